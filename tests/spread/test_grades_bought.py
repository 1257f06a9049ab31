"""What is bought is what is drawn: the grades of a model file, of a bill and of drawn boards."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from designer.base import plain_json
from designer.base.design_folder import Folder
from designer.base.errors import InputError, Unreachable
from designer.base.eseries import series_values
from designer.base.manifest import file_hash
from designer.catalog.parts_catalog import load_catalog
from designer.centering.design_search import look
from designer.centering.repair_slots import part_slots
from designer.centering.repair_upgrade import Upgrades, upgraded_file
from designer.check.synthesis_result import Synthesis
from designer.circuit.netlist import Circuit
from designer.cli import entry
from designer.folders import board_files, design_files
from designer.folders.design_source import bills_are_of_old, design_inputs
from designer.jobs import study_job, study_stage
from designer.jobs.options import Options
from designer.model.model_file import ModelFile, parse_model_file, read_model_file
from designer.report.data import ReportData
from designer.report.spread_words import words_of
from designer.report.write import render_markdown
from designer.spread.part_grades import better_grades, better_grades_text, bought, once_otherwise
from designer.spread.part_rules import spread_of
from designer.spread.spread import Spread, draw_many
from designer.verbs import tables
from designer.yields.study import RunResult, Study
from designer.yields.study_plan import plan_study
from tests.circuit.test_reduction import EXACT, circuit_of
from tests.folders.test_stage_files import design_of
from tests.shared.model_text import COARSE_CIRCUIT, PAPER_TABLE
from tests.shared.quick_folders import quick_folder
from tests.shared.report_data import NO_ORIGIN
from tests.shared.stages import bought as nearest_sold, rectifier, stage

pytestmark = pytest.mark.usefixtures("figures_are_blank", "designs_are_made_once")

CATALOG = load_catalog()
E24 = nearest_sold(EXACT)
"""The paper's circuit of E24; R203 and R50 of E96, which is sold at 1 % and better alone."""
MIXED = circuit_of({**E24, "R203": 619e3, "R50": 22.1e3})
HALVES = stage(
    "saturation", "both", {**E24, "R50A": 11e3, "R50B": 11.3e3}, composites={"R50": "series"}
)
RECTIFIER = stage("rectifier", "both", nearest_sold(rectifier()))
CIRCUITS = {"paper": MIXED, "composite": HALVES, "rectifier": RECTIFIER}
FIVE = "resistor_grade = 0.05\ncapacitor_grade = 0.05\n"


def file_of(circuit: str = "", more: str = "") -> ModelFile:
    text = f"format = 1\n{PAPER_TABLE}[circuit]\nsaturation = 13.0\n{circuit}{more}"
    return parse_model_file(text, Path("some.toml"))


def made_of(file: ModelFile, circuit: Circuit) -> Synthesis:
    catalog = file.choices(CATALOG)
    return Synthesis(file, catalog, (), design_of(file, circuit))


def rows_of(made: Synthesis) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(board_files.bills(made)["bom.csv"])))


def on_the_bill(made: Synthesis) -> dict[str, float]:
    """Grade by part, of what the bill's part numbers say by the catalogue's own rules."""
    numbers = {f.part_number.of(v): f.grade for f in CATALOG.families for v in f.values}
    names = {*made.design.circuit.values}
    return {
        name: numbers[row["part_number"]]
        for row in rows_of(made)
        for each in row["designators"].split()
        for name in (each, each[:-1])  # R50A is R50A1 on the bill
        if name in names
    }


def drawn_widths(file: ModelFile, circuit: Circuit) -> dict[str, float]:
    """Largest deviation of each part on many boards."""
    boards = draw_many(circuit, spread_of(file, circuit, file.choices(CATALOG)), 3, range(1500))
    return {n: float(np.abs(boards.values[n] / v - 1.0).max()) for n, v in circuit.values.items()}


@pytest.mark.parametrize("name", CIRCUITS)
@pytest.mark.parametrize(
    "grades", ["", FIVE, "resistor_grade = 0.001\n", "resistor_grade = 0.02\n"]
)
def test_boards_are_drawn_at_the_grade_on_the_bill(name: str, grades: str) -> None:
    file, circuit = file_of(grades), CIRCUITS[name]
    if grades.endswith("0.001\n") and name == "paper":
        circuit = circuit_of(E24)  # 619k is sold at 1 % alone, within 0.1 % families up to 332k
    bill_grades, widths = on_the_bill(made_of(file, circuit)), drawn_widths(file, circuit)
    assert bill_grades.keys() == circuit.values.keys() - {n for n in widths if n[0] in "UVJ"}
    for part, grade in bill_grades.items():
        assert 0.98 * grade < widths[part] <= grade * (1.0 + 1e-9), part


