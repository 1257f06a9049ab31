"""Bifurcation curves over two parameters against closed forms, points located one by one, and an
independent integrator."""

from __future__ import annotations

import threading
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from designer.base.arrays import Array
from designer.base.threads import parallel
from designer.bifurcations.border_curve import BorderCurve, read_curve
from designer.bifurcations.branch_survey import Survey, survey
from designer.bifurcations.conditions import (
    Condition,
    Grazing,
    MapSlopes,
    Multiplier,
    MultiplierPair,
    grazings,
)
from designer.bifurcations.continuation import start, trace
from designer.bifurcations.extended_system import CurvePoint
from designer.bifurcations.flow_family import MOST_FLOWS, Family, FlowPlane
from designer.bifurcations.grazing_contact import GrazingContact
from designer.bifurcations.orbit_curve import map_image
from designer.bifurcations.plane_curves import PlaneCurve, PlaneWindow, continued
from designer.bifurcations.points import PointKind, locate
from designer.bifurcations.windows import window
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.model.mechanics import SecondOrderSystem
from designer.model.swept_model import ModelSubject
from tests.bifurcations.test_continuation import PAPER, PLAIN
from tests.bifurcations.test_points import linear_orbit
from tests.shared.oracles import response_amplitude

B = 0.25
WINDOW = PlaneWindow((0.6, 1.8), (0.15, 0.35))


@cache
def surveyed(omega: float, low: float, high: float, depth: int) -> Survey:
    """Branches of the paper's model over ω at b = 0.25, from the attractor at a frequency."""
    over = ModelSubject(PAPER, omega).family("omega")
    orbit = settle(over.flow(omega), np.zeros(4))
    return survey(over, [(omega, orbit)], low, high, depth=depth)


@cache
def curve(kind: PointKind, near: float) -> PlaneCurve:
    """The ω-b curve through one of the points beside 1-2-2 at ω = 0.85 or 1-1-1 at 1.55."""
    found = surveyed(0.85, 0.7, 0.95, 0) if near < 1.0 else surveyed(1.55, 1.33, 1.6, 1)
    point = next(p for p in found.points if p.kind is kind and abs(p.value - near) < 1e-3)
    followed = continued(ModelSubject(PAPER).plane("omega", "b"), point, B, WINDOW)
    assert followed is not None
    assert followed.points[followed.begun].values[0] == pytest.approx(point.value, abs=1e-8)
    return followed


@pytest.mark.slow
def test_grazing_of_the_linear_response_by_its_closed_form() -> None:
    """x1 reaches b where its amplitude without stops is b, at every ω."""
    exact = abs(response_amplitude(PLAIN, 1.55)[0])
    over = ModelSubject(PAPER, 1.55).family("b")
    free = start(over, linear_orbit(1.55), 1.02 * exact, symmetric=True)
    points = locate(trace(free, 0.99 * exact, 1.03 * exact))
    grazing = next(p for p in points if p.kind is PointKind.GRAZING)
    plane = ModelSubject(PAPER).plane("b", "omega")
    window = PlaneWindow((0.2 * exact, 3.0 * exact), (1.2, 1.9))
    followed = continued(plane, grazing, 1.55, window)
    assert followed is not None
    assert set(followed.ends) == {"edge of omega"}
    for b, omega in followed.values:
        amplitude = abs(response_amplitude(PLAIN, omega)[0])
        assert abs(b - amplitude) < 1e-10 * amplitude


def test_torus_curve_and_its_resonances_where_damping_vanishes() -> None:
    """x'' + c x' + x = sin ωt: the pair exp(± 2πi/ω) lies on the unit circle where c = 0."""

    def build(c: float, omega: float) -> Flow:
        one = np.ones((1, 1))
        system = SecondOrderSystem(np.ones(1), c * one, one, np.ones(1), ())
        return Flow(system.piecewise_linear(), Drive(omega), fast=False)

    plane = FlowPlane(
        Family("c", -1.0, 1.0, lambda c: build(c, 2.3)),
        Family("omega", 0.1, 10.0, lambda w: build(0.1, w)),
        build,
    )
    over = plane.along_first(2.3)
    (point,) = locate(trace(start(over, settle(over.flow(0.2), np.zeros(2)), 0.2), -0.1, 0.3))
    followed = continued(plane, point, 2.3, PlaneWindow((-0.2, 0.2), (2.1, 5.0)))
    assert followed is not None
    assert np.abs(followed.values[:, 0]).max() < 1e-9
    met = {c.name: c.values[1] for c in followed.codimension_two}
    assert met == pytest.approx({"1:3 resonance": 3.0, "1:4 resonance": 4.0}, abs=1e-8)


