"""Diodes in the rails: what they let through, what they are refused for, where they stand."""

from __future__ import annotations

import re
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from designer.base.errors import InputError
from designer.board.board_check import check_board
from designer.board.board_parts import fitted
from designer.board.component import components
from designer.board.kicad_placement import place
from designer.board.kicad_rules import board_rules
from designer.circuit.netlist import Circuit
from designer.circuit.stage_title import SUPPLY as STAGE, stage_names
from designer.model.board_table import BoardChoice, BoardSpec
from designer.model.model_file import parse_model_file
from designer.routing.net_kinds import kinds_of_nets
from tests.base.test_views import CIRCUITS
from tests.shared.model_text import PAPER_TABLE
from tests.shared.stages import CATALOG

PAPER = CIRCUITS["paper"]
CHOICE = BoardChoice(BoardSpec(reverse_protection="1N5819"))
INPUTS = ("vcc_in", "vee_in")


def board(circuit: Circuit = PAPER) -> Circuit:
    return fitted(circuit, CHOICE, CATALOG)


@pytest.mark.parametrize(("plus", "minus"), [(15.34, -15.34), (-15.34, 15.34)])
def test_a_supply_reaches_the_rails_only_the_right_way_round(
    plus: float, minus: float, tmp_path: Path
) -> None:
    """In ngspice, with a Schottky diode of textbook parameters and the load of twelve amplifiers;
    the connector's pins are taken from the board."""
    circuit = board()
    ways = next(p.nets for p in circuit.fittings if p.name == "J1")
    deck = [
        "rails",
        f"V1 {ways[0]} {ways[1]} {plus}",
        f"V2 {ways[2]} {ways[1]} {minus}",
        "R1 vcc 0 500",
        "R2 vee 0 500",
        *(f"{d.name} {d.anode} {d.cathode} schottky" for d in circuit.supply_diodes),
        ".model schottky D(Is=1u N=1.05 Rs=0.05)",
        ".control",
        "op",
        "print v(vcc) v(vee)",
        ".endc",
        ".end",
    ]
    file = tmp_path / "rails.cir"
    file.write_text("\n".join(deck))
    run = subprocess.run(
        ["ngspice", "-b", str(file)], capture_output=True, text=True, timeout=60, check=False
    )
    volts = {net: float(v) for net, v in re.findall(r"v\((v..)\) = (\S+)", run.stdout)}
    if plus > 0.0:
        assert 15.0 <= volts["vcc"] < 15.34
        assert -15.34 < volts["vee"] <= -15.0
    else:
        assert abs(volts["vcc"]) < 0.01
        assert abs(volts["vee"]) < 0.01


def test_a_drop_is_that_of_the_next_larger_current_of_the_sheet() -> None:
    entry = CATALOG.supply_diode("1N5819")
    drops = [entry.drop(amperes) for amperes in (0.01, 0.1, 0.11, 1.0, 1.1)]
    assert drops == [0.34, 0.34, 0.6, 0.6, None]


def test_the_diodes_are_parts_of_the_supply() -> None:
    """On the bill, in the class and under the width rule of the supply, named at the connector."""
    circuit = board()
    listed = {c.reference: c for c in components(circuit, CATALOG, CHOICE)}
    assert [listed[name].nets for name in ("D911", "D912")] == [
        {"1": "vcc", "2": "vcc_in"},
        {"1": "vee_in", "2": "vee"},
    ]
    bought = listed["D911"].bought
    assert bought is not None
    assert bought.part_number == "1N5819HW-7-F"
    assert {stage_names(circuit)[name] for name in ("J1", "D911", "D912")} == {STAGE}
    width = next(rule for rule in board_rules(circuit) if rule.id == "supply-width")
    assert width.nets == ("VCC", "VEE", "GND", "/vcc_in", "/vee_in")
    names = dict(enumerate(("/vcc_in", "/vee_in", "VCC", "/v1")))
    kinds = kinds_of_nets(circuit, names)
    assert [kinds[number] == kinds[2] for number in names] == [True, True, True, False]
    (connector,) = (
        s for s in place(circuit, list(listed.values())).spots if s.component.reference == "J1"
    )
    assert connector.pin_labels == ("+15.3 V", "0 V", "-15.3 V")


def test_cases_of_the_diode() -> None:
    through = CATALOG.mounted("tht")
    listed = components(fitted(PAPER, CHOICE, through), through, CHOICE)
    found = {c.footprint for c in listed if c.value == "1N5819"}
    assert found == {"Diode_THT:D_DO-41_SOD81_P10.16mm_Horizontal"}


@pytest.mark.parametrize(
    ("diode", "supply", "expected"),
    [("1N5818", 15.0, "1N5819"), ("1N5819", 20.0, "a diode for 40.34 V in reverse")],
)
def test_a_diode_that_does_not_do_is_refused(diode: str, supply: float, expected: str) -> None:
    choice = BoardChoice(replace(CHOICE.spec, reverse_protection=diode))
    with pytest.raises(InputError, match=re.escape(expected)) as caught:
        fitted(replace(PAPER, supply=supply), choice, CATALOG)
    assert caught.value.field == "board.reverse_protection"


def test_a_diode_for_less_than_the_amplifiers_draw_is_refused() -> None:
    entry = CATALOG.supply_diode("1N5819")
    weak = replace(entry, drops=(replace(entry.drops[0], current=0.02),))
    with pytest.raises(InputError, match="that the op-amps draw"):
        fitted(PAPER, CHOICE, replace(CATALOG, supply_diodes=(weak,)))


def test_a_model_file_names_the_diode() -> None:
    text = "format = 1\n" + PAPER_TABLE + '[board]\nreverse_protection = "1N58"\n'
    with pytest.raises(InputError) as caught:
        check_board(parse_model_file(text), CATALOG)
    assert caught.value.field == "board.reverse_protection"
