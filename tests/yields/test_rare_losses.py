"""Rare losses: the densities by integrals, the estimate against probabilities in closed form."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.integrate import quad
from scipy.stats import binomtest, norm, poisson

from designer.base.arrays import Array
from designer.check.synthesis_result import synthesise
from designer.cli import entry
from designer.folders.study_cache import StudyCache
from designer.folders.study_stores import PIECES
from designer.model.model_file import parse_model_file
from designer.spread import loss_walks
from designer.spread.tilted_cube import TiltedCube, mean_of, tilt_of, width_of
from designer.verdicts.verdict import Verdict
from designer.yields import drawn_boards, loss_regions, rare_losses, stored_parts
from designer.yields.margins import Margin
from designer.yields.rare_losses import AnyLost, RareLosses, counted_losses
from designer.yields.stored_parts import AnswerLog, StoredParts
from designer.yields.study_plan import plan_study
from designer.yields.tolerance_study import check
from designer.yields.yield_count import Yield
from tests.shared.closed_forms import irwin_hall
from tests.shared.exploring import quick
from tests.shared.model_text import SMALL
from tests.verdicts.test_verdict import plan

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

# ---------------------------------------------------------------------------------------------
# Densities


@given(st.floats(-39.0, 39.0))
def test_moments_of_a_tilt_are_their_integrals(tilt: float) -> None:
    total = quad(lambda u: math.exp(tilt * u - abs(tilt)), 0.0, 1.0)[0]
    mean = quad(lambda u: u * math.exp(tilt * u - abs(tilt)), 0.0, 1.0)[0] / total
    square = quad(lambda u: u * u * math.exp(tilt * u - abs(tilt)), 0.0, 1.0)[0] / total
    at = np.array([tilt])
    assert mean_of(at)[0] == pytest.approx(mean, abs=1e-7)
    assert width_of(at)[0] == pytest.approx(math.sqrt(square - mean**2), rel=1e-3)
    assert tilt_of(mean_of(at))[0] == pytest.approx(
        tilt, abs=1e-6 * max(1.0, math.exp(0.4 * abs(tilt)))
    )


def test_weights_are_the_mixtures() -> None:
    """Their mean is 1, none is above 1 over the plain share, and they weigh moments back."""
    tilts = [np.array([3.0, -2.0, 0.0]), np.array([0.0, 5.0, 5.0])]
    cube = TiltedCube.of(tilts, 0.1, 3, np.array([0.7, 0.3]))
    points, component = cube.drawn(200_000, np.random.default_rng(1))
    weights = cube.weights(points)
    assert np.bincount(component) == pytest.approx(len(points) * cube.shares, rel=0.01)
    assert weights.mean() == pytest.approx(1.0, abs=0.01)
    assert weights.max() <= 1.0 / 0.1
    assert (weights[:, None] * points).mean(axis=0) == pytest.approx(0.5, abs=0.01)


# ---------------------------------------------------------------------------------------------
# The estimate, on boards whose losses are known in closed form


class _Boards:
    """Stands for boards: their points, further off by ``wide``."""

    def __init__(self, points: Array) -> None:
        self.points = points

    def __len__(self) -> int:
        return len(self.points)

    def take(self, rows: Array) -> _Boards:
        return _Boards(self.points[rows])


def estimated(
    monkeypatch: pytest.MonkeyPatch,
    size: int,
    lost: Callable[[Array], list[str]],
    seed: int,
    brief: Callable[[Array], list[str]] | None = None,
    limit: Callable[[Array], Array] | None = None,
    **how: Any,
) -> rare_losses.RareLosses:
    """The estimate where a board's coordinates decide: ``lost`` names what each shows, "" where it
    is fine, "failed" where it has no answer. brief : names what it shows where it is asked briefly.
    limit : margin of boards (N, coordinates) to a linear limit; None: none is known."""

    def verdicts(_: object, boards: _Boards, within: int | None) -> list[tuple[Verdict, str]]:
        shown = lost if within is None or brief is None else brief
        verdicts = {"": Verdict.OK, "failed": Verdict.FAILED}
        return [(verdicts.get(r, Verdict.LOST), r) for r in shown(boards.points)]

    def kinds(_: object, boards: _Boards, *, whole: bool) -> list[str]:
        return (brief or lost)(boards.points)

    def wider(boards: _Boards, share: Array) -> _Boards:
        return _Boards(0.5 + share[:, None] * (boards.points - 0.5))

    names = tuple(f"R{k}" for k in range(size))
    spread = SimpleNamespace(coordinates=lambda _: names, from_cube=lambda _, cube: _Boards(cube))
    question = SimpleNamespace(stream="1", periodic=brief is not None)
    plan: Any = SimpleNamespace(
        census=False, labels=(), seed=seed, questions=(question,), spread=spread, circuit=None,
        modelled=lambda boards: boards, boards=lambda _: None,
    )  # fmt: skip
    limits = [] if limit is None else [SimpleNamespace(what="a limit")]
    margin = SimpleNamespace(limits=limits, each=lambda boards: limit(boards.points)[:, None])  # type: ignore[misc]
    monkeypatch.setattr(drawn_boards.Drawing, "_verdicts", verdicts)
    monkeypatch.setattr(drawn_boards.Drawing, "_kinds", kinds)
    monkeypatch.setattr(drawn_boards.Drawing, "quick", True)
    monkeypatch.setattr(loss_regions, "nominal_limits", lambda *_, **__: margin)
    monkeypatch.setattr(drawn_boards, "between", wider)
    return rare_losses.rare_losses(plan, 0, **how)


REPETITIONS = 60


@pytest.mark.parametrize(
    ("size", "threshold"),
    quick([(12, 10.3), (20, 15.6), (12, 9.6)]),
)
def test_the_interval_covers_a_probability_that_is_known(
    monkeypatch: pytest.MonkeyPatch, size: int, threshold: float
) -> None:
    """One region: lost where the sum of all coordinates is above a threshold. Of 60 intervals of
    95 % at least 52 cover: fewer have a chance below 1 in 200. Plain boards would take a hundred
    times as many."""
    truth = irwin_hall(size, threshold)
    assert 1e-7 < truth < 1e-3

    def lost(points: Array) -> list[str]:
        return ["1-0-0" if s > threshold else "" for s in points.sum(axis=1)]

    found = [estimated(monkeypatch, size, lost, seed) for seed in range(REPETITIONS)]
    covered = sum(r.low <= truth <= r.high for r in found)
    assert covered >= 52
    assert np.mean([r.lost for r in found]) == pytest.approx(truth, rel=0.1)
    assert np.median([r.gain for r in found]) > 5.0
    assert all(r.largest_weight <= 1.0 / rare_losses.PLAIN for r in found)
    assert all(len(r.regions) >= 1 and r.regions[0].becomes == "1-0-0" for r in found)


def test_a_board_without_an_answer_is_neither_lost_nor_fine(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Beyond the threshold one more coordinate leaves half of the boards without one."""
    truth = 0.5 * irwin_hall(12, 9.6)

    def lost(points: Array) -> list[str]:
        beyond = zip(points[:, :12].sum(axis=1), points[:, 12], strict=True)
        return ["" if s <= 9.6 else "failed" if u < 0.5 else "1-0-0" for s, u in beyond]

    found = [estimated(monkeypatch, 13, lost, seed) for seed in range(6)]
    assert np.mean([r.lost for r in found]) == pytest.approx(truth, rel=0.2)
    assert np.mean([r.unanswered for r in found]) == pytest.approx(truth, rel=0.2)
    for estimate, low, high in (r.per_million for r in found):
        assert 0.0 < low < estimate < high < 1e6


