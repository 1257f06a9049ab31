"""E-series against the published tables; the catalogue: its data, its files and its answers."""

from __future__ import annotations

import dataclasses
import math
import os
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from designer.base.errors import InputError, InputErrors, Unreachable
from designer.base.eseries import SERIES, eseries, series_values
from designer.base.units import decode_value
from designer.catalog import fields
from designer.catalog.entries import OpAmp
from designer.catalog.fields import PRICE_CLASSES, Figure
from designer.catalog.parts_catalog import Catalog, load_catalog
from designer.catalog.read import ENVIRONMENT

SHIPPED = Path(__file__).resolve().parents[2] / "catalogs"

E24 = [10, 11, 12, 13, 15, 16, 18, 20, 22, 24, 27, 30, 33, 36, 39, 43, 47, 51, 56, 62, 68, 75, 82,
       91]  # fmt: skip
E96 = [
    100, 102, 105, 107, 110, 113, 115, 118, 121, 124, 127, 130, 133, 137, 140, 143, 147, 150, 154,
    158, 162, 165, 169, 174, 178, 182, 187, 191, 196, 200, 205, 210, 215, 221, 226, 232, 237, 243,
    249, 255, 261, 267, 274, 280, 287, 294, 301, 309, 316, 324, 332, 340, 348, 357, 365, 374, 383,
    392, 402, 412, 422, 432, 442, 453, 464, 475, 487, 499, 511, 523, 536, 549, 562, 576, 590, 604,
    619, 634, 649, 665, 681, 698, 715, 732, 750, 768, 787, 806, 825, 845, 866, 887, 909, 931, 953,
    976,
]  # fmt: skip


# E-series.


def test_coarse_series_are_the_table_of_iec_60063() -> None:
    assert list(eseries("E24")) == [10 * value for value in E24]
    assert list(eseries("E12")) == [
        10 * v for v in (10, 12, 15, 18, 22, 27, 33, 39, 47, 56, 68, 82)
    ]
    assert list(eseries("E6")) == [100, 150, 220, 330, 470, 680]
    assert list(eseries("E3")) == [100, 220, 470]


def test_fine_series_are_the_table_of_iec_60063() -> None:
    assert list(eseries("E96")) == E96
    assert list(eseries("E48")) == E96[::2]
    assert list(eseries("E192"))[::2] == E96
    odd = eseries("E192")[1::2]
    assert odd[:8] == (101, 104, 106, 109, 111, 114, 117, 120)
    assert odd[-8:] == (835, 856, 876, 898, 920, 942, 965, 988)


@pytest.mark.parametrize("name", SERIES)
def test_a_series_has_as_many_values_as_its_name_says(name: str) -> None:
    values = eseries(name)
    assert len(values) == int(name[1:])
    assert list(values) == sorted(set(values))
    assert values[0] == 100
    assert values[-1] < 1000


def test_an_unknown_series_is_named() -> None:
    with pytest.raises(InputError, match="E97"):
        eseries("E97")


def test_series_values_are_the_floats_that_one_writes() -> None:
    values = series_values(["E96"], 1e3, 1e6)
    assert 22.1e3 in values
    assert values[0] == 1e3
    assert values[-1] == 1e6
    assert len(values) == 3 * 96 + 1
    assert 6.8e-9 in series_values(["E12"], 1e-9, 1e-6)


def test_the_union_has_each_value_once() -> None:
    union = series_values(["E24", "E96"], 100.0, 999.0)
    assert union.tolist() == sorted({10.0 * v for v in E24} | {float(v) for v in E96})
    assert series_values(["E24", "E12", "E24"], 1.0, 99.0).tolist() == sorted(
        [float(v) for v in E24] + [v / 10 for v in E24]
    )


@given(
    st.lists(st.sampled_from(SERIES), min_size=1, max_size=3),
    st.floats(min_value=1e-13, max_value=1e9),
    st.floats(min_value=1.0, max_value=1e4),
)
def test_series_values_are_those_in_the_range(names: list[str], lo: float, ratio: float) -> None:
    hi = lo * ratio
    values = series_values(names, lo, hi)
    brute = {
        float(f"{mantissa}e{decade}")
        for name in names
        for mantissa in eseries(name)
        for decade in range(-20, 16)
    }
    assert values.tolist() == sorted(value for value in brute if lo <= value <= hi)


@pytest.mark.parametrize(
    ("lo", "hi"),
    [(0.0, 1.0), (-1.0, 1.0), (2.0, 1.0), (1.0, math.inf), (math.nan, 1.0), (1.0, math.nan)],
)
def test_a_range_that_is_none(lo: float, hi: float) -> None:
    with pytest.raises(InputError, match="range"):
        series_values(["E12"], lo, hi)


