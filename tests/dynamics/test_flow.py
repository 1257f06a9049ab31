"""The exact flow against references that share no code with it (tests/shared/oracles.py)."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st
from scipy.linalg import expm

from designer.base.arrays import Array
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowStatus
from designer.dynamics.piecewise_linear import Drive, Guard, Mode, ModeKey, PiecewiseLinearSystem
from designer.model.clearance import Clearance
from designer.model.mechanics import SecondOrderSystem
from designer.model.model import Dimensionless
from tests.shared.exploring import quick
from tests.shared.oracles import Plain, brute_flow, integrate, response_amplitude

PAPER = Plain(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25)
START = np.array([0.1, -0.2, 0.05, 0.3])


def model_of(p: Plain) -> Dimensionless:
    sides = {(True, True): "both", (True, False): "upper", (False, True): "lower"}
    return Dimensionless(
        p.m, p.k, p.k0, p.c, p.zeta, p.f20, p.b,
        sides=sides[p.upper, p.lower],  # type: ignore[arg-type]
    )  # fmt: skip


def flow_of(p: Plain, omega: float) -> Flow:
    return Flow(model_of(p).second_order().piecewise_linear(), Drive(omega))


def magnification(flow: Flow, x: Array, periods: int) -> float:
    """How much a disturbance at any strobe can have grown at the end, at least 1."""
    one, total = [], np.eye(len(x))
    for _ in range(periods):
        run = flow.run(x, 1, tangent=np.eye(len(x)))
        assert run.tangent is not None
        x = run.strobes[-1]
        one.append(run.tangent)
    worst = 1.0
    for step in reversed(one):
        total = total @ step
        worst = max(worst, float(np.linalg.norm(total, 2)))
    return worst


CASES = [
    pytest.param(PAPER, 1.55, 20, id="paper p=1"),
    pytest.param(PAPER, 1.43, 20, id="paper asymmetric"),
    pytest.param(PAPER, 0.85, 20, id="paper p=2"),
    pytest.param(PAPER, 0.54, 10, id="paper p=3"),
    pytest.param(PAPER, 0.284, 6, id="paper p=6"),
    pytest.param(PAPER, 1.2, 10, id="paper chaos"),
    pytest.param(replace(PAPER, k0=0.0), 1.0, 20, id="no stops"),
    pytest.param(replace(PAPER, k0=0.3), 0.9, 20, id="soft stops"),
    pytest.param(replace(PAPER, k0=0.999), 0.85, 4, id="hard stops"),
    pytest.param(replace(PAPER, zeta=1e-3), 0.95, 10, id="hardly damped"),
    pytest.param(replace(PAPER, zeta=0.9), 0.5, 20, id="overdamped"),
    pytest.param(replace(PAPER, b=1e-3), 0.8, 10, id="tiny clearance"),
    pytest.param(replace(PAPER, b=10.0), 0.8, 20, id="never touched"),
    pytest.param(replace(PAPER, lower=False), 0.7, 20, id="upper stop only"),
    pytest.param(replace(PAPER, upper=False), 0.7, 20, id="lower stop only"),
    pytest.param(replace(PAPER, f20=1.0, m=0.3, k=0.7, c=0.0), 0.9, 20, id="driven at M2"),
    pytest.param(replace(PAPER, f20=0.4, m=0.8, k=0.2, c=0.7), 1.3, 20, id="driven at both"),
]


@pytest.mark.parametrize(("p", "omega", "periods"), quick(CASES, 2))
def test_trajectory_is_that_of_dop853(p: Plain, omega: float, periods: int) -> None:
    """State after many periods, every impact's time, velocity and side."""
    truth = integrate(p, omega, list(START), periods)
    flow = flow_of(p, omega)
    run = flow.run(START, periods, measure=True)
    assert run.status is FlowStatus.DONE
    peak = np.abs(run.strobes).max()
    # The reference is the worse of the two: rtol 1e-12 at each step.
    bound = 2e-11 * magnification(flow, START, periods) * max(peak, 1e-3)
    assert np.abs(run.strobes[-1] - truth.strobes[-1]).max() <= bound
    assert run.impacts.side.tolist() == truth.sides.tolist()
    assert run.counts[:, :, 1].sum() == (truth.sides > 0).sum() if p.k0 else True
    if len(truth.times) and bound < 1e-6:
        # An error of the state moves an impact by error/velocity.
        slowest = np.abs(truth.velocities).min()
        assert np.abs(run.impacts.time - truth.times).max() <= 10 * bound / slowest
        speeds = run.impacts.state[:, 1]
        assert np.abs(speeds - truth.velocities).max() <= 1e3 * bound / slowest + 1e-9
        assert run.impacts.state[:, 0] == pytest.approx(truth.sides * p.b, abs=1e-13)


