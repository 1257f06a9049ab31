"""The words of the page's address: what they mean, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, strategies as st

from designer import InputError, ModelFile, parse_model_file, read_model_file
from designer.explorer.controls import controls
from designer.explorer.place import first_place, read_place, words_of
from designer.explorer.saved_model import saved_text
from designer.model.swept_model import ModelSubject
from tests.shared.model_text import PAPER_TABLE
from tests.shared.system_text import clearance, system_text, table

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
FILES = ("paper", "three-masses", "hammer-base", "backlash", "aberdeen")


def file(name: str) -> ModelFile:
    return read_model_file(EXAMPLES / f"{name}.toml")


PAPER = file("paper")


@pytest.mark.parametrize("name", FILES)
def test_the_words_of_a_place_give_it_again(name: str) -> None:
    modelfile = file(name)
    place = first_place(modelfile)
    changes: dict[str, Any] = {each: 1.01 * place.model.parameter(each) for each in ("b",)}
    size = 2 * place.model.second_order().size
    changes |= {"omega": "0.9", "start": ",".join(["0.125"] * size), "shown": 1}
    if name in ("hammer-base",):
        changes["omega"] = "90"
    moved = read_place(modelfile, changes)
    assert read_place(modelfile, words_of(moved)) == moved
    assert moved.omega == float(changes["omega"])
    assert moved.state.tolist() == [0.125] * size
    assert read_place(modelfile, {}) == place


@given(omega=st.floats(0.01, 100.0), zeta=st.floats(1e-3, 10.0))
def test_no_digit_is_lost(omega: float, zeta: float) -> None:
    place = read_place(PAPER, {"omega": repr(omega), "zeta": zeta})
    assert (place.omega, place.model.parameter("zeta")) == (omega, zeta)
    assert read_place(PAPER, words_of(place)) == place


@pytest.mark.parametrize(
    ("words", "field"),
    [
        ({"k0": "1.5"}, "k0"),
        ({"omega": "nan"}, "omega"),
        ({"omega": "-1"}, "omega"),
        ({"omega": "1e9"}, "omega"),
        ({"zeta": "inf"}, "zeta"),
        ({"zeta": "0.1; rm -rf /"}, "zeta"),
        ({"zeta": ["0.1"]}, "zeta"),
        ({"zeta": True}, "zeta"),
        ({"../../etc/passwd": "1"}, "address"),
        ({"omega": "10 Hz"}, "omega"),
        ({"start": "1,2,3"}, "start"),
        ({"start": "1,2,3,nan"}, "start"),
        ({"start": "1,2,3,1e300"}, "start"),
        ({"shown": "-1"}, "shown"),
        ({"shown": "1e1"}, "shown"),
    ],
)
def test_what_is_no_place_is_refused(words: dict[str, object], field: str) -> None:
    with pytest.raises(InputError) as caught:
        read_place(PAPER, words)
    assert caught.value.field.removeprefix("model.") == field


def test_a_value_may_carry_its_unit() -> None:
    place = read_place(file("hammer-base"), {"omega": "12 Hz"})
    assert place.omega == pytest.approx(75.398, abs=1e-3)


@pytest.mark.parametrize("name", FILES)
def test_every_parameter_has_a_slider_and_both_its_ends_can_be_had(name: str) -> None:
    modelfile = file(name)
    each = controls(modelfile)
    place = first_place(modelfile)
    assert sorted(c.name for c in each) == sorted(["omega", *place.model.parameters])
    assert each[0].name == "omega"
    for control in each:
        assert control.low <= control.value <= control.high, control.name
        assert not control.logarithmic or control.low > 0.0
        for value in (control.low, control.high):
            read_place(modelfile, {control.name: value})


TO_GROUND = ("m", "ground")
BOUND = parse_model_file(
    system_text(
        {"m": 1.0},
        {TO_GROUND: 1.0},
        {TO_GROUND: 0.1},
        clearance("A", *TO_GROUND, upper=0.3, lower=0.2, stiffness=20.0, restitution=0.5),
        table("cubic_spring", between=TO_GROUND, k3=0.1, range=2.0),
        table("friction", between=TO_GROUND, force=0.2, velocity=0.01, static=0.3, stribeck=0.04),
        table("force", on="m", amplitude=1.0),
    )
)
"""Numbers that bound each other."""


def test_sliders_end_where_other_numbers_of_the_model_bound_theirs() -> None:
    sliders = {c.name: c for c in controls(BOUND)}
    assert "A.damping" not in sliders  # the restitution decides it
    for control in sliders.values():
        for value in (control.low, control.high):
            read_place(BOUND, {control.name: control.rounded(value, 6)})  # as the page sends it
    ends = {name: (c.low, c.high) for name, c in sliders.items()}
    assert ends["m-ground.force"] == pytest.approx((0.04, 0.3), rel=0.01)
    assert ends["m-ground.static"] == pytest.approx((0.2, 1.5), rel=0.01)
    assert ends["m-ground.velocity"] == pytest.approx((0.002, 0.04), rel=0.01)
    assert ends["A.upper"] == pytest.approx((-0.2, 0.9), rel=0.01)


def test_what_another_number_decides_has_no_slider() -> None:
    """The stops of one restitution have one stiffness."""
    text = saved_text(BOUND, read_place(BOUND, {}))
    modelfile = parse_model_file(
        text.replace("\nstiffness = 20.0", "\nupper_stiffness = 20.0\nlower_stiffness = 20.0")
    )
    assert modelfile.model.parameter("A.upper_stiffness") == 20.0
    names = {c.name for c in controls(modelfile)}
    assert names == {c.name for c in controls(BOUND)} - {"A.stiffness"}


def test_a_number_that_another_one_bounds_is_refused_by_the_name_of_both() -> None:
    words = "m-ground.force: found 0.4, expected another m-ground.force: it stands beside"
    with pytest.raises(InputError, match=f"{words} friction m-ground.static = 0.3, which is to be"):
        read_place(BOUND, {"m-ground.force": 0.4})


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_what_is_no_finite_number_is_refused_as_such(value: float) -> None:
    for name in ("A.upper", "m-ground.force"):
        with pytest.raises(InputError, match=f"{name}: a finite number$"):
            ModelSubject(BOUND.model).check("over", name, value)


LISTS = parse_model_file(
    """format = 2
