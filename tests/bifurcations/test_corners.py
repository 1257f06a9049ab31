"""Corners of laws, and stops whose force jumps, that an orbit comes to touch, against the closed
form of the linear motion that never passes them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve

from designer.base.arrays import Array
from designer.bifurcations.branch_survey import survey
from designer.bifurcations.conditions import grazings
from designer.bifurcations.grazing_contact import GrazingContact, height
from designer.bifurcations.plane_curves import PlaneCurve, PlaneWindow, continued
from designer.bifurcations.points import Bifurcation, PointKind
from designer.bifurcations.windows import all_windows
from designer.circuit.swept_board import BoardSubject
from designer.dynamics.attractors import settle
from designer.model.model_file import parse_model_file
from designer.model.swept_model import ModelSubject
from designer.plots.point_captions import caption
from tests.shared.rule_cases import HOLDING, bent
from tests.shared.system_text import clearance, system_text, table

JOINT = ("a", "ground")
STIFFENING = table(
    "law",
    name="F",
    between=list(JOINT),
    points=[[-2.0, -3.0], [-1.0, -1.0], [1.0, 1.0], [2.0, 3.0]],
)
"""A spring of 1 up to ± 1, of 2 beyond."""
DRAG = 'quantity = "velocity"\n'


def subject(law: str, spring: float, omega: float, amplitude: float) -> ModelSubject:
    """One mass on it and on a spring, with a damper of 0.2."""
    springs = {JOINT: spring} if spring else {}
    force = table("force", on="a", amplitude=amplitude)
    text = system_text({"a": 1.0}, springs, {JOINT: 0.2}, law, force)
    return ModelSubject(parse_model_file(text).model, omega)


def amplitude_at_corner(omega: float, spring: float = 1.0, damper: float = 0.2) -> float:
    """Of the force that moves the mass by 1."""
    return math.hypot(spring - omega**2, damper * omega)


HARD = [[-3.0, -5.5], [-2.0, -3.0], [-1.0, -1.0], [1.0, 1.0], [2.0, 3.0], [3.0, 5.5]]


def corners(points: tuple[Bifurcation, ...]) -> list[Bifurcation]:
    return [point for point in points if point.kind is PointKind.CORNER]


def test_the_corner_is_where_the_linear_motion_comes_to_it() -> None:
    """It ends no window, since the counts and the stability stay."""
    over = subject(STIFFENING, 0.0, 1.6, 1.0)
    family = over.family("omega")
    orbit = settle(family.flow(1.6), np.zeros(2))
    found = survey(family, [(1.6, orbit)], 1.45, 1.7, depth=0)
    assert corners(found.points) == []
    found = survey(family, [(1.6, orbit)], 1.36, 1.7, depth=0)
    (point,) = corners(found.points)
    assert point.value == pytest.approx(1.4, abs=1e-8)
    assert amplitude_at_corner(1.4) == pytest.approx(1.0, rel=1e-12)
    assert point.error < 1e-8
    assert point.stops == "F at 1 and F at -1"
    assert point.stable == (True, True)
    text = "corner of a force, F at 1 and F at -1, touched by 1-0-0 symmetric at ω = 1.4"
    assert caption(point, "ω").startswith(text)
    (window,) = all_windows(found)
    assert (window.low.value, window.high.value) == (1.36, 1.7)


def test_corners_that_six_digits_do_not_tell_apart_are_two() -> None:
    law = table(
        "law", name="F", between=list(JOINT), points=[[-1, 0], [1, 0], [1.000001, 1e-6], [2, 3]]
    )
    found = subject(law, 1.0, 0.8, 0.5).family("omega").flow(0.8).system.corners
    places = [each.corner.place for each in found if each.corner is not None]
    assert places == [1.0, 1.000001]
    assert {str(each.corner) for each in found} == {"F at 1"}


def test_a_corner_of_a_law_of_velocity() -> None:
    """At the resonance of the spring all of the force is that of the dampers."""
    points = [[-1.0, -0.3], [-0.5, -0.3], [0.5, 0.3], [1.0, 0.3]]
    law = table("law", name="drag", between=list(JOINT), points=points) + DRAG
    over = subject(law, 1.0, 1.0, 0.3)
    family = over.family("a.amplitude")
    orbit = settle(family.flow(0.3), np.zeros(2))
    found = survey(family, [(0.3, orbit)], 0.3, 0.5, depth=0)
    (point,) = corners(found.points)
    assert point.value == pytest.approx(0.3 + 0.2 * 0.5, abs=1e-8)
    assert point.stops == "drag at 0.5 and drag at -0.5"


def test_a_corner_of_a_law_on_a_board() -> None:
    """Where a spring of 7, which holds up to 0.5, lets the mass move by that, to within what the
    parts are off; the diodes of the stage, between which it bends, add no point of their own. Its
    curve over the generator's settings too."""
    design = bent(0.01).synthesis.design
    frequency = design.errors.scales.frequency
    board = BoardSubject(design, frequency(1.2))
    family, volts = board.family("amplitude"), board.amplitude
    orbit = settle(family.flow(2.5 * volts), np.zeros(2))
    found = survey(family, [(2.5 * volts, orbit)], 2.5 * volts, 2.8 * volts, depth=0).points
    (point,) = corners(found)
    assert point.stops == "K at 0.5"
    window = PlaneWindow((2.5 * volts, 3.1 * volts), (frequency(1.0), frequency(1.4)))
    plane = board.plane("amplitude", "frequency")
    curve = continued(plane, point, frequency(1.2), window)
    assert curve is not None
    assert set(curve.ends) == {"edge of frequency"}
    assert len(curve.points) > 10
    for given, hertz in [(point.value, frequency(1.2)), *curve.values]:
        omega = 2.0 * math.pi * hertz * design.errors.scales.seconds
        wanted = 0.5 * amplitude_at_corner(omega, 7.0)
        assert given / volts == pytest.approx(wanted, rel=2.0 * design.errors.max_error)


