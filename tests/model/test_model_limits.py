"""What the models of this version cannot be is said by name, and where it is documented."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from designer.base.errors import InputError
from designer.base.schema import keys_of
from designer.model import model_limits
from designer.model.model_file import parse_model_file
from designer.model.model_limits import MODELS, WHERE
from tests.shared.model_text import PAPER_TABLE

ROOT = Path(__file__).resolve().parents[2]
DRILL = (ROOT / "examples" / "drill.toml").read_text("utf-8")
PAPER = "format = 1\n" + PAPER_TABLE


def refused(text: str) -> InputError:
    with pytest.raises(InputError) as caught:
        parse_model_file(text, Path("some.toml"))
    return caught.value


@pytest.mark.parametrize(
    ("line", "what"),
    [
        ('M3 = "2 kg"', "a third mass"),
        ("K3 = 1e4", "a third mass"),
        ("C4 = 1", "a third mass"),
        ("P12 = 1", "a third mass"),
        ("B2 = 1e-3", "a second clearance"),
        ("B_upper = 1e-3", "a second clearance"),
        ("K02 = 1e5", "a second clearance"),
        ("base = 1e-3", "base motion"),
        ("base_amplitude = 1e-3", "base motion"),
        ("C0 = 3", "damping in the stops"),
        ("friction = 3", "friction"),
        ("preload = 3", "a constant force"),
    ],
)
def test_a_key_of_another_mechanism_is_named(line: str, what: str) -> None:
    key = line.split()[0]
    error = refused(DRILL.replace("B = ", f"{line}\nB = "))
    assert error.file == "some.toml"
    assert error.field == f"mechanical.{key}"
    assert error.found == f"unknown key '{key}'"
    assert f"without {what}: format 1 knows two masses in a chain with stops on the first" in (
        error.expected
    )
    assert "format = 2 knows any masses" in error.expected
    assert f"{key} is not known" in error.expected
    assert WHERE in error.expected


@pytest.mark.parametrize("key", ["m3", "k3", "zeta3", "b2", "b_lower"])
def test_so_is_one_of_a_dimensionless_model(key: str) -> None:
    error = refused(PAPER.replace("b = ", f"{key} = 0.1\nb = "))
    assert error.field == f"model.{key}"
    assert "two masses in a chain" in error.expected


@pytest.mark.parametrize("key", ["mass", "spring", "damper", "clearance", "force"])
@pytest.mark.parametrize("head", ["format = 1", 'title = "x"'])
def test_lists_of_any_system_are_refused_in_format_1(key: str, head: str) -> None:
    error = refused(f'{head}\n[[{key}]]\nname = "M1"\n{DRILL[DRILL.index("[mechanical]") :]}')
    assert error.field == key
    assert "two masses in a chain" in error.expected


def test_base_motion_is_refused() -> None:
    assert refused(PAPER + "[base]\namplitude = 1\n").field == "base"


def test_misspelt_keys_are_still_taken_for_that() -> None:
    error = refused(PAPER.replace("zeta", "zet"))
    assert 'did you mean "zeta"?' in error.expected
    error = refused(DRILL.replace("C2 =", "c2 ="))
    assert 'did you mean "C2"?' in error.expected


def test_no_key_of_a_model_is_refused() -> None:
    for table, record in MODELS.items():
        model_limits.check({table: dict.fromkeys(keys_of(record))}, None)


def test_the_docs_have_the_limits() -> None:
    page, title = WHERE.split(", ")
    assert re.search(rf"^## {title}$", (ROOT / page).read_text("utf-8"), re.MULTILINE)
    assert f"{page}#{title.lower()}" in (ROOT / "README.md").read_text("utf-8")
