"""The benchmark of sweeps runs, on a small case, and states what it measured."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks import bench_sweeps


def test_small(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        bench_sweeps, "costs", lambda: [bench_sweeps.Cost(1.55, 1.0, 0.8, 0.9, 1.7, 90.0)]
    )
    bench_sweeps.main(tmp_path, rounds=1, steps=9, side=3)
    said = json.loads((tmp_path / "sweeps.json").read_text())
    assert [t["points"] for t in said["timings"]] == [9, 9, 18, 9]
    assert all(t["periods"] >= 9 * 150 and min(t["cpu"]) > 0.0 for t in said["timings"])
    text = (tmp_path / "sweeps.md").read_text(encoding="utf-8")
    assert "| 1.55 | 1.0" in text


def test_costs_of_the_simple_response() -> None:
    (cost,) = bench_sweeps.costs((1.55,), 50)
    assert cost.impacts == 1.0  # 1-1-1
