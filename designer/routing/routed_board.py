"""A board file with its tracks, vias and ground pours.

The file holds a pour's filled shape, so that a board is whole before KiCad fills it anew. Pads get
thermal relief: a gap all round, and bridges that a solder joint does not lose its heat through.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import shapely
from scipy.cluster.hierarchy import DisjointSet
from shapely import Geometry

from designer.base.arrays import Array
from designer.board.kicad_names import circuit_net, identifier
from designer.board.kicad_rules import CustomRule
from designer.board.net_codes import names_nets, with_codes, without_codes
from designer.board.sexpr import Expression, expression, expression_text, lists, read, word
from designer.circuit.netlist import Circuit
from designer.routing.board_copper import (
    ALL,
    LAYERS,
    BoardCopper,
    Copper,
    Point,
    grown,
    read_copper,
    track_item,
    via_item,
    zone_layers,
)
from designer.routing.net_kinds import GROUND_KIND, NetKind, kinds_of_nets, net_kinds
from designer.routing.router import find_routes
from designer.routing.routing_grid import (
    BRIDGE,
    EDGE,
    OVERLAP,
    RELIEF,
    THINNEST,
    Nodes,
    RoutingGrid,
)

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


POUR = "designer pour"
"""Name of a zone that was made here."""


@dataclass(frozen=True)
class RoutedBoard:
    """A routed board, and what it took."""

    text: str
    """Text of the ``.kicad_pcb``."""
    open: Mapping[str, int]
    """The circuit's nets with connections that no way was found for, and how many."""
    lengths: Mapping[str, float]
    """Length of the tracks that were laid on each of the circuit's nets [mm]."""
    vias: int
    """Vias that were set."""


def route_board(
    text: str, circuit: Circuit, rules: Sequence[CustomRule], file: Path | None = None
) -> RoutedBoard:
    """Lay the tracks of a placed board of a circuit; what is on it already stays.

    text : of the ``.kicad_pcb``. rules : the board's, whose widths and clearances hold. The same
    text gives the same board, byte for byte. file : where it was read from, for messages.

    Raises
    ------
    InputError : the board has no closed edge, is too large, or has a pad of a shape that is not
        read.
    """
    whole = read(text, file)
    board = with_codes(whole)
    board = Expression(tuple(item for item in board.items if not _ours(item)), board.source)
    copper = read_copper(board)
    kinds = net_kinds(rules)
    of = kinds_of_nets(circuit, copper.nets)
    routes = find_routes(copper, kinds, of)
    by_name = {kind.name: kind for kind in kinds}
    items: list[Expression] = []
    lengths: dict[str, float] = {}
    for net, runs in sorted(routes.paths.items()):
        name = copper.nets[net]
        own = list(_items(routes.grid, runs, net, name, by_name[of[net]]))
        items += own
        lengths[circuit_net(name)] = sum(_length(item) for item in own)
    routed, pours, floating = _poured(board, items, kinds, of)
    if floating:
        items = [item for item in items if item.name != "via" or _place(item) not in floating]
        routed, pours, _ = _poured(board, items, kinds, of)
    poured = Expression((*routed.items, *pours), board.source)
    return RoutedBoard(
        expression_text(without_codes(poured) if names_nets(whole) else poured),
        {circuit_net(copper.nets[net]): count for net, count in sorted(routes.open.items())},
        lengths,
        sum(item.name == "via" for item in items),
    )


def _items(
    grid: RoutingGrid, runs: Sequence[Nodes], net: int, name: str, kind: NetKind
) -> Iterator[Expression]:
    """Tracks and vias of a net."""
    for run in runs:
        for nodes in _straight(grid, run):
            start, end = (grid.place(nodes[i]) for i in (0, -1))
            if len(nodes) == 2 and start == end:
                yield via_item(start, net, name, "via")
            else:
                layer = LAYERS[grid.layer(nodes[0])]
                yield track_item(start, end, 2.0 * kind.half, layer, net, name, "track")


def _straight(grid: RoutingGrid, run: Nodes) -> Iterator[list[int]]:
    """The straight pieces of a run of nodes; a change of sides is a piece of two nodes."""
    piece: list[int] = []
    for before, after in pairwise(map(int, run)):
        step = after - before
        if piece and piece[-1] - piece[-2] != step:
            yield piece
            piece = []
        piece = [*(piece or [before]), after]
    if piece:
        yield piece


def _place(via: Expression) -> Point:
    at = via.get("at")
    return round(at.number(0), 3), round(at.number(1), 3)


def _poured(
    board: Expression, items: Sequence[Expression], kinds: Sequence[NetKind], of: Mapping[int, str]
) -> tuple[Expression, list[Expression], set[Point]]:
    """A board with what was laid on it; a pour of ground for each side that has none, and for each
    inner layer without a zone; the places of vias that float with the pours."""
    routed = Expression((*board.items, *items), board.source)
    copper = read_copper(routed)
    zones, floating = list[Expression](), set[Point]()
    clearance = {kind.name: kind.clearance for kind in kinds}
    clearances = {net: clearance[name] for net, name in of.items()}
    least = clearance[GROUND_KIND]
    for ground in (net for net, name in of.items() if name == GROUND_KIND):
        there = {
            name
            for zone in board.all("zone")
            if zone.get("net").text() == str(ground)
            for name in zone_layers(zone)
        }
        outer = [name for name in LAYERS if not there & {name, "F&B.Cu", ALL}]
        pours = [
            ground_pour(copper, ground, layer, clearances, least)
            for layer in (*outer, *copper.planes)
        ]
        floating |= floating_vias(copper, ground, pours)
        zones += [_zone(pour, ground, copper.nets[ground], least) for pour in pours]
    return routed, zones, floating


def _ours(item: object) -> bool:
    """Whether an item of a board is a pour that was made here."""
    return (
        isinstance(item, Expression)
        and item.name == "zone"
        and any(name.text() == POUR for name in item.all("name"))
    )


def _zone(pour: Pour, net: int, name: str, clearance: float) -> Expression:
    return expression(
        "zone",
        *lists(
            net=net,
            net_name=name,
            layer=pour.layer,
            uuid=identifier("pour", name, pour.layer),
            name=POUR,
            hatch=(word("edge"), 0.5),
        ),
        expression("connect_pads", clearance=clearance),
        *lists(min_thickness=THINNEST, filled_areas_thickness=False),
        expression("fill", True, thermal_gap=RELIEF, thermal_bridge_width=BRIDGE),
        expression("polygon", _points(pour.border)),
        *(
            expression("filled_polygon", *lists(layer=pour.layer), _points(fill))
            for fill in pour.fills
        ),
    )


def _points(corners: Array) -> Expression:
    return expression("pts", *(expression("xy", x, y) for x, y in pour_corners(corners)))


def _length(item: Expression) -> float:
    if item.name != "segment":
        return 0.0
    start, end = ((item.get(n).number(0), item.get(n).number(1)) for n in ("start", "end"))
    return math.dist(start, end)
