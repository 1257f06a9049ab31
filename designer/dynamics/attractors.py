"""Which attractor a start leads to: settling, shooting, classification.

Settle for 20 drive periods, look for the period n at which the strobe nearly repeats, polish by
Newton's method on the n-period map and accept only what converged, is stable, lies where the
settling had arrived and draws the settling trajectory in; otherwise settle longer (40, 140, 800,
4000 periods in all). Newton at once would be faster and wrong: it also lands on unstable orbits and
on other attractors. What is chaotic after 800 or 4000 periods is watched for longer, since chaos
may be a transient. What has neither a short period nor chaos is run on, and is of a long period,
quasi-periodic, weakly chaotic, or not settled.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
import scipy

from designer.base import jit
from designer.base.arrays import Array
from designer.base.atomic_write import NotWritten, appearing
from designer.dynamics import step_budget
from designer.dynamics.counts import MAX_PERIOD
from designer.dynamics.flow import MAX_EVENTS, Flow
from designer.dynamics.flow_result import FlowResult, FlowStatus
from designer.dynamics.lyapunov_exponent import (
    BLOCK,
    Bound,
    LyapunovExponent,
    lyapunov,
    sign,
)
from designer.dynamics.orbit import SURE, Orbit, OrbitStatus, peaks_of
from designer.dynamics.piecewise_linear import ModeKey
from designer.dynamics.quasi_periodic import DRIFT, closed_curve, frequencies
from designer.dynamics.step_budget import Budget
from designer.kernels.kernel_orbit import (
    CHAOS,
    CLOSING,
    NEAR,
    STROBE_TOLERANCE as STROBE_TOLERANCE,
    WORTH,
)

STAGES = (20, 20, 100, 660, 3200)
LONG_PERIOD = 4 * MAX_PERIOD
"""Longest period that is looked for where there is neither one up to ``MAX_PERIOD`` nor chaos, and
the strobe does not come back by itself."""
LAST = 12_800
"""Drive periods of the run that decides where no stage did."""
FIRST = 300
"""Drive periods over which chaos is first looked for."""
FAINTEST = Bound(1.0 / SURE, 0.0, 20_000)
"""How long an exponent is measured for its sign."""
PLAIN = 3e-8
"""Difference of the two halves in the rotation number below which the run of the last stage is long
enough to call a motion quasi-periodic."""
ON_TORUS = Bound(0.0, 1e-3, 20_000)
"""How closely the exponent of a torus has to be 0."""
LOOK = 300
"""Drive periods between two looks at whether chaos has ended on a periodic orbit."""
WATCH = 4000
"""Drive periods that a single chaotic motion is watched for before it is called one."""
NEARLY = 1e-6
"""Of the spread of each state: a strobe that has come back as near as this is worth polishing,
whatever its period."""
TURNS = 4
"""How often a motion whose chaos has ended is settled anew."""
RATTLES = (
    f"more than {MAX_EVENTS} changes of contact in a drive period: something rests on a stop whose "
    "force jumps at the touch, and rattles on it lower and faster without end"
)
"""Why a motion is given up that would have to be followed through infinitely many impacts."""
ENGINE_ERROR = 1e-10
"""Of the peak: contacts shallower and misses nearer than this are undecided."""


Finder = Callable[[Flow, FlowResult], tuple[Orbit | None, int]]
"""The orbit that a run has arrived at, if any, and the drive periods that finding it cost."""


def settle(
    flow: Flow,
    x: Array,
    mode: ModeKey | None = None,
    budget: Budget | None = None,
    *,
    watch: int = WATCH,
) -> Orbit:
    """The attractor reached from state x (n,) at drive phase 0.

    budget : steps that it may take, ``step_budget.SETTLING`` by default; with none left its status
    is not settled, and the reason says after how many drive periods. watch : drive periods that
    chaos is watched for, since it may end; 0 where that is done for many starts together
    (``coexisting_attractors.outlived``).

    Returns an orbit of any status; it never raises for lack of an answer.
    """
    with flow.within(Budget(step_budget.SETTLING) if budget is None else budget) as given:
        return _settle(flow, x, mode, given, watch)


def _settle(flow: Flow, x: Array, mode: ModeKey | None, budget: Budget, watch: int) -> Orbit:
    spent = 0
    for _ in range(TURNS):
        orbit = _arrive(flow, x, mode, budget)
        spent += orbit.periods
        if orbit.status is not OrbitStatus.APERIODIC or not watch:
            return replace(orbit, periods=spent)
        watched = _watched(flow, orbit, watch, budget)
        spent += watched.periods
        if not isinstance(watched, _Ended):
            return replace(watched, periods=spent)
        x, mode = watched.start, watched.mode
    reason = f"chaos that ends and comes back, in {spent} drive periods"
    return Orbit(OrbitStatus.NOT_SETTLED, start=x, mode=mode or (), reason=reason, periods=spent)


def _arrive(flow: Flow, x: Array, mode: ModeKey | None, budget: Budget) -> Orbit:
    """What the start leads to, as far as chaos that is no transient."""
    spent = 0
    for stage, periods in enumerate(STAGES):
        found, run, spent = _further(flow, x, mode, periods, spent, budget, _polish)
        if found is not None:
            return found
        x, mode = run.strobes[-1], run.mode
        if stage >= 3:
            growth = lyapunov(flow, x, mode, FIRST)
            spent, x, mode = spent + FIRST, growth.start, growth.mode
            if growth.value * flow.drive.period > CHAOS and growth.sign > 0:
                return _unperiodic(OrbitStatus.APERIODIC, growth, spent)
            orbit, cost = long_orbit(flow, x, mode)
            spent += cost
            if orbit is None and stage == 4:
                orbit, cost = _regular(flow, run, PLAIN)
                spent += cost
            if orbit is not None:
                return replace(orbit, periods=spent)
    for last in (False, True):
        found, run, spent = _further(flow, x, mode, LAST, spent, budget, _regular)
        if found is not None:
            return found
        x, mode = run.strobes[-1], run.mode
        if not run.counts.any() and _decays(flow, mode):
            break
        if not last:  # a growth too small to be seen at once
            growth = lyapunov(flow, x, mode, FIRST, FAINTEST)
            spent, x, mode = spent + BLOCK * len(growth.rates), growth.start, growth.mode
            if growth.sign > 0:
                return _unperiodic(OrbitStatus.APERIODIC, growth, spent)
    why = (
        f"after {spent} drive periods neither a period nor chaos nor a closed curve of strobes: "
        "very slow, or of more than two frequencies"
    )
    return _unperiodic(OrbitStatus.NOT_SETTLED, growth, spent, why)


def _further(
    flow: Flow,
    x: Array,
    mode: ModeKey | None,
    periods: int,
    spent: int,
    budget: Budget,
    find: Finder,
) -> tuple[Orbit | None, FlowResult, int]:
    """More drive periods: what ends the search, if anything does, the run, and all that was spent.

    find : looks for the orbit that the run has arrived at.
    """
    run = flow.run(x, periods, mode=mode)
    spent += len(run.strobes) - 1
    if run.status is not FlowStatus.DONE:
        return _stopped(flow, run, spent, budget), run, spent
    orbit, cost = find(flow, run)
    spent += cost
    return None if orbit is None else replace(orbit, periods=spent), run, spent


def _stopped(flow: Flow, run: FlowResult, spent: int, budget: Budget) -> Orbit:
    """What is said of a motion whose run came to no end."""
    diverged = run.status is FlowStatus.DIVERGED
    status = OrbitStatus.DIVERGED if diverged else OrbitStatus.NOT_SETTLED
    reason = str(run.status)
    if run.status is FlowStatus.CHATTER and not flow.system.continuous:
        reason = RATTLES
    if run.status is FlowStatus.TOO_LONG:
        reason = _too_long(flow, spent, budget)
    return Orbit(status, reason=reason, periods=spent)


def _regular(flow: Flow, run: FlowResult, drift: float = DRIFT) -> tuple[Orbit | None, int]:
    """The stable orbit or the torus that a long run has arrived at, if any; also what it cost.
    drift : by how much the two halves of a torus may differ in its rotation number."""
    periods, strobes = list(range(1, LONG_PERIOD + 1)), run.strobes
    spread = np.maximum(np.ptp(strobes, axis=0), 1e-300)
    back = np.abs(strobes[: -len(strobes) // 2 : -1] - strobes[-1]) / spread
    near = np.flatnonzero(back.max(axis=1)[1:] < NEARLY)
    if len(near):
        periods += [n for n in (int(near[0]) + 1,) if n > LONG_PERIOD]
    orbit, cost = _polish(flow, run, periods)
    if orbit is not None:
        return orbit, cost
    curve = closed_curve(strobes)
    if curve is None or curve.error > drift or (not run.counts.any() and _decays(flow, run.mode)):
        return None, cost
    growth = lyapunov(flow, strobes[-1], run.mode, FIRST, ON_TORUS)
    cost += BLOCK * len(growth.rates)
    if growth.sign:
        return None, cost
    torus = _unperiodic(OrbitStatus.QUASI_PERIODIC, growth, 0)
    return replace(torus, frequencies=frequencies(flow, growth.start, growth.mode, curve)), cost


def _decays(flow: Flow, mode: ModeKey) -> bool:
    """Whether free motion in this mode dies out. Without an impact its one attractor then has the
    drive's own period, however long it repeats as if it had settled."""
    rates = np.linalg.eigvals(flow.system.mode(mode).A)
    return bool(rates.real.max() < -1e-12 * np.abs(rates).max())