def test_each_thread_has_flows_of_its_own() -> None:
    """The rays of a region ask at once; a flow is used by one thread at a time."""
    both = threading.Barrier(2)

    def build(*_: float) -> Any:
        return object()

    along = Family("a", 0.0, 1e9, build)
    plane = FlowPlane(along, along, build)

    def asked(_: int) -> tuple[Flow, Flow]:
        both.wait(60.0)
        flows = plane.flow(1.0, 0.0), along.flow(1.0)
        assert (plane.flow(1.0, 0.0), along.flow(1.0)) == flows
        return flows

    (at, over), (at_other, over_other) = parallel(asked, range(2), 2)
    assert at is not at_other
    assert over is not over_other


def test_the_oldest_flow_is_dropped() -> None:
    made: list[float] = []

    def build(value: float) -> Any:
        made.append(value)
        return object()

    along = Family("a", 0.0, 1e9, build)
    for value in (*range(MOST_FLOWS + 1), 1, 0):
        along.flow(float(value))
    assert made == [*range(MOST_FLOWS + 1), 0]


@pytest.mark.parametrize("kind", [PointKind.FOLD, PointKind.TORUS, PointKind.GRAZING])
def test_slopes_of_a_condition_are_those_of_its_differences(kind: PointKind) -> None:
    """By state and phase, at a state that is on no orbit."""
    flow = ModelSubject(PAPER).plane("omega", "b").build(0.85, B)
    x, extra = np.array([0.03, -0.5, 0.1, -0.2]), np.zeros(0)
    scale = np.array([0.5, 0.4, 0.6, 0.3])

    def jacobian(at: Array) -> Array:
        image = map_image(flow, at, 1, symmetric=False)
        assert image is not None
        return np.asarray(image.jacobian * scale / scale[:, None])

    def change(direction: Array) -> Array:
        step = 3e-8 * scale * direction
        return np.asarray((jacobian(x + step) - jacobian(x - step)) / 6e-8)

    condition: Condition = Multiplier.at(PointKind.FOLD, jacobian(x) + 0.1 * np.eye(4))
    if kind is PointKind.TORUS:
        condition = MultiplierPair.at(jacobian(x))
    if kind is PointKind.GRAZING:
        condition, extra = Grazing(GrazingContact(0, 1, True), 1, 0.5), np.array([0.31])
    slopes = condition.slopes(flow, x, extra, MapSlopes(scale, jacobian(x), change))
    assert slopes is not None
    steps = np.diag(np.concatenate([scale, np.ones(len(extra))])) * 1e-5
    for column, step in zip(slopes.T, steps, strict=True):
        ends = []
        for sign in (1.0, -1.0):
            at = x + sign * step[:4]
            ends.append(
                condition.residual(flow, at, extra + sign * step[4:], lambda at=at: jacobian(at))  # type: ignore[misc]
            )
        assert ends[0] is not None
        assert ends[1] is not None
        assert column == pytest.approx((ends[0] - ends[1]) / 2e-5, rel=1e-4, abs=1e-4)


@pytest.mark.slow
def test_curves_run_to_the_edges_and_say_where_they_meet() -> None:
    fork, grazing = curve(PointKind.PITCHFORK, 0.8562), curve(PointKind.GRAZING, 0.76644)
    assert fork.ends == ("grazing meets pitchfork", "edge of b")
    assert grazing.ends == ("edge of b", "edge of b")
    assert fork.points[-1].values[1] == 0.35
    (ended,) = fork.codimension_two
    (passed,) = grazing.codimension_two
    assert ended.name == passed.name == "grazing meets pitchfork"
    assert ended.values == pytest.approx(passed.values, abs=1e-9)
    assert all(fork.stable)
    # Beyond the meeting point no stable orbit grazes: it has lost its symmetry before.
    assert not all(grazing.stable)
    plain = BorderCurve.of(grazing)
    assert read_curve(plain.as_dict()).as_dict() == plain.as_dict()


CASES = [
    (PointKind.PITCHFORK, 0.78722),
    (PointKind.FOLD, 0.92006),
    (PointKind.GRAZING, 0.76644),
    (PointKind.PITCHFORK, 1.46052),
    (PointKind.DOUBLING, 1.34995),
]


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "near"), CASES)
def test_curves_pass_points_that_are_located_one_by_one(kind: PointKind, near: float) -> None:
    followed = curve(kind, near)
    inner = followed.points[1:-1]
    for k in np.linspace(0, len(inner) - 1, 20).astype(int):
        values = located(followed, inner[k])
        assert values, inner[k].values
        assert min(abs(v - inner[k].values[0]) for v in values) < 1e-8


