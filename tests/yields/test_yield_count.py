"""Yields against the closed formula and by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given, strategies as st

from designer.verdicts.verdict import Answer, Verdict
from designer.yields.yield_count import Yield, count


@given(
    ok=st.integers(0, 300), lost=st.integers(0, 300), grazing=st.integers(0, 50),
    failed=st.integers(0, 50),
)  # fmt: skip
def test_wilson_interval_is_the_closed_formula(
    ok: int, lost: int, grazing: int, failed: int
) -> None:
    y = Yield(ok, lost, grazing, failed)
    n = ok + lost + grazing
    assert y.samples == n + failed
    if n == 0:
        assert math.isnan(y.rate)
        assert y.interval == (0.0, 1.0)
        return
    p, z = ok / n, 1.959963984540054
    assert y.rate == pytest.approx(p)
    centre = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n)) / (1 + z * z / n)
    low, high = y.interval
    assert low == pytest.approx(max(centre - half, 0.0), abs=1e-12)
    assert high == pytest.approx(min(centre + half, 1.0), abs=1e-12)
    assert low - 1e-12 <= p <= high + 1e-12


def test_count_sorts_verdicts() -> None:
    blank = Answer(0, 0, Verdict.OK, "", "", 0.0, 0.0, 0.0, 0.0, 0)
    order = [Verdict.OK] * 4 + [Verdict.LOST] * 3 + [Verdict.GRAZING] * 2 + [Verdict.FAILED]
    got = count([replace(blank, verdict=v) for v in order])
    assert (got.ok, got.lost, got.grazing, got.failed) == (4, 3, 2, 1)
