"""The best linear block of a catalogue: levels of error, from below, until one can be reached."""

from __future__ import annotations

import time
from dataclasses import dataclass

from designer.completion import Bounds
from designer.linear_block import FIRST_LEVEL, GROWTH, LAST_LEVEL, Targets, ratio_table
from designer.selection import Selection, Shortfall, select
from designer.system import Array
from designer.wishes import NO_WISHES, Wishes

MOST_CUT = 4
"""Levels whose tables had to be cut, one after the other, before the search gives up."""
PROOF_TOLERANCE = 1e-6
"""An error this close to its lower bound counts as proved."""


@dataclass(frozen=True)
class Cost:
    """seconds : wall time. rows : of all joined tables."""

    seconds: float
    rows: int


@dataclass(frozen=True)
class LinearBlock:
    """The parts chosen, and what is known of them.

    values : by part name [ohm, F]. error : the least that the largest of the ten errors can be
    made by the scales. bound : no choice under the conditions has a smaller error. proved : error
    is within ``PROOF_TOLERANCE`` of bound. proof : how that is known, in words. solver : the
    solver's word for the last program.
    """

    values: dict[str, float]
    error: float
    bound: float
    proved: bool
    proof: str
    solver: str
    cost: Cost


def best(
    targets: Targets,
    resistors: Array,
    capacitors: Array,
    prices: Array,
    bounds: Bounds,
    wishes: Wishes = NO_WISHES,
) -> LinearBlock | Shortfall:
    """The choice of least error, among those the fewest distinct values and the lowest price.

    resistors, capacitors : what can be bought [ohm], [F]. prices : price class of each capacitor;
    resistors of a grade cost the same. A ``Shortfall`` names what leaves no choice.
    """
    began, rows = time.perf_counter(), 0
    free = least_error(targets, resistors, capacitors)
    signal = resistors[(resistors >= bounds.signal[0]) & (resistors <= bounds.signal[1])]
    if len(signal) and bounds.stop > signal[-1]:
        return Shortfall("stop stiffness", True)
    binding = "signal resistors"
    level, lowest, cut = FIRST_LEVEL, 0.0, 0
    while cut < MOST_CUT and level < LAST_LEVEL and len(signal):
        searched = True
        table = ratio_table(signal, capacitors, targets, level, bounds.p_range)
        rows += len(table)
        if len(table):
            answer = select(table, signal, capacitors, prices, targets, bounds, level)
            if isinstance(answer, Selection):
                whole = answer.complete or answer.error <= free + PROOF_TOLERANCE
                return LinearBlock(
                    answer.values,
                    answer.error,
                    answer.error if whole else max(free, lowest),
                    whole,
                    "empty join of the scale-free combinations of the coefficient errors below "
                    "the bound",
                    answer.solver,
                    Cost(time.perf_counter() - began, rows),
                )
            binding, searched = answer.what, answer.whole
        elif binding == "signal resistors":
            binding = "coefficients"
        if table.complete and searched:
            lowest = level
        cut += not (table.complete and searched)
        level = _next(level)
    return Shortfall(binding, cut == 0)


def least_error(targets: Targets, resistors: Array, capacitors: Array) -> float:
    """Lower bound of the eight-term error over the whole catalogue, no side condition."""
    level, previous = FIRST_LEVEL, 0.0
    while level < LAST_LEVEL:
        table = ratio_table(resistors, capacitors, targets, level)
        if len(table):
            return float(table.error[0]) if table.complete else previous
        previous, level = level, _next(level)
    return LAST_LEVEL


def _next(level: float) -> float:
    return level * (1e3 if level < 1e-6 else GROWTH)
