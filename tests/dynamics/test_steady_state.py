"""Steady motions by the compiled engine: against the general flow, and against integration."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.integrate import solve_ivp

from designer.base.arrays import Array
from designer.dynamics import attractors, modal_tables, steady_state
from designer.dynamics.counts import MAX_PERIOD
from designer.dynamics.flow import MAX_EVENTS, Flow
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.dynamics.steady_state import (
    DrivenSystem,
    SteadyMotion,
    TransientSettings,
    by_flow,
    exponents,
)
from designer.kernels import kernel_algebra, kernel_orbit, kernel_sweep
from designer.kernels.kernel_modal import CHANGE, WIDTH
from designer.model.model import Dimensionless
from designer.model.model_file import parse_model_file
from designer.model.swept_model import ModalBatch, ModelSubject
from tests.dynamics.test_modal_tables import PAPER, cases
from tests.shared.exploring import quick
from tests.shared.oracles import Plain
from tests.shared.system_text import clearance, system_text, table

PLAIN = Plain(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25)
PERIODIC = (1.55, 1.43, 0.85, 0.54, 0.41, 0.337, 0.284, 0.24, 0.215, 0.3, 0.1, 1.085, 0.7)
CHAOTIC = (1.0, 1.2, 0.95, 0.6, 0.66, 0.48)


def setting(omega: float, model: Dimensionless = PAPER) -> DrivenSystem:
    (made,) = ModelSubject(model).settings([{"omega": omega}])
    assert made.tables is not None
    return made


def flow(omega: float, model: Dimensionless = PAPER) -> Flow:
    return Flow(model.second_order().piecewise_linear(), Drive(omega), fast=False)


def exact(omega: float, x: Array) -> tuple[Array, float, float]:
    """State and least x1 after one period from x, and the growth of a tangent vector, by DOP853."""
    v = np.array([0.5, -0.3, 0.7, 0.4])

    def rhs(t: float, z: Array) -> list[float]:
        side = PLAIN.side_of(z[0])
        dx = PLAIN.rhs(t, z[:4], omega, side)
        base = PLAIN.rhs(t, np.zeros(4), omega, side)
        free = PLAIN.rhs(t, z[4:], omega, side)
        return [*dx, *(np.array(free) - base)]

    period = 2.0 * math.pi / omega
    found = solve_ivp(
        rhs,
        (0.0, period),
        np.concatenate([x, v]),
        method="DOP853",
        rtol=1e-11,
        atol=1e-13,
        max_step=period / 2000,
        dense_output=True,
    )
    assert found.sol is not None
    x1 = found.sol(np.linspace(0.0, period, 40001))[0]
    end = found.y[:, -1]
    return end[:4], float(x1.min()), float(np.linalg.norm(end[4:]) / np.linalg.norm(v))


@settings(max_examples=60, deadline=None)
@given(st.lists(cases(), min_size=2, max_size=4))
def test_tables_in_batches_equal_those_of_one(
    chosen: list[tuple[Dimensionless, float, int]],
) -> None:
    models, omegas = [c[0] for c in chosen], [c[1] for c in chosen]
    for model, omega, got in zip(models, omegas, ModalBatch().tables(models, omegas), strict=True):
        want = modal_tables.tables(model.second_order().piecewise_linear(), Drive(omega))
        assert (want is None) == (got is None)
        if want is None or got is None:
            continue
        exists = [0] + [1] * (model.sides != "lower") + [2] * (model.sides != "upper")
        for m in exists:
            a = want.data[m * WIDTH : (m + 1) * WIDTH]
            c = got.data[m * WIDTH : (m + 1) * WIDTH]
            keep = np.isfinite(a)
            for gone in {0, 1, 2} - set(exists):
                keep[CHANGE + 28 * gone : CHANGE + 28 * gone + 28] = False
            np.testing.assert_array_equal(a[~np.isfinite(a)], c[~np.isfinite(a)])
            size = np.abs(a[keep]) + 1e-9 * np.median(np.abs(a[keep]))
            assert (np.abs(a[keep] - c[keep]) <= 1e-9 * size + 1e-13).all()


def test_the_longest_period_is_that_of_the_definitions() -> None:
    assert kernel_orbit.MAX_PERIOD == MAX_PERIOD


@pytest.mark.parametrize("seed", range(8))
def test_linear_algebra_of_size_four(seed: int) -> None:
    rng = np.random.default_rng(seed)
    M, r = rng.standard_normal((4, 4)), rng.standard_normal(4)
    want = float(np.abs(np.linalg.eigvals(M)).max())
    radius, factor, substitute = (
        getattr(kernel_algebra, name).py_func
        for name in ("spectral_radius", "factor", "substitute")
    )
    assert radius(M, 48) == pytest.approx(want, rel=1e-12)
    assert radius(M, 5) == pytest.approx(want, rel=0.2)
    assert radius(np.diag([0.5, -0.9, 0.0, 0.1]), 48) == pytest.approx(0.9, rel=1e-12)
    assert radius(np.zeros((4, 4)), 48) == 0.0
    factors, order, x = M.copy(), np.zeros(4, dtype=np.int64), np.zeros((4, 1))
    assert factor(factors, order) > 0.0
    substitute(factors, order, r[:, None], x)
    np.testing.assert_allclose(M @ x[:, 0], r, atol=1e-9)
    assert factor(np.ones((4, 4)), order) == 0.0


@pytest.mark.parametrize("omega", quick([1.55, 0.85, 0.54, 0.215, 1.0, 0.6]))
def test_least_displacement_and_exponent_against_integration(omega: float) -> None:
    """One period from an arbitrary point of the attractor, chaotic ones too."""
    x = setting(omega).steady(np.zeros(4), TransientSettings(100, 16, 0)).end
    end, low, growth = exact(omega, x)
    once = setting(omega).steady(x, TransientSettings(0, 1, 0))
    np.testing.assert_allclose(once.end, end, atol=2e-7)
    assert once.minima[0] == pytest.approx(low, abs=1e-6)
    tables = setting(omega).tables
    assert tables is not None
    driven = kernel_sweep.DrivenModel(tables, 2 * np.pi / omega, MAX_EVENTS)
    v = np.array([[0.5], [-0.3], [0.7], [0.4]])
    carried = flow(omega).run(x, 1, tangent=v).tangent
    assert carried is not None
    assert np.linalg.norm(carried) / np.linalg.norm(v) == pytest.approx(growth, rel=1e-4)
    # and the kernel's own exponent over many periods is the flow's
    (mine,) = exponents(driven, x.copy(), 1)  # the first ten periods do not count
    start = flow(omega).run(x, 10, tangent=v)
    assert start.tangent is not None
    last = flow(omega).run(start.strobes[-1], 5, tangent=start.tangent)
    assert last.tangent is not None
    want = math.log(np.linalg.norm(last.tangent) / np.linalg.norm(start.tangent)) / 5
    assert mine == pytest.approx(want, abs=1e-4)


def _alike(a: SteadyMotion, b: SteadyMotion, tolerance: float) -> None:
    np.testing.assert_allclose(a.minima, b.minima, atol=tolerance)
    np.testing.assert_allclose(a.velocities, b.velocities, atol=tolerance)
    np.testing.assert_allclose(a.end, b.end, atol=tolerance)


@pytest.mark.parametrize("omega", PERIODIC)
def test_periodic_motions_equal_the_slow_version(omega: float) -> None:
    course = TransientSettings(500, 30)
    fast, slow = (
        setting(omega).steady(np.zeros(4), course),
        by_flow(flow(omega), np.zeros(4), course),
    )
    assert fast.status is slow.status is OrbitStatus.PERIODIC
    assert (fast.response, fast.symmetric) == (slow.response, slow.symmetric)
    assert fast.radius == pytest.approx(slow.radius, abs=1e-6)
    assert fast.lyapunov == pytest.approx(slow.lyapunov, rel=1e-5, abs=1e-6)
    assert fast.lyapunov < 0.0
    _alike(fast, slow, 1e-6)


@pytest.mark.parametrize("omega", CHAOTIC)
def test_chaos_shows_the_slow_version_for_a_while(omega: float) -> None:
    x = setting(omega).steady(np.zeros(4), TransientSettings()).end
    _alike(
        setting(omega).steady(x, TransientSettings(0, 5, 0)),
        by_flow(flow(omega), x, TransientSettings(0, 5, 0)),
        1e-8,
    )
    motion = setting(omega).steady(x, TransientSettings())
    assert motion.status is OrbitStatus.APERIODIC
    assert motion.lyapunov * 2 * np.pi / omega > 0.3


@pytest.mark.parametrize("omega", [0.625734293717487, 0.38073229291716687])
def test_long_periods_are_found_by_both_engines(omega: float) -> None:
    fast = setting(omega).steady(np.zeros(4), TransientSettings())
    slow = by_flow(flow(omega), np.zeros(4), TransientSettings())
    assert fast.response == slow.response == attractors.settle(flow(omega), np.zeros(4)).response
    assert fast.n > MAX_PERIOD
    hurried = setting(omega).steady(np.zeros(4), TransientSettings(patience=0))
    assert hurried.status is OrbitStatus.NOT_SETTLED


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(st.floats(0.12, 1.8))
def test_names_what_settling_names(omega: float) -> None:
    """Wherever a motion is periodic, settling from where it is says the same; a motion called
    aperiodic is not periodic by settling either."""
    seen = setting(omega).steady(np.zeros(4), TransientSettings())
    orbit = attractors.settle(flow(omega), seen.end)
    if seen.status is OrbitStatus.PERIODIC:
        assert (orbit.response, orbit.symmetric) == (seen.response, seen.symmetric)
        assert abs(orbit.radius - seen.radius) < 1e-6
    elif orbit.status is OrbitStatus.PERIODIC:
        # It was on a chaotic transient: later it is periodic, and so it is here.
        assert seen.status in (OrbitStatus.APERIODIC, OrbitStatus.NOT_SETTLED)
        later = setting(omega).steady(orbit.start, TransientSettings(50, 30))
        assert later.response == orbit.response


@pytest.mark.parametrize(
    ("settled", "shown"),
    [
        (OrbitStatus.PERIODIC, "1-1-1"),
        (OrbitStatus.GRAZING, "1-1-1"),  # as it was run, as in the compiled engine
        (OrbitStatus.CLIPPED, "clipped"),
        (OrbitStatus.NOT_SETTLED, "not settled"),
    ],
)
def test_only_periodic_motions_are_counted(
    settled: OrbitStatus, shown: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    orbit = replace(attractors.settle(flow(1.55), np.zeros(4)), status=settled)
    monkeypatch.setattr(steady_state, "settle", lambda *_, **__: orbit)
    got = by_flow(flow(1.55), orbit.start, TransientSettings(4, 2))
    assert got.response == shown
    if shown == "1-1-1":
        assert (got.n, got.p, got.q, got.symmetric) == (1, 1, 1, True)
    else:
        assert (got.n, got.p, got.q, got.symmetric) == (0, 0, 0, None)
        assert math.isnan(got.radius)


def test_one_sided_and_free_models() -> None:
    upper = Dimensionless(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.1, sides="upper")
    got = setting(1.2, upper).steady(np.zeros(4), TransientSettings())
    orbit = attractors.settle(flow(1.2, upper), got.end)
    assert got.response == orbit.response
    assert got.q == 0
    free = Dimensionless(m=0.5, k=0.5, k0=0.0, c=0.5, zeta=0.1, f20=0.0, b=0.1)
    (linear,) = ModelSubject(free).settings([{"omega": 1.2}])
    assert linear.tables is None  # by the general flow
    motion = linear.steady(np.zeros(4), TransientSettings(200, 16))
    assert (motion.response, motion.symmetric) == ("1-0-0", True)
    assert len(motion.velocities) == 0
    assert np.ptp(motion.minima) < 1e-9


def test_all_impacts_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Room grows to what is met: chattering has more impacts than are allowed for."""
    monkeypatch.setattr(steady_state, "ROOM", 1)
    got = setting(0.215).steady(np.zeros(4), TransientSettings(40, 3, 0))
    run = flow(0.215).run(np.zeros(4), 43, measure=True)
    shown = (run.impacts.time > 40 * 2 * np.pi / 0.215) & (run.impacts.side > 0)
    assert len(got.velocities) == shown.sum() > 3
    np.testing.assert_allclose(got.velocities, run.impacts.state[shown, 1], atol=1e-8)


