"""Lists of what distributors sell: order numbers and prices of parts, as CSV (docs/catalogue.md).

Such a list is a file ``stock/NAME.csv`` in a catalogue folder, or one that a command names. A row
is for one maker's part number; or, for resistors and capacitors, for a kind, value, case and grade.
"""

from __future__ import annotations

import datetime
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

from designer.base.errors import MISSING, InputError
from designer.base.guarded_reading import csv_rows, read_text
from designer.base.schema import one_of
from designer.base.units import parse_quantity
from designer.catalog.entries import UNITS, Kind

COLUMNS = (
    "part_number",
    "kind",
    "value",
    "case",
    "grade",
    "distributor",
    "number",
    "price_eur",
    "from_pieces",
    "date",
    "source",
)
NEEDED = ("distributor", "number", "date", "source")
"""Columns whose cells may not be empty."""
BY_VALUE = ("kind", "value", "case", "grade")
"""What says which part a row is for, where there is no part number."""
_MAX_BYTES = 4_000_000


@dataclass(frozen=True)
class StockRow:
    """A part as a distributor sells it."""

    part_number: str
    """The maker's part number; "" where kind, value, case and grade say which part it is."""
    kind: Kind | None
    """Kind of part, where there is no part number."""
    value: float
    """Its value [Ω or F]; nan where there is a part number."""
    case: str
    """Its case, such as "0603": a word of the footprint's name; "" with a part number."""
    grade: float
    """Its tolerance, a fraction; nan where there is a part number."""
    distributor: str
    number: str
    """The distributor's order number."""
    price: float | None
    """Euro apiece, or None."""
    from_pieces: int
    """The number of pieces from which that price holds."""
    date: str
    """When it was looked up, as YYYY-MM-DD."""
    source: str
    """Where it was looked up."""

    def fits(
        self, part_number: str, kind: str, value: float | None, footprint: str, grade: float | None
    ) -> bool:
        """Whether a part on the bill may be ordered by this row.

        value : in Ω or F. grade : the tolerance that was bought; a row of a better one fits.
        """
        if self.part_number:
            return self.part_number.casefold() == part_number.casefold()
        return (
            kind == self.kind
            and value is not None
            and math.isclose(value, self.value, rel_tol=1e-9)
            and self.case.casefold() in re.split(r"[_:]", footprint.casefold())
            and self.grade <= (1.0 if grade is None else grade) * (1.0 + 1e-9)
        )


def read_stock(folders: Sequence[Path], inner: str) -> tuple[StockRow, ...]:
    """The rows of the lists in these folders, nearest folder first. inner : their folder there.

    Raises
    ------
    InputError : a list cannot be read, or is wrong; names file and line.
    """
    paths = [path for folder in folders for path in sorted((folder / inner).glob("*.csv"))]
    return tuple(row for path in paths for row in stock_rows(path))


def stock_rows(path: Path, field: str = "the file") -> tuple[StockRow, ...]:
    """The rows of one list. field : what named the file, for messages.

    Raises
    ------
    InputError : it cannot be read, or is wrong; names the line and the column.
    """
    text = read_text(path, "a list of parts as CSV (docs/catalogue.md)", field, _MAX_BYTES)
    rows = csv_rows(text, path)
    _, header = next(rows, (1, []))
    names = [name.strip() for name in header]
    _check_header(path, names)
    out = []
    for number, row in rows:
        if any(cell.strip() for cell in row):
            if len(row) != len(names):
                expected = f"{len(names)}, as the header"
                raise InputError(path, f"line {number}", f"{len(row)} cells", expected)
            cells = dict(zip(names, (cell.strip() for cell in row), strict=True))
            out.append(_row(cells, path, f"line {number}"))
    return tuple(out)


def order_number(rows: Iterable[StockRow], distributor: str) -> str:
    """The first order number of a distributor; "" where there is none."""
    wanted = distributor.casefold()
    return next((row.number for row in rows if row.distributor.casefold() == wanted), "")


def _check_header(path: Path, names: Sequence[str]) -> None:
    for name in names:
        if name not in COLUMNS or names.count(name) > 1:
            found = f"column {name!r}" + (" twice" if names.count(name) > 1 else "")
            raise InputError(path, "line 1", found, one_of(name, COLUMNS))
    for name in NEEDED:
        if name not in names:
            raise InputError(path, "line 1", f"no column {name!r}", "a header with " + ", ".join(
                NEEDED) + ", and part_number or " + ", ".join(BY_VALUE))  # fmt: skip


def _row(cells: Mapping[str, str], path: Path, place: str) -> StockRow:
    for name in NEEDED:
        if not cells[name]:
            raise InputError(path, f"{place}.{name}", MISSING, "some text")
    by_value = [name for name in BY_VALUE if cells.get(name)]
    part_number = cells.get("part_number", "")
    if bool(part_number) is bool(by_value) or (by_value and len(by_value) < len(BY_VALUE)):
        found = ", ".join([*(["part_number"] if part_number else []), *by_value]) or "neither"
        expected = "part_number, or all of " + ", ".join(BY_VALUE)
        raise InputError(path, place, found, expected)
    kinds = get_args(Kind)
    kind: Kind | None = next((each for each in kinds if each == cells.get("kind")), None)
    if by_value and kind is None:
        raise InputError(path, f"{place}.kind", cells["kind"], one_of(cells["kind"], kinds))
    try:
        datetime.date.fromisoformat(cells["date"])
    except ValueError:
        raise InputError(path, f"{place}.date", cells["date"], "a day, YYYY-MM-DD") from None
    unit = UNITS[kind] if kind else ""
    return StockRow(
        part_number=part_number,
        kind=kind,
        value=_number(cells, "value", unit, path, place),
        case=cells.get("case", ""),
        grade=_number(cells, "grade", "", path, place),
        distributor=cells["distributor"],
        number=cells["number"],
        price=_number(cells, "price_eur", "", path, place) if cells.get("price_eur") else None,
        from_pieces=_pieces(cells.get("from_pieces") or "1", path, f"{place}.from_pieces"),
        date=cells["date"],
        source=cells["source"],
    )


def _number(cells: Mapping[str, str], name: str, unit: str, path: Path, place: str) -> float:
    text = cells.get(name, "")
    if not text:
        return math.nan
    expected = f"a number > 0{f' in {unit}, such as 22.1k or 100n' if unit else ''}"
    expected = "a fraction: 0.01 is 1 %" if name == "grade" else expected
    try:
        value = parse_quantity(text, unit)
    except ValueError:
        raise InputError(path, f"{place}.{name}", text, expected) from None
    if value <= 0.0:
        raise InputError(path, f"{place}.{name}", text, expected)
    return value


def _pieces(text: str, path: Path, place: str) -> int:
    if not (text.isascii() and text.isdecimal() and int(text[:9]) > 0 and len(text) <= 9):
        raise InputError(path, place, text, "a whole number of pieces, at least 1")
    return int(text)
