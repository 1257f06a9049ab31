"""Torus and doubling curves of an impacting oscillator, and the resonances that end them.

x'' + c x' + x = sin ωt with a spring and a damper d behind a gap on one side. Without the damper
the flow preserves area where c = 0, with contacts or without (Liouville), so every torus curve lies
there. With it the determinant of the monodromy matrix depends on how long the contacts last, and
torus curves lie where c < 0 pays for them: as in any system. Orbit, determinant 1 and the trace
that makes the pair a root of 1 are solved for by another integrator.
"""

from __future__ import annotations

from dataclasses import replace
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
from designer.model.clearance import Clearance
from designer.model.mechanics import SecondOrderSystem

STIFFNESS, GAP = 3.0, 0.1


def _build(c: float, omega: float, damper: float) -> Flow:
    one = np.ones((1, 1))
    stop = replace(Clearance.even(0, STIFFNESS, GAP, "upper"), damping=damper)
    system = SecondOrderSystem(np.ones(1), c * one, one, np.ones(1), (stop,))
    return Flow(system.piecewise_linear(), Drive(omega), fast=False)


@cache
def curve(
    kind: PointKind, first: str, omega: float, window: PlaneWindow, damper: float
) -> PlaneCurve:
    """Through the point of a kind nearest to where rest leads to at c = 0.05."""
    along_c = Family("c", -1.0, 1.0, lambda c: _build(c, omega, damper))
    along_omega = Family("omega", 0.1, 10.0, lambda w: _build(0.05, w, damper))
    if first == "c":
        plane = FlowPlane(along_c, along_omega, lambda c, w: _build(c, w, damper))
        at, second = 0.05, omega
    else:
        plane = FlowPlane(along_omega, along_c, lambda w, c: _build(c, w, damper))
        at, second = omega, 0.05
    over = plane.along_first(second)
    branch = trace(start(over, settle(over.flow(at), np.zeros(2)), at), *window.first)
    point = min((p for p in locate(branch) if p.kind is kind), key=lambda p: abs(p.value - at))
    followed = continued(plane, point, second, window)
    assert followed is not None
    return followed


def monodromy(x: Array, c: float, omega: float, n: int, damper: float) -> tuple[Array, Array]:
    """State after n periods, and the variational solution, by DOP853 restarted at every event; its
    jump there is that of the force (Aizerman and Gantmakher)."""
    t, end, touched = 0.0, 2.0 * np.pi * n / omega, bool(x[0] > GAP)
    state = np.concatenate([x, np.eye(2).ravel()])
    while t < end:

        def rates(at: float, s: Array, touched: bool = touched) -> Array:
            k, d = 1.0 + STIFFNESS * touched, c + damper * touched
            v = s[2:].reshape(2, 2)
            force = np.sin(omega * at) + STIFFNESS * GAP * touched
            return np.array([s[1], force - k * s[0] - d * s[1], *v[1], *(-k * v[0] - d * v[1])])

        def event(at: float, s: Array) -> float:
            return float(s[0] - GAP)

        event.terminal = True  # type: ignore[attr-defined]
        event.direction = -1.0 if touched else 1.0  # type: ignore[attr-defined]
        run = solve_ivp(
            rates, (t, end), state, "DOP853", events=event, rtol=1e-12, atol=1e-13, max_step=0.1
        )
        t, state = float(run.t[-1]), run.y[:, -1]
        if run.status == 1:
            # The rate of x' falls by d x' where contact begins, and x passes the gap with x'.
            state[4:] += (damper if touched else -damper) * state[2:4]
            touched = not touched
    return state[:2], state[2:].reshape(2, 2)


def _resonance(value: float, x: Array, place: Array, n: int, damper: float) -> Array:
    """(c, ω) near by at which an orbit of period n has a monodromy matrix of this trace and of
    determinant 1."""

    def equations(u: Array) -> Array:
        end, matrix = monodromy(u[:2], float(u[2]), float(u[3]), n, damper)
        return np.array([*(end - u[:2]), np.trace(matrix) - value, np.linalg.det(matrix) - 1.0])

    found = fsolve(equations, [*x, *(place + 1e-5)], xtol=1e-11)
    assert np.abs(equations(found)).max() < 1e-8
    return np.asarray(found[2:])


TRACES = {"1:1 resonance": 2.0, "1:2 resonance": -2.0, "1:3 resonance": -1.0, "1:4 resonance": 0.0}


DAMPERS = (0.0, 0.01)


@pytest.mark.slow
@pytest.mark.parametrize("damper", DAMPERS)
def test_torus_curve_of_an_impacting_orbit_ends_in_a_resonance(damper: float) -> None:
    """That of 3-2-0; its pair is a quarter of a turn on the way, and becomes real."""
    window = PlaneWindow((-0.05, 0.05), (1.85, 1.91))
    followed = curve(PointKind.TORUS, "c", 1.89, window, damper)
    along = followed.values[:, 0]
    assert np.abs(along).max() < 1e-9 if not damper else (along < -1e-3).all()
    assert "1:1 resonance" in followed.ends
    assert followed.system.n == 3
    checked = [c for c in followed.codimension_two if c.name in TRACES]
    assert {c.name for c in checked} >= {"1:1 resonance", "1:4 resonance"}
    for met in checked:
        place = np.array(met.values)
        exact = _resonance(TRACES[met.name], met.point.z[:2], place, 3, damper)
        assert place == pytest.approx(exact, abs=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("damper", DAMPERS)
def test_doubling_curve_of_an_impacting_orbit_meets_its_resonance(damper: float) -> None:
    window = PlaneWindow((2.0, 2.3), (-0.05, 0.1))
    followed = curve(PointKind.DOUBLING, "omega", 2.1, window, damper)
    (met,) = [c for c in followed.codimension_two if c.name == "1:2 resonance"]
    place = np.array(met.values[::-1])
    exact = _resonance(-2.0, met.point.z[:2], place, 1, damper)
    assert place == pytest.approx(exact, abs=1e-7 if damper else 1e-8)
    assert place[0] < -1e-3 if damper else abs(place[0]) < 1e-8
