"""Shapes of a drive, and the flow under one, against samples and an independent integrator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.integrate import solve_ivp

from designer.base.arrays import Array
from designer.dynamics import drive_shape
from designer.dynamics.attractors import settle
from designer.dynamics.drive_shape import SINE, Channel, Shape
from designer.dynamics.drive_states import with_drive_states
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.piecewise_linear import (
    Drive,
    Guard,
    Mode,
    ModeKey,
    PiecewiseLinearSystem,
    SecondDrive,
    motion_of_states,
)
from designer.dynamics.turning_points import heights

SIZES = st.floats(-2.0, 2.0).filter(lambda value: abs(value) > 1e-3)
SHAPES = st.lists(
    st.tuples(st.integers(1, 9), SIZES, SIZES), min_size=1, max_size=5, unique_by=lambda w: w[0]
).map(lambda waves: tuple(sorted(waves)))
TURNS = np.linspace(0.0, 2.0 * np.pi, 200_001)


@pytest.mark.slow
@given(SHAPES)
def test_extremes_are_those_of_a_fine_sample(shape: Shape) -> None:
    wave = drive_shape.wave(shape, TURNS)
    low, high = drive_shape.extremes(shape)
    size = np.abs(wave).max()
    assert low <= wave.min() <= low + 1e-6 * size
    assert high - 1e-6 * size <= wave.max() <= high


@given(SHAPES, st.lists(SIZES | st.just(0.0), min_size=2, max_size=4).filter(any))
def test_forces_of_one_shape_take_one_channel(shape: Shape, sizes: list[float]) -> None:
    waves = {n: np.outer([sine, cosine], sizes) for n, sine, cosine in shape}
    (found,) = made_of(waves)
    assert drive_shape.peak(found.shape) == pytest.approx(1.0)
    assert found.force[int(np.flatnonzero(sizes)[0])] > 0.0


@given(SHAPES, SHAPES, st.lists(st.tuples(SIZES, SIZES), min_size=1, max_size=3))
def test_sums_of_two_shapes_take_two_channels(
    one: Shape, other: Shape, more: list[tuple[float, float]]
) -> None:
    """Two masses have a shape alone, further ones a sum of both."""
    sizes = np.array([(1.0, 0.0), (0.0, 1.0), *more]).T
    waves: dict[int, Array] = {}
    for shape, own in zip((one, other), sizes, strict=True):
        for n, sine, cosine in shape:
            waves[n] = waves.get(n, np.zeros((2, sizes.shape[1]))) + np.outer([sine, cosine], own)
    assert len(made_of(waves)) <= 2


def made_of(waves: dict[int, Array]) -> tuple[Channel, ...]:
    """The channels of these forces, which are their sum."""
    found = drive_shape.channels(waves)
    assert found is not None
    angle = TURNS[::1000]
    sums = sum(np.outer(drive_shape.wave(c.shape, angle), c.force) for c in found)
    basis = [
        np.outer(f(n * angle), row)
        for n in waves
        for f, row in zip((np.sin, np.cos), waves[n], strict=True)
    ]
    whole = sum(basis)
    assert sums == pytest.approx(whole, abs=1e-7 * np.abs(whole).max())
    return found


def test_three_phases_take_four_resistors() -> None:
    """The third phase is a sum of the other two."""
    turns = np.deg2rad([0.0, 120.0, 240.0])
    first, second = made_of({1: np.stack([np.cos(turns), np.sin(turns)])})
    assert first.force == pytest.approx([1.0, 0.0, -1.0])
    assert second.force == pytest.approx([0.0, 1.0, -1.0])


@pytest.mark.parametrize("degree", [1.0, 0.01])
def test_a_pair_that_nearly_cancels_is_not_taken(degree: float) -> None:
    """Two phases that hardly differ would have to make a third one, far from both."""
    turns = np.deg2rad([0.0, degree, 120.0, -120.0])
    for channel in made_of({1: np.stack([np.cos(turns), np.sin(turns)])}):
        assert np.abs(channel.force).max() < 2.0


def test_three_shapes_are_too_many() -> None:
    waves = {n: np.zeros((2, 3)) for n in (1, 2, 3)}
    for k, n in enumerate(waves):
        waves[n][0, k] = 1.0
    assert drive_shape.channels(waves) is None


SHAPE: Shape = ((1, 0.7, -0.4), (2, 0.3, 0.2), (3, 0.0, -0.25))
GAP, STEEP, LEVER = 0.5, 9.0, 0.3
"""Of a stop that moves with the drive."""


def moving_stop() -> PiecewiseLinearSystem:
    """x'' = -x - 0.2 x' + u - 9 max(0, x + 0.3 u - 0.5)."""
    open_ = np.array([[0.0, 1.0], [-1.0, -0.2]])

    def build(key: ModeKey) -> Mode:
        (side,) = key
        A, B, d = open_.copy(), np.array([0.0, 1.0]), np.zeros(2)
        if side:
            A[1, 0] -= STEEP
            B[1] -= STEEP * LEVER
            d[1] += STEEP * GAP
        sign = -1.0 if side else 1.0
        guard = Guard(np.array([sign, 0.0]), sign * LEVER, -sign * GAP, (1 - side,), 0)
        return Mode(A, B, d, (guard,), (side,))

    displacement, velocity = motion_of_states(2, [0])
    return PiecewiseLinearSystem(("x", "v"), build, (0,), ("A",), displacement, velocity)


