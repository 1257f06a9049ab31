"""What the catalogue cannot give is refused before anything is computed, with what it can."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from designer.base.errors import InputError, Unreachable
from designer.board.board_check import check_board
from designer.catalog.entries import PartCase, mounting_of
from designer.catalog.parts_catalog import Catalog, load_catalog
from designer.centering import design_search
from designer.check import synthesis_result
from designer.cli import entry
from designer.jobs import search_stage, study_stage
from designer.model.model_file import ModelFile, parse_model_file
from designer.synthesis import parts_choice
from designer.synthesis.part_checks import check_choices
from tests.catalog.test_catalog import SHIPPED
from tests.shared.exploring import quick
from tests.shared.model_text import PAPER_TABLE
from tests.shared.stages import CATALOG, PAPER


def text(circuit: str = "", board: str = "") -> str:
    return (
        f'format = 1\n{PAPER_TABLE}\n[[response]]\nomega = 1.55\nexpect = "1-1-1"\n\n'
        f"[circuit]\n{circuit}\n\n[board]\n{board}\n"
    )


def model(circuit: str = "", board: str = "") -> ModelFile:
    return parse_model_file(text(circuit, board))


def refused(circuit: str = "", board: str = "", catalog: Catalog = CATALOG) -> InputError:
    with pytest.raises(InputError) as caught:
        check_board(model(circuit, board), catalog)
    return caught.value


def with_opamp(name: str, **changes: object) -> Catalog:
    """The shipped catalogue with one op-amp changed."""
    others = (replace(o, **changes) if o.name == name else o for o in CATALOG.opamps)  # type: ignore[arg-type]
    return replace(CATALOG, opamps=tuple(others))


def would_do(error: InputError) -> list[str]:
    """The parts that the message names, of rails (would do) or of a case (have one)."""
    names = re.split("that would do: |that have one: ", error.expected)[-1]
    return names.split(", ") if names != error.expected else []


def for_rails(volts: float, *, tht: bool = False) -> list[str]:
    """By the catalogue's own ranges: the op-amps for these rails."""
    return [
        o.name
        for o in CATALOG.opamps
        if (o.supply.min or 0.0) <= volts <= (o.supply.max or 99.0)
        and (not tht or "tht" in {mounting_of(f) for f in cases(o.footprint, o.cases)})
    ]


def cases(first: str, others: tuple[PartCase, ...]) -> list[str]:
    return [first, *(case.footprint for case in others)]


def test_everything_shipped_can_be_used() -> None:
    """No false alarm: every op-amp on rails of its own, in both cases where it has both."""
    for opamp in CATALOG.opamps:
        circuit = f'opamp = "{opamp.name}"\nsupply = {opamp.rated_supply}'
        check_board(model(circuit), CATALOG)
        for footprint in cases(opamp.footprint, opamp.cases):
            check_board(model(circuit, f'mounting = "{mounting_of(footprint)}"'), CATALOG)


def test_rails_that_an_opamp_does_not_take() -> None:
    error = refused('opamp = "MCP6004"')
    assert (error.field, error.found) == ("circuit.supply", 15.0)
    assert error.expected.startswith("0.9 to 3 V, the rails of MCP6004; op-amps ")
    assert would_do(error) == for_rails(15.0)
    assert "TL072C" in would_do(error)
    assert would_do(refused('opamp = "TL074C"\nsupply = 1.5')) == ["MCP6004"]
    assert would_do(refused('opamp = "TL074C"\nsupply = 50')) == ["none"]


def test_a_case_that_the_board_does_not_take() -> None:
    error = refused('opamp = "OPA2192"', 'mounting = "tht"')
    assert error.field == "board.mounting"
    assert would_do(error) == for_rails(15.0, tht=True)
    assert "TL072C" in would_do(error)
    assert "TL072H" not in would_do(error)


