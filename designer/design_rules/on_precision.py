"""Rules on what shifts the clearance: errors as a constant force at it, over the drive."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from designer.base.arrays import Array
from designer.catalog.design_rule import Finding, value_text
from designer.catalog.design_rules import BY_ID
from designer.circuit.netlist import Diode
from designer.circuit.static_shifts import (
    Shifts,
    far_slope as far_slope_of,
    largest_offset,
    leftovers,
    offset_forces,
    thermal,
)
from designer.design_rules.rule_subject import Look, RuleSubject

INSULATION = 1e9
"""Ohm between a node and a rail across the board."""
SLOWEST = 0.1
"""Hz from which 1/f noise counts: slower changes are offsets."""
ABSORPTION = {"polypropylene": 0.001, "C0G": 0.006, "X7R": 0.025}
"""Share of the charge that a dielectric gives back, by a word of its description; WIMA,
characteristics of dielectrics, the larger where a range is given."""
UNKNOWN = 0.025
"""The same of a dielectric that is in no table."""
RETURNS = 1.0
"""Time [s] that it is given back within, at the fastest that counts."""
STEP = 1e-5
"""Relative change of a resistor for a sensitivity."""


def offset(s: RuleSubject) -> Iterator[Finding]:
    """All sections' largest offsets, independent of each other."""
    limit = largest_offset(s.opamp)
    for at in s.forces:
        share = offset_forces(at, limit)
        total = float(np.hypot.reduce(list(share.values())))
        more = f"{1e3 * limit:.3g} mV at each of {len(share)} sections{s.warm}"
        yield Finding(
            total, _most(share), more=_with_clearance(s, at, more), do=_quieter(s, total / limit)
        )


def _quieter(s: RuleSubject, per_volt: float) -> str:
    """What helps against offsets, with the op-amps on which the same parts keep the rule. Whether
    their bias currents, limits and bandwidths suit, the other rules say once one is taken.

    per_volt : the force that offsets make, over the largest of them.
    """
    rule, own = BY_ID["offset-force"], s.synthesis.modelfile.rules.get("offset-force")
    limit = rule.limit if own is None else own.limit
    assert limit is not None
    forces = {
        each.name: per_volt * largest_offset(each.over(s.catalog.temperatures))
        for each in s.catalog.opamps_at(s.circuit.supply)
        if each.sections == s.opamp.sections
    }
    keep = [f"{name} ({force:.2g})" for name, force in forces.items() if rule.keeps(force, limit)]
    if not keep:
        return f"no op-amp of the catalogue has so little offset; {rule.do}"
    names = " or ".join(keep)
    return f"take circuit.opamp {names} (no other rule is judged with it); or {rule.do}"


def bias(s: RuleSubject) -> Iterator[Finding]:
    """All inputs' largest bias currents, added up."""
    figure = s.opamp.bias
    limit = figure.max if figure.max is not None else figure.nominal
    for at in s.forces:
        share = {
            section.name: abs(at.current.get(section.inverting, 0.0))
            for section in s.circuit.sections
        }
        total = sum(share.values()) * limit
        yield Finding(
            total,
            _most(share),
            more=_with_clearance(s, at, f"{value_text(limit, 'A')} at each input{s.warm}"),
        )


def noise(s: RuleSubject) -> Iterator[Finding]:
    """RMS of op-amps and resistors from ``SLOWEST`` to the highest frequency that matters."""
    corner = s.opamp.noise_corner.nominal if s.opamp.noise_corner is not None else 0.0
    white = s.fastest - SLOWEST
    flicker = corner * float(np.log(s.fastest / SLOWEST))
    density, resistors = s.opamp.noise.nominal, s.circuit.resistors
    for at in s.forces:
        amplifiers = sum((at.offset[a.name] * density) ** 2 for a in s.circuit.sections)
        warm = sum((at.between(r.a, r.b) * thermal(r.value)) ** 2 for r in resistors)
        total = float(np.sqrt(amplifiers * (white + flicker) + warm * white))
        yield Finding(
            total, more=_with_clearance(s, at, f"{SLOWEST:g} Hz to {value_text(s.fastest, 'Hz')}")
        )


def leakage(s: RuleSubject) -> Iterator[Finding]:
    """A rail through the board into one summing node; with it whatever leaks through diodes.

    Opposed diodes at one node leak less than that: neither sees a voltage there.
    """
    circuit = s.circuit
    positions = circuit.open[len(circuit.sections) :]
    blocking = [d for d, on in zip(circuit.diodes, positions, strict=True) if not on]
    opposed = {frozenset(d.nets) for d in circuit.fittings if isinstance(d, Diode)}
    for at in s.forces:
        through = 0.0
        for diode in blocking:
            entry = s.catalog.diode(diode.model.name)
            through += abs(at.between(diode.cathode, diode.anode)) * entry.reverse_current.nominal
        for section in circuit.sections:
            node = section.inverting
            over_board = abs(at.current.get(node, 0.0)) * circuit.supply / INSULATION
            more = f"{circuit.supply:g} V over {INSULATION / 1e9:g} GΩ"
            if through:
                more += ", and through the diodes"
            if any(node in pair for pair in opposed):
                more += "; the protection's diodes see no voltage"
            place = f"{section.name}, node {node}"
            yield Finding((over_board + through), place, more=_with_clearance(s, at, more))


