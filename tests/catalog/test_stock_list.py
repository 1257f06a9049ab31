"""Lists of what distributors sell: which part a row is for, and what is wrong with a list."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import pytest

from designer.base.errors import InputError
from designer.board.bom import bill
from designer.board.bom_layouts import layouts
from designer.catalog.parts_catalog import load_catalog
from designer.catalog.stock_list import StockRow, order_number, stock_rows
from tests.board.test_bom_layouts import listed
from tests.shared.stages import CATALOG

HEAD = "part_number,kind,value,case,grade,distributor,number,price_eur,from_pieces,date,source\n"
BY_NUMBER = "RC0603FR-079K1L,,,,,LCSC,C1,0.01,10,2026-01-05,a page\n"
BY_VALUE = ",resistor,9.1k,0603,0.01,Shop,S2,,,2026-01-05,a page\n"


def rows(folder: Path, text: str) -> tuple[StockRow, ...]:
    path = folder / "list.csv"
    path.write_text(text, encoding="utf-8")
    return stock_rows(path, "--parts")


def test_a_row_is_for_a_part_number_or_for_what_may_stand_in_its_place(tmp_path: Path) -> None:
    number, value = rows(tmp_path, HEAD + BY_NUMBER + BY_VALUE)
    assert (number.price, number.from_pieces) == (0.01, 10)
    assert (value.price, value.from_pieces, value.value, value.grade) == (None, 1, 9100.0, 0.01)
    part = "Resistor_SMD:R_0603_1608Metric", 0.01
    assert number.fits("rc0603fr-079k1l", "resistor", 9100.0, *part)
    assert not number.fits("RC0603FR-079K1", "resistor", 9100.0, *part)
    assert value.fits("any", "resistor", 9100.0, *part)
    assert not value.fits("any", "capacitor", 9100.0, *part)
    assert not value.fits("any", "resistor", 9101.0, *part)
    assert not value.fits("any", "resistor", None, *part)
    assert not value.fits("any", "resistor", 9100.0, "Resistor_SMD:R_0805_2012Metric", 0.01)
    assert value.fits("any", "resistor", 9100.0, part[0], 0.05)
    assert not value.fits("any", "resistor", 9100.0, part[0], 0.001)


def test_the_bill_has_the_numbers_of_the_nearest_list(tmp_path: Path) -> None:
    mine = rows(tmp_path, HEAD + BY_NUMBER.replace("C1,", "C9,") + BY_NUMBER + BY_VALUE)
    lines = bill(listed("paper"), mine)
    (drive,) = (one for one in lines if "R6" in one.designators)
    assert order_number(drive.stock, "lcsc") == "C9"
    assert order_number(drive.stock, "Shop") == "S2"
    assert not any(one.stock for one in lines if one is not drive)
    (layout,) = layouts(["jlcpcb"], CATALOG.folders)
    table = list(csv.DictReader(io.StringIO(layout.csv(lines))))
    assert {row["Designator"]: row["LCSC Part #"] for row in table if row["LCSC Part #"]} == {
        "R6": "C9"
    }


def test_lists_in_a_catalogue_folder_are_read_and_hashed(tmp_path: Path) -> None:
    stock = tmp_path / "stock"
    stock.mkdir()
    (stock / "mine.csv").write_text(HEAD + BY_NUMBER, encoding="utf-8")
    with_list = load_catalog(tmp_path)
    assert next(row.number for row in with_list.stock) == "C1"  # before the shipped ones
    (stock / "mine.csv").write_text(HEAD + BY_NUMBER.replace("C1", "C2"), encoding="utf-8")
    assert load_catalog(tmp_path).hash != with_list.hash


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("", "line 1"),
        (HEAD.replace("number,kind", "numbr,kind"), "line 1"),
        (HEAD.replace("kind", "case"), "line 1"),
        (HEAD.replace(",date", ""), "line 1"),
        (HEAD + BY_NUMBER.replace(",a page", ""), "line 2"),
        (HEAD + BY_NUMBER.replace("a page", " "), "line 2.source"),
        (HEAD + BY_NUMBER.replace("C1", ""), "line 2.number"),
        (HEAD + "\n" + BY_NUMBER.replace("RC0603FR-079K1L", ""), "line 3"),
        (HEAD + BY_VALUE.replace(",resistor", "X,resistor"), "line 2"),
        (HEAD + BY_VALUE.replace("0.01", ""), "line 2"),
        (HEAD + BY_VALUE.replace("resistor", "resistance"), "line 2.kind"),
        (HEAD + BY_VALUE.replace("9.1k", "9.1kF"), "line 2.value"),
        (HEAD + BY_VALUE.replace("9.1k", "0"), "line 2.value"),
        (HEAD + BY_VALUE.replace("0.01", "1%"), "line 2.grade"),
        (HEAD + BY_NUMBER.replace("0.01", "-1"), "line 2.price_eur"),
        (HEAD + BY_NUMBER.replace(",10,", ",0,"), "line 2.from_pieces"),
        (HEAD + BY_NUMBER.replace("2026-01-05", "5.1.2026"), "line 2.date"),
    ],
)
def test_wrong_lists_are_named(tmp_path: Path, text: str, field: str) -> None:
    with pytest.raises(InputError) as caught:
        rows(tmp_path, text)
    assert caught.value.field == field
    assert str(tmp_path) in str(caught.value)


def test_a_list_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        stock_rows(tmp_path / "none.csv", "--parts")
    assert caught.value.field == "--parts"
