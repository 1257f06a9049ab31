"""How many boards of a million lose a response: importance sampling of the parts.

Where losses are rare, plain boards hardly show any. Here boards are drawn where they are lost
(``tilted_cube``), and each counts by how likely it is. Where that is, is found in three ways: the
linear limits of the nominal board (``margins``), boards whose parts are off by more than they may
be (``loss_walks``), and the lost boards of pilot rounds, to whose means the tilts are moved (the
cross-entropy method: R. Y. Rubinstein, D. P. Kroese, 2004). What no round meets is not counted: the
answer says how much that can be, which plain boards bound.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import cached_property
from itertools import compress
from operator import not_
from typing import Any
from zlib import crc32

import numpy as np
from scipy.special import ndtri

from designer.base.arrays import Array, Index, Mask
from designer.base.plain_json import plain
from designer.base.progress import doing
from designer.base.proportion import inverse_binomial, wilson
from designer.base.rare_words import boards_text
from designer.circuit.board_arrays import Boards
from designer.circuit.ensemble import BRIEF, Ensemble
from designer.dynamics.orbit import WITHOUT_PERIOD, Orbit, OrbitStatus
from designer.spread.board_quantities import between
from designer.spread.spread import BOARD
from designer.spread.tilted_cube import STEEPEST, TiltedCube, mean_of, tilt_of, width_of
from designer.verdicts.exact_circuit import Case, settled
from designer.verdicts.verdict import Question, StudyPlan, Verdict
from designer.yields.loss_walks import LossWalk, Shown, independent, walk
from designer.yields.margins import nominal_limits
from designer.yields.stored_parts import AnswerLog, StoredParts
from designer.yields.worst_corner import LAST
from designer.yields.yield_count import Yield

MOST_BOARDS = 40_000
"""Boards that the estimate may take, pilot rounds left out."""
LEAST_BOARDS = 1_500
"""Boards that it takes at least."""
BLOCK = 500
"""Boards at a time."""
TARGET = 0.3
"""Half-width of the interval over the estimate at which it ends."""
PLAIN = 0.1
"""Share of plain boards in the mixture; no weight is above 1 over it."""
PILOTS, PILOT = 3, 600
"""Rounds in which the tilts are moved, and boards of each."""
ENOUGH = 50.0
"""Effective number of lost boards, at least, of an estimate that ends before its most boards."""
SOME = 20.0
"""Effective number of lost boards, at least, of an estimate that ends on one side of a bound."""
FEWEST = 6
"""Lost boards of one kind that begin a region."""
TELLING = 12.0
"""Effective number of lost boards that move a tilt."""
EVEN = 0.4
"""Share of the boards of all regions that is dealt evenly; the rest goes by how much each region
adds."""
CLEAR = 1.5
"""Standard errors by which a coordinate's mean has to be off to move its tilt at all."""
WIDE = (1.25, 1.6, 2.0, 2.5, 3.2, 4.0)
"""The factors on the deviations of boards that look for further regions."""
OFTEN = 0.05
"""Share of lost boards at which they are wide enough."""
MET, MANY = 3, 16
"""Boards that show one kind of loss at a width, at least, for it to be followed back; and from the
least width at which so many do, where one has them."""
SEARCHES = 3
"""Walks from lost boards, and from those that lie in none of the regions found so."""
ELSEWHERE = 0.4
"""Density of a region's boards over that of all, below which a board is taken not to lie in it."""
EXPLORED = 512
"""Boards of a width."""
SCOUTED = 40_000
"""Steps that a board may take which only says where to draw."""
SURE = 4
"""Of boards that show no period briefly and were drawn where they are lost, one of so many is asked
until it is known; the others count as lost, less what these say."""
TRIED = 64
"""Boards as they are that say whether answers come quickly."""
FEW_MOVES = 60
"""Last moves of lost boards where each answer takes long."""
OTHER = "no n-p-q"
"""The kind of loss of all boards that neither clip nor have an n-p-q."""
MOST_WALKS, MOST_REGIONS = 6, 12
"""Walks of lost boards, and components of the mixture beside the plain one."""
SHOWN_PARTS = 5
"""Parts of a region that are named."""
WIDEST = 10.0
"""The factor by which tolerances are widened at most, to see where the first board is lost."""
STEPS = 16
"""Widths that are looked at, twice: over the whole range, then between two of them."""
SINGLE = 8
"""Parts that are moved alone."""
PLENTY = 40
"""Lost boards of a study: with so many its count is as good, and nothing is drawn where it is
lost."""
LOOKED, FREQUENT = 512, 8
"""Plain boards that are looked at first, and lost ones of them from which plain boards are
counted: of an estimate half the boards are lost, and to know that of each may take seconds."""
COUNTED, MOST_COUNTED = 125, 6_000
"""Boards of such a count at a time, and at most."""
APART = 1.4
"""Spread of lost boards along one way over the most that chance makes, above which they are two."""
TAG = 0xAA5E
"""Sets these boards apart from those of a study with the same seed."""
_STREAMS = (), (1,), (2,)
"""What sets apart the numbers of the estimate, of plain boards, and of who is asked on."""
QUANTILE = 1.959964
"""The quantile of the normal distribution for 95 %, two-sided."""
PATH = (0.3, 0.5, 0.65, 0.8, 0.9, 1.0, 1.15, 1.35, 1.7, 2.2, 3.0)
"""Shares of the tilt that a linear limit foretells at which the loss is looked for."""