@dataclass(frozen=True)
class _Ended:
    """Chaos that is over: where the motion is then."""

    start: Array
    mode: ModeKey | None
    periods: int


def _watched(flow: Flow, orbit: Orbit, periods: int, budget: Budget) -> Orbit | _Ended:
    """A chaotic motion after so many more drive periods: chaotic still, the periodic orbit that it
    has ended on, or not chaotic any more. The drive periods are those of the watch alone."""
    x, mode, spent = orbit.start, orbit.mode or None, 0
    while spent < periods:
        length = min(LOOK, periods - spent)
        found, run, spent = _further(flow, x, mode, length, spent, budget, _polish)
        if found is not None:
            return found
        x, mode = run.strobes[-1], run.mode
    growth = lyapunov(flow, x, mode, min(FIRST, periods), FAINTEST)
    spent += BLOCK * len(growth.rates)
    if growth.sign > 0:
        return _unperiodic(OrbitStatus.APERIODIC, growth, spent)
    return _Ended(growth.start, growth.mode, spent)


def followed(flow: Flow, orbit: Orbit, periods: int, budget: Budget | None = None) -> Orbit:
    """An aperiodic motion followed for so many more drive periods: itself where it is chaotic to
    their end, else what it leads to."""
    with flow.within(Budget(step_budget.SETTLING) if budget is None else budget) as given:
        watched = _watched(flow, orbit, periods, given)
        spent = orbit.periods + watched.periods
        if isinstance(watched, _Ended):
            watched = _settle(flow, watched.start, watched.mode, given, periods)
            spent += watched.periods
        return replace(watched, periods=spent)


