"""Bifurcation points against analytic ones and against an independent integrator."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from designer.base.arrays import Array
from designer.bifurcations.branch_survey import Survey, passes, survey
from designer.bifurcations.continuation import End, apart, start, trace
from designer.bifurcations.flow_family import Family
from designer.bifurcations.orbit_curve import Curve, Solved
from designer.bifurcations.points import Bifurcation, PointKind, locate
from designer.bifurcations.windows import NOT_LOCATED, all_windows, outside, window, windows
from designer.circuit.board_values import nominal_board
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.dynamics.turning_points import heights
from designer.model import swept_model
from designer.model.mechanics import SecondOrderSystem
from tests.bifurcations.test_continuation import PAPER, PLAIN, branch_of, linear_branch, monodromy
from tests.shared.exploring import quick
from tests.shared.oracles import Plain, integrate, response_amplitude
from tests.shared.paper_cases import subject


@cache
def first_cascade() -> Survey:
    """The paper's 1-1-1 from ω = 1.55 down to 1.28, its twins and their doubled orbits."""
    over = swept_model.of_model(PAPER, 1.55, "omega")
    return survey(over, [(1.55, settle(over.flow(1.55), np.zeros(4)))], 1.28, 1.6)


def point(found: Survey, kind: PointKind, near: float) -> Bifurcation:
    """The one point of a kind within 1e-3 of a value, on the first branch that has it."""
    return next(p for p in found.points if p.kind is kind and abs(p.value - near) < 1e-3)


def amplitude_at(omega: float) -> float:
    return float(np.abs(response_amplitude(PLAIN, omega)[0]))


def linear_orbit(omega: float) -> Orbit:
    """The symmetric response without impacts, from the linear amplitudes."""
    X = response_amplitude(PLAIN, omega)
    x = [X[0].imag, omega * X[0].real, X[1].imag, omega * X[1].real]
    return Orbit(OrbitStatus.PERIODIC, n=1, start=np.array(x))


def test_grazing_of_the_linear_response_is_where_its_amplitude_is_the_clearance() -> None:
    exact = float(brentq(lambda w: amplitude_at(w) - PAPER.b, 1.9, 4.0, xtol=1e-15))
    over = swept_model.of_model(PAPER, 1.0, "omega")
    free = start(over, linear_orbit(exact + 0.1), exact + 0.1, symmetric=True)
    branch = trace(free, exact - 0.05, exact + 0.2)
    grazed = next(p for p in branch.points if p.response == "1-1-1" and p.value < exact)
    back = trace(start(over, grazed.orbit, grazed.value), exact - 0.05, exact + 0.05)
    for one in (branch, back):
        found = [p for p in locate(one) if p.kind is PointKind.GRAZING]
        assert len(found) == 1
        assert {found[0].before, found[0].after} == {"1-1-1", "1-0-0"}
        assert abs(found[0].value - exact) < 1e-10


@pytest.mark.parametrize("omega", quick([0.7, 1.55, 2.2]))
def test_grazing_over_the_clearance(omega: float) -> None:
    exact = amplitude_at(omega)
    over = swept_model.of_model(PAPER, omega, "b")
    free = start(over, linear_orbit(omega), 1.02 * exact, symmetric=True)
    found = locate(trace(free, 0.98 * exact, 1.03 * exact))
    grazing = [p.value for p in found if p.kind is PointKind.GRAZING]
    assert grazing == pytest.approx([exact], rel=1e-10)


def test_a_linear_oscillator_has_no_bifurcations() -> None:
    assert locate(linear_branch()) == []


class Stalling(Curve):
    """Its orbits are off by 3e-10 of their size, and say so."""

    def correct(
        self, y0: Array, border: Array, along: Array | None = None, centre: Array | None = None
    ) -> Solved | None:
        solved = super().correct(y0, border, along, centre)
        off = np.append(3e-10 * solved.x, 0.0) if solved is not None else 0.0
        return solved and replace(solved, y=solved.y + off, residual=3e-10)


