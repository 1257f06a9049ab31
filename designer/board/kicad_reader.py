"""A KiCad board as the rules read it: what stands where, what is on which net, what is routed.

A board file is foreign input: what is not as KiCad 9 or 10 writes it is refused with its place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from designer.base.errors import InputError
from designer.base.guarded_reading import read_bytes, reading
from designer.base.natural_sort import natural_key
from designer.base.views import View
from designer.board.component import Component
from designer.board.kicad_names import circuit_net
from designer.board.net_codes import with_codes
from designer.board.outline import Outline, circle, pen_path, read_outline
from designer.board.sexpr import Expression, read

OLDEST, NEWEST = 20221018, 20260206
"""Versions of board files that are read: KiCad 7 to 10."""
LARGEST = 30_000_000
"""Bytes of a board file; one of 60 parts, routed and with its pours, has 830,000."""
MOST_LAID, MOST_CORNERS = 20_000, 3000
"""Tracks and vias of a board; and corners of its zones' outlines. KiCad's check of so many takes 25
s, where the outline crosses itself at random too."""
SHOWN = 5
"""Differences that a message lists."""
COURTYARDS = ("F.CrtYd", "B.CrtYd")
TRACKS = ("segment", "arc")
WITHIN_SIZE = frozenset({"rect", "roundrect", "oval"})
"""Shapes of pads that fill ``size``, but for their corners."""
EXCLUDED = {"exclude_from_pos_files": "the position file", "exclude_from_bom": "the bill"}
"""KiCad's marks of a footprint that a file leaves out, and that file."""
PART_NUMBER = "MPN"
"""The field that has a part's number, on the sheet and on the board."""
EXPECTED = "a board of KiCad 7 to 10 (.kicad_pcb)"
Point = tuple[float, float]


@dataclass(frozen=True)
class PlacedPad:
    """A pad as it stands on a board."""

    number: str
    net: str
    """The circuit's name of its net, "" where none is connected."""
    at: Point
    """Place on the board [mm]."""
    corners: tuple[Point, ...]
    """Corners of the copper, or of the rectangle around it, in order [mm]; a circle's are many, and
    a shape that is not read has none."""
    hole: float
    """Diameter of its hole, or width of its slot [mm]; 0 on the surface."""
    bottom: bool
    """Whether its copper is on the lower side alone."""


@dataclass(frozen=True)
class PlacedFootprint:
    """A footprint as it stands on a board."""

    reference: str
    value: str
    pads: tuple[PlacedPad, ...]
    courtyard: bool
    """Whether the footprint has a courtyard."""
    library: str
    """Library of the footprint; "" where none is written."""
    name: str
    part_number: str | None
    """The field ``MPN``, None where there is none."""
    fitted: bool
    """Whether it is fitted; False where it is marked DNP."""
    excluded: frozenset[str] = frozenset()
    """Which of the marks ``EXCLUDED`` it has."""

    @property
    def wired(self) -> bool:
        """Whether any pad is on a net: a mounting hole's is not."""
        return any(pad.net for pad in self.pads)


@dataclass(frozen=True)
class BoardFile:
    """A board file, as it was read."""

    path: Path
    """The file that it was read from."""
    text: str
    footprints: tuple[PlacedFootprint, ...]
    tracks: tuple[str, ...]
    """Net of each piece of track."""
    vias: tuple[str, ...]
    """Net of each via."""
    zones: tuple[str, ...]
    """Net of each zone."""
    outline: Outline
    """The board's edge."""

    def footprint(self, reference: str) -> PlacedFootprint | None:
        """The footprint of one component."""
        return next((f for f in self.footprints if f.reference == reference), None)

    def pads(self, reference: str) -> tuple[PlacedPad, ...]:
        """Pads of one component."""
        footprint = self.footprint(reference)
        return () if footprint is None else footprint.pads

    @property
    def copper(self) -> bool:
        """Whether anything is routed: a track, a via or a zone."""
        return bool(self.tracks or self.vias or self.zones)

    @property
    def routed(self) -> frozenset[str]:
        """Nets that have a track, a via or a zone."""
        return frozenset([*self.tracks, *self.vias, *self.zones])


def read_board(path: Path) -> BoardFile:
    """Read a ``.kicad_pcb``.

    Raises
    ------
    InputError : it cannot be read, is cut off, is no board, or is newer than KiCad 10.
    """
    content = read_bytes(path, f"{EXPECTED}, up to {LARGEST} bytes", "--board", LARGEST)
    with reading(path, EXPECTED, "--board"):
        text = content.decode("utf-8").replace("\r\n", "\n").replace("\r", "\n")
    with reading(path, EXPECTED):
        tree = read(text, path)
        if tree.name != "kicad_pcb":
            raise InputError(path, "--board", f"({tree.name[:40]} …)", EXPECTED)
        _check_version(tree)
        return _board(with_codes(tree), text, path)


def _board(board: Expression, text: str, path: Path) -> BoardFile:
    _check_size(board)
    names = {net.text(0): net.text(1) for net in board.all("net")}
    return BoardFile(
        path=path,
        text=text,
        footprints=tuple(_footprint(each) for each in board.all("footprint")),
        tracks=tuple(_net(each, names) for kind in TRACKS for each in board.all(kind)),
        vias=tuple(_net(each, names) for each in board.all("via")),
        zones=tuple(_net(each, names) for each in board.all("zone")),
        outline=read_outline(board),
    )


