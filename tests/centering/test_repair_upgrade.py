"""Upgrades: what they make of a model file, of a bill of materials and of the boards."""

from __future__ import annotations

import csv
import io
import itertools
import math
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from designer.base.errors import InputError
from designer.base.toml_writer import toml_text
from designer.board.board_parts import board_circuit
from designer.board.bom import bill, bill_csv
from designer.board.component import components
from designer.catalog.fields import PRICE_CLASSES
from designer.catalog.parts_catalog import load_catalog
from designer.centering.repair_branch import RepairBranch, better_opamps, branch_of, branches
from designer.centering.repair_slots import part_slots
from designer.centering.repair_upgrade import (
    PartNetwork,
    Upgrades,
    WindowPlace,
    price,
    upgraded_file,
    with_same_parts,
)
from designer.check.synthesis_result import Synthesis, with_stage
from designer.model.circuit_table import DeadZone
from designer.model.model_file import parse_model_file
from designer.spread.part_grades import bought
from designer.spread.part_rules import spread_of
from designer.spread.spread import draw_many
from tests.shared import paper_cases
from tests.shared.mechanism_file import HAMMER
from tests.shared.model_text import COARSE_CIRCUIT, COARSE_RECTIFIER, SMALL

CATALOG = load_catalog()

FILES = Path(__file__).resolve().parents[2] / "examples"

VALUES = st.recursive(
    st.one_of(
        st.booleans(),
        st.integers(-(2**62), 2**62),
        st.floats(allow_nan=False),
        st.text(st.characters(codec="utf-8")),
    ),
    lambda inner: st.one_of(
        st.lists(inner, max_size=3), st.dictionaries(st.text(max_size=5), inner, max_size=3)
    ),
    max_leaves=8,
)


@given(st.dictionaries(st.text(max_size=5), VALUES, max_size=5))
def test_what_is_written_is_read_again(data: dict[str, Any]) -> None:
    assert tomllib.loads(toml_text(data)) == data


@pytest.mark.parametrize("name", ["paper", "rectifier", "spread", "drill"])
def test_examples_say_the_same_after_they_are_written_again(name: str) -> None:
    data = tomllib.loads((FILES / f"{name}.toml").read_text(encoding="utf-8"))
    assert tomllib.loads(toml_text(data)) == data


@pytest.fixture(scope="module")
def base() -> Synthesis:
    return paper_cases.synthesised()


def test_the_model_file_says_what_is_upgraded(base: Synthesis) -> None:
    upgrades = Upgrades(
        opamp="TL074H",
        grades={"R50": 0.001, "R4": 0.001},
        places={1: WindowPlace(0.87, 0.26)},
        trim=0.03,
        trimmer=True,
        networks=(PartNetwork("Vishay ACAS 0612", ("R2", "R3")),),
    )
    read = upgraded_file(base.modelfile, upgrades)
    assert Upgrades.of_dict(upgrades.as_dict()) == upgrades
    assert (read.circuit.opamp, read.circuit.saturation) == ("TL074H", None)
    assert (read.responses[1].omega, read.responses[1].b) == (0.87, 0.26)
    assert read.responses[1].expect == base.modelfile.responses[1].expect
    assert read.responses[0] == base.modelfile.responses[0]
    assert read.tuning.as_dict() == {"frequency": 0.0, "amplitude": 0.0, "offset": 0.03}
    assert [(rule.names, rule.grade) for rule in read.spread.part] == [(("R50", "R4"), 0.001)]
    assert read.board.dc_trim == "fitted"
    assert [(n.parts, n.family) for n in read.spread.network] == [
        (("R2", "R3"), "Vishay ACAS 0612")
    ]
    assert read.model == base.modelfile.model
    assert upgraded_file(base.modelfile, Upgrades()) is base.modelfile


@pytest.mark.parametrize(
    ("key", "stated", "rate"),
    [
        ("omega", "125.66", 1.0),
        ("Omega", '"125.66 rad/s"', 1.0),
        ("Omega", "125.66", 1.0),
        ("frequency", '"20 Hz"', 1.0 / math.tau),
        ("frequency", "20", 1.0 / math.tau),
        ("frequency", '"125.66 rad/s"', 1.0 / math.tau),
    ],
)
@pytest.mark.parametrize("b", [1.0, 1.1])
def test_a_response_moves_in_the_key_of_its_frequency(
    key: str, stated: str, rate: float, b: float
) -> None:
    text = f'{HAMMER}[[response]]\n{key} = {stated}\nexpect = "1-1-0;0-1"\ntwin = "exact"\n'
    file = parse_model_file(text)
    (before,) = file.responses
    assert before.omega is not None
    assert before.omega == pytest.approx(125.66, rel=1e-4)
    moved = upgraded_file(file, Upgrades(places={0: WindowPlace(131.4, b)}))
    (after,) = moved.responses
    assert after.omega == pytest.approx(131.4, rel=1e-15)
    assert (after.b, after.expect, after.twin) == (b, before.expect, "exact")
    (table,) = tomllib.loads(moved.text)["response"]
    assert {*table} & {"omega", "Omega", "frequency"} == {key}
    assert float(str(table[key]).removesuffix(" Hz")) == pytest.approx(131.4 * rate, rel=1e-15)
    stays = upgraded_file(file, Upgrades(places={0: WindowPlace(before.omega, 1.2)}))
    assert stays.responses[0].omega == before.omega
    assert tomllib.loads(stays.text)["response"][0][key] == tomllib.loads(f"key = {stated}")["key"]