@pytest.mark.slow
def test_error_of_a_point_grows_with_what_newtons_method_left() -> None:
    exact = amplitude_at(1.55)
    over = swept_model.of_model(PAPER, 1.55, "b")
    free = start(over, linear_orbit(1.55), 1.02 * exact, symmetric=True)
    c = free.curve
    rough = replace(free, curve=Stalling(c.family, c.n, c.symmetric, c.scale))
    branch = trace(rough, 0.98 * exact, 1.03 * exact)
    found = [p for p in locate(branch) if p.kind is PointKind.GRAZING]
    assert found
    for p in found:
        assert 2e-11 < abs(p.value - exact) < p.error < 1e-8


def test_torus_where_an_oscillators_damping_vanishes() -> None:
    def build(c: float) -> Flow:
        one = np.ones((1, 1))
        system = SecondOrderSystem(np.ones(1), c * one, one, np.ones(1), ())
        return Flow(system.piecewise_linear(), Drive(2.3), fast=False)

    over = Family("c", -1.0, 1.0, build)
    branch = trace(start(over, settle(over.flow(0.2), np.zeros(2)), 0.2), -0.1, 0.3)
    found = locate(branch)
    assert [p.kind for p in found] == [PointKind.TORUS]
    assert abs(found[0].value) < 1e-11
    assert found[0].stable == (False, True)


def multiplier(p: Bifurcation, at: complex) -> complex:
    """The multiplier nearest to ``at``, by central differences of DOP853 at the point's orbit."""
    orbit = p.point.orbit
    found = np.linalg.eigvals(monodromy(PLAIN, p.value, orbit.start, orbit.n))
    return complex(found[np.argmin(np.abs(found - at))])


def rate(found: Survey, p: Bifurcation, at: complex) -> float:
    """How fast that multiplier changes with the parameter, from the branch's points about it."""
    branch = found.branches[p.branch]
    i = int(p.position)
    values = [
        q.orbit.multipliers[np.argmin(np.abs(q.orbit.multipliers - at))].real
        for q in branch.points[i : i + 2]
    ]
    return float(np.diff(values)[0] / np.diff(branch.values[i : i + 2])[0])


@pytest.mark.slow
def test_pitchfork_and_doubling_have_their_multiplier_by_an_independent_integrator() -> None:
    found = first_cascade()
    for kind, near, at in ((PointKind.PITCHFORK, 1.4605, 1.0), (PointKind.DOUBLING, 1.34995, -1.0)):
        p = point(found, kind, near)
        off = abs(multiplier(p, at) - at)
        assert off < 1e-5
        assert off / abs(rate(found, p, at)) < 1e-7  # central differences, error 1e-7
        x = p.point.orbit.start
        assert np.abs(integrate(PLAIN, p.value, list(x), 1).strobes[-1] - x).max() < 1e-10


def half_map(p: Plain, omega: float, x: Array) -> Array:
    """The mirrored half-period map by DOP853, the stop's law in the right-hand side."""
    solved = solve_ivp(
        lambda t, s: p.rhs(t, s, omega, p.side_of(s[0])),
        (0.0, np.pi / omega), x, method="DOP853", rtol=1e-13, atol=1e-15, max_step=0.02,
    )  # fmt: skip
    return np.asarray(-solved.y[:, -1])


@pytest.mark.slow
def test_pitchfork_is_the_half_period_multiplier_minus_one() -> None:
    p = point(first_cascade(), PointKind.PITCHFORK, 1.4605)
    x, step = p.point.orbit.start, 1e-4
    assert np.abs(half_map(PLAIN, p.value, x) - x).max() < 1e-10

    def least(omega: float, y: Array) -> float:
        """det(1 + H) by differences of the fourth order."""
        columns = []
        for e in np.eye(4):
            f = [half_map(PLAIN, omega, y + k * step * e) for k in (-2, -1, 1, 2)]
            columns.append((f[0] - 8.0 * f[1] + 8.0 * f[2] - f[3]) / (12.0 * step))
        return float(np.linalg.det(np.eye(4) + np.array(columns).T))

    branch = first_cascade().branches[p.branch]
    reach = 2e-8
    signs = []
    for value in (p.value - reach, p.value + reach):
        orbit = branch.curve.near(x, value)
        assert orbit is not None
        signs.append(least(value, orbit.x))
    assert signs[0] * signs[1] < 0.0