def test_the_grade_that_is_asked_for_is_bought_where_it_is_sold() -> None:
    """Yageo's data sheets: JR-07 is 5 %, FR-07 is 1 %; E24 values have both, E96 the latter."""
    made = made_of(file_of(FIVE), MIXED)
    by_value = {row["value"]: row for row in rows_of(made)}
    assert by_value["10kΩ"]["part_number"] == "RC0603JR-0710KL"
    assert by_value["10kΩ"]["grade"] == "0.05"
    assert by_value["22.1kΩ"]["part_number"] == "RC0603FR-0722K1L"
    assert "5 %, at which nobody sells" in by_value["22.1kΩ"]["description"]
    assert "nobody" not in by_value["10kΩ"]["description"]
    plain = rows_of(made_of(file_of(), MIXED))
    own = [row for row in plain if {"R4", "R50", "C2"} & set(row["designators"].split())]
    assert [row["grade"] for row in own] == ["0.01"] * 3
    assert not any("nobody" in row["description"] for row in plain)


def test_parts_of_a_better_grade_are_said_everywhere() -> None:
    file = file_of(FIVE)
    better = better_grades(file, MIXED, CATALOG)
    assert {name: (g.wanted, g.bought) for name, g in better.items()} == {
        "R50": (0.05, 0.01),
        "R203": (0.05, 0.01),
    }
    assert "R50 R203 (1 % for 5 %)" in better_grades_text(better)
    answer = design_files.answer(made_of(file, MIXED))
    assert answer["better_grades"]["R203"] == {"asked": 0.05, "bought": 0.01}
    spread = spread_of(file, MIXED, CATALOG)
    assert spread.name == "bench-1"
    assert "a better grade of 1 %: R50, R203" in words_of(spread, MIXED)
    assert spread.as_dict()["grades"] == {"R50": 0.01, "R203": 0.01}
    plain = file_of()
    assert "better_grades" not in design_files.answer(made_of(plain, MIXED))
    assert spread_of(plain, MIXED, CATALOG) == Spread.bench_1(CATALOG.opamp("TL074C"), 0.01, 0.01)
    assert better_grades_text(better_grades(plain, MIXED, CATALOG)) == ""


@pytest.mark.slow
def test_the_table_and_the_report_say_so(capfd: pytest.CaptureFixture[str]) -> None:
    for grades, there in ((FIVE, True), ("", False)):
        made = made_of(file_of(grades), MIXED)
        tables.synthesised(plain_json.plain(design_files.answer(made)))
        plan = plan_study(made.modelfile, made.design, (), made.catalog, samples=1, seed=1)
        study = Study((), plan, (), {}, ())
        result = RunResult(made.modelfile, made.catalog, (), made.design, (), study, NO_ORIGIN)
        page = " ".join(render_markdown(ReportData(result, "")).split())
        for said in (" ".join(capfd.readouterr().err.split()), page):
            assert ("drawn, at a better one: R50 R203 (1 % for 5 %)" in said) is there


def test_a_grade_of_its_own_is_bought_and_drawn_too() -> None:
    """0.1 % as an upgrade states it, 2 % that nobody sells, and 0 for the study alone."""
    upgrades = Upgrades(grades={"R4": 0.001, "R5": 0.02, "R10": 0.0})
    file = upgraded_file(file_of(FIVE), upgrades)
    widths = drawn_widths(file, MIXED)
    listed = on_the_bill(made_of(file, MIXED))
    assert (listed["R4"], listed["R5"], listed["R10"]) == (0.001, 0.01, 0.05)
    assert widths["R4"] <= 0.001
    assert 0.0098 < widths["R5"] <= 0.01
    assert widths["R10"] == 0.0
    assert bought(file, MIXED, CATALOG)["R5"] == 0.02
    assert spread_of(file, MIXED, CATALOG).name == "model file"


