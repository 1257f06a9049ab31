"""Routed boards without KiCad: what touches what, by shapes that the router did not make."""

from __future__ import annotations

import itertools
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, strategies as st

from designer.base.errors import InputError
from designer.board.kicad_names import circuit_net
from designer.board.kicad_rules import board_rules
from designer.board.sexpr import Expression, expression_text, read
from designer.routing.board_copper import BoardCopper, layer_count, read_copper, with_layers
from designer.routing.net_kinds import kinds_of_nets, net_kinds
from designer.routing.routed_board import RoutedBoard, cut_open, route_board
from tests.shared.answer_store import stored
from tests.shared.kicad_cases import case, case_files

NAME = "one mass"


def placed() -> str:
    return next(text for name, text in case_files(NAME).items() if name.endswith(".kicad_pcb"))


@cache
def routed() -> RoutedBoard:
    circuit = case(NAME).circuit
    made: RoutedBoard = stored(route_board)(placed(), circuit, board_rules(circuit))
    return made


@cache
def copper() -> BoardCopper:
    return read_copper(read(routed().text))


def test_every_net_is_one_piece() -> None:
    """The pads of a net, by tracks and vias that touch on a side, are all joined."""
    assert routed().open == {}
    for net in set(copper().nets) - {0}:
        pieces = [p for p in copper().pieces if p.net == net]
        sides = [
            shapely.union_all([p.shape for p in pieces if p.layers[layer]]) for layer in (0, 1)
        ]
        parts = [part for side in sides for part in shapely.get_parts(side)]
        through = [p.shape for p in pieces if p.layers == (True, True)]
        pads = shapely.union_all([p.shape for p in pieces if p.relief])
        parts.sort(key=lambda part: not shapely.intersects(part, pads))
        group, rest = parts[:1], parts[1:]
        while near := [
            part
            for part in rest
            if any(
                shapely.intersects(part, hole) and any(shapely.intersects(g, hole) for g in group)
                for hole in through
            )
        ]:
            group += near
            rest = [part for part in rest if not any(part is n for n in near)]
        # What is left are vias between the pours of ground.
        assert not any(shapely.intersects(part, pads) for part in rest), copper().nets[net]


def test_nets_stay_apart_as_their_classes_say() -> None:
    kinds = {kind.name: kind for kind in net_kinds(board_rules(case(NAME).circuit))}
    of = kinds_of_nets(case(NAME).circuit, copper().nets)
    for layer in (0, 1):
        nets = {
            net: shapely.union_all(
                [p.shape for p in copper().pieces if p.net == net and p.layers[layer]]
            )
            for net in copper().nets
        }
        tracks = {p.net for p in copper().pieces if not p.pad and p.layers[layer]}
        for one, other in itertools.combinations(sorted(nets), 2):
            if one in tracks or other in tracks:
                wanted = max(kinds[of[one]].clearance, kinds[of[other]].clearance)
                gap = shapely.distance(nets[one], nets[other])
                assert np.isnan(gap) or gap > wanted - 1e-3


def test_summing_nodes_are_short_and_stay_on_the_front() -> None:
    circuit = case(NAME).circuit
    nodes = {s.inverting for s in circuit.sections} - {"0"}
    assert max(routed().lengths.get(node, 0.0) for node in nodes) < 25.0
    vias = read(routed().text).all("via")
    names = copper().nets
    assert vias
    assert not nodes & {circuit_net(names[int(v.get("net").number())]) for v in vias}


@pytest.mark.slow
def test_the_same_board_twice_and_nothing_more_on_a_routed_one() -> None:
    circuit = case(NAME).circuit
    rules = board_rules(circuit)
    assert route_board(placed(), circuit, rules) == routed()
    again = route_board(routed().text, circuit, rules)
    assert again.text == routed().text
    assert (again.vias, sum(again.lengths.values())) == (0, 0.0)


