"""Records of exact orbits at settings that are in no file: what a person may put on a scope.

Each is of a board of the design's own spread, at a frequency drawn over all that the settings
span and beyond, and an amplitude of its own. The exact circuit says what the motion is. Then comes
a scope: 8 bits, noise, errors of gain and offset, or none of these but 16 bits; any of the nets in
any order, one alone as well; a time base of 3 to 40 drive periods; now and then a channel that is
clipped, by the converter or before it. A few records come with ``--omega`` or ``--channels``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from designer.base.arrays import Array
from designer.check.synthesis_result import Synthesis
from designer.circuit.design import settings
from designer.circuit.netlist import Circuit, Excitation
from designer.circuit.nominal import nominal_reduction, on_circuit
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import OrbitStatus
from designer.spread.part_rules import spread_of
from designer.spread.spread import draw_many
from designer.workbench.record import Record
from tests.shared.simulated_scope import SimulatedScope

POINTS = 1000
"""Of a drive period, of the exact motion."""
LONGEST = 40.0
"""Drive periods of a record."""
BEYOND = 1.25
"""Times the highest setting's frequency, and one over it of the lowest."""
AMPLITUDES = (0.7, 1.4)
"""Of a setting's."""
CLIPPED, TOLD, CLEAN = 0.2, 0.2, 0.25
"""Shares of the records with a clipped channel, with ``--omega`` or ``--channels``, and of those
that a scope without noise and errors made."""


@dataclass(frozen=True)
class ExactRecord:
    """A record, and what is true of it."""

    number: int
    """Of the draw."""
    record: Record
    """What the scope wrote."""
    response: str
    """By the exact circuit: n-p-q or "aperiodic"."""
    frequency: float
    """Of the drive [Hz], by the clock of the scope."""
    nets: tuple[str, ...]
    """At CH1, CH2, …."""
    clipped: str
    """The net whose channel is clipped; "" without one."""
    omega: float | None
    """What ``--omega`` says."""
    channels: Mapping[str, str] | None
    """What ``--channels`` says."""
    clean: bool
    """Whether the scope has no noise and no errors."""
    graze: float
    """Shallowest contact or nearest miss, over the peak of the displacement."""


def drawn_records(synthesis: Synthesis, numbers: range, seed: int) -> Iterator[ExactRecord]:
    """The records of these numbers; draws whose motion has no name are left out."""
    design, circuit = synthesis.design, synthesis.design.circuit
    spread = spread_of(synthesis.modelfile, circuit, synthesis.catalog)
    boards = draw_many(circuit, spread, seed, numbers)
    system = nominal_reduction(design).system()
    shown = [on_circuit(system, design, r) for r in synthesis.model_responses]
    starts = [orbit.start for orbit in shown if len(orbit.start)] or [np.zeros(system.size)]
    known = settings(design, synthesis.model_responses)
    low = min(s.frequency_hz for s in known) / BEYOND
    span = max(s.frequency_hz for s in known) * BEYOND / low
    for place, number in enumerate(numbers):
        rng = np.random.default_rng([seed, number])
        volts = known[0].amplitude_v_peak * rng.uniform(*AMPLITUDES)
        drive = Excitation(low * span ** rng.uniform(), volts)
        reduction = Reduction(circuit, boards.board(place))
        flow = Flow(reduction.system(), drive.drive)
        orbit = settle(flow, starts[rng.integers(len(starts))])
        chaotic = orbit.status is OrbitStatus.APERIODIC and orbit.lyapunov > 0.0
        if orbit.status is not OrbitStatus.PERIODIC and not chaotic:
            continue
        run = flow.run(orbit.start, round(LONGEST) + 1, mode=orbit.mode or None, points=POINTS)
        waves = _waves(reduction, run.strobes, drive)
        moving = waves[circuit.state_nets[system.moving]]
        graze = min(orbit.penetration, orbit.miss) / float(np.abs(moving).max())
        clean = np.random.default_rng([seed, number, 1]).uniform() < CLEAN
        yield _recorded(number, waves, drive, orbit.response, graze, rng, synthesis, clean=clean)