def _unperiodic(
    status: OrbitStatus, growth: LyapunovExponent, spent: int, reason: str = ""
) -> Orbit:
    return Orbit(
        status,
        start=growth.start,
        mode=growth.mode,
        lyapunov=growth.value,
        lyapunov_error=growth.error,
        reason=reason,
        periods=spent,
    )


def long_orbit(flow: Flow, x: Array, mode: ModeKey | None = None) -> tuple[Orbit | None, int]:
    """The stable orbit of a period above ``MAX_PERIOD``, up to ``LONG_PERIOD``, that the motion
    through x (states,) is on or near, if any; also the drive periods that this cost."""
    run = flow.run(x, LONG_PERIOD, mode=mode)
    if run.status is not FlowStatus.DONE:
        return None, len(run.strobes) - 1
    orbit, cost = _polish(flow, run, range(MAX_PERIOD + 1, LONG_PERIOD + 1))
    return orbit, LONG_PERIOD + cost


def _too_long(flow: Flow, spent: int, budget: Budget) -> str:
    """Why settling was cut short."""
    return (
        f"no period was found in {spent} drive periods; more are not run, since they took "
        f"{budget.spent:.2g} steps: the fastest motion of the model is "
        f"{flow.steps_a_period:.2g} steps to a drive period, or its contacts are that fast"
    )