# The catalogue that comes with the tool.


@pytest.fixture(autouse=True)
def _only_what_the_test_says(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """No folder of this machine's user takes part."""
    monkeypatch.delenv(ENVIRONMENT, raising=False)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))


@pytest.fixture(scope="module")
def catalog() -> Catalog:
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv(ENVIRONMENT, raising=False)
        patch.setenv("XDG_CONFIG_HOME", os.devnull)
        return load_catalog()


def test_resistors_at_one_percent_are_all_of_e96(catalog: Catalog) -> None:
    values = catalog.values("resistor", ["E96"], 1e3, 1e6, 0.01)
    assert values.tolist() == series_values(["E96"], 1e3, 1e6).tolist()
    assert catalog.values("resistor", ["E192"], 1e3, 1e6, 0.001).tolist() == (
        series_values(["E192"], 1e3, 1e6).tolist()
    )


def test_a_finer_grade_is_never_more_choice(catalog: Catalog) -> None:
    for kind, lo, hi in (("resistor", 1.0, 10e6), ("capacitor", 1e-10, 1e-6)):
        before: set[float] = set()
        for grade in (0.001, 0.01, 0.02, 0.05, 0.1):
            try:
                found = set(catalog.values(kind, ["E24", "E96", "E192"], lo, hi, grade).tolist())  # type: ignore[arg-type]
            except Unreachable:
                found = set()
            assert before <= found
            before = found
        assert before


def test_capacitors_that_a_design_needs(catalog: Catalog) -> None:
    e12 = series_values(["E12"], 1e-9, 1e-8).tolist()
    fine = catalog.values("capacitor", ["E12"], 1e-10, 1e-6, 0.01)
    coarse = catalog.values("capacitor", ["E12"], 1e-10, 1e-6, 0.05)
    assert set(e12) <= set(fine.tolist())
    assert set(fine.tolist()) < set(coarse.tolist())
    assert np.all(np.diff(coarse) > 0)


@pytest.mark.parametrize(
    ("kind", "value", "grade", "part_number"),
    [
        ("resistor", 22.1e3, 0.01, "RC0603FR-0722K1L"),
        ("resistor", 100e3, 0.001, "RT0603BRD07100KL"),
        ("resistor", 1e6, 0.005, "RT0603BRD071ML"),
        ("capacitor", 1e-9, 0.01, "GRM1885C1H102FA01D"),
        ("capacitor", 22e-9, 0.01, "C1206C223F5GACTU"),
        ("capacitor", 100e-9, 0.02, "GCM31C5C1H104FA16L"),
        ("capacitor", 10e-9, 0.05, "GRM1885C1H103JA01D"),
        ("capacitor", 47e-9, 0.05, "C1206C473J5GACTU"),
    ],
)
def test_published_part_numbers(
    catalog: Catalog, kind: str, value: float, grade: float, part_number: str
) -> None:
    part = catalog.part(kind, value, grade)  # type: ignore[arg-type]
    assert part.part_number == part_number
    assert part.value == value
    assert part.family.grade <= grade


