"""Every rule on a circuit, each with the function that looks at it, and all of them at once.

Rules on a board stand in ``designer.rule_board``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from designer import rule_nets, rule_precision, rule_ratings
from designer.rule import Found, NotRun, Outcome, Override, Rule, judged, not_run
from designer.rule_list import BY_ID, RULES
from designer.rule_subject import Subject

Look = Callable[[Subject], Iterable[Found]]

LOOKS: dict[str, Look] = {
    "feedback": lambda s: rule_nets.feedback(s.circuit),
    "drivers": lambda s: rule_nets.drivers(s.components, s.circuit.generator.net),
    "floating-input": lambda s: rule_nets.floating_inputs(s.components, s.circuit.generator.net),
    "single-pin": lambda s: rule_nets.single_pins(s.components),
    "references": lambda s: rule_nets.duplicates(s.components),
    "supply-pins": lambda s: rule_nets.supply_pins(s.components, s.opamp.supply_pins),
    "decoupling": lambda s: rule_nets.decoupling(s.components),
    "swing": lambda s: rule_ratings.swing(s.circuit, s.opamp, s.operating),
    "load": lambda s: rule_ratings.load(s.circuit),
    "output-current": lambda s: rule_ratings.output_current(s.circuit, s.opamp, s.operating),
    "fault-current": lambda s: rule_ratings.fault_current(s.circuit, s.opamp),
    "power": lambda s: rule_ratings.power(s.watts, s.operating),
    "power-stuck": lambda s: rule_ratings.power(s.watts, s.stuck),
    "capacitor-voltage": lambda s: rule_ratings.capacitor_voltage(
        s.circuit, s.volts, s.operating, s.stuck
    ),
    "common-mode": lambda s: rule_ratings.common_mode(s.circuit, s.opamp, s.operating),
    "slew": lambda s: rule_ratings.slew(s.circuit, s.opamp, s.operating),
    "gain-bandwidth": lambda s: rule_ratings.gain_bandwidth(s.circuit, s.opamp, s.fastest),
    "offset-force": lambda s: rule_precision.offset(s.opamp, s.circuit, s.forces, s.drive),
    "bias-force": lambda s: rule_precision.bias(s.opamp, s.circuit, s.forces, s.drive),
    "noise-force": lambda s: rule_precision.noise(s.opamp, s.circuit, s.forces, s.drive, s.fastest),
    "leakage-force": lambda s: rule_precision.leakage(s.circuit, s.catalog, s.forces, s.drive),
    "absorption-force": lambda s: rule_precision.absorption(
        s.circuit, s.dielectrics, s.forces, s.drive
    ),
    "dead-zone-stiffness": lambda s: rule_precision.stiffness(
        s.circuit, s.design.model.mu, s.made.modelfile.circuit.resistor_grade
    ),
}
"""By id: yields what was found, one value for each place that the rule looks at."""


def on_circuit(subject: Subject, overrides: Mapping[str, Override]) -> tuple[Outcome, ...]:
    """Every rule on the circuit, in the order of the list."""
    wanted = [rule for rule in RULES if rule.scope == "circuit"]
    return tuple(look(rule.id, subject, overrides.get(rule.id)) for rule in wanted)


def look(id_: str, subject: Subject, override: Override | None = None) -> Outcome:
    """One rule on the circuit; what cannot be looked at is not run, and says why."""
    rule = BY_ID[id_]
    return outcome(rule, lambda: LOOKS[id_](subject), override)


def outcome(rule: Rule, find: Callable[[], Iterable[Found]], override: Override | None) -> Outcome:
    """What a rule says of what ``find`` finds."""
    try:
        return judged(rule, list(find()), override)
    except NotRun as reason:
        return not_run(rule, str(reason), override)
    except ArithmeticError as error:
        return not_run(rule, f"no answer: {error}", override)
