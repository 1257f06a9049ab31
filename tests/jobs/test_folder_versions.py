"""Design folders that released versions wrote, as `scripts/store-folders` stored them: this version
reads each with every verb, and refuses a folder of a format that it does not know."""

from __future__ import annotations

import json
import shutil
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from designer.base.version import __version__
from designer.cli import entry as cli
from designer.folders import design_source
from designer.folders.design_source import read_design
from designer.jobs import stage_runner, study_job
from designer.jobs.study_stage import Place, read_study
from tests.shared.exploring import quick
from tests.shared.stopped_work import work_stopped

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

STORED = sorted((Path(__file__).parent / "folders").glob("*/*.zip"))
OF_THIS_VERSION = [path for path in STORED if path.parent.name == __version__]
STUDY = "--rung exact --map grade"
VERBS = {
    "export": "export {}",
    "rules": "rules {}",
    "simulate": "simulate {} --engine circuit --starts 1",
    "sweep of the circuit": "bifurcation {} --circuit --from 1 --to 0.9 --steps 3",
    "sweep of the model": "bifurcation {} --from 1 --to 0.9 --steps 3",
    "search": "search {} --yield 0.9",
    "trade": "trade {}",
    "bench": "bench {} --record {}/model.toml",
}
ANEW = {
    "run": "run {}",
    "tolerance": f"tolerance {{}} {STUDY}",
}
"""Verbs whose stage is of the version that made it: --overwrite makes it anew."""


def unpacked(archive: Path, place: Path) -> Path:
    with zipfile.ZipFile(archive) as stream:
        stream.extractall(place)
    return place


@pytest.fixture(scope="module", params=STORED, ids=lambda p: f"{p.parent.name}-{p.stem}")
def stored(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return unpacked(request.param, tmp_path_factory.mktemp("stored") / "design")


@pytest.fixture
def later(monkeypatch: pytest.MonkeyPatch) -> None:
    """This version is a later one than wrote any folder."""
    monkeypatch.setattr(design_source, "__version__", "99.0")


@pytest.fixture(scope="module")
def begun(stored: Path) -> Iterator[Path]:
    """The folder, for verbs that stop where their work begins."""
    with work_stopped(stored):
        yield stored


def document(path: Path) -> dict[str, Any]:
    answer: dict[str, Any] = json.loads(path.read_text("ascii"))
    return answer


def test_every_format_of_model_files_is_stored() -> None:
    """Of each version; ``scripts/store-folders`` stores this one's when its number changes."""
    for version in {path.parent for path in STORED} | {STORED[0].parents[1] / __version__}:
        assert {path.stem for path in version.glob("*.zip")} == {"format-1", "format-2"}


@pytest.mark.parametrize("archive", OF_THIS_VERSION, ids=lambda path: path.stem)
def test_a_study_is_answered_as_it_was(
    archive: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    """By the version that made it, where nothing that decides a study is another since."""
    stored = unpacked(archive, tmp_path / "design")
    inputs = document(stored / "manifest.json")["stages"]["design"]["inputs"]
    for module in (design_source, stage_runner, study_job):
        monkeypatch.setattr(module, "design_inputs", lambda *_: inputs)
    written = document(stored / "tolerance.json")
    assert cli.status(["tolerance", str(stored), *STUDY.split(), "--json"]) in (0, 1)
    assert json.loads(capfd.readouterr().out)["responses"] == written["responses"]


def test_the_design_and_the_rows_are_those_that_were_written(stored: Path) -> None:
    synthesis = read_design(stored)
    written = document(stored / "design.json")["parts"]
    assert synthesis.design.circuit.values == written
    study = read_study(stored, synthesis, Place("study"))
    answers = document(stored / "tolerance.json")["responses"]
    assert [(y.ok, y.samples) for y in study.yields if y is not None] == [
        (answer["yield"]["ok"], answer["yield"]["samples"]) for answer in answers
    ]


@pytest.mark.parametrize("verb", quick([*VERBS, *ANEW], 3))
@pytest.mark.usefixtures("later")
def test_every_verb_reads_it(
    verb: str, begun: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """A later version gets to where the verb's work begins."""
    folder = shutil.copytree(begun, tmp_path / "copied")
    command = (VERBS | ANEW)[verb].format(folder, folder).split()
    if verb in ANEW:
        assert cli.status(command) == 2
        assert "--overwrite" in capfd.readouterr().err
        command.append("--overwrite")
    assert cli.status(command) == 130, capfd.readouterr().err


@pytest.mark.parametrize("name", ["manifest.json", "design.json", "model.toml"])
def test_a_newer_format_is_refused(
    name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Exit 2, the file, and what to do; nothing is written."""
    folder = unpacked(STORED[0], tmp_path / "design")
    text = (folder / name).read_text("utf-8")
    newer = text.replace('"format": 1', '"format": 3', 1).replace("format = 1", "format = 3", 1)
    assert newer != text
    (folder / name).write_text(newer, "utf-8")
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    assert cli.status(["rules", str(folder)]) == 2
    message = capfd.readouterr().err
    assert f"{name}: format: found 3" in message
    assert "newer version of designer" in message
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before