@pytest.mark.slow
def test_what_is_routed_stays_and_what_is_open_is_routed() -> None:
    """Without the tracks of one net, and with a part that somebody has moved."""
    circuit = case(NAME).circuit
    board = read(routed().text)
    nets = {net.text(1): net.text(0) for net in board.all("net")}
    left = tuple(
        item
        for item in board.items
        if not (
            isinstance(item, Expression)
            and item.name in ("segment", "via")
            and item.get("net").text() == nets["/v1"]
        )
    )
    again = route_board(expression_text(Expression(left)), circuit, board_rules(circuit))
    assert again.open == {}
    assert {net for net, length in again.lengths.items() if length} == {"v1"}
    kept = {item.get("uuid").text(0) for item in Expression(left).all("segment")}
    assert kept <= {item.get("uuid").text(0) for item in read(again.text).all("segment")}


def test_a_net_that_nothing_leads_to_stays_open_and_touches_nothing() -> None:
    """A pad walled in by a ring of foreign copper on both sides."""
    wall = "".join(
        f'(segment (start {x0} {y0}) (end {x1} {y1}) (width 0.3) (layer "{layer}") (net 2))'
        for layer in ("F.Cu", "B.Cu")
        for x0, y0, x1, y1 in ((3, 3, 7, 3), (7, 3, 7, 7), (7, 7, 3, 7), (3, 7, 3, 3))
    )
    circuit = case(NAME).circuit
    answer = route_board(small(wall), circuit, board_rules(circuit))
    assert answer.open == {"v1": 1}
    assert answer.lengths.get("v1", 0.0) == 0.0
    free = route_board(small(""), circuit, board_rules(circuit))
    assert free.open == {}
    # 10 mm between the pads; a track may end at any place inside one.
    assert free.lengths["v1"] == pytest.approx(10.0, abs=1.0)


def test_a_board_without_an_edge_is_refused() -> None:
    circuit = case(NAME).circuit
    with pytest.raises(InputError, match=r"Edge\.Cuts"):
        route_board(small("").replace("Edge.Cuts", "Dwgs.User"), circuit, board_rules(circuit))


def small(more: str) -> str:
    """Two pads of one net, 10 mm apart."""
    pads = "".join(
        f'(footprint "p" (layer "F.Cu") (at {x} 5) (pad "1" smd rect (at 0 0) (size 1 1) '
        '(layers "F.Cu" "F.Mask") (net 1 "/v1")))'
        for x in (5, 15)
    )
    return (
        '(kicad_pcb (version 20241229) (net 0 "") (net 1 "/v1") (net 2 "/v2")'
        f'(gr_rect (start 0 0) (end 20 10) (layer "Edge.Cuts")){pads}{more})'
    )


@given(st.lists(st.tuples(st.integers(1, 18), st.integers(1, 18)), max_size=6, unique=True))
def test_a_pour_with_holes_is_one_line_of_the_same_area(corners: list[tuple[int, int]]) -> None:
    holes = shapely.union_all([shapely.box(x, y, x + 0.7, y + 0.6) for x, y in corners])
    whole = shapely.difference(shapely.box(0, 0, 20, 20), holes)
    line = cut_open(whole)
    x, y = line.T
    area = 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
    assert area == pytest.approx(float(whole.area))
    assert shapely.Polygon(line).buffer(0.0).symmetric_difference(whole).area < 1e-9


def bridges(board: str) -> int:
    """How many arms of the pour on the back reach the pad of ground at (10, 5)."""
    source = read(board)
    (zone,) = [z for z in source.all("zone") if z.get("layer").text() == "B.Cu"]
    rings = [
        [(p.number(0), p.number(1)) for p in each.get("pts").all("xy")]
        for each in zone.all("filled_polygon")
    ]
    pour = shapely.union_all([shapely.Polygon(ring).buffer(0.0) for ring in rings])
    round_pad = shapely.box(9.3, 4.3, 10.7, 5.7).exterior  # in the gap of the relief
    return len(shapely.get_parts(shapely.intersection(pour, round_pad)))


