"""Rules on a board: what is read from its file, what KiCad says, and when nothing counts."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, strategies as st
from scipy.optimize import brentq
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial.distance import pdist, squareform

from designer.base.errors import InputError
from designer.base.views import View
from designer.board import kicad_rules
from designer.board.component import Component, joined
from designer.board.kicad_names import kicad_net
from designer.board.kicad_reader import MOST_LAID, BoardFile, check_belongs, read_board
from designer.board.kicad_rules import CustomRule, rules_text, spacing
from designer.board.sexpr import Expression, expression, expression_text, read, read_all
from designer.catalog.design_rule import FAIL, NOT_RUN, PASS, Override, RuleOutcome
from designer.catalog.design_rules import RULES
from designer.design_rules import kicad_drc, on_board, on_fab
from designer.design_rules.kicad_drc import DesignRuleCheck
from designer.design_rules.kicad_program import KicadFailed
from designer.folders import kicad_files
from designer.jobs import rules_job
from tests.circuit.test_reduction import EXACT
from tests.shared.exploring import quick
from tests.shared.rule_cases import base, generic
from tests.shared.stages import stage

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

BY_KICAD = (
    "clearance",
    "summing-clearance",
    "pad-clearance",
    "component-spacing",
    "summing-length",
    "summing-vias",
    "supply-width",
)
"""Rules whose pair is a board that breaks them in KiCad's check, and one that just keeps them."""
BY_REPORT = ("unconnected", "short-circuit", "kicad-errors", "schematic-parity")
"""Rules that KiCad's check says by itself: the pairs stand in
tests/design_rules/test_rules_copper.py and tests/design_rules/test_kicad_errors.py."""
OF_PARTS = ("part-value", "part-number", "part-footprint", "part-fitted", "pin-hole")
"""Rules on the parts: the pairs stand in tests/design_rules/test_rules_parts.py."""
OF_FIGURES = ("mounting-holes", "board-thickness", "board-layers")
"""Rules on figures of the board: the pairs stand in tests/design_rules/test_on_fab.py."""
BY_FAB = tuple(on_fab.READ)
"""Rules by what a fab makes: the pairs stand in tests/design_rules/test_on_fab.py."""
ON_PLACES = ("decoupling-distance", "summing-span", "board-outline")
BY_READING = (*ON_PLACES, *OF_PARTS, *OF_FIGURES, *BY_FAB)
NOTHING: Mapping[str, int] = {}


@cache
def drawn() -> str:
    """The exported board of the design that pairs start from: placed, not routed."""
    files = kicad_files.texts(base().synthesis)
    return next(text for name, text in files.items() if name.endswith(".kicad_pcb"))


@cache
def whole() -> Expression:
    """The same as it is read."""
    return read(drawn())


def custom(**limits: float) -> tuple[CustomRule, ...]:
    """The custom rules of that design, some with other limits."""
    said = {name.replace("_", "-"): Override(limit, "a test") for name, limit in limits.items()}
    return kicad_rules.board_rules(base().circuit, said)


def board_of(text: str, folder: Path) -> BoardFile:
    """A board's text as it is read from a file."""
    path = folder / "some.kicad_pcb"
    path.write_text(text, encoding="utf-8")
    return read_board(path)


def edited(change: Any) -> str:
    """The exported board with every list of its top level changed, or left out for None."""
    items = [change(i) if isinstance(i, Expression) else i for i in whole().items]
    return expression_text(Expression(tuple(i for i in items if i is not None)))


def reference(footprint: Expression) -> str:
    return next(p.text(1) for p in footprint.all("property") if p.text(0) == "Reference")


def renamed(old: str, new: str) -> str:
    return drawn().replace(f'(property "Reference" "{old}"', f'(property "Reference" "{new}"')


def with_items(*items: Expression) -> str:
    return expression_text(Expression((*whole().items, *items)))


def track(net: str, width: float, length: float, y: float = -20.0) -> Expression:
    """A track on one of the board's nets, aside."""
    numbers = {n.text(1): n.text(0) for n in whole().all("net")}
    return expression(
        "segment",
        expression("start", -50.0, y),
        expression("end", -50.0 + length, y),
        expression("width", width),
        expression("layer", "F.Cu"),
        expression("net", int(numbers[kicad_net(net)])),
    )


def by_id(outcomes: tuple[RuleOutcome, ...]) -> dict[str, RuleOutcome]:
    return {o.rule.id: o for o in outcomes}


def looked(text: str, folder: Path) -> dict[str, RuleOutcome]:
    """What the rules say of a board of the design."""
    board = board_of(text, folder)
    return by_id(on_board.checked(board, base().components, custom(), {}, generic()))


@cache
def small() -> str:
    """A board of four components only."""
    kept = ("U1", "C903", "C904", "R4")
    return edited(lambda i: i if i.name != "footprint" or reference(i) in kept else None)


