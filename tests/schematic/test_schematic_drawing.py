"""The drawing: every part once, nothing over anything, text of a model file inert."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections import Counter
from itertools import combinations

import pytest
from matplotlib import pyplot

from designer.board.board_parts import fitted
from designer.board.component import Numbers, components, designator, pin_numbers
from designer.circuit.netlist import Circuit, Connector, Section, TestPoint
from designer.model.board_table import BoardChoice
from designer.schematic import schematic_drawing
from designer.schematic.drawing_cells import Amplifier, Chain, board_cells, circuit_cells
from tests.base.test_views import CIRCUITS
from tests.shared.stages import CATALOG

HOSTILE = "<script>alert(1)</script> & $x_1$ ]]> \" ' 1.23456789"
SVG = "{http://www.w3.org/2000/svg}"


def board(name: str) -> Circuit:
    return fitted(CIRCUITS[name], BoardChoice(), CATALOG)


def numbers(name: str) -> Numbers:
    return pin_numbers(components(board(name), CATALOG, BoardChoice()))


def texts(svg: str) -> list[tuple[str, tuple[float, float, float, float]]]:
    """Each line of text with its box: left, top, right, bottom, by the width of plain letters."""
    found = []
    for text in ET.fromstring(svg).iter(f"{SVG}text"):
        size, y = float(text.attrib["font-size"]), float(text.attrib["y"])
        for span in text.iter(f"{SVG}tspan"):
            y += float(span.attrib["dy"])
            said = span.text or ""
            x, wide = float(span.attrib["x"]), 0.55 * size * len(said)
            left = {"start": x, "middle": x - wide / 2, "end": x - wide}[text.attrib["text-anchor"]]
            found.append((said, (left, y - 0.75 * size, left + wide, y + 0.2 * size)))
    return found


@pytest.mark.parametrize("name", CIRCUITS)
def test_every_part_is_drawn_once(name: str) -> None:
    circuit = board(name)
    said = " \n ".join(text for text, _ in texts(schematic_drawing.svg(circuit)))
    for part in (*circuit.parts, *circuit.fittings):
        name = part.name if isinstance(part, Section) else designator(part.name)
        found = re.findall(rf"(?<![\w·]){name}(?![\w])", said)
        if isinstance(part, Connector):
            assert found
        elif isinstance(part, TestPoint | Section):
            assert len(found) == 1, part.name
        else:
            assert len(found) == 1, part.name


@pytest.mark.parametrize("name", CIRCUITS)
def test_no_text_lies_on_another(name: str) -> None:
    boxes = texts(schematic_drawing.svg(board(name), "A title", numbers(name)))
    for (one, a), (two, b) in combinations(boxes, 2):
        apart = a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]
        assert apart, (one, two)


def test_op_amps_show_the_pads_of_their_case() -> None:
    """Of a TL074 in SO-14, by its data sheet: A has 2, 3 and 1, the supply 4 and 11."""
    pads = numbers("paper")
    assert pads["U1A"] == {"-": "2", "+": "3", "OUT": "1"}
    assert pads["U1D"] == {"-": "13", "+": "12", "OUT": "14"}
    circuit = board("paper")
    said = [text for text, _ in texts(schematic_drawing.svg(circuit, "", pads))]
    plain = [text for text, _ in texts(schematic_drawing.svg(circuit))]
    shown = Counter(said) - Counter(plain)
    wanted = Counter(pad for s in circuit.sections for pad in pads[s.name].values())
    assert shown == wanted + Counter(f"{p}: V+ 4, V- 11" for p in circuit.packages)


@pytest.mark.parametrize("name", CIRCUITS)
def test_wires_join_what_the_circuit_joins(name: str) -> None:
    """The cells hold every part with its own nets, at the sections that those nets are of."""
    circuit = CIRCUITS[name]
    by_name = {p.name: p for p in circuit.parts}
    seen = []
    for cell in (cell for row in circuit_cells(circuit) for cell in row):
        if isinstance(cell, Amplifier):
            seen.append(cell.section.name)
            held = [*cell.inputs, *cell.feedback, *cell.shunts, *filter(None, [cell.series])]
            assert all(c.end == cell.section.inverting for c in (*cell.inputs, *cell.feedback))
        else:
            held = [row for row in cell.rows if isinstance(row, Chain)]
        for chain in held:
            net = chain.start
            for i, part in enumerate(chain.parts):
                seen.append(part.name)
                ends = by_name[part.name].nets
                assert net in ends
                first = part.anode if hasattr(part, "anode") else part.nets[0]
                assert chain.forward(i) == (first == net)
                net = ends[1] if ends[0] == net else ends[0]
            assert net == chain.end
    assert sorted(seen) == sorted(by_name)


def test_a_title_is_text_and_nothing_else() -> None:
    svg = schematic_drawing.svg(CIRCUITS["paper"], HOSTILE)
    plain = schematic_drawing.svg(CIRCUITS["paper"], "plain")
    assert HOSTILE in [said for said, _ in texts(svg)]
    assert [e.tag for e in ET.fromstring(svg).iter()] == [
        e.tag for e in ET.fromstring(plain).iter()
    ]
    assert "<script" not in svg


def test_equal_circuits_give_equal_bytes() -> None:
    svg = schematic_drawing.svg(board("rectifier"), "One")
    assert svg == schematic_drawing.svg(board("rectifier"), "One")
    assert svg != schematic_drawing.svg(board("one-sided rectifier"), "One")


def test_a_picture_of_points() -> None:
    png = schematic_drawing.png(CIRCUITS["one-sided rectifier"], HOSTILE, dpi=20)
    assert png.startswith(b"\x89PNG\r\n")
    assert len(png) > 5000


def test_a_picture_leaves_no_figure_behind() -> None:
    before = pyplot.get_fignums()
    schematic_drawing.png(CIRCUITS["one-sided rectifier"], dpi=20)
    assert pyplot.get_fignums() == before


def test_without_fittings_there_is_no_board() -> None:
    assert board_cells(CIRCUITS["paper"]) == ()
    assert not any("board" in said for said, _ in texts(schematic_drawing.svg(CIRCUITS["paper"])))
