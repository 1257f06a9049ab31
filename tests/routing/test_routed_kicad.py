"""Routed boards as KiCad 9 sees them, and under our own rules."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import pytest

from designer import read_model_file, synthesise
from designer.board.board_parts import board_circuit
from designer.board.component import Component, components
from designer.board.kicad_reader import read_board
from designer.board.kicad_rules import CustomRule, board_rules
from designer.catalog.design_rule import PASS
from designer.design_rules import on_board
from designer.fabrication.kicad_plot import plot
from designer.fabrication.order import check_order
from designer.fabrication.plotted_copper import plotted
from designer.folders import board_files
from designer.folders.kicad_files import texts
from designer.jobs.board_routing import board_file
from designer.routing.board_copper import with_layers
from designer.routing.routed_board import route_board
from tests.shared.exploring import EXPLORING
from tests.shared.kicad_cases import CASES, case, case_files, kicad, written
from tests.shared.rule_cases import generic

EXAMPLES = Path(__file__).parents[2] / "examples"
HARDEST = "through-hole", "BNC jacks", "singles", "duals on the surface", "four masses"
"""Cases that ask most of the router: everything in holes, the largest pads, the most packages, the
narrowest pads, the largest board. The others are a few parts of these more or less; what is theirs
alone is in their nets, which ``tests/schematic/test_kicad_cli.py`` has of every case."""
ROUTED = [*HARDEST, *(name for name in CASES if EXPLORING and name not in (*HARDEST, "surface"))]
OFTEN = [("paper", 4), ("surface", 2)]
"""Boards of every run and their layers; the others are routed with the slow tests."""
SELDOM = [("through-hole", 4), *((name, 2) for name in ROUTED)]


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
    nothing_is_found(folder / board, project.components, rules)


@pytest.mark.kicad
@pytest.mark.slow
@pytest.mark.parametrize("name", ["backlash", "hammer-base"])
def test_nothing_is_found_on_the_board_of_another_system(name: str, tmp_path: Path) -> None:
    """From its model file: clearances between masses, and a base that is struck."""
    design = synthesise(read_model_file(EXAMPLES / f"{name}.toml")).synthesis
    circuit, choice = board_circuit(design)
    files, board = texts(design), board_file(design)
    rules = board_rules(circuit, design.modelfile.rules)
    routed = route_board(files[board], circuit, rules)
    assert routed.open == {}
    own = {key.removeprefix("kicad/"): text for key, text in {**files, board: routed.text}.items()}
    folder = written(own, tmp_path / "project")
    place = folder / board.removeprefix("kicad/")
    plots = plot(read_board(place), "board", protel_names=True)
    listed, bought = board_files.listed(design), board_files.bought(design)
    ordered = check_order(
        plotted(plots.gerbers), plots.positions, read_board(place), listed, bought
    )
    assert ordered.faults == ()
    assert ordered.pads > 100
    nothing_is_found(place, components(circuit, design.catalog, choice), rules)
    sheet = place.with_suffix(".kicad_sch").name
    kicad(folder, "sch", "erc", "--severity-all", "--format", "json", "-o", "erc.json", sheet)
    pages = json.loads((folder / "erc.json").read_text())["sheets"]
    assert [each for page in pages for each in page["violations"]] == []


def nothing_is_found(board: Path, parts: Sequence[Component], rules: Sequence[CustomRule]) -> None:
    """Neither by KiCad, parity with the sheet included, nor by the rules on a board."""
    folder = board.parent
    kicad(
        folder, "pcb", "drc", "--severity-all", "--schematic-parity", "--format", "json",
        "-o", "drc.json", board.name,
    )  # fmt: skip
    found = json.loads((folder / "drc.json").read_text())
    assert found["violations"] == []
    assert found["unconnected_items"] == []
    assert found["schematic_parity"] == []
    outcomes = on_board.checked(read_board(board), parts, rules, {}, generic())
    assert {o.rule.id: o.found for o in outcomes if o.status != PASS} == {}