def refused(text: str, folder: Path) -> InputError:
    """The error of a board that cannot be read or is of another design."""
    with pytest.raises(InputError) as error:
        check_belongs(board_of(text, folder), base().components)
    assert error.value.exit_status == 2
    return error.value


# ---------------------------------------------------------------------------------------------
# The file


def test_the_exported_board_is_of_its_design(tmp_path: Path) -> None:
    board = board_of(drawn(), tmp_path)
    check_belongs(board, base().components)
    assert not board.tracks
    assert not board.vias
    assert not board.routed
    listed = {c.reference: c for c in base().components}
    holes = {footprint.reference for footprint in board.footprints} - listed.keys()
    assert holes == {"H1", "H2", "H3", "H4", "FID1", "FID2", "FID3"}
    for footprint in (each for each in board.footprints if each.reference not in holes):
        there = {p.number: p.net for p in footprint.pads if p.net}
        assert there == {n: net for n, net in listed[footprint.reference].nets.items() if net}
        assert footprint.courtyard


@pytest.mark.slow
def test_a_board_of_another_design_is_told_apart(tmp_path: Path) -> None:
    saturating = replace(base().synthesis, design=replace(base().synthesis.design, circuit=stage(
        "saturation", "both", {n: v if n[0] == "C" else 10e3 for n, v in EXACT.items()}
    )))  # fmt: skip
    files = kicad_files.texts(saturating)
    text = next(text for name, text in files.items() if name.endswith(".kicad_pcb"))
    said = refused(text, tmp_path)
    assert said.field == "footprints"
    assert "without D200, D201, D202, D203" in str(said)
    assert "with R210" in str(said)


def test_other_references_are_named(tmp_path: Path) -> None:
    said = refused(renamed("R4", "R4X"), tmp_path)
    assert "without R4; with R4X" in str(said)
    twice = refused(renamed("R4", "R5"), tmp_path)
    assert "R5 twice" in str(twice)


def test_pins_on_other_nets_are_named(tmp_path: Path) -> None:
    def exchange(item: Expression) -> Expression:
        if item.name != "footprint" or reference(item) != "R4":
            return item
        text = expression_text(item)
        first, second = (f'"{kicad_net(n)}"' for n in ("v1", "s2"))
        return read(text.replace(first, '"?"').replace(second, first).replace('"?"', second))

    said = refused(edited(exchange), tmp_path)
    assert said.field == "nets"
    assert "R4.1 on s2, not on v1; R4.2 on v1, not on s2" in str(said)


def test_a_mounting_hole_may_be_there_besides(tmp_path: Path) -> None:
    hole = expression(
        "footprint",
        "MountingHole:MountingHole_3.2mm_M3",
        expression("layer", "F.Cu"),
        expression("at", -10.0, -10.0),
        expression("property", "Reference", "H1"),
    )
    check_belongs(board_of(with_items(hole), tmp_path), base().components)


def test_a_newer_board_and_an_older_one_are_refused(tmp_path: Path) -> None:
    said = refused(drawn().replace("(version 20241229)", "(version 20260901)"), tmp_path)
    assert said.field == "version"
    assert "from a newer one" in str(said)
    said = refused(drawn().replace("(version 20241229)", "(version 20171130)"), tmp_path)
    assert "save the board with KiCad 9" in str(said)
    said = refused(drawn().replace("(version 20241229)", "(version new)"), tmp_path)
    assert "a file version" in str(said)


@pytest.mark.parametrize(
    ("drawn_item", "count", "found"),
    [
        ("(via (at 1 1) (size 0.6) (drill 0.3) (net 1))", MOST_LAID + 1, "tracks and vias"),
        ("(zone (net 1) (polygon (pts (xy 0 0) (xy 1 0) (xy 1 1))))", 1001, "outlines have 3003"),
    ],
)
def test_a_board_of_too_much_copper_is_refused_at_once(
    tmp_path: Path, drawn_item: str, count: int, found: str
) -> None:
    """20,000 vias and a zone that crossed itself 20,000 times kept the rules busy for minutes."""
    said = refused(small().rstrip()[:-1] + count * drawn_item + ")", tmp_path)
    assert found in str(said)


@given(cut=st.floats(0.0, 0.999))
def test_a_board_that_is_cut_off_is_refused(
    tmp_path_factory: pytest.TempPathFactory, cut: float
) -> None:
    text = small()[: int(cut * (len(small()) - 2))]
    with pytest.raises(InputError, match=r"some\.kicad_pcb"):
        board_of(text, tmp_path_factory.mktemp("cut"))


