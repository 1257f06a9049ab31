"""The sheet as it is read by people: nothing over anything, wires where they belong, any size."""

from __future__ import annotations

import html
import re
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import pytest

from designer.board import kicad_sim
from designer.board.kicad_items import entries
from designer.board.kicad_names import PAPERS
from designer.board.kicad_symbols import GRID, TEXT
from designer.schematic.drawing_cells import Amplifier, circuit_cells
from designer.schematic.kicad_project import Project
from designer.schematic.sheet_drawing import (
    SIZES,
    Placed,
    Sheet,
    SheetCell,
    text_width,
)
from designer.schematic.sheet_layout import arranged, layout
from tests.shared.exploring import quick
from tests.shared.kicad_cases import CASES, case, case_files, kicad, written

LINE_STEP = 1.62
"""Distance from a line of text to the next one, in heights of its letters, as KiCad sets them."""
SLIM = 0.05
"""Half the width of a wire."""


@dataclass(frozen=True)
class Box:
    """A rectangle on the sheet, in units of the grid."""

    what: str
    left: float
    top: float
    right: float
    bottom: float

    def meets(self, other: Box) -> bool:
        across = min(self.right, other.right) - max(self.left, other.left)
        return across > 0.01 and min(self.bottom, other.bottom) - max(self.top, other.top) > 0.01


def sheet_of(made: Project) -> Sheet:
    listed = entries(made.circuit, made.components, made.run, "models")
    return layout(made.circuit, listed, kicad_sim.directives(made.circuit, made.run))


def written_text(what: str, x: float, y: float, size: float = TEXT) -> Box:
    """A line about its middle."""
    wide, high = text_width(what, size), size / GRID
    return Box(what, x - wide / 2, y - high / 2, x + wide / 2, y + high / 2)


def texts(sheet: Sheet) -> list[Box]:
    """Everything that is written, but numbers and names of pins."""
    out = []
    for s in sheet.symbols:
        reference, value = s.names_at()
        if s.item.shape.power and s.item.value not in ("GND", "PWR_FLAG"):
            out.append(written_text(s.item.value, *value))
        if s.item.shape.power or s.unit == len(s.item.shape.units) > 1:
            continue
        out.append(written_text(s.item.reference, *reference))
        if s.item.shape.prefix != "TP":
            out.append(written_text(s.item.value, *value))
    for label in sheet.labels:
        wide, (x, y) = text_width(label.net), label.at
        left = x - wide if label.left else float(x)
        out.append(Box(label.net, left, y - 1.2, left + wide, y - 0.1))
    for note in (n for cell in sheet.cells for n in cell.notes):
        size, at = SIZES[note.kind], note.at
        lines = note.text.split("\n")
        wide = max(text_width(line, size) for line in lines)
        high = size * (1.0 + LINE_STEP * (len(lines) - 1)) / GRID
        left = at[0] - wide / 2 if note.kind == "role" and not note.left else at[0]
        top = at[1] if note.kind == "role" else at[1] - high
        out.append(Box(note.text, left, top, left + wide, top + high))
    return out


def bodies(sheet: Sheet) -> list[Box]:
    """Of each symbol what is drawn, without its pins."""
    return [body(s) for s in sheet.symbols]


def body(s: Placed) -> Box:
    drawn = [p for line in s.item.shape.units[s.unit - 1].lines for p in line]
    if s.upright:
        points = [(s.x + y, s.y + x) for x, y in drawn]
    else:
        points = [(s.x + x * (-1 if s.angle == 180 else 1), s.y - y) for x, y in drawn]
    xs, ys = [p[0] for p in points], [p[1] for p in points]
    name = f"{s.item.reference} {s.unit}"
    edge = 2 * SLIM  # where a wire may end
    return Box(name, min(xs) + edge, min(ys) + edge, max(xs) - edge, max(ys) - edge)


