"""Which recipe to give a response: candidates tried from the simplest on, as docs/definitions.md
("Reached") states. The sweep of the one that is taken is then tried without steps, and slower: what
a person does with a generator.
"""

from __future__ import annotations

import math
import os
import pickle
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from threading import Thread
from typing import Any

import numpy as np

from designer.base.progress import doing, part
from designer.base.second_process import Ask, Awaited
from designer.circuit.ensemble import BRIEF, Ensemble
from designer.dynamics.orbit import Orbit
from designer.dynamics.piecewise_linear import PiecewiseLinearSystem
from designer.spread.spread import draw_many
from designer.verdicts.exact_circuit import Case, settled
from designer.verdicts.verdict import Question, StudyPlan, Verdict
from designer.yields.power_up import switched_on
from designer.yields.start_recipe import SLOWER, Recipe, RecipeKind

TRIALS, FEW_TRIALS = 12, 4
"""Phases at which the nominal circuit is switched on; the first few of them, where none works, are
enough to go on to another recipe, and to ask what a person may do otherwise."""
BOARDS = 24
"""Sample boards that a recipe is tried on, if they show the response as built."""
STARTS = 3
"""Phases from which each of them is switched on."""
FEW_BOARDS = 8
"""Of the able ones, those that are asked what a person may do otherwise; so many starts on boards
are tried however long the sweep."""
BOARD_PERIODS = 20_000
"""Drive periods of sweeps on boards after which no further start is tried."""
HAND_PERIODS, LEAST_BY_HAND = 16_000, 4
"""Drive periods of all sweeps that are tried as a person may do otherwise; where they hold fewer
sweeps than the second, none is tried."""
TRIAL = "recipe:"
"""Stream of those boards."""
STEP = 0.01
"""Largest step of a sweep, as a fraction."""
HOLD = 20
"""Drive periods at each step of a sweep."""
SETTLE = 40
"""Drive periods of the last wait, beside those that shrink a deviation to ``REMAINDER``."""
REMAINDER = 1e-3
LONG_SWEEP, GOOD = 1000, 0.75
"""Drive periods of a sweep beyond which it is tried only where no shorter one is good: works from
all phases on the nominal circuit, and at this share of the starts on boards."""
LONGEST_WAIT = 4000
"""Drive periods of the last wait at most."""
ASIDE = 0.10
"""How far from the wanted frequency a short sweep begins."""
SOFT = 0.5
"""Share of the amplitude at which an amplitude ramp begins."""
ABOVE = 1.1
"""Where the long sweep begins, over the highest resonance inside the clearance."""
GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


def find_recipes(plan: StudyPlan, jobs: int = 1, other: Ask | None = None) -> tuple[Recipe, ...]:
    """A recipe for each question of the plan; its seed and number of samples do not matter.

    other : a process that takes questions once it is idle, and half of the trials once none is
    left; no recipe depends on it. What only calls functions here takes no question.
    """
    count = len(plan.questions)
    if other is None or jobs < 2 or not count:
        return tuple(_named(bench, n, count) for n, bench in enumerate(_benches(plan, jobs)))
    pickled, here, there = pickle.dumps(plan), jobs - jobs // 2, jobs // 2
    benches, left = _benches(plan, here), iter(range(count))
    waiting: dict[int, Awaited[Recipe]] = {}
    mine: dict[int, Recipe] = {}

    def hand_out() -> None:
        answer: Awaited[Any] = other(os.getpid)
        while answer.wait() and (number := next(left, None)) is not None:
            answer = waiting[number] = other(_found_there, pickled, there, number)

    beside = Thread(target=hand_out, daemon=True)
    try:
        for number in left:
            elsewhere = partial(other, _worked_there, pickled, there, number)
            bench = replace(benches[number], elsewhere=elsewhere, busy=beside.is_alive)
            if not mine:
                beside.start()
            mine[number] = _named(bench, number, count)
    finally:
        list(left)  # of those nobody is asked any more
    if len(mine) < count:
        beside.join()
    mine |= {number: answer() for number, answer in waiting.items() if answer.wait()}
    return tuple(mine[n] if n in mine else _named(benches[n], n, count) for n in range(count))


