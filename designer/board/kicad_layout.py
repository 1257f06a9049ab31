"""Where things stand on the sheet: a cell for each op-amp section, parts in rows about it.

Units of ``GRID``, y downwards. A section's inputs come from the left to a bus, which is its summing
node, its feedback runs above it, its output leaves to the right. What touches no summing node
stands below, named at both ends. Cells fill the sheet column by column.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

from designer.base.natural_sort import natural_key
from designer.board.kicad_names import POWER
from designer.board.kicad_symbols import GRID, REACH, ShapePin, SymbolShape, power
from designer.circuit.stage_title import DEAD_ZONE, INTERFACE, REFERENCES, SUPPLY

Point = tuple[int, int]

PITCH = 6
"""Between rows."""
BUS, AMPLIFIER, RETURN, END = 18, 26, 34, 36
"""Columns of a cell: summing node, op-amp, the way back from its output, where the output ends."""
WIDTH = 50
"""Of a column of cells."""
GAP = 6
"""Between cells, for a title."""
PAPERS = {"A4": (297, 210), "A3": (420, 297), "A2": (594, 420), "A1": (841, 594), "A0": (1189, 841)}
"""Sizes [mm], landscape."""
MARGIN, TITLE_BLOCK = 16.0, 36.0
"""Millimetres that the frame takes on each side, and its title block at the bottom."""


@dataclass(frozen=True)
class Item:
    """Something with a symbol."""

    reference: str
    """Its designator."""
    value: str
    """The value that is shown."""
    shape: SymbolShape
    """Symbol that it is drawn with."""
    pins: Mapping[str, str]
    """Net by pin number, "" where none is."""
    stages: Mapping[int, str]
    """Stage of each unit, by its number; one stage of a part of one unit."""

    def ends(self) -> tuple[str, ...]:
        """Nets of its pins."""
        return tuple(self.pins.values())


@dataclass(frozen=True)
class Placed:
    """A unit of a symbol on the sheet."""

    item: Item
    """Whose symbol it is."""
    unit: int
    """Number of the unit."""
    x: int
    """Place to the right, in units of the grid."""
    y: int
    """Place downwards, in units of the grid."""
    angle: int = 0
    """How far it is turned [degrees]."""

    def point(self, number: str) -> Point:
        """Where a pin is."""
        _, pin = self.item.shape.pin(number)
        sign = -1 if self.angle == 180 else 1
        return self.x + sign * pin.x, self.y - sign * pin.y


@dataclass(frozen=True)
class NetLabel:
    """A net's name on the sheet."""

    net: str
    """Name of the net."""
    at: Point
    """The point that it names."""
    left: bool
    """Whether it is written to the left of it."""


@dataclass(frozen=True)
class Note:
    """A text on the sheet."""

    text: str
    """The text that is written."""
    at: Point
    """Where it stands."""
    heading: bool = False
    """Whether it is the title of a cell, which is larger."""


@dataclass
class LayoutCell:
    """What stands together."""

    title: str
    """Title of the cell."""
    symbols: list[Placed] = field(default_factory=list)
    """Units of symbols in the cell."""
    wires: list[tuple[Point, Point]] = field(default_factory=list)
    """Wires, horizontal or vertical, from point to point."""
    labels: list[NetLabel] = field(default_factory=list)
    """Names of nets in the cell."""
    notes: list[Note] = field(default_factory=list)
    """Texts of the cell."""
    open_pins: list[Point] = field(default_factory=list)
    """Points of the pins that nothing is connected to."""
    height: int = 0
    """Height, in units of the grid."""

    def moved(self, x: int, y: int) -> LayoutCell:
        """The cell elsewhere."""

        def at(point: Point) -> Point:
            return point[0] + x, point[1] + y

        return LayoutCell(
            self.title,
            [replace(s, x=s.x + x, y=s.y + y) for s in self.symbols],
            [(at(a), at(b)) for a, b in self.wires],
            [replace(each, at=at(each.at)) for each in self.labels],
            [replace(each, at=at(each.at)) for each in self.notes],
            [at(p) for p in self.open_pins],
            self.height,
        )

    def end(self, net: str, at: Point, owner: str, *, left: bool) -> None:
        """The end of a wire: a power symbol, a label, or a mark that nothing is there."""
        if not net:
            self.open_pins.append(at)
        elif net in POWER:
            name = POWER[net]
            item = Item(f"#PWR_{owner}", name, power(name), {"1": net}, {1: ""})
            self.symbols.append(Placed(item, 1, *at))
        else:
            self.labels.append(NetLabel(net, at, left))

    def wire(self, *points: Point) -> None:
        """A wire through these points; those that coincide take none."""
        self.wires += [(a, b) for a, b in pairwise(points) if a != b]


