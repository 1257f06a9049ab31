"""A board for other routers: Specctra's design format out, its session format back.

The design (``.dsn``) has the board's edge, every pad with its copper and its net, the widths and
clearances of each kind of net, and the tracks that are there. The session (``.ses``) is what a
router made of it. Lengths are in micrometres and y points upwards; a session states a unit of its
own. Source: Cadence, SPECCTRA Design Language Reference, 2000; checked against what KiCad 9 writes
and reads.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import shapely
from shapely import Geometry

from designer.base.guarded_reading import read_bytes, reading
from designer.base.version import __version__
from designer.board.kicad_reader import TRACKS, BoardFile, PlacedPad
from designer.board.kicad_rules import CustomRule
from designer.board.net_classes import DEFAULT, VIA
from designer.board.net_codes import names_nets, with_codes, without_codes
from designer.board.sexpr import (
    Expression,
    expression,
    expression_text,
    lists,
    read,
    word,
)
from designer.circuit.netlist import Circuit
from designer.routing.board_copper import (
    LAYERS,
    BoardCopper,
    layers_of,
    read_copper,
    track_item,
    track_path,
    via_item,
    zone_layers,
)
from designer.routing.net_kinds import NetKind, kinds_of_nets, net_kinds

UM = 1000.0
"""Micrometres of a millimetre."""
PADSTACK = f"via_{VIA['via_diameter'] * UM:g}_{VIA['via_drill'] * UM:g}"
"""Name of the one kind of via: its diameter and its hole."""
LARGEST = 30_000_000
"""Bytes of a session."""
EXPECTED = "a session of a router (.ses)"
UNITS = {"um": 1e-3, "mm": 1.0, "cm": 10.0, "mil": 0.0254, "inch": 25.4}
"""Millimetres of a unit of length."""
Point = tuple[float, float]
_Stack = tuple[tuple[Point, ...], tuple[str, ...]]
"""Corners [um] and layers of a pad."""


@dataclass(frozen=True)
class _Pin:
    """A pad of a component, as a router has to reach it."""

    component: str
    number: str
    pad: PlacedPad
    net: str
    layers: tuple[str, ...]

    @property
    def name(self) -> str:
        return f"{self.component}-{self.number}"

    @property
    def shape(self) -> tuple[Point, ...]:
        """Corners about its place [um]."""
        x, y = self.pad.at
        return tuple((round((a - x) * UM, 3), round((y - b) * UM, 3)) for a, b in self.pad.corners)


def design_text(board: BoardFile, name: str, circuit: Circuit, rules: Sequence[CustomRule]) -> str:
    """A ``.dsn`` of a board of a circuit.

    name : of the board. rules : the board's, whose widths and clearances hold.

    Raises
    ------
    InputError : the board has no closed edge, several separate ones, or a pad of a shape that is
        not read.
    """
    source = with_codes(read(board.text, board.path))
    copper = read_copper(source)
    if (outlines := len(shapely.get_parts(copper.area))) != 1:
        raise source.error(f"{outlines} separate outlines", "one, which Specctra's format has")
    kinds, of = net_kinds(rules), kinds_of_nets(circuit, copper.nets)
    pins = list(_pins(board, source, copper.names))
    padstacks = {
        key: f"pad_{k}" for k, key in enumerate(dict.fromkeys((p.shape, p.layers) for p in pins))
    }
    tree = expression(
        "pcb",
        name,
        expression("parser", word("QUOTE"), *lists(host_cad="designer", host_version=__version__)),
        expression("resolution", word("um"), 10),
        expression("unit", word("um")),
        expression("structure", *_structure(source, copper, kinds)),
        expression("placement", *_placement(pins)),
        expression("library", *_library(pins, padstacks, copper.names)),
        expression("network", *_network(pins, copper.nets, of, kinds)),
        expression("wiring", *_wiring(source, copper.nets)),
    )
    # The one place of the format that is no expression.
    return expression_text(tree).replace("QUOTE", '(string_quote ")', 1)


def with_session(text: str, session: Path) -> str:
    """A board with the tracks and vias of a session, in the place of all that it has.

    text : of the ``.kicad_pcb``; the new one is given back. Pours stay.

    Raises
    ------
    InputError : no session, or one of another board: it has nets or layers that this has not.
    """
    whole = read(text)
    board = with_codes(whole)
    numbers = {net.text(1): int(net.number(0)) for net in board.all("net")}
    content = read_bytes(session, f"{EXPECTED}, up to {LARGEST} bytes", "--session", LARGEST)
    with reading(session, EXPECTED, "--session"):
        routes = read(content.decode("utf-8"), session)
    with reading(session, EXPECTED):
        if routes.name != "session":
            raise routes.error("no session", EXPECTED)
        items = list(_routed(routes.get("routes"), numbers))
    gone = (*TRACKS, "via")
    rest = [i for i in board.items if not (isinstance(i, Expression) and i.name in gone)]
    routed = Expression((*rest, *items), board.source)
    return expression_text(without_codes(routed) if names_nets(whole) else routed)


def _pins(board: BoardFile, source: Expression, names: Sequence[str]) -> Iterator[_Pin]:
    """Of pads of one number the second is "2@1", the third "2@2", as KiCad writes them."""
    for placed, item in zip(board.footprints, source.all("footprint"), strict=True):
        earlier: Counter[str] = Counter()
        for pad, own in zip(placed.pads, item.all("pad"), strict=True):
            net = own.find("net")
            front, back = layers_of(own.get("layers").atoms)
            outer = (*names[:1][:front], *names[-1:][:back])
            layers = tuple(names) if front and back else outer
            if pad.number and layers:
                again = earlier[pad.number]
                number = f"{pad.number}@{again}" if again else pad.number
                name = "" if net is None else net.text(1)
                yield _Pin(placed.reference, number, pad, name, layers)
                earlier[pad.number] += 1


def _structure(
    source: Expression, copper: BoardCopper, kinds: Sequence[NetKind]
) -> Iterator[Expression]:
    for layer in copper.names:
        kind = "power" if layer in copper.inner else "signal"
        yield expression("layer", word(layer), expression("type", word(kind)))
    yield from _planes(source, copper)
    yield expression("boundary", _path("pcb", 0.0, _corners(copper.area)))
    for hole in shapely.get_parts(copper.area):
        for ring in hole.interiors:
            yield from _keepouts(shapely.Polygon(ring), copper.names)
    for piece in copper.pieces:
        if piece.pad and not piece.relief and not piece.net:  # a bare hole
            yield from _keepouts(piece.shape, copper.names)
    yield expression("via", word(PADSTACK))
    yield _rule(next(kind for kind in kinds if kind.name == DEFAULT))


def _planes(source: Expression, copper: BoardCopper) -> Iterator[Expression]:
    """The zones of the inner layers: what a via of their net reaches. Pours of the sides are made
    anew, so another router is not told of them."""
    for zone in source.all("zone"):
        places = [(p.number(0), p.number(1)) for p in zone.get("polygon").get("pts").all("xy")]
        for layer in (name for name in copper.inner if name in zone_layers(zone)):
            net = copper.nets[int(zone.get("net").number())]
            yield expression("plane", net, _polygon(layer, [_um(place) for place in places]))


def _keepouts(shape: Geometry, names: Sequence[str]) -> Iterator[Expression]:
    for layer in names:
        yield expression("keepout", "", _polygon(layer, _corners(shape)))


def _placement(pins: Iterable[_Pin]) -> Iterator[Expression]:
    """Every component is an image of its own, so that nothing is turned; its pins are placed."""
    for component in dict.fromkeys(pin.component for pin in pins):
        place = expression("place", component, 0, 0, word("front"), 0)
        yield expression("component", component, place)


def _library(
    pins: Sequence[_Pin], padstacks: Mapping[_Stack, str], layers: Sequence[str]
) -> Iterator[Expression]:
    own: dict[str, list[_Pin]] = defaultdict(list)
    for pin in pins:
        own[pin.component].append(pin)
    for component, its in own.items():
        yield expression(
            "image",
            component,
            *(
                expression(
                    "pin",
                    word(padstacks[(pin.shape, pin.layers)]),
                    pin.number,
                    *_um(pin.pad.at),
                )
                for pin in its
            ),
        )
    shapes = {padstacks[(pin.shape, pin.layers)]: pin for pin in pins}
    for name, pin in shapes.items():
        outlines = (expression("shape", _polygon(layer, pin.shape)) for layer in pin.layers)
        yield expression("padstack", word(name), *outlines, expression("attach", word("off")))
    circles = (
        expression("shape", expression("circle", word(layer), VIA["via_diameter"] * UM))
        for layer in layers
    )
    yield expression("padstack", word(PADSTACK), *circles, expression("attach", word("off")))


def _network(
    pins: Iterable[_Pin], nets: Mapping[int, str], of: Mapping[int, str], kinds: Sequence[NetKind]
) -> Iterator[Expression]:
    own: dict[str, list[str]] = defaultdict(list)
    for pin in pins:
        if pin.net:
            own[pin.net].append(pin.name)
    for net, names in own.items():
        yield expression("net", net, expression("pins", *map(word, names)))
    for kind in kinds:
        members = [nets[n] for n, name in of.items() if name == kind.name and nets[n] in own]
        via = expression("circuit", expression("use_via", word(PADSTACK)))
        yield expression("class", kind.name, *members, via, _rule(kind))


def _wiring(board: Expression, nets: Mapping[int, str]) -> Iterator[Expression]:
    """Tracks and vias that are there; a router may change them."""
    kind = expression("type", word("route"))
    for name in TRACKS:
        for item in board.all(name):
            width, layer = item.get("width").number() * UM, item.get("layer").text()
            path = _path(layer, width, [_um(point) for point in track_path(item)])
            yield expression("wire", path, _net(item, nets), kind)
    for item in board.all("via"):
        at = item.get("at")
        place = _um((at.number(0), at.number(1)))
        yield expression("via", word(PADSTACK), *place, _net(item, nets), kind)


def _net(item: Expression, nets: Mapping[int, str]) -> Expression:
    return expression("net", nets[int(item.get("net").number())])


def _rule(kind: NetKind) -> Expression:
    return expression("rule", *lists(width=2.0 * kind.half * UM, clearance=kind.clearance * UM))


def _um(point: Sequence[float]) -> Point:
    return point[0] * UM, -point[1] * UM


def _corners(shape: Geometry) -> list[Point]:
    """The corners of an area's border [um]."""
    return [_um(corner) for corner in shapely.get_coordinates(shapely.get_exterior_ring(shape))]


