"""Open and short-circuited nets of a board: KiCad's own check, on boards of a few pads."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

from designer.board.sexpr import Expression, expression, expression_text, read, word
from designer.catalog.design_rule import FAIL, NOT_RUN, PASS, RuleOutcome
from designer.design_rules import kicad_drc, on_board
from tests.design_rules.test_rules_board import (
    answer,
    board_of,
    by_id,
    custom,
    on_drawn,
    track,
    with_items,
)
from tests.shared.rule_cases import generic

NETS = ("/v1", "/v2", "GND")


def pads_and_tracks(*open_nets: str, across: bool = False, vertical: bool = False) -> str:
    """A board of three nets with two pads each, a row a net, joined by a track where not open.

    across : a track of the first net that ends at a pad of the second. vertical : one that crosses
    the track of the second net between its pads and joins two pads of the first.
    """
    items: list[Expression] = []
    for number, net in enumerate(NETS, start=1):
        y = 20.0 + 10.0 * number
        items += [pad(number, 20.0, y), pad(number, 40.0, y)]
        if net not in open_nets:
            items.append(segment(number, (20.0, y), (40.0, y)))
    if across:
        items.append(segment(1, (40.0, 30.0), (40.0, 40.0)))
    if vertical:
        items += [pad(1, 30.0, 45.0), segment(1, (30.0, 30.0), (30.0, 45.0))]
    return expression_text(Expression((*read(EMPTY).items, *items)))


EMPTY = """
(kicad_pcb (version 20241229) (generator "designer") (generator_version "9.0")
  (general (thickness 1.6)) (paper "A4")
  (layers (0 "F.Cu" signal) (2 "B.Cu" signal) (1 "F.Mask" user) (25 "Edge.Cuts" user))
  (net 0 "") (net 1 "/v1") (net 2 "/v2") (net 3 "GND"))
"""


def pad(net: int, x: float, y: float) -> Expression:
    one = expression(
        "pad", "1", word("smd"), word("rect"), expression("at", 0.0, 0.0),
        expression("size", 1.0, 1.0), expression("layers", "F.Cu", "F.Mask"),
        expression("net", net, NETS[net - 1]),
    )  # fmt: skip
    return expression(
        "footprint", "some:pad", expression("layer", "F.Cu"), expression("at", x, y), one
    )


def segment(net: int, start: tuple[float, float], end: tuple[float, float]) -> Expression:
    return expression(
        "segment", expression("start", *start), expression("end", *end),
        expression("width", 0.5), expression("layer", "F.Cu"), expression("net", net),
    )  # fmt: skip


def looked(text: str, folder: Path) -> dict[str, RuleOutcome]:
    board = board_of(text, folder)
    return by_id(on_board.checked(board, [], custom(), {}, generic()))


@pytest.mark.kicad
def test_a_board_whose_tracks_are_deleted_is_caught_and_a_routed_one_is_not(tmp_path: Path) -> None:
    whole = looked(pads_and_tracks(), tmp_path)
    assert whole["unconnected"].status == PASS, whole["unconnected"].found
    assert whole["short-circuit"].status == PASS, whole["short-circuit"].found
    lost = looked(pads_and_tracks("/v1", "GND"), tmp_path)
    assert lost["unconnected"].status == FAIL
    assert lost["unconnected"].found == "2; not routed: GND (1), v1 (1)"
    assert "route these nets" in lost["unconnected"].rule.do
    bare = looked(pads_and_tracks(*NETS), tmp_path)
    assert bare["unconnected"].status == NOT_RUN
    assert bare["unconnected"].found == "nothing is routed yet: 3 connections of 3 nets are open"


@pytest.mark.kicad
def test_copper_of_two_nets_that_touches_is_caught(tmp_path: Path) -> None:
    """A track that ends on a foreign pad, and one that crosses another."""
    for text in (pads_and_tracks(across=True), pads_and_tracks(vertical=True)):
        found = looked(text, tmp_path)["short-circuit"]
        assert found.status == FAIL, found.found
        assert found.value >= 1.0
        assert "/v1" in found.found
        assert "/v2" in found.found


@pytest.mark.kicad
def test_kicad_shows_that_it_reports_both(tmp_path: Path) -> None:
    told = kicad_drc.check(board_of(pads_and_tracks(), tmp_path), custom())
    assert told.misunderstood == frozenset()


@cache
def partly_routed() -> str:
    return with_items(track("s1", 0.3, 5.0))


@pytest.mark.parametrize("id_", ["unconnected", "short-circuit"])
def test_what_kicad_does_not_report_on_the_specimen_passes_nothing(
    tmp_path: Path, id_: str
) -> None:
    found = on_drawn(partly_routed(), tmp_path, answer(id_))
    assert found[id_].status == NOT_RUN
    assert "does not report" in found[id_].found


def test_many_open_nets_are_counted_and_the_first_are_named(tmp_path: Path) -> None:
    nets = {f"n{number:02d}": 2 for number in range(20)}
    found = on_drawn(partly_routed(), tmp_path, answer(unconnected=nets))["unconnected"]
    assert found.status == FAIL
    assert found.value == 40.0
    assert found.found.startswith("40; not routed: n00 (2), n01 (2), ")
    assert found.found.endswith("n11 (2) and 8 more nets")
