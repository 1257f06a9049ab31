"""The region of a response and the largest boxes in it."""

from __future__ import annotations

import numpy as np
import pytest

from designer.bifurcations import response_region
from designer.bifurcations.plane_curves import PlaneWindow
from designer.bifurcations.response_region import EDGE, SpreadBox, room
from designer.model.swept_model import ModelSubject
from tests.bifurcations.test_continuation import PAPER, PLAIN
from tests.bifurcations.test_points import linear_orbit
from tests.shared.oracles import response_amplitude

TRIANGLE = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])


@pytest.mark.parametrize(
    ("at", "wanted"),
    [((0.25, 0.25), 0.25), ((0.1, 0.3), 0.1), ((0.4, 0.4), 0.1), ((0.6, 0.6), 0.0)],
)
def test_room_is_the_largest_square_about_a_point(at: tuple[float, float], wanted: float) -> None:
    assert room(TRIANGLE, np.array([at]))[0] == pytest.approx(wanted, abs=1e-12)


def test_room_by_trying_every_point_of_the_border() -> None:
    rng = np.random.default_rng(3)
    angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, 9))
    border = rng.uniform(0.4, 1.0, (9, 1)) * np.column_stack([np.cos(angles), np.sin(angles)])
    sides = zip(border, np.roll(border, -1, axis=0), strict=True)
    dense = np.concatenate([np.linspace(a, b, 4001) for a, b in sides])
    for point in rng.uniform(-0.2, 0.2, (20, 2)):
        found = room(border, point[None])[0]
        wanted = np.abs(dense - point).max(axis=1).min()
        assert found == 0.0 or found == pytest.approx(wanted, abs=1e-3)
    assert room(border, np.zeros((1, 2)))[0] > 0.0


@pytest.mark.slow
def test_region_without_impacts_ends_where_the_linear_response_reaches_the_stop() -> None:
    """Its border is b = |X1(ω)|; above that there is nothing but the window."""
    exact = abs(response_amplitude(PLAIN, 1.55)[0])
    at, inside = (1.55, 1.4 * exact), PlaneWindow((1.3, 1.8), (0.2 * exact, 2.0 * exact))
    plane = ModelSubject(PAPER).plane("omega", "b")
    found = response_region.region(plane, linear_orbit(1.55), at, inside, rays=8)
    assert found.response == "1-0-0"
    assert set(found.kinds) == {"grazing", EDGE}
    for (omega, b), kind in zip(found.border, found.kinds, strict=True):
        if kind == "grazing":
            assert b == pytest.approx(abs(response_amplitude(PLAIN, omega)[0]), rel=1e-8)
        else:
            assert omega in (1.3, 1.8) or b == pytest.approx(2.0 * exact)
    around, best = found.around, found.best
    assert 0.0 < around.share <= best.share
    # Each is as wide as its centre leaves room for.
    nominal = np.array(at)
    for box in (around, best):
        centre = np.array(box.centre) / nominal
        assert room(found.border / nominal, centre[None])[0] == pytest.approx(box.share, rel=1e-9)
    # A box has its ellipse inside it.
    assert found.ellipse_around.share >= around.share
    assert found.ellipse_best.share >= found.ellipse_around.share


def test_largest_circles_of_a_triangle() -> None:
    """That about (0.1, 0.3) ends at a leg; the inscribed one has the radius 1 - 1/√2."""
    radius = 1.0 - np.sqrt(0.5)
    about, best = response_region._circles(TRIANGLE, np.array([0.1, 0.3]))
    assert about[1] == pytest.approx(0.1, abs=1e-12)
    assert best[1] == pytest.approx(radius, abs=1e-5)
    assert best[0] == pytest.approx([radius, radius], abs=1e-4)


def test_box_of_spread_holds_95_per_cent_of_evenly_spread_boards() -> None:
    """Ratios from 0.9 to 1.1 and from 0.8 to 1.2 about (0.5, 0.1); the triangle ends at x + y = 1,
    and all but those with 0.5 r + 0.1 s > 1, of which there are none, lie in it."""
    evenly = np.linspace(-1.0, 1.0, 401)
    r, s = (a.ravel() for a in np.meshgrid(1.0 + 0.1 * evenly, 1.0 + 0.2 * evenly))
    box = SpreadBox.about((0.5, 0.1), np.column_stack([r, s]), TRIANGLE)
    assert box.low == pytest.approx((0.5 * (1.0 - 0.095), 0.1 * (1.0 - 0.19)))
    assert box.high == pytest.approx((0.5 * 1.095, 0.1 * 1.19))
    assert (box.share, box.boards, box.inside) == (0.95, 401 * 401, 1.0)
    half = SpreadBox.about((0.5, 0.5), np.column_stack([r, s]), TRIANGLE)
    # By symmetry about the border as many lie inside as outside.
    assert half.inside == pytest.approx(0.5, abs=0.01)
