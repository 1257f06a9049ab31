"""Units of the user: Hz, rad/s and mm go in and come out under ``[mechanical]``."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from designer.base.errors import InputError
from designer.base.si_unit import prefixed, value_text
from designer.base.units import distinct_texts
from designer.bifurcations.parameter_map import MapPlan
from designer.cli import entry
from designer.folders.bench_tables import COLUMNS, MECHANISM
from designer.jobs import bifurcation_request
from designer.jobs.bifurcation_request import Request
from designer.model.model import Dimensionless, SiScales
from designer.model.model_file import parse_model_file
from designer.model.si_units import (
    FAR_ABOVE,
    FAR_BELOW,
    Reader,
    angular_frequency,
    natural_frequencies,
    units_of,
)
from designer.model.swept_model import ModelSubject
from designer.plots import bifurcation_plots, simulate_plots
from designer.verbs import tables
from tests.shared.model_text import COARSE_RECTIFIER, PAPER_TABLE
from tests.shared.quick_folders import without_starts

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

Captured = pytest.CaptureFixture[str]
DRILL = (Path(__file__).resolve().parents[2] / "examples" / "drill.toml").read_text("utf-8")
# Of its table [mechanical], by hand: s, m and m/s of one dimensionless unit.
TIME = math.sqrt(2.0 / 60e3)
LENGTH = 100.0 / 60e3
SPEED = LENGTH / TIME


@pytest.fixture(scope="module")
def drill(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("units") / "drill.toml"
    path.write_text(DRILL, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def paper(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("units") / "paper.toml"
    path.write_text("format = 1\n" + PAPER_TABLE, encoding="utf-8")
    return path


def mechanical() -> SiScales:
    made = parse_model_file(DRILL).si
    assert made is not None
    return made


def asked(capfd: Captured, *words: object) -> Any:
    assert entry.status([*map(str, words), "--json", "-q"]) == 0
    return json.loads(capfd.readouterr().out)


def refused(capfd: Captured, *words: object) -> str:
    assert entry.status([*map(str, words), "-q"]) == 2
    out, err = capfd.readouterr()
    assert out == ""
    return err


# ---------------------------------------------------------------------------------------------
# Texts and numbers


def test_a_frequency_is_read_in_its_unit() -> None:
    ten = 20.0 * math.pi
    for text in ("10 Hz", "10Hz", "0.01 kHz", " 10 Hz ", "10", 10):
        assert angular_frequency(text) == pytest.approx(ten, rel=1e-15)
    for text in ("62.8 rad/s", "62.8rad/s", "0.0628 krad/s"):
        assert angular_frequency(text) == pytest.approx(62.8, rel=1e-15)
    for text in ("", "fast", "10 rpm", "1e999 Hz", "10 Hz 5", "10 hz"):
        with pytest.raises(ValueError, match="number"):
            angular_frequency(text)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (54.1131, "Hz", "54.11 Hz"),
        (0.0, "Hz", "0 Hz"),
        (0.25, "Hz", "0.25 Hz"),
        (0.05, "Hz", "50 mHz"),
        (9999.0, "Hz", "9999 Hz"),
        (12345.0, "Hz", "12.35 kHz"),
        (3e7, "Hz", "30 MHz"),
        (-6.488e-4, "m", "-0.6488 mm"),
        (0.5, "m", "500 mm"),
        (1.5, "m", "1.5 m"),
        (2e-6, "m", "2 µm"),
        (3e-10, "m", "0.3 nm"),
        (0.0, "m", "0 m"),
        (0.3, "m/s", "300 mm/s"),
    ],
)
def test_values_are_shown_in_the_unit_that_suits_them(value: float, unit: str, text: str) -> None:
    assert value_text(value, unit) == text
    factor, name = prefixed(value, unit)
    assert text == f"{value / factor:.4g} {name}"


def test_the_units_of_a_model_are_those_of_its_si_values() -> None:
    units = units_of(mechanical(), parse_model_file(DRILL).model)
    assert units["omega"].scale == pytest.approx(1.0 / (2.0 * math.pi * TIME), rel=1e-14)
    assert units["b"].scale == units["x1"].scale == pytest.approx(LENGTH, rel=1e-14)
    assert units["x2'"].scale == pytest.approx(SPEED, rel=1e-14)
    assert units["b"].text(0.3) == "0.5 mm"
    assert {u.suffix for u in units.values()} == {"hz", "m", "m_s"}
    assert units_of(None, parse_model_file(DRILL).model) == {}


def test_natural_frequencies_are_those_of_the_two_linear_systems() -> None:
    """A mass on a spring by hand, and the drill's by the characteristic polynomial."""
    model = parse_model_file(DRILL).model
    low, high = natural_frequencies(model)
    ratio = 3.0 / 2.0  # M2/M1
    for stop, found, pick in ((0.0, low, min), (9.0, high, max)):
        # det(K - w² M) = 0 with K = [[1 + stop, -1], [-1, 1 + 40/60]].
        k11, k22 = 1.0 + stop, 1.0 + 40.0 / 60.0
        squares = np.roots([ratio, -(ratio * k11 + k22), k11 * k22 - 1.0])
        assert found == pytest.approx(math.sqrt(pick(squares.real)), rel=1e-12)


