"""Where the cells of the sheet stand: mass by mass, the signal from left to right, wires between.

The cells of a mass or a dead zone are a block of lines. A cell follows the one whose output it
takes, on the same line and joined by a wire; the output of a line that another line takes, or
makes too, leads there between two cells. What is not joined is named. Blocks fill the paper column
by column.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from designer.board.kicad_items import Entry
from designer.board.kicad_names import PAPERS
from designer.board.kicad_symbols import GRID
from designer.circuit.netlist import Circuit
from designer.schematic.drawing_cells import Amplifier, Cell, circuit_cells
from designer.schematic.sheet_cells import (
    SheetParts,
    amplifier_cell,
    flow_cell,
    node_cell,
    node_fittings,
    probe_cells,
    supply_cells,
)
from designer.schematic.sheet_drawing import Point, Sheet, SheetCell

GAP, CHANNEL = 4, 2
"""Distance between cells, and the room of each wire that leads up there."""
APART = 5
"""Distance between blocks."""
MARGIN, TITLE_BLOCK = 16.0, 36.0
"""Millimetres that the frame takes on each side, and its title block at the bottom."""
STEP = 10
"""Distance between the heights of columns that are tried."""
ROOM = 230
"""Width of a block of small cells."""


@dataclass(frozen=True)
class Way:
    """Where the output of a line leads: between two cells of a line above, and there to an input
    that takes its net, or to the output that makes it too."""

    line: int
    """The line above."""
    gap: int
    """Index of the cell that the wire passes before; their number behind the last one."""
    inlet: int | None
    """Index of the input of that cell; None for the output of the cell before."""


def layout(circuit: Circuit, entries: Sequence[Entry], directives: Sequence[str]) -> Sheet:
    """Everything of a circuit and its board on one sheet. directives : of the simulation."""
    parts = SheetParts.of(entries)
    rows = circuit_cells(circuit, node_fittings(circuit))
    blocks = [block([_drawn(cell, parts) for cell in cells]) for cells in rows]
    probes = list(probe_cells(circuit, parts))
    supply = list(supply_cells(circuit, parts))
    drawn = {s.item.reference for b in (*blocks, *probes, *supply) for s in b.symbols}
    rest = [e for e in entries if e.item.reference not in drawn]
    board = [e.item for e in rest if e.component is not None]
    simulation = [e.item for e in rest if e.component is None]
    probes.append(flow_cell("generator, trim, ground", board))
    probes.append(flow_cell("simulation", simulation, directives))
    return arranged([*blocks, *shelves(probes), *shelves(supply)])


def _drawn(cell: Cell, parts: SheetParts) -> SheetCell:
    return amplifier_cell(cell, parts) if isinstance(cell, Amplifier) else node_cell(cell, parts)


def block(cells: Sequence[SheetCell]) -> SheetCell:
    """The cells of a mass or a dead zone, in lines, joined by wires."""
    lines = lines_of(cells)
    ways = {k: way for k in range(len(lines)) if (way := _way(lines, k)) is not None}
    gaps = Counter((way.line, way.gap) for way in ways.values())
    placed = _in_lines(lines, gaps)
    out = SheetCell(cells[0].title)
    joined = {point for line in placed for point in _along(out, line)}
    taken: Counter[tuple[int, int]] = Counter()
    for k, way in ways.items():
        taken[way.line, way.gap] += 1
        joined |= _upwards(out, placed, k, way, taken[way.line, way.gap])
    for line in placed:
        for cell in line:
            _absorb(out, cell, joined)
    return out


def lines_of(cells: Sequence[SheetCell]) -> list[list[SheetCell]]:
    """Each cell behind one whose output it takes, as far as there is one. Those that have nothing
    to do with any other stand in one line, the last."""
    alone = [c for c in cells if not any(_meet(c, other) for other in cells if other is not c)]
    left = [c for c in cells if not any(c is other for other in alone)]
    lines: list[list[SheetCell]] = []
    while left:
        line = [left.pop(0)]
        while (k := next((k for k, c in enumerate(left) if _takes(c, line[-1])), None)) is not None:
            line.append(left.pop(k))
        lines.append(line)
    return [*lines, alone] if alone else lines


def _takes(cell: SheetCell, other: SheetCell) -> bool:
    """Whether the output of another cell is an input of a cell."""
    return other.outlet is not None and any(i.net == other.outlet.net for i in cell.inlets)


def _meet(one: SheetCell, other: SheetCell) -> bool:
    nets = {c.outlet.net for c in (one, other) if c.outlet is not None}
    return len(nets) == 1 or _takes(one, other) or _takes(other, one)


def _way(lines: Sequence[Sequence[SheetCell]], k: int) -> Way | None:
    """Where the output of line ``k`` leads; None where no line above has its net."""
    last = lines[k][-1].outlet
    assert last is not None
    for i, line in enumerate(lines[:k]):
        for j, cell in enumerate(line):
            if cell.outlet is not None and cell.outlet.net == last.net:
                return Way(i, j + 1, None)
    for i, line in enumerate(lines[:k]):
        for j, cell in enumerate(line[1:], start=1):
            for n, inlet in enumerate(cell.inlets):
                if inlet.net == last.net:
                    return Way(i, j, n)
    return None


def _in_lines(
    lines: Sequence[Sequence[SheetCell]], gaps: Mapping[tuple[int, int], int]
) -> list[list[SheetCell]]:
    """The cells side by side and line below line, the cells of a line on one level."""
    out, y = [], 0
    for i, line in enumerate(lines):
        y -= min(cell.top for cell in line)
        x, placed, top = 0, [], min(cell.top for cell in line)
        for j, cell in enumerate(line):
            x += (GAP if j else 0) + CHANNEL * gaps.get((i, j), 0)
            placed.append(cell.titled(top).moved(x - cell.left, y))
            x = placed[-1].right
        out.append(placed)
        y = max(cell.bottom for cell in placed) + 2
    return out


def _along(out: SheetCell, line: Sequence[SheetCell]) -> Iterator[Point]:
    """Wires from each cell of a line to the next; the inputs that they reach."""
    for one, following in pairwise(line):
        assert one.outlet is not None
        start = one.outlet.at
        inlet = next((i for i in following.inlets if i.net == one.outlet.net), None)
        if inlet is not None:
            x = following.left
            out.wire(start, (x, start[1]), (x, inlet.at[1]), inlet.at)
            yield inlet.at


def _upwards(
    out: SheetCell, placed: Sequence[Sequence[SheetCell]], k: int, way: Way, nth: int
) -> set[Point]:
    """A wire from the end of line ``k`` up to where it leads, if nothing is in between; the input
    that it reaches."""
    above = placed[way.line]
    before, outlet = above[way.gap - 1], placed[k][-1].outlet
    assert outlet is not None
    assert before.outlet is not None
    x, (right, y) = before.right + CHANNEL * nth, outlet.at
    if x < right or any(line[-1].right >= x for line in placed[way.line + 1 : k]):
        return set()
    if way.inlet is not None:
        target = above[way.gap].inlets[way.inlet].at
        out.wire(outlet.at, (x, y), (x, target[1]), target)
        return {target}
    target = before.outlet.at
    out.wire(outlet.at, (x, y), (x, target[1]))
    if way.gap == len(above):
        out.wire((x, target[1]), target)
    out.right = max(out.right, x)
    return set()


def _absorb(out: SheetCell, cell: SheetCell, joined: Collection[Point]) -> None:
    """A cell into a block; its inputs that no wire reaches are named."""
    for inlet in cell.inlets:
        if inlet.at not in joined:
            out.end(inlet.net, inlet.at, inlet.owner, left=True)
    out.symbols += cell.symbols
    out.wires += cell.wires
    out.labels += cell.labels
    out.notes += cell.notes
    out.open_pins += cell.open_pins
    out.left, out.right = min(out.left, cell.left), max(out.right, cell.right)
    out.top, out.bottom = min(out.top, cell.top), max(out.bottom, cell.bottom)


def shelves(cells: Sequence[SheetCell]) -> list[SheetCell]:
    """Small cells side by side, as many as there is room for."""
    out: list[SheetCell] = []
    for cell in cells:
        wide = cell.right - cell.left
        if not out or out[-1].right + GAP + wide > ROOM:
            out.append(SheetCell(cell.title))
        shelf = out[-1]
        x = shelf.right + (GAP if shelf.symbols else 0)
        _absorb(shelf, cell.titled(cell.top).moved(x - cell.left, -cell.top), ())
    return out


def arranged(blocks: Sequence[SheetCell]) -> Sheet:
    """The blocks on the smallest sheet that takes them, in columns as even as they can be; beyond
    A0, on a sheet of its own size."""
    for paper, (width, height) in PAPERS.items():
        most = _units(height - 2.0 * MARGIN - TITLE_BLOCK)
        for tall in range(STEP, most + 1, STEP):
            cells, right = _columns(blocks, tall)
            if cells is not None and right <= _units(width - MARGIN):
                return Sheet(paper, cells)
    tallest = max(_units(PAPERS["A0"][1]), *(b.bottom - b.top for b in blocks))
    cells, right = _columns(blocks, tallest)
    assert cells is not None
    high = tallest * GRID + 2.0 * MARGIN + TITLE_BLOCK
    return Sheet(("User", right * GRID + MARGIN, high), cells)


def _columns(blocks: Sequence[SheetCell], height: int) -> tuple[tuple[SheetCell, ...] | None, int]:
    """The blocks in columns of this height, in their order, and where they end on the right; None
    where one is taller."""
    x = top = _units(MARGIN)
    y = right = 0
    out = []
    for one in blocks:
        tall = one.bottom - one.top
        if tall > height:
            return None, 0
        if y and y + tall > height:
            x, y = right + 2 * GAP, 0
        out.append(one.moved(x - one.left, top + y - one.top))
        right = max(right, out[-1].right)
        y += tall + APART
    return tuple(out), right


def _units(length: float) -> int:
    """Millimetres in whole units of the grid."""
    return int(length / GRID)
