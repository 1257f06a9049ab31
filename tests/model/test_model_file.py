"""Model files: what is read, and that each thing that can be wrong is named."""

from __future__ import annotations

import contextlib
import hashlib
import math
import os
import re
import tomllib
from dataclasses import FrozenInstanceError, fields
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from designer.base.errors import MISSING, InputError
from designer.base.schema import FileTable, keys_of
from designer.dynamics.counts import Counts
from designer.jobs.template import TEXT
from designer.model.circuit_table import SIDE_CONDITIONS, CircuitSpec
from designer.model.model import Dimensionless, Mechanical
from designer.model.model_file import (
    MAX_BYTES,
    ModelFile,
    json_schema,
    parse_model_file,
    read_model_file,
)
from designer.model.response_table import Response
from tests.shared.model_text import dimensionless

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
PAPER = (EXAMPLES / "paper.toml").read_text(encoding="utf-8")
DRILL = (EXAMPLES / "drill.toml").read_text(encoding="utf-8")
MODEL = "[model]\nm = 0.5\nk = 0.5\nk0 = 0.95\nc = 0.5\nzeta = 0.1\nf20 = 0.0\nb = 0.25\n"
SMALL = "format = 1\n" + MODEL


def refused(text: str) -> InputError:
    """The error that a text ends in, with the file named."""
    with pytest.raises(InputError) as caught:
        parse_model_file(text, Path("some.toml"))
    assert caught.value.file == "some.toml"
    assert caught.value.exit_status == 2
    says = " is missing" if caught.value.found is MISSING else ": found "
    assert str(caught.value).startswith(f"some.toml: {caught.value.field}{says}")
    return caught.value


def changed(old: str, new: str, text: str = PAPER) -> str:
    assert old in text
    return text.replace(old, new, 1)


# The examples.


def test_paper_is_the_published_case() -> None:
    file = read_model_file(EXAMPLES / "paper.toml")
    assert file.model == Dimensionless(
        m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25, sides="both"
    )
    assert file.mechanical is None
    wanted = [(each.omega, str(each.expect), each.symmetric) for each in file.responses]
    assert wanted == [
        (1.55, "1-1-1", None),
        (1.43, "1-1-1", False),
        (0.85, "1-2-2", None),
        (0.54, "1-3-3", None),
        (0.41, "1-4-4", None),
        (0.337, "1-5-5", None),
        (0.284, "1-6-6", None),
        (0.24, "1-7-7", None),
        (0.215, "1-8-8", None),
    ]
    assert file.circuit == CircuitSpec(
        opamp="TL074C",
        supply=15.0,
        saturation=13.0,
        resistors=("E96",),
        capacitors=("E12",),
        resistor_grade=0.01,
        capacitor_grade=0.01,
        resistor_range=(1e3, 1e6),
        capacitor_range=(1e-9, 1e-6),
        frequency=(50.0, 1000.0),
        dead_zone="saturation",
        objective="match",
        composites=False,
        side_conditions=True,
    )


def test_paper_is_written_for_editing_by_line() -> None:
    # One element a line, bare headers, one-line arrays, each key of the contract.
    for line in PAPER.splitlines():
        assert re.fullmatch(r"|#.*|\[\w+\]|\[\[\w+\]\]|\w+ = [^#]*[^#\s]", line), line
    tables = tomllib.loads(PAPER)
    assert set(tables) == {"format", "title", "model", "response", "circuit"}
    assert set(tables["model"]) == {each.name for each in fields(Dimensionless)}
    # Choices are stated; wishes, of which the paper has none, are left out.
    wishes = {"diode", "reference", "matched", "preferred", "most_values", "slack", "max_error"}
    wishes |= {"resistor_family", "capacitor_family"}
    assert set(tables["circuit"]) == {each.name for each in fields(CircuitSpec)} - wishes
    assert all({"omega", "expect"} <= set(table) for table in tables["response"])


