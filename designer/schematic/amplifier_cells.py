"""Cells of the sheet that the circuit is drawn with: an op-amp section with its parts, or a node
that parts hold, such as a reference.

Inputs come from the left to a vertical wire, the summing node. Feedback runs above the op-amp,
what loads its output hangs on the right. The level of a cell, y = 0, is that of its first input.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from designer.board.component import Component
from designer.board.kicad_items import Entry, Item, section_units
from designer.board.kicad_names import POWER
from designer.board.kicad_symbols import PART_ROW, REACH
from designer.circuit.netlist import GROUND, Section
from designer.schematic.drawing_cells import Amplifier, CellRows, Chain, role_lines
from designer.schematic.sheet_drawing import (
    SIZES,
    Inlet,
    Note,
    Placed,
    Point,
    SheetCell,
    label_width,
    side_of,
    text_width,
    turned,
)

PART = 16
"""Room of a part in a row, with its texts."""
HANGING = 14
"""Room of a part on end, with its texts beside it."""
FIRST_FEEDBACK = 8
"""Height of the lowest feedback above the level."""
PIN, AMPLIFIER, OUTPUT = 3, 9, 15
"""From the summing node to the inverting input, the middle of the op-amp, its output."""
ROLE_LETTERS, NARROW_LETTERS = 24, 14
"""Letters in a line of a role, below a part and beside one."""


@dataclass(frozen=True)
class SheetParts:
    """What the sheet has a symbol for, by name of the part."""

    items: Mapping[str, Item]
    """The item of each part but op-amp sections."""
    units: Mapping[str, tuple[Item, int]]
    """The item of each op-amp section, and its unit; also of each package's supply, as "U1P"."""
    roles: Mapping[str, str]
    """What each item is for, by its designator."""

    @classmethod
    def of(cls, entries: Sequence[Entry]) -> SheetParts:
        """The parts from the entries of the sheet."""
        items: dict[str, Item] = {}
        units: dict[str, tuple[Item, int]] = {}
        roles: dict[str, str] = {}
        for entry in entries:
            component = entry.component
            if component is None:
                continue
            roles[component.reference] = component.role
            if component.kind == "op-amp":
                units |= _units(component, entry.item)
            else:
                items |= dict.fromkeys(component.parts, entry.item)
        return cls(items, units, roles)


def _units(component: Component, item: Item) -> dict[str, tuple[Item, int]]:
    return {f"{item.reference}{name}": (item, i) for name, i in section_units(component).items()}


def amplifier_cell(drawn: Amplifier, parts: SheetParts) -> SheetCell:
    """An op-amp section with everything that its nodes alone hold."""
    cell = SheetCell(drawn.title)
    inputs = drawn.inputs
    node = _named(inputs) + PART * max((len(c.parts) for c in inputs), default=0)
    levels = inputs_at(cell, inputs, node, parts)
    placed = section_at(cell, drawn.section, (node + AMPLIFIER, 2), parts)
    cell.wire((node, 0), (node + PIN, 0))
    back = max((len(c.parts) for c in drawn.feedback), default=0)
    spare = 2 if drawn.series is None else label_width(drawn.section.output) + 2
    tip = node + max(OUTPUT + spare, PART * back)
    cell.wire((node + OUTPUT, 2), (tip, 2))
    after = tip
    if drawn.series is not None:
        after = tip + PART * len(drawn.series.parts)
        row(cell, drawn.series, (tip, 2), after, parts)
        cell.end(drawn.section.output, (node + OUTPUT + 1, 2), placed.item.reference, left=False)
    top = _feedback(cell, drawn, (node, tip, after), parts)
    highest = min(top, levels[0]) - 3
    cell.wire((node, highest), (node, max(0, levels[-1])))
    cell.end(drawn.section.inverting, (node, highest), "", left=False)
    net = drawn.section.output if drawn.series is None else drawn.series.end
    end = _loads(cell, drawn.shunts, after, parts)
    finish(cell, net, (end, 2), drawn.section.name)
    cell.bottom = max(levels[-1] + 4, 12, 16 if drawn.shunts else 0)
    return headed(cell, highest - 2)


def node_cell(drawn: CellRows, parts: SheetParts) -> SheetCell:
    """A net that parts hold: from the left what feeds it, hanging on it what leads to ground."""
    chains = [r for r in drawn.rows if isinstance(r, Chain)]
    net = chains[0].end
    hanging = [c for c in chains if c.start == GROUND]
    fed = [c for c in chains if c not in hanging]
    cell = SheetCell(drawn.title)
    node = _named(fed) + PART * max((len(c.parts) for c in fed), default=0)
    levels = inputs_at(cell, fed, node, parts)
    cell.wire((node, 0), (node, levels[-1]))
    end = _loads(cell, [c.turned for c in hanging], node, parts, 0)
    finish(cell, net, (end, 0), f"{fed[0].parts[0].name if fed else net}_node")
    cell.bottom = max(levels[-1] + 4, 14)
    return headed(cell, -6)


def follower_cell(section: Section, parts: SheetParts) -> SheetCell:
    """A spare section: its output at its inverting input."""
    cell = SheetCell(f"spare · {section.name}")
    section_at(cell, section, (AMPLIFIER - PIN, 2), parts)
    cell.wire((0, 0), (0, -4), (OUTPUT - 2, -4), (OUTPUT - 2, 2), (OUTPUT - PIN, 2))
    cell.wire((OUTPUT - 2, 2), (OUTPUT, 2))
    finish(cell, section.output, (OUTPUT, 2), section.name)
    cell.bottom = 12
    return headed(cell, -7)