LAWS = {
    "one bend": HOLDING,
    "limits": ((-1.0, -0.3), (-0.5, -0.3), (0.5, 0.3), (1.0, 0.3)),
    "hardens": ((-1.0, -3.3), (-0.5, -0.3), (0.5, 0.3), (1.0, 3.3)),
    "two bends": ((-1.0, -1.3), (-0.5, -0.3), (0.5, 0.3), (0.8, 1.2), (1.0, 3.3)),
}


@pytest.mark.parametrize("law", LAWS)
def test_the_motion_on_either_side_of_a_corner_on_a_board(law: str) -> None:
    """A tip is of the mode within and a dip of that beyond, on whichever side of the corner, or
    between the two diodes, the motion is: the modes that hold where no diode of the stage is about
    to turn."""
    board = BoardSubject(bent(0.01, LAWS[law]).synthesis.design, 200.0)
    flow, system = board.family("amplitude").flow(board.amplitude), board.system
    period, first = flow.drive.period, len(system.clearances)
    assert len(system.corners) == len(LAWS[law]) - 2
    for k, corner in enumerate(system.corners):
        place = -corner.e * corner.C / (corner.C @ corner.C)
        states = [share * place for share in (0.999, 1.000001, 1.001)]
        keys = [flow.mode_at(x, 0.0) for x in states]
        assert len(set(keys)) == 3
        within, _, beyond = map(system.mode, keys)
        assert system.modes_beyond[k] is beyond
        for x in states:
            for tip, mode in ((True, within), (False, beyond)):
                found = height(flow, x, 1, GrazingContact(first + k, 1, tip), 0.0)
                rate = mode.A @ x + mode.d
                bend = mode.A @ rate + mode.B * flow.drive.amplitude * flow.drive.omega
                wanted = [corner.C @ x + corner.e, period * corner.C @ rate]
                assert found == pytest.approx([*wanted, period**2 * corner.C @ bend], rel=1e-9)


