"""The steady motion that a start leads to, as a bifurcation diagram shows it.

A transient is run and left out; over the periods kept after it the least displacement of each and
every impact on the stops of interest are noted, and the motion is named n-p-q by the rules of
``dynamics.attractors``. Two engines: the compiled one for models (``kernels.kernel_sweep``), and
the general flow, which is slow and obvious, and serves boards and whatever the fast path does not
fit.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, replace

import numpy as np

from designer.base.arrays import Array
from designer.base.threads import interrupt
from designer.dynamics import attractors
from designer.dynamics.attractors import followed, peaks_near, settle
from designer.dynamics.counts import MAX_PERIOD, Pairs
from designer.dynamics.flow import MAX_EVENTS, Flow
from designer.dynamics.flow_result import FlowStatus
from designer.dynamics.lyapunov_exponent import (
    BLOCK,
    Bound,
    LyapunovExponent,
    lyapunov,
    until,
)
from designer.dynamics.orbit import SYMMETRY_TOLERANCE, Motion, Orbit, OrbitStatus
from designer.dynamics.step_budget import Budget
from designer.kernels import kernel_orbit, kernel_sweep as kernel
from designer.kernels.kernel_modal import ModalTables, Watch
from designer.kernels.kernel_orbit import CHAOS, WORTH

SURELY = 1e-6
"""Below it at half a period, an asymmetry stays far under the tolerance at all other times."""
ROOM = 48
"""Impacts on the upper stop per period that are kept at first; more where there are more."""
SWEPT = Bound(relative=0.1, absolute=0.0, periods=4000)
"""Of the exponents of a diagram; a single motion's is measured ten times as closely."""
WATCHES = 2
"""How many times the periods of settling chaos is watched for, since it may end."""
_STATUS = {
    kernel.PERIODIC: OrbitStatus.PERIODIC,
    kernel.APERIODIC: OrbitStatus.APERIODIC,
    kernel.NOT_SETTLED: OrbitStatus.NOT_SETTLED,
}
_STOPPED = {
    kernel_orbit.TOO_MANY_EVENTS: OrbitStatus.NOT_SETTLED,
    kernel_orbit.DIVERGED: OrbitStatus.DIVERGED,
}


@dataclass(frozen=True)
class TransientSettings:
    """How many drive periods a run towards a steady state takes."""

    settle: int = 500
    """Drive periods that are left out at the start."""
    keep: int = 30
    """Drive periods that are kept and shown."""
    patience: int = 4000
    """Drive periods that are added at most while the motion is undecided."""

    @property
    def tangents(self) -> int:
        """Of those left out, the last ones, over which the exponent is taken."""
        return self.settle // 2


@dataclass(frozen=True)
class SteadyMotion(Motion):
    """What a start leads to."""

    status: OrbitStatus
    """Periodic, quasi-periodic, aperiodic, not settled or diverged; of a board also clipped (an
    op-amp is at its limit). Never grazing: a count within rounding of a tangency is given as it was
    run."""
    n: int
    p: int
    q: int
    symmetric: bool | None
    """Whether the motion is its own mirror image; None unless periodic."""
    lyapunov: float
    """Largest exponent per unit of the system's time; of a periodic motion, by its multipliers."""
    radius: float
    """Largest modulus of the multipliers (nan unless periodic)."""
    start: Array
    """(states,) a strobe of the orbit, or where the motion was left."""
    end: Array
    """(states,) strobe at the end of what is shown."""
    minima: Array
    """(keep,) least displacement in the first clearance in each period kept."""
    velocities: Array
    """(k,) velocity where contact with the first stop of interest begins, in those periods: the
    upper stop of the first clearance unless others were asked for."""
    periods: int
    """Drive periods that were run in all."""
    more: Pairs = ()
    lyapunov_error: float = float("nan")
    """Standard error of ``lyapunov``; nan of a periodic motion."""
    further: tuple[Array, ...] = ()
    """The same as ``velocities`` of each further stop of interest."""


