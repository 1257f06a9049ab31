"""Boards from the moment they are switched on: every capacitor discharged, the generator anywhere
in its period, the op-amps free to clip, on the exact circuit.

The rest of the first period is run by the general kernel, which starts at any phase; the drives
after it by the compiled way of boards where that knows it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from designer.base.arrays import Array, Mask
from designer.base.threads import parallel
from designer.circuit.ensemble import Ensemble
from designer.circuit.reduction import FloatingCircuit
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowStatus
from designer.dynamics.orbit import Orbit, failed
from designer.dynamics.piecewise_linear import Drive, PiecewiseLinearSystem
from designer.spread.random_streams import uniforms
from designer.verdicts.exact_circuit import Case, settled
from designer.verdicts.verdict import BoardRow, Question, StudyPlan, Verdict
from designer.yields.start_recipe import Recipe

WATCHED = 20
"""Drive periods after switching on in which clipping is looked for."""
NEAR = 0.01
"""Of each state's peak: a board that has come as near to an orbit that is known to attract, and is
nearer after one more of its periods, has arrived."""
BESIDE = 24
"""Boards whose modes are solved together, where one of them enters these."""
WAITS = (8, 8, 4)
"""The parts of the last drive's periods after which a start may have come to its orbit."""
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


Swept = Callable[[Sequence[tuple[Drive, int]], Array], tuple[Array, Mask]]
"""What knows the way of a board through drives from several states, or where it does not
(``Ensemble.swept`` of a board)."""


def until_strobe(flow: Flow, phase: float) -> Arrival | None:
    """The first strobe after switching on at drive phase ``phase`` [rad]; None if the flow fails.

    Raises
    ------
    ArithmeticError : no mode of the system holds at the start.
    """
    run = flow.to_strobe(np.zeros(flow.system.size), phase)
    if run.status is not FlowStatus.DONE:
        return None
    return Arrival(run.strobes[-1], 1, run.clipped_time > 0.0)


def follow(
    system: PiecewiseLinearSystem,
    stages: Sequence[tuple[Drive, int]],
    phases: Sequence[float],
    swept: Swept | None = None,
) -> list[Arrival | None]:
    """Switch on at each of these drive phases [rad] under the first drive, then each drive for its
    whole periods, phase-continuous; None where the flow fails.

    swept : a faster way through the stages, of the same system.

    Raises
    ------
    ArithmeticError : no mode of the system holds at some state on the way.
    """
    # One for all phases: its tables cost more than a few periods.
    general = Flow(system, stages[0][0], fast=False)
    return _onwards(system, stages, [until_strobe(general, phase) for phase in phases], swept)


def _onwards(
    system: PiecewiseLinearSystem,
    stages: Sequence[tuple[Drive, int]],
    arrivals: Sequence[Arrival | None],
    swept: Swept | None,
    watch: bool = True,
) -> list[Arrival | None]:
    """The way on from these arrivals, as of ``follow``. watch : whether the first of the stages
    begins with switching on, so that clipping is looked for."""
    known = _swept(swept, stages, arrivals)
    rest = [None if k in known else arrival for k, arrival in enumerate(arrivals)]
    for number, stage in enumerate(stages):
        if not any(rest):
            break
        # What clips in one stage need not do so in the next one.
        through = _swept(swept, [stage], rest) if len(stages) > 1 else {}
        left = [None if k in through else arrival for k, arrival in enumerate(rest)]
        if any(left):
            drive, periods = stage
            flow = Flow(system, drive)
            watched = min(periods, WATCHED) if watch and number == 0 else 0
            left = [_on(flow, a, watched, True) for a in left]
            left = [_on(flow, a, periods - watched, False) for a in left]
        rest = [through.get(k, arrival) for k, arrival in enumerate(left)]
    return [known.get(k, arrival) for k, arrival in enumerate(rest)]


def _swept(
    swept: Swept | None, stages: Sequence[tuple[Drive, int]], arrivals: Sequence[Arrival | None]
) -> dict[int, Arrival]:
    """The arrivals that the faster way knows after these stages, by their places."""
    begun = {k: arrival for k, arrival in enumerate(arrivals) if arrival is not None}
    if swept is None or not begun:
        return {}
    states, periods = np.array([a.state for a in begun.values()]), sum(n for _, n in stages)
    ends = zip(begun.items(), *swept(stages, states), strict=True)
    return {
        k: Arrival(end, arrival.periods + periods, arrival.clipped)
        for (k, arrival), end, whole in ends
        if whole
    }


