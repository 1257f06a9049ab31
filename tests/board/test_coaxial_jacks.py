"""Coaxial jacks in the place of pins: what is bought, where they stand, what is refused."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest

from designer.base.errors import InputError
from designer.board.board_parts import fitted, probed_nets
from designer.board.bom import bill
from designer.board.component import components
from designer.board.kicad_board import board
from designer.board.kicad_items import entries
from designer.board.kicad_placement import EDGE, place
from designer.board.kicad_reader import read_board
from designer.board.kicad_rules import board_rules
from designer.circuit.netlist import GROUND
from designer.model.board_table import BoardChoice, BoardSpec, Connectors
from designer.model.model_file import parse_model_file
from designer.routing.specctra import design_text
from tests.base.test_views import CIRCUITS
from tests.shared.kicad_cases import RUN, case, case_files
from tests.shared.model_text import PAPER_TABLE
from tests.shared.stages import CATALOG

SERIES: tuple[Connectors, ...] = ("sma", "bnc")


@pytest.mark.parametrize("series", SERIES)
@pytest.mark.parametrize("name", ["paper", "four masses"])
def test_a_jack_for_the_generator_and_for_each_output(series: Connectors, name: str) -> None:
    circuit, choice = CIRCUITS[name], BoardChoice(BoardSpec(connectors=series))
    listed = components(fitted(circuit, choice, CATALOG), CATALOG, choice)
    jacks = {c.reference: c for c in listed if c.kind == "jack"}
    nets = {reference: (c.nets["1"], c.nets["2"]) for reference, c in jacks.items()}
    assert nets == {
        "J2": (circuit.generator.net, GROUND),
        **{f"J{k}": (f"{net}_out", GROUND) for k, net in enumerate(probed_nets(circuit), 3)},
    }
    assert [c.reference for c in listed if c.kind == "connector"] == ["J1"]
    (line,) = (each for each in bill(listed) if each.designators == tuple(jacks))
    assert line.part_number == CATALOG.coaxial_jack(series).part_number
    assert line.quantity == len(jacks)


@pytest.mark.parametrize("name", ["SMA jacks", "BNC jacks"])
def test_jacks_stand_at_the_edges_with_the_names_of_their_signals(name: str) -> None:
    """The generator's on the left, the outputs' on the right below one another, with room for the
    plugs; nothing between them and the edge."""
    made = case(name)
    placement = place(made.circuit, made.components)
    jacks = {s.component.reference: s for s in placement.spots if s.component.kind == "jack"}
    box = placement.outline
    assert jacks["J2"].box.left == pytest.approx(box.left + EDGE, abs=0.1)
    outputs = [jacks[f"J{k}"] for k in range(3, 8)]
    for spot in outputs:
        assert box.right - spot.box.right == pytest.approx(EDGE, abs=1.05)  # whole millimetres
        assert not [s for s in placement.spots if s not in outputs and s.box.right > spot.box.left]
    centres = [s.pad("1")[1] for s in outputs]
    plug = outputs[0].footprint.plug
    assert all(b - a > plug for a, b in pairwise(centres))
    text = {s.component.reference: s.caption for s in jacks.values()}
    assert text == {"J2": "generator", "J3": "v1", "J4": "v2", "J5": "v3", "J6": "v4", "J7": "fv"}
    listed = entries(made.circuit, made.components, RUN, "models")
    drawn = [item.text(0) for item in board("b", "", listed, placement).all("gr_text")]
    assert set(text.values()) <= set(drawn)


def test_pins_are_as_before_without_the_key() -> None:
    listed = components(fitted(CIRCUITS["paper"], BoardChoice(), CATALOG), CATALOG, BoardChoice())
    assert {c.reference: c.kind for c in listed if c.reference.startswith("J")} == {
        "J1": "connector", "J2": "connector", "J3": "connector",
    }  # fmt: skip


def test_pads_of_one_number_have_ids_and_names_of_their_own(tmp_path: Path) -> None:
    circuit, files = case("SMA jacks").circuit, case_files("SMA jacks")
    path = tmp_path / "b.kicad_pcb"
    path.write_text(next(text for name, text in files.items() if name.endswith(path.suffix)))
    ids = re.findall(r'\(uuid "([^"]+)"', path.read_text())
    assert len(ids) == len(set(ids)) > 100
    design = design_text(read_board(path), "b", circuit, board_rules(circuit))
    for name in ("2", "2@1", "2@2", "2@3"):
        assert f"J3-{name}" in design


def test_another_word_is_refused() -> None:
    with pytest.raises(InputError) as caught:
        parse_model_file("format = 1\n" + PAPER_TABLE + '[board]\nconnectors = "tnc"\n')
    assert caught.value.field == "board.connectors"
    assert caught.value.found == '"tnc"'
    assert "sma" in caught.value.expected


def test_a_catalogue_without_such_a_jack_is_told_of() -> None:
    sma = tuple(jack for jack in CATALOG.coaxial_jacks if jack.series == "sma")
    with pytest.raises(InputError, match=r"board\.connectors.*sma"):
        replace(CATALOG, coaxial_jacks=sma).coaxial_jack("bnc")
