"""Which attractor a start leads to: settling, shooting, classification.

Settle for 20 drive periods, look for the period n at which the strobe nearly repeats, polish by
Newton's method on the n-period map and accept only what converged, is stable, lies where the
settling had arrived and draws the settling trajectory in; otherwise settle longer (40, 140, 800,
4000 periods in all). Newton at once would be faster and wrong: it also lands on unstable orbits and
on other attractors. What has neither a short period nor chaos after 800 periods is looked at for
longer periods, and after 4000 for whether it has settled at all: if not, once more after the many
periods over which a small growth is measured.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from scipy.stats import qmc

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.dynamics import step_budget
from designer.dynamics.counts import MAX_PERIOD
from designer.dynamics.flow import MAX_EVENTS, Flow
from designer.dynamics.flow_result import FlowResult, FlowStatus
from designer.dynamics.lyapunov_exponent import BLOCK, Bound, LyapunovExponent, lyapunov
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.piecewise_linear import ModeKey
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
"""Longest period that is looked for where there is neither one up to ``MAX_PERIOD`` nor chaos."""
STATIONARY = 0.01
"""Change of how far a motion is from repeating, over half of the last stage, below which it has
settled. What approaches an orbit of multiplier ρ changes by 1 - ρ^1600, so only ρ > 0.999994 may be
taken for settled."""
FIRST = 300
"""Drive periods over which chaos is first looked for."""
SURE = 4.0
"""Standard errors that a small exponent has to be above 0 to be called chaos."""
RATTLES = (
    f"more than {MAX_EVENTS} changes of contact in a drive period: something rests on a stop whose "
    "force jumps at the touch, and rattles on it lower and faster without end"
)
"""Why a motion is given up that would have to be followed through infinitely many impacts."""
ENGINE_ERROR = 1e-10
"""Of the peak: contacts shallower and misses nearer than this are undecided."""


def settle(
    flow: Flow, x: Array, mode: ModeKey | None = None, budget: Budget | None = None
) -> Orbit:
    """The attractor reached from state x (n,) at drive phase 0.

    budget : steps that it may take, ``step_budget.SETTLING`` by default; with none left its status
    is not settled, and the reason says after how many drive periods.

    Returns an orbit of any status; it never raises for lack of an answer.
    """
    with flow.within(Budget(step_budget.SETTLING) if budget is None else budget) as given:
        return _settle(flow, x, mode, given)


def _settle(flow: Flow, x: Array, mode: ModeKey | None, budget: Budget) -> Orbit:
    spent = 0
    for stage, periods in enumerate(STAGES):
        run = flow.run(x, periods, mode=mode)
        spent += len(run.strobes) - 1
        if run.status is not FlowStatus.DONE:
            diverged = run.status is FlowStatus.DIVERGED
            status = OrbitStatus.DIVERGED if diverged else OrbitStatus.NOT_SETTLED
            reason = str(run.status)
            if run.status is FlowStatus.CHATTER and not flow.system.continuous:
                reason = RATTLES
            if run.status is FlowStatus.TOO_LONG:
                reason = _too_long(flow, spent, budget)
            return Orbit(status, reason=reason, periods=spent)
        x, mode = run.strobes[-1], run.mode
        orbit, cost = _polish(flow, run)
        spent += cost
        if orbit is not None:
            return replace(orbit, periods=spent)
        if stage >= 3:
            growth = lyapunov(flow, x, mode, FIRST)
            spent, x, mode = spent + FIRST, growth.start, growth.mode
            if growth.value * flow.drive.period > CHAOS:
                return _unperiodic(OrbitStatus.APERIODIC, growth, spent)
            orbit, cost = long_orbit(flow, x, mode)
            spent += cost
            if orbit is not None:
                return replace(orbit, periods=spent)
    still = _without_period(flow, run)
    if not still:  # a growth too small to be seen at once
        growth = lyapunov(flow, x, mode, FIRST, Bound(1.0 / SURE, 0.0, 20_000))
        spent += BLOCK * len(growth.rates)
        if growth.value > SURE * growth.error:
            return _unperiodic(OrbitStatus.APERIODIC, growth, spent)
        run = flow.run(growth.start, STAGES[-1], mode=growth.mode)
        orbit, cost = _polish(flow, run) if run.status is FlowStatus.DONE else (None, 0)
        spent += len(run.strobes) - 1 + cost
        if orbit is not None:
            return replace(orbit, periods=spent)
        still = run.status is FlowStatus.DONE and _without_period(flow, run)
    why = "quasi-periodic, or of a longer period" if still else "very slow"
    return _unperiodic(
        OrbitStatus.APERIODIC if still else OrbitStatus.NOT_SETTLED,
        growth,
        spent,
        f"no period up to {LONG_PERIOD} and no chaos after {spent} drive periods: {why}",
    )


def _without_period(flow: Flow, run: FlowResult) -> bool:
    """Whether a run shows a motion that has settled without a period."""
    return is_stationary(run.strobes) and (bool(np.any(run.counts)) or not _decays(flow, run.mode))


def _decays(flow: Flow, mode: ModeKey) -> bool:
    """Whether free motion in this mode dies out. Without an impact its one attractor then has the
    drive's own period, however long it repeats as if it had settled."""
    rates = np.linalg.eigvals(flow.system.mode(mode).A)
    return bool(rates.real.max() < -1e-12 * np.abs(rates).max())


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


