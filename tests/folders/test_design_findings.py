"""What is not good enough about a design is said first, wherever a design is answered."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from designer.base.design_folder import Folder
from designer.base.plain_json import plain
from designer.catalog.design_rule import FAIL
from designer.cli import entry
from designer.folders import design_files
from designer.folders.design_findings import findings, subject_of as look_at
from designer.folders.design_source import design_answer
from designer.jobs import rules_job
from designer.model.model_file import parse_model_file
from tests.design_rules.test_run_rules import written
from tests.shared.model_text import SMALL
from tests.shared.rule_cases import TEXT, base, subject_of
from tests.shared.stages import PAPER, bought, rectifier, stage

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

LOW_SWING = '[rules.swing]\nlimit = "1 V"\nreason = "a test"\n'


def test_a_design_that_keeps_everything_has_no_finding() -> None:
    assert findings(base().synthesis, base()) == {"warnings": [], "failed_rules": []}


@pytest.mark.slow
def test_the_rules_that_fail_are_those_of_the_verb() -> None:
    """No circuit for this model stays below a volt."""
    made = replace(base().synthesis, modelfile=parse_model_file(TEXT + LOW_SWING))
    found = findings(made, look_at(made))
    assert [rule["id"] for rule in found["failed_rules"]] == ["swing"]
    checked = [o.as_dict() for o in rules_job.checked(made).outcomes if o.status == FAIL]
    assert plain(found["failed_rules"]) == plain(checked)
    assert found["warnings"] == ["A design rule fails on the circuit: swing."]


def test_a_stop_without_force_is_a_large_error_and_another_response() -> None:
    """R50 makes the stop's force; a thousand times as large it makes none."""
    values = bought(rectifier())
    values["R50"] *= 1000.0
    wrong = subject_of(stage("rectifier", "both", values), PAPER, TEXT).synthesis
    error, response, *_ = findings(wrong, look_at(wrong))["warnings"]
    assert error.startswith("The largest coefficient error is ")
    assert "stop" in error
    assert "above 1 %" in error
    assert "circuit.composites = true" in error
    assert response.startswith("The nominal circuit does not show 1-1-1 at ω = 1.55: ")


def test_a_folder_of_an_earlier_version_is_judged_when_it_is_asked(tmp_path: Path) -> None:
    path = written(tmp_path / "design", TEXT)
    assert "failed_rules" not in json.loads((path / "design.json").read_text("utf-8"))
    answer = design_answer(Folder(path))
    assert (answer["warnings"], answer["failed_rules"]) == ([], [])


@pytest.mark.slow
def test_a_design_is_told_first_and_its_files_are_there_before_its_starts(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    model, out = tmp_path / "m.toml", tmp_path / "out"
    model.write_text(SMALL + LOW_SWING, encoding="utf-8")
    there: list[bool] = []
    told: list[str] = []

    def starts(made: Any, *_: object) -> list[None]:
        names = ("bom.csv", "circuit.cir", "schematic.svg", "scales.csv")
        there.extend((out / name).is_file() for name in names)
        told.append(capfd.readouterr().err)
        return [None] * len(made.model_responses)

    monkeypatch.setattr(design_files, "start_recipes", starts)
    words = ["synthesise", str(model), "--out", str(out)]
    assert entry.status(words) == 0
    assert there == [True] * 4
    (early,) = told
    first = capfd.readouterr().err
    assert early.index("\nparts stand after") < early.index("\nParts\n")
    assert first.index("Not good enough: ") < first.index("Design rules that fail")
    assert "\nParts\n" not in first
    assert f"designer rules {out}" in first
    assert entry.status(words) == 0  # nothing is made anew
    again = capfd.readouterr().err
    assert (
        again[again.index("Not good") :].splitlines()[:5]
        == (first[first.index("Not good") :].splitlines()[:5])
    )
    assert entry.status([*words, "--json"]) == 0
    answer = json.loads(capfd.readouterr().out)
    assert entry.status(["rules", str(out), "--json"]) == 1
    judged = json.loads(capfd.readouterr().out)["rules"]
    of_circuit = [rule for rule in judged if rule["scope"] == "circuit"]
    assert answer["failed_rules"] == [rule for rule in of_circuit if rule["status"] == FAIL]
    assert any("design rule" in text for text in answer["warnings"])


@pytest.mark.slow
def test_starts_that_are_interrupted_are_sought_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model, out = tmp_path / "m.toml", tmp_path / "out"
    model.write_text(SMALL, encoding="utf-8")

    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(design_files, "start_recipes", stopped)
    words = ["synthesise", str(model), "--out", str(out)]
    assert entry.status(words) == 130
    assert not (out / "design.json").exists()
    monkeypatch.setattr(design_files, "start_recipes", lambda made, *_: [None])
    assert entry.status(words) == 2  # unfinished: only --resume goes on
    assert entry.status([*words, "--resume"]) == 0
    assert (out / "design.json").is_file()