def test_a_pad_of_ground_has_thermal_bridges_and_none_where_two_find_no_room() -> None:
    """A pad of 1 mm in the open, and one between two tracks of another net."""
    pad = (
        '(footprint "g" (layer "F.Cu") (at 10 5) (pad "1" thru_hole rect (at 0 0) (size 1 1) '
        '(drill 0.5) (layers "*.Cu") (net 3 "GND"))) (net 3 "GND")'
    )
    walls = "".join(
        f'(segment (start {x} 3) (end {x} 7) (width 0.3) (layer "B.Cu") (net 2))' for x in (9, 11)
    )
    circuit = case(NAME).circuit
    rules = board_rules(circuit)
    assert bridges(route_board(small(pad), circuit, rules).text) == 4
    assert bridges(route_board(small(pad + walls), circuit, rules).text) == 2
    walls += walls.replace("(start 9 3) (end 9 7)", "(start 9 4) (end 11 4)")
    assert bridges(route_board(small(pad + walls), circuit, rules).text) == 0
    corners = ((7, 2), (13, 2), (13, 8), (7, 8), (7, 2))
    fence = "".join(
        f'(segment (start {a} {b}) (end {x} {y}) (width 0.3) (layer "B.Cu") (net 2))'
        for (a, b), (x, y) in itertools.pairwise(corners)
    )
    assert bridges(route_board(small(pad + fence), circuit, rules).text) == 0  # an island


def test_no_via_joins_islands_of_ground_to_each_other_alone() -> None:
    """Inside a fence on both sides no pad of ground is met: KiCad calls such a pour isolated."""
    pad = '(net 3 "GND")' + "".join(
        f'(footprint "g" (layer "F.Cu") (at {x} 2) (pad "1" thru_hole rect (at 0 0) (size 1 1) '
        '(drill 0.5) (layers "*.Cu") (net 3 "GND")))'
        for x in (8, 12)
    )
    corners = ((6, 6), (9, 6), (9, 9), (6, 9), (6, 6))
    fence = "".join(
        f'(segment (start {a} {b}) (end {x} {y}) (width 0.3) (layer "{side}") (net 2))'
        for (a, b), (x, y) in itertools.pairwise(corners)
        for side in ("F.Cu", "B.Cu")
    )
    circuit = case(NAME).circuit
    rules = board_rules(circuit)
    fenced = shapely.box(6, 6, 9, 9)

    def inside(board: str) -> tuple[int, float]:
        source = read(board)
        places = [(v.get("at").number(0), v.get("at").number(1)) for v in source.all("via")]
        fills = [f for zone in source.all("zone") for f in zone.all("filled_polygon")]
        rings = [[(p.number(0), p.number(1)) for p in f.get("pts").all("xy")] for f in fills]
        poured = shapely.union_all([shapely.Polygon(ring).buffer(0.0) for ring in rings])
        vias = sum(bool(shapely.contains_xy(fenced, *place)) for place in places)
        return vias, float(shapely.intersection(poured, fenced).area)

    vias, area = inside(route_board(small(pad), circuit, rules).text)
    assert vias == 1
    assert area > 1.0
    assert inside(route_board(small(pad + fence), circuit, rules).text) == (0, 0.0)


@pytest.mark.slow
def test_on_four_layers_every_pad_of_ground_reaches_the_planes() -> None:
    """By tracks of its own side to a via, or through the board; no track leads from pad to pad."""
    circuit = case(NAME).circuit
    rules = board_rules(circuit)
    board = route_board(with_layers(placed(), 4), circuit, rules)
    assert (board.open, layer_count(board.text)) == ({}, 4)
    found = read_copper(read(board.text))
    ground = [p for p in found.pieces if found.nets[p.net] == "GND"]
    for side in (0, 1):
        own = [p for p in ground if p.layers[side]]
        copper = shapely.union_all([p.shape for p in own])
        through = shapely.union_all([p.shape for p in own if p.through])
        assert any(not p.through for p in own) or side
        assert all(shapely.intersects(part, through) for part in shapely.get_parts(copper))
    assert board.lengths["0"] < 0.25 * routed().lengths["0"]
    planes = [z for z in read(board.text).all("zone") if z.get("layer").text().startswith("In")]
    assert [len(z.all("filled_polygon")) for z in planes] == [1, 1]
    # With its number back, the board is the one that was placed.
    assert with_layers(board.text, 2) == with_layers(placed(), 2)
    assert route_board(board.text, circuit, rules).text == board.text