def check_belongs(board: BoardFile, components: Sequence[Component]) -> None:
    """Whether a board is one of these components on these nets.

    Footprints without any net, such as mounting holes, may be there besides. Whether the parts are
    the design's is for the rules on parts to say.

    Raises
    ------
    InputError : designators or nets differ; says which.
    """
    wanted = {c.reference: c for c in components if View.BOARD in c.views}
    there: dict[str, PlacedFootprint] = {}
    for footprint in board.footprints:
        if footprint.reference in there and footprint.reference in wanted:
            raise InputError(
                board.path, "footprints", f"{footprint.reference} twice", "each designator once"
            )
        there[footprint.reference] = footprint
    missing = sorted(wanted.keys() - there.keys(), key=natural_key)
    foreign = sorted((n for n in there.keys() - wanted.keys() if there[n].wired), key=natural_key)
    if missing or foreign:
        differences = [f"without {few(missing)}"] if missing else []
        differences += [f"with {few(foreign)}"] if foreign else []
        raise InputError(
            board.path,
            "footprints",
            "; ".join(differences),
            "the components of this design, all of them",
        )
    differ = []
    for reference, component in wanted.items():
        pads = {pad.number: pad.net for pad in there[reference].pads}
        for number, net in component.nets.items():
            if pads.get(number, "no such pad") != net:
                on = pads.get(number, "no such pad") or "no net"
                differ.append(f"{reference}.{number} on {on}, not on {net or 'no net'}")
    if differ:
        raise InputError(board.path, "nets", few(differ, "; "), "the nets of this design")


def few(words: Sequence[str], between: str = ", ") -> str:
    """The first words, and how many more there are."""
    more = len(words) - SHOWN
    return between.join(words[:SHOWN]) + (f" and {more} more" if more > 0 else "")


def _check_version(board: Expression) -> None:
    text = board.get("version").text()
    if not (text.isascii() and text.isdecimal() and len(text) <= 8):  # a date, YYYYMMDD
        raise board.get("version").error(text, "the number of a file version")
    version, file = int(text), board.source.file
    if version > NEWEST:
        expected = f"at most {NEWEST}, KiCad 10: this board is from a newer one"
        raise InputError(file, "version", text, expected)
    if version < OLDEST:
        expected = f"at least {OLDEST}, KiCad 7: save the board with KiCad 9"
        raise InputError(file, "version", text, expected)


def _check_size(board: Expression) -> None:
    """InputError for a board that geometry would take minutes for."""
    laid = sum(1 for each in board.children if each.name in (*TRACKS, "via"))
    if laid > MOST_LAID:
        raise board.error(f"{laid} tracks and vias", f"at most {MOST_LAID}")
    outlines = (area for zone in board.all("zone") for area in zone.all("polygon"))
    corners = sum(len(points.children) for area in outlines for points in area.all("pts"))
    if corners > MOST_CORNERS:
        found = f"zones whose outlines have {corners} corners"
        raise board.error(found, f"at most {MOST_CORNERS}")


def _footprint(item: Expression) -> PlacedFootprint:
    at = item.get("at")
    x, y = at.number(0), at.number(1)
    turn = math.radians(at.number(2) if len(at.atoms) > 2 else 0.0)
    library, _, name = item.text(0).rpartition(":")
    marks = frozenset(mark for each in item.all("attr") for mark in each.atoms)
    return PlacedFootprint(
        reference=_field(item, "Reference") or "",
        value=_field(item, "Value") or "",
        pads=tuple(_pad(pad, (x, y), turn) for pad in item.all("pad")),
        courtyard=any(
            layer.text() in COURTYARDS for each in item.children for layer in each.all("layer")
        ),
        library=library,
        name=name,
        part_number=_field(item, PART_NUMBER),
        fitted="dnp" not in marks,
        excluded=marks & EXCLUDED.keys(),
    )


def _field(item: Expression, name: str) -> str | None:
    for each in item.all("property"):
        if each.text(0) == name:
            return each.text(1)
    for each in item.all("fp_text"):  # KiCad 7
        if each.text(0) == name.lower():
            return each.text(1)
    return None


def _pad(item: Expression, origin: Point, turn: float) -> PlacedPad:
    at = item.get("at")
    place = turned((at.number(0), at.number(1)), origin, turn)
    net = item.find("net")
    layers = {layer for each in item.all("layers") for layer in each.atoms}
    return PlacedPad(
        item.text(0),
        circuit_net(net.text(1)) if net is not None and not _unconnected(net.text(1)) else "",
        place,
        pad_corners(item, place, math.radians(at.number(2) if len(at.atoms) > 2 else 0.0)),
        hole=min(drilled(item) or (0.0,)),
        bottom="B.Cu" in layers and "F.Cu" not in layers,
    )


def drilled(pad: Expression) -> tuple[float, float] | None:
    """Width and height of a pad's hole [mm]; None on the surface. Only a slot states two."""
    drill = pad.find("drill")
    if drill is None or not drill.atoms:
        return None
    first, last = int(drill.text() == "oval"), len(drill.atoms) - 1
    return drill.number(first), drill.number(max(first, last))


def _unconnected(net: str) -> bool:
    """KiCad gives a pin that is marked as not connected a net of its own."""
    return net.startswith("unconnected-(")


def _net(item: Expression, names: dict[str, str]) -> str:
    net = item.find("net")
    return "" if net is None else circuit_net(names.get(net.text(), ""))


def pad_corners(pad: Expression, at: Point, turn: float) -> tuple[Point, ...]:
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
        points = pen_path(each)
        if not points:
            return None
        width = each.find("width")
        half = 0.0 if width is None else width.number() / 2.0
        xs, ys = [p[0] for p in points], [p[1] for p in points]
        left, right = min(left, min(xs) - half), max(right, max(xs) + half)
        top, bottom = min(top, min(ys) - half), max(bottom, max(ys) + half)
    return left, top, right, bottom