def test_a_branch_that_ends_where_a_stop_pushes_at_once() -> None:
    """It touches the stop where the linear motion does, and no orbit of its period goes on."""
    gap = clearance("S", *JOINT, upper=1.26, stiffness=29.0, preload=1.0)
    force = table("force", on="a", amplitude=0.5)
    text = system_text({"a": 1.0}, {JOINT: 1.0}, {JOINT: 0.1}, gap, force)
    over = ModelSubject(parse_model_file(text).model, 0.77)
    family = over.family("omega")
    orbit = settle(family.flow(0.77), np.zeros(2))
    found = survey(family, [(0.77, orbit)], 0.76, 0.8, depth=0)
    (point,) = found.points

    def off(omega: float) -> float:
        return 1.26 * amplitude_at_corner(omega, damper=0.1) - 0.5

    wanted = float(brentq(off, 0.77, 0.8, xtol=1e-14))
    assert point.error < 1e-8
    assert point.value == pytest.approx(wanted, abs=2.0 * point.error)
    assert (point.kind, point.before, point.after) == (PointKind.GRAZING, "1-0-0", "")
    (window,) = all_windows(found)
    assert (window.low.value, window.high.point) == (0.76, point)
    said = "1-0-0 symmetric below; beyond no orbit of its period was found; stable below, unstable"
    assert said in caption(point, "ω")


HANGING = table("law", name="F", between=list(JOINT), points=[[-1, 0], [0.7, 0], [2, 1]])
"""No force up to 0.7."""


@pytest.mark.slow
def test_a_corner_of_a_law_that_a_sweep_moves() -> None:
    """It is touched where it stands at the amplitude of the linear motion, over two parameters
    where this is so at every force."""
    over, amplitude = subject(HANGING, 1.0, 0.8, 0.5), 0.5 / amplitude_at_corner(0.8)
    family = over.family("F.x2")
    orbit = settle(family.flow(1.5), np.zeros(2))
    found = survey(family, [(1.5, orbit)], amplitude - 0.1, 1.9, depth=0)
    (point,) = corners(found.points)
    assert point.value == pytest.approx(amplitude, rel=1e-9)
    assert f"at F.x2 = {amplitude:.9g}: stable on both sides" in caption(point, "F.x2")
    plane, window = over.plane("F.x2", "a.amplitude"), PlaneWindow((0.3, 1.9), (0.1, 0.8))
    curve = continued(plane, point, 0.5, window)
    assert curve is not None
    assert len(curve.points) > 10
    for place, force in curve.values:
        assert force == pytest.approx(place * amplitude_at_corner(0.8), rel=1e-7)


def test_the_curve_of_a_corner_to_the_edge_of_what_two_points_may_be() -> None:
    """The corner stays where the linear motion has its amplitude, whatever the point behind it is;
    a step beyond the edge would put the one behind the other."""
    law = table(
        "law", name="F", between=list(JOINT), points=[[-2, 0], [0.5, 0], [4, 0.1], [9, 0.2]]
    )
    over, amplitude = subject(law, 1.0, 0.8, 0.6), 0.6 / amplitude_at_corner(0.8)
    family = over.family("F.x2")
    orbit = settle(family.flow(1.8), np.zeros(2))
    (point,) = corners(survey(family, [(1.8, orbit)], amplitude - 0.1, 1.9, depth=0).points)
    window = PlaneWindow((0.3, amplitude + 5e-4), (amplitude + 6e-4, 4.1))
    curve = continued(over.plane("F.x2", "F.x3"), point, 4.0, window)
    assert curve is not None
    assert curve.ends == ("edge of F.x3", "edge of F.x3")
    assert curve.values[:, 0] == pytest.approx(amplitude, rel=1e-7)
    plane = over.plane("F.x2", "F.x3")
    pairs = [(5.0, 7.0), (-1.0, 0.0), (7.0, 5.0), (-2.5, 0.0), (1.0, 9.5)]
    assert [plane.contains(*pair) for pair in pairs] == [True, True, False, False, False]


def test_a_domain_that_another_parameter_bounds() -> None:
    """A static friction below that of sliding is refused: a branch is followed up to it."""
    friction = {"force": 0.3, "static": 0.4, "velocity": 0.1, "stribeck": 0.5}
    over = subject(table("friction", between=list(JOINT), **friction), 1.0, 0.7, 1.0)
    family = over.family("a-ground.static")
    assert [family.contains(value) for value in (0.3, 0.299)] == [True, False]
    orbit = settle(family.flow(0.4), np.zeros(2))
    found = survey(family, [(0.4, orbit)], 0.3, 0.45, depth=0)
    (window,) = all_windows(found)
    assert (window.low.value, window.high.value) == pytest.approx((0.3, 0.45), abs=1e-8)


