"""Yields against the closed formula and by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given, strategies as st

from designer.verdicts.verdict import Answer, Verdict
from designer.yields.yield_count import Yield, all_on_one, count, reasons, worst


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


OK, LOST, GRAZING, FAILED = Verdict.OK, Verdict.LOST, Verdict.GRAZING, Verdict.FAILED
BLANK = Answer(0, 0, OK, "", "", 0.0, 0.0, 0.0, 0.0, 0)


def test_a_board_is_what_its_worst_response_is() -> None:
    """One that is lost is one too many, whatever the others are; then one that is undecided."""
    boards = [(OK, OK), (OK, LOST), (FAILED, LOST), (GRAZING, OK), (FAILED, GRAZING), (OK, FAILED)]
    assert [worst(verdicts) for verdicts in boards] == [OK, LOST, LOST, GRAZING, GRAZING, FAILED]
    rows = [
        replace(BLANK, sample=sample, question=question, verdict=boards[sample][question])
        for question in (0, 1)
        for sample in range(len(boards))
    ]
    assert all_on_one(rows) == Yield(1, 2, 2, 1)
    assert all_on_one(rows, census=True) == Yield(1, 2, 2, 1, census=True)


def test_of_all_the_boards_there_are_the_rate_is_no_estimate() -> None:
    assert Yield(3, 1, 0, 1, census=True).interval == (0.75, 0.75)
    assert Yield(3, 1, 0, 1).interval[0] < 0.75 < Yield(3, 1, 0, 1).interval[1]
    assert Yield(0, 0, 0, 2, census=True).interval == (0.0, 1.0)
    assert count([BLANK, BLANK], census=True).interval == (1.0, 1.0)
    assert count([BLANK, BLANK]).interval[0] < 1.0


def test_reasons_are_counted_without_their_figures_the_most_frequent_first() -> None:
    rows = [
        (OK, ""),
        (LOST, "to 2-2-2"),
        (FAILED, "3 of 4 settings gave no answer"),
        (LOST, "asymmetric by 0.2 of the peak"),
        (GRAZING, ""),
        (LOST, "to 1-2-2"),
        (LOST, "asymmetric by 0.31 of the peak"),
    ]
    assert list(reasons(rows).items()) == [
        ("lost: asymmetric", 2),
        ("failed: most settings gave no answer", 1),
        ("grazing", 1),
        ("lost: to 1-2-2", 1),
        ("lost: to 2-2-2", 1),
    ]