@settings(max_examples=30)
@given(
    omega=st.floats(0.2, 3.0),
    m=st.floats(0.1, 0.9),
    k=st.floats(0.1, 0.9),
    c=st.floats(0.0, 0.9),
    zeta=st.floats(0.01, 2.0),
    f20=st.floats(0.0, 1.0),
)
def test_steady_state_without_stops_is_the_frequency_response(
    omega: float, m: float, k: float, c: float, zeta: float, f20: float
) -> None:
    p = Plain(m, k, 0.0, c, zeta, f20, 1.0)
    X = response_amplitude(p, omega)
    phases = omega * np.arange(9) * (2.0 * np.pi / omega / 8)
    turn = np.exp(1j * phases)
    want = np.stack(
        [(X[0] * turn).imag, (1j * omega * X[0] * turn).imag, (X[1] * turn).imag,
         (1j * omega * X[1] * turn).imag], axis=1,
    )  # fmt: skip
    run = flow_of(p, omega).run(want[0], 1, points=8, measure=True)
    scale = np.abs(X).max() * max(omega, 1.0)
    assert np.abs(run.strobes - want).max() <= 1e-12 * scale
    assert run.extremes[[0, 2], 1] == pytest.approx(np.abs(X), rel=1e-11)
    assert run.extremes[[0, 2], 0] == pytest.approx(-np.abs(X), rel=1e-11)


def test_transient_without_stops_is_the_matrix_exponential() -> None:
    """Homogeneous part by expm, forced part by the frequency response."""
    p, omega = replace(PAPER, k0=0.0, zeta=0.05), 0.77
    X = response_amplitude(p, omega)
    forced = np.array([X[0].imag, (1j * omega * X[0]).imag, X[1].imag, (1j * omega * X[1]).imag])
    A = model_of(p).second_order().state_matrix()
    want = expm(A * 3 * 2.0 * np.pi / omega) @ (START - forced) + forced
    assert flow_of(p, omega).run(START, 3).strobes[-1] == pytest.approx(want, abs=1e-13)


@pytest.mark.parametrize("omega", [1.55, 0.85, 0.41])
def test_tangent_is_the_derivative_of_the_map(omega: float) -> None:
    flow = flow_of(PAPER, omega)
    x = flow.run(START, 30).strobes[-1]
    run = flow.run(x, 2, tangent=np.eye(4))
    assert run.tangent is not None
    h = 1e-6
    for j in range(4):
        step = h * np.eye(4)[j]
        difference = flow.run(x + step, 2).strobes[-1] - flow.run(x - step, 2).strobes[-1]
        assert run.tangent[:, j] == pytest.approx(difference / (2 * h), abs=2e-8)
    some = np.array([[1.0, -2.0], [0.5, 0.0], [3.0, 1.0], [0.0, 1.0]])
    carried = flow.run(x, 2, tangent=some).tangent
    assert carried == pytest.approx(run.tangent @ some, abs=1e-14)
    assert np.array_equal(some[0], [1.0, -2.0]), "the caller's array was overwritten"


@pytest.mark.parametrize("omega", [1.2, 0.85, 0.24])
@pytest.mark.parametrize("points", [2, 7, 64])
def test_more_points_pass_through_the_same_strobes(omega: float, points: int) -> None:
    flow = flow_of(PAPER, omega)
    coarse, fine = flow.run(START, 4, measure=True), flow.run(START, 4, measure=True, points=points)
    bound = 1e-13 * magnification(flow, START, 4)
    assert np.abs(fine.strobes[::points] - coarse.strobes).max() <= bound
    assert fine.counts.sum(axis=0).tolist() == coarse.counts.sum(axis=0).tolist()
    assert fine.impacts.time == pytest.approx(coarse.impacts.time, abs=1e3 * bound)
    assert fine.extremes == pytest.approx(coarse.extremes, abs=1e2 * bound)
    assert fine.miss == pytest.approx(coarse.miss, abs=1e2 * bound)
    assert fine.penetration == pytest.approx(coarse.penetration, abs=1e2 * bound)


def test_a_run_in_pieces_is_the_run_in_one() -> None:
    flow = flow_of(PAPER, 0.54)
    whole = flow.run(START, 9)
    x, mode, counts = START, None, []
    for periods in (1, 3, 5):
        run = flow.run(x, periods, mode=mode)
        x, mode = run.strobes[-1], run.mode
        counts += run.counts.tolist()
    assert x == pytest.approx(whole.strobes[-1], abs=1e-12)
    assert mode == whole.mode
    assert counts == whole.counts.tolist()


