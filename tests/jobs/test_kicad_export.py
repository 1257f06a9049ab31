"""The verb ``export`` and the project inside a design folder."""

from __future__ import annotations

import contextlib
import io
import json
import math
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from designer.base.design_folder import Folder
from designer.base.errors import InputError
from designer.board.sexpr import Expression, expression_text, read
from designer.catalog.parts_catalog import load_catalog
from designer.catalog.read import ENVIRONMENT
from designer.check.synthesis_result import Synthesis
from designer.cli import entry
from designer.folders import kicad_files
from designer.schematic.kicad_project import Project
from tests.catalog.test_catalog import own_opamp
from tests.shared.exploring import quick
from tests.shared.paper_cases import PAPER

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

MODEL = """
format = 1
title = "Linear pair"

[model]
m = 0.5
k = 0.5
k0 = 0.0
c = 0.5
zeta = 0.1
f20 = 0.0
b = 0.25

[circuit]
opamp = "TL074C"
resistors = "E24"
capacitors = "E12"
"""
"""Without stops and responses: the quickest design."""


@dataclass(frozen=True)
class Done:
    returncode: int
    stdout: str
    stderr: str


def designer(*arguments: str | Path) -> Done:
    """The command line, inside this process."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = entry.status([str(a) for a in arguments])
    return Done(code, out.getvalue(), err.getvalue())


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A design folder that ``export`` made from a model file."""
    place = tmp_path_factory.mktemp("export")
    (place / "pair.toml").write_text(MODEL, encoding="utf-8")
    done = designer("export", place / "pair.toml", "--out", place / "design", "--json")
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    folder = place / "design"
    assert answer["format"] == 1
    assert answer["files"] == sorted(
        str(p.relative_to(folder)) for p in (folder / "kicad").rglob("*") if p.is_file()
    )
    return folder


