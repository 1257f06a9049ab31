"""Cells of the sheet that only the board or the simulation has: probes, supply, all the rest."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

from designer.board.kicad_items import Item
from designer.board.kicad_names import POWER
from designer.board.kicad_symbols import PART_ROW, REACH
from designer.board.pins import SUPPLY_UNIT
from designer.circuit.board_parts_only import Connector, SupplyCapacitor, SupplyDiode, TestPoint
from designer.circuit.netlist import Circuit, Diode, Resistor, Section
from designer.schematic.amplifier_cells import (
    PART,
    SheetParts,
    follower_cell,
    headed,
    place_upright,
    row,
)
from designer.schematic.drawing_cells import Chain
from designer.schematic.sheet_drawing import (
    Inlet,
    Note,
    Placed,
    Point,
    SheetCell,
    label_width,
    text_width,
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
