"""The edge of a board against shapes whose distances are known, and another library's polygons."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, strategies as st
from matplotlib.path import Path as Polygon

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.board.outline import Outline, circle, read_outline
from designer.board.sexpr import read

L_SHAPE = [(0.0, 0.0), (40.0, 0.0), (40.0, 20.0), (20.0, 20.0), (20.0, 50.0), (0.0, 50.0)]


def board(*items: str) -> Outline:
    """The outline of a board with these items on its edge."""
    drawn = (f'({item} (layer "Edge.Cuts"))' for item in items)
    return read_outline(read(f"(kicad_pcb {' '.join(drawn)})"))


def square(x: float, y: float, half: float = 0.5, turn: float = 0.0) -> Array:
    around = (math.pi / 4 + turn + k * math.pi / 2 for k in range(4))
    long = half * math.sqrt(2.0)
    return np.array([(x + long * math.cos(a), y + long * math.sin(a)) for a in around])


def polygon(points: list[tuple[float, float]]) -> str:
    return f"gr_poly (pts {' '.join(f'(xy {x} {y})' for x, y in points)})"


@given(x=st.floats(-5.0, 45.0), y=st.floats(-5.0, 55.0))
def test_inside_as_matplotlib_says(x: float, y: float) -> None:
    outline = board(polygon(L_SHAPE))
    assert outline.open_at is None
    there = Polygon(np.array([*L_SHAPE, L_SHAPE[0]]), closed=True)
    near = min(abs(v - b) for v, borders in ((x, (0, 20, 40)), (y, (0, 20, 50))) for b in borders)
    if near > 1e-6:
        found = outline.inside(np.array([(x, y)]))
        assert found[0] == there.contains_point((x, y))


@given(
    gap=st.floats(-8.0, 8.0),
    along=st.floats(3.0, 17.0),
    turn=st.sampled_from([0.0, math.pi / 2, math.pi]),
)
def test_room_at_a_straight_side(gap: float, along: float, turn: float) -> None:
    """A pad 1 mm wide whose outermost copper is this far inside the right side of the arm; the
    other sides are farther away than 8 mm or as far as ``along`` says."""
    outline = board(polygon(L_SHAPE))
    room = outline.room(square(40.0 - 0.5 - gap, along, turn=turn))
    if gap >= 0.0:
        assert room == pytest.approx(min(gap, along - 0.5, 20.0 - along - 0.5), abs=1e-9)
    else:
        assert room == pytest.approx(gap, abs=1e-9)


def test_the_inner_corner_and_a_slot_through_a_pad() -> None:
    outline = board(polygon(L_SHAPE))
    assert outline.room(square(18.0, 18.0)) == pytest.approx(math.hypot(1.5, 1.5))
    # A slot narrower than the pad: every corner is on the board, and an edge runs through it.
    slotted = board(polygon(L_SHAPE), "gr_rect (start 10 9.9) (end 30 10.1)")
    assert slotted.room(square(20.0, 10.0)) == 0.0
    assert slotted.room(square(20.0, 8.0)) == pytest.approx(9.9 - 8.5)
    assert slotted.room(square(20.0, 10.0, half=0.05)) < 0.0, "in the slot"
    # A cut-out wholly under a pad: no corner is off the board, and no edge meets the pad's.
    holed = board("gr_rect (start 0 0) (end 40 40)", "gr_rect (start 19 19) (end 21 21)")
    assert holed.room(square(20.0, 20.0, half=5.0)) == 0.0
    assert holed.room(square(20.0, 20.0, half=5.0, turn=0.5)) == 0.0
    assert holed.room(square(30.0, 20.0, half=5.0)) == pytest.approx(4.0)


@given(
    at=st.tuples(st.floats(-8.0, 8.0), st.floats(-8.0, 8.0)),
    radius=st.floats(0.05, 12.0),
    turn=st.floats(0.0, 6.2),
    reverse=st.booleans(),
)
def test_a_pad_and_a_round_cut_out(
    at: tuple[float, float], radius: float, turn: float, reverse: bool
) -> None:
    """A square pad, 10 mm wide, and a hole beside it, across its edge, wholly under it or around
    it: the gap between a square and a disc is known in the square's own frame."""
    outline = board(
        "gr_rect (start -40 -40) (end 40 40)",
        f"gr_circle (center {at[0]} {at[1]}) (end {at[0] + radius} {at[1]})",
    )
    pad = square(0.0, 0.0, half=5.0, turn=turn)
    room = outline.room(pad[::-1] if reverse else pad)
    u = abs(at[0] * math.cos(turn) + at[1] * math.sin(turn))
    v = abs(at[1] * math.cos(turn) - at[0] * math.sin(turn))
    gap = math.hypot(max(u - 5.0, 0.0), max(v - 5.0, 0.0)) - radius
    chord = radius * (1.0 - math.cos(math.pi / 72)) + 1e-9
    if gap > chord:
        assert room == pytest.approx(gap, abs=chord)
    elif gap < 0.0:
        assert room <= chord
    if max(u, v) < 5.0 - radius:
        assert room == 0.0, "wholly under the pad"