def test_paper_has_no_line_that_an_edit_could_confuse() -> None:
    comments = [line for line in PAPER.splitlines() if line.startswith("#")]
    assert not any("=" in line or "[" in line for line in comments)


def test_drill_follows_equation_3() -> None:
    file = read_model_file(EXAMPLES / "drill.toml")
    mechanical = file.mechanical
    assert mechanical is not None
    # By hand, from the numbers in the file.
    model = dimensionless(file.model)
    assert model.m == pytest.approx(3 / (2 + 3), rel=1e-15)
    assert model.k == pytest.approx(40 / (60 + 40), rel=1e-15)
    assert model.k0 == pytest.approx(540 / (540 + 60), rel=1e-15)
    assert model.c == pytest.approx(24 / (56 + 24), rel=1e-15)
    assert model.zeta == pytest.approx(56 / (2 * math.sqrt(60e3 * 2)), rel=1e-15)
    assert model.f20 == pytest.approx(20 / (80 + 20), rel=1e-15)
    assert model.b == pytest.approx(0.5e-3 * 60e3 / (80 + 20), rel=1e-15)
    omegas = [each.omega for each in file.responses]
    assert omegas == pytest.approx([340 * math.sqrt(2 / 60e3), 124 * math.sqrt(2 / 60e3)])


# What a file may leave out, and how else it may say things.


def test_a_small_file_gets_the_defaults() -> None:
    file = parse_model_file(SMALL)
    assert file.circuit == CircuitSpec()
    assert file.responses == ()
    assert file.title == "untitled"
    assert dimensionless(file.model).sides == "both"
    assert parse_model_file(SMALL, Path("a/bench.toml")).title == "bench"


def test_the_defaults_are_those_of_the_paper_but_for_what_is_chosen() -> None:
    stated = parse_model_file(PAPER).circuit
    default = CircuitSpec()
    differ = {f.name for f in fields(stated) if getattr(stated, f.name) != getattr(default, f.name)}
    assert differ == {"saturation", "objective", "dead_zone"}
    assert default.saturation is None
    assert default.dead_zone is None
    assert (stated.objective, default.objective) == ("match", "margin")


def test_values_with_units() -> None:
    text = SMALL + (
        '[circuit]\nsupply = "12 V"\nsaturation = "10500 mV"\n'
        'resistor_range = ["4k7", 470000]\ncapacitor_range = ["1nF", "0.1 µF"]\n'
        'frequency = ["100 Hz", "1.5kHz"]\nresistors = ["E24", "E96", "E24"]\n'
    )
    circuit = parse_model_file(text).circuit
    assert circuit.supply == 12.0
    assert circuit.saturation == 10.5
    assert circuit.resistor_range == (4.7e3, 470e3)
    assert circuit.capacitor_range == (1e-9, 1e-7)
    assert circuit.frequency == (100.0, 1500.0)
    assert circuit.resistors == ("E24", "E96")


def test_everything_that_a_response_may_say() -> None:
    text = SMALL + (
        '[[response]]\nomega = "best"\nexpect = "2-4-4"\n'
        '[[response]]\nomega = 1\nexpect = "1-1-2"\ntwin = "exact"\nsymmetric = false\nb = 0.3\n'
        "[[response]]\nomega = 0.5\nb = [0.2, 0.3]\n"
    )
    assert parse_model_file(text).responses == (
        Response(None, Counts(2, ((4, 4),))),
        Response(1.0, Counts(1, ((1, 2),)), "exact", False, 0.3),
        Response(0.5, None, "either", None, (0.2, 0.3)),
    )


def test_later_choices_of_the_contract_are_valid() -> None:
    text = SMALL + (
        '[circuit]\nobjective = "yield"\ncomposites = true\ndead_zone = "rectifier"\n'
        "side_conditions = false\n"
    )
    circuit = parse_model_file(text).circuit
    assert (circuit.objective, circuit.composites) == ("yield", True)
    assert (circuit.dead_zone, circuit.side_conditions) == ("rectifier", False)


