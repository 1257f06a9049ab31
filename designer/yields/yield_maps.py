"""Yield over ω, b, the parts' grade, ω × grade, and temperature: where to sit in a window, and what
becomes of boards that get warm.

At each point the nominal circuit's wanted orbit is continued from the neighbouring point; where the
nominal circuit does not show the response, the yield is 0 and the point is marked as not there. The
same boards are asked at every point (over grade and temperature the same uniform numbers), so that
neighbours differ by their setting and not by the draw. Over b the threshold stays and the
generator's amplitude goes as 1/b.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from designer.base.arrays import Array
from designer.base.defaults import OVERS, Over
from designer.base.errors import InputError
from designer.catalog.entries import ROOM
from designer.circuit.ensemble import Ensemble
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit
from designer.dynamics.piecewise_linear import Drive, PiecewiseLinearSystem
from designer.spread.spread import OpAmpDrift, Spread, draw_many
from designer.verdicts.verdict import Question, StudyPlan, Verdict
from designer.yields.yield_count import Yield

if TYPE_CHECKING:
    from designer.answers.study_answer import StudyMapRow

Counts = NDArray[np.int64]

SET: tuple[Over, ...] = ("omega", "b", "omega-grade")
"""What the generator is set to along the first axis; the nominal circuit has a window there."""
POINTS = 17
"""Points of ω or b across a window; the setting in use is one more."""
SAMPLES = 100
GRADES = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05)
"""The grades of resistors and capacitors alike."""
TEMPERATURES = (-20.0, 0.0, 25.0, 40.0, 55.0, 70.0, 85.0)
"""°C of all boards of a point."""
PACE, LARGEST_PACE = 0.0025, 0.01
"""Relative: first and largest step of the search for the window's edges."""
REACH = 0.3
"""Relative: how far from the setting in use a window is followed."""
HALVINGS = 6
"""Halvings of the last step, at each edge."""
DOUBTED = 10
"""Boards left open by a forecast that are settled before the others are taken for lost."""
NEARLY_SYMMETRIC = 0.01
"""Of the peak: a nominal orbit below it is past its pitchfork; bias currents leave it so much."""
SEED_SHIFT = 1_000_003
"""Added to the study's seed: a setting that was chosen on a map is judged on boards it has not
seen."""


@dataclass(frozen=True)
class Axis:
    """An axis of a yield map."""

    name: str
    """What is varied: "omega", "b", "grade" (a fraction, of resistors and capacitors) or
    "temperature" (of the boards, in °C)."""
    values: tuple[float, ...]
    """Values of the setting along the axis."""


