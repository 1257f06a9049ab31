"""The copper of a board file as shapes, and the board's edge. Millimetres, y downwards."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from shapely import Geometry

from designer.base.arrays import Array
from designer.board.kicad_board import layers
from designer.board.kicad_names import identifier
from designer.board.kicad_reader import TRACKS, pad_corners, turned
from designer.board.net_classes import VIA
from designer.board.outline import pen_path, read_outline
from designer.board.sexpr import Expression, expression, expression_text, read, word

FRONT, BACK = "F.Cu", "B.Cu"
LAYERS = (FRONT, BACK)
"""The layers that tracks are laid on."""
ALL = "*.Cu"
"""KiCad's name of every copper layer."""
CHORDS = 8
"""Chords of a quarter of a circle."""
MOST_MEETINGS = 10_000
"""Pairs of pieces of an edge that meet, beyond those that follow each other: a drawing of lines
that cross has as many faces, and an edge has none."""
PIECES_AT_ONCE = 16
SCREW_ROOM = 0.3
"""Round a bare hole, more than the clearance of copper [mm]."""
NO_NET = 0
"""KiCad's number of what is on no net."""
Point = tuple[float, float]


@dataclass(frozen=True)
class Copper:
    """A piece of copper, or a hole, that is there before anything is routed."""

    shape: Geometry
    """Its area [mm]."""
    net: int
    """KiCad's number of its net."""
    layers: tuple[bool, bool]
    """Whether it is on the front, on the back."""
    pad: bool = True
    """Whether no via may be in it: a pad, a hole or a via."""
    relief: bool = False
    """Whether a pour leaves a thermal relief round it: a pad that is soldered."""
    inner: frozenset[str] = frozenset()
    """The inner layers that it is on."""

    def on(self, layer: str) -> bool:
        """Whether it is on the layer of this name."""
        return layer in self.inner or any(
            there and layer == name for name, there in zip(LAYERS, self.layers, strict=True)
        )

    @property
    def through(self) -> bool:
        """Whether it joins both sides, and the planes between them."""
        return all(self.layers)


@dataclass(frozen=True)
class BoardCopper:
    """What a router has to know of a board file."""

    pieces: tuple[Copper, ...]
    """Pads, tracks, vias, holes."""
    nets: Mapping[int, str]
    """KiCad's names of the nets by their number."""
    edge: Geometry
    """The board's edge as lines."""
    area: Geometry
    """What the outermost edge encloses, less the cut-outs."""
    inner: tuple[str, ...] = ()
    """The inner copper layers, from the front."""
    planes: tuple[str, ...] = ()
    """Those of them that no zone is on: planes of ground lie there, which every via reaches."""
    file: Path | None = None
    """The board's file, for messages."""

    @property
    def names(self) -> tuple[str, ...]:
        """All copper layers, from the front."""
        return FRONT, *self.inner, BACK


def grown(shape: Geometry, by: float) -> Geometry:
    """A shape with a border [mm] round it, or without one where ``by`` is below 0."""
    wider: Geometry = shapely.buffer(shape, by, quad_segs=CHORDS)
    return wider


def read_copper(board: Expression) -> BoardCopper:
    """Everything on the copper layers of a ``kicad_pcb``, but for zones.

    Raises
    ------
    InputError : the board has no closed edge, or one that crosses itself again and again, or
        something is not as KiCad 9 writes it.
    """
    outline = read_outline(board)
    if not len(outline.sides) or outline.open_at is not None:
        raise board.error("no closed edge", "a closed line on Edge.Cuts")
    lines = shapely.linestrings(outline.sides)
    _check_meetings(board, lines)
    edge = shapely.multilinestrings([lines])[0]
    inner = inner_layers(board)
    pieces = [piece for each in board.all("footprint") for piece in _pads(each, inner)]
    pieces += [_track(each, inner) for kind in TRACKS for each in board.all(kind)]
    pieces += [_via(each, inner) for each in board.all("via")]
    zones = {name for each in board.all("zone") for name in zone_layers(each)}
    return BoardCopper(
        tuple(pieces),
        {int(net.number(0)): net.text(1) for net in board.all("net")},
        edge,
        _enclosed(edge),
        inner,
        tuple(name for name in inner if not zones & {name, ALL}),
        board.source.file,
    )


def inner_layers(board: Expression) -> tuple[str, ...]:
    """The copper layers between front and back, from the front."""
    listed = board.find("layers")
    names = [each.text(0) for each in listed.children] if listed is not None else []
    return tuple(name for name in names if name.endswith(".Cu") and name not in LAYERS)


def zone_layers(zone: Expression) -> frozenset[str]:
    """The names of layers that a zone states, such as ``*.Cu``."""
    stated = (*zone.all("layer"), *zone.all("layers"))
    return frozenset(name for each in stated for name in each.atoms)


def _enclosed(edge: Geometry) -> Geometry:
    """The faces of a drawing of lines, alternately board and cut-out from the outside: those that
    lie within an odd number of the faces' outer rings."""
    faces = shapely.get_parts(shapely.polygonize([shapely.unary_union(edge)]))
    rings = shapely.STRtree(shapely.polygons(shapely.get_exterior_ring(faces)))
    inner, _ = rings.query(shapely.point_on_surface(faces), predicate="within")
    within = np.bincount(inner, minlength=len(faces))
    area: Geometry = shapely.unary_union(faces[within % 2 == 1])
    return area