def test_a_binned_law_keeps_what_the_grade_leaves() -> None:
    law = '[spread]\nresistors = { law = "binned", inner = 0.01 }\n'
    spread = spread_of(file_of(FIVE, law), MIXED, CATALOG)
    boards = draw_many(MIXED, spread, 3, range(2000))
    left = np.abs(boards.values["R4"] / MIXED.values["R4"] - 1.0)
    assert (left.min() > 0.0099, left.max() <= 0.05) == (True, True)
    picked = np.abs(boards.values["R203"] / MIXED.values["R203"] - 1.0)
    assert picked.max() <= 0.01
    assert picked.min() < 1e-4


def test_another_grade_for_all_is_a_question_and_no_purchase() -> None:
    spread = spread_of(file_of(FIVE), MIXED, CATALOG)
    asked = spread.with_grades(resistor=0.02)
    assert (asked.grades, asked.wanted_grades) == ({}, {})
    assert spread.with_grades(capacitor=0.02).grades == spread.grades
    own = spread_of(upgraded_file(file_of(FIVE), Upgrades(grades={"R4": 0.001})), MIXED, CATALOG)
    assert own.with_grades(resistor=0.02).grades == {"R4": 0.001}


def test_upgrades_start_from_what_is_bought() -> None:
    """R203 of E96 is at 1 % already: from there on the next grade is 0.1 %."""
    slots = {s.slot.name: s for s in part_slots(made_of(file_of(FIVE), MIXED))}
    assert slots["R50"].grades == (0.01, 0.001)
    assert set(slots["R4"].grades) == {0.05, 0.01, 0.001}
    assert slots["R4"].grades[0] == 0.05
    now = CATALOG.part("resistor", 22.1e3, 0.01)
    then = CATALOG.part("resistor", 22.1e3, 0.001)
    extra = CATALOG.euro(then.price) - CATALOG.euro(now.price)
    assert slots["R50"].slot.options[1].price == pytest.approx(extra)


@given(data=st.data())
def test_the_rule_of_what_is_bought(data: st.DataObject) -> None:
    """Against a plain reading of all families: the very grade first, then price, then grade."""
    families = [f for f in CATALOG.families if f.use == "signal"]
    family = data.draw(st.sampled_from(families))
    value = data.draw(st.sampled_from(family.values))
    grade = data.draw(st.sampled_from([0.001, 0.005, 0.01, 0.02, 0.05, 0.1]))
    sold = [f for f in families if f.kind == family.kind and value in f.values and f.grade <= grade]
    found = CATALOG.sold(family.kind, value, grade)
    if not sold:
        assert found is None
        return
    same = [f for f in sold if f.grade == grade]
    wanted = (
        min(same, key=lambda f: f.price) if same else min(sold, key=lambda f: (f.price, f.grade))
    )
    assert found is not None
    assert (found.family.price, found.family.grade) == (wanted.price, wanted.grade)
    assert (found.family.grade == grade) is bool(same)


# Families that are bought from.


@pytest.mark.parametrize(
    ("stated", "names"),
    [
        ('"Vishay CRCW0603 F"', ("Vishay CRCW0603 F",)),
        ('["Vishay CRCW0603 F", "Yageo RC0603JR-07"]', ("Vishay CRCW0603 F", "Yageo RC0603JR-07")),
        ('"!Vishay CRCW0603 F"', ("!Vishay CRCW0603 F",)),
    ],
)
def test_families_are_read(stated: str, names: tuple[str, ...]) -> None:
    assert file_of(f"resistor_family = {stated}\n").circuit.resistor_family == names


@pytest.mark.parametrize(
    ("stated", "expected"),
    [
        ("[]", "a family of the catalogue"),
        ("3", "a family of the catalogue"),
        ("[3]", "a family of the catalogue"),
        ('["!Vishay CRCW0603 F", "Yageo RC0603JR-07"]', "all of them with ! or none"),
    ],
)
def test_what_is_no_choice_of_families(stated: str, expected: str) -> None:
    with pytest.raises(InputError, match="resistor_family") as caught:
        file_of(f"resistor_family = {stated}\n")
    assert caught.value.file == "some.toml"
    assert expected in caught.value.expected