def peaks_near(flow: Flow, x: Array, mode: ModeKey | None = None, points: int = 32) -> Array:
    """(states,) peak of each state over the drive period that starts at x: at the strobe alone a
    value may be tiny beside it."""
    return peaks_of(flow.run(x, 1, mode=mode, points=points).strobes.T)


def shoot(
    flow: Flow, x: Array, n: int, mode: ModeKey | None = None, peak: Array | None = None
) -> tuple[Array, Array] | None:
    """A fixed point of the n-period map near x, with its monodromy matrix, or None.

    Newton with at most eight evaluations; converged means that the map moves the point by less
    than 1e-11 of the peak. Finds unstable orbits as well as stable ones, and does not check that
    n is the least period.
    """
    size = len(x)
    last = np.inf
    if peak is None:
        peak = peaks_near(flow, x, mode)
    for _ in range(8):
        run = flow.run(x, n, mode=mode, tangent=np.eye(size))
        if run.status is not FlowStatus.DONE or run.tangent is None:
            return None
        step = run.strobes[-1] - x
        error = float((np.abs(step) / peak).max())
        if error < 1e-11 or (error < 1e-9 and error >= 0.5 * last):
            return x, run.tangent
        try:
            x = x - np.linalg.solve(run.tangent - np.eye(size), step)
        except np.linalg.LinAlgError:
            return None
        if not np.all(np.isfinite(x)) or np.abs(x).max() > 1e6 * peak.max():
            return None
        last, mode = error, None
    return None


def describe(
    flow: Flow, x: Array, n: int, monodromy: Array, mode: ModeKey | None = None, laps: int = 3
) -> Orbit:
    """The orbit through the fixed point x (states,) of the n-period map, over laps·n periods.

    Checks by running that the strobe repeats, counts impacts, refines extremes. Unstable orbits
    want a single lap: what rounding leaves grows by their multipliers.
    """
    run = flow.run(x, laps * n, mode=mode, measure=True)
    if run.status is not FlowStatus.DONE:
        return Orbit(OrbitStatus.NOT_SETTLED, reason=f"while classifying period {n}: {run.status}")
    peak = peaks_of(run.extremes)
    drift = np.abs(run.strobes - np.tile(run.strobes[:n], (laps + 1, 1))[: laps * n + 1])
    multipliers = np.linalg.eigvals(monodromy).astype(complex)
    # Entries at the very strobe may fall into one lap or the next: judge them together.
    met = run.counts.sum(axis=0) / laps
    first, *more = [(round(upper), round(lower)) for lower, upper in met] or [(0, 0)]
    once = run.impacts.time < n * flow.drive.period
    status = OrbitStatus.PERIODIC
    floors = ENGINE_ERROR * np.abs(run.spans).max(axis=1)
    if (drift > STROBE_TOLERANCE * peak).any():
        status = OrbitStatus.NOT_SETTLED
    elif run.clipped_time > 0.0:
        status = OrbitStatus.CLIPPED
    elif (run.graze.min(axis=1) < floors).any() or run.tangencies:
        status = OrbitStatus.GRAZING
    span = n * flow.drive.period
    radius = float(np.abs(multipliers).max())
    return Orbit(
        status=status,
        n=n,
        p=first[0],
        q=first[1],
        more=tuple(more),
        start=run.strobes[0],
        mode=flow.mode_at(x, 0.0, mode),
        extremes=run.extremes,
        spans=run.spans,
        speeds=run.speeds,
        impact_times=run.impacts.time[once],
        impact_velocities=run.impacts.velocity[once],
        impact_sides=run.impacts.side[once].astype(float),
        impact_clearances=run.impacts.clearance[once],
        asymmetry=asymmetry(flow, x, n, peak),
        multipliers=multipliers,
        lyapunov=float(np.log(radius) / span) if radius > 0.0 else -np.inf,
        graze=run.graze,
        reason="" if status is OrbitStatus.PERIODIC else f"while classifying period {n}",
    )