@dataclass(frozen=True)
class YieldMap:
    """Counts of a response on a grid of settings; every array has the axes' shape."""

    over: Over
    """What the settings differ in."""
    question: int
    """Number of the question of the plan."""
    axes: tuple[Axis, ...]
    there: NDArray[np.bool_]
    """Whether the nominal circuit shows the response, with the symmetry that is asked for."""
    ok: Counts
    """Boards that keep the response."""
    lost: Counts
    """Boards that lose the response."""
    grazing: Counts
    """Boards whose count of impacts is undecided."""
    failed: Counts
    """Boards without an answer."""
    samples: int
    """Boards at each setting."""
    seed: int
    """Seed that the boards were drawn with."""
    used: float
    """The setting of the plan, in the first axis's unit; over the temperature 25 °C."""
    window: tuple[float, float] | None
    """Edges of the nominal circuit's window in the first axis's unit; None over grade and
    temperature."""
    open: tuple[bool, bool]
    """Whether the lower and the upper edge of the window lie at the reach of the search."""
    attractors: int
    """Attractors that were sought."""
    seconds: float
    """Wall time [s]."""
    frequency: float | None = None
    """Frequency of the generator at the setting of the plan [Hz]."""
    drift: OpAmpDrift | None = None
    """Over the temperature: what it does to the op-amps of these boards."""
    specified: tuple[float | None, float | None] = (None, None)
    """Over the temperature: ends of the op-amp's range [°C]; None for one that is not known."""

    def at(self, *index: int) -> Yield:
        """The yield at one point."""
        return Yield(*(int(a[index]) for a in (self.ok, self.lost, self.grazing, self.failed)))

    @property
    def rate(self) -> Array:
        """ok/(samples - failed), 0 where the response is not there."""
        return self._each(lambda y: 0.0 if np.isnan(y.rate) else y.rate)

    @property
    def low(self) -> Array:
        """Lower end of the 95 % Wilson interval, 0 where the response is not there."""
        return self._each(lambda y: y.interval[0])

    @property
    def high(self) -> Array:
        """Upper end, 0 where the response is not there."""
        return self._each(lambda y: y.interval[1])

    @property
    def recommended(self) -> tuple[float, ...] | None:
        """The setting in use if none is better, else the best one, on every axis; None where no
        board is ok anywhere, and over the temperature, which nobody sets.

        The best has the interval with the highest lower end; a setting whose interval overlaps it
        is as good. Of the rows of such neighbours that hold a best one, the middle of the longest.
        Over the grade and of grades, the coarsest of those with the highest lower end. The nominal
        circuit shows the response there.
        """
        counts = self.there & (self.ok > 0)
        if not counts.any() or self.over == "temperature":
            return None
        low, high = (np.where(counts, end, -1.0) for end in (self.low, self.high))
        best = float(low.max())
        grade: tuple[float, ...] = ()
        if low.ndim == 2:
            column = int(np.flatnonzero((low == best).any(axis=0))[-1])
            grade = (self.axes[1].values[column],)
            low, high = low[:, column], high[:, column]
        if self.over == "grade":
            return (self.axes[0].values[int(np.flatnonzero(low == best)[-1])],)
        values = np.array(self.axes[0].values)
        equal = np.flatnonzero(high >= best)
        if self.used in values[equal]:
            return (self.used, *grade)
        rows = np.split(equal, np.flatnonzero(np.diff(equal) > 1) + 1)
        rows = [row for row in rows if (low[row] == best).any()]
        longest = max(rows, key=lambda row: float(values[row[-1]] - values[row[0]]))
        middle = 0.5 * (values[longest[0]] + values[longest[-1]])
        nearest = longest[int(np.argmin(np.abs(values[longest] - middle)))]
        return (float(values[nearest]), *grade)

    def as_dict(self) -> StudyMapRow:
        """Plain, for JSON, without what it cost."""
        row: StudyMapRow = {
            "over": self.over,
            "question": self.question,
            "axes": [{"name": a.name, "values": list(a.values)} for a in self.axes],
            "there": self.there.tolist(),
            "ok": self.ok.tolist(),
            "lost": self.lost.tolist(),
            "grazing": self.grazing.tolist(),
            "failed": self.failed.tolist(),
            "low": self.low.tolist(),
            "high": self.high.tolist(),
            "samples": self.samples,
            "seed": self.seed,
            "used": self.used,
            "frequency_hz": self.frequency,
            "window": None if self.window is None else list(self.window),
            "open": list(self.open),
            "recommended": None if self.recommended is None else list(self.recommended),
        }
        if self.drift is not None:
            row["op_amps"] = self.drift.as_dict()
            row["specified"] = list(self.specified)
        return row

    def outside(self, celsius: float) -> bool:
        """Whether the op-amp is not specified for a temperature [°C]."""
        low, high = self.specified
        return (low is not None and celsius < low) or (high is not None and celsius > high)

    def _each(self, value: Callable[[Yield], float]) -> Array:
        out = np.zeros(self.there.shape)
        for index in np.ndindex(self.there.shape):
            if self.there[index]:
                out[index] = value(self.at(*index))
        return out


_COUNTS = ("ok", "lost", "grazing", "failed")