@pytest.mark.slow
def test_twins_meet_at_the_pitchfork() -> None:
    found = first_cascade()
    p = point(found, PointKind.PITCHFORK, 1.4605)
    child = next(b for b, q in zip(found.branches, found.parents, strict=True) if q == p.branch)
    assert child.ends[0] is End.JOINED
    near = [q for q in child.points if abs(q.value - p.value) < 2e-3][:6]
    squares = [float(np.sum(apart(child.curve, q) ** 2)) for q in near]
    fit = np.polynomial.Polynomial.fit(squares, [q.value for q in near], 2)
    assert abs(fit(0.0) - p.value) < 1e-6


@pytest.mark.slow
def test_no_branch_falls_back_onto_its_parent() -> None:
    over = swept_model.of_model(PAPER, 0.335, "omega")
    orbit = settle(over.flow(0.335), np.zeros(4))
    found = survey(over, [(0.335, orbit)], 0.314, 0.35, depth=1)
    assert len(found.branches) > 1
    for branch, parent in zip(found.branches, found.parents, strict=True):
        if parent >= 0:
            away = [np.abs(apart(branch.curve, p)).max() for p in branch.points[1:-1]]
            assert min(away) > 1e-7
    named = [(w.response, w.symmetric) for w in all_windows(found) if w.width > 1e-2]
    assert named == [("1-5-5", False), ("1-5-5", True)]


@pytest.mark.slow
def test_doubling_is_where_long_runs_change_their_period() -> None:
    p = point(first_cascade(), PointKind.DOUBLING, 1.34995)
    for shift, n in ((3e-3, 1), (-3e-3, 2)):
        omega = p.value + shift
        strobes = Flow(
            PAPER.second_order().piecewise_linear(), Drive(omega)
        ).run(p.point.orbit.start, 3000).strobes[-9:]  # fmt: skip
        assert np.abs(strobes[n:] - strobes[:-n]).max() < 1e-8
        assert n == 1 or np.abs(np.diff(strobes, axis=0)).max() > 1e-2


def tip(p: Plain, omega: float, x: Array, periods: int) -> float:
    """Signed height, over its stop, of the turning point nearest to a stop, by DOP853."""
    solved = solve_ivp(
        lambda t, s: p.rhs(t, s, omega, p.side_of(s[0])),
        (0.0, 2.0 * np.pi * periods / omega), x,
        method="DOP853", rtol=1e-13, atol=1e-15, max_step=0.01, dense_output=True,
    )  # fmt: skip
    y, sol = solved.y, solved.sol
    assert sol is not None
    best = np.inf
    for i in np.flatnonzero(np.diff(np.sign(y[1]))):
        ends = solved.t[i], solved.t[i + 1]
        turning = brentq(lambda t: sol(t)[1], *ends, xtol=1e-14)
        x1 = sol(turning)[0]
        for height in (x1 - p.b, -x1 - p.b):
            best = height if abs(height) < abs(best) else best
    return float(best)


@pytest.mark.slow
def test_grazing_within_a_cascade_by_an_independent_integrator() -> None:
    found = first_cascade()
    p = point(found, PointKind.GRAZING, 1.33931)
    assert {p.before, p.after} in ({"2-2-2", "2-2-3"}, {"2-2-2", "2-3-2"})
    curve = found.branches[p.branch].curve
    signs = []
    for value in (p.value - 1e-8, p.value + 1e-8):
        orbit = curve.near(p.point.orbit.start, value)
        assert orbit is not None
        signs.append(tip(PLAIN, value, orbit.x, 2))
    assert signs[0] * signs[1] < 0.0