@dataclass(frozen=True)
class LossRegion:
    """A part of the spread in which boards lose the response."""

    found_by: str
    """What led there: a limit of the nominal board in words, wider boards, or lost ones."""
    becomes: str
    """What most of its lost boards show instead."""
    share: float
    """Share of all losses that are most likely of this region."""
    boards: int
    """Lost boards of it that were drawn."""
    parts: tuple[str, ...]
    """Parts that lead there most, each with the end that does: "R203 high"."""


@dataclass(frozen=True)
class ToleranceMargin:
    """How far parts may be off before the response is lost."""

    part: str
    """The part that is moved alone, to its worse end; "" for all parts of a region at theirs."""
    widening: float | None
    """The tolerance at which it is lost first, over its own; below 1 it is lost within it. None: up
    to ``WIDEST`` it is not."""


@dataclass(frozen=True)
class RareLosses:
    """How many boards lose one response."""

    question: int
    """Number of the question of the plan."""
    lost: float
    """Estimated share of the boards with an answer that lose it."""
    low: float
    """Lower end of the 95 % interval."""
    high: float
    """Upper end; where no board was lost, what the plain boards leave possible."""
    unanswered: float
    """Estimated share of boards without an answer, which count nowhere else."""
    boards: int
    """Boards of the estimate."""
    pilots: int
    """Boards that are not of the estimate: they looked for the regions, or whether losses are
    plenty."""
    drawn_lost: int
    """Boards of the estimate that were lost."""
    effective: float
    """Effective number of lost boards: the square of their weights' sum over the sum of squares."""
    largest_weight: float
    """The largest weight of a lost board, over the mean weight of 1."""
    gain: float
    """Plain boards that the same interval would take, over those drawn, pilots included; nan
    without a loss."""
    unseen: float
    """A region that no search met may hold this share at most, by 95 %: what the plain boards leave
    of which none, or so many, were lost outside the regions. 0 of a count, which sees all."""
    narrow: bool
    """Whether the interval is as narrow as was aimed at."""
    regions: tuple[LossRegion, ...]
    """The regions, the largest share first."""
    margins: tuple[ToleranceMargin, ...]
    """The worst corner of all regions, then single parts, the nearest to a loss first."""
    seconds: float
    """Wall time [s]."""

    @property
    def per_million(self) -> tuple[float, float, float]:
        """Boards of a million that lose it: the estimate, and the ends of its interval."""
        return 1e6 * self.lost, 1e6 * self.low, 1e6 * self.high

    def ends(self, level: float) -> tuple[float, float]:
        """Ends of the interval at another level than 0.95, without what may be unseen."""
        quantile = float(ndtri(0.5 + 0.5 * level))
        if not self.unseen:  # counted, not drawn
            answered = round(self.boards * (1.0 - self.unanswered))
            if self.pilots:  # to a number of losses
                return inverse_binomial(self.drawn_lost, answered, level)
            return wilson(self.drawn_lost, answered, quantile)
        if not self.lost:
            return 0.0, 0.0
        spread = (self.lost / self.low) ** (quantile / QUANTILE)
        return self.lost / spread, min(self.lost * spread, 1.0)

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON; an undefined number is None."""
        document: dict[str, Any] = plain({**asdict(self), "per_million": self.per_million})
        return document


@dataclass(frozen=True)
class AnyLost:
    """How many boards lose at least one of several responses, as far as the estimates of the single
    ones say: at least as many as lose the one that most lose, at most as many as all those together
    (M. Fréchet, Fund. Math. 25, 1935)."""

    least: float
    """Share of the boards, at least."""
    most: float
    """Share of them, at most."""
    low: float
    """The least share, by the lower ends of the intervals."""
    high: float
    """The largest share, by their upper ends and what may be unseen of each."""

    @classmethod
    def of(cls, found: Sequence[RareLosses]) -> AnyLost:
        """From one estimate at least. Each statement, n intervals and what may be unseen of those
        that were drawn, is at the level 1 - 0.05 over their number, so that all of them hold at
        once on 95 % (C. E. Bonferroni, 1936)."""
        lost = [each.lost for each in found]
        level = 1.0 - 0.05 / (len(found) + sum(each.unseen > 0.0 for each in found))
        lows, highs = zip(*(each.ends(level) for each in found), strict=True)
        # The quantiles of a Poisson count grow with the level most where nothing was counted.
        unseen = sum(each.unseen for each in found) * math.log(1.0 - level) / math.log(0.05)
        return cls(max(lost), min(sum(lost), 1.0), max(lows), min(sum(highs) + unseen, 1.0))


@dataclass(frozen=True)
class _Region:
    """A component of the mixture, and what led to it."""

    tilt: Array
    found_by: str
    adds: float = 0.0
    """Weight of its lost boards in the last round; 0 where none was drawn yet."""


@dataclass(frozen=True)
class _Found:
    """Where boards are lost, and what it took to find it."""

    regions: list[_Region]
    boards: int
    """Boards that were asked."""
    plain: int
    """How many of these boards are plain ones of pilot rounds."""
    strays: Array
    """(N, coordinates) of those the lost ones."""


@dataclass(frozen=True)
class _Sample:
    """Boards that were asked. points : (N, coordinates). responses : of each what it shows."""

    points: Array
    component: Index
    lost: Mask
    unanswered: Mask
    responses: tuple[str, ...]
    stands: Array
    """(N,) for how many boards of brief answers each stands, itself one of them; 0 of one that was
    asked briefly and is taken for lost."""

    def first(self, count: int) -> _Sample:
        """So many of them."""
        return _Sample(*(getattr(self, each.name)[:count] for each in fields(self)))

    def joined(self, other: _Sample) -> _Sample:
        """Both samples, one after the other."""
        return _Sample(
            np.concatenate([self.points, other.points]),
            np.concatenate([self.component, other.component]),
            np.concatenate([self.lost, other.lost]),
            np.concatenate([self.unanswered, other.unanswered]),
            (*self.responses, *other.responses),
            np.concatenate([self.stands, other.stands]),
        )


@dataclass(frozen=True)
class _Drawing:
    """What draws boards of one question and asks them. Boards are given by points (N, coordinates)
    of the cube; wide : (N,) by how much more off than they may be, None for not at all."""

    plan: StudyPlan
    question: Question
    jobs: int
    progress: Callable[[], None]
    log: AnswerLog
    """Has what was answered before an interruption."""

    @property
    def names(self) -> tuple[str, ...]:
        return self.plan.spread.coordinates(self.plan.circuit)

    @cached_property
    def quick(self) -> bool:
        """Whether the compiled way answers for boards as they are."""
        if not self.question.excitation.drive.is_sine:
            return False
        ensemble = Ensemble(self.plan.boards(range(TRIED)), jobs=self.jobs)
        open_ = sum(orbit is None for orbit in self._quickly(ensemble))
        return ensemble.compiled and open_ <= 1

    @property
    def within(self) -> int:
        """Steps that a scouted board may take: chaos that is wanted has to be known for it."""
        return SCOUTED if self.question.periodic else BRIEF

    def _quickly(self, ensemble: Ensemble) -> list[Orbit | None]:
        """What the compiled way says of these boards, None where it leaves it open."""
        count, q = len(ensemble), self.question
        starts = np.tile(q.start.start, (count, 1))
        orbits = ensemble.quick(range(count), [q.excitation.drive] * count, starts, jobs=self.jobs)
        for _ in orbits:
            self.progress()
        return orbits

    def boards(self, points: Array, wide: Array | None = None) -> Boards:
        boards = self.plan.modelled(self.plan.spread.from_cube(self.plan.circuit, points))
        return boards if wide is None else between(boards, wide)

    def asked(
        self, points: Array, wide: Array | None = None, *, within: int | None = None
    ) -> list[tuple[Verdict, str]]:
        """The verdict of each board and what it shows. within : as of ``Ensemble.respond``."""

        def ask() -> list[str]:
            answers = self._verdicts(self.boards(points, wide), within)
            return [f"{verdict} {response}" for verdict, response in answers]

        lines = self._known(("asked", within), points, wide, ask)
        pairs = (line.partition(" ") for line in lines)
        return [(Verdict(verdict), response) for verdict, _, response in pairs]

    def foretold(self, points: Array, wide: Array, *, whole: bool) -> list[str]:
        """The kind of loss of each board, "" where it is fine. whole : whether boards are asked
        that the compiled way leaves open; they count as fine otherwise."""

        def ask() -> list[str]:
            return self._kinds(self.boards(points, wide), whole=whole)

        return self._known(("foretold", whole), points, wide, ask)

    def _known(
        self, how: object, points: Array, wide: Array | None, ask: Callable[[], list[str]]
    ) -> list[str]:
        question = [repr(how).encode("ascii"), points.tobytes()]
        question += [] if wide is None else [wide.tobytes()]
        return self.log.answer(b"".join(question), len(points), ask)

    def _verdicts(self, boards: Boards, within: int | None) -> list[tuple[Verdict, str]]:
        q = self.question
        out: list[tuple[Verdict, str]] = []
        for first in range(0, len(boards), BLOCK):
            some = range(first, min(first + BLOCK, len(boards)))
            ensemble = Ensemble(boards.take(np.array(some)), jobs=self.jobs)
            cases: list[Case] = [(i, q, q.excitation, q.start.start) for i in range(len(some))]
            rows = settled(ensemble, cases, self.jobs, self.progress, within=within)
            out += [(verdict, orbit.response) for orbit, verdict, _ in rows]
        return out

    def _kinds(self, boards: Boards, *, whole: bool) -> list[str]:
        out = [""] * len(boards)
        slow = list(range(len(boards)))
        if self.quick:
            orbits = self._quickly(Ensemble(boards, jobs=self.jobs))
            slow = [k for k, orbit in enumerate(orbits) if orbit is None]
            for k, orbit in enumerate(orbits):
                if orbit is not None and self.question.judge(orbit)[0] is not Verdict.OK:
                    out[k] = _kind_of(orbit.response)
        if slow and (whole or not self.quick):
            asked = self._verdicts(boards.take(np.array(slow)), self.within)
            for k, (verdict, response) in zip(slow, asked, strict=True):
                out[k] = "" if verdict is Verdict.OK else _kind_of(response)
        return out

    def scouted(self, points: Array, component: Index, wide: Array | None = None) -> _Sample:
        """These boards asked briefly, which is enough to find where to draw: one that takes long to
        settle is lost here."""
        verdicts = self.asked(points, wide, within=self.within)
        lost = np.array([v is not Verdict.OK for v, _ in verdicts], dtype=bool)
        responses, alone = tuple(response for _, response in verdicts), np.ones(len(points))
        return _Sample(points, component, lost, np.zeros_like(lost), responses, alone)

    def lost_first(self, points: Array, wide: Array | None, count: int) -> Mask:
        """(rows, count) which boards are lost, of rows of so many one after the other, up to the
        first of each row: one that takes long is asked until that is known."""
        brief = self.asked(points, wide, within=self.within)
        lost = np.array([v is not Verdict.OK for v, _ in brief], dtype=bool)
        slow = lost & np.array([_is_open(*answer) for answer in brief], dtype=bool)
        each = lost.reshape(-1, count)  # the same memory
        while True:
            first = np.arange(len(each)) * count + each.argmax(axis=1)
            if not (on := first[slow[first]]).size:
                return each
            found = self.asked(points[on], None if wide is None else wide[on])
            lost[on] = [v not in (Verdict.OK, Verdict.FAILED) for v, _ in found]
            slow[on] = False

    def sample(self, points: Array, component: Index, rng: np.random.Generator) -> _Sample:
        """These boards asked. Where a period is wanted, a board that shows none briefly hardly ever
        comes to it, and to know that takes long: of those that are no plain ones one of ``SURE`` is
        asked on (double sampling: J. Neyman, J. Am. Stat. Assoc. 33, 1938, 101)."""
        brief = self.question.periodic
        found = self.asked(points, within=self.within if brief else None)
        open_ = np.array([_is_open(*answer) for answer in found], dtype=bool)
        open_ &= brief
        stands = np.where(open_ & (component > 0), float(SURE), 1.0)
        on = open_ & (rng.random(len(points)) * stands < 1.0)
        if on.any():
            for k, answer in zip(np.flatnonzero(on), self.asked(points[on]), strict=True):
                found[k] = answer
        stands[open_ & ~on] = 0.0
        failed = np.array([v is Verdict.FAILED for v, _ in found], dtype=bool) & (stands > 0.0)
        fine = np.array([v is Verdict.OK for v, _ in found], dtype=bool)
        responses = tuple(response for _, response in found)
        return _Sample(points, component, ~fine & ~failed, failed, responses, stands)


def _is_open(verdict: Verdict, response: str) -> bool:
    """Whether a brief answer may be another one once the board has settled."""
    return verdict is Verdict.FAILED or response in WITHOUT_PERIOD


def rare_losses(
    plan: StudyPlan,
    number: int,
    *,
    most: int | None = None,
    target: float = TARGET,
    bound: float | None = None,
    jobs: int = 1,
    progress: Callable[[], None] = lambda: None,
    log: AnswerLog | None = None,
) -> RareLosses:
    """How many boards lose question ``number`` of a plan, on the exact circuit.

    most : boards that the estimate may take; ``MOST_BOARDS`` where none is given. target :
    half-width of the 95 % interval over the estimate at which it ends. bound : a share; it ends as
    well where the interval lies on one side of it, which favours that side a little. progress :
    called once a board that was asked. log : has what boards answered before an interruption, and
    gets what they answer now.

    Raises
    ------
    ValueError : the boards are those of a list, which are as many as there are.
    """
    if plan.census or plan.labels:
        raise ValueError("measured boards are counted, not drawn")
    began = time.perf_counter()
    most = MOST_BOARDS if most is None else most
    question = plan.questions[number]
    log = AnswerLog(StoredParts(), "") if log is None else log
    drawing = _Drawing(plan, question, jobs, progress, log)
    stream = crc32(question.stream.encode("utf-8"))
    rng, look, double = (np.random.default_rng([plan.seed, stream, TAG, *k]) for k in _STREAMS)
    doing("plain boards")
    first = drawing.scouted(*_mixture([], PLAIN, len(drawing.names)).drawn(LOOKED, look))
    if first.lost.sum() >= FREQUENT:
        counted, asked = _counted(drawing, number, look, min(most, MOST_COUNTED), target, bound)
        if counted is not None:
            return replace(counted, seconds=time.perf_counter() - began)
        first = first.joined(asked)
    doing("regions of loss")
    found = _regions(drawing, rng)
    regions = found.regions
    cube = _mixture(regions, PLAIN, len(drawing.names))
    sample = drawing.sample(*cube.drawn(BLOCK, rng), double)
    while True:
        result = _estimate(cube, sample)
        count = len(sample.points)
        doing(f"{boards_text(1e6 * result.mean)} of a million boards, by {count} boards")
        narrow = result.mean > 0.0 and QUANTILE * result.error <= target * result.mean
        narrow = narrow and result.effective >= ENOUGH
        decided = bound is not None and _is_decided(result, bound)
        if count >= most or ((narrow or decided) and count >= LEAST_BOARDS):
            break
        sample = sample.joined(drawing.sample(*cube.drawn(BLOCK, rng), double))
    pilots, plain = len(first.points) + found.boards, sample.component == 0
    strays = [first.points[first.lost], found.strays, sample.points[plain & sample.lost]]
    elsewhere = int((cube.densities(np.concatenate(strays)).argmax(axis=1) == 0).sum())
    outside = unseen_share(elsewhere, len(first.points) + found.plain + int(plain.sum()))
    low, high = _interval(result.mean, result.error, outside)
    gain = math.nan
    if result.mean > 0.0 and result.error > 0.0:
        gain = result.mean * (1.0 - result.mean) / result.error**2 / (pilots + count)
    return RareLosses(
        question=number,
        lost=result.mean,
        low=low,
        high=high,
        unanswered=result.unanswered,
        boards=count,
        pilots=pilots,
        drawn_lost=result.drawn_lost,
        effective=result.effective,
        largest_weight=result.largest,
        gain=gain,
        unseen=outside,
        narrow=narrow,
        regions=tuple(_named(drawing, cube, regions, sample, cube.weights(sample.points))),
        margins=tuple(_margins(drawing, regions)),
        seconds=time.perf_counter() - began,
    )


def _counted(
    drawing: _Drawing,
    number: int,
    rng: np.random.Generator,
    most: int,
    target: float,
    bound: float | None,
) -> tuple[RareLosses | None, _Sample]:
    """Plain boards up to so many lost ones that their share is as narrow as ``target``; or up to
    ``SOME`` where these tell its side of ``bound``. None where so many are not lost of ``most``
    boards, by 97.5 %. Beside it the boards that were asked.

    To stop at a number of losses k, of n boards, takes the estimate (k - 1)/(n - 1), whose mean is
    the share (J. B. S. Haldane, Biometrika 33, 1945, 222); k/n is above it.
    """
    plain = _mixture([], PLAIN, len(drawing.names))
    sample = drawing.sample(*plain.drawn(min(COUNTED, most), rng), rng)
    enough = max(PLENTY, 2 + math.ceil((QUANTILE / target) ** 2))
    for losses in ([] if bound is None else [int(SOME)]) + [enough]:
        while (lost := int(sample.lost.sum())) < losses:
            left = most - len(sample.points)
            likely = wilson(lost, int((~sample.unanswered).sum()))[1]
            if lost + likely * left < losses:
                return None, sample
            more = plain.drawn(min(COUNTED, left), rng)
            sample = sample.joined(drawing.sample(*more, rng))
        counted = sample.first(int(np.flatnonzero(sample.lost)[losses - 1]) + 1)
        answered = int((~counted.unanswered).sum())
        low, high = inverse_binomial(losses, answered)
        if bound is not None and (high <= bound or low > bound):
            break
    even, asked = np.ones(len(counted.points)), len(counted.points)
    regions = _plain_regions(counted, even, drawing.names)
    cube = _mixture(regions, PLAIN, len(drawing.names))
    pilots = LOOKED + len(sample.points) - asked
    share = (losses - 1) / (answered - 1)
    result = replace(
        _count(number, Yield(answered - losses, losses, 0, asked - answered)),
        lost=share,
        low=low,
        high=high,
        pilots=pilots,
        gain=asked / (asked + pilots),
        narrow=QUANTILE * math.sqrt((1.0 - share) / (losses - 2)) <= target,
        regions=tuple(_named(drawing, cube, regions, counted, even)),
        margins=tuple(_margins(drawing, regions)),
    )
    return result, sample


def counted_losses(number: int, counted: Yield) -> RareLosses | None:
    """The same of what a study has counted, where it lost ``PLENTY`` boards; None where fewer."""
    plenty = counted.lost + counted.grazing >= PLENTY
    return _count(number, counted) if plenty else None


def _count(number: int, counted: Yield) -> RareLosses:
    """Of so many plain boards, whatever was lost of them."""
    answered, lost = counted.samples - counted.failed, counted.lost + counted.grazing
    low, high = wilson(lost, answered)
    share = lost / answered
    return RareLosses(
        question=number,
        lost=share,
        low=low,
        high=high,
        unanswered=counted.failed / counted.samples,
        boards=counted.samples,
        pilots=0,
        drawn_lost=lost,
        effective=float(lost),
        largest_weight=1.0,
        gain=1.0,
        unseen=0.0,
        narrow=QUANTILE * math.sqrt((1.0 - share) / lost) <= TARGET,
        regions=(),
        margins=(),
        seconds=0.0,
    )


def unseen_share(lost: int, plain_boards: float) -> float:
    """What may lie outside the regions, by 95 %: of so many plain boards so many were lost there
    (the exact upper end of a Poisson count: 3 over the boards where none was)."""
    from scipy.stats import chi2  # takes a second

    return float(0.5 * chi2.ppf(0.95, 2 * (lost + 1))) / max(plain_boards, 1)


def _interval(mean: float, error: float, outside: float) -> tuple[float, float]:
    """95 % of an estimate: even in its logarithm, which keeps it above 0."""
    if mean <= 0.0:
        return 0.0, outside
    spread = math.exp(QUANTILE * error / mean)
    return mean / spread, min(mean * spread, 1.0)


def _is_decided(estimate: _Estimate, bound: float) -> bool:
    """Whether an estimate's interval lies on one side of a share, by enough lost boards."""
    if estimate.effective < SOME:
        return False
    low, high = _interval(estimate.mean, estimate.error, math.inf)
    return high <= bound or low > bound