def yield_map(
    plan: StudyPlan,
    number: int,
    over: Over,
    b: float,
    *,
    values: Sequence[float] | None = None,
    grades: Sequence[float] = GRADES,
    temperatures: Sequence[float] = TEMPERATURES,
    warmed: Spread | None = None,
    samples: int = SAMPLES,
    points: int = POINTS,
    quick: bool = False,
    jobs: int = 1,
    progress: Callable[[], None] = lambda: None,
) -> YieldMap:
    """The yield of question ``number`` of the plan over one or two settings.

    b : the clearance that the question's amplitude stands for. values : of ω or b; by default
    ``points`` across the nominal circuit's window and the setting in use. temperatures : [°C].
    warmed : the plan's spread with what moves its boards with temperature (``part_rules.warmed``);
    needed over it. samples : boards at each point. quick : a forecast: the boards that
    ``Ensemble.quick`` leaves open at a setting are lost if none of the first few of them
    (``DOUBTED``) shows the response once it is settled. progress : called once an attractor.

    Raises
    ------
    InputError : over is none of ``OVERS``; no value, no sample, a value that is not positive.
    """
    began = time.perf_counter()
    if over not in OVERS:
        raise InputError(None, "--map", over, f"one of {', '.join(OVERS)}")
    _check("samples", [samples])
    _check("points", [points])
    _check("grade", grades)
    if values is not None:
        _check("b" if over == "b" else "omega", values)
    question, seed = plan.questions[number], plan.seed + SEED_SHIFT
    assert question.spec.omega is not None
    used = b if over == "b" else question.spec.omega
    nominal = _NominalOrbits(plan, question, over, used, progress)
    window: tuple[float, float] | None = None
    open_ = (False, False)
    settings = [used]
    if over in SET and values is not None:
        settings = sorted(set(map(float, values)))
    elif over in SET:
        window, open_ = nominal.window()
        settings = sorted({used, *np.linspace(*window, points).tolist()})
    orbits = nominal.orbits(settings)
    spreads: tuple[Spread, ...] = (plan.spread,)
    if "grade" in over:
        spreads = tuple(plan.spread.with_grades(resistor=g, capacitor=g) for g in grades)
    elif over == "temperature":
        assert warmed is not None
        spreads = tuple(map(warmed.at_temperature, temperatures))
    counts = {name: np.zeros((len(settings), len(spreads)), dtype=np.int64) for name in _COUNTS}
    for column, spread in enumerate(spreads):
        drawn = draw_many(plan.circuit, spread, seed, range(samples))
        ensemble = Ensemble(plan.modelled(drawn))
        tasks = [
            _Task(i, board, nominal.drive(value), orbit.start)
            for board in range(samples)
            for i, (value, orbit) in enumerate(zip(settings, orbits, strict=True))
            if orbit is not None
        ]
        verdicts = _answered(ensemble, tasks, quick, question, jobs, progress)
        for task, verdict in zip(tasks, verdicts, strict=True):
            counts[str(verdict or Verdict.LOST)][task.setting, column] += 1
        nominal.spent += len(tasks)
    axes = [Axis("b" if over == "b" else "omega", tuple(settings))] if over in SET else []
    axes += [Axis("grade", tuple(grades))] if "grade" in over else []
    axes += [Axis("temperature", tuple(temperatures))] if over == "temperature" else []
    size = tuple(len(axis.values) for axis in axes)
    there = np.tile(np.array([[orbit is not None] for orbit in orbits]), (1, len(spreads)))
    return YieldMap(
        over=over,
        question=number,
        axes=tuple(axes),
        there=there.reshape(size),
        **{name: counts[name].reshape(size) for name in _COUNTS},
        samples=samples,
        seed=seed,
        used=ROOM if over == "temperature" else used,
        window=window,
        open=open_,
        attractors=nominal.spent,
        seconds=time.perf_counter() - began,
        frequency=question.excitation.frequency,
        drift=warmed.opamps if over == "temperature" and warmed is not None else None,
        specified=_specified(plan) if over == "temperature" else (None, None),
    )


def _specified(plan: StudyPlan) -> tuple[float | None, float | None]:
    """The range of temperatures [°C] of the plan's op-amp, as far as the catalogue knows."""
    figures = plan.circuit.figures
    rated = None if figures is None else figures.temperature
    return (None, None) if rated is None else (rated.min, rated.max)


class _Task(NamedTuple):
    """A board to be asked, at a setting of this number."""

    setting: int
    board: int
    drive: Drive
    start: Array


