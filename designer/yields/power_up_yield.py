"""Reached: which boards end on a response when they are switched on by its recipe.

From discharged capacitors, with the generator anywhere in its period (drawn from seed, sample and
response) and the op-amps free to clip, on the exact circuit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.base.threads import parallel
from designer.circuit.ensemble import Ensemble
from designer.circuit.reduction import FloatingCircuit
from designer.dynamics.orbit import Orbit, failed
from designer.spread.random_streams import uniforms
from designer.spread.spread import draw_many
from designer.yields.power_up import Arrival, follow
from designer.yields.start_recipe import Recipe
from designer.yields.verdict import Question, StudyPlan, Verdict, judge

STREAM = "phase:"
"""Sets the generator's phase apart from the other draws of a sample."""


@dataclass(frozen=True)
class PowerUpAnswer:
    """One sample of one response, switched on by the recipe."""

    sample: int
    """Number of the board."""
    question: int
    """Number of the question of the plan."""
    verdict: Verdict
    """What became of the board."""
    response: str
    """n-p-q or status that it shows."""
    reason: str
    """Why it is not ok, or ""."""
    phase: float
    """Phase of the generator at power-up [rad]."""
    periods: int
    """Drive periods from power-up to the end of the recipe, and those that settling cost after
    it."""
    clipped: bool
    """Whether an op-amp that ought to be linear was at its limit in the first periods."""


@dataclass(frozen=True)
class Ended:
    """What a power-up led to."""

    verdict: Verdict
    """What became of the board."""
    reason: str
    """Why it is not ok, or ""."""
    orbit: Orbit
    """The orbit that was reached; None where none was."""
    arrival: Arrival | None
    """State at the end of the recipe; None where the flow failed."""


def switched_on(
    ensemble: Ensemble,
    starts: Sequence[tuple[int, Question, Recipe, float]],
    jobs: int = 1,
) -> list[Ended]:
    """What each start leads to: a board of the ensemble, a response with its recipe, and the drive
    phase at power-up [rad]."""

    groups: dict[tuple[int, Recipe], list[int]] = {}
    for k, (board, _, recipe, _) in enumerate(starts):
        groups.setdefault((board, recipe), []).append(k)

    def arrive(group: tuple[tuple[int, Recipe], list[int]]) -> list[Arrival | str]:
        (board, recipe), members = group
        try:
            system = ensemble.reduction(board).system()
            met = follow(system, recipe.drives, [starts[k][3] for k in members])
        except (FloatingCircuit, ArithmeticError, np.linalg.LinAlgError) as error:
            return [str(error)] * len(members)
        return ["the flow did not get through the start" if a is None else a for a in met]

    found: dict[int, Arrival | str] = {}
    for members, ways in zip(groups.values(), parallel(arrive, groups.items(), jobs), strict=True):
        found |= dict(zip(members, ways, strict=True))
    arrivals = [found[k] for k in range(len(starts))]
    there = [
        (start, met)
        for start, met in zip(starts, arrivals, strict=True)
        if not isinstance(met, str)
    ]
    settled = iter(
        ensemble.settle(
            [board for (board, *_), _ in there],
            [recipe.target.drive for (_, _, recipe, _), _ in there],
            np.array([met.state for _, met in there]),
            jobs=jobs,
        )
        if there
        else ()
    )
    out = []
    for (_, question, _, _), met in zip(starts, arrivals, strict=True):
        orbit = failed(met) if isinstance(met, str) else next(settled)
        verdict, reason = judge(orbit, question.spec, question.start)
        out.append(Ended(verdict, reason, orbit, None if isinstance(met, str) else met))
    return out


def phases(seed: int, question: Question, indices: range) -> Array:
    """(N,) phase of the generator at power-up [rad] on each of these samples; it depends on the
    response, not on its place in the plan."""
    return 2.0 * np.pi * uniforms(seed, f"{STREAM}{question.stream}", indices)


def reached_block(
    plan: StudyPlan,
    indices: range,
    recipes: Sequence[Recipe],
    jobs: int,
    progress: Callable[[], None] = lambda: None,
) -> list[PowerUpAnswer]:
    """A row for every board of the block and every question, in order.

    recipes : one for each question (``yields.start_recipe_search``). progress : called once a row.
    """
    ensemble = Ensemble(draw_many(plan.circuit, plan.spread, plan.seed, indices))
    asked = [(i, number) for i in range(len(indices)) for number in range(len(plan.questions))]
    drawn = [phases(plan.seed, question, indices).tolist() for question in plan.questions]
    starts = [(i, plan.questions[number], recipes[number], drawn[number][i]) for i, number in asked]
    rows = []
    for (i, number), ended in zip(asked, switched_on(ensemble, starts, jobs), strict=True):
        arrival = ended.arrival
        rows.append(
            PowerUpAnswer(
                sample=indices[i],
                question=number,
                verdict=ended.verdict,
                response=ended.orbit.response,
                reason=ended.reason,
                phase=drawn[number][i],
                periods=ended.orbit.periods + (0 if arrival is None else arrival.periods),
                clipped=arrival is not None and arrival.clipped,
            )
        )
        progress()
    return rows