def curve_of_corner(
    over: ModelSubject, start: float, ends: tuple[float, float], window: PlaneWindow
) -> PlaneCurve:
    """That of the one corner on the branch of what is reached from rest at a frequency."""
    family = over.family("omega")
    orbit = settle(family.flow(start), np.zeros(2))
    (point,) = corners(survey(family, [(start, orbit)], *ends, depth=0).points)
    curve = continued(over.plane("omega", "a.amplitude"), point, 1.0, window)
    assert curve is not None
    return curve


@pytest.mark.slow
def test_the_curve_of_a_corner_over_two_parameters() -> None:
    over = subject(STIFFENING, 0.0, 1.6, 1.0)
    curve = curve_of_corner(over, 1.6, (1.36, 1.7), PlaneWindow((1.2, 1.7), (0.6, 1.8)))
    assert curve.kind is PointKind.CORNER
    assert set(curve.ends) == {"edge of a.amplitude"}
    assert len(curve.points) > 10
    for omega, amplitude in curve.values:
        assert amplitude == pytest.approx(amplitude_at_corner(omega), rel=1e-7)
    assert curve.codimension_two == ()


def test_a_velocity_that_is_largest_where_a_damped_stop_is_met() -> None:
    """It turns at a kink, for the damper's force jumps there: by another integrator it is that of
    the corner. No smooth equation holds along its curve, so none is begun."""
    points = [[-9.0, -0.9], [1.5, 0.15], [9.0, 1.65]]
    law = table("law", name="drag", between=list(JOINT), points=points) + DRAG
    gap = clearance("S", *JOINT, upper=0.3, stiffness=2.0, damping=3.0)
    force = table("force", on="a", amplitude=1.0, constant=1.0)
    text = system_text({"a": 1.0}, {JOINT: 1.0}, {JOINT: 0.2}, law, gap, force)
    over, omega = ModelSubject(parse_model_file(text).model, 0.8), 0.8
    family = over.family("a.amplitude")
    orbit = settle(family.flow(1.45), np.zeros(2))
    (point,) = corners(survey(family, [(1.45, orbit)], 1.4, 1.6, depth=0).points)
    assert point.stops == "drag at 1.5"
    assert point.error < 1e-8

    def rates(t: float, x: Array) -> Array:
        pushed = 2.0 * (x[0] - 0.3) + 3.0 * x[1] if x[0] > 0.3 else 0.0
        drag = 0.1 * x[1] + 0.1 * max(x[1] - 1.5, 0.0)
        drive = 1.0 + point.value * math.sin(omega * t)
        return np.array([x[1], drive - 0.2 * x[1] - x[0] - drag - pushed])

    def met(_: float, x: Array) -> float:
        return float(x[0] - 0.3)

    start, period = point.point.solved.x, 2.0 * math.pi / omega
    kept = solve_ivp(
        rates, (0.0, period), start, "DOP853", rtol=1e-10, atol=1e-12, events=met, max_step=0.005
    )
    assert kept.y[:, -1] == pytest.approx(start, abs=1e-6)
    assert kept.y_events is not None
    assert kept.y_events[0][:, 1].max() == pytest.approx(1.5, abs=1e-6)
    assert kept.y[1].max() < 1.5 + 1e-6
    window = PlaneWindow((1.4, 1.6), (0.7, 0.9))
    assert continued(over.plane("a.amplitude", "omega"), point, omega, window) is None


