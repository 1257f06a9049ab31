"""Cells of the sheet: an op-amp section with its parts, a node that parts hold, such as a
reference, and what only the board or the simulation has: probes, supply, all the rest.

Inputs come from the left to a vertical wire, the summing node. Feedback runs above the op-amp,
what loads its output hangs on the right. The level of a cell, y = 0, is that of its first input.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from designer.board.component import Component
from designer.board.kicad_items import Entry, Item, section_units
from designer.board.kicad_names import POWER
from designer.board.kicad_symbols import PART_ROW, REACH
from designer.board.pins import SUPPLY_UNIT
from designer.circuit.netlist import (
    GROUND,
    Circuit,
    Connector,
    Diode,
    Resistor,
    Section,
    SupplyCapacitor,
    SupplyDiode,
    TestPoint,
)
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

WIDTH = 50
"""Width of a cell of parts in rows."""
STACK = 18
"""Height of two capacitors one above the other, with their texts."""


def node_fittings(circuit: Circuit) -> tuple[Resistor | Diode, ...]:
    """What the board adds at the summing nodes: protection, the resistor of the trim."""
    nodes = {s.inverting for s in circuit.sections}
    both = (p for p in circuit.fittings if isinstance(p, Resistor | Diode))
    return tuple(p for p in both if nodes & set(p.nets))


def probe_cells(circuit: Circuit, parts: SheetParts) -> Iterator[SheetCell]:
    """The outputs with their resistors and connectors."""
    at_nodes = node_fittings(circuit)
    fittings = [p for p in circuit.fittings if isinstance(p, Resistor) and p.name in parts.items]
    probes = [p for p in fittings if p not in at_nodes]
    if probes:
        yield probe_cell(circuit, probes, parts)


def supply_cells(circuit: Circuit, parts: SheetParts) -> Iterator[SheetCell]:
    """The supply, the supply pins of each package, the spare sections."""
    yield supply_cell(circuit, parts)
    for package in circuit.packages:
        yield decoupling_cell(circuit, package, parts)
    for spare in circuit.fittings:
        if isinstance(spare, Section):
            yield follower_cell(spare, parts)


def probe_cell(circuit: Circuit, probes: Sequence[Resistor], parts: SheetParts) -> SheetCell:
    """Each output's resistor, its pad and its pin of a connector in one line, the connectors
    below one another."""
    cell = SheetCell("outputs")
    pads = {p.net: parts.items[p.name] for p in circuit.fittings if isinstance(p, TestPoint)}
    behind = {p.b: p for p in probes}
    first = 2 + max(label_width(p.a) for p in probes)
    named = first + PART + max(map(label_width, behind))
    y = 0
    for connector in circuit.fittings:
        if not isinstance(connector, Connector) or not set(connector.ways) & set(behind):
            continue
        placed = Placed(parts.items[connector.name], 1, named + 10 + REACH, y)
        cell.symbols.append(placed)
        for number, net in placed.item.pins.items():
            x, y = placed.point(number)
            if net not in behind:
                cell.pin_end(placed, number, (x - 2, y))
                continue
            _probe_line(cell, behind[net], (first, y), x, parts)
            if net in pads:
                cell.symbols.append(Placed(pads[net], 1, named + 1, y))
        cell.right = max(cell.right, x + REACH + (12 if connector.series else 6))
        cell.bottom = y + 5
        y += PART_ROW // 2
    return headed(cell, -6)


def _probe_line(
    cell: SheetCell, probe: Resistor, start: Point, pin: int, parts: SheetParts
) -> None:
    """An output, its resistor, and a wire to the connector's pin at x = ``pin``."""
    end = start[0] + PART - 2, start[1]
    row(cell, Chain(probe.a, probe.b, (probe,)), start, end[0], parts)
    cell.inlets.append(Inlet(probe.a, start, f"{probe.name}_in"))
    cell.wire(end, (pin, start[1]))
    cell.end(probe.b, end, probe.name, left=False)


def supply_cell(circuit: Circuit, parts: SheetParts) -> SheetCell:
    """The supply's connector, and the bulk capacitors between rails and ground."""
    cell = SheetCell("supply")
    nets = {*POWER, *circuit.supply_inputs}
    connector = next(
        p for p in circuit.fittings if isinstance(p, Connector) and set(p.ways) <= nets
    )
    placed = Placed(parts.items[connector.name], 1, 9, 4)
    cell.symbols.append(placed)
    for number in placed.item.pins:
        x, y = placed.point(number)
        cell.pin_end(placed, number, (x - 2, y))
    _stack(cell, _capacitors(circuit, ""), 22, parts)
    cell.right, cell.bottom = 22 + STACK, 18
    for diode in circuit.supply_diodes:
        _series(cell, diode, 5, parts)
    return headed(cell, -8)