def test_extremes_are_at_least_those_of_a_dense_trace() -> None:
    for omega in (1.55, 0.85, 0.24):
        flow = flow_of(PAPER, omega)
        refined = flow.run(START, 3, measure=True).extremes
        trace = flow.run(START, 3, points=5000).strobes
        dense = np.stack([trace.min(axis=0), trace.max(axis=0)], axis=1)
        assert (refined[:, 0] <= dense[:, 0] + 1e-13).all()
        assert (refined[:, 1] >= dense[:, 1] - 1e-13).all()
        # Beyond the nearest sample by at most half a step's curvature (kinks included).
        assert refined == pytest.approx(dense, abs=1e-4)


def test_penetration_and_miss_against_a_dense_trace() -> None:
    flow = flow_of(PAPER, 0.54)
    x = flow.run(np.zeros(4), 200).strobes[-1]
    run = flow.run(x, 1, measure=True)
    x1 = flow.run(x, 1, points=200_000).strobes[:, 0]
    inside = (x1[1:-1] >= x1[:-2]) & (x1[1:-1] > x1[2:])
    tops = np.concatenate(
        [x1[1:-1][inside], -x1[1:-1][(x1[1:-1] <= x1[:-2]) & (x1[1:-1] < x1[2:])]]
    )
    assert run.penetration == pytest.approx(tops[tops > 0.25].min() - 0.25, abs=1e-8)
    short = tops[tops < 0.25]
    if len(short):
        assert run.miss == pytest.approx(0.25 - short.max(), abs=1e-8)
    else:
        assert run.miss == math.inf


# Grazing: the clearance is put a hair's breadth below or above a known local maximum.


@pytest.mark.parametrize("omega", [1.55, 0.85, 0.337])
@pytest.mark.parametrize("hair", [1e-5, 1e-7, 1e-9, 1e-11])
@pytest.mark.parametrize("sides", ["upper", "lower", "both"])
def test_grazing_contacts_are_found_and_misses_are_not(
    omega: float, hair: float, sides: str
) -> None:
    """b = (first local maximum of the free motion) ∓ hair · peak: one double crossing, or none."""
    free = replace(PAPER, k0=0.0)
    start = np.array([0.0, 0.3, 0.1, 0.0]) * (1.0 if sides != "lower" else -1.0)
    sign = 1.0 if sides != "lower" else -1.0
    if sides == "lower":
        # u → -u by starting half a period on: use the mirror image with an inverted drive.
        flow_free = Flow(model_of(free).second_order().piecewise_linear(), Drive(omega, -1.0))
    else:
        flow_free = flow_of(free, omega)
    extremes = flow_free.run(start, 1, measure=True).extremes[0]
    peak = float(extremes[1] if sign > 0 else -extremes[0])
    assert peak > abs(start[0])
    found = {}
    for what, b in (("hit", peak * (1.0 - hair)), ("miss", peak * (1.0 + hair))):
        p = replace(PAPER, b=b, upper=sides != "lower", lower=sides == "lower")
        flow = Flow(model_of(p).second_order().piecewise_linear(), flow_free.drive)
        found[what] = flow.run(start, 1, measure=True)
    side = 1 if sign > 0 else 0
    assert found["hit"].counts[0, 0, side] >= 1
    assert found["hit"].penetration <= 1.01 * hair * peak + 1e-15
    assert found["hit"].penetration >= 0.5 * hair * peak
    assert found["miss"].counts.sum() == 0
    assert found["miss"].miss == pytest.approx(hair * peak, rel=1e-3, abs=1e-15)


# General systems: random matrices, several clearances, drives in the guards.


def random_chain(rng: np.random.Generator, masses: int, stops: int) -> PiecewiseLinearSystem:
    links = rng.uniform(0.3, 3.0, masses)
    stiffness = np.diag(links + np.concatenate([links[1:], [0.0]]))
    damping = np.zeros((masses, masses))
    for i in range(1, masses):
        stiffness[i, i - 1] = stiffness[i - 1, i] = -links[i]
    damping += 0.1 * stiffness
    sides = ["both", "upper", "lower"]
    return SecondOrderSystem(
        mass=rng.uniform(0.5, 2.0, masses),
        damping=damping,
        stiffness=stiffness,
        force=rng.uniform(-1.0, 1.0, masses),
        clearances=tuple(
            Clearance.even(
                int(rng.integers(masses)),
                float(rng.uniform(0.5, 30.0)),
                float(rng.uniform(0.05, 0.5)),
                sides[int(rng.integers(3))],  # type: ignore[arg-type]
                f"A{number}",
            )
            for number in range(stops)
        ),
    ).piecewise_linear()


