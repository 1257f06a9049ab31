"""Piecewise-linear laws, cubic springs and friction: what they stand for, and what is refused."""

from __future__ import annotations

import json
import math
import re
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.optimize import minimize

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.laws.force_law import ForceLaw
from designer.laws.law_elements import cubic_error, cubic_points, points_for
from designer.model.clearance import Side
from designer.model.lumped_system import LumpedSystem
from designer.model.mechanics import SecondOrderSystem
from designer.model.model_file import parse_model_file
from designer.model.relative_motion import shown_stops
from tests.shared.system_text import clearance, system_text, table

PLACES = st.lists(st.integers(-40, 40), min_size=2, max_size=9, unique=True).map(sorted)
FORCES = st.lists(st.integers(-30, 30), min_size=9, max_size=9)
ONE = system_text({"a": 1.5}, {("a", "ground"): 2.0}, {("a", "ground"): 0.1})
FORCE = table("force", on="a", amplitude=1.0)
GROUNDED = ("a", "ground")


def straight_on(points: tuple[tuple[float, float], ...], at: float) -> float:
    """The force at one x, looked up piece by piece."""
    pieces = list(pairwise(points))
    inner = [p for p in pieces if p[0][0] <= at < p[1][0]]
    (x0, f0), (x1, f1) = inner[0] if inner else pieces[0] if at < points[0][0] else pieces[-1]
    return f0 + (f1 - f0) * (at - x0) / (x1 - x0)


def model(*more: str) -> LumpedSystem:
    found = parse_model_file(ONE + FORCE + "".join(more)).model
    assert isinstance(found, LumpedSystem)
    return found


@pytest.mark.slow
@given(PLACES, FORCES, st.sampled_from([1.0, 0.4, 3.0]))
def test_what_joins_in_at_the_corners_makes_the_force(
    places: list[int], forces: list[int], factor: float
) -> None:
    points = tuple((x / 8.0, f / 4.0) for x, f in zip(places, forces, strict=False))
    law = ForceLaw("L", (1.0,), "displacement", points)
    for x in np.linspace(-7.0, 7.0, 113):
        expected = straight_on(points, x)
        assert law.force(np.array(x)) == pytest.approx(expected, abs=1e-9 * (1.0 + abs(expected)))
        scaled = law.scaled(factor).force(np.array(factor * x))
        assert scaled == pytest.approx(factor * expected, abs=1e-8 * (1.0 + abs(expected)))
    mirrored = ForceLaw("L", (1.0,), "displacement", tuple((-x, -f) for x, f in points[::-1]))
    grid = np.linspace(-7.0, 7.0, 113)
    if law.even:
        np.testing.assert_allclose(law.force(grid), mirrored.force(grid), atol=1e-9)
    assert mirrored.reach == law.reach


@pytest.mark.parametrize("unit", [1.0, 1e-4, 0.3])
def test_a_point_where_the_slope_stays_is_no_corner(unit: float) -> None:
    """Nor does it break a symmetry, and a small change of the slope is none of rounding."""
    places = [-3.0, -1.0, 0.1, 1.0, 3.0, 4.0]
    points = tuple((unit * x, 7.0 * unit * (x if x < 4.0 else 9.0)) for x in places)
    one = ForceLaw("L", (1.0,), "displacement", points)
    assert one.corners == (3.0 * unit,)
    ((_, change),) = one.bends[1]
    assert change == pytest.approx(35.0)
    line = ForceLaw("L", (1.0,), "displacement", points[:5])
    assert (line.corners, line.even) == ((), True)
    assert line.slope == pytest.approx(7.0)
    bent = ForceLaw("L", (1.0,), "displacement", ((-1.0, -1.0), (0.5, 0.5), (1.0, 1.0 + 1e-9)))
    assert bent.corners == (0.5,)


