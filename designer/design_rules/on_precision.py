"""Rules on what shifts the clearance: errors as a constant force at it, over the drive."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from designer.catalog.design_rule import Finding
from designer.circuit.netlist import Diode
from designer.design_rules.force_at_clearance import leftover, thermal
from designer.design_rules.subject import RuleSubject

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
    figure = s.opamp.offset
    limit = figure.max if figure.max is not None else s.opamp.offset_limit
    share = {
        section.name: abs(s.forces.offset[section.name]) * limit / s.drive
        for section in s.circuit.sections
    }
    total = float(np.sqrt(sum(each**2 for each in share.values())))
    more = f"{1e3 * limit:.3g} mV at each of {len(share)} sections"
    yield Finding(total, _most(share), more=more)


def bias(s: RuleSubject) -> Iterator[Finding]:
    """All inputs' largest bias currents, added up."""
    figure = s.opamp.bias
    limit = figure.max if figure.max is not None else figure.nominal
    current = s.forces.current
    share = {
        section.name: abs(current.get(section.inverting, 0.0)) for section in s.circuit.sections
    }
    total = sum(share.values()) * limit / s.drive
    yield Finding(total, _most(share), more=f"{limit:.3g} A at each input")


def noise(s: RuleSubject) -> Iterator[Finding]:
    """RMS of op-amps and resistors from ``SLOWEST`` to the highest frequency that matters."""
    corner = s.opamp.noise_corner.nominal if s.opamp.noise_corner is not None else 0.0
    white = s.fastest - SLOWEST
    flicker = corner * float(np.log(s.fastest / SLOWEST))
    density, forces = s.opamp.noise.nominal, s.forces
    amplifiers = sum((forces.offset[a.name] * density) ** 2 for a in s.circuit.sections)
    resistors = sum((forces.between(r.a, r.b) * thermal(r.value)) ** 2 for r in s.circuit.resistors)
    total = float(np.sqrt(amplifiers * (white + flicker) + resistors * white)) / s.drive
    yield Finding(total, more=f"{SLOWEST:g} Hz to {s.fastest:.4g} Hz")


def leakage(s: RuleSubject) -> Iterator[Finding]:
    """A rail through the board into one summing node; with it whatever leaks through diodes.

    Opposed diodes at one node leak less than that: neither sees a voltage there.
    """
    circuit, forces = s.circuit, s.forces
    through = 0.0
    for diode in circuit.diodes:
        if diode.rest:
            continue  # it conducts
        entry = s.catalog.diode(diode.model.name)
        through += abs(forces.between(diode.cathode, diode.anode)) * entry.reverse_current.nominal
    opposed = {frozenset(d.nets) for d in circuit.fittings if isinstance(d, Diode)}
    for section in circuit.sections:
        node = section.inverting
        over_board = abs(forces.current.get(node, 0.0)) * circuit.supply / INSULATION
        more = f"{circuit.supply:g} V over {INSULATION / 1e9:g} GΩ"
        if through:
            more += ", and through the diodes"
        if any(node in pair for pair in opposed):
            more += "; the protection's diodes see no voltage"
        yield Finding((over_board + through) / s.drive, f"{section.name}, node {node}", more=more)


def absorption(s: RuleSubject) -> Iterator[Finding]:
    """Charge that an integrator's capacitor gives back after its output stood at its limit."""
    circuit = s.circuit
    for capacitor in circuit.capacitors:
        words = s.dielectrics.get(capacitor.name, "")
        known = [share for word, share in ABSORPTION.items() if word.lower() in words.lower()]
        share = known[0] if known else UNKNOWN
        current = share * capacitor.value * circuit.saturation / RETURNS
        force = abs(s.forces.between(capacitor.plus, capacitor.minus)) * current / s.drive
        more = f"{100 * share:g} % of {circuit.saturation:g} V, {words or 'dielectric not known'}"
        yield Finding(force, capacitor.name, more=more)


def stiffness(s: RuleSubject) -> Iterator[Finding]:
    """What the dead zone leaves, in units of K1: |nominal| and a standard deviation.

    The resistors are spread evenly within the grades at which they are bought.
    """
    circuit, grades, system = s.circuit, s.resistor_grades, s.design.model.second_order()
    mu = system.relative_stiffness(system.clearances[0])
    if not circuit.stops:
        return
    nominal = mu * leftover(circuit)
    change = {
        r.name: (mu * leftover(circuit, {r.name: r.value * (1.0 + STEP)}) - nominal) / STEP
        for r in circuit.resistors
    }
    most = max(grades[name] for name in change)
    shares = {name: c * (grades[name] / most) for name, c in change.items()}
    deviation = float(np.sqrt(sum(c**2 for c in shares.values()))) * most / np.sqrt(3.0)
    bought = " and ".join(f"{100 * g:g}" for g in sorted({grades[name] for name in change}))
    more = f"nominal {abs(nominal):.2g}, deviation {deviation:.2g} at {bought} % resistors"
    yield Finding(float(abs(nominal) + deviation), _most(shares), more=more)


def _most(shares: Mapping[str, float]) -> str:
    """Where most of a sum comes from."""
    worst = max(shares, key=lambda name: abs(shares[name]))
    return f"{worst}, which has most of it"