def located(followed: PlaneCurve, p: CurvePoint) -> list[float]:
    """Values of ω of the points of the curve's kind on the branch at the same b, by the
    continuation over one parameter."""
    system = followed.system
    omega, b = p.values
    over = system.plane.along_first(b)
    orbit = Orbit(OrbitStatus.PERIODIC, n=system.n, start=p.z[:4])
    for off in (2e-3, -2e-3, 5e-4, -5e-4):
        try:
            origin = start(over, orbit, omega + off, symmetric=system.symmetric)
        except ArithmeticError:
            continue
        branch = trace(origin, omega - 3e-3, omega + 3e-3)
        values = [q.value for q in locate(branch) if q.kind is followed.kind]
        if values:
            return values
    return []


NEAR = 2e-3
"""In drive periods: how far about a turning point the contact is that of ``half_period``."""


def half_period(
    omega: float, b: float, x: Array, tip: float, about: int = 0
) -> tuple[Array, Array, Array]:
    """Mirrored half-period map, its Jacobian, and (x1, x1') at the phase ``tip``, by DOP853 with
    its variational equations; about the turning point the motion is that in contact with the stop
    ``about``, or without contact (0)."""
    p = replace(PLAIN, b=b)
    period = 2.0 * np.pi / omega
    eye = np.eye(4)

    def rhs(t: float, s: Array) -> Array:
        shallow = min(abs(t / period - tip), abs(t / period - tip + 0.5)) < NEAR
        side = about if shallow else p.side_of(s[0])
        rate = np.array(p.rhs(t, s[:4], omega, side))
        zero = np.array(p.rhs(t, np.zeros(4), omega, side))
        A = np.array([np.array(p.rhs(t, e, omega, side)) - zero for e in eye]).T
        return np.concatenate([rate, (A @ s[4:].reshape(4, 4)).ravel()])

    def run(start: Array, begin: float, end: float) -> Array:
        solved = solve_ivp(
            rhs, (begin, end), start, method="DOP853", rtol=1e-11, atol=1e-13,
            max_step=period / 400.0,
        )  # fmt: skip
        return np.asarray(solved.y[:, -1])

    middle = run(np.concatenate([x, eye.ravel()]), 0.0, tip * period)
    end = run(middle, tip * period, 0.5 * period)
    return -end[:4], -end[4:].reshape(4, 4), middle[:2]


@pytest.mark.slow
def test_grazing_meets_pitchfork_by_an_independent_solve() -> None:
    """The orbit, the tip's height and rate, and det(1 + H), all by another integrator."""
    (met,) = curve(PointKind.GRAZING, 0.76644).codimension_two
    z = met.point.z
    contact = met.point.condition.contact  # type: ignore[attr-defined]
    tip, side = float(z[4]) % 1.0, contact.side
    if tip > 0.5:
        tip, side = tip - 0.5, -side

    def equations(u: Array) -> Array:
        image, H, at = half_period(u[5], u[6], u[:4], u[4])
        det = np.linalg.det(np.eye(4) + H)
        return np.concatenate([image - u[:4], [side * at[0] - u[6], at[1], det]])

    begun = np.concatenate([z[:4], [tip + 1e-5], np.array(met.values) + np.array([1e-5, -1e-5])])
    solved, _, found, _ = fsolve(equations, begun, xtol=1e-11, full_output=True, epsfcn=1e-12)
    assert found in (1, 4, 5)
    assert np.abs(equations(solved)).max() < 1e-8
    assert solved[5:] == pytest.approx(met.values, abs=1e-7)


@pytest.mark.slow
def test_pitchfork_that_hugs_a_grazing_ends_where_both_meet_by_another_integrator() -> None:
    """The pitchfork of 1-8-8 comes to the dip in which two contacts become one from the side on
    which multipliers change with the square root of the gap."""
    over = ModelSubject(PAPER, 0.215).family("omega")
    orbit = settle(over.flow(0.215), np.zeros(4))
    low = window(over, orbit, 0.215, 0.205, 0.22).low.point
    assert low is not None
    plane = ModelSubject(PAPER).plane("omega", "b")
    followed = continued(plane, low, B, PlaneWindow((0.15, 1.8), (0.15, 0.35)))
    assert followed is not None
    assert followed.ends == ("grazing meets pitchfork", "edge of b")
    omega, b = followed.points[0].values
    x, flow = followed.points[0].z[:4], plane.build(omega, b)
    (dip, phase), *_ = grazings(flow, x, 1, symmetric=True)
    assert not dip.contact.tip
    assert dip.contact.side == 1
    image, H, at = half_period(omega, b, x, phase, dip.contact.side)
    assert image == pytest.approx(x, abs=1e-8)
    assert at == pytest.approx([b, 0.0], abs=1e-8)
    assert abs(np.linalg.det(np.eye(4) + H)) < 1e-6
