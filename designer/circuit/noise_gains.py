"""Loads and noise gains of the op-amp stages, read from a circuit's parts and nets alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from designer.circuit.netlist import GROUND, Circuit, Resistor, Section


@dataclass(frozen=True)
class _Conductance:
    """A conductance [S] between two nets."""

    a: str
    b: str
    siemens: float

    def other(self, net: str) -> str:
        return self.b if net == self.a else self.a


def _conductances(circuit: Circuit) -> list[_Conductance]:
    """The resistors, with the nets that only resistors meet taken out, star to mesh: the middle of
    two in series, the tap of a divider."""
    found = [_Conductance(r.a, r.b, 1.0 / r.value) for r in circuit.resistors]
    held = {GROUND, circuit.generator.net, *(supply.net for supply in circuit.supplies)}
    held = held.union(*(p.nets for p in circuit.parts if not isinstance(p, Resistor)))
    for net in circuit.nets:
        if net in held:
            continue
        star = [f for f in found if net in (f.a, f.b)]
        total = sum(f.siemens for f in star)
        found = [f for f in found if f not in star]
        found += [
            _Conductance(one.other(net), two.other(net), one.siemens * two.siemens / total)
            for one, two in combinations(star, 2)
        ]
    return found


def conductance(circuit: Circuit, a: str, b: str) -> float:
    """Between two nets [S], through resistors alone; straight or by nets that only these meet."""
    return sum(wire.siemens for wire in _conductances(circuit) if {wire.a, wire.b} == {a, b})


@dataclass(frozen=True)
class SectionStage:
    """One section with what is connected to it."""

    section: Section
    """The section."""
    outputs: frozenset[str]
    """Net of its output, and those that a diode joins to it."""
    load: float
    """Load of its output, every resistor there taken to ground [ohm]; infinite without one."""
    integrates: bool
    """Whether a capacitor closes its loop."""
    gain: float
    """Noise gain of a ratio stage; for an integrator 1."""
    corner: float
    """Frequency [Hz] of an integrator by which its noise gain times frequency exceeds the
    frequency; 0 for a ratio stage."""

    def bandwidth(self, frequency: float) -> float:
        """Noise gain times frequency [Hz], both at this frequency [Hz]."""
        return self.gain * frequency + self.corner


def stages(circuit: Circuit) -> Iterator[SectionStage]:
    """The stages of a circuit whose amplifiers all invert, in its order."""
    wires = _conductances(circuit)
    for s in circuit.sections:
        node = s.inverting
        # What hangs on the far end of a diode hangs on the output while the diode conducts.
        joined = {net for d in circuit.diodes if s.output in d.nets for net in d.nets}
        outputs = frozenset({s.output, *joined} - {node})
        load = sum(w.siemens for w in wires if {w.a, w.b} & outputs)
        at_node = [w for w in wires if node in (w.a, w.b)]
        total = sum(w.siemens for w in at_node)
        back = sum(w.siemens for w in at_node if w.other(node) in outputs)
        farads = sum(
            c.value
            for c in circuit.capacitors
            if node in c.nets and (set(c.nets) - {node}) <= outputs
        )
        yield SectionStage(
            section=s,
            outputs=outputs,
            load=1.0 / load if load > 0.0 else float("inf"),
            integrates=farads > 0.0,
            gain=1.0 if farads > 0.0 else total / back if back > 0.0 else float("inf"),
            corner=total / (2.0 * np.pi * farads) if farads > 0.0 else 0.0,
        )
