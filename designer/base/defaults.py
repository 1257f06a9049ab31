"""What an option may be, and is where nothing is said, for functions and command line alike."""

from __future__ import annotations

import math
import os
from typing import Literal, get_args

from designer.base.errors import InputError

StudyEngine = Literal["exact", "bandwidth", "auto", "ngspice"]
"""Which engine decides; "auto": the exact circuit, and ngspice is asked about a sample;
"bandwidth": the same with op-amps that lag, in both."""
STUDY_ENGINES: tuple[StudyEngine, ...] = ("exact", "bandwidth", "auto", "ngspice")
Fidelity = Literal["ideal", "dynamic", "full"]
"""How much of an op-amp ngspice is told (``spice.opamp_model``)."""
Dialect = Literal["ltspice", "portable"]
DIALECTS: tuple[Dialect, ...] = get_args(Dialect)
"""What a deck for another simulator is written in (``spice.simulator_decks``)."""
Over = Literal["omega", "b", "grade", "omega-grade", "temperature"]
OVERS: tuple[Over, ...] = ("omega", "b", "grade", "omega-grade", "temperature")
"""What a yield map is made over."""
SEED = 1
"""Of the random numbers."""
MOST_SEED = 2**63 - 1
"""Larger ones would be written into files that no reader of JSON takes."""
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
COLLECTION = 50_000, 20, 20
"""Thresholds of ``gc``. A page and a board are some 100,000 objects without circles: at Python's
own thresholds the collector goes through all libraries' objects again and again, a fifth of a
study's CPU time."""


def cores() -> int:
    """How many cores this process may use: the default of ``jobs``."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def check_count(name: str, value: int | None, least: int, most: float = math.inf) -> None:
    """InputError for an option that is stated, and is too small or too large."""
    if value is not None and value < least:
        raise InputError(None, name, value, f"a whole number >= {least}")
    if value is not None and value > most:
        raise InputError(None, name, value, f"at most {most}")


def check_seed(seed: int) -> None:
    """InputError unless an option is a seed."""
    check_count("--seed", seed, 0, MOST_SEED)
