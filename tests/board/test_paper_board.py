"""The paper's own values, whose small signals ask for a small trim, get a board like any design."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest

from designer.base.errors import Unreachable
from designer.board import board_notes
from designer.board.board_parts import board_circuit, fitted, trim_reach
from designer.circuit.netlist import Trimmer
from designer.circuit.paper_values import MODEL, OPAMP, circuit, corrected, rounded
from designer.design_rules import run_rules
from designer.design_rules.rule_subject import RuleSubject
from designer.model.board_table import BoardChoice
from designer.model.model_file import parse_model_file
from designer.schematic.kicad_project import Project, files
from tests.base.test_views import CIRCUITS
from tests.shared.kicad_cases import RUN
from tests.shared.model_text import PAPER_TABLE
from tests.shared.rule_cases import subject_of
from tests.shared.stages import CATALOG

TEXT = f"""
format = 1
title = "the paper's values"
{PAPER_TABLE}"""
UNSOLD = 1e-7
"""A grade at which no resistor is sold."""


@cache
def subject() -> RuleSubject:
    """The printed values with the errata's corrections, each the nearest that is sold."""
    values = rounded(corrected(), parse_model_file(TEXT).circuit, CATALOG)
    return subject_of(circuit(MODEL, values, CATALOG.opamp(OPAMP)), MODEL, TEXT)


def test_the_trim_of_small_signals_is_the_largest_resistor_and_says_its_reach() -> None:
    """5 % of 1.2 V through 100 kΩ from 15 V asks for 25 MΩ; 10 MΩ reaches 0.15 V."""
    at = subject()
    board, choice = board_circuit(at.synthesis)
    assert choice.trim == pytest.approx(0.05 * 1.2, rel=0.05)
    assert trim_reach(board) == pytest.approx(15.0 * 100e3 / 10e6, rel=1e-12)
    notes = board_notes.markdown(at.synthesis, board, choice, at.components)
    assert "of up to ± 150mV at the generator" in notes


def test_every_rule_looks_at_it() -> None:
    outcomes = run_rules.on_circuit(subject(), {})
    assert len(outcomes) == len(run_rules.LOOKS)
    by_id = {outcome.rule.id: outcome.status for outcome in outcomes}
    for id_ in ("feedback", "drivers", "floating-input", "single-pin", "decoupling"):
        assert by_id[id_] == "pass"


def test_it_is_exported() -> None:
    at = subject()
    made = files(Project("the paper's values", at.circuit, tuple(at.components), RUN, "", {}))
    (board,) = (text for name, text in made.items() if name.endswith(".kicad_pcb"))
    for component in at.components:
        assert f'"{component.reference}"' in board


def test_a_trim_that_cannot_be_bought_is_left_out_where_it_stays_empty() -> None:
    choice = replace(BoardChoice(), resistor_grade=UNSOLD)
    board = fitted(CIRCUITS["paper"], choice, CATALOG)
    without = replace(choice, spec=replace(choice.spec, dc_trim="none"))
    assert board == fitted(CIRCUITS["paper"], without, CATALOG)
    assert not any(isinstance(p, Trimmer) for p in board.fittings)
    wanted = replace(choice, spec=replace(choice.spec, dc_trim="fitted"))
    with pytest.raises(Unreachable):
        fitted(CIRCUITS["paper"], wanted, CATALOG)
