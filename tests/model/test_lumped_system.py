"""Model files of format 2: what their elements add up to, and what is refused."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.linalg import expm
from scipy.optimize import brentq, minimize_scalar

from designer.base.errors import InputError
from designer.laws.hertz_law import hertz_pieces
from designer.model.driven import model_flow
from designer.model.lumped_elements import Damper, Force, Gap, Mass, Spring
from designer.model.lumped_system import LumpedSystem
from designer.model.model import Dimensionless
from designer.model.model_file import ModelFile, parse_model_file
from tests.shared.model_text import PAPER_TABLE, dimensionless
from tests.shared.system_text import clearance, system_text, table

HAMMER = system_text(
    {"hammer": "2 kg", "casing": "3 kg"},
    {("hammer", "casing"): "60 kN/m", ("casing", "ground"): "40 kN/m"},
    {("hammer", "casing"): "56 N s/m", ("casing", "ground"): "24 N s/m"},
    clearance("A", "hammer", "ground", upper="0.5 mm", lower="0.7 mm", stiffness="540 kN/m"),
    table("force", on="hammer", amplitude="80 N", constant="-19.6 N"),
    table("response", frequency="54 Hz", expect="1-1-1"),
)


def read(text: str) -> ModelFile:
    return parse_model_file(text, Path("some.toml"))


def refused(text: str) -> InputError:
    with pytest.raises(InputError) as caught:
        read(text)
    assert caught.value.file == "some.toml"
    return caught.value


def paper(model: Dimensionless) -> LumpedSystem:
    """The same system, element by element."""
    first, second = ("M1", "M2"), ("M2", "ground")
    m2, z2 = model.m / (1.0 - model.m), 2.0 * model.zeta
    dampers = [Damper(first, z2)]
    if model.c:
        dampers.append(Damper(second, z2 * model.c / (1.0 - model.c)))
    return LumpedSystem(
        (Mass("M1", 1.0), Mass("M2", m2)),
        (Spring(first, 1.0), Spring(second, model.k / (1.0 - model.k))),
        tuple(dampers),
        (Gap("A", ("M1", "ground"), model.b, model.b, model.mu),),
        (Force("M1", 1.0 - model.f20), Force("M2", model.f20)),
    )


def test_the_paper_s_case_is_one_instance_of_the_rule() -> None:
    model = dimensionless(read("format = 1\n" + PAPER_TABLE).model)
    ours, theirs = paper(model).second_order(), model.second_order()
    for name in ("mass", "damping", "stiffness", "force"):
        assert getattr(ours, name) == pytest.approx(getattr(theirs, name), rel=1e-15), name
    assert ours.clearances == theirs.clearances
    x = np.array([0.1, -0.2, 0.3, 0.05])
    a = model_flow(paper(model), 0.85).run(x, 3)
    b = model_flow(model, 0.85).run(x, 3)
    assert a.strobes == pytest.approx(b.strobes, abs=1e-12)
    assert a.counts.tolist() == b.counts.tolist()


def test_values_with_units_are_si_and_frequencies_rad_per_second() -> None:
    file = read(HAMMER)
    system = file.model.second_order()
    assert system.mass.tolist() == [2.0, 3.0]
    assert system.stiffness.tolist() == [[60e3, -60e3], [-60e3, 100e3]]
    assert system.damping.tolist() == [[56.0, -56.0], [-56.0, 80.0]]
    assert system.constant.tolist() == [-19.6, 0.0]
    (stop,) = system.clearances
    assert (stop.mass, stop.other) == (0, None)
    assert [(side, spring.gap) for side, spring in stop.sides] == [(1, 5e-4), (-1, 7e-4)]
    assert file.responses[0].omega == pytest.approx(2.0 * np.pi * 54.0)
    assert file.si is not None
    assert file.si.hertz(2.0 * np.pi) == pytest.approx(1.0)
    plain = re.sub(r'"([-\d.]+) (?:kg|N s/m|N|kN/m|mm)"', r"\1", HAMMER)
    assert read(plain.replace('frequency = "54 Hz"', "omega = 1.0")).si is None


def test_ground_may_stand_first() -> None:
    turned = HAMMER.replace('["hammer", "ground"]', '["ground", "hammer"]')
    (ours,) = read(turned).model.second_order().clearances
    (theirs,) = read(HAMMER).model.second_order().clearances
    assert (ours.mass, ours.upper, ours.lower) == (theirs.mass, theirs.lower, theirs.upper)


def test_b_is_a_factor_on_gaps_and_constant_forces() -> None:
    """With every gap, constant force and start half as large, half the drive does the same."""
    model = read(HAMMER).model
    omega, start = 300.0, np.array([1e-4, 0.02, -2e-4, 0.01])
    whole = model_flow(model, omega).run(start, 5)
    half = model_flow(model.at(0.5), omega)
    half.drive = type(half.drive)(omega, 0.5)
    again = type(half)(half.system, half.drive).run(0.5 * start, 5)
    assert again.strobes == pytest.approx(0.5 * whole.strobes, abs=1e-12 * abs(start).max())
    assert again.counts.tolist() == whole.counts.tolist()


def test_every_parameter_has_a_name_and_can_be_changed() -> None:
    model = read(HAMMER).model
    assert set(model.parameters) == {"b", *model.units} == {
        "b", "hammer.mass", "casing.mass", "hammer-casing.stiffness", "casing-ground.stiffness",
        "hammer-casing.damping", "casing-ground.damping", "A.upper", "A.lower", "A.stiffness",
        "A.damping", "A.preload", "hammer.amplitude", "hammer.constant",
    }  # fmt: skip
    for name in model.parameters:
        other = model.changed({name: 1.25 * model.parameter(name) + 1e-6})
        assert other.parameter(name) == 1.25 * model.parameter(name) + 1e-6
        assert other != model
        assert other.changed({name: model.parameter(name)}) == model
    with pytest.raises(InputError) as caught:
        model.changed({"hammer.mass": -1.0})
    assert caught.value.expected == "a number > 0"


COUPLED = """\
format = 2
[matrices]
names = ["hammer", "casing"]
mass = [[2.0, 0.6], [0.6, 3.0]]
stiffness = [[60e3, -60e3], [-60e3, 100e3]]
damping = [[56.0, -56.0], [-56.0, 80.0]]
"""


@pytest.mark.parametrize("masses", [[[2.0, 0.0], [0.0, 3.0]], [[2.0, 0.6], [0.6, 3.0]]])
@pytest.mark.parametrize(
    ("joint", "row"),
    [
        ('between = ["hammer", "ground"]', [1.0, 0.0]),
        ('between = ["hammer", "casing"]', [1.0, -1.0]),
        ("of = { hammer = 1.0, casing = -0.5 }", [1.0, -0.5]),
        ("of = { hammer = 0.3, casing = 2.0 }", [0.3, 2.0]),
    ],
)
def test_restitution_is_the_speed_that_one_contact_leaves(
    joint: str, row: list[float], masses: list[list[float]]
) -> None:
    """Of the bodies with the stop alone, from Newton's law by another integrator, in whatever way
    the bodies move beside the motion in the clearance."""
    text = HAMMER.replace('expect = "1-1-1"\n', "")
    if masses[0][1]:
        text = COUPLED + text[text.index("[[clearance]]") :]
    text = text.replace('between = ["hammer", "ground"]\nupper', f"{joint}\nupper")
    text = text.replace('stiffness = "540 kN/m"', 'stiffness = "540 kN/m"\nrestitution = 0.7')
    (clearance,) = read(text).model.second_order().clearances
    r, inverse = np.array(row), np.linalg.inv(np.array(masses))
    k, c = clearance.first.stiffness, clearance.damping
    rate = np.block(
        [
            [np.zeros((2, 2)), np.eye(2)],
            [-k * inverse @ np.outer(r, r), -c * inverse @ np.outer(r, r)],
        ]
    )
    before = np.array([0.0, 0.0, 1.0 / r[0], 0.0])  # the hammer alone closes the gap

    def depth(t: float) -> float:
        return float(r @ (expm(rate * t) @ before)[:2])

    half = np.pi / np.sqrt(k * r @ inverse @ r)  # undamped; the damped one is a little longer
    end = brentq(depth, 0.5 * half, 1.9 * half, xtol=1e-16)
    assert r @ (expm(rate * end) @ before)[2:] == pytest.approx(-0.7, rel=1e-6)


@pytest.mark.parametrize(
    ("keys", "field"),
    [
        ('stiffness = "1 kN/m"\nrestitution = 0.7\ndamping = 3.0', "restitution"),
        ("upper_stiffness = 10.0\nlower_stiffness = 20.0\nrestitution = 0.7", "restitution"),
        ('law = "hertz"\nconstant = 3e10\ndepth = "1 mm"\nrestitution = 0.7', "restitution"),
        ('stiffness = "1 kN/m"\nrestitution = 1.2', "restitution"),
        ('stiffness = "1 kN/m"\npreload_over = "1 mm"', "preload_over"),
    ],
)
def test_what_a_stop_cannot_be_is_refused(keys: str, field: str) -> None:
    told = refused(HAMMER.replace('stiffness = "540 kN/m"', keys))
    assert told.field.endswith(f".{field}")


def test_later_keys_of_a_clearance_change_no_hash_where_they_are_not_stated() -> None:
    plain = read(HAMMER).model
    assert not {"restitution", "preload_over"} & set(plain.as_dict()["gaps"][0])  # type: ignore[index]
    more = 'stiffness = "540 kN/m"\nrestitution = 0.8\npreload = "5 N"\npreload_over = "1 mm"'
    model = read(HAMMER.replace('stiffness = "540 kN/m"', more)).model
    assert model.parameters["A.restitution"][1] == 1.0
    assert model.units["A.preload_over"] == "m"
    assert "A.restitution" not in model.units
    (softer,) = model.changed({"A.restitution": 0.5}).second_order().clearances
    (clearance,) = model.second_order().clearances
    assert softer.damping > clearance.damping > 0.0
    with pytest.raises(InputError, match="at most 1"):
        model.changed({"A.restitution": 1.5})


def without(text: str, table: str, number: int = 1) -> str:
    """The file without the table of this name and number."""
    parts = re.split(r"(?m)^(?=\[)", text)
    places = [i for i, part in enumerate(parts) if part.startswith(f"[[{table}]]")]
    del parts[places[number - 1]]
    return "".join(parts)


BASE = '[base]\namplitude = "1 mm"\nstops = "fixed"\n'

WRONG: list[tuple[str, str, str]] = [
    (without(HAMMER, "spring", 2), "spring.between", "it floats"),
    (without(HAMMER, "spring", 1), "spring.between", "a [[spring]] between hammer and another"),
    (without(without(HAMMER, "damper"), "damper"), "damper.between", "a [[damper]] for it"),
    (without(HAMMER, "force"), "force", "nothing moves"),
    (
        HAMMER.replace('upper = "0.5 mm"', 'upper = "-0.7 mm"'),
        "clearance A.upper",
        "two clearances",
    ),
    (
        HAMMER.replace('upper = "0.5 mm"\nlower = "0.7 mm"\n', ""),
        "clearance A.upper",
        "an upper or a lower stop",
    ),
    (HAMMER.replace('stiffness = "540 kN/m"\n', ""), "clearance A.stiffness", "upper_stiffness"),
    (HAMMER.replace('name = "casing"', 'name = "hammer"'), "mass.name", "no other mass"),
    (HAMMER.replace('name = "A"', 'name = "ground"'), "clearance.name", "other than ground"),
    (HAMMER.replace('on = "hammer"', 'on = "hamer"'), "force.on", 'did you mean "hammer"?'),
    (
        HAMMER.replace('["hammer", "casing"]', '["hammer", "hammer"]', 1),
        "spring[1].between",
        "two different names",
    ),
    (HAMMER.replace('"24 N s/m"', '"-24 N s/m"'), "damper[2].damping", "a number > 0"),
    (
        HAMMER.replace('stiffness = "540 kN/m"', 'law = "hertz"\nconstant = 1e9'),
        "clearance A.depth",
        'of the law "hertz"',
    ),
    (
        HAMMER.replace('stiffness = "540 kN/m"', 'stiffness = "540 kN/m"\ndamping = 3.0')
        + BASE
        + '[[friction]]\nbetween = ["hammer", "ground"]\nforce = "1 N"\nvelocity = "1 mm/s"\n',
        "clearance A.damping",
        "which moves with the ground",
    ),
    (HAMMER.replace("[[clearance]]", "[[clearence]]"), "clearence", 'did you mean "clearance"?'),
    ("format = 2\n", "mass", "at least one table"),
    (HAMMER.replace('"2 kg"', "5e-324"), "mass[1].mass", "from 1e-60 to 1e+60"),
    (HAMMER.replace('"540 kN/m"', "1e300"), "clearance[1].stiffness", "from 1e-60 to 1e+60"),
    (HAMMER.replace('upper = "0.5 mm"', "upper = 1e-61"), "clearance[1].upper", "1e-60"),
    (
        HAMMER + '[[clearance]]\nname = "a"\nbetween = ["casing", "ground"]\nupper = 1.0\n'
        "stiffness = 2.0\n",
        "clearance.name",
        "more than capitals",
    ),
]


@pytest.mark.parametrize(
    ("text", "field", "expected"), WRONG, ids=[w[1] + str(i) for i, w in enumerate(WRONG)]
)
def test_what_is_no_system_is_refused(text: str, field: str, expected: str) -> None:
    error = refused(text)
    assert error.field == field
    assert expected in error.expected


def test_a_clearance_that_nothing_moves_is_refused() -> None:
    more = '[[mass]]\nname = "idle"\nmass = 1.0\n'
    more += '[[spring]]\nbetween = ["idle", "ground"]\nstiffness = 1.0\n'
    more += '[[damper]]\nbetween = ["idle", "ground"]\ndamping = 1.0\n'
    gap = '[[clearance]]\nname = "B"\nbetween = ["idle", "ground"]\nupper = 1.0\nstiffness = 2.0\n'
    hammer = HAMMER.replace('expect = "1-1-1"\n', "")
    error = refused(hammer + more + gap)
    assert error.field == "clearance B.between"
    assert "it can never be reached" in error.expected
    assert len(read(hammer + more).model.second_order().mass) == 3
    assert read(hammer + more + gap + BASE).model.second_order().base == 1e-3


@given(
    pieces=st.integers(1, 8),
    constant=st.floats(1e-3, 1e12),
    depth=st.floats(1e-6, 10.0),
)
def test_hertz_pieces_keep_to_the_error_that_they_state(
    pieces: int, constant: float, depth: float
) -> None:
    steps = hertz_pieces(constant, depth, pieces)
    x = np.linspace(0.0, depth, 20_001)
    force = steps.stiffness * x
    for joint, stiffness in steps.further:
        assert stiffness > 0.0
        force += stiffness * np.maximum(x - joint, 0.0)
    error = (force - constant * x**1.5) / (constant * depth**1.5)
    assert error.max() == pytest.approx(steps.largest_error, rel=1e-4)
    assert error.min() == pytest.approx(-steps.largest_error, rel=1e-4)


def test_one_piece_is_the_best_straight_line() -> None:
    """max |k x - x^1.5| on [0, 1] is the larger of its inner extreme and its end."""

    def worst(k: Any) -> float:
        return float(max(abs(k - 1.0), 4.0 / 27.0 * k**3))

    best = minimize_scalar(worst, bounds=(0.5, 1.5), method="bounded", options={"xatol": 1e-12})
    steps = hertz_pieces(1.0, 1.0, 1)
    assert steps.stiffness == pytest.approx(best.x, abs=1e-6)
    assert steps.largest_error == pytest.approx(best.fun, abs=1e-6)


def test_a_hertzian_stop_stiffens_in_steps() -> None:
    text = HAMMER.replace(
        'stiffness = "540 kN/m"', 'law = "hertz"\nconstant = 1e9\ndepth = "0.2 mm"'
    )
    system = read(text).model.second_order()
    steps = hertz_pieces(1e9, 2e-4, 4)
    flow = model_flow(read(text).model, 300.0)
    for sign, gap in ((1.0, 5e-4), (-1.0, 7e-4)):
        for depth in (1e-5, 5e-5, 1.2e-4, 1.9e-4):
            x = np.array([sign * (gap + depth), 0.0, 0.0, 0.0])
            key = flow.system.mode_at(x, 0.0)
            springs = [(0.0, steps.stiffness), *steps.further]
            met = sum(depth > start for start, _ in springs)
            assert list(key) == [sign * met]
            mode = flow.system.mode(key)
            assert list(mode.sides) == [sign]
            stop = sum(k * max(depth - start, 0.0) for start, k in springs)
            want = (-60e3 * x[0] - sign * stop - 19.6) / 2.0
            assert (mode.A @ x + mode.d)[1] == pytest.approx(want, rel=1e-12)
    assert len(system.clearances) == 1