def test_fold_ends_what_a_long_run_follows() -> None:
    branch = branch_of(PAPER, 0.85, "omega", 0.8, 0.95)
    p = next(q for q in locate(branch) if q.kind is PointKind.FOLD)
    assert p.direction == 0
    assert p.stable[0] != p.stable[1]
    x = p.point.orbit.start
    for shift, stays in ((-1e-4, True), (1e-4, False)):
        flow = Flow(PAPER.second_order().piecewise_linear(), Drive(p.value + shift))
        strobes = flow.run(x, 3000).strobes[-50:]
        assert bool(np.abs(strobes - x).max() < 0.1) is stays
    # Near a fold the branch is a parabola: twice as far from it, four times the parameter.
    i = int(p.position)
    for q in (branch.points[i - 1], branch.points[i + 2]):
        assert q.value < p.value


def test_heights_are_the_margins_of_the_exact_flow() -> None:
    flow = Flow(PAPER.second_order().piecewise_linear(), Drive(0.7))
    orbit = settle(flow, np.zeros(4))
    found = heights(flow, orbit)
    positive = found[found > 0.0]
    assert positive.max() == pytest.approx(orbit.extremes[0, 1] - PAPER.b, abs=1e-11)
    assert positive.min() == pytest.approx(orbit.penetration, abs=1e-11)
    assert len(positive) >= orbit.p + orbit.q


@pytest.mark.slow
def test_windows_are_what_settling_finds() -> None:
    found = all_windows(first_cascade())
    named = {(w.response, w.symmetric): w for w in found if w.width > 0.02}
    symmetric = named["1-1-1", True]
    assert symmetric.low.why == "pitchfork"
    assert symmetric.high.why == End.LIMIT
    twins = named["1-1-1", False]
    assert twins.high.value == symmetric.low.value
    assert twins.low.why == "period-doubling"
    for w in found:
        if w.width < 1e-4:
            continue
        middle = 0.5 * (w.low.value + w.high.value)
        branch = first_cascade().branches[w.branch]
        at = min(branch.points, key=lambda q: abs(q.value - middle) + 10.0 * (not q.stable))
        orbit = settle(
            Flow(PAPER.second_order().piecewise_linear(), Drive(at.value)), at.orbit.start
        )
        assert passes(branch, at.value, orbit, 1e-5)


def test_window_of_a_response_and_what_lies_outside() -> None:
    over = swept_model.of_model(PAPER, 0.215, "omega")
    orbit = settle(over.flow(0.215), np.zeros(4))
    assert orbit.response == "1-8-8"
    one = window(over, orbit, 0.215, 0.2, 0.25)
    assert (one.low.why, one.high.why) == ("pitchfork", "grazing")
    value, after = outside(over, one.high, 1.0)
    assert value > one.high.value
    assert after.response == "1-7-7"
    plain = one.as_dict()
    assert plain["from"] == one.low.value
    assert plain["to_kind"] == "grazing"


@cache
def below_1_6_6() -> Survey:
    """Symmetric 1-6-6 about ω = 0.28, and the twins that leave it at both ends."""
    over = swept_model.of_model(PAPER, 0.28, "omega")
    return survey(over, [(0.28, settle(over.flow(0.28), np.zeros(4)))], 0.27, 0.3, depth=1)


@pytest.mark.slow
def test_a_branch_begins_with_the_counts_of_the_orbit_that_it_leaves() -> None:
    found = below_1_6_6()
    children = [
        (b, found.branches[q]) for b, q in zip(found.branches, found.parents, strict=True) if q >= 0
    ]
    assert len(children) == 2
    for child, parent in children:
        assert child.ends[0] is End.JOINED
        assert np.abs(apart(child.curve, child.points[0])).max() < 1e-8
        assert passes(parent, child.points[0].value, child.points[0].orbit)
        assert child.points[0].response == "1-6-6"
    # Every change of counts on the way is a grazing point.
    for number, (child, _) in enumerate(children, 1):
        pairs = zip(child.points, child.points[1:], strict=False)
        changes = sum(a.counts != b.counts for a, b in pairs)
        assert sum(p.kind is PointKind.GRAZING for p in found.on(number)) == changes