@pytest.mark.parametrize("name", ["AA", "P", "1", "a"])
def test_sections_with_names_that_no_package_can_have(name: str) -> None:
    pins = CATALOG.opamp("TL072C").pins
    wrong = with_opamp("TL072C", pins=(replace(pins[0], name=name), pins[1]))
    error = refused('opamp = "TL072C"', catalog=wrong)
    assert error.field == "circuit.opamp"
    assert f"a section {name}" in str(error.found)
    assert "TL074C" in would_do(error)
    assert "TL072C" not in would_do(error)


def test_pins_that_the_case_does_not_have() -> None:
    wrong = with_opamp("TL072C", supply_pins=("14", "4"))
    error = refused('opamp = "TL072C"', catalog=wrong)
    assert error.field == "circuit.opamp"
    assert "a pin 14 in Package_SO:SOIC-8" in str(error.found)
    assert "8 pads" in error.expected
    assert "TL071C" in would_do(error)
    # A case that only the user knows is no reason to refuse: the bill can state it.
    own = with_opamp("TL072C", footprint="Mine:TSSOP-8")
    check_board(model('opamp = "TL072C"'), own)


def test_a_reference_that_the_rails_cannot_feed() -> None:
    low = 'opamp = "MCP6004"\nsupply = 2.5\ndead_zone = "rectifier"'
    error = refused(low)
    assert isinstance(error, Unreachable)
    assert error.field == "circuit.reference"
    small = replace(CATALOG.reference("LM4040C50"), name="small", voltage=1.2)
    catalog = replace(CATALOG, references=(*CATALOG.references, small))
    assert would_do(refused(low, catalog=catalog)) == ["small"]
    check_board(model(low + '\nreference = "small"'), catalog)
    # Nothing is asked of it where it has no part in the circuit.
    check_choices(replace(PAPER, k0=0.0), model(low).circuit, CATALOG)


def test_a_diode_that_is_none() -> None:
    """1 µV forward: no junction; 1N4148 and its like are named instead."""
    one = CATALOG.diode("1N4148")
    wrong = replace(one, name="wire", forward_voltage=replace(one.forward_voltage, typ=1e-6))
    catalog = replace(CATALOG, diodes=(*CATALOG.diodes, wrong))
    for circuit in ('diode = "wire"', 'diode = "wire"\ndead_zone = "rectifier"'):
        error = refused(circuit, catalog=catalog)
        assert "1N4148" in would_do(error)
        assert "wire" not in would_do(error)
    check_board(model('diode = "wire"', "input_protection = false"), catalog)


@pytest.mark.parametrize(
    ("circuit", "board", "field"),
    [
        ('opamp = "TL072X"', "", "circuit.opamp"),
        ('diode = "1N9999"', "", "circuit.diode"),
        ("preferred = [1.234e4]", "", "circuit.preferred"),
        ("resistor_grade = 1e-6", "", "circuit.resistor_grade"),
        ("", 'bulk = "3.7µF"', "board.bulk"),
        ("", 'decoupling = "9nF"', "board.decoupling"),
        ("", 'probe_resistor = "123.4"', "board.probe_resistor"),
        ("", 'bom = ["none-such"]', "board.bom"),
    ],
)
def test_other_choices_are_refused_as_early(circuit: str, board: str, field: str) -> None:
    assert refused(circuit, board).field == field


# Nothing is computed before.


