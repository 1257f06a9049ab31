"""From ngspice's waveforms to an orbit.

Runs inside the worker processes: numpy and the standard library only. Strobes are interpolated
(ngspice steps where it likes), impacts are entries of the board's own open-mode guards, and the
tolerances are those of docs/definitions.md for ngspice.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from designer.base.arrays import Array
from designer.dynamics.counts import MAX_PERIOD, read_counts
from designer.dynamics.orbit import Orbit, OrbitStatus, largest_speeds
from designer.dynamics.piecewise_linear import PiecewiseLinearSystem
from designer.spice.simulator import Waveforms

STROBE_TOLERANCE = 2e-3
"""How near two strobes are that count as one, as a share of the peak of each state."""
BRIEF = 2 * MAX_PERIOD
"""Drive periods in which no strobe of the second half need be like one before it, whatever the
period: the shortest proof that there is none."""
ENGINE_ERROR = 5e-4
"""Share of the peak of the moving state: shallower contacts and nearer misses are undecided."""


@dataclass(frozen=True)
class ClearanceRows:
    """How the motion in one clearance is read from the states and the generator."""

    upper: Array | None
    """(states + 2,) guard row over (states, generator, 1), positive in contact with the upper stop;
    None where there is none."""
    lower: Array | None
    """The row of the lower stop, likewise."""
    displacement: Array
    """(states + 2,) row of the displacement in the clearance."""
    velocity: Array
    """(states,) row of the velocity in it; what the generator's rate adds is left out."""

    @property
    def stops(self) -> tuple[tuple[int, Array], ...]:
        """The sides that have a stop, 1 upper and -1 lower, each with its row."""
        pairs = ((1, self.upper), (-1, self.lower))
        return tuple((side, row) for side, row in pairs if row is not None)


def clearance_rows(system: PiecewiseLinearSystem) -> tuple[ClearanceRows, ...]:
    """The rows of each clearance of a system, in their order."""
    rows = [system.contact_rows(k) for k in range(len(system.clearances))]
    return tuple(
        ClearanceRows(row.get(1), row.get(-1), displacement, velocity[:-1])
        for row, displacement, velocity in zip(
            rows, system.displacement, system.velocity, strict=True
        )
    )


@dataclass(frozen=True)
class LinearOutput:
    """An op-amp's output that ought to stay between its limits."""

    net: str
    """Net of the output."""
    low: float
    """Voltage [V] below which it is at a limit; -inf where it may be."""
    high: float
    """Voltage [V] above which it is at a limit; inf where it may be."""


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
    clearances: tuple[ClearanceRows, ...]
    """How the motion in each clearance is read."""
    generator: str
    """Net of the generator."""
    keep: bool = False
    """Whether to return a trace."""
    brief: bool = False
    """Whether `BRIEF` periods may show that there is no period, instead of four times the longest;
    for a board that has none on the exact circuit."""
    outputs: tuple[LinearOutput, ...] = ()
    """Outputs that are looked at; beyond its limits one makes the orbit clipped."""


@dataclass(frozen=True)
class Read:
    """What was read from a run."""

    orbit: Orbit
    strobes: Array
    """(k, states) strobes."""
    trace: tuple[Array, Array] | None
    """On request, time (m,) from 0 over the last n periods and states (m, states)."""


def strobes_after(
    waveforms: Waveforms, period: float, nets: tuple[str, ...], shift: Array
) -> Array:
    """(k, states) states at the end of each of the run's periods. period, nets, shift : as of
    ``Reading``."""
    states = _states(waveforms, nets, shift)
    return _at(waveforms.axis, states, _marks(waveforms.axis, period, 1))


def _states(waveforms: Waveforms, nets: tuple[str, ...], shift: Array) -> Array:
    """(k, states) at the run's own points; as of ``Reading``."""
    return np.asarray(np.stack([waveforms.signals[net] for net in nets], axis=1) - shift)


def _marks(time: Array, period: float, first: int) -> Array:
    """(k,) times of the strobes from number ``first`` on, the last no later than the run's end."""
    last = int(np.floor(time[-1] / period * (1.0 + 1e-9)))
    return np.asarray(np.minimum(np.arange(first, last + 1).astype(float) * period, time[-1]))


