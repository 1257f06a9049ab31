"""What is measured of ngspice on a design's responses: warm starts, errors, throughput, memory."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from designer.base.arrays import Array
from designer.circuit.ensemble import Ensemble
from designer.circuit.netlist import Circuit
from designer.dynamics.counts import MAX_PERIOD
from designer.spice import numerics_gate
from designer.spice.deck import SolverSettings
from designer.spice.numerics_gate import GateSubject
from designer.spice.pool import SpicePool
from designer.spice.read_orbit import STROBE_TOLERANCE, Read
from designer.spice.simulator import SimulationFailed, SpiceJob, Waveforms
from designer.spread.spread import Spread, draw_many

SETTLED = 400
"""Drive periods of the run that a warm start is held against."""


def peak_of(subject: GateSubject) -> Array:
    """(states,) peaks of the exact orbit."""
    return np.asarray(np.abs(subject.orbit.extremes).max(axis=1))


LAST = 50
"""Laps whose median is the settled strobe."""


@dataclass(frozen=True)
class WarmStart:
    """A long run from the exact circuit's orbit.

    gaps : (periods + 1,) distance of each strobe from the settled one, of the peak. Settled is the
    median of the last `LAST` laps, a quarter of the run at most, since each strobe has ngspice's
    noise. needed : the first strobe from which all later ones are within the strobe tolerance.
    predicted : what ``warm_start`` says of the first periods. exact : what the exact circuit's
    multiplier alone says. response : n-p-q at the end. seconds : wall time.
    """

    gaps: Array
    needed: int
    predicted: int
    exact: int
    response: str
    seconds: float


def warm_job(
    subject: GateSubject, settings: SolverSettings, periods: int = SETTLED
) -> SpiceJob[Read]:
    """The run of a warm start; every strobe comes back."""
    n = max(subject.orbit.n, 1)
    long = replace(subject, discard=periods - 4 * n)
    return numerics_gate.job(long, settings, whole=True)


def warm(subject: GateSubject, result: Read, seconds: float = 0.0) -> WarmStart:
    """What a `warm_job` shows."""
    n, peak = max(subject.orbit.n, 1), peak_of(subject)
    strobes = result.strobes
    last = min(LAST * n, len(strobes) // 4)
    settled = np.median(strobes[: -last - 1 : -n], axis=0)
    gaps = (np.abs(strobes - settled) / peak).max(axis=1)
    far = np.flatnonzero(gaps > STROBE_TOLERANCE)
    short = strobes[: numerics_gate.PROBE * n + 1]
    predicted, _ = numerics_gate.settling_periods(short, n, subject.orbit.radius, peak)
    moves = (np.abs(strobes[2 * n] - strobes[n]) / peak).max() / (1.0 - subject.orbit.radius)
    alone = max(np.log(STROBE_TOLERANCE / moves) / np.log(subject.orbit.radius), 0.0)
    return WarmStart(
        gaps=gaps,
        needed=int(far[-1]) + 1 if len(far) else 0,
        predicted=predicted,
        exact=n * (1 + int(np.ceil(alone))),
        response=result.orbit.response,
        seconds=seconds,
    )


# ---------------------------------------------------------------------------------------------
# Throughput


@dataclass(frozen=True)
class Throughput:
    """seconds : wall time of ``samples`` boards on ``jobs`` workers. agreed : runs that show the
    exact circuit's n-p-q; failed : runs that did not count. periods : simulated, on average."""

    samples: int
    jobs: int
    seconds: float
    agreed: int
    failed: int
    periods: float


def boards(
    circuit: Circuit, spread: Spread, nominal: GateSubject, samples: int, jobs: int, seed: int = 1
) -> list[GateSubject]:
    """Boards of a study, each on the orbit of the exact circuit that it settles on."""
    ensemble = Ensemble(draw_many(circuit, spread, seed, range(samples)))
    drives = [nominal.excitation.drive] * samples
    starts = np.tile(nominal.orbit.start, (samples, 1))
    orbits = ensemble.settle(range(samples), drives, starts, jobs=jobs)
    return [
        replace(nominal, reduction=ensemble.reduction(i), orbit=orbit)
        for i, orbit in enumerate(orbits)
        if len(orbit.start)
    ]


def throughput(
    pool: SpicePool, subjects: Sequence[GateSubject], settings: SolverSettings, jobs: int
) -> Throughput:
    """All subjects through the pool, as the study does it (without its refinements)."""
    began = time.perf_counter()
    agreed = failed = 0
    for i, heard in pool.map(numerics_gate.job(s, settings) for s in subjects):
        if isinstance(heard, SimulationFailed):
            failed += 1
        else:
            agreed += heard.orbit.response == subjects[i].orbit.response
    seconds = time.perf_counter() - began
    periods = float(np.mean([numerics_gate.length(s) for s in subjects]))
    return Throughput(len(subjects), jobs, seconds, agreed, failed, periods)


NAIVE_PERIODS = 500


def naive(subjects: Sequence[GateSubject], settings: SolverSettings, jobs: int) -> Throughput:
    """A process for every sample, from discharged capacitors, 500 periods; same settings."""
    rest = [
        replace(
            s,
            start=np.zeros(len(s.circuit.states)),
            discard=NAIVE_PERIODS - 4 * (s.orbit.n or MAX_PERIOD),
        )
        for s in subjects
    ]
    with SpicePool(jobs, "batch", timeout=600.0) as pool:
        return throughput(pool, rest, settings, jobs)


# ---------------------------------------------------------------------------------------------
# Memory


def resident_megabytes(waves: Waveforms, reduce: Callable[[Waveforms], object]) -> float:
    """Resident memory of the worker after it has read a run."""
    reduce(waves)
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def memory(subject: GateSubject, settings: SolverSettings, runs: int) -> list[float]:
    """Resident memory [MB] of one worker after each of so many runs."""
    todo = numerics_gate.job(subject, settings)
    look = partial(resident_megabytes, reduce=todo.reduce)
    one = SpiceJob(todo.netlist, todo.signals, todo.stop, look)
    out = []
    with SpicePool(1) as pool:
        for _, size in pool.map(one for _ in range(runs)):
            assert not isinstance(size, SimulationFailed), size.reason
            out.append(size)
    return out