def by_integrator(drive: Drive, start: Array, times: Array) -> Array:
    def rates(t: float, y: Array) -> list[float]:
        u = drive.offset + drive.amplitude * sum(
            s * np.sin(n * drive.omega * t) + c * np.cos(n * drive.omega * t)
            for n, s, c in drive.shape
        )
        push = STEEP * max(0.0, y[0] + LEVER * u - GAP)
        return [y[1], -y[0] - 0.2 * y[1] + u - push]

    span = (0.0, float(times[-1]))
    found = solve_ivp(rates, span, start, "DOP853", times, rtol=1e-11, atol=1e-12, max_step=0.01)
    return np.asarray(found.y.T)


def test_the_flow_under_a_shape_is_the_integrator_s() -> None:
    """Its stop moves with the drive too: the guards see the shape."""
    drive = Drive(0.9, 1.3, 0.1, SHAPE)
    flow, start = Flow(moving_stop(), drive), np.array([0.2, -0.1])
    assert flow.kernel == "general"
    run = flow.run(start, 3, points=200, measure=True)
    times = np.arange(601) / 200 * drive.period
    wanted = by_integrator(drive, start, times)
    assert np.abs(run.strobes - wanted).max() < 1e-8
    assert run.counts.sum() == 3
    late = flow.to_strobe(wanted[50], 0.5 * np.pi)
    assert np.abs(late.strobes[-1] - wanted[200]).max() < 1e-8


def leaping_stop() -> PiecewiseLinearSystem:
    """The same with a damper in contact, and forces of further waves beside the drive's sine."""
    plain, extra = moving_stop(), np.array([[0.0] * 5, [0.3, -0.2, 0.1, 0.05, 0.2]])

    def build(key: ModeKey) -> Mode:
        mode = plain.build(key)
        return replace(mode, A=mode.A - np.diag([0.0, 0.8 * key[0]]), waves=extra)

    return replace(plain, build=build, continuous=False, orders=(2, 3))


def two_channels() -> PiecewiseLinearSystem:
    """The same with a second drive."""
    plain = moving_stop()

    def build(key: ModeKey) -> Mode:
        return replace(plain.build(key), second=np.array([0.0, 0.5]))

    return replace(plain, build=build)


@pytest.mark.parametrize("points", [1, 7])
@pytest.mark.parametrize(
    ("system", "drive"),
    [
        (moving_stop(), Drive(0.9, 1.3, 0.1, SHAPE)),
        (leaping_stop(), Drive(0.9, 1.3, 0.1)),
        (two_channels(), Drive(0.9, 1.3, 0.1, SHAPE, SecondDrive(0.6, SHAPE[1:]))),
    ],
    ids=["moving stop", "leaping stop", "two channels"],
)
def test_waves_as_states_of_the_fast_path_are_the_general_kernel(
    system: PiecewiseLinearSystem, drive: Drive, points: int
) -> None:
    """Tangents, impacts, extremes and misses too, with stretches that end inside a period."""
    start = np.array([0.2, -0.1])
    flows = [Flow(system, drive, waves=waves) for waves in (True, False)]
    assert [flow.kernel for flow in flows] == ["tabulated", "general"]
    fast, general = (
        flow.run(
            start, 12, points=points, stretches=12 * points - 2, tangent=np.eye(2), measure=True
        )
        for flow in flows
    )
    assert general.counts.sum() > 3
    assert fast.counts.tolist() == general.counts.tolist()
    for name in ("strobes", "tangent", "extremes", "spans", "graze"):
        np.testing.assert_allclose(getattr(fast, name), getattr(general, name), atol=1e-9)
    for name in ("time", "velocity", "state"):
        found, wanted = (getattr(run.impacts, name) for run in (fast, general))
        np.testing.assert_allclose(found, wanted, atol=1e-9)


def test_turning_points_see_the_shape() -> None:
    """Highest point of x + 0.3 u past its stop over an orbit."""
    drive = Drive(0.9, 1.3, 0.1, SHAPE)
    flow = Flow(moving_stop(), drive)
    orbit = settle(flow, np.zeros(2))
    assert orbit.status is OrbitStatus.PERIODIC
    times = np.linspace(0.0, orbit.n * drive.period, 40_001)
    states = by_integrator(drive, orbit.start, times)
    past = states[:, 0] + LEVER * drive.at(drive.omega * times) - GAP
    assert heights(flow, orbit)[-1] == pytest.approx(past.max(), abs=1e-6)


def test_a_shape_as_states_moves_the_same() -> None:
    drive = Drive(0.9, 1.3, 0.1, SHAPE)
    system = moving_stop()
    alone = Flow(with_drive_states(system, drive), replace(drive, amplitude=0.0, shape=SINE))
    start = np.array([0.2, -0.1])
    whole = np.concatenate([start, [0.0, 1.0, 0.0, 1.0, 0.0, 1.0]])
    there = Flow(system, drive).run(start, 2, points=50).strobes
    assert np.abs(alone.run(whole, 2, points=50).strobes[:, :2] - there).max() < 1e-9


def test_a_mirror_image_needs_a_drive_that_turns_over() -> None:
    mirrored = replace(moving_stop(), mirror=-np.eye(2))
    assert (
        Flow(mirrored, Drive(1.0, shape=((1, 0.8, 0.0), (3, 0.2, 0.1)))).system.mirror is not None
    )
    assert Flow(mirrored, Drive(1.0, shape=((1, 0.8, 0.0), (2, 0.2, 0.1)))).system.mirror is None


def test_waves_beside_a_drive_that_is_no_sine_are_refused() -> None:
    with pytest.raises(ValueError, match="no sine"):
        Flow(replace(moving_stop(), orders=(2,)), Drive(1.0, shape=SHAPE))
