"""How many boards of a million lose a response: importance sampling of the parts.

Where losses are rare, plain boards hardly show any. Here boards are drawn where they are lost
(``loss_regions``), and each counts by how likely it is. What no round meets is not counted: the
answer says how much that can be, which plain boards bound.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING
from zlib import crc32

import numpy as np
from scipy.special import ndtri

from designer.answers.rare_words import boards_text
from designer.base.arrays import Array
from designer.base.plain_json import plain
from designer.base.progress import doing
from designer.base.proportion import inverse_binomial, wilson
from designer.spread.tilted_cube import TiltedCube
from designer.verdicts.verdict import StudyPlan
from designer.yields.drawn_boards import BLOCK, Drawing, Sample
from designer.yields.loss_regions import (
    Region,
    effective_number,
    find_regions,
    mixture,
    plain_regions,
)
from designer.yields.stored_parts import AnswerLog, StoredParts
from designer.yields.worst_corner import LAST
from designer.yields.yield_count import Yield

if TYPE_CHECKING:
    from designer.answers.study_answer import RareLossRow

MOST_BOARDS = 40_000
"""Boards that the estimate may take, pilot rounds left out."""
LEAST_BOARDS = 1_500
"""Boards that it takes at least."""
TARGET = 0.3
"""Half-width of the interval over the estimate at which it ends."""
PLAIN = 0.1
"""Share of plain boards in the mixture; no weight is above 1 over it."""
ENOUGH = 50.0
"""Effective number of lost boards, at least, of an estimate that ends before its most boards."""
SOME = 20.0
"""Effective number of lost boards, at least, of an estimate that ends on one side of a bound."""
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
TAG = 0xAA5E
"""Sets these boards apart from those of a study with the same seed."""
_STREAMS = (), (1,), (2,)
"""What sets apart the numbers of the estimate, of plain boards, and of who is asked on."""
QUANTILE = 1.959964
"""The quantile of the normal distribution for 95 %, two-sided."""


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

    def as_dict(self) -> RareLossRow:
        """Plain data for JSON; an undefined number is None."""
        document: RareLossRow = plain({**asdict(self), "per_million": self.per_million})
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
    drawing = Drawing(plan, question, jobs, progress, log)
    stream = crc32(question.stream.encode("utf-8"))
    rng, look, double = (np.random.default_rng([plan.seed, stream, TAG, *k]) for k in _STREAMS)
    doing("plain boards")
    first = drawing.scouted(*mixture([], PLAIN, len(drawing.names)).drawn(LOOKED, look))
    if first.lost.sum() >= FREQUENT:
        counted, asked = _counted(drawing, number, look, min(most, MOST_COUNTED), target, bound)
        if counted is not None:
            return replace(counted, seconds=time.perf_counter() - began)
        first = first.joined(asked)
    doing("regions of loss")
    found = find_regions(drawing, rng)
    regions = found.regions
    cube = mixture(regions, PLAIN, len(drawing.names))
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
    drawing: Drawing,
    number: int,
    rng: np.random.Generator,
    most: int,
    target: float,
    bound: float | None,
) -> tuple[RareLosses | None, Sample]:
    """Plain boards up to so many lost ones that their share is as narrow as ``target``; or up to
    ``SOME`` where these tell its side of ``bound``. None where so many are not lost of ``most``
    boards, by 97.5 %. Beside it the boards that were asked.

    To stop at a number of losses k, of n boards, takes the estimate (k - 1)/(n - 1), whose mean is
    the share (J. B. S. Haldane, Biometrika 33, 1945, 222); k/n is above it.
    """
    plain = mixture([], PLAIN, len(drawing.names))
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
    regions = plain_regions(counted, even, drawing.names)
    cube = mixture(regions, PLAIN, len(drawing.names))
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


def _estimate(cube: TiltedCube, sample: Sample) -> _Estimate:
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
        effective_number(hits) if hits.any() else 0.0,
        float(hits.max(initial=0.0)),
    )


def _named(
    drawing: Drawing,
    cube: TiltedCube,
    regions: Sequence[Region],
    sample: Sample,
    weights: Array,
) -> list[LossRegion]:
    """The regions with what was lost in them: each lost board is counted to the component that it
    is likeliest of, the plain one's as a region of its own."""
    likeliest = cube.densities(sample.points).argmax(axis=1)
    total = float((weights * sample.lost).sum())
    named = []
    for k, region in enumerate([Region(cube.tilts[0], "elsewhere"), *regions]):
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


def _margins(drawing: Drawing, regions: Sequence[Region]) -> Iterator[ToleranceMargin]:
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


def _widenings(drawing: Drawing, points: Array) -> list[float | None]:
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