@given(at=st.floats(0.0, 0.999), put=st.sampled_from(["(", ")", '"', "x", " nan ", "()", "\x00"]))
def test_a_damaged_board_is_read_or_refused_but_never_more(
    tmp_path_factory: pytest.TempPathFactory, at: float, put: str
) -> None:
    place = int(at * len(small()))
    text = small()[:place] + put + small()[place:]
    there = [c for c in base().components if f'"{c.reference}"' in small()]
    with contextlib.suppress(InputError):
        board = board_of(text, tmp_path_factory.mktemp("damaged"))
        check_belongs(board, there)
        list(on_board.decoupling_distance(board, there))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "0 expressions"),
        (b"(kicad_sch (version 20250114))", "kicad_sch"),
        (b"\xff\xfe\x00", "UTF-8"),
        (b"(kicad_pcb)", "version"),
        (b"PCBNEW-BOARD Version 1", "PCBNEW"),
    ],
)
def test_what_is_no_board(tmp_path: Path, content: bytes, said: str) -> None:
    path = tmp_path / "some.kicad_pcb"
    path.write_bytes(content)
    with pytest.raises(InputError, match=said):
        read_board(path)


def test_what_is_no_file(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "none.kicad_pcb"):
        with pytest.raises(InputError, match="--board"):
            read_board(path)


def test_tracks_arcs_vias_and_zones_are_read(tmp_path: Path) -> None:
    numbers = {n.text(1): int(n.text(0)) for n in whole().all("net")}
    arc = expression("arc", start=(0.0, 0.0), mid=(1.0, 1.0), end=(2.0, 0.0), net=numbers["/s1"])
    via = expression("via", at=(0.0, 0.0), net=numbers["/s2"])
    zone = expression("zone", net=numbers["GND"])
    board = board_of(with_items(track("s2", 0.3, 7.0), arc, via, zone), tmp_path)
    assert board.tracks == ("s2", "s1")
    assert (board.vias, board.zones) == (("s2",), ("0",))
    assert board.routed == {"s1", "s2", "0"}


# ---------------------------------------------------------------------------------------------
# Read from the file


def shifted(name: str, by: tuple[float, float]) -> str:
    """The exported board with one component moved [mm]."""

    def moved(item: Expression) -> Expression:
        if item.name != "footprint" or reference(item) != name:
            return item
        at = item.get("at")
        turn = at.number(2) if len(at.atoms) > 2 else None
        new = expression("at", at.number(0) + by[0], at.number(1) + by[1], turn)
        return Expression(tuple(new if i is at else i for i in item.items))

    return edited(moved)


def by_reading(text: str, folder: Path) -> dict[str, RuleOutcome]:
    """What is said of a board without KiCad."""
    board = board_of(text, folder)
    return by_id(on_board.on_board(board, base().components, custom(), {}, "not asked", generic()))


def decoupled(distance: float, folder: Path) -> RuleOutcome:
    """C903 moved so that its nearer pad is this far from U1's V+."""
    board = board_of(drawn(), folder)
    pin = next(p for p in board.pads("U1") if p.net == "vcc")
    pad = next(p for p in board.pads("C903") if p.net == "vcc")
    by = pin.at[0] + distance - pad.at[0], pin.at[1] - pad.at[1]
    return by_reading(shifted("C903", by), folder)["decoupling-distance"]


def test_a_far_decoupling_capacitor_is_caught_and_a_near_miss_is_not(tmp_path: Path) -> None:
    far = decoupled(10.05, tmp_path)
    assert (far.status, far.where) == (FAIL, "U1.4")
    assert far.value == pytest.approx(10.05, abs=1e-5)
    near = decoupled(9.95, tmp_path)
    assert near.status == PASS
    assert "read from the board file" in near.found


def test_a_capacitor_on_the_other_rail_does_not_decouple_this_one(tmp_path: Path) -> None:
    listed = [c for c in base().components if c.reference != "C903"]
    board = board_of(drawn(), tmp_path)
    found = by_id(on_board.on_board(board, listed, custom(), {}, "not asked", generic()))
    assert found["decoupling-distance"].status == NOT_RUN


def spanning(length: float) -> tuple[str, str]:
    """A node of R4, and the exported board with R4 moved to where the node's tree is this long."""
    r4 = next(c for c in base().components if c.reference == "R4")
    (node,) = {pin.net for pin in r4.pins} & {s.inverting for s in base().circuit.sections}
    pads = [
        (reference(item), place)
        for item in whole().all("footprint")
        for place, pad in zip(pads_of(reference(item)), item.all("pad"), strict=True)
        if (net := pad.find("net")) is not None and net.text(1) == kicad_net(node)
    ]

    def tree(down: float) -> float:
        places = [(x, y + down * (name == "R4")) for name, (x, y, *_) in pads]
        return float(minimum_spanning_tree(squareform(pdist(places))).sum())

    down = brentq(lambda by: tree(by) - length, 10.0, 200.0)
    return node, shifted("R4", (0.0, down))