@dataclass(frozen=True)
class Sheet:
    """The whole drawing."""

    paper: str
    """Size of the paper, as in ``PAPERS``."""
    cells: tuple[LayoutCell, ...]
    """The cells, at their places."""

    @property
    def symbols(self) -> tuple[Placed, ...]:
        return tuple(s for cell in self.cells for s in cell.symbols)

    @property
    def labels(self) -> tuple[NetLabel, ...]:
        return tuple(s for cell in self.cells for s in cell.labels)

    @property
    def segments(self) -> tuple[tuple[Point, Point], ...]:
        """The wires, cut wherever another wire, a pin or a label meets them."""
        pins = {s.point(p.number) for s in self.symbols for p in _unit_pins(s)}
        stops = pins | {label.at for label in self.labels}
        wires = {wire for cell in self.cells for wire in cell.wires}
        stops |= {end for wire in wires for end in wire}
        out: set[tuple[Point, Point]] = set()
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
            for pin in _unit_pins(s):
                at = s.point(pin.number)
                meeting[at] = meeting.get(at, 0) + 1
        return tuple(sorted(p for p, n in meeting.items() if n > 2))


def arrange(items: Sequence[Item], last: LayoutCell) -> Sheet:
    """The sheet of these items; ``last`` is the cell that stands behind all others."""
    cells = [*_amplifiers(items), last]
    for paper, (width, height) in PAPERS.items():
        columns = int((width - 2 * MARGIN) / GRID) // WIDTH
        rows = int((height - 2 * MARGIN - TITLE_BLOCK) / GRID)
        placed = _pack(cells, columns, rows)
        if placed is not None:
            return Sheet(paper, placed)
    return Sheet("A0", _pack(cells, 18, 10**6) or ())


def flow(title: str, items: Iterable[Item], notes: Sequence[str] = ()) -> LayoutCell:
    """A cell of parts in rows, named at every end; the notes stand below them."""
    cell = LayoutCell(title)
    _rows(cell, list(items), 0)
    for i, text in enumerate(notes):
        cell.notes.append(Note(text, (0, cell.height + 2 * i + 2)))
    cell.height += 2 * len(notes) + 2
    return cell


def _amplifiers(items: Sequence[Item]) -> list[LayoutCell]:
    """A cell for each section in the order of the stages, then one for each other stage."""
    sections = [
        (item, unit, item.stages[unit])
        for item in items
        if item.shape.prefix == "U"
        for unit in range(1, len(item.shape.units) + 1)
        if unit in item.stages and len(item.shape.units[unit - 1].pins) == 3
    ]
    order = sorted({stage for item in items for stage in item.stages.values()}, key=_rank)
    sections.sort(key=lambda s: order.index(s[2]))
    free = [item for item in items if item.shape.prefix != "U"]
    cells: dict[str, list[LayoutCell]] = {}
    for item, unit, stage in sections:
        inverting, _, output = (item.pins[p.number] for p in item.shape.units[unit - 1].pins)
        near = [p for p in free if len(p.pins) == 2 and inverting in p.ends() and stage in _of(p)]
        free = [p for p in free if p not in near]
        back = [p for p in near if output in p.ends()]
        inputs = [p for p in near if p not in back]
        cells.setdefault(stage, []).append(_section(item, unit, stage, inputs, back))
    for stage in order:
        rest = [p for p in free if stage in _of(p)]
        units = [
            replace(item, stages={unit: stage})
            for item in items
            if item.shape.prefix == "U"
            for unit, s in item.stages.items()
            if s == stage and len(item.shape.units[unit - 1].pins) != 3
        ]
        if rest or units:
            cells.setdefault(stage, []).append(flow(stage, [*units, *rest]))
    return [cell for stage in order for cell in cells.get(stage, [])]


def _rank(stage: str) -> tuple[int, tuple[object, ...]]:
    """The way of the signal: integrators, inverters, dead zones, other amplifiers, the rest."""
    kinds = ("integrator", "inverter", DEAD_ZONE)
    last = (REFERENCES, INTERFACE, SUPPLY)
    place = next((i for i, kind in enumerate(kinds) if stage.startswith(kind)), len(kinds))
    if stage in last:
        place += 1 + last.index(stage)
    return place, natural_key(stage)


def _of(item: Item) -> tuple[str, ...]:
    return tuple(item.stages.values())


def _section(
    item: Item, unit: int, stage: str, inputs: Sequence[Item], back: Sequence[Item]
) -> LayoutCell:
    """One section with its inputs on the left and its feedback above."""
    cell = LayoutCell(f"{stage} ({item.reference}{chr(64 + unit)})")
    y = PITCH * len(back) + 3
    amplifier = Placed(item, unit, AMPLIFIER, y)
    cell.symbols.append(amplifier)
    minus, plus, out = (pin.number for pin in item.shape.units[unit - 1].pins)
    node, output = item.pins[minus], item.pins[out]
    at_minus, at_plus, at_out = (amplifier.point(n) for n in (minus, plus, out))
    cell.end(item.pins[plus], at_plus, f"{item.reference}_{plus}", left=True)
    cell.wire((BUS, at_minus[1]), at_minus)
    cell.wire(at_out, (END, at_out[1]))
    cell.end(output, (END, at_out[1]), f"{item.reference}_{out}", left=False)
    levels = [at_minus[1]]
    for i, part in enumerate(inputs):
        placed = _turned(part, node, (BUS - 5, PITCH * i))
        cell.symbols.append(placed)
        _far_end(cell, placed, node)
        cell.wire((BUS - 5 + REACH, PITCH * i), (BUS, PITCH * i))
        levels.append(PITCH * i)
    for i, part in enumerate(back):
        placed = _turned(part, output, (AMPLIFIER, PITCH * i))
        cell.symbols.append(placed)
        cell.wire((BUS, PITCH * i), (AMPLIFIER - REACH, PITCH * i))
        cell.wire((AMPLIFIER + REACH, PITCH * i), (RETURN, PITCH * i), (RETURN, at_out[1]))
        levels.append(PITCH * i)
    if node == output:  # a follower
        levels.append(y - 6)
        cell.wire((BUS, y - 6), (RETURN, y - 6), (RETURN, at_out[1]))
    elif node not in POWER:
        # Past the junction; above the bus where nothing leads on from there.
        position = (BUS + 1, 0) if back else (BUS, min(levels))
        cell.labels.append(NetLabel(node, position, left=False))
    cell.wire((BUS, min(levels)), (BUS, max(levels)))
    cell.height = max(PITCH * (len(inputs) - 1) + 4, y + 6)
    return cell