def test_wishes_and_side_conditions() -> None:
    text = SMALL + (
        '[circuit]\ndiode = "BAT54"\nreference = "LM4040C41"\nslack = 1e-4\nmost_values = 9\n'
        'matched = [["R1", "R7"], ["C2", "C4"], ["R7", "R3", "R7"]]\n'
        'preferred = ["10k", "10nF", 4700, "4k7", "4R7", 1e-8, "22 kΩ"]\n'
        'composites = ["R50", "R203", "R50"]\nside_conditions = ["load", "swing"]\n'
    )
    circuit = parse_model_file(text).circuit
    assert (circuit.diode, circuit.reference) == ("BAT54", "LM4040C41")
    assert (circuit.slack, circuit.most_values) == (1e-4, 9)
    # R7 joins two groups into one.
    assert circuit.matched == (("C2", "C4"), ("R1", "R7", "R3"))
    assert circuit.preferred == (1e-8, 4.7, 4.7e3, 1e4, 2.2e4)
    assert circuit.composites == ("R50", "R203")
    assert circuit.active_conditions == {"load", "swing"}
    assert hash(circuit) == hash(parse_model_file(text).circuit)


def test_side_conditions_are_all_or_none_or_those_named() -> None:
    assert CircuitSpec().active_conditions == set(SIDE_CONDITIONS)
    assert CircuitSpec(side_conditions=False).active_conditions == set()
    assert CircuitSpec(side_conditions=()).active_conditions == set()
    assert CircuitSpec(side_conditions=("swing",)).active_conditions == {"swing"}


def test_omega_may_be_dimensionless_under_mechanical() -> None:
    text = changed("Omega = 340.0", "omega = 1.25", DRILL)
    assert parse_model_file(text).responses[0].omega == 1.25


def test_text_and_hash_are_of_the_file_word_for_word(tmp_path: Path) -> None:
    path = tmp_path / "windows.toml"
    content = PAPER.replace("\n", "\r\n").encode()
    path.write_bytes(content)
    file = read_model_file(path)
    assert file.text.encode() == content
    assert file.sha256 == hashlib.sha256(content).hexdigest()
    assert file.source == path
    assert file.model == parse_model_file(PAPER).model


def test_a_byte_order_mark_is_no_obstacle(tmp_path: Path) -> None:
    path = tmp_path / "marked.toml"
    path.write_bytes(b"\xef\xbb\xbf" + PAPER.encode())
    assert read_model_file(path).text == PAPER


def test_what_was_read_does_not_change() -> None:
    file = parse_model_file(PAPER)
    with pytest.raises(FrozenInstanceError):
        file.title = "other"  # type: ignore[misc]
    assert isinstance(hash(file), int)


# n-p-q.


def test_a_response_accepts_its_twin_unless_it_is_to_be_exact() -> None:
    one, other = Counts.parse("1-2-1;0-1"), Counts.parse("1-1-2;1-0")
    assert Response(1.0).accepts(one)
    assert Response(1.0, one).accepts(one)
    assert Response(1.0, one).accepts(other)
    assert Response(1.0, one, twin="exact").accepts(one)
    assert not Response(1.0, one, twin="exact").accepts(other)
    assert not Response(1.0, one).accepts(Counts.parse("1-1-2;0-1"))
    assert not Response(1.0, one).accepts(Counts.parse("1-2-1"))


# What is wrong, one thing at a time: (old, new, field, found, part of what was expected).