@dataclass(frozen=True)
class _Estimate:
    mean: float
    error: float
    unanswered: float
    drawn_lost: int
    effective: float
    largest: float


def _estimate(cube: TiltedCube, sample: _Sample) -> _Estimate:
    """Shares of lost boards and of those without an answer, each board by its weight; the error is
    that within the components, of which each has as many boards as their share says, and what those
    of brief answers may add, as if one more of the boards that stand for them were no loss."""
    counts = np.bincount(sample.component, minlength=len(cube.shares))
    drawn = TiltedCube(cube.tilts, counts / counts.sum())
    weights = drawn.weights(sample.points)
    hits, total = weights * sample.lost, len(sample.points)
    # One that is no loss takes from the others for which it stands what they were taken for.
    shares, variance = hits + weights * np.where(sample.lost, 0.0, 1.0 - sample.stands), 0.0
    for k, count in enumerate(counts.tolist()):
        if count > 1:
            variance += count * float(shares[sample.component == k].var(ddof=1))
    asked_on = int((sample.stands > 1.0).sum())
    variance += (float(weights[sample.stands == 0.0].sum()) / (asked_on + 1)) ** 2
    none = float((weights * sample.unanswered * sample.stands).sum()) / total
    answered = max(1.0 - none, 1e-12)
    return _Estimate(
        max(float(shares.sum()), 0.0) / total / answered,
        math.sqrt(variance) / total / answered,
        none,
        int(sample.lost.sum()),
        _effective(hits) if hits.any() else 0.0,
        float(hits.max(initial=0.0)),
    )


