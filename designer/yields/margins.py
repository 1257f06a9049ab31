"""How far a board is from losing a response, as a smooth function of its parts.

The margin is the least of a few linear functions of the quantities that differ between boards, in
standard deviations over the spread. They come from the nominal board, by central differences of
every function of ``dynamics.continued_orbit``, and from lost boards, at the point of the straight
way from the nominal board where the response ends (``Crossing``): these see what is curved. Boards
of even number decide which functions stay; boards of odd number tell how well the margin's sign
predicts verdicts. It sees neither clipping nor other attractors that the nominal orbit leads to.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from designer.base.arrays import Array, Index
from designer.base.threads import parallel
from designer.circuit.board_arrays import Boards
from designer.circuit.board_values import nominal_board
from designer.circuit.ensemble import BRIEF, Ensemble
from designer.circuit.netlist import Circuit
from designer.dynamics.continued_orbit import ContinuedOrbit, Function, follow, functions
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import SYMMETRY_TOLERANCE, Orbit
from designer.dynamics.piecewise_linear import Drive
from designer.spread.board_quantities import Quantity, between, column, quantities, with_column
from designer.verdicts.exact_circuit import Case, settled
from designer.verdicts.verdict import Answer, Question, Verdict
from designer.yields.stored_parts import StoredParts, counted

STEP = 0.02
"""Half the span of a central difference, over a quantity's standard deviation."""
BACK = 0.8
"""Share of the way to the crossing at which its gradient is taken, since a fold has none at its
end."""
DRAWN = 256
"""Boards, at least, from which the standard deviations of the quantities are taken."""
NEAREST = 6
"""Limits of the nominal board that are considered: those nearest to it."""
CROSSINGS = 8
"""Lost boards for each response whose crossings are sought."""
PACE = 0.25
"""Share of the way to a lost board of the first steps; then the gap is halved."""
ROUNDS = 10
"""Attractors sought for a crossing, at most."""


@dataclass(frozen=True)
class Limit:
    """One way of losing the response."""

    what: str
    """How the response is lost, in words."""
    kind: str
    """Kind of the function; see ``continued_orbit.Function``."""
    nominal: float
    """Its value on the nominal board [V for contact, miss, parting], where the linear function is
    positive."""
    sigma: float
    """Its standard deviation over the spread."""
    slopes: Array
    """(k,) its change over one standard deviation of each quantity."""
    board: int = -1
    """The lost board it was found on; -1 for the nominal board."""

    @property
    def reliability_index(self) -> float:
        """The standard deviations between the nominal board and the loss."""
        return self.nominal / self.sigma


@dataclass(frozen=True)
class Crossing:
    """Where on the straight way from the nominal board to a lost one the response ends.

    Where it was met on the board itself, ``inside`` and ``outside`` are 1: the response is there,
    and the nominal orbit leads to another attractor.
    """

    board: int
    """The lost board, by its place in the ensemble."""
    question: int
    """Number of the question of the plan."""
    inside: float
    """The farthest share of the way at which the response was met."""
    outside: float
    """The nearest share of the way at which the response was not met."""
    orbit: Orbit
    """The orbit at ``inside``."""

    @property
    def there(self) -> bool:
        return self.inside == 1.0


@dataclass(frozen=True)
class Prediction:
    """How well the sign of a margin says what became of boards that had no part in choosing it."""

    ok: int
    """Boards that were ok."""
    lost: int
    """Boards that were lost."""
    missed: int
    """Lost boards that were predicted to be ok."""
    alarms: int
    """Ok boards that were predicted to be lost."""

    @property
    def right(self) -> int:
        """Verdicts that were foretold."""
        return self.ok + self.lost - self.missed - self.alarms


@dataclass(frozen=True)
class Margin:
    """The margin of one response."""

    quantities: tuple[Quantity, ...]
    """What differs between boards, in the order of the slopes."""
    limits: tuple[Limit, ...]
    """Ways of losing the response, the nearest first."""
    prediction: Prediction = Prediction(0, 0, 0, 0)
    """How well the margin's sign foretells what became of boards."""
    sought: int = 0
    """Lost boards on which the response was looked for."""
    there: int = 0
    """How many of the ``sought`` lost boards have the response all the same, while the nominal
    orbit leads to another attractor."""

    def each(self, boards: Boards) -> Array:
        """(N, limits) every limit on these boards, in its own standard deviations."""
        total = np.tile([limit.reliability_index for limit in self.limits], (len(boards), 1))
        slopes = np.array([limit.slopes / limit.sigma for limit in self.limits])
        # Summed one by one: the last digits of a matrix product depend on the number of boards.
        for k, q in enumerate(self.quantities):
            total += ((column(boards, q) - q.nominal) / q.sigma)[:, None] * slopes[:, k]
        return np.asarray(total)

    def of(self, boards: Boards) -> Array:
        """(N,) the margin of these boards; inf where nothing limits."""
        if not self.limits:
            return np.full(len(boards), np.inf)
        return np.asarray(self.each(boards).min(axis=1))


