"""Numbers of boards, and the seed, where nothing is said: for functions and command line alike."""

from __future__ import annotations

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