@pytest.mark.parametrize("name", quick(CASES, 3))
def test_nothing_lies_over_anything(name: str) -> None:
    """Texts and symbols; a wire may end at a symbol and runs through none, nor through a text."""
    sheet = sheet_of(case(name))
    written, drawn = texts(sheet), bodies(sheet)
    assert len(written) > len(drawn) > 40
    over = [(a, b) for a, b in combinations(written, 2) if a.meets(b)]
    over += [(a, b) for a in written for b in drawn if a.meets(b)]
    over += [(a, b) for a, b in combinations(drawn, 2) if a.meets(b)]
    for (xa, ya), (xb, yb) in sheet.segments:
        wire = Box(
            "wire", min(xa, xb) - SLIM, min(ya, yb) - SLIM, max(xa, xb) + SLIM, max(ya, yb) + SLIM
        )
        over += [(wire, b) for b in (*written, *drawn) if wire.meets(b)]
    assert over == []


def test_the_op_amps_of_a_mass_stand_in_its_row_as_in_the_drawing() -> None:
    circuit = case("paper").circuit
    sheet = sheet_of(case("paper"))
    at = {
        f"{s.item.reference}{'ABCD'[s.unit - 1]}": (s.x, s.y)
        for s in sheet.symbols
        if s.item.shape.prefix == "U" and len(s.pins) == 3
    }
    rows = circuit_cells(circuit)
    for row in rows[:2]:
        names = [cell.section.name for cell in row if isinstance(cell, Amplifier)]
        assert len(names) == 4
        assert len({at[name][1] for name in names}) == 1
        assert sorted(names, key=lambda name: at[name][0]) == names
    assert at["U2C"][1] < at["U2D"][1]


@pytest.mark.parametrize(("name", "named"), [("paper", {"v2", "v4n"}), ("rectifier", {"vrp"})])
def test_a_wire_leads_from_a_cell_to_the_next(name: str, named: set[str]) -> None:
    """Inside a mass or a dead zone a net is named where it is made; a second name, on the left of
    its wire, stands in another row only."""
    sheet = sheet_of(case(name))
    made = {"v2": "U1B", "v4n": "U1C", "vrp": "U3A"}
    for net in named:
        (_, y), *more = (label.at for label in sheet.labels if label.net == net and not label.left)
        assert not more, "named once where it is made"
        user = next(
            s for s in sheet.symbols
            if s.item.reference == made[net][:2] and "ABCD"[s.unit - 1] == made[net][2:]
        )  # fmt: skip
        taken = [label.at[1] for label in sheet.labels if label.net == net and label.left]
        assert all(abs(at - user.y) > 12 for at in taken), net
        assert abs(y - user.y) < 4


def test_decoupling_stands_beside_its_package() -> None:
    made = case("paper")
    sheet = sheet_of(made)
    for component in (c for c in made.components if c.near):
        own = next(s for s in sheet.symbols if s.item.reference == component.reference)
        supply = next(
            s for s in sheet.symbols
            if s.item.reference == component.near and s.unit == len(s.item.shape.units)
        )  # fmt: skip
        assert abs(own.x - supply.x) + abs(own.y - supply.y) < 20


def test_more_than_the_largest_paper_is_a_sheet_of_its_own_size() -> None:
    cells = [SheetCell(str(i), right=300, bottom=200) for i in range(20)]
    sheet = arranged(cells)
    assert isinstance(sheet.paper, tuple)
    kind, wide, high = sheet.paper
    assert kind == "User"
    assert wide > PAPERS["A0"][0]
    assert max(c.right for c in sheet.cells) * GRID < wide
    assert max(c.bottom for c in sheet.cells) * GRID < high
    boxes = [Box(c.title, c.left, c.top, c.right, c.bottom) for c in sheet.cells]
    assert not any(a.meets(b) for a, b in combinations(boxes, 2))


@pytest.mark.kicad
def test_texts_are_no_wider_than_is_reckoned(tmp_path: Path) -> None:
    """Against the widths that KiCad writes into its own picture of the sheet."""
    folder = written(case_files("composites"), tmp_path)
    (file,) = folder.glob("*.kicad_sch")
    kicad(folder, "sch", "export", "svg", "-o", "out", file.name)
    (picture,) = (folder / "out").glob("*.svg")
    drawn = html.unescape(picture.read_text("utf-8"))
    found = re.findall(r'textLength="([\d.]+)" font-size="([\d.]+)"[^>]*>([^<]+)<', drawn)
    assert len(found) > 200
    seen = {text for _, _, text in found}
    assert {"R50A1", "LM4040C50"} & seen
    for length, font, text in found:
        assert float(length) <= text_width(text, 0.75 * float(font)) * GRID + 0.02, text