@pytest.mark.parametrize("threshold", [0.0, 0.8])
def test_lost_boards_are_in_two_where_they_lie_further_apart_than_chance_has_it(
    threshold: float,
) -> None:
    """On both sides of a sum's middle: their variance along the sum is 0.17, where chance makes
    0.1 of 2000 boards of variance 1/12."""
    points = np.random.default_rng(7).random((8000, 12))
    here = np.abs(points.sum(axis=1) - 6.0) > threshold
    here &= np.cumsum(here) <= 2000
    sides = list(loss_regions._sides(points, np.ones(len(points)), here))
    assert len(sides) == (2 if threshold else 1)
    assert (np.sum(sides, axis=0) == here).all()


@pytest.mark.slow
@pytest.mark.parametrize("ends", [False, True])
def test_two_regions_of_one_kind_of_loss_are_found(
    monkeypatch: pytest.MonkeyPatch, ends: bool
) -> None:
    """Lost where twelve coordinates are large together, or where twelve others are, or where they
    are small themselves. What is lost shows the same, and a walk tends to end in one of the two. Of
    16 intervals of 95 % at least 12 cover: fewer have a chance of 1 in 1000."""
    truth = irwin_hall(12, 10.0) + irwin_hall(12, 9.7)

    def lost(points: Array) -> list[str]:
        first = points[:, :12].sum(axis=1)
        second = 12.0 - first if ends else points[:, -12:].sum(axis=1)
        return ["1-0-0" if a > 10.0 or b > 9.7 else "" for a, b in zip(first, second, strict=True)]

    found = [estimated(monkeypatch, 60, lost, seed) for seed in range(16)]
    assert sum(r.low <= truth <= r.high for r in found) >= 12
    assert np.mean([r.lost for r in found]) == pytest.approx(truth, rel=0.1)