def _series(cell: SheetCell, diode: SupplyDiode, x: int, parts: SheetParts) -> None:
    """A diode of the supply below what the cell has, from the connector's net to the rail."""
    rail = next(net for net in diode.nets if net != diode.source)
    start = x + label_width(diode.source), cell.bottom + 3
    end = start[0] + PART + 2  # the rail's symbol stands clear of the role
    cell.end(diode.source, start, f"{diode.name}_in", left=True)
    row(cell, Chain(diode.source, rail, (diode,)), start, end - 2, parts)
    cell.wire((end - 2, start[1]), (end, start[1]))
    cell.end(rail, (end, start[1]), f"{diode.name}_out", left=False)
    cell.bottom += 8


def decoupling_cell(circuit: Circuit, package: str, parts: SheetParts) -> SheetCell:
    """The supply pins of a package, with the capacitors that stand at them."""
    item, unit = parts.units[f"{package}{SUPPLY_UNIT}"]
    cell = SheetCell(f"supply · {package}")
    placed = Placed(item, unit, 6, 6)
    cell.symbols.append(placed)
    _stack(cell, _capacitors(circuit, package), 14, parts)
    for pin in placed.pins:
        x, y = placed.point(pin.number)
        rail = 0 if y < placed.y else 12
        cell.wire((x, y), (x, rail), (14, rail))
    cell.right, cell.bottom = 14 + STACK, 16
    return headed(cell, -5)


def _capacitors(circuit: Circuit, package: str) -> list[SupplyCapacitor]:
    """The capacitors of a package, that of the positive rail first."""
    capacitors = [p for p in circuit.fittings if isinstance(p, SupplyCapacitor)]
    return [p for p in capacitors if p.package == package]


def _stack(
    cell: SheetCell, capacitors: Sequence[SupplyCapacitor], x: int, parts: SheetParts
) -> None:
    """Capacitors one above the other from the positive rail, y = 0, down to the negative."""
    y = 0
    for part in capacitors:
        item = parts.items[part.name]
        place_upright(cell, item, part.minus, (x, y + REACH), parts)
        aside = (x, y) if y == 0 else (x - 3, y)
        cell.wire((x, y), aside)
        cell.end(part.plus, aside, f"{part.name}_plus", left=False)
        y += 2 * REACH
    cell.end(capacitors[-1].minus, (x, y), f"{capacitors[-1].name}_minus", left=False)


def flow_cell(title: str, items: Iterable[Item], lines: Sequence[str] = ()) -> SheetCell:
    """Parts in rows, named at every end; lines of text below them."""
    cell = SheetCell(title)
    x, y, tallest = 0, 0, 0
    for item in items:
        width, height = _size(item)
        if x and x + width > WIDTH:
            x, y, tallest = 0, y + tallest, 0
        _alone(cell, item, x, y)
        x, tallest = x + width, max(tallest, height)
    y += tallest
    for i, text in enumerate(lines):
        cell.notes.append(Note(text, (0, y + 2 * i + 2), f"{title} {i}", "line"))
    longest = max(map(text_width, lines), default=0.0)
    cell.right, cell.bottom = max(WIDTH, math.ceil(longest)), y + 2 * len(lines) + 2
    return headed(cell, -6)


def _size(item: Item) -> tuple[int, int]:
    """Room of a part with its names."""
    pins = item.shape.units[0].pins
    if item.shape.prefix in ("#FLG", "TP"):
        return 12, 10
    if len(pins) == 2 and not item.shape.numbers:
        return 25, PART_ROW + (2 if item.shape.prefix == "V" else 0)
    return 25, max(p.y for p in pins) - min(p.y for p in pins) + 8


def _alone(cell: SheetCell, item: Item, x: int, y: int) -> None:
    """One part with the names of its nets at its pins."""
    small = item.shape.prefix in ("#FLG", "TP")
    placed = Placed(item, 1, x + (3 if small else 13), y + (4 if small else 0))
    cell.symbols.append(placed)
    for pin in placed.pins:
        at, net = placed.point(pin.number), item.pins[pin.number]
        if item.shape.prefix == "#FLG":
            away = (at[0] + 4, at[1])
            down = (away[0], away[1] + (2 if POWER.get(net) != "VCC" else 0))
            cell.wire(at, away, down)
            cell.end(net, down, f"{item.reference}_{pin.number}", left=False)
        elif small and POWER.get(net) == "VCC":  # its symbol points up, into the pad's
            away = (at[0] + 8, at[1])
            cell.wire(at, away)
            cell.end(net, away, f"{item.reference}_{pin.number}", left=False)
        elif small or not net:
            cell.pin_end(placed, pin.number, at)
        else:
            step = (4 if item.shape.prefix == "V" else 2) * (-1 if pin.angle == 0 else 1)
            cell.pin_end(placed, pin.number, (at[0] + step, at[1]))


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
