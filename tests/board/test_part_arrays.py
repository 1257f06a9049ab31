"""Arrays: as they are sold, how their elements differ, and what the bill says."""

from __future__ import annotations

import csv
import io
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from designer.base.errors import MISSING, InputError, Unreachable
from designer.base.toml_writer import toml_text
from designer.base.views import View
from designer.board import board_notes
from designer.board.board_parts import board_circuit
from designer.board.bom import bill, bill_csv
from designer.board.component import components, to_buy
from designer.catalog.parts_catalog import load_catalog
from designer.catalog.read import read_catalog_file
from designer.centering.repair_upgrade import price
from designer.check.synthesis_result import Synthesis
from designer.model.model_file import ModelFile, parse_model_file
from designer.spread.part_grades import arrays, bought
from designer.spread.part_rules import spread_of
from designer.spread.spread import draw_many
from tests.shared import paper_cases

CATALOG = load_catalog()
NAME = "Vishay ACAS 0612"


@pytest.fixture(scope="module")
def base() -> Synthesis:
    return paper_cases.synthesised()


def equal(made: Synthesis, count: int) -> tuple[str, ...]:
    """The names of so many resistors of one value."""
    by: dict[float, list[str]] = {}
    for r in made.design.circuit.resistors:
        by.setdefault(r.value, []).append(r.name)
    return tuple(max(by.values(), key=len)[:count])


def with_network(made: Synthesis, *networks: dict[str, Any], **more: Any) -> ModelFile:
    data = tomllib.loads(made.modelfile.text)
    data.setdefault("spread", {})["network"] = list(networks)
    data["spread"] |= more
    return parse_model_file(toml_text(data))


