"""Responses that no motion of a model can be are refused with its file; others are not."""

from __future__ import annotations

import pytest

from designer.base.errors import InputError
from designer.model.model_file import parse_model_file
from tests.shared.mechanism_file import HAMMER
from tests.shared.model_text import PAPER_TABLE

HERTZ = """\
format = 2
[[mass]]
name = "ball"
mass = 1.0
[[spring]]
between = ["ball", "ground"]
stiffness = 1.0
[[damper]]
between = ["ball", "ground"]
damping = 0.1
[[clearance]]
name = "plate"
between = ["ball", "ground"]
lower = -0.1
law = "hertz"
constant = 30.0
depth = 0.5
[[force]]
on = "ball"
amplitude = 0.3
"""


LINEAR = HERTZ[: HERTZ.index("[[clearance]]")] + HERTZ[HERTZ.index("[[force]]") :]


def paper(k0: float, sides: str) -> str:
    table = PAPER_TABLE.replace("k0 = 0.95", f"k0 = {k0}")
    return f'format = 1\n{table}sides = "{sides}"\n'


def wanted(model: str, keys: str) -> None:
    parse_model_file(f"{model}[[response]]\nomega = 1.0\nexpect = {keys}\n")


@pytest.mark.parametrize(
    ("model", "keys", "field"),
    [
        (HERTZ, '"aperiodic"', None),
        (HERTZ, '"quasi-periodic"', None),
        (HERTZ, '"aperiodic"\nleast_exponent = 0.1', None),
        (HERTZ, '"chaos"', "expect"),
        (HERTZ, '"grazing"', "expect"),
        (HERTZ, '"aperiodic"\nleast_exponent = 0.0', "least_exponent"),
        (HERTZ, '"quasi-periodic"\nleast_exponent = 0.1', "least_exponent"),
        (HERTZ, '"1-0-0"\nleast_exponent = 0.1', "least_exponent"),
        (HERTZ, '"aperiodic"\ntwin = "exact"', "twin"),
        (HERTZ, '"aperiodic"\nsymmetric = true', "symmetric"),
        (LINEAR, '"aperiodic"', "expect"),
    ],
)
def test_motions_without_a_period_can_be_wanted(model: str, keys: str, field: str | None) -> None:
    """Of what is not linear; with an exponent that is one of chaos, and nothing of n-p-q."""
    if field is None:
        wanted(model, keys)
        return
    with pytest.raises(InputError) as caught:
        wanted(model, keys)
    assert caught.value.field == f"response[1].{field}"


@pytest.mark.parametrize("n", [1, 2, 16])
@pytest.mark.parametrize(("p", "q"), [(0, 0), (0, 1), (1, 0), (2, 3)])
@pytest.mark.parametrize("sides", ["both", "upper", "lower"])
@pytest.mark.parametrize("twin", ["either", "exact"])
def test_what_one_clearance_can_be(n: int, p: int, q: int, sides: str, twin: str) -> None:
    """By hand: without impacts a motion is linear; a missing stop is never hit. A model that lacks
    one has no mirror twins, so ``twin`` changes nothing."""
    hit = (not p or sides != "lower") and (not q or sides != "upper")
    possible = hit and not (n > 1 and p == q == 0)
    keys = f'"{n}-{p}-{q}"\ntwin = "{twin}"'
    if possible:
        wanted(paper(0.95, sides), keys)
        return
    with pytest.raises(InputError) as caught:
        wanted(paper(0.95, sides), keys)
    assert (caught.value.field, caught.value.found) == ("response[1].expect", f"{n}-{p}-{q}")


@pytest.mark.parametrize("counts", ["1-1-1", "1-1-0", "3-0-0", "16-4-4"])
def test_a_model_without_stops_has_one_response(counts: str) -> None:
    wanted(paper(0.0, "both"), '"1-0-0"')
    with pytest.raises(InputError) as caught:
        wanted(paper(0.0, "both"), f'"{counts}"')
    assert ("as in 1-0-0: the model has no stops" in caught.value.expected) or (
        "n = 1" in caught.value.expected
    )


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ('"1-1-1;0-1"', "as in 1-1-0;0-1: there is no lower stop of anvil"),
        ('"2-1-3;2-1"', "as in 2-1-0;0-1: there is no lower stop of anvil and no upper"),
        ('"1-0-1;1-0"', "as in 1-1-0;0-1: there is no lower stop of anvil"),
        ('"1-1-0"', "p-q for each clearance, as in 1-p-q;p-q, for the clearances anvil, pad"),
        ('"1-0-0;0-0;0-0"', "p-q for each clearance, as in 1-p-q;p-q"),
        ('"3-0-0;0-0"', "n = 1"),
    ],
)  # fmt: skip
def test_of_several_clearances_the_stop_is_named(keys: str, expected: str) -> None:
    with pytest.raises(InputError) as caught:
        wanted(HAMMER, keys)
    assert expected in caught.value.expected


@pytest.mark.parametrize("keys", ['"1-1-0;0-1"', '"4-0-0;0-3"', '"1-0-0;0-0"'])
def test_what_two_one_sided_clearances_can_be_is_read(keys: str) -> None:
    wanted(HAMMER, keys)


def test_a_symmetric_motion_has_an_odd_period() -> None:
    wanted(paper(0.95, "both"), '"3-2-2"\nsymmetric = true')
    wanted(paper(0.95, "both"), '"2-2-2"\nsymmetric = false')
    with pytest.raises(InputError) as caught:
        wanted(paper(0.95, "both"), '"2-2-2"\nsymmetric = true')
    assert caught.value.field == "response[1].symmetric"


def test_inside_a_stop_of_several_springs_a_motion_without_impacts_may_be_anything() -> None:
    wanted(HERTZ, '"2-0-0"')
    for missing in ('"2-1-1"', '"2-1-0"'):
        with pytest.raises(InputError):
            wanted(HERTZ, missing)