@pytest.mark.slow
def test_chaos_that_fades_while_its_exponent_is_taken_is_a_transient() -> None:
    """Beyond the grazing of its linear orbit a press is chaotic for hundreds of periods, then
    settles on that orbit, whose closed form is the oscillator's steady state."""
    mass, damping, stiffness, force, omega = 1.2, 9.0, 4e3, 12.0, 127.0
    press = parse_model_file(
        system_text(
            {"ram": mass},
            {("ram", "ground"): stiffness},
            {("ram", "ground"): damping},
            clearance(
                "stops", "ram", "ground", upper=0.8e-3, lower=1.5e-3,
                upper_stiffness=40e3, lower_stiffness=6e3,
            ),
            table("force", on="ram", amplitude=force),
        )
    ).model.second_order().piecewise_linear()  # fmt: skip
    chaos = Flow(press, Drive(122.0)).run(np.array([2e-3, 0.1]), 400).strobes[-100:]
    phasor = force / (stiffness - mass * omega**2 + 1j * omega * damping)
    linear = np.array([phasor.imag, omega * phasor.real])
    ended = [by_flow(Flow(press, Drive(omega)), x, TransientSettings()) for x in chaos]
    assert all(s.lyapunov > 0.0 for s in ended if s.status is OrbitStatus.APERIODIC)
    settled = [s for s in ended if s.status is OrbitStatus.PERIODIC]
    assert len(settled) > len(chaos) / 2
    for steady in settled:
        np.testing.assert_allclose(steady.start, linear, rtol=1e-6)
