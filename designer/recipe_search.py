"""Which recipe to give a response: candidates tried from the simplest on.

Each is tried on the nominal circuit and on sample boards of its own, from discharged
capacitors, with phases of the generator that fill the circle. The first that always worked is
taken, else the one that worked most often. Its sweep is then tried without steps, and
slower: what a person does with a generator.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from designer.boards import Boards
from designer.circuit import nominal_board
from designer.deck import Excitation
from designer.ensemble import Ensemble
from designer.orbit import Orbit
from designer.reached import switched_on
from designer.recipe import SLOWER, Recipe, Way
from designer.spread import draw_many
from designer.system import PiecewiseLinearSystem
from designer.verdict import Question, StudyPlan, Verdict, judge

TRIALS = 12
"""Phases at which the nominal circuit is switched on."""
BOARDS = 6
"""Sample boards that a recipe is tried on, once each."""
TRIAL = "recipe:"
"""Stream of those boards."""
STEP = 0.01
"""Largest step of a sweep, as a fraction."""
HOLD = 20
"""Drive periods at each step of a sweep."""
SETTLE = 40
"""Drive periods of the last wait, beside those that shrink a deviation to ``REMAINDER``."""
REMAINDER = 1e-3
LONGEST_WAIT = 4000
"""Drive periods of the last wait at most."""
ASIDE = 0.10
"""How far from the wanted frequency a short sweep begins."""
SOFT = 0.5
"""Of the amplitude: where an amplitude ramp begins."""
ABOVE = 1.1
"""Of the highest resonance inside the clearance: where the long sweep begins."""
GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


def find_recipes(plan: StudyPlan, jobs: int = 1) -> tuple[Recipe, ...]:
    """A recipe for each question of the plan; its seed and number of samples do not matter."""
    nominal = Ensemble(Boards.of(plan.circuit, [nominal_board(plan.circuit)]))
    sample = Ensemble(draw_many(plan.circuit, plan.spread, 0, range(BOARDS), TRIAL))
    return tuple(_find(question, nominal, sample, jobs) for question in plan.questions)


def candidates(question: Question, system: PiecewiseLinearSystem) -> Iterator[Recipe]:
    """Recipes for a response, the simplest first. system : the nominal circuit."""
    target = question.excitation
    wait = _wait(question.start)

    def sweep(way: Way, frequency: float, amplitude: float) -> Recipe:
        first = Excitation(frequency, amplitude, target.offset)
        ratio = max(
            abs(math.log(frequency / target.frequency)),
            abs(math.log(amplitude / target.amplitude)),
        )
        steps = math.ceil(ratio / math.log1p(STEP) - 1e-9)
        return Recipe(way, question.spec.omega, target, first, steps, HOLD, wait)

    frequency, amplitude = target.frequency, target.amplitude
    yield Recipe(Way.DIRECT, question.spec.omega, target, target, 0, HOLD, wait)
    yield sweep(Way.FROM_ABOVE, frequency * (1.0 + ASIDE), amplitude)
    yield sweep(Way.FROM_BELOW, frequency * (1.0 - ASIDE), amplitude)
    yield sweep(Way.AMPLITUDE, frequency, SOFT * amplitude)
    far = ABOVE * highest_resonance(system)
    if far > frequency * (1.0 + ASIDE):
        yield sweep(Way.FROM_FAR, far, amplitude)


def highest_resonance(system: PiecewiseLinearSystem) -> float:
    """Of the free motion inside the clearance, per unit of the system's time; 0 without one."""
    poles = np.linalg.eigvals(system.mode(system.start).A).astype(complex)
    return float(np.abs(poles.imag).max()) / (2.0 * math.pi)


def _find(question: Question, nominal: Ensemble, sample: Ensemble, jobs: int) -> Recipe:
    as_built = sample.settle(
        range(BOARDS),
        [question.excitation.drive] * BOARDS,
        np.tile(question.start.start, (BOARDS, 1)),
        jobs=jobs,
    )
    able = [i for i, o in enumerate(as_built) if judge(o, question.spec, question.start)[0] == "ok"]
    tried = []
    for option in candidates(question, nominal.reduction(0).system()):
        known = _on_nominal(replace(option, boards=BOARDS), question, nominal, jobs)
        if known.rate == 1.0:
            known = _on_boards(known, question, sample, able, jobs)
            if known.rate == 1.0:
                return _by_hand(known, question, nominal, sample, able, jobs)
        tried.append(known)
    # None is certain: then all are tried on the boards, and the one that did best is taken.
    whole = [
        t if t.reached == t.trials else _on_boards(t, question, sample, able, jobs) for t in tried
    ]
    best = max(whole, key=lambda recipe: recipe.rate)
    return _by_hand(best, question, nominal, sample, able, jobs)


def _by_hand(
    recipe: Recipe,
    question: Question,
    nominal: Ensemble,
    sample: Ensemble,
    able: Sequence[int],
    jobs: int,
) -> Recipe:
    """The recipe with how freely its sweep may be done: without steps, and slower."""
    if recipe.way is Way.DIRECT:
        return recipe

    def as_well(other: Recipe) -> bool:
        met = _on_boards(_on_nominal(other, question, nominal, jobs), question, sample, able, jobs)
        return met.reached >= recipe.reached and met.board_reached >= recipe.board_reached

    smooth = as_well(recipe.refined())
    slow = recipe.refined(SLOWER) if smooth else replace(recipe, hold=SLOWER * recipe.hold)
    return replace(recipe, smooth=smooth, slower=as_well(slow))


def _on_nominal(recipe: Recipe, question: Question, nominal: Ensemble, jobs: int) -> Recipe:
    ended = switched_on(nominal, [(0, question, recipe, phase(k)) for k in range(TRIALS)], jobs)
    reached = sum(e.verdict is Verdict.OK for e in ended)
    return replace(recipe, reached=reached, trials=len(ended))


def _on_boards(
    recipe: Recipe, question: Question, sample: Ensemble, able: Sequence[int], jobs: int
) -> Recipe:
    starts = [(i, question, recipe, phase(i)) for i in able]
    ended = switched_on(sample, starts, jobs)
    reached = sum(e.verdict is Verdict.OK for e in ended)
    return replace(recipe, board_reached=reached, board_trials=len(ended))


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
