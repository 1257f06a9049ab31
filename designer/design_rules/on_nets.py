"""Rules on parts and nets alone: what no value and no signal enters."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np

from designer.board.component import Component
from designer.board.pins import Pin
from designer.catalog.design_rule import Finding
from designer.circuit.netlist import GROUND, NEGATIVE, POSITIVE, Circuit, Section
from designer.dynamics.piecewise_linear import ModeKey

CLOSED = 1e3
"""Conductance [S] of a capacitor at signal frequencies and of a diode that conducts."""
OPEN = 1e-15
"""Conductance [S] from every net to ground, so that none is without an answer."""


def feedback(circuit: Circuit) -> Iterator[Finding]:
    """What comes back of each section's output, its neighbours' outputs held: at rest and in each
    contact, for a diode may open the loop."""
    keys = dict.fromkeys([circuit.rest])
    for stop in circuit.stops:
        keys |= dict.fromkeys(circuit.carrying(contact) for _, contact in stop.contacts)
    for key in keys:
        for section in circuit.sections:
            yield Finding(_returned(circuit, section, key), section.name)


def _returned(circuit: Circuit, section: Section, key: ModeKey) -> float:
    """v(-) - v(+) for 1 V at the output and every other source at rest."""
    held = {GROUND: 0.0, circuit.generator.net: 0.0, POSITIVE: 0.0, NEGATIVE: 0.0}
    held |= {s.output: 0.0 for s in circuit.sections}
    held[section.output] = 1.0
    free = [net for net in circuit.nets if net not in held]
    place = {net: i for i, net in enumerate(free)}
    G, right = OPEN * np.eye(len(free)), np.zeros(len(free))

    def join(a: str, b: str, siemens: float) -> None:
        for here, there in ((a, b), (b, a)):
            if here not in place:
                continue
            G[place[here], place[here]] += siemens
            if there in place:
                G[place[here], place[there]] -= siemens
            else:
                right[place[here]] += siemens * held[there]

    for r in circuit.resistors:
        join(r.a, r.b, 1.0 / r.value)
    for c in circuit.capacitors:
        join(c.plus, c.minus, CLOSED)
    for reference in circuit.references:
        join(reference.cathode, reference.anode, CLOSED)
    positions = key[len(circuit.sections) :]
    for diode, position in zip(circuit.diodes, positions, strict=True):
        if position:
            join(diode.anode, diode.cathode, CLOSED)
    volts = np.linalg.solve(G, right) if free else right

    def at(net: str) -> float:
        return float(volts[place[net]]) if net in place else held[net]

    return at(section.inverting) - at(section.noninverting)


def drivers(found: Sequence[Component], generator: str) -> Iterator[Finding]:
    """Sources on each net: op-amp outputs, the rails, ground, the generator."""
    on: dict[str, list[str]] = {POSITIVE: ["the supply"], NEGATIVE: ["the supply"]}
    on |= {GROUND: ["ground"], generator: ["the generator"]}
    for component, pin in _pins(found):
        if pin.electrical == "output" and pin.net:
            on.setdefault(pin.net, []).append(f"{component.reference}{pin.unit}")
    for net, names in on.items():
        yield Finding(len(names), net, more=", ".join(names) if len(names) > 1 else "")


def floating_inputs(found: Sequence[Component], generator: str) -> Iterator[Finding]:
    """Inputs that no resistor, reference or trimmer joins to a driven net."""
    reached = {GROUND, POSITIVE, NEGATIVE, generator}
    reached |= {pin.net for _, pin in _pins(found) if pin.electrical == "output"}
    ways = [
        {pin.net for pin in c.pins if pin.net}
        for c in found
        if c.kind in ("resistor", "reference", "trimmer")
    ]
    grown = True
    while grown:
        grown = False
        for nets in ways:
            if nets & reached and not nets <= reached:
                reached |= nets
                grown = True
    lost = [
        f"{component.reference}{pin.unit} ({pin.name})"
        for component, pin in _pins(found)
        if pin.electrical == "input" and pin.net not in reached
    ]
    yield Finding(len(lost), ", ".join(lost))


def single_pins(found: Sequence[Component]) -> Iterator[Finding]:
    """Nets that one pin alone is on."""
    on: dict[str, list[str]] = {}
    for component, pin in _pins(found):
        if pin.net:
            on.setdefault(pin.net, []).append(f"{component.reference}.{pin.number}")
    lost = [f"{net} ({names[0]})" for net, names in on.items() if len(names) == 1]
    yield Finding(len(lost), ", ".join(lost))


def duplicates(found: Sequence[Component]) -> Iterator[Finding]:
    """Designators that stand twice."""
    counted = Counter(c.reference for c in found)
    twice = sorted(name for name, count in counted.items() if count > 1)
    yield Finding(len(twice), ", ".join(twice))


def supply_pins(found: Sequence[Component], pair: tuple[str, str]) -> Iterator[Finding]:
    """Supply pins of op-amps. pair : numbers of the positive and the negative pin."""
    wrong = []
    for component in found:
        if component.kind != "op-amp":
            continue
        nets = component.nets
        for number, rail in zip(pair, (POSITIVE, NEGATIVE), strict=True):
            if nets.get(number) != rail:
                on = nets.get(number) or "nothing"
                wrong.append(f"{component.reference}.{number} is on {on}, not on {rail}")
    yield Finding(len(wrong), "; ".join(wrong))


def decoupling(found: Sequence[Component]) -> Iterator[Finding]:
    """Farads from each rail to ground at each op-amp package."""
    for package in found:
        if package.kind != "op-amp":
            continue
        for rail in (POSITIVE, NEGATIVE):
            total = sum(
                c.quantity or 0.0
                for c in found
                if c.kind == "capacitor"
                and c.near == package.reference
                and set(c.nets.values()) == {rail, GROUND}
            )
            yield Finding(total, f"{package.reference}, {rail}")


def _pins(found: Sequence[Component]) -> Iterator[tuple[Component, Pin]]:
    for component in found:
        for pin in component.pins:
            yield component, pin
