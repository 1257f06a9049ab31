"""Boards as KiCad 10 saves them, with nets by name: read, routed and judged as those of KiCad 9.

The other form is made from a board of KiCad 9 by changing its text, line by line.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

from designer.board.kicad_reader import BoardFile, read_board
from designer.board.net_codes import with_codes, without_codes
from designer.board.sexpr import expression_text, read
from designer.design_rules import on_board
from designer.routing.routed_board import RoutedBoard, route_board
from designer.routing.specctra import design_text, with_session
from tests.design_rules.test_rules_board import by_id, custom, drawn
from tests.shared.rule_cases import base, generic

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")


def by_name(text: str) -> str:
    """A board of KiCad 9 as KiCad 10 has it: no list of nets, no numbers."""
    names = dict(re.findall(r'^\t\(net (\d+) "([^"]*)"\)$', text, re.MULTILINE))
    text = re.sub(r'^\t\(net \d+ "[^"]*"\)\n', "", text, flags=re.MULTILINE)
    text = re.sub(r'\(net \d+ "([^"]*)"\)', r'(net "\1")', text)
    text = re.sub(r"\(net (\d+)\)", lambda m: f'(net "{names[m[1]]}")', text)
    text = re.sub(r'\n\t*\(net_name "[^"]*"\)', "", text)
    assert "20241229" in text
    return text.replace("20241229", "20260206")


def saved(text: str, folder: Path) -> BoardFile:
    path = folder / "board.kicad_pcb"
    path.write_text(text, encoding="utf-8")
    return read_board(path)


def same(a: BoardFile, b: BoardFile) -> None:
    assert a.footprints == b.footprints
    assert (a.tracks, a.vias, a.zones) == (b.tracks, b.vias, b.zones)
    assert (a.outline.sides == b.outline.sides).all()


@cache
def routed() -> RoutedBoard:
    """The board of KiCad 9."""
    return route_board(drawn(), base().circuit, custom())


@pytest.mark.slow
def test_a_board_with_named_nets_is_read_as_one_with_numbers(tmp_path: Path) -> None:
    nine = routed().text
    ten = by_name(nine)
    assert "(net 1" not in ten
    same(saved(nine, tmp_path), saved(ten, tmp_path))
    assert saved(ten, tmp_path).copper
    verdicts = [
        [
            (outcome.rule.id, outcome.status, outcome.found)
            for outcome in on_board.on_board(
                board, base().components, custom(), {}, "not asked", generic()
            )
        ]
        for board in (saved(nine, tmp_path), saved(ten, tmp_path))
    ]
    assert verdicts[0] == verdicts[1]


@pytest.mark.slow
def test_a_board_with_named_nets_is_routed_in_its_own_form(tmp_path: Path) -> None:
    nine = routed()
    ten = route_board(by_name(drawn()), base().circuit, custom())
    assert (ten.open, ten.lengths, ten.vias) == (nine.open, nine.lengths, nine.vias)
    assert '(net "GND")' in ten.text
    assert "net_name" not in ten.text
    assert "(net 1" not in ten.text
    same(saved(nine.text, tmp_path), saved(ten.text, tmp_path))


def test_numbers_come_and_go_without_a_trace() -> None:
    ten = read(by_name(routed().text))
    back = without_codes(with_codes(ten))
    assert sorted(expression_text(back).split()) == sorted(expression_text(ten).split())


def test_another_router_is_told_the_same_of_either(tmp_path: Path) -> None:
    texts = [
        design_text(saved(text, tmp_path), "board", base().circuit, custom())
        for text in (drawn(), by_name(drawn()))
    ]
    assert sorted(texts[0].split()) == sorted(texts[1].split())
    session = tmp_path / "board.ses"
    session.write_text(
        '(session board (routes (resolution um 10) (parser (host_cad "x")) (network_out '
        "(net GND (wire (path F.Cu 2500 600000 -600000 610000 -600000))))))",
        encoding="utf-8",
    )
    laid = with_session(by_name(drawn()), session)
    assert saved(laid, tmp_path).tracks == ("0",)
    assert '(net "GND")' in laid


@pytest.mark.kicad
def test_an_older_kicad_says_that_it_cannot_read_the_file(tmp_path: Path) -> None:
    board = saved(by_name(drawn()), tmp_path)
    found = by_id(on_board.checked(board, base().components, custom(), {}, generic()))
    assert found["unconnected"].status == "not run"
    assert found["part-value"].status == "pass"
