"""What stands on the sheet of KiCad: symbols, wires, names of nets, texts.

Units of ``GRID``, x to the right and y downwards.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Literal

from designer.board.kicad_items import Item
from designer.board.kicad_names import POWER
from designer.board.kicad_symbols import GRID, REACH, TEXT, ShapePin, power

Point = tuple[int, int]
Wire = tuple[Point, Point]
TextKind = Literal["title", "role", "line"]
SIZES: Mapping[TextKind, float] = {"title": 1.8, "role": 0.9, "line": TEXT}
"""Heights of the letters of each kind of text [mm]."""
_TURNS = {0: (1, 0), 90: (0, 1), 180: (-1, 0), 270: (0, -1)}
_WIDTHS = {
    **dict.fromkeys("iIlj.,:;'|!", 0.6),
    **dict.fromkeys("ft()[] r", 0.8),
    **dict.fromkeys("-+=", 1.3),
    **dict.fromkeys("mMwWΩµ@", 1.5),
}


@dataclass(frozen=True)
class Placed:
    """A unit of a symbol on the sheet."""

    item: Item
    """The item whose symbol it is."""
    unit: int
    x: int
    """Place to the right, in units of the grid."""
    y: int
    """Place downwards, in units of the grid."""
    angle: int = 0
    """How far it is turned to the left [degrees], a multiple of 90."""

    @property
    def pins(self) -> tuple[ShapePin, ...]:
        """The pins of this unit."""
        return self.item.shape.units[self.unit - 1].pins

    @property
    def upright(self) -> bool:
        """Whether a part of two pins stands on end."""
        return self.angle in (90, 270)

    def point(self, number: str) -> Point:
        """Where a pin is."""
        _, pin = self.item.shape.pin(number)
        across, up = _TURNS[self.angle]
        return self.x + pin.x * across - pin.y * up, self.y - pin.x * up - pin.y * across

    def names_at(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """The middles of reference and value: in one line above a part of two pins, in two lines
        beside one that stands on end, and where the symbol says for any other."""
        (_, height), _ = texts = self.item.shape.texts
        first, second = text_width(self.item.reference), text_width(self.item.value)
        if not _in_a_row(self.item):
            (rx, ry), (vx, vy) = texts
            if self.item.shape.prefix == "TP":  # beside the ring
                rx = 1.0 + first / 2
            return (self.x + rx, self.y - ry), (self.x + vx, self.y - vy)
        if self.upright:
            left = self.x + side_of(self.item)
            return (left + first / 2, self.y - 0.9), (left + second / 2, self.y + 0.9)
        left = self.x - (first + second + 1.0) / 2
        y = self.y - height
        return (left + first / 2, y), (left + first + 1.0 + second / 2, y)


@dataclass(frozen=True)
class NetLabel:
    """A net's name on the sheet."""

    net: str
    at: Point
    left: bool
    """Whether it is written to the left of it."""


@dataclass(frozen=True)
class Note:
    """A text on the sheet."""

    text: str
    """The text, its lines parted by a line feed."""
    at: tuple[float, float]
    """Middle of the upper edge of a role, left lower corner of another text."""
    owner: str
    """What it belongs to; with the kind, it is there once."""
    kind: TextKind = "role"
    left: bool = False
    """Whether a role begins at its point, instead of lying on both sides of it."""


@dataclass(frozen=True)
class Inlet:
    """The end of a wire that is to be joined or named."""

    net: str
    """Net of the wire."""
    at: Point
    """Its end."""
    owner: str
    """Name that a power symbol there has."""


