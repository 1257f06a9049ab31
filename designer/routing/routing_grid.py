"""The grid that a board is routed on: what may pass where, and the terminals of each net."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Geometry

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.routing.board_copper import NO_NET, BoardCopper, Copper
from designer.routing.kernel_router import FREE, NOBODY, Grid, SearchSpace
from designer.routing.net_kinds import GROUND_KIND, VIA_RADIUS, NetKind

STEP = 0.125
"""Distance between places [mm]."""
MOST_PLACES = 8_000_000
"""The most places of a layer: each takes some 200 bytes while a board is routed."""
MARGIN = 0.015
"""Added to clearances [mm]: two tracks come as much nearer between the places of the grid."""
EDGE = 0.5
"""Distance between copper and the board's edge [mm]: KiCad's own least."""
THINNEST = 0.25
"""Least width of a pour [mm]."""
RELIEF = 0.3
"""Gap of a pour round a pad of ground [mm]."""
BRIDGE = 0.4
"""Width of a thermal bridge of a pour [mm]."""
OVERLAP = 0.25
"""How far a bridge reaches past the gap [mm], to the middle of its round end: more than half its
width and the slack, so that the end lies in the pour."""
BRIDGED = RELIEF + OVERLAP + 0.5 * BRIDGE + 0.01
"""Distance from a pad to the far end of its bridges [mm], and a slack."""
BESIDE_PAD = 0.1
"""Distance between a via and a pad of its own net [mm]: solder does not run into it."""
Nodes = NDArray[np.int32]


@dataclass(frozen=True)
class RoutingGrid:
    """A board on the grid."""

    origin: tuple[float, float]
    """The first place [mm]."""
    arrays: Grid
    """The grid as the kernel takes it."""
    work: SearchSpace
    """Scratch space of the kernel."""
    reaches: NDArray[np.int64]
    """(K, 4, K) for ``kernel_router.count``, by the kind of the net that is counted."""

    def place(self, node: int) -> tuple[float, float]:
        """Where a node is [mm]."""
        y, x = divmod(node % self.arrays.places, self.arrays.width)
        return self.origin[0] + STEP * x, self.origin[1] + STEP * y

    def layer(self, node: int) -> int:
        """0 on the front, 1 on the back."""
        return node // self.arrays.places

    def nodes_in(self, piece: Copper, half: float) -> list[int]:
        """The nodes at which a track may end in a piece of copper, the one in its middle first.

        half : of the track's width [mm]; it stays inside the piece where that is wide enough.
        """
        middle = shapely.centroid(piece.shape)
        for inset in (half, 0.5 * half, 0.0, -STEP):
            inner = shapely.buffer(piece.shape, -inset)
            if shapely.is_empty(inner):
                continue
            rows, columns, x, y = self._around(inner)
            inside = np.flatnonzero(shapely.contains_xy(inner, x, y))
            if len(inside):
                break
        away = np.hypot(x - middle.x, y - middle.y)[inside].round(6)
        flat = (rows * self.arrays.width + columns)[inside][np.argsort(away, kind="stable")]
        places = [int(place) for place in flat]
        return [
            place + layer * self.arrays.places
            for layer in (0, 1)
            if piece.layers[layer]
            for place in places
        ]

    def block(
        self,
        pieces: Sequence[Copper],
        kinds: Sequence[NetKind],
        of: Sequence[int],
        *,
        planes: bool = False,
    ) -> None:
        """Give the surroundings of each piece to its net. of : index of the kind of each piece.
        planes : of ground lie between the sides: no via stands in the way of a pad's bridges."""
        owner, via_owner = self.arrays.owner, self.arrays.via_owner
        farthest = max(k.half for k in kinds) + VIA_RADIUS + max(k.clearance for k in kinds)
        farthest += BRIDGED * planes
        for piece, kind in zip(pieces, of, strict=True):
            rows, columns, x, y = self._around(shapely.buffer(piece.shape, farthest + MARGIN))
            flat = rows * self.arrays.width + columns
            gap = shapely.distance(piece.shape, shapely.points(x, y))
            for index, other in enumerate(kinds):
                apart = max(other.clearance, kinds[kind].clearance) + MARGIN
                near = flat[gap < other.half + apart]
                for layer in (0, 1):
                    if piece.layers[layer]:
                        _give(owner[index], near + layer * self.arrays.places, piece.net)
                bridged = planes and piece.relief and piece.through
                bridged = bridged and kinds[kind].name == GROUND_KIND
                room = VIA_RADIUS + apart + BRIDGED * bridged
                _give(via_owner[index], flat[gap < room], piece.net)
                if piece.pad:
                    via_owner[index, flat[gap < VIA_RADIUS + BESIDE_PAD]] = NOBODY

    def _around(self, shape: Geometry) -> tuple[NDArray[np.int64], NDArray[np.int64], Array, Array]:
        """Rows, columns and places [mm] of the nodes of a layer in the box of a shape."""
        left, top, right, bottom = shapely.bounds(shape)
        height = self.arrays.places // self.arrays.width
        x = _steps(left - self.origin[0], right - self.origin[0], self.arrays.width)
        y = _steps(top - self.origin[1], bottom - self.origin[1], height)
        rows, columns = (a.ravel() for a in np.meshgrid(y, x, indexing="ij"))
        across, down = columns.astype(np.float64), rows.astype(np.float64)
        return rows, columns, self.origin[0] + STEP * across, self.origin[1] + STEP * down


