"""The command line: exit statuses, what goes where, and that nothing is written by half."""

from __future__ import annotations

import _hashlib
import csv
import importlib
import io
import json
import os
import platform
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import pytest

from designer.base.version import __version__
from designer.cli import entry
from designer.cli.app import VERBS
from designer.cli.command_line import application
from designer.folders.bench_tables import COLUMNS
from designer.spice.worker import open_simulator
from designer.verbs.declared import GROUPS
from tests.shared.blank_figures import blank_figures
from tests.shared.exploring import quick
from tests.shared.folder_contents import without_cost
from tests.shared.made_once import made_once
from tests.shared.model_text import COARSE_RECTIFIER, PAPER_TABLE

ROOT = Path(__file__).resolve().parents[2]
HOSTILE = "; .control shell touch planted .endc <script>alert(1)</script> =1+1 [bold] ${HOME}"
BASE = f'format = 1\ntitle = "{HOSTILE}"\n{PAPER_TABLE}'
WANTED = '[[response]]\nomega = 0.85\nexpect = "1-2-2"\n'
SMALL = BASE + WANTED
SAMPLES = 3


def _process(*arguments: str | Path, **more: Any) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "designer", *map(str, arguments)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        **{"env": {**os.environ, "PYTHONPATH": str(ROOT)}, **more},
    )


def _model(folder: Path, text: str = SMALL) -> Path:
    path = folder / "small.toml"
    path.write_text(text, encoding="utf-8")
    return path


def _tree(folder: Path) -> dict[str, bytes]:
    return {
        p.relative_to(folder).as_posix(): p.read_bytes()
        for p in sorted(folder.rglob("*"))
        if p.is_file()
    }


def _strict(text: str) -> Any:
    def refuse(name: str) -> float:
        raise AssertionError(f"{name} is no JSON")

    return json.loads(text, parse_constant=refuse)


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("cli")


@pytest.fixture(scope="module")
def finished(home: Path) -> tuple[Path, subprocess.CompletedProcess[str]]:
    """A run that nobody disturbed, and what it printed."""
    out = home / "finished"
    model = _model(home, SMALL + COARSE_RECTIFIER)
    arguments = ["run", str(model), "--out", str(out), "--samples", str(SAMPLES), "--jobs", "2"]
    stdout, stderr = io.StringIO(), io.StringIO()
    with redirect_stdout(stdout), redirect_stderr(stderr), blank_figures(), made_once():
        status = entry.status([*arguments, "--json"])
    assert status == 0, stderr.getvalue()
    said = stdout.getvalue(), stderr.getvalue()
    return out, subprocess.CompletedProcess(arguments, status, *said)


@pytest.fixture(scope="module")
def undisturbed(home: Path) -> tuple[Path, subprocess.CompletedProcess[str]]:
    """The same run as a process, with everything that a user has."""
    out = home / "undisturbed" / "finished"  # the report states the folder's name
    arguments = ["run", str(home / "small.toml"), "--out", str(out), "--samples", str(SAMPLES)]
    process = _process(*arguments, "--jobs", "2", "--json")
    stdout, stderr = process.communicate(timeout=300)
    assert process.returncode == 0, stderr
    return out, subprocess.CompletedProcess(arguments, 0, stdout, stderr)


# ---------------------------------------------------------------------------------------------
# Answers


def test_version_and_module(capfd: pytest.CaptureFixture[str]) -> None:
    assert entry.status(["--version"]) == 0
    first, *programs = capfd.readouterr().out.splitlines()
    assert first == f"designer {__version__}"
    versions = dict(line.split(maxsplit=1) for line in programs)
    assert list(versions) == ["Python", "ngspice", "KiCad", "solver", "cores"]
    assert versions["Python"] == platform.python_version()
    assert versions["cores"] == str(len(os.sched_getaffinity(0)))


def test_the_version_says_what_is_missing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert entry.status(["--version"]) == 0
    out = capfd.readouterr().out
    assert "ngspice  the program ngspice is missing" in out
    assert "KiCad    none" in out