def test_a_far_part_of_a_summing_node_is_caught_and_a_near_miss_is_not(tmp_path: Path) -> None:
    """The tree by scipy; in holes a node may be larger."""
    node, text = spanning(25.05)
    far = by_reading(text, tmp_path)["summing-span"]
    assert (far.status, far.where, far.limit) == (FAIL, node, 25.0)
    assert far.value == pytest.approx(25.05, abs=1e-5)
    nodes = {s.inverting for s in base().circuit.sections} - {"0"}
    assert all(re.search(rf"\b{name} \d+\.\d\b", far.found) for name in nodes)
    near = by_reading(spanning(24.95)[1], tmp_path)["summing-span"]
    assert near.status == PASS
    axial = "Resistor_THT:R_Axial_DIN0207_L6.3mm_D2.5mm_P10.16mm_Horizontal"
    listed = [replace(c, footprint=axial) if c.reference == "R4" else c for c in base().components]
    for length, status in ((44.95, PASS), (45.05, FAIL)):
        board = board_of(spanning(length)[1], tmp_path)
        found = by_id(on_board.on_board(board, listed, custom(), {}, "not asked", generic()))[
            "summing-span"
        ]
        assert (found.status, found.limit) == (status, 45.0)


def edge() -> tuple[Expression, dict[str, float]]:
    """The outline of the exported board, a rectangle, and where its sides are [mm]."""
    found = next(i for i in whole().all("gr_rect"))
    (left, top), (right, bottom) = ((p.number(0), p.number(1)) for p in
                                    (found.get("start"), found.get("end")))  # fmt: skip
    return found, {"left": left, "top": top, "right": right, "bottom": bottom}


def pads_of(name: str) -> list[tuple[float, float, float, float]]:
    """Centre and half sizes of a component's pads as the file states them, the component turned by
    whole right angles."""
    out = []
    footprint = next(i for i in whole().all("footprint") if reference(i) == name)
    at = footprint.get("at")
    turn = round(at.number(2) if len(at.atoms) > 2 else 0.0) % 360
    for pad in footprint.all("pad"):
        x, y = pad.get("at").number(0), pad.get("at").number(1)
        w, h = (pad.get("size").number(i) / 2.0 for i in (0, 1))
        c, s = {0: (1, 0), 90: (0, 1), 180: (-1, 0), 270: (0, -1)}[turn]
        place = at.number(0) + x * c + y * s, at.number(1) - x * s + y * c
        out.append((*place, *((w, h) if s == 0 else (h, w))))
    return out


def at_edge(gap: float, folder: Path, name: str = "R4", side: str = "right") -> RuleOutcome:
    """A component moved so that its outermost copper is this far inside one side of the board."""
    limits = edge()[1]
    if side == "right":
        by = limits["right"] - gap - max(x + w for x, _, w, _ in pads_of(name)), 0.0
    else:
        by = 0.0, limits["top"] + gap - min(y - h for _, y, _, h in pads_of(name))
    return by_reading(shifted(name, by), folder)["board-outline"]


@pytest.mark.parametrize(
    ("name", "side"), quick([("R4", "right"), ("C903", "top"), ("U1", "right")])
)
def test_a_part_past_the_edge_is_caught_and_a_near_miss_is_not(
    tmp_path: Path, name: str, side: str
) -> None:
    for gap in (0.45, 0.01, -1.0, -50.0):
        past = at_edge(gap, tmp_path, name, side)
        assert past.status == FAIL
        assert past.where.startswith(f"{name}.")
        # Across the edge from 0 on; outside, by how far the outermost copper is.
        assert past.value == pytest.approx(gap, abs=1e-5)
    near = at_edge(0.55, tmp_path, name, side)
    assert near.status == PASS
    assert near.value == pytest.approx(0.55, abs=1e-5)
    assert "read from the board file" in near.found


def reshaped(name: str, number: str, change: Any) -> str:
    """The exported board with the text of one pad of one component changed."""

    def pad(item: Any) -> Any:
        if isinstance(item, Expression) and item.name == "pad" and item.text(0) == number:
            return read(change(expression_text(item)))
        return item

    def footprint(item: Expression) -> Expression:
        if item.name != "footprint" or reference(item) != name:
            return item
        return Expression(tuple(pad(i) for i in item.items))

    return edited(footprint)


def custom_pad(*primitives: str) -> Any:
    """To a custom pad of a small round anchor and these primitives."""

    def change(text: str) -> str:
        shape = re.sub(r"^\(pad (\S+) (\S+) \S+", r"(pad \1 \2 custom", text.strip())
        shape = re.sub(r"\(size [^)]*\)", "(size 0.2 0.2)", shape)
        shape = re.sub(r"\(roundrect_rratio [^)]*\)", "", shape)
        options = "(options (clearance outline) (anchor circle))"
        return f"{shape[:-1]} {options} (primitives {' '.join(primitives)}))"

    return change


def with_offset(text: str) -> str:
    """The copper 0.7 mm along and 0.4 mm across the pad."""
    return f"{text.strip()[:-1]} (drill (offset 0.7 0.4)))"


