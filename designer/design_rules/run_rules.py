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
from designer.design_rules.subject import RuleSubject

Look = Callable[[RuleSubject], Iterable[Finding]]

LOOKS: dict[str, Look] = {
    "feedback": lambda s: on_nets.feedback(s.circuit),
    "drivers": lambda s: on_nets.drivers(s.components, s.circuit.generator.net),
    "floating-input": lambda s: on_nets.floating_inputs(s.components, s.circuit.generator.net),
    "single-pin": lambda s: on_nets.single_pins(s.components),
    "references": lambda s: on_nets.duplicates(s.components),
    "supply-pins": lambda s: on_nets.supply_pins(s.components, s.opamp.supply_pins),
    "decoupling": lambda s: on_nets.decoupling(s.components),
    "swing": lambda s: on_ratings.swing(s.circuit, s.opamp, s.operating),
    "load": lambda s: on_ratings.load(s.circuit),
    "output-current": lambda s: on_ratings.output_current(s.circuit, s.opamp, s.operating),
    "fault-current": lambda s: on_ratings.fault_current(s.circuit, s.opamp),
    "power": lambda s: on_ratings.power(s.watts, s.operating),
    "power-stuck": lambda s: on_ratings.power(s.watts, s.stuck),
    "capacitor-voltage": lambda s: on_ratings.capacitor_voltage(
        s.circuit, s.volts, s.operating, s.stuck
    ),
    "common-mode": lambda s: on_ratings.common_mode(s.circuit, s.opamp, s.operating),
    "slew": lambda s: on_ratings.slew(s.circuit, s.opamp, s.operating),
    "gain-bandwidth": lambda s: on_ratings.gain_bandwidth(s.circuit, s.opamp, s.fastest),
    "offset-force": lambda s: on_precision.offset(s.opamp, s.circuit, s.forces, s.drive),
    "bias-force": lambda s: on_precision.bias(s.opamp, s.circuit, s.forces, s.drive),
    "noise-force": lambda s: on_precision.noise(s.opamp, s.circuit, s.forces, s.drive, s.fastest),
    "leakage-force": lambda s: on_precision.leakage(s.circuit, s.catalog, s.forces, s.drive),
    "absorption-force": lambda s: on_precision.absorption(
        s.circuit, s.dielectrics, s.forces, s.drive
    ),
    "dead-zone-stiffness": lambda s: on_precision.stiffness(
        s.circuit, s.design.model.mu, s.resistor_grades
    ),
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