def _check_meetings(board: Expression, lines: Array) -> None:
    """InputError for an edge whose pieces meet more often than ``MOST_MEETINGS``, found a few
    pieces at a time."""
    tree, left = shapely.STRtree(lines), MOST_MEETINGS
    for start in range(0, len(lines), PIECES_AT_ONCE):
        some = lines[start : start + PIECES_AT_ONCE]
        # Each meets itself and its two neighbours.
        left -= tree.query(some, predicate="intersects").shape[1] - 3 * len(some)
        if left < 0:
            found = f"an edge whose pieces meet in more than {MOST_MEETINGS} places"
            raise board.error(found, "a closed line on Edge.Cuts that does not cross itself")


def _pads(footprint: Expression, inner: Sequence[str]) -> Iterator[Copper]:
    at = footprint.get("at")
    turn = math.radians(at.number(2) if len(at.atoms) > 2 else 0.0)
    for pad in footprint.all("pad"):
        own = pad.get("at")
        place = turned((own.number(0), own.number(1)), (at.number(0), at.number(1)), turn)
        angle = math.radians(own.number(2) if len(own.atoms) > 2 else 0.0)
        net = pad.find("net")
        number = NO_NET if net is None else int(net.number(0))
        names, shape = pad.get("layers").atoms, _pad_shape(pad, place, angle)
        own_room = pad.find("clearance")
        if own_room is not None and number == NO_NET:  # a mark that nothing comes near
            shape = grown(shape, own_room.number())
        if pad.text(1) == "np_thru_hole":
            bare = grown(shape, SCREW_ROOM)
            yield Copper(bare, NO_NET, (True, True), inner=frozenset(inner))
        else:
            yield Copper(
                shape, number, layers_of(names), relief=True, inner=_inner_of(names, inner)
            )


def _pad_shape(pad: Expression, place: tuple[float, float], angle: float) -> Geometry:
    if pad.text(2) == "circle":
        return grown(shapely.Point(place), pad.get("size").number() / 2.0)
    corners = pad_corners(pad, place, angle)
    if not corners:
        raise pad.error("a shape that is not read", "a circle, a rectangle, an oval or a polygon")
    return shapely.Polygon(corners)


def layers_of(names: Iterable[str]) -> tuple[bool, bool]:
    there = set(names)
    both = ALL in there or "F&B.Cu" in there
    return both or FRONT in there, both or BACK in there


def _inner_of(names: Iterable[str], inner: Sequence[str]) -> frozenset[str]:
    there = set(names)
    return frozenset(inner if ALL in there else there & set(inner))


def track_path(item: Expression) -> list[Point]:
    """The middle of a track as straight pieces; an arc's are chords."""
    drawn = {"segment": "gr_line", "arc": "gr_arc"}[item.name]
    return pen_path(Expression((word(drawn), *item.items[1:]), item.source, item.offset))


def _track(item: Expression, inner: Sequence[str]) -> Copper:
    shape = grown(shapely.LineString(track_path(item)), item.get("width").number() / 2.0)
    net, names = int(item.get("net").number()), item.get("layer").atoms
    return Copper(shape, net, layers_of(names), pad=False, inner=_inner_of(names, inner))


def _via(item: Expression, inner: Sequence[str]) -> Copper:
    at = item.get("at")
    shape = grown(shapely.Point(at.number(0), at.number(1)), item.get("size").number() / 2.0)
    return Copper(shape, int(item.get("net").number()), (True, True), inner=frozenset(inner))


def track_item(
    start: Point, end: Point, width: float, layer: str, net: int, name: str, key: str
) -> Expression:
    """A straight track of a board file.

    net, name : KiCad's number and name of its net. key : of its id, so that what one writer laid
    has other ids than what another did.
    """
    return expression(
        "segment",
        start=start,
        end=end,
        width=width,
        layer=layer,
        net=net,
        uuid=identifier(key, name, layer, f"{start} {end}"),
    )


def via_item(at: Point, net: int, name: str, key: str) -> Expression:
    """A via of a board file, of the project's size; net, name and key as in ``track_item``."""
    return expression(
        "via",
        at=at,
        size=VIA["via_diameter"],
        drill=VIA["via_drill"],
        layers=LAYERS,
        net=net,
        uuid=identifier(key, name, f"{at}"),
    )


INNER = {2: (), 4: ((4, "In1.Cu", "power"), (6, "In2.Cu", "power"))}
"""Inner layers by the number of copper layers, as KiCad 9 numbers them."""


def layer_count(text: str) -> int:
    """How many copper layers a ``.kicad_pcb`` has."""
    return 2 + len(inner_layers(read(text)))


def with_layers(text: str, count: int) -> str:
    """A board of another number of copper layers, 2 or 4, without tracks, vias and zones.

    text : of the ``.kicad_pcb``; the new one is given back.
    """
    board = read(text)
    listed, inner = board.get("layers"), inner_layers(board)
    outer = [each for each in listed.children if each.text(0) not in inner]
    at = 1 + next(i for i, each in enumerate(outer) if each.text(0) == FRONT)
    new = Expression((listed.items[0], *outer[:at], *layers(INNER[count]), *outer[at:]))
    gone = (*TRACKS, "via", "zone")
    items = [i for i in board.items if not (isinstance(i, Expression) and i.name in gone)]
    return expression_text(Expression(tuple(new if i is listed else i for i in items)))
