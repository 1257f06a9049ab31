"""The numerics gate: which ngspice settings may decide on a response.

Before ngspice's verdict counts, two step sizes and two integration methods must agree with each
other, and with the exact circuit, on n-p-q and on every strobe within a stated bound. The largest
step follows the contact, not only the period: T/200 miscounts the eight-impact response.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from designer import deck
from designer.circuit import Board, Circuit
from designer.deck import Excitation, SolverSettings
from designer.flow import Flow
from designer.ngspice import SimulationFailed
from designer.orbit import MAX_PERIOD, Orbit, OrbitStatus
from designer.reduction import Reduction
from designer.system import Array, Drive, PiecewiseLinearSystem
from designer.waveform_orbit import Read, Reading, read
from designer.workers import SpiceJob, SpicePool

STEPS_PER_PERIOD, STEPS_PER_CONTACT = 200, 10
LEVELS = 5
"""How often the step is halved before the gate gives up."""
BOUND = 1e-3
"""Of the peak: half the strobe tolerance, so that boards that differ have room too."""
DISCARD = 2
"""Periods left out after a start on the exact circuit's orbit."""


@dataclass(frozen=True)
class GateResult:
    """settings : what passed, or the finest that was tried. passed : whether any did.
    difference : largest strobe difference between the runs, of the peak. read : the run at
    ``settings``; tried : steps a period that were tried."""

    settings: SolverSettings
    passed: bool
    difference: float
    read: Read | SimulationFailed
    tried: tuple[int, ...]


@dataclass(frozen=True)
class Subject:
    """One response of one board (a reduction): what a run of ngspice needs.

    orbit : on the exact circuit; the run starts there and its n sets the length.
    """

    reduction: Reduction
    excitation: Excitation
    orbit: Orbit

    @property
    def circuit(self) -> Circuit:
        return self.reduction.circuit

    @property
    def board(self) -> Board:
        return self.reduction.board

    @cached_property
    def system(self) -> PiecewiseLinearSystem:
        return self.reduction.system()

    @property
    def shift(self) -> Array:
        """(states,) voltages of the state nets with every capacitor discharged: offsets."""
        solved = self.reduction.solution(self.system.start)
        return np.array([solved.voltage[net][-1] for net in self.circuit.state_nets])

    @property
    def period(self) -> float:
        return 1.0 / self.excitation.frequency


def job(subject: Subject, settings: SolverSettings, *, keep: bool = False) -> SpiceJob[Read]:
    """The run of one subject: ``DISCARD`` periods and at least 4n (six or more) to judge.

    Where the exact circuit has no period, ngspice is given enough to find any up to the largest.
    """
    periods = DISCARD + max(4 * (subject.orbit.n or MAX_PERIOD), 6)
    stop = periods * subject.period
    upper, lower = contact_rows(subject.system)
    reading = Reading(
        period=subject.period,
        discard=DISCARD,
        nets=subject.circuit.state_nets,
        shift=subject.shift,
        upper=upper,
        lower=lower,
        generator=subject.circuit.generator.net,
        moving=subject.system.displacement[0] if subject.system.displacement else 0,
        keep=keep,
    )
    text = deck.write(
        subject.circuit,
        subject.board,
        subject.excitation,
        settings,
        title="one response of one board",
        stop_time=stop,
        initial=subject.orbit.start,
    )
    signals = (*subject.circuit.state_nets, subject.circuit.generator.net)
    return SpiceJob(text, signals, stop, partial(read, reading=reading))


def contact_rows(system: PiecewiseLinearSystem) -> tuple[Array | None, Array | None]:
    """Rows over (states, generator, 1) of the displacement past the upper, the lower stop."""
    rows = system.contact_rows(0)
    return rows.get(1), rows.get(-1)


def shortest_contact(orbit: Orbit, system: PiecewiseLinearSystem, excitation: Excitation) -> float:
    """Length [s] of the orbit's shortest contact; the period where there is none."""
    period = 1.0 / excitation.frequency
    upper, lower = contact_rows(system)
    if orbit.n == 0 or len(orbit.impact_times) == 0:
        return period
    flow = Flow(system, Drive(2.0 * np.pi * excitation.frequency, -excitation.amplitude))
    points = 2000
    trace = flow.run(orbit.start, orbit.n, points=points).strobes
    phase = 2.0 * np.pi * np.arange(len(trace)) / points
    u = -excitation.amplitude * np.sin(phase)
    shortest = period
    for row in (upper, lower):
        if row is None:
            continue
        touching = trace @ row[:-2] + row[-2] * u + row[-1] > 0.0
        change = np.diff(touching.astype(int))
        entries, exits = np.flatnonzero(change > 0), np.flatnonzero(change < 0)
        for entry in entries:
            after = exits[exits > entry]
            if len(after):
                shortest = min(shortest, float(after[0] - entry) * period / points)
    return shortest


def check(pool: SpicePool, subjects: Sequence[Subject]) -> list[GateResult]:
    """Find the coarsest settings that pass, for the nominal board of each response.

    All subjects move through the levels together, so that the workers stay busy.
    """
    steps = []
    for s in subjects:
        shortest = shortest_contact(s.orbit, s.system, s.excitation)
        contact = int(np.ceil(STEPS_PER_CONTACT * s.period / shortest))
        steps.append(max(STEPS_PER_PERIOD, contact))
    results: list[GateResult | None] = [None] * len(subjects)
    tried: list[list[int]] = [[] for _ in subjects]
    for level in range(LEVELS):
        open_ = [i for i, r in enumerate(results) if r is None or not r.passed]
        jobs = []
        for i in open_:
            tried[i].append(steps[i] * 2**level)
            trio = _trio(subjects[i].period / tried[i][-1])
            jobs += [job(subjects[i], settings, keep=True) for settings in trio]
        found = dict(pool.map(jobs))
        for k, i in enumerate(open_):
            runs = [found[3 * k + j] for j in range(3)]
            first = _trio(subjects[i].period / tried[i][-1])[0]
            results[i] = _judge(subjects[i], first, runs, tuple(tried[i]))
    return [r for r in results if r is not None]


def _trio(step: float) -> tuple[SolverSettings, SolverSettings, SolverSettings]:
    """The settings under test, the same at half the step, and the other method."""
    return (
        SolverSettings("trap", step),
        SolverSettings("trap", step / 2.0),
        SolverSettings("gear", step / 2.0),
    )


def _judge(
    subject: Subject,
    settings: SolverSettings,
    runs: Sequence[Read | SimulationFailed],
    tried: tuple[int, ...],
) -> GateResult:
    good = [r for r in runs if isinstance(r, Read)]
    if len(good) < len(runs):
        return GateResult(settings, False, float("nan"), runs[0], tried)
    wanted = subject.orbit
    same = all(r.orbit.response == wanted.response for r in good)
    difference = float("nan")
    if wanted.status is OrbitStatus.PERIODIC:
        peak = np.abs(wanted.extremes).max(axis=1)
        last = [r.strobes[-wanted.n :] for r in good]
        difference = max(float((np.abs(a - b) / peak).max()) for a, b in _pairs(last))
    passed = same and bool(difference <= BOUND or wanted.status is not OrbitStatus.PERIODIC)
    return GateResult(settings, passed, difference, runs[0], tried)


def _pairs(items: Sequence[Array]) -> Iterator[tuple[Array, Array]]:
    for i, a in enumerate(items):
        for b in items[i + 1 :]:
            yield a, b
