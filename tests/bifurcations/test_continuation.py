"""Branches of periodic orbits against references that share no code with them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.linalg import expm

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.bifurcations.branch_survey import passes
from designer.bifurcations.continuation import Branch, End, follow, start, trace
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive
from designer.model import swept_model
from designer.model.model import Dimensionless
from tests.shared.oracles import Plain, integrate, response_amplitude

PAPER = Dimensionless(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25)
PLAIN = Plain(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25)
TWO_MASSES = replace(PAPER, m=0.4, k=0.45, k0=0.9, c=0.3, zeta=0.12, f20=0.05, b=0.3)


def flow_at(model: Dimensionless, omega: float) -> Flow:
    return Flow(model.second_order().piecewise_linear(), Drive(omega))


def branch_of(
    model: Dimensionless, omega: float, parameter: str, low: float, high: float
) -> Branch:
    """The branch, over a parameter, of the attractor that rest leads to."""
    over = swept_model.of_model(model, omega, parameter)
    orbit = settle(flow_at(model, omega), np.zeros(4))
    value = omega if parameter == "omega" else getattr(model, parameter)
    return trace(start(over, orbit, value), low, high)


def monodromy(p: Plain, omega: float, x: Array, n: int) -> Array:
    """Central differences of the n-period map of DOP853."""
    step, columns = 1e-5, []
    for e in np.eye(4):
        ends = [integrate(p, omega, list(x + s * step * e), n).strobes[-1] for s in (1, -1)]
        columns.append((ends[0] - ends[1]) / (2.0 * step))
    return np.array(columns).T


@cache
def linear_branch() -> Branch:
    """Over ω, of the paper's model with a clearance that is never reached."""
    return branch_of(replace(PAPER, b=50.0), 0.7, "omega", 0.5, 1.0)


def test_linear_branch_has_the_linear_amplitude_and_multipliers() -> None:
    model, branch = replace(PAPER, b=50.0), linear_branch()
    assert branch.ends == (End.LIMIT, End.LIMIT)
    assert branch.values.min() == 0.5
    assert branch.values.max() == 1.0
    A = model.second_order().state_matrix()
    for point in branch.points[::5]:
        wanted = np.abs(response_amplitude(replace(PLAIN, b=50.0), point.value))
        assert point.orbit.extremes[[0, 2], 1] == pytest.approx(wanted, rel=1e-9)
        exact = np.linalg.eigvals(expm(A * 2.0 * np.pi / point.value))
        assert np.sort_complex(point.orbit.multipliers) == pytest.approx(
            np.sort_complex(exact), abs=1e-9
        )


@pytest.mark.slow
def test_points_close_and_multiply_as_an_independent_integrator_says() -> None:
    branch = branch_of(PAPER, 1.55, "omega", 1.2, 1.6)
    assert not all(p.stable for p in branch.points)
    for point in branch.points[:: len(branch.points) // 4]:
        x = point.orbit.start
        lap = integrate(PLAIN, point.value, list(x), 1)
        assert np.abs(lap.strobes[-1] - x).max() < 1e-10
        assert (lap.sides > 0).sum() == point.orbit.p
        assert (lap.sides < 0).sum() == point.orbit.q
        found = np.linalg.eigvals(monodromy(PLAIN, point.value, x, 1))
        assert np.abs(found).max() == pytest.approx(point.orbit.radius, rel=1e-5)


@pytest.mark.parametrize("parameter", ["b", "k0", "zeta", "m", "k", "c", "f20"])
def test_every_parameter_leads_to_the_orbit_that_is_reached_there(parameter: str) -> None:
    value = getattr(TWO_MASSES, parameter)
    far = value * 1.04
    branch = branch_of(TWO_MASSES, 1.6, parameter, value, far)
    assert branch.parameter == parameter
    last = branch.points[-1]
    assert last.value == far
    assert len({p.value for p in branch.points}) == len(branch.points)
    names: dict[str, float] = {parameter: far}
    there = replace(TWO_MASSES, **names)  # type: ignore[arg-type]
    reached = settle(flow_at(there, 1.6), np.zeros(4))
    assert passes(branch, far, reached)
    assert last.response == reached.response


def test_a_branch_goes_round_a_fold_and_on_through_grazing() -> None:
    branch = branch_of(PAPER, 0.85, "omega", 0.76, 0.95)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(branch.values))))
    assert len(turns) == 2  # at 0.9201 and at 0.7662
    assert {p.response for p in branch.points} == {"1-2-2", "1-1-1"}
    steps = [
        branch.curve.distance(a.solved, b.solved)
        for a, b in zip(branch.points, branch.points[1:], strict=False)
        if a.counts != b.counts
    ]
    assert max(steps) < 1e-8


def test_same_branch_whichever_end_it_is_begun_at() -> None:
    one = branch_of(PAPER, 1.7, "omega", 1.4, 1.75)
    over = swept_model.of_model(PAPER, 1.7, "omega")
    other = trace(start(over, one.points[0].orbit, 1.4, symmetric=True), 1.4, 1.75)
    for point in one.points[::7]:
        assert passes(other, point.value, point.orbit)


def test_until_stops_after_its_first_point() -> None:
    over = swept_model.of_model(PAPER, 1.55, "omega")
    origin = start(over, settle(over.flow(1.55), np.zeros(4)), 1.55)
    branch = follow(origin, 1.0, 1.8, -1.0, until=lambda p: not p.stable)
    assert branch.ends[1] is End.STOPPED
    assert [p.stable for p in branch.points][-2:] == [True, False]


def test_start_refuses_what_is_no_orbit() -> None:
    over = swept_model.of_model(PAPER, 1.55, "omega")
    orbit = settle(over.flow(1.55), np.zeros(4))
    astray = replace(orbit, start=orbit.start + 1e4)
    with pytest.raises(ArithmeticError, match=r"omega = 1\.55"):
        start(over, astray, 1.55)


def test_unknown_parameters_and_values_outside_are_refused() -> None:
    with pytest.raises(InputError, match="one of omega, b"):
        swept_model.of_model(PAPER, 1.55, "mass")
    over = swept_model.of_model(PAPER, 1.55, "k0")
    with pytest.raises(InputError, match=r"k0: found 1\.0"):
        over.flow(1.0)


def test_symmetric_orbits_of_even_period_are_refused() -> None:
    over = swept_model.of_model(PAPER, 1.335, "omega")
    orbit = settle(over.flow(1.345), np.zeros(4))
    assert orbit.n == 2
    with pytest.raises(InputError, match="an odd period"):
        start(over, orbit, 1.345, symmetric=True)
