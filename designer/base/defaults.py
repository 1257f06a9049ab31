"""What an option is where nothing is said, for functions and command line alike."""

from __future__ import annotations

import os

from designer.base.errors import InputError

SEED = 1
"""Of the random numbers."""
SAMPLES = 200
"""Boards of a tolerance study."""
SEARCH_SAMPLES = 4000
"""Fresh boards of the study at the end of a search."""
TRADE_BOARDS = 400
"""Boards of each response in a trade: with fewer no yield can be shown to within 1 %."""
DRAWN_STARTS = 200
"""Initial states that ``simulate`` draws, for the shares of the attractors."""

CURVE_DEPTH = 1
"""How many times in a row other bifurcation curves are begun where curves meet."""


def cores() -> int:
    """How many cores this process may use: the default of ``jobs``."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def at_least(name: str, value: int, least: int) -> None:
    """InputError unless an option is large enough."""
    if value < least:
        raise InputError(None, name, value, f"a whole number >= {least}")