@pytest.mark.slow
def test_a_better_part_is_bought_and_spreads_less(base: Synthesis) -> None:
    made = with_same_parts(base, upgraded_file(base.modelfile, Upgrades(grades={"R50": 0.001})))
    circuit = made.design.circuit
    grades = bought(made.modelfile, circuit, CATALOG)
    assert grades == {"R50": 0.001}
    lines = bill(components(circuit, CATALOG, board_circuit(made)[1]))
    rows = list(csv.DictReader(io.StringIO(bill_csv(lines))))
    own = next(row for row in rows if "R50" in row["designators"].split())
    assert (own["designators"], own["grade"]) == ("R50", "0.001")
    count = sum(int(row["quantity"]) for row in rows)
    assert count == len(circuit.resistors) + len(circuit.capacitors) + len(circuit.packages)
    boards = draw_many(circuit, spread_of(made.modelfile, circuit, CATALOG), 1, range(2000))
    plain = draw_many(circuit, spread_of(base.modelfile, circuit, CATALOG), 1, range(2000))
    narrow = np.std(boards.values["R50"]) / np.std(plain.values["R50"])
    assert narrow == pytest.approx(0.1)
    assert np.array_equal(boards.values["R4"], plain.values["R4"])


def test_a_grade_that_nobody_sells_is_for_the_study_alone(base: Synthesis) -> None:
    text = base.modelfile.text + '\n[[spread.part]]\nnames = ["R50"]\ngrade = 1e-6\n'
    file = parse_model_file(text)
    assert bought(file, base.design.circuit, CATALOG) == {}


def test_prices_of_slots_are_those_of_the_bill(base: Synthesis) -> None:
    """One part after the other: the difference of two bills is what its option says."""
    least = price(base)
    slots = part_slots(base)
    assert {s.slot.name for s in slots} <= set(base.design.circuit.values)
    for slot in slots[::7]:
        for option, grade in list(zip(slot.slot.options, slot.grades, strict=True))[1:]:
            file = upgraded_file(base.modelfile, Upgrades(grades={slot.parts[0]: grade}))
            extra = price(replace(base, modelfile=file)) - least
            assert option.price == pytest.approx(extra, abs=1e-12)
            assert grade < base.modelfile.circuit.resistor_grade
    assert part_slots(base, frozenset({"grade", "reference"})) == ()


def test_prices_lie_within_their_classes() -> None:
    ends = [0.0, *PRICE_CLASSES]
    for number, (low, high) in enumerate(itertools.pairwise(ends), start=1):
        assert low < CATALOG.euro(number) <= high
    with pytest.raises(InputError, match="a class with a table"):
        CATALOG.euro(7)


def test_another_opamp_on_the_same_parts_has_its_own_limits(base: Synthesis) -> None:
    now, other = CATALOG.opamp("TL074C"), CATALOG.opamp("TL074H")
    assert [o.name for o in better_opamps(now, 15.0, CATALOG)] == ["TL074H", "OPA4192"]
    made = with_same_parts(base, upgraded_file(base.modelfile, Upgrades(opamp="TL074H")))
    circuit, errors = made.design.circuit, made.design.errors
    assert circuit.values == base.design.circuit.values
    assert (circuit.opamp, circuit.gain) == ("TL074H", other.gain.typ)
    assert circuit.saturation == other.saturation_at(15.0)
    scale = circuit.output_limits()["U3C"] / base.design.circuit.saturation
    assert errors.scales.threshold == pytest.approx(base.design.errors.scales.threshold * scale)
    assert errors.max_error == pytest.approx(base.design.errors.max_error)
    broken = [c.quantity for c in made.design.checks if not c.holds]
    assert broken == ["generator_peak_v"]  # 4.95 V were asked of it before


@pytest.mark.slow
def test_where_a_condition_breaks_the_parts_are_chosen_anew(base: Synthesis) -> None:
    branch = branch_of(base, Upgrades(opamp="TL074H", grades={"R50": 0.001}))
    assert isinstance(branch, RepairBranch)
    assert branch.upgrades == Upgrades(opamp="TL074H")
    design = branch.synthesis.design
    assert all(check.holds for check in design.checks)
    differing = {n for n, v in design.circuit.values.items() if v != base.design.circuit.values[n]}
    assert differing == {"R6"}  # the generator's
    assert branch.extra == 0.0  # both op-amps are of one class, and so are both resistors


def test_branches_that_are_not_wanted_are_not_made(base: Synthesis) -> None:
    alone = list(branches(base, frozenset({"op-amp", "dead zone"})))
    assert [b.upgrades for b in alone] == [Upgrades()]


def test_a_folder_of_ones_own_replaces_single_prices(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    own.write_text('format = 1\n[[price]]\nprice_class = 3\neuro = 0.2\nsource = "a quotation"\n')
    catalog = load_catalog(tmp_path)
    assert (catalog.euro(3), catalog.euro(4)) == (0.2, CATALOG.euro(4))
    own.write_text('format = 1\n[[price]]\nprice_class = 9\neuro = 0.2\nsource = "a quotation"\n')
    with pytest.raises(InputError) as refused:
        load_catalog(tmp_path)
    assert refused.value.field == "price[1].price_class"


@pytest.mark.parametrize("kind", ["saturation", "rectifier"])
def test_a_stage_that_was_chosen_for_the_file_stays(kind: DeadZone) -> None:
    """A file that states no stage is repaired with the one that its design has."""
    unstated = parse_model_file(SMALL.replace(COARSE_RECTIFIER, COARSE_CIRCUIT))
    assert unstated.circuit.dead_zone is None
    repaired = upgraded_file(with_stage(unstated, kind), Upgrades(opamp="OPA4192"))
    assert (repaired.circuit.opamp, repaired.circuit.dead_zone) == ("OPA4192", kind)
