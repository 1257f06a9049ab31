"""The copper, openings and holes of plotted files, as areas, by geometry alone.

Gerbers and hole files are read by gerbonara, and what it reads becomes areas of shapely. Which
layer a file is stands in its X2 attribute; names of nets and pads, which such a file may state too,
are not read. Millimetres, y upwards, as the files have them.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import shapely
from gerbonara import graphic_primitives as gp
from gerbonara.excellon import ExcellonFile
from gerbonara.rs274x import GerberFile
from gerbonara.utils import MM
from shapely.affinity import rotate
from shapely.geometry import LineString, Point, Polygon, box
from shapely.geometry.base import BaseGeometry

CHORDS = 16
"""Of a quarter of a circle: of one of 3 mm a chord is 7 µm inside it."""
GRID = 1e-4
"""Ends of the board's edge that are nearer than this [mm] are one point."""
_FUNCTION = re.compile(r"TF\.FileFunction,([^*\n]+)")
Place = tuple[float, float]


@dataclass(frozen=True)
class Hole:
    """A hole or a slot."""

    area: BaseGeometry
    """What is drilled or milled away."""
    plated: bool
    """Whether it joins the layers."""


@dataclass
class Plotted:
    """What the files of a board say."""

    copper: dict[str, BaseGeometry] = field(default_factory=dict)
    """Copper of each layer, by its name in the files: ``L1`` is the top."""
    bottom: str = ""
    """Name of the lowest layer of copper."""
    mask: dict[str, BaseGeometry] = field(default_factory=dict)
    """Openings of the mask, by side: "Top" and "Bot"."""
    paste: dict[str, BaseGeometry] = field(default_factory=dict)
    """Openings of the stencil, by side."""
    board: BaseGeometry = field(default_factory=Polygon)
    """What is inside the edge, without what is cut out; empty where the edge is not closed."""
    holes: list[Hole] = field(default_factory=list)


def plotted(files: Mapping[str, bytes]) -> Plotted:
    """What plotted files say; a file that states no function, as a job file, is left out.

    Raises
    ------
    ValueError : a file cannot be read.
    """
    out = Plotted()
    for name, content in files.items():
        text = content.decode("utf-8", errors="replace")
        stated = _FUNCTION.search(text)
        if stated is None or name.endswith(".gbrjob"):
            continue
        kind, *more = stated[1].split(",")
        with warnings.catch_warnings():
            # gerbonara warns of the places in which KiCad states modes, which are as KiCad 9 has
            # them; what it cannot read it raises.
            warnings.simplefilter("ignore")
            try:
                _take(out, kind, more, text)
            except (SyntaxError, LookupError, AttributeError, TypeError) as error:
                raise ValueError(f"{name} cannot be read back: {error}") from error
    return out


def _take(out: Plotted, kind: str, more: Sequence[str], text: str) -> None:
    if kind == "Copper":
        out.copper[more[0]] = _area(text)
        out.bottom = more[0] if more[1] == "Bot" else out.bottom
    elif kind == "Soldermask":
        out.mask[more[0]] = _area(text)
    elif kind == "Paste":
        out.paste[more[0]] = _area(text)
    elif kind == "Profile":
        lines = [_path(drawn) for drawn in _drawn(text)]
        edge = shapely.set_precision(shapely.union_all(lines), GRID)
        out.board = shapely.build_area(edge) or Polygon()
    elif kind in ("Plated", "NonPlated"):
        out.holes += [Hole(area, kind == "Plated") for area in _drilled(text)]


def _drawn(text: str) -> Iterator[Any]:
    """What a Gerber draws, in its order."""
    for item in GerberFile.from_string(text).objects:
        yield from item.to_primitives(MM)


def _drilled(text: str) -> Iterator[BaseGeometry]:
    for item in ExcellonFile.from_string(text).objects:
        yield from map(_shape, item.to_primitives(MM))


def _area(text: str) -> BaseGeometry:
    """What is dark in the end: what is clear takes away from what was dark before it."""
    out: BaseGeometry = Polygon()
    dark, run = True, list[BaseGeometry]()
    for drawn in (*_drawn(text), None):
        if drawn is None or drawn.polarity_dark != dark:
            more = shapely.union_all(run)
            out, run = (out.union(more) if dark else out.difference(more)), []
        if drawn is not None:
            dark = drawn.polarity_dark
            run.append(_shape(drawn))
    return out


def _shape(drawn: Any) -> BaseGeometry:
    """The area of one thing that is drawn."""
    if isinstance(drawn, gp.Circle):
        return Point(drawn.x, drawn.y).buffer(drawn.r, CHORDS)
    if isinstance(drawn, gp.Line | gp.Arc):
        return _path(drawn).buffer(drawn.width / 2.0, CHORDS)
    if isinstance(drawn, gp.Rectangle):
        wide, high = drawn.w / 2.0, drawn.h / 2.0
        upright = box(drawn.x - wide, drawn.y - high, drawn.x + wide, drawn.y + high)
        return rotate(upright, drawn.rotation, "center", use_radians=True)
    if isinstance(drawn, gp.ArcPoly):
        return Polygon(_outline(drawn)).buffer(0)
    raise TypeError(f"a {type(drawn).__name__}")


def _path(drawn: Any) -> BaseGeometry:
    """The middle of what a pen follows; a point where it stays."""
    if isinstance(drawn, gp.Circle):
        return Point(drawn.x, drawn.y)
    start, end = (drawn.x1, drawn.y1), (drawn.x2, drawn.y2)
    if isinstance(drawn, gp.Arc):
        return LineString(_arc(start, end, (drawn.cx, drawn.cy), clockwise=drawn.clockwise))
    return Point(start) if start == end else LineString([start, end])


def _outline(drawn: Any) -> list[Place]:
    """Corners of a region, its arcs as chords."""
    out: list[Place] = []
    for start, end, (clockwise, centre) in drawn.segments:
        if clockwise is None:
            out += [start, end]
        else:
            out += _arc(start, end, centre, clockwise=clockwise)
    return out


def _arc(start: Place, end: Place, centre: Place, *, clockwise: bool) -> list[Place]:
    """Points of an arc with both ends, which are one for a whole circle."""
    radius = math.dist(start, centre)
    first, last = (math.atan2(p[1] - centre[1], p[0] - centre[0]) for p in (start, end))
    swept = (first - last if clockwise else last - first) % (2.0 * math.pi)
    swept = swept if swept > 1e-9 else 2.0 * math.pi
    count = max(1, math.ceil(swept / (math.pi / 2.0 / CHORDS)))
    turn = (-swept if clockwise else swept) / count
    between = [first + turn * i for i in range(1, count)]
    inner = [(centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a)) for a in between]
    return [start, *inner, end]
