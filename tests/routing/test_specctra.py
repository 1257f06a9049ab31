"""Boards for other routers and back: KiCad's own reader and writer of the formats are the truth."""

from __future__ import annotations

import itertools
import math
from collections import defaultdict
from functools import cache
from pathlib import Path

import pytest

from designer.base.errors import InputError
from designer.board.kicad_reader import read_board
from designer.board.kicad_rules import board_rules
from designer.board.net_classes import CLASSES, DEFAULT, SUMMING, SUPPLY
from designer.board.sexpr import Expression, expression, expression_text, read, word
from designer.routing.board_copper import read_copper
from designer.routing.routed_board import RoutedBoard, route_board
from designer.routing.specctra import design_text, with_session
from tests.shared.answer_store import stored
from tests.shared.kicad_cases import case, case_files, written
from tests.shared.kicad_python import asked_of_pcbnew

NAME = "one mass"
EXPORT = """
import sys, pcbnew
assert pcbnew.ExportSpecctraDSN(pcbnew.LoadBoard(sys.argv[1]), sys.argv[2])
"""
IMPORT = """
import sys, pcbnew
board = pcbnew.LoadBoard(sys.argv[1])
assert pcbnew.ImportSpecctraSES(board, sys.argv[2])
pcbnew.SaveBoard(sys.argv[3], board)
"""
QUOTE = '(string_quote ")'
Track = tuple[object, ...]


def placed() -> str:
    return case_files(NAME)[board_name()]


def board_name() -> str:
    return next(name for name in case_files(NAME) if name.endswith(".kicad_pcb"))


@cache
def routed() -> str:
    circuit = case(NAME).circuit
    made: RoutedBoard = stored(route_board)(placed(), circuit, board_rules(circuit))
    return made.text


def project(folder: Path, text: str) -> Path:
    return written({**case_files(NAME), board_name(): text}, folder) / board_name()


def ours(board: Path) -> Expression:
    circuit = case(NAME).circuit
    text = design_text(read_board(board), "board", circuit, board_rules(circuit))
    assert text.count(QUOTE) == 1
    return read(text.replace(QUOTE, ""))


def kicads(board: Path) -> Expression:
    out = board.with_suffix(".dsn")
    asked_of_pcbnew(EXPORT, board.parent, board, out)
    return read(out.read_text("utf-8").replace(QUOTE, ""))


def nets(design: Expression) -> dict[str, set[str]]:
    return {n.text(0): set(n.get("pins").atoms) for n in design.get("network").all("net")}


def places(design: Expression) -> dict[str, tuple[float, float]]:
    """Where each pin is on the board [um]."""
    images = {image.text(0): image for image in design.get("library").all("image")}
    out = {}
    for component in design.get("placement").all("component"):
        for place in component.all("place"):
            x, y, turn = place.number(1), place.number(2), math.radians(place.number(4))
            for pin in images[component.text(0)].all("pin"):
                a, b = pin.number(2), pin.number(3)
                out[f"{place.text(0)}-{pin.text(1)}"] = (
                    x + a * math.cos(turn) - b * math.sin(turn),
                    y + a * math.sin(turn) + b * math.cos(turn),
                )
    return out


def wires(design: Expression) -> set[Track]:
    """Tracks and vias: net, layer, width and places [um]."""
    out = set[Track]()
    for wire in design.get("wiring").all("wire"):
        path = wire.get("path")
        width, *values = (round(float(text), 1) for text in path.atoms[1:])
        points = zip(values[::2], values[1::2], strict=True)
        for ends in itertools.pairwise(points):  # KiCad joins tracks of a way
            out.add((wire.get("net").text(0), path.text(0), width, *sorted(ends)))
    for via in design.get("wiring").all("via"):
        at = (round(via.number(1), 1), round(via.number(2), 1))
        out.add((via.get("net").text(0), "via", *at))
    return out


def edge(design: Expression) -> set[tuple[float, float]]:
    path = design.get("structure").get("boundary").get("path")
    values = [float(text) for text in path.atoms[2:]]
    return set(zip(values[::2], values[1::2], strict=True))


@pytest.mark.kicad
def test_another_router_is_told_what_kicad_would_tell_it(tmp_path: Path) -> None:
    board = project(tmp_path, routed())
    made, true = ours(board), kicads(board)
    assert nets(made) == nets(true)
    expected = places(true)
    for pin, at in places(made).items():
        assert at == pytest.approx(expected[pin], abs=0.2), pin
    assert len(wires(true)) > 50
    assert wires(made) == wires(true)
    assert edge(made) == edge(true)


@pytest.mark.slow
def test_each_net_has_the_width_and_clearance_of_its_class(tmp_path: Path) -> None:
    made = ours(project(tmp_path, routed()))
    sizes = dict[str, tuple[float, float]]()
    for each in made.get("network").all("class"):
        rule = each.get("rule")
        size = (rule.get("width").number() / 1e3, rule.get("clearance").number() / 1e3)
        sizes |= dict.fromkeys(each.atoms[1:], size)
    for net, name in (("/v1", DEFAULT), ("/s1", SUMMING), ("VCC", SUPPLY), ("GND", SUPPLY)):
        assert sizes[net] == (CLASSES[name]["track_width"], CLASSES[name]["clearance"])
    assert sizes.keys() == nets(made).keys()