@pytest.mark.parametrize(
    ("key", "name", "known"),
    [
        ("resistor_family", "Yageo RC0603FR-7", 'did you mean "Yageo RC0603FR-07"?'),
        ("capacitor_family", "!Vishay MKP1838 1 %", "Murata GRM1885C1H F"),
        ("capacitor_family", "Yageo RC0603FR-07", "Murata GRM1885C1H F"),
        ("resistor_family", "Vishay ACAS 0612", "Yageo RC0603FR-07"),
    ],
)
def test_unknown_families_are_answered_with_the_known(key: str, name: str, known: str) -> None:
    file = file_of(f'{key} = "{name}"\n')
    with pytest.raises(InputError, match="family") as caught:
        file.choices(CATALOG)
    assert (caught.value.file, caught.value.field) == ("some.toml", f"circuit.{key}")
    assert caught.value.found == name.removeprefix("!")
    assert known in caught.value.expected


def makers(made: Synthesis) -> set[str]:
    """Of the resistors on the bill, substitutes among them."""
    rows = [row for row in rows_of(made) if row["value"].endswith("Ω") and row["grade"]]
    rows = [row for row in rows if not row["designators"].startswith("RV")]
    said = [row["substitute"].split()[0] for row in rows if row["substitute"]]
    return {row["manufacturer"] for row in rows} | set(said)


def test_a_bill_is_of_the_families_that_are_named() -> None:
    assert makers(made_of(file_of(), MIXED)) == {"Yageo", "Vishay"}
    vishay = made_of(file_of('resistor_family = "Vishay CRCW0603 F"\n'), MIXED)
    assert makers(vishay) == {"Vishay"}
    assert all(n.startswith("CRCW0603") for n in numbers(vishay, "Ω"))
    other = 'resistor_family = ["!Vishay CRCW0603 F", "!Vishay MRS25 F", "!Vishay TNPW0603 B"]\n'
    assert makers(made_of(file_of(other), MIXED)) == {"Yageo"}


def numbers(made: Synthesis, unit: str) -> list[str]:
    rows = [row for row in rows_of(made) if row["value"].endswith(unit) and row["grade"]]
    return [row["part_number"] for row in rows if not row["designators"].startswith("RV")]


def test_values_and_grades_are_those_of_the_families() -> None:
    """Murata's GRM1885C1H F ends at 10 nF, Yageo's JR-07 holds E24 at 5 % alone."""
    few = file_of('capacitor_family = "Murata GRM1885C1H F"\n').choices(CATALOG)
    sold = few.values("capacitor", ["E12"], 1e-9, 1e-6, 0.01)
    assert sold.tolist() == series_values(["E12"], 1e-9, 10e-9).tolist()
    coarse = file_of('resistor_family = "Yageo RC0603JR-07"\n').choices(CATALOG)
    sold = coarse.values("resistor", ["E96", "E24"], 1e3, 1e6, 0.05)
    assert sold.tolist() == series_values(["E24"], 1e3, 1e6).tolist()
    with pytest.raises(Unreachable, match="resistor_family leaves out") as told:
        coarse.values("resistor", ["E24"], 1e3, 1e6, 0.01)
    assert told.value.expected.startswith("0.05 or more")
    assert "Yageo RC0603FR-07 (1 %, 1Ω to 10MΩ)" in told.value.expected


@pytest.mark.parametrize(
    ("circuit", "more", "field", "word"),
    [
        ('resistor_family = "Yageo"\n', "", "circuit.resistor_family", "Vishay MRS25 F"),
        ("", '[board]\nmounting = "tht"\n', "board.mounting", "TL074C"),
    ],
)
def test_a_search_keeps_to_families_and_cases(
    circuit: str, more: str, field: str, word: str
) -> None:
    wanted = '[[response]]\nomega = 0.85\nexpect = "1-2-2"\n'
    text = f'{more}{wanted}[search]\nopamps = ["OPA4192"]\n'
    with pytest.raises(InputError, match=word) as caught:
        look(file_of(circuit, text), CATALOG, 1)
    assert caught.value.field == field


# Cases.


@pytest.mark.parametrize(
    ("name", "supply", "there", "not_there"),
    [("OPA4192", 15.0, "TL074C", "MCP6004"), ("OPA4192", 2.5, "MCP6004", "TL074C")],
)
def test_an_opamp_without_such_a_case_is_answered_with_those_that_have_one(
    name: str, supply: float, there: str, not_there: str
) -> None:
    """TL074C: SOIC and PDIP from 4.5 V rails up (SLOS080), MCP6004: to 3 V (DS21733)."""
    with pytest.raises(InputError, match="through-hole") as caught:
        CATALOG.mounted("tht").opamp(name, supply)
    instead = caught.value.expected.partition("; ")[2]
    assert there in instead
    assert not_there not in instead


