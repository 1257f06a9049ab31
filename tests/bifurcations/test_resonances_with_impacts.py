"""Torus and doubling curves of an impacting oscillator, and the resonances that end them.

x'' + c x' + x = sin ωt with a spring behind a gap on one side: the flow preserves area where c = 0,
with contacts or without (Liouville), so every torus curve lies there, and a doubling has its second
multiplier -1 there. Where on it the pair is a root of 1 follows from the trace of the monodromy
matrix, which another integrator gives.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from designer.base.arrays import Array
from designer.bifurcations.continuation import start, trace
from designer.bifurcations.flow_family import Family, FlowPlane
from designer.bifurcations.plane_curves import PlaneCurve, PlaneWindow, continued
from designer.bifurcations.points import PointKind, locate
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive
from designer.model.mechanics import Clearance, SecondOrderSystem

STIFFNESS, GAP = 3.0, 0.1


def _build(c: float, omega: float) -> Flow:
    one = np.ones((1, 1))
    stop = Clearance.even(0, STIFFNESS, GAP, "upper")
    system = SecondOrderSystem(np.ones(1), c * one, one, np.ones(1), (stop,))
    return Flow(system.piecewise_linear(), Drive(omega), fast=False)


@cache
def _curve(kind: PointKind, first: str, omega: float, window: PlaneWindow) -> PlaneCurve:
    """Through the point of a kind nearest to where rest leads to at c = 0.05."""
    along_c = Family("c", -1.0, 1.0, lambda c: _build(c, omega))
    along_omega = Family("omega", 0.1, 10.0, lambda w: _build(0.05, w))
    if first == "c":
        plane, at, second = FlowPlane(along_c, along_omega, _build), 0.05, omega
    else:
        plane = FlowPlane(along_omega, along_c, lambda w, c: _build(c, w))
        at, second = omega, 0.05
    over = plane.along_first(second)
    branch = trace(start(over, settle(over.flow(at), np.zeros(2)), at), *window.first)
    point = min((p for p in locate(branch) if p.kind is kind), key=lambda p: abs(p.value - at))
    followed = continued(plane, point, second, window)
    assert followed is not None
    return followed


def _monodromy(x: Array, omega: float, n: int) -> tuple[Array, Array]:
    """State after n periods, and the variational solution, by DOP853 restarted at every event."""
    t, end, touched = 0.0, 2.0 * np.pi * n / omega, bool(x[0] > GAP)
    state = np.concatenate([x, np.eye(2).ravel()])
    while t < end:

        def rates(at: float, s: Array, touched: bool = touched) -> Array:
            k = 1.0 + STIFFNESS * touched
            v = s[2:].reshape(2, 2)
            force = np.sin(omega * at) + STIFFNESS * GAP * touched
            return np.array([s[1], force - k * s[0], *v[1], *(-k * v[0])])

        def event(at: float, s: Array) -> float:
            return float(s[0] - GAP)

        event.terminal = True  # type: ignore[attr-defined]
        event.direction = -1.0 if touched else 1.0  # type: ignore[attr-defined]
        run = solve_ivp(
            rates, (t, end), state, "DOP853", events=event, rtol=1e-12, atol=1e-13, max_step=0.1
        )
        t, state, touched = float(run.t[-1]), run.y[:, -1], touched ^ (run.status == 1)
    return state[:2], state[2:].reshape(2, 2)


def _where_the_trace_is(value: float, x: Array, omega: float, n: int) -> float:
    """ω near by at which the orbit of period n without damping has this trace."""

    def equations(u: Array) -> Array:
        end, matrix = _monodromy(u[:2], float(u[2]), n)
        return np.array([*(end - u[:2]), np.trace(matrix) - value])

    found = fsolve(equations, [*x, omega + 1e-5], xtol=1e-11)
    assert np.abs(equations(found)).max() < 1e-8
    return float(found[2])


TRACES = {"1:1 resonance": 2.0, "1:2 resonance": -2.0, "1:3 resonance": -1.0, "1:4 resonance": 0.0}


@pytest.mark.slow
def test_torus_curve_of_an_impacting_orbit_ends_in_a_resonance() -> None:
    """The curve of 3-2-0 lies at c = 0; its pair is a quarter of a turn twice, and becomes real."""
    window = PlaneWindow((-0.05, 0.05), (1.85, 1.91))
    followed = _curve(PointKind.TORUS, "c", 1.89, window)
    assert np.abs(followed.values[:, 0]).max() < 1e-9
    assert "1:1 resonance" in followed.ends
    assert followed.system.n == 3
    checked = [c for c in followed.codimension_two if c.name in TRACES]
    assert {c.name for c in checked} >= {"1:1 resonance", "1:4 resonance"}
    for met in checked:
        c, omega = met.values
        exact = _where_the_trace_is(TRACES[met.name], met.point.z[:2], omega, 3)
        assert abs(c) < 1e-8
        assert omega == pytest.approx(exact, abs=1e-7)


@pytest.mark.slow
def test_doubling_curve_of_an_impacting_orbit_meets_its_resonance() -> None:
    followed = _curve(PointKind.DOUBLING, "omega", 2.1, PlaneWindow((2.0, 2.3), (-0.05, 0.1)))
    (met,) = [c for c in followed.codimension_two if c.name == "1:2 resonance"]
    omega, c = met.values
    assert abs(c) < 1e-8
    exact = _where_the_trace_is(-2.0, met.point.z[:2], omega, 1)
    assert omega == pytest.approx(exact, abs=1e-8)