SHAPES: dict[str, tuple[Any, tuple[float, float, float, float]]] = {
    "polygon": (
        custom_pad("(gr_poly (pts (xy -1 -0.5) (xy 1.6 -0.5) (xy 1 2)) (width 0.2) (fill yes))"),
        (-1.1, -0.6, 1.7, 2.1),
    ),
    "line, circle and arc": (
        custom_pad(
            "(gr_line (start 0 0) (end 0 -1.5) (width 0.4))",
            "(gr_circle (center 0.5 0) (end 1 0) (width 0) (fill yes))",
            "(gr_arc (start 0 1) (mid -1 0) (end 0 -1) (width 0.2))",
        ),
        (-1.1, -1.7, 1.0, 1.1),
    ),
    "rectangle": (
        custom_pad("(gr_rect (start -0.3 -2) (end 0.3 0.5) (width 0.1) (fill yes))"),
        (-0.35, -2.05, 0.35, 0.55),
    ),
}
"""Pads, and how far each reaches in its own frame: left, top, right, bottom [mm]."""


@pytest.mark.parametrize("name", ["R4"])
@pytest.mark.parametrize("shape", SHAPES)
def test_a_custom_pad_reaches_as_far_as_its_primitives(
    tmp_path: Path, name: str, shape: str
) -> None:
    change, reach = SHAPES[shape]
    board = board_of(reshaped(name, "2", change), tmp_path)
    ((at, turn),) = [(p.at, angle_of(name)) for p in board.pads(name) if p.number == "2"]
    (found,) = [p.corners for p in board.pads(name) if p.number == "2"]
    left, top, right, bottom = turned_box(reach, turn)
    assert min(x for x, _ in found) == pytest.approx(at[0] + left, abs=2e-3)
    assert max(x for x, _ in found) == pytest.approx(at[0] + right, abs=2e-3)
    assert min(y for _, y in found) == pytest.approx(at[1] + top, abs=2e-3)
    assert max(y for _, y in found) == pytest.approx(at[1] + bottom, abs=2e-3)


def angle_of(name: str) -> int:
    """A footprint's angle on the board, a whole number of right angles."""
    at = next(i for i in whole().all("footprint") if reference(i) == name).get("at")
    return round(at.number(2) if len(at.atoms) > 2 else 0.0) % 360


def turned_box(
    reach: tuple[float, float, float, float], turn: int
) -> tuple[float, float, float, float]:
    """The box after right angles counter-clockwise as seen, y downwards: (x, y) to (y, -x)."""
    left, top, right, bottom = reach
    for _ in range(turn // 90):
        left, top, right, bottom = top, -right, bottom, -left
    return left, top, right, bottom


@pytest.mark.parametrize("name", ["R4"])
def test_copper_that_is_off_its_hole_is_looked_for_where_it_is(tmp_path: Path, name: str) -> None:
    plain, moved = (
        next(p for p in board_of(text, tmp_path).pads(name) if p.number == "1")
        for text in (drawn(), reshaped(name, "1", with_offset))
    )
    by = turned_box((0.7, 0.4, 0.7, 0.4), angle_of(name))[:2]
    assert moved.at == plain.at
    for old, new in zip(plain.corners, moved.corners, strict=True):
        assert (new[0] - old[0], new[1] - old[1]) == pytest.approx(by, abs=1e-6)


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("roundrect", "trapezoid", 1),
        lambda text: f"{text.strip()[:-1]} (padstack (mode front_inner_back)))",
        custom_pad('(gr_text "A" (at 0 0))'),
    ],
)
def test_a_pad_whose_shape_is_not_read_passes_nothing(tmp_path: Path, change: Any) -> None:
    found = by_reading(reshaped("R4", "1", change), tmp_path)["board-outline"]
    assert found.status == NOT_RUN
    assert found.found == "R4.1 has a shape that is not read"


def test_without_an_edge_or_with_a_gap_in_it_nothing_is_passed(tmp_path: Path) -> None:
    box = edge()[1]
    edges = whole().all("gr_rect")
    bare = Expression(tuple(i for i in whole().items if i not in edges))
    found = by_reading(expression_text(bare), tmp_path)["board-outline"]
    assert found.status == FAIL
    assert "no edge" in found.found
    corners = [(box["left"], box["top"]), (box["right"], box["top"]),
               (box["right"], box["bottom"]), (box["left"], box["bottom"])]  # fmt: skip

    def drawn_in_lines(gap: float) -> str:
        lines = [
            expression(
                "gr_line",
                expression("start", *a),
                expression("end", *b),
                expression("layer", "Edge.Cuts"),
            )
            for a, b in zip(corners, [*corners[1:], (corners[0][0] + gap, corners[0][1])],
                            strict=True)
        ]  # fmt: skip
        return expression_text(Expression((*bare.items, *lines)))

    assert by_reading(drawn_in_lines(0.0), tmp_path)["board-outline"].status == PASS
    found = by_reading(drawn_in_lines(0.5), tmp_path)["board-outline"]
    assert found.status == FAIL
    assert "not closed" in found.found


