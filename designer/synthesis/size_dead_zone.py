"""Sizing a dead-zone stage: the stages of the search, matched parts, and the proof.

The search begins with few values for the resistors that only set a level and with the threshold as
high as the swing allows, and ends with the whole catalogue; it stops where the error is nothing or
is the least of the whole catalogue. Every answer is computed anew from its values.
"""

from __future__ import annotations

from collections.abc import Mapping

from designer.base.arrays import Array
from designer.circuit.coefficients import EXACT
from designer.circuit.dead_zone_parts import DeadZoneStage
from designer.linear_network.linear_terms import ANY
from designer.model.circuit_table import CircuitSpec
from designer.synthesis import rectifier_stage, saturating_search
from designer.synthesis.dead_zone_target import DeadZone, DeadZoneTarget, parts_of
from designer.synthesis.equal_parts import equal_parts
from designer.synthesis.value_program import Ranking


def size(
    target: DeadZoneTarget,
    resistors: Array,
    base: float,
    used: frozenset[float],
    spec: CircuitSpec = ANY,
    fixed: Mapping[str, float] | None = None,
    price: Mapping[float, float] | None = None,
) -> DeadZone | str:
    """The stage for this target, or the name of the condition that leaves none.

    resistors : values that may be used [ohm], ascending. base : the first value tried for resistors
    that only set a level. used : values that the rest of the circuit has; they cost nothing in the
    second stage. spec : its matched, preferred, most_values and slack count. fixed : values of
    parts outside the stage that matched groups may name. price : price class by value.
    """
    preferred = frozenset(spec.preferred)
    most = None
    if spec.most_values is not None:
        most = spec.most_values - len(used - preferred)
        if most < 0:
            return "distinct values"
    ranking = Ranking(used | preferred, price or {}, EXACT, spec.slack, most)
    rectifier = DeadZoneStage(target.kind).rectifies
    groups = (*(rectifier_stage.EQUAL if rectifier else ()), *spec.matched)
    equal = equal_parts(parts_of(target.kind, target.sides), groups, fixed or {})
    if equal is None:
        return "matched parts"
    if rectifier:
        return rectifier_stage.size(target, resistors, ranking, equal)
    return saturating_search.size(target, resistors, base, ranking, equal)
