"""Where the components stand on the board: a block about each op-amp package.

A section's parts stand in the quarter of the block where its pins are; decoupling stands at the
supply pins. What comes in is left of the blocks, what goes out is right of them. Millimetres, y
downwards.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from designer.board.board_parts import probed_nets
from designer.board.component import Component
from designer.board.footprints import FootprintShape, footprint
from designer.circuit.netlist import GROUND, Circuit, Section
from designer.circuit.stage_title import INTERFACE, SUPPLY, stage_names

TEXT = 0.8
"""Height of a reference on the board [mm]."""
LETTER = 0.85
"""Width of one of its letters [mm]."""
ROOM = 0.4
"""Between cells [mm]."""
EDGE = 3.0
"""From the outermost part to the board's edge [mm]."""
PER_COLUMN = 12
"""Amplifiers whose packages stand below one another: those of the paper's circuit."""
ORIGIN = (25.0, 25.0)
"""The board's upper left corner on the sheet."""


@dataclass(frozen=True)
class PlacedComponent:
    """A component on the board."""

    component: Component
    """The component."""
    footprint: FootprintShape
    """The footprint, with its pads."""
    x: float = 0.0
    """Place to the right [mm]."""
    y: float = 0.0
    """Place downwards [mm]."""
    angle: int = 0
    """How far it is turned [degrees]."""

    @property
    def box(self) -> PlacedBox:
        """Its courtyard with the room for its reference above it."""
        left, top, right, bottom = self.footprint.courtyard
        if self.angle == 180:
            left, top, right, bottom = -right, -bottom, -left, -top
        half = LETTER * len(self.component.reference) / 2.0
        return PlacedBox(
            self.x + min(left, -half),
            self.y + top - TEXT - 0.4,
            self.x + max(right, half),
            self.y + bottom,
        )

    def pad(self, number: str) -> tuple[float, float]:
        """Where a pad is."""
        pad = next(p for p in self.footprint.pads if p.number == number)
        sign = -1.0 if self.angle == 180 else 1.0
        return self.x + sign * pad.x, self.y + sign * pad.y

    def moved(self, x: float, y: float) -> PlacedComponent:
        return replace(self, x=self.x + x, y=self.y + y)


@dataclass(frozen=True)
class PlacedBox:
    """An upright rectangle on the board."""

    left: float
    """Its left edge [mm]."""
    top: float
    """Its upper edge [mm]."""
    right: float
    """Its right edge [mm]."""
    bottom: float
    """Its lower edge [mm]."""

    @property
    def width(self) -> float:
        return self.right - self.left

    @property
    def height(self) -> float:
        return self.bottom - self.top


@dataclass(frozen=True)
class Placement:
    """Where everything stands on the board."""

    spots: tuple[PlacedComponent, ...]
    """Every component with a footprint."""
    outline: PlacedBox
    """Outline of the board."""


def place(circuit: Circuit, components: Sequence[Component]) -> Placement:
    """The board; InputError for a footprint that is not known here."""
    spots = {c.reference: PlacedComponent(c, footprint(c.footprint)) for c in components}
    owner = _owners(circuit, components)
    blocks: list[list[PlacedComponent]] = []
    packages = [c for c in components if c.kind == "op-amp"]
    for package in packages:
        near = [spots.pop(c.reference) for c in components if c.near == package.reference]
        mine = {
            section: [spots.pop(n) for n in names if n in spots]
            for section, names in owner.items()
            if section in package.parts
        }
        blocks.append(_block(spots.pop(package.reference), near, mine))
    middle = [_stack(column) for column in _columns(blocks, len(circuit.sections))]
    height = max((_bounds(column).height for column in middle), default=40.0)
    incoming, outgoing = _sides(circuit, spots.values())
    columns = [_strip(incoming, height), *middle, _strip(outgoing, height)]
    out: list[PlacedComponent] = []
    x = 0.0
    for column in filter(None, columns):
        box = _bounds(column)
        out += [s.moved(x - box.left, -box.top) for s in column]
        x += box.width + 2.0 * ROOM
    return _on_board(out)


