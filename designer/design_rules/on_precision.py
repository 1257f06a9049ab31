"""Rules on what shifts the clearance: errors as a constant force at it, over the drive."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from designer.catalog.catalog import Catalog
from designer.catalog.design_rule import Finding
from designer.catalog.entries import OpAmp
from designer.circuit.netlist import Circuit, Diode
from designer.design_rules.force_at_clearance import Forces, leftover, thermal

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


def offset(opamp: OpAmp, circuit: Circuit, forces: Forces, drive: float) -> Iterator[Finding]:
    """All sections' largest offsets, independent of each other. drive : amplitude [V]."""
    limit = opamp.offset.max if opamp.offset.max is not None else opamp.offset_limit
    share = {s.name: abs(forces.offset[s.name]) * limit / drive for s in circuit.sections}
    worst = max(share, key=lambda name: share[name])
    total = float(np.sqrt(sum(each**2 for each in share.values())))
    more = f"{shown_volts(limit)} at each of {len(share)} sections"
    yield Finding(total, f"{worst}, which has most of it", more=more)


def bias(opamp: OpAmp, circuit: Circuit, forces: Forces, drive: float) -> Iterator[Finding]:
    """All inputs' largest bias currents, added up."""
    limit = opamp.bias.max if opamp.bias.max is not None else opamp.bias.nominal
    share = {s.name: abs(forces.current.get(s.inverting, 0.0)) for s in circuit.sections}
    worst = max(share, key=lambda name: share[name])
    total = sum(share.values()) * limit / drive
    yield Finding(total, f"{worst}, which has most of it", more=f"{limit:.3g} A at each input")


def noise(
    opamp: OpAmp, circuit: Circuit, forces: Forces, drive: float, frequency: float
) -> Iterator[Finding]:
    """RMS of op-amps and resistors from ``SLOWEST`` to ``frequency`` [Hz]."""
    corner = opamp.noise_corner.nominal if opamp.noise_corner is not None else 0.0
    white = frequency - SLOWEST
    flicker = corner * float(np.log(frequency / SLOWEST))
    density = opamp.noise.nominal
    amplifiers = sum((forces.offset[s.name] * density) ** 2 for s in circuit.sections)
    resistors = sum((forces.between(r.a, r.b) * thermal(r.value)) ** 2 for r in circuit.resistors)
    total = float(np.sqrt(amplifiers * (white + flicker) + resistors * white)) / drive
    yield Finding(total, more=f"{SLOWEST:g} Hz to {frequency:.4g} Hz")


def leakage(circuit: Circuit, catalog: Catalog, forces: Forces, drive: float) -> Iterator[Finding]:
    """A rail through the board into one summing node; with it whatever leaks through diodes.

    Opposed diodes at one node leak less than that: neither sees a voltage there.
    """
    through = 0.0
    for diode in circuit.diodes:
        if diode.rest:
            continue  # it conducts
        entry = catalog.diode(diode.model.name)
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
        yield Finding((over_board + through) / drive, f"{section.name}, node {node}", more=more)


def absorption(
    circuit: Circuit, dielectrics: Mapping[str, str], forces: Forces, drive: float
) -> Iterator[Finding]:
    """Charge that an integrator's capacitor gives back after its output stood at its limit.

    dielectrics : of the capacitors, in words, by name.
    """
    for capacitor in circuit.capacitors:
        words = dielectrics.get(capacitor.name, "")
        known = [share for word, share in ABSORPTION.items() if word.lower() in words.lower()]
        share = known[0] if known else UNKNOWN
        current = share * capacitor.value * circuit.saturation / RETURNS
        force = abs(forces.between(capacitor.plus, capacitor.minus)) * current / drive
        more = f"{100 * share:g} % of {circuit.saturation:g} V, {words or 'dielectric not known'}"
        yield Finding(force, capacitor.name, more=more)


def stiffness(circuit: Circuit, mu: float, grades: Mapping[str, float]) -> Iterator[Finding]:
    """What the dead zone leaves, in units of K1: |nominal| and a standard deviation.

    mu : the stop's stiffness over K1. grades : of each resistor as it is bought, spread evenly.
    """
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
    worst = max(shares, key=lambda name: abs(shares[name]))
    bought = " and ".join(f"{100 * g:g}" for g in sorted({grades[name] for name in change}))
    more = f"nominal {abs(nominal):.2g}, deviation {deviation:.2g} at {bought} % resistors"
    yield Finding(float(abs(nominal) + deviation), f"{worst}, which has most of it", more=more)


def shown_volts(volts: float) -> str:
    """Volts as people write them."""
    return f"{1e3 * volts:.3g} mV"
