"""Real parts for the response that is shown: those of ``synthesise``, with the yield of a study."""

from __future__ import annotations

import pytest

from designer import InputError, parse_model_file, synthesise, tolerance
from designer.centering.stage_choice import synthesise as choose
from designer.circuit.design import ConditionCheck
from designer.explorer.board_box import PartsProcess, board_box, condition_row, expected
from designer.explorer.place import read_place
from tests.shared.model_text import COARSE_RECTIFIER, PAPER_TABLE

pytestmark = pytest.mark.usefixtures("designs_are_made_once")

FILE = parse_model_file(f"format = 1\n{PAPER_TABLE}{COARSE_RECTIFIER}")
WANTED = '[[response]]\nomega = 0.85\nexpect = "1-2-2"\n'


@pytest.mark.slow
def test_the_parts_and_the_yield_are_those_of_the_verbs() -> None:
    messages = list(board_box(FILE, read_place(FILE, {"omega": 0.85}), "1-2-2", choose))
    rows = dict(messages[1]["rows"])
    design = synthesise(parse_model_file(f"format = 1\n{PAPER_TABLE}{WANTED}{COARSE_RECTIFIER}"))
    assert design.design is not None
    names = {part.name for part in design.design.circuit.resistors}
    assert names < rows.keys()
    assert rows["exact circuit"] == "1-2-2"
    yields = [message for message in messages if message["kind"] == "yield"]
    assert [message["samples"] for message in yields] == list(range(10, 210, 10))
    study = tolerance(design, samples=40, rung="exact", blame=False, jobs=1).study
    assert study is not None
    (counted,) = study.yields
    assert counted is not None
    assert (yields[3]["samples"], yields[3]["ok"]) == (40, counted.ok)


def test_a_side_condition_is_told_in_its_unit() -> None:
    load = ConditionCheck("load", "load_ohm", 2000.0, 2540.0, "U1", least=True)
    assert condition_row(load) == ("load", "2.54 kΩ (at least 2 kΩ)")
    level = ConditionCheck("level", "signal_level_ratio", 3.0, 3.5)
    assert condition_row(level) == ("signal level ratio", "3.5 (at most 3, not kept)")


def test_what_no_circuit_makes_is_said() -> None:
    text = f"format = 1\n{PAPER_TABLE}[circuit]\nresistor_range = [1e3, 1.1e3]\n"
    modelfile = parse_model_file(text)
    with pytest.raises(InputError):
        list(board_box(modelfile, read_place(modelfile, {"omega": 0.85}), "1-2-2", choose))
    with pytest.raises(InputError, match="n-p-q"):
        expected(None)


@pytest.mark.slow
def test_parts_are_chosen_in_a_process_of_their_own() -> None:
    process = PartsProcess()
    process.close()  # one that was never asked
    try:
        there = process(parse_model_file(f"format = 1\n{PAPER_TABLE}{WANTED}{COARSE_RECTIFIER}"))
    finally:
        process.close()
    here = choose(parse_model_file(f"format = 1\n{PAPER_TABLE}{WANTED}{COARSE_RECTIFIER}"))
    assert there.design.circuit == here.design.circuit
