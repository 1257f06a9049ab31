"""The ground pour of a layer: its area, filled round everything else, as KiCad keeps it.

The file holds the filled shape, so that a board is whole before KiCad fills it anew. Pads get
thermal relief: a gap all round, and bridges that a solder joint does not lose its heat through.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.cluster.hierarchy import DisjointSet
from shapely import Geometry

from designer.base.arrays import Array
from designer.routing.board_copper import BoardCopper, Copper, Point, grown
from designer.routing.routing_grid import BRIDGE, EDGE, OVERLAP, RELIEF, THINNEST

BRIDGES = 2
"""Least number of bridges of a pad; with fewer its track alone joins it."""
SLACK = 0.01
"""More than each gap [mm]: corners of circles lie on them, chords inside."""


@dataclass(frozen=True)
class Pour:
    """A pour of one layer."""

    layer: str
    border: Array
    """(n, 2) corners of its border [mm]."""
    pieces: tuple[Geometry, ...]
    """What is filled, with the thermal bridges [mm]."""

    @property
    def fills(self) -> tuple[Array, ...]:
        """Each piece as corners (n, 2) [mm]: holes are joined to the outside by a cut."""
        return tuple(cut_open(piece) for piece in self.pieces)


def ground_pour(
    copper: BoardCopper, ground: int, layer: str, clearances: Mapping[int, float], least: float
) -> Pour:
    """Fill a layer of a routed board.

    ground : number of its net. clearances : of each net [mm]. least : of what is on no net, and of
    the pour itself [mm].
    """
    border = shapely.buffer(copper.area, -EDGE - SLACK, join_style="mitre")
    there = [piece for piece in copper.pieces if piece.on(layer)]
    own = [piece for piece in there if piece.net == ground]
    foreign = shapely.union_all(
        [
            grown(p.shape, max(least, clearances.get(p.net, least)) + SLACK)
            for p in there
            if p.net != ground
        ]
    )
    reliefs = shapely.union_all([grown(p.shape, RELIEF + SLACK) for p in own if p.relief])
    free = shapely.difference(border, foreign)
    half = 0.5 * THINNEST + SLACK
    open_ = grown(shapely.difference(free, reliefs), -half)
    filled = grown(open_, half)
    parts, lone = _parts(filled, free, own)
    while lone:
        filled = shapely.difference(filled, shapely.union_all(lone))
        parts, lone = _parts(filled, free, own)
    outline = max(shapely.get_parts(border), key=lambda part: float(part.area))
    parts.sort(key=lambda part: shapely.bounds(part).tolist())
    return Pour(layer, shapely.get_coordinates(outline.exterior)[:-1], tuple(parts))


def floating_vias(copper: BoardCopper, ground: int, pours: Sequence[Pour]) -> set[Point]:
    """Places [mm, to 1 µm] of the vias that join pieces of the pours to each other, to no pad."""
    own = [piece for piece in copper.pieces if piece.net == ground]
    tree = shapely.STRtree([piece.shape for piece in own])
    joined = DisjointSet(range(len(own)))
    for layer in copper.names:
        shapes = [shape for pour in pours if pour.layer == layer for shape in pour.pieces]
        shapes += [piece.shape for piece in own if piece.on(layer)]
        for shape in shapes:
            first, *others = [k for k in tree.query(shape, "intersects") if own[k].on(layer)]
            for other in others:
                joined.merge(first, other)
    floating = [group for group in joined.subsets() if not any(own[k].relief for k in group)]
    return {
        (round(middle.x, 3), round(middle.y, 3))
        for k in itertools.chain.from_iterable(floating)
        if own[k].pad
        for middle in [shapely.centroid(own[k].shape)]
    }


def _parts(
    filled: Geometry, free: Geometry, own: Sequence[Copper]
) -> tuple[list[Geometry], list[Geometry]]:
    """The pieces of a fill with the thermal bridges that reach it, and those of them that one pad's
    bridges alone hold: to KiCad these are islands, and bridges to them are none. The largest piece
    is no island."""
    bridges = [b for p in own if p.relief for b in _bridges(p.shape, filled, free)]
    tree = shapely.STRtree([piece.shape for piece in own])
    parts, lone = [], []
    pieces = shapely.get_parts(shapely.union_all([filled, *bridges]))
    largest = max(map(shapely.area, pieces), default=0.0)
    for part in pieces:
        held = tree.query(part, predicate="intersects")
        if len(held) == 1 and own[held[0]].relief and part.area < largest:
            lone.append(part)
        elif len(held):
            parts.append(part)
    return parts, lone


def _bridges(pad: Geometry, filled: Geometry, free: Geometry) -> list[Geometry]:
    """The thermal bridges of a pad that reach the pour; none where they are too few."""
    left, top, right, bottom = shapely.bounds(pad)
    x, y, half = 0.5 * (left + right), 0.5 * (top + bottom), 0.5 * BRIDGE
    reach = RELIEF + OVERLAP
    arms = (
        (left - reach, y - half, x, y + half, left - reach, y),
        (x, y - half, right + reach, y + half, right + reach, y),
        (x - half, top - reach, x + half, y, x, top - reach),
        (x - half, y, x + half, bottom + reach, x, bottom + reach),
    )
    out = []
    for *box, end_x, end_y in arms:
        arm = shapely.box(*box)
        end = grown(shapely.Point(end_x, end_y), half)
        if shapely.covers(free, arm) and shapely.covers(filled, end):
            out.append(arm)
    return out if len(out) >= BRIDGES else []


def cut_open(polygon: Geometry) -> Array:
    """A polygon with holes as one closed line, shape (n, 2), without a repeated end.

    Each hole is joined, from its leftmost corner to the left, to what is there; the cut has no
    width.
    """
    line: Array = shapely.get_coordinates(polygon.exterior)[:-1]
    holes = [shapely.get_coordinates(ring)[:-1] for ring in polygon.interiors]
    for hole in sorted(holes, key=lambda ring: tuple(ring[np.lexsort(ring.T[::-1])[0]])):
        start = int(np.lexsort(hole.T[::-1])[0])
        ring = np.roll(hole, -start, axis=0)
        line = _joined(line, np.vstack([ring, ring[:1]]))
    return line


def _joined(line: Array, ring: Array) -> Array:
    """A closed line with a ring inside it spliced in, by a cut to the left of the ring's start."""
    x, y = ring[0]
    ends = np.roll(line, -1, axis=0)
    low, high = np.minimum(line[:, 1], ends[:, 1]), np.maximum(line[:, 1], ends[:, 1])
    crossing = np.flatnonzero((low <= y) & (y <= high) & (np.minimum(line[:, 0], ends[:, 0]) <= x))
    rise = ends[crossing, 1] - line[crossing, 1]
    flat = rise == 0.0
    share = np.where(flat, 0.0, (y - line[crossing, 1]) / np.where(flat, 1.0, rise))
    at = line[crossing, 0] + share * (ends[crossing, 0] - line[crossing, 0])
    at = np.where(flat, np.maximum(line[crossing, 0], ends[crossing, 0]), at)
    at = np.where(at <= x, at, -np.inf)
    side = int(crossing[np.argmax(at)])
    corner = np.array([[at.max(), y]])
    return np.vstack([line[: side + 1], corner, ring, corner, line[side + 1 :]])


def pour_corners(points: Sequence[tuple[float, float]] | Array) -> Iterator[tuple[float, float]]:
    """Corners as they are written: in steps of 0.1 µm, without repetition."""
    last: tuple[float, float] | None = None
    for x, y in np.round(points, 4).tolist():
        if (x, y) != last:
            yield x, y
        last = x, y