WRONG = [
    ('expect = "1-2-2"', 'expect = "1-2-2;0-1"', "response[3].expect", "1-2-2;0-1", "1-p-q"),
    # structure
    ("format = 1", "format = 3", "format", "3", "1 or 2"),
    ("format = 1", "format = true", "format", "true", "1"),
    ("format = 1", "format = 1.0", "format", "1.0", "1"),
    ("format = 1\n", "", "format", "is missing", "1"),
    ("[model]", "[modle]", "modle", "unknown key 'modle'", 'did you mean "model"?'),
    ("[model]", "[[model]]", "model", "[{", "a table [model]"),
    ("\n[model]", "\nresponse = 3\n[model]", "line", "[[response]]", "valid TOML"),
    ("[circuit]", "[yield]\nx = 1\n[circuit]", "yield", "unknown key 'yield'", "one of"),
    ('title = "Soft', 'title = "\\nSoft', "title", '"?Soft', "line breaks"),
    ("title = ", "title = 3 #", "title", "3", "text"),
    # [model]
    ("m = 0.5", "m = 1.5", "model.m", "1.5", "(0, 1)"),
    ("m = 0.5", "m = 0", "model.m", "0", "(0, 1)"),
    ("k = 0.5", "k = 0", "model.k", "0", "no circuit can hold"),
    ("k0 = 0.95", "k0 = 1.0", "model.k0", "1.0", "[0, 1)"),
    ("k0 = 0.95", "k0 = -0.1", "model.k0", "-0.1", "[0, 1)"),
    ("c = 0.5", "c = 1", "model.c", "1", "[0, 1)"),
    ("zeta = 0.1", "zeta = 0", "model.zeta", "0", "> 0"),
    ("f20 = 0.0", "f20 = 1.1", "model.f20", "1.1", "[0, 1]"),
    ("b = 0.25", "b = 0.0", "model.b", "0.0", "> 0"),
    ("b = 0.25", "b = nan", "model.b", "nan", "finite"),
    ("b = 0.25", "b = inf", "model.b", "inf", "finite"),
    ("b = 0.25", "b = 1e400", "model.b", "inf", "finite"),
    ("b = 0.25", "b = 0x" + "f" * 4000, "model.b", "a very large integer", "too large"),
    ("k0 = 0.95", 'k0 = "much"', "model.k0", '"much"', "without quotes"),
    ("k0 = 0.95", 'k0 = "0.95"', "model.k0", '"0.95"', "without quotes"),
    ("k0 = 0.95", "k0 = [0.95]", "model.k0", "[0.95]", "a number"),
    ("k0 = 0.95", "k0 = false", "model.k0", "false", "a number"),
    ("k0 = 0.95", "k0 = 1979-05-27", "model.k0", "date", "a number"),
    ("zeta = 0.1", "zet = 0.1", "model.zet", "unknown key 'zet'", 'did you mean "zeta"?'),
    ("zeta = 0.1\n", "", "model.zeta", "is missing", "> 0"),
    ("zeta = 0.1\n", "zeta = 0.1\nB = 1\n", "model.B", "unknown key 'B'", 'did you mean "b"?'),
    ('sides = "both"', 'sides = "left"', "model.sides", '"left"', '"upper"'),
    ('sides = "both"', "sides = 2", "model.sides", "2", '"upper"'),
    # [[response]]
    ("omega = 0.85", "omega = 0", "response[3].omega", "0", '> 0, or "best"'),
    ("omega = 0.85", "omega = -1", "response[3].omega", "-1", '> 0, or "best"'),
    ("omega = 0.85", 'omega = "fast"', "response[3].omega", '"fast"', '"best"'),
    ("omega = 0.85", "Omega = 10", "response[3].Omega", "10.0", "[mechanical]"),
    ("omega = 0.85\n", "", "response[3].omega", "is missing", '"best"'),
    ("omega = 0.85", "omgea = 0.85", "response[3].omgea", "unknown key", 'did you mean "omega"?'),
    ('"1-2-2"', '"17-2-2"', "response[3].expect", '"17-2-2"', "1 to 16"),
    ('"1-2-2"', '"2-2"', "response[3].expect", '"2-2"', "n-p-q"),
    ('"1-2-2"', "122", "response[3].expect", "122", "n-p-q"),
    ("symmetric = false", "symmetric = 0", "response[2].symmetric", "0", "true or false"),
    ("symmetric = false", 'twin = "eaxct"', "response[2].twin", '"eaxct"', 'mean "exact"?'),
    ("symmetric = false", "b = 0", "response[2].b", "0", "> 0"),
    ("symmetric = false", "b = [0.3, 0.2]", "response[2].b", "[0.3, 0.2]", "reversed"),
    ("symmetric = false", "b = [0.2]", "response[2].b", "[0.2]", "[low, high]"),
    ("symmetric = false", "b = [0, 0.2]", "response[2].b", "[0, 0.2]", "> 0"),
    ('expect = "1-2-2"', 'twin = "exact"', "response[3].twin", '"exact"', "an expect"),
    # [circuit]
    ('"TL074C"', "74", "circuit.opamp", "74", "op-amp"),
    ('"TL074C"', '" "', "circuit.opamp", '" "', "op-amp"),
    ("supply = 15.0", "supply = -15", "circuit.supply", "-15", "> 0 in V"),
    ("supply = 15.0", 'supply = "15 A"', "circuit.supply", '"15 A"', "in V"),
    ("supply = 15.0", "supply = true", "circuit.supply", "true", "in V"),
    ("saturation = 13.0", "saturation = 16", "circuit.saturation", "16.0", "within the supply"),
    ('"E96"', '"E97"', "circuit.resistors", '"E97"', 'did you mean "E96"?'),
    ('"E96"', '["E24", "e96"]', "circuit.resistors", "['E24', 'e96']", 'did you mean "E96"?'),
    ('"E96"', "[]", "circuit.resistors", "[]", "E192"),
    ('"E12"', "12", "circuit.capacitors", "12", "E192"),
    ("resistor_grade = 0.01", "resistor_grade = 1", "circuit.resistor_grade", "1", "(0, 1)"),
    ("capacitor_grade = 0.01", "capacitor_grade = 0", "circuit.capacitor_grade", "0", "(0, 1)"),
    ("[1e3, 1e6]", "[1e6, 1e3]", "circuit.resistor_range", "[1000000.0, 1000.0]", "reversed"),
    ("[1e3, 1e6]", "[0, 1e3]", "circuit.resistor_range", "[0, 1000.0]", "> 0"),
    ("[1e3, 1e6]", "1e3", "circuit.resistor_range", "1000.0", "[low, high]"),
    ("[1e3, 1e6]", "[1, 2, 3]", "circuit.resistor_range", "[1, 2, 3]", "[low, high]"),
    ("[1e-9, 1e-6]", '["1nH", "1µF"]', "circuit.capacitor_range", "['1nH', ", "in F"),
    ("[50, 1000]", '["50 Hz", true]', "circuit.frequency", "['50 Hz', True]", "in Hz"),
    ('"saturation"', '"rectifer"', "circuit.dead_zone", '"rectifer"', 'mean "rectifier"?'),
    ('"match"', '"yeild"', "circuit.objective", '"yeild"', 'did you mean "yield"?'),
    ("composites = false", "composites = 0", "circuit.composites", "0", "true, false or"),
    ("composites = false", 'composites = ["C1"]', "circuit.composites", "['C1']", "resistors"),
    ("composites = false", "composites = [7]", "circuit.composites", "[7]", "resistors"),
    ("side_conditions = true", "side_conditions = 1", "circuit.side_conditions", "1", "noise_gain"),
    ("side_conditions = true", 'side_conditions = ["swings"]', "circuit.side_conditions",
     "['swings']", 'did you mean "swing"?'),
    ("side_conditions = true", "matched = [3]", "circuit.matched", "[3]", '["R1", "R7"]'),
    ("side_conditions = true", 'matched = [["R1", "C1"]]', "circuit.matched", "[['R1', 'C1']]",
     "no value in common"),
    ("side_conditions = true", 'matched = [["R1", "R1"]]', "circuit.matched", "[['R1', 'R1']]",
     "two parts or more"),
    ("side_conditions = true", 'matched = [["R1", "U1A"]]', "circuit.matched", "[['R1', 'U1A']]",
     '["R1", "R7"]'),
    ("side_conditions = true", 'preferred = ["10 V"]', "circuit.preferred", "['10 V']", "Ω or F"),
    ("side_conditions = true", "preferred = [0]", "circuit.preferred", "[0]", "Ω or F"),
    ("side_conditions = true", "preferred = 10", "circuit.preferred", "10", "a list"),
    ("side_conditions = true", "most_values = 0", "circuit.most_values", "0", ">= 1"),
    ("side_conditions = true", "most_values = 9.0", "circuit.most_values", "9.0", ">= 1"),
    ("side_conditions = true", "most_values = true", "circuit.most_values", "true", ">= 1"),
    ("side_conditions = true", "slack = -1e-9", "circuit.slack", "-1e-09", "from 0 to 0.1"),
    ("side_conditions = true", "slack = 0.11", "circuit.slack", "0.11", "from 0 to 0.1"),
    ("side_conditions = true", "slack = inf", "circuit.slack", "inf", "from 0 to 0.1"),
    ("side_conditions = true", "diode = 4148", "circuit.diode", "4148", "diode"),
    ("side_conditions = true", 'reference = ""', "circuit.reference", '""', "reference"),
    ("side_conditions = true", "sideconditions = true", "circuit.sideconditions", "unknown",
     'did you mean "side_conditions"?'),
    # TOML
    ("k0 = 0.95", "k0 = ", "line 10", "k0 =", "valid TOML"),
    ("k0 = 0.95", "k0 0.95", "line 10", "k0 0.95", "valid TOML"),
    ("k0 = 0.95", "k = 0.95", "line 10", "k = 0.95", "valid TOML"),
    ("k0 = 0.95", "k0 = " + "9" * 5000, "line", "", "valid TOML"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "field", "found", "expected"), WRONG)