def test_an_inner_layer_of_somebody_s_own_stays_his() -> None:
    """A zone on it: no plane of ground there, and no via through a track of the other."""
    zone = (
        '(layers (0 "F.Cu" signal) (4 "In1.Cu" power) (6 "In2.Cu" signal) (2 "B.Cu" signal))'
        '(zone (net 2) (net_name "/v2") (layer "In1.Cu") '
        "(polygon (pts (xy 1 1) (xy 9 1) (xy 9 9))))"
        '(segment (start 2 5) (end 18 5) (width 0.3) (layer "In2.Cu") (net 2))'
    )
    found = read_copper(read(small(zone)))
    assert (found.inner, found.planes) == (("In1.Cu", "In2.Cu"), ("In2.Cu",))
    track = next(p for p in found.pieces if not p.pad)
    assert [track.on(name) for name in found.names] == [False, False, True, False]


def edged(*items: str) -> Expression:
    drawn = "".join(f'({item} (layer "Edge.Cuts"))' for item in items)
    return read(f'(kicad_pcb (version 20241229) (net 0 ""){drawn})', Path("x.kicad_pcb"))


def rectangle(left: float, top: float, right: float, bottom: float) -> str:
    return f"gr_rect (start {left} {top}) (end {right} {bottom})"


def ring(x: float, y: float, radius: float) -> str:
    return f"gr_circle (center {x} {y}) (end {x + radius} {y})"


def test_cut_outs_and_what_lies_in_them() -> None:
    """Areas by hand: a rectangle, 20 in it alternately cut out and left; beside it one that a line
    divides."""
    nested = [rectangle(k, k, 100 - k, 60 - k) for k in range(21)]
    area = read_copper(edged(*nested)).area
    assert area.area == pytest.approx(
        sum((-1) ** k * (100 - 2 * k) * (60 - 2 * k) for k in range(21))
    )
    halves = rectangle(0, 0, 5, 10), rectangle(5, 0, 10, 10)
    assert read_copper(edged(*halves)).area.equals(shapely.box(0, 0, 10, 10))
    crossed = rectangle(0, 0, 6, 6), rectangle(4, 4, 10, 10)
    assert read_copper(edged(*crossed)).area.area == pytest.approx(36 + 36 - 4)


def test_a_board_of_many_cut_outs() -> None:
    """Their areas taken away one after the other took a square of their number."""
    holes = [ring(2 + 4 * (k % 24), 2 + 4 * (k // 24), 1.0) for k in range(500)]
    area = read_copper(edged(rectangle(0, 0, 100, 100), *holes)).area
    hole = 36.0 * np.sin(np.pi / 36.0)  # of a circle's 72 chords
    assert area.area == pytest.approx(1e4 - 500 * hole)


@pytest.mark.parametrize(
    "items",
    [
        [ring(20, 20, 9)] * 400,
        [ring(20 + 1e-4 * k, 20, 9) for k in range(400)],
        [
            "gr_poly (pts "
            + "".join(f"(xy {k * 379 % 997} {k * 7919 % 991})" for k in range(997))
            + ")"
        ],
    ],
    ids=["equal circles", "nearly equal circles", "a star"],
)
def test_an_edge_that_crosses_itself_everywhere(items: list[str]) -> None:
    """400 equal circles took 2.4 GB."""
    with pytest.raises(InputError, match=r"x.kicad_pcb: line 1.*meet in more than 10000 places"):
        read_copper(edged(*items))


def test_a_circle_drawn_twice_is_one() -> None:
    twice = read_copper(edged(ring(20, 20, 9), ring(20, 20, 9))).area
    assert twice.equals(read_copper(edged(ring(20, 20, 9))).area)


def test_a_board_as_large_as_a_field_is_not_routed() -> None:
    circuit = case(NAME).circuit
    text = placed()
    board = read(text)
    (edge,) = (i for i in board.children if i.name == "gr_rect" and "Edge.Cuts" in str(i))
    far = text[: edge.offset] + text[edge.offset :].replace("(end ", "(end 9999", 1)
    with pytest.raises(InputError, match=r"y.kicad_pcb: Edge.Cuts: found a board of .* mm²"):
        route_board(far, circuit, board_rules(circuit), Path("y.kicad_pcb"))
