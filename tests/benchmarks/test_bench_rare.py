"""The witness of rare losses: what is counted, what an interrupted run leaves, wider boards."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks import bench_rare
from benchmarks.bench_rare import (
    BLOCK,
    CASES,
    Case,
    Summary,
    figures,
    measured,
    report,
    summaries,
    widened,
)
from designer.catalog.parts_catalog import load_catalog
from designer.spread.spread import Spread, draw_many
from tests.shared.stages import bought, rectifier, stage

FEW = 2 * BLOCK
TWO = CASES[:2]


def plain(_case: Case, first: int) -> dict[str, Any]:
    return {
        "first": first, "boards": BLOCK, "lost": 20, "failed": 0,
        "becomes": {"1-1-1": 15, "clipped": 5}, "wall": 1.0, "cpu": 2.0,
    }  # fmt: skip


def rare(_case: Case, time: int) -> dict[str, Any]:
    """Every fourth interval lies above the plain share of 1e-3."""
    low = 1.5e-3 if time % 4 == 3 else 0.9e-3
    return {
        "time": time, "lost": 1.1 * low, "low": low, "high": 1.3 * low, "boards": 1500,
        "pilots": 500, "effective": 60.0, "largest_weight": 0.1, "gain": 20.0, "unseen": 1e-3,
        "narrow": True, "regions": [], "wall": 3.0, "cpu": 5.0,
    }  # fmt: skip


@pytest.fixture
def made_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench_rare, "CASES", TWO)
    monkeypatch.setattr(bench_rare, "FEW", 10)
    monkeypatch.setattr(bench_rare, "plain_row", plain)
    monkeypatch.setattr(bench_rare, "rare_row", rare)


@pytest.mark.usefixtures("made_up")
def test_an_interrupted_run_goes_on_and_measures_nothing_twice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "rows.jsonl"
    assert measured(path, FEW, 4, minutes=0.0) == []
    whole = measured(path, FEW, 4, minutes=1.0)
    assert len(whole) == len(TWO) * (2 + 4)
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    path.write_text("".join([*lines[:3], lines[3][:20]]), encoding="utf-8")
    again = measured(path, FEW, 4, minutes=1.0)
    assert again == whole
    more = measured(path, FEW, 5, minutes=1.0)
    assert more[: len(whole)] == whole
    assert len(more) == len(whole) + len(TWO)
    monkeypatch.setattr(bench_rare, "CASES", (Case(TWO[0].example, TWO[0].number, 9.0),))
    with pytest.raises(SystemExit, match="of another width"):
        measured(path, FEW, 5, minutes=1.0)


@pytest.mark.usefixtures("made_up")
def test_intervals_that_hold_the_plain_share_are_counted(tmp_path: Path) -> None:
    rows = measured(tmp_path / "rows.jsonl", FEW, 8, minutes=1.0)
    found = summaries(rows)
    assert [s.case for s in found] == list(TWO)
    one = found[0]
    assert (one.boards, one.lost, one.share) == (FEW, 40, 1e-3)
    low, high = one.interval  # of a Poisson count of 40, nearly: 40 - 11.4 and 40 + 13.4
    assert low == pytest.approx(28.9 / FEW, rel=0.02)
    assert high == pytest.approx(54.0 / FEW, rel=0.02)
    assert one.holds == one.meets == 6
    assert one.becomes == "1-1-1 (30), clipped (10)"
    said = figures(found)
    assert (said["estimates"], said["hold"], said["share_held"]) == (16, 12, 0.75)
    text = report(found, FEW, 8)
    assert "12 of 16 intervals of 95 % meet that of the plain share." in text
    assert "12 of 16 hold the plain share itself (75 %)" in " ".join(text.split())
    assert "6 of 8" in text
    assert json.loads(json.dumps(said)) == said


def test_cases_with_too_few_lost_boards_are_left_out() -> None:
    case = TWO[0]
    made = {"commit": "abc"}
    few = Summary(case, [plain(case, 0) | {"lost": 2} | made], [rare(case, 0) | made])
    assert figures([few])["share_held"] is None
    assert "too few lost" in report([few], BLOCK, 1)
    none = report([Summary(case, few.plain, [])], BLOCK, 1)
    assert "nan" not in none
    assert "so far 0 of the" in none


def test_wider_boards_are_as_much_further_off() -> None:
    """Every quantity of a board with the same numbers: twice as far from the nominal one."""
    circuit = stage("rectifier", "both", bought(rectifier()))
    spread = Spread.bench_1(load_catalog().opamp("TL074C"), 0.01, 0.005)
    one, two = (draw_many(circuit, s, 3, range(40)) for s in (spread, widened(spread, 2.0)))
    for name, value in circuit.values.items():
        assert two.values[name] / value - 1.0 == pytest.approx(
            2.0 * (one.values[name] / value - 1.0), rel=1e-6, abs=1e-12
        )
    assert two.offset["U1A"] == pytest.approx(2.0 * one.offset["U1A"])
    assert two.reference["VR1"] - 5.0 == pytest.approx(2.0 * (one.reference["VR1"] - 5.0))
    off = one.high["U1A"] - circuit.saturation
    assert np.abs(off).max() > 0.1
    assert two.high["U1A"] - circuit.saturation == pytest.approx(2.0 * off)