def read(waveforms: Waveforms, reading: Reading) -> Read:
    """Classify the run after ``reading.discard`` periods."""
    time = waveforms.axis
    x = _states(waveforms, reading.nets, reading.shift)
    marks = _marks(time, reading.period, reading.discard)
    last = reading.discard + len(marks) - 1
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
    impacts = _impacts(t, y, u, reading.clearances, inside, laps, first, n * reading.period)
    status, reason = OrbitStatus.PERIODIC, ""
    doubt = next((each.doubt for each in impacts if each.doubt), "")
    clipping = _clipping(waveforms, reading.outputs, first - slack, marks[-1] + slack)
    if clipping or doubt:
        status = OrbitStatus.CLIPPED if clipping else OrbitStatus.GRAZING
        reason = clipping or doubt
    times = np.concatenate([np.zeros(0), *(each.times for each in impacts)])
    order = np.argsort(times, kind="stable")
    which = [np.full(len(each.times), k) for k, each in enumerate(impacts)]
    pairs = [each.pair for each in impacts] or [(0, 0)]
    met = (
        _joined([each.velocities for each in impacts])[order],
        _joined([each.sides for each in impacts])[order],
        _joined(which)[order].astype(np.int64),
    )
    orbit = Orbit(
        status=status,
        n=n,
        p=pairs[0][0],
        q=pairs[0][1],
        more=tuple(pairs[1:]),
        start=strobes[-1],
        extremes=np.stack([y[inside].min(axis=0), y[inside].max(axis=0)], axis=1),
        spans=np.array([each.span for each in impacts]).reshape(-1, 2),
        speeds=largest_speeds(*met, len(impacts)),
        impact_times=times[order],
        impact_velocities=met[0],
        impact_sides=met[1],
        impact_clearances=met[2],
        asymmetry=_asymmetry(t, y, marks[-1], n, reading.period, peak),
        graze=np.array([[each.depth, each.miss] for each in impacts]).reshape(-1, 2),
        reason=reason,
        periods=last,
    )
    return Read(orbit, strobes, _tail(t, y, marks, strobes, reading, n))


@dataclass(frozen=True)
class _Impacts:
    """The impacts in one clearance over a lap, and what makes their count doubtful.

    counts : a lap, by side. depth, miss : of the shallowest contact and the nearest miss. span :
    least and greatest displacement in the clearance.
    """

    counts: dict[int, float]
    times: Array
    sides: Array
    velocities: Array
    depth: float
    miss: float
    span: tuple[float, float]
    doubt: str

    @property
    def pair(self) -> tuple[int, int]:
        return round(self.counts[1]), round(self.counts[-1])


def _clipping(
    waveforms: Waveforms, outputs: tuple[LinearOutput, ...], first: float, last: float
) -> str:
    """Which output is at a limit between two times; nothing where none is."""
    inside = (waveforms.axis >= first) & (waveforms.axis <= last)
    for output in outputs:
        volts = waveforms.signals[output.net][inside]
        if ((volts < output.low) | (volts > output.high)).any():
            return f"the output at {output.net} is at its limit"
    return ""


def name_in_ngspice(response: str) -> str:
    """What ngspice calls a response of the exact engine: aperiodic one of a period above
    ``MAX_PERIOD``, which is not looked for there, and a quasi-periodic one, since no run is long
    enough to tell it from chaos."""
    counts = read_counts(response)
    long = counts is not None and counts.n > MAX_PERIOD
    torus = response == OrbitStatus.QUASI_PERIODIC
    return str(OrbitStatus.APERIODIC) if long or torus else response


def _impacts(
    t: Array,
    y: Array,
    u: Array,
    clearances: tuple[ClearanceRows, ...],
    inside: NDArray[np.bool_],
    laps: int,
    first: float,
    lap: float,
) -> list[_Impacts]:
    """The impacts in each clearance between times ``first`` and ``first`` + ``lap``."""
    out = []
    for rows in clearances:
        counts, depth, miss = {1: 0.0, -1: 0.0}, np.inf, np.inf
        times, sides, velocities = [], [], []
        moving = y @ rows.velocity
        for side, row in rows.stops:
            g = y[inside] @ row[:-2] + row[-2] * u[inside] + row[-1]
            when, deep, near = _entries(t[inside], g)
            counts[side] = len(when) / laps
            depth, miss = min(depth, deep), min(miss, near)
            once = when[when < first + lap]
            times.append(once - first)
            sides.append(np.full(len(once), float(side)))
            velocities.append(np.interp(once, t, moving) if len(once) else np.zeros(0))
        moved = y @ rows.displacement[:-2] + rows.displacement[-2] * u + rows.displacement[-1]
        floor = ENGINE_ERROR * max(float(np.abs(moved).max()), 1e-12)
        span = float(moved[inside].min()), float(moved[inside].max())
        joined = _joined(times), _joined(sides), _joined(velocities), depth, miss, span
        out.append(_Impacts(counts, *joined, _doubt(counts, min(depth, miss), floor)))
    return out


def _joined(arrays: list[Array]) -> Array:
    return np.concatenate([np.zeros(0), *arrays])


def _doubt(counts: dict[int, float], nearest: float, floor: float) -> str:
    """Why the impacts of a clearance are not sure; nothing where they are."""
    if any(abs(c - round(c)) >= 1e-9 for c in counts.values()):
        return f"impacts a lap differ: {counts[1]:g} upper, {counts[-1]:g} lower"
    if nearest < floor:
        return f"a contact or miss of {nearest:.3g} V is below {floor:.3g} V"
    return ""


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