def is_stationary(strobes: Array) -> bool:
    """Whether a motion has settled, though without a period: for every n up to ``LONG_PERIOD`` the
    strobes (k, states), k > 8 ``LONG_PERIOD``, repeat after n periods no better at the end than in
    the middle. What approaches a periodic orbit repeats ever better."""
    peak = np.maximum(np.abs(strobes).max(axis=0), 1e-300)
    scaled, quarter = strobes / peak, len(strobes) // 4
    for n in range(1, LONG_PERIOD + 1):
        gap = np.abs(scaled[n:] - scaled[:-n]).max(axis=1)
        middle, end = float(gap[quarter : 2 * quarter].max()), float(gap[-quarter:].max())
        if end <= STROBE_TOLERANCE or abs(end - middle) > STATIONARY * middle:
            return False
    return True


def _too_long(flow: Flow, spent: int, budget: Budget) -> str:
    """Why settling was cut short."""
    return (
        f"no period was found in {spent} drive periods; more are not run, since they took "
        f"{budget.spent:.2g} steps: the fastest motion of the model is "
        f"{flow.steps_a_period:.2g} steps to a drive period, or its contacts are that fast"
    )


def peaks_near(flow: Flow, x: Array, mode: ModeKey | None = None, points: int = 32) -> Array:
    """(states,) peak of each state over the drive period that starts at x.

    A state's value at the strobe may be tiny beside its peak, so strobes alone give no scale.
    States that hardly move are measured against the largest.
    """
    peak = np.abs(flow.run(x, 1, mode=mode, points=points).strobes).max(axis=0)
    return np.asarray(np.maximum(peak, max(1e-9 * float(peak.max()), 1e-300)))


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


def shoot_symmetric(flow: Flow, x: Array, n: int) -> tuple[Array, Array] | None:
    """A symmetric orbit of odd period n near x, by the half-period map, or None.

    x(t + nT/2) = mirror · x(t); the paper's Eq. (9) is the case of one impact on each stop. Half
    the work of ``shoot``, and it cannot leave for an asymmetric branch, so beyond a pitchfork it
    follows the unstable symmetric orbit. Returns the point and the full monodromy matrix.

    Raises
    ------
    InputError : n is even, or the system has no mirror.
    """
    mirror = flow.system.mirror
    if n % 2 == 0 or mirror is None:
        raise InputError(None, "n", n, "an odd period of a system with a mirror")
    size, last = len(x), np.inf
    peak = peaks_near(flow, x)
    for _ in range(12):
        run = flow.run(x, n, points=2, stretches=n, tangent=np.eye(size))
        if run.status is not FlowStatus.DONE or run.tangent is None:
            return None
        step = mirror @ run.strobes[-1] - x
        half = mirror @ run.tangent
        error = float((np.abs(step) / peak).max())
        if error < 1e-11 or (error < 1e-9 and error >= 0.5 * last):
            return x, half @ half
        x = x - np.linalg.solve(half - np.eye(size), step)
        if not np.all(np.isfinite(x)) or np.abs(x).max() > 1e6 * peak.max():
            return None
        last = error
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
    peak = np.abs(run.extremes).max(axis=1)
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
        mode=flow.system.mode_at(x, flow.drive.offset, mode),
        extremes=run.extremes,
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
    """An aperiodic motion with its exponent to ``lyapunov_exponent.Bound``; any other as it is."""
    if orbit.status is not OrbitStatus.APERIODIC or not len(orbit.start):
        return orbit
    with flow.within(Budget(step_budget.SETTLING)):
        growth = lyapunov(flow, orbit.start, orbit.mode or None, FIRST, Bound())
    return replace(orbit, lyapunov=growth.value, lyapunov_error=growth.error)


def starts(scale: Array, count: int, seed: int = 0) -> Array:
    """(count, n) initial states: rest, then a scrambled Sobol set in the box ± scale."""
    box = qmc.Sobol(len(scale), seed=seed).random(max(1, 1 << (count - 1).bit_length()))
    return np.vstack([np.zeros((1, len(scale))), scale * (2.0 * box - 1.0)])[:count]


def coexisting(flow: Flow, states: Iterable[Array]) -> list[Orbit]:
    """The different attractors that these starts lead to, in order of discovery.

    Starts that are left when ``step_budget.STARTS`` steps are spent are not run. Mirror twins
    count as one; aperiodic ones are not told apart.
    """
    attractors: list[Orbit] = []
    left = float(step_budget.STARTS)
    for x in states:
        if left <= 0.0:
            break
        budget = Budget(min(step_budget.SETTLING, left))
        orbit = settle(flow, np.asarray(x, dtype=float), budget=budget)
        left -= budget.spent
        if not any(same(flow, orbit, other) for other in attractors):
            attractors.append(orbit)
    return attractors


def same(flow: Flow, a: Orbit, b: Orbit) -> bool:
    """Whether two orbits are one, up to the strobe they start at and the mirror."""
    if a.status is not b.status or a.counts.family != b.counts.family:
        return False
    if a.status is not OrbitStatus.PERIODIC:
        return True
    peak = np.abs(b.extremes).max(axis=1)
    laps = flow.run(b.start, b.n).strobes[:-1]
    candidates = [laps]
    if flow.system.mirror is not None:
        candidates.append(mirrored_strobes(flow, b))
    return any(bool((np.abs(c - a.start) < 1e-6 * peak).all(axis=1).any()) for c in candidates)


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
    return None if shot is None else describe(flow, shot[0], orbit.n, shot[1])


def _polish(
    flow: Flow, run: FlowResult, periods: range = range(1, MAX_PERIOD + 1)
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
        turns = int(np.clip(np.log(1e-4) / np.log(max(radius, 1e-3)), 2, CLOSING // n))
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
