"""The KiCad project without KiCad: what is connected on the sheet, what stands on the board, ids,
and text from elsewhere."""

from __future__ import annotations

import itertools
import json
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial.distance import pdist, squareform

from designer.base.views import View
from designer.board.component import joined
from designer.board.footprints import footprint
from designer.board.kicad_names import (
    LONGEST,
    circuit_net,
    footprint_name,
    kicad_net,
    project_name,
    safe_text,
)
from designer.board.kicad_placement import Placement, place
from designer.board.sexpr import Expression, read, read_all
from designer.board.summing_nodes import node_spans, shortest_tree
from designer.circuit.netlist import Resistor
from designer.schematic.kicad_project import Project, files
from tests.base.test_views import CIRCUITS
from tests.shared.exploring import quick
from tests.shared.kicad_cases import CASES, case, case_files, project

Point = tuple[float, float]


def file(made: dict[str, str], ending: str) -> Expression:
    return read(next(text for name, text in made.items() if name.endswith(ending)))


@cache
def part_of(name: str, ending: str) -> Expression:
    """A file of one of ``CASES`` as it is read."""
    return file(case_files(name), ending)


def prop(symbol: Expression, name: str) -> str:
    return next(p.text(1) for p in symbol.all("property") if p.text(0) == name)


class Drawing:
    """A sheet read as KiCad does: pins, wires and labels meet where their points are equal."""

    def __init__(self, sheet: Expression) -> None:
        self.parent: dict[Point, Point] = {}
        self.pins: dict[tuple[str, str], Point] = {}
        self.names: dict[Point, set[str]] = {}
        self.open = {self.at(n) for n in sheet.all("no_connect")}
        library = {s.text(0): s for s in sheet.get("lib_symbols").all("symbol")}
        for wire in sheet.all("wire"):
            a, b = ((xy.number(0), xy.number(1)) for xy in wire.get("pts").all("xy"))
            self.join(a, b)
        for label in sheet.all("label"):
            self.names.setdefault(self.at(label), set()).add("/" + label.text(0))
        for symbol in sheet.all("symbol"):
            shape = library[symbol.get("lib_id").text(0)]
            for number, point in self.points(symbol, shape):
                if shape.find("power") is not None:
                    if prop(symbol, "Reference").startswith("#PWR"):
                        self.names.setdefault(point, set()).add(prop(symbol, "Value"))
                else:
                    self.pins[prop(symbol, "Reference"), number] = point

    @staticmethod
    def at(thing: Expression) -> Point:
        return thing.get("at").number(0), thing.get("at").number(1)

    def points(self, symbol: Expression, shape: Expression) -> Iterator[tuple[str, Point]]:
        x, y = self.at(symbol)
        turn = np.exp(1j * np.deg2rad(symbol.get("at").number(2)))
        unit = int(symbol.get("unit").number(0))
        for drawn in shape.all("symbol"):
            if not drawn.text(0).endswith(f"_{unit}_1"):
                continue
            for pin in drawn.all("pin"):
                dx, dy = self.at(pin)
                away = complex(dx, dy) * turn
                where = (round(x + away.real, 4), round(y - away.imag, 4))
                yield pin.get("number").text(0), where

    def root(self, point: Point) -> Point:
        while self.parent.get(point, point) != point:
            point = self.parent[point]
        return point

    def join(self, a: Point, b: Point) -> None:
        self.parent[self.root(a)] = self.root(b)

    def nets(self) -> dict[str, set[tuple[str, str]]]:
        """By name; what has no name is under "" with its pins."""
        named: dict[Point, set[str]] = {}
        for point, names in self.names.items():
            named.setdefault(self.root(point), set()).update(names)
        out: dict[str, set[tuple[str, str]]] = {}
        for pin, point in self.pins.items():
            names = named.get(self.root(point), {""})
            assert len(names) == 1, (pin, names)
            out.setdefault(next(iter(names)), set()).add(pin)
        return out


@pytest.mark.parametrize("name", quick(CASES, 3))
def test_the_sheet_connects_what_the_components_say(name: str) -> None:
    drawing = Drawing(part_of(name, ".kicad_sch"))
    simulated = {"VM1", "VCC1", "VEE1"}
    nets = {
        circuit_net(net): {pin for pin in pins if pin[0] not in simulated}
        for net, pins in drawing.nets().items()
    }
    wanted = {net: set(pads) for net, pads in joined(case(name).components).items()}
    free = nets.pop("", set())
    assert nets == wanted
    assert all(drawing.pins[pin] in drawing.open for pin in free)


