"""The benchmark of the exact circuit runs, on a few boards, and its report says what it
measured."""

from __future__ import annotations

import pytest

from benchmarks import bench_tolerance


@pytest.mark.slow
def test_a_quick_look() -> None:
    plans = {stage: bench_tolerance.plan_of(stage, 1) for stage in bench_tolerance.STAGES}
    rows = bench_tolerance.measure(plans, samples=6, boards=1, runs=0)
    assert [(row.stage, row.p, row.samples) for row in rows] == [
        ("paper", 1, 6),
        ("rectifier", 1, 6),
    ]
    for row in rows:
        assert row.kept == 1.0
        assert row.longest < 140
        assert row.cpu > 0.0
        assert row.brute > 0.0
    size = bench_tolerance.memory(plans["paper"], 6)
    assert size > 50.0
    text = bench_tolerance.report(rows, {6: size}, 1.0)
    assert text.count("| 1-1-1 ") == 2
    assert bench_tolerance.plot(rows).axes[0].get_legend() is not None