@pytest.mark.parametrize(("k1", "k3"), [(0.0, 1.0), (1.0, 2.0), (-1.0, 1.0), (2.0, -0.3)])
@pytest.mark.parametrize("count", [2, 4, 8, 20])
def test_pieces_of_a_cubic_miss_it_by_what_they_say(k1: float, k3: float, count: int) -> None:
    x = np.linspace(-1.3, 1.3, 200_001)
    law = ForceLaw("L", (1.0,), "displacement", cubic_points(k1, k3, 1.3, count))
    cubic = k1 * x + k3 * x**3
    missed = np.abs(law.force(x) - cubic).max() / np.abs(cubic).max()
    assert missed == pytest.approx(cubic_error(k1, k3, 1.3, count), rel=1e-6)
    assert law.even
    assert len(law.points) == count


def test_no_other_pieces_of_a_cubic_are_better() -> None:
    """An optimiser that may put two corners, and the force there and at the end, where it likes."""
    x = np.linspace(0.0, 1.0, 4001)

    def largest(values: Array) -> float:
        (a, b), forces = np.sort(values[:2]), values[2:]
        return float(np.abs(np.interp(x, [0.0, a, b, 1.0], [0.0, *forces]) - x**3).max())

    ours = cubic_points(0.0, 1.0, 1.0, 6)[3:]
    begun = np.array([0.5, 0.8, 0.1, 0.5, 1.0])
    for start in (begun, np.array([ours[0][0], ours[1][0], *(f for _, f in ours)])):
        found = minimize(largest, start, method="Nelder-Mead", tol=1e-12)
        assert found.fun > 0.999 * cubic_error(0.0, 1.0, 1.0, 6)


def test_the_fewest_points_for_an_error() -> None:
    count = points_for(1.0, 1.0, 2.0, 0.01)
    assert count is not None
    assert cubic_error(1.0, 1.0, 2.0, count) <= 0.01 < cubic_error(1.0, 1.0, 2.0, count - 2)
    assert points_for(0.0, 1.0, 1.0, 1e-6) is None


def test_elements_of_a_file_become_laws() -> None:
    system = model(
        table("cubic_spring", between=GROUNDED, k1=-0.5, k3=0.25, range=2.0, points=6),
        table("friction", between=("ground", "a"), force=0.3, velocity=0.1, speed=0.25),
        table("law", name="L", between=GROUNDED, points=[[-1, -2], [1, 2], [2, 2]]),
    ).second_order()
    by_name = {law.name: law for law in system.laws}
    assert set(by_name) == {"L", "a-ground.cubic", "ground-a.friction"}
    assert by_name["ground-a.friction"].row == (-1.0,)
    sliding = by_name["ground-a.friction"].force(np.array([-9.0, 0.25, 9.0]))
    assert sliding == pytest.approx([-0.3, 0.0, 0.3])
    # What is at rest is in the matrices: 2 of the spring, -0.5 + 0.25 of the cubic one's first
    # piece, 2 of the law; the belt drags at rest.
    cubic = by_name["a-ground.cubic"]
    assert system.stiffness[0, 0] == pytest.approx(2.0 + cubic.slope + 2.0)
    assert system.damping[0, 0] == pytest.approx(0.1)
    assert system.constant == pytest.approx([-0.3])


def test_elements_between_the_same_bodies_add_up() -> None:
    springs = [table("cubic_spring", between=GROUNDED, k3=k, range=2.0) for k in (1.0, 0.5)]
    frictions = [
        table("friction", between=GROUNDED, force=f, velocity=v)
        for f, v in ((0.3, 0.1), (0.2, 1.0))
    ]
    laws = model(*springs, *frictions).second_order().laws
    x = np.linspace(-3.0, 3.0, 61)
    alone = [model(one).second_order().laws[0].force(x) for one in (*springs, *frictions)]
    assert len({law.name for law in laws}) == 4
    np.testing.assert_allclose(sum(law.force(x) for law in laws), sum(alone), atol=1e-12)