def _columns(
    blocks: Sequence[list[PlacedComponent]], amplifiers: int
) -> Iterator[Sequence[list[PlacedComponent]]]:
    """The blocks in their order, shared out evenly among as many columns as the amplifiers take."""
    count = max(1, math.ceil(amplifiers / PER_COLUMN))
    ends = [len(blocks) * i // count for i in range(count + 1)]
    yield from (blocks[start:end] for start, end in pairwise(ends))


def _on_board(spots: Sequence[PlacedComponent]) -> Placement:
    """The outline round the parts, its corner at ``ORIGIN``, everything on steps of 0.05 mm."""
    box = _bounds(spots)
    dx, dy = ORIGIN[0] + EDGE - box.left, ORIGIN[1] + EDGE - box.top
    outline = PlacedBox(
        *ORIGIN,
        ORIGIN[0] + math.ceil(box.width + 2.0 * EDGE),
        ORIGIN[1] + math.ceil(box.height + 2.0 * EDGE),
    )
    placed = [replace(s, x=_step(s.x + dx), y=_step(s.y + dy)) for s in spots]
    return Placement(tuple(placed), outline)


def _owners(circuit: Circuit, components: Sequence[Component]) -> dict[str, list[str]]:
    """References of the parts that belong to each section, by the section's name.

    A part at a summing node is its section's; another one of a stage is that section's whose
    output it touches, or goes to the stage's first.
    """
    stages = stage_names(circuit)
    sections = [p for p in (*circuit.parts, *circuit.fittings) if isinstance(p, Section)]
    out: dict[str, list[str]] = {s.name: [] for s in sections}
    for component in components:
        if component.kind == "op-amp" or component.stage in (SUPPLY, INTERFACE):
            continue
        nets = set(component.nets.values())
        stage = [s for s in sections if stages[s.name] == component.stage]
        ranked = [s for s in stage if s.inverting in nets and s.inverting != GROUND]
        ranked += [s for s in stage if s.output in nets]
        ranked += stage
        if ranked:
            out[ranked[0].name].append(component.reference)
    return out


def _block(
    package: PlacedComponent,
    near: Sequence[PlacedComponent],
    mine: Mapping[str, Sequence[PlacedComponent]],
) -> list[PlacedComponent]:
    """A package with its decoupling beside the supply pins and its sections' parts around."""
    out = [package, *_decoupling(package, near)]
    core = _bounds(out)
    pins = {p.number: p for p in package.component.pins}
    for section, parts in mine.items():
        unit = section.removeprefix(package.component.reference)
        places = [package.pad(n) for n, pin in pins.items() if pin.unit == unit]
        left = sum(x for x, _ in places) < 0.0
        above = sum(y for _, y in places) < 0.0
        group = _rows(parts, right=left)
        if not group:
            continue
        box = _bounds(group)
        x = core.left - ROOM - box.right if left else core.right + ROOM - box.left
        y = -ROOM / 2.0 - box.bottom if above else ROOM / 2.0 - box.top
        out += [s.moved(x, y) for s in group]
    return out


def _decoupling(package: PlacedComponent, near: Sequence[PlacedComponent]) -> list[PlacedComponent]:
    """Each capacitor with one pad at the supply pin of the same net."""
    out: list[PlacedComponent] = []
    for spot in near:
        nets = spot.component.nets
        pin = next(
            p
            for p in package.component.pins
            if p.electrical == "power_in" and p.net in nets.values()
        )
        x, y = package.pad(pin.number)
        side = -1.0 if x < 0.0 else 1.0
        # The pad of the supply's net faces the package.
        number = next(n for n, net in nets.items() if net == pin.net)
        turned = replace(spot, angle=180)
        facing = spot if -side * spot.pad(number)[0] > 0.0 else turned
        left, _, right, _ = package.footprint.courtyard
        edge = left if side < 0.0 else right
        reach = facing.box.right if side < 0.0 else -facing.box.left
        at = facing.moved(edge + side * (reach + ROOM), y)
        while any(_overlap(at.box, other.box) for other in out):
            at = at.moved(0.0, 0.5 if y >= 0.0 else -0.5)
        out.append(at)
    return out


def _rows(
    parts: Iterable[PlacedComponent], *, right: bool, width: float | None = None
) -> list[PlacedComponent]:
    """Parts in rows from top to bottom, against the right or the left edge at x = 0."""
    queue = list(parts)
    if not queue:
        return []
    widest = max(s.box.width for s in queue)
    limit = max(13.0, 2.1 * widest) if width is None else max(width, widest)
    out: list[PlacedComponent] = []
    y = 0.0
    row: list[PlacedComponent] = []

    def close() -> None:
        nonlocal y
        tall = max(s.box.height for s in row)
        x = 0.0
        for s in reversed(row) if right else row:
            box = s.box
            dx = x - box.right if right else x - box.left
            out.append(s.moved(dx, y + (tall - box.height) / 2.0 - box.top))
            x += (-1.0 if right else 1.0) * (box.width + ROOM)
        y += tall + ROOM / 2.0
        row.clear()

    for s in queue:
        if row and sum(r.box.width + ROOM for r in row) + s.box.width > limit:
            close()
        row.append(s)
    close()
    return out


def _stack(blocks: Sequence[Sequence[PlacedComponent]]) -> list[PlacedComponent]:
    """Blocks below one another, their packages in one column."""
    out: list[PlacedComponent] = []
    y = 0.0
    for block in blocks:
        box = _bounds(block)
        out += [s.moved(0.0, y - box.top) for s in block]
        y += box.height + 2.0 * ROOM
    return out


def _sides(
    circuit: Circuit, spots: Iterable[PlacedComponent]
) -> tuple[list[PlacedComponent], list[PlacedComponent]]:
    """What comes in, and what goes out: parts that a state's or the dead zone's output drives."""
    incoming: list[PlacedComponent] = []
    outgoing: list[PlacedComponent] = []
    simulated = set(circuit.nets) | {GROUND}
    for spot in spots:
        outside = {net for net in spot.component.nets.values() if net and net not in simulated}
        drives = {
            net
            for p in (*circuit.parts, *circuit.fittings)
            if outside & set(p.nets)
            for net in p.nets
        }
        out = bool(drives & set(probed_nets(circuit)))
        (outgoing if out else incoming).append(spot)
    return incoming, outgoing


def _strip(spots: Sequence[PlacedComponent], height: float) -> list[PlacedComponent]:
    """Columns of parts about as high as the blocks."""
    columns: list[list[PlacedComponent]] = []
    y = math.inf
    for s in spots:
        tall = s.box.height + ROOM
        if y + tall > max(height, tall):
            columns.append([])
            y = 0.0
        columns[-1].append(s.moved(-s.box.left, y - s.box.top))
        y += tall
    out: list[PlacedComponent] = []
    x = 0.0
    for column in columns:
        box = _bounds(column)
        out += [s.moved(x, 0.0) for s in column]
        x += box.width + ROOM
    return out


def _bounds(spots: Iterable[PlacedComponent]) -> PlacedBox:
    boxes = [s.box for s in spots]
    return PlacedBox(
        min(b.left for b in boxes),
        min(b.top for b in boxes),
        max(b.right for b in boxes),
        max(b.bottom for b in boxes),
    )


def _overlap(a: PlacedBox, b: PlacedBox) -> bool:
    return a.left < b.right and b.left < a.right and a.top < b.bottom and b.top < a.bottom


def _step(value: float) -> float:
    return round(value * 20.0) / 20.0
