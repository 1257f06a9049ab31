"""Lost boards led to what parts may be: their law against that of a sum of uniform numbers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from designer.base.arrays import Array
from designer.spread.loss_walks import BOARDS, KEPT, LossWalk, independent, walk
from tests.shared.closed_forms import irwin_hall

SIZE, SUMMED = 60, 12


def wider(points: Array, widths: Array) -> Array:
    return 0.5 + widths[:, None] * (points - 0.5)


def shown(points: Array, widths: Array) -> list[str]:
    """The first twelve coordinates are large together, or the last twelve small: this is rarer, and
    commoner the wider parts are. Beyond 1.5 times the width a third loss is met."""
    at = wider(points, widths)
    first, last = at[:, :SUMMED].sum(axis=1), (1.0 - at[:, -SUMMED:]).sum(axis=1)
    far = np.abs(at[:, 30] - 0.5) > 0.75
    return [
        "2-2-2" if a > 9.5 else "clipped" if b > 10.2 else "far" if c else ""
        for a, b, c in zip(first, last, far, strict=True)
    ]


def begun(kind: str, width: float, rng: np.random.Generator) -> LossWalk:
    points = rng.random((20_000, SIZE))
    here = np.array([k == kind for k in shown(points, np.full(len(points), width))])
    return LossWalk.of(kind, width, points[here][:12], float(here.mean()))


def test_boards_that_have_walked_have_the_law_of_lost_boards() -> None:
    """Each kind alone, and how common it is; of a kind that no board of width 1 shows, none is
    left."""
    rng = np.random.default_rng(4)
    walks = [begun("2-2-2", 2.0, rng), begun("clipped", 2.5, rng), begun("far", 2.5, rng)]
    large, small, none = walk(walks, shown, rng)
    assert len(none) == 0
    for begun_there, points, threshold, mine in (
        (walks[0], large, 9.5, large[:, :SUMMED]),
        (walks[1], small, 10.2, 1.0 - small[:, -SUMMED:]),
    ):
        assert (mine.sum(axis=1) > threshold).all()
        beyond = quad(lambda s: irwin_hall(SUMMED, s), threshold, SUMMED)[0]
        assert 0.3 < begun_there.share / irwin_hall(SUMMED, threshold) < 3.0
        mean = threshold + beyond / irwin_hall(SUMMED, threshold)
        assert mine.sum(axis=1).mean() == pytest.approx(mean, abs=0.05)
        assert mine.mean(axis=0) == pytest.approx(mean / SUMMED, abs=0.06)
        middle = points[:, SUMMED:-SUMMED]
        assert middle.mean(axis=0) == pytest.approx(0.5, abs=0.15)
        assert middle.std() == pytest.approx(12**-0.5, abs=0.02)


@pytest.mark.parametrize(("stay", "longer"), [(1.0, True), (0.4, False)])
def test_the_next_step_is_longer_where_most_boards_stay_lost(stay: float, longer: bool) -> None:
    each = LossWalk.of("2-2-2", 3.0, np.random.default_rng(1).random((BOARDS, 5)), 0.1)
    before = each.next_width / each.width
    each.narrow(np.arange(BOARDS) < stay * BOARDS)
    assert each.width == 3.0 * before
    assert (each.next_width / each.width < before - 0.05) is longer
    assert each.share == pytest.approx(0.1 * stay, rel=0.05)


def test_a_loss_that_adds_next_to_nothing_walks_less() -> None:
    """Beside a loss that is known: far rarer than it, and half as common."""
    rng = np.random.default_rng(4)
    share = irwin_hall(SUMMED, 9.5)
    for known, count in ((1e4 * share, 1), (2.0 * share, 2)):
        (large,) = walk([begun("2-2-2", 2.0, rng)], shown, rng, 2 * KEPT, known)
        assert len(large) == count * BOARDS


@pytest.mark.slow
def test_a_loss_that_is_called_otherwise_on_better_parts_is_followed() -> None:
    """Far beyond the limit, where bad parts lie, it shows another kind."""

    def called(points: Array, widths: Array) -> list[str]:
        sums = wider(points, widths)[:, :SUMMED].sum(axis=1)
        return ["4-4-4" if s > 12.0 else "2-2-2" if s > 9.5 else "" for s in sums]

    rng = np.random.default_rng(8)
    points = rng.random((200_000, SIZE))
    far = [k == "4-4-4" for k in called(points, np.full(len(points), 2.0))]
    (found,) = walk([LossWalk.of("4-4-4", 2.0, points[far][:12], 1e-3)], called, rng, moves=40)
    assert set(called(found, np.ones(len(found)))) == {"2-2-2"}


@pytest.mark.parametrize(("copies", "least", "most"), [(1, 96, 96), (8, 15.36, 45.0)])
def test_copies_are_no_independent_boards(copies: int, least: float, most: float) -> None:
    """Of 192 boards, of which some are alike: at most half count, and 24 different ones as about
    24."""
    points = np.random.default_rng(3).random((192 // copies, SIZE))
    assert least <= independent(np.tile(points, (copies, 1))) <= most


def test_boards_lie_within_what_parts_may_be() -> None:
    """A coordinate of 1 is beyond the end of its part's law, where an unbounded one is infinite."""
    far = LossWalk("clipped", 2.0, 2.0, np.array([[-40.0, 0.0, 40.0]]), 0.1)
    low, middle, high = far.points[0]
    assert (low, middle) == (0.0, 0.5)
    assert 1.0 - 1e-15 < high < 1.0


@pytest.mark.parametrize(("kind", "reach"), [("2-2-2", 0.95), ("", 0.05)])
def test_moves_are_as_long_as_boards_stay_lost(kind: str, reach: float) -> None:
    """Where every board is lost a move may forget where it began; where none stays, a short one is
    tried, and the boards are where they were."""
    begun_at = np.random.default_rng(1).random((12, 5))
    each = LossWalk.of("2-2-2", 1.0, begun_at, 0.1)
    before = each.normal
    walk([each], lambda points, _: [kind] * len(points), np.random.default_rng(2), moves=20)
    assert each.reach == reach
    assert (each.normal == before).all() == (kind == "")
    assert len(each.kept) == 1


@pytest.mark.parametrize(("share", "kept"), [(0.1, 6), (1e-5, 1)])
def test_a_loss_that_adds_nothing_walks_briefly(share: float, kept: int) -> None:
    begun_at = np.random.default_rng(1).random((12, 5))
    each = LossWalk.of("2-2-2", 1.0, begun_at, share)
    rng = np.random.default_rng(2)
    walk([each], lambda points, _: ["2-2-2"] * len(points), rng, commonest=0.01)
    assert len(each.kept) == kept
