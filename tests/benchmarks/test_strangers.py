"""The population of strangers' systems: what is drawn, what is kept of a run, what is counted."""

from __future__ import annotations

import json
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from benchmarks import __main__ as command, bench_strangers, stranger_parts, stranger_systems
from benchmarks.bench_strangers import ANSWERED, INEXACT, REFUSED, SILENT
from benchmarks.stranger_systems import LAWS, SHAPES, draw
from designer.model.find_responses import find
from designer.model.model_file import parse_model_file
from tests.shared.exploring import seeds

ROW: dict[str, Any] = {
    "number": 0, "masses": 2, "clearances": 1, "kinds": ["base"], "size": "mm, kg", "exit": 0,
    "cpu": 12.0, "wall": 13.0, "first_parts": 2.0, "outcome": ANSWERED, "max_error": 2e-3,
    "worst": "x1' x1", "certificate": "bound", "lower_bound": 1e-3, "model": "1-1-1",
    "nominal": "1-1-1", "shown": True, "boards": {"ok": 190, "lost": 10},
}  # fmt: skip
SAID: dict[str, Any] = {
    k: ROW[k] for k in ("masses", "clearances", "kinds", "size", "wall", "first_parts")
} | {"exit": 2, "said": "circuit: no choice of parts"}


@pytest.mark.slow
@pytest.mark.parametrize("number", seeds(4))
def test_each_file_is_read_and_shows_its_response(number: int) -> None:
    stranger = draw(7, number)
    modelfile = parse_model_file(stranger.text)
    system = modelfile.model.second_order()
    assert (system.size, len(system.clearances)) == (stranger.masses, stranger.clearances)
    assert ("base" in stranger.kinds) == bool(system.base)
    assert ("constant force" in stranger.kinds) == bool(system.constant.any())
    between = any(clearance.other is not None for clearance in system.clearances)
    assert ("between masses" in stranger.kinds) == between
    held = any(stop.gap < 0.0 for c in system.clearances for _, stop in c.sides)
    assert ("preloaded" in stranger.kinds) == held
    assert all(response.found for response in find(modelfile.model, modelfile.responses))
    assert draw(7, number).text == stranger.text


def test_thirty_in_a_row_have_every_shape(monkeypatch: pytest.MonkeyPatch) -> None:
    # Neither the response nor the rest of a file decides on the shape.
    monkeypatch.setattr(stranger_systems._Drawn, "with_response", lambda self, title: title)
    for first in (0, 30):
        drawn = Counter((s.masses, s.clearances) for s in (draw(3, first + k) for k in range(30)))
        assert drawn == dict(SHAPES)


def test_ten_in_a_row_have_every_law() -> None:
    kinds: Counter[str] = Counter()
    for number in range(10):
        stranger = draw(5, number, "laws")
        modelfile = parse_model_file(stranger.text)
        system = modelfile.model.second_order()
        assert (system.size, len(system.clearances)) == (stranger.masses, stranger.clearances)
        assert any(zone.bend_of for zone in system.dead_zones)
        kinds.update(kind for kind in stranger.kinds if kind in dict(LAWS))
        if number < 4:
            assert all(r.found for r in find(modelfile.model, modelfile.responses))
    assert kinds == dict(LAWS)


@pytest.fixture
def no_response_sought(monkeypatch: pytest.MonkeyPatch) -> None:
    """Files as they are drawn: that takes no time."""
    monkeypatch.setattr(
        stranger_systems._Drawn,
        "with_response",
        lambda self, title: self._elements(title) + "\n[[response]]\nomega = 1.0\n",
    )


@pytest.mark.usefixtures("no_response_sought")
def test_thirty_in_a_row_are_linked_in_every_way() -> None:
    kinds: Counter[str] = Counter()
    for number in range(30):
        stranger = draw(5, number, "linked")
        clearances = parse_model_file(stranger.text).model.second_order().clearances
        assert any(stop.damping for stop in clearances) == ("damped stops" in stranger.kinds)
        assert any(stop.push for stop in clearances) == ("mass matrix" in stranger.kinds)
        kinds.update(stranger.kinds)
    assert min(kinds[kind] for kind in ("damped stops", "combination", "mass matrix")) >= 5


@pytest.mark.usefixtures("no_response_sought")
def test_thirty_in_a_row_are_driven_in_every_way() -> None:
    """Never by one sine, and never by more than a generator of two channels gives."""
    kinds: Counter[str] = Counter()
    channels: Counter[int] = Counter()
    for number in range(30):
        stranger = draw(5, number, "driven")
        system = parse_model_file(stranger.text).model.second_order()
        shapes = system.drive_shapes(system.own_frequency)
        assert shapes != (((1, 1.0, 0.0),),) or "phase" in stranger.text
        kinds.update(kind for kind in stranger.kinds if kind in dict(stranger_systems.DRIVES))
        channels[len(shapes)] += 1
    assert sum(kinds.values()) == 30
    assert kinds.keys() == dict(stranger_systems.DRIVES).keys()
    assert min(channels[1], channels[2]) >= 5


