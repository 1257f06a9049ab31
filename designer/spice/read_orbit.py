"""From ngspice's waveforms to an orbit.

Runs inside the worker processes: numpy and the standard library only. Strobes are interpolated
(ngspice steps where it likes), impacts are entries of the board's own open-mode guards, and the
tolerances are those of docs/definitions.md for ngspice.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.dynamics.counts import MAX_PERIOD
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.spice.simulator import Waveforms

STROBE_TOLERANCE = 2e-3
"""Of the peak of each state."""
BRIEF = 2 * MAX_PERIOD
"""Drive periods in which no strobe of the second half need be like one before it, whatever the
period: the shortest proof that there is none."""
ENGINE_ERROR = 5e-4
"""Of the peak of the moving state: contacts shallower, misses nearer than this are undecided."""


@dataclass(frozen=True)
class Reading:
    """How to read a run."""

    period: float
    """Drive period [s]."""
    discard: int
    """Periods to leave out at the start."""
    nets: tuple[str, ...]
    """Nets that carry the states."""
    shift: Array
    """(states,) what their voltages are above the capacitors' (offsets)."""
    upper: Array | None
    """(states + 2,) guard row over (states, generator, 1), positive in contact with the upper stop;
    None where there is none."""
    lower: Array | None
    """(states + 2,) guard row over (states, generator, 1), positive in contact with the lower stop;
    None where there is none."""
    generator: str
    """Net of the generator."""
    moving: int
    """Index of the state that moves in the clearance."""
    keep: bool = False
    """Whether to return a trace."""
    brief: bool = False
    """Whether `BRIEF` periods may show that there is no period, instead of four times the longest;
    for a board that has none on the exact circuit."""


@dataclass(frozen=True)
class Read:
    """What was read from a run."""

    orbit: Orbit
    """The orbit."""
    strobes: Array
    """(k, states) strobes."""
    trace: tuple[Array, Array] | None
    """On request, time (m,) from 0 over the last n periods and states (m, states)."""


def read(waveforms: Waveforms, reading: Reading) -> Read:
    """Classify the run after ``reading.discard`` periods."""
    time = waveforms.axis
    x = np.stack([waveforms.signals[net] for net in reading.nets], axis=1) - reading.shift
    last = int(np.floor(time[-1] / reading.period * (1.0 + 1e-9)))
    marks = np.arange(reading.discard, last + 1).astype(float) * reading.period
    marks[-1] = min(marks[-1], time[-1])
    strobes = _at(time, x, marks)
    settled = time >= marks[0]
    # The window opens and closes on exact strobes, so that n periods hold n periods' impacts.
    t = np.concatenate([[marks[0]], time[settled & (time > marks[0])]])
    y = np.concatenate([strobes[:1], x[settled & (time > marks[0])]])
    peak = np.maximum(np.abs(y).max(axis=0), 1e-12)
    n = _period(strobes, peak)
    if n == 0:
        tried = (len(strobes) - 1) // 4
        if reading.brief and _never_repeats(strobes, peak):
            tried = MAX_PERIOD
        status = OrbitStatus.APERIODIC if tried >= MAX_PERIOD else OrbitStatus.NOT_SETTLED
        reason = f"no period up to {min(tried, MAX_PERIOD)} in {len(strobes)} strobes"
        return Read(
            Orbit(status, start=strobes[-1], periods=last, reason=reason),
            strobes,
            _tail(t, y, marks, strobes, reading, len(strobes) - 1),
        )
    laps = (len(strobes) - 1) // n
    first = marks[len(strobes) - 1 - laps * n]
    slack = 1e-12 * reading.period
    inside = (t >= first - slack) & (t <= marks[-1] + slack)
    u = waveforms.signals[reading.generator]
    u = np.interp(t, time, u)
    sides, times, velocities = [], [], []
    depth, miss, counts = np.inf, np.inf, {1: 0.0, -1: 0.0}
    for side, row in ((1, reading.upper), (-1, reading.lower)):
        if row is None:
            continue
        g = y[inside] @ row[:-2] + row[-2] * u[inside] + row[-1]
        when, deep, near = _entries(t[inside], g)
        counts[side] = len(when) / laps
        depth, miss = min(depth, deep), min(miss, near)
        end = first + n * reading.period
        once = when[when < end]
        times += list(once - first)
        sides += [side] * len(once)
        velocity = np.interp(once, t, y[:, reading.moving + 1]) if len(once) else np.zeros(0)
        velocities += list(velocity)
    order = np.argsort(times, kind="stable")
    whole = all(abs(c - round(c)) < 1e-9 for c in counts.values())
    floor = ENGINE_ERROR * peak[reading.moving]
    status, reason = OrbitStatus.PERIODIC, ""
    if not whole:
        status = OrbitStatus.GRAZING
        reason = f"impacts a lap differ: {counts[1]:g} upper, {counts[-1]:g} lower"
    elif min(depth, miss) < floor:
        status = OrbitStatus.GRAZING
        reason = f"a contact or miss of {min(depth, miss):.3g} V is below {floor:.3g} V"
    orbit = Orbit(
        status=status,
        n=n,
        p=round(counts[1]),
        q=round(counts[-1]),
        start=strobes[-1],
        extremes=np.stack([y[inside].min(axis=0), y[inside].max(axis=0)], axis=1),
        impact_times=np.array(times)[order],
        impact_velocities=np.array(velocities)[order],
        impact_sides=np.array(sides, dtype=float)[order],
        asymmetry=_asymmetry(t, y, marks[-1], n, reading.period, peak),
        penetration=float(depth),
        miss=float(miss),
        reason=reason,
        periods=last,
    )
    return Read(orbit, strobes, _tail(t, y, marks, strobes, reading, n))