@dataclass
class SheetCell:
    """What stands together; its level is the height of the signal's way in."""

    title: str
    symbols: list[Placed] = field(default_factory=list)
    wires: list[Wire] = field(default_factory=list)
    """Wires, horizontal or vertical, from point to point."""
    labels: list[NetLabel] = field(default_factory=list)
    notes: list[Note] = field(default_factory=list)
    open_pins: list[Point] = field(default_factory=list)
    """Points of the pins that nothing is connected to."""
    inlets: list[Inlet] = field(default_factory=list)
    """Ends on the left that a wire or a name is wanted at."""
    outlet: Inlet | None = None
    """Where the wire of what it makes ends on the right; None where it makes nothing."""
    left: int = 0
    right: int = 0
    top: int = 0
    """Its upper edge."""
    bottom: int = 0
    """Its lower edge."""

    def moved(self, x: int, y: int) -> SheetCell:
        """The cell elsewhere."""

        def at(point: Point) -> Point:
            return point[0] + x, point[1] + y

        return SheetCell(
            self.title,
            [replace(s, x=s.x + x, y=s.y + y) for s in self.symbols],
            [(at(a), at(b)) for a, b in self.wires],
            [replace(each, at=at(each.at)) for each in self.labels],
            [replace(n, at=(n.at[0] + x, n.at[1] + y)) for n in self.notes],
            [at(p) for p in self.open_pins],
            [replace(each, at=at(each.at)) for each in self.inlets],
            None if self.outlet is None else replace(self.outlet, at=at(self.outlet.at)),
            self.left + x,
            self.right + x,
            self.top + y,
            self.bottom + y,
        )

    def titled(self, top: int) -> SheetCell:
        """The cell with its title below this height."""
        note = Note(self.title, (self.left, top + 2), self.title, "title")
        return replace(self, notes=[*self.notes, note], top=top)

    def end(self, net: str, at: Point, owner: str, *, left: bool) -> None:
        """The end of a wire: a power symbol, a label, or a mark that nothing is there."""
        if not net:
            self.open_pins.append(at)
        elif net in POWER:
            name = POWER[net]
            item = Item(f"#PWR_{owner}", name, power(name), {"1": net})
            self.symbols.append(Placed(item, 1, *at))
        else:
            self.labels.append(NetLabel(net, at, left))

    def wire(self, *points: Point) -> None:
        """A wire through these points; those that coincide take none."""
        self.wires += [(a, b) for a, b in pairwise(points) if a != b]

    def pin_end(self, placed: Placed, number: str, to: Point) -> None:
        """A wire from a pin to a point, and what stands there."""
        self.wire(placed.point(number), to)
        left = to[0] <= placed.point(number)[0]
        net = placed.item.pins[number]
        self.end(net, to, f"{placed.item.reference}_{number}", left=left)


@dataclass(frozen=True)
class Sheet:
    """The whole drawing."""

    paper: str | tuple[str, float, float]
    """Size of the paper: one of ``PAPERS``, or "User" with width and height [mm]."""
    cells: tuple[SheetCell, ...]
    """The cells, at their places."""

    @property
    def symbols(self) -> tuple[Placed, ...]:
        return tuple(s for cell in self.cells for s in cell.symbols)

    @property
    def labels(self) -> tuple[NetLabel, ...]:
        return tuple(s for cell in self.cells for s in cell.labels)

    @property
    def segments(self) -> tuple[Wire, ...]:
        """The wires, cut wherever another wire, a pin or a label meets them."""
        pins = {s.point(p.number) for s in self.symbols for p in s.pins}
        stops = pins | {label.at for label in self.labels}
        wires = {wire for cell in self.cells for wire in cell.wires}
        stops |= {end for wire in wires for end in wire}
        out: set[Wire] = set()
        for a, b in wires:
            on = sorted(p for p in stops if _on(p, a, b))
            out |= set(pairwise(on))
        return tuple(sorted(out))

    @property
    def junctions(self) -> tuple[Point, ...]:
        """Points at which three wires or more meet, pins counted."""
        meeting: dict[Point, int] = {}
        for segment in self.segments:
            for end in segment:
                meeting[end] = meeting.get(end, 0) + 1
        for s in self.symbols:
            for pin in s.pins:
                at = s.point(pin.number)
                meeting[at] = meeting.get(at, 0) + 1
        return tuple(sorted(p for p, n in meeting.items() if n > 2))


def text_width(text: str, size: float = TEXT) -> float:
    """Width of a line of text, in units of the grid, no less than KiCad's.

    size : height of a letter [mm].
    """
    letters = sum(_WIDTHS.get(ch, 1.1 if ch.isupper() else 0.96) for ch in text)
    return (letters + 0.25) * size / GRID


def label_width(net: str) -> int:
    """Room [grid] that the name of a net takes beside its point; a power symbol takes less."""
    return math.ceil(text_width(net)) if net not in POWER else 2


def side_of(item: Item) -> float:
    """How far beside a part that stands on end its texts begin: past its open pins."""
    return 2.0 if len(item.shape.units[0].pins) == 2 else 5.0


def turned(item: Item, net: str, at: Point, angles: Sequence[int]) -> Placed:
    """A part of two pins, turned by the first of these angles that puts a pin of this net last: to
    the right of a part that lies, below one that stands."""
    for angle in angles:
        placed = Placed(item, 1, *at, angle)
        x, y = at
        last = (x + REACH, y) if angle in (0, 180) else (x, y + REACH)
        if any(placed.point(n) == last for n, other in item.pins.items() if other == net):
            return placed
    raise ValueError(f"{item.reference} has no pin at {net}")


def _in_a_row(item: Item) -> bool:
    """Whether a symbol is one of two pins in a row."""
    shape = item.shape
    xs = [pin.x for pin in shape.units[0].pins]
    return len(shape.units) == 1 and -REACH in xs and REACH in xs and not shape.numbers


def _on(p: Point, a: Point, b: Point) -> bool:
    """Whether a point is on a wire, its ends included."""
    (x, y), (xa, ya), (xb, yb) = p, a, b
    if xa == xb:
        return x == xa and min(ya, yb) <= y <= max(ya, yb)
    return y == ya and min(xa, xb) <= x <= max(xa, xb)