def test_names_what_is_wrong(old: str, new: str, field: str, found: str, expected: str) -> None:
    error = refused(changed(old, new))
    if field == "line":
        assert error.field.startswith("line ")
    else:
        assert error.field == field
    message = str(error)
    says = found if found == "is missing" else f"found {found}"
    assert says in message.replace("datetime.", "")
    assert expected in message.partition(", expected ")[2]
    assert message.isprintable()


WRONG_MECHANICAL = [
    ('"2 kg"', '"2 k"', "mechanical.M1", '"2 k"', "in kg"),
    ('"2 kg"', "0", "mechanical.M1", "0", "> 0 in kg"),
    ('"40 kN/m"', "0", "mechanical.K2", "0", "> 0"),
    ('"60 kN/m"', '"60 kN"', "mechanical.K1", '"60 kN"', "in N/m"),
    ('"0.5 mm"', "-1", "mechanical.B", "-1", "> 0 in m"),
    ("P1 = 80.0", "P1 = -80.0", "mechanical.P1", "-80.0", ">= 0 in N"),
    ("C2 = 24.0\n", "", "mechanical.C2", "is missing", "N s/m"),
    ("C2 = 24.0", "c2 = 24.0", "mechanical.c2", "unknown key 'c2'", 'did you mean "C2"?'),
    ('"2 kg"', "1e-300", "mechanical.M2", "3.0", "m = M2/(M1 + M2) a number in (0, 1)"),
    ('"60 kN/m"', "1e-320", "mechanical.", "", ""),
    ("Omega = 340.0", "Omega = 340\nomega = 1", "response[1].Omega", "omega and", "one of the two"),
    (
        "Omega = 340.0",
        "Omega = 340\nfrequency = 54\nomega = 1",
        "response[1].frequency",
        "omega and Omega and frequency",
        "one of the three",
    ),
    ("Omega = 340.0", "Omega = 0", "response[1].Omega", "0", "rad/s"),
    ("Omega = 340.0", 'Omega = "best"', "response[1].Omega", '"best"', "rad/s"),
    (
        'Omega = 340.0\nexpect = "1-1-1"\n',
        'expect = "1-1-1"\n',
        "response[1].omega",
        "is missing",
        "Omega in rad/s",
    ),
    ("[mechanical]", MODEL + "[mechanical]", "mechanical", "[model] and", "one of the two"),
]


