"""Side conditions verified on a finished circuit: each with its limit and what was found."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from designer.catalog.entries import OpAmp
from designer.circuit.dead_zone_parts import idle_limits
from designer.circuit.design import ConditionCheck, Design
from designer.circuit.netlist import Circuit, Section
from designer.circuit.noise_gains import SectionStage, stages
from designer.circuit.resistors import effective
from designer.model.find_responses import Peaks
from designer.synthesis.limits import (
    GENERATOR_PEAK,
    LEAST_SIGNAL,
    LEVEL_RATIO,
    LOAD,
    NOISE_GAIN,
    SHARE,
    SIGNAL,
    SIGNAL_RESISTORS,
    SWING_SHARE,
    bandwidth_limit,
    guaranteed,
)
from designer.synthesis.output_loads import Load, Loads


def verify(
    design: Design,
    kept: frozenset[str],
    opamp: OpAmp,
    peaks: Peaks,
    amplitudes: Sequence[float],
    loads: Loads | None,
) -> tuple[ConditionCheck, ...]:
    """The kept conditions on the finished circuit, in the order of ``SIDE_CONDITIONS``.

    amplitudes : of the generator, one for each response [V peak]. loads : peak voltages and
    currents of the sections; None where no response was wanted, and then only the states' peaks
    count and no current is known.
    """
    found = [
        *_swing(design, peaks, loads),
        *_idle(design, loads),
        *_level(design, opamp, peaks),
        *_stages(design, opamp, peaks),
        *_current(opamp, loads),
        *_resistors(design),
        ConditionCheck(
            "generator", "generator_peak_v", GENERATOR_PEAK, max(amplitudes, default=0.0), "VM1"
        ),
    ]
    return tuple(check for check in found if check.name in kept)


def _swing(design: Design, peaks: Peaks, loads: Loads | None) -> list[ConditionCheck]:
    limit = SWING_SHARE * design.circuit.saturation
    volts = design.errors.scales.volts * peaks.states
    where, top = max(
        zip(design.circuit.state_nets, volts.tolist(), strict=True), key=lambda pair: pair[1]
    )
    meant = saturating(design.circuit)
    for load in _known(loads):
        if load.section not in meant and load.peak > top:
            where, top = load.section, load.peak
    return [ConditionCheck("swing", "swing_v", limit, top, where)]


def _idle(design: Design, loads: Loads | None) -> list[ConditionCheck]:
    """fv of a rectifier against what the idle half's series diode stands, on the worse side.

    The driving section's output is a drop beyond fv.
    """
    reach = idle_limits(design.circuit, effective(design.circuit.values, design.composites))
    drop = {d.name: d.model.drop for d in design.circuit.diodes}
    found = [
        ConditionCheck(
            "swing",
            "rectifier_fv_v",
            abs(limit),
            max((load.high if limit > 0.0 else -load.low) - drop[diode], 0.0),
            diode,
        )
        for load in _known(loads)
        if load.section in reach
        for diode, limit in [reach[load.section]]
    ]
    return [max(found, key=lambda check: check.excess)] if found else []


def saturating(circuit: Circuit) -> frozenset[str]:
    """Sections that reach their limits in contact: the stops' switches and what drives them."""
    ends = {contact.switch for stop in circuit.stops for _, contact in stop.contacts}
    clip = [s for s in circuit.sections if s.name in ends]
    return frozenset(s.name for s in [*clip, *_drivers(circuit, clip)])


def _drivers(circuit: Circuit, driven: Sequence[Section]) -> list[Section]:
    nodes = {s.inverting for s in driven}
    feeding = {net for r in circuit.resistors if {r.a, r.b} & nodes for net in (r.a, r.b)}
    return [s for s in circuit.sections if s.limits and s.output in feeding]


def _level(design: Design, opamp: OpAmp, peaks: Peaks) -> list[ConditionCheck]:
    volts = design.errors.scales.volts * peaks.states
    pairs = [(0, 1), (2, 3), (1, 3)]
    ratio = max(float(max(volts[i] / volts[j], volts[j] / volts[i])) for i, j in pairs)
    share = float(volts.max() / volts[0])
    offset = float(volts[0]) / opamp.offset_limit
    return [
        ConditionCheck("level", "signal_level_ratio", LEVEL_RATIO, ratio),
        ConditionCheck("level", "signal_share_ratio", SHARE, share),
        ConditionCheck("level", "signal_offset_ratio", LEAST_SIGNAL, offset, "v1", least=True),
    ]


def _stages(design: Design, opamp: OpAmp, peaks: Peaks) -> list[ConditionCheck]:
    every = tuple(stages(design.circuit))
    frequency = peaks.fastest / (2.0 * np.pi * design.errors.scales.seconds)
    heaviest = min(every, key=lambda s: s.load)
    steepest = max((s for s in every if not s.integrates), key=lambda s: s.gain, default=None)

    def product(stage: SectionStage) -> float:
        return stage.bandwidth(frequency)

    slowest = max(every, key=product)
    out = [
        ConditionCheck("load", "load_ohm", LOAD, heaviest.load, heaviest.section.name, least=True),
        ConditionCheck(
            "bandwidth",
            "noise_gain_bandwidth_hz",
            bandwidth_limit(opamp),
            product(slowest),
            slowest.section.name,
        ),
    ]
    if steepest is not None:
        out.insert(
            1,
            ConditionCheck(
                "noise_gain", "noise_gain", NOISE_GAIN, steepest.gain, steepest.section.name
            ),
        )
    return out


def _current(opamp: OpAmp, loads: Loads | None) -> list[ConditionCheck]:
    if not _known(loads):
        return []
    most = max(_known(loads), key=lambda load: load.current)
    limit = guaranteed(opamp.output_current)
    return [ConditionCheck("load", "output_current_a", limit, most.current, most.section)]


def _resistors(design: Design) -> list[ConditionCheck]:
    values = effective(design.circuit.values, design.composites)
    signal = {name: value for name, value in values.items() if name in SIGNAL_RESISTORS}
    low, high = min(signal, key=signal.__getitem__), max(signal, key=signal.__getitem__)
    return [
        ConditionCheck(
            "resistors", "signal_resistor_low_ohm", SIGNAL[0], signal[low], low, least=True
        ),
        ConditionCheck("resistors", "signal_resistor_high_ohm", SIGNAL[1], signal[high], high),
    ]


def _known(loads: Loads | None) -> tuple[Load, ...]:
    return () if loads is None else loads.sections
