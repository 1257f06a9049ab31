"""The edge of a board: where it runs in a KiCad file, and how far inside it something lies.

Read are the lines, arcs, circles, rectangles, polygons and curves on Edge.Cuts that belong to the
board itself; curves as chords. What a footprint cuts out is left out.
"""

from __future__ import annotations

import cmath
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise

import numpy as np

from designer.base.arrays import Array
from designer.board.sexpr import Expression

LAYER = "Edge.Cuts"
CHORDS = 72
"""Of a whole circle: at a radius of 10 mm a chord is at most 0.01 mm inside it."""
MOST_SIDES = 40_000
"""Straight pieces of an edge: 550 circles cut out, or 10,000 slots with corners."""
JOINED = 0.01
"""Ends that are nearer than this [mm] are one point."""
Point = tuple[float, float]


@dataclass(frozen=True)
class Outline:
    """The edge of a board."""

    sides: Array
    """(n, 2, 2) the edge as straight pieces, cut-outs among them [mm]."""
    ends: tuple[Point, ...] = ()
    """Ends of the lines, arcs and curves, which others continue [mm]."""

    @property
    def open_at(self) -> Point | None:
        """A place where the edge ends, or branches; None where it is closed.

        None too where there is no edge.
        """
        ends = Counter((round(x / JOINED), round(y / JOINED)) for x, y in self.ends)
        for (x, y), count in ends.items():
            # A point may fall on either side of a border of the grid.
            near = sum(ends.get((x + i, y + j), 0) for i in (-1, 0, 1) for j in (-1, 0, 1))
            if count and near % 2:
                return x * JOINED, y * JOINED
        return None

    def inside(self, points: Array) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Of points, shape (k, 2): whether each is on the board. The edge has to be closed."""
        x, y = points[:, 0, None], points[:, 1, None]
        (x0, y0), (x1, y1) = self.sides[:, 0].T, self.sides[:, 1].T
        crossed = (y0 > y) != (y1 > y)
        with np.errstate(divide="ignore", invalid="ignore"):
            at = x0 + (y - y0) * (x1 - x0) / (y1 - y0)
        odd: np.ndarray[tuple[int], np.dtype[np.bool_]] = (crossed & (x < at)).sum(axis=1) % 2 == 1
        return odd

    def room(self, corners: Array) -> float:
        """From a convex shape to the edge [mm]: the gap where all of it is on the board, 0 where it
        lies across the edge or over a cut-out, else less than 0 by how far its outermost corner is
        outside.

        corners : shape (k, 2), in order.
        """
        # No side is farther from a corner than the one that is nearest to the middle: only those
        # that may be nearer are looked at.
        middle = corners.mean(axis=0)
        reach = float(np.linalg.norm(corners - middle, axis=1).max())
        away = _to_sides(middle[None], self.sides)[0]
        sides = self.sides[away <= away.min() + 2.0 * reach]
        if away.min() > reach:  # the edge does not pass the shape: one point tells for all
            inside = np.repeat(self.inside(middle[None]), len(corners))
        else:
            inside = self.inside(corners)
        if not inside.all():
            return -float(_to_sides(corners[~inside], sides).min(axis=1).max())
        around = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
        if _cross(around, sides) or _any_within(sides.reshape(-1, 2), around):
            return 0.0
        gaps = _to_sides(corners, sides), _to_sides(sides.reshape(-1, 2), around)
        return float(min(gap.min() for gap in gaps))


def read_outline(board: Expression) -> Outline:
    """The edge of a board file; without any side where it has none.

    Raises
    ------
    InputError : it has more than ``MOST_SIDES``, or an item is not as KiCad 9 writes it.
    """
    sides: list[tuple[Point, Point]] = []
    ends: list[Point] = []
    for each in board.children:
        if not any(layer.text() == LAYER for layer in each.all("layer")):
            continue
        points = pen_path(each)
        if not _closed(each):
            ends += points[:1] + points[-1:]
        sides += pairwise(points)
        if len(sides) > MOST_SIDES:
            raise each.error(f"an edge of more than {MOST_SIDES} pieces", "a simpler one")
    return Outline(np.array(sides, dtype=float).reshape(-1, 2, 2), tuple(ends))


def pen_path(item: Expression) -> list[Point]:
    """The middle of what a drawn item's pen follows, as straight pieces; a closed one's first point
    again at the end. Nothing where it is none of the kinds that are read."""
    return _closed(item) or _open(item)


def _open(item: Expression) -> list[Point]:
    """A line, an arc or a curve, from end to end; nothing of what is none."""
    if item.name == "gr_line":
        return [_point(item.get("start")), _point(item.get("end"))]
    if item.name == "gr_arc":
        return _arc(item)
    if item.name == "gr_curve":
        return _bezier([_point(each) for each in item.get("pts").all("xy")])
    return []


def _closed(item: Expression) -> list[Point]:
    """A rectangle, a circle or a polygon, its first point again at the end; nothing of others."""
    points: list[Point] = []
    if item.name == "gr_rect":
        (x0, y0), (x1, y1) = _point(item.get("start")), _point(item.get("end"))
        points = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    elif item.name == "gr_circle":
        centre = _point(item.get("center"))
        points = circle(centre, math.dist(centre, _point(item.get("end"))))
    elif item.name == "gr_poly":
        points = list(islice(_corners(item.get("pts")), MOST_SIDES + 1))
        if len(points) > MOST_SIDES:
            raise item.error(f"more than {MOST_SIDES} points", "a simpler polygon")
    return points + points[:1]


def circle(centre: Point, radius: float, chords: int = CHORDS) -> list[Point]:
    """Corners of the polygon inside a circle."""
    turns = (2.0 * math.pi * k / chords for k in range(chords))
    return [(centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a)) for a in turns]


def _corners(points: Expression) -> Iterator[Point]:
    for each in points.children:
        if each.name == "xy":
            yield _point(each)
        elif each.name == "arc":
            yield from _arc(each)


def _arc(item: Expression) -> list[Point]:
    """From start to end through mid; straight where the three are in line."""
    a, b, c = (complex(*_point(item.get(name))) for name in ("start", "mid", "end"))
    cross = ((b - a).conjugate() * (c - a)).imag
    if abs(cross) < 1e-9:
        return [(p.real, p.imag) for p in (a, b, c)]
    share = (c - a) / (b - a)
    centre = a + (b - a) * (share - abs(share) ** 2) / (2j * share.imag)
    turn = cmath.phase((c - centre) / (a - centre)) % (2.0 * math.pi)
    if cross < 0.0:
        turn -= 2.0 * math.pi
    count = max(2, math.ceil(CHORDS * abs(turn) / (2.0 * math.pi)))
    inner = [centre + (a - centre) * cmath.rect(1.0, turn * k / count) for k in range(1, count)]
    return [(p.real, p.imag) for p in (a, *inner, c)]


def _bezier(controls: Sequence[Point]) -> list[Point]:
    """A cubic Bézier curve."""
    if len(controls) != 4:
        return list(controls)
    out = []
    for k in range(CHORDS + 1):
        t = k / CHORDS
        weights = ((1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3)
        x, y = (sum(w * p[i] for w, p in zip(weights, controls, strict=True)) for i in (0, 1))
        out.append((x, y))
    return out


def _point(item: Expression) -> Point:
    return item.number(0), item.number(1)


def _to_sides(points: Array, sides: Array) -> Array:
    """Distance of each point from each straight piece, shape (points, sides)."""
    start, along = sides[:, 0], sides[:, 1] - sides[:, 0]
    away = points[:, None] - start
    long = np.maximum((along**2).sum(axis=1), 1e-300)
    share = np.clip((away * along).sum(axis=2) / long, 0.0, 1.0)
    distance: Array = np.linalg.norm(away - share[..., None] * along, axis=2)
    return distance


def _cross(some: Array, others: Array) -> bool:
    """Whether any straight piece of the one crosses one of the others."""
    a, b = some[:, None, 0], some[:, None, 1]
    c, d = others[None, :, 0], others[None, :, 1]
    apart = _turn(a, b, c) * _turn(a, b, d), _turn(c, d, a) * _turn(c, d, b)
    return bool(((apart[0] < 0.0) & (apart[1] < 0.0)).any())


def _any_within(points: Array, around: Array) -> bool:
    """Whether any of the points, shape (k, 2), lies inside a convex shape with these sides."""
    turns = _turn(around[None, :, 0], around[None, :, 1], points[:, None])
    return bool(((turns > 0.0).all(axis=1) | (turns < 0.0).all(axis=1)).any())


def _turn(a: Array, b: Array, c: Array) -> Array:
    """Above 0 where c lies on the one side of the line from a to b, below on the other."""
    side: Array = (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (
        c[..., 0] - a[..., 0]
    )
    return side
