"""The design folder: what is reused, what may be replaced, and what is never touched."""

from __future__ import annotations

import csv
import io
import json
import os
import shutil
from pathlib import Path
from typing import Any

import pytest

import designer
from designer.base.csv_tables import csv_text, safe_cell
from designer.base.design_folder import Folder
from designer.base.errors import InputError
from designer.base.manifest import MANIFEST, StageName, file_hash
from designer.base.natural_sort import natural_key
from designer.base.plain_json import dumps
from designer.centering import stage_choice
from designer.check import synthesis_result
from designer.check.synthesis_result import synthesise
from designer.cli import entry
from designer.folders import design_files
from designer.folders.design_source import read_design
from designer.model.model_file import read_model_file
from tests.shared.exploring import quick
from tests.shared.model_text import COARSE_RECTIFIER, PAPER_TABLE
from tests.shared.paper_cases import PAPER, synthesised
from tests.shared.quick_folders import without_starts

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

ROOT = Path(__file__).resolve().parents[2]
WANTED: dict[StageName, tuple[dict[str, Any], list[str]]] = {
    "design": ({"model": "a"}, ["model.toml", "design.json"])
}
STUDY: dict[StageName, tuple[dict[str, Any], list[str]]] = {
    **WANTED,
    "study": (
        {"model": "a", "seed": 1},
        ["tolerance.json", "samples.parquet/block-000000.parquet"],
    ),
}


def _fill(path: Path, wanted: Any = STUDY) -> Folder:
    folder = Folder(path)
    folder.begin(wanted, {})
    for stage, (_, names) in wanted.items():
        for name in names:
            folder.write(name, '{"format": 1}' if name.endswith(".json") else name)
        folder.finish(stage)
    return folder


def _decide(path: Path, wanted: Any, *, overwrite: bool = False, resume: bool = False) -> list[str]:
    return list(Folder(path).decide(wanted, overwrite=overwrite, resume=resume))


def test_a_board_that_somebody_has_worked_on_is_kept_beside_the_new_one(tmp_path: Path) -> None:
    """Hours of routing were replaced by --overwrite without a word. What is as the tool wrote it is
    replaced, and so is any other file."""
    board = "kicad/a.kicad_pcb"
    wanted: Any = {"design": ({"model": "a"}, ["model.toml", board])}
    for text in ("routed by hand", "routed again"):
        _fill(tmp_path, wanted)
        (tmp_path / board).write_text(text)
        (tmp_path / "model.toml").write_text("another")
    _fill(tmp_path, wanted)
    _fill(tmp_path, wanted)
    kept = sorted(path.name for path in (tmp_path / "kicad").iterdir())
    assert kept == ["a.kicad_pcb", "a.kicad_pcb.kept-1", "a.kicad_pcb.kept-2"]
    assert (tmp_path / f"{board}.kept-1").read_text() == "routed by hand"
    assert (tmp_path / f"{board}.kept-2").read_text() == "routed again"
    assert not list(tmp_path.glob("model.toml.*"))
    (tmp_path / board).write_text("routed once more")
    renamed: Any = {"design": ({"model": "b"}, ["model.toml", "kicad/b.kicad_pcb"])}
    _fill(tmp_path, renamed)
    assert (tmp_path / f"{board}.kept-3").read_text() == "routed once more"


def test_a_new_folder_does_everything(tmp_path: Path) -> None:
    out = tmp_path / "a" / "b"
    assert _decide(out, STUDY) == ["design", "study"]
    assert _decide(out, STUDY, resume=True) == ["design", "study"]
    assert not out.exists()


def test_the_same_inputs_do_nothing(tmp_path: Path) -> None:
    _fill(tmp_path)
    assert Folder(tmp_path).manifest is not None
    assert _decide(tmp_path, STUDY) == []
    assert _decide(tmp_path, STUDY, overwrite=True) == []
    assert _decide(tmp_path, WANTED) == []


def test_a_study_extends_a_design(tmp_path: Path) -> None:
    _fill(tmp_path, WANTED)
    assert _decide(tmp_path, STUDY) == ["study"]


def test_other_inputs_need_overwrite(tmp_path: Path) -> None:
    _fill(tmp_path)
    other: Any = {**STUDY, "study": ({"model": "a", "seed": 2}, STUDY["study"][1])}
    with pytest.raises(InputError, match=r"made with --seed 1, asked for 2.*--overwrite"):
        _decide(tmp_path, other)
    with pytest.raises(InputError):
        _decide(tmp_path, other, resume=True)
    assert _decide(tmp_path, other, overwrite=True) == ["study"]


