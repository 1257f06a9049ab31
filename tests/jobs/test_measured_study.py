"""Boards that were measured: a study of all of them, by their names, beside the random boards."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import designer
from designer.cli import entry
from designer.folders.design_source import read_design
from designer.jobs.folder_numbers import of_study
from designer.jobs.options import Options
from designer.model.model_file import parse_model_file, read_model_file
from designer.report.measured_table import boards_csv, response_labels
from tests.shared.model_text import SMALL
from tests.shared.quick_folders import quick_folder

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

GOOD = ("B01", "=B02")
"""The second name would start a formula in a spreadsheet."""
BAD = "B03"


@pytest.fixture(scope="module")
def design(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return quick_folder(SMALL, tmp_path_factory.mktemp("measured") / "design")


@pytest.fixture(scope="module")
def listed(design: Path) -> Path:
    """Two boards that are the nominal one but for their limits, and one with a resistor that is
    off by 60 %."""
    parts = json.loads((design / "design.json").read_text())["parts"]
    sections = [s.name for s in read_design(design).design.circuit.sections]
    rows = ["part,value,board"]
    for board in (*GOOD, BAD):
        for name, value in parts.items():
            off = 1.6 if board == BAD and name == "R1" else 1.0
            rows.append(f"{name},{value * off!r},{board}")
        rows += [f"{name}.offset,0V,{board}" for name in sections]
    path = design.parent / "boards.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


@pytest.fixture(scope="module")
def studied(design: Path, listed: Path) -> Path:
    """The design folder with a random study and that of the built boards."""
    words = ["tolerance", str(design), "--rung", "exact", "--no-blame", "-q"]
    assert entry.status([*words, "--samples", "4"]) == 0
    before = (design / "tolerance.json").read_bytes()
    assert entry.status([*words, "--measured", str(listed)]) == 0
    assert (design / "tolerance.json").read_bytes() == before
    return design


def test_every_board_has_its_name_and_its_verdict(studied: Path) -> None:
    """Boards that are nominal do what the nominal circuit does; one that is far off does not."""
    place = studied / "measured"
    answer = json.loads((place / "tolerance.json").read_text())
    assert [row["board"] for row in answer["boards"]] == [*GOOD, BAD]
    assert [row["verdicts"] for row in answer["boards"]] == [["ok"], ["ok"], ["lost"]]
    assert [row["all"] for row in answer["boards"]] == ["ok", "ok", "lost"]
    assert answer["boards"][0]["shown"] == ["1-2-2"]
    assert answer["samples"] == 3
    rows = (place / "boards.csv").read_text().splitlines()
    assert rows[0] == "board,1: 0.85 1-2-2,all"
    assert rows[1] == "B01,ok,ok"
    assert rows[2] == "'=B02,ok,ok"
    assert rows[3].startswith("B03,lost (")
    samples = pd.read_parquet(place / "samples.parquet")
    assert list(samples["board"]) == [*GOOD, BAD]
    assert list(samples["verdict"]) == ["ok", "ok", "lost"]
    random = pd.read_parquet(studied / "samples.parquet")
    assert "board" not in random.columns
    assert len(random) == 4


def test_all_the_boards_there_are_have_no_interval(
    studied: Path, listed: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    place = studied / "measured"
    answer = json.loads((place / "tolerance.json").read_text())
    counted = answer["responses"][0]["yield"]
    assert counted["census"] is True
    assert counted["low"] == counted["high"] == pytest.approx(2 / 3)
    random = json.loads((studied / "tolerance.json").read_text())["responses"][0]["yield"]
    assert "census" not in random
    assert random["low"] < random["high"]
    page = (place / "report.md").read_text()
    assert "667 (all 3 boards)" in page
    assert "Wilson" not in page
    assert "95 % interval" not in page
    assert "### Board by board" in page
    assert all(name in page for name in ("B01", BAD))
    assert "Wilson" in (studied / "report.md").read_text()
    # What is there is shown again; nothing is computed.
    assert entry.status(["tolerance", str(studied), "--measured", str(listed)]) == 0
    said = capfd.readouterr().err
    assert "was there already" in said
    assert "all 3" in said
    assert "=B02" in said
    assert "All 3 boards" in said
    outcome = designer.tolerance(studied, measured=listed)
    assert outcome.reused
    assert list(outcome.boards().board) == [*GOOD, BAD]
    assert list(outcome.boards().verdict) == ["ok", "ok", "lost"]
    assert len(designer.tolerance(studied).boards()) == 4


def test_another_list_is_other_boards(
    studied: Path, listed: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "design"
    shutil.copytree(studied, out)
    other = tmp_path / "other.csv"
    rows = [line.rpartition(",") for line in listed.read_text().splitlines()]
    other.write_text("".join(f"{row}\n" for row, _, name in rows if name in ("board", GOOD[0])))
    words = ["tolerance", str(out), "--measured", str(other), "-q"]
    assert entry.status(words) == 2
    assert "--overwrite" in capfd.readouterr().err
    assert entry.status([*words, "--overwrite", "--json"]) == 0
    answer = json.loads(capfd.readouterr().out)
    assert [row["board"] for row in answer["boards"]] == ["board"]
    assert (out / "measured" / "measured.csv").read_bytes() == other.read_bytes()


REFUSED = [
    ("part,valeu,board\nR1,100k,B01\n", "line 1", "column 'valeu'", 'did you mean "value"?'),
    ("part,board\nR1,B01\n", "line 1", "part,board", "columns part, value"),
    ("part,value,board\nR999,100k,B01\n", "line 2", "R999", "a part of this design"),
    ("part,value,board\nR1,100k,\n", "line 2", "no board", "the name of the board"),
]


@pytest.mark.parametrize(("text", "where", "found", "expected"), REFUSED)
def test_a_list_that_cannot_be_is_refused_by_its_line(
    design: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    text: str,
    where: str,
    found: str,
    expected: str,
) -> None:
    path = tmp_path / "list.csv"
    path.write_text(text)
    before = (design / "manifest.json").read_bytes()
    assert entry.status(["tolerance", str(design), "--measured", str(path), "-q"]) == 2
    said = capfd.readouterr().err
    assert all(words in said for words in ("list.csv", where, found, expected))
    assert (design / "manifest.json").read_bytes() == before


@pytest.mark.parametrize(
    "words", [["--samples", "3"], ["--until", "0.1"], ["--map", "b"], ["--out", "x"]]
)
def test_options_of_random_boards_are_refused(
    design: Path, listed: Path, words: list[str], capfd: pytest.CaptureFixture[str]
) -> None:
    assert entry.status(["tolerance", str(design), "--measured", str(listed), *words, "-q"]) == 2
    said = capfd.readouterr().err
    assert f"{words[0]}: found {words[1]}, expected no such option with --measured" in said


def test_a_model_file_has_no_built_boards(
    listed: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "small.toml"
    model.write_text(SMALL)
    assert entry.status(["tolerance", str(model), "--measured", str(listed), "-q"]) == 2
    assert "a design folder, whose boards were measured" in capfd.readouterr().err


def test_a_model_file_s_list_is_studied_whole(tmp_path: Path) -> None:
    """As many samples as boards, unless somebody says otherwise."""
    (tmp_path / "bench.csv").write_text("part,value,board\nR1,1k,a\nR1,1k,b\nR1,1k,c\n")
    model = tmp_path / "model.toml"
    model.write_text(SMALL + '[spread]\nmeasured = "bench.csv"\n')
    read, out = read_model_file(model), tmp_path / "out"
    assert of_study(model, out, read, Options(), {"samples": None}).samples == 3
    assert of_study(model, out, read, Options(samples=7), {"samples": 7}).samples == 7
    plain = parse_model_file(SMALL)
    assert of_study(model, out, plain, Options(), {"samples": None}).samples == 200


def test_columns_of_two_responses_at_one_frequency_differ() -> None:
    labels = response_labels([(0.85, "1-2-2"), (0.85, "1-2-2"), (1.5, None)])
    assert labels == ["1: 0.85 1-2-2", "2: 0.85 1-2-2", "3: 1.5 -"]
    row: Any = {"board": "B1", "cells": ["ok", None, "lost (clipped)"], "all": None}
    assert boards_csv(labels, [row]).splitlines()[1] == "B1,ok,,lost (clipped),"
