"""Exponents of chaos and their standard errors: series and maps of known exponent, many runs."""

from __future__ import annotations

import numpy as np
import pytest

from designer.base.arrays import Array
from designer.dynamics.attractors import settle, with_exponent
from designer.dynamics.lyapunov_exponent import BATCHES, Bound, batch_error, lyapunov, until
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.steady_state import SWEPT, TransientSettings, by_flow
from tests.dynamics.test_attractors import REST, flow_at
from tests.dynamics.test_steady_state import setting


@pytest.mark.parametrize("memory", [-0.5, 0.0, 0.8])
def test_the_error_of_a_correlated_mean(memory: float) -> None:
    """x' = memory · x + noise, 4000 long: the mean's variance is known in closed form."""
    count, runs = 4000, 300
    noise = np.random.default_rng(5).standard_normal((runs, count))
    x = np.zeros((runs, count))
    for k in range(1, count):
        x[:, k] = memory * x[:, k - 1] + noise[:, k]
    true = 1.0 / (1.0 - memory) ** 2 / count
    estimated = np.mean([batch_error(row) ** 2 for row in x])
    assert estimated == pytest.approx(true, rel=0.15)
    off = np.abs(x.mean(axis=1)) / np.array([batch_error(row) for row in x])
    assert 0.92 < np.mean(off < 1.96) < 0.99


def _tent(a: float, seed: int) -> tuple[Array, float]:
    """Growth rates of the skew tent map, 5 steps at a time, and its exponent in closed form."""
    x, rates = float(np.random.default_rng(seed).uniform()), []
    for _ in range(100_000):
        rates.append(-np.log(a) if x < a else -np.log(1.0 - a))
        x = x / a if x < a else (1.0 - x) / (1.0 - a)
    exact = -a * np.log(a) - (1.0 - a) * np.log(1.0 - a)
    return np.array(rates).reshape(-1, 5).mean(axis=1), float(exact)


def test_a_series_is_made_longer_until_its_error_is_below_the_bound() -> None:
    rates, exact = _tent(0.3, 1)
    given = 0

    def further(blocks: int) -> Array:
        nonlocal given
        given += blocks
        return rates[given - blocks : given]

    short = until(Bound(relative=0.05), np.zeros(0), further)
    assert len(short) == BATCHES
    given = 0
    long = until(Bound(relative=0.006), np.zeros(0), further)
    assert BATCHES < len(long) == given < len(rates)
    assert batch_error(long) < 0.006 * exact
    assert abs(long.mean() - exact) < 3.0 * batch_error(long)
    given = 0
    assert len(until(Bound(0.0, 0.0, periods=5000), np.zeros(0), further)) == 1000


def test_the_stated_error_is_what_runs_of_chaos_scatter_by() -> None:
    """At ω = 0.6 runs of 300 periods scatter by some per cent, as each of them says, about the
    exponent that the two engines measure closely."""
    motion = setting(0.6).steady(REST, TransientSettings())
    assert motion.lyapunov_error < max(SWEPT.relative * motion.lyapunov, SWEPT.absolute)
    flow, x, runs = flow_at(0.6), motion.end, []
    for _ in range(40):
        runs.append(lyapunov(flow, x, None, 300))
        x = runs[-1].start
    values, stated = np.array([r.value for r in runs]), np.array([r.error for r in runs])
    assert 0.02 < values.std(ddof=1) / values.mean() < 0.08
    assert np.sqrt(np.mean(stated**2)) == pytest.approx(values.std(ddof=1), rel=0.3)
    close = with_exponent(flow, settle(flow, REST))
    assert close.lyapunov_error < 0.01 * close.lyapunov
    both = np.hypot(close.lyapunov_error, values.std(ddof=1) / np.sqrt(len(runs)))
    assert abs(close.lyapunov - values.mean()) < 3.0 * both
    assert abs(close.lyapunov - motion.lyapunov) < 3.0 * motion.lyapunov_error


def test_both_engines_of_a_diagram_measure_to_the_same_bound() -> None:
    fast = setting(1.2).steady(REST, TransientSettings())
    slow = by_flow(flow_at(1.2), REST, TransientSettings())
    assert fast.status is slow.status is OrbitStatus.APERIODIC
    off = abs(fast.lyapunov - slow.lyapunov)
    assert off < 4.0 * np.hypot(fast.lyapunov_error, slow.lyapunov_error)
    assert max(fast.lyapunov_error, slow.lyapunov_error) < 0.1 * fast.lyapunov


def test_growth_of_less_than_a_hundredth_a_period_is_told_from_none() -> None:
    """No period, not stationary, and far below what 300 periods show: weak chaos."""
    orbit = settle(flow_at(0.43496198479391757), REST)
    assert orbit.status is OrbitStatus.APERIODIC
    assert 0.0 < 4.0 * orbit.lyapunov_error < orbit.lyapunov
    assert orbit.lyapunov * 2.0 * np.pi / 0.435 < 0.02


def test_a_periodic_orbit_has_no_error_of_its_exponent() -> None:
    orbit = settle(flow_at(0.85), REST)
    assert with_exponent(flow_at(0.85), orbit) is orbit
    assert np.isnan(orbit.lyapunov_error)
