"""Loads and noise gains of the op-amp stages, read from a circuit's parts and nets alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from designer.circuit.netlist import Circuit, Section


def conductance(circuit: Circuit, a: str, b: str) -> float:
    """Between two nets [S], through resistors alone; straight or by nets that only these meet."""
    return float(sum(wire.siemens for wire in circuit.wires() if {wire.a, wire.b} == {a, b}))


@dataclass(frozen=True)
class SectionStage:
    """One section with what is connected to it."""

    section: Section
    outputs: frozenset[str]
    """Net of its output, and those that a diode joins to it."""
    load: float
    """Load of its output, every resistor there taken to ground [ohm]; infinite without one."""
    integrates: bool
    """Whether a capacitor closes its loop."""
    gain: float
    """Noise gain of a ratio stage; of an integrator that of its capacitors, 1 where it has one."""
    corner: float
    """Frequency [Hz] of an integrator by which its noise gain times frequency exceeds ``gain``
    times the frequency; 0 for a ratio stage."""

    def bandwidth(self, frequency: float) -> float:
        """Noise gain times frequency [Hz], both at this frequency [Hz]."""
        return self.gain * frequency + self.corner


def stages(circuit: Circuit) -> Iterator[SectionStage]:
    """The stages of a circuit whose amplifiers all invert, in its order."""
    wires, loads = circuit.wires(), circuit.output_loads()
    for s in circuit.sections:
        node = s.inverting
        outputs = circuit.output_nets(s)
        at_node = [w for w in wires if node in (w.a, w.b)]
        total = sum(w.siemens for w in at_node)
        back = sum(w.siemens for w in at_node if w.other(node) in outputs)
        there = [c for c in circuit.capacitors if node in c.nets]
        farads = sum(c.value for c in there if (set(c.nets) - {node}) <= outputs)
        yield SectionStage(
            section=s,
            outputs=outputs,
            load=loads[s.name],
            integrates=farads > 0.0,
            gain=sum(c.value for c in there) / farads if farads > 0.0 else _ratio(total, back),
            corner=total / (2.0 * np.pi * farads) if farads > 0.0 else 0.0,
        )


def _ratio(total: float, back: float) -> float:
    return total / back if back > 0.0 else float("inf")
