"""The share of a section's output that returns to its inputs, in a mode of its circuit."""

from __future__ import annotations

import numpy as np

from designer.circuit.netlist import GROUND, NEGATIVE, POSITIVE, Circuit, Section
from designer.dynamics.piecewise_linear import ModeKey

CLOSED = 1e3
"""Conductance [S] of the largest capacitor at signal frequencies and of a diode that conducts."""
OPEN = 1e-15
"""Conductance [S] from every net to ground, so that none is without an answer."""


def feedback_share(circuit: Circuit, section: Section, key: ModeKey) -> float:
    """v(-) - v(+) for 1 V at the section's output and every other source at rest.

    key : the mode, which says what diodes conduct; where none closes the loop the share is 0.
    """
    fixed = dict.fromkeys((GROUND, *circuit.generator_nets, POSITIVE, NEGATIVE), 0.0)
    fixed |= {s.output: 0.0 for s in circuit.sections}
    fixed[section.output] = 1.0
    free = [net for net in circuit.nets if net not in fixed]
    place = {net: i for i, net in enumerate(free)}
    G, right = OPEN * np.eye(len(free)), np.zeros(len(free))

    def join(a: str, b: str, siemens: float) -> None:
        for one, other in ((a, b), (b, a)):
            if one not in place:
                continue
            G[place[one], place[one]] += siemens
            if other in place:
                G[place[one], place[other]] -= siemens
            else:
                right[place[one]] += siemens * fixed[other]

    for r in circuit.resistors:
        join(r.a, r.b, 1.0 / r.value)
    largest = max((c.value for c in circuit.capacitors), default=1.0)
    for c in circuit.capacitors:
        join(c.plus, c.minus, CLOSED * c.value / largest)
    for reference in circuit.references:
        join(reference.cathode, reference.anode, CLOSED)
    positions = key[len(circuit.sections) :]
    for diode, position in zip(circuit.diodes, positions, strict=True):
        if position:
            join(diode.anode, diode.cathode, CLOSED)
    volts = np.linalg.solve(G, right) if free else right

    def at(net: str) -> float:
        return float(volts[place[net]]) if net in place else fixed[net]

    return at(section.inverting) - at(section.noninverting)