def test_a_new_design_makes_the_study_anew(tmp_path: Path) -> None:
    _fill(tmp_path)
    other: Any = {"design": ({"model": "b"}, WANTED["design"][1])}
    assert _decide(tmp_path, other, overwrite=True) == ["design"]
    (tmp_path / "mine.txt").write_text("mine")
    folder = _fill(tmp_path, other)
    assert folder.manifest is not None
    assert set(folder.manifest.stages) == {"design"}
    left = {p.name for p in tmp_path.rglob("*") if p.is_file()}
    assert left == {MANIFEST, "model.toml", "design.json", "mine.txt"}


def test_unfinished_work_needs_a_word(tmp_path: Path) -> None:
    Folder(tmp_path).begin(STUDY, {})
    assert json.loads((tmp_path / MANIFEST).read_text())["complete"] is False
    with pytest.raises(InputError, match=r"--resume.*--overwrite"):
        _decide(tmp_path, STUDY)
    assert _decide(tmp_path, STUDY, resume=True) == ["design", "study"]
    assert _decide(tmp_path, STUDY, overwrite=True) == ["design", "study"]


@pytest.mark.parametrize("damage", ["changed", "gone"])
def test_changed_files_are_not_answers(tmp_path: Path, damage: str) -> None:
    _fill(tmp_path)
    path = tmp_path / "tolerance.json"
    if damage == "changed":
        path.write_text('{"format": 1, "responses": []}')
    else:
        path.unlink()
    with pytest.raises(InputError, match=r"tolerance\.json"):
        _decide(tmp_path, STUDY)
    assert _decide(tmp_path, STUDY, overwrite=True) == ["study"]


def test_cost_may_change(tmp_path: Path) -> None:
    _fill(tmp_path)
    (tmp_path / "tolerance.json").write_text('{"cost": {"seconds": 3.0}, "format": 1}')
    assert _decide(tmp_path, STUDY) == []
    assert file_hash("a.json", b'{"a":1,"cost":2}') == file_hash("a.json", b'{ "a": 1 }')
    assert file_hash("a.csv", b'{"a":1,"cost":2}') != file_hash("a.csv", b'{"a":1}')


def test_foreign_files_stand_in_the_way(tmp_path: Path) -> None:
    _fill(tmp_path, WANTED)
    (tmp_path / "tolerance.json").write_text("mine")
    for overwrite in (False, True):
        with pytest.raises(InputError, match="does not list"):
            _decide(tmp_path, STUDY, overwrite=overwrite)
    assert (tmp_path / "tolerance.json").read_text() == "mine"


@pytest.mark.parametrize("name", ["../victim", "/etc/passwd", "a/../../victim", "link/victim", ""])
def test_a_manifest_cannot_point_outside(tmp_path: Path, name: str) -> None:
    out = tmp_path / "out"
    _fill(out)
    (tmp_path / "victim").write_text("mine")
    (out / "link").symlink_to(tmp_path)
    manifest = json.loads((out / MANIFEST).read_text())
    manifest["files"][name] = {"stage": "design", "sha256": None}
    (out / MANIFEST).write_text(json.dumps(manifest))
    with pytest.raises(InputError, match="inside the folder"):
        Folder(out)
    assert (tmp_path / "victim").read_text() == "mine"


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        '{"format": 1}',
        '{"format": 2, "tool": "designer"}',
        '{"format": 1, "tool": 3}',
    ],
)
def test_other_manifests_are_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / MANIFEST).write_text(text)
    with pytest.raises(InputError):
        Folder(tmp_path)


def test_a_rewritten_file_is_no_changed_file(tmp_path: Path) -> None:
    folder = _fill(tmp_path)
    folder.rewrite("model.toml", "better")
    assert _decide(tmp_path, STUDY) == []
    path = tmp_path / "model.toml"
    assert path.read_text() == "better"
    before = path.stat().st_mtime_ns, path.stat().st_ino
    folder.rewrite("model.toml", "better")
    assert (path.stat().st_mtime_ns, path.stat().st_ino) == before
    path.write_text("spoilt")
    folder.rewrite("model.toml", "better")
    assert path.read_text() == "better"