def _named(bench: _Bench, number: int, count: int) -> Recipe:
    with part(f"start recipe of response {number + 1} of {count}"):
        return _find(bench)


def _benches(plan: StudyPlan, jobs: int) -> tuple[_Bench, ...]:
    """Where the recipes of each question are tried."""
    nominal = Ensemble(plan.nominal())
    drawn = draw_many(plan.circuit, plan.spread, 0, range(BOARDS), TRIAL)
    sample = Ensemble(plan.modelled(drawn))
    return tuple(_Bench(question, nominal, sample, jobs) for question in plan.questions)


@lru_cache(maxsize=1)
def _benches_of(pickled: bytes, jobs: int) -> tuple[_Bench, ...]:
    return _benches(pickle.loads(pickled), jobs)


def _worked_there(
    pickled: bytes, jobs: int, number: int, are_samples: bool, trials: Sequence[_Trial]
) -> list[bool]:
    """``_Bench.worked`` of the question of this number, for a process that is asked often."""
    return _benches_of(pickled, jobs)[number].worked(are_samples, trials)


def _found_there(pickled: bytes, jobs: int, number: int) -> Recipe:
    """The recipe of the question of this number, for a process that is asked about several."""
    return _find(_benches_of(pickled, jobs)[number])


def candidates(question: Question, system: PiecewiseLinearSystem) -> Iterator[Recipe]:
    """Recipes for a response, the simplest first. system : the nominal circuit."""
    target, spec = question.excitation, question.spec
    direct = Recipe(
        RecipeKind.DIRECT,
        spec.omega,
        target,
        target,
        steps=0,
        hold=HOLD,
        wait=_wait(question.start),
        hertz_scale=1.0 / (2.0 * math.pi) if spec.in_hertz else None,
    )

    def sweep(way: RecipeKind, frequency: float, amplitude: float) -> Recipe:
        first = replace(target.louder(amplitude / target.amplitude), frequency=frequency)
        ratio = max(
            abs(math.log(frequency / target.frequency)),
            abs(math.log(amplitude / target.amplitude)),
        )
        steps = math.ceil(ratio / math.log1p(STEP) - 1e-9)
        return replace(direct, way=way, first=first, steps=steps)

    frequency, amplitude = target.frequency, target.amplitude
    yield direct
    yield sweep(RecipeKind.FROM_ABOVE, frequency * (1.0 + ASIDE), amplitude)
    yield sweep(RecipeKind.FROM_BELOW, frequency * (1.0 - ASIDE), amplitude)
    yield sweep(RecipeKind.AMPLITUDE, frequency, SOFT * amplitude)
    far = ABOVE * highest_resonance(system)
    if far > frequency * (1.0 + ASIDE):
        yield sweep(RecipeKind.FROM_FAR, far, amplitude)


def highest_resonance(system: PiecewiseLinearSystem) -> float:
    """The highest resonance of the free motion inside the clearance, per unit of the system's time;
    0 without one."""
    poles = np.linalg.eigvals(system.mode(system.start).A).astype(complex)
    return float(np.abs(poles.imag).max()) / (2.0 * math.pi)


@dataclass(frozen=True)
class _Trials:
    """A recipe with what became of its starts. boards : by the able board and the place of its
    phase."""

    recipe: Recipe
    nominal: tuple[bool, ...] = ()
    boards: Mapping[tuple[int, int], bool] = field(default_factory=dict)

    @property
    def certain(self) -> bool:
        return all(self.nominal) and all(self.boards.values())

    @property
    def good(self) -> bool:
        boards = self.boards.values()
        return all(self.nominal) and sum(boards) >= GOOD * max(len(boards), 1)

    @property
    def share(self) -> float:
        """Share of all starts that lead to the response."""
        starts = (*self.nominal, *self.boards.values())
        return sum(starts) / len(starts)

    def beaten_by(self, other: _Trials) -> bool:
        """Whether the other one works more often, by a standard error of the difference or more:
        of the starts that one of the two fails at and the other does not, in √ of their number.
        Starts on boards that only one of them was tried at do not count."""
        pairs = [
            *zip(self.nominal, other.nominal, strict=True),
            *((yes, other.boards[at]) for at, yes in self.boards.items() if at in other.boards),
        ]
        worse, better = pairs.count((False, True)), pairs.count((True, False))
        return worse > better and worse - better >= math.sqrt(worse + better)

    @property
    def counted(self) -> Recipe:
        return replace(
            self.recipe,
            reached=sum(self.nominal),
            trials=len(self.nominal),
            board_reached=sum(self.boards.values()),
            board_trials=len(self.boards),
        )