def _waves(reduction: Reduction, states: Array, drive: Excitation) -> dict[str, Array]:
    """(k,) voltage [V] of each net along states (k, n), `POINTS` of them a drive period from phase
    0."""
    circuit, system, wave = reduction.circuit, reduction.system(), drive.drive
    angle = 2.0 * np.pi * np.arange(len(states)) / POINTS
    u = wave.amplitude * np.sin(angle) + wave.offset
    whole = np.column_stack([states, u, np.ones(len(states))])
    sides = np.zeros((len(states), len(circuit.stops)), dtype=np.int64)
    for c in range(len(circuit.stops)):
        for side, row in system.contact_rows(c).items():
            sides[whole @ row > 0.0, c] = side
    out = {net: np.empty(len(states)) for net in circuit.outputs}
    for each in np.unique(sides, axis=0):
        here = (sides == each).all(axis=1)
        voltage = reduction.solution(circuit.in_contact(each.tolist())).voltage
        for net, values in out.items():
            values[here] = whole[here] @ voltage[net]
    return {**out, circuit.generator.net: u}


def _recorded(
    number: int,
    waves: Mapping[str, Array],
    drive: Excitation,
    response: str,
    graze: float,
    rng: np.random.Generator,
    synthesis: Synthesis,
    *,
    clean: bool,
) -> ExactRecord:
    """What a scope makes of it, or one of 16 bits without noise and errors."""
    circuit = synthesis.design.circuit
    nets = _nets(circuit, rng)
    scope = SimulatedScope(
        points=int(2000 * 25 ** rng.uniform()),
        periods=float(3.0 * (LONGEST / 3.0) ** rng.uniform()),
        channels=nets,
        noise=float(0.002 * 10 ** rng.uniform()),
        clock=0.0,
    )
    if clean:
        scope = replace(scope, bits=16, noise=0.0, jitter=0.0, gain=0.0, offset=0.0)
    clipped = str(rng.choice(nets)) if rng.uniform() < CLIPPED else ""
    shown, before = dict(waves), rng.uniform() < 0.5
    limits = _limits(waves[clipped], rng) if clipped else (-math.inf, math.inf)
    if clipped and before:
        shown[clipped] = np.clip(waves[clipped], *limits)
    at = np.arange(len(waves[nets[0]])) / (POINTS * drive.frequency)
    record = scope.record(at, shown, 1.0 / drive.frequency, rng)
    if clipped and not before:
        channel = f"CH{nets.index(clipped) + 1}"
        cut = np.clip(record.signals[channel], *limits)
        record = replace(record, signals={**record.signals, channel: cut})
    record = replace(record, time=record.time + rng.choice([0.0, 1.0, -20.0]) * record.duration)
    omega, channels = None, None
    if rng.uniform() < TOLD:
        omega = drive.frequency / synthesis.design.errors.scales.frequency(1.0)
        omega *= 1.0 + rng.uniform(-0.02, 0.02)
    elif rng.uniform() < TOLD and nets != (circuit.generator.net,):
        channels = {net: f"CH{k + 1}" for k, net in enumerate(nets)}
    return ExactRecord(
        number, record, response, drive.frequency, nets, clipped, omega, channels, clean, graze
    )


def _nets(circuit: Circuit, rng: np.random.Generator) -> tuple[str, ...]:
    """What is on the channels, in any order: mostly what docs/bench.md asks for."""
    first, stages = circuit.displacements[0], list(circuit.stage_outputs)
    generator, others = circuit.generator.net, list(circuit.outputs)
    choices: list[list[str]] = [
        [first, *stages, generator],
        [first, *stages],
        [first, *stages],
        [first, generator],
        [*stages, generator],
        [first],
        [stages[0]],
        [circuit.displacements[-1], first, stages[0]],
        [*circuit.displacements, stages[0], generator],
        [
            str(net)
            for net in rng.choice([*others, generator], size=min(3, len(others)), replace=False)
        ],
    ]
    chosen = list(dict.fromkeys(choices[rng.integers(len(choices))]))
    return tuple(chosen[k] for k in rng.permutation(len(chosen)))


def _limits(wave: Array, rng: np.random.Generator) -> tuple[float, float]:
    """Where a channel is cut [V]: at 60 to 90 % of its range, on one side or on both."""
    middle, half = float(wave.max() + wave.min()) / 2.0, float(np.ptp(wave)) / 2.0
    share = rng.uniform(0.6, 0.9) * half
    low, high = middle - share, middle + share
    side = rng.integers(3)
    return (-math.inf if side == 1 else low), (math.inf if side == 2 else high)
