"""Distributions against their analytic cdf and moments, and what holds for every one of them."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy import integrate
from scipy.stats import kstest, norm, truncnorm

from designer.base.arrays import Array
from designer.model.distributions import Binned, Distribution, Normal, Split, Uniform

U = np.random.default_rng(20).random(20_000)

# law, its cdf by hand, mean, variance


def _binned(x: Array) -> Array:
    """Density 1/(2 (outer - inner)) on both sides of the gap: inner 1, outer 5."""
    below = (np.clip(x, -5.0, -1.0) + 5.0) / 8.0
    return np.asarray(below + (np.clip(x, 1.0, 5.0) - 1.0) / 8.0)


def _split(x: Array) -> Array:
    """Half on each side of 3: from 2 and up to 7."""
    below = (np.clip(x, 2.0, 3.0) - 2.0) / 2.0
    return np.asarray(below + (np.clip(x, 3.0, 7.0) - 3.0) / 8.0)


CUT = 10.0 / 3.0
LEFT = 1.0 - 2.0 * CUT * norm.pdf(CUT) / (norm.cdf(CUT) - norm.cdf(-CUT))
SPLIT_SQUARE = 0.5 * (19.0 / 3.0) + 0.5 * (79.0 / 3.0)  # mean square: (b² + ab + a²)/3 each half
LAWS: list[tuple[Distribution, Callable[[Array], Array], float, float]] = [
    (Uniform(-2.0, 4.0), lambda x: (x + 2.0) / 6.0, 1.0, 3.0),
    (Normal(3.0, 10.0), truncnorm(-CUT, CUT, scale=3.0).cdf, 0.0, 9.0 * LEFT),
    (Binned(1.0, 5.0), _binned, 0.0, 31.0 / 3.0),  # (25 + 5 + 1)/3
    (Split(2.0, 3.0, 7.0), _split, 3.75, SPLIT_SQUARE - 3.75**2),
]
EACH = pytest.mark.parametrize(("law", "cdf", "mean", "variance"), LAWS)


@EACH
def test_distribution_and_moments(
    law: Distribution, cdf: Callable[[Array], Array], mean: float, variance: float
) -> None:
    drawn = law.ppf(U)
    assert kstest(cdf(drawn), "uniform").pvalue > 1e-3
    sigma = math.sqrt(variance)
    assert drawn.mean() == pytest.approx(mean, abs=4.0 * sigma / math.sqrt(len(U)))
    assert drawn.var() == pytest.approx(variance, rel=0.03)


@EACH
def test_moments_by_quadrature(
    law: Distribution, cdf: Callable[[Array], Array], mean: float, variance: float
) -> None:
    """The integral over u of ppf and its square; and cdf(ppf(u)) is u."""

    def moment(power: int) -> float:
        halves = [(0.0, 0.5), (0.5, 1.0)]  # a law may jump at 1/2
        return sum(
            float(integrate.quad(lambda u: float(law.ppf(np.array([u]))[0]) ** power, a, b)[0])
            for a, b in halves
        )

    assert moment(1) == pytest.approx(mean, abs=1e-7)
    assert moment(2) - mean**2 == pytest.approx(variance, rel=1e-7)
    u = np.linspace(0.0, 1.0, 401)
    assert cdf(law.ppf(u)) == pytest.approx(u, abs=1e-12)


@st.composite
def laws(draw: st.DrawFn) -> Distribution:
    positive = st.floats(1e-12, 1e6)
    a, b, c = sorted(draw(st.tuples(positive, positive, positive)))
    sign = draw(st.sampled_from([-1.0, 1.0]))
    low, high = sorted((sign * a, c))
    each: list[Distribution] = [Uniform(low, high), Normal(a, c), Binned(a, c)]
    if low <= b <= high:
        each.append(Split(low, b, high))
    return draw(st.sampled_from(each))


@given(laws(), st.lists(st.floats(0.0, 1.0, exclude_max=True), min_size=2, max_size=20))
def test_more_is_more_and_stays_within(law: Distribution, numbers: list[float]) -> None:
    u = np.sort(np.array(numbers))
    drawn = law.ppf(u)
    assert np.all(np.diff(drawn) >= -1e-12 * np.abs(drawn).max())
    said = law.as_dict()
    low = said.get("low", -said.get("limit", said.get("outer", 0.0)))
    high = said.get("high", said.get("limit", said.get("outer", 0.0)))
    room = 1e-9 * max(abs(low), abs(high))
    assert np.all((drawn >= low - room) & (drawn <= high + room))
    if isinstance(law, Binned):
        assert np.all(np.abs(drawn) >= law.inner - room)


@given(st.floats(1e-9, 10.0), st.floats(1e-9, 10.0))
def test_symmetric_laws_are_symmetric(a: float, b: float) -> None:
    u = np.array([0.1, 0.37, 0.499])
    for law in (Uniform(-a, a), Normal(a, b), Binned(min(a, b), max(a, b))):
        assert law.ppf(1.0 - u) == pytest.approx(-law.ppf(u), rel=1e-9)


def test_no_spread_is_no_spread() -> None:
    for law in (Uniform(0.0, 0.0), Normal(0.0, 0.0), Normal(0.0, 1.0)):
        assert not law.ppf(U).any()


@pytest.mark.parametrize("sigma", [0.05, 0.2, 1.0, 30.0])
def test_a_cut_normal_over_its_range_of_widths(sigma: float) -> None:
    """From hardly cut to nearly uniform, against SciPy."""
    u = np.linspace(0.0, 1.0, 1001)[1:-1]
    truth = truncnorm(-1.0 / sigma, 1.0 / sigma, scale=sigma).ppf(u)
    assert Normal(sigma).ppf(u) == pytest.approx(truth, rel=1e-8, abs=1e-12)