def test_the_command_line_says_what_stands_in_the_way(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "model.toml"
    text = f'format = 1\n{PAPER_TABLE}[board]\nmounting = "tht"\n{COARSE_CIRCUIT}'
    for more, words in (
        ('opamp = "OPA4192"\nsupply = 15.0\n', ["board.mounting", "OPA4192", "TL074C"]),
        (
            'resistor_family = "Yageo RC0603FR-07"\n',
            ["circuit.resistor_family", "has no through-hole form", "Vishay MRS25 F"],
        ),
    ):
        path.write_text(text + more, encoding="utf-8")
        assert entry.status(["synthesise", str(path), "--out", str(tmp_path / "out"), "-q"]) == 2
        told = capfd.readouterr().err
        assert not (tmp_path / "out").exists()
        for word in (str(path), *words):
            assert word in told


def test_a_value_that_only_other_cases_have_names_their_family() -> None:
    with pytest.raises(Unreachable, match="no through-hole form") as caught:
        CATALOG.mounted("tht").part("resistor", 4.7e6, 0.01)
    assert "Yageo RC0603FR-07" in caught.value.expected
    with pytest.raises(Unreachable, match="no surface-mounted form") as caught:
        CATALOG.mounted("smd").values("capacitor", ["E12"], 50e-9, 95e-9, 0.01)
    assert "Vishay MKP1837" in caught.value.expected


# Folders of a time when the bill and the study went by different rules.


def test_which_files_it_can_be_about() -> None:
    assert not once_otherwise(file_of(), CATALOG)
    assert not once_otherwise(file_of('resistors = ["E24", "E96"]\n'), CATALOG)
    assert not once_otherwise(upgraded_file(file_of(), Upgrades(grades={"R4": 0.001})), CATALOG)
    assert once_otherwise(file_of(FIVE), CATALOG)
    assert once_otherwise(file_of('resistors = "E192"\n'), CATALOG)
    assert once_otherwise(upgraded_file(file_of(), Upgrades(grades={"R4": 0.005})), CATALOG)
    here = design_inputs(file_of(FIVE), CATALOG)
    assert bills_are_of_old({k: v for k, v in here.items() if k != "grades"}, here)
    assert not bills_are_of_old(here, here)
    plain = design_inputs(file_of(), CATALOG)
    assert set(plain) == {"model", "catalogue", "version"}


@pytest.mark.slow
def test_a_study_renews_the_bill_of_a_folder_of_that_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The folder as it was then: the bill at 1 %, no word of grades among the inputs."""
    response = '[[response]]\nomega = 0.85\nexpect = "1-2-2"\n'
    out = quick_folder(
        f"format = 1\n{PAPER_TABLE}{response}{COARSE_CIRCUIT}{FIVE}", tmp_path / "out"
    )
    new, place = (out / "bom.csv").read_text(), out / "manifest.json"
    assert "RC0603JR" in new
    old = new.replace("RC0603JR", "RC0603FR").replace(",0.05,", ",0.01,")
    manifest = json.loads(place.read_text())
    for stage_ in manifest["stages"].values():
        del stage_["inputs"]["grades"], stage_["inputs_sha256"]
    (out / "bom.csv").write_text(old)
    manifest["files"]["bom.csv"]["sha256"] = file_hash("bom.csv", old.encode())
    place.write_text(json.dumps(manifest))

    class Studied(Exception):
        """The study would begin here."""

    def studied(*_: object) -> None:
        raise Studied

    monkeypatch.setattr(study_stage, "checks", studied)
    for bill in (old, new):
        assert (out / "bom.csv").read_text() == bill
        with pytest.raises(Studied):
            study_job.run_into(
                read_model_file(out / "model.toml"),
                out,
                Options(samples=4, rung="exact", overwrite=True),
                lambda _: "",
            )
        assert "bought better grades than its study drew" in caplog.text
        caplog.clear()
    assert (out / "bom.csv").read_text() == new
    assert Folder(out).changed("design") is None