def inputs_at(
    cell: SheetCell, inputs: Sequence[Chain], node: int, parts: SheetParts
) -> tuple[int, ...]:
    """Rows of inputs that end at a vertical wire; their heights, at least one."""
    for i, chain in enumerate(inputs):
        start = node - PART * len(chain.parts), PART_ROW * i
        row(cell, chain, start, node, parts)
        # The name of a rail stands on both sides of its wire.
        end = (start[0] - 2, start[1]) if chain.start in POWER else start
        cell.wire(end, start)
        cell.inlets.append(Inlet(chain.start, end, f"{chain.parts[0].name}_in"))
    return tuple(PART_ROW * i for i in range(len(inputs))) or (0,)


def section_at(cell: SheetCell, section: Section, at: Point, parts: SheetParts) -> Placed:
    """The triangle of a section, with what its other input is joined to."""
    item, unit = parts.units[section.name]
    placed = Placed(item, unit, *at)
    cell.symbols.append(placed)
    _, plus, _ = (pin.number for pin in placed.pins)
    cell.pin_end(placed, plus, placed.point(plus))
    return placed


def _feedback(
    cell: SheetCell, drawn: Amplifier, columns: tuple[int, int, int], parts: SheetParts
) -> int:
    """The feedback above an op-amp, from its node to its output or the end of what follows that;
    the height of the highest."""
    node, tip, after = columns
    top = 0
    over: dict[int, int] = {}
    for i, chain in enumerate(reversed(drawn.feedback)):
        y = -FIRST_FEEDBACK - PART_ROW * i
        end = tip if chain.start == drawn.section.output else after
        row(cell, chain.turned, (node, y), end, parts)
        over[end] = top = y
    for column, y in over.items():
        cell.wire((column, y), (column, 2))
    return top


def _loads(
    cell: SheetCell, loads: Sequence[Chain], start: int, parts: SheetParts, y: int = 2
) -> int:
    """What hangs on a wire at this height from ``start`` on; where that wire ends."""
    for i, chain in enumerate(loads):
        _hang(cell, chain, (start + 3 + HANGING * i, y), parts)
    end = start + (HANGING * len(loads) - 1 if loads else 2)
    cell.wire((start, y), (end, y))
    return end


def _hang(cell: SheetCell, chain: Chain, at: Point, parts: SheetParts) -> None:
    """A chain from a point down to ground."""
    (x, y), net = at, chain.start
    cell.wire(at, (x, y + 1))
    y += 1
    for part in chain.parts:
        if y > at[1] + 1:
            cell.end(net, (x, y), f"{part.name}_start", left=True)
        net = other(part.nets, net)
        place_upright(cell, parts.items[part.name], net, (x, y + REACH), parts)
        y += 2 * REACH
    cell.end(net, (x, y), f"{chain.parts[-1].name}_end", left=False)


def place_upright(cell: SheetCell, item: Item, below: str, at: Point, parts: SheetParts) -> Placed:
    """A part on end, its role beside it. below : net of its lower pin."""
    placed = turned(item, below, at, (90, 270))
    cell.symbols.append(placed)
    _open(cell, placed)
    role = parts.roles[item.reference]
    if role:
        text = "\n".join(role_lines(role, NARROW_LETTERS))
        at_role = at[0] + side_of(item), at[1] + 2.0
        cell.notes.append(Note(text, at_role, item.reference, left=True))
    return placed


def row(cell: SheetCell, chain: Chain, start: Point, end: int, parts: SheetParts) -> None:
    """The parts of a chain on one height, from a point to the column ``end``."""
    x, y = start
    net, step = chain.start, (end - x) // len(chain.parts)
    before = start
    for i, part in enumerate(chain.parts):
        if i:
            cell.end(net, before, f"{part.name}_start", left=False)
        item, net = parts.items[part.name], other(part.nets, net)
        middle = x + step * i + step // 2
        placed = turned(item, net, (middle, y), (0, 180))
        cell.symbols.append(placed)
        cell.wire(before, (middle - REACH, y))
        before = middle + REACH, y
        _open(cell, placed)
        role = parts.roles[item.reference]
        if role:
            lines = "\n".join(role_lines(role, ROLE_LETTERS))
            below = 1.5 if len(placed.pins) == 2 else 3.6
            cell.notes.append(Note(lines, (middle, y + below), item.reference))
    cell.wire(before, (end, y))


def other(nets: Sequence[str], net: str) -> str:
    """The other net of a part of two pins."""
    return nets[1] if nets[0] == net else nets[0]


def finish(cell: SheetCell, net: str, at: Point, owner: str) -> None:
    """The way out of a cell, with its name, and the cell's edge behind it."""
    cell.end(net, at, f"{owner}_out", left=False)
    cell.outlet = Inlet(net, at, f"{owner}_out")
    cell.right = at[0] + (3 if net in POWER else label_width(net) + 1)


def headed(cell: SheetCell, top: int) -> SheetCell:
    """The cell with room for its title at this height."""
    cell.top = top - 2
    wide = text_width(cell.title, SIZES["title"])
    cell.right = max(cell.right, cell.left + int(wide) + 1)
    return cell


def _named(chains: Sequence[Chain]) -> int:
    """Room for the names of the nets that inputs come from."""
    return 2 + max((label_width(c.start) for c in chains), default=0)


def _open(cell: SheetCell, placed: Placed) -> None:
    """Marks at the pins of a part that stay open."""
    cell.open_pins += [placed.point(n) for n, net in placed.item.pins.items() if not net]
