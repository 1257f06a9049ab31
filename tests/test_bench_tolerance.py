"""The benchmark of the exact rung runs, on a few boards, and its report says what it measured."""

from __future__ import annotations

import pytest

from benchmarks import bench_tolerance


@pytest.mark.slow
def test_a_quick_look() -> None:
    rows = bench_tolerance.measure(samples=6, most=1, boards=1)
    assert [(row.stage, row.p, row.samples) for row in rows] == [
        ("paper", 1, 6),
        ("rectifier", 1, 6),
    ]
    for row in rows:
        assert row.kept == 1.0
        assert row.longest < 140
        assert row.cpu > 0.0
        assert row.brute > 0.0
    text = bench_tolerance.report(rows, 1.0)
    assert text.count("1-1-1") == 2
    assert bench_tolerance.plot(rows).axes[0].get_legend() is not None
