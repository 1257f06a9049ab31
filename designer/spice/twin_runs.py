"""The largest Lyapunov exponent in ngspice: how fast two runs from neighbouring states part.

A long run of the board gives states along its motion. From each of some of them a pair of runs sets
out, the second one ``APART`` of the peak away. After each stretch of periods the second is brought
back to that distance along the line between the two (G. Benettin, L. Galgani, A. Giorgilli,
J.-M. Strelcyn, Meccanica 15, 1980, 9). Nothing here knows the exact flow or its tangent vectors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from designer.base.arrays import Array
from designer.base.progress import doing
from designer.dynamics.lyapunov_exponent import batch_error
from designer.dynamics.orbit import SURE, OrbitStatus
from designer.spice.deck import SolverSettings
from designer.spice.numerics_gate import GateResult, GateSubject, deck_of
from designer.spice.pool import SpicePool
from designer.spice.read_orbit import Read, strobes_after
from designer.spice.simulator import SimulationFailed, SpiceJob

APART = 1e-4
"""Distance of the two runs at the beginning of a stretch, as a share of each state's peak. It is
above what the steps of the integration leave by a factor of a hundred."""
PAIRS = 32
"""Pairs of runs: the error is taken from how their growths differ."""
TURNS, STRETCHES = 2, 6
"""Stretches that only turn the distance towards the direction that grows, and those that count."""
LONGEST = 5
"""Drive periods of a stretch, at most."""
STRETCHED = 10.0
"""Growth of the distance in a stretch that its length aims at."""


@dataclass(frozen=True)
class Growth:
    """A largest exponent per second."""

    value: float
    """Its estimate."""
    error: float
    """Its standard error."""


def with_exponents(
    pool: SpicePool, subjects: Sequence[GateSubject], results: Sequence[GateResult]
) -> list[GateResult]:
    """The results of the gate, with ngspice's own exponent where the exact circuit is aperiodic.

    ngspice's motion is aperiodic where that is surely above 0, and not settled where it is not.
    Quasi-periodic motions, whose exponent is 0, are left as they are.
    """
    return [
        _decided(result, exponent(pool, subject, result.settings))
        if _has_exponent(subject, result)
        else result
        for subject, result in zip(subjects, results, strict=True)
    ]


def _has_exponent(subject: GateSubject, result: GateResult) -> bool:
    chaotic = subject.orbit.status is OrbitStatus.APERIODIC
    return (
        chaotic and subject.fidelity == "ideal" and result.passed and isinstance(result.read, Read)
    )


def _decided(result: GateResult, growth: Growth | SimulationFailed) -> GateResult:
    assert isinstance(result.read, Read)
    if isinstance(growth, SimulationFailed):
        return replace(result, read=growth, passed=False)
    orbit = replace(result.read.orbit, lyapunov=growth.value, lyapunov_error=growth.error)
    if not growth.value > SURE * growth.error:
        reason = (
            f"exponent {growth.value:.3g} ± {growth.error:.1g} per second is not surely above 0"
        )
        orbit = replace(orbit, status=OrbitStatus.NOT_SETTLED, reason=reason)
    return replace(result, read=replace(result.read, orbit=orbit))


def exponent(
    pool: SpicePool, subject: GateSubject, settings: SolverSettings
) -> Growth | SimulationFailed:
    """The exponent of a subject whose motion has no period, from its orbit's start, with ideal
    op-amps (others have states of their own)."""
    growth = max(subject.orbit.lyapunov * subject.period, 1e-3)
    periods = int(np.clip(np.log(STRETCHED) / growth, 1, LONGEST))
    along = PAIRS * (TURNS + STRETCHES) * periods
    doing(f"exponent in ngspice: a run of {along} periods")
    first = _job(subject, settings, subject.orbit.start, along, whole=True)
    strobes = _results(pool, [first])[0]
    if isinstance(strobes, SimulationFailed):
        return strobes
    peak = np.maximum(np.abs(strobes).max(axis=0), 1e-12)
    bases = strobes[:: (TURNS + STRETCHES) * periods][:PAIRS]
    random = np.random.default_rng(0).standard_normal(bases.shape)
    others = bases + APART * peak * random / _length(random)[:, None]
    rates = np.zeros((PAIRS, STRETCHES))
    for stretch in range(TURNS + STRETCHES):
        doing(f"exponent in ngspice: stretch {stretch + 1} of {TURNS + STRETCHES}")
        starts = np.concatenate([bases, others])
        ends = _results(pool, [_job(subject, settings, x, periods) for x in starts])
        failed = next((end for end in ends if isinstance(end, SimulationFailed)), None)
        if failed is not None:
            return failed
        reached = np.array([end[-1] for end in ends if not isinstance(end, SimulationFailed)])
        bases, others = reached[:PAIRS], reached[PAIRS:]
        apart = (others - bases) / peak
        if stretch >= TURNS:
            rates[:, stretch - TURNS] = np.log(_length(apart) / APART) / periods
        others = bases + APART * peak * apart / _length(apart)[:, None]
    each = rates.mean(axis=1) / subject.period
    return Growth(float(each.mean()), batch_error(each))


def _length(apart: Array) -> Array:
    """(k,) lengths of vectors (k, states)."""
    return np.asarray(np.linalg.norm(apart, axis=1))


def _job(
    subject: GateSubject,
    settings: SolverSettings,
    capacitors: Array,
    periods: int,
    *,
    whole: bool = False,
) -> SpiceJob[Array]:
    """The run from a state over so many periods; whole : with every strobe, not the last alone."""
    stop = periods * subject.period
    kept = 0.0 if whole else (periods - 1) * subject.period
    reduce = partial(
        strobes_after, period=subject.period, nets=subject.circuit.state_nets, shift=subject.shift
    )
    text = deck_of(subject, settings, capacitors[: len(subject.circuit.states)], stop, kept)
    return SpiceJob(
        text, subject.circuit.state_nets, stop, reduce, patience=max(periods / 100, 1.0)
    )


def _results(pool: SpicePool, jobs: Sequence[SpiceJob[Array]]) -> list[Array | SimulationFailed]:
    done = dict(pool.map(jobs))
    return [done[k] for k in range(len(jobs))]
