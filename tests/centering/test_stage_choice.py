"""The stage that is built where the model file states none."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from designer.base.arrays import Mask
from designer.base.second_process import other_process
from designer.catalog.design_rule import Finding, judged
from designer.catalog.design_rules import BY_ID
from designer.catalog.parts_catalog import load_catalog
from designer.centering import stage_choice
from designer.centering.stage_choice import BOARDS, StageForecast, chosen, forecast, least_kept
from designer.check import checked_design, synthesis_result
from designer.check.synthesis_result import Synthesis, with_stage
from designer.circuit.dead_zone_parts import stage_kind
from designer.dynamics.counts import Counts
from designer.model import find_responses
from designer.model.model_file import parse_model_file
from designer.verbs.simulate import simulate
from designer.verdicts import exact_circuit
from designer.verdicts.verdict import Verdict
from designer.yields.study_plan import plan_study
from tests.shared.model_text import COARSE_CIRCUIT
from tests.shared.system_text import clearance, system_text, table

CATALOG = load_catalog()
CHAIN = (
    {"a": 0.12, "b": 0.10, "tip": 0.08},
    {("a", "ground"): 2e4, ("b", "a"): 1.6e4, ("tip", "b"): 1.2e4},
    {("a", "ground"): 4.0, ("b", "a"): 3.0, ("tip", "b"): 3.0},
    table("force", on="tip", amplitude=3.0),
)
ONE = (
    {"a": 1.0},
    {("a", "ground"): 1.0},
    {("a", "ground"): 0.1},
    table("force", on="a", amplitude=1.0),
)
STIFF = system_text(
    *CHAIN,
    clearance("A", "tip", "ground", upper=1e-3, stiffness=1.5e5),
    table("response", omega=226.2),
    COARSE_CIRCUIT,
)
"""A stiff stop on one side: offsets and the leftover slope spoil the saturating stage."""


@pytest.mark.slow
@pytest.mark.usefixtures("designs_are_made_once")
def test_the_stage_is_taken_whose_boards_keep_the_response(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its reason names both, and a study of other boards bears it out."""
    # The catalogue that is given, for the stage that is not stated too: no other is read.
    monkeypatch.setattr(stage_choice, "load_catalog", None)
    monkeypatch.setattr(stage_choice, "BOARDS", 16)
    modelfile = parse_model_file(STIFF)
    made = stage_choice.synthesise(modelfile, CATALOG, jobs=2)
    assert made.modelfile.circuit.dead_zone == "rectifier"
    assert made.stage_reason.startswith("rectifier: ")
    assert "; saturation: " in made.stage_reason
    kept = {}
    for kind in ("rectifier", "saturation"):
        stated = with_stage(modelfile, kind)
        other = made if kind == "rectifier" else stage_choice.synthesise(stated, CATALOG)
        assert other.modelfile.circuit.dead_zone == kind
        said = stage_choice.better_stage(stated, other, 2)
        assert ("with the rectifier stage" in said) is (kind == "saturation")
        assert not stage_choice.better_stage(modelfile, other)  # none is stated there
        if kind == "saturation":
            lost = stage_choice.kept_of_doubtful(stated, other, 2)
            with other_process(2) as elsewhere:
                assert elsewhere(stage_choice.other_stage, stated, other, lost, 1)() == said
        checked = checked_design.check(other.design, other.model_responses, None)
        plan = plan_study(stated, other.design, checked, CATALOG, samples=40, seed=11)
        answers = exact_circuit.block(plan, range(40), 2)
        kept[kind] = sum(answer.verdict is Verdict.OK for answer in answers)
    assert kept["rectifier"] > kept["saturation"]


@pytest.mark.slow
def test_the_model_is_asked_once_for_both_stages(monkeypatch: pytest.MonkeyPatch) -> None:
    """And the parts are those of a stage that asks for itself, and those that another process
    helps to choose."""
    asked: list[object] = []

    def find(*arguments: Any) -> Any:
        asked.append(arguments)
        return find_responses.find(*arguments)

    monkeypatch.setattr(synthesis_result, "find", find)
    even = clearance("A", "a", "ground", upper=0.5, lower=0.5, stiffness=9.0)
    modelfile = parse_model_file(system_text(*ONE, even, table("response", omega=1.3)))
    made = stage_choice.synthesise(modelfile, CATALOG)
    assert len(asked) == 1
    with other_process(2) as other:
        elsewhere = stage_choice.synthesise(modelfile, CATALOG, other=other)
    assert len(asked) == 2
    assert elsewhere.design.circuit == made.design.circuit
    assert elsewhere.stage_reason == made.stage_reason
    for kind in ("saturation", "rectifier"):
        alone = synthesis_result.synthesise(with_stage(modelfile, kind), CATALOG)
        shared = synthesis_result.synthesise(
            with_stage(modelfile, kind), CATALOG, shown=made.model_responses
        )
        assert shared.design.circuit == alone.design.circuit
        assert shared.design.errors.errors == alone.design.errors.errors
    assert len(asked) == 4