def _until_near(
    system: PiecewiseLinearSystem,
    stages: Sequence[tuple[Drive, int]],
    phases: Sequence[float],
    swept: Swept,
    orbit: Orbit,
) -> list[Arrival | None]:
    """As ``follow``, but the last drive's periods end where a start has come to an orbit that
    attracts."""
    *before, (drive, periods) = stages
    parts = [max(periods // share, 1) for share in WAITS]
    parts.append(max(periods - sum(parts), 0))
    arrivals = follow(system, [*before, (drive, parts[0])], phases, swept)
    for part in parts[1:]:
        there = [k for k, arrival in enumerate(arrivals) if arrival is not None]
        states = np.array([a.state for a in arrivals if a is not None])
        near = come_to(orbit, states, swept, drive) if there else np.zeros(0, dtype=bool)
        left = dict(zip(there, ~near, strict=True))
        rest = [arrival if left.get(k) else None for k, arrival in enumerate(arrivals)]
        if not any(rest):
            break
        later = _onwards(system, [(drive, part)], rest, swept, watch=False)
        arrivals = [later[k] if left.get(k) else one for k, one in enumerate(arrivals)]
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
    known: Sequence[Orbit | None] = (),
    *,
    within: int | None = None,
) -> list[PowerUpEnd]:
    """What each start leads to: a board of the ensemble, a response with its recipe, and the drive
    phase at power-up [rad].

    known : of each start the board's own orbit of the response, where it has one that attracts; a
    start that has come to it is not settled again. within : as of ``Ensemble.respond``.
    """
    arrivals = _arrivals(ensemble, starts, known, jobs)
    orbits = _arrived(ensemble, starts, arrivals, known, jobs)
    cases: list[Case] = [
        (board, question, recipe.target, arrival.state)
        for (board, question, recipe, _), arrival, orbit in zip(
            starts, arrivals, orbits, strict=True
        )
        if isinstance(arrival, Arrival) and orbit is None
    ]
    ends = iter(settled(ensemble, cases, jobs, within=within))
    out = []
    for (_, question, _, _), arrival, orbit in zip(starts, arrivals, orbits, strict=True):
        if not isinstance(arrival, Arrival):
            out.append(PowerUpEnd(failed(arrival), Verdict.FAILED, arrival, None))
        elif orbit is not None:
            out.append(PowerUpEnd(orbit, *question.judge(orbit), arrival))
        else:
            out.append(PowerUpEnd(*next(ends), arrival))
    return out


def _arrivals(
    ensemble: Ensemble,
    starts: Sequence[tuple[int, Question, Recipe, float]],
    known: Sequence[Orbit | None],
    jobs: int,
) -> list[Arrival | str]:
    """Where each start's recipe leads; the reason where the flow fails. known : as of
    ``switched_on``: a start that has come to that orbit does not wait until the recipe's end."""
    groups: dict[tuple[int, Recipe], list[int]] = {}
    for k, (board, _, recipe, _) in enumerate(starts):
        groups.setdefault((board, recipe), []).append(k)
    # The starts of one board share its tables, unless threads would have nothing to do.
    parts = 1 if len(groups) >= jobs else jobs
    tasks = [
        (key, members[k::parts])
        for key, members in groups.items()
        for k in range(min(parts, len(members)))
    ]

    boards = list(dict.fromkeys(board for board, _ in groups))
    neighbours = {b: boards[k - k % BESIDE :][:BESIDE] for k, b in enumerate(boards)}

    def arrive(task: tuple[tuple[int, Recipe], list[int]]) -> list[Arrival | str]:
        (board, recipe), members = task
        try:
            system = ensemble.reduction(board).system()
            swept = partial(ensemble.swept, board, neighbours=neighbours[board])
            phases = [starts[k][3] for k in members]
            orbit = known[members[0]] if known else None
            if orbit is None:
                arrivals = follow(system, recipe.drives, phases, swept)
            else:
                arrivals = _until_near(system, recipe.drives, phases, swept, orbit)
        except (FloatingCircuit, ArithmeticError, np.linalg.LinAlgError) as error:
            return [str(error)] * len(members)
        return [a or "the flow did not get through the start" for a in arrivals]

    by_start: dict[int, Arrival | str] = {}
    for (_, members), some in zip(tasks, parallel(arrive, tasks, jobs), strict=True):
        by_start |= dict(zip(members, some, strict=True))
    return [by_start[k] for k in range(len(starts))]


def _arrived(
    ensemble: Ensemble,
    starts: Sequence[tuple[int, Question, Recipe, float]],
    arrivals: Sequence[Arrival | str],
    known: Sequence[Orbit | None],
    jobs: int,
) -> list[Orbit | None]:
    """The known orbit that each start has come to; None where that is not plain."""
    out: list[Orbit | None] = [None] * len(starts)
    groups: dict[tuple[int, Recipe], list[int]] = {}
    for k, orbit in enumerate(known):
        if orbit is not None and isinstance(arrivals[k], Arrival):
            groups.setdefault((starts[k][0], starts[k][2]), []).append(k)

    def near(task: tuple[tuple[int, Recipe], list[int]]) -> Mask:
        (board, recipe), members = task
        orbit = known[members[0]]
        assert orbit is not None
        states = np.array([a.state for k in members if isinstance(a := arrivals[k], Arrival)])
        return come_to(orbit, states, partial(ensemble.swept, board), recipe.target.drive)

    for (_, members), some in zip(
        groups.items(), parallel(near, groups.items(), jobs), strict=True
    ):
        for k, yes in zip(members, some.tolist(), strict=True):
            out[k] = known[k] if yes else None
    return out


def come_to(orbit: Orbit, states: Array, swept: Swept, drive: Drive) -> Mask:
    """(E,) whether each of these states (E, n) lies within ``NEAR`` of an orbit that attracts, and
    nearer to it after one more of its periods."""
    no = np.zeros(len(states), dtype=bool)
    if orbit.start.shape != states.shape[1:]:
        return no
    laps, on_it = swept([(drive, 1)], orbit.start[None]), [orbit.start]
    while laps[1].all() and len(on_it) < orbit.n:
        on_it.append(laps[0][0])
        laps = swept([(drive, 1)], laps[0])
    peaks = orbit.coarse_peaks

    def distances(of: Array) -> Array:
        apart = np.abs(of[:, None] - np.array(on_it)[None]) / peaks
        return np.asarray(apart.max(axis=2).min(axis=1))

    before = distances(states)
    later, whole = swept([(drive, orbit.n)], states)
    return laps[1].all() & whole & (before < NEAR) & (distances(later) < before)


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