def _period(strobes: Array, peak: Array) -> int:
    """Least n whose strobes repeat for 3n periods at the end of the run; 0 if there is none."""
    for n in range(1, min(MAX_PERIOD, (len(strobes) - 1) // 4) + 1):
        gap = np.abs(strobes[-3 * n :] - strobes[-4 * n : len(strobes) - n])
        if (gap <= STROBE_TOLERANCE * peak).all():
            return n
    return 0


def _never_repeats(strobes: Array, peak: Array) -> bool:
    """Whether each period up to the longest is missed by a strobe of the last `MAX_PERIOD`."""
    if len(strobes) <= BRIEF:
        return False
    last, tolerance = strobes[-MAX_PERIOD:], STROBE_TOLERANCE * peak
    return all(
        bool((np.abs(last - strobes[-MAX_PERIOD - n : -n]) > tolerance).any())
        for n in range(1, MAX_PERIOD + 1)
    )


def _entries(t: Array, g: Array) -> tuple[Array, float, float]:
    """Times where g rises through 0, the smallest depth of a contact and the nearest miss."""
    rising = np.flatnonzero((g[:-1] <= 0.0) & (g[1:] > 0.0))
    falling = np.flatnonzero((g[:-1] > 0.0) & (g[1:] <= 0.0))
    when = t[rising] - g[rising] * (t[rising + 1] - t[rising]) / (g[rising + 1] - g[rising])
    depth = np.inf
    for i in rising:
        after = falling[falling > i]
        if len(after):
            depth = min(depth, float(g[i : after[0] + 2].max()))
    peaks = np.flatnonzero((g[1:-1] >= g[:-2]) & (g[1:-1] > g[2:]) & (g[1:-1] <= 0.0)) + 1
    miss = float(-g[peaks].max()) if len(peaks) else np.inf
    return when, depth, miss


def _at(time: Array, x: Array, marks: Array) -> Array:
    """Cubic interpolation through the four nearest points, for each mark (k,): (k, states)."""
    i = np.clip(np.searchsorted(time, marks) - 2, 0, len(time) - 4)
    index = i[:, None] + np.arange(4)
    nodes, values = time[index], x[index]
    out = np.zeros((len(marks), x.shape[1]))
    for j in range(4):
        others = [k for k in range(4) if k != j]
        weight = np.prod((marks[:, None] - nodes[:, others]), axis=1) / np.prod(
            nodes[:, [j]] - nodes[:, others], axis=1
        )
        out += weight[:, None] * values[:, j]
    return out


def _asymmetry(t: Array, y: Array, end: float, n: int, period: float, peak: Array) -> float:
    if n % 2 == 0:
        return float("nan")
    grid = end - n * period * (1.0 - np.arange(128) / 128)
    wave = _at(t, y, grid)
    return float((np.abs(np.roll(wave, -64, axis=0) + wave).max(axis=0) / peak).max())


def _tail(
    t: Array, y: Array, marks: Array, strobes: Array, reading: Reading, n: int
) -> tuple[Array, Array] | None:
    """The last n periods, from a strobe on."""
    if not reading.keep:
        return None
    k = max(len(marks) - 1 - n, 0)
    later = t > marks[k]
    time = np.concatenate([marks[k : k + 1], t[later]]) - marks[k]
    return time, np.concatenate([strobes[k : k + 1], y[later]])
