"""Brute-force bifurcation data over one parameter, in blocks of steps.

A track is one way through the parameter: down or up, following the attractor (each step starts
where the one before ended), or one start that is the same at every step. Followed tracks are
sequential, and run beside each other; the steps of a fixed start are independent. Blocks end where
the step number says, so an interrupted sweep goes on from what it has.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from designer.base.arrays import Array
from designer.base.threads import parallel
from designer.bifurcations.block_store import KeptBlocks, stored
from designer.bifurcations.orbit_jumps import jumps
from designer.bifurcations.subject import Subject
from designer.dynamics.attractors import starts
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.steady_state import UPPER, SteadyMotion, TransientSettings

if TYPE_CHECKING:
    from designer.answers.bifurcation_answer import WindowRow

BLOCK = 64
"""Steps of a block."""
KICK = 1e-6
"""Of the largest state at the end of the shown periods: how far a followed state is pushed before
each step. A state that is symmetric to the last digit would stay on a symmetric orbit long after
that lost its stability; which twin it leaves for is decided here."""
DOWN, UP = "down", "up"


@dataclass(frozen=True)
class SweepPlan:
    """What is swept."""

    subject: Subject
    """The system whose parameter changes."""
    parameter: str
    """Name of the parameter that changes."""
    values: Array
    """(N,) values of the parameter, ascending."""
    tracks: tuple[str, ...] = (DOWN,)
    """"down", "up", or "start K" for row K of ``starts``."""
    starts: Array = field(default_factory=lambda: np.zeros((0, 0)))
    """(K, states) starts of the tracks that begin anew at each value; rest where none is given."""
    course: TransientSettings = field(default_factory=TransientSettings)
    """Periods of each step."""

    def __post_init__(self) -> None:
        if not len(self.starts):
            object.__setattr__(self, "starts", np.zeros((1, len(self.subject.states))))

    @property
    def followed(self) -> bool:
        """Whether each step starts where the one before ended."""
        return self.tracks[0] in (DOWN, UP)

    def order(self, track: str) -> Array:
        """The values in the order in which this track meets them."""
        return self.values[::-1] if track == DOWN else self.values

    def blocks(self, track: str) -> list[Array]:
        """The same, cut into blocks."""
        order = self.order(track)
        return [order[k : k + BLOCK] for k in range(0, len(order), BLOCK)]

    def as_dict(self) -> dict[str, Any]:
        """What decides the result."""
        stops = tuple((stop.clearance, stop.side) for stop in self.subject.stops)
        return {
            **({} if stops == UPPER else {"stops": stops}),
            "subject": self.subject.as_dict(),
            "parameter": self.parameter,
            "from": float(self.values[0]),
            "to": float(self.values[-1]),
            "steps": len(self.values),
            "tracks": list(self.tracks),
            "starts": [] if self.followed else self.starts.tolist(),
            "periods": dict(self.course.__dict__),
        }


@dataclass(frozen=True)
class Window:
    """Neighbouring steps that show one response."""

    low: float
    """The parameter at the first of them."""
    high: float
    """The parameter at the last of them."""
    response: str
    """The response, as "n-p-q"."""
    symmetric: bool | None
    """Whether the response is its own mirror image; None where it is not periodic."""
    steps: int
    """How many they are."""
    track: str
    """The track they lie on; "starts" where several starts are taken together."""
    lyapunov: tuple[float, float] | None = None
    """Least and greatest exponent of aperiodic steps; None of others."""
    lyapunov_error: float | None = None
    """Largest standard error of these exponents; None of others."""

    def as_dict(self) -> WindowRow:
        """Plain data by the keys of the contract."""
        row: WindowRow = {
            "from": self.low,
            "to": self.high,
            "response": self.response,
            "symmetric": self.symmetric,
            "steps": self.steps,
            "track": self.track,
        }
        if self.lyapunov is not None:
            row["lyapunov"], row["lyapunov_error"] = self.lyapunov, self.lyapunov_error
        return row


@dataclass(frozen=True)
class Sweep:
    """What a sweep showed."""

    plan: SweepPlan
    """What the sweep was asked for."""
    steps: Mapping[str, tuple[SteadyMotion, ...]]
    """For each track one ``SteadyMotion`` per value, in the order of ``plan.values``."""

    @cached_property
    def windows(self) -> list[Window]:
        """Of every followed track by itself, where it jumps to another orbit of one name too; of
        fixed starts together. Ascending."""
        if self.plan.followed:
            return [w for t in self.plan.tracks for w in _windows(self, (t,), t)]
        track = self.plan.tracks[0] if len(self.plan.tracks) == 1 else "starts"
        return _windows(self, self.plan.tracks, track)

    @property
    def periods(self) -> int:
        """Drive periods that were run in all."""
        return sum(s.periods for steps in self.steps.values() for s in steps)


def follow(*directions: str) -> dict[str, Any]:
    """The fields of a plan that follows the attractor, "down" or "up" or both."""
    return {"tracks": tuple(directions)}


def from_starts(subject: Subject, changes: Sequence[Mapping[str, float]], count: int) -> Any:
    """The fields of a plan with ``count`` starts: rest, then a Sobol set in a box of a few static
    deflections, as in ``dynamics.attractors.starts``. changes : the ends of the sweep."""
    box = starts(subject.scale(changes), count)
    return {"tracks": tuple(f"start {k}" for k in range(count)), "starts": box}


def run(
    plan: SweepPlan,
    jobs: int = 1,
    store: KeptBlocks[list[SteadyMotion]] | None = None,
    progress: Callable[[], None] = lambda: None,
) -> Sweep:
    """Make the sweep, or what of it ``store`` has not: a block holds the steps of a track and of a
    number in the order in which they are made.

    ``progress`` is called once a block.

    Raises
    ------
    KeyboardInterrupt : finished blocks are in the store by then.
    """
    tasks: list[list[tuple[str, int]]] = []
    for track in plan.tracks:
        numbers = [(track, k) for k in range(len(plan.blocks(track)))]
        tasks += [numbers] if plan.followed else [[each] for each in numbers]

    def work(task: list[tuple[str, int]]) -> list[tuple[str, list[SteadyMotion]]]:
        out, x = [], np.zeros(len(plan.subject.states))
        for track, number in task:
            block = plan.blocks(track)[number]
            if plan.followed:
                make = partial(_followed, plan, block, x)
            else:
                make = partial(_fixed, plan, block, plan.starts[int(track.split()[1])])
            may_be = partial(_may_be, plan=plan, block=block)
            steps = stored(store, (track, number), may_be, make)
            x = next_start(steps[-1], plan.subject.weights)
            out.append((track, steps))
            progress()
        return out

    by_track: dict[str, list[SteadyMotion]] = {track: [] for track in plan.tracks}
    for blocks in parallel(work, tasks, jobs):
        for track, steps in blocks:
            by_track[track] += steps
    return Sweep(
        plan,
        {t: tuple(s[::-1] if t == DOWN else s) for t, s in by_track.items()},
    )


def _may_be(steps: Sequence[SteadyMotion], plan: SweepPlan, block: Array) -> bool:
    """Whether stored steps are of these values and this system."""
    states, periods, stops = len(plan.subject.states), plan.course.keep, len(plan.subject.stops)
    return len(steps) == len(block) and all(
        step.countable
        and len(step.start) == len(step.end) == states
        and len(step.minima) <= periods
        and len(step.further) in (0, stops - 1)
        and (not len(step.minima) or bool(np.isfinite(step.end).all()))
        for step in steps
    )


def next_start(step: SteadyMotion, weights: Array) -> Array:
    """Where the next followed step starts: the end of this one, slightly pushed; rest where this
    one had no end. weights : as ``Subject`` has them."""
    if not len(step.minima):
        return np.zeros(len(step.end))
    size = np.abs(weights * step.end).max()
    push = KICK * size * (-1.0) ** np.arange(len(step.end))
    return np.asarray(step.end + push / weights)


def _followed(plan: SweepPlan, values: Iterable[float], x: Array) -> list[SteadyMotion]:
    out = []
    for setting in plan.subject.settings([{plan.parameter: float(v)} for v in values]):
        out.append(setting.steady(x, plan.course))
        x = next_start(out[-1], plan.subject.weights)
    return out


def _fixed(plan: SweepPlan, values: Iterable[float], x: Array) -> list[SteadyMotion]:
    settings = plan.subject.settings([{plan.parameter: float(v)} for v in values])
    return [setting.steady(x, plan.course) for setting in settings]


def _windows(sweep: Sweep, tracks: Sequence[str], name: str) -> list[Window]:
    """Runs of steps at which one of the tracks shows a response; ordered by where they begin."""
    values, plan = sweep.plan.values, sweep.plan
    ends: set[int] = set()
    if plan.followed:
        family = plan.subject.family(plan.parameter)
        ends = {k for t in tracks for k in jumps(family, values.tolist(), sweep.steps[t])}
    out: list[Window] = []
    running: dict[tuple[str, bool | None], int] = {}
    responses: set[tuple[str, bool | None]]
    for i in range(len(values) + 1):
        responses = set()
        if i < len(values):
            steps = [sweep.steps[t][i] for t in tracks]
            responses = {(s.response, s.symmetric) for s in steps}
        for key in [k for k in running if k not in responses or i in ends]:
            first = running.pop(key)
            low, high = float(values[first]), float(values[i - 1])
            run = [s for t in tracks for s in sweep.steps[t][first:i] if s.response == key[0]]
            out.append(Window(low, high, *key, i - first, name, *_exponents(run)))
        for key in responses:
            running.setdefault(key, i)
    return sorted(out, key=lambda w: (w.low, w.high, w.response, str(w.symmetric)))


def _exponents(steps: Sequence[SteadyMotion]) -> tuple[tuple[float, float] | None, float | None]:
    """Least and greatest exponent of aperiodic steps, and the largest error of one."""
    if steps[0].status is not OrbitStatus.APERIODIC:
        return None, None
    values = [s.lyapunov for s in steps]
    return (min(values), max(values)), max(s.lyapunov_error for s in steps)