def absorption(s: RuleSubject) -> Iterator[Finding]:
    """Charge that an integrator's capacitor gives back after its output stood at its limit."""
    circuit = s.circuit
    for capacitor in circuit.capacitors:
        words = s.dielectrics.get(capacitor.name, "")
        shares = [share for word, share in ABSORPTION.items() if word.lower() in words.lower()]
        share = shares[0] if shares else UNKNOWN
        current = share * capacitor.value * circuit.saturation / RETURNS
        more = f"{100 * share:g} % of {circuit.saturation:g} V, {words or 'dielectric not known'}"
        for at in s.forces:
            force = abs(at.between(capacitor.plus, capacitor.minus)) * current
            yield Finding(force, capacitor.name, more=_with_clearance(s, at, more))


def stiffness(s: RuleSubject) -> Iterator[Finding]:
    """What each dead zone leaves, in units of its mass's stiffness: |nominal| and a standard
    deviation.

    The resistors are spread evenly within the grades at which they are bought.
    """
    circuit, grades = s.circuit, s.resistor_grades
    if not circuit.dead_zones:
        return
    units = _relative_stiffness(s)
    nominal = units * leftovers(circuit)
    change = {
        r.name: (units * leftovers(circuit, {r.name: r.value * (1.0 + STEP)}) - nominal) / STEP
        for r in circuit.resistors
    }
    most = max(grades[name] for name in change)
    bought = " and ".join(f"{100 * g:g}" for g in sorted({grades[name] for name in change}))
    for k, stop in enumerate(circuit.dead_zones):
        shares = {name: float(c[k]) * (grades[name] / most) for name, c in change.items()}
        deviation = float(np.sqrt(sum(c**2 for c in shares.values()))) * most / np.sqrt(3.0)
        left = abs(float(nominal[k]))
        more = f"nominal {left:.2g}, deviation {deviation:.2g} at {bought} % resistors"
        if len(circuit.dead_zones) > 1:
            more = f"{'bend' if stop.bend_of else 'clearance'} {stop.clearance}: {more}"
        yield Finding(float(left + deviation), _most(shares), more=more)


def far_slope(s: RuleSubject) -> Iterator[Finding]:
    """Of each law that falls, what the parts leave of its last slopes: a standard deviation over
    the nominal one. Where large slopes cancel, parts of 1 % leave little of it.

    The parts are spread as for ``stiffness``.
    """
    circuit, grades = s.circuit, s.resistor_grades
    zones = s.design.model.second_order().dead_zones
    for chain in dict.fromkeys(zone.bend_of for zone in zones if zone.bend_of and zone.falls):
        own = circuit.chains[chain]
        for side in dict.fromkeys(side for zone in own for side, _ in zone.contacts):
            nominal = far_slope_of(circuit, chain, side)
            shares = {
                r.name: (
                    far_slope_of(circuit, chain, side, {r.name: r.value * (1.0 + STEP)}) - nominal
                )
                / STEP
                * grades[r.name]
                for r in circuit.resistors
            }
            deviation = float(np.sqrt(sum(c**2 for c in shares.values()) / 3.0))
            relative = deviation / abs(nominal) if nominal else np.inf
            word = "upper" if side > 0 else "lower"
            yield Finding(relative, _most(shares), more=f"{chain}, beyond its {word} bends")


def _relative_stiffness(s: RuleSubject) -> Array:
    """(dead zones,) stiffness of the stops, the mean of both, over that of the mass's springs."""
    system = s.design.model.second_order()
    return np.array(
        [
            np.mean([stop.stiffness for _, stop in zone.sides]) / system.own_slope(zone)
            for zone in system.dead_zones
        ]
    )


def _with_clearance(s: RuleSubject, at: Shifts, more: str) -> str:
    """The text, with the name of the clearance in front where there are several."""
    return f"clearance {at.clearance}: {more}" if len(s.forces) > 1 else more


def _most(shares: Mapping[str, float]) -> str:
    """Where most of a sum comes from."""
    worst = max(shares, key=lambda name: abs(shares[name]))
    return f"{worst}, which has most of it"


LOOKS: Mapping[str, Look] = {
    "offset-force": offset,
    "bias-force": bias,
    "noise-force": noise,
    "leakage-force": leakage,
    "absorption-force": absorption,
    "dead-zone-stiffness": stiffness,
    "far-slope": far_slope,
}
"""The rules of this file by id: each yields what was found, one value for each place that it
looks at."""
