"""The table [spread]: what it accepts, and one refusal for each thing that is wrong with it."""

from __future__ import annotations

from pathlib import Path

import pytest

from designer.base.errors import InputError
from designer.cli import entry
from designer.model.measured_values import read_measured
from designer.model.model_file import parse_model_file, read_model_file
from designer.model.spread_table import NetworkRule, Offset, PartRule, SpreadShape, SpreadSpec
from designer.spread.part_rules import spread_of
from tests.circuit.test_reduction import EXACT
from tests.shared.stages import bought, stage
from tests.spread.test_spread_model import CATALOG, PAPER

ROOT = Path(__file__).resolve().parents[2]
SOLD = stage("saturation", "both", bought(EXACT))


def table(text: str) -> SpreadSpec:
    return parse_model_file(f"{PAPER}\n[spread]\n{text}\n").spread


def test_the_example_states_every_key_and_is_valid() -> None:
    path = ROOT / "examples" / "spread.toml"
    modelfile = read_model_file(path)
    spread = spread_of(modelfile, SOLD, CATALOG)
    assert spread.name == "model file"
    text = path.read_text(encoding="utf-8")
    lines = [line.lstrip("# ") for line in text.splitlines()]
    for key in SpreadSpec.__dataclass_fields__:
        named = any(line.startswith((f"{key} =", f"[[spread.{key}]]")) for line in lines)
        assert named, key
    for key in PartRule.__dataclass_fields__:
        assert any(line.startswith(f"{key} =") for line in lines), key


def test_what_the_comments_of_the_example_offer_is_valid() -> None:
    said = 'resistors = { law = "binned", inner = 0.002 }\noffset = 0\nbias = "typical"'
    read = table(said + "\nreference_grade = 0.001")
    assert read.resistors == SpreadShape("binned", inner=0.002)
    assert read.offset == Offset(0.0, 0.0)


def test_the_examples_of_the_documentation(tmp_path: Path) -> None:
    text = (ROOT / "docs" / "spread.md").read_text(encoding="utf-8")
    blocks = [block.partition("\n") for block in text.split("```")[1::2]]
    (example,) = [body for language, _, body in blocks if language == "toml"]
    read = parse_model_file(f"{PAPER}\n{example}").spread
    assert (read.reels, read.temperature, len(read.network), len(read.part)) == (
        0.5,
        (10, 40),
        1,
        1,
    )
    (listed,) = [body for language, _, body in blocks if not language]
    (tmp_path / "bench.csv").write_text(listed, encoding="utf-8")
    assert read_measured(tmp_path / "bench.csv").values["U1A.offset"] == (-1.3e-3,)


def test_units_and_short_forms() -> None:
    read = table(
        """\
resistors = "normal"
capacitors = { law = "normal", sigmas = 2 }
offset = { sigma = "500 µV", limit = 2e-3 }
bias = ["-10 pA", "20 pA"]
gain_bandwidth = [1e6, "2 MHz"]
temperature = [20, 20]
ageing = [-0.01, 0]
measured = "lists/bench.csv"
network = [{ parts = ["R1", "R7"], share = 1 }, { parts = ["C2", "C4"], share = 0.5 }]
part = [{ names = "R1", tempco = 5e-6 }]
"""
    )
    assert (read.resistors, read.capacitors) == (SpreadShape("normal"), SpreadShape("normal", 2.0))
    assert read.offset == Offset(5e-4, 2e-3)
    assert read.bias == (-1e-11, 2e-11)
    assert read.gain_bandwidth == (1e6, 2e6)
    assert (read.temperature, read.ageing) == ((20.0, 20.0), (-0.01, 0.0))
    assert read.measured == "lists/bench.csv"
    assert read.network == (NetworkRule(("R1", "R7"), 1.0), NetworkRule(("C2", "C4"), 0.5))
    assert read.part == (PartRule(("R1",), tempco=(-5e-6, 5e-6)),)


