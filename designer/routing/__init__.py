"""Tracks, vias and ground pours of a board that is placed: from a board file to another.

Negotiated congestion on a grid (L. McMurchie, C. Ebeling, PathFinder, FPGA 1995). Needs no KiCad.
"""
