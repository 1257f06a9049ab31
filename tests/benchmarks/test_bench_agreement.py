"""The benchmark of agreement runs, on a few boards, and its report says what it measured."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks import bench_agreement
from benchmarks.bench_agreement import Difference, Row
from designer.base.manifest import read_json
from designer.model.model_file import read_model_file
from designer.verdicts.verdict import Answer, Verdict
from designer.yields.two_engine_yield import Explanation

ROW = Row("1-2-2", 0.85, 200, 196, 198, 1, 0, 1, 40, 40, 1)
UNEXPLAINED = Difference(0.85, "1-2-2", 7, "1-2-2", "1-1-1", "1-1-1", 0.1, 0.2, 0.5, "unexplained")
GRAZING = replace(UNEXPLAINED, sample=9, penetration=1e-3, why="grazing margin")


def test_the_report_counts_what_has_an_answer(tmp_path: Path) -> None:
    bench_agreement.write(tmp_path, [ROW], [UNEXPLAINED, GRAZING], 1.0)
    text = (tmp_path / "agreement.md").read_text(encoding="utf-8")
    assert "196 of 198" in text
    assert "99.0 %" in text
    assert "1 / 0 / 1" in text
    assert text.count("| 0.85 ") == 3
    data = read_json(tmp_path / "agreement.json")
    assert data["rows"][0]["rate"] == pytest.approx(196 / 198)
    assert data["rows"][0]["low"] < 0.99 < data["rows"][0]["high"]
    assert [d["sample"] for d in data["differences"]] == [7, 9]
    assert {p.suffix for p in tmp_path.iterdir()} == {".md", ".json", ".svg", ".png"}
    assert "There is none." in bench_agreement.report([ROW], [], 1.0)


@pytest.mark.parametrize(
    ("known", "finer", "radius", "why"),
    [
        (Explanation.GRAZING, "1-1-1", 0.5, "grazing margin"),
        (Explanation.NONE, "1-2-2", 0.5, "the same at a finer step"),
        (Explanation.BASIN, "1-1-1", 0.5, "another attractor from the nominal orbit"),
        (Explanation.NONE, "1-1-1", 0.95, "settles slowly (multiplier above 0.9)"),
        (Explanation.NONE, "1-1-1", 0.5, "unexplained"),
    ],
)
def test_a_difference_is_explained_by_what_was_seen(
    known: Explanation, finer: str, radius: float, why: str
) -> None:
    answer = Answer(0, 0, Verdict.OK, "1-2-2", "", radius, 0.1, 0.1, 0.0, 0)
    assert bench_agreement._why(known, finer, answer) == why


@pytest.mark.slow
def test_a_quick_look() -> None:
    file = read_model_file(bench_agreement.MODEL)
    rows, found = bench_agreement.measure(replace(file, responses=file.responses[:1]), 3)
    (row,) = rows
    assert (row.response, row.samples) == ("1-1-1", 3)
    assert row.agreed == row.decided == 3
    assert row.own_decided == 3
    assert found == []