def routing_grid(
    copper: BoardCopper, kinds: Sequence[NetKind], of: Mapping[int, int]
) -> RoutingGrid:
    """The grid of a board. of : index of the kind of each net, by its number.

    Raises
    ------
    InputError : the board is too large for it.
    """
    left, top, right, bottom = shapely.bounds(copper.area)
    width, height = (math.floor(d / STEP) + 1 for d in (right - left, bottom - top))
    places, count = width * height, len(kinds)
    if places > MOST_PLACES:
        found = f"a board of {right - left:.5g} mm × {bottom - top:.5g} mm"
        raise InputError(
            copper.file, "Edge.Cuts", found, f"at most {MOST_PLACES * STEP**2:.3g} mm²"
        )
    arrays = Grid(
        width=width,
        places=places,
        owner=np.full((count, 2 * places), FREE, dtype=np.int16),
        via_owner=np.full((count, places), FREE, dtype=np.int16),
        taken=np.zeros((count, 2 * places), dtype=np.int16),
        via_taken=np.zeros((count, places), dtype=np.int16),
        history=np.zeros(2 * places, dtype=np.int32),
    )
    grid = RoutingGrid((float(left), float(top)), arrays, _work(places), _reaches(kinds))
    own = [of.get(p.net, 0) for p in copper.pieces]
    grid.block(copper.pieces, kinds, own, planes=bool(copper.planes))
    x, y = np.meshgrid(left + STEP * np.arange(width), top + STEP * np.arange(height))
    points = shapely.points(x.ravel(), y.ravel())
    room = shapely.distance(copper.edge, points)
    room[~shapely.contains_xy(copper.area, x.ravel(), y.ravel())] = -1.0
    for index, kind in enumerate(kinds):
        outside = np.flatnonzero(room < EDGE + kind.half)
        arrays.owner[index, outside] = arrays.owner[index, outside + places] = NOBODY
        arrays.via_owner[index, room < EDGE + VIA_RADIUS] = NOBODY
    return grid


def _steps(first: float, last: float, count: int) -> NDArray[np.int64]:
    low, high = max(0, math.ceil(first / STEP)), min(count - 1, math.floor(last / STEP))
    return np.arange(low, high + 1)


def _give(owner: NDArray[np.int16], nodes: NDArray[np.int64], net: int) -> None:
    """Give nodes to a net; those that another one has are nobody's, as is what is on no net."""
    there = owner[nodes]
    mine = NOBODY if net == NO_NET else net
    owner[nodes] = np.where((there == FREE) | (there == mine), mine, NOBODY)


def _work(places: int) -> SearchSpace:
    nodes = 2 * places
    return SearchSpace(
        cost=np.zeros(nodes, dtype=np.int64),
        parent=np.zeros(nodes, dtype=np.int32),
        seen=np.zeros(nodes, dtype=np.int32),
        goal=np.zeros(nodes, dtype=np.int32),
        tree=np.zeros(nodes, dtype=np.int32),
        keys=np.zeros(4 * nodes, dtype=np.int64),
        nodes=np.zeros(4 * nodes, dtype=np.int32),
        searches=np.zeros(1, dtype=np.int64),
    )


def _reaches(kinds: Sequence[NetKind]) -> NDArray[np.int64]:
    def square(reach: float) -> int:
        return math.ceil(((reach + MARGIN) / STEP) ** 2 - 1e-9)

    out = np.zeros((len(kinds), 4, len(kinds)), dtype=np.int64)
    for (j, one), (k, other) in product(enumerate(kinds), repeat=2):
        apart = max(one.clearance, other.clearance)
        out[j, :, k] = [
            square(one.half + other.half + apart),
            square(one.half + VIA_RADIUS + apart),
            square(VIA_RADIUS + other.half + apart),
            square(2.0 * VIA_RADIUS + apart),
        ]
    return out
