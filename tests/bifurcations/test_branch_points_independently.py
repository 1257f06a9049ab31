"""Points on branches of impacting orbits, by an integrator that shares nothing with the package.

DOP853 runs the orbits about each point, the stops' law in its right-hand side or restarted at each
impact.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from designer.bifurcations.continuation import Branch, start, trace
from designer.bifurcations.points import Bifurcation, PointKind, locate
from designer.dynamics.attractors import settle
from designer.model import swept_model
from tests.bifurcations.test_continuation import PAPER, PLAIN, monodromy
from tests.bifurcations.test_points import tip
from tests.shared.oracles import integrate

GRAZINGS = [
    # an attractor at ω; its branch from, to; a grazing point; the grazing is a contact that is lost
    # as ω rises (1), or two contacts that become one (-1)
    (0.215, 0.2135, 0.2195, 0.2184843842, -1),  # 1-8-8 → 1-7-7
    (0.80, 0.7655, 0.81, 0.7664397061, 1),  # 1-2-2 → 1-1-1
    (1.225, 1.2182, 1.23, 1.2183385915, -1),  # 1-2-1 → 1-1-1
]
CHANGES = [
    # the same, a point where stability changes, and the multiplier there
    (0.32, 0.3145, 0.3205, 0.3150786, PointKind.DOUBLING, -1.0),
    (1.342, 1.335, 1.37, 1.3361967, PointKind.DOUBLING, -1.0),
    (1.342, 1.335, 1.37, 1.3687522838, PointKind.FOLD, 1.0),
]
STARTS = np.random.default_rng(5).uniform(-0.5, 0.5, (40, 4))


@cache
def branch(omega: float, low: float, high: float) -> Branch:
    """Of an attractor at ω, the first from a few starts whose branch holds a point there."""
    over = swept_model.of_model(PAPER, omega, "omega")
    wanted = {0.215: (1, 16), 0.80: (1, 2), 1.225: (1, 2), 0.32: (1, 10), 1.342: (1, 3)}[omega]
    for x in [np.zeros(4), *STARTS]:
        orbit = settle(over.flow(omega), x)
        if (orbit.n, orbit.p + orbit.q) == wanted:
            return trace(start(over, orbit, omega), low, high)
    raise AssertionError(f"no such orbit at ω = {omega}")


def point(where: Branch, kind: PointKind, near: float) -> Bifurcation:
    (one,) = [p for p in locate(where) if p.kind is kind and abs(p.value - near) < 2e-7]
    return one


@pytest.mark.slow
@pytest.mark.parametrize(("omega", "low", "high", "near", "lost"), GRAZINGS)
def test_last_impact_shrinks_to_nothing_at_a_grazing_point(
    omega: float, low: float, high: float, near: float, lost: int
) -> None:
    """How far the turning point, tip or dip, lies past its stop goes through nought: that is what
    the velocity of the impact that is lost squares to."""
    where = branch(omega, low, high)
    p = point(where, PointKind.GRAZING, near)
    shifts = np.array([-1e-8, 1e-8])
    past = []
    for shift in shifts:
        solved = where.curve.near(p.point.solved.x, p.value + shift)
        assert solved is not None
        past.append(tip(PLAIN, p.value + shift, solved.x, where.curve.n))
    assert np.sign(past).tolist() == [lost, -lost]
    vanishes = shifts[0] - past[0] * (shifts[1] - shifts[0]) / (past[1] - past[0])
    assert abs(vanishes) < 5e-9


@pytest.mark.slow
@pytest.mark.parametrize(("omega", "low", "high", "near", "kind", "unit"), CHANGES)
def test_multiplier_at_the_ends_of_impacting_windows(
    omega: float, low: float, high: float, near: float, kind: PointKind, unit: float
) -> None:
    where = branch(omega, low, high)
    p = point(where, kind, near)
    x, n = p.point.orbit.start, p.point.orbit.n
    assert np.abs(integrate(PLAIN, p.value, list(x), n).strobes[-1] - x).max() < 1e-9
    found = np.linalg.eigvals(monodromy(PLAIN, p.value, x, n))
    assert np.abs(found - unit).min() < 1e-4
