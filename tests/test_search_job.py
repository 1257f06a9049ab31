"""A search with its folder: written, reused, interrupted, and taken by every other verb."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import pytest

from designer import cli
from designer.modelfile import parse_model_file
from designer.search_job import confirms
from designer.search_levers import Choice
from designer.search_memory import Memory
from designer.search_resolved import resolved
from tests.search_cases import asked, made

OPEN = 'omega = "best"\nexpect = "1-2-2"\nb = [0.25, 0.27]'
MORE = "[spread]\noffset = 0\n"


def run(*arguments: object) -> int:
    return cli.status([str(a) for a in arguments])


def read(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


def files(folder: Path) -> dict[str, str]:
    """Hashes of the files, those of JSON without their times."""
    said = read(folder / "manifest.json")["files"]
    return {name: entry["sha256"] for name, entry in said.items()}


def test_a_resolved_file_says_what_was_open() -> None:
    asked_file = parse_model_file(asked(OPEN, more=MORE))
    synthesis = made()
    found = resolved(asked_file, synthesis, Choice.of(asked_file.circuit), Path("model.toml"))
    (response,) = found.responses
    assert response.omega == synthesis.found[0].omega
    assert response.b == synthesis.found[0].b
    assert response.expect == asked_file.responses[0].expect
    assert found.circuit == asked_file.circuit
    assert found.spread == asked_file.spread
    assert found.search == asked_file.search
    assert (found.model, found.title) == (asked_file.model, asked_file.title)
    assert found.sha256 == parse_model_file(found.text).sha256


@pytest.mark.slow
def test_a_search_from_end_to_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("designer.search.LEVERS", ("opamp", "dead zone", "amplitude"))
    model, whole, cut = (
        tmp_path / "model.toml",
        tmp_path / "whole" / "found",
        tmp_path / "cut" / "found",
    )
    model.write_text(asked(OPEN, band=(0.75, 0.95)), encoding="utf-8")
    # The folders have one name: the report states the command.
    options = ("--samples", 60, "--jobs", 2, "-q")
    assert run("search", model, "--out", whole, *options, "--json") == 0
    answer = json.loads(capsys.readouterr().out)

    # The keys of ``synthesise``, yields of fresh boards, and what the search did.
    assert {"parts", "errors", "max_error", "certificate", "scales", "knobs"} <= set(answer)
    (response,) = answer["responses"]
    assert response["yield"]["samples"] == 60
    assert response["yield"]["ok"] >= 58
    assert response["limited_by"]["line"]
    (confirmed,) = answer["confirmation"]["responses"]
    assert answer["confirmation"]["rung"] == "dynamic"
    assert confirmed["asked"] >= 40
    assert confirmed["agreed"] >= 38
    search = answer["search"]
    assert search["final"]["smallest_distance"] >= search["start"]["smallest_distance"]
    assert search["steps"]

    # The chosen place stands wherever a verb looks for it.
    (place,) = search["final"]["responses"]
    assert 0.25 <= place["b"] <= 0.27
    assert 0.75 <= place["omega"] <= 0.95
    assert answer["knobs"][0]["omega"] == place["omega"]
    with (whole / "setup.csv").open(encoding="utf-8", newline="") as stream:
        assert float(next(csv.DictReader(stream))["omega"]) == place["omega"]
    assert (whole / "asked.toml").read_bytes() == model.read_bytes()
    written = parse_model_file((whole / "model.toml").read_text(encoding="utf-8"))
    assert written.responses[0].omega == place["omega"]

    # Again: nothing is done. With other inputs: refused.
    before = files(whole)
    assert run("search", model, "--out", whole, *options) == 0
    assert files(whole) == before
    assert run("search", model, "--out", whole, "--samples", 60, "--seed", 2, "-q") == 2
    assert files(whole) == before

    # Interrupted and resumed, it ends with the same files.
    write, left = Memory._write, [3]

    def interrupted(self: Memory, rows: dict[str, tuple[int, ...]]) -> None:
        write(self, rows)
        left[0] -= 1
        if not left[0]:
            raise KeyboardInterrupt

    monkeypatch.setattr(Memory, "_write", interrupted)
    assert run("search", model, "--out", cut, *options) == 130
    monkeypatch.setattr(Memory, "_write", write)
    assert not read(cut / "manifest.json")["complete"]
    assert run("search", model, "--out", cut, *options) == 2
    assert run("search", model, "--out", cut, *options, "--resume") == 0
    assert files(cut) == before

    # The folder is a design folder like any other.
    capsys.readouterr()
    assert run("simulate", whole, "--engine", "circuit", "-q", "--json") == 0
    assert json.loads(capsys.readouterr().out)["responses"][0]["response"] == "1-2-2"
    moved = whole.rename(tmp_path / "moved")
    assert run("tolerance", moved, "--samples", 60, "--rung", "exact", "--jobs", 2, "-q") == 0


@pytest.mark.parametrize("verb", ["search", "synthesise", "run", "tolerance"])
def test_what_cannot_be_sought_writes_nothing(
    verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "model.toml"
    model.write_text(asked('omega = "best"'), encoding="utf-8")
    assert run(verb, model, "--out", tmp_path / "out", "-q") == 2
    said = capsys.readouterr().err
    assert str(model) in said
    assert "response[1].expect" in said
    assert not (tmp_path / "out").exists()


def test_a_match_leaves_no_place_open(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "model.toml"
    model.write_text(asked(OPEN, objective="match"), encoding="utf-8")
    assert run("synthesise", model, "--out", tmp_path / "out", "-q") == 2
    assert 'circuit.objective = "yield"' in capsys.readouterr().err
    assert run("search", model, "--yield", 0.9, "--out", tmp_path / "out", "-q") == 2
    assert "--yield" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("passed", "asked", "agreed", "held"),
    [
        (True, 40, 40, True),
        (True, 40, 38, True),
        (True, 40, 37, False),
        (True, 0, 0, False),
        (False, 40, 40, False),
        (None, 40, 40, False),
    ],
)
def test_what_ngspice_bears_out(passed: bool | None, asked: int, agreed: int, held: bool) -> None:
    gate = None if passed is None else {"passed": passed}
    assert confirms({"gate": gate, "asked": asked, "agreed": agreed}) is held
