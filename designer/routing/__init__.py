"""Tracks, vias and ground pours of a board that is placed: from a board file to another.

Negotiated congestion on a grid (L. McMurchie, C. Ebeling, PathFinder, FPGA 1995). Needs no KiCad.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