def asymmetry(flow: Flow, x: Array, n: int, peak: Array, points: int = 128) -> float:
    """max over t of |x(t + nT/2) - image of x(t)| relative to each state's peak, with the image in
    the system's mirror or, where it has none, its ``reflection``; nan for even n, and where the
    flow does not come to an end."""
    run = flow.run(x, n, points=points) if n % 2 else None
    if run is None or run.status is not FlowStatus.DONE:
        return float("nan")
    trace = run.strobes[:-1]
    half = n * points // 2
    system = flow.system
    mirror = system.reflection if system.mirror is None else system.mirror
    image = -trace if mirror is None else trace @ mirror.T
    return float((np.abs(np.roll(trace, -half, axis=0) - image).max(axis=0) / peak).max())


def with_exponent(flow: Flow, orbit: Orbit) -> Orbit:
    """An aperiodic motion with its exponent to ``lyapunov_exponent.Bound``, or what it is where
    that shows that its chaos was a transient, with the life of that; any other as it is."""
    if orbit.status is not OrbitStatus.APERIODIC or not len(orbit.start):
        return orbit
    if Bound().holds(orbit.lyapunov, orbit.lyapunov_error, flow.drive.period):
        return orbit
    with flow.within(Budget(step_budget.SETTLING)) as budget:
        growth = lyapunov(flow, orbit.start, orbit.mode or None, FIRST, Bound())
        spent = orbit.periods + BLOCK * len(growth.rates)
        if min(growth.sign, sign(growth.rates[-len(growth.rates) // 4 :])) <= 0:
            later = _settle(flow, growth.start, growth.mode, budget, WATCH)
            return _outgrown(later, spent + later.periods)
        run = flow.run(growth.start, 2 * MAX_PERIOD, mode=growth.mode)
        found, cost = _polish(flow, run) if run.status is FlowStatus.DONE else (None, 0)
        if found is not None:
            return _outgrown(found, spent + len(run.strobes) - 1 + cost)
        return _unperiodic(OrbitStatus.APERIODIC, growth, spent)


def _outgrown(orbit: Orbit, periods: int) -> Orbit:
    """Where a chaotic motion is found after these drive periods, its life if it has ended."""
    ended = orbit.status not in (OrbitStatus.APERIODIC, OrbitStatus.NOT_SETTLED)
    return replace(orbit, periods=periods, transients=(periods,) if ended else ())


def starts(scale: Array, count: int, seed: int = 0, first: Array | None = None) -> Array:
    """(count, n) initial states: rest, or ``first``, then a scrambled Sobol set in the box
    ± scale."""
    box = _sobol(len(scale), max(1, 1 << (count - 1).bit_length()), seed)
    rest = np.zeros(len(scale)) if first is None else first
    return np.vstack([rest, scale * (2.0 * box - 1.0)])[:count]


def _sobol(size: int, count: int, seed: int) -> Array:
    """(count, size) points of a scrambled Sobol set in [0, 1).

    Those of seed 0 are kept beside the compiled kernels: most models take less time to find a
    response than SciPy's statistics to import.
    """
    folder = jit.CACHE if seed == 0 else None
    made_by = f"{scipy.__version__}-{np.__version__}"  # NumPy draws what scrambles
    kept = None if folder is None else folder / f"sobol-{made_by}-{size}-{count}.npy"
    if kept is not None:
        with suppress(OSError, ValueError, EOFError):
            known = np.load(kept)
            if _is_sobol(known, size, count):
                return np.asarray(known)
    from scipy.stats import qmc

    points = np.asarray(qmc.Sobol(size, seed=seed).random(count))
    if kept is not None:
        with suppress(NotWritten), appearing(kept) as partial, partial.open("wb") as file:
            np.save(file, points)
    return points


def _is_sobol(points: Array, size: int, count: int) -> bool:
    """Whether an array has the form of a Sobol set of 2^m points: along each axis one of them in
    each of so many equal parts of [0, 1)."""
    if points.dtype != float or points.shape != (count, size):
        return False
    parts = np.sort(np.floor(count * points), axis=0)
    return bool((parts == np.arange(count)[:, None]).all())


def same(flow: Flow, a: Orbit, b: Orbit) -> bool:
    """Whether two orbits are one, up to the strobe they start at and the mirror."""
    if a.status is not b.status or a.counts.family != b.counts.family:
        return False
    if a.status is not OrbitStatus.PERIODIC:
        return True
    laps = flow.run(b.start, b.n).strobes[:-1]
    candidates = [laps]
    if flow.system.mirror is not None:
        candidates.append(mirrored_strobes(flow, b))
    return any(bool((np.abs(c - a.start) < 1e-6 * b.peaks).all(axis=1).any()) for c in candidates)


def mirrored_strobes(flow: Flow, orbit: Orbit) -> Array:
    """(n, states) strobes of the mirror twin: the orbit half a drive period on, reflected."""
    assert flow.system.mirror is not None
    trace = flow.run(orbit.start, orbit.n, points=2).strobes
    return np.asarray(trace[1:-1:2] @ flow.system.mirror.T)


def twin(flow: Flow, orbit: Orbit) -> Orbit | None:
    """The mirror twin of a periodic orbit, or None where the system has no mirror."""
    if flow.system.mirror is None or orbit.status is not OrbitStatus.PERIODIC:
        return None
    x = mirrored_strobes(flow, orbit)[0]
    shot = shoot(flow, x, orbit.n)
    if shot is None:
        return None
    return replace(describe(flow, shot[0], orbit.n, shot[1]), transients=orbit.transients)


def _polish(
    flow: Flow, run: FlowResult, periods: Iterable[int] = range(1, MAX_PERIOD + 1)
) -> tuple[Orbit | None, int]:
    """Try to turn the end of a settling run into an orbit of one of these periods; also what it
    cost."""
    strobes, cost = run.strobes, 1
    peak = peaks_near(flow, strobes[-1], run.mode)
    for n in (n for n in periods if n < len(strobes)):
        gap = np.abs(strobes[-1] - strobes[-1 - n]) / peak
        if gap.max() > WORTH:
            continue
        shot = shoot(flow, strobes[-1], n, run.mode, peak)
        cost += 8 * n
        if shot is None:
            continue
        x, monodromy = shot
        once = flow.run(x, n)
        if once.status is not FlowStatus.DONE:
            continue
        laps = once.strobes
        closes = np.all(np.abs(laps - x) <= STROBE_TOLERANCE * peak, axis=1).tolist()
        least = next((d for d in range(1, n + 1) if n % d == 0 and closes[d]), None)
        if least is None:  # begun anew, in the mode that its start tells, it is another motion
            continue
        if least < n:
            shorter = shoot(flow, x, least, None, peak)
            if shorter is None:
                continue
            x, monodromy = shorter
        radius = float(np.abs(np.linalg.eigvals(monodromy)).max())
        if radius >= 1.0 or (np.abs(x - strobes[-1]) / peak).max() >= NEAR:
            continue
        turns = int(np.clip(np.log(1e-4) / np.log(max(radius, 1e-3)), 2, max(CLOSING // n, 1)))
        cost += turns * n
        if not _closes_in(flow, run, x, turns * n, radius**turns, peak):
            continue
        orbit = describe(flow, x, least, monodromy)
        cost += 5 * n
        if orbit.status is not OrbitStatus.NOT_SETTLED:
            return orbit, cost
    return None, cost


def _closes_in(
    flow: Flow, run: FlowResult, x: Array, periods: int, factor: float, peak: Array
) -> bool:
    """Whether the settling trajectory itself goes to the orbit through x: a passing one leaves.

    factor : what the multipliers say of the distance after ``periods``; ten times that is granted.
    """
    later = flow.run(run.strobes[-1], periods, mode=run.mode)
    if later.status is not FlowStatus.DONE:
        return False
    before = float((np.abs(run.strobes[-1] - x) / peak).max())
    after = float((np.abs(later.strobes[-1] - x) / peak).max())
    return after <= max(10.0 * factor * before, STROBE_TOLERANCE)