def margins(
    circuit: Circuit,
    questions: Sequence[Question],
    boards: Boards,
    answers: Sequence[Sequence[Answer]],
    *,
    asked: Boards | None = None,
    count: int = CROSSINGS,
    only: Collection[tuple[int, int]] | None = None,
    jobs: int = 1,
    progress: Callable[[], None] = lambda: None,
    parts: StoredParts | None = None,
) -> tuple[Margin, ...]:
    """The margin of each question; without limits where no n-p-q is wanted.

    boards : drawn of the spread; answers : of each question, what became of board ``sample``.
    asked : the boards that the answers speak of, where it is others than ``boards``, such as boards
    farther off, of which more are lost: standard deviations are those of ``boards`` all the same.
    count : crossings sought for each question. only : of those the ones that are sought, as
    (question, sample); all of them if None. progress : called once an attractor or followed
    orbit. parts : the known ones, and where the others go.
    """
    differing = quantities(circuit, boards)
    asked = boards if asked is None else asked
    parts = StoredParts() if parts is None else parts
    lost = [
        pair
        for pair in lost_boards(answers, count)
        if questions[pair[0]].periodic and (only is None or pair in only)
    ]
    crossed = _stored_crossings(asked, lost, questions, parts, jobs, progress)
    nominal = replace(Boards.of(circuit, [nominal_board(circuit)]), bandwidth=boards.bandwidth)
    probes = _probes(nominal, differing)
    limits: list[list[Limit]] = []
    for number, question in enumerate(questions):
        if not question.periodic:
            limits.append([])
            continue
        base = _Base(nominal, question, question.start)
        compute = partial(_nominal_limits, base, probes, differing, boards, jobs)
        limits.append(list(counted(parts, f"nominal {number}", progress, compute)))
    for crossing in crossed:
        question = questions[crossing.question]
        compute_one = partial(_crossing_limit, crossing, question, asked, boards, differing, jobs)
        name = f"limit {crossing.question} {crossing.board}"
        limit = counted(parts, name, progress, compute_one)
        if limit is not None:
            limits[crossing.question].append(limit)
    out = []
    for number, row in enumerate(answers):
        margin = _foretelling(Margin(differing, tuple(limits[number])), asked, row)
        sought = [c for c in crossed if c.question == number]
        out.append(replace(margin, sought=len(sought), there=sum(c.there for c in sought)))
    return tuple(out)


def nominal_limits(
    circuit: Circuit, question: Question, boards: Boards, *, jobs: int = 1
) -> Margin:
    """Every linear limit of the nominal board that is considered, the nearest first. boards : drawn
    of the spread, for the standard deviations."""
    differing = quantities(circuit, boards)
    nominal = replace(Boards.of(circuit, [nominal_board(circuit)]), bandwidth=boards.bandwidth)
    base, probes = _Base(nominal, question, question.start), _probes(nominal, differing)
    return Margin(differing, _nominal_limits(base, probes, differing, boards, jobs, lambda: None))


def lost_boards(
    answers: Sequence[Sequence[Answer]], count: int = CROSSINGS
) -> list[tuple[int, int]]:
    """The lost boards of even number whose crossings are sought, as (question, sample): of each
    question the first ``count``, question after question."""
    return [
        (number, sample)
        for number, row in enumerate(answers)
        for sample in [a.sample for a in row if a.verdict is Verdict.LOST and a.sample % 2 == 0][
            :count
        ]
    ]