def _regions(drawing: _Drawing, rng: np.random.Generator) -> _Found:
    """Where boards are lost."""
    limits = list(_by_limits(drawing))
    wide, spent = _by_wider_boards(drawing, rng)
    regions, asked = [*wide, *limits], len(PATH) * len(limits) + spent
    clear, strays = 0, list[Array]()
    for _ in range(PILOTS):
        cube = _mixture(regions, 0.3, len(drawing.names))
        sample = drawing.scouted(*cube.drawn(PILOT, rng))
        asked += len(sample.points)
        clear += int((sample.component == 0).sum())
        strays.append(sample.points[(sample.component == 0) & sample.lost])
        moved = _moved(regions, cube, sample, drawing.names) or regions
        regions = sorted(moved, key=lambda region: -region.adds)[:MOST_REGIONS]
    return _Found(regions, asked, clear, np.concatenate(strays))


def _mixture(regions: Sequence[_Region], plain: float, size: int) -> TiltedCube:
    """Plain boards and those of the regions: some of each, and more of what adds more."""
    adds = np.array([region.adds for region in regions])
    even = np.ones(len(regions)) / max(len(regions), 1)
    parts = EVEN * even + (1.0 - EVEN) * adds / adds.sum() if adds.any() else even
    return TiltedCube.of([region.tilt for region in regions], plain, size, parts)