def test_every_value_of_every_family_has_its_part_number(catalog: Catalog) -> None:
    numbers = set()
    for family in catalog.families:
        rule = family.part_number
        for value in family.values:
            number = rule.of(value)
            code = number.removeprefix(rule.prefix)
            if family.use == "array":  # it stands there twice
                code = code[: (len(code) - len("EP100")) // 2]
            code = code.removesuffix(rule.suffix)
            assert decode_value(rule.code, code) == value
            assert rule.value(number) == value
            assert number not in numbers
            numbers.add(number)


@pytest.mark.parametrize(
    ("family", "value", "number"),
    [
        # Of distributors' lists and published parts lists; each rule also has its file's example.
        ("Yageo RC0603FR-07", 22.1e3, "RC0603FR-0722K1L"),
        ("Yageo RT0603BRD07", 10e3, "RT0603BRD0710KL"),
        ("Vishay CRCW0603 F", 45.3e3, "CRCW060345K3FKEA"),
        ("Vishay TNPW0603 B", 40.2e3, "TNPW060340K2BEEA"),
        ("Vishay TNPW0603 B", 21.5e3, "TNPW060321K5BEEA"),
        ("Vishay MRS25 F", 18.2, "MRS25000C1829FC100"),
        ("Yageo MFP-25BRD52", 10e3, "MFP-25BRD52-10K"),
        ("Vishay ACAS 0612", 10e3, "ACASA1002E1002P100"),
        ("Yageo MFP-25BRD52", 120.0, "MFP-25BRD52-120R"),
        ("Murata GRM1885C1H J", 10e-9, "GRM1885C1H103JA01D"),
        ("Murata GRM31C5C1H J", 100e-9, "GRM31C5C1H104JA01L"),
        ("KEMET C0603 F 50 V", 1e-9, "C0603C102F5GACTU"),
        ("KEMET C320 X7R 50 V", 100e-9, "C320C104K5R5TA"),
        ("Panasonic FC 50 V", 10e-6, "EEU-FC1H100"),
    ],
)
def test_published_numbers_both_ways(
    catalog: Catalog, family: str, value: float, number: str
) -> None:
    (found,) = [each for each in catalog.families if each.name == family]
    assert found.part_number.of(value) == number
    assert found.part_number.value(number) == value
    assert value in found.values
    with pytest.raises(ValueError, match="not a part number"):
        found.part_number.value(f"x{number}")


@given(data=st.data())
def test_a_part_is_the_cheapest_of_the_grade_or_a_better_one(
    catalog: Catalog, data: st.DataObject
) -> None:
    signal = [f for f in catalog.families if f.use == "signal"]
    family = data.draw(st.sampled_from(signal))
    value = data.draw(st.sampled_from(family.values))
    grade = family.grade * data.draw(st.one_of(st.just(1.0), st.floats(1.0, 20.0)))
    part = catalog.part(family.kind, value, grade)
    assert part.value == value
    fitting = [f for f in signal if f.kind == family.kind and value in f.values]
    fitting = [f for f in fitting if f.grade <= grade]
    same = [f for f in fitting if f.grade == grade]
    cheapest = min((f.price, f.grade) for f in same or fitting)
    assert (part.price, part.family.grade) == cheapest
    assert (part.manufacturer, part.footprint) == (part.family.manufacturer, part.family.footprint)
    # The same value, a rounding error away.
    assert catalog.part(family.kind, value * (1 + 1e-12), grade) == part


def test_families_state_where_they_come_from(catalog: Catalog) -> None:
    for family in catalog.families:
        assert family.sources
        assert 1 <= family.price <= len(PRICE_CLASSES)
        assert family.rating.voltage is not None
        assert family.rating.voltage >= 25.0
        assert (family.rating.power is not None) == (family.kind == "resistor")
        assert family.range == (family.values[0], family.values[-1])
        if family.use == "signal":
            assert 0.0 < family.temperature_coefficient < 1e-3


def figures(opamp: OpAmp) -> dict[str, Figure]:
    found = {f.name: getattr(opamp, f.name) for f in dataclasses.fields(opamp)}
    return {name: value for name, value in found.items() if isinstance(value, Figure)}


def test_opamps_have_the_usual_pins(catalog: Catalog) -> None:
    """JEDEC's single, dual and quad, as the first page of each sheet draws them."""
    usual = {
        1: (("7", "4"), [("2", "3", "6")]),
        2: (("8", "4"), [("2", "3", "1"), ("6", "5", "7")]),
        4: (("4", "11"), [("2", "3", "1"), ("6", "5", "7"), ("9", "10", "8"), ("13", "12", "14")]),
    }
    by_count = {count: {o.name for o in catalog.opamps if o.sections == count} for count in usual}
    assert by_count == {
        1: {"TL071C"},
        2: {"TL072C", "TL072H", "OPA2192"},
        4: {"TL074C", "TL074H", "OPA4192", "MCP6004"},
    }
    for opamp in catalog.opamps:
        supply, sections = usual[opamp.sections]
        assert opamp.supply_pins == supply
        assert [(p.inverting, p.noninverting, p.output) for p in opamp.pins] == sections
        cases = [opamp.footprint, *(case.footprint for case in opamp.cases)]
        leads = {"14"} if opamp.sections == 4 else {"8"}
        assert {re.split(r"[-_]", case.split(":")[1])[1] for case in cases} == leads


def test_opamp_figures_are_plausible_and_sourced(catalog: Catalog) -> None:
    for opamp in catalog.opamps:
        for name, figure in figures(opamp).items():
            assert figure.source, name
            given_ = [v for v in (figure.min, figure.typ, figure.max) if v is not None]
            assert given_ == sorted(given_)
            assert figure.nominal in given_
            # A figure that the source does not give is marked.
            assert figure.assumed or not re.search("not compared|taken from", figure.source)
        assert 2e-6 <= opamp.offset_sigma < opamp.offset_limit <= 10e-3
        assert 0.8 < opamp.saturation.nominal / opamp.rated_supply < 1.0
        assert 1e4 < opamp.gain.nominal < 1e8
        assert 1e6 <= opamp.gbw.nominal < 2e7
        assert 5e5 < opamp.slew.nominal < 1e8
        assert 1e-13 < opamp.bias.nominal < 1e-9
        assert 1e-9 < opamp.noise.nominal < 1e-7
        assert 1e-3 < opamp.output_current.nominal < 0.1


def test_offsets_of_the_reference_spread(catalog: Catalog) -> None:
    c, h = catalog.opamp("TL074C"), catalog.opamp("TL074H")
    assert (c.offset_sigma, c.offset_limit) == (3e-3, 10e-3)
    assert (h.offset_sigma, h.offset_limit) == (1e-3, 4e-3)


def test_saturation_follows_the_supply(catalog: Catalog) -> None:
    opamp = catalog.opamp("TL074C")
    assert opamp.saturation_at(15.0) == 13.5
    assert opamp.saturation_at(12.0) == 10.5


def test_diodes_and_references(catalog: Catalog) -> None:
    assert catalog.diode("1N4148").forward_voltage.max == 1.0
    assert catalog.diode("1N4148").recovery.max == 4e-9
    assert catalog.reference("LM4040C50").voltage == 5.0
    assert catalog.reference("LM4040C50").grade == 0.005


# Questions that have no answer.


@pytest.mark.parametrize(
    ("series", "lo", "hi", "grade", "field", "expected"),
    [
        (["E12"], 1e-9, 1e-6, 1e-4, "circuit.capacitor_grade", "0.01 or more"),
        (["E12"], 1e-4, 1e-3, 0.01, "circuit.capacitor_range", "1nF to 1µF"),
        (["E12"], 1.05e-9, 1.1e-9, 0.01, "circuit.capacitor_range", "1nF to 1µF"),
    ],
)
def test_unreachable_says_what_binds(
    catalog: Catalog,
    series: list[str],
    lo: float,
    hi: float,
    grade: float,
    field: str,
    expected: str,
) -> None:
    with pytest.raises(Unreachable) as caught:
        catalog.values("capacitor", series, lo, hi, grade)
    assert caught.value.field == field
    assert expected in caught.value.expected


def test_values_of_an_unknown_series(catalog: Catalog) -> None:
    with pytest.raises(InputError, match='did you mean "E96"') as caught:
        catalog.values("resistor", ["E24", "e96"], 1e3, 1e6, 0.01)
    assert caught.value.field == "circuit.resistors"
    assert not isinstance(caught.value, Unreachable)


def test_values_of_an_unknown_kind(catalog: Catalog) -> None:
    with pytest.raises(InputError, match="resistor, capacitor"):
        catalog.values("inductor", ["E12"], 1.0, 2.0, 0.1)  # type: ignore[arg-type]


def test_a_part_that_is_not_sold(catalog: Catalog) -> None:
    with pytest.raises(Unreachable, match=r"1\.2nF or 1\.5nF"):
        catalog.part("capacitor", 1.3e-9, 0.01)
    with pytest.raises(Unreachable, match=r"0\.001 or more"):
        catalog.part("resistor", 10e3, 1e-5)


def test_unknown_names_are_answered_with_the_known_ones(catalog: Catalog) -> None:
    with pytest.raises(
        InputError, match=r'TL074C, TL074H, OPA4192, MCP6004, .*; did you mean "OPA\d?192"\?'
    ):
        catalog.opamp("OPA192")
    with pytest.raises(InputError, match="1N4148"):
        catalog.diode("1N4149")
    with pytest.raises(InputError, match="LM4040C50"):
        catalog.reference("LM4040")


# Folders, and whose entry wins.

FAMILY = """
[[family]]
name = "drawer"
kind = "capacitor"
manufacturer = "various"
dielectric = "measured film"
values = ["10nF", "13nF", 22e-9]
grade = 0.002
temperature_coefficient = 300e-6
footprint = "Capacitor_THT:C_Rect_L7.2mm_W5.5mm_P5.00mm_FKS2_FKP2_MKS2_MKP2"
price = 1
part_number = { prefix = "drawer-", code = "plain" }
sources = ["measured"]
"""


def folder(path: Path, text: str, name: str = "own.toml") -> Path:
    path.mkdir(parents=True, exist_ok=True)
    (path / name).write_text(text, encoding="utf-8")
    return path


def own_opamp(offset: str) -> str:
    """The shipped TL074C with another offset_sigma."""
    text = (SHIPPED / "opamps.toml").read_text(encoding="utf-8")
    first = "".join(text.partition("[[opamp]]")[1:]).split("\n[[opamp]]")[0]
    return "format = 1\n\n" + first.replace('offset_sigma = "3 mV"', f'offset_sigma = "{offset}"')


def test_a_folder_of_ones_own_adds_parts(tmp_path: Path, catalog: Catalog) -> None:
    mine = load_catalog(folder(tmp_path / "mine", "format = 1\n" + FAMILY))
    part = mine.part("capacitor", 10e-9, 0.002)
    assert part.part_number == "drawer-10n"
    assert part.family.grade == 0.002
    # Where 1 % is asked for, 1 % is bought, and the drawer's where nobody has that.
    assert mine.part("capacitor", 10e-9, 0.01) == catalog.part("capacitor", 10e-9, 0.01)
    # 13 nF is no E12 value: it can be asked for by name, but no series holds it.
    assert mine.part("capacitor", 13e-9, 0.01).part_number == "drawer-13n"
    assert mine.values("capacitor", ["E12"], 1e-9, 1e-6, 0.002).tolist() == [10e-9, 22e-9]
    assert len(mine.families) == len(catalog.families) + 1
    assert mine.hash != catalog.hash
    assert mine.folders == (tmp_path / "mine", SHIPPED)


def test_the_nearer_folder_wins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, catalog: Catalog
) -> None:
    config = tmp_path / "config"
    user = folder(config / "designer" / "catalogs", own_opamp("4 mV"))
    assert load_catalog().opamp("TL074C").offset_sigma == 4e-3
    first = folder(tmp_path / "first", own_opamp("5 mV"))
    second = folder(tmp_path / "second", own_opamp("6 mV"))
    monkeypatch.setenv(ENVIRONMENT, f"{first}{os.pathsep}{second}")
    assert load_catalog().opamp("TL074C").offset_sigma == 5e-3
    extra = folder(tmp_path / "extra", own_opamp("7 mV"))
    found = load_catalog(extra)
    assert found.opamp("TL074C").offset_sigma == 7e-3
    assert found.folders == (extra, first, second, user, SHIPPED)
    # Replaced, not doubled.
    assert sorted(o.name for o in found.opamps) == sorted(o.name for o in catalog.opamps)