WRONG = [
    # text, field, part of what was found, part of what was expected
    ("x = 1", "spread.x", "unknown key 'x'", "one of"),
    ('resistor = "normal"', "spread.resistor", "unknown key", 'did you mean "resistors"?'),
    ('resistors = "gauss"', "spread.resistors", "gauss", "one of uniform, normal, binned"),
    ('resistors = "unifrom"', "spread.resistors", "unifrom", 'did you mean "uniform"?'),
    ("resistors = 3", "spread.resistors", "3", '"uniform", "normal"'),
    ("resistors = { sigmas = 3 }", "spread.resistors", "sigmas", '"uniform"'),
    ('resistors = { law = "normal", sigmas = 0 }', "spread.resistors", "0", "sigmas is > 0"),
    ('resistors = { law = "normal", sigmas = -1 }', "spread.resistors", "-1", "sigmas is > 0"),
    ('resistors = { law = "normal", sigmas = "3" }', "spread.resistors", "3", "is a number"),
    ('resistors = { law = "normal", inner = 1 }', "spread.resistors", "1", "normal has no inner"),
    ('capacitors = "binned"', "spread.capacitors", "binned", "binned needs inner"),
    (
        'capacitors = { law = "binned", inner = 0.01 }',
        "spread.capacitors.inner",
        "0.01",
        "below the grade of 0.01",
    ),
    (
        'resistors = { law = "binned", inner = 0.05 }',
        "spread.resistors.inner",
        "0.05",
        "below the grade of 0.01",
    ),
    ('resistors = { law = "binned", inner = -0.1 }', "spread.resistors", "-0.1", "inner is > 0"),
    ("offset = 1", "spread.offset", "1", "sigma"),
    ("offset = false", "spread.offset", "false", "sigma"),
    ('offset = { sigma = "3 mV" }', "spread.offset", "3 mV", "limit"),
    ('offset = { sigma = "-3 mV", limit = 1 }', "spread.offset", "-3 mV", "both are > 0"),
    ('offset = { sigma = "3 mA", limit = 1 }', "spread.offset", "3 mA", "sigma"),
    ("saturation = -0.05", "spread.saturation", "-0.05", "a fraction in [0, 1)"),
    ("saturation = 1.0", "spread.saturation", "1.0", "a fraction in [0, 1)"),
    ("supply = -0.1", "spread.supply", "-0.1", "a fraction in [0, 1)"),
    ('supply = "5 %"', "spread.supply", "5 %", "without quotes"),
    ('bias = "most"', "spread.bias", "most", '"data sheet"'),
    ("bias = [2e-12, 1e-12]", "spread.bias", "[", "reversed"),
    ('gain_bandwidth = ["1 MHz"]', "spread.gain_bandwidth", "1 MHz", "a range"),
    ("reference_grade = 2", "spread.reference_grade", "2", "[0, 1)"),
    ("temperature = [50, 0]", "spread.temperature", "[50, 0]", "reversed"),
    ("temperature = 50", "spread.temperature", "50", "a range [low, high]"),
    ("temperature = [-300, 0]", "spread.temperature", "-300", "°C"),
    ("temperature = [0, nan]", "spread.temperature", "nan", "°C"),
    ("ageing = -0.01", "spread.ageing", "-0.01", "± a number >= 0"),
    ("ageing = [0.01, 0.0]", "spread.ageing", "0.01", "reversed"),
    ("ageing = 1.5", "spread.ageing", "1.5", "a fraction"),
    ("reels = 1.1", "spread.reels", "1.1", "from 0 to 1"),
    ("reels = -0.1", "spread.reels", "-0.1", "from 0 to 1"),
    ("measured = 3", "spread.measured", "3", "CSV"),
    (
        '[[spread.network]]\nparts = ["R1", "R7"]\nshare = 1.5',
        "spread.network[1].share",
        "1.5",
        "from 0 to 1",
    ),
    ('[[spread.network]]\nparts = ["R1"]', "spread.network[1].share", "is missing", "a share"),
    ("[[spread.network]]\nparts = 3\nshare = 1", "spread.network[1].parts", "3", "a list"),
    ("[[spread.part]]\ngrade = 0.1", "spread.part[1].names", "is missing", "a part such as"),
    ("[[spread.part]]\nnames = []", "spread.part[1].names", "[]", "a list of parts"),
    ('[[spread.part]]\nnames = ["R1", "R1"]', "spread.part[1].names", "R1", "once"),
    ('[[spread.part]]\nnames = "R1"\ngrade = -0.1', "spread.part[1].grade", "-0.1", "[0, 1)"),
    ('[[spread.part]]\nnames = "R1"\nlaw = "x"', "spread.part[1].law", "x", "uniform"),
    ('[[spread.part]]\nnames = "R1"\ntempco = -1e-4', "spread.part[1].tempco", "-0.0001", ">= 0"),
    ('[[spread.part]]\nnames = "R1"\ntempco = 100', "spread.part[1].tempco", "100", "1/K"),
    ('[[spread.part]]\nnames = "R1"\nvalue = 1', "spread.part[1].value", "unknown key", "one of"),
    ("[[spread.parts]]\nnames = 1", "spread.parts", "unknown key", 'did you mean "part"?'),
]


@pytest.mark.parametrize(("text", "field", "found", "expected"), WRONG)
def test_names_what_is_wrong(text: str, field: str, found: str, expected: str) -> None:
    with pytest.raises(InputError) as caught:
        table(text)
    assert caught.value.field == field
    assert found in str(caught.value)
    assert expected in caught.value.expected