def test_a_search_knows_the_commonest_loss_of_those_before_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What is rare beside it walks less: here the second of two regions begins walks again."""
    known, walk = list[float](), loss_walks.walk

    def recorded(walks: Any, shown: Any, rng: Any, moves: int = 120, commonest: float = 0.0) -> Any:
        known.append(commonest)
        return walk(walks, shown, rng, moves, commonest)

    def lost(points: Array) -> list[str]:
        sums = points[:, :12].sum(axis=1), points[:, -12:].sum(axis=1)
        return ["1-0-0" if a > 10.0 or b > 9.7 else "" for a, b in zip(*sums, strict=True)]

    monkeypatch.setattr(loss_regions, "walk", recorded)
    estimated(monkeypatch, 60, lost, 0)
    quick = known[::2]  # each search leads those back first that are quick to tell
    assert quick[0] == 0.0
    assert quick[1] == pytest.approx(irwin_hall(12, 9.7), rel=0.9)


@pytest.mark.slow
def test_the_rounds_find_a_region_that_walks_know_badly(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lost where twelve coordinates are large together and another is within a tenth of its
    middle, which no tilt leads to. Walks know the means of the 47 others badly; each round adds to
    what those before said of them. Of 12 intervals of 95 % at least 8 cover (fewer have a chance of
    1 in 5000)."""
    truth = 0.2 * irwin_hall(12, 9.0)

    def lost(points: Array) -> list[str]:
        each = zip(points[:, :12].sum(axis=1), points[:, 20], strict=True)
        return ["1-0-0" if s > 9.0 and abs(u - 0.5) < 0.1 else "" for s, u in each]

    found = [estimated(monkeypatch, 60, lost, seed) for seed in range(12)]
    assert sum(r.low <= truth <= r.high for r in found) >= 8
    assert np.median([r.boards for r in found]) < 5000


