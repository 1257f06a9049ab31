"""Bills from components, and in the columns of others."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from pathlib import Path

import pytest

from designer.base.errors import InputError
from designer.base.views import View
from designer.board.board_parts import fitted
from designer.board.bom import COLUMNS, Line, bill, bill_csv
from designer.board.bom_layouts import file_of, layouts
from designer.board.component import Component, components
from designer.catalog.parts_catalog import load_catalog
from designer.catalog.read import LAYOUTS
from designer.model.board_table import BoardChoice
from tests.base.test_views import CIRCUITS
from tests.shared.stages import CATALOG

CHOICE = BoardChoice()


def listed(name: str, choice: BoardChoice = CHOICE) -> tuple[Component, ...]:
    return components(fitted(CIRCUITS[name], choice, CATALOG), CATALOG, choice)


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


@pytest.mark.parametrize("name", CIRCUITS)
@pytest.mark.parametrize("trim", ["fitted", "unfitted"])
def test_the_bill_is_what_is_bought_and_no_more(name: str, trim: str) -> None:
    spec = replace(CHOICE.spec, dc_trim="fitted" if trim == "fitted" else "unfitted")
    found = listed(name, replace(CHOICE, spec=spec))
    lines = bill(found)
    named = [d for line in lines for d in line.designators]
    assert sorted(named) == sorted(c.reference for c in found if View.BOM in c.views)
    assert ("RV901" in named) == (trim == "fitted")
    assert not [d for d in named if d.startswith("TP")]
    assert all(line.quantity == len(line.designators) for line in lines)
    # Like parts stand together, and in no other line.
    numbers = [(line.manufacturer, line.part_number) for line in lines]
    assert len(set(numbers)) == len(numbers)


def test_a_value_for_signals_is_no_value_for_supplies() -> None:
    found = {c.reference: c for c in listed("paper")}
    assert found["C2"].value == found["C903"].value == "100nF"
    assert found["C2"].bought is not None
    assert found["C903"].bought is not None
    assert found["C2"].bought.part_number != found["C903"].bought.part_number
    assert "C0G" in found["C2"].description
    assert "X7R" in found["C903"].description


def test_substitutes_are_of_another_maker_in_the_same_footprint() -> None:
    count = 0
    for catalog in (CATALOG.mounted("smd"), CATALOG.mounted("tht")):
        for family in catalog.families:
            if family.mounting != catalog.mounting:
                continue
            value = family.values[len(family.values) // 2]
            part = catalog.part(family.kind, value, family.grade, family.use)
            other = catalog.substitute(part, family.grade)
            if other is not None:
                count += 1
                assert other.manufacturer != part.manufacturer
                assert other.footprint == part.footprint
                assert other.value == part.value
                assert other.family.grade <= family.grade
    assert count > 5


def test_columns_of_the_assembler() -> None:
    (layout,) = layouts(["jlcpcb"], CATALOG.folders)
    made = rows(layout.csv(bill(listed("paper"))))
    assert list(made[0]) == ["Comment", "Designator", "Footprint", "LCSC Part #"]
    drive = next(row for row in made if "R6" in row["Designator"].split(","))
    assert drive == {
        "Comment": "9.1kΩ 1% RC0603FR-079K1L",
        "Designator": "R6",
        "Footprint": "R_0603_1608Metric",
        "LCSC Part #": "",
    }
    assert all(len(row["Designator"].split(",")) <= 200 for row in made)


def test_columns_of_kicad() -> None:
    (layout,) = layouts(["kicad"], CATALOG.folders)
    made = rows(layout.csv(bill(listed("paper"))))
    assert list(made[0])[:5] == ["Reference", "Value", "Footprint", "Qty", "DNP"]
    drive = next(row for row in made if row["Reference"] == "R6")
    assert drive["Footprint"] == "Resistor_SMD:R_0603_1608Metric"
    assert (drive["MPN"], drive["Qty"]) == ("RC0603FR-079K1L", "1")
    assert drive["Substitute"] == "Vishay CRCW06039K10FKEA"


def test_no_cell_is_a_formula(tmp_path: Path) -> None:
    line = Line(1, ("R1",), "=1+1", "+x", "@m", "-p", "F:F", "", 1, "")
    (tmp_path / LAYOUTS).mkdir()
    own = 'format = 1\ncolumns = [{ title = "A", field = "value" }, { title = "B", text = "=x" }]\n'
    (tmp_path / LAYOUTS / "own.toml").write_text(own)
    (layout,) = layouts(["own"], [tmp_path, *CATALOG.folders])
    (row,) = rows(layout.csv([line]))
    assert row == {"A": "'=1+1", "B": "'=x"}
    (ours,) = rows(bill_csv([line]))
    assert tuple(ours) == COLUMNS
    assert ours["description"] == "'+x"
    assert layout.file == file_of("own") == "bom-own.csv"


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("format = 2\ncolumns = []", "format"),
        ("format = 1", "columns"),
        ("format = 1\ncolumns = []", "columns"),
        ('format = 1\ncolumns = [{ title = "A" }]', "columns[1]"),
        ('format = 1\ncolumns = [{ title = "A", field = "value", text = "" }]', "columns[1]"),
        ('format = 1\ncolumns = [{ title = "A", field = "valeu" }]', "columns[1].field"),
        (
            'format = 1\ncolumns = [{ title = "A", text = "" }, { title = "A", text = "" }]',
            "columns",
        ),
        ("format = 1\ncolums = []", "colums"),
        ("format = ", "line 1"),
    ],
)
def test_wrong_layouts_are_named(tmp_path: Path, text: str, field: str) -> None:
    (tmp_path / LAYOUTS).mkdir()
    (tmp_path / LAYOUTS / "own.toml").write_text(text)
    with pytest.raises(InputError) as caught:
        layouts(["own"], [tmp_path])
    assert caught.value.field == field
    assert str(caught.value.file).endswith("own.toml")


def test_an_unknown_layout_is_named() -> None:
    with pytest.raises(InputError, match="jlcpcb") as caught:
        layouts(["jlpcb"], CATALOG.folders)
    assert caught.value.field == "board.bom"


def test_a_changed_layout_is_a_changed_input(tmp_path: Path) -> None:
    (tmp_path / LAYOUTS).mkdir()
    path = tmp_path / LAYOUTS / "own.toml"
    path.write_text('format = 1\ncolumns = [{ title = "A", text = "" }]\n')
    before = load_catalog(tmp_path).hash
    path.write_text('format = 1\ncolumns = [{ title = "B", text = "" }]\n')
    assert load_catalog(tmp_path).hash != before != load_catalog().hash