def _effective(weights: Array) -> float:
    """Effective number of boards with these weights (L. Kish, Survey Sampling, 1965)."""
    return float(weights.sum() ** 2 / (weights**2).sum())


def _tiltable(names: Sequence[str]) -> Array:
    """(coordinates,) 1 where a coordinate may be tilted: which board of a list it is has no
    order."""
    return np.array([0.0 if name == BOARD else 1.0 for name in names])


def _by_limits(drawing: _Drawing) -> Iterator[_Region]:
    """From each linear limit of the nominal board the tilt that leads to it, as far as boards at
    the tilt's means are lost."""
    plan, question = drawing.plan, drawing.question
    if not question.periodic:
        return
    boards = plan.boards(range(EXPLORED))
    margin = nominal_limits(plan.circuit, question, boards, jobs=drawing.jobs)
    if not margin.limits:
        return
    size = len(drawing.names)
    ends = np.full((2 * size, size), 0.5)
    for k in range(size):
        ends[2 * k, k], ends[2 * k + 1, k] = 0.25, 0.75
    each = margin.each(drawing.boards(ends))
    middle = margin.each(drawing.boards(np.full((1, size), 0.5)))[0]
    slopes = 2.0 * (each[1::2] - each[0::2]) * _tiltable(drawing.names)[:, None]
    for j, limit in enumerate(margin.limits):
        way = -slopes[:, j]
        if not np.abs(way).max() > 0.0:
            continue
        strength = _strength(way, float(middle[j]))
        tilts = np.clip(np.outer(strength * np.array(PATH), way), -STEEPEST, STEEPEST)
        (lost,) = drawing.lost_first(mean_of(tilts), None, len(tilts))
        if lost.any():
            yield _Region(tilts[lost.argmax()], limit.what)


