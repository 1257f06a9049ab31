"""The verb ``bifurcation``: what is printed, what is written, and that a kill loses nothing."""

from __future__ import annotations

import json
import re
import signal
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from designer.base.design_folder import Folder
from designer.catalog.parts_catalog import load_catalog
from designer.circuit.swept_board import BoardSubject
from designer.cli import entry
from designer.dynamics import attractors
from designer.folders.design_files import load
from designer.model.model_file import read_model_file
from designer.verbs import bifurcation as bifurcation_verb
from designer.verbs.bifurcation import bifurcation
from tests.cli.test_entry import BASE, WANTED, _process, _strict, _tree
from tests.shared.model_text import COARSE_RECTIFIER
from tests.shared.quick_folders import quick_folder
from tests.shared.system_text import clearance, system_text, table

pytestmark = pytest.mark.usefixtures("designs_are_made_once")

SWEEP = ("--from", "1.40", "--to", "1.52", "--steps", "25")


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bifurcation") / "small.toml"
    path.write_text(BASE + WANTED + COARSE_RECTIFIER, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def design(model: Path) -> Path:
    return quick_folder(model.read_text(encoding="utf-8"), model.parent / "design")


def _asked(capfd: pytest.CaptureFixture[str], *words: object) -> Any:
    assert entry.status(["bifurcation", *map(str, words), "--json"]) == 0
    return _strict(capfd.readouterr().out)


def test_prints_windows_and_points(model: Path, capfd: pytest.CaptureFixture[str]) -> None:
    answer = _asked(capfd, model, *SWEEP)
    assert list(model.parent.glob("*.parquet")) == []
    first, last = answer["windows"][0], answer["windows"][-1]
    assert {"from", "to", "response", "symmetric"} <= set(first)
    assert (first["from"], first["response"], first["symmetric"]) == (1.4, "1-1-1", False)
    assert (last["to"], last["response"], last["symmetric"]) == (1.52, "1-1-1", True)
    (point,) = answer["points"]
    assert {"parameter", "kind", "value"} <= set(point)
    assert (point["parameter"], point["kind"]) == ("omega", "pitchfork")
    assert first["to"] < point["value"] < last["from"]


def test_writes_pictures_and_data_with_their_origin(
    model: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    words = (model, *SWEEP, "--down", "--up", "--no-points", "--out", out)
    answer = _asked(capfd, *words)
    written = _tree(out)
    assert _strict(written["sweep.json"].decode())["windows"] == answer["windows"]
    assert written["sweep.png"].startswith(b"\x89PNG")
    assert b"<svg" in written["sweep.svg"]
    manifest = _strict(written["manifest.json"].decode())
    assert manifest["complete"] is True
    assert set(manifest["files"]) == set(written) - {"manifest.json"}
    for track in ("down", "up"):
        path = out / "sweep.parquet" / f"{track}-000000.parquet"
        table = pq.read_table(path, partitioning=None).to_pylist()
        values = np.linspace(1.40, 1.52, 25)
        np.testing.assert_array_equal(
            [row["omega"] for row in table], values if track == "up" else values[::-1]
        )
        assert all(len(row["minima"]) == 30 for row in table)
        said = json.loads(pq.read_schema(path).metadata[b"designer"])
        assert said["provenance"]["model_sha256"] == answer["provenance"]["model_sha256"]
        assert said["provenance"]["versions"]["designer"]
    assert _asked(capfd, *words)["windows"] == answer["windows"]  # what is there
    assert _tree(out) == written
    assert entry.status(["bifurcation", *map(str, words), "--periods", "100"]) == 2
    assert "--overwrite" in capfd.readouterr().err
    assert _tree(out) == written


@pytest.mark.slow
def test_a_smaller_map_takes_the_place_of_a_larger_one(
    model: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The rows of the larger one are of another map. They go, and none is called damaged."""
    ends, quick = ("--from", "1.4", "--to", "1.5"), ("--periods", "20", "--keep", "4")
    words = (model, *ends, *quick, "--out", tmp_path / "out")
    _asked(capfd, *words, "--steps", "4", "--map", "b", "0.2", "0.3", "3")
    again = ("--steps", "3", "--map", "b", "0.2", "0.3", "2", "--overwrite")
    assert entry.status(["bifurcation", *map(str, (*words, *again)), "--json"]) == 0
    said = capfd.readouterr()
    assert "damaged" not in said.err
    assert sum(_strict(said.out)["counts"].values()) == 6
    assert len(list((tmp_path / "out" / "map.parquet").iterdir())) == 2


def test_files_of_others_are_left_alone(
    model: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert entry.status(["bifurcation", str(model), *SWEEP, "--no-points", "--out", str(out)]) == 0
    (out / "map.png").write_text("mine")
    before = _tree(out)
    words = ["--map", "b", "0.2", "0.3", "3", "--out", str(out), "--overwrite"]
    assert entry.status(["bifurcation", str(model), *SWEEP, *words]) == 2
    assert "map.png" in capfd.readouterr().err
    assert _tree(out) == before
    other = tmp_path / "other"
    other.mkdir()
    (other / "letter.txt").write_text("mine")
    assert entry.status(["bifurcation", str(model), *SWEEP, "--out", str(other)]) == 2
    assert list(_tree(other)) == ["letter.txt"]


BAD: list[tuple[str, str, str]] = [
    ("--from 1 --to 1 --steps 5", "--to", "another value"),
    ("--from 0 --to 1 --steps 5", "--from", "0.001"),
    ("--from -1 --to 1 --steps 5", "--from", "0.001"),
    ("--from 1 --to 2 --steps 1", "--steps", ">= 2"),
    ("--from 1 --to 2", "--steps", "is missing"),
    ("--from 1 --to 2 --steps 1000000", "--steps", "at most"),
    ("--to 2 --steps 3", "--from", "is missing"),
    ("--over k0 --from 0.5 --to 1 --steps 5", "--to", "[0, 1)"),
    ("--over beta --from 0.5 --to 1 --steps 5", "--over", "one of omega"),
    ("--over b --from 0.1 --to 1 --steps 5 --omega 0", "--omega", "0.001"),
    ("--from 1 --to 2 --steps 3 --omega 1", "--omega", "swept"),
    ("--from 1 --to 2 --steps 3 --starts 0", "--starts", ">= 1"),
    ("--from 1 --to 2 --steps 3 --starts 2 --up", "--starts", "without"),
    ("--from 1 --to 2 --steps 3 --periods -1", "--periods", ">= 0"),
    ("--from 1 --to 2 --steps 3 --keep 0", "--keep", ">= 1"),
    ("--from 1 --to 2 --steps 3 --jobs 0", "--jobs", ">= 1"),
    ("--from 1 --to 2 --steps 3 --map omega 1 2 3", "--map", "another"),
    ("--from 1 --to 2 --steps 3 --map b 1 1 3", "--map", "another value"),
    ("--from 1 --to 2 --steps 3 --map b -1 1 3", "--map", "> 0"),
    ("--from 1 --to 2 --steps 3 --map b 1 2 3 --down", "--down", "none with --map"),
    ("--from 1 --to 2 --steps 9000 --map b 1 2 9000", "--map", "points in all"),
    ("--basins --steps 9000 --map x1' -1 1 9000", "--map", "points in all"),
    ("--basins --over b", "--over", "x1"),
    ("--basins --map x1 -1 1 3", "--map", "another state"),
    ("--circuit --from 1 --to 2 --steps 3", "--circuit", "design folder"),
]


@pytest.mark.parametrize(("options", "field", "part"), BAD)
def test_bad_input(
    model: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    options: str,
    field: str,
    part: str,
) -> None:
    out = tmp_path / "out"
    assert entry.status(["bifurcation", str(model), *options.split(), "--out", str(out)]) == 2
    said = capfd.readouterr()
    assert said.out == ""
    assert field in said.err
    assert part in said.err
    assert "Traceback" not in said.err
    assert not out.exists()


BENT = system_text(
    {"a": "2 kg"},
    {("a", "ground"): "8 kN/m"},
    {("a", "ground"): "20 N s/m"},
    table("law", name="F", between=["a", "ground"], points=[[-1e-3, 0], [1e-3, 0], [3e-3, 40]]),
    table("friction", between=["a", "ground"], force="1 N", velocity="5 mm/s"),
    table("force", on="a", amplitude="10 N"),
)


def test_a_point_of_a_law_takes_its_unit(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "bent.toml"
    path.write_text(BENT, encoding="utf-8")
    ends = ("--from", "0.5 mm", "--to", "2 mm", "--steps", "4", "--no-points")
    answer = _asked(capfd, path, "--over", "F.x2", "--frequency", "8 Hz", *ends)
    assert (answer["from"], answer["to"], answer["unit"]) == (5e-4, 2e-3, "m")


def test_a_map_of_two_points_beyond_those_of_the_file(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Every cell may be, though F.x2 goes on beyond the F.x3 of the file."""
    path = tmp_path / "bent.toml"
    path.write_text(BENT, encoding="utf-8")
    words = "--over F.x2 --from 0.004 --to 0.005 --steps 2 --map F.x3 0.006 0.007 2".split()
    answer = _asked(capfd, path, *words, "--frequency", "8 Hz", "--periods", "40")
    assert sum(answer["counts"].values()) == 4


@pytest.mark.parametrize(
    ("options", "field", "part"),
    [
        ("--over F.x2 --from 0 --to 0.004", "--to", "F.x2: points by rising x, not x2 = 0.004"),
        ("--over F.x4 --from 0 --to 1", "--over", "F.x3"),
        ("--over F.f3 --from -60 --to 1", "--from", "F.f3: a slope there"),
        (
            "--over F.x2 --from 0 --to 0.002 --map F.x3 0.0015 0.004 5",
            "--map",
            "by rising x, not x2 = 0.002 and x3 = 0.0015",
        ),
        ("--over F.x2 --from 0 --to 0.002 --and F.x3 0.0015 0.004", "--and", "by rising x"),
        ("--over a.mass --from -1 --to 2 --map F.x3 2 4 5", "--from", "-1.0, expected a.mass: a n"),
        ("--over F.x2 --from 0 --to 0.002 --and F.f3 50 60", "--and", "about 40"),
    ],
)
def test_what_points_cannot_be_is_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], options: str, field: str, part: str
) -> None:
    path = tmp_path / "bent.toml"
    path.write_text(BENT, encoding="utf-8")
    words = (*options.split(), "--steps", "5", "--frequency", "8 Hz")
    assert entry.status(["bifurcation", str(path), *words]) == 2
    said = capfd.readouterr().err
    assert field in said
    assert part in said
    assert "Traceback" not in said


def test_needs_a_frequency(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "model.toml"
    path.write_text(BASE, encoding="utf-8")
    words = [
        "bifurcation",
        str(path),
        "--over",
        "b",
        "--from",
        "0.2",
        "--to",
        "0.3",
        "--steps",
        "3",
    ]
    assert entry.status(words) == 2
    assert "--omega" in capfd.readouterr().err
    answer = _asked(capfd, *words[1:], "--omega", "1.55", "--no-points")
    assert answer["parameter"] == "b"
    assert {w["response"] for w in answer["windows"]} == {"1-1-1"}


@pytest.mark.slow
def test_goes_on_after_a_kill(model: Path, tmp_path: Path) -> None:
    """And again after a Ctrl-C. What was finished is kept to the byte, and the whole is that of
    one process: in chaos each step shows every digit of the state handed over to it."""
    out, whole = tmp_path / "out", tmp_path / "whole"
    words: list[str | Path] = [
        "bifurcation",
        model,
        "--from",
        "0.9",
        "--to",
        "1.2",
        "--steps",
        "450",
    ]
    words += ["--periods", "400", "--no-points", "--down", "--up"]
    assert _finished(*words, "--out", whole)[0] == 0
    blocks = len(list((whole / "sweep.parquet").iterdir()))
    for number, (count, how) in enumerate(((2, signal.SIGKILL), (9, signal.SIGINT))):
        process = _process(*words, "--out", out, *(["--resume"] if number else []))
        while process.poll() is None:
            if len(list((out / "sweep.parquet").glob("*-0*.parquet"))) >= count:
                process.send_signal(how)
                break
            time.sleep(0.005)
        process.communicate(timeout=60)
        assert process.returncode == (130 if how is signal.SIGINT else -9)
        assert json.loads((out / "manifest.json").read_text())["complete"] is False
        assert count <= len(list((out / "sweep.parquet").glob("*-0*.parquet"))) < blocks
    kept = {p: p.read_bytes() for p in (out / "sweep.parquet").glob("*-0*.parquet")}
    status, said = _finished(*words, "--out", out)
    assert status == 2
    assert "--resume" in said
    assert _finished(*words, "--out", out, "--resume")[0] == 0
    assert all(path.read_bytes() == content for path, content in kept.items())
    assert set(_tree(out)) == set(_tree(whole))
    one, other = (json.loads((f / "sweep.json").read_text()) for f in (out, whole))
    assert {**one, "cost": 0} == {**other, "cost": 0}
    for path in sorted((whole / "sweep.parquet").iterdir()):
        assert (out / "sweep.parquet" / path.name).read_bytes() == path.read_bytes()
    for picture in ("sweep.svg", "sweep.png"):
        assert (out / picture).read_bytes() == (whole / picture).read_bytes()


def _finished(*words: str | Path) -> tuple[int, str]:
    """Exit status and standard error of a process of its own."""
    process = _process(*words)
    _, said = process.communicate(timeout=300)
    return process.returncode, said


def test_map_and_basins(model: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    words = ["--from", "0.8", "--to", "0.9", "--steps", "4", "--map", "b", "0.2", "0.3", "3"]
    answer = _asked(capfd, model, *words, "--out", out)
    assert sum(answer["counts"].values()) == 12
    assert answer["y"] == {"name": "b", "from": 0.2, "to": 0.3, "steps": 3}
    assert len(list((out / "map.parquet").iterdir())) == 3
    answer = _asked(
        capfd, model, "--basins", "--omega", "1.43", "--steps", "6", "--map", "x1'", "-1", "1", "5",
        "--out", out,
    )  # fmt: skip
    assert len(answer["cells"]) == 30
    assert sum(a["share"] for a in answer["attractors"]) == pytest.approx(1.0)
    table = pq.read_table(out / "basins.parquet" / "row-000002.parquet", partitioning=None)
    assert {"x1", "x1'", "status"} <= set(table.column_names)
    assert {"map.png", "map.svg", "map.json", "basins.png", "basins.svg"} <= set(_tree(out))


def test_what_is_expected_of_a_response_makes_no_other_work(
    model: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """A file with another ``expect`` has the same basins. One with another damping has not, nor
    has one whose first response, at whose frequency they are, is another."""
    file = read_model_file(model)
    out, changed = tmp_path / "out", tmp_path / "changed.toml"

    def asked(text: str) -> int:
        changed.write_text(text, encoding="utf-8")
        axes = ("--steps", "2", "--map", "x2", "-1", "1", "2", "--periods", "20", "--keep", "4")
        words = ["bifurcation", "basins", str(changed), *axes, "--out", str(out)]
        return entry.status(words)

    assert asked(file.text) == 0
    before = _tree(out)
    (first,) = file.data["response"]
    other = {**first, "expect": "2-1-1", "twin": "exact", "symmetric": False}
    assert asked("# a comment\n" + file.with_({"response": [other]}).text) == 0
    assert _tree(out) == before
    capfd.readouterr()
    for change in ({"response": [{**first, "omega": 0.9}]}, {"zeta": 0.11}, {"title": "another"}):
        assert asked(file.with_(change).text) == 2
        assert "--overwrite" in capfd.readouterr().err
    assert _tree(out) == before
    # A folder of an earlier version says it by the text.
    manifest = out / "manifest.json"
    said = json.loads(manifest.read_text())["stages"]["basins"]["inputs"]["model"]
    assert said == file.motions_sha256 != file.sha256
    folder = Folder(out)
    assert folder.manifest is not None
    folder.manifest.stages["basins"].inputs["model"] = file.sha256
    folder._save()
    assert asked(file.text) == 0
    assert asked("# a comment\n" + file.text) == 2


def test_a_model_and_its_circuit_need_a_folder_each(
    design: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert entry.status(["bifurcation", str(design), *SWEEP, "--no-points", "--out", str(out)]) == 0
    before = _tree(out)
    words = ["--circuit", "--from", "300", "--to", "310", "--steps", "3", "--no-points"]
    capfd.readouterr()
    assert entry.status(["bifurcation", str(design), *words, "--out", str(out)]) == 2
    said = capfd.readouterr().err
    assert "subject model" in said
    assert "another folder" in said
    assert _tree(out) == before


def test_old_blocks_of_another_circuit_are_not_taken(design: Path) -> None:
    """The part values are the same; what the catalogue says of the op-amps is not."""
    modelfile = read_model_file(design / "model.toml")
    made, again = (load(Folder(design), modelfile, load_catalog()).design for _ in range(2))
    said = BoardSubject(made).as_dict()
    assert said == BoardSubject(again).as_dict()
    changes: tuple[dict[str, Any], ...] = ({"gain": 1e4}, {"bias": 1e-6}, {"saturation": 9.0})
    for change in changes:
        circuit = replace(made.circuit, **change)
        other = BoardSubject(made)
        other.design = replace(made, circuit=circuit)
        assert other.as_dict()["parts"] == said["parts"]
        assert other.as_dict() != said


def test_circuit_in_hertz_and_volts(design: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """One step after another is what the board settles on at that frequency of the generator."""
    modelfile = read_model_file(design / "model.toml")
    made = load(Folder(design), modelfile, load_catalog()).design
    low, high = made.errors.scales.frequency(0.80), made.errors.scales.frequency(0.88)
    ends = ["--from", repr(low), "--to", repr(high), "--steps", "4", "--periods", "150"]
    answer = _asked(capfd, design, "--circuit", *ends, "--no-points")
    assert (answer["parameter"], answer["unit"]) == ("frequency", "Hz")
    shown = {w["response"] for w in answer["windows"]}
    x = np.zeros(4)
    settled = set()
    for setting in BoardSubject(made).settings(
        [{"frequency": float(f)} for f in np.linspace(low, high, 4)[::-1]]
    ):
        orbit = attractors.settle(setting.flow(), x)
        settled.add(orbit.response)
        x = orbit.start
    assert shown == settled == {"1-2-2"}
    assert answer["windows"][0]["from"] == pytest.approx(low)
    assert entry.status(["bifurcation", str(design), "--circuit", "--from", "1", "--to", "0"]) == 2
    assert "Hz" in capfd.readouterr().err


def test_reproduce_says_what_there_is_not(capfd: pytest.CaptureFixture[str]) -> None:
    assert entry.status(["reproduce", "everything"]) == 2


@pytest.mark.slow
def test_curves_over_a_second_parameter(
    model: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    words = (model, *SWEEP, "--and", "b", "0.22", "0.28", "--out", out)
    answer = _asked(capfd, *words)
    (curve,) = answer["curves"]
    assert (curve["kind"], curve["response"], curve["ends"]) == (
        "pitchfork",
        "1-1-1",
        ["edge of b", "edge of b"],
    )
    assert min(abs(w - answer["points"][0]["value"]) for w, _ in curve["points"]) < 1e-9
    own = {"name": "b", "from": 0.22, "to": 0.28, "at": 0.25, "depth": 1}
    assert answer["and"] == {**own, "unit": ""}  # a dimensionless model has no SI values
    header, *rows = (out / "curves.csv").read_text().splitlines()
    assert header == "curve,kind,response,symmetric,omega,b,stable,begun_at"
    assert len(rows) == len(curve["points"])
    kept = [
        row
        for f in sorted((out / "curves.parquet").iterdir())
        for row in pq.read_table(f).to_pylist()
    ]
    assert [row["points"] for row in kept] == [curve["points"]]
    # A block that is left is taken as it is; the work is the same again.
    written = _tree(out)
    (out / "sweep.json").unlink()
    (out / "curves.parquet" / "block-000003.parquet").unlink()
    again = _asked(capfd, *words, "--overwrite")
    assert {**again, "cost": 0} == {**answer, "cost": 0}
    assert _tree(out)["curves.csv"] == written["curves.csv"]


@pytest.mark.slow
def test_region_of_a_response(
    model: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    words = (model, *SWEEP, "--and", "b", "0.24", "0.26", "--region", "1.49")
    region = _asked(capfd, *words, "--out", tmp_path / "out")["region"]
    assert (region["response"], region["symmetric"], region["at"]) == ("1-1-1", True, [1.49, 0.25])
    kinds = [end["kind"] for end in region["border"]]
    assert set(kinds) == {"pitchfork", "edge of the window"}
    assert region["around"]["centre"] == [1.49, 0.25]
    assert region["around"]["share"] <= region["best"]["share"]
    assert entry.status(["bifurcation", *map(str, words), "--out", str(tmp_path / "out")]) == 0
    text = capfd.readouterr().err
    assert "Region of 1-1-1 about omega = 1.49, b = 0.25" in text
    assert f"{region['around']['share']:.2%}" in text


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (("--and", "omega", "1", "2"), "another parameter"),
        (("--and", "b", "0.3", "0.4"), "0.25, the value along the sweep"),
        (("--and", "mass", "0.3", "0.4"), "b"),
        (("--and", "b", "0.2", "0.4", "--no-points"), "a sweep with its points"),
        (("--region", "1.5"), "a second parameter too"),
        (("--region", "1.6", "--and", "b", "0.2", "0.4"), "between 1.4 and 1.52"),
    ],
)
def test_bad_second_parameter(
    model: Path, capfd: pytest.CaptureFixture[str], words: tuple[str, ...], part: str
) -> None:
    assert entry.status(["bifurcation", str(model), *SWEEP, *words]) == 2
    text = capfd.readouterr().err
    assert "--and" in text or "--region" in text
    assert part in text


def test_counted_basins(model: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """In JSON, in a table with limits, in the picture; of starts in a box that was asked for."""
    out = tmp_path / "out"
    words = ("--from", "1.45", "--to", "1.55", "--steps", "3", "--no-points")
    options = ("--shares", "8", "--seed", "5", "--box", "x1=-0.1:0.1", "--out", out)
    answer = _asked(capfd, model, *words, *options)["shares"]
    assert (answer["starts"], answer["seed"], answer["box"]["x1"]) == (8, 5, [-0.1, 0.1])
    rows = [step for a in answer["attractors"] for step in a["steps"]]
    by_value = [sum(r["count"] for r in rows if r["value"] == v) for v in (1.45, 1.5, 1.55)]
    assert by_value == [8, 8, 8]
    assert all(r["low"] <= r["share"] <= r["high"] for r in rows)
    header, *lines = (out / "shares.csv").read_text().splitlines()
    assert header.startswith("omega,attractor,response,symmetric,twin,count,starts,share,low,high,")
    assert len(lines) == len(rows)
    assert "shares.csv" in json.loads((out / "manifest.json").read_text())["files"]
    assert len(bifurcation(model, from_=1.5, to=1.55, steps=2, points=False, shares=4).shares()) > 1


def test_boards_are_switched_on_at_any_phase(
    design: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    modelfile = read_model_file(design / "model.toml")
    scales = load(Folder(design), modelfile, load_catalog()).design.errors.scales
    ends = ["--from", repr(scales.frequency(0.84)), "--to", repr(scales.frequency(0.86))]
    words = [*ends, "--steps", "2", "--periods", "100", "--no-points", "--shares", "3"]
    answer = _asked(capfd, design, "--circuit", *words)["shares"]
    assert all(limits == [0.0, 0.0] for limits in answer["box"].values())
    assert sum(step["count"] for a in answer["attractors"] for step in a["steps"]) == 6
    assert answer["attractors"][0]["steps"][0]["response"] == "1-2-2"


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (("--shares", "0"), ">= 1"),
        (("--shares", "9", "--basins"), "a sweep"),
        (("--box", "x1=0:1"), "--shares"),
        (("--shares", "9", "--box", "x1=1"), "STATE=A:B"),
        (("--shares", "9", "--box", "x9=0:1"), "x1"),
        (("--shares", "9", "--box", "x1=1:0"), "two finite ends"),
    ],
)
def test_bad_starts(
    model: Path, capfd: pytest.CaptureFixture[str], words: tuple[str, ...], part: str
) -> None:
    assert entry.status(["bifurcation", str(model), *SWEEP, *words]) == 2
    text = capfd.readouterr().err
    assert "--shares" in text or "--box" in text
    assert part in text


KINDS = {kind.name: kind for kind in bifurcation_verb.VERB.kinds}


@pytest.mark.parametrize("kind", KINDS)
def test_a_kind_has_a_help_page_with_an_example_that_it_reads(
    kind: str, model: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The example's words are among the page's; what the kind must be given is asked for."""
    assert entry.status(["bifurcation", kind, "--help"]) == 0
    page = capfd.readouterr().out
    own = KINDS[kind]
    assert " ".join(own.help.split()) in " ".join(page.split())
    assert all(" ".join(text.split()) in " ".join(page.split()) for text in own.texts.values())
    assert f"  {own.example}\n" in page
    words = set(re.findall(r"--[a-z-]+", own.example))
    assert all(re.search(rf"^  {word} ", page, re.MULTILINE) for word in words)
    required = re.findall(
        r"^  (--\S+)(?:.(?!\n  --))*?\[required\]", page, re.MULTILINE | re.DOTALL
    )
    if "!" in own.words:
        assert len(required) == own.words.count("!")
        assert entry.status(["bifurcation", kind, str(model), "--from", "0.8", "--to", "1"]) == 2
        assert f"Missing option '{required[0]}'" in capfd.readouterr().err


def test_a_kind_is_the_verb_with_the_words_that_it_stands_for(
    model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    ends = ["--from", "-1", "--to", "1", "--steps", "2", "--map", "x2", "-1", "1", "2"]
    at = ["--omega", "0.85"]
    said = _asked(capfd, "basins", model, *ends, *at)
    once = _asked(capfd, model, "--basins", *ends, *at)
    assert (said["kind"], said["cells"]) == ("basins", once["cells"])
    assert entry.status(["bifurcation", "map", str(model), "--basins"]) == 2
    monkeypatch.chdir(tmp_path)
    Path("sweep").write_bytes(model.read_bytes())  # a file of a kind's name is a file
    words = ["--from", "1.4", "--to", "1.41", "--steps", "2", "--no-points"]
    assert _asked(capfd, "sweep", *words)["kind"] == "sweep"
    assert _asked(capfd, "sweep", model, *words)["kind"] == "sweep"
    assert _asked(capfd, "sweep", *words, model)["kind"] == "sweep"
    assert entry.status(["bifurcation", "sweeps", str(model), *words]) == 2
    assert "found sweeps, expected one of sweep, curves" in capfd.readouterr().err


@pytest.mark.parametrize("ends", [("60", "100"), ("9.5492965855 Hz", "100 rad/s")])
def test_the_unit_that_a_plain_number_was_taken_in_is_said(
    ends: tuple[str, str], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """60 rad/s are 9.549 Hz, whoever writes them."""
    path = tmp_path / "gap.toml"
    path.write_text(
        system_text(
            {"hammer": "0.5 kg"},
            {("hammer", "ground"): "2 kN/m"},
            {("hammer", "ground"): "6 N s/m"},
            clearance("A", "hammer", "ground", upper="1 mm", lower="1 mm", stiffness="38 kN/m"),
            table("force", on="hammer", amplitude="4 N"),
        ),
        encoding="utf-8",
    )
    words = ["bifurcation", "sweep", str(path), "--from", ends[0], "--to", ends[1], "--steps", "2"]
    words += ["--periods", "20", "--no-points"]
    assert entry.status(words) == 0
    said = capfd.readouterr().err
    over = "ω from 60 to 100 rad/s (9.549 Hz to 15.92 Hz)"
    assert f"sweep over {over} …" in said
    assert f"\nWindows, {over}\n" in said
    lengths = ["--over", "A.upper", "--from", "0.001", "--to", "2 mm", "--omega", "80"]
    assert entry.status([*words[:3], *lengths, *words[7:]]) == 0
    assert "sweep over A.upper from 1 mm to 2 mm" in capfd.readouterr().err
    answer = _asked(capfd, *words[1:])
    assert (answer["unit"], answer["to"]) == ("rad/s", 100.0)
    assert answer["from"] == pytest.approx(60.0, rel=1e-9)
