"""From a circuit to something that can be built: components, bill, drawing, KiCad project.

Everything is written from the circuit's parts and the fittings that a board adds to them.
"""