@dataclass(frozen=True)
class _Trial:
    """A start that is tried. known : the board's own orbit, if it attracts."""

    board: int
    recipe: Recipe
    phase: float
    known: Orbit | None


@dataclass(frozen=True)
class _Bench:
    """Where the recipes of a question are tried. able : sample boards that show it as built, with
    the orbits that they show. elsewhere : ``worked`` by another process, unless that is ``busy``;
    what it gives waits for the answer."""

    question: Question
    nominal: Ensemble
    sample: Ensemble
    jobs: int
    able: Mapping[int, Orbit] = field(default_factory=dict)
    elsewhere: Callable[[bool, Sequence[_Trial]], Callable[[], list[bool]]] | None = None
    busy: Callable[[], bool] = bool

    def on_nominal(self, trials: _Trials, count: int = TRIALS) -> _Trials:
        """The trials from the first ``count`` phases, without those that were tried before."""
        own = self.question.start
        known = own if self.question.periodic and own.radius < 1.0 else None
        starts = [
            _Trial(0, trials.recipe, phase(k), known) for k in range(len(trials.nominal), count)
        ]
        return replace(trials, nominal=(*trials.nominal, *self._shared(False, starts)))

    def on_boards(self, trials: _Trials, boards: int = BOARDS, each: int = STARTS) -> _Trials:
        """On the first ``boards`` able ones, from the first ``each`` phases of each, without those
        that were tried before; from fewer phases, and on fewer boards, where the sweep is long."""
        most = max(BOARD_PERIODS // max(trials.recipe.sweep_periods, 1), FEW_BOARDS)
        each = min(each, max(most // FEW_BOARDS, 1))
        able = list(self.able.items())[: min(boards, most // each)]
        periodic = self.question.periodic
        starts = {
            (i, k): _Trial(i, trials.recipe, phase(STARTS * i + k), orbit if periodic else None)
            for i, orbit in able
            for k in range(each)
            if (i, k) not in trials.boards
        }
        found = self._shared(True, list(starts.values()))
        return replace(trials, boards={**trials.boards, **dict(zip(starts, found, strict=True))})

    def _shared(self, are_samples: bool, trials: Sequence[_Trial]) -> list[bool]:
        """``worked``, half of it elsewhere: by boards, for the starts of one share its tables."""
        if self.elsewhere is None or len(trials) < 2 or self.busy():
            return self.worked(are_samples, trials)
        boards = list(dict.fromkeys(t.board for t in trials))
        others = set(boards[1::2])
        away = [t.board in others if others else k % 2 == 1 for k, t in enumerate(trials)]
        halves = [
            [t for t, at in zip(trials, away, strict=True) if at is is_away]
            for is_away in (False, True)
        ]
        there = self.elsewhere(are_samples, halves[1])
        found = iter(self.worked(are_samples, halves[0])), iter(there())
        return [next(found[is_away]) for is_away in away]

    def worked(self, are_samples: bool, trials: Sequence[_Trial]) -> list[bool]:
        """Whether each of these starts leads to the response. are_samples : on the sample boards,
        not the nominal one."""
        ends = switched_on(
            self.sample if are_samples else self.nominal,
            [(t.board, self.question, t.recipe, t.phase) for t in trials],
            self.jobs,
            [t.known for t in trials],
            within=BRIEF,
        )
        return [end.verdict is Verdict.OK for end in ends]


def _find(bench: _Bench) -> Recipe:
    drawn, able = _able(bench)
    bench = replace(bench, able=able)
    every: list[_Trials] = []
    for option in candidates(bench.question, bench.nominal.reduction(0).system()):
        if option.sweep_periods > LONG_SWEEP and any(trials.good for trials in every):
            continue
        doing(str(option.way))
        trials = _Trials(replace(option, boards=drawn, able=len(able)))
        trials = bench.on_nominal(trials, FEW_TRIALS)
        if any(trials.nominal):
            trials = bench.on_nominal(trials)
        if all(trials.nominal):
            trials = bench.on_boards(trials, FEW_BOARDS)
            if trials.certain:
                trials = bench.on_boards(trials)
            if trials.certain:
                return _by_hand(trials, bench)
        every.append(trials)
    if not any(any(trials.nominal) for trials in every):
        every = [bench.on_nominal(trials) for trials in every]
    return _best(every, bench)


def _able(bench: _Bench) -> tuple[int, Mapping[int, Orbit]]:
    """How many boards were asked, and those that show the response as built, with their orbits.
    Where none of the first half does, the others are not asked."""
    question, able = bench.question, dict[int, Orbit]()
    for asked in (range(BOARDS // 2), range(BOARDS // 2, BOARDS)):
        cases: list[Case] = [
            (i, question, question.excitation, question.start.start) for i in asked
        ]
        ends = settled(bench.sample, cases, bench.jobs, within=BRIEF)
        able |= {
            i: orbit
            for i, (orbit, verdict, _) in zip(asked, ends, strict=True)
            if verdict is Verdict.OK
        }
        if not able:
            return asked.stop, able
    return BOARDS, able


def _best(every: Sequence[_Trials], bench: _Bench) -> Recipe:
    """The first recipe that no other one plainly beats, of those that worked at all."""
    working = [t for t in every if any(t.nominal)]
    if not working:
        return every[0].counted
    first = max(working, key=lambda t: sum(t.nominal))
    hopeful = [t for t in working if not replace(t, boards={}).beaten_by(replace(first, boards={}))]
    complete = [bench.on_boards(t) for t in hopeful]
    best = max(complete, key=lambda t: t.share)
    return _by_hand(next(t for t in complete if not t.beaten_by(best)), bench)


def _by_hand(trials: _Trials, bench: _Bench) -> Recipe:
    """The recipe with how freely its sweep may be done: without steps, and slower. These are tried
    from a few phases, and from one phase of a few boards, the fewer the longer the sweep is."""
    recipe = trials.counted
    if recipe.way is RecipeKind.DIRECT:
        return recipe

    def as_well(other: Recipe) -> bool:
        starts = HAND_PERIODS // other.sweep_periods
        if starts < LEAST_BY_HAND:
            return False
        phases = min(starts // 3 + 1, FEW_TRIALS)
        few = min(starts - phases, FEW_BOARDS, len(bench.able))
        tried = bench.on_nominal(_Trials(other), phases)
        if sum(tried.nominal) < sum(trials.nominal[:phases]):
            return False
        boards = bench.on_boards(tried, few, 1).boards
        return sum(boards.values()) >= sum(trials.boards[at] for at in boards)

    smooth = as_well(recipe.refined())
    slow = recipe.refined(SLOWER) if smooth else replace(recipe, hold=SLOWER * recipe.hold)
    return replace(recipe, smooth=smooth, slower=as_well(slow))


def phase(number: int) -> float:
    """Phases [rad] that fill the circle, and its half, however many are taken: by the golden
    section."""
    return 2.0 * math.pi * ((0.5 + number * GOLDEN) % 1.0)


def _wait(orbit: Orbit) -> int:
    """Drive periods until a deviation from the orbit has shrunk, by its slowest multiplier."""
    radius = orbit.radius
    if not 0.0 < radius < 1.0:
        return SETTLE
    return min(SETTLE + math.ceil(orbit.n * math.log(REMAINDER) / math.log(radius)), LONGEST_WAIT)