def test_an_interrupted_run_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []

    def measure(stranger: Any, *_: object) -> dict[str, Any]:
        asked.append(stranger.number)
        if stranger.number == 2 and len(asked) < 4:
            raise KeyboardInterrupt
        return {**ROW, "number": stranger.number}

    monkeypatch.setattr(bench_strangers, "measure", measure)
    monkeypatch.setattr(bench_strangers, "commit", lambda: "c")
    words = ["--seed", "7", "--count", "3", "--seconds", "9", "--out", str(tmp_path)]
    with pytest.raises(SystemExit, match="goes on"):
        bench_strangers.main(words)
    with (tmp_path / bench_strangers.LINES).open("a") as file:
        file.write('{"seed": 7, "numb')  # cut off
    assert bench_strangers.main(words).startswith("3 of 3 below 1 %")
    assert asked == [0, 1, 2, 2]
    said = json.loads((tmp_path / "strangers.json").read_text())
    assert [row["number"] for row in said["systems"]] == [0, 1, 2]
    with pytest.raises(SystemExit, match="another population"):
        bench_strangers.main([*words, "--seed", "8"])


@pytest.mark.slow
def test_what_was_refused_is_sought_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = {"found": True, "max_error": 4e-3}
    refused = {**SAID, "outcome": REFUSED, "cpu": 3.0}
    calls: list[float] = []

    def sought(_: Path, seconds: float) -> dict[str, Any]:
        calls.append(seconds)
        return found

    monkeypatch.setattr(
        bench_strangers, "measure", lambda stranger, *_: {**refused, "number": stranger.number}
    )
    monkeypatch.setattr(bench_strangers, "sought", sought)
    monkeypatch.setattr(bench_strangers, "commit", lambda: "c")
    words = ["--seed", "7", "--count", "1", "--out", str(tmp_path)]
    assert bench_strangers.main([*words, "--search", "0"]).endswith("0 refused wrongly")
    for _ in range(2):
        assert bench_strangers.main([*words, "--search", "5"]).endswith("1 refused wrongly")
    assert calls == [5.0]
    assert "0.4 %" in (tmp_path / "README.md").read_text()


def test_counts() -> None:
    rows = [
        ROW,
        {**ROW, "number": 1, "cpu": 25.0, "shown": False, "boards": None},
        {**ROW, "number": 2, "outcome": INEXACT, "max_error": 0.19, "cpu": 61.0},
        {**SAID, "number": 3, "outcome": REFUSED, "cpu": 3.0, "sought": {"found": False}},
        {**SAID, "number": 4, "outcome": SILENT, "cpu": 120.0, "sought": {"found": True}},
    ]
    said = bench_strangers.figures(rows)
    assert said["below_1_percent"] == 2
    assert said["within_20_s"] == 1
    assert said["within_60_s"] == 2
    assert (said["above_1_percent"], said["refused"], said["no_answer"]) == (1, 1, 1)
    assert said["wrongly_refused"] == 1
    assert (said["nominal_shows_it"], said["nominal_asked"]) == (1, 2)
    assert (said["yield_95"], said["yield_asked"]) == (1, 2)


@pytest.mark.slow
def test_a_process_is_ended_at_its_limit() -> None:
    loop = "import sys\nprint('parts stand', file=sys.stderr, flush=True)\nwhile True: pass"
    run = bench_strangers.Run([sys.executable, "-c", loop], 1, "parts stand")
    assert run.status < 0
    assert run.cpu > 0.0
    assert run.noted is not None


def test_options_belong_to_one_benchmark(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["--count", "3"]) == 2
    assert command.main(["flow", "--count", "3"]) == 2
    assert "flow has no options" in capsys.readouterr().err


@pytest.mark.slow
def test_the_other_search_finds_parts_where_there_are_some_and_none_where_there_are_none() -> None:
    text = draw(7, 2).text
    found = stranger_parts.search(parse_model_file(text), 30.0)
    assert found["found"]
    assert 0.0 < float(str(found["max_error"])) < 0.01
    band = 'frequency = ["60 kHz", "70 kHz"]\n'  # too fast for the op-amp's bandwidth
    fast = text.replace("[circuit]\n", f"[circuit]\n{band}")
    assert not stranger_parts.search(parse_model_file(fast), 1.0)["found"]
