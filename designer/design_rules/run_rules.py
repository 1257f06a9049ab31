"""Every rule on a circuit, each with the function that looks at it, and all of them at once.

Rules on a board stand in ``design_rules.on_board``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from designer.catalog.design_rule import (
    DesignRule,
    Finding,
    NotRun,
    Override,
    RuleOutcome,
    judged,
    not_run,
)
from designer.catalog.design_rules import BY_ID, RULES
from designer.design_rules import on_nets, on_precision, on_ratings
from designer.design_rules.rule_subject import RuleSubject

Look = Callable[[RuleSubject], Iterable[Finding]]

LOOKS: dict[str, Look] = {
    "feedback": on_nets.feedback,
    "drivers": on_nets.drivers,
    "floating-input": on_nets.floating_inputs,
    "single-pin": on_nets.single_pins,
    "references": on_nets.duplicates,
    "supply-pins": on_nets.supply_pins,
    "decoupling": on_nets.decoupling,
    "swing": on_ratings.swing,
    "load": on_ratings.load,
    "output-current": on_ratings.output_current,
    "fault-current": on_ratings.fault_current,
    "power": on_ratings.power,
    "power-stuck": on_ratings.power_stuck,
    "capacitor-voltage": on_ratings.capacitor_voltage,
    "common-mode": on_ratings.common_mode,
    "bulk": on_ratings.bulk,
    "reference-current": on_ratings.reference_current,
    "temperature": on_ratings.temperature,
    "slew": on_ratings.slew,
    "gain-bandwidth": on_ratings.gain_bandwidth,
    "offset-force": on_precision.offset,
    "bias-force": on_precision.bias,
    "noise-force": on_precision.noise,
    "leakage-force": on_precision.leakage,
    "absorption-force": on_precision.absorption,
    "dead-zone-stiffness": on_precision.stiffness,
    "far-slope": on_precision.far_slope,
}
"""By id: yields what was found, one value for each place that the rule looks at."""


def on_circuit(subject: RuleSubject, overrides: Mapping[str, Override]) -> tuple[RuleOutcome, ...]:
    """Every rule on the circuit, in the order of the list."""
    wanted = [rule for rule in RULES if rule.scope == "circuit"]
    return tuple(look(rule.id, subject, overrides.get(rule.id)) for rule in wanted)


def look(id_: str, subject: RuleSubject, override: Override | None = None) -> RuleOutcome:
    """One rule on the circuit; what cannot be looked at is not run, and says why."""
    rule = BY_ID[id_]
    return outcome(rule, lambda: LOOKS[id_](subject), override)


def outcome(
    rule: DesignRule, find: Callable[[], Iterable[Finding]], override: Override | None
) -> RuleOutcome:
    """What a rule says of what ``find`` finds."""
    try:
        return judged(rule, list(find()), override)
    except NotRun as reason:
        return not_run(rule, str(reason), override)
    except ArithmeticError as error:
        return not_run(rule, f"no answer: {error}", override)