@pytest.mark.slow
def test_a_fold_on_the_curve_of_a_corner() -> None:
    """A spring that hardens past ± 1, and once more past ± 2: twice a motion that just comes to 2
    has a multiplier 1, by another integrator. The curve of the fold sees it too."""
    hard = table("law", name="F", between=list(JOINT), points=HARD)
    over = subject(hard, 0.0, 1.0, 0.8)
    family = over.family("omega")
    orbit = settle(family.flow(1.0), np.zeros(2))
    found = survey(family, [(1.0, orbit)], 0.98, 1.4, depth=0).points
    point, plane = corners(found)[0], over.plane("omega", "a.amplitude")
    assert point.stops == "F at 2 and F at -2"
    window = PlaneWindow((1.0, 1.4), (0.4, 1.0))
    curve = continued(plane, point, 0.8, window)
    assert curve is not None
    met = curve.codimension_two
    assert [each.name for each in met] == ["corner meets fold"] * 2
    folds = continued(plane, next(p for p in found if p.kind is PointKind.FOLD), 0.8, window)
    assert folds is not None
    seen = [each for each in folds.codimension_two if each.name == "corner meets fold"]
    assert all(each.other is None for each in seen)
    for each in seen:
        assert any(each.values == pytest.approx(same.values, abs=1e-6) for same in met)
    assert seen
    for each in met:
        omega, amplitude = each.values

        def rates(t: float, x: Array, omega: float = omega, a: float = amplitude) -> Array:
            spring = x[0] + math.copysign(max(abs(x[0]) - 1.0, 0.0), x[0])
            return np.array([x[1], a * math.sin(omega * t) - 0.2 * x[1] - spring])

        def image(x: Array, omega: float = omega) -> tuple[Array, float]:
            times = np.linspace(0.0, 2.0 * math.pi / omega, 4001)
            kept = solve_ivp(rates, (0.0, times[-1]), x, "DOP853", times, rtol=1e-11, atol=1e-12)
            return kept.y[:, -1], float(np.abs(kept.y[0]).max())

        start = each.point.z[:2]
        end, largest = image(start)
        assert end == pytest.approx(start, abs=1e-7)
        assert largest == pytest.approx(2.0, abs=1e-5)
        steps = 1e-5 * np.eye(2)
        columns = [(image(start + d)[0] - image(start - d)[0]) / 2e-5 for d in steps]
        multipliers = np.linalg.eigvals(np.array(columns).T)
        assert np.abs(multipliers - 1.0).min() < 1e-4


@pytest.mark.slow
def test_where_a_preload_has_risen() -> None:
    """A stop's push that has come to its end bends the force: by another integrator the motion just
    reaches there."""
    gap = clearance("S", *JOINT, upper=0.3, stiffness=2.0, preload=0.4, preload_over=0.25)
    force = table("force", on="a", amplitude=1.0)
    text = system_text({"a": 1.0}, {JOINT: 1.0}, {JOINT: 0.2}, gap, force)
    over, omega = ModelSubject(parse_model_file(text).model, 0.8), 0.8
    family = over.family("a.amplitude")
    orbit = settle(family.flow(0.2), np.zeros(2))
    (point,) = corners(survey(family, [(0.2, orbit)], 0.2, 0.9, depth=0).points)
    assert point.stops == "S at 0.55"
    assert caption(point, "P").startswith(
        "corner of a force, S at 0.55, touched by 1-1-0 asymmetric"
    )

    def rates(t: float, x: Array) -> Array:
        depth = max(x[0] - 0.3, 0.0)
        pushed = 2.0 * depth + 1.6 * min(depth, 0.25)
        return np.array([x[1], point.value * math.sin(omega * t) - 0.2 * x[1] - x[0] - pushed])

    start, period = point.point.solved.x, 2.0 * math.pi / omega
    kept = solve_ivp(rates, (0.0, period), start, "DOP853", rtol=1e-11, atol=1e-12, max_step=0.002)
    assert kept.y[:, -1] == pytest.approx(start, abs=1e-7)
    assert kept.y[0].max() == pytest.approx(0.55, abs=1e-6)
    curve = continued(
        over.plane("a.amplitude", "omega"), point, omega, PlaneWindow((0.2, 1.5), (0.6, 0.9))
    )
    assert curve is not None
    assert set(curve.ends) == {"edge of omega"}