def _answered(
    ensemble: Ensemble,
    tasks: Sequence[_Task],
    quick: bool,
    question: Question,
    jobs: int,
    progress: Callable[[], None],
) -> list[Verdict | None]:
    """Of each task; None where a forecast left it open to the last."""

    def judged(some: Sequence[int], *, settled: bool) -> list[Verdict | None]:
        boards, drives = [tasks[t].board for t in some], [tasks[t].drive for t in some]
        starts = np.array([tasks[t].start for t in some])
        orbits: Sequence[Orbit | None] = (
            ensemble.settle(boards, drives, starts, jobs=jobs, progress=progress)
            if settled
            else ensemble.quick(boards, drives, starts, jobs=jobs, progress=progress)
        )
        return [None if orbit is None else question.judge(orbit)[0] for orbit in orbits]

    everything = range(len(tasks))
    if not quick:
        return judged(everything, settled=True)
    verdicts = judged(everything, settled=False)
    for setting in dict.fromkeys(task.setting for task in tasks):
        left = [t for t in everything if tasks[t].setting == setting and verdicts[t] is None]
        settle_open(verdicts, left, lambda some: judged(some, settled=True))
    return verdicts


def settle_open(
    verdicts: list[Verdict | None],
    left: Sequence[int],
    settle: Callable[[Sequence[int]], Sequence[Verdict | None]],
) -> None:
    """Of the verdicts that a forecast leaves open, at these places, the first `DOUBTED` are put in
    by ``settle``; the others too if one of those is ok."""
    for some in (left[:DOUBTED], left[DOUBTED:]):
        settled = settle(some) if some else []
        for k, verdict in zip(some, settled, strict=True):
            verdicts[k] = verdict
        if Verdict.OK not in settled:
            break


class _NominalOrbits:
    """The nominal circuit's wanted orbit along ω or b. spent : attractors sought."""

    def __init__(
        self,
        plan: StudyPlan,
        question: Question,
        over: Over,
        used: float,
        progress: Callable[[], None],
    ) -> None:
        self.question, self.over, self.used = question, over, used
        self.progress, self.spent = progress, 0
        self._system: PiecewiseLinearSystem = Ensemble(plan.nominal()).reduction(0).system()
        self._known: dict[float, Orbit] = {used: question.start}

    def drive(self, value: float) -> Drive:
        """The generator at this ω or b."""
        e, ratio = self.question.excitation, value / self.used
        if self.over == "b":
            return e.louder(1.0 / ratio).drive
        return replace(e, frequency=e.frequency * ratio).drive

    def window(self) -> tuple[tuple[float, float], tuple[bool, bool]]:
        """Edges of the window around the setting in use; whether each is only the search's end."""
        (low, below), (high, above) = (self._edge(-1.0), self._edge(1.0))
        return (low, high), (below, above)

    def orbits(self, settings: Sequence[float]) -> list[Orbit | None]:
        """The wanted orbit at each setting; None where the nominal circuit does not show it."""
        orbits: dict[float, Orbit | None] = {}
        for value in sorted(settings, key=lambda v: abs(v - self.used)):
            near = min(self._known, key=lambda known: (abs(known - value), known))
            orbits[value] = self._known.get(value) or self._try(value, near)
        return [orbits[value] for value in settings]

    def _try(self, value: float, near: float) -> Orbit | None:
        self.spent += 1
        self.progress()
        try:
            orbit = settle(Flow(self._system, self.drive(value)), self._known[near].start)
        except ArithmeticError:
            return None
        if self.question.judge(orbit)[0] is not Verdict.OK:
            return None
        if self.question.spec.symmetric is False and orbit.asymmetry < NEARLY_SYMMETRIC:
            return None
        self._known[value] = orbit
        return orbit

    def _edge(self, sign: float) -> tuple[float, bool]:
        inside, pace = self.used, PACE
        while True:
            beyond = inside + sign * pace * self.used
            if abs(beyond - self.used) > REACH * self.used:
                return inside, True
            if self._try(beyond, inside) is None:
                break
            inside, pace = beyond, min(1.5 * pace, LARGEST_PACE)
        for _ in range(HALVINGS):
            middle = 0.5 * (inside + beyond)
            if self._try(middle, inside) is None:
                beyond = middle
            else:
                inside = middle
        return inside, False


def _check(name: str, values: Sequence[float]) -> None:
    if not len(values):
        raise InputError(None, name, list(values), "at least one value")
    for value in values:
        if not (np.isfinite(value) and value > 0.0):
            raise InputError(None, name, value, "a number > 0")