def test_the_help_shows_every_verb_once_below_a_heading(capfd: pytest.CaptureFixture[str]) -> None:
    assert entry.status(["--help"]) == 0
    text = capfd.readouterr().out
    visible = [name for name, each in application().commands.items() if not each.hidden]
    assert all(len(re.findall(rf"^  {name}  +\S", text, re.MULTILINE)) == 1 for name in visible)
    headings = [text.index(f"\n{group}:\n") for group in GROUPS]
    assert headings == sorted(headings)


@pytest.mark.parametrize("verb", sorted(application().commands))
def test_the_help_of_a_verb_ends_with_a_command_that_is_understood(
    verb: str, capfd: pytest.CaptureFixture[str]
) -> None:
    words = verb.split()  # a verb, or a verb and one of its kinds
    assert entry.status([*words, "--help"]) == 0
    example = capfd.readouterr().out.rpartition("Example:\n")[2].split("\n\n")[0]
    shown = shlex.split(example)
    name = verb.replace("synthesize", "synthesise")
    assert shown[: len(words) + 1] == ["designer", *name.split()]
    # raises where an option is unknown
    application().commands[name].make_context(name, shown[len(words) + 1 :])


def test_a_shell_completes_the_verbs(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COMP_WORDS", "designer tol")
    monkeypatch.setenv("COMP_CWORD", "1")
    monkeypatch.setenv("_DESIGNER_COMPLETE", "complete_bash")
    with pytest.raises(SystemExit) as left:
        entry.status([])
    assert left.value.code == 0
    assert capfd.readouterr().out.split() == ["tolerance"]


def test_run_prints_one_object_and_nothing_else(
    finished: tuple[Path, subprocess.CompletedProcess[str]],
) -> None:
    out, done = finished
    answer = _strict(done.stdout)
    keys = "parts errors max_error certificate scales knobs dead_zone distinct_values cost".split()
    assert set(keys) <= set(answer)
    assert set(answer["certificate"]) == {"status", "lower_bound", "proof"}
    (response,) = answer["responses"]
    assert {response[k] for k in ("expected", "model", "circuit", "ngspice")} == {"1-2-2"}
    counted = response["yield"]
    assert set(counted) == {"ok", "lost", "grazing", "failed", "samples", "low", "high"}
    assert counted["samples"] == SAMPLES
    assert counted["ok"] + counted["lost"] + counted["grazing"] + counted["failed"] == SAMPLES
    assert response["agreement"]["asked"] == SAMPLES
    assert response["agreement"]["nominal_start"]["asked"] == SAMPLES
    assert "Traceback" not in done.stderr
    assert out.is_dir()


@pytest.mark.slow
def test_a_process_prints_the_same_and_nothing_else(
    finished: tuple[Path, subprocess.CompletedProcess[str]],
    undisturbed: tuple[Path, subprocess.CompletedProcess[str]],
) -> None:
    answers = [_strict(done.stdout) for _, done in (finished, undisturbed)]
    same = ("parts", "errors", "responses")
    assert {key: answers[0][key] for key in same} == {key: answers[1][key] for key in same}
    assert answers[0].keys() == answers[1].keys()
    assert "Traceback" not in undisturbed[1].stderr


def test_folder_holds_what_the_contract_says(
    finished: tuple[Path, subprocess.CompletedProcess[str]],
) -> None:
    out, _ = finished
    manifest = _strict((out / "manifest.json").read_text())
    assert manifest["format"] == 1
    assert manifest["complete"] is True
    assert set(manifest["files"]) == set(_tree(out)) - {"manifest.json"}
    names = "model.toml design.json circuit.cir bom.csv setup.csv scales.csv tolerance.json"
    board = "bom-kicad.csv bom-jlcpcb.csv board.md schematic.svg schematic.png"
    wanted = {*names.split(), *board.split(), "report.html", "report.md"}
    assert wanted <= set(manifest["files"])
    assert (out / "model.toml").read_text() == SMALL + COARSE_RECTIFIER
    (placed,) = (out / "kicad").glob("*.kicad_pcb")
    assert "\t(segment" in placed.read_text("utf-8"), "a run routes its board"
    for name in ("design.json", "tolerance.json"):
        value = _strict((out / name).read_text())
        assert value["format"] == 1
        assert value["provenance"]["versions"]["designer"] == __version__
    with (out / "setup.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert tuple(rows[0]) == COLUMNS
    assert rows[0]["load"] == "high-Z"
    assert float(rows[0]["amplitude_vpp"]) == 2 * float(rows[0]["amplitude_v_peak"])


def test_bill_counts_every_part(finished: tuple[Path, subprocess.CompletedProcess[str]]) -> None:
    out, done = finished
    with (out / "bom.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    listed = [name for row in rows for name in row["designators"].split()]
    assert len(listed) == len(set(listed)) == sum(int(row["quantity"]) for row in rows)
    circuit = set(_strict(done.stdout)["parts"]) | {"U1", "U2", "U3"}
    assert circuit <= set(listed)
    # What the board has beside it: connectors, capacitors of the supply, probes, protection; and
    # the diodes and references of a rectifier, which have no value.
    others = r"J[123]|[RCD]9\d\d|D2\d\d|VR\d"
    assert {name for name in listed if not re.fullmatch(others, name)} == circuit
    assert all(row["part_number"] for row in rows)


def test_hostile_title_reaches_nothing(
    finished: tuple[Path, subprocess.CompletedProcess[str]],
) -> None:
    out, _ = finished
    deck = (out / "circuit.cir").read_text()
    title = deck.splitlines()[0]
    assert title.startswith("* ")
    assert not set(title) & set(';<>${}[]`"')
    assert ".control" not in deck.split("\n", 1)[1]
    assert "<script>alert" not in (out / "report.html").read_text()
    assert "<script>alert" not in (out / "report.md").read_text()
    assert "<script" not in (out / "schematic.svg").read_text()
    assert "<script" not in (out / "board.md").read_text()


def test_report_names_the_command_line_and_no_path(
    finished: tuple[Path, subprocess.CompletedProcess[str]], home: Path
) -> None:
    out, _ = finished
    said = f"designer run small.toml --out finished --samples {SAMPLES} --seed 1"
    assert f"    {said}\n" in (out / "report.md").read_text()
    for name in ("report.html", "report.md"):
        text = (out / name).read_text()
        assert said in text
        assert str(home) not in text


def test_deck_runs_in_plain_ngspice(
    finished: tuple[Path, subprocess.CompletedProcess[str]], tmp_path: Path
) -> None:
    out, _ = finished
    deck = (out / "circuit.cir").read_text()
    assert not any(line.startswith("+") for line in deck.splitlines())
    assert "IC=" in deck
    assert ".ic" not in deck.lower().split()
    done = subprocess.run(
        ["ngspice", "-b", out / "circuit.cir"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "v(v1)" in done.stdout
    assert list(tmp_path.iterdir()) == []
    # The same without the line that prints, which is for the plain program alone.
    kept = [line for line in deck.splitlines() if not line.startswith(".print")]
    (tran,) = (line.split() for line in kept if line.startswith(".tran"))
    waves = open_simulator("batch").run("\n".join(kept) + "\n", ["v1", "v2"], float(tran[2]))
    threshold = json.loads((out / "design.json").read_text())["scales"]["threshold"]
    assert waves.signals["v1"].max() > threshold


def test_same_inputs_are_not_computed_again(
    finished: tuple[Path, subprocess.CompletedProcess[str]],
    home: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    out, done = finished
    before = _tree(out)  # with times in it, which no second computation would repeat
    model = str(home / "small.toml")
    for verb in (["run", model, "--out", str(out)], ["run", str(out)]):
        assert entry.status([*verb, "--samples", str(SAMPLES), "--json", "--resume"]) == 0
        assert _strict(capfd.readouterr().out) == _strict(done.stdout)
    assert entry.status(["tolerance", str(out), "--samples", str(SAMPLES), "--json"]) == 0
    answer = _strict(capfd.readouterr().out)
    assert answer["responses"] == _strict(done.stdout)["responses"]
    assert entry.status(["synthesise", model, "--out", str(out), "--json", "-q"]) == 0
    assert _strict(capfd.readouterr().out)["parts"] == _strict(done.stdout)["parts"]
    assert _tree(out) == before


@pytest.mark.slow
def test_overwrite_replaces_listed_files_only(
    finished: tuple[Path, subprocess.CompletedProcess[str]],
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    whole, _ = finished
    out = tmp_path / "moved"
    shutil.copytree(whole, out)
    for name in ("notes.txt", "samples.parquet/mine.parquet"):
        (out / name).write_text("mine")
    before = _tree(out)
    fewer = ["tolerance", str(out), "--samples", "2", "--rung", "exact", "--no-blame", "-q"]
    _refused(fewer, capfd, "manifest.json", f"samples {SAMPLES}", "--overwrite")
    _refused([*fewer, "--resume"], capfd, "manifest.json", "--overwrite")
    assert _tree(out) == before
    assert entry.status([*fewer, "--overwrite", "--json"]) == 0
    assert _strict(capfd.readouterr().out)["responses"][0]["yield"]["samples"] == 2
    after = _tree(out)
    assert {n for n in after if n.startswith("samples")} == {
        "samples.parquet/block-000000.parquet",
        "samples.parquet/mine.parquet",
    }
    assert after["notes.txt"] == after["samples.parquet/mine.parquet"] == b"mine"
    assert after["design.json"] == before["design.json"]
    assert set(_strict(after["manifest.json"].decode())["files"]) == set(after) - {
        "manifest.json",
        "notes.txt",
        "samples.parquet/mine.parquet",
    }


def test_a_model_that_was_changed_in_its_folder(
    finished: tuple[Path, subprocess.CompletedProcess[str]],
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "changed"
    shutil.copytree(finished[0], out)
    model = out / "model.toml"
    model.write_text(model.read_text().replace("0.85", "0.86"))
    before = _tree(out)
    _refused(["tolerance", str(out), "-q"], capfd, "model.toml")
    _refused(["simulate", str(out), "-q"], capfd, "model.toml")
    _refused(["run", str(model), "--out", str(out), "-q"], capfd, "manifest.json", "--overwrite")
    assert _tree(out) == before


@pytest.mark.slow
def test_fidelities_of_op_amps_in_ngspice(
    finished: tuple[Path, subprocess.CompletedProcess[str]], capfd: pytest.CaptureFixture[str]
) -> None:
    out, _ = finished
    words = ["simulate", str(out), "--engine", "ngspice", "--rung", "dynamic", "--starts", "1"]
    assert entry.status([*words, "--json"]) == 0
    answer = _strict(capfd.readouterr().out)
    (response,) = answer["responses"]
    assert response["response"] == "1-2-2"
    assert answer["provenance"]["settings"]["rung"] == "dynamic"
    # Op-amps with a memory have an orbit of their own, and a way to it.
    assert response["engine"]["discarded_periods"] > 2
    assert response["x1_max"] == pytest.approx(0.40105, rel=2e-2)
    _refused(["simulate", str(out), "--rung", "full", "-q"], capfd, "--rung", "--engine ngspice")


@pytest.mark.parametrize("engine", ["model", "circuit", "ngspice"])
def test_simulate_a_folder(
    finished: tuple[Path, subprocess.CompletedProcess[str]],
    capfd: pytest.CaptureFixture[str],
    engine: str,
) -> None:
    out, _ = finished
    words = ["simulate", str(out), "--engine", engine, "--starts", "1", "--json"]
    assert entry.status(words) == 0
    (response,) = _strict(capfd.readouterr().out)["responses"]
    keys = (
        "omega response status symmetric x1_max x1_min impact_velocities multipliers lyapunov "
        "others cost"
    )
    assert set(keys.split()) <= set(response)
    assert response["response"] == "1-2-2"
    assert response["x1_max"] == pytest.approx(0.40105, rel=2e-3)
    assert max(response["impact_velocities"]) == pytest.approx(0.6, abs=0.3)


def test_simulate_from_rest(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    model = _model(tmp_path)
    assert (
        entry.status(["simulate", str(model), "--omega", "1.55", "--omega", "0.85", "--json"]) == 0
    )
    responses = _strict(capfd.readouterr().out)["responses"]
    assert [r["omega"] for r in responses] == [1.55, 0.85]
    met = {responses[0]["response"], *(o["response"] for o in responses[0]["others"])}
    assert met == {"1-1-1", "3-3-3"}


def test_a_response_that_is_not_there_is_exit_1(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    model = _model(tmp_path, BASE + WANTED.replace("1-2-2", "1-7-7") + COARSE_RECTIFIER)
    assert entry.status(["simulate", str(model), "--starts", "1", "--json"]) == 1
    assert _strict(capfd.readouterr().out)["responses"][0]["found"] is False
    out = tmp_path / "out"
    for _ in range(2):  # made, then read again
        assert entry.status(["synthesise", str(model), "--out", str(out), "-q"]) == 1


@pytest.mark.slow
def test_synthesis_without_responses_or_stops(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    model = _model(tmp_path, BASE.replace("k0 = 0.95", "k0 = 0.0") + COARSE_RECTIFIER)
    out = tmp_path / "out"
    assert entry.status(["synthesize", str(model), "--out", str(out), "--json"]) == 0
    answer = _strict(capfd.readouterr().out)
    assert answer["dead_zone"] is None
    assert answer["knobs"] == []
    assert answer["scales"]["threshold"] is None
    words = ["simulate", str(out), "--omega", "1", "--engine", "circuit", "--starts", "1"]
    assert entry.status([*words, "--json"]) == 0
    assert _strict(capfd.readouterr().out)["responses"][0]["response"] == "1-0-0"
    done = subprocess.run(["ngspice", "-b", out / "circuit.cir"], capture_output=True, check=False)
    assert done.returncode == 0


def test_catalog_check(capfd: pytest.CaptureFixture[str]) -> None:
    """An op-amp's model against its figures; an unknown name is bad input."""
    assert entry.status(["catalog", "--check", "TL074C", "--json"]) == 0
    said = json.loads(capfd.readouterr().out)
    assert said["opamp"] == "TL074C"
    figures = {row["figure"]: row for row in said["checks"]}
    assert figures["swing into 2 kΩ, high"]["measured"] == pytest.approx(12.0, rel=0.01)
    assert figures["recovery"]["assumed"]
    assert all(row["agrees"] for row in said["checks"])
    assert entry.status(["catalog", "--check", "TL074C"]) == 0
    out, err = capfd.readouterr()
    assert out == ""
    assert "slew, rising" in err
    assert entry.status(["catalog", "--check", "TL074X"]) == 2
    assert "TL074C" in capfd.readouterr().err


def test_catalog(capfd: pytest.CaptureFixture[str]) -> None:
    assert entry.status(["catalog", "--json"]) == 0
    said = capfd.readouterr()
    answer = _strict(said.out)
    assert "TL074C" in answer["opamps"]
    kinds = {
        "opamps", "families", "diodes", "references", "supply_diodes", "trimmers", "headers",
        "coaxial_jacks",
    }  # fmt: skip
    assert set(answer) == {"format", "hash"} | kinds
    assert "Bourns 3296W 10 kΩ" in answer["trimmers"]
    assert all(answer[kind] for kind in kinds)
    assert said.err == ""
    assert entry.status(["catalog"]) == 0
    said = capfd.readouterr()
    assert said.out == ""
    listed = [*answer["supply_diodes"], *answer["trimmers"], *answer["headers"]]
    for name in ("TL074C", *listed, *answer["coaxial_jacks"]):
        assert name in said.err


def test_new_writes_a_valid_file_once(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "mine.toml"
    assert entry.status(["new", str(path)]) == 0
    from designer import read_model_file

    assert len(read_model_file(path).responses) == 2
    path.write_text("mine")
    assert entry.status(["new", str(path)]) == 2
    assert path.read_text() == "mine"
    assert entry.status(["new", str(tmp_path / "no" / "such.toml")]) == 2


def test_log_file(tmp_path: Path) -> None:
    log = tmp_path / "log"
    assert entry.status(["catalog", "-q", "--json", "--log", str(log)]) == 0
    assert __version__ in log.read_text()
    assert entry.status(["catalog", "--log", str(tmp_path / "no" / "log")]) == 2


def test_import_is_light() -> None:
    code = (
        "import sys, designer, designer.cli.entry;"
        "print('numpy' in sys.modules, designer.__version__)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["False", __version__]


def test_a_wrong_model_file_is_told_before_the_engine_is_imported(tmp_path: Path) -> None:
    (tmp_path / "wrong.toml").write_text("format = 2\nfoo = 1\n")
    code = (
        "import sys; from designer.cli import entry\n"
        "for verb in (['run', '--out', 'out'], ['simulate'], ['bifurcation']):\n"
        "    print(entry.status([verb[0], 'wrong.toml', *verb[1:]]))\n"
        "print(sorted({'numba', 'scipy', 'pandas', 'cvxpy'} & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split("\n") == ["2", "2", "2", "[]", ""], done.stderr
    assert done.stderr.count("unknown key 'foo'") == 3


def test_every_verb_is_registered() -> None:
    assert sorted(n for n in application().commands if " " not in n) == sorted(VERBS)


def test_public_names_exist() -> None:
    designer = importlib.import_module("designer")
    assert all(getattr(designer, name) is not None for name in designer.__all__)
    assert set(designer.__all__) <= set(dir(designer))
    with pytest.raises(AttributeError):
        designer.nothing  # noqa: B018


# ---------------------------------------------------------------------------------------------
# Refusals


def _refused(
    arguments: Sequence[str], capfd: pytest.CaptureFixture[str], *words: str, status: int = 2
) -> None:
    assert entry.status([str(a) for a in arguments]) == status
    said = capfd.readouterr()
    assert said.out == ""
    assert "Traceback" not in said.err
    assert said.err.count("\n") <= 2
    for word in words:
        assert word in said.err


BAD = {
    "unknown key": (SMALL.replace("zeta", "zetta"), "model.zetta"),
    "missing key": (SMALL.replace("b = 0.25\n", ""), "model.b"),
    "text for a number": (SMALL.replace("m = 0.5", 'm = "much"'), "model.m"),
    "outside its domain": (SMALL.replace("k0 = 0.95", "k0 = 1.0"), "model.k0"),
    "no stiffness": (SMALL.replace("k = 0.5", "k = 0.0"), "model.k"),
    "unknown op-amp": (SMALL + '[circuit]\nopamp = "TL047C"\n', "circuit.opamp"),
    "unknown series": (SMALL + '[circuit]\nresistors = "E95"\n', "circuit.resistors"),
    "unreachable range": (
        SMALL + "[circuit]\nresistor_range = [1000, 1050]\n",
        "circuit",
    ),
    "unreachable grade": (SMALL + "[circuit]\nresistor_grade = 1e-5\n", "circuit.resistor_grade"),
    "other format": (SMALL.replace("format = 1", "format = 3"), "format"),
    "not TOML": ("format = = 1", "line 1"),
    "two lines of title": (SMALL.replace(HOSTILE, "a\\nb"), "title"),
    "not of this version": (SMALL.replace("0.85", '"best"'), "response[1].omega"),
}


@pytest.mark.parametrize("name", BAD)
@pytest.mark.parametrize("verb", ["run", "synthesise"])
def test_bad_model_files_write_nothing(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], name: str, verb: str
) -> None:
    text, field = BAD[name]
    model = _model(tmp_path, text)
    out = tmp_path / "out"
    _refused([verb, str(model), "--out", str(out), "-q"], capfd, str(model), field, "expected")
    assert not out.exists()


def test_files_that_are_none(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    out = str(tmp_path / "out")
    _refused(["run", str(tmp_path / "no.toml"), "--out", out], capfd, "no.toml", "expected")
    _refused(["run", str(tmp_path), "--out", out], capfd, "manifest.json", "expected")
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    _refused(["synthesise", str(binary), "--out", out], capfd, "UTF-8")
    assert not Path(out).exists()


def test_no_response_for_a_study(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    model, out = str(_model(tmp_path, BASE)), tmp_path / "out"
    _refused(["run", model, "--out", str(out), "-q"], capfd, "[[response]]")
    _refused(["tolerance", model, "--out", str(out), "-q"], capfd, "[[response]]")
    _refused(["simulate", model, "-q"], capfd, "[[response]]", "--omega")
    assert not out.exists()


@pytest.mark.parametrize(
    "options",
    [
        ["--samples", "0"],
        ["--samples", "-3"],
        ["--samples", "many"],
        ["--samples", "1000000000000"],
        ["--samples", "1.5"],
        ["--jobs", "0"],
        ["--seed", "-1"],
        ["--unknown"],
        ["more"],
    ],
)
def test_bad_options(tmp_path: Path, capfd: pytest.CaptureFixture[str], options: list[str]) -> None:
    out = tmp_path / "out"
    _refused(["run", str(_model(tmp_path)), "--out", str(out), "-q", *options], capfd, options[0])
    assert not out.exists()


def test_bad_options_of_simulate(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    model = str(_model(tmp_path))
    for omega in ("0", "-1", "nan", "inf", "fast"):
        _refused(["simulate", model, f"--omega={omega}", "-q"], capfd, "--omega")
    _refused(["simulate", model, "--engine", "spectre"], capfd, "--engine")


@pytest.mark.parametrize("verb", ["serach", "nonsense"])
def test_unknown_verbs(capfd: pytest.CaptureFixture[str], verb: str) -> None:
    _refused([verb], capfd, verb, "run, synthesise")


def test_folders_that_cannot_be_written(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    model = str(_model(tmp_path))
    _refused(["run", model], capfd, "--out")
    file = tmp_path / "file"
    file.write_text("mine")
    for out in (file, file / "below", file / "far" / "below"):
        _refused(["run", model, "--out", str(out), "-q"], capfd, str(out), "--out")
    assert file.read_text() == "mine"
    foreign = tmp_path / "foreign"
    foreign.mkdir()
    (foreign / "bom.csv").write_text("mine")
    for more in ([], ["--overwrite"], ["--resume"]):
        _refused(["run", model, "--out", str(foreign), "-q", *more], capfd, "foreign", "--out")
    assert _tree(foreign) == {"bom.csv": b"mine"}


def test_missing_ngspice_is_exit_3(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    monkeypatch.setenv("PATH", str(tmp_path))
    assert entry.status(["run", str(_model(tmp_path)), "--out", str(out), "--json"]) == 3
    said = capfd.readouterr()
    assert said.out == ""
    assert "apt-get install" in said.err
    assert "Traceback" not in said.err
    assert not out.exists()


@pytest.mark.parametrize(
    "what", quick(["too old", "no library", "another library", "a library that crashes"])
)
def test_an_ngspice_that_will_not_do_is_exit_3(tmp_path: Path, what: str) -> None:
    """Clear, before any long work, and nothing is written."""
    out, environment = tmp_path / "out", {**os.environ, "PYTHONPATH": str(ROOT)}
    if what == "too old":
        old = tmp_path / "ngspice"
        old.write_text("#!/bin/sh\necho '** ngspice-34 : Circuit level simulation program'\n")
        old.chmod(0o755)
        environment["PATH"] = f"{tmp_path}:{environment['PATH']}"
        said: tuple[str, ...] = ("ngspice 34 found", "apt-get install")
    elif what == "no library":
        environment["NGSPICE_LIBRARY_PATH"] = os.devnull
        said = ("libngspice does not load", "apt-get install")
    elif what == "another library":
        environment["NGSPICE_LIBRARY_PATH"] = _hashlib.__file__
        said = ("libngspice does not load", _hashlib.__file__, "ngSpice_Init", "apt-get install")
    else:
        # A module of this name comes before PySpice's: loading the library ends the process.
        (tmp_path / "PySpice").mkdir()
        (tmp_path / "PySpice" / "__init__.py").write_text("import os\nos.kill(os.getpid(), 11)\n")
        environment["PYTHONPATH"] = f"{tmp_path}:{ROOT}"
        said = ("simulation workers do not start", "died (exit -11)", "libngspice is ")
    process = _process("run", _model(tmp_path), "--out", out, "--json", env=environment)
    stdout, stderr = process.communicate(timeout=120)
    assert process.returncode == 3
    assert stdout == ""
    assert all(words in stderr for words in said), stderr
    assert "Traceback" not in stderr
    assert not out.exists()


# ---------------------------------------------------------------------------------------------
# Interrupted


def _wait_for(path: Path, process: subprocess.Popen[str]) -> None:
    deadline = time.monotonic() + 120
    while not path.exists():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.mark.parametrize("library", ["typer", "numpy", "numba"])
def test_a_library_that_is_missing_is_exit_3(library: str, tmp_path: Path) -> None:
    """As after an installation that broke off."""
    code = (
        f"import sys; sys.modules[{library!r}] = None\n"
        "from designer.cli.entry import main\nmain(sys.argv[1:])\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, "simulate", str(_model(tmp_path)), "--starts", "0"],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 3, done.stderr
    assert f"the library {library} is missing or broken" in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""


def test_a_defect_of_the_tool_s_own_is_no_missing_library(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def broken(_: list[str]) -> int:
        raise ImportError("cannot import name 'x' from 'designer.model'", name="designer.model")

    monkeypatch.setattr("designer.cli.command_line.dispatch", broken)
    assert entry.status(["new"]) == 1
    assert "internal error: ImportError" in capfd.readouterr().err


@pytest.mark.slow
def test_killed_study_goes_on_and_ends_the_same(
    undisturbed: tuple[Path, subprocess.CompletedProcess[str]],
    home: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    whole, done = undisturbed
    out = home / "killed" / whole.name
    arguments = ["run", str(home / "small.toml"), "--out", str(out), "--samples", str(SAMPLES)]
    process = _process(*arguments, "--jobs", "1")
    _wait_for(out / "samples.parquet" / "block-000000.parquet", process)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    assert _strict((out / "manifest.json").read_text())["complete"] is False
    _refused([*arguments, "-q"], capfd, "--resume", "--overwrite")
    first = (out / "samples.parquet" / "block-000000.parquet").stat().st_mtime_ns
    assert entry.status([*arguments, "-q", "--resume", "--json", "--jobs", "1"]) == 0
    answer = _strict(capfd.readouterr().out)
    assert (out / "samples.parquet" / "block-000000.parquet").stat().st_mtime_ns == first
    assert answer["responses"] == _strict(done.stdout)["responses"]
    assert without_cost(out) == without_cost(whole)


@pytest.mark.slow
def test_ctrl_c_is_exit_130(
    finished: tuple[Path, subprocess.CompletedProcess[str]], tmp_path: Path
) -> None:
    """In a longer study of a design that stands: what comes before it has its parts' time."""
    out = Path(shutil.copytree(finished[0], tmp_path / "interrupted"))
    first = out / "samples.parquet" / "block-000000.parquet"
    first.unlink()
    process = _process("run", out, "--samples", "500", "--jobs", "1", "--overwrite")
    _wait_for(first, process)
    process.send_signal(signal.SIGINT)
    _, stderr = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in stderr
    assert "--resume" in stderr
    assert _strict((out / "manifest.json").read_text())["complete"] is False
    assert not list(out.rglob("*.part"))


def test_a_response_that_the_model_does_not_show_is_an_answer_without_a_folder(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The answer is no, before a part is chosen: the object has what there is instead."""
    model = tmp_path / "wrong.toml"
    text = BASE + WANTED.replace("1-2-2", "1-5-5") + COARSE_RECTIFIER
    model.write_text(text, encoding="utf-8")
    out, few = str(tmp_path / "out"), ("--samples", "3", "--json")
    arguments = ["tolerance", str(model), "--out", out, *few]
    assert entry.status(arguments) == 1
    (response,) = _strict(capfd.readouterr().out)["responses"]
    assert response["expected"] == "1-5-5"
    assert response["yield"] is None
    assert (response["found"], response["model"]) == (False, "1-2-2")
    assert not (tmp_path / "out").exists()