Stops = tuple[tuple[int, int], ...]
"""Stops of interest: index of the clearance, and 1 for its upper stop or -1 for the lower."""
UPPER: Stops = ((0, 1),)
"""The upper stop of the first clearance, the one that the fast path watches."""


@dataclass(frozen=True)
class DrivenSystem:
    """A system under a drive."""

    flow: Callable[[], Flow]
    """Makes the system's flow."""
    period: float
    """Period of the drive, in the system's time."""
    tables: ModalTables | None = None
    """Tables of the fast path; None where steady states are found by the flow."""
    stops: Stops = UPPER
    """The stops whose impacts are noted; others than ``UPPER`` need the flow."""

    def steady(
        self, x: Array, course: TransientSettings, budget: Budget | None = None
    ) -> SteadyMotion:
        """What the start x (states,) leads to. budget : steps for a motion that the compiled engine
        does not name; those of ``settle`` unless given.

        Raises
        ------
        KeyboardInterrupt : ``dynamics.flow.interruption`` was set by another thread.
        """
        if interrupt.is_set():
            raise KeyboardInterrupt
        if self.tables is None or self.stops != UPPER:
            flow = self.flow()
            with nullcontext() if budget is None else flow.within(budget):
                steady = by_flow(flow, x, course, self.stops, budget)
        else:
            steady = _by_kernel(self.flow, self.tables, self.period, x, course, budget)
        return _outlasting(self.flow, steady, course, budget)


def _outlasting(
    flow: Callable[[], Flow], steady: SteadyMotion, course: TransientSettings, budget: Budget | None
) -> SteadyMotion:
    """What is left of chaos after it was watched for ``WATCHES`` times the periods of settling."""
    if steady.status is not OrbitStatus.APERIODIC:
        return steady
    chaos = Orbit(
        steady.status,
        start=steady.end,
        lyapunov=steady.lyapunov,
        lyapunov_error=steady.lyapunov_error,
    )
    later = followed(flow(), chaos, WATCHES * course.settle, budget)
    if later.status is OrbitStatus.APERIODIC:
        return replace(steady, periods=steady.periods + later.periods)
    extremes = (steady.minima, steady.velocities, *steady.further)
    return _of_orbit(later, steady.end, extremes, steady.periods)


def by_flow(
    flow: Flow,
    x: Array,
    course: TransientSettings,
    stops: Stops = UPPER,
    budget: Budget | None = None,
) -> SteadyMotion:
    """By the general flow, period after period. stops : whose impacts are noted, one at least.
    budget : steps for settling."""
    growth, state = None, np.array(x, dtype=float)
    free = course.settle - course.tangents
    spent = course.settle + course.keep
    if free:
        run = flow.run(state, free)
        if run.status is not FlowStatus.DONE:
            return stopped(run.status, state, spent)
        state = run.strobes[-1]
    if course.tangents:
        growth = lyapunov(flow, state, None, course.tangents)
        state = growth.start
    strobes, minima = [state], []
    velocities: list[list[float]] = [[] for _ in stops]
    for _ in range(course.keep):
        run = flow.run(strobes[-1], 1, measure=True)
        if run.status is not FlowStatus.DONE:
            return stopped(run.status, strobes[-1], spent)
        strobes.append(run.strobes[-1])
        minima.append(float((run.spans if len(run.spans) else run.extremes)[0, 0]))
        for met, (clearance, side) in zip(velocities, stops, strict=True):
            here = (run.impacts.side == side) & (run.impacts.clearance == clearance)
            met += run.impacts.velocity[here].tolist()
    end, extremes = strobes[-1], (np.array(minima), *(np.array(met) for met in velocities))
    chaos = growth is not None and growth.value * growth.period > CHAOS
    after = None
    if growth and chaos and course.tangents >= kernel.SPAN and not _repeats(flow, strobes):
        orbit, after = _measured(flow, Orbit(OrbitStatus.APERIODIC, start=end), growth.rates)
    else:
        orbit = settle(flow, end, budget=budget)
        if orbit.status is OrbitStatus.APERIODIC:
            orbit, after = _measured(flow, orbit)
        elif growth is not None and not np.isfinite(orbit.lyapunov):
            orbit = replace(orbit, lyapunov=growth.value)
    if after is not None:
        steady = by_flow(flow, after, course, stops, budget)
        return replace(steady, periods=spent + steady.periods)
    return _of_orbit(orbit, end, extremes, spent)