@pytest.mark.kicad
def test_kicad_measures_the_same_distance_from_the_edge(tmp_path: Path) -> None:
    """Its own rule, at the gap between a pad and the edge: it stays silent of what is outside."""
    rule = CustomRule("edge", "edge_clearance", 2.0, True)
    limits = edge()[1]
    right = max(x + w for x, _, w, _ in pads_of("R4"))
    text = shifted("R4", (limits["right"] - 0.45 - right, 0.0))
    told = kicad_drc.report(text, rules_text((rule,)), tmp_path / "near")
    said = [v for v in kicad_drc.violations(told, (rule,)) if "R4" in v.where]
    here = by_reading(text, tmp_path)["board-outline"].value
    assert min(v.actual for v in said) == pytest.approx(here, abs=0.005)
    told = kicad_drc.report(shifted("R4", (500.0, 0.0)), rules_text((rule,)), tmp_path / "outside")
    assert not [v for v in kicad_drc.violations(told, (rule,)) if "R4" in v.where]


# ---------------------------------------------------------------------------------------------
# Never a pass by itself


def test_without_a_board_nothing_is_run() -> None:
    found = on_board.without_board(custom(), {})
    assert {o.rule.id for o in found} == {*BY_KICAD, *BY_REPORT, *BY_READING}
    assert {o.status for o in found} == {NOT_RUN}
    assert all("no board" in o.found for o in found)
    assert by_id(found)["clearance"].limit_text == "at least 0.2 mm"


def test_without_kicad_only_what_is_read_is_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    found = rules_job.checked(base().synthesis, board_of(drawn(), tmp_path))
    assert found.kicad is None
    of_board = {o.rule.id: o for o in found.outcomes if o.rule.scope == "board"}
    for id_ in (*BY_KICAD, *BY_REPORT):
        assert of_board[id_].status == NOT_RUN
        assert "not installed" in of_board[id_].found
    not_read = {id_ for id_ in BY_READING if of_board[id_].status != PASS}
    assert not_read == {"fab-track", "board-layers"}  # the board has no track yet


def program(folder: Path, script: str) -> None:
    """Something in the place of kicad-cli."""
    path = folder / "kicad-cli"
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)


@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("echo 8.0.4", "older than KiCad 9"),
        ("echo something", "older than KiCad 9"),
        ('[ "$1" = --version ] && echo 9.0.0; echo no such board >&2; exit 3', "no such board"),
        ('[ "$1" = --version ] && echo 9.0.0; while [ $# -gt 1 ]; do shift; [ "$1" = --output ] '
         '&& echo "{" > "$2"; done', "no JSON"),
        ('[ "$1" = --version ] && echo 9.0.0; while [ $# -gt 1 ]; do shift; [ "$1" = --output ] '
         '&& echo "[]" > "$2"; done', "another kind"),
        # A KiCad that has dropped every rule finds nothing.
        ('[ "$1" = --version ] && echo 9.0.0; while [ $# -gt 1 ]; do shift; [ "$1" = --output ] '
         '&& echo "{\\"violations\\": [], \\"unconnected_items\\": []}" > "$2"; done',
         "dropped the custom rules"),
        # One that writes no list of open connections may not pass for one that has found none.
        ('[ "$1" = --version ] && echo 9.0.0; while [ $# -gt 1 ]; do shift; [ "$1" = --output ] '
         '&& echo "{\\"violations\\": []}" > "$2"; done', "another kind"),
    ],
)  # fmt: skip
def test_a_kicad_that_gives_no_answer_passes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, script: str, said: str
) -> None:
    program(tmp_path, script)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    with pytest.raises(KicadFailed, match=said):
        kicad_drc.check(board_of(drawn(), tmp_path), custom())
    found = looked(drawn(), tmp_path)
    assert {found[id_].status for id_ in (*BY_KICAD, *BY_REPORT)} == {NOT_RUN}


def answer(*misunderstood: str, unconnected: Mapping[str, int] = NOTHING) -> DesignRuleCheck:
    """KiCad has found nothing but these open connections."""
    return DesignRuleCheck("9.0.0", (), frozenset(misunderstood), unconnected)


def on_drawn(text: str, folder: Path, told: DesignRuleCheck) -> dict[str, RuleOutcome]:
    board = board_of(text, folder)
    return by_id(on_board.on_board(board, base().components, custom(), {}, told, generic()))


def test_a_rule_that_kicad_does_not_understand_is_not_run(tmp_path: Path) -> None:
    found = on_drawn(drawn(), tmp_path, answer("pad-clearance"))
    assert found["pad-clearance"].status == NOT_RUN
    assert "does not report" in found["pad-clearance"].found
    assert found["component-spacing"].status == PASS


def test_what_is_not_routed_is_not_passed(tmp_path: Path) -> None:
    found = on_drawn(drawn(), tmp_path, answer())
    for id_ in ("clearance", "summing-length", "summing-vias", "supply-width"):
        assert found[id_].status == NOT_RUN
    part = with_items(track("s1", 0.3, 5.0), track("vcc", 0.3, 5.0))
    found = on_drawn(part, tmp_path, answer(unconnected={"s2": 3, "0": 12}))
    assert found["clearance"].status == PASS
    assert found["summing-length"].found == "not routed yet: s2"
    assert found["supply-width"].found == "not routed yet: GND"
    assert found["unconnected"].status == FAIL
    assert found["unconnected"].value == 15.0
    assert found["unconnected"].found == "15; not routed: GND (12), s2 (3)"
    found = on_drawn(part, tmp_path, answer())
    assert found["summing-length"].status == PASS
    assert found["unconnected"].status == PASS