def snapshot(folder: Path) -> dict[str, bytes]:
    return {str(p): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_the_project_is_in_the_design_folder_and_its_manifest(made: Path) -> None:
    kinds = {p.suffix for p in (made / "kicad").iterdir() if p.stem == "linear-pair"}
    assert kinds == {".kicad_sch", ".kicad_pcb", ".kicad_pro", ".kicad_dru", ".net", ".lib"}
    manifest = json.loads((made / "manifest.json").read_text())
    assert manifest["complete"]
    assert {n for n, f in manifest["files"].items() if f["stage"] == "kicad"} == {
        str(p.relative_to(made)) for p in (made / "kicad").rglob("*") if p.is_file()
    }


def test_a_second_export_changes_nothing(made: Path) -> None:
    before = snapshot(made)
    done = designer("export", made, "--json")
    assert done.returncode == 0, done.stderr
    assert snapshot(made) == before


def test_the_same_model_makes_the_same_project_elsewhere(made: Path, tmp_path: Path) -> None:
    done = designer("synthesise", made.parent / "pair.toml", "--out", tmp_path / "again", "-q")
    assert done.returncode == 0, done.stderr
    one, other = ({p.name: p.read_bytes() for p in (d / "kicad").glob("*.*") if p.is_file()}
                  for d in (made, tmp_path / "again"))  # fmt: skip
    assert one == other


@pytest.mark.parametrize("begun", quick([False, True]))
def test_a_design_interrupted_at_its_project_gets_one(
    made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, begun: bool
) -> None:
    """Before the project's first file, and amid its files."""
    model, folder = made.parent / "pair.toml", tmp_path / "design"

    def interrupted(self: Folder, name: str, content: str | bytes) -> None:
        if name.startswith("kicad/"):
            if begun:
                write(self, name, content)
            raise KeyboardInterrupt
        write(self, name, content)

    write = Folder.write
    with monkeypatch.context() as patched:
        patched.setattr(Folder, "write", interrupted)
        assert designer("synthesise", model, "--out", folder, "-q").returncode == 130
    assert designer("synthesise", model, "--out", folder, "--resume", "-q").returncode == 0
    one, other = (
        {p.name: p.read_bytes() for p in (d / "kicad").glob("*.*") if p.is_file()}
        for d in (made, folder)
    )
    assert one == other


def edited(made: Path) -> tuple[Path, bytes]:
    board = made / "kicad" / "linear-pair.kicad_pcb"
    return board, board.read_bytes()


def test_an_edited_board_is_kept_until_it_is_to_be_replaced(made: Path) -> None:
    board, written = edited(made)
    board.write_bytes(written + b"\n")
    try:
        assert designer("synthesise", made, "-q").returncode == 0, "another stage's business"
        assert board.read_bytes() == written + b"\n"
        refused = designer("export", made)
        assert refused.returncode == 2
        assert "linear-pair.kicad_pcb" in refused.stderr
        assert "--overwrite" in refused.stderr
        assert board.read_bytes() == written + b"\n"
        assert designer("export", made, "--overwrite").returncode == 0
        assert board.read_bytes() == written
    finally:
        board.write_bytes(written)


@pytest.mark.slow
def test_a_folder_made_with_another_catalogue(
    made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every verb reads its parts and says which catalogue they are from; no choice is made anew."""
    folder = tmp_path / "design"
    shutil.copytree(made, folder)
    design, project = (folder / "design.json").read_bytes(), snapshot(folder / "kicad")
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "own.toml").write_text(own_opamp("5 mV"), encoding="utf-8")
    before = load_catalog().hash[:12]
    monkeypatch.setenv(ENVIRONMENT, str(mine))
    now = load_catalog().hash[:12]
    assert now != before
    for verb in (
        ["rules"],
        ["export"],
        ["simulate", "--engine", "circuit", "--omega", "1.2", "--starts", "1"],
    ):
        done = designer(verb[0], folder, *verb[1:])
        assert done.returncode in (0, 1), done.stderr
        assert f"made with catalogue {before}" in done.stderr.replace("\n", " ")
        assert now in done.stderr
        assert (folder / "design.json").read_bytes() == design
    assert snapshot(folder / "kicad") == project
    assert "--overwrite" in designer("export", folder).stderr
    done = designer("export", folder, "--overwrite")
    assert done.returncode == 0, done.stderr
    assert (folder / "design.json").read_bytes() == design
    assert json.loads((folder / "manifest.json").read_text())["stages"]["kicad"]["inputs"][
        "catalogue"
    ].startswith(now)
    refused = designer("synthesise", folder)  # it would choose the parts anew
    assert refused.returncode == 2
    assert "made with another catalogue" in refused.stderr
    assert before not in refused.stderr
    assert now not in refused.stderr


def test_a_model_file_needs_a_place_to_write(tmp_path: Path) -> None:
    done = designer("export", PAPER)
    assert done.returncode == 2
    assert "--out" in done.stderr
    done = designer("export", tmp_path)
    assert done.returncode == 2
    assert "manifest.json" in done.stderr


def test_a_file_of_the_same_name_is_not_replaced(made: Path, tmp_path: Path) -> None:
    """A folder whose project was taken out, with somebody's own file in its place."""
    folder = tmp_path / "design"
    folder.mkdir()
    manifest = json.loads((made / "manifest.json").read_text())
    manifest["stages"].pop("kicad")
    kept = {n: f for n, f in manifest["files"].items() if f["stage"] != "kicad"}
    (folder / "manifest.json").write_text(json.dumps({**manifest, "files": kept}))
    for name in kept:
        (folder / name).write_bytes((made / name).read_bytes())
    foreign = folder / "kicad" / "linear-pair.net"
    foreign.parent.mkdir()
    foreign.write_text("mine")
    done = designer("export", folder, "--overwrite")
    assert done.returncode == 2
    assert "linear-pair.net" in done.stderr
    assert foreign.read_text() == "mine"
    foreign.unlink()
    assert designer("export", folder, "-q").returncode == 0
    assert foreign.read_bytes() == (made / "kicad" / "linear-pair.net").read_bytes()


def test_a_case_without_a_footprint_stops_the_export_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """synthesise goes on and says it; export says what is accepted."""
    from designer.base.progress import Progress, report_to
    from designer.jobs import synthesise_job
    from designer.jobs.export_job import Export
    from designer.jobs.options import Options
    from designer.model.model_file import read_model_file

    def unknown(project: Project) -> dict[str, str]:
        raise InputError(None, "footprint", "Other:QFN", "a name such as …")

    class Notes(Progress):
        def __init__(self) -> None:
            self.notes: list[str] = []

        def note(self, text: str) -> None:
            self.notes.append(text)

    model = tmp_path / "pair.toml"
    model.write_text(MODEL, encoding="utf-8")
    monkeypatch.setattr(kicad_files, "files", unknown)
    notes = Notes()
    with report_to(notes):
        synthesise_job.synthesise_into(read_model_file(model), tmp_path / "design", Options())
    assert any("no KiCad project" in n and "Other:QFN" in n for n in notes.notes)
    assert not (tmp_path / "design" / "kicad").exists()
    with pytest.raises(InputError, match="Other:QFN"):
        Export(read_model_file(model), tmp_path / "design", Options()).project()


def test_the_sheet_takes_the_gate_s_settings_unless_somebody_changed_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from designer.base.design_folder import Folder

    folder = Folder(tmp_path / "design")
    texts = {"kicad/a.kicad_sch": "first", "kicad/a.net": "net"}
    monkeypatch.setattr(kicad_files, "design_provenance", lambda made: {})
    made: Synthesis = None  # type: ignore[assignment]
    kicad_files.write(folder, made, {"model": "x"}, texts)
    later: Callable[..., dict[str, str]] = lambda made, checked: {  # noqa: E731
        name: text + " at the gate" for name, text in texts.items()
    }
    monkeypatch.setattr(kicad_files, "texts", later)
    kicad_files.settle(folder, made, None)  # type: ignore[arg-type]
    sheet, net = (folder / name for name in texts)
    assert sheet.read_text() == "first at the gate"
    assert net.read_text() == "net"
    assert Folder(folder.path).changed("kicad") is None

    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    sheet_before, texts["kicad/a.kicad_sch"] = sheet.read_text(), "second"
    monkeypatch.setattr(folder, "write", killed)
    with pytest.raises(KeyboardInterrupt):
        kicad_files.settle(folder, made, None)  # type: ignore[arg-type]
    assert sheet.read_text() == sheet_before
    folder = Folder(folder.path)
    kicad_files.settle(folder, made, None)  # type: ignore[arg-type]
    assert sheet.read_text() == "second at the gate"
    sheet.write_text("by hand")
    kicad_files.settle(folder, made, None)  # type: ignore[arg-type]
    assert sheet.read_text() == "by hand"


def track_length(item: Expression) -> float:
    start, end = ((item.get(n).number(0), item.get(n).number(1)) for n in ("start", "end"))
    return math.dist(start, end)


@pytest.mark.slow
def test_a_board_is_routed_and_what_somebody_changed_stays(made: Path, tmp_path: Path) -> None:
    folder = tmp_path / "design"
    shutil.copytree(made, folder)
    board = folder / "kicad" / "linear-pair.kicad_pcb"
    assert designer("export", folder, "--keep").returncode == 2
    assert designer("export", folder, "--routed", "--deck", "ltspice").returncode == 2
    done = designer("export", folder, "--routed", "--json")
    assert done.returncode == 0, done.stderr
    routing = json.loads(done.stdout)["routing"]
    assert routing["open"] == {}
    assert routing["vias"] > 0
    routed = board.read_text("utf-8")
    assert routed.count("(segment") > 20
    # The manifest knows it: no verb takes it for a changed one, and nothing is left to route.
    assert designer("export", folder, "-q").returncode == 0
    again = designer("export", folder, "--routed", "--json")
    assert json.loads(again.stdout)["routing"]["length_mm"] == 0.0
    assert board.read_text("utf-8") == routed
    for options in (["--layers", "4"], ["--routed", "--layers", "3"]):
        assert designer("export", folder, *options).returncode == 2
    four = designer("export", folder, "--routed", "--layers", "4", "--json")
    assert json.loads(four.stdout)["routing"]["layers"] == 4
    assert designer("export", folder, "--routed", "--layers", "2").returncode == 0
    assert board.read_text("utf-8") == routed
    # The longest track is taken away by hand, the others stay.
    source = read(routed)
    longest = max(source.all("segment"), key=track_length)
    left = tuple(item for item in source.items if item is not longest)
    board.write_text(expression_text(Expression(left)), encoding="utf-8")
    refused = designer("export", folder, "--routed")
    assert refused.returncode == 2
    assert "linear-pair.kicad_pcb" in refused.stderr
    kept = designer("export", folder, "--routed", "--keep", "--json")
    assert kept.returncode == 0, kept.stderr
    assert json.loads(kept.stdout)["routing"]["length_mm"] > 0.0
    assert designer("export", folder, "--routed").returncode == 2, "it is still somebody's board"
    other = designer("export", folder, "--routed", "--keep", "--layers", "4")
    assert (other.returncode, "--layers" in other.stderr) == (2, True)


@pytest.mark.slow
def test_a_board_goes_to_another_router_and_comes_back(made: Path, tmp_path: Path) -> None:
    """The session of a router that found nothing: everything is routed here."""
    folder, dsn, session = tmp_path / "design", tmp_path / "b.dsn", tmp_path / "b.ses"
    shutil.copytree(made, folder)
    done = designer("export", folder, "--dsn", dsn, "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["dsn"] == str(dsn)
    assert dsn.read_text("utf-8").startswith('(pcb "linear-pair"')
    assert designer("export", folder, "--dsn", dsn).returncode == 2
    assert designer("export", folder, "--dsn", dsn, "--overwrite").returncode == 0
    assert designer("export", folder, "--session", session).returncode == 2
    missing = designer("export", folder, "--routed", "--session", session)
    assert missing.returncode == 2
    assert "b.ses" in missing.stderr
    routes = "(routes (resolution um 10) (network_out))"
    session.write_text(f"(session b {routes})", encoding="utf-8")
    done = designer("export", folder, "--routed", "--session", session, "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["routing"]["open"] == {}