@pytest.mark.slow
@settings(max_examples=8)
@given(seed=st.integers(0, 10**6), masses=st.integers(1, 3), stops=st.integers(1, 3))
def test_chains_with_several_clearances(seed: int, masses: int, stops: int) -> None:
    rng = np.random.default_rng(seed)
    system = random_chain(rng, masses, stops)
    drive = Drive(float(rng.uniform(0.4, 2.0)), float(rng.uniform(0.5, 2.0)), 0.1)
    x = rng.uniform(-0.04, 0.04, 2 * masses)
    flow = Flow(system, drive)
    run = flow.run(x, 4, measure=True)
    assume(min(run.penetration, run.miss) > 1e-4)  # the reference is blind to grazing
    truth = brute_flow(
        system.build, system.start, (drive.omega, drive.amplitude, drive.offset), x, 4, 1000
    )
    bound = 1e-12 * magnification(flow, x, 4) * max(1.0, float(np.abs(truth.strobes).max()))
    assert np.abs(run.strobes - truth.strobes).max() <= bound
    logged = list(zip(run.impacts.clearance.tolist(), run.impacts.side.tolist(), strict=True))
    assert logged == [(c, s) for _, c, s in truth.entries]
    assert run.impacts.time == pytest.approx([t for t, _, _ in truth.entries], abs=1e4 * bound)


def random_limiter(rng: np.random.Generator, n: int) -> PiecewiseLinearSystem:
    """x' = A x + B u + d + w·clip(c·x + D u + e, low, high): guards see the drive, constants."""
    A = rng.standard_normal((n, n))
    A -= (np.linalg.eigvals(A).real.max() + 0.3) * np.eye(n)
    B, d, w = (rng.standard_normal(n) for _ in range(3))
    c, D, e = rng.standard_normal(n), float(rng.normal()), float(0.2 * rng.normal())
    low, high = -float(rng.uniform(0.1, 1.0)), float(rng.uniform(0.1, 1.0))

    def build(key: ModeKey) -> Mode:
        (position,) = key
        if position == 0:
            up, down = Guard(c, D, e - high, (1,)), Guard(-c, -D, low - e, (-1,))
            return Mode(A + np.outer(w, c), B + w * D, d + w * e, (up, down), ())
        limit = high if position > 0 else low
        back = Guard(-position * c, -position * D, position * (limit - e), (0,))
        return Mode(A, B, d + w * limit, (back,), ())

    return PiecewiseLinearSystem(tuple(f"x{i}" for i in range(n)), build, (0,), (), (), ())


@pytest.mark.slow
@settings(max_examples=15)
@given(seed=st.integers(0, 10**6), n=st.sampled_from((2, 4, 6)))
def test_limiters_that_see_the_drive(seed: int, n: int) -> None:
    """Sizes that the other tests have too: the fast path is compiled for each anew."""
    follows_the_reference(seed, n)


@pytest.mark.slow
@settings(max_examples=15)
@given(seed=st.integers(0, 10**6))
def test_an_odd_number_of_states(seed: int) -> None:
    """The least there can be: each size is compiled anew."""
    follows_the_reference(seed, 1)