def session(without: str = "") -> str:
    """What a router would have written that found the tracks and vias of the routed board, or all
    but those of one net."""
    source = read(routed())
    names = {int(net.number(0)): net.text(1) for net in source.all("net")}
    laid = defaultdict[str, list[Expression]](list)
    for item in source.all("segment"):
        ends = [item.get(end) for end in ("start", "end")]
        at = [v for end in ends for v in (end.number(0) * 1e4, -end.number(1) * 1e4)]
        path = expression("path", word(item.get("layer").text()), item.get("width").number() * 1e4)
        wire = expression("wire", Expression((*path.items, *expression("", *at).items[1:])))
        laid[names[int(item.get("net").number())]].append(wire)
    stack = "Via[0-1]_600:300_um"
    for item in source.all("via"):
        place = (item.get("at").number(0) * 1e4, -item.get("at").number(1) * 1e4)
        laid[names[int(item.get("net").number())]].append(expression("via", stack, *place))
    resolution = expression("resolution", word("um"), 10)
    shapes = (
        expression("shape", expression("circle", word(layer), 6000, 0, 0))
        for layer in ("F.Cu", "B.Cu")
    )
    padstack = expression("padstack", stack, *shapes, expression("attach", word("off")))
    found = (expression("net", net, *items) for net, items in laid.items() if net != without)
    routes = (
        resolution,
        expression("parser"),
        expression("library_out", padstack),
        expression("network_out", *found),
    )
    return expression_text(
        expression(
            "session",
            "board",
            expression("base_design", "board"),
            expression("placement", resolution),
            expression("was_is"),
            expression("routes", *routes),
        )
    )


def tracks(board: str) -> set[Track]:
    """Net, layer, width and ends, or sizes and the place, of every track and via [mm]."""
    source = read(board)
    names = {net.text(0): net.text(1) for net in source.all("net")}
    out = set[Track]()
    for item in source.all("segment"):
        ends = sorted(
            tuple(round(item.get(end).number(k), 4) for k in (0, 1)) for end in ("start", "end")
        )
        width = item.get("width").number()
        out.add((names[item.get("net").text()], item.get("layer").text(), width, *ends))
    for item in source.all("via"):
        at = tuple(round(item.get("at").number(k), 4) for k in (0, 1))
        sizes = item.get("size").number(), item.get("drill").number()
        out.add((names[item.get("net").text()], "via", *sizes, at))
    return out


@pytest.mark.kicad
def test_a_session_is_read_as_kicad_reads_it(tmp_path: Path) -> None:
    """On the placed board, and whatever is on it goes."""
    board = project(tmp_path, placed())
    file, out = tmp_path / "board.ses", tmp_path / "imported.kicad_pcb"
    file.write_text(session(), encoding="utf-8")
    asked_of_pcbnew(IMPORT, tmp_path, board, file, out)
    by_kicad = tracks(out.read_text("utf-8"))
    assert by_kicad == tracks(routed())
    assert tracks(with_session(placed(), file)) == by_kicad
    assert tracks(with_session(routed(), file)) == by_kicad


@pytest.mark.slow
def test_what_a_session_leaves_open_is_routed_here(tmp_path: Path) -> None:
    """A whole session leaves nothing to do; without one net, that net alone is routed."""
    circuit, file = case(NAME).circuit, tmp_path / "board.ses"
    for missing in (set[str](), {"v1"}):
        file.write_text(session("".join(f"/{net}" for net in missing)), encoding="utf-8")
        board = route_board(with_session(placed(), file), circuit, board_rules(circuit))
        assert board.open == {}
        assert {net for net, length in board.lengths.items() if length > 0.0} == missing


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("(session", "(pcb", "no session"),
        ('(net "/v1"', '(net "/v99"', "nets of this board"),
        ("F.Cu", "In1.Cu", "one of F.Cu, B.Cu"),
        ("um 10", "furlong 10", "furlong"),
        ("(path F.Cu 2000 ", "(path F.Cu 2000 7 ", "two or more places"),
    ],
)
def test_a_session_of_something_else_is_refused(
    old: str, new: str, complaint: str, tmp_path: Path
) -> None:
    file, text = tmp_path / "board.ses", session()
    assert old in text, text[:2000]
    file.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError, match=complaint) as caught:
        with_session(routed(), file)
    assert str(file) in str(caught.value)


def test_a_session_that_is_cut_off_is_refused(tmp_path: Path) -> None:
    file, text = tmp_path / "board.ses", session()
    file.write_text(text[: len(text) // 2], encoding="utf-8")
    with pytest.raises(InputError, match="nothing closes"):
        with_session(routed(), file)


def test_a_board_of_several_outlines_is_refused_and_one_with_a_cut_out_is_not(
    tmp_path: Path,
) -> None:
    """The format has one boundary; a hole in it is a keepout."""

    def design(x: float, y: float) -> Expression:
        cut = f'(gr_rect (start {x} {y}) (end {x + 2} {y + 2}) (layer "Edge.Cuts"))'
        return ours(project(tmp_path, placed().replace("(gr_text", f"{cut}\n(gr_text", 1)))

    with pytest.raises(InputError, match="2 separate outlines"):
        design(-50.0, -50.0)
    inside = read_copper(read(placed())).area.centroid
    keepouts = design(inside.x, inside.y).get("structure").all("keepout")
    bare = ours(project(tmp_path, placed())).get("structure").all("keepout")
    assert len(keepouts) == len(bare) + 2
