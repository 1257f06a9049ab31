"""Cusp and fold-flip of impacting oscillators, by their closed form.

Between two events the motion of a piecewise-linear system is a matrix exponential, SciPy's. Events
are found by Brent's method, and where they are the monodromy matrix is continuous: the product of
the pieces. All conditions of a point are solved for at once; nothing is the package's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq, fsolve

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

PIECES = 100
"""Pieces of a drive period: two events on one stop never lie in the same."""


@dataclass(frozen=True)
class Oscillators:
    """Unit masses under forces of one frequency, each with an upper stop."""

    damping: Array
    """(n,) of each mass."""
    stiffness: Array
    """(n, n) stiffness matrix."""
    force: Array
    """(n,) amplitudes."""
    stops: tuple[tuple[float, float], ...]
    """(gap, stiffness) for each mass."""

    def flow(self, omega: float) -> Flow:
        """As the package has it."""
        stops = tuple(
            Clearance.even(j, stiffness, gap, "upper", "AB"[j])
            for j, (gap, stiffness) in enumerate(self.stops)
        )
        system = SecondOrderSystem(
            np.ones(len(stops)), np.diag(self.damping), self.stiffness, self.force, stops
        )
        return Flow(system.piecewise_linear(), Drive(omega), fast=False)

    def generator(self, omega: float, touched: tuple[bool, ...]) -> Array:
        """M of z' = M z, z = (x1, x1', x2, x2', …, sin ωt, cos ωt, 1), with some in contact."""
        n = 2 * len(touched)
        M = np.zeros((n + 3, n + 3))
        M[n, n + 1], M[n + 1, n] = omega, -omega
        for j, (gap, stiffness) in enumerate(self.stops):
            M[2 * j, 2 * j + 1] = 1.0
            M[2 * j + 1, 0:n:2] = -self.stiffness[j]
            M[2 * j + 1, 2 * j + 1] = -self.damping[j]
            M[2 * j + 1, n] = self.force[j]
            if touched[j]:
                M[2 * j + 1, 2 * j] -= stiffness
                M[2 * j + 1, n + 2] = stiffness * gap
        return M

    def period(self, x: Array, omega: float) -> tuple[Array, Array]:
        """State and monodromy matrix after a drive period from a strobe."""
        n, left = len(x), 2.0 * np.pi / omega
        piece = left / PIECES
        z, phi = np.concatenate([x, [0.0, 1.0, 1.0]]), np.eye(n)
        touched = tuple(bool(x[2 * j] > gap) for j, (gap, _) in enumerate(self.stops))
        whole: dict[tuple[bool, ...], Array] = {}
        while left > 0.0:
            M, step = self.generator(omega, touched), min(piece, left)
            if touched not in whole:
                whole[touched] = expm(M * piece)
            propagator = whole[touched] if step == piece else expm(M * step)
            after = propagator @ z
            first = None
            for j, (gap, _) in enumerate(self.stops):
                if (after[2 * j] > gap) != touched[j]:

                    def past(t: float, M: Array = M, z: Array = z, j: int = j) -> float:
                        return float((expm(M * t) @ z)[2 * j] - self.stops[j][0])

                    at = float(brentq(past, 0.0, step, xtol=1e-15, rtol=1e-14))
                    if first is None or at < step:
                        first, step = j, at
            if first is not None:
                propagator = expm(M * step)
            z, phi, left = propagator @ z, propagator[:n, :n] @ phi, left - step
            if first is not None:
                touched = tuple(t ^ (j == first) for j, t in enumerate(touched))
        return z[:n], phi


def curve_of_the_fold(
    plane: FlowPlane, states: int, omega: float, second: float, window: PlaneWindow
) -> PlaneCurve:
    """The curve of a fold of the orbit that rest leads to at ω."""
    over = plane.along_first(second)
    begun = start(over, settle(over.flow(omega), np.zeros(states)), omega)
    fold = next(p for p in locate(trace(begun, *window.first)) if p.kind is PointKind.FOLD)
    followed = continued(plane, fold, second, window)
    assert followed is not None
    return followed


def solved(equations: Callable[[Array], Array], begun: Array) -> Array:
    """The root near by, of equations that are 0 there to 1e-9."""
    root, information, _, _ = fsolve(equations, begun, xtol=1e-10, full_output=True)
    assert np.abs(information["fvec"]).max() < 1e-9
    return np.asarray(root)


def plane_of(system: Callable[[float], Oscillators], c: float, omega: float) -> FlowPlane:
    """Over ω and the damping of the first mass."""
    return FlowPlane(
        Family("omega", 0.1, 10.0, lambda w: system(c).flow(w)),
        Family("c", 0.0, 1.0, lambda c: system(c).flow(omega)),
        lambda w, c: system(c).flow(w),
    )


def two_coupled(c: float) -> Oscillators:
    """The first mass has the bent resonance, the second doubles its period; a spring between."""
    stiffness = np.array([[1.02, -0.02], [-0.02, 0.34]])
    force, stops = np.array([1.0, 0.32]), ((5.0, 3.0), (0.1, 0.96))
    return Oscillators(np.array([c, 0.05]), stiffness, force, stops)


@pytest.mark.slow
def test_the_cusp_in_which_both_folds_of_a_bent_resonance_meet() -> None:
    """The derivative of det(M - 1) along the null vector is 0 at the cusp; that vector is a column
    of the adjugate of M - 1, which is smooth."""

    def damped(c: float) -> Oscillators:
        one = np.ones(1)
        return Oscillators(c * one, np.ones((1, 1)), one, ((5.0, 3.0),))

    def equations(u: Array) -> Array:
        system, x, omega = damped(u[3]), u[:2], u[2]
        end, M = system.period(x, omega)
        null = np.array([M[1, 1] - 1.0, -M[1, 0]])
        beside = [
            np.linalg.det(system.period(x + h * null, omega)[1] - np.eye(2)) for h in (1e-5, -1e-5)
        ]
        det = np.linalg.det(M - np.eye(2))
        return np.array([*(end - x), det, (beside[0] - beside[1]) / 2e-5])

    plane, window = plane_of(damped, 0.14, 1.06), PlaneWindow((1.035, 1.12), (0.13, 0.18))
    (cusp,) = curve_of_the_fold(plane, 2, 1.06, 0.14, window).codimension_two
    assert cusp.name == "cusp"
    root = solved(equations, cusp.point.z + 1e-5)
    assert cusp.values == pytest.approx(root[2:], abs=1e-8)
    assert cusp.point.z[:2] == pytest.approx(root[:2], abs=1e-5)


@pytest.mark.slow
def test_the_fold_flip_of_two_coupled_oscillators() -> None:
    def equations(u: Array) -> Array:
        end, M = two_coupled(u[5]).period(u[:4], u[4])
        eye = np.eye(4)
        return np.array([*(end - u[:4]), np.linalg.det(M - eye), np.linalg.det(M + eye)])

    plane, window = plane_of(two_coupled, 0.07, 1.1), PlaneWindow((1.09, 1.22), (0.068, 0.08))
    (met,) = curve_of_the_fold(plane, 4, 1.1, 0.07, window).codimension_two
    assert met.name == "fold-flip"
    root = solved(equations, met.point.z + 1e-6)
    assert met.values == pytest.approx(root[4:], abs=1e-8)
    assert met.point.z[:4] == pytest.approx(root[:4], abs=1e-6)
