"""Shaw and Holmes' oscillator (J. Sound Vib. 90, 129, 1983), built by hand on ``dynamics`` alone.

    x'' + 2ζx' + x + κ·max(x − g, 0) = a·sin(ωt)

One mass, one stop: two states and two modes. ``main`` finds its orbits and a bifurcation point and
holds them against an integrator that is restarted at every crossing.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from designer.base.arrays import Array
from designer.bifurcations.branch_survey import survey
from designer.bifurcations.flow_family import Family
from designer.bifurcations.points import PointKind
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.piecewise_linear import (
    Drive,
    Guard,
    Mode,
    ModeKey,
    PiecewiseLinearSystem,
    motion_of_states,
)

ZETA, KAPPA, GAP, FORCE = 0.05, 8.0, 0.1, 1.0


def system() -> PiecewiseLinearSystem:
    """Key (0,) off the stop, (1,) on it; the stop is at x = g."""

    def build(key: ModeKey) -> Mode:
        touching = key == (1,)
        side = 1.0 if touching else -1.0
        guard = Guard(
            np.array([-side, 0.0]), 0.0, side * GAP, (0,) if touching else (1,), clearance=0
        )
        return Mode(
            A=np.array([[0.0, 1.0], [-1.0 - KAPPA * touching, -2.0 * ZETA]]),
            B=np.array([0.0, FORCE]),
            d=np.array([0.0, KAPPA * GAP * touching]),
            guards=(guard,),
            sides=(int(touching),),
        )

    return PiecewiseLinearSystem(("x", "x'"), build, (0,), ("stop",), *motion_of_states(2, [0]))


def lap(omega: float, start: Array, periods: int) -> tuple[Array, Array, int]:
    """End, monodromy (2, 2) and entries into contact of an orbit, by DOP853 restarted at each
    crossing. The saltation matrix is the identity, as the field is continuous."""

    touching = bool(start[0] > GAP)

    def field(t: float, y: Array) -> Array:
        A = np.array([[0.0, 1.0], [-1.0 - KAPPA * touching, -2.0 * ZETA]])
        push = np.array([0.0, FORCE * np.sin(omega * t) + KAPPA * GAP * touching])
        return np.concatenate([A @ y[:2] + push, (A @ y[2:].reshape(2, 2)).ravel()])

    def crossing(t: float, y: Array) -> float:
        return float(y[0] - GAP)

    crossing.terminal = True  # type: ignore[attr-defined]
    t, end = 0.0, periods * 2.0 * np.pi / omega
    y = np.concatenate([start, np.eye(2).ravel()])
    impacts = 0
    while t < end:
        crossing.direction = -1.0 if touching else 1.0  # type: ignore[attr-defined]
        run = solve_ivp(
            field,
            (t, end),
            y,
            "DOP853",
            events=crossing,
            rtol=1e-12,
            atol=1e-13,
            max_step=0.02,  # or two crossings between steps go unseen
        )
        t, y = float(run.t[-1]), run.y[:, -1]
        if run.status == 1:
            touching = not touching
            impacts += touching
    return y[:2], y[2:].reshape(2, 2), impacts


def main(low: float = 1.3, high: float = 3.4) -> None:
    """Print "orbits" and "points" once each has been shown right."""
    oscillator = system()
    family = Family("omega", low, high, lambda w: Flow(oscillator, Drive(w), fast=False))
    known = []
    for omega in (1.6, 2.32, 3.28):
        orbit = settle(family.flow(omega), np.zeros(2))
        assert orbit.status is OrbitStatus.PERIODIC, (omega, orbit)
        end, monodromy, impacts = lap(omega, orbit.start, orbit.n)
        np.testing.assert_allclose(end, orbit.start, atol=1e-8)
        multipliers = np.linalg.eigvals(monodromy)
        assert abs(np.abs(multipliers).max() - orbit.radius) < 1e-7
        assert (orbit.p, orbit.q) == (impacts, 0)
        known.append((omega, orbit))
    print("orbits")
    found = survey(family, known, low, high)
    doublings = [p for p in found.points if p.kind is PointKind.DOUBLING]
    assert doublings, found.points
    for point in doublings:
        end, monodromy, _ = lap(point.value, point.point.orbit.start, point.point.orbit.n)
        np.testing.assert_allclose(end, point.point.orbit.start, atol=1e-7)
        assert np.abs(np.linalg.eigvals(monodromy) + 1.0).min() < 1e-6
    print("points")
