"""A setting of the generator at which a board shows a wanted response: a stated search.

The rounds are those of "Tuned" in docs/definitions.md: the centred board, its bands' corners,
settings halved, paths from the nominal board; of a response without a period the first two.
Nothing is random. No board is asked more than ``MOST_TRIES`` times, and no more than
``MOST_FOLLOWED`` orbits are followed for it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from designer.base.arrays import Array
from designer.base.threads import parallel
from designer.circuit.ensemble import Ensemble
from designer.dynamics.counts import Counts
from designer.dynamics.orbit import Orbit
from designer.model.tuning_bands import Bands
from designer.verdicts.exact_circuit import Case, settled
from designer.verdicts.verdict import Question, Verdict
from designer.yields import window_path
from designer.yields.adjustment import AS_BUILT, Adjustment, widths
from designer.yields.window_path import PathSetting, find_window

HALVED = 4
"""Pairs of settings halved at once."""
APART = 0.02
"""Settings nearer than this, over the half-bands, are one."""
PATHS = ((0.0, True), (0.5, True), (-0.5, True), (0.5, False))
"""The paths: each with the half-bands of DC offset at which it sets out, and whether it is tied."""
SPOTS = 3
"""Settings of a path that are asked, at most: those deepest inside the window."""
MOST_TRIES = (1 + 8 + 2 * HALVED) + len(PATHS) * SPOTS
MOST_FOLLOWED = len(PATHS) * window_path.MOST_FOLLOWED


@dataclass(frozen=True)
class Try:
    """One setting that a board was asked at, and what it answered."""

    setting: Adjustment
    """The setting, as changes of the generator."""
    orbit: Orbit
    """The orbit that it settled on."""
    verdict: Verdict
    """What became of the board."""

    @property
    def margin(self) -> float:
        """How far the impacts are from changing their number, in units of the displacement."""
        return min(self.orbit.penetration, self.orbit.miss)


@dataclass
class BoardCase:
    """One board, by its place in the ensemble, and one response that it does not show as built."""

    board: int
    """Place of the board in the ensemble."""
    question: Question
    """The response that is asked for."""
    centre: float
    """The DC offset that centres the board, over the amplitude."""
    tries: list[Try] = field(default_factory=list)
    """The settings that were asked."""
    followed: int = 0
    """Orbits that were followed on paths to the board."""

    @property
    def best(self) -> Try | None:
        """The setting that works with the greatest margin, if any does."""
        good = [t for t in self.tries if t.verdict is Verdict.OK]
        return max(good, key=lambda t: t.margin) if good else None

    @property
    def unanswered(self) -> int:
        """Tries that gave no answer."""
        return sum(t.verdict is Verdict.FAILED for t in self.tries)


Asked = tuple[Adjustment, Array]
"""A setting, and the state that the board starts from there."""


def seek(
    ensemble: Ensemble, cases: Sequence[BoardCase], bands: Bands, *, jobs: int = 1
) -> Sequence[BoardCase]:
    """Ask every case in rounds until it works or the rounds are over; fills in the tries."""
    for propose in _rounds(ensemble, bands):
        left = [case for case in cases if case.best is None]
        proposed = zip(left, parallel(propose, left, jobs), strict=True)
        proposals = [(case, setting, start) for case, some in proposed for setting, start in some]
        trials: list[Case] = [
            (case.board, case.question, setting.of(case.question.excitation), start)
            for case, setting, start in proposals
        ]
        rows = settled(ensemble, trials, jobs)
        for (case, setting, _), (orbit, verdict, _) in zip(proposals, rows, strict=True):
            case.tries.append(Try(setting, orbit, verdict))
    return cases


Round = Callable[[BoardCase], list[Asked]]


def _rounds(ensemble: Ensemble, bands: Bands) -> list[Round]:
    def centred(points: Sequence[tuple[float, float]]) -> Round:
        """Frequency and amplitude in half-bands as settings, from the nominal orbit."""

        def propose(case: BoardCase) -> list[Asked]:
            settings = [
                Adjustment.at(
                    np.array([bands.frequency * f, bands.amplitude * a, case.centre]), bands
                )
                for f, a in points
            ]
            return [(s, case.question.start.start) for s in _new(case, settings, bands)]

        return propose

    def halved(follow: bool) -> Round:
        return lambda case: _halfway(case, bands, follow)

    def path(first: float, tied: bool) -> Round:
        def propose(case: BoardCase) -> list[Asked]:
            if not case.question.periodic:
                return []
            board = ensemble.boards.take([case.board])
            spots, followed = find_window(board, case.question, bands, first, tied=tied)
            case.followed += followed
            return [(s, case.question.start.start) for s in _deepest(spots, case, bands)]

        return propose

    edge = (-1.0, 0.0, 1.0)
    frame = [(f, a) for a in edge for f in edge if (f, a) != (0.0, 0.0)]
    return [
        centred([(0.0, 0.0)]),
        centred(frame),
        halved(False),
        halved(True),
        *(path(first, tied) for first, tied in PATHS),
    ]


def _deepest(spots: Sequence[PathSetting], case: BoardCase, bands: Bands) -> list[Adjustment]:
    """Settings of a path, the one deepest inside the window first, and none twice.

    A window may be smaller than ``APART``, so a setting is left out only where the very same was
    tried.
    """
    earlier = [AS_BUILT, *(t.setting for t in case.tries)]
    picked: list[Adjustment] = []
    for spot in sorted(spots, key=lambda spot: -spot.radius):
        setting = spot.setting
        if setting not in earlier and all(_distance(setting, s, bands) > APART for s in picked):
            picked.append(setting)
    return picked[:SPOTS]


def _halfway(case: BoardCase, bands: Bands, follow: bool) -> list[Asked]:
    """Between pairs of settings that leave the wanted counts between them, the best pair first.

    follow : start from the attractor of the better one; otherwise from the nominal orbit.
    """
    picked: list[Asked] = []
    for better, worse in _brackets(case, bands):
        middle = Adjustment(*(0.5 * (better.setting.vector + worse.setting.vector)).tolist())
        earlier = [setting for setting, _ in picked]
        if not _new(case, [*earlier, middle], bands)[len(earlier) :]:
            continue
        picked.append((middle, better.orbit.start if follow else case.question.start.start))
        if len(picked) == HALVED:
            break
    return picked


def _brackets(case: BoardCase, bands: Bands) -> list[tuple[Try, Try]]:
    """Pairs of tries, the better one of each first, by how far their counts are off and then by
    their distance. A pair leaves the wanted count of a stop between it if not both have too many
    impacts there, or both too few; one stop of which that holds is enough, two are better."""
    expect = case.question.wanted.expect
    if not isinstance(expect, Counts):
        return []
    counted = [t for t in case.tries if t.orbit.n]
    pairs = []
    for wanted in {expect, expect.mirrored}:
        off = [
            [a - b for a, b in zip(t.orbit.counts.rates, wanted.rates, strict=True)]
            for t in counted
        ]
        # The right counts over the wrong period are wrong too.
        cost = [
            sum(map(abs, row)) + 0.5 * (t.orbit.n != wanted.n)
            for row, t in zip(off, counted, strict=True)
        ]
        for i, j in combinations(range(len(counted)), 2):
            outside = sum(a * b > 0.0 for a, b in zip(off[i], off[j], strict=True))
            if outside == len(off[i]) or off[i] == off[j]:
                continue
            i, j = (i, j) if cost[i] <= cost[j] else (j, i)
            apart = _distance(counted[i].setting, counted[j].setting, bands)
            pairs.append((cost[i] + cost[j] + outside, apart, i, j))
    return [(counted[i], counted[j]) for _, _, i, j in sorted(pairs)]


def _new(case: BoardCase, settings: Sequence[Adjustment], bands: Bands) -> list[Adjustment]:
    """The settings that differ from what was tried, from as built and from each other."""
    earlier = [AS_BUILT, *(t.setting for t in case.tries)]
    untried: list[Adjustment] = []
    for setting in settings:
        if all(_distance(setting, other, bands) > APART for other in (*earlier, *untried)):
            untried.append(setting)
    return untried


def _distance(a: Adjustment, b: Adjustment, bands: Bands) -> float:
    """Largest difference over the half-band; a band of no width has only one value."""
    width = widths(bands)
    wide = width > 0.0
    return float((np.abs(a.vector - b.vector)[wide] / width[wide]).max(initial=0.0))