def test_rounded_boards() -> None:
    """A disc, and the same of two arcs: the gap is the radius less the corner's distance."""
    disc = board("gr_circle (center 5 5) (end 15 5)")
    arcs = board(
        "gr_arc (start -5 5) (mid 5 -5) (end 15 5)", "gr_arc (start -5 5) (mid 5 15) (end 15 5)"
    )
    for outline in (disc, arcs):
        assert outline.open_at is None
        for at in (0.0, 3.0, 6.0):
            corners = square(5.0 + at, 5.0)
            far = max(math.dist(c, (5.0, 5.0)) for c in corners)
            # Chords lie inside their arc, by at most r (1 - cos(π/72)).
            assert outline.room(corners) == pytest.approx(10.0 - far, abs=0.0096)
    half = board("gr_arc (start -5 5) (mid 5 -5) (end 15 5)", "gr_line (start 15 5) (end -5 5)")
    assert half.open_at is None
    assert half.room(square(5.0, 0.0)) > 0.0
    assert half.room(square(5.0, 8.0)) == pytest.approx(-3.5)


def test_a_curve_and_a_polygon_with_an_arc() -> None:
    """A Bézier curve that is a straight line, and a polygon with a round end."""
    curved = board(
        "gr_curve (pts (xy 0 0) (xy 10 0) (xy 20 0) (xy 30 0))",
        "gr_line (start 30 0) (end 30 10)",
        "gr_line (start 30 10) (end 0 10)",
        "gr_line (start 0 10) (end 0 0)",
    )
    assert curved.open_at is None
    assert curved.room(square(15.0, 3.0)) == pytest.approx(2.5)
    rounded = board(
        "gr_poly (pts (xy 0 0) (xy 20 0) (arc (start 20 0) (mid 30 10) (end 20 20)) (xy 0 20))"
    )
    assert rounded.room(square(27.0, 10.0)) > 0.0
    assert rounded.room(square(27.0, 3.0)) < 0.0


def test_where_the_edge_is_open() -> None:
    lines = ["gr_line (start 0 0) (end 30 0)", "gr_line (start 30 0) (end 30 10)"]
    assert board(*lines).open_at == (0.0, 0.0)
    assert board(*lines, "gr_line (start 30.004 9.997) (end 0 0)").open_at is None
    assert board().open_at is None
    assert len(board().sides) == 0


def test_a_polygon_for_a_circle() -> None:
    points = circle((1.0, 2.0), 3.0, 16)
    assert len(points) == 16
    assert {round(math.dist(p, (1.0, 2.0)), 12) for p in points} == {3.0}


@given(
    x=st.floats(-8.0, 48.0),
    y=st.floats(-8.0, 58.0),
    half=st.sampled_from([0.3, 1.0, 4.0, 12.0]),
    turn=st.floats(0.0, 1.5),
)
def test_room_as_shapely_says(x: float, y: float, half: float, turn: float) -> None:
    """An L with three cut-outs, and pads of any size anywhere."""
    holes = [(10.0, 10.0, 3.0), (10.0, 35.0, 1.0), (30.0, 10.0, 0.2)]
    outline = board(
        polygon(L_SHAPE), *(f"gr_circle (center {a} {b}) (end {a + r} {b})" for a, b, r in holes)
    )
    area = shapely.Polygon(L_SHAPE, [circle((a, b), r) for a, b, r in holes])
    corners = square(x, y, half, turn)
    pad = shapely.Polygon(corners)
    out = [
        float(area.boundary.distance(p)) for p in map(shapely.Point, corners) if not area.covers(p)
    ]
    inside = float(area.boundary.distance(pad)) if area.covers(pad) else 0.0
    expected = -max(out) if out else inside
    assert outline.room(corners) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("item", "count"),
    [
        ("gr_circle (center 0 0) (end 9 0)", 556),
        ("gr_arc (start 0 0) (mid 9 9) (end 18 0)", 1112),
        ("gr_poly (pts " + "(xy 0 0) (xy 1 0)" * 500 + ")", 41),
        ("gr_rect (start 0 0) (end 9 9)", 10_001),
    ],
)
def test_an_edge_of_too_many_pieces(item: str, count: int) -> None:
    with pytest.raises(InputError, match="an edge of more than 40000 pieces"):
        board(*[item] * count)


def test_a_polygon_of_too_many_points_is_refused_before_they_are_made() -> None:
    arcs = "(arc (start 0 0) (mid 9 9) (end 18 0))" * 20_000
    with pytest.raises(InputError, match="more than 40000 points"):
        board(f"gr_poly (pts {arcs})")