def _path(layer: str, width: float, corners: Sequence[Point]) -> Expression:
    return expression("path", word(layer), width, *(value for c in corners for value in c))


def _polygon(layer: str, corners: Sequence[Point]) -> Expression:
    return expression("polygon", word(layer), 0, *(value for c in corners for value in c))


def _routed(routes: Expression, numbers: Mapping[str, int]) -> Iterator[Expression]:
    """Tracks and vias of a session, as items of a board."""
    resolution = routes.get("resolution")
    if resolution.text(0) not in UNITS or not resolution.number(1) > 0.0:
        raise resolution.error(" ".join(resolution.atoms), f"one of {', '.join(UNITS)}, a number")
    scale = UNITS[resolution.text(0)] / resolution.number(1)
    for net in routes.get("network_out").all("net"):
        name = net.text(0)
        if name not in numbers:
            raise net.error(f"net {name}", "nets of this board alone")
        for wire in net.all("wire"):
            yield from _segments(wire.get("path"), numbers[name], name, scale)
        for via in net.all("via"):
            at = via.number(1) * scale, -via.number(2) * scale
            yield via_item(at, numbers[name], name, "session via")


def _segments(path: Expression, net: int, name: str, scale: float) -> Iterator[Expression]:
    layer, values = path.text(0), [path.number(k) * scale for k in range(1, len(path.atoms))]
    if layer not in LAYERS:
        raise path.error(f"layer {layer}", f"one of {', '.join(LAYERS)}")
    width, places = values[0], values[1:]
    if not width > 0.0 or len(places) < 4 or len(places) % 2:
        raise path.error(f"{len(places)} numbers after the width", "two or more places")
    points = [(x, -y) for x, y in zip(places[::2], places[1::2], strict=True)]
    for start, end in pairwise(points):
        if start != end:
            yield track_item(start, end, width, layer, net, name, "session")
