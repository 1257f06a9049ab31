"""Boards from the moment they are switched on: every capacitor discharged, the generator anywhere
in its period, the op-amps free to clip, on the exact circuit.

The flow starts at drive phase 0. The rest of the first period is run with the generator as two more
states, sine and cosine, which start at any phase: as exact as everything else.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from designer.base.arrays import Array
from designer.base.threads import parallel
from designer.circuit.ensemble import Ensemble
from designer.circuit.reduction import FloatingCircuit
from designer.dynamics.drive_states import with_drive_states
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowStatus
from designer.dynamics.orbit import Orbit, failed
from designer.dynamics.piecewise_linear import Drive, PiecewiseLinearSystem
from designer.spread.random_streams import uniforms
from designer.verdicts.exact_rung import Case, settled
from designer.verdicts.verdict import BoardRow, Question, StudyPlan, Verdict
from designer.yields.start_recipe import Recipe

WATCHED = 20
"""Drive periods after switching on in which clipping is looked for."""
STREAM = "phase:"
"""Sets the generator's phase apart from the other draws of a sample."""


@dataclass(frozen=True)
class PowerUp(BoardRow):
    """A board switched on by the recipe."""

    phase: float
    """Phase of the generator at power-up [rad]."""
    periods: int
    """Drive periods from power-up to the end of the recipe, and those that settling cost after
    it."""
    clipped: bool
    """Whether an op-amp that ought to be linear was at its limit in the first periods."""


class Arrival(NamedTuple):
    """Where a recipe leads."""

    state: Array
    """(n,) state at drive phase 0."""
    periods: int
    """Drive periods that it took."""
    clipped: bool
    """Whether an element that ought to be linear was at its limit in the first ``WATCHED``."""


class PowerUpEnd(NamedTuple):
    """What a power-up leads to."""

    orbit: Orbit
    """The orbit that it settled on."""
    verdict: Verdict
    """What became of the board."""
    reason: str
    """Why it is not ok, or ""."""
    arrival: Arrival | None
    """The end of the recipe; None where the flow failed."""


def until_strobe(driven: PiecewiseLinearSystem, drive: Drive, phase: float) -> Arrival | None:
    """The first strobe after switching on at drive phase ``phase`` [rad]; None if the flow fails.

    driven : the system with the drive's sine and cosine as states (``with_drive_states``).
    """
    left = 1.0 - (phase / (2.0 * np.pi)) % 1.0
    start = np.zeros(driven.size)
    start[-2:] = np.sin(phase), np.cos(phase)
    # The generator's swing is in the states: what is left of the drive is its offset.
    rest = Drive(drive.omega / left, 0.0, drive.offset)
    # One period: the tables of the fast path cost as much, and are compiled for two more states.
    run = Flow(driven, rest, fast=False).run(start, 1, measure=True)
    if run.status is not FlowStatus.DONE:
        return None
    return Arrival(run.strobes[-1][:-2], 1, run.clipped_time > 0.0)


def follow(
    system: PiecewiseLinearSystem, stages: Sequence[tuple[Drive, int]], phases: Sequence[float]
) -> list[Arrival | None]:
    """Switch on at each of these drive phases [rad] under the first drive, then each drive for its
    whole periods, phase-continuous; None where the flow fails.

    Raises
    ------
    ArithmeticError : no mode of the system holds at some state on the way.
    """
    driven = with_drive_states(system, stages[0][0])
    arrivals = [until_strobe(driven, stages[0][0], phase) for phase in phases]
    for number, (drive, periods) in enumerate(stages):
        flow = Flow(system, drive)  # one for all phases: its tables cost more than a few periods
        watched = min(periods, WATCHED) if number == 0 else 0
        arrivals = [_on(flow, a, watched, True) for a in arrivals]
        arrivals = [_on(flow, a, periods - watched, False) for a in arrivals]
    return arrivals


def _on(flow: Flow, arrival: Arrival | None, periods: int, measure: bool) -> Arrival | None:
    if arrival is None or periods == 0:
        return arrival
    run = flow.run(arrival.state, periods, measure=measure)
    if run.status is not FlowStatus.DONE:
        return None
    clipped = arrival.clipped or run.clipped_time > 0.0
    return Arrival(run.strobes[-1], arrival.periods + periods, clipped)


def switched_on(
    ensemble: Ensemble,
    starts: Sequence[tuple[int, Question, Recipe, float]],
    jobs: int = 1,
) -> list[PowerUpEnd]:
    """What each start leads to: a board of the ensemble, a response with its recipe, and the drive
    phase at power-up [rad]."""
    arrivals = _arrivals(ensemble, starts, jobs)
    cases: list[Case] = [
        (board, question, recipe.target, arrival.state)
        for (board, question, recipe, _), arrival in zip(starts, arrivals, strict=True)
        if isinstance(arrival, Arrival)
    ]
    ends = iter(settled(ensemble, cases, jobs))
    return [
        PowerUpEnd(failed(arrival), Verdict.FAILED, arrival, None)
        if isinstance(arrival, str)
        else PowerUpEnd(*next(ends), arrival)
        for arrival in arrivals
    ]


def _arrivals(
    ensemble: Ensemble, starts: Sequence[tuple[int, Question, Recipe, float]], jobs: int
) -> list[Arrival | str]:
    """Where each start's recipe leads; the reason where the flow fails."""
    groups: dict[tuple[int, Recipe], list[int]] = {}
    for k, (board, _, recipe, _) in enumerate(starts):
        groups.setdefault((board, recipe), []).append(k)

    def arrive(group: tuple[tuple[int, Recipe], list[int]]) -> list[Arrival | str]:
        (board, recipe), members = group
        try:
            system = ensemble.reduction(board).system()
            arrivals = follow(system, recipe.drives, [starts[k][3] for k in members])
        except (FloatingCircuit, ArithmeticError, np.linalg.LinAlgError) as error:
            return [str(error)] * len(members)
        return [a or "the flow did not get through the start" for a in arrivals]

    by_start: dict[int, Arrival | str] = {}
    for members, some in zip(groups.values(), parallel(arrive, groups.items(), jobs), strict=True):
        by_start |= dict(zip(members, some, strict=True))
    return [by_start[k] for k in range(len(starts))]


def phases(seed: int, question: Question, indices: range) -> Array:
    """(N,) phase of the generator at power-up [rad] on each of these samples; it depends on the
    response, not on its place in the plan."""
    return 2.0 * np.pi * uniforms(seed, f"{STREAM}{question.stream}", indices)


def power_up_block(
    plan: StudyPlan,
    indices: range,
    recipes: Sequence[Recipe],
    jobs: int,
    progress: Callable[[], None] = lambda: None,
) -> list[PowerUp]:
    """A row for every board of the block and every question, in order.

    recipes : one for each question (``yields.start_recipe_search``). progress : called once a row.
    """
    ensemble = Ensemble(plan.boards(indices))
    switch_on = [phases(plan.seed, question, indices).tolist() for question in plan.questions]
    pairs = plan.rows(indices)
    starts = [(i, plan.questions[k], recipes[k], switch_on[k][i]) for i, k in pairs]
    rows = []
    for (i, k), end in zip(pairs, switched_on(ensemble, starts, jobs), strict=True):
        way = end.arrival
        rows.append(
            PowerUp(
                sample=indices[i],
                question=k,
                verdict=end.verdict,
                response=end.orbit.response,
                reason=end.reason,
                phase=switch_on[k][i],
                periods=end.orbit.periods + (0 if way is None else way.periods),
                clipped=way is not None and way.clipped,
            )
        )
        progress()
    return rows