def test_a_stage_that_alone_makes_the_clearances_is_no_choice() -> None:
    unequal = clearance("A", "a", "ground", upper=0.5, lower=0.3, stiffness=9.0)
    modelfile = parse_model_file(system_text(*ONE, unequal, table("response", omega=1.3)))
    system = modelfile.model.second_order()
    assert stage_kind(modelfile.circuit, system.clearances) == "rectifier"
    assert stage_kind(modelfile.circuit, ()) == "saturation"
    made = stage_choice.synthesise(modelfile, CATALOG)
    assert (made.modelfile.circuit.dead_zone, made.stage_reason) == ("rectifier", "")


@pytest.fixture(scope="module")
def plain() -> Synthesis:
    even = clearance("A", "a", "ground", upper=0.5, lower=0.5, stiffness=9.0)
    text = system_text(*ONE, even, table("response", omega=1.3))
    return stage_choice.synthesise(with_stage(parse_model_file(text), "rectifier"), CATALOG)


def test_boards_decide_before_rules_and_rules_before_parts(plain: Synthesis) -> None:
    def told(kept: int | None, *failed: str) -> StageForecast:
        outcomes = tuple(judged(BY_ID[name], [Finding(1e9, "v1")]) for name in failed)
        return StageForecast(replace(plain, outcomes=outcomes), kept)

    assert told(BOARDS, "offset-force").better_than(told(BOARDS // 2))
    assert not told(BOARDS // 2).better_than(told(BOARDS, "offset-force"))
    assert told(BOARDS - 1).better_than(told(BOARDS, "offset-force"))  # one board is chance
    assert told(None).better_than(told(None, "offset-force"))
    assert not told(BOARDS).better_than(told(BOARDS))
    assert chosen([told(10), told(60)]).stage_reason.startswith("rectifier: 60 of 64 boards")


def test_a_response_that_the_nominal_circuit_does_not_show_is_kept_by_no_board(
    plain: Synthesis,
) -> None:
    seen = forecast(plain, 2)
    assert seen.kept == BOARDS
    (response,) = plain.model_responses
    wanted = replace(response, spec=replace(response.spec, expect=Counts(5, ((2, 2),))))
    assert forecast(replace(plain, model_responses=(wanted,))).kept == 0


def test_the_fewest_are_counted_without_asking_all_boards() -> None:
    """Of responses that any share of the boards keeps; those that most keep are asked of few."""
    draws = np.random.default_rng(0)
    for _ in range(50):
        keeps = draws.random((5, BOARDS)) < draws.random((5, 1)) ** 0.3
        asked: list[int] = []

        def kept_by(number: int, boards: range, keeps: Mask = keeps, asked: Any = asked) -> int:
            asked.extend(BOARDS * number + board for board in boards)
            return int(keeps[number, boards].sum())

        assert least_kept(5, kept_by) == keeps.sum(axis=1).min()
        assert len(asked) == len(set(asked))
        if keeps.sum(axis=1).min() < BOARDS // 2:
            assert len(asked) < keeps.size


def test_other_verbs_show_the_circuit_that_is_synthesised(monkeypatch: pytest.MonkeyPatch) -> None:
    """``simulate`` on the circuit of a file without a stage has the stage that is chosen."""
    asked: list[str] = []

    def forecast_of(made: Synthesis, _jobs: int = 1) -> StageForecast:
        asked.append(str(made.modelfile.circuit.dead_zone))
        return StageForecast(made, BOARDS if asked[-1] == "rectifier" else 0)

    monkeypatch.setattr(stage_choice, "forecast", forecast_of)
    even = clearance("A", "a", "ground", upper=0.5, lower=0.5, stiffness=9.0)
    text = system_text(*ONE, even, table("response", omega=1.3))
    found = simulate(parse_model_file(text), engine="circuit", starts=1)
    assert sorted(asked) == ["rectifier", "saturation"]
    assert found.answer["responses"][0]["response"] == "1-1-1"