def test_static_friction_falls_to_that_of_sliding() -> None:
    friction = {"force": 0.3, "static": 0.5, "velocity": 0.1, "stribeck": 0.4}
    (law,) = model(table("friction", between=GROUNDED, **friction)).second_order().laws
    at = np.array([0.05, 0.1, 0.25, 0.4, 5.0])
    assert law.force(at) == pytest.approx([0.25, 0.5, 0.4, 0.3, 0.3])
    assert law.force(-at) == pytest.approx(-law.force(at))


def test_units_make_a_file_of_si_values() -> None:
    points = [["-1 mm", "-20 N"], ["1 mm", "20 N"], ["3 mm", "21 N"]]
    text = ONE + FORCE + table("law", name="L", between=GROUNDED, points=points)
    found = parse_model_file(text)
    assert found.si is not None
    (law,) = found.model.second_order().laws
    assert law.points == ((-1e-3, -20.0), (1e-3, 20.0), (3e-3, 21.0))
    plain = [[-1, -2], [1, 2]]
    assert parse_model_file(ONE + FORCE + table("law", name="L", of={"a": 2}, points=plain).replace(
        '{"a": 2}', "{ a = 2 }"
    )).si is None  # fmt: skip


def test_files_without_laws_keep_their_hashes() -> None:
    assert not {"laws", "cubic_springs", "frictions"} & model().as_dict().keys()
    spring = table("cubic_spring", between=GROUNDED, k3=1.0, range=2.0)
    assert "cubic_springs" in json.dumps(model(spring).as_dict())


def test_numbers_of_laws_are_parameters() -> None:
    text = table("cubic_spring", between=GROUNDED, k3=1.0, range=2.0)
    text += table("friction", between=GROUNDED, force=0.3, velocity=0.1)
    changed = model(text).changed({"a-ground.k3": 2.5, "a-ground.force": 0.0})
    assert changed.cubic_springs[0].k3 == 2.5
    assert changed.frictions[0].force == 0.0
    assert model(text).places["a-ground.velocity"] == ("friction", 0, "velocity")


def test_points_of_laws_are_parameters() -> None:
    points = [[-1, -2], [1, 2], [3, 3]]
    system = model(law(points=points), law(name="D", quantity="velocity", points=points))
    assert system.places["L.f3"] == ("law", 0, "points", 2, 1)
    units = {name: text for name, text in system.units.items() if name[0] in "LD"}
    assert units == {
        **{f"{name}.f{i}": "N" for name in "LD" for i in (1, 2, 3)},
        **{f"{name}.x{i}": unit for name, unit in (("L", "m"), ("D", "m/s")) for i in (1, 2, 3)},
    }
    both = {"L.x2": 3.5, "L.x3": 4.0, "D.f1": -1.5}
    moved = [[-1, -2], [3.5, 2], [4, 3]], [[-1, -1.5], [1, 2], [3, 3]]
    again = model(law(points=moved[0]), law(name="D", quantity="velocity", points=moved[1]))
    assert system.changed(both) == again
    assert [system.changed(both).parameter(name) for name in both] == list(both.values())
    low, high = system.parameters["L.x2"]
    assert system.changed({"L.x2": low}) != system != system.changed({"L.x2": high})
    assert (low, high) == pytest.approx((-1.0, 3.0), abs=1e-5)
    for beyond in (-1.0, 3.0, math.nan):
        with pytest.raises(InputError, match=r"by rising x|a number"):
            system.changed({"L.x2": beyond})
    with pytest.raises(InputError, match=r"slope -0\.5 beyond its points"):
        system.changed({"D.f3": 1.0})


def test_a_file_has_the_points_that_it_is_given() -> None:
    text = ONE + FORCE + law(points=[["-1 mm", -2], ["1 mm", "2 N"], [0.003, 3]])
    moved = parse_model_file(text).with_({"L.x2": "0.5 mm", "L.f2": 1.5, "L.x3": 0.004})
    assert moved.data["law"][0]["points"] == [["-1 mm", -2], ["0.5 mm", "1.5 N"], [0.004, 3]]
    with pytest.raises(InputError, match=r"L\.x2: found None"):
        moved.with_({"L.x2": None})


