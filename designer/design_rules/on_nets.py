"""Rules on parts and nets alone: what no value and no signal enters."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping

from designer.board.component import Component
from designer.board.pins import Pin
from designer.catalog.design_rule import Finding
from designer.circuit.feedback_loops import feedback_share
from designer.circuit.netlist import GROUND, NEGATIVE, POSITIVE
from designer.design_rules.rule_subject import Look, RuleSubject


def feedback(s: RuleSubject) -> Iterator[Finding]:
    """What comes back of each section's output, its neighbours' outputs held: at rest and in each
    contact, for a diode may open the loop."""
    circuit = s.circuit
    keys = dict.fromkeys([circuit.rest, circuit.open])
    for stop in circuit.dead_zones:
        keys |= dict.fromkeys(circuit.carrying(contact) for _, contact in stop.contacts)
    for key in keys:
        for section in circuit.sections:
            yield Finding(feedback_share(circuit, section, key), section.name)


def drivers(s: RuleSubject) -> Iterator[Finding]:
    """Sources on each net: op-amp outputs, the rails, ground, the generator."""
    on: dict[str, list[str]] = {POSITIVE: ["the supply"], NEGATIVE: ["the supply"]}
    on |= {GROUND: ["ground"], **{net: ["the generator"] for net in s.circuit.generator_nets}}
    for component, pin in _pins(s):
        if pin.electrical == "output" and pin.net:
            on.setdefault(pin.net, []).append(f"{component.reference}{pin.unit}")
    for net, names in on.items():
        yield Finding(len(names), net, more=", ".join(names) if len(names) > 1 else "")


def floating_inputs(s: RuleSubject) -> Iterator[Finding]:
    """Inputs that no resistor, reference or trimmer joins to a driven net."""
    driven = {GROUND, POSITIVE, NEGATIVE, *s.circuit.generator_nets}
    driven |= {pin.net for _, pin in _pins(s) if pin.electrical == "output"}
    conducting = [
        {pin.net for pin in c.pins if pin.net}
        for c in s.components
        if c.kind in ("resistor", "reference", "trimmer")
    ]
    while any(nets & driven and not nets <= driven for nets in conducting):
        driven |= {net for nets in conducting if nets & driven for net in nets}
    lost = [
        f"{component.reference}{pin.unit} ({pin.name})"
        for component, pin in _pins(s)
        if pin.electrical == "input" and pin.net not in driven
    ]
    yield Finding(len(lost), ", ".join(lost))


def single_pins(s: RuleSubject) -> Iterator[Finding]:
    """Nets that one pin alone is on."""
    on: dict[str, list[str]] = {}
    for component, pin in _pins(s):
        if pin.net:
            on.setdefault(pin.net, []).append(f"{component.reference}.{pin.number}")
    lost = [f"{net} ({names[0]})" for net, names in on.items() if len(names) == 1]
    yield Finding(len(lost), ", ".join(lost))


def duplicates(s: RuleSubject) -> Iterator[Finding]:
    """Designators that stand twice."""
    counted = Counter(c.reference for c in s.components)
    twice = sorted(name for name, count in counted.items() if count > 1)
    yield Finding(len(twice), ", ".join(twice))


def supply_pins(s: RuleSubject) -> Iterator[Finding]:
    """Supply pins of op-amps that are not on their rail."""
    wrong = []
    for component in s.components:
        if component.kind != "op-amp":
            continue
        nets = component.nets
        for number, rail in zip(s.opamp.supply_pins, (POSITIVE, NEGATIVE), strict=True):
            if nets.get(number) != rail:
                on = nets.get(number) or "nothing"
                wrong.append(f"{component.reference}.{number} is on {on}, not on {rail}")
    yield Finding(len(wrong), "; ".join(wrong))


def decoupling(s: RuleSubject) -> Iterator[Finding]:
    """Farads from each rail to ground at each op-amp package."""
    for package in s.components:
        if package.kind != "op-amp":
            continue
        for rail in (POSITIVE, NEGATIVE):
            total = sum(
                c.quantity or 0.0
                for c in s.components
                if c.kind == "capacitor"
                and c.near == package.reference
                and set(c.nets.values()) == {rail, GROUND}
            )
            yield Finding(total, f"{package.reference}, {rail}")


def _pins(s: RuleSubject) -> Iterator[tuple[Component, Pin]]:
    for component in s.components:
        for pin in component.pins:
            yield component, pin


LOOKS: Mapping[str, Look] = {
    "feedback": feedback,
    "drivers": drivers,
    "floating-input": floating_inputs,
    "single-pin": single_pins,
    "references": duplicates,
    "supply-pins": supply_pins,
    "decoupling": decoupling,
}
"""The rules of this file by id: each yields what was found, one value for each place that it
looks at."""