def test_an_array_is_no_choice_for_a_single_part() -> None:
    (family,) = [f for f in CATALOG.families if f.use == "array"]
    assert (family.elements, family.matching, family.grade) == (4, 0.001, 0.0025)
    assert CATALOG.part("resistor", 10e3, 0.0025).family.use == "signal"
    assert CATALOG.part("resistor", 10e3, 0.01).family.use == "signal"
    sold = CATALOG.array(NAME, 10e3)
    assert sold.part_number == "ACASA1002E1002P100"
    for value in family.values:
        assert family.part_number.value(family.part_number.of(value)) == pytest.approx(value)
    with pytest.raises(ValueError, match="not a part number"):
        family.part_number.value("ACASA1002E1003P100")
    with pytest.raises(Unreachable, match="100Ω to 221kΩ"):
        CATALOG.array(NAME, 1e6)
    with pytest.raises(InputError, match="ACAS"):
        CATALOG.array("ACAS 0612", 10e3)
    with pytest.raises(InputError, match="smd"):
        CATALOG.mounted("tht").array(NAME, 10e3)


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        ('use = "array"\n', "", "elements"),
        ("elements = 4\n", "", "elements"),
        ("matching = 0.001\n", "", "matching"),
        ("elements = 4\n", "elements = 1\n", "elements"),
        ("matching = 0.001\n", "matching = 0\n", "matching"),
    ],
)
def test_what_an_array_needs_is_asked_for(tmp_path: Path, old: str, new: str, field: str) -> None:
    text = (Path(__file__).parents[2] / "catalogs" / "resistors.toml").read_text("utf-8")
    table = text[text.index("[[family]]", text.index("# Arrays:")) :]
    path = tmp_path / "arrays.toml"
    path.write_text("format = 1\n" + table.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_catalog_file(path)
    assert caught.value.field == f"family[1].{field}"
    path.write_text("format = 1\n" + table, encoding="utf-8")
    assert len(read_catalog_file(path)[1]) == 1


def test_elements_are_matched_and_within_their_grade(base: Synthesis) -> None:
    """By the law that is stated: uniform, common and own parts, moments of sums."""
    names, circuit = equal(base, 4), base.design.circuit
    file = with_network(base, {"parts": list(names), "family": NAME})
    spread = spread_of(file, circuit, CATALOG)
    boards = draw_many(circuit, spread, 3, range(20000))
    off = np.array([boards.values[n] / circuit.values[n] - 1.0 for n in names])
    apart = off[:, None, :] - off[None, :, :]
    assert np.abs(off).max() <= 0.0025
    assert 0.0009 < np.abs(apart).max() <= 0.001 * (1.0 + 1e-9)
    share = 0.8  # two parts differ by 2 (1 − share) of the grade at most
    sigma = 0.0025 / np.sqrt(3.0) * np.sqrt(share**2 + (1.0 - share) ** 2)
    assert off.std(axis=1) == pytest.approx(sigma, rel=0.02)
    correlated = share**2 / (share**2 + (1.0 - share) ** 2)
    assert np.corrcoef(off)[0, 1:] == pytest.approx(correlated, abs=0.01)
    plain = draw_many(circuit, spread_of(base.modelfile, circuit, CATALOG), 3, range(50))
    again = draw_many(circuit, spread, 3, range(50))
    for name, column in plain.values.items():
        assert name in names or (again.values[name] == column).all()


def test_the_bill_buys_the_array_and_not_its_elements(base: Synthesis) -> None:
    names, circuit = equal(base, 4), base.design.circuit
    file = with_network(base, {"parts": list(names[:3]), "family": NAME})
    made = replace(base, modelfile=file)
    fitted, choice = board_circuit(made)
    found = components(fitted, CATALOG, choice)
    rows = list(csv.DictReader(io.StringIO(bill_csv(bill(to_buy(found, choice))))))
    (line,) = [row for row in rows if row["designators"] == "RN1"]
    assert line["quantity"] == "1"
    assert line["part_number"] == CATALOG.array(NAME, circuit.values[names[0]]).part_number
    assert line["description"].endswith(f"in the places of {' '.join(names[:3])}")
    assert (line["grade"], line["price_class"]) == ("0.0025", "4")
    listed = [n for row in rows for n in row["designators"].split()]
    assert not set(names[:3]) & set(listed)
    assert names[3] in listed
    assert len(set(listed)) == len(listed)
    # The board keeps the pads of the single parts.
    placed = {c.reference: c.views for c in found if View.BOARD in c.views}
    assert all(View.BOM not in placed[name] for name in names[:3])
    assert bought(file, circuit, CATALOG) == {}
    assert [a.parts for a in arrays(file, circuit, CATALOG)] == [names[:3]]
    single = CATALOG.part("resistor", circuit.values[names[0]], 0.01)
    extra = CATALOG.euro(4) - 3 * CATALOG.euro(single.price)
    assert price(made) - price(base) == pytest.approx(extra)
    told = board_notes.markdown(made, fitted, choice, found)
    assert f"takes the places of {', '.join(names[:3])}" in told


def test_what_no_array_can_be_is_refused(base: Synthesis) -> None:
    circuit, four = base.design.circuit, equal(base, 4)
    other = next(r.name for r in circuit.resistors if r.value != circuit.values[four[0]])
    five = equal(base, 5)

    def refused(*networks: dict[str, Any], **more: Any) -> InputError:
        with pytest.raises(InputError) as caught:
            spread_of(with_network(base, *networks, **more), circuit, CATALOG)
        return caught.value

    both = refused({"parts": list(four), "family": NAME, "share": 0.5})
    assert (both.field, both.found) == ("spread.network[1].share", "share and family")
    assert refused({"parts": list(four)}).found is MISSING
    assert refused({"parts": list(four), "family": "no such"}).field == "spread.network[1].family"
    unequal = refused({"parts": [four[0], other], "family": NAME})
    assert unequal.field in ("spread.network[1].parts", "spread.network[1].family")
    if len(five) == 5:
        assert "up to 4 parts" in refused({"parts": list(five), "family": NAME}).expected
    graded = refused(
        {"parts": list(four), "family": NAME}, part=[{"names": [four[0]], "grade": 0.001}]
    )
    assert "a grade of their own" in graded.expected
    assert refused({"parts": ["C1", "C2"], "family": NAME}).field.startswith("spread.network[1]")
    aged = refused({"parts": list(four), "family": NAME}, ageing="catalogue")
    assert aged.field == "spread.ageing"
