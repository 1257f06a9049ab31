"""n-p-q as text and back, and what mirrors do to it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from designer.dynamics.counts import Counts, read_counts
from designer.dynamics.orbit import Orbit, OrbitStatus, failed

PAIRS = st.lists(st.tuples(st.integers(0, 9999), st.integers(0, 9999)), min_size=1, max_size=4)


@given(st.integers(1, 16), PAIRS)
def test_text_and_back(n: int, pairs: list[tuple[int, int]]) -> None:
    counts = Counts(n, tuple(pairs))
    assert Counts.parse(str(counts)) == counts
    assert read_counts(str(counts)) == counts
    assert counts.family == counts.mirrored.family
    assert counts.mirrored.mirrored == counts


def test_what_is_written() -> None:
    counts = Counts(1, ((2, 3), (0, 1)))
    assert str(counts) == "1-2-3;0-1"
    assert str(counts.mirrored) == "1-3-2;1-0"
    assert str(counts.doubled) == "2-4-6;0-2"
    assert (counts.p, counts.q, counts.total) == (2, 3, 6)
    assert Counts(2, ((2, 3), (0, 1))).rates == (1.0, 1.5, 0.0, 0.5)


@pytest.mark.parametrize(
    "text",
    ["", "1-1", "1-1-1-1", "0-1-1", "17-1-1", "1--1", "-1-1-1", "1-1-1 ", "1.0-1-1", "01-1-1",
     "1-01-1", "a-b-c", "1-1-10000", "\u0661-1-1", "1-1-1\n", "1-1-1;", "1-1-1;1", "1-1-1;1-1-1",
     "1-1-1; 1-1", "1-1-1;01-1"],
)  # fmt: skip
def test_what_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="n-p-q"):
        Counts.parse(text)


@pytest.mark.parametrize("text", ["aperiodic", "not settled", "17-1-1x"])
def test_a_status_has_no_counts(text: str) -> None:
    assert read_counts(text) is None


def test_long_periods_and_many_impacts_are_read_from_a_response() -> None:
    assert read_counts("32-20000-0") == Counts(32, ((20000, 0),))


@pytest.mark.parametrize(
    ("orbit", "countable"),
    [
        (Orbit(OrbitStatus.PERIODIC, n=1), True),
        (Orbit(OrbitStatus.PERIODIC), False),
        (Orbit(OrbitStatus.APERIODIC), True),
        (Orbit(OrbitStatus.APERIODIC, n=-1), False),
        (Orbit(OrbitStatus.PERIODIC, n=1, p=-1), False),
        (Orbit(OrbitStatus.PERIODIC, n=1, p=1_000_000, q=1_000_000), True),
        (Orbit(OrbitStatus.PERIODIC, n=1, q=1_000_001), False),
        (Orbit(OrbitStatus.PERIODIC, n=1, more=((0, 0), (0, -1))), False),
    ],
)
def test_numbers_that_are_stored_may_be_no_counts(orbit: Orbit, countable: bool) -> None:
    assert orbit.countable is countable


def test_an_orbit_that_could_not_be_computed_has_nothing() -> None:
    """Arrays of no entry have the rest of their shape, so that what reads them reads nothing."""
    orbit = failed("why")
    assert orbit.peaks.shape == (0,)
    assert (str(orbit.status), orbit.reason, str(orbit.counts)) == ("failed", "why", "0-0-0")
    pairs = (orbit.extremes, orbit.spans, orbit.speeds, orbit.graze)
    assert [each.shape for each in pairs] == [(0, 2)] * 4
    lists = (orbit.start, orbit.impact_times, orbit.impact_velocities, orbit.impact_sides)
    assert [each.shape for each in (*lists, orbit.impact_clearances, orbit.multipliers)] == [
        (0,)
    ] * 6
    assert (orbit.penetration, orbit.miss) == (math.inf, math.inf)
    assert all(map(math.isnan, (orbit.radius, orbit.asymmetry, orbit.lyapunov)))
    assert orbit.symmetric is None
    assert (orbit.periods, orbit.more, orbit.frequencies, orbit.mode) == (0, (), (), ())


def test_impacts_without_a_clearance_are_of_the_first() -> None:
    orbit = Orbit(OrbitStatus.PERIODIC, n=1, p=1, q=1, impact_sides=np.array([1.0, -1.0]))
    assert orbit.impact_clearances.tolist() == [0, 0]
    second = replace(orbit, impact_clearances=np.array([1, 1]))
    assert second.impact_clearances.tolist() == [1, 1]
