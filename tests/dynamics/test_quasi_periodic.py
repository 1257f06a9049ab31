"""Closed curves of strobes, and motions on a torus: maps in closed form, a torus bifurcation, and
an integrator that knows nothing of the package."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from designer.base.arrays import Array
from designer.dynamics.attractors import describe, settle, shoot
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.quasi_periodic import closed_curve
from tests.shared.event_integrator import GROUND, Gap, Mechanism, integrate
from tests.shared.mechanisms import absolute, flow_of

LONG = 3201
GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
STOPPED = Mechanism(
    masses=[1.0, 1.4],
    springs=[(0, GROUND, 1.0), (1, 0, 1.3)],
    dampers=[(0, GROUND, 0.05), (1, 0, 0.05)],
    forces=[1.0, 0.0],
    omega=1.25,
    gaps=[Gap(0, GROUND, upper=((0.2, 8.0),))],
)
"""Its 1-1-0 loses its stability to a torus at ω = 1.2489."""
REST = np.zeros(4)


@cache
def torus(omega: float = 1.25) -> tuple[Flow, Orbit]:
    flow = flow_of(STOPPED, omega)
    return flow, settle(flow, REST)


def turning(rotation: float, bend: float, count: int = LONG) -> Array:
    """Strobes that turn by this on a curve that is no circle, unevenly; in closed form."""
    angle = 2.0 * np.pi * rotation * np.arange(count) + 0.3
    at = angle + bend * np.sin(angle)
    x, y = np.cos(at) + 0.2 * np.cos(2.0 * at), np.sin(at) - 0.3 * np.sin(3.0 * at)
    return np.stack([x, 100.0 + 1e-3 * y, np.full(count, 5.0)], axis=1)


@settings(max_examples=60, deadline=None)
@given(whole=st.integers(2, 90), bend=st.floats(0.0, 0.9))
def test_the_rotation_number_of_a_curve_is_found_to_ten_digits(whole: int, bend: float) -> None:
    rotation = 1.0 / (whole + GOLDEN)
    curve = closed_curve(turning(rotation, bend))
    assert curve is not None
    assert curve.rotation == pytest.approx(rotation, abs=1e-10)
    assert curve.error < 1e-7


def test_the_two_senses_of_turning_are_one() -> None:
    for rotation in (GOLDEN, 1.0 - GOLDEN, 7.0 - GOLDEN):
        curve = closed_curve(turning(rotation, 0.5))
        assert curve is not None
        assert curve.rotation == pytest.approx(1.0 - GOLDEN, abs=1e-11)


@pytest.mark.parametrize("period", [17, 64, 97, 399, 1201])
def test_a_long_period_is_no_torus(period: int) -> None:
    assert closed_curve(turning(round(GOLDEN * period) / period, 0.5)) is None


@pytest.mark.parametrize("fading", [1e-3, 1e-5, 1e-7])
def test_a_spiral_is_no_torus_however_slow(fading: float) -> None:
    slow = (1.0 - fading) ** np.arange(LONG)[:, None]
    strobes = turning(GOLDEN, 0.5)
    middle = strobes.mean(axis=0)
    for factor in (slow, 1.0 / slow):
        assert closed_curve(middle + factor * (strobes - middle)) is None


def test_two_turnings_at_once_are_no_curve() -> None:
    """A torus of three frequencies: strobes fill a surface."""
    strobes = turning(GOLDEN, 0.3) + 0.3 * turning(np.sqrt(2.0), 0.0)[:, [1, 0, 2]]
    assert closed_curve(strobes) is None


def _mapped(step: str, count: int = 24_000) -> Array:
    x = np.empty((count, 2))
    x[0] = 0.5, 0.4
    for k in range(count - 1):
        a, b = x[k]
        x[k + 1] = {
            "henon": (1.0 - 1.4 * a * a + b, 0.3 * a),
            "chaos near a torus": (b, 2.27 * b * (1.0 - a)),
            "eight chaotic bands": (b, 2.25 * b * (1.0 - a)),
            "torus": (b, 2.1 * b * (1.0 - a)),
            "locked, of period 7": (b, 2.2 * b * (1.0 - a)),
        }[step]
    return x[-LONG:]


def test_of_the_delayed_logistic_map_the_torus_alone_is_one() -> None:
    """Aronson and others, Comm. Math. Phys. 83, 1982, 303: a torus from 2 on, locked to 1/7 near
    2.2, chaotic above 2.26."""
    assert closed_curve(_mapped("torus")) is not None
    for other in ("henon", "chaos near a torus", "eight chaotic bands", "locked, of period 7"):
        assert closed_curve(_mapped(other)) is None, other
    noise = np.random.default_rng(1).standard_normal((LONG, 2))
    assert closed_curve(noise) is None


def test_what_stands_still_is_no_torus() -> None:
    assert closed_curve(np.tile([1.0, 2.0], (LONG, 1))) is None
    assert closed_curve(np.zeros((LONG, 2))) is None


# Motions.


def test_a_motion_beside_a_torus_bifurcation_is_quasi_periodic() -> None:
    """It turns once in the time that its strobes take around their middle, counted one by one."""
    flow, orbit = torus()
    assert orbit.response == "quasi-periodic"
    assert (orbit.n, orbit.p, orbit.q, orbit.reason) == (0, 0, 0, "")
    assert abs(orbit.lyapunov) < 4.0 * orbit.lyapunov_error
    assert orbit.frequencies[0] == 1.25
    strobes = flow.run(orbit.start, 8000, mode=orbit.mode).strobes
    off = (strobes - strobes.mean(axis=0)) / np.ptp(strobes, axis=0)
    turned = np.abs(np.diff(np.unwrap(np.arctan2(off[:, 1], off[:, 0])))).sum()
    counted = turned / (2.0 * np.pi * 8000)
    ratio = orbit.frequencies[1] / 1.25
    assert ratio == pytest.approx(counted, abs=1.0 / 8000)


def test_its_strobes_are_those_of_an_integrator_of_newtons_law() -> None:
    flow, orbit = torus()
    run = flow.run(orbit.start, 12, mode=orbit.mode)
    period = flow.drive.period
    y, entries = integrate(STOPPED, absolute(STOPPED, orbit.start)[[0, 1, 2, 3]], 12 * period)
    assert y == pytest.approx(absolute(STOPPED, run.strobes[-1]), abs=1e-8)
    assert len(entries) == run.counts.sum()


def test_at_its_birth_it_turns_by_the_angle_of_the_multipliers() -> None:
    """At a torus bifurcation the rotation number is the angle of the pair that crosses the unit
    circle; beyond it the two part in proportion to the way."""
    off = []
    for omega in (1.2491, 1.2497):
        flow, orbit = torus(omega)
        assert orbit.status is OrbitStatus.QUASI_PERIODIC
        middle = flow.run(orbit.start, 4000, mode=orbit.mode).strobes.mean(axis=0)
        shot = shoot(flow, middle, 1)
        assert shot is not None
        unstable = describe(flow, shot[0], 1, shot[1], laps=1)
        assert 1.0 < unstable.radius < 1.02
        largest = unstable.multipliers[np.argmax(np.abs(unstable.multipliers))]
        angle = abs(float(np.angle(largest))) / (2.0 * np.pi)
        off.append(abs(orbit.frequencies[1] / omega - angle) / (unstable.radius - 1.0))
    assert abs(orbit.frequencies[1] / omega - angle) < 0.02
    assert off[0] == pytest.approx(off[1], rel=0.5)


def test_beside_the_torus_the_motion_is_periodic() -> None:
    assert settle(flow_of(STOPPED, 1.24), REST).response == "1-1-0"
    assert settle(flow_of(STOPPED, 1.28), REST).response == "7-6-0"


@pytest.mark.parametrize(("damping", "status"), [(0.0, "quasi-periodic"), (1e-5, "not settled")])
def test_a_free_motion_that_dies_out_is_no_torus(damping: float, status: str) -> None:
    """x'' + x swings with its own frequency for ever, or for a hundred thousand periods."""
    free = Mechanism([1.0], [(0, GROUND, 1.0)], [(0, GROUND, damping)], [1.0], float(np.sqrt(2.0)))
    orbit = settle(flow_of(free), np.array([0.7, 0.1]))
    assert orbit.response == status
    if not damping:
        assert orbit.frequencies == pytest.approx((np.sqrt(2.0), 1.0), rel=1e-12)


def test_the_second_frequency_is_the_strongest_line_of_the_motion() -> None:
    """Driven far below its own frequency: 3 turns of x'' + 9 x a unit of time, not their part in a
    drive period."""
    free = Mechanism([1.0], [(0, GROUND, 9.0)], [], [1.0], float(np.sqrt(0.7)))
    orbit = settle(flow_of(free), np.array([0.7, 0.1]))
    assert orbit.frequencies == pytest.approx((np.sqrt(0.7), 3.0), rel=1e-10)
    stiff = replace(free, springs=[(0, GROUND, 0.04)])
    orbit = settle(flow_of(stiff), np.array([0.7, 0.1]))
    assert orbit.frequencies == pytest.approx((np.sqrt(0.7), 0.2), rel=1e-10)