def follows_the_reference(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    system = random_limiter(rng, n)
    drive = Drive(float(rng.uniform(0.5, 3.0)), float(rng.uniform(0.3, 2.0)), float(rng.normal()))
    x = 0.1 * rng.standard_normal(n)
    flow = Flow(system, drive)
    run = flow.run(x, 3)
    assert run.status is FlowStatus.DONE
    key = system.mode_at(x, drive.offset)
    truth = brute_flow(system.build, key, (drive.omega, drive.amplitude, drive.offset), x, 3, 1500)
    scale = max(1.0, float(np.abs(truth.strobes).max()))
    # A double crossing that the reference does not see leaves less than this behind.
    assert np.abs(run.strobes - truth.strobes).max() <= 1e-9 * scale


def test_modes_are_built_when_entered_and_once() -> None:
    built: list[ModeKey] = []
    system = model_of(PAPER).second_order().piecewise_linear()
    inner = system.build

    def build(key: ModeKey) -> Mode:
        built.append(key)
        return inner(key)

    system.build = build
    flow = Flow(system, Drive(1.55))
    flow.run(np.zeros(4), 1, points=50)
    assert built[0] == (0,)
    flow.run(np.zeros(4), 20)
    assert sorted(built) == [(-1,), (0,), (1,)]
    assert system.built == 3


# The code for two masses is compiled for many other tests.
@pytest.mark.parametrize(("masses", "seed"), quick([(2, 6), (3, 4)]))
def test_many_modes_grow_the_tables(masses: int, seed: int) -> None:
    """Three clearances on one chain: more modes than the tables begin with."""
    system = random_chain(np.random.default_rng(seed), masses, 3)
    flow = Flow(system, Drive(0.7, 3.0))
    run = flow.run(np.zeros(2 * masses), 30)
    again = Flow(system, Drive(0.7, 3.0)).run(np.zeros(2 * masses), 30)
    assert system.built > 4
    assert np.array_equal(run.strobes, again.strobes)


def test_chatter_ends_with_a_status() -> None:
    flow = flow_of(PAPER, 0.215)
    run = flow.run(np.zeros(4), 20, max_events=3)
    assert run.status is FlowStatus.CHATTER
    assert len(run.strobes) < 21
    assert np.all(np.isfinite(run.strobes))
    assert len(run.counts) == len(run.strobes) - 1


def test_growth_without_bound_ends_with_a_status() -> None:
    system = SecondOrderSystem(
        np.array([1.0]), np.array([[-1.0]]), np.array([[1.0]]), np.array([1.0]), ()
    ).piecewise_linear()
    assert Flow(system, Drive(1.0)).run(np.array([0.1, 0.0]), 50).status is FlowStatus.DIVERGED


def test_rest_without_drive_stays_at_rest() -> None:
    system = model_of(PAPER).second_order().piecewise_linear()
    run = Flow(system, Drive(1.0, 0.0)).run(np.zeros(4), 5, measure=True)
    assert not run.strobes.any()
    assert run.counts.sum() == 0


@pytest.mark.parametrize("side", [1, -1])
def test_a_start_inside_a_stop_is_in_contact(side: int) -> None:
    start = np.array([side * 0.3, 0.0, 0.0, 0.0])
    truth = integrate(PAPER, 0.85, list(start), 3)
    run = flow_of(PAPER, 0.85).run(start, 3, measure=True)
    assert run.strobes[-1] == pytest.approx(truth.strobes[-1], abs=1e-10)
    assert run.impacts.side.tolist() == truth.sides.tolist(), "the running contact is no entry"


def test_the_mirror_image_of_a_trajectory_is_a_trajectory() -> None:
    system = model_of(PAPER).second_order().piecewise_linear()
    assert system.mirror is not None
    a = Flow(system, Drive(0.85)).run(START, 5, measure=True)
    b = Flow(system, Drive(0.85, -1.0)).run(system.mirror @ START, 5, measure=True)
    assert np.array_equal(a.strobes, -b.strobes)
    assert np.array_equal(a.counts, b.counts[:, :, ::-1])
    one_sided = model_of(replace(PAPER, lower=False)).second_order().piecewise_linear()
    assert one_sided.mirror is None


def test_seconds_and_volts_do_not_matter() -> None:
    """A system in other units (T = s t, v = r x) is the same trajectory: no absolute tolerances."""
    inner = model_of(PAPER).second_order().piecewise_linear()
    seconds, volts = 1e-4, 1e3

    def build(key: ModeKey) -> Mode:
        m = inner.build(key)
        guards = tuple(replace(g, e=g.e * volts) for g in m.guards)
        return Mode(m.A / seconds, m.B * volts / seconds, m.d * volts / seconds, guards, m.sides)

    system = replace(inner, build=build, _modes={})
    a = Flow(inner, Drive(0.54)).run(START, 10, measure=True)
    b = Flow(system, Drive(0.54 / seconds)).run(START * volts, 10, measure=True)
    assert b.strobes / volts == pytest.approx(a.strobes, abs=1e-12)
    assert b.counts.tolist() == a.counts.tolist()
    assert b.impacts.time / seconds == pytest.approx(a.impacts.time, rel=1e-10)
    assert b.penetration / volts == pytest.approx(a.penetration, rel=1e-8)


@pytest.mark.parametrize("turns", [-1, 0, 1, 2])
def test_the_way_to_the_strobe_is_the_same_after_whole_turns(turns: int) -> None:
    flow = flow_of(PAPER, 0.85)
    quarters = flow.run(START, 1, points=4).strobes
    late = flow.to_strobe(quarters[1], (0.5 + 2.0 * turns) * np.pi)
    assert late.strobes[-1] == pytest.approx(quarters[-1], abs=1e-10)