@pytest.fixture
def nothing_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever takes time fails the test."""

    def fail(*_: object, **__: object) -> object:
        raise AssertionError("work before the refusal")

    for module, name in (
        (synthesis_result, "synthesise"), (design_search, "stretches"), (parts_choice, "_Search"),
        (study_stage.StudyHelp, "of"), (search_stage, "SpicePool"),
    ):  # fmt: skip
        monkeypatch.setattr(module, name, fail)


WRONG = {
    "an op-amp": ('opamp = "OPA2192"', 'mounting = "tht"', "board.mounting", "TL072C"),
    "rails": ('opamp = "MCP6004"', "", "circuit.supply", "TL072C"),
    "a value of the board": ("", 'bulk = "3.7µF"', "board.bulk", "10µF"),
}


@pytest.mark.usefixtures("nothing_runs")
@pytest.mark.parametrize("verb", ["synthesise", "run", "search", "trade"])
@pytest.mark.parametrize("case", WRONG)
def test_the_verbs_refuse_before_any_work(
    verb: str, case: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    circuit, board, field, other = WRONG[case]
    file = tmp_path / "wrong.toml"
    file.write_text(text(circuit, board), encoding="utf-8")
    out = tmp_path / "out"
    assert entry.status([verb, str(file), "--out", str(out), "--jobs", "1"]) == 2
    told = capfd.readouterr().err
    assert str(file) in told
    assert field in told
    assert other in told
    assert "Traceback" not in told
    assert not out.exists()


@pytest.mark.parametrize("verb", quick(["synthesise", "run", "tolerance", "trade", "search"], 2))
@pytest.mark.parametrize(
    ("wanted", "instead"),
    [('"1-9-9"', "1-3-3"), ('"1-3-3"\nsymmetric = false', "1-3-3, symmetric")],
)
def test_no_part_is_chosen_for_a_response_that_no_start_finds(
    verb: str,
    wanted: str,
    instead: str,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """At ω = 0.54 the paper's model has one attractor, the symmetric 1-3-3."""

    def fail(*_: object, **__: object) -> object:
        raise AssertionError("work before the refusal")

    monkeypatch.setattr(parts_choice, "synthesise", fail)
    file, out = tmp_path / "wrong.toml", tmp_path / "out"
    there = f"format = 1\n{PAPER_TABLE}"
    responses = [f"[[response]]\nomega = {w}\n" for w in (1.55, f"0.54\nexpect = {wanted}")]
    file.write_text(there + "".join(responses), encoding="utf-8")
    assert entry.status([verb, str(file), "--out", str(out), "--jobs", "1", "--json"]) == 1
    told = capfd.readouterr()
    assert f"{file}: response[2]: {wanted.strip(chr(34))[:5]}" in told.err
    assert f"from none of 16 starts; found instead: {instead}\n" in told.err
    assert [row["found"] for row in json.loads(told.out)["responses"]] == [True, False]
    assert not out.exists()


def test_a_search_leaves_out_what_the_rails_cannot_feed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A rectifier among the dead zones of a search on low rails does not end it; alone it does."""
    monkeypatch.setattr(design_search, "stretches", lambda *_, **__: ())
    low = text('opamp = "MCP6004"\nsupply = 2.5')
    both = low + '\n[search]\ndead_zones = ["saturation", "rectifier"]\n'
    assert design_search.look(parse_model_file(both), CATALOG, 1) == ()
    alone = parse_model_file(low + '\n[search]\ndead_zones = ["rectifier"]\n')
    with pytest.raises(Unreachable, match=r"circuit\.reference"):
        design_search.look(alone, CATALOG, 1)


def test_a_search_chooses_among_the_cases_that_the_board_takes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    catalogs = []

    class Stop(Exception):
        pass

    def hunt(_: ModelFile, catalog: Catalog, *__: object) -> None:
        catalogs.append(catalog)
        raise Stop

    monkeypatch.setattr(design_search, "_DesignSearch", hunt)
    with pytest.raises(Stop):
        design_search.search(model("", 'mounting = "tht"'), CATALOG, seed=1, jobs=1, windows=())
    assert [c.mounting for c in catalogs] == ["tht"]


def test_an_opamp_of_ones_own_with_three_sections(tmp_path: Path) -> None:
    """A triple works by the same rule as any other number."""
    shipped = (SHIPPED / "opamps.toml").read_text(encoding="utf-8")
    own = "format = 1\n\n[[opamp]]\n" + shipped.split("[[opamp]]\n")[1]
    fourth = '    { name = "D", inverting = "13", noninverting = "12", output = "14" },\n'
    assert fourth in own
    own = own.replace(fourth, "").replace('"TL074C"', '"triple"', 1)
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "own.toml").write_text(own, encoding="utf-8")
    catalog = load_catalog(folder)
    assert catalog.opamp("triple").sections == 3
    check_board(model('opamp = "triple"'), catalog)
