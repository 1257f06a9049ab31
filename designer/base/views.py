"""Where a part of a circuit stands: what is simulated, what is on the board, what is bought."""

from __future__ import annotations

import enum


class View(enum.Flag):
    """SIMULATION : in the netlists and the reduction. BOARD : a footprint. BOM : to be bought."""

    SIMULATION = enum.auto()
    BOARD = enum.auto()
    BOM = enum.auto()
    EVERYWHERE = SIMULATION | BOARD | BOM
    FITTED = BOARD | BOM
    """What a board needs and no simulation knows of."""