def law(**keys: object) -> str:
    return table("law", **{"name": "L", "between": GROUNDED, "points": [[-1, -2], [1, 2]], **keys})


@pytest.mark.parametrize(
    ("text", "field", "expected"),
    [
        (law(points=[[1, 2]]), "law[1].points", "two to 64 points"),
        (law(points=[[1, 2], [1, 3]]), "law[1].points", "x does not rise"),
        (law(points=[[0, 0], [1, "2 kg"]]), "law[1].points", "two to 64 points"),
        (law(points=[[0, 0], [1, "2 m"]]), "law[1].points", "write the unit N"),
        (law(points=[[-1e300, -1e300], [1e300, 1e300]]), "law L.points", "numbers from"),
        (law(points=[[0, 0], [1e-59, 1e9]]), "law L.points", "slopes up to"),
        (
            table("cubic_spring", between=GROUNDED, k3=1.0, range=1e200),
            "cubic_spring a-ground.range",
            "a number from",
        ),
        (
            table("cubic_spring", between=GROUNDED, k3=1.0, range=2.0, points=[[1, 1], [2, 2]]),
            "cubic_spring[1].points",
            "an even whole number",
        ),
        (
            table("friction", between=GROUNDED, force=0.3, velocity=0.1, speed="3 m"),
            "friction[1].speed",
            "write the unit m/s",
        ),
        (law(points=[["0 m", 0], ["1 m/s", 2]]), "law[1].points", "x in m and in m/s"),
        (law(points=[["0 m/s", 0], ["1 m/s", 2]]), "law L.points", "x in m: "),
        (law(between=["a", "b"]), "law.between", "one of a, ground"),
        (
            law(of={})
            .replace("of = {}", "of = { ground = 1.0 }")
            .replace('between = ["a", "ground"]\n', ""),
            "law L.of",
            "masses: ground",
        ),
        (law(name="a"), "law.name", "no other mass, clearance or law"),
        (law(of={"a": 1}).replace('{"a": 1}', "{ a = 1 }"), "law L.between", "or of ="),
        (law().replace('between = ["a", "ground"]\n', ""), "law L.between", "between = [A, B]"),
        (law(points=[[-1, 4], [1, -4]]), "law L", "springs and laws hold"),
        (law(quantity="velocity", points=[[-1, 4], [1, -4]]), "law L", "do not drive a motion"),
        (
            table("cubic_spring", between=GROUNDED, k3=-1.0, range=2.0),
            "law a-ground.cubic",
            "springs and laws hold",
        ),
        (
            table("cubic_spring", between=GROUNDED, k3=1.0, range=2.0, points=3),
            "cubic_spring[1].points",
            "an even whole number",
        ),
        (
            table("cubic_spring", between=GROUNDED, k3=1.0, range=2.0, points=4, error=0.1),
            "cubic_spring a-ground.error",
            "none beside points",
        ),
        (
            table("cubic_spring", between=GROUNDED, k3=1.0, range=2.0, error=1e-7),
            "cubic_spring a-ground.error",
            "64 points reach",
        ),
        (
            table("friction", between=GROUNDED, force=0.3, velocity=0.1, static=0.2, stribeck=0.4),
            "friction a-ground.static",
            "at least force",
        ),
        (
            table("friction", between=GROUNDED, force=0.3, velocity=0.1, static=0.4, stribeck=0.1),
            "friction a-ground.stribeck",
            "more than velocity",
        ),
        (
            table("friction", between=GROUNDED, force=0.3, velocity=0.1, static=0.4),
            "friction a-ground.stribeck",
            "both static and stribeck",
        ),
    ],
)
def test_what_is_no_law_is_refused(text: str, field: str, expected: str) -> None:
    with pytest.raises(InputError) as refused:
        model(text)
    assert refused.value.field == field
    assert expected in refused.value.expected


