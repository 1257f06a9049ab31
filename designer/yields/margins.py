"""How far a board is from losing a response, as a smooth function of its parts.

The margin is the least of a few linear functions of the quantities that differ between boards, each
divided by its own standard deviation over the spread. They come from two places:

- the nominal board: every function of ``dynamics.continued_orbit`` on the wanted orbit, linearised
by
  central differences;
- lost boards: on the straight line from the nominal board to a lost one, the point where the
  response is lost (``yields.crossings``), the function that ends there, and its gradient shortly
  before. Such a limit sees what is curved near the nominal board.

Which of them are kept is decided on the boards of even number: one after the other, the one that
sets most verdicts right, as long as any does. How well the sign of the margin predicts the verdicts
is measured on the boards of odd number and belongs to every result. What it cannot see: other
attractors whose basin the nominal orbit lies in, and clipping.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from designer.base.arrays import Array
from designer.base.threads import parallel
from designer.circuit.board_arrays import Boards
from designer.circuit.ensemble import Ensemble
from designer.circuit.netlist import Circuit, nominal_board
from designer.dynamics.continued_orbit import ContinuedOrbit, Function, follow, functions
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import SYMMETRY_TOLERANCE, Orbit
from designer.dynamics.piecewise_linear import Drive
from designer.spread.board_quantities import Quantity, between, column, quantities, with_column
from designer.yields.blame_pieces import StoredParts, counted
from designer.yields.crossings import ROUNDS, Crossing, crossings
from designer.yields.verdict import Answer, Question, Verdict

STEP = 0.02
"""Of a quantity's standard deviation: half the span of a central difference."""
BACK = 0.8
"""Of the way to the crossing: where its gradient is taken, since a fold has none at its end."""
NEAREST = 6
"""Limits of the nominal board that are considered: those nearest to it."""
CROSSINGS = 8
"""Lost boards for each response whose crossings are sought."""


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
    def distance(self) -> float:
        """Standard deviations between the nominal board and the loss."""
        return self.nominal / self.sigma


@dataclass(frozen=True)
class Prediction:
    """How well the sign of a margin says what became of boards that had no part in choosing it."""

    ok: int
    """Boards that were ok."""
    lost: int
    """Boards that were lost."""
    missed: int
    """Lost boards that were said to be ok."""
    alarms: int
    """Ok boards that were said to be lost."""

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
    """Of ``sought`` lost boards, those on which the response exists all the same and the
    nominal orbit leads to another attractor."""

    def each(self, boards: Boards) -> Array:
        """(N, limits) every limit on these boards, in its own standard deviations."""
        total = np.tile([limit.distance for limit in self.limits], (len(boards), 1))
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
    count: int = CROSSINGS,
    only: Collection[tuple[int, int]] | None = None,
    jobs: int = 1,
    progress: Callable[[], None] = lambda: None,
    pieces: StoredParts | None = None,
) -> tuple[Margin, ...]:
    """The margin of each question.

    boards : drawn of the spread; answers : of each question, what became of board ``sample``.
    count : crossings sought for each question. only : of those the ones that are sought, as
    (question, sample); all of them if None. progress : called once an attractor or followed
    orbit. pieces : what is known already, and where the rest goes.
    """
    differing = quantities(circuit, boards)
    pieces = StoredParts() if pieces is None else pieces
    wanted = [pair for pair in lost_boards(answers, count) if only is None or pair in only]
    met = _met(boards, wanted, questions, pieces, jobs, progress)
    nominal = Boards.of(circuit, [nominal_board(circuit)])
    probes = _probes(nominal, differing)
    found: list[list[Limit]] = []
    for number, question in enumerate(questions):
        base = _Base(nominal, question, question.start)

        def at_nominal(step: Callable[[], None], base: _Base = base) -> tuple[Limit, ...]:
            return tuple(_nominal_limits(base, probes, differing, boards, jobs, step))

        found.append(list(counted(pieces, f"nominal {number}", progress, at_nominal)))
    for crossing in met:

        def at_crossing(step: Callable[[], None], crossing: Crossing = crossing) -> Limit | None:
            question = questions[crossing.question]
            return _crossing_limit(crossing, question, boards, differing, jobs, step)

        name = f"limit {crossing.question} {crossing.board}"
        limit = counted(pieces, name, progress, at_crossing)
        if limit is not None:
            found[crossing.question].append(limit)
    out = []
    for number, row in enumerate(answers):
        margin = _chosen(Margin(differing, tuple(found[number])), boards, row)
        own = [c for c in met if c.question == number]
        out.append(replace(margin, sought=len(own), there=sum(c.there for c in own)))
    return tuple(out)


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


