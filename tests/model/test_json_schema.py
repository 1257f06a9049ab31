"""The JSON Schema of model files, by an independent validator."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from designer.base.errors import InputError
from designer.jobs.template import SCHEMA, SECOND, TEXT
from designer.model.model_file import json_schema, parse_model_file
from designer.verbs.new import new

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
FILES = {path.name: path.read_text("utf-8") for path in sorted(EXAMPLES.glob("*.toml"))}
FILES |= {"template of format 1": TEXT, "template of format 2": SECOND}
EVERY_KIND = """
[tuning]
offset = 0.1
[spread]
resistors = { law = "normal", sigmas = 3 }
offset = { sigma = "3 mV", limit = "10 mV" }
bias = ["0 A", "200 pA"]
temperature = [0, 50]
ageing = "catalogue"
[[spread.part]]
names = "R203"
tempco = [-1e-5, 2e-5]
[rules.swing]
limit = "12.5 V"
reason = "measured"
[search]
omega = [0.2, 1.5]
[[response]]
omega = "best"
b = [0.2, 0.3]
"""


@pytest.fixture(scope="module")
def validator() -> Draft202012Validator:
    schema = json_schema()
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


@pytest.mark.parametrize("name", FILES)
def test_what_is_read_is_allowed(name: str, validator: Draft202012Validator) -> None:
    parse_model_file(FILES[name])
    assert list(validator.iter_errors(tomllib.loads(FILES[name]))) == []


def test_values_of_every_shape_are_allowed(validator: Draft202012Validator) -> None:
    text = FILES["paper.toml"].replace("[spread]", "[spread.unused]") + EVERY_KIND
    parse_model_file(text)
    assert list(validator.iter_errors(tomllib.loads(text))) == []


@pytest.mark.parametrize(
    ("old", "new_text"),
    [
        ('name = "hammer"\n', ""),
        ('name = "hammer"', 'nam = "hammer"'),
        ('mass = "2 kg"', "mass = true"),
        ("format = 2", "format = 3"),
        ('between = ["hammer", "casing"]', 'between = ["hammer"]'),
        ('# dead_zone = "rectifier"', 'dead_zone = "rectifer"'),
        ('expect = "1-1-1"', "expect = 111"),
        ("resistor_grade = 0.01", 'resistor_grade = "1 %"'),
        ("[[force]]", "[[push]]"),
    ],
)
def test_mistakes_are_marked(old: str, new_text: str, validator: Draft202012Validator) -> None:
    text = SECOND.replace(old, new_text, 1)
    with pytest.raises(InputError):
        parse_model_file(text)
    assert not validator.is_valid(tomllib.loads(text))


def test_every_key_says_what_it_is() -> None:
    schema = json_schema()
    tables = [*schema["anyOf"], *schema["$defs"].values()]
    described: list[dict[str, Any]] = [
        key for table in tables for key in table["properties"].values()
    ]
    assert all("$ref" in key or len(key["description"]) > 10 for key in described)
    assert "None" not in json.dumps([key.get("default", 0) for key in described])


@pytest.mark.slow
def test_a_new_file_has_its_schema_beside_it(tmp_path: Path) -> None:
    new(tmp_path / "first.toml", format=2)
    place = tmp_path / SCHEMA
    assert (tmp_path / "first.toml").read_text("utf-8").startswith(f"#:schema ./{SCHEMA}\n")
    assert json.loads(place.read_text("utf-8")) == json.loads(json.dumps(json_schema()))
    place.write_text('{"title": "Model file of designer", "of": "an older version"}')
    new(tmp_path / "second.toml")
    assert "older" not in place.read_text("utf-8")
    place.write_text("mine")
    new(tmp_path / "third.toml")
    assert place.read_text("utf-8") == "mine"