def test_a_law_may_be_all_that_holds_a_mass_or_slows_it() -> None:
    text = system_text({"a": 1.5}, {}, {}, FORCE)
    spring = table("cubic_spring", between=GROUNDED, k1=-1.0, k3=1.0, range=2.0)
    friction = table("friction", between=GROUNDED, force=0.3, velocity=0.1)
    assert parse_model_file(text + spring + friction).model.second_order().own_frequency > 0.0
    for missing, what in ((spring, "damper"), (friction, "spring")):
        with pytest.raises(InputError) as refused:
            parse_model_file(text + missing)
        assert refused.value.field == f"{what}.between"


@given(PLACES, FORCES, st.sampled_from([1.0, -1.0]))
def test_dead_zones_make_the_force(places: list[int], forces: list[int], sign: float) -> None:
    """Each dead zone is a spring past its gap, one that limits with the slope at rest a ramp that
    stays: with the line that is wired they are the law."""
    points = tuple((x / 8.0, f / 4.0) for x, f in zip(places, forces, strict=False))
    law = ForceLaw("a-b.L", (sign,), "displacement", points)
    one = np.ones(1)
    system = SecondOrderSystem(
        one, 0.1 * one[:, None], (7.0 + law.slope) * one[:, None], one, (),
        constant=np.array([-sign * law.offset]), laws=(law,),
    )  # fmt: skip
    x = np.linspace(-7.0, 7.0, 113)
    total = system.wired.stiffness[0, 0] * x - system.wired.constant[0] - 7.0 * x
    for zone in system.dead_zones:
        ends = {side: (stop.gap, stop.stiffness) for side, stop in zone.sides}
        if zone.limits:
            (above, steep), (below, same) = ends[1], ends[-1]
            assert steep == same < 0.0
            total += -steep * (np.clip(x, -below, above) + below)
        else:
            for side, (gap, stiffness) in ends.items():
                total += side * stiffness * np.maximum(side * x - gap, 0.0)
    wanted = np.array([sign * straight_on(points, sign * each) for each in x])
    assert total == pytest.approx(wanted, abs=1e-8 * (1.0 + np.abs(wanted).max()))
    names = [zone.name for zone in system.dead_zones]
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"\w+", name, re.ASCII) for name in names)


def test_names_of_dead_zones_meet_no_clearance_s() -> None:
    stops = clearance("L_1", "a", "ground", upper=0.5, stiffness=8.0)
    bent = law(points=[[-1, -2], [1, 2], [2, 3]])
    zones = model(stops, bent).second_order().dead_zones
    assert [zone.name for zone in zones] == ["L_1", "L_2"]


def test_a_sum_of_two_masses_is_a_dead_zone() -> None:
    """Per unit of the first mass's displacement, and of the force on it."""
    text = system_text({"a": 1.5, "b": 1.0}, {GROUNDED: 2.0, ("b", "ground"): 1.0}, {GROUNDED: 0.1})
    text += table("damper", between=("b", "ground"), damping=0.1) + FORCE
    text += table("law", name="L", points=[[-1, 0], [1, 0], [2, 3]]) + "of = { a = 0.5, b = 2.0 }\n"
    (zone,) = parse_model_file(text).model.second_order().dead_zones
    assert (zone.mass, zone.combination, zone.push) == (1, (0.25, 1.0), ())
    assert zone.upper == Side(0.5, 12.0)
    assert zone.lower is None


def test_both_stops_are_shown_where_a_law_or_a_drive_makes_them_differ() -> None:
    stops = clearance("A", "a", "ground", upper=0.5, lower=0.5, stiffness=8.0)
    assert shown_stops(model(stops).second_order()) == ((0, 1),)
    uneven = law(points=[[-1, -2], [1, 2], [2, 3]])
    assert shown_stops(model(stops, uneven).second_order()) == ((0, 1), (0, -1))
    second = table("force", on="a", harmonics=[[2, 0.5, 0.0]])
    assert shown_stops(model(stops, second).second_order()) == ((0, 1), (0, -1))
