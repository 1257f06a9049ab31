"""A board file with its tracks, vias and ground pours."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from designer.base.arrays import Array
from designer.board.kicad_names import circuit_net, identifier
from designer.board.kicad_rules import CustomRule
from designer.board.net_codes import names_nets, with_codes, without_codes
from designer.board.sexpr import Expression, expression, expression_text, lists, read, word
from designer.circuit.netlist import Circuit
from designer.routing.board_copper import (
    ALL,
    LAYERS,
    Point,
    read_copper,
    track_item,
    via_item,
    zone_layers,
)
from designer.routing.ground_pour import (
    Pour,
    floating_vias,
    ground_pour,
    pour_corners,
)
from designer.routing.net_kinds import GROUND_KIND, NetKind, kinds_of_nets, net_kinds
from designer.routing.router import find_routes
from designer.routing.routing_grid import BRIDGE, RELIEF, THINNEST, Nodes, RoutingGrid

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