def test_numbers_are_told_apart_with_as_few_digits_as_that_takes() -> None:
    assert distinct_texts([1.152343150646588, 0.5], 4) == ["1.152", "0.5"]
    assert distinct_texts([1.15231, 1.15238, 1.15231], 4) == ["1.1523", "1.1524", "1.1523"]
    assert distinct_texts([1.0, 1.0 + 1e-15], 4) == ["1", "1"]


# ---------------------------------------------------------------------------------------------
# Model files


def test_a_response_may_give_its_frequency_in_hertz() -> None:
    for line, angular in (
        ('frequency = "10 Hz"', 20.0 * math.pi),
        ("frequency = 10", 20.0 * math.pi),
        ('frequency = "62.8 rad/s"', 62.8),
    ):
        (first, _) = parse_model_file(DRILL.replace("Omega = 340.0", line)).responses
        assert first.omega == pytest.approx(angular * TIME, rel=1e-14)


@pytest.mark.parametrize(
    ("lines", "field", "expected"),
    [
        ('frequency = "10 Hz"\nomega = 1', "response[1].frequency", "one of the two"),
        ('Omega = 3\nfrequency = "10 Hz"', "response[1].frequency", "one of the two"),
        ('Omega = 3\nfrequency = 1\nomega = "best"', "response[1].frequency", "one of the three"),
        ('frequency = "fast"', "response[1].frequency", '"62.8 rad/s"'),
        ("frequency = 0", "response[1].frequency", "> 0"),
        ("frequency = true", "response[1].frequency", "> 0"),
        ("", "response[1].omega", "frequency in Hz"),
    ],
)
def test_exactly_one_frequency(lines: str, field: str, expected: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_model_file(DRILL.replace("Omega = 340.0", lines))
    assert caught.value.field == field
    assert expected in caught.value.expected


def test_hertz_need_a_mechanical_model() -> None:
    with pytest.raises(InputError) as caught:
        parse_model_file(f"format = 1\n{PAPER_TABLE}[[response]]\nfrequency = '10 Hz'\n")
    assert caught.value.field == "response[1].frequency"
    assert "Hz needs a table [mechanical]" in caught.value.expected


# ---------------------------------------------------------------------------------------------
# simulate


def test_simulate_takes_hertz_and_answers_in_si_too(drill: Path, capfd: Captured) -> None:
    hertz = 340.0 / (2.0 * math.pi)
    answer = asked(capfd, "simulate", drill, "--frequency", f"{hertz!r} Hz", "--starts", "1")
    (found,) = answer["responses"]
    assert found["omega"] == pytest.approx(340.0 * TIME, rel=1e-14)
    assert found["frequency_hz"] == pytest.approx(hertz, rel=1e-12)
    for one in (found, *found["others"]):
        assert one["x1_max_m"] == pytest.approx(one["x1_max"] * LENGTH, rel=1e-13)
        assert one["x1_min_m"] == pytest.approx(one["x1_min"] * LENGTH, rel=1e-13)
        assert one["impact_velocities_m_s"] == pytest.approx(
            [v * SPEED for v in one["impact_velocities"]], rel=1e-13
        )
    words = ("--frequency", "340 rad/s", "--starts", "1")
    (same,) = asked(capfd, "simulate", drill, *words)["responses"]
    assert same["x1_max"] == pytest.approx(found["x1_max"], rel=1e-9)


def test_a_dimensionless_model_has_no_si_keys(paper: Path, capfd: Captured) -> None:
    (found,) = asked(capfd, "simulate", paper, "--omega", "0.85", "--starts", "1")["responses"]
    assert not [key for key in found if key.endswith(("_hz", "_m", "_m_s"))]


def test_tables_show_hertz_and_millimetres(drill: Path, capfd: Captured) -> None:
    assert entry.status(["simulate", str(drill), "--frequency", "54.1 Hz"]) == 0
    lines = capfd.readouterr().err.rstrip().splitlines()
    head, row = lines[lines.index("Responses of the model") + 1 :][:2]
    starts = lines[-1]
    assert "mechanism" in head
    assert "x1 max (SI)" in head
    assert starts.startswith("ω = 1.96253: of 200 starts")
    assert row.split()[:3] == ["1.96253", "54.1", "Hz"]
    assert "1.081 mm" in row  # x1_max is 0.6487


def test_what_a_plain_omega_far_out_of_range_means_is_asked(drill: Path, capfd: Captured) -> None:
    said = refused(capfd, "simulate", drill, "--omega", "340")
    hertz = f"{340.0 / (2.0 * math.pi * TIME):.4g} Hz"
    assert f"340 dimensionless would be {hertz}" in said
    assert f"--frequency '{hertz}'" in said
    assert "340 rad/s is ω = 1.96" in said
    assert "--frequency '340 rad/s' or --omega 1.96" in said
    # What is said to do is done.
    words = "simulate", drill, "--frequency", "340 rad/s", "--starts", "1"
    (found,) = asked(capfd, *words)["responses"]
    assert found["omega"] == pytest.approx(1.963, abs=5e-4)
    read = Reader(parse_model_file(DRILL).model, mechanical())
    assert read.frequency("--frequency", hertz) == pytest.approx(340.0, rel=5e-4)
    said = refused(
        capfd, "bifurcation", drill, "--from", "1", "--to", "340", "--steps", "3", "--no-points"
    )
    assert "--to '340 rad/s' or --to 1.96" in said


def test_where_far_out_of_range_begins() -> None:
    read = Reader(parse_model_file(DRILL).model, mechanical())
    low, high = natural_frequencies(read.model)
    for fine in (0.999 * FAR_ABOVE * high, 1.001 * low / FAR_BELOW):
        assert read.omega("--omega", fine) == fine
    for far in (1.001 * FAR_ABOVE * high, 0.999 * low / FAR_BELOW):
        with pytest.raises(InputError, match="dimensionless would be"):
            read.omega("--omega", far)
        assert Reader(read.model).omega("--omega", far) == far  # nothing else can be meant


@pytest.mark.parametrize("text", ["fast", "0 Hz", "-3 Hz", "nan Hz", "10 mm", ""])
def test_frequencies_that_are_none(drill: Path, capfd: Captured, text: str) -> None:
    said = refused(capfd, "simulate", drill, f"--frequency={text}")
    assert "--frequency" in said
    assert '"62.8 rad/s"' in said


def test_a_dimensionless_model_knows_no_hertz(paper: Path, capfd: Captured) -> None:
    assert "[mechanical]" in refused(capfd, "simulate", paper, "--frequency", "10 Hz")
    words = ("bifurcation", paper, "--from", "10 Hz", "--to", "1", "--steps", "3")
    assert "[mechanical]" in refused(capfd, *words)


@pytest.mark.slow
def test_pictures_are_named_by_few_digits_of_what_si_values_give(
    drill: Path, tmp_path: Path, capfd: Captured
) -> None:
    words = ("simulate", drill, "--frequency", "54.1 Hz", "--starts", "1", "--plots")
    files = asked(capfd, *words, tmp_path / "a")["files"]
    assert {f.rsplit("-", 1)[0] for f in files} == {"omega-1.963"}
    assert asked(capfd, *words, tmp_path / "b")["files"] == files
    assert simulate_plots.names([1.152343150646588]) == ("omega-1.15234315065",)  # as ever


# ---------------------------------------------------------------------------------------------
# bifurcation


def test_a_sweep_in_hertz(drill: Path, tmp_path: Path, capfd: Captured) -> None:
    out = tmp_path / "sweep"
    words = ("bifurcation", drill, "--from", "50 Hz", "--to", "60 Hz", "--steps", "3")
    answer = asked(capfd, *words, "--periods", "60", "--keep", "2", "--no-points", "--out", out)
    assert (answer["unit"], answer["si_unit"]) == ("", "Hz")
    first = answer["windows"][0]
    assert (first["from_hz"], first["to_hz"]) == pytest.approx((50.0, 60.0), rel=1e-12)
    assert first["from"] == pytest.approx(100.0 * math.pi * TIME, rel=1e-12)
    assert entry.status(["bifurcation", *map(str, words[1:]), "--periods", "60", "--keep", "2",
                       "--no-points", "--out", str(out)]) == 0  # fmt: skip
    table = capfd.readouterr().err
    assert "from [Hz]" in table
    assert "60 Hz" in table


def plan_of(**more: Any) -> Any:
    file = parse_model_file(DRILL)
    subject = ModelSubject(file.model, scales=file.si)
    return bifurcation_request.plan_of(Request(steps=3, **more), subject, file)


def test_lengths_and_speeds_are_read_in_their_units() -> None:
    sweep = plan_of(over="b", from_="0.4 mm", to=0.3, frequency="54.1 Hz")
    assert sweep.values[[0, -1]] == pytest.approx([0.4e-3 / LENGTH, 0.3], rel=1e-12)
    assert sweep.subject.omega == pytest.approx(2.0 * math.pi * 54.1 * TIME, rel=1e-12)
    both = plan_of(over="b", from_="0.4 mm", to="0.5 mm", map_=("omega", "40 Hz", "1.9", 3))
    assert isinstance(both, MapPlan)
    assert both.ys[[0, -1]] == pytest.approx([80.0 * math.pi * TIME, 1.9], rel=1e-12)
    plane = plan_of(basins=True, from_="-1 mm", to="1 mm", map_=("x2'", "-50 mm/s", "0.1", 3))
    assert plane.xs[[0, -1]] == pytest.approx([-1e-3 / LENGTH, 1e-3 / LENGTH], rel=1e-12)
    assert plane.ys[[0, -1]] == pytest.approx([-50e-3 / SPEED, 0.1], rel=1e-12)


@pytest.mark.parametrize(
    ("more", "option", "expected"),
    [
        ({"over": "zeta", "from_": "0.1 m", "to": 0.2}, "--from", "zeta has no unit"),
        ({"over": "b", "from_": 0.2, "to": "10 Hz"}, "--to", "in m"),
        ({"from_": 1.0, "to": "2 mm"}, "--to", "62.8 rad/s"),
        ({"from_": 1.0, "to": 2.0, "frequency": "10 Hz"}, "--frequency", "is swept"),
        (
            {"over": "b", "from_": 0.2, "to": 0.3, "frequency": "10 Hz", "omega": 1.0},
            "--frequency",
            "beside --omega",
        ),
    ],
)
def test_units_that_do_not_fit(more: dict[str, Any], option: str, expected: str) -> None:
    with pytest.raises(InputError) as caught:
        plan_of(**more)
    assert caught.value.field == option
    assert expected in caught.value.expected


def test_a_board_is_swept_in_its_own_units() -> None:
    read = Reader(parse_model_file(DRILL).model, mechanical(), {"frequency": "Hz", "offset": "V"})
    assert read.value("--from", "frequency", "0.2 kHz") == pytest.approx(200.0)
    assert read.value("--from", "offset", "-10 mV") == pytest.approx(-0.01)
    assert read.value("--from", "omega", "62.8") == 62.8
    with pytest.raises(InputError):
        read.value("--from", "omega", "10 Hz")  # the generator's or the mechanism's?


def test_pictures_have_axes_in_si_units() -> None:
    sweep = plan_of(from_="50 Hz", to="60 Hz", periods=40, keep=2)
    from designer.bifurcations import sweep as sweeps

    figure = bifurcation_plots.diagram(sweeps.run(sweep, 1))
    names = {a.get_xlabel() for axes in figure.axes for a in axes.child_axes}
    assert "Hz" in names
    heights = {a.get_ylabel() for axes in figure.axes for a in axes.child_axes}
    assert {"mm", "mm/s"} <= heights
    plain = bifurcation_request.plan_of(
        Request(from_=0.8, to=0.9, steps=3, periods=20, keep=2),
        ModelSubject(Dimensionless(0.5, 0.5, 0.95, 0.5, 0.1, 0.0, 0.25)),
        parse_model_file("format = 1\n" + PAPER_TABLE),
    )
    assert isinstance(plain, sweeps.SweepPlan)
    assert not [a for axes in bifurcation_plots.diagram(sweeps.run(plain, 1)).axes
                for a in axes.child_axes]  # fmt: skip


# ---------------------------------------------------------------------------------------------
# Designs and studies


@pytest.fixture(scope="module")
def studied(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A design of coarse parts with a study of a few boards on the exact circuit."""
    head, _ = DRILL.split("[[response]]", 1)
    model = tmp_path_factory.mktemp("studied") / "coarse.toml"
    wanted = '[[response]]\nfrequency = "54.1 Hz"\n[[response]]\nfrequency = "54.2 Hz"\n'
    model.write_text(head + wanted + COARSE_RECTIFIER, encoding="utf-8")
    out = model.parent / "out"
    with pytest.MonkeyPatch.context() as patched:
        without_starts(patched)
        words = ["tolerance", model, "--out", out, "--rung", "exact", "--samples", "4"]
        words += ["--no-blame", "-q"]
        assert entry.status([str(word) for word in words]) == 0
    return out


def test_setup_tables_and_reports_show_the_mechanisms_frequency(
    studied: Path, capfd: Captured
) -> None:
    with (studied / "setup.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert tuple(rows[0]) == (*COLUMNS, MECHANISM)
    assert [row[MECHANISM] for row in rows] == ["54.1", "54.2"]
    assert [row["omega"] for row in rows] == [
        f"{2.0 * math.pi * hertz * TIME:.6g}" for hertz in (54.1, 54.2)
    ]
    design = json.loads((studied / "design.json").read_text())
    study = json.loads((studied / "tolerance.json").read_text())
    assert [k["mechanism_hz"] for k in design["knobs"]] == pytest.approx([54.1, 54.2])
    assert [r["frequency_hz"] for r in study["responses"]] == pytest.approx([54.1, 54.2])
    tables.synthesised(design)
    tables.tolerance(study)
    printed = capfd.readouterr().err
    for page in (printed, (studied / "report.md").read_text("utf-8").replace("\u00a0", " ")):
        assert "mechanism" in page
        assert "54.1 Hz" in page
        assert "1.9625295" not in page


def test_tables_of_folders_without_these_keys_are_as_they_were(
    studied: Path, capfd: Captured
) -> None:
    design = json.loads((studied / "design.json").read_text())
    for knob in design["knobs"]:
        del knob["mechanism_hz"]
    tables.synthesised(design)
    assert "mechanism" not in capfd.readouterr().err