UNFIT = [
    ('[[spread.part]]\nnames = "R999"', "spread.part[1].names", "R999", "one of resistors"),
    ('[[spread.part]]\nnames = "references"', "spread.part[1].names", "references", "one of"),
    ('[[spread.part]]\nnames = "U1A"', "spread.part[1].names", "U1A", "one of"),
    (
        '[[spread.network]]\nparts = ["R1", "R999"]\nshare = 1',
        "spread.network[1].parts",
        "R999",
        "one of",
    ),
    (
        '[[spread.network]]\nparts = ["R1"]\nshare = 1',
        "spread.network[1].parts",
        "R1",
        "two or more",
    ),
    (
        '[[spread.network]]\nparts = ["R1", "C1"]\nshare = 1',
        "spread.network[1].parts",
        "R1, C1",
        "two or more resistors, or capacitors",
    ),
    (
        '[[spread.network]]\nparts = ["R1", "R7"]\nshare = 1\n'
        '[[spread.network]]\nparts = ["R7", "R8"]\nshare = 1',
        "spread.network[2].parts",
        "R7",
        "in one network, once",
    ),
    (
        '[[spread.network]]\nparts = ["R1", "R7"]\nshare = 1\n'
        '[[spread.part]]\nnames = "R7"\nlaw = { law = "binned", inner = 0.001 }',
        "spread.network[1].parts",
        "R7, binned",
        "picked by itself",
    ),
    (
        '[[spread.part]]\nnames = "R7"\ngrade = 0.001\nlaw = { law = "binned", inner = 0.001 }',
        "spread.part[1].law.inner",
        "0.001",
        "below the grade of 0.001",
    ),
    (
        'temperature = [0, 50]\n[[spread.part]]\nnames = "R7"\ngrade = 1e-6',
        "spread.temperature",
        "R7",
        "tempco in [[spread.part]]",
    ),
]


@pytest.mark.parametrize(("text", "field", "found", "expected"), UNFIT)
def test_names_what_does_not_fit_the_design(
    text: str, field: str, found: str, expected: str
) -> None:
    modelfile = parse_model_file(f"{PAPER}\n[spread]\n{text}\n")
    with pytest.raises(InputError) as caught:
        spread_of(modelfile, SOLD, CATALOG)
    assert caught.value.field == field
    assert found in str(caught.value.found)
    assert expected in caught.value.expected


@pytest.mark.parametrize("verb", ["run", "tolerance", "synthesise"])
@pytest.mark.parametrize(
    ("text", "word"),
    [
        ('resistors = "gauss"', "spread.resistors"),
        ('[[spread.part]]\nnames = "R999"', "spread.part[1].names"),
        ('[[spread.network]]\nparts = ["R1", "R1A"]\nshare = 1', "spread.network[1].parts"),
        ('measured = "none.csv"', "spread.measured"),
    ],
)
def test_the_command_line_refuses_and_writes_nothing(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], verb: str, text: str, word: str
) -> None:
    model, out = tmp_path / "model.toml", tmp_path / "out"
    model.write_text(f"{PAPER}\n[spread]\n{text}\n", encoding="utf-8")
    assert entry.status([verb, str(model), "--out", str(out), "-q"]) == 2
    said = capfd.readouterr()
    assert (said.out, out.exists()) == ("", False)
    assert "Traceback" not in said.err
    assert word in said.err
    assert str(model) in said.err


def test_halves_of_a_composite_may_come_to_be() -> None:
    """Before a design is sought, R203A is known where composites are allowed; not otherwise."""
    from designer.spread.part_rules import check_names
    from designer.synthesis.part_checks import unit_circuit

    text = PAPER.replace("composites = false", "composites = true")
    part = '\n[spread]\n[[spread.part]]\nnames = "R203A"\n'
    for source, known in ((text, True), (PAPER, False)):
        modelfile = parse_model_file(source + part)
        circuit = unit_circuit(modelfile.model, modelfile.circuit, CATALOG)
        if known:
            check_names(modelfile, circuit, CATALOG)
        else:
            with pytest.raises(InputError, match="R203A"):
                check_names(modelfile, circuit, CATALOG)


@pytest.mark.parametrize(
    ("spread", "word"),
    [
        ('ageing = "catalogue"', "capacitors, of which the catalogue has no drift"),
        ('[[spread.network]]\nparts = ["R203"]\nshare = 1.0', "two or more resistors"),
        ('[[spread.network]]\nparts = ["R203", "C1"]\nshare = 1.0', "two or more resistors"),
        (
            '[[spread.network]]\nparts = ["R203", "R204"]\nfamily = "Vishay ACAS 0612"\n'
            '[[spread.network]]\nparts = ["R204", "R205"]\nshare = 1.0',
            "parts that are in one network",
        ),
    ],
)
def test_what_no_boards_can_be_is_refused_before_a_design_is_sought(
    spread: str, word: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    from designer.check import synthesis_result

    def sought(*_: object) -> None:
        raise AssertionError("work before the refusal")

    monkeypatch.setattr(synthesis_result, "find", sought)
    with pytest.raises(InputError, match=word):
        synthesis_result.synthesise(parse_model_file(f"{PAPER}\n[spread]\n{spread}\n"), CATALOG)
