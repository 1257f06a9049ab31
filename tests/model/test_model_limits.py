"""What is not modelled is said by name, with what comes nearest, and where it is documented."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from designer.base.errors import InputError
from designer.base.schema import FileTable, keys_of, nested_table
from designer.base.toml_writer import toml_text
from designer.model.model_file import FORMATS, parse_model_file
from designer.model.model_limits import ELEMENTS, LIMITS, MODELS, WHERE
from tests.shared.mechanism_file import HAMMER
from tests.shared.model_text import PAPER_TABLE

ROOT = Path(__file__).resolve().parents[2]
DRILL = (ROOT / "examples" / "drill.toml").read_text("utf-8")
PAPER = "format = 1\n" + PAPER_TABLE


def refused(text: str) -> InputError:
    with pytest.raises(InputError) as caught:
        parse_model_file(text, Path("some.toml"))
    return caught.value


def told(error: InputError, feature: str) -> None:
    """The message has the feature, what comes nearest and the page."""
    assert error.file == "some.toml"
    words = rf"; not modelled( in format [12])?: [^;]*{re.escape(feature)}[^;]*; nearest: .+"
    assert re.search(words, error.expected)
    assert error.expected.endswith(f"({WHERE})")


@pytest.mark.parametrize(
    ("line", "feature"),
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
        ("preload = 3", "a constant force"),
        ("friction = 3", "friction"),
        ("cubic = 3", "a spring that is not linear"),
        ("restitution = 0.8", "a coefficient of restitution"),
        ("phase = 90", "another phase"),
        ('frequency = "20 Hz"', "more than one drive frequency"),
        ('waveform = "square"', "no sine"),
        ("harmonics = [[2, 1.0, 0.0]]", "no sine"),
        ("delay = 1e-3", "a delay"),
        ("mass_matrix = [[1, 0], [0, 1]]", "matrices"),
        ("inertia = 1e-3", "rotation"),
        ("x0 = 1e-3", "initial conditions"),
    ],
)
def test_a_key_of_another_mechanism_is_named(line: str, feature: str) -> None:
    key = line.split()[0]
    error = refused(DRILL.replace("B = ", f"{line}\nB = "))
    assert error.field == f"mechanical.{key}"
    assert error.found == f"unknown key '{key}'"
    told(error, feature)


@pytest.mark.parametrize("key", ["m3", "k3", "zeta3", "b2", "b_lower"])
def test_so_is_one_of_a_dimensionless_model(key: str) -> None:
    error = refused(PAPER.replace("b = ", f"{key} = 0.1\nb = "))
    assert error.field == f"model.{key}"
    assert "format = 2" in error.expected


UNREAD = (
    ("friction = 3", "friction"),
    ("restitution = 0.8", "a coefficient of restitution"),
    ("phase = 90", "another phase"),
    ('frequency = "20 Hz"', "more than one drive frequency"),
    ("harmonics = [[2, 1.0, 0.0]]", "no sine"),
    ("delay = 1e-3", "a delay"),
    ("cubic = 1.0", "a spring that is not linear"),
    ("torque = 1.0", "rotation"),
    ("gravity = 9.81", "a weight"),
)
"""Keys that no element of format 2 has but those of ``READ``, and what they ask for."""
READ = {("clearance", "restitution"), ("force", "phase"), ("force", "harmonics")}


@pytest.mark.parametrize(
    ("table", "line", "feature"),
    [
        (table, *asked)
        for table in ("mass", "spring", "damper", "clearance", "force")
        for asked in UNREAD
        if (table, asked[0].split()[0]) not in READ
    ],
)
def test_an_element_of_format_2_has_no_such_key(table: str, line: str, feature: str) -> None:
    """Unless the element knows it: whoever models it has nothing to change in the table."""
    key = line.split()[0]
    if key in keys_of(_element(table)):
        pytest.fail(f"{table}.{key} is read: take this case away")
    error = refused(HAMMER.replace(f"[[{table}]]\n", f"[[{table}]]\n{line}\n", 1))
    assert error.field == f"{table}[1].{key}"
    told(error, feature)


def test_an_acceleration_of_the_base_is_its_amplitude() -> None:
    force = HAMMER.index("[[force]]")
    end = HAMMER.find("[", force + len("[[force]]"))
    base = '[base]\nacceleration = "0.5 g"\n'
    error = refused(HAMMER[:force] + base + (HAMMER[end:] if end > 0 else ""))
    assert error.field == "base.acceleration"
    told(error, "an acceleration by its own key")
    assert 'amplitude = "0.5 g"' in error.expected


def _element(table: str) -> type[FileTable]:
    record = nested_table(keys_of(FORMATS[1])[table])
    assert record is not None
    return record


@pytest.mark.parametrize(
    ("table", "feature"),
    [
        ('[[coulomb]]\nbetween = ["hammer", "ground"]\nforce = 1', "friction"),
        ('[[nonlinear_spring]]\nname = "x"', "a spring that is not linear"),
        ("[[duffing]]\nk3 = 1", "a spring that is not linear"),
        ("[stiffness_matrix]\nrows = [[1.0]]", "matrices"),
        ("[gravity]\ng = 9.81", "a weight"),
        ("[initial]\nx = 1", "initial conditions"),
        ("[[delay]]\ntime = 1", "a delay"),
        ("[waveform]\nterms = 1", "no sine"),
        ('[drive]\non = "hammer"\namplitude = 1.0', "a drive by a table of its own"),
        ("[model]\nm = 0.5", "the tables of format 1"),
    ],
)  # fmt: skip
def test_a_table_that_no_format_knows_is_named(table: str, feature: str) -> None:
    error = refused(f"{HAMMER}{table}\n")
    assert error.field == re.findall(r"\w+", table)[0]
    told(error, feature)


@pytest.mark.parametrize(
    ("old", "new", "field", "accepted", "feature"),
    [
        ('"8 kN/m"', '"-8 kN/m"', "spring[1].stiffness", "a number > 0", "negative stiffness"),
        ('"40 kN/m"', "-40", "clearance[1].stiffness", "a number > 0", "negative stiffness"),
        ('"20 N s/m"', '"-1 N s/m"', "damper[1].damping", "a number > 0", "negative damping"),
        ('"12 N"', '"2 g"', "force[1].amplitude", "a force", "an acceleration"),
        ('"12 N"', '"2.5e1 m/s^2"', "force[1].amplitude", "a force", "an acceleration"),
        ('"8 kN/m"', "[[1, 2], [2, 1]]", "spring[1].stiffness", "a number > 0", "matrices"),
    ],
)
def test_a_value_that_is_not_modelled_is_named(
    old: str, new: str, field: str, accepted: str, feature: str
) -> None:
    error = refused(HAMMER.replace(old, new, 1))
    assert error.field == field
    assert error.expected.startswith(accepted)
    told(error, feature)


def test_matrices_in_the_place_of_elements_are_named() -> None:
    error = refused("format = 2\nmass = [[1.0, 0.0], [0.0, 1.0]]\n")
    assert error.field == "mass"
    told(error, "matrices")


def test_values_that_are_accepted_are_not_looked_up() -> None:
    for old, new in (('"12 N"', '"-12 N"'), ('"2 kg"', '"2000 g"'), ('"0.8 mm"', '"-0.8 mm"')):
        assert old in HAMMER
        parse_model_file(HAMMER.replace(old, new, 1))


@pytest.mark.parametrize(
    "keys",
    [
        'frequency = "20 Hz"\nfrequency2 = "30 Hz"',
        'frequency = ["20 Hz", "30 Hz"]',
        "omega = [100.0, 150.0]",
        'omega = 100.0\nsecond_frequency = "1 Hz"',
    ],
)
def test_a_second_frequency_is_named(keys: str) -> None:
    told(refused(f"{HAMMER}[[response]]\n{keys}\n"), "more than one drive frequency")


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        (HAMMER.replace("format = 2", "format = 3"), "it is format = 2"),
        (HAMMER.replace("format = 2\n", ""), "it is format = 2"),
        (PAPER.replace("format = 1", 'format = "1"'), "with [model] it is format = 1"),
        (PAPER.replace("format = 1\n", ""), "with [model] it is format = 1"),
        ("format = 0\n", "format = 2 any [[mass]]"),
        (f"{HAMMER}{PAPER_TABLE}".replace("format = 2\n", ""), "format = 2 any [[mass]]"),
    ],
)
def test_a_format_that_is_none_says_which_the_tables_are_of(text: str, meant: str) -> None:
    error = refused(text)
    assert error.field == "format"
    assert meant in error.expected
    assert WHERE in error.expected


@pytest.mark.parametrize("key", ["mass", "spring", "damper", "clearance", "force"])
def test_lists_of_any_system_are_refused_in_format_1(key: str) -> None:
    error = refused(f'format = 1\n[[{key}]]\nname = "M1"\n{DRILL[DRILL.index("[mechanical]") :]}')
    assert error.field == key
    assert "format = 2" in error.expected


def test_base_motion_is_refused() -> None:
    assert refused(PAPER + "[base]\namplitude = 1\n").field == "base"


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        (PAPER.replace("zeta", "zet"), "zeta"),
        (DRILL.replace("C2 =", "c2 ="), "C2"),
        (HAMMER.replace("stiffness", "stifness", 1), "stiffness"),
        (HAMMER.replace("[[clearance]]", "[[clearence]]", 1), "clearance"),
        (HAMMER.replace("constant", "x").replace("amplitude", "amplitud"), "amplitude"),
        (f"{HAMMER}[[responses]]\nomega = 1\n", "response"),
        (f"{HAMMER}[[response]]\nfreqency = 1\n", "frequency"),
    ],
)
def test_misspelt_keys_are_still_taken_for_that(text: str, meant: str) -> None:
    assert f'did you mean "{meant}"?' in refused(text).expected


def test_no_key_that_is_read_is_refused() -> None:
    """Every key of every table, with a value that its file would have: nothing is looked up."""
    for text in (PAPER, DRILL, HAMMER):
        parse_model_file(text)
    for number, top in enumerate(FORMATS, start=1):
        for limit in LIMITS:
            if limit.value is None and number in limit.formats and limit.tables:
                known = [k for k in keys_of(top) if re.fullmatch(limit.tables, k)]
                assert known == [], limit.feature
    for limit in LIMITS:
        assert set(limit.of) <= {*MODELS, *ELEMENTS, "response"}
        assert set(limit.formats) <= {1, 2}


ANYTHING = st.one_of(st.integers(), st.text(max_size=9), st.lists(st.lists(st.integers())))


@given(st.dictionaries(st.text(max_size=12), ANYTHING))
def test_whatever_keys_a_table_has_the_error_is_one_of_the_input(keys: dict[str, object]) -> None:
    for table in ("model", "clearance"):
        text = toml_text({"format": 1 + (table == "clearance"), table: keys})
        with pytest.raises(InputError):
            parse_model_file(text)


def limits_table() -> list[str]:
    """The rows of the table in docs/model-file.md."""
    rows = []
    for limit in LIMITS:
        if limit.example:
            formats = " and ".join(map(str, limit.formats))
            rows.append(f"| {limit.feature} | {formats} | {limit.example} | {limit.nearest} |")
    return rows


def test_the_docs_have_the_limits() -> None:
    page, title = WHERE.split("#")
    text = (ROOT / page).read_text("utf-8")
    section = text[re.search(rf"^## {title}$", text, re.MULTILINE | re.IGNORECASE).end() :]  # type: ignore[union-attr]
    assert [line for line in section.splitlines() if line.startswith("| ")][1:] == limits_table()
    assert WHERE in (ROOT / "README.md").read_text("utf-8")


# The formulas that the table gives for what comes nearest, against integrals over a period.

_T = np.linspace(0.0, 2.0 * np.pi, 200_001)
X, OMEGA = 0.7, 1.3


def _work(force: np.ndarray) -> float:
    """That a damper takes in a period of x = X sin ωt; ``force`` over ωt in one period."""
    return float(np.trapezoid(force * X * np.cos(_T), _T))


def test_the_damper_nearest_to_friction_takes_the_same_energy() -> None:
    friction = 0.4 * np.sign(np.cos(_T))
    damper = 4.0 * 0.4 / (math.pi * OMEGA * X) * X * OMEGA * np.cos(_T)
    assert _work(damper) == pytest.approx(_work(friction), rel=1e-4)


def test_the_damper_nearest_to_drag_takes_the_same_energy() -> None:
    speed = X * OMEGA * np.cos(_T)
    drag, damper = 0.4 * speed * np.abs(speed), 8.0 * 0.4 * OMEGA * X / (3.0 * math.pi) * speed
    assert _work(damper) == pytest.approx(_work(drag), rel=1e-6)


def test_the_spring_and_the_damper_nearest_to_a_delay_make_its_force() -> None:
    k, tau = 2.0, 0.9
    later = k * X * np.sin(_T - OMEGA * tau)
    spring, damper = k * math.cos(OMEGA * tau), -(k / OMEGA) * math.sin(OMEGA * tau)
    made = spring * X * np.sin(_T) + damper * X * OMEGA * np.cos(_T)
    np.testing.assert_allclose(made, later, atol=1e-12)