def test_the_wheel_carries_its_catalogue_inside(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "site" / "designer"
    shutil.copytree(SHIPPED, package / "catalogs")
    monkeypatch.setattr("importlib.resources.files", lambda _: package)
    inside = load_catalog()
    assert inside.folders == (package / "catalogs",)
    monkeypatch.undo()
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    assert inside.hash == load_catalog().hash


def test_an_installation_without_catalogue(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.resources.files", lambda _: tmp_path / "site" / "designer")
    with pytest.raises(InputError, match="comes with the tool"):
        load_catalog()


def test_the_hash_is_of_the_content(tmp_path: Path, catalog: Catalog) -> None:
    text = "format = 1\n" + FAMILY
    one = load_catalog(folder(tmp_path / "one", text)).hash
    assert one == load_catalog(folder(tmp_path / "two", text)).hash
    assert one != load_catalog(folder(tmp_path / "one", text + "# more\n")).hash
    assert re.fullmatch("[0-9a-f]{64}", catalog.hash)


def test_other_files_in_a_folder_are_left_alone(tmp_path: Path, catalog: Catalog) -> None:
    mine = folder(tmp_path / "mine", "not a catalogue", "README.md")
    assert load_catalog(mine).hash == catalog.hash


def test_a_folder_that_does_not_exist(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="catalogue folder"):
        load_catalog(tmp_path / "nowhere")
    monkeypatch.setenv(ENVIRONMENT, str(tmp_path / "nowhere"))
    with pytest.raises(InputError, match=ENVIRONMENT):
        load_catalog()


# CSV.

CSV = (
    "format,name,kind,manufacturer,dielectric,series,range,grade,temperature_coefficient,"
    "rating,footprint,price,part_number,example,sources,assumed\r\n"
    "1,reel,resistor,Yageo,thin film,E24 E96,1k 10k,0.001,10e-6,power=0.1 voltage=75V,"
    "Resistor_SMD:R_0603_1608Metric,4,prefix=RT0603BRB07 code=yageo suffix=L,"
    'value=2.21k part_number=RT0603BRB072K21L,"data sheet, V.11 | a reel",\r\n'
)


def test_a_family_from_csv(tmp_path: Path) -> None:
    mine = load_catalog(folder(tmp_path / "mine", CSV, "reels.csv"))
    family = next(each for each in mine.families if each.name == "reel")
    assert family.values == tuple(series_values(["E24", "E96"], 1e3, 1e4).tolist())
    assert (family.rating.power, family.rating.voltage) == (0.1, 75.0)
    assert family.sources == ("data sheet, V.11", "a reel")
    assert family.assumed == ()
    assert family.part_number.of(4.99e3) == "RT0603BRB074K99L"


@pytest.mark.parametrize(
    ("old", "new", "field", "expected"),
    [
        ("0.001", "tight", "line 2.grade", "fraction"),
        ("1,reel", "2,reel", "line 2.format", "1"),
        ("1,reel", "1,", "line 2.name", "name"),
        ("code=yageo", "code=yaego", "line 2.part_number.code", 'did you mean "yageo"?'),
        ("format,name", "format,nmae", "line 1", 'did you mean "name"?'),
        (",4,prefix", ",cheap,prefix", "line 2.price", "price class"),
        (",4,prefix", ",4,4,prefix", "line 2", "as the header"),
        ("1k 10k", "10k 1k", "line 2.range", "low <= high"),
        ("2K21L", "2K2L", "line 2.example.part_number", "RT0603BRB072K21L"),
        ('"data sheet', '"data" sheet', "line 2", "CSV"),
    ],
)
def test_wrong_csv_is_named(tmp_path: Path, old: str, new: str, field: str, expected: str) -> None:
    assert old in CSV
    mine = folder(tmp_path / "mine", CSV.replace(old, new, 1), "reels.csv")
    with pytest.raises(InputError) as caught:
        load_catalog(mine)
    assert caught.value.file == str(mine / "reels.csv")
    assert caught.value.field == field
    assert expected in caught.value.expected


# The documentation.


def test_the_examples_of_the_documentation(tmp_path: Path) -> None:
    text = (SHIPPED.parent / "docs" / "catalogue.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```(toml|csv)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    assert [language for language, _ in blocks] == ["toml", "toml", "csv", "csv"]
    for number, (language, block) in enumerate(blocks[:3]):
        folder(tmp_path / "mine", block, f"{number}.{language}")
    folder(tmp_path / "mine" / "stock", blocks[3][1], "list.csv")
    mine = load_catalog(tmp_path / "mine")
    assert mine.part("capacitor", 22e-9, 0.01).part_number == "drawer-22n"
    named = {family.name: family for family in mine.families}
    assert {"Bench drawer 1 %", "Yageo RC0805FR-07"} <= set(named)
    assert mine.euro(3) == 0.11
    assert [row.distributor for row in mine.stock][:2] == ["LCSC", "Our shelf"]
    chips = named["Yageo RC0805FR-07"]
    assert chips.part_number.of(4.99e3) == "RC0805FR-074K99L"


# Wrong TOML.


@pytest.mark.parametrize(
    ("old", "new", "field", "expected"),
    [
        ("format = 1", "format = 2", "format", "1"),
        ("[[family]]", "[[familly]]", "familly", 'did you mean "family"?'),
        ("grade = 0.002", "grade = 2", "family[1].grade", "(0, 1)"),
        ("grade = 0.002", "garde = 0.002", "family[1].garde", 'did you mean "grade"?'),
        ('kind = "capacitor"', 'kind = "capacitors"', "family[1].kind", 'mean "capacitor"?'),
        ('"13nF"', '"13nH"', "family[1].range", "quantities in F"),
        ('"13nF"', "-1e-9", "family[1].range", "quantities in F"),
        ('"13nF"', "true", "family[1].values", "list of values"),
        ('["10nF", "13nF", 22e-9]', "[]", "family[1].values", "values, or series"),
        ("price = 1", "price = 0", "family[1].price", "price class"),
        ("price = 1", "price = 7", "family[1].price", "price class"),
        ("price = 1", "price = 1.0", "family[1].price", "price class"),
        ('"Capacitor_THT:', '"', "family[1].footprint", "Library:Name"),
        ('code = "plain"', 'code = "morse"', "family[1].part_number.code", '"eia3"'),
        ('code = "plain"', 'codes = "plain"', "family[1].part_number.codes", 'mean "code"?'),
        ('sources = ["measured"]', "", "family[1].sources", "data sheets"),
        ('sources = ["measured"]', 'sources = "measured"', "family[1].sources", "data sheets"),
        ("300e-6", '"300 ppm"', "family[1].temperature_coefficient", "per kelvin"),
        ("price = 1", "price = 1\nrating = { volts = 50 }", "family[1].rating.volts", "voltage"),
        ("price = 1", "price = ", "line 12", "valid TOML"),
    ],
)
def test_wrong_toml_is_named(tmp_path: Path, old: str, new: str, field: str, expected: str) -> None:
    text = "format = 1\n" + FAMILY
    assert old in text
    mine = folder(tmp_path / "mine", text.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        load_catalog(mine)
    assert caught.value.file == str(mine / "own.toml")
    assert caught.value.field == field
    assert expected in caught.value.expected


def test_a_code_that_cannot_spell_a_value(tmp_path: Path) -> None:
    text = FAMILY.replace('"13nF"', '"1.05nF"').replace('code = "plain"', 'code = "eia3"')
    with pytest.raises(InputError, match=r"can spell 1\.05nF"):
        load_catalog(folder(tmp_path / "mine", "format = 1\n" + text))


@pytest.mark.parametrize(
    ("old", "new", "field", "expected"),
    [
        ('offset = { typ = "3 mV", max', 'offset = { typ = "30 mV", max', "offset", "min <= typ"),
        (
            'typ = "3 mV", max = "10 mV", source',
            'tpy = "3 mV", source',
            "offset.tpy",
            'did you mean "typ"?',
        ),
        ('typ = "3 mV", max = "10 mV", source', "source", "offset", "at least one number"),
        ('typ = "3 mV", max', 'typ = "3 mA", max', "offset.typ", "in V"),
        (', source = "SLOS080V 6.8, magnitude"', "", "offset.source", "where the figure stands"),
        ("assumed = true", "assumed = 1", "saturation.assumed", "true or false"),
        ("offset_limit", "offset_limits", "offset_limits", 'did you mean "offset_limit"?'),
        ('supply_pins = ["4", "11"]', 'supply_pins = ["4"]', "supply_pins", "two pins"),
        ('supply_pins = ["4", "11"]', "supply_pins = [4, 11]", "supply_pins", "two pins"),
        ('output = "1"', 'output = "2"', "section", "used once"),
        ('name = "B"', 'name = "A"', "section.name", "used once"),
        ('noninverting = "3"', "noninverting = 3", "section[1].noninverting", "in quotes"),
        ("gain = { min = 25e3", 'gain = { min = "lots"', "gain.min", "V/V"),
        ("rated_supply", "rated_suply", "rated_suply", 'did you mean "rated_supply"?'),
    ],
)
def test_wrong_opamps_are_named(
    tmp_path: Path, old: str, new: str, field: str, expected: str
) -> None:
    text = own_opamp("3 mV")
    assert old in text
    mine = folder(tmp_path / "mine", text.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        load_catalog(mine)
    assert caught.value.field == f"opamp[1].{field}"
    assert expected in caught.value.expected


# Everything that is wrong, at once.


def lines_of(error: InputError) -> list[str]:
    return [line.partition(".toml: ")[2] or line for line in str(error).splitlines()]


def test_everything_that_is_wrong_with_a_file_is_said_at_once(tmp_path: Path) -> None:
    """Two families and an op-amp: misspelt, missing, out of range, and by the rules of its kind."""
    wrong = FAMILY.replace('sources = ["measured"]', "").replace("price = 1", "price = 9")
    wrong = wrong.replace("grade = 0.002", "garde = 0.002")
    odd = FAMILY.replace('name = "drawer"', 'name = "other"').replace('"13nF"', '"1.05nF"')
    odd = odd.replace('code = "plain"', 'code = "eia3"') + "elements = 4\n"
    opamp = own_opamp("3 mV").removeprefix("format = 1\n")
    for old, new in (
        (', source = "SLOS080V 6.8, magnitude"', ""),
        ('output = "1"', 'output = "2"'),
        ("gain = { min = 25e3", 'gain = { mni = 1, min = "lots"'),
    ):
        assert old in opamp
        opamp = opamp.replace(old, new, 1)
    mine = folder(tmp_path / "mine", f"format = 1\n{wrong}{odd}{opamp}")
    with pytest.raises(InputErrors) as caught:
        load_catalog(mine)
    said = lines_of(caught.value)
    assert [line.partition(": found")[0].partition(" is missing")[0] for line in said] == [
        "family[1].garde",
        "family[1].price",
        "family[1].sources",
        "family[2].elements",
        "family[2].part_number.code",
        "opamp[1].offset.source",
        "opamp[1].gain.mni",
        "opamp[1].gain.min",
    ]
    assert "family[1].sources is missing, expected a list of data sheets" in said[2]
    assert said[5].startswith("opamp[1].offset.source is missing, expected where the figure stands")
    assert all(p.file == str(mine / "own.toml") for p in caught.value.problems)
    assert caught.value.exit_status == 2


def test_every_line_of_a_csv_file_is_read(tmp_path: Path) -> None:
    head, row = CSV.splitlines()[0], CSV.splitlines()[1]
    rows = [row.replace("thin film", ""), row.replace("1,", "2,", 1), f"{row},more", row]
    mine = folder(tmp_path / "mine", "\n".join([head, *rows, ""]), "reels.csv")
    with pytest.raises(InputError) as caught:
        load_catalog(mine)
    said = str(caught.value).splitlines()
    assert [line.partition("reels.csv: ")[2].split(":")[0].split(" is")[0] for line in said] == [
        "line 2.dielectric",
        "line 3.format",
        "line 4",
    ]


def test_long_lists_of_problems_are_counted(tmp_path: Path) -> None:
    text = "format = 1\n" + FAMILY.replace("price = 1", "price = 9") * 40
    with pytest.raises(InputErrors) as caught:
        load_catalog(folder(tmp_path / "mine", text))
    assert len(caught.value.problems) == 40
    said = str(caught.value).splitlines()
    assert (len(said), said[-1]) == (31, "and 10 more")


def test_figures_may_carry_any_prefix_of_their_unit(tmp_path: Path) -> None:
    """As data sheets write them, against the same figures as plain numbers."""
    text = own_opamp("3 mV")
    plain = load_catalog(folder(tmp_path / "plain", text)).opamp("TL074C")
    for key, written, bound, value in (
        ("slew", '"9 V/µs"', "typ", 9e6),
        ("gain", '"200 V/mV"', "typ", 200e3),
        ("noise", '"0.02 µV/√Hz"', "typ", 2e-8),
        ("gbw", '"5.25 MHz"', "typ", 5.25e6),
        ("phase_margin", '"60 °"', "typ", 60.0),
        ("offset_drift", '"18 µV/°C"', "typ", 18e-6),
        ("bias_doubling", '"10 °C"', "typ", 10.0),
        ("gbw_drift", '"-2000 ppm/K"', "typ", -2e-3),
        ("gbw_drift", '"-0.2 %/K"', "typ", -2e-3),
        ("slew_drift", '"-2e-3/°C"', "typ", -2e-3),
        ("saturation_drift", '"-1 mV/K"', "typ", -1e-3),
    ):
        line = f'{key} = {{ {bound} = {written}, source = "a sheet" }}\n'
        kept = [each for each in text.splitlines() if not each.startswith(f"{key} =")]
        place = kept.index(next(each for each in kept if each.startswith("price =")))
        place_of = tmp_path / key / written.strip('"').partition(" ")[0]
        mine = folder(place_of, "\n".join([*kept[:place], line, *kept[place:]]))
        read = load_catalog(mine).opamp("TL074C")
        assert getattr(read, key).nominal == value
        assert read.offset == plain.offset


def test_one_series_and_a_coefficient_in_ppm(tmp_path: Path) -> None:
    text = FAMILY.replace(
        'values = ["10nF", "13nF", 22e-9]', 'series = "E6"\nrange = ["1nF", "1µF"]'
    )
    for written in ('"300 ppm/K"', '"300e-6/K"', '"300 ppm/°C"', "300e-6"):
        mine = folder(tmp_path / "mine", "format = 1\n" + text.replace("300e-6", written))
        (family,) = [f for f in load_catalog(mine).families if f.name == "drawer"]
        assert family.series == ("E6",)
        assert family.values == tuple(series_values(["E6"], 1e-9, 1e-6).tolist())
        assert family.temperature_coefficient == 300e-6


def test_a_coefficient_in_ppm_is_the_number_itself_and_a_long_one_is_refused() -> None:
    read = fields.per_kelvin().read
    for count in range(1, 1000):
        assert read(f"{count} ppm/K") == float(f"{count}e-6")
    with pytest.raises(ValueError, match="per kelvin"):
        read(10**400)


def test_one_name_twice_in_a_folder(tmp_path: Path) -> None:
    mine = folder(tmp_path / "mine", "format = 1\n" + FAMILY, "a.toml")
    folder(mine, "format = 1\n" + FAMILY, "b.toml")
    with pytest.raises(InputError, match=r"b\.toml: name: found drawer"):
        load_catalog(mine)


def test_a_catalogue_file_that_cannot_be_read(tmp_path: Path) -> None:
    mine = tmp_path / "mine"
    (mine / "folder.toml").mkdir(parents=True)
    with pytest.raises(InputError, match=r"folder\.toml"):
        load_catalog(mine)
    shutil.rmtree(mine)
    folder(mine, "")
    (mine / "own.toml").write_bytes(b"format = 1\n# \xff\n")
    with pytest.raises(InputError, match="line 2: found byte 0xff"):
        load_catalog(mine)
