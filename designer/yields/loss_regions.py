"""Where in the spread of the parts boards lose a response, and the tilts that lead there.

Found in three ways: the linear limits of the nominal board (``margins``), boards whose parts are
off by more than they may be (``loss_walks``), and the lost boards of all pilot rounds so far, to
whose means the tilts are moved (the cross-entropy method: R. Y. Rubinstein, D. P. Kroese, 2004; the
rounds weighed together: J.-M. Cornuet et al., Scand. J. Stat. 39, 2012, 798).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from operator import not_

import numpy as np

from designer.base.arrays import Array, Mask
from designer.spread.loss_walks import LossWalk, Shown, independent, walk
from designer.spread.spread import BOARD
from designer.spread.tilted_cube import STEEPEST, TiltedCube, mean_of, tilt_of, width_of
from designer.yields.drawn_boards import Drawing, Sample, kind_of
from designer.yields.margins import nominal_limits

PILOTS, MOST_PILOTS, PILOT = 3, 9, 600
"""Rounds in which the tilts are moved, at least and at most, and boards of each."""
SEEN = 25.0
"""Effective number of lost boards of a round after which there is no other."""
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
FEW_MOVES = 60
"""Last moves of lost boards where each answer takes long."""
MOST_WALKS, MOST_REGIONS = 6, 12
"""Walks of lost boards, and components of the mixture beside the plain one."""
APART = 1.4
"""Spread of lost boards along one way over the most that chance makes, above which they are two."""
PATH = (0.3, 0.5, 0.65, 0.8, 0.9, 1.0, 1.15, 1.35, 1.7, 2.2, 3.0)
"""Shares of the tilt that a linear limit foretells at which the loss is looked for."""


@dataclass(frozen=True)
class Region:
    """A component of the mixture, and what led to it."""

    tilt: Array
    found_by: str
    adds: float = 0.0
    """Weight of its lost boards of all rounds so far, as if these were one; 0 before the first."""


@dataclass(frozen=True)
class FoundRegions:
    """Where boards are lost, and what it took to find it."""

    regions: list[Region]
    boards: int
    """Boards that were asked."""
    plain: int
    """How many of these boards are plain ones of pilot rounds."""
    strays: Array
    """(N, coordinates) of those the lost ones."""


def find_regions(drawing: Drawing, rng: np.random.Generator) -> FoundRegions:
    """Where boards are lost."""
    limits = list(_by_limits(drawing))
    wide, spent = _by_wider_boards(drawing, rng)
    regions, asked = [*wide, *limits], len(PATH) * len(limits) + spent
    rounds, pool = list[TiltedCube](), None
    while True:
        cube = mixture(regions, 0.3, len(drawing.names))
        sample = drawing.scouted(*cube.drawn(PILOT, rng))
        rounds.append(cube)
        pool = sample if pool is None else pool.joined(sample)
        # As if each had been drawn of all rounds together.
        densities = [each.densities(pool.points).sum(axis=1) for each in rounds]
        moved = _moved(regions, cube, pool, 1.0 / np.mean(densities, axis=0), drawing.names)
        regions = sorted(moved or regions, key=lambda region: -region.adds)[:MOST_REGIONS]
        hits = cube.weights(sample.points)[sample.lost]
        seen = effective_number(hits) >= SEEN if hits.any() else not pool.lost.any()
        if len(rounds) == MOST_PILOTS or (len(rounds) >= PILOTS and seen):
            break
    plain = pool.component == 0
    asked += len(pool.points)
    return FoundRegions(regions, asked, int(plain.sum()), pool.points[plain & pool.lost])


def mixture(regions: Sequence[Region], plain: float, size: int) -> TiltedCube:
    """Plain boards and those of the regions: some of each, and more of what adds more."""
    adds = np.array([region.adds for region in regions])
    even = np.ones(len(regions)) / max(len(regions), 1)
    parts = EVEN * even + (1.0 - EVEN) * adds / adds.sum() if adds.any() else even
    return TiltedCube.of([region.tilt for region in regions], plain, size, parts)


def effective_number(weights: Array) -> float:
    """Effective number of boards with these weights (L. Kish, Survey Sampling, 1965)."""
    return float(weights.sum() ** 2 / (weights**2).sum())


def _tiltable(names: Sequence[str]) -> Array:
    """(coordinates,) 1 where a coordinate may be tilted: which board of a list it is has no
    order."""
    return np.array([0.0 if name == BOARD else 1.0 for name in names])


def _by_limits(drawing: Drawing) -> Iterator[Region]:
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
            yield Region(tilts[lost.argmax()], limit.what)


def _strength(way: Array, reliability_index: float) -> float:
    """The tilt along a way at whose mean a limit of this reliability index is reached; the steepest
    where none is steep enough."""
    low, high = 0.0, STEEPEST / float(np.abs(way).max())
    for _ in range(60):
        middle = 0.5 * (low + high)
        moved = float(way @ (mean_of(middle * way) - 0.5))
        low, high = (middle, high) if moved < reliability_index else (low, middle)
    return 0.5 * (low + high)


def _by_wider_boards(drawing: Drawing, rng: np.random.Generator) -> tuple[list[Region], int]:
    """A tilt for each kind of loss that boards show which are further off than they may be: of
    those boards, led back to what parts may be (``loss_walks``). Boards of a walk are copies of few
    in the end, so that of two regions of one kind it may leave one: lost boards that lie in no
    region of their kind begin walks again."""
    wider, asked = _wider_boards(drawing, rng)
    regions, commonest = dict[str, list[Region]](), 0.0
    walks = _begun(wider)
    for _ in range(SEARCHES):
        found, spent = _led_back(drawing, walks, rng, commonest)
        commonest = max([commonest, *(w.share for w in walks if w.width == 1.0)])
        asked += spent
        for kind, region in found:
            regions.setdefault(kind, []).append(region)
        again = {kind: [region.tilt for region in regions[kind]] for kind, _ in found}
        walks = _begun([each.outside(again) for each in wider])
        if not walks:
            break
    return [region for some in regions.values() for region in some], asked


def _led_back(
    drawing: Drawing, walks: Sequence[LossWalk], rng: np.random.Generator, commonest: float
) -> tuple[list[tuple[str, Region]], int]:
    """Regions at the ends of these walks, each with the kind of loss, and the boards asked.
    commonest : as of ``walk``."""
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
    ends = list(walk(quick, shown(False), rng, commonest=commonest))
    commonest = max([commonest, *(w.share for w in quick if w.width == 1.0)])
    ends += walk(slow, shown(True), rng, FEW_MOVES, commonest)
    found, may = list[tuple[str, Region]](), _tiltable(drawing.names)
    for each, points in zip([*quick, *slow], ends, strict=True):
        if not len(points):  # it ended on its way
            continue
        lost = drawing.scouted(points, np.zeros(len(points), dtype=int)).lost
        asked += len(points)
        even, share = np.ones(len(points)), independent(points) / len(points)
        sides = list(_sides(points, even, lost, share)) if lost.any() else []
        sides.sort(key=lambda mine: -mine.sum())
        for mine in sides:
            count = share * float(mine.sum())
            if count < FEWEST and mine is not sides[0]:  # few, by which others begin again
                continue
            tilt = _tilt(points[mine], even[mine], may, np.zeros(len(may)), count)
            if tilt.any():
                region = Region(tilt, f"boards {each.met:g} times as far off")
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


def _wider_boards(drawing: Drawing, rng: np.random.Generator) -> tuple[list[_WiderBoards], int]:
    """Boards of one width after the other, until enough are lost, and how many were asked."""
    plain = mixture([], 1.0, len(drawing.names))
    found, last = list[_WiderBoards](), False
    for wide in WIDE:
        points, component = plain.drawn(EXPLORED, rng)
        sample = drawing.scouted(points, component, np.full(len(points), wide))
        each = zip(sample.responses, sample.lost, strict=True)
        kinds = tuple(kind_of(response) if lost else "" for response, lost in each)
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


def _tilts(sample: Sample, weights: Array, names: Sequence[str]) -> Iterator[tuple[str, Array]]:
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
    count = share * effective_number(w)
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
        effective = effective_number(weights)
    error = width / math.sqrt(max(effective, 1.0))
    off = np.maximum(np.abs(mean - known) / error, 1e-9)
    taken = may * np.maximum(1.0 - (CLEAR / off) ** 2, 0.0)
    moved = tilt_of(np.clip(known + taken * (mean - known), 0.02, 0.98))
    return np.where(taken > 0.0, moved, before)


def _moved(
    regions: Sequence[Region],
    cube: TiltedCube,
    sample: Sample,
    weights: Array,
    names: Sequence[str],
) -> list[Region]:
    """The regions moved to the means of their own lost boards; those of new kinds of loss join
    them, those that are the likeliest of no lost board leave."""
    likeliest = cube.densities(sample.points).argmax(axis=1)
    may, out = _tiltable(names), list[Region]()
    for k, region in enumerate(regions, start=1):
        mine = sample.lost & (likeliest == k)
        tilt = region.tilt
        if mine.any() and effective_number(weights[mine]) >= TELLING:
            tilt = _tilt(sample.points[mine], weights[mine], may, region.tilt)
        if mine.any():
            adds = float(weights[mine].sum())
            out.append(Region(tilt if tilt.any() else region.tilt, region.found_by, adds))
    outside = replace(sample, lost=sample.lost & (likeliest == 0))
    return out + plain_regions(outside, weights, names)


def plain_regions(sample: Sample, weights: Array, names: Sequence[str]) -> list[Region]:
    """A region for each kind of loss of enough boards."""
    each = _tilts(sample, weights, names)
    return [Region(tilt, f"plain boards that show {response}") for response, tilt in each]
