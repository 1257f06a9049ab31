"""A circuit on paper: the drawing of a design folder, the sheet of KiCad, the project around it.

Both are drawn from the same cells, mass by mass, with the signal from left to right.
"""
