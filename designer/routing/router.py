"""Joining the terminals of every net: all at once at first, then those again that meet.

Each net takes its cheapest way, at first over others too. Where two meet, the place becomes dearer
from round to round, until every place has one net: negotiated congestion (McMurchie, Ebeling 1995).
What is left are ways round places that have become free since: in the end each net is laid anew
among the others as they lie, and has the cheaper of both ways.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import shapely
from numpy.typing import NDArray

from designer.base.progress import doing
from designer.routing.board_copper import NO_NET, BoardCopper, Copper
from designer.routing.kernel_router import (
    BEND,
    BREAK,
    DIAGONAL,
    FREE,
    HISTORY,
    STRAIGHT,
    UNIT,
    Tariff,
    conflicts,
    count,
    route,
    route_to_plane,
)
from designer.routing.net_kinds import GROUND_KIND, NetKind
from designer.routing.routing_grid import STEP, Nodes, RoutingGrid, routing_grid

STITCH = 7.5
"""Distance between the vias that join the pours [mm]."""
ROUNDS = 100
"""Most rounds of negotiation."""
PRESSURE, GROWTH, MOST_PRESSURE = 8, 1.4, 4000
"""Of the first round, from round to round, at most; in units of UNIT."""
TIDYINGS = 2
"""How often each net is laid anew among the others in the end."""


@dataclass(frozen=True)
class Terminals:
    """What is to be joined on one net."""

    net: int
    """KiCad's number of the net."""
    kind: int
    """Index of its kind."""
    starts: NDArray[np.int64]
    """(T + 1,) where each terminal's nodes begin in ``nodes``."""
    nodes: Nodes
    plane: bool = False
    """Whether a plane of the net is to be reached by a via, instead of the other terminals."""

    @property
    def connections(self) -> int:
        """How many are to be made."""
        return len(self.starts) - (1 if self.plane else 2)


@dataclass(frozen=True)
class Routes:
    """The paths of every net."""

    grid: RoutingGrid
    """The grid that nodes are of."""
    paths: Mapping[int, tuple[Nodes, ...]]
    """By net: runs of neighbouring nodes."""
    open: Mapping[int, int]
    """Nets with connections that no way was found for, and how many."""
    rounds: int


def find_routes(copper: BoardCopper, kinds: Sequence[NetKind], of: Mapping[int, str]) -> Routes:
    """Routes for everything on a board that is not joined yet. of : name of the kind of each net.

    The same board has the same routes on every machine.
    """
    names = [kind.name for kind in kinds]
    index = {net: names.index(name) for net, name in of.items()}
    grid = routing_grid(copper, kinds, index)
    nets = list(_nets(copper, grid, kinds, index))
    return _Negotiation(grid, kinds, nets).routes()


def _nets(
    copper: BoardCopper, grid: RoutingGrid, kinds: Sequence[NetKind], of: Mapping[int, int]
) -> list[Terminals]:
    """Nets with something to join, by kind, the shorter ones first.

    Where there are planes of ground, what goes through the board is on them already.
    """
    out = []
    for net in copper.nets:
        pieces = [p for p in copper.pieces if p.net == net and net != NO_NET]
        # A via that only joins the pours is no end of a connection.
        groups = [g for g in _joined(pieces) if any(piece.relief for piece in g)]
        plane = bool(copper.planes) and kinds[of.get(net, 0)].name == GROUND_KIND
        if plane:
            groups = [g for g in groups if not any(piece.through for piece in g)]
        if len(groups) < (1 if plane else 2):
            continue
        box = shapely.bounds(shapely.union_all([p.shape for p in pieces]))
        kind = of[net]
        lists = [
            [n for piece in group for n in grid.nodes_in(piece, kinds[kind].half)]
            for group in groups
        ]
        ends = np.cumsum([0, *map(len, lists)])
        flat = np.array([n for each in lists for n in each], dtype=np.int32)
        size = round(float(box[2] - box[0] + box[3] - box[1]), 3)
        out.append(((kind, size, copper.nets[net]), Terminals(net, kind, ends, flat, plane)))
    return [terminals for _, terminals in sorted(out, key=lambda each: each[0])]


def _joined(pieces: Sequence[Copper]) -> list[list[Copper]]:
    """The pieces of a net in groups that touch one another."""
    groups: list[list[Copper]] = []
    for piece in pieces:
        touching = [g for g in groups if any(_touch(piece, other) for other in g)]
        groups = [g for g in groups if g not in touching]
        groups.append([*(each for g in touching for each in g), piece])
    return groups


def _touch(a: Copper, b: Copper) -> bool:
    shared = any(one and other for one, other in zip(a.layers, b.layers, strict=True))
    return shared and bool(shapely.intersects(a.shape, b.shape))


