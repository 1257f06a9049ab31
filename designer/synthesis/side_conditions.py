"""Side conditions verified on a finished circuit: each with its limit and what was found."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from designer.catalog.entries import OpAmp
from designer.circuit.dead_zone_parts import idle_limits
from designer.circuit.design import ConditionCheck, Design
from designer.circuit.netlist import Circuit
from designer.circuit.noise_gains import stages
from designer.circuit.resistors import effective
from designer.linear_network.linear_terms import Targets
from designer.model.find_responses import Peaks
from designer.synthesis.limits import (
    GENERATOR_PEAK,
    LEAST_SIGNAL,
    LEVEL_RATIO,
    LOAD,
    NOISE_GAIN,
    SHARE,
    SIGNAL,
    SWING_SHARE,
    bandwidth_limit,
    guaranteed,
)
from designer.synthesis.output_loads import Load, Loads

HEAVY, LIGHT = 2e3, 10e3
"""Loads that data sheets state the swing for [Ω]."""


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


def verify(
    design: Design,
    conditions: frozenset[str],
    opamp: OpAmp,
    peaks: Peaks,
    amplitudes: Sequence[float],
    loads: Loads | None,
) -> tuple[ConditionCheck, ...]:
    """These conditions on the finished circuit, in the order of ``SIDE_CONDITIONS``; the voltages
    of a mass at rest are assumed (``Peaks.states``).

    amplitudes : of the generator, the largest of each channel [V peak]. loads : peak voltages and
    currents of the sections; None where no response was wanted, and then only the states' peaks
    count and no current is known.
    """
    sections = () if loads is None else loads.sections
    checks = [
        *_swing(design, opamp, peaks, sections),
        *_level(design, opamp, peaks),
        *_stages(design, opamp, peaks),
    ]
    if sections:
        most = max(sections, key=lambda load: load.current)
        limit = guaranteed(opamp.output_current)
        checks.append(ConditionCheck("load", "output_current_a", limit, most.current, most.section))
    values = effective(design.circuit.values, design.composites)
    signal = {name: values[name] for name in Targets.of(design.model).resistors}
    low, high = min(signal, key=signal.__getitem__), max(signal, key=signal.__getitem__)
    in_low, in_high = "signal_resistor_low_ohm", "signal_resistor_high_ohm"
    amplitude = max(amplitudes, default=0.0)
    checks += [
        ConditionCheck("resistors", in_low, SIGNAL[0], signal[low], low, least=True),
        ConditionCheck("resistors", in_high, SIGNAL[1], signal[high], high),
        ConditionCheck("generator", "generator_peak_v", GENERATOR_PEAK, amplitude, "VM1"),
    ]
    return tuple(check for check in checks if check.name in conditions)


def _swing(
    design: Design, opamp: OpAmp, peaks: Peaks, sections: Sequence[Load]
) -> list[ConditionCheck]:
    """Outputs that stay linear against the op-amp's limit; fv of a rectifier, on its worse side,
    against what the idle half's series diode stands (the driving section is a drop beyond fv)."""
    circuit = design.circuit
    volts = design.errors.scales.volts * peaks.states
    tops = dict(zip(circuit.state_nets, volts.tolist(), strict=True))
    meant = saturating(circuit)
    tops |= {load.section: load.peak for load in sections if load.section not in meant}
    where = max(tops, key=tops.__getitem__)
    limit = SWING_SHARE * circuit.saturation
    checks = [ConditionCheck("swing", "swing_v", limit, tops[where], where)]
    loaded = [
        ConditionCheck(
            "swing",
            "guaranteed_swing_v",
            guaranteed_swing(opamp, circuit, load.current),
            load.peak,
            load.section,
        )
        for load in sections
        if load.section not in meant
    ]
    checks += sorted(loaded, key=lambda check: -check.excess)[:1]
    reach = idle_limits(circuit, effective(circuit.values, design.composites))
    drop = {d.name: d.model.drop for d in circuit.diodes}
    idle = []
    for load in sections:
        if load.section in reach:
            diode, end = reach[load.section]
            fv = max((load.high if end > 0.0 else -load.low) - drop[diode], 0.0)
            idle.append(ConditionCheck("swing", "rectifier_fv_v", abs(end), fv, diode))
    return checks + sorted(idle, key=lambda check: -check.excess)[:1]


def saturating(circuit: Circuit) -> frozenset[str]:
    """Sections that reach their limits in contact: the stops' switches and what drives them."""
    ends = {contact.switch for stop in circuit.dead_zones for _, contact in stop.contacts}
    nodes = {s.inverting for s in circuit.sections if s.name in ends}
    feeding = {net for r in circuit.resistors if nodes & set(r.nets) for net in r.nets}
    return frozenset(
        s.name for s in circuit.sections if s.name in ends or (s.limits and s.output in feeding)
    )


def _level(design: Design, opamp: OpAmp, peaks: Peaks) -> list[ConditionCheck]:
    volts = design.errors.scales.volts * peaks.states
    zones = design.model.second_order().dead_zones
    own = zones[0].watched if zones else 0
    pairs = [*zip(volts[0::2], volts[1::2], strict=True), *combinations(volts[1::2], 2)]
    ratio = max(float(max(one / other, other / one)) for one, other in pairs)
    share = float(volts.max() / volts[own])
    offset = float(volts[own]) / opamp.offset_limit
    net = design.circuit.state_nets[own]
    return [
        ConditionCheck("level", "signal_level_ratio", LEVEL_RATIO, ratio),
        ConditionCheck("level", "signal_share_ratio", SHARE, share),
        ConditionCheck("level", "signal_offset_ratio", LEAST_SIGNAL, offset, net, least=True),
    ]


def _stages(design: Design, opamp: OpAmp, peaks: Peaks) -> list[ConditionCheck]:
    every = tuple(stages(design.circuit))
    frequency = peaks.fastest / (2.0 * np.pi * design.errors.scales.seconds)
    heaviest = min(every, key=lambda s: s.load)
    slowest = max(every, key=lambda s: s.bandwidth(frequency))
    steepest = max((s for s in every if not s.integrates), key=lambda s: s.gain, default=None)
    load, product = heaviest.load, slowest.bandwidth(frequency)
    limit, slow = bandwidth_limit(opamp), slowest.section.name
    checks = [ConditionCheck("load", "load_ohm", LOAD, load, heaviest.section.name, least=True)]
    if steepest is not None:
        gain, steep = steepest.gain, steepest.section.name
        checks.append(ConditionCheck("noise_gain", "noise_gain", NOISE_GAIN, gain, steep))
    return [*checks, ConditionCheck("bandwidth", "noise_gain_bandwidth_hz", limit, product, slow)]
