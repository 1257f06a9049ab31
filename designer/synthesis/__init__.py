"""From a model to the best parts that can be bought, with a proof of how good they are.

The dead zones by tables beside a linear network (``designer.linear_network``), side conditions
(swing, load, bandwidth) on the finished circuit.
"""