@pytest.mark.parametrize("name", quick(CASES, 3))
def test_the_board_and_the_netlist_carry_the_same_nets(name: str) -> None:
    board = part_of(name, ".kicad_pcb")
    numbers = {net.text(1): net.text(0) for net in board.all("net")}
    pins = {(c.reference, pin.number) for c in case(name).components for pin in c.pins}
    on_board: dict[str, set[tuple[str, str]]] = {}
    for part in board.all("footprint"):
        for pad in part.all("pad"):
            net = pad.find("net")
            if net is None:  # a pad that no pin belongs to
                assert (prop(part, "Reference"), pad.text(0)) not in pins
                continue
            assert net.text(0) == numbers[net.text(1)]
            on_board.setdefault(net.text(1), set()).add((prop(part, "Reference"), pad.text(0)))
    listed = {
        net.get("name").text(0): {
            (n.get("ref").text(0), n.get("pin").text(0)) for n in net.all("node")
        }
        for net in part_of(name, ".net").get("nets").all("net")
    }
    assert on_board == listed
    wanted = {kicad_net(n): set(pads) for n, pads in joined(case(name).components).items()}
    assert {n: p for n, p in listed.items() if not n.startswith("unconnected-")} == wanted


@pytest.mark.parametrize("name", quick(CASES, 3))
def test_components_stand_apart_on_the_board(name: str) -> None:
    placement = placed(case(name))
    names = [s.component.reference for s in placement.spots]
    board = [c for c in case(name).components if View.BOARD in c.views]
    assert sorted(names) == sorted(c.reference for c in board)
    yards = {s.component.reference: s.courtyard for s in placement.spots}
    for (a, one), (b, other) in itertools.combinations(yards.items(), 2):
        across = max(one.left - other.right, other.left - one.right)
        down = max(one.top - other.bottom, other.top - one.bottom)
        assert max(across, down) >= 0.25, (a, b)
    edge = placement.outline
    for yard in yards.values():
        assert edge.left < yard.left < yard.right < edge.right
        assert edge.top < yard.top < yard.bottom < edge.bottom


@pytest.mark.parametrize("name", quick(CASES, 3))
def test_decoupling_stands_at_the_supply_pins(name: str) -> None:
    spots = {s.component.reference: s for s in placed(case(name)).spots}
    near = [s for s in spots.values() if s.component.near]
    assert near
    for spot in near:
        package = spots[spot.component.near]
        supply = {p.net: p.number for p in package.component.pins if p.electrical == "power_in"}
        number, net = next((n, t) for n, t in spot.component.nets.items() if t in supply)
        pad, pin = spot.pad(number), package.pad(supply[net])
        assert abs(pad[0] - pin[0]) + abs(pad[1] - pin[1]) < 10.0


def placed(made: Project) -> Placement:
    return place(made.circuit, [c for c in made.components if View.BOARD in c.views])


@pytest.mark.parametrize("name", quick(CASES, 3))
def test_the_pads_of_a_summing_node_stand_together(name: str) -> None:
    """25 mm where parts are on the surface, 45 mm where they stand in holes."""
    made = case(name)
    spans = node_spans(made.circuit, placed(made))
    assert spans.keys() == {s.inverting for s in made.circuit.sections} - {"0"}
    assert max(spans.values()) < (45.0 if name == "through-hole" else 25.0)


@given(st.sets(st.tuples(st.integers(0, 9), st.integers(0, 9)), min_size=2, max_size=6))
def test_the_tree_of_a_node_is_the_shortest(points: set[tuple[int, int]]) -> None:
    apart = squareform(pdist(np.array(sorted(points), dtype=float)))
    assert shortest_tree(sorted(points)) == pytest.approx(minimum_spanning_tree(apart).sum())


@pytest.mark.parametrize("name", quick(CASES, 3))
def test_ids_are_given_once_and_references_lead_to_their_symbols(name: str) -> None:
    sheet, board = (part_of(name, end) for end in (".kicad_sch", ".kicad_pcb"))
    for tree in (sheet, board):
        ids = Counter(e.text(0) for e in tree.walk() if e.name == "uuid")
        assert [i for i, n in ids.items() if n > 1] == []
    owner = {s.get("uuid").text(0): prop(s, "Reference") for s in sheet.all("symbol")}
    for part in board.all("footprint"):
        if "board_only" in part.get("attr").atoms:
            assert prop(part, "Reference") in {"H1", "H2", "H3", "H4", "FID1", "FID2", "FID3"}
        else:
            assert owner[part.get("path").text(0).lstrip("/")] == prop(part, "Reference")


def test_the_same_design_makes_the_same_bytes() -> None:
    assert files(case("rectifier")) == case_files("rectifier")


