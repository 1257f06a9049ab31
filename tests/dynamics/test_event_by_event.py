"""The exact flow of random mechanisms against an integrator that is restarted at every event.

Every element there is: springs, dampers, constant forces, a moving ground with stops that move with
it or not, gaps to ground and between masses, unequal and preloaded sides, stops that stiffen in
steps, dampers and preloads in contact.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from designer.dynamics.flow_result import FlowStatus
from tests.shared.event_integrator import GROUND, Gap, Mechanism, integrate
from tests.shared.mechanisms import absolute, flow_of

PERIODS = 2
CLEAR = 1e-3
"""Contacts shallower and misses nearer than this are left to the tests of grazing."""

number = st.integers(0, 1000).map(lambda k: k / 1000.0)
"""In [0, 1]; a whole number of thousandths, so that a failure shrinks to something to look at."""


@st.composite
def stops(draw: st.DrawFn, least: float) -> tuple[tuple[float, float], ...]:
    """The springs of a stop whose gap is above ``least``."""
    place = least + 0.05 + 0.6 * draw(number)
    out = []
    for _ in range(draw(st.integers(1, 3))):
        out.append((place, 2.0 + 20.0 * draw(number)))
        place += 0.05 + 0.2 * draw(number)
    return tuple(out)


@st.composite
def gaps(draw: st.DrawFn, masses: int) -> Gap:
    a = draw(st.integers(0, masses - 1))
    b = draw(st.sampled_from([GROUND, *(k for k in range(masses) if k != a)]))
    sides = draw(st.sampled_from(["both", "upper", "lower"]))
    first = draw(stops(-0.3))
    second = draw(stops(max(-first[0][0], -0.3)))
    damping = draw(st.sampled_from([0.0, 0.3]))
    upper = () if sides == "lower" else first
    lower = {"both": second, "upper": (), "lower": first}[sides]
    preload = draw(st.sampled_from([0.0, 0.2]))
    return Gap(a, b, upper, lower, damping, preload)


@st.composite
def mechanisms(draw: st.DrawFn) -> Mechanism:
    n = draw(st.integers(1, 3))
    links = [(k, k - 1 if k else GROUND) for k in range(n)] + [(n - 1, GROUND)]
    fixed = draw(st.booleans())
    few = draw(st.lists(gaps(n), max_size=2))
    assume(_apart(few))
    return Mechanism(
        masses=[0.5 + draw(number) for _ in range(n)],
        springs=[(a, b, 0.3 + 2.0 * draw(number)) for a, b in links],
        dampers=[(a, b, 0.05 + 0.3 * draw(number)) for a, b in links],
        forces=[2.0 * draw(number) - 0.5 for _ in range(n)],
        omega=0.5 + 2.0 * draw(number),
        gaps=few,
        constants=[draw(number) - 0.5 for _ in range(n)],
        base=draw(st.sampled_from([0.0, 0.3])),
        fixed_stops=fixed,
    )


def _apart(some: list[Gap]) -> bool:
    """Whether no two springs begin at one place: SciPy tells one of two events at the same time."""
    places = sorted(
        (min(g.mass, g.other), max(g.mass, g.other), side * place * (1 if g.mass > g.other else -1))
        for g in some
        for side, _, place, _ in g.thresholds
    )
    return all(a[:2] != b[:2] or b[2] - a[2] > CLEAR for a, b in itertools.pairwise(places))


def compare(system: Mechanism, seed: int) -> None:
    """Every contact of every clearance, and where it ends, from a random start."""
    flow = flow_of(system)
    start = np.random.default_rng(seed).uniform(-1.0, 1.0, flow.system.size)
    run = flow.run(start, PERIODS, measure=True)
    assert run.status is FlowStatus.DONE
    assume(min(run.penetration, run.miss) > CLEAR)
    met, end = run.impacts, PERIODS * flow.drive.period
    y, entries = integrate(system, absolute(system, start), end)
    if len(entries) < len(met.time):  # a way off the stop that is shorter than a step
        y, entries = integrate(system, absolute(system, start), end, shorter=30.0)
    for k in range(len(system.gaps)):
        own, theirs = met.clearance == k, [e for e in entries if e.gap == k]
        assert met.side[own].tolist() == [e.side for e in theirs]
        assert met.time[own] == pytest.approx([e.time for e in theirs], abs=1e-8)
        assert met.velocity[own] == pytest.approx([e.velocity for e in theirs], abs=1e-8)
    assert absolute(system, run.strobes[-1]) == pytest.approx(y, abs=1e-8)


SEEDS = st.integers(0, 2**32 - 1)


@settings(max_examples=10)
@given(mechanisms(), SEEDS)
def test_every_event(system: Mechanism, seed: int) -> None:
    compare(system, seed)


@pytest.mark.slow
@settings(max_examples=150)
@given(mechanisms(), SEEDS)
def test_every_event_of_many(system: Mechanism, seed: int) -> None:
    compare(system, seed)