@pytest.mark.parametrize(("old", "new", "field", "found", "expected"), WRONG_MECHANICAL)
def test_names_what_is_wrong_in_si(
    old: str, new: str, field: str, found: str, expected: str
) -> None:
    error = refused(changed(old, new, DRILL))
    assert error.field.startswith(field) if field.endswith(".") else error.field == field
    assert (found if found == "is missing" else f"found {found}") in str(error)
    assert expected in error.expected


def test_p1_and_p2_both_zero() -> None:
    error = refused(DRILL.replace("P1 = 80.0", "P1 = 0").replace("P2 = 20.0", "P2 = 0"))
    assert error.field == "mechanical.P1"


def test_a_file_without_a_model() -> None:
    error = refused("format = 1\n")
    assert error.field == "model"
    assert "[mechanical]" in error.expected


def test_a_response_in_single_brackets() -> None:
    error = refused(SMALL + "[response]\nomega = 1\n")
    assert error.field == "response"
    assert "[[response]]" in error.expected


def test_an_empty_text() -> None:
    assert refused("").field == "format"


def test_nesting_beyond_reason() -> None:
    error = refused("title = " + "[" * 100_000)
    assert error.field == "line 1"


@pytest.mark.parametrize("name", ["title", "model", "mechanical", "response", "circuit", "format"])
@pytest.mark.parametrize("value", ["3", "true", '"x"', "[1]", "{}", "nan", "1979-05-27", "[{}]"])
def test_no_value_of_a_wrong_type_gets_past(name: str, value: str) -> None:
    text = f"{name} = {value}\n" + ("" if name == "format" else "format = 1\n")
    text += "" if name in ("model", "mechanical") else MODEL
    try:
        file = parse_model_file(text)
    except InputError:
        return
    assert (name, value) in {("title", '"x"'), ("circuit", "{}")}
    assert file.title in ("x", "untitled")


