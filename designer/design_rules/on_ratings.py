"""Rules on what parts stand and op-amps give, at the voltages of the wanted responses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from designer.catalog.design_rule import Finding
from designer.catalog.entries import OpAmp
from designer.circuit.netlist import GROUND, NEGATIVE, POSITIVE, Circuit, Diode
from designer.circuit.noise_gains import SectionStage, stages
from designer.design_rules.operating_point import Operating, Peak
from designer.synthesis.limits import bandwidth_limit, guaranteed
from designer.synthesis.side_conditions import saturating

GENERATOR = 10.0
"""Most that a generator gives into a high impedance [V]: what common ones do."""
INPUT = 2e-3
"""Largest current into an input where no sheet gives one [A]: DS21733J, MCP6004, has the least."""
HEAVY, LIGHT = 2e3, 10e3
"""Loads that data sheets state the swing for [Ω]."""


def swing(circuit: Circuit, opamp: OpAmp, met: Operating) -> Iterator[Finding]:
    """Peaks of every output but those that reach their limits in contact."""
    meant = saturating(circuit)
    for section in circuit.sections:
        if section.name in meant:
            continue
        peak = max(met.high[section.output], met.low[section.output], key=lambda p: p.value)
        current = met.source[section.name].value
        yield Finding(
            peak.value, _at(section.name, peak), guaranteed_swing(opamp, circuit, current)
        )


def guaranteed_swing(opamp: OpAmp, circuit: Circuit, current: float) -> float:
    """Least output swing [V] at this output current [A] and the circuit's rails.

    The figures are those into 10 kΩ and 2 kΩ; between and beyond them in proportion to the current.
    """
    shift = circuit.supply - opamp.rated_supply
    light = guaranteed(opamp.swing)
    if opamp.swing_2k is None:
        return light + shift
    heavy = guaranteed(opamp.swing_2k)
    from_, to = light / LIGHT, heavy / HEAVY
    share = max((current - from_) / (to - from_), 0.0)
    return light + share * (heavy - light) + shift


def load(circuit: Circuit) -> Iterator[Finding]:
    """Resistance on each output."""
    for stage in stages(circuit):
        if stage.load < float("inf"):
            yield Finding(stage.load, stage.section.name)


def output_current(circuit: Circuit, opamp: OpAmp, met: Operating) -> Iterator[Finding]:
    """Peak current of each output."""
    limit = guaranteed(opamp.output_current)
    for section in circuit.sections:
        peak = met.source[section.name]
        yield Finding(peak.value, _at(section.name, peak), limit)


def fault_current(circuit: Circuit, opamp: OpAmp) -> Iterator[Finding]:
    """From the generator into each input with the supply off, every output and rail at 0 V.

    A pair of opposed diodes to ground at the node takes the current in the input's place; the two
    share it at worst, for both drop a diode's voltage.
    """
    limit = INPUT if opamp.input_current is None else opamp.input_current.nominal
    held = {GROUND, POSITIVE, NEGATIVE, *(s.output for s in circuit.sections)}
    for section in circuit.sections:
        node = section.inverting
        siemens = _towards(circuit, circuit.generator.net, node, held)
        current = GENERATOR * siemens
        ways = {
            d.anode == node
            for d in circuit.fittings
            if isinstance(d, Diode) and set(d.nets) == {node, GROUND}
        }
        more = ""
        if ways == {True, False}:
            current, more = current / 2.0, "shared with the diodes at the node"
        yield Finding(current, f"{section.name}, node {node}", limit, more)


def _towards(circuit: Circuit, source: str, node: str, held: set[str]) -> float:
    """Conductance [S] from the generator into a node at 0 V: straight, or through one more net."""
    total = 0.0
    for first in circuit.resistors:
        if source not in first.nets:
            continue
        middle = first.b if first.a == source else first.a
        if middle == node:
            total += 1.0 / first.value
        elif middle not in held:
            second = [r for r in circuit.resistors if set(r.nets) == {middle, node}]
            total += sum(1.0 / (first.value + r.value) for r in second)
    return total


def power(ratings: Mapping[str, float], met: Operating) -> Iterator[Finding]:
    """Mean power of each resistor over its rating [W], by name."""
    for name, rating in ratings.items():
        peak = met.power.get(name)
        if peak is not None:
            more = f"{1e3 * peak.value:.3g} mW of {1e3 * rating:.3g} mW"
            yield Finding(peak.value / rating, _at(name, peak), more=more)


def capacitor_voltage(
    circuit: Circuit,
    ratings: Mapping[str, float],
    met: Operating,
    stuck: Operating,
) -> Iterator[Finding]:
    """Voltage of each capacitor over its rating [V], by name; those of the supply too."""
    supply = {POSITIVE: circuit.supply, NEGATIVE: -circuit.supply, GROUND: 0.0}
    across = {name: met.across[name] for name in met.across if name in ratings}
    for name, peak in stuck.across.items():
        if name in across and peak.value > across[name].value:
            across[name] = peak
    for part in circuit.fittings:
        if part.name in ratings and set(part.nets) <= set(supply):
            volts = [supply[net] for net in part.nets]
            across[part.name] = Peak(abs(volts[0] - volts[1]), "")
    for name, peak in across.items():
        more = f"{peak.value:.3g} V of {ratings[name]:.3g} V"
        yield Finding(peak.value / ratings[name], _at(name, peak), more=more)


def common_mode(circuit: Circuit, opamp: OpAmp, met: Operating) -> Iterator[Finding]:
    """Room of each input inside the range; its ends move with the rails."""
    shift = circuit.supply - opamp.rated_supply
    low = (opamp.common_mode.min or 0.0) - shift
    high = (opamp.common_mode.max or 0.0) + shift
    for section in circuit.sections:
        for net in dict.fromkeys((section.inverting, section.noninverting)):
            top, bottom = met.high[net], met.low[net]
            yield Finding(high - top.value, _at(section.name, top))
            yield Finding(-bottom.value - low, _at(section.name, bottom))


def slew(circuit: Circuit, opamp: OpAmp, met: Operating) -> Iterator[Finding]:
    """Fastest change of each output over what is guaranteed."""
    limit = guaranteed(opamp.slew)
    for section in circuit.sections:
        peak = met.slew[section.name]
        more = f"{peak.value / 1e6:.3g} V/µs of {limit / 1e6:.3g} V/µs"
        yield Finding(peak.value / limit, _at(section.name, peak), more=more)


def gain_bandwidth(circuit: Circuit, opamp: OpAmp, frequency: float) -> Iterator[Finding]:
    """Noise gain times the highest frequency that matters [Hz]."""

    def found(stage: SectionStage) -> Finding:
        more = f"up to {frequency:.4g} Hz"
        name = stage.section.name
        return Finding(stage.bandwidth(frequency), name, bandwidth_limit(opamp), more)

    return (found(stage) for stage in stages(circuit))


def _at(name: str, peak: Peak) -> str:
    if not peak.run:
        return name
    return f"{name} ({'ω = ' if peak.run[0].isdigit() else ''}{peak.run})"