def _turned(item: Item, right: str, at: Point) -> Placed:
    """A part of two pins with the pin of this net on the right."""
    placed = Placed(item, 1, *at)
    on_right = [n for n in item.pins if item.pins[n] == right and placed.point(n)[0] > at[0]]
    return placed if on_right else replace(placed, angle=180)


def _far_end(cell: LayoutCell, placed: Placed, node: str) -> None:
    """The left end of a part whose right end is at the bus."""
    number = min(placed.item.pins, key=lambda n: placed.point(n)[0])
    at = placed.point(number)
    cell.wire((at[0] - 2, at[1]), at)
    cell.end(
        placed.item.pins[number], (at[0] - 2, at[1]), f"{placed.item.reference}_{number}", left=True
    )


def _rows(cell: LayoutCell, items: Sequence[Item], top: int) -> None:
    """Parts from the left to the right and down, each with its own ends."""
    x, y, tallest = 0, top, 0
    for item in items:
        width, height = _size(item)
        if x and x + width > WIDTH:
            x, y, tallest = 0, y + tallest, 0
        _alone(cell, item, x, y)
        x, tallest = x + width, max(tallest, height)
    cell.height = y + tallest


def _size(item: Item) -> tuple[int, int]:
    """Of a part with its names."""
    pins = item.shape.units[0].pins
    if item.shape.prefix == "U":
        return 12, 18
    if item.shape.prefix == "#FLG":
        return 12, 12
    if len(pins) == 2 and not item.shape.numbers:
        return 25, PITCH + (2 if item.shape.prefix == "V" else 0)
    return 25, max(p.y for p in pins) - min(p.y for p in pins) + 8


def _alone(cell: LayoutCell, item: Item, x: int, y: int) -> None:
    """One part with the names of its nets at its pins."""
    if item.shape.prefix == "U":
        (unit,) = item.stages
        placed = Placed(item, unit, x + 5, y + 6)
    elif item.shape.prefix == "#FLG":
        placed = Placed(item, 1, x + 3, y + 4)
    else:
        placed = Placed(item, 1, x + 13, y)
    cell.symbols.append(placed)
    for pin in _unit_pins(placed):
        at, net = placed.point(pin.number), item.pins[pin.number]
        owner = f"{item.reference}_{pin.number}"
        step = {0: -2, 180: 2}.get(pin.angle, 0)
        if item.shape.prefix == "TP":
            step = -2
        if item.shape.prefix == "#FLG":
            away = (at[0] + 4, at[1] + (2 if POWER.get(net) != "VCC" else 0))
            cell.wire(at, (away[0], at[1]), away)
            cell.end(net, away, owner, left=False)
        elif not net or not step:
            cell.end(net, at, owner, left=True)
        else:
            away = (at[0] + step, at[1])
            cell.wire(at, away)
            cell.end(net, away, owner, left=step < 0)


def _unit_pins(placed: Placed) -> tuple[ShapePin, ...]:
    return placed.item.shape.units[placed.unit - 1].pins


def _on(p: Point, a: Point, b: Point) -> bool:
    """Whether a point is on a wire, its ends included."""
    (x, y), (xa, ya), (xb, yb) = p, a, b
    if xa == xb:
        return x == xa and min(ya, yb) <= y <= max(ya, yb)
    return y == ya and min(xa, xb) <= x <= max(xa, xb)


def _pack(cells: Sequence[LayoutCell], columns: int, rows: int) -> tuple[LayoutCell, ...] | None:
    """The cells in columns of this many rows, in their order; None where they do not fit."""
    left = top = int(MARGIN / GRID)
    column, y = 0, 0
    out = []
    for cell in cells:
        if y and y + GAP + cell.height > rows:
            column, y = column + 1, 0
        if column >= columns or GAP + cell.height > rows:
            return None
        moved = cell.moved(left + column * WIDTH, top + y + GAP)
        moved.notes.append(Note(cell.title, (left + column * WIDTH, top + y), heading=True))
        out.append(moved)
        y += GAP + cell.height + 2
    return tuple(out)
