"""What is proposed after a verb: command lines that the parser takes, where there is cause."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest

from designer.cli import command_line
from designer.verbs import next_steps
from designer.verbs.next_steps import Step


def response(found: bool = True, rate: float = 1.0) -> dict[str, Any]:
    return {"omega": 10.0, "expected": "1-1-1", "found": found, "rate": rate, "yield": {}}


def verbs(steps: Iterable[Step]) -> list[str]:
    """The verbs of command lines, each of which is parsed."""
    found = []
    for command, _ in steps:
        program, *words = shlex.split(command)
        if program == "designer":
            verb = command_line.application().commands[words[0]]
            verb.make_context(words[0], words[1:])
            found.append(words[0])
    return found


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a space in its name, and a board."""
    place = tmp_path / "my rig"
    (place / "kicad").mkdir(parents=True)
    (place / "kicad" / "rig.kicad_pcb").touch()
    return place


def test_after_a_study_what_has_cause_is_proposed(folder: Path) -> None:
    good: Any = {"responses": [response()]}
    assert verbs(next_steps.after_study(folder, good)) == ["rules", "export"]
    poor: Any = {"responses": [response(rate=0.5)]}
    assert verbs(next_steps.after_study(folder, poor))[0] == "search"
    unanswered: Any = {"responses": [response() | {"rate": None}]}
    assert verbs(next_steps.after_study(folder, unanswered))[0] == "search"
    left_out: Any = {"responses": [response(found=False) | {"yield": None, "rate": None}]}
    assert verbs(next_steps.after_study(folder, left_out))[0] == "bifurcation"
    (folder / "kicad" / "rig.kicad_pcb").unlink()
    assert verbs(next_steps.after_study(folder, good)) == ["export"]


def test_the_board_s_rules_are_proposed_once(folder: Path) -> None:
    without: Any = {"board": None}
    assert verbs(next_steps.after_rules(folder, without)) == ["rules"]
    on_board: Any = {"board": "rig.kicad_pcb"}
    assert verbs(next_steps.after_rules(folder, on_board)) == []


def test_a_model_in_hertz_is_swept_in_hertz(tmp_path: Path) -> None:
    wanted = response(found=False) | {"omega": 2.0 * math.pi * 36.0}
    for hertz in ({"frequency_hz": 36.0}, {"frequency_hz": 140.8, "mechanism_hz": 36.0}):
        steps = list(next_steps.after_response(tmp_path, [wanted | hertz]))
        assert verbs(steps) == ["bifurcation"]
        assert "--from '25.2 Hz' --to '46.8 Hz'" in steps[0][0]


def test_a_sweep_goes_around_the_frequency_that_was_wanted(tmp_path: Path) -> None:
    ((command, purpose),) = next_steps.after_response(tmp_path, [response(found=False)])
    assert "--from 7 --to 13" in command
    assert "1-1-1" in purpose
    any_response = response(found=False) | {"expected": None}
    ((_, purpose),) = next_steps.after_response(tmp_path, [any_response])
    assert "None" not in purpose


def test_a_design_or_a_model_leads_on(tmp_path: Path) -> None:
    design: Any = {"knobs": [response()]}
    assert verbs(next_steps.after_design(tmp_path, design)) == ["tolerance", "rules"]
    assert verbs(next_steps.after_model(tmp_path / "my.toml")) == ["simulate", "run"]


def test_rules_that_fail_are_proposed_first(tmp_path: Path) -> None:
    """And once: rules without a board say nothing else."""
    failing = {"failed_rules": [{"id": "swing"}, {"id": "offset-force"}]}
    design: Any = {"knobs": [response()], **failing}
    steps = list(next_steps.after_design(tmp_path, design))
    assert verbs(steps) == ["rules", "tolerance"]
    assert steps[0][1].endswith("swing, offset-force")
    study: Any = {"responses": [response()], **failing}
    assert verbs(next_steps.after_study(tmp_path, study)) == ["rules", "export"]
