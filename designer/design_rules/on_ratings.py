"""Rules on what parts stand and op-amps give, at the voltages of the wanted responses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from designer.catalog.design_rule import Finding, NotRun, value_text
from designer.catalog.entries import ROOM
from designer.circuit.netlist import GROUND, NEGATIVE, POSITIVE, Diode
from designer.circuit.noise_gains import conductance, stages
from designer.design_rules.rule_subject import Look, RuleSubject
from designer.synthesis.limits import bandwidth_limit, guaranteed
from designer.synthesis.operating_point import Operating, Peak
from designer.synthesis.side_conditions import guaranteed_swing, saturating

GENERATOR = 10.0
"""Most that a generator gives into a high impedance [V]: what common ones do."""
INPUT = 2e-3
"""Largest current into an input where no sheet gives one [A]: DS21733J, MCP6004, has the least."""


def swing(s: RuleSubject) -> Iterator[Finding]:
    """Peaks of every output but those that reach their limits in contact."""
    peaks, exempt = s.operating, saturating(s.circuit)
    for section in s.circuit.sections:
        if section.name not in exempt:
            peak = max(peaks.high[section.output], peaks.low[section.output], key=lambda p: p.value)
            limit = guaranteed_swing(s.opamp, s.circuit, peaks.source[section.name].value)
            yield Finding(peak.value, _at(section.name, peak), limit)


def load(s: RuleSubject) -> Iterator[Finding]:
    """Resistance on each output."""
    for stage in stages(s.circuit):
        if stage.load < float("inf"):
            yield Finding(stage.load, stage.section.name)


def output_current(s: RuleSubject) -> Iterator[Finding]:
    """Peak current of each output."""
    limit = guaranteed(s.opamp.output_current)
    for section in s.circuit.sections:
        peak = s.operating.source[section.name]
        yield Finding(peak.value, _at(section.name, peak), limit)


def fault_current(s: RuleSubject) -> Iterator[Finding]:
    """The current from the generator into each input with the supply off, every output and rail at
    0 V.

    A pair of opposed diodes to ground at the node takes the current in the input's place; the two
    share it at worst, for both drop a diode's voltage.
    """
    circuit, most = s.circuit, s.opamp.input_current
    limit = INPUT if most is None else most.nominal
    for section in circuit.sections:
        node = section.inverting
        current = GENERATOR * sum(conductance(circuit, n, node) for n in circuit.generator_nets)
        ways = {
            d.anode == node
            for d in circuit.fittings
            if isinstance(d, Diode) and set(d.nets) == {node, GROUND}
        }
        more = ""
        if ways == {True, False}:
            current, more = current / 2.0, "shared with the diodes at the node"
        yield Finding(current, f"{section.name}, node {node}", limit, more)


def power(s: RuleSubject) -> Iterator[Finding]:
    """Mean power of each resistor over its rating."""
    return _power(s, s.operating)


def power_stuck(s: RuleSubject) -> Iterator[Finding]:
    """The power with an op-amp stuck at a rail."""
    return _power(s, s.stuck)


def _power(s: RuleSubject, peaks: Operating) -> Iterator[Finding]:
    for name, rating in s.watts.items():
        peak = peaks.power.get(name)
        if peak is not None:
            more = f"{1e3 * peak.value:.3g} mW of {1e3 * rating:.3g} mW"
            yield Finding(peak.value / rating, _at(name, peak), more=more)


def capacitor_voltage(s: RuleSubject) -> Iterator[Finding]:
    """Voltage of each capacitor over its rating; those of the supply too."""
    ratings, peaks = s.volts, s.operating.across
    supply = {POSITIVE: s.circuit.supply, NEGATIVE: -s.circuit.supply, GROUND: 0.0}
    across = {name: peaks[name] for name in peaks if name in ratings}
    for name, peak in s.stuck.across.items():
        if name in across and peak.value > across[name].value:
            across[name] = peak
    for part in s.circuit.fittings:
        if part.name in ratings and set(part.nets) <= set(supply):
            volts = [supply[net] for net in part.nets]
            across[part.name] = Peak(abs(volts[0] - volts[1]), "")
    for name, peak in across.items():
        more = f"{peak.value:.3g} V of {ratings[name]:.3g} V"
        yield Finding(peak.value / ratings[name], _at(name, peak), more=more)


def common_mode(s: RuleSubject) -> Iterator[Finding]:
    """Room of each input inside the range; its ends move with the rails."""
    shift = s.circuit.supply - s.opamp.rated_supply
    low = (s.opamp.common_mode.min or 0.0) - shift
    high = (s.opamp.common_mode.max or 0.0) + shift
    for section in s.circuit.sections:
        for net in dict.fromkeys((section.inverting, section.noninverting)):
            top, bottom = s.operating.high[net], s.operating.low[net]
            yield Finding(high - top.value, _at(section.name, top))
            yield Finding(-bottom.value - low, _at(section.name, bottom))


def reference_current(s: RuleSubject) -> Iterator[Finding]:
    """Least current of each shunt reference over what it needs."""
    for reference in s.circuit.references:
        if not reference.least:
            raise NotRun(f"the catalogue has no least current of {reference.model}")
        peak = s.operating.reference[reference.name]
        more = f"{-1e6 * peak.value:.3g} µA of {1e6 * reference.least:.3g} µA"
        yield Finding(-peak.value / reference.least, _at(reference.name, peak), more=more)


def bulk(s: RuleSubject) -> Iterator[Finding]:
    """Capacitance of each rail's bulk at its voltage, over that at the op-amps' pins.

    Raises
    ------
    NotRun : the catalogue does not say what a ceramic keeps under DC.
    """
    for rail in (POSITIVE, NEGATIVE):
        here = [
            c
            for c in s.components
            if c.kind == "capacitor" and set(c.nets.values()) == {rail, GROUND}
        ]
        whole = [c for c in here if not c.near]
        at_pins = sum(c.quantity or 0.0 for c in here if c.near)
        if not whole or not at_pins:
            raise NotRun(f"no capacitors from {rail} to ground, at the supply and at the op-amps")
        kept = {c.reference: s.kept_under_dc(c) for c in whole}
        total = sum((c.quantity or 0.0) * kept[c.reference] for c in whole)
        shares = ", ".join(f"{name} keeps {100 * share:.0f} %" for name, share in kept.items())
        more = f"{value_text(total, 'F')} at {s.circuit.supply:g} V ({shares}) over "
        yield Finding(total / at_pins, rail, more=more + value_text(at_pins, "F"))


def temperature(s: RuleSubject) -> Iterator[Finding]:
    """Room between the boards' temperatures and the ends of the op-amp's range.

    Raises
    ------
    NotRun : the catalogue has no end of the range.
    """
    rated = s.opamp.temperature
    if rated is None or (rated.min is None and rated.max is None):
        raise NotRun(f"the catalogue has no range of temperatures of {s.opamp.name}")
    low, high = s.catalog.temperatures or (ROOM, ROOM)
    for end, room in (
        (rated.min, None if rated.min is None else low - rated.min),
        (rated.max, None if rated.max is None else rated.max - high),
    ):
        if room is not None:
            at = low if end == rated.min else high
            yield Finding(room, s.opamp.name, more=f"boards at {at:g} °C, specified to {end:g} °C")


def slew(s: RuleSubject) -> Iterator[Finding]:
    """Fastest change of each output over what is guaranteed."""
    limit = guaranteed(s.opamp.slew)
    for section in s.circuit.sections:
        peak = s.operating.slew[section.name]
        more = f"{peak.value / 1e6:.3g} V/µs of {limit / 1e6:.3g} V/µs{s.warm}"
        yield Finding(peak.value / limit, _at(section.name, peak), more=more)


def gain_bandwidth(s: RuleSubject) -> Iterator[Finding]:
    """Noise gain times the highest frequency that matters."""
    limit, fastest = bandwidth_limit(s.opamp), value_text(s.fastest, "Hz")
    for stage in stages(s.circuit):
        product = stage.bandwidth(s.fastest)
        more = f"a noise gain of {product / s.fastest:.3g} times {fastest}{s.warm}"
        yield Finding(product, stage.section.name, limit, more)


def _at(name: str, peak: Peak) -> str:
    if not peak.run:
        return name
    return f"{name} ({'ω = ' if peak.run[0].isdigit() else ''}{peak.run})"


LOOKS: Mapping[str, Look] = {
    "swing": swing,
    "load": load,
    "output-current": output_current,
    "fault-current": fault_current,
    "power": power,
    "power-stuck": power_stuck,
    "capacitor-voltage": capacitor_voltage,
    "common-mode": common_mode,
    "bulk": bulk,
    "reference-current": reference_current,
    "temperature": temperature,
    "slew": slew,
    "gain-bandwidth": gain_bandwidth,
}
"""The rules of this file by id: each yields what was found, one value for each place that it
looks at."""