def _strength(way: Array, reliability_index: float) -> float:
    """The tilt along a way at whose mean a limit of this reliability index is reached; the steepest
    where none is steep enough."""
    low, high = 0.0, STEEPEST / float(np.abs(way).max())
    for _ in range(60):
        middle = 0.5 * (low + high)
        moved = float(way @ (mean_of(middle * way) - 0.5))
        low, high = (middle, high) if moved < reliability_index else (low, middle)
    return 0.5 * (low + high)


def _by_wider_boards(drawing: _Drawing, rng: np.random.Generator) -> tuple[list[_Region], int]:
    """A tilt for each kind of loss that boards show which are further off than they may be: of
    those boards, led back to what parts may be (``loss_walks``). Boards of a walk are copies of few
    in the end, so that of two regions of one kind it may leave one: lost boards that lie in no
    region of their kind begin walks again."""
    wider, asked = _wider_boards(drawing, rng)
    regions = dict[str, list[_Region]]()
    walks = _begun(wider)
    for _ in range(SEARCHES):
        found, spent = _led_back(drawing, walks, rng)
        asked += spent
        for kind, region in found:
            regions.setdefault(kind, []).append(region)
        again = {kind: [region.tilt for region in regions[kind]] for kind, _ in found}
        walks = _begun([each.outside(again) for each in wider])
        if not walks:
            break
    return [region for some in regions.values() for region in some], asked


def _led_back(
    drawing: _Drawing, walks: Sequence[LossWalk], rng: np.random.Generator
) -> tuple[list[tuple[str, _Region]], int]:
    """Regions at the ends of these walks, each with the kind of loss, and the boards asked."""
    asked = 0

    def shown(whole: bool) -> Shown:
        def kinds(points: Array, widths: Array) -> list[str]:
            nonlocal asked
            asked += len(points)
            return drawing.foretold(points, widths, whole=whole)

        return kinds

    # It takes long to say what clips or has no n-p-q: those walks are shorter.
    fast = [drawing.quick and each.kind[:1].isdigit() for each in walks]
    quick, slow = list(compress(walks, fast)), list(compress(walks, map(not_, fast)))
    ends = list(walk(quick, shown(False), rng))
    commonest = max((w.share for w in quick if not w.going), default=0.0)
    ends += walk(slow, shown(True), rng, FEW_MOVES, commonest)
    found, may = list[tuple[str, _Region]](), _tiltable(drawing.names)
    for each, points in zip([*quick, *slow], ends, strict=True):
        if not len(points):  # it ended on its way
            continue
        lost = drawing.scouted(points, np.zeros(len(points), dtype=int)).lost
        asked += len(points)
        even, share = np.ones(len(points)), independent(points) / len(points)
        for mine in _sides(points, even, lost, share) if lost.any() else ():
            count = share * float(mine.sum())
            if (
                count < FEWEST and mine.sum() < lost.sum()
            ):  # too few tell where; others begin there again
                continue
            tilt = _tilt(points[mine], even[mine], may, np.zeros(len(may)), count)
            if tilt.any():
                region = _Region(tilt, f"boards {each.met:g} times as far off")
                found.append((each.kind, region))
    return found, asked