def test_footprints_without_a_courtyard_leave_the_spacing_open(tmp_path: Path) -> None:
    def bare(item: Expression) -> Expression:
        if item.name != "footprint" or reference(item) != "R4":
            return item
        kept = [
            i
            for i in item.items
            if not (
                isinstance(i, Expression) and any(c.text() == "F.CrtYd" for c in i.all("layer"))
            )
        ]
        return Expression(tuple(kept))

    found = on_drawn(edited(bare), tmp_path, answer())["component-spacing"]
    assert found.status == NOT_RUN
    assert "R4" in found.found


# ---------------------------------------------------------------------------------------------
# The rules in KiCad's words


def test_the_table_of_ipc_2221() -> None:
    """Steps of table 6-1, columns B2 and A6: at each step and just past it."""
    assert spacing(15.0) == (0.1, 0.13)
    assert spacing(30.0) == (0.1, 0.25)
    assert spacing(30.1) == (0.6, 0.4)
    assert spacing(100.0) == (0.6, 0.5)
    assert spacing(500.0) == (2.5, 1.5)
    with pytest.raises(InputError, match="500 V"):
        spacing(501.0)


def test_a_higher_supply_widens_the_clearance() -> None:
    usual = {rule.id: rule.limit for rule in custom()}
    high = {r.id: r.limit for r in kicad_rules.board_rules(replace(base().circuit, supply=18.0))}
    assert (usual["clearance"], usual["pad-clearance"]) == (0.2, 0.25)
    assert (high["clearance"], high["pad-clearance"]) == (0.6, 0.4)


def test_the_text_reads_back_and_the_special_rule_comes_last() -> None:
    read_back = read_all(rules_text(custom()))
    assert [e.name for e in read_back] == ["version", *["rule"] * len(custom())]
    order = [e.text() for e in read_back[1:]]
    # Of two that fit, KiCad takes the later one.
    assert order.index("pad-clearance") > order.index("clearance")


def test_rules_name_the_nets_of_the_circuit() -> None:
    rule = next(r for r in custom() if r.id == "summing-length")
    assert set(rule.nets) == {kicad_net(s.inverting) for s in base().circuit.sections}
    assert all(f"A.NetName == '{net}'" in rule.condition for net in rule.nets)


def test_widths_are_told_by_limit_and_net() -> None:
    """A width's violation names the board's setup in the place of the rule."""
    said = "Track width (board setup constraints min width 0.3000 mm; actual 0.2000 mm)"
    place = {"pos": {"x": 1.0, "y": 2.0}, "description": "Track [VCC] on F.Cu, length 5.0 mm"}
    elsewhere = {**place, "description": "Track [/v1] on F.Cu, length 5.0 mm"}

    def found(words: str, item: dict[str, Any], type_: str = "track_width") -> list[str]:
        one = {"type": type_, "description": words, "items": [item]}
        return [v.rule for v in kicad_drc.violations({"violations": [one]}, custom())]

    assert found(said, place) == ["supply-width"]
    assert found(said, elsewhere) == []
    assert found(said.replace("0.3000", "0.1500"), place) == []
    named = "Clearance violation (rule 'clearance' clearance 0.2000 mm; actual 0.1000 mm)"
    assert found(named, place, "clearance") == ["clearance"]
    assert found(named.replace("'clearance'", "'somebody else'"), place, "clearance") == []


def test_places_are_said_in_printable_words() -> None:
    one = {
        "type": "clearance",
        "description": "(rule 'clearance' clearance 0.2 mm; actual 0.1 mm)",
        "items": [{"description": "Pad\x1b[31m 1", "pos": {"x": 1.5, "y": 2.0}}],
    }
    (found,) = kicad_drc.violations({"violations": [one]}, custom())
    assert found.where == "Pad?[31m 1 (1.5 mm, 2.0 mm)"
    assert found.actual == 0.1


# ---------------------------------------------------------------------------------------------
# With KiCad


@cache
def examples(*, breaking: bool, folder: Path) -> dict[str, RuleOutcome]:
    """What the rules say of a board whose examples break them, or just keep them."""
    folder.mkdir(exist_ok=True)
    board = board_of(kicad_drc.specimen(custom(), breaking=breaking), folder)
    listed: list[Component] = []
    return by_id(
        on_board.on_board(board, listed, custom(), {}, kicad_drc.check(board, custom()), generic())
    )


@pytest.fixture(scope="module")
def scratch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("examples")


