"""Sizing a dead-zone stage: the stages of the search, matched parts, and the proof.

The search begins with few values for the resistors that only set a level and with the threshold as
high as the swing allows, and ends with the whole catalogue; it stops where the error is nothing or
is the least of the whole catalogue. Every answer is computed anew from its values.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace

from designer.base.arrays import Array
from designer.circuit.coefficients import EXACT
from designer.synthesis import rectifier_stage, saturating_search
from designer.synthesis.dead_zone_target import DeadZone, DeadZoneTarget, parts_of
from designer.synthesis.equal_parts import ties_of
from designer.synthesis.preferences import NO_WISHES, Wishes
from designer.synthesis.value_program import Ranking


def size(
    target: DeadZoneTarget,
    resistors: Array,
    base: float,
    used: frozenset[float],
    wishes: Wishes = NO_WISHES,
    fixed: Mapping[str, float] | None = None,
    price: Mapping[float, float] | None = None,
) -> DeadZone | str:
    """The stage for this target, or the name of the condition that leaves none.

    resistors : values that may be used [ohm], ascending. base : the first value tried for resistors
    that only set a level. used : values that the rest of the circuit has; they cost nothing in the
    second stage. fixed : values of parts outside the stage that matched groups may name. price :
    price class by value.
    """
    began = time.perf_counter()
    free = used | wishes.preferred
    most = None
    if wishes.most_values is not None:
        most = wishes.most_values - len(used - wishes.preferred)
        if most < 0:
            return "distinct values"
    ranking = Ranking(free, price or {}, EXACT, wishes.slack, most)
    inherent = rectifier_stage.EQUAL if target.kind == "rectifier" else ()
    groups = (*inherent, *wishes.matched)
    ties = ties_of(parts_of(target.kind, target.sides), groups, fixed or {})
    if ties is None:
        return "matched parts"
    if target.kind == "rectifier":
        found = rectifier_stage.size(target, resistors, ranking, ties.tie, ties.value)
    else:
        found = saturating_search.size(target, resistors, base, ranking, ties)
    if isinstance(found, str):
        return found
    return replace(found, seconds=time.perf_counter() - began)