class _Negotiation:
    """The rounds on one board."""

    def __init__(
        self, grid: RoutingGrid, kinds: Sequence[NetKind], nets: Sequence[Terminals]
    ) -> None:
        self.grid, self.kinds, self.nets = grid, kinds, nets
        arrays = grid.arrays
        self.marks = np.zeros(arrays.taken.shape, dtype=np.int32)
        self.via_marks = np.zeros(arrays.via_taken.shape, dtype=np.int32)
        self.mark = 0
        self.out = np.zeros(4 * arrays.places, dtype=np.int32)
        self.paths: dict[int, Nodes] = {}
        self.open: dict[int, int] = {}

    def routes(self) -> Routes:
        pressure, todo, rounds = float(PRESSURE), list(self.nets), 0
        while todo and rounds < ROUNDS:
            rounds += 1
            doing(f"routing, round {rounds}, {len(todo)} nets")
            for net in todo:
                self._route(net, round(pressure))
            pressure = min(GROWTH * pressure, MOST_PRESSURE)
            todo = [net for net in self.nets if self._conflicts(net, HISTORY // 2)]
        for net in reversed(todo):  # what could not be settled stays open: no two nets touch
            if self._conflicts(net, 0):
                self._count(net, -1)
                self.open[net.net] = net.connections
                self.paths[net.net] = np.zeros(0, dtype=np.int32)
        self.grid.arrays.history[:] = 0
        for _, net in product(range(TIDYINGS), self.nets):
            self._tidy(net)
        paths = {net: _runs(nodes) for net, nodes in self.paths.items()}
        for net in self.nets:
            if self.kinds[net.kind].name == GROUND_KIND:
                paths[net.net] += tuple(self._stitches(net))
        return Routes(self.grid, paths, {n: k for n, k in self.open.items() if k}, rounds)

    def _stitches(self, net: Terminals) -> Iterator[Nodes]:
        """Vias between the pours of a net, wherever a lattice meets free room on both sides."""
        arrays, step = self.grid.arrays, round(STITCH / STEP)
        every = np.arange(arrays.places).reshape(-1, arrays.width)
        for place in map(int, every[step::step, step::step].ravel()):
            both = [place, place + arrays.places]
            owners = {*arrays.owner[net.kind, both], arrays.via_owner[net.kind, place]}
            taken = arrays.taken[net.kind, both].any() or arrays.via_taken[net.kind, place]
            if owners <= {FREE, net.net} and not taken:
                yield np.array(both, dtype=np.int32)

    def _route(self, net: Terminals, pressure: int) -> None:
        """Take a net's paths out, and find its cheapest ones among the others."""
        if net.net in self.paths:
            self._count(net, -1)
        kind, arrays = self.kinds[net.kind], self.grid.arrays
        tariff = Tariff(
            net.net, net.kind, kind.front, kind.back, kind.via, pressure * kind.yields // UNIT
        )
        way = route_to_plane if net.plane else route
        size, left = way(arrays, tariff, self.grid.work, net.starts, net.nodes, self.out)
        self.paths[net.net], self.open[net.net] = self.out[:size].copy(), left
        self._count(net, 1)

    def _tidy(self, net: Terminals) -> None:
        """Lay a net anew among the others as they lie; the old way stays where it is as good."""
        before, left = self.paths[net.net], self.open[net.net]
        self._route(net, MOST_PRESSURE)
        better = (self.open[net.net], self._cost(net)) < (left, self._cost(net, before))
        if not better or self._conflicts(net, 0):
            self._count(net, -1)
            self.paths[net.net], self.open[net.net] = before, left
            self._count(net, 1)

    def _cost(self, net: Terminals, nodes: Nodes | None = None) -> int:
        """What a net's paths cost where nothing is in the way."""
        nodes = self.paths[net.net] if nodes is None else nodes
        kind, arrays = self.kinds[net.kind], self.grid.arrays
        inside = (nodes[:-1] != BREAK) & (nodes[1:] != BREAK)
        moves = np.where(inside, nodes[1:] - nodes[:-1], 0)
        via = np.abs(moves) == arrays.places
        factor = np.where(nodes[:-1] < arrays.places, kind.front, kind.back)
        straight = np.isin(np.abs(moves), (1, arrays.width))
        steps = np.where(straight, STRAIGHT, DIAGONAL) * factor // UNIT
        bends = (moves[1:] != moves[:-1]) & inside[1:] & inside[:-1] & ~via[1:]
        costs = np.where(via, kind.via, steps)[inside]
        return int(costs.sum() + BEND * bends.sum())

    def _count(self, net: Terminals, sign: int) -> None:
        self.mark += 1
        grid, reaches = self.grid.arrays, self.grid.reaches[net.kind]
        count(grid, self.paths[net.net], reaches, self.marks, self.via_marks, self.mark, sign)

    def _conflicts(self, net: Terminals, history: int) -> int:
        return conflicts(self.grid.arrays, net.kind, self.paths[net.net], history)


def _runs(nodes: Nodes) -> tuple[Nodes, ...]:
    """The paths of a kernel's answer."""
    runs = (run[run != BREAK] for run in np.split(nodes, np.flatnonzero(nodes == BREAK)))
    return tuple(run for run in runs if len(run))