def test_another_value_changes_a_few_lines() -> None:
    """Only the part's own value and what is ordered for it, and the revision."""
    circuit = CIRCUITS["paper"]
    parts = tuple(
        replace(p, value=12e3) if isinstance(p, Resistor) and p.name == "R100" else p
        for p in circuit.parts
    )
    assert parts != circuit.parts
    before = files(project(circuit, dc_trim="unfitted"))
    after = files(project(replace(circuit, parts=parts), dc_trim="unfitted"))
    assert before.keys() == after.keys()
    for name, text in before.items():
        one, other = text.splitlines(), after[name].splitlines()
        assert len(one) == len(other), name
        differ = [(a, b) for a, b in zip(one, other, strict=True) if a != b]
        most = {".kicad_pcb": 6, ".kicad_sch": 5}.get(Path(name).suffix, 4)
        assert len(differ) <= most, name
    assert before != after


def test_only_the_simulation_has_its_sources_and_the_board_its_fittings() -> None:
    made = case("paper")
    views = {c.reference: c.views for c in made.components}
    sheet = file(case_files("paper"), ".kicad_sch")
    seen = set()
    for symbol in sheet.all("symbol"):
        reference = prop(symbol, "Reference")
        said = {key: symbol.get(key).text(0) for key in ("exclude_from_sim", "in_bom", "on_board")}
        if reference in ("VM1", "VCC1", "VEE1"):
            assert said == {"exclude_from_sim": "no", "in_bom": "no", "on_board": "no"}
        elif not reference.startswith("#"):
            view = views[reference]
            assert said == {
                "exclude_from_sim": "no" if View.SIMULATION in view else "yes",
                "in_bom": "yes" if View.BOM in view else "no",
                "on_board": "yes" if View.BOARD in view else "no",
            }
        seen.add(reference)
    assert seen >= {*views, "VM1", "VCC1", "VEE1"}
    unfitted = {c.reference for c in made.components if not c.fitted}
    assert unfitted == {
        prop(s, "Reference") for s in sheet.all("symbol") if s.get("dnp").text(0) == "yes"
    }
    assert "RV901" in unfitted


def test_net_classes_name_summing_nodes_and_supplies() -> None:
    made = case_files("paper")
    name = next(n for n in made if n.endswith(".kicad_pro"))
    found = json.loads(made[name])["net_settings"]
    classes = {row["pattern"]: row["netclass"] for row in found["netclass_patterns"]}
    assert classes["/s2"] == "summing"
    assert {n for n, c in classes.items() if c == "supply"} == {"GND", "VCC", "VEE"}
    used = {net.text(1) for net in file(made, ".kicad_pcb").all("net")}
    assert set(classes) <= used
    assert set(classes.values()) < {c["name"] for c in found["classes"]}


def test_the_rules_of_the_board_are_in_the_project() -> None:
    made = case_files("paper")
    text = next(text for name, text in made.items() if name.endswith(".kicad_dru"))
    assert text == case("paper").rules
    assert len([e for e in read_all(text) if e.name == "rule"]) >= 6


@given(st.text())
def test_a_title_from_a_model_file_stays_a_title(title: str) -> None:
    shown = safe_text(title)
    assert shown.isprintable()
    assert "${" not in shown
    name = project_name(title)
    assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", name)
    assert len(name) <= LONGEST


def test_a_title_with_everything_that_could_end_it_is_written_and_read() -> None:
    title = 'a "title") (text ".include x" \\ ${HOME} \n.tran 1 2'
    made = files(replace(case("paper"), title=title))
    sheet, board = (file(made, end) for end in (".kicad_sch", ".kicad_pcb"))
    for tree in (sheet, board):
        shown = tree.get("title_block").get("title").text(0)
        assert shown == 'a "title") (text ".include x" \\ $ {HOME} .tran 1 2'
    texts = [t.text(0) for t in sheet.all("text")]
    assert not any("include" in text for text in texts)


def test_names_of_nets_lead_back() -> None:
    for circuit in CIRCUITS.values():
        for net in (*circuit.nets, "0"):
            assert circuit_net(kicad_net(net)) == net


@pytest.mark.slow
def test_each_footprint_of_the_board_is_in_the_project_s_library() -> None:
    for name in CASES:
        made = case_files(name)
        used = {f.text(0) for f in file(made, ".kicad_pcb").all("footprint")}
        held = {n for n in made if n.endswith(".kicad_mod")}
        wanted = {f"designer.pretty/{u.removeprefix('designer:')}.kicad_mod" for u in used}
        assert held == wanted
        for component in case(name).components:
            if View.BOARD in component.views:
                pads = {pad.number for pad in footprint(component.footprint).pads}
                assert pads >= {pin.number for pin in component.pins}
                assert f"designer:{footprint_name(component.footprint)}" in used
