"""Ratios of benchmarks are kept by commit, and those that have fallen are named."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks import __main__ as command, bench_chains, history
from benchmarks.figures import Figures
from benchmarks.history import noted


def test_a_ratio_that_has_fallen_by_more_than_a_tenth_is_named(tmp_path: Path) -> None:
    path = tmp_path / "reports" / "rows.jsonl"
    for value in (90.0, 100.0, 110.0):  # of which 100 is usual
        assert noted("flow", Figures("", {"a": value, "b": 2.0}), path) == []
    assert noted("flow", Figures("", {"a": 91.0, "b": 2.0, "c": 1.0}), path) == []
    (said,) = noted("flow", Figures("", {"a": 80.0, "b": 3.0, "c": float("nan")}), path)
    assert said == "flow: a fell by 16 %, from 95.5 to 80"
    assert noted("sweeps", Figures("", {"a": 1.0}), path) == []  # another one's ratio
    rows = [json.loads(line) for line in path.read_text("utf-8").splitlines()]
    assert [row["ratios"].get("a") for row in rows] == [90.0, 100.0, 110.0, 91.0, 80.0, 1.0]
    assert "c" not in rows[4]["ratios"]
    assert all(len(row["commit"].split(",")[0]) == 40 for row in rows)


def test_another_processor_is_no_loss(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "rows.jsonl"
    for name, value in (("A, 2 cores; numpy 1", 9.0), ("B, 2 cores; numpy 1", 4.0)):
        monkeypatch.setattr(history, "machine", lambda name=name: name)
        assert noted("flow", Figures("", {"a": value}), path) == []
    monkeypatch.setattr(history, "machine", lambda: "A, 2 cores; numpy 2")
    assert len(noted("flow", Figures("", {"a": 4.0}), path)) == 1


def test_the_command_keeps_the_ratios_of_what_it_ran(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "rows.jsonl"
    monkeypatch.setattr(history, "HISTORY", path)
    for value in (3.0, 2.0):
        monkeypatch.setattr(
            bench_chains, "main", lambda value=value: Figures("fine", {"one": value})
        )
        assert command.main(["chains"]) == 0
    assert "chains: one fell by 33 %, from 3 to 2" in capsys.readouterr().out
    assert len(path.read_text("utf-8").splitlines()) == 2
