"""KiCad's own errors and the schematic beside a board: each fault in a saved board is told."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from designer.board.kicad_reader import read_board
from designer.catalog.design_rule import FAIL, NOT_RUN, PASS, RuleOutcome
from designer.design_rules import kicad_drc, on_board
from designer.folders import kicad_files
from tests.design_rules.test_rules_board import custom
from tests.shared.rule_cases import base, generic

pytestmark = pytest.mark.kicad
Change = Callable[[str], str]


@cache
def exported() -> dict[str, str]:
    """Board and schematic of a design, by their endings: placed, not routed."""
    files = kicad_files.texts(base().synthesis)
    endings = (".kicad_pcb", ".kicad_sch")
    return {end: text for name, text in files.items() for end in endings if name.endswith(end)}


def looked(folder: Path, board: str, schematic: str | None) -> dict[str, RuleOutcome]:
    path = folder / "board.kicad_pcb"
    path.write_text(board, encoding="utf-8")
    if schematic is not None:
        path.with_suffix(".kicad_sch").write_text(schematic, encoding="utf-8")
    found = on_board.checked(read_board(path), base().components, custom(), {}, generic())
    return {outcome.rule.id: outcome for outcome in found}


def first_pad(text: str) -> tuple[float, float]:
    """Where the first pad of a board is [mm]."""
    at = re.search(r"\(footprint .*?\(at ([-0-9.]+) ([-0-9.]+)", text, re.S)
    pad = re.search(r"\(pad .*?\(at ([-0-9.]+) ([-0-9.]+)", text, re.S)
    assert at is not None
    assert pad is not None
    return float(at[1]) + float(pad[1]), float(at[2]) + float(pad[2])


def more(items: str) -> Change:
    """A board with these items, in which x and y are those of the first pad."""

    def change(text: str) -> str:
        x, y = first_pad(text)
        return text.rstrip()[:-1] + items.format(x=x, y=y, right=x + 1.0) + ")"

    return change


def without_mask(text: str) -> str:
    at = text.index('"F.Mask"', text.index("(pad "))
    return text[:at] + text[at + len('"F.Mask"') :]


ID = "(uuid 11111111-1111-4111-8111-111111111111)"
FAULTS: dict[str, Change] = {
    "copper_edge_clearance": more(
        "(gr_circle (center {x} {y}) (end {right} {y}) (stroke (width 0.1) (type solid))"
        f' (fill no) (layer "Edge.Cuts") {ID})'
    ),
    "drill_out_of_range": more(
        '(via (at 5 5) (size 0.6) (drill 0.1) (layers "F.Cu" "B.Cu") (net 0) ' + ID + ")"
    ),
    "annular_width": more(
        '(via (at 5 5) (size 0.35) (drill 0.3) (layers "F.Cu" "B.Cu") (net 0) ' + ID + ")"
    ),
    "invalid_outline": lambda text: text.replace('(layer "Edge.Cuts")', '(layer "Dwgs.User")'),
    "lib_footprint_mismatch": without_mask,
}
"""A change of a saved board, by the type that KiCad gives it."""


@pytest.mark.parametrize("kind", FAULTS)
def test_an_error_of_kicad_s_own_fails(kind: str, tmp_path: Path) -> None:
    board = FAULTS[kind](exported()[".kicad_pcb"])
    found = looked(tmp_path, board, exported()[".kicad_sch"])["kicad-errors"]
    assert found.status == FAIL
    assert kind in found.found


def test_a_board_as_it_is_exported_has_none(tmp_path: Path) -> None:
    """Neither errors nor differences; the planted track is not told as a warning."""
    found = looked(tmp_path, exported()[".kicad_pcb"], exported()[".kicad_sch"])
    assert {found[id_].status for id_ in (kicad_drc.ERRORS, kicad_drc.PARITY)} == {PASS}
    assert found[kicad_drc.ERRORS].found == "0"


def test_a_value_that_is_changed_in_the_schematic_alone_is_a_difference(tmp_path: Path) -> None:
    board, schematic = exported()[".kicad_pcb"], exported()[".kicad_sch"]
    value = re.search(r'\(property "Value" "([0-9.]+kΩ)"', schematic)
    assert value is not None
    other = schematic.replace(value[0], value[0].replace(value[1], "1.23kΩ"), 1)
    found = looked(tmp_path, board, other)[kicad_drc.PARITY]
    assert found.status == FAIL
    assert "footprint_symbol_mismatch" in found.found


def test_without_a_schematic_parity_is_not_run(tmp_path: Path) -> None:
    found = looked(tmp_path, exported()[".kicad_pcb"], None)[kicad_drc.PARITY]
    assert found.status == NOT_RUN
    assert "no board.kicad_sch beside the board" in found.found
