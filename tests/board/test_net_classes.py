"""Net classes of the exported project: KiCad itself says which class and which sizes a net has."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from designer.board.kicad_rules import board_rules
from designer.board.net_classes import CLASSES, DEFAULT, SUMMING, SUPPLY, VIA
from designer.board.sexpr import Expression, expression, expression_text, read
from designer.catalog.design_rules import BY_ID
from tests.shared.kicad_cases import case, case_files, kicad, written
from tests.shared.kicad_python import asked_of_pcbnew

PAIRS = {DEFAULT: ("/v1", "/v2"), SUMMING: ("/s1", "/v1"), SUPPLY: ("VCC", "/v3")}
"""Two nets that lie beside one another, the first of them of the class."""
SIZES = {DEFAULT: (0.2, 0.25), SUMMING: (0.3, 0.2), SUPPLY: (0.2, 0.5)}
"""Clearance and width of a track [mm], as docs/kicad.md has them."""
ASK = """
import json, sys, pcbnew
board = pcbnew.LoadBoard(sys.argv[1])
out = {}
for name in board.GetNetInfo().NetsByName():
    found = board.FindNet(str(name)).GetNetClassSlow()
    sizes = found.GetClearance(), found.GetTrackWidth(), found.GetViaDiameter(), found.GetViaDrill()
    out[str(name)] = [found.GetName(), *(size / 1e6 for size in sizes)]
print("ANSWER " + json.dumps(out))
"""
"""Asks KiCad's own module what it makes of the project."""


def project_with(folder: Path, *, gap: float, priority: bool, rules: bool) -> Path:
    """The exported project with a pair of tracks of each class beside the board, gap [mm] apart."""
    made = dict(case_files("paper"))
    board = next(name for name in made if name.endswith(".kicad_pcb"))
    settings = next(name for name in made if name.endswith(".kicad_pro"))
    whole = read(made[board])
    number = {net.text(1): int(net.text(0)) for net in whole.all("net")}
    tracks = []
    for row, pair in enumerate(PAIRS.values()):
        for side, net in enumerate(pair):
            y = -20.0 - 10.0 * row + side * (0.25 + gap)
            tracks.append(
                expression(
                    "segment",
                    expression("start", 0.0, y),
                    expression("end", 5.0, y),
                    expression("width", 0.25),
                    expression("layer", "F.Cu"),
                    expression("net", number[net]),
                )
            )
    made[board] = expression_text(Expression((*whole.items, *tracks)))
    if not priority:
        value = json.loads(made[settings])
        for each in value["net_settings"]["classes"]:
            del each["priority"]
        made[settings] = json.dumps(value)
    if not rules:
        made = {name: text for name, text in made.items() if not name.endswith(".kicad_dru")}
    return written(made, folder)


def clearances(folder: Path) -> dict[str, tuple[str, float]]:
    """By the nets of a pair: who asked for the gap that it does not keep, and for how much [mm]."""
    board = next(folder.glob("*.kicad_pcb")).name
    kicad(folder, "pcb", "drc", "--severity-all", "--format", "json", "-o", "drc.json", board)
    found = json.loads((folder / "drc.json").read_text())["violations"]
    out = {}
    for each in found:
        if each["type"] != "clearance":
            continue
        said = re.search(r"\((netclass|rule) '([^']*)' clearance ([0-9.]+) mm", each["description"])
        assert said is not None, each["description"]
        nets = {re.search(r"\[(.*?)\]", item["description"])[1] for item in each["items"]}  # type: ignore[index]
        key = next(name for name, pair in PAIRS.items() if set(pair) == nets)
        out[key] = (f"{said[1]} {said[2]}", float(said[3]))
    return out


def nets_by_kicad(folder: Path) -> dict[str, Any]:
    """Class, clearance, width, via and drill of each net, as KiCad's Python module has them."""
    board = next(folder.glob("*.kicad_pcb"))
    (answer,) = re.findall(r"^ANSWER (.*)$", asked_of_pcbnew(ASK, folder, board), re.MULTILINE)
    return dict(json.loads(answer))


def test_every_class_has_a_priority_of_its_own() -> None:
    made = case_files("paper")
    settings = json.loads(next(t for n, t in made.items() if n.endswith(".kicad_pro")))
    found = {c["name"]: c["priority"] for c in settings["net_settings"]["classes"]}
    assert found == {DEFAULT: 2147483647, SUMMING: 0, SUPPLY: 1}


def test_the_rules_ask_for_what_the_classes_ask() -> None:
    """A rule goes before a class, so the general rule must not take the summing nodes' gap away."""
    rules = {rule.id: rule for rule in board_rules(case("paper").circuit)}
    order = list(rules)
    assert order.index("clearance") < order.index("summing-clearance")
    assert rules["summing-clearance"].limit == CLASSES[SUMMING]["clearance"]
    assert BY_ID["summing-clearance"].limit == CLASSES[SUMMING]["clearance"]
    assert rules["supply-width"].usual == CLASSES[SUPPLY]["track_width"]
    assert "(opt 0.5mm)" in " ".join(case("paper").rules.split())


@pytest.mark.kicad
def test_a_narrow_gap_is_told_by_its_class(tmp_path: Path) -> None:
    """0.15 mm is too little for each class, 0.25 mm for the summing nodes alone."""
    narrow = clearances(project_with(tmp_path / "a", gap=0.15, priority=True, rules=False))
    assert narrow == {name: (f"netclass {name}", SIZES[name][0]) for name in PAIRS}
    wider = clearances(project_with(tmp_path / "b", gap=0.25, priority=True, rules=False))
    assert wider == {SUMMING: ("netclass summing", 0.3)}
    assert clearances(project_with(tmp_path / "c", gap=0.31, priority=True, rules=False)) == {}


@pytest.mark.kicad
def test_with_the_project_s_rules_the_summing_nodes_keep_their_gap(tmp_path: Path) -> None:
    found = clearances(project_with(tmp_path / "a", gap=0.25, priority=True, rules=True))
    assert found == {SUMMING: ("rule summing-clearance", 0.3)}
    assert clearances(project_with(tmp_path / "b", gap=0.31, priority=True, rules=True)) == {}


@pytest.mark.kicad
def test_kicad_gives_each_net_the_sizes_of_its_class(tmp_path: Path) -> None:
    found = nets_by_kicad(project_with(tmp_path, gap=0.5, priority=True, rules=True))
    summing = {f"/{s.inverting}" for s in case("paper").circuit.sections}
    for net, (name, *sizes) in found.items():
        kind = SUMMING if net in summing else SUPPLY if net in ("GND", "VCC", "VEE") else DEFAULT
        assert name.split(",")[0] == kind, net
        assert sizes == pytest.approx([*SIZES[kind], VIA["via_diameter"], VIA["via_drill"]])
    assert summing <= found.keys()


@pytest.mark.kicad
def test_without_a_priority_kicad_knows_no_class(tmp_path: Path) -> None:
    """What these tests are for: KiCad says nothing of it, so only its answers show it."""
    folder = project_with(tmp_path, gap=0.25, priority=False, rules=False)
    assert clearances(folder) == {}
    assert {tuple(row[1:3]) for row in nets_by_kicad(folder).values()} == {(0.2, 0.2)}