def test_no_folder_below_a_file(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    for path in (tmp_path / "file", tmp_path / "file" / "a" / "b"):
        with pytest.raises(InputError, match="--out"):
            Folder(path)


@pytest.fixture(scope="module")
def paper(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The design folder of the paper's example; tests work on copies."""
    out = tmp_path_factory.mktemp("paper") / "out"
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(synthesis_result, "synthesise", lambda *_, **__: synthesised())
        without_starts(patched)
        assert entry.status(["synthesise", str(PAPER), "--out", str(out), "-q"]) == 0
    return out


@pytest.fixture
def copied(paper: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(paper, tmp_path / "copied"))


@pytest.mark.parametrize("example", quick(["paper.toml", "drill.toml"]))
def test_a_design_is_read_back_as_it_was_made(
    tmp_path: Path, copied: Path, example: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if example == "paper.toml":
        moved, made = copied, synthesised()
    else:
        model = ROOT / "examples" / example
        out, kept = tmp_path / "out", synthesise(read_model_file(model))
        monkeypatch.setattr(synthesis_result, "synthesise", lambda *_, **__: kept)
        without_starts(monkeypatch)
        # 0 or 1: whether every wanted response was found is not the question here
        assert entry.status(["synthesise", str(model), "--out", str(out), "-q"]) in (0, 1)
        moved, made = tmp_path / "elsewhere", kept
        os.rename(out, moved)
    found, design = made.model_responses, made.design
    again = read_design(moved)
    assert again.design.circuit == design.circuit
    assert again.design.errors.errors == design.errors.errors
    assert again.design.certificate == design.certificate
    assert [r.orbit.response for r in again.model_responses] == [r.orbit.response for r in found]
    scales = (moved / "scales.csv").read_text()
    assert ("metres per volt" in scales) == (example == "drill.toml")
    assert "model time per circuit second" in scales


def test_a_changed_model_in_a_folder_is_refused(copied: Path) -> None:
    path = copied / "model.toml"
    path.write_text(path.read_text().replace("b = 0.25", "b = 0.26"))
    with pytest.raises(InputError, match=r"model\.toml"):
        read_design(copied)


def test_parts_that_do_not_fit_are_refused(copied: Path) -> None:
    path = copied / "design.json"
    design = json.loads(path.read_text())
    for parts in ({**design["parts"], "R2": 1.0}, {}, None, {**design["parts"], "R2": "x"}):
        path.write_text(json.dumps({**design, "parts": parts}))
        with pytest.raises(InputError, match=r"design\.json"):
            read_design(copied)


def test_cells_cannot_start_a_formula() -> None:
    for text in ("=1+1", "+cmd", "-cmd", "@SUM(A1)", "\t=1", "\r=1"):
        assert safe_cell(text).startswith("'")
    for text in ("-1.5", "+3", "1e-9", "R1 R2", "a,b"):
        assert safe_cell(text) == text
    text = csv_text(("a", "b"), [{"a": '=1,"x"', "b": "2"}])
    assert list(csv.reader(io.StringIO(text))) == [["a", "b"], ['\'=1,"x"', "2"]]
    assert sorted(["R10", "R2", "C1", "R203A"], key=natural_key) == ["C1", "R2", "R10", "R203A"]
    strange = ["R²", "R١", "", "2", "R" + "9" * 5000, "R10"]  # on a board that somebody else drew
    assert sorted(strange, key=natural_key) == ["", "2", "R10", "R" + "9" * 5000, "R²", "R١"]


def test_json_is_strict() -> None:
    value = {"a": float("nan"), "b": [float("inf"), 0.1], "c": 1 + 2j, "d": True, "e": "µ\x1b"}
    text = dumps(value)
    assert json.loads(text) == {"a": None, "b": [None, 0.1], "c": [1, 2], "d": True, "e": "µ\x1b"}
    assert text.isascii()
    with pytest.raises(TypeError):
        dumps({"a": object()})


@pytest.mark.slow
def test_files_stand_before_what_takes_longer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Parts, deck, bill and KiCad project before the other stage is looked at, which goes on beside
    the start recipes and has its word in the answer."""
    met: dict[str, set[str]] = {}

    def files() -> set[str]:
        return {path.name for path in (tmp_path / "made").rglob("*") if path.is_file()}

    def doubtful(*_: object) -> int:
        met["stage"] = files()
        return 30

    def better(*_: object) -> str:  # not for another process, which cannot have it
        return "The other one is better."

    def sought(*_: object) -> list[None]:
        met["recipes"] = files()
        return [None]

    monkeypatch.setattr(stage_choice, "kept_of_doubtful", doubtful)
    monkeypatch.setattr(stage_choice, "other_stage", better)
    monkeypatch.setattr(design_files, "start_recipes", sought)
    text = f"format = 1\n{PAPER_TABLE}[[response]]\nomega = 0.54\n{COARSE_RECTIFIER}"
    file = tmp_path / "model.toml"
    file.write_text(text, encoding="utf-8")
    made = designer.synthesise(file, out=tmp_path / "made")
    first = {"circuit.cir", "bom.csv", "model.kicad_sch"}
    assert first <= met["stage"] <= met["recipes"] < files()
    assert {"setup.csv", "design.json"} <= files() - met["recipes"]
    assert "The other one is better." in made.answer["warnings"]