# Files that are no files.


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the file is missing, expected a model file") as caught:
        read_model_file(tmp_path / "nowhere.toml")
    assert "nowhere.toml" in str(caught.value)


def test_a_folder(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="found a folder"):
        read_model_file(tmp_path)


def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.toml")
    with pytest.raises(InputError, match="no regular file"):
        read_model_file(tmp_path / "pipe.toml")


def test_a_name_that_no_file_can_have() -> None:
    with pytest.raises(InputError, match="null"):
        read_model_file(Path("a\0b"))
    with pytest.raises(InputError, match="too long"):
        read_model_file(Path("a" * 5000))


def test_a_file_that_is_too_large(tmp_path: Path) -> None:
    path = tmp_path / "large.toml"
    path.write_bytes(b"# " + b"x" * MAX_BYTES)
    with pytest.raises(InputError, match="more than 1000000 bytes"):
        read_model_file(path)


def test_a_file_of_the_largest_size(tmp_path: Path) -> None:
    path = tmp_path / "largest.toml"
    path.write_bytes((SMALL + "#").encode().ljust(MAX_BYTES, b"x"))
    assert dimensionless(read_model_file(path).model).m == 0.5


def test_a_file_that_is_not_utf_8(tmp_path: Path) -> None:
    path = tmp_path / "latin.toml"
    path.write_bytes(PAPER.replace("two-sided", "two\xadsided").encode("latin-1"))
    with pytest.raises(InputError, match="UTF-8") as caught:
        read_model_file(path)
    assert caught.value.field == "line 5"
    assert caught.value.found == "byte 0xad"