def _stored_crossings(
    boards: Boards,
    lost: Sequence[tuple[int, int]],
    questions: Sequence[Question],
    parts: StoredParts,
    jobs: int,
    progress: Callable[[], None],
) -> list[Crossing]:
    """The crossing of each of these (question, sample), those that are stored not sought again."""
    by_board: dict[tuple[int, int], Crossing] = {}
    for question, sample in lost:
        crossing = parts.get(f"crossing {question} {sample}")
        if crossing is not None:
            by_board[question, sample] = crossing
            for _ in range(ROUNDS):
                progress()
    missing = [pair for pair in lost if pair not in by_board]
    computed = crossings(boards, missing, questions, jobs=jobs, progress=progress)
    parts.put({f"crossing {c.question} {c.board}": c for c in computed})
    by_board |= {(c.question, c.board): c for c in computed}
    return [by_board[pair] for pair in lost]


def crossings(
    boards: Boards,
    lost: Sequence[tuple[int, int]],
    questions: Sequence[Question],
    *,
    jobs: int = 1,
    progress: Callable[[], None] = lambda: None,
) -> list[Crossing]:
    """The crossing of each of these (question, sample), along the attractor.

    A share of the way is a trial: what it leads to, if not to the response, is not asked.
    progress : called ``ROUNDS`` times for each.
    """
    size = len(lost)
    inside, outside = np.zeros(size), np.full(size, np.inf)
    orbits = [questions[number].start for number, _ in lost]
    for _ in range(ROUNDS):
        going = np.flatnonzero(inside < 1.0).tolist()
        for _ in range(size - len(going)):
            progress()
        if not going:
            continue
        farther, halfway = np.minimum(inside + PACE, 1.0), 0.5 * (inside + outside)
        share = np.where(np.isinf(outside), farther, halfway)[going]
        ensemble = Ensemble(between(boards.take([lost[k][1] for k in going]), share))
        questions_left = [questions[lost[k][0]] for k in going]
        cases: list[Case] = [
            (i, q, q.excitation, orbits[k].start)
            for i, (k, q) in enumerate(zip(going, questions_left, strict=True))
        ]
        rows = settled(ensemble, cases, jobs, progress, within=BRIEF)
        for k, at, (orbit, verdict, _) in zip(going, share, rows, strict=True):
            if verdict is Verdict.OK:
                inside[k], orbits[k] = at, orbit
                if at == 1.0:
                    outside[k] = 1.0
            else:
                outside[k] = at
    return [
        Crossing(sample, number, float(inside[k]), float(outside[k]), orbits[k])
        for k, (number, sample) in enumerate(lost)
    ]


@dataclass(frozen=True)
class _Base:
    """A board (as ``Boards`` of one) with an orbit of the wanted kind on it."""

    board: Boards
    question: Question
    orbit: Orbit

    @property
    def drive(self) -> Drive:
        return self.question.excitation.drive

    @property
    def symmetric(self) -> bool:
        return bool(self.orbit.n % 2 and self.orbit.asymmetry < SYMMETRY_TOLERANCE)


def _probes(board: Boards, differing: Sequence[Quantity]) -> Ensemble:
    """The boards with a little less, then a little more of each quantity."""
    rows = board.take(np.zeros(2 * len(differing), dtype=np.intp))
    for k, q in enumerate(differing):
        values = column(rows, q).copy()
        values[2 * k] -= STEP * q.sigma
        values[2 * k + 1] += STEP * q.sigma
        rows = with_column(rows, q, values)
    return Ensemble(rows)


def _follow(base: _Base, ensemble: Ensemble, jobs: int) -> list[ContinuedOrbit | None]:
    """The base's orbit on each of these boards."""

    def one(index: int) -> ContinuedOrbit | None:
        try:
            flow = Flow(ensemble.reduction(index).system(), base.drive)
            return follow(flow, base.orbit.start, base.orbit.n)
        except (ArithmeticError, np.linalg.LinAlgError):
            return None

    return list(parallel(one, range(len(ensemble)), jobs))


