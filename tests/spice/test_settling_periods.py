"""Warm starts: predicted remainders against known geometric ways, and ngspice settled for long."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.ngspice_figures import SETTLED, memory, warm, warm_job
from designer.base.defaults import Fidelity
from designer.spice import numerics_gate
from designer.spice.deck import SolverSettings
from designer.spice.numerics_gate import MOST_DISCARDED, PROBE, settling_periods
from designer.spice.pool import SpicePool
from designer.spice.read_orbit import STROBE_TOLERANCE, Read
from tests.shared.paper_cases import subject

STEPS = {1: 200, 2: 400, 3: 600, 4: 800, 5: 900, 6: 2200, 7: 2500, 8: 2900}
"""Steps a period on ``ideal``, about those that the gate finds, by p."""
PEAK = np.array([2.0, 1.0, 1.0, 1.0])


def way(c: float, rho: float, n: int = 1, noise: float = 0.0, laps: int = PROBE) -> np.ndarray:
    """Strobes of a geometric approach from c of the peak; the first strobe is off by anything."""
    rng = np.random.default_rng(3)
    k = np.arange(laps * n + 1)
    x = np.outer(c * rho ** (k / n), PEAK * [1.0, 0.5, 0.1, 0.0])
    x += (
        np.outer(np.sin(2 * np.pi * k / n), [1.0, 0.0, 0.0, 0.0]) + rng.normal(size=x.shape) * noise
    )
    x[0] += 0.4
    return x


@pytest.mark.parametrize("rho", [0.1, 0.5, 0.9, 0.97])
@pytest.mark.parametrize("c", [0.5, 0.02])
@pytest.mark.parametrize("n", [1, 3])
def test_the_prediction_is_the_first_strobe_that_is_near_enough(
    rho: float, c: float, n: int
) -> None:
    found, _ = settling_periods(way(c, rho, n), n, rho, PEAK)
    assert found % n == 0
    assert c * rho ** (found / n) <= STROBE_TOLERANCE * 1.001
    least = max(np.log(STROBE_TOLERANCE / c) / np.log(rho), 1.0)
    assert found / n <= least + 2


def test_a_fidelity_that_is_slower_than_the_exact_circuit_is_seen() -> None:
    found, rho = settling_periods(way(0.05, 0.97), 1, 0.2, PEAK)
    assert rho == pytest.approx(0.97, abs=1e-6)
    assert 0.05 * 0.97**found <= STROBE_TOLERANCE
    assert 0.05 * 0.97 ** (found - 2) > STROBE_TOLERANCE


def test_noise_is_no_slow_way() -> None:
    found, rho = settling_periods(way(0.01, 0.3, noise=1e-5), 1, 0.3, PEAK)
    assert rho == 0.3
    assert found <= 4
    assert settling_periods(way(1e-4, 0.5, noise=1e-5), 1, 0.5, PEAK)[0] == 1


def test_a_way_without_a_multiplier() -> None:
    assert settling_periods(way(0.3, 0.6), 1, float("nan"), PEAK)[1] == pytest.approx(0.6, abs=0.01)


@pytest.fixture(scope="module")
def pool() -> Iterator[SpicePool]:
    with SpicePool(2) as pool:
        yield pool


@pytest.mark.slow
@pytest.mark.parametrize("p", [1, 8])
def test_ideal_from_the_third_period_on(pool: SpicePool, p: int) -> None:
    """The strobe, against the same run settled for 400 periods."""
    who = subject(p)
    assert who.orbit.radius < 0.9
    (passed,) = numerics_gate.check(pool, [who])
    assert passed.passed
    ((_, found),) = pool.map([warm_job(who, passed.settings)])
    assert isinstance(found, Read)
    assert len(found.strobes) == SETTLED + 1
    assert found.orbit.response == f"1-{p}-{p}"
    measured = warm(who, found)
    assert measured.gaps[2:].max() < STROBE_TOLERANCE


WITH_MEMORY = 1, 3, 8
"""p of the responses that fidelities with a memory are asked for."""


@pytest.mark.slow
@pytest.mark.parametrize("fidelity", ["dynamic", "full"])
def test_fidelities_with_a_memory_after_what_is_predicted(
    pool: SpicePool, fidelity: Fidelity
) -> None:
    """What is said to be discarded is enough, and the response is the wanted one.

    The settled strobe is that of a run ten times as long, of at least sixty periods.
    """
    exact = [subject(p) for p in WITH_MEMORY]
    asked = numerics_gate.warmed(pool, [replace(who, fidelity=fidelity) for who in exact])
    discarded = [who.discard for who in asked]
    assert all(numerics_gate.DISCARD <= d < MOST_DISCARDED for d in discarded)
    jobs = [
        warm_job(who, SolverSettings("trap", who.period / STEPS[p], numerics_gate.RELTOL),
                 max(10 * who.discard, 60))
        for p, who in zip(WITH_MEMORY, asked, strict=True)
    ]  # fmt: skip
    found = dict(pool.map(jobs))
    needed = []
    for i, (p, who) in enumerate(zip(WITH_MEMORY, asked, strict=True)):
        read = found[i]
        assert isinstance(read, Read)
        assert read.orbit.response == f"1-{p}-{p}"
        measured = warm(who, read)
        assert measured.gaps[who.discard :].max() < STROBE_TOLERANCE, (p, discarded)
        assert measured.gaps[1] < 0.05, "op-amps that start elsewhere push the states away"
        needed.append(measured.needed)
    assert sum(n > 1 for n in needed) >= 2, "a rung with an orbit of its own has a way to go"


@pytest.mark.slow
def test_a_worker_s_memory_is_flat() -> None:
    who = subject(1)
    sizes = memory(who, SolverSettings("trap", who.period / 200.0), 160)
    # Kept plots would be 120 runs × 1600 points × 7 vectors × 8 bytes = 11 MB.
    assert max(sizes[40:]) - sizes[40] < 3.0
