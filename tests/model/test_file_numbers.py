"""A model file with other values is the file that somebody would have written with them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from designer import InputError, ModelFile, parse_model_file, read_model_file
from tests.shared.model_text import PAPER_TABLE

EXAMPLES = Path(__file__).parents[2] / "examples"
PAPER = 'format = 1\ntitle = "as it was"\n' + PAPER_TABLE
SI = (
    "format = 1\n[mechanical]\nM1 = '2 kg'\nM2 = 3\nC1 = 60\nC2 = 24\nK0 = '540 kN/m'\n"
    "K1 = '60 kN/m'\nK2 = '40 kN/m'\nB = '0.5 mm'\nP1 = 80\nP2 = 0\n"
)


SYSTEM = """format = 2
[[mass]]
name = "m"
mass = 1.0
[[spring]]
between = ["m", "ground"]
stiffness = 1.0
[[damper]]
between = ["m", "ground"]
damping = 0.1
[[clearance]]
name = "A"
between = ["m", "ground"]
upper = 0.5
lower = 0.7
stiffness = 9.0
[[force]]
on = "m"
amplitude = 1.0
"""


def asked(modelfile: ModelFile) -> dict[str, Any]:
    """All that a file asks for."""
    words = vars(modelfile).copy()
    return {key: words[key] for key in words if key not in ("text", "source", "mechanical", "si")}


def test_a_parameter_is_what_a_sweep_calls_it() -> None:
    file = parse_model_file(PAPER)
    assert asked(file.with_({"b": 0.3})) == asked(parse_model_file(PAPER.replace("0.25", "0.3")))
    assert file.with_({}).model == file.model
    assert file.model.b == 0.25
    moved = parse_model_file(SI).with_({"b": 2.0 * parse_model_file(SI).model.b})
    assert moved.mechanical is not None
    assert pytest.approx(1e-3, rel=1e-9) == moved.mechanical.B
    assert 'B = "1 mm"' in moved.text


@pytest.mark.parametrize("value", ["0.7 mm", 0.0007])
def test_a_number_of_an_element_may_have_its_unit(value: object) -> None:
    file = read_model_file(EXAMPLES / "rig.toml")
    moved = file.with_({"buffers.upper": value, "carriage.mass": "1900 g"})
    assert moved.model.parameter("buffers.upper") == pytest.approx(0.0007, rel=1e-12)
    assert moved.model.parameter("carriage.mass") == pytest.approx(1.9, rel=1e-12)
    unmoved = set(file.model.parameters) - {"buffers.upper", "carriage.mass"}
    assert all(moved.model.parameter(n) == file.model.parameter(n) for n in unmoved)
    assert (moved.title, moved.source, moved.responses) == (file.title, file.source, file.responses)


@pytest.mark.parametrize("x2", ["0.001", '"1 mm"'])
def test_a_point_of_a_law_is_written_as_the_others_are(x2: str) -> None:
    law = '[[law]]\nname = "F"\nbetween = ["m", "ground"]\n'
    points = f"points = [[-0.001, 0], [{x2}, 0], [1, 2]]\n"
    text = SYSTEM.replace("mass = 1.0", 'mass = "1 kg"') + law + points
    file = parse_model_file(text)
    for value in (2e-3, "2 mm"):
        moved = file.with_({"F.x2": value})
        assert moved.model == file.model.changed({"F.x2": 2e-3})
        assert moved.data["law"][0]["points"][1] == ["2 mm" if "mm" in x2 else 2e-3, 0]


def test_keys_and_tables_are_set_added_and_left_out() -> None:
    wanted = [{"omega": 0.85, "expect": "1-2-2"}]
    file = parse_model_file(PAPER).with_({"response": wanted, "circuit.max_error": 0.01})
    assert [str(r.expect) for r in file.responses] == ["1-2-2"]
    assert file.circuit.max_error == 0.01
    assert file.with_({"circuit.max_error": None, "title": "new"}).circuit.max_error is None
    assert (file.title, file.with_({"title": "new"}).title) == ("as it was", "new")


@pytest.mark.parametrize(
    ("name", "value", "field"),
    [
        ("nonsense", 1.0, "nonsense"),
        ("b", "wide", "b"),
        ("b", math.nan, "model.b"),
        ("k0", 2.0, "model.k0"),
        ("circuit.opamp", "no such op-amp\n", "circuit.opamp"),
        ("circuit.max_error", math.inf, "circuit.max_error"),
        ("circuit.opamp", object(), "circuit.opamp"),
        ("circuit.opamp.name", "TL074C", "circuit.opamp.name"),
        ("response.omega", 1.0, "response.omega"),
        ("format", 3, "format"),
        ("b", True, "b"),
        ("b", 10**400, "b"),
        ("circuit.nonsense", None, "circuit.nonsense"),
        ("model", 3, "model"),
        ("model", None, "model"),
    ],
)
def test_what_no_file_could_say_is_refused(name: str, value: object, field: str) -> None:
    file = parse_model_file(PAPER + '[[response]]\nomega = 0.85\nexpect = "1-2-2"\n[circuit]\n')
    file = file.with_({"circuit.opamp": "TL074C"})
    with pytest.raises(InputError) as refused:
        file.with_({name: value})
    assert refused.value.field == field


def test_a_number_of_an_element_may_be_left_out() -> None:
    text = SYSTEM.replace("lower = 0.7\n", "")
    assert text != SYSTEM
    file = parse_model_file(SYSTEM).with_({"A.lower": None})
    assert file.model == parse_model_file(text).model
    with pytest.raises(InputError, match=r"A\.lower: found None, expected a parameter or a key"):
        file.with_({"A.lower": None})


def test_keys_are_changed_before_the_parameters_that_they_make() -> None:
    """A parameter beside a key of its own table is what was asked for, wherever it stands now."""
    drill = read_model_file(EXAMPLES / "drill.toml")
    moved = drill.with_({"mechanical.K1": "50 kN/m", "b": 0.6})
    assert moved.model.b == pytest.approx(0.6, rel=1e-12)
    assert moved.mechanical is not None
    assert moved.mechanical.K1 == 50e3
    paper = parse_model_file(PAPER)
    assert paper.with_({"model.b": 0.4, "b": 0.25}).model.b == 0.25
    pair = read_model_file(EXAMPLES / "backlash.toml")
    turned = pair.with_({"mass": pair.data["mass"][::-1], "load.mass": 3})
    assert turned.model.parameter("load.mass") == 3.0
    assert turned.model.parameter("driver.mass") == pair.model.parameter("driver.mass")
    with pytest.raises(InputError, match=r"spring\.between"):
        pair.with_({"mass": pair.data["mass"][:1], "load.mass": 3})


def test_a_length_of_a_mechanism_may_have_its_unit() -> None:
    moved = read_model_file(EXAMPLES / "drill.toml").with_({"b": "0.5 mm"})
    assert moved.mechanical is not None
    assert pytest.approx(0.5e-3, rel=1e-12) == moved.mechanical.B


def test_without_a_title_a_file_has_its_name() -> None:
    assert parse_model_file(PAPER, Path("there/mine.toml")).with_({"title": None}).title == "mine"


def test_the_factor_on_all_gaps_is_no_number_of_a_file() -> None:
    with pytest.raises(InputError, match="the gaps themselves"):
        read_model_file(EXAMPLES / "rig.toml").with_({"b": 2.0})