# Whatever a file holds, the answer is a model or an InputError.


@given(st.text(max_size=200))
def test_any_text_is_answered(text: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_model_file(text)
    assert str(caught.value).isprintable()


LINES = PAPER.splitlines(keepends=True)


@given(st.integers(0, len(LINES) - 1), st.sampled_from(LINES), st.booleans())
def test_any_misplaced_line_is_answered(place: int, line: str, replace: bool) -> None:
    text = "".join([*LINES[:place], line, *LINES[place + replace :]])
    with contextlib.suppress(InputError):
        assert isinstance(parse_model_file(text), ModelFile)


@given(st.text(min_size=1, max_size=20))
def test_any_unknown_key_is_named(key: str) -> None:
    quoted = "".join(
        f"\\u{ord(ch):04X}" if ord(ch) < 0x10000 else f"\\U{ord(ch):08X}" for ch in key
    )
    if key in {each.name for each in fields(Dimensionless)}:
        return
    error = refused("format = 1\n" + MODEL + f'"{quoted}" = 1\n')
    assert error.field.startswith("model.")
    assert "unknown key" in str(error)
    assert str(error).isprintable()


def test_what_the_starter_shows_in_comments_is_valid() -> None:
    """Every key of [circuit] stands in it; a comment's mark taken away leaves a valid line."""
    assert parse_model_file(TEXT).circuit == CircuitSpec(saturation=13.0)
    table, _, spread = TEXT[TEXT.index("[circuit]") :].partition("\n\n")
    shown = [line.removeprefix("# ").partition("  #")[0] for line in table.splitlines()[1:]]
    assert {line.partition(" =")[0] for line in shown} == {f.name for f in fields(CircuitSpec)}
    for line in shown:
        parse_model_file(SMALL + "[circuit]\n" + line)
    lines = [line.removeprefix("# ") for line in spread.splitlines()]
    read = parse_model_file(SMALL + "\n".join(lines[lines.index("[spread]") :])).spread
    assert (read.resistors.law, read.temperature, read.supply) == ("normal", (10.0, 40.0), 0.02)
    assert read.measured == "measured.csv"


# What the JSON Schema, and so docs/reference/model-file-keys.md, says of the keys of a model.


@pytest.mark.parametrize(("name", "table"), [("model", Dimensionless), ("mechanical", Mechanical)])
def test_the_model_s_keys_are_required(name: str, table: type[FileTable]) -> None:
    required = json_schema()["$defs"][table.__name__]["required"]
    assert set(required) == keys_of(table).keys() - {"sides"}
    fine = {"model": MODEL, "mechanical": DRILL[DRILL.index("[mechanical]") :].split("\n\n")[0]}
    for key in required:
        rest, count = re.subn(rf"^{key} *=.*\n?", "", fine[name], flags=re.MULTILINE)
        assert count == 1, key
        assert refused(f"format = 1\n{rest}").field == f"{name}.{key}"


@pytest.mark.parametrize("key", sorted(keys_of(Dimensionless).keys() - {"sides"}))
def test_the_schema_says_the_domain_of_each_parameter(key: str) -> None:
    """The ends of the interval that it gives, by trying them."""
    domain = json_schema()["$defs"]["Dimensionless"]["properties"][key]["description"]
    domain = domain.partition("Expected: a number ")[2]
    for end, inside in ((0.0, "[0" in domain), (1.0, "1]" in domain or domain == "> 0.")):
        text = "format = 1\n" + re.sub(rf"^{key} = .*", f"{key} = {end}", MODEL, flags=re.M)
        if inside:
            assert getattr(parse_model_file(text).model, key) == end
        else:
            assert refused(text).field == f"model.{key}"