def _met(
    boards: Boards,
    wanted: Sequence[tuple[int, int]],
    questions: Sequence[Question],
    pieces: StoredParts,
    jobs: int,
    progress: Callable[[], None],
) -> list[Crossing]:
    """The crossing of each of these (question, sample), those that are known not sought again."""
    known: dict[tuple[int, int], Crossing] = {}
    for question, sample in wanted:
        crossing = pieces.get(f"crossing {question} {sample}")
        if crossing is not None:
            known[question, sample] = crossing
            for _ in range(ROUNDS):
                progress()
    missing = [pair for pair in wanted if pair not in known]
    found = crossings(
        boards,
        [sample for _, sample in missing],
        [question for question, _ in missing],
        questions,
        jobs=jobs,
        progress=progress,
    )
    pieces.put({f"crossing {c.question} {c.board}": c for c in found})
    known |= {(c.question, c.board): c for c in found}
    return [known[pair] for pair in wanted]


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
    """For each quantity the board with a little less of it, then with a little more."""
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
) -> list[Limit]:
    orbit = _follow(base, Ensemble(base.board), 1)[0]
    if orbit is None:
        return []
    wanted = functions(orbit, base.symmetric)
    slopes = _gradients(base, wanted, probes, jobs, progress)
    limits = [
        limit
        for f, row in zip(wanted, slopes, strict=True)
        for limit in [_limit(f, f.value, row, differing, boards)]
        if limit is not None
    ]
    return sorted(limits, key=lambda limit: limit.distance)[:NEAREST]


def _crossing_limit(
    crossing: Crossing,
    question: Question,
    boards: Boards,
    differing: tuple[Quantity, ...],
    jobs: int,
    progress: Callable[[], None],
) -> Limit | None:
    """The limit that ends the response on the way to this board; None where none is seen."""
    if crossing.there or crossing.inside == 0.0:
        return None
    lost = boards.take([crossing.board, crossing.board])
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
    row = boards.take([crossing.board])
    way = np.array([float((column(row, q)[0] - q.nominal) / q.sigma) for q in differing])
    limit = _limit(first[1], -end * float(np.sum(slopes * way)), slopes, differing, boards)
    return None if limit is None else replace(limit, board=crossing.board)


def _limit(
    function: Function,
    nominal: float,
    slopes: Array,
    differing: tuple[Quantity, ...],
    drawn: Boards,
) -> Limit | None:
    """None where it does not react to anything, or would be negative on the nominal board."""
    limit = Limit(function.what, function.kind, nominal, 1.0, slopes)
    sigma = float(Margin(differing, (limit,)).each(drawn).std())
    return replace(limit, sigma=sigma) if sigma > 0.0 and nominal > 0.0 else None


def _chosen(margin: Margin, boards: Boards, answers: Sequence[Answer]) -> Margin:
    """Of its limits those that foretell the verdicts of even boards, tested on the odd ones."""
    ok = np.array([a.sample for a in answers if a.verdict is Verdict.OK], dtype=np.intp)
    lost = np.array([a.sample for a in answers if a.verdict is Verdict.LOST], dtype=np.intp)
    if not margin.limits:
        return replace(
            margin, prediction=_prediction(margin, boards, ok[ok % 2 == 1], lost[lost % 2 == 1])
        )
    each = margin.each(boards) > 0.0
    learn_ok, learn_lost = ok[ok % 2 == 0], lost[lost % 2 == 0]
    fine, kept = np.ones(len(boards), dtype=bool), []
    best = int(fine[learn_ok].sum() + (~fine[learn_lost]).sum())
    while True:
        scores = [
            int((fine & each[:, j])[learn_ok].sum() + (~(fine & each[:, j]))[learn_lost].sum())
            for j in range(each.shape[1])
        ]
        j = int(np.argmax(scores))
        if scores[j] <= best:
            break
        best = scores[j]
        fine &= each[:, j]
        kept.append(j)
    kept = kept or [int(np.argmin([limit.distance for limit in margin.limits]))]
    limits = sorted((margin.limits[j] for j in kept), key=lambda limit: limit.distance)
    out = replace(margin, limits=tuple(limits))
    return replace(out, prediction=_prediction(out, boards, ok[ok % 2 == 1], lost[lost % 2 == 1]))


def _prediction(margin: Margin, boards: Boards, ok: Array, lost: Array) -> Prediction:
    fine = margin.of(boards) > 0.0
    return Prediction(len(ok), len(lost), int(fine[lost].sum()), int((~fine[ok]).sum()))