@pytest.mark.slow
def test_the_curve_of_a_corner_ends_where_the_turning_point_does() -> None:
    """A law so weak that the motion is linear: the lower of two maxima comes to 1, and is no more
    where height, rate and curvature of a sine and its third harmonic say so."""
    weak = table("law", name="F", between=list(JOINT), points=[[0, 0], [1, 1], [2, 2 + 1e-8]])
    force = table("force", on="a", amplitude=1.0, harmonics=[[3, 0.3, 0.0]])
    text = system_text({"a": 1.0}, {}, {JOINT: 0.2}, weak, force)
    over = ModelSubject(parse_model_file(text).model, 0.358)
    curve = curve_of_corner(over, 0.358, (0.355, 0.365), PlaneWindow((0.34, 0.4), (0.9, 3.2)))
    assert "degenerate corner" in curve.ends

    def off(at: Array) -> Array:
        phase, omega, amplitude = at
        waves = [
            size * np.exp(1j * n * phase) / (1.0 - (n * omega) ** 2 + 0.2j * n * omega)
            for n, size in ((1, amplitude), (3, 0.3))
        ]
        orders = np.array([1j, 3j])
        return np.array([(orders**d @ waves).imag - (d == 0) for d in range(3)])

    _, *wanted = fsolve(off, [2.8, 0.37, 2.5], xtol=1e-12)
    (end,) = [each for each in curve.codimension_two if each.name == "degenerate corner"]
    assert end.values == pytest.approx(wanted, rel=1e-5)


@pytest.mark.slow
def test_the_curves_of_two_corners_meet() -> None:
    """Of laws so weak that both masses move as the linear system does."""
    masses, springs = {"a": 1.0, "b": 2.0}, {JOINT: 1.0, ("a", "b"): 0.5, ("b", "ground"): 1.5}
    dampers = {JOINT: 0.2, ("b", "ground"): 0.1}
    weak = [
        table(
            "law", name=name, between=[name.lower(), "ground"], points=[[0, 0], [x, 0], [9, 1e-9]]
        )
        for name, x in (("A", 1.0), ("B", 0.7))
    ]
    text = system_text(masses, springs, dampers, *weak, table("force", on="a", amplitude=1.0))

    def reached(omega: float) -> Array:
        K = np.array([[1.5, -0.5], [-0.5, 2.0]]) + 1j * omega * np.diag([0.2, 0.1])
        moved = np.linalg.solve(K - omega**2 * np.diag([1.0, 2.0]), [1.0, 0.0])
        return np.asarray(np.abs(moved) / [1.0, 0.7])

    wanted = brentq(lambda w: float(np.subtract(*reached(w))), 0.6, 1.1)
    over = ModelSubject(parse_model_file(text).model, 0.79)
    family = over.family("a.amplitude")
    orbit = settle(family.flow(0.5), np.zeros(4))
    found = corners(survey(family, [(0.5, orbit)], 0.5, 0.7, depth=0).points)
    assert [each.stops for each in found] == ["A at 1", "B at 0.7"]
    window = PlaneWindow((0.5, 0.65), (0.78, 0.82))
    curve = continued(over.plane("a.amplitude", "omega"), found[0], 0.79, window)
    assert curve is not None
    (met,) = curve.codimension_two
    assert met.name == "two corners"
    assert met.values == pytest.approx((1.0 / reached(wanted)[0], wanted), rel=1e-6)


def test_a_symmetric_orbit_touches_a_corner_and_its_image_as_one() -> None:
    """The largest and the least displacement, half a period apart: whichever half of the orbit the
    followed one is in, the other is no second touch."""
    flow = subject(STIFFENING, 0.0, 1.4, 1.0).family("omega").flow(1.4)
    assert [str(guard.corner) for guard in flow.system.corners] == ["F at 1", "F at -1"]
    start = settle(flow, np.zeros(2)).start
    every = grazings(flow, start, 1, corners=True)
    tips = [(each, phase) for each, phase in every if each.contact.tip]
    assert sorted(each.contact.clearance for each, _ in tips) == [0, 1]
    assert abs(tips[0][1] - tips[1][1]) == pytest.approx(0.5, abs=1e-9)
    for own in tips:
        for symmetric in (True, False):
            others = grazings(flow, start, 1, own, symmetric=symmetric, corners=True)
            assert not any(each.contact.tip for each, _ in others)


def test_pieces_of_a_curve_have_no_corners() -> None:
    """Where they lie says nothing of the curve."""
    cubic = table("cubic_spring", between=list(JOINT), k1=1.0, k3=0.5, range=2.0, points=8)
    assert subject(cubic, 0.0, 1.6, 1.0).family("omega").flow(1.6).system.corners == ()
