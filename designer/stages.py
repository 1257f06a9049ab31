"""Loads and noise gains of the op-amp stages, read from a circuit's parts and nets alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from designer.circuit import GROUND, Circuit, Section


@dataclass(frozen=True)
class Branch:
    """Conductance [S] between two nets: one resistor, or two in series that meet nothing else."""

    a: str
    b: str
    siemens: float

    def other(self, net: str) -> str:
        return self.b if net == self.a else self.a


def branches(circuit: Circuit) -> tuple[Branch, ...]:
    """Every resistor; resistors in series that share a net with no other part are one branch."""
    found = [Branch(r.a, r.b, 1.0 / r.value) for r in circuit.resistors]
    held = {GROUND, circuit.generator.net}.union(
        *(p.nets for p in circuit.parts if p not in circuit.resistors)
    )
    for net in circuit.nets:
        at = [f for f in found if net in (f.a, f.b)]
        if net in held or len(at) != 2:
            continue
        one, two = at
        together = 1.0 / (1.0 / one.siemens + 1.0 / two.siemens)
        found = [f for f in found if f not in at]
        found.append(Branch(one.other(net), two.other(net), together))
    return tuple(found)


@dataclass(frozen=True)
class Stage:
    """One section with what is connected to it.

    load : of its output, every resistor there taken to ground [ohm]; infinite without one.
    integrates : whether a capacitor closes its loop. gain : noise gain of a ratio stage; for an
    integrator 1. corner : of an integrator, the frequency [Hz] that its noise gain times frequency
    exceeds the frequency by; 0 for a ratio stage.
    """

    section: Section
    load: float
    integrates: bool
    gain: float
    corner: float

    def bandwidth(self, frequency: float) -> float:
        """Noise gain times frequency [Hz], both at this frequency [Hz]."""
        return self.gain * frequency + self.corner


def stages(circuit: Circuit) -> Iterator[Stage]:
    """The stages of a circuit whose amplifiers all invert, in its order."""
    wires = branches(circuit)
    for s in circuit.sections:
        node = s.inverting
        # What hangs on the far end of a diode hangs on the output while the diode conducts.
        joined = {net for d in circuit.diodes if s.output in d.nets for net in d.nets}
        outputs = ({s.output} | joined) - {node}
        load = sum(w.siemens for w in wires if {w.a, w.b} & outputs)
        at_node = [w for w in wires if node in (w.a, w.b)]
        total = sum(w.siemens for w in at_node)
        back = sum(w.siemens for w in at_node if w.other(node) in outputs)
        farads = sum(
            c.value
            for c in circuit.capacitors
            if node in c.nets and (set(c.nets) - {node}) <= outputs
        )
        yield Stage(
            section=s,
            load=1.0 / load if load > 0.0 else float("inf"),
            integrates=farads > 0.0,
            gain=1.0 if farads > 0.0 else total / back if back > 0.0 else float("inf"),
            corner=total / (2.0 * np.pi * farads) if farads > 0.0 else 0.0,
        )