@pytest.mark.kicad
@pytest.mark.parametrize("id_", BY_KICAD)
def test_a_board_that_breaks_the_rule_is_caught_and_a_near_miss_is_not(
    id_: str, scratch: Path
) -> None:
    caught = examples(breaking=True, folder=scratch / "breaking")[id_]
    assert caught.status == FAIL, caught.found
    rule = next(r for r in custom() if r.id == id_)
    # A tenth past the limit, a count one past it; a courtyard's line has a width.
    expected = rule.limit * (0.9 if rule.least else 1.1)
    assert caught.value == pytest.approx(3.0 if id_ == "summing-vias" else expected, abs=0.02)
    kept = examples(breaking=False, folder=scratch / "keeping")[id_]
    assert kept.status == PASS, kept.found


@pytest.mark.kicad
def test_one_syntax_error_drops_every_rule_and_is_noticed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The real KiCad says nothing of it and finds a board clean that breaks every rule."""

    def damaged(rules: Any) -> str:
        return rules_text(rules).replace("(constraint track_width", "(constraint track_wide", 1)

    text = kicad_drc.specimen(custom(), breaking=True)
    clean = kicad_drc.report(text, damaged(custom()), tmp_path / "damaged")
    assert kicad_drc.violations(clean, custom()) == ()
    monkeypatch.setattr(kicad_drc, "rules_text", damaged)
    with pytest.raises(KicadFailed, match="dropped the custom rules"):
        kicad_drc.check(board_of(drawn(), tmp_path), custom())
    found = looked(drawn(), tmp_path)
    assert {found[id_].status for id_ in BY_KICAD} == {NOT_RUN}
    assert all("dropped" in found[id_].found for id_ in BY_KICAD)


@pytest.mark.kicad
def test_a_property_that_kicad_does_not_know_is_noticed(tmp_path: Path) -> None:
    rules = tuple(
        replace(r, condition="A.Speed == 'fast'") if r.id == "supply-width" else r for r in custom()
    )
    found = kicad_drc.check(board_of(drawn(), tmp_path), rules)
    assert found.misunderstood == {"supply-width"}


@pytest.mark.kicad
def test_the_exported_board_keeps_what_can_be_looked_at(tmp_path: Path) -> None:
    found = looked(drawn(), tmp_path)
    assert not [o for o in found.values() if o.status == FAIL]
    assert found["pad-clearance"].status == PASS
    assert found["component-spacing"].status == PASS
    assert found["decoupling-distance"].status == PASS
    assert found["summing-length"].found.startswith("not routed yet: d1, d2, i1")
    assert found["supply-width"].found.startswith("not routed yet: GND")
    pads = joined(c for c in base().components if View.BOARD in c.views)
    count = sum(len(there) - 1 for there in pads.values())
    nets = sum(len(there) > 1 for there in pads.values())
    assert found["unconnected"].status == NOT_RUN
    assert (
        found["unconnected"].found
        == f"nothing is routed yet: {count} connections of {nets} nets are open"
    )
    assert found["short-circuit"].status == PASS


@pytest.mark.kicad
def test_what_a_drawn_board_breaks_is_found_on_it(tmp_path: Path) -> None:
    """A thin supply track and a long summing node, though nothing else is routed."""
    text = with_items(track("vcc", 0.29, 5.0), track("s2", 0.2, 50.5, -30.0))
    found = looked(text, tmp_path)
    assert found["supply-width"].status == FAIL
    assert found["supply-width"].value == 0.29
    assert "VCC" in found["supply-width"].where
    assert found["summing-length"].status == FAIL
    assert found["summing-length"].value == pytest.approx(50.5)
    assert found["clearance"].status == PASS


@pytest.mark.kicad
def test_severities_of_the_board_s_own_project_hide_nothing(tmp_path: Path) -> None:
    """A project beside the board that ignores every violation is not asked."""
    (tmp_path / "some.kicad_pro").write_text(
        '{"board": {"design_settings": {"rule_severities": {"track_width": "ignore"}}}}'
    )
    text = with_items(track("vcc", 0.29, 5.0))
    found = looked(text, tmp_path)
    assert found["supply-width"].status == FAIL


@pytest.mark.kicad
def test_pads_lie_where_kicad_puts_them(tmp_path: Path) -> None:
    """Turned footprints: KiCad's report gives the place of every pad that is not connected."""
    board = board_of(drawn(), tmp_path)
    answer = kicad_drc.report(drawn(), rules_text(custom()), tmp_path / "pads")
    read_here = {f"Pad {p.number} [{kicad_net(p.net)}] of {f.reference}": p.at
                 for f in board.footprints for p in f.pads}  # fmt: skip
    seen = 0
    for each in answer["unconnected_items"]:
        for item in each["items"]:
            name = next((n for n in read_here if f"{n} on" in item["description"]), None)
            if name is not None:
                at = item["pos"]["x"], item["pos"]["y"]
                assert at == pytest.approx(read_here[name], abs=1e-3), name
                seen += 1
    assert seen > 50


def test_every_rule_on_a_board_stands_in_a_pair() -> None:
    assert {*BY_KICAD, *BY_REPORT, *BY_READING} == {r.id for r in RULES if r.scope == "board"}