@dataclass(frozen=True)
class _WiderBoards:
    """Boards whose parts are off by more than they may be."""

    width: float
    """By how much more."""
    points: Array
    """(N, coordinates)"""
    kinds: tuple[str, ...]
    """The kind of loss of each, "" where it is fine."""

    def outside(self, tilts: Mapping[str, Sequence[Array]]) -> _WiderBoards:
        """The same boards, those fine that are not of these kinds or lie where tilts of their kind
        lead, which lean the less the wider boards are."""
        kinds = list(self.kinds)
        for k, kind in enumerate(kinds):
            if kind not in tilts:
                kinds[k] = ""
        for kind in {*kinds} - {""}:
            leans = [tilt_of(0.5 + (mean_of(tilt) - 0.5) / self.width) for tilt in tilts[kind]]
            even = np.full(len(leans), 1.0 / len(leans))
            cube = TiltedCube.of(leans, 0.0, self.points.shape[1], even)
            inside = cube.densities(self.points)[:, 1:].max(axis=1) * len(leans) >= ELSEWHERE
            kinds = ["" if k == kind and i else k for k, i in zip(kinds, inside, strict=True)]
        return replace(self, kinds=tuple(kinds))


def _wider_boards(drawing: _Drawing, rng: np.random.Generator) -> tuple[list[_WiderBoards], int]:
    """Boards of one width after the other, until enough are lost, and how many were asked."""
    plain = _mixture([], PLAIN, len(drawing.names))
    found, last = list[_WiderBoards](), False
    for wide in WIDE:
        points, component = plain.drawn(EXPLORED, rng)
        sample = drawing.scouted(points, component, np.full(len(points), wide))
        each = zip(sample.responses, sample.lost, strict=True)
        kinds = tuple(_kind_of(response) if lost else "" for response, lost in each)
        found.append(_WiderBoards(wide, points, kinds))
        if sample.lost.mean() >= OFTEN:
            if last:  # a width more, for kinds of loss that the first had too few of
                break
            last = True
    return found, sum(len(each.points) for each in found)


def _begun(wider: Sequence[_WiderBoards]) -> list[LossWalk]:
    """Walks from each kind of loss at the least width at which enough boards show it, the nearest
    first."""
    met = dict[str, tuple[float, Array]]()
    for boards in wider:
        for kind in {*boards.kinds} - {""}:
            here = boards.points[[shown == kind for shown in boards.kinds]]
            before = len(met[kind][1]) if kind in met else MET - 1
            if before < min(len(here), MANY):
                met[kind] = (boards.width, here)
    walks = list[LossWalk]()
    for kind, (wide, points) in sorted(met.items(), key=lambda each: (each[1][0], each[0])):
        even = np.ones(len(points))
        for side in _sides(points, even, even > 0):
            walks.append(LossWalk.of(kind, wide, points[side], float(side.sum()) / EXPLORED))
    return walks[:MOST_WALKS]


def _kind_of(shown: str) -> str:
    """The kind of loss of a board that shows this."""
    named = shown == OrbitStatus.CLIPPED or shown[:1].isdigit()
    return shown if named else OTHER


def _tilts(sample: _Sample, weights: Array, names: Sequence[str]) -> Iterator[tuple[str, Array]]:
    """For each kind of loss of enough boards the response that they show, and the tilt whose means
    are theirs."""
    may, none = _tiltable(names), np.zeros(len(names))
    kinds = Counter(r for r, lost in zip(sample.responses, sample.lost, strict=True) if lost)
    for response, count in kinds.most_common():
        if count < FEWEST:
            break
        here = sample.lost & np.array([r == response for r in sample.responses], dtype=bool)
        for mine in _sides(sample.points, weights, here):
            tilt = _tilt(sample.points[mine], weights[mine], may, none)
            if tilt.any():
                yield response, tilt


def _sides(points: Array, weights: Array, here: Mask, share: float = 1.0) -> Iterator[Mask]:
    """Lost boards of one kind in two, where they lie on both sides of the middle: losses by a part
    that is too large, and by one that is too small, have a mean that says nothing.

    They do where their spread along one way is more than chance makes of so many boards (V. A.
    Marchenko, L. A. Pastur, 1967), and both sides have enough of them. share : of them, those that
    are independent.
    """
    off, w = points[here] - 0.5, weights[here] / weights[here].sum()
    count = share * _effective(w)
    values, ways = np.linalg.eigh((off.T * w) @ off)
    edge = (1.0 + math.sqrt(points.shape[1] / count)) ** 2 / 12.0
    along = (points - 0.5) @ ways[:, -1] > 0.0
    sides = [here & along, here & ~along]
    apart = values[-1] > APART * edge and min(int(side.sum()) for side in sides) >= FEWEST
    yield from sides if apart else [here]


