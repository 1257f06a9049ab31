"""Routed boards as KiCad 9 sees them, and under our own rules."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from designer.board.kicad_reader import read_board
from designer.board.kicad_rules import board_rules
from designer.catalog.design_rule import PASS
from designer.design_rules import on_board
from designer.routing.board_layers import with_layers
from designer.routing.routed_board import route_board
from tests.shared.kicad_cases import CASES, case, case_files, kicad, written

OFTEN = [("paper", 4), ("surface", 2)]
"""Boards of every run and their layers; the others are routed with the slow tests."""
SELDOM = [("through-hole", 4), *((name, 2) for name in CASES if name != "surface")]


@pytest.mark.kicad
@pytest.mark.parametrize(
    ("name", "layers"), [*OFTEN, *(pytest.param(*one, marks=pytest.mark.slow) for one in SELDOM)]
)
def test_kicad_and_the_rules_find_nothing_on_a_routed_board(
    name: str, layers: int, tmp_path: Path
) -> None:
    """With the project's net classes, and without the project under the custom rules."""
    made, project = dict(case_files(name)), case(name)
    rules = board_rules(project.circuit)
    board = next(file for file in made if file.endswith(".kicad_pcb"))
    routed = route_board(with_layers(made[board], layers), project.circuit, rules)
    assert routed.open == {}
    folder = written({**made, board: routed.text}, tmp_path / "project")
    kicad(
        folder, "pcb", "drc", "--severity-all", "--schematic-parity", "--format", "json",
        "-o", "drc.json", board,
    )  # fmt: skip
    found = json.loads((folder / "drc.json").read_text())
    assert found["violations"] == []
    assert found["unconnected_items"] == []
    assert found["schematic_parity"] == []
    outcomes = on_board.checked(read_board(folder / board), project.components, rules, {})
    assert {o.rule.id: o.found for o in outcomes if o.status != PASS} == {}
