"""The copper of a pad in a KiCad board file, as a convex shape around it."""

from __future__ import annotations

import math

from designer.base.sexpr import Expression
from designer.board.outline import circle, drawn

Point = tuple[float, float]
WITHIN_SIZE = frozenset({"rect", "roundrect", "oval"})
"""Shapes that fill ``size``, but for their corners."""


def corners(pad: Expression, at: Point, turn: float) -> tuple[Point, ...]:
    """Corners of the copper, or of the rectangle around it, in order [mm]; a circle's are many.

    at : where the pad stands on the board [mm]; the copper may be off it by the drill's ``offset``.
    turn : the pad's angle on the board, which the file states with the footprint's in it. Empty
    where the shape is not read: a trapezoid, one of a kind that is not known, or one that differs
    from layer to layer.
    """
    drill = pad.find("drill")
    offset = None if drill is None else drill.find("offset")
    centre = at if offset is None else turned((offset.number(0), offset.number(1)), at, turn)
    size, kind = pad.get("size"), pad.text(2)
    x, y = size.number(0) / 2.0, size.number(1) / 2.0
    box: tuple[float, float, float, float] | None = None
    if pad.find("padstack") is not None:
        return ()
    if kind == "circle":
        return tuple(circle(centre, x, 16))
    if kind in WITHIN_SIZE:
        box = -x, -y, x, y
    elif kind == "custom":
        box = _around(pad, (-x, -y, x, y))
    if box is None:
        return ()
    left, top, right, bottom = box
    rectangle = ((left, top), (right, top), (right, bottom), (left, bottom))
    return tuple(turned(corner, centre, turn) for corner in rectangle)


def turned(at: Point, origin: Point, turn: float) -> Point:
    """A place in a turned frame, on the board. Angles [rad] are counter-clockwise as seen, with y
    downwards."""
    x, y = at
    return (
        origin[0] + x * math.cos(turn) + y * math.sin(turn),
        origin[1] - x * math.sin(turn) + y * math.cos(turn),
    )


def _around(
    pad: Expression, anchor: tuple[float, float, float, float]
) -> tuple[float, float, float, float] | None:
    """The rectangle around the anchor and the primitives of a custom pad, in its own frame; None
    where one of these is of a kind that is not known."""
    left, top, right, bottom = anchor
    primitives = pad.find("primitives")
    for each in () if primitives is None else primitives.children:
        points = drawn(each)
        if not points:
            return None
        width = each.find("width")
        half = 0.0 if width is None else width.number() / 2.0
        xs, ys = [p[0] for p in points], [p[1] for p in points]
        left, right = min(left, min(xs) - half), max(right, max(xs) + half)
        top, bottom = min(top, min(ys) - half), max(bottom, max(ys) + half)
    return left, top, right, bottom