def _faded(rates: Array) -> bool:
    """Whether chaos was a transient: its tangents shrink in the last quarter of its ``rates``."""
    tail = rates[len(rates) - len(rates) // 4 :]
    return len(tail) > 0 and float(tail.mean()) < -CHAOS


def _measured(flow: Flow, orbit: Orbit, rates: Array | None = None) -> tuple[Orbit, Array | None]:
    """An aperiodic motion with its exponent to ``SWEPT``, or what it is if that is not surely above
    0; also the state that it was left in, if its chaos was a transient. rates : what is known of
    its growth."""
    x, mode = orbit.start, orbit.mode or None

    def further(blocks: int) -> Array:
        nonlocal x, mode
        more = lyapunov(flow, x, mode, BLOCK * (blocks + 1))
        x, mode = more.start, more.mode
        return more.rates

    known = until(SWEPT, np.zeros(0) if rates is None else rates, further)
    growth = LyapunovExponent(known, flow.drive.period, x, mode or ())
    if _faded(known):
        return orbit, x
    if growth.sign <= 0:
        return settle(flow, x, mode), None
    return replace(orbit, lyapunov=growth.value, lyapunov_error=growth.error), None


def _of_orbit(orbit: Orbit, end: Array, extremes: tuple[Array, ...], spent: int) -> SteadyMotion:
    """An orbit with the ``extremes`` of the run that led to it: minima, then impact velocities of
    each stop, after ``spent`` periods."""
    if orbit.status is OrbitStatus.GRAZING:  # a count near a tangency is given as it was run
        orbit = replace(orbit, status=OrbitStatus.PERIODIC)
    periodic = orbit.status is OrbitStatus.PERIODIC
    return SteadyMotion(
        status=orbit.status,
        n=orbit.n if periodic else 0,
        p=orbit.p if periodic else 0,
        q=orbit.q if periodic else 0,
        symmetric=orbit.symmetric,
        lyapunov=orbit.lyapunov,
        lyapunov_error=orbit.lyapunov_error,
        radius=orbit.radius if periodic else float("nan"),
        start=orbit.start if len(orbit.start) else end,
        end=end,
        minima=extremes[0],
        velocities=extremes[1],
        periods=spent + orbit.periods,
        more=orbit.more if periodic else (),
        further=extremes[2:],
    )


def _repeats(flow: Flow, strobes: list[Array]) -> bool:
    """Whether the last strobe is near an earlier one, up to the largest period."""
    peak = peaks_near(flow, strobes[-1])
    earlier = strobes[-1 - min(MAX_PERIOD, len(strobes) - 1) : -1]
    return any(bool((np.abs(s - strobes[-1]) <= WORTH * peak).all()) for s in earlier)


def stopped(status: FlowStatus, x: Array, spent: int) -> SteadyMotion:
    """What a run that came to no end leads to: left at x (states,) after ``spent`` periods."""
    diverged = status is FlowStatus.DIVERGED
    return _nothing(OrbitStatus.DIVERGED if diverged else OrbitStatus.NOT_SETTLED, x, spent)


def _nothing(status: OrbitStatus, x: Array, spent: int) -> SteadyMotion:
    nan, none = float("nan"), np.zeros(0)
    return SteadyMotion(status, 0, 0, 0, None, nan, nan, x, x, none, none, spent)


def _by_kernel(
    flow: Callable[[], Flow],
    tables: ModalTables,
    period: float,
    x: Array,
    course: TransientSettings,
    budget: Budget | None,
) -> SteadyMotion:
    model = kernel.DrivenModel(tables, period, MAX_EVENTS)
    strobes, cursor = np.empty((course.keep + 1, 4)), np.zeros(2, dtype=np.int64)
    rates = np.empty(max(course.tangents - kernel.ALIGN, 0) // kernel.RENEWAL)
    orbit, facts, counted = np.empty(4), np.full(3, np.nan), np.zeros(4, dtype=np.int64)
    room, entries = 0, ROOM * course.keep
    while entries > room:  # more impacts than room: again, with room for all
        room = entries
        watch = Watch(
            np.empty(course.keep), np.empty(room), np.zeros(4), np.zeros(1, dtype=np.int64)
        )
        at = np.array(x, dtype=float)
        growth, code = kernel.motion(
            model, at, course.settle, course.tangents, strobes, watch, cursor, rates,
            course.patience, orbit, facts, counted,
        )  # fmt: skip
        entries = int(watch.entries[0])
    spent = course.settle + course.keep
    if code == kernel.UNNAMED:
        return _nothing(_STOPPED[int(cursor[1])], np.array(x, dtype=float), spent)
    extremes = watch.minima, watch.velocities[:entries].copy()
    spent += int(counted[kernel_orbit.SPENT])
    if code == kernel.NOT_SETTLED and course.patience:  # a long period, or none, but settled
        return _of_orbit(settle(flow(), orbit, budget=budget), strobes[-1], extremes, spent)
    exponent = float(facts[2]) / period, float("nan")
    if code == kernel.APERIODIC:
        plain = growth > CHAOS and course.tangents >= kernel.SPAN  # else it was later that it was
        measured, after = _swept_exponent(model, orbit, rates if plain else rates[:0])
        if after is not None:
            steady = _by_kernel(flow, tables, period, after, course, budget)
            return replace(steady, periods=spent + steady.periods)
        if measured.sign <= 0:
            return _of_orbit(settle(flow(), orbit, budget=budget), strobes[-1], extremes, spent)
        exponent = measured.value, measured.error
    stopped = code == kernel.STOPPED
    n, p, q = (
        int(counted[place]) if code == kernel.PERIODIC else 0
        for place in (0, kernel_orbit.UPPER, kernel_orbit.LOWER)
    )
    return SteadyMotion(
        status=_STOPPED[int(cursor[1])] if stopped else _STATUS[code],
        n=n,
        p=p,
        q=q,
        symmetric=_symmetric(flow, facts[1], orbit, n, watch.peak) if n else None,
        lyapunov=exponent[0],
        lyapunov_error=exponent[1],
        radius=float(facts[0]) if n else float("nan"),
        start=orbit,
        end=strobes[-1],
        minima=extremes[0],
        velocities=extremes[1],
        periods=spent,
    )


def _swept_exponent(
    model: kernel.DrivenModel, x: Array, rates: Array
) -> tuple[LyapunovExponent, Array | None]:
    """Exponent of the chaos through x (4,), of which some rates are known; also the state that it
    was left in, if it was a transient."""
    x = x.copy()

    def further(blocks: int) -> Array:
        return exponents(model, x, blocks)

    known = until(SWEPT, rates, further)
    growth = LyapunovExponent(known, model.period, x, ())
    return growth, x if _faded(known) else None


def exponents(model: kernel.DrivenModel, x: Array, blocks: int) -> Array:
    """Growth of a tangent vector per period over so many blocks of periods from x (4,), which is
    carried along; none where the flow stopped."""
    room, periods, none = np.empty(blocks), kernel.ALIGN + blocks * kernel.RENEWAL, np.zeros(0)
    place, counted = np.zeros(2, dtype=np.int64), np.zeros(0, dtype=np.int64)
    watch = Watch(none, none, none, np.zeros(1, dtype=np.int64))
    kernel.motion(
        model, x, periods, periods, np.empty((1, 4)), watch, place, room, 0, none, none, counted,
    )  # fmt: skip
    return room if place[1] == kernel_orbit.DONE else room[:0]


def _symmetric(flow: Callable[[], Flow], half: float, x: Array, n: int, peak: Array) -> bool:
    """By the asymmetry half a period later; where that leaves it open, at all times."""
    if n % 2 == 0 or half >= SYMMETRY_TOLERANCE:
        return False
    if half < SURELY:
        return True
    return attractors.asymmetry(flow(), x, n, peak) < SYMMETRY_TOLERANCE
