"""The interval of a proportion against SciPy's."""

from __future__ import annotations

import pytest
from hypothesis import given, strategies as st
from scipy.stats import binomtest

from designer.base.proportion import wilson


@given(of=st.integers(1, 500), count=st.integers(0, 500))
def test_wilson_is_that_of_scipy(of: int, count: int) -> None:
    count = min(count, of)
    ci = binomtest(count, of).proportion_ci(0.95, method="wilson")
    assert wilson(count, of) == pytest.approx((ci.low, ci.high), abs=1e-12)


@given(of=st.integers(1, 300), tenths=st.integers(0, 3000))
def test_half_a_count_lies_between_its_neighbours(of: int, tenths: int) -> None:
    count = min(tenths / 10.0, float(of))
    low, high = wilson(count, of)
    assert wilson(int(count), of)[0] <= low <= count / of + 1e-12
    assert count / of - 1e-12 <= high <= wilson(min(int(count) + 1, of), of)[1]


@given(of=st.integers(1, 5000))
def test_an_interval_of_none_or_all_ends_without_rounding(of: int) -> None:
    assert wilson(0.0, of)[0] == 0.0
    assert wilson(float(of), of)[1] == 1.0


def test_nothing_asked_says_nothing() -> None:
    assert wilson(0, 0) == (0.0, 1.0)