[matrices]
names = ["tip", "root"]
mass = [1, 2]
stiffness = [[3, -1], [-1, 4]]
damping = [[0.1, 0], [0, 0.2]]
[[law]]
name = "F"
between = ["tip", "ground"]
points = [[-1, -1], [0, 0], [2, 1]]
[[force]]
on = "tip"
amplitude = 1
"""
)


def test_points_and_entries_have_no_slider_and_are_in_the_address_where_they_were_asked_for() -> (
    None
):
    assert [c.name for c in controls(LISTS)] == ["omega", "b", "tip.amplitude", "tip.constant"]
    place = first_place(LISTS)
    assert words_of(place).keys() == {"omega", "b", "tip.amplitude", "tip.constant"}
    moved = read_place(LISTS, {"F.x3": "3", "mass.tip.tip": "1.5", "b": "2"})
    assert words_of(moved).keys() - words_of(place).keys() == {"F.x3", "mass.tip.tip"}
    assert read_place(LISTS, words_of(moved)) == moved
    with pytest.raises(InputError, match="> 0"):
        read_place(LISTS, {"mass.tip.tip": "0"})


def test_an_address_may_ask_for_so_many_sliders(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first; those that are there anyway, and words that are no parameters, count for none."""
    monkeypatch.setattr("designer.explorer.controls.MOST_ASKED", 2)
    always = {"omega", "b", "tip.amplitude", "tip.constant"}
    asked = ["b", "no such", "mass.tip.tip", "mass.tip.tip", "F.x3", "F.f3"]
    assert {c.name for c in controls(LISTS, asked)} == always | {"mass.tip.tip", "F.x3"}


def test_a_file_that_wants_nothing_is_looked_at_where_the_model_resonates() -> None:
    modelfile = parse_model_file(f"format = 1\n{PAPER_TABLE}")
    assert first_place(modelfile).omega == 1.0
