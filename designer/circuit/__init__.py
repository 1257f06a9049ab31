"""Parts, pins and nets; the matching conditions as a rule; the way back to a system.

``Circuit`` is the one list of parts that everything else is written from. ``Reduction`` makes a
piecewise-linear system of it by nodal analysis, so that circuit and model can be compared.
"""