def test_a_limit_of_the_nominal_board_leads_to_the_losses(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where wider boards show nothing, and in fewer coordinates than there are: of 60 intervals of
    95 % at least 52 cover."""
    truth = irwin_hall(12, 10.3)

    def margin(points: Array) -> Array:
        margin: Array = 10.3 - points[:, :12].sum(axis=1)
        return margin

    def lost(points: Array) -> list[str]:
        return ["1-0-0" if m < 0.0 else "" for m in margin(points)]

    monkeypatch.setattr(loss_regions, "_by_wider_boards", lambda *_: ([], 0))
    found = [estimated(monkeypatch, 16, lost, seed, lost, margin) for seed in range(REPETITIONS)]
    assert sum(r.low <= truth <= r.high for r in found) >= 52
    assert np.mean([r.lost for r in found]) == pytest.approx(truth, rel=0.1)
    assert all(r.regions[0].found_by == "a limit" for r in found)


@pytest.mark.parametrize("lost_of_them", quick([0.7, 1.0]))
def test_boards_that_show_no_period_briefly_are_asked_on_by_chance(
    monkeypatch: pytest.MonkeyPatch, lost_of_them: float
) -> None:
    """They are those of a sum above a threshold; another coordinate decides which come to the
    wanted period after all. A quarter is asked: of 40 intervals of 95 % at least 33 cover (fewer
    have a chance of 1 in 1000)."""
    truth, asked = lost_of_them * irwin_hall(12, 9.6), 0

    def brief(points: Array) -> list[str]:
        return ["aperiodic" if s > 9.6 else "" for s in points[:, :12].sum(axis=1)]

    def lost(points: Array) -> list[str]:
        nonlocal asked
        asked += len(points)
        both = zip(brief(points), points[:, 12], strict=True)
        return [shown if u < lost_of_them else "" for shown, u in both]

    found = [estimated(monkeypatch, 13, lost, seed, brief) for seed in range(40)]
    assert sum(r.low <= truth <= r.high for r in found) >= 33
    assert np.mean([r.lost for r in found]) == pytest.approx(truth, rel=0.1)
    assert 0 < asked < 0.35 * sum(r.drawn_lost for r in found)


def test_plenty_of_losses_are_counted_on_plain_boards(monkeypatch: pytest.MonkeyPatch) -> None:
    """One board in 20, and nothing is drawn where it is lost."""
    truth = irwin_hall(12, 7.65)
    assert 0.04 < truth < 0.06

    def lost(points: Array) -> list[str]:
        return ["1-0-0" if s > 7.65 else "" for s in points.sum(axis=1)]

    def never(*_: object) -> None:
        raise AssertionError("sought")

    monkeypatch.setattr(rare_losses, "find_regions", never)
    found = [estimated(monkeypatch, 12, lost, seed) for seed in range(REPETITIONS)]
    assert sum(r.low <= truth <= r.high for r in found) >= 52
    assert np.mean([r.lost for r in found]) == pytest.approx(truth, rel=0.1)
    assert all(r.drawn_lost >= rare_losses.PLENTY and r.boards < 2000 for r in found)
    assert all([region.becomes for region in r.regions] == ["1-0-0"] for r in found)
    assert all(r.narrow and r.margins[0].widening is not None for r in found)


@pytest.mark.parametrize(
    ("most", "target"), [(rare_losses.MOST_BOARDS, 0.1), (500, 0.3), (2000, 0.3)]
)
def test_a_count_keeps_to_the_limits_of_an_estimate(
    monkeypatch: pytest.MonkeyPatch, most: int, target: float
) -> None:
    """One board in 10: to ± 10 % take 385 lost ones, to ± 30 % 43, and 500 boards hardly have
    them. Of 12 intervals of 95 % at least 10 cover."""
    truth, covered = irwin_hall(12, 7.3), 0
    assert 0.09 < truth < 0.11

    def lost(points: Array) -> list[str]:
        return ["1-0-0" if s > 7.3 else "" for s in points.sum(axis=1)]

    for seed in range(12):
        result = estimated(monkeypatch, 12, lost, seed, most=most, target=target)
        assert result.boards <= most
        covered += result.low < truth < result.high
        if result.unseen == 0.0:
            assert result.narrow
            assert 0.5 * (result.high - result.low) <= 1.05 * target * result.lost
            assert result.lost == (result.drawn_lost - 1) / (result.boards - 1)
            assert result.ends(0.95) == pytest.approx((result.low, result.high))
            assert result.gain == result.boards / (result.boards + result.pilots)
    assert covered >= 10


@pytest.mark.parametrize("bound", [1e-5, 0.5])
def test_a_count_ends_on_the_right_side_of_a_bound(
    monkeypatch: pytest.MonkeyPatch, bound: float
) -> None:
    def lost(points: Array) -> list[str]:
        return ["1-0-0" if s > 7.65 else "" for s in points.sum(axis=1)]

    result = estimated(monkeypatch, 12, lost, 3, bound=bound)
    assert result.drawn_lost == rare_losses.SOME
    assert not result.narrow
    assert (result.low > bound) is (bound < 0.1)
    assert result.low < irwin_hall(12, 7.65) < result.high
    none = estimated(monkeypatch, 12, lost, 3, bound=0.05)
    assert none.drawn_lost > rare_losses.PLENTY


def test_boards_that_are_slow_but_sound_are_no_plenty(monkeypatch: pytest.MonkeyPatch) -> None:
    """Briefly one board in 20 shows no period; all of these come to it. Asking plain boards ends
    where enough lost ones are out of reach; those that were asked are in the number of boards, and
    in what may be unseen."""
    asked = 0

    def brief(points: Array) -> list[str]:
        return ["aperiodic" if s > 7.65 else "" for s in points.sum(axis=1)]

    def lost(points: Array) -> list[str]:
        return [""] * len(points)

    def ended(*of: Any) -> Any:
        nonlocal asked
        found = counted(*of)
        asked = len(found[1].points)
        return found

    def whole() -> RareLosses:
        return estimated(monkeypatch, 12, lost, 1, brief, most=1500)

    counted = rare_losses._counted
    monkeypatch.setattr(rare_losses, "_counted", ended)
    result = whole()
    assert 0 < asked <= 1000
    monkeypatch.setattr(rare_losses, "FREQUENT", math.inf)
    never = whole()
    assert result.pilots == never.pilots + asked
    assert (result.lost, result.boards) == (never.lost, never.boards)
    assert result.unseen < never.unseen


@pytest.mark.parametrize("factor", quick([0.4, 2.5]))
def test_an_estimate_ends_on_the_right_side_of_a_bound(
    monkeypatch: pytest.MonkeyPatch, factor: float
) -> None:
    """Of a share that is known, and with fewer boards than the share itself takes."""
    truth = irwin_hall(12, 10.3)

    def lost(points: Array) -> list[str]:
        return ["1-0-0" if s > 10.3 else "" for s in points.sum(axis=1)]

    pairs = [
        [
            estimated(monkeypatch, 12, lost, seed, target=0.08, bound=bound)
            for bound in (factor * truth, None)
        ]
        for seed in range(20)
    ]
    sides = [r.high <= factor * truth if factor > 1.0 else r.low > factor * truth for r, _ in pairs]
    assert sum(sides) >= 19
    assert all(r.boards <= whole.boards for r, whole in pairs)
    assert sum(r.boards for r, _ in pairs) < 0.9 * sum(whole.boards for _, whole in pairs)


@pytest.mark.slow
def test_two_regions_that_lie_apart_are_both_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lost where the first six are large, and, as something else, where the last six are small."""
    truth = irwin_hall(6, 5.2) + irwin_hall(6, 5.4)
    truth -= irwin_hall(6, 5.2) * irwin_hall(6, 5.4)

    def lost(points: Array) -> list[str]:
        first, last = points[:, :6].sum(axis=1), (1.0 - points[:, 6:]).sum(axis=1)
        return [
            "1-0-0" if a > 5.2 else "clipped" if b > 5.4 else ""
            for a, b in zip(first, last, strict=True)
        ]

    found = [estimated(monkeypatch, 12, lost, seed) for seed in range(20)]
    assert sum(r.low <= truth <= r.high for r in found) >= 16
    kinds = [{region.becomes for region in r.regions} for r in found]
    assert sum(kind == {"1-0-0", "clipped"} for kind in kinds) >= 18


@pytest.mark.slow
def test_the_commonest_loss_of_bad_parts_does_not_hide_that_of_good_ones(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Among 60 coordinates twelve decide on the one, and two others, which are to be far off
    together, on the other: that is the commoner from 1.6 times the width on, and impossible at
    1."""
    truth = irwin_hall(12, 10.0)

    def lost(points: Array) -> list[str]:
        first, far = points[:, :12].sum(axis=1), points[:, 20:22].sum(axis=1)
        return [
            "1-0-0" if a > 10.0 else "clipped" if b > 2.2 else ""
            for a, b in zip(first, far, strict=True)
        ]

    found = [estimated(monkeypatch, 60, lost, seed) for seed in range(20)]
    assert sum(r.low <= truth <= r.high for r in found) >= 16
    assert np.mean([r.lost for r in found]) == pytest.approx(truth, rel=0.1)


@pytest.mark.slow
def test_losses_on_both_sides_of_the_middle_are_two_regions(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As what is lost both ways shows the same, only where it lies tells the two apart."""
    truth = 2.0 * irwin_hall(12, 9.8)

    def lost(points: Array) -> list[str]:
        return ["1-0-0" if abs(s - 6.0) > 3.8 else "" for s in points.sum(axis=1)]

    found = [estimated(monkeypatch, 12, lost, seed) for seed in range(20)]
    assert sum(r.low <= truth <= r.high for r in found) >= 16


def test_boards_that_are_never_lost_leave_what_plain_boards_leave(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """All boards are plain then, and 3 over their number is 95 % of what may be."""
    monkeypatch.setattr(rare_losses, "MOST_BOARDS", 2000)
    result = estimated(monkeypatch, 5, lambda points: [""] * len(points), 1)
    assert (result.lost, result.low, result.regions, result.margins) == (0.0, 0.0, (), ())
    assert math.isnan(result.gain)
    assert result.high == result.unseen == pytest.approx(3.0 / result.boards, rel=0.6)


@pytest.mark.parametrize(("lost", "end"), [(0, 2.996), (1, 4.744), (2, 6.296)])
def test_what_lies_outside_is_bounded_by_a_poisson_count(lost: int, end: float) -> None:
    """95 %, one-sided: as tables of the Poisson distribution have it."""
    assert rare_losses.unseen_share(lost, 1000) == pytest.approx(end / 1000, rel=1e-3)


def test_margins_are_the_widths_at_which_a_corner_and_a_part_are_lost(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Lost where 3 u0 + u1 + … is above its middle by 1.8. Alone, coordinate 0 has to be off by
    0.6, which is 1.2 of its tolerance; all together reach it at 1.8/3."""

    def lost(points: Array) -> list[str]:
        sums = 3.0 * (points[:, 0] - 0.5) + (points[:, 1:4] - 0.5).sum(axis=1)
        return ["1-0-0" if s > 1.8 else "" for s in sums]

    result = estimated(monkeypatch, 4, lost, 3)
    everything, first, *others = result.margins
    assert everything.part == ""
    assert everything.widening == pytest.approx(1.8 / 3.0, rel=0.05)
    assert first.part == "R0"
    assert first.widening == pytest.approx(1.2, rel=0.05)
    assert [m.widening for m in others] == [pytest.approx(3.6, rel=0.05)] * 3


def test_a_board_that_takes_long_is_no_loss_of_a_margin(monkeypatch: pytest.MonkeyPatch) -> None:
    """Slow from 1.2, lost from 1.8 on: the margins of a coordinate that counts three times."""

    def sums(points: Array) -> Array:
        sums: Array = 3.0 * (points[:, 0] - 0.5) + (points[:, 1:4] - 0.5).sum(axis=1)
        return sums

    def lost(points: Array) -> list[str]:
        return ["1-0-0" if s > 1.8 else "" for s in sums(points)]

    def brief(points: Array) -> list[str]:
        return ["1-0-0" if s > 1.8 else "failed" if s > 1.2 else "" for s in sums(points)]

    result = estimated(monkeypatch, 4, lost, 3, brief)
    everything, first, *others = result.margins
    assert everything.widening == pytest.approx(0.6, rel=0.05)
    assert first.widening == pytest.approx(1.2, rel=0.05)
    assert [m.widening for m in others] == [pytest.approx(3.6, rel=0.05)] * 3


def test_plenty_of_losses_are_counted_as_they_are() -> None:
    few = Yield(ok=170, lost=20, grazing=5, failed=5)
    many = Yield(ok=150, lost=35, grazing=10, failed=5)
    assert counted_losses(0, few) is None
    counted = counted_losses(0, many)
    assert counted is not None
    assert counted.lost == pytest.approx(45 / 195)
    assert counted.low < counted.lost < counted.high
    assert counted.unanswered == 5 / 200
    assert (counted.boards, counted.pilots, counted.drawn_lost) == (200, 0, 45)
    assert (counted.effective, counted.largest_weight, counted.gain) == (45.0, 1.0, 1.0)
    assert (counted.unseen, counted.seconds, counted.narrow) == (0.0, 0.0, True)
    enough = replace(few, lost=35)
    sure = counted_losses(0, replace(few, ok=9000, lost=35))
    assert sure is not None
    assert not sure.narrow  # 40 of so many are ± 31 %
    assert counted_losses(0, replace(enough, lost=34)) is None
    assert counted_losses(0, enough) is not None


class _InFile(StoredParts):
    """Parts in a file that is read anew."""

    def __init__(self, path: Path) -> None:
        self._file = StudyCache(path, lambda name, content: write(path, name, content))

    def get(self, name: str) -> Any | None:
        return self._file.get(name, "key")

    def put(self, values: Mapping[str, Any]) -> None:
        self._file.put_all(values, "key")


def write(path: Path, name: str, content: bytes) -> None:
    path.with_name(name).write_bytes(content)


class _Asked:
    """Boards of twelve coordinates that are lost where the sum is above a threshold; Ctrl-C comes
    where more than ``most`` are asked."""

    def __init__(self, most: float = math.inf) -> None:
        self.most, self.count = most, 0

    def __call__(self, points: Array) -> list[str]:
        if self.count + len(points) > self.most:
            raise KeyboardInterrupt
        self.count += len(points)
        return ["clipped" if s > 9.6 else "" for s in points.sum(axis=1)]


STOPS = (0.1, 0.3, 0.5, 0.8, 0.97)
"""Shares of all boards: while kinds of loss are met, on walks, in pilot rounds, in the estimate."""


def test_an_interrupted_estimate_goes_on_where_it_was(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """No board that was answered is asked again, and the end is the same to the last digit."""
    monkeypatch.setattr(stored_parts, "EVERY", 0.0)
    monkeypatch.setattr(loss_regions, "FEW_MOVES", 20)
    whole = _Asked()
    expected = replace(estimated(monkeypatch, 12, whole, 1), seconds=0.0)
    path, done = tmp_path / "pieces.npz", 0
    for share in STOPS:
        asked = _Asked(share * whole.count - done)
        with pytest.raises(KeyboardInterrupt):
            estimated(monkeypatch, 12, asked, 1, log=AnswerLog(_InFile(path), "a"))
        done += asked.count
        assert 0 < done < whole.count
    rest, parts = _Asked(), _InFile(path)
    found = estimated(monkeypatch, 12, rest, 1, log=AnswerLog(parts, "a"))
    assert replace(found, seconds=0.0) == expected
    assert done + rest.count == whole.count
    # What others were asked says nothing here.
    other = estimated(monkeypatch, 12, _Asked(), 2, log=AnswerLog(parts, "a"))
    fresh = estimated(monkeypatch, 12, _Asked(), 2)
    assert replace(other, seconds=0.0) == replace(fresh, seconds=0.0) != expected


@given(st.lists(st.lists(st.booleans(), min_size=3, max_size=3), min_size=1, max_size=12))
def test_what_all_responses_lose_lies_between_the_bounds(boards: list[list[bool]]) -> None:
    """Of boards that are counted one by one, for each of three responses whether it is lost."""
    single = [Yield(len(boards) - sum(lost), sum(lost), 0, 0) for lost in zip(*boards, strict=True)]
    bounds = AnyLost.of([share_of(each) for each in single])
    truth = sum(map(any, boards)) / len(boards)
    assert bounds.low <= bounds.least <= truth + 1e-12
    assert truth - 1e-12 <= bounds.most <= bounds.high <= 1.0


def test_ends_of_the_bounds_hold_for_all_responses_at_once() -> None:
    """Three intervals and what may be unseen of two are each at 1 - 0.05/5: the even one in the
    logarithm by the normal's quantile, the counted one by SciPy."""
    drawn = drawn_share(2e-4, 0.2, unseen=1e-3)
    none = drawn_share(0.0, 0.0, unseen=2e-3)
    counted = share_of(Yield(950, 45, 0, 0))
    bounds = AnyLost.of([drawn, none, counted])
    level = 1.0 - 0.05 / 5
    ci = binomtest(45, 995).proportion_ci(level, method="wilson")
    high = 2e-4 * math.exp(norm.ppf(0.5 + 0.5 * level) * 0.2) + ci.high
    # 3 over the number of boards is ln 20 over it; at the level of each it is ln 100.
    high += 3e-3 * math.log(100.0) / math.log(20.0)
    assert bounds.low == pytest.approx(ci.low)
    assert bounds.high == pytest.approx(high, rel=1e-5)
    counts = AnyLost.of([counted])
    assert (counts.low, counts.high) == pytest.approx((counted.low, counted.high))


@pytest.mark.parametrize("lost", [0, 1, 5, 40])
@pytest.mark.parametrize("responses", [2, 9])
def test_no_more_is_unseen_than_the_bounds_say(lost: int, responses: int) -> None:
    """So many plain boards were lost outside the regions: against SciPy's Poisson distribution."""
    unseen = rare_losses.unseen_share(lost, 1000)
    bounds = AnyLost.of([drawn_share(0.0, 0.0, unseen=unseen)] * responses)
    each = bounds.high / responses
    assert poisson.cdf(lost, 1000 * each) <= 0.05 / (2 * responses) * (1.0 + 1e-6)


def drawn_share(lost: float, error: float, *, unseen: float) -> RareLosses:
    """error : standard error over the estimate."""
    spread = math.exp(rare_losses.QUANTILE * error)
    high = lost * spread if lost else unseen
    return replace(
        share_of(Yield(1000, 0, 0, 0)), lost=lost, low=lost / spread, high=high, unseen=unseen,
        pilots=3000,
    )  # fmt: skip


def share_of(counted: Yield) -> RareLosses:
    low, high = counted.interval
    lost = counted.lost / counted.samples
    return RareLosses(
        0, lost, 1.0 - high, 1.0 - low, 0.0, counted.samples, 0, counted.lost, 1.0, 1.0, 1.0, 0.0,
        True, (), (), 0.0,
    )  # fmt: skip


# ---------------------------------------------------------------------------------------------
# On boards


def drawing_of(text: str) -> drawn_boards.Drawing:
    """Boards of the one response of a model file."""
    modelfile = parse_model_file(text)
    made = synthesise(modelfile)
    plan = plan_study(modelfile, made.design, check(made, None), made.catalog, samples=1, seed=1)
    log = AnswerLog(StoredParts(), "")
    return drawn_boards.Drawing(plan, plan.questions[0], 1, lambda: None, log)


@pytest.mark.slow
def test_what_is_foretold_of_boards_is_what_they_show() -> None:
    """For any number of threads; but for what the compiled way leaves open, if that is not asked
    about: it is no loss then."""
    drawing = drawing_of(SMALL)
    assert drawing.quick
    points = np.random.default_rng(5).random((96, len(drawing.names)))
    wide = np.full(96, 8.0)
    known = drawing.asked(points, wide, within=drawn_boards.SCOUTED)
    lost = ["" if v is Verdict.OK else drawn_boards.kind_of(r) for v, r in known]
    assert {"", "clipped", drawn_boards.OTHER} < set(lost)
    assert replace(drawing, jobs=3).foretold(points, wide, whole=True) == lost
    quickly = drawing.foretold(points, wide, whole=False)
    assert all(a in (b, "") for a, b in zip(quickly, lost, strict=True))
    assert {"", "1-1-1"} == set(quickly)


def test_answers_to_a_drive_that_is_no_sine_come_slowly() -> None:
    p = plan(1)
    sine, log = p.questions[0], AnswerLog(StoredParts(), "")
    waves = ((1, 1.0, 0.0), (3, 0.2, 0.1))
    other = replace(sine, excitation=replace(sine.excitation, shape=waves))
    for question, compiled in ((sine, True), (other, False)):
        assert drawn_boards.Drawing(p, question, 1, lambda: None, log).quick is compiled


# ---------------------------------------------------------------------------------------------
# In a folder


@pytest.mark.slow
def test_the_verb_writes_it_and_takes_it_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rare_losses, "MOST_BOARDS", 60)
    monkeypatch.setattr(rare_losses, "BLOCK", 30)
    monkeypatch.setattr(loss_regions, "PILOT", 30)
    monkeypatch.setattr(loss_regions, "EXPLORED", 64)
    monkeypatch.setattr(loss_walks, "BOARDS", 12)
    monkeypatch.setattr(loss_regions, "FEW_MOVES", 20)
    monkeypatch.setattr(stored_parts, "EVERY", 0.0)
    model, folder = tmp_path / "model.toml", tmp_path / "d"
    model.write_text(SMALL, "utf-8")
    command = ["tolerance", str(model), "--out", str(folder), "--rung", "exact", "--samples", "20"]
    command += ["--no-blame", "--rare"]
    margins = rare_losses._margins

    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    def never(*_: object, **__: object) -> None:
        raise AssertionError("drawn twice")

    monkeypatch.setattr(rare_losses, "_margins", stopped)
    assert entry.status(command) == 130
    monkeypatch.setattr(rare_losses, "_margins", margins)
    monkeypatch.setattr(drawn_boards.Drawing, "_verdicts", never)
    assert entry.status([*command, "--resume"]) == 0
    assert not (folder / PIECES).exists()
    assert "Rare losses" in capsys.readouterr().err
    document = json.loads((folder / "tolerance.json").read_text("utf-8"))
    found = [r["rare"] for r in document["responses"]]
    assert all(r["low"] <= r["lost"] <= r["high"] for r in found)
    assert "Boards of a million" in (folder / "report.md").read_text("utf-8")
    assert document["cost"]["rare_seconds"] > 0.0
    monkeypatch.setattr("designer.yields.tolerance_study.rare_losses", never)
    assert entry.status(["tolerance", str(folder), "--tuned"]) == 0
    again = json.loads((folder / "tolerance.json").read_text("utf-8"))
    assert [r["rare"] for r in again["responses"]] == found


def test_boards_of_a_list_are_counted_and_not_drawn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "boards.csv").write_text("part,value,board\nR100,10k,a\nR100,10.1k,b\n", "utf-8")
    model = tmp_path / "model.toml"
    model.write_text(SMALL + '\n[spread]\nmeasured = "boards.csv"\n', "utf-8")
    for verb in ("tolerance", "run"):
        assert entry.status([verb, str(model), "--out", str(tmp_path / "d"), "--rare"]) == 2
        assert "--rare" in capsys.readouterr().err
        assert not (tmp_path / "d").exists()


def test_no_limit_is_asked_for_without_a_period(monkeypatch: pytest.MonkeyPatch) -> None:
    """A motion without a period has no orbit that could be followed to a limit."""

    def never(*_: object, **__: object) -> Margin:
        raise AssertionError("followed")

    monkeypatch.setattr(loss_regions, "nominal_limits", never)
    monkeypatch.setattr(rare_losses, "MOST_BOARDS", 500)
    estimated(monkeypatch, 3, lambda points: [""] * len(points), 2)
