"""A verb on a design folder goes on with the folder's own numbers, unless others are given."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from designer.base.defaults import TRADE_BOARDS
from designer.base.design_folder import Folder
from designer.cli import command_line, entry
from designer.folders import model_source
from designer.jobs import folder_numbers, search_job, study_job, trade_job
from designer.jobs.options import Options
from designer.model.model_file import parse_model_file
from tests.shared.model_text import SMALL

STUDY = {"samples": 50, "seed": 7, "until": 0.1, "layers": ["samples"]}


class _Asked(Exception):
    """options : of the work that a verb was about to do."""

    def __init__(self, options: Any) -> None:
        self.options = options


def folder(path: Path, **stages: dict[str, Any]) -> Path:
    """A folder with finished stages of these inputs, and nothing in them."""
    place = Folder(path)
    for name, inputs in stages.items():
        place.begin({name: (inputs, [])}, {})  # type: ignore[dict-item]
        place.finish(name)  # type: ignore[arg-type]
    return path


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every verb on a folder ends where its work would begin."""

    def study(modelfile: Any, out: Path, options: Options, *_: Any, **__: Any) -> Any:
        raise _Asked(options)

    def repaired(path: Path, **options: Any) -> Any:
        raise _Asked(options)

    def trade(modelfile: Any, out: Path, options: Options, extent: Any, *_: Any) -> Any:
        raise _Asked((options, extent))

    def source(path: Path, out: Path | None) -> Any:
        return parse_model_file(SMALL), path if out is None else out

    for module in (study_job, model_source):
        monkeypatch.setattr(module, "source", source)
    monkeypatch.setattr(study_job, "run_into", study)
    monkeypatch.setattr(search_job, "search_into", study)
    monkeypatch.setattr(trade_job, "answer", trade)
    monkeypatch.setattr("designer.jobs.repair_job.repair_into", repaired)


def options_of(*words: object) -> Any:
    """What a command line would work with."""
    with pytest.raises(_Asked) as met:
        command_line.dispatch([str(w) for w in words])
    return met.value.options


@pytest.mark.usefixtures("asked")
@pytest.mark.parametrize("verb", ["tolerance", "run"])
def test_a_study_has_the_folders_own_numbers(tmp_path: Path, verb: str) -> None:
    out = folder(tmp_path / "out", design={}, study=STUDY)
    options = options_of(verb, out, "-q")
    assert (options.samples, options.seed, options.until) == (50, 7, 0.1)
    assert options.rung == ("exact" if verb == "tolerance" else "auto")
    given = options_of(verb, out, "--samples", "20", "--seed", "2", "-q")
    assert (given.samples, given.seed) == (20, 2)
    anew = options_of(verb, out, "--overwrite", "-q")
    assert (anew.samples, anew.seed, anew.until) == (50, 7, None)


@pytest.mark.usefixtures("asked")
def test_a_study_that_asked_ngspice_goes_on_asking(tmp_path: Path) -> None:
    out = folder(tmp_path / "out", study={**STUDY, "layers": ["ngspice", "samples"]})
    assert options_of("tolerance", out, "-q").rung == "auto"
    lagging = folder(tmp_path / "lagging", study={**STUDY, "rung": "bandwidth"})
    assert options_of("tolerance", lagging, "-q").rung == "bandwidth"
    assert options_of("tolerance", lagging, "--rung", "exact", "-q").rung == "exact"
    exact = folder(tmp_path / "exact", study=STUDY)
    assert options_of("tolerance", exact, "--rung", "auto", "-q").rung == "auto"


@pytest.mark.usefixtures("asked")
def test_a_model_file_has_the_usual_numbers_unless_work_is_resumed(tmp_path: Path) -> None:
    """Who names a model file begins; who resumes goes on with what was begun."""
    out = folder(tmp_path / "out", study=STUDY)
    model = tmp_path / "small.toml"
    model.write_text(SMALL)
    usual = options_of("tolerance", model, "--out", out, "-q")
    assert (usual.samples, usual.seed, usual.rung) == (200, 1, "auto")
    resumed = options_of("tolerance", model, "--out", out, "--resume", "-q")
    assert (resumed.samples, resumed.seed, resumed.rung) == (50, 7, "exact")


@pytest.mark.usefixtures("asked")
@pytest.mark.parametrize(
    ("layers", "words", "attributed", "budget"),
    [
        (["samples"], [], True, None),
        (["samples", "without blame"], [], False, None),
        (["samples", "without blame"], ["--blame"], True, None),
        (["blame budget 900", "samples"], [], True, 900),
        (["blame budget 900", "samples"], ["--blame-budget", "1000"], True, 1000),
        (["blame budget 900", "samples"], ["--no-blame"], False, None),
    ],
)
def test_the_attribution_is_as_the_folder_has_it(
    tmp_path: Path, layers: list[str], words: list[str], attributed: bool, budget: int | None
) -> None:
    out = folder(tmp_path / "out", study={**STUDY, "layers": layers})
    options = options_of("tolerance", out, *words, "-q")
    assert (options.blame, options.blame_budget) == (attributed, budget)


@pytest.mark.usefixtures("asked")
def test_a_repair_has_the_folders_own_yield_and_seed(tmp_path: Path) -> None:
    inputs = {"yield": 0.97, "budget": 3.0, "without": ["trim"], "seed": 4}
    out = folder(tmp_path / "out", design={}, cure=inputs)
    options = options_of("search", out, "-q")
    assert options["target"] == 0.97
    assert options["budget"] == 3.0
    assert options["without"] == ["trim"]
    assert options["options"].seed == 4
    anew = options_of("search", out, "--yield", "0.9", "--overwrite", "-q")
    assert (anew["target"], anew["budget"], list(anew["without"])) == (0.9, None, [])
    none = folder(tmp_path / "none", design={})
    assert entry.status(["search", str(none), "-q"]) == 2


@pytest.mark.usefixtures("asked")
def test_a_search_that_is_resumed_has_its_own_numbers(tmp_path: Path) -> None:
    out = folder(tmp_path / "out", search={"seed": 9}, study=STUDY)
    model = tmp_path / "small.toml"
    model.write_text(SMALL)
    options = options_of("search", model, "--out", out, "--resume", "-q")
    assert (options.seed, options.samples) == (9, 50)
    usual = options_of("search", model, "--out", out, "-q")
    assert (usual.seed, usual.samples) == (1, 4000)


@pytest.mark.usefixtures("asked")
def test_a_trade_has_the_folders_own_boards(tmp_path: Path) -> None:
    out = folder(tmp_path / "out", design={}, trade={"boards": 12, "seed": 3})
    options, extent = options_of("trade", out, "-q")
    assert (options.seed, extent.boards) == (3, 12)
    options, extent = options_of("trade", out, "--boards", "5", "-q")
    assert (options.seed, extent.boards) == (3, 5)
    none = folder(tmp_path / "none", design={})
    options, extent = options_of("trade", none, "-q")
    assert (options.seed, extent.boards) == (1, TRADE_BOARDS)


def test_limits_that_are_none_are_left_out(tmp_path: Path) -> None:
    out = folder(tmp_path / "out", study={**STUDY, "until": None})
    assert folder_numbers.stage_numbers(Folder(out), "study", ("seed",), ("until",)) == {"seed": 7}
    assert folder_numbers.stage_numbers(Folder(out), "trade", ("seed",)) == {}
    assert json.loads((out / "manifest.json").read_text())["complete"]