def _tilt(
    points: Array, weights: Array, may: Array, before: Array, effective: float | None = None
) -> Array:
    """The tilt whose means are those of these lost boards.

    Of what chance may have made of a mean, beside that with the tilt ``before``, less is taken over
    the more it may (the positive part of W. James, C. Stein, 4th Berkeley Symp. 1961). may : 1
    where a coordinate may be tilted. effective : their effective number; None: that of the weights.
    """
    known, width = mean_of(before), width_of(before)
    mean = (weights @ points) / weights.sum()
    if effective is None:
        effective = _effective(weights)
    error = width / math.sqrt(max(effective, 1.0))
    off = np.maximum(np.abs(mean - known) / error, 1e-9)
    taken = may * np.maximum(1.0 - (CLEAR / off) ** 2, 0.0)
    moved = tilt_of(np.clip(known + taken * (mean - known), 0.02, 0.98))
    return np.where(taken > 0.0, moved, before)


def _moved(
    regions: Sequence[_Region], cube: TiltedCube, sample: _Sample, names: Sequence[str]
) -> list[_Region]:
    """The regions moved to the means of their own lost boards; those of new kinds of loss join
    them, those without a loss leave."""
    densities = cube.densities(sample.points)
    weights, likeliest = 1.0 / densities.sum(axis=1), densities.argmax(axis=1)
    may, out = _tiltable(names), list[_Region]()
    for k, region in enumerate(regions, start=1):
        mine = sample.lost & (likeliest == k)
        tilt = region.tilt
        if mine.any() and _effective(weights[mine]) >= TELLING:
            tilt = _tilt(sample.points[mine], weights[mine], may, region.tilt)
        if mine.any():
            adds = float(weights[mine].sum())
            out.append(_Region(tilt if tilt.any() else region.tilt, region.found_by, adds))
    outside = replace(sample, lost=sample.lost & (likeliest == 0))
    return out + _plain_regions(outside, weights, names)


def _plain_regions(sample: _Sample, weights: Array, names: Sequence[str]) -> list[_Region]:
    """A region for each kind of loss of enough boards."""
    each = _tilts(sample, weights, names)
    return [_Region(tilt, f"plain boards that show {response}") for response, tilt in each]


def _named(
    drawing: _Drawing,
    cube: TiltedCube,
    regions: Sequence[_Region],
    sample: _Sample,
    weights: Array,
) -> list[LossRegion]:
    """The regions with what was lost in them: each lost board is counted to the component that it
    is likeliest of, the plain one's as a region of its own."""
    likeliest = cube.densities(sample.points).argmax(axis=1)
    total = float((weights * sample.lost).sum())
    named = []
    for k, region in enumerate([_Region(cube.tilts[0], "elsewhere"), *regions]):
        mine = sample.lost & (likeliest == k)
        if not mine.any():
            continue
        seen = Counter(sample.responses[i] for i in np.flatnonzero(mine))
        named.append(
            LossRegion(
                found_by=region.found_by,
                becomes=seen.most_common(1)[0][0],
                share=float(weights[mine].sum()) / total,
                boards=int(mine.sum()),
                parts=_leading(drawing.names, region.tilt),
            )
        )
    return sorted(named, key=lambda r: -r.share)


def _leading(names: Sequence[str], tilt: Array) -> tuple[str, ...]:
    """The coordinates that are tilted most, with the ends that they lean to."""
    order = np.argsort(-np.abs(tilt), kind="stable")[:SHOWN_PARTS]
    ends = ((names[k], "high" if tilt[k] > 0.0 else "low") for k in order if tilt[k])
    return tuple(f"{name} {end}" for name, end in ends)


def _margins(drawing: _Drawing, regions: Sequence[_Region]) -> Iterator[ToleranceMargin]:
    """The tolerance margins of the corners that the regions lean to, and of single parts at the
    ends that they lean to. Tolerances are widened in proportion, every law with them."""
    if not regions:
        return
    doing("tolerance margins")
    corners = np.array([_corner(region.tilt) for region in regions])
    found = [w for w in _widenings(drawing, corners) if w is not None]
    yield ToleranceMargin("", min(found, default=None))
    lean = max((r.tilt for r in regions), key=lambda t: float(np.abs(t).max()))
    order = np.argsort(-np.max([np.abs(r.tilt) for r in regions], axis=0), kind="stable")[:SINGLE]
    alone = np.full((len(order), len(lean)), 0.5)
    for row, k in enumerate(order):
        tilts = [float(r.tilt[k]) for r in regions]
        alone[row, k] = _corner(np.array([max(tilts, key=abs)]))[0]
    each = zip(order.tolist(), _widenings(drawing, alone), strict=True)
    margins = [ToleranceMargin(drawing.names[k], w) for k, w in each]
    yield from sorted(margins, key=lambda m: math.inf if m.widening is None else m.widening)


def _corner(tilt: Array) -> Array:
    """The end of each coordinate that a tilt leans to; the middle of those that it leaves."""
    return np.where(tilt > 0.0, LAST, np.where(tilt < 0.0, 0.0, 0.5))


def _widenings(drawing: _Drawing, points: Array) -> list[float | None]:
    """For each point (coordinates,) the width of the tolerances at which its board is lost first;
    None where it is not up to ``WIDEST``."""
    rows = np.repeat(points, STEPS, axis=0)
    low, high = np.full(len(points), 1.0 / WIDEST), np.full(len(points), WIDEST)
    found = np.ones(len(points), dtype=bool)
    for _ in range(2):
        widths = np.geomspace(low, high, STEPS, axis=1)
        lost = drawing.lost_first(rows, widths.ravel(), STEPS)
        found &= lost.any(axis=1)
        first = lost.argmax(axis=1)
        each = np.arange(len(points))
        low, high = widths[each, np.maximum(first - 1, 0)], widths[each, first]
    return [float(high[k]) if found[k] else None for k in range(len(points))]