@pytest.mark.slow
def test_window_behind_a_grazing_does_not_begin_at_the_pitchfork() -> None:
    one = next(w for w in all_windows(below_1_6_6()) if w.response in ("1-6-5", "1-5-6"))
    fork = next(
        p
        for p in below_1_6_6().points
        if p.kind is PointKind.PITCHFORK and p.stable == (True, False)
    )
    assert one.low.why == PointKind.FOLD
    assert one.low.value < fork.value - 1e-8
    # Both are attractors between the fold and the pitchfork, by running the flow.
    middle = 0.5 * (one.low.value + fork.value)
    flow = Flow(PAPER.second_order().piecewise_linear(), Drive(middle))
    for x, response in ((one.low.orbit.start, one.response), (fork.point.orbit.start, "1-6-6")):
        assert settle(flow, x).response == response


def test_windows_end_where_a_change_of_stability_was_not_located() -> None:
    branch = branch_of(PAPER, 1.55, "omega", 1.4, 1.6)
    fork = next(p for p in locate(branch) if p.kind is PointKind.PITCHFORK)
    (known,) = windows(branch, [fork])
    (guessed,) = windows(branch, [])
    assert known.high == guessed.high
    assert (known.low.why, guessed.low.why) == (PointKind.PITCHFORK, NOT_LOCATED)
    assert abs(guessed.low.value - fork.value) <= guessed.low.error
    assert guessed.low.error < 1e-2


@pytest.mark.slow
def test_windows_have_one_response_where_a_grazing_was_not_located() -> None:
    branch = branch_of(PAPER, 0.85, "omega", 0.76, 0.95)
    points = locate(branch)
    grazing = [p for p in points if p.kind is PointKind.GRAZING and p.stable == (True, True)]
    assert grazing
    whole = windows(branch, points)
    split = windows(branch, [p for p in points if p not in grazing])
    assert [w.response for w in split] == [w.response for w in whole]
    for p in grazing:
        ends = [e for w in split for e in (w.low, w.high) if e.why == NOT_LOCATED]
        assert min(abs(e.value - p.value) for e in ends) < 1e-8


def test_window_of_an_unstable_orbit_is_refused() -> None:
    branch = branch_of(PAPER, 1.55, "omega", 1.4, 1.6)
    unstable = branch.points[0]
    assert not unstable.stable
    over = swept_model.of_model(PAPER, 1.55, "omega")
    with pytest.raises(ArithmeticError, match="not stable"):
        window(over, unstable.orbit, unstable.value, 1.3, 1.6)


def test_survey_is_the_same_again_and_adds_nothing_for_known_orbits() -> None:
    over = swept_model.of_model(PAPER, 1.55, "omega")
    orbit = settle(over.flow(1.55), np.zeros(4))
    other = settle(over.flow(1.5), np.zeros(4))
    once = survey(over, [(1.55, orbit)], 1.45, 1.6, depth=0)
    twice = survey(over, [(1.55, orbit), (1.5, other)], 1.45, 1.6, depth=0)
    assert len(once.branches) == len(twice.branches)
    assert [p.as_dict() for p in once.points] == [p.as_dict() for p in twice.points]
    assert windows(once.branches[0], once.on(0))[0].response == "1-1-1"


@pytest.mark.slow
def test_a_board_folds_where_its_model_does() -> None:
    """Exact parts and ideal op-amps: the same equations in volts and seconds."""
    case = subject(2)
    circuit = case.reduction.circuit
    system = Reduction(circuit, nominal_board(circuit, ideal=True)).system()
    e = case.excitation
    over = Family(
        "frequency", 1.0, 1e5, lambda f: Flow(system, replace(e, frequency=f).drive, fast=False)
    )
    scale = e.frequency / 0.85
    board = trace(start(over, case.orbit, e.frequency), 0.8 * scale, 0.95 * scale)
    model = branch_of(PAPER, 0.85, "omega", 0.8, 0.95)
    found = [next(p for p in locate(b) if p.kind is PointKind.FOLD).value for b in (board, model)]
    assert found[0] / scale == pytest.approx(found[1], rel=1e-9)