def _gradients(
    base: _Base,
    wanted: Sequence[Function],
    probes: Ensemble,
    jobs: int,
    progress: Callable[[], None],
) -> Array:
    """(functions, k) change over one standard deviation of each quantity; 0 where the orbit or the
    extreme is not found on one of the two boards of a difference."""
    runs = _follow(base, probes, jobs)
    for _ in runs:
        progress()
    out = np.zeros((len(wanted), len(runs) // 2))
    for f, function in enumerate(wanted):
        for k in range(len(runs) // 2):
            below, above = function.on(runs[2 * k]), function.on(runs[2 * k + 1])
            if below is not None and above is not None:
                out[f, k] = (above - below) / (2.0 * STEP)
    return out


def _nominal_limits(
    base: _Base,
    probes: Ensemble,
    differing: tuple[Quantity, ...],
    boards: Boards,
    jobs: int,
    progress: Callable[[], None],
) -> tuple[Limit, ...]:
    (orbit,) = _follow(base, Ensemble(base.board), 1)
    if orbit is None:
        return ()
    wanted = functions(orbit, base.symmetric)
    slopes = _gradients(base, wanted, probes, jobs, progress)
    all_ = [
        _limit(f, f.value, row, differing, boards) for f, row in zip(wanted, slopes, strict=True)
    ]
    limits = [limit for limit in all_ if limit is not None]
    return tuple(sorted(limits, key=lambda limit: limit.reliability_index)[:NEAREST])


def _crossing_limit(
    crossing: Crossing,
    question: Question,
    asked: Boards,
    boards: Boards,
    differing: tuple[Quantity, ...],
    jobs: int,
    progress: Callable[[], None],
) -> Limit | None:
    """The limit that ends the response on the way to this board; None where none is seen."""
    if crossing.there or crossing.inside == 0.0:
        return None
    lost = asked.take([crossing.board, crossing.board])
    shares = np.array([BACK * crossing.inside, crossing.inside])
    near = between(lost, shares)
    base = _Base(near.take([0]), question, crossing.orbit)
    before, last = _follow(base, Ensemble(near), 1)
    if before is None or last is None:
        return None
    end, first = 0.5 * (crossing.inside + crossing.outside), None
    for function in functions(before, base.symmetric):
        value = function.on(last)
        if value is None or value >= function.value:
            continue
        pace = (function.value - value) / (shares[1] - shares[0])
        zero = shares[1] + max(value, 0.0) / pace
        if first is None or zero < first[0]:
            first = (zero, function)
    if first is None:
        return None
    slopes = _gradients(base, [first[1]], _probes(base.board, differing), jobs, progress)[0]
    row = asked.take([crossing.board])
    way = np.array([float((column(row, q)[0] - q.nominal) / q.sigma) for q in differing])
    limit = _limit(first[1], -end * float(np.sum(slopes * way)), slopes, differing, boards)
    return None if limit is None else replace(limit, board=crossing.board)


def _limit(
    function: Function,
    nominal: float,
    slopes: Array,
    differing: tuple[Quantity, ...],
    boards: Boards,
) -> Limit | None:
    """None where it does not react to anything, or would be negative on the nominal board."""
    limit = Limit(function.what, function.kind, nominal, 1.0, slopes)
    sigma = float(Margin(differing, (limit,)).each(boards).std())
    return replace(limit, sigma=sigma) if sigma > 0.0 and nominal > 0.0 else None


def _foretelling(margin: Margin, boards: Boards, answers: Sequence[Answer]) -> Margin:
    """The margin with those of its limits that foretell the verdicts of even boards, tested on the
    odd ones."""
    ok, lost = (
        np.array([a.sample for a in answers if a.verdict is verdict], dtype=np.intp)
        for verdict in (Verdict.OK, Verdict.LOST)
    )
    if margin.limits:
        picked = _picked(margin.each(boards) > 0.0, ok[ok % 2 == 0], lost[lost % 2 == 0])
        nearest = int(np.argmin([limit.reliability_index for limit in margin.limits]))
        limits = [margin.limits[k] for k in picked or [nearest]]
        margin = replace(
            margin, limits=tuple(sorted(limits, key=lambda limit: limit.reliability_index))
        )
    fine, ok, lost = margin.of(boards) > 0.0, ok[ok % 2 == 1], lost[lost % 2 == 1]
    prediction = Prediction(len(ok), len(lost), int(fine[lost].sum()), int((~fine[ok]).sum()))
    return replace(margin, prediction=prediction)


def _picked(each: NDArray[np.bool_], ok: Index, lost: Index) -> list[int]:
    """The limits that set more of these verdicts right, one after the other.

    each : (boards, limits) whether each limit lets the board pass.
    """

    def right(fine: NDArray[np.bool_]) -> int:
        return int(fine[ok].sum() + (~fine[lost]).sum())

    fine, picked = np.ones(len(each), dtype=bool), list[int]()
    while True:
        scores = [right(fine & one) for one in each.T]
        best = int(np.argmax(scores))
        if scores[best] <= right(fine):
            return picked
        fine = fine & each[:, best]
        picked.append(best)
