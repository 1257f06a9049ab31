"""The interval of a proportion against SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.stats import binom, binomtest, nbinom, norm

from designer.base.proportion import inverse_binomial, mid_p, wilson


@given(of=st.integers(1, 500), count=st.integers(0, 500), level=st.floats(0.5, 0.999))
def test_wilson_is_that_of_scipy(of: int, count: int, level: float) -> None:
    count = min(count, of)
    ci = binomtest(count, of).proportion_ci(0.95, method="wilson")
    assert wilson(count, of) == pytest.approx((ci.low, ci.high), abs=1e-12)
    ci = binomtest(count, of).proportion_ci(level, method="wilson")
    quantile = float(norm.ppf(0.5 + 0.5 * level))
    assert wilson(count, of, quantile) == pytest.approx((ci.low, ci.high), abs=1e-12)


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


@given(st.integers(1, 400), st.data())
def test_mid_p_limits_leave_a_fortieth_beyond_each(of: int, data: st.DataObject) -> None:
    count = data.draw(st.integers(0, of))
    low, high = mid_p(count, of)
    assert mid_p(of - count, of) == pytest.approx((1.0 - high, 1.0 - low), abs=1e-12)
    above = 0.5 * (binom.sf(count - 1, of, low) + binom.sf(count, of, low))
    assert above == pytest.approx(0.025 if count else 0.5, abs=1e-9)
    below = 0.5 * (binom.cdf(count - 1, of, high) + binom.cdf(count, of, high))
    assert below == pytest.approx(0.025 if count < of else 0.5, abs=1e-9)


@pytest.mark.parametrize("of", [30, 50, 200])
def test_mid_p_is_tight_where_nothing_was_seen_and_still_covers(of: int) -> None:
    assert mid_p(0, of)[1] == pytest.approx(1.0 - 0.05 ** (1.0 / of))
    assert mid_p(0, of)[1] < 0.9 * wilson(0, of)[1]
    assert str(mid_p(0, of)[0]) == "0.0"  # nobody reads of -0 per cent
    rates = np.linspace(0.001, 0.5, 300)
    limits = [mid_p(k, of) for k in range(of + 1)]
    covered = [
        sum(binom.pmf(k, of, rate) for k, (low, high) in enumerate(limits) if low <= rate <= high)
        for rate in rates
    ]
    assert min(covered) > 0.92
    assert np.mean(covered) > 0.95


@pytest.mark.parametrize("count", [2, 20, 45])
@pytest.mark.parametrize("rate", [0.02, 0.3, 0.9])
def test_an_interval_of_a_number_of_hits_covers_exactly(count: int, rate: float) -> None:
    """Of all numbers of asked ones, each as likely as SciPy's negative binomial law has it."""
    of = np.arange(count, int(nbinom.ppf(1.0 - 1e-9, count, rate)) + count + 1)
    chance = nbinom.pmf(of - count, count, rate)
    for level in (0.95, 0.99):
        low, high = np.transpose([inverse_binomial(count, int(n), level) for n in of])
        assert 0.7 * (1.0 - level) < chance[(rate < low) | (rate > high)].sum() or rate > 0.1
        assert chance[rate < low].sum() <= 0.5 * (1.0 - level)
        assert chance[rate > high].sum() <= 0.5 * (1.0 - level)
    assert (chance * (count - 1) / (of - 1)).sum() == pytest.approx(rate, abs=1e-6)
