"""Bills of materials in the columns of others: KiCad's, an assembler's, one's own.

A layout is a TOML file in a folder ``bom-layouts`` beside the catalogue's files, named after it
(docs/board.md); folders are searched as the catalogue's are, so a user's own comes first.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from designer.base.csv_tables import csv_text
from designer.base.errors import MISSING, InputError
from designer.base.guarded_reading import read_text
from designer.base.schema import (
    FIRST_FORMAT,
    FileTable,
    checked,
    choice,
    line,
    lines,
    one_of,
    such,
)
from designer.base.toml_reader import parse_toml
from designer.board.bom import COLUMNS, Line
from designer.catalog.read import LAYOUTS
from designer.catalog.stock_list import order_number

ORDER_NUMBER = "order_number"
FIELDS = (*COLUMNS, "package", "comment", ORDER_NUMBER)
"""What a column may show: a field of the bill; the footprint's name; value, grade and number; a
distributor's number."""
_MAX_BYTES = 100_000
_TEXT = such(
    "text of one line, possibly empty",
    lambda value: isinstance(value, str) and value.isprintable() and len(value) <= 200,
)


@dataclass(frozen=True)
class LayoutColumn(FileTable):
    """A column of a bill."""

    title: Annotated[str, line("a heading of one line")]
    """Heading of the column."""
    field: Annotated[str | None, choice(*FIELDS)] = None
    """One of ``FIELDS``; None for a column of one text."""
    text: Annotated[str | None, _TEXT] = None
    """Text of every cell, where ``field`` is None."""
    distributor: Annotated[str | None, line("a distributor's name")] = None
    """Whose number it shows, where ``field`` is "order_number"."""


@dataclass(frozen=True)
class Layout:
    """The columns of a bill."""

    name: str
    separator: str
    """What stands between designators."""
    columns: tuple[LayoutColumn, ...]

    @property
    def file(self) -> str:
        """Name of the bill in this layout."""
        return file_of(self.name)

    def csv(self, bought: Iterable[Line]) -> str:
        """The bill as CSV."""
        titles = [column.title for column in self.columns]
        rows = [
            {column.title: self._cell(column, one) for column in self.columns} for one in bought
        ]
        return csv_text(titles, rows)

    def _cell(self, column: LayoutColumn, one: Line) -> str:
        if column.field is None:
            return column.text or ""
        if column.field == ORDER_NUMBER:
            return order_number(one.stock, column.distributor or "")
        if column.field == "designators":
            return self.separator.join(one.designators)
        if column.field == "package":
            return one.footprint.rpartition(":")[2]
        if column.field == "comment":
            grade = f"{100.0 * float(one.grade):g}%" if one.grade else ""
            return " ".join(dict.fromkeys(w for w in (one.value, grade, one.part_number) if w))
        return one.cells()[column.field]


def file_of(name: str) -> str:
    """Name of the bill in the layout of this name."""
    return f"bom-{name}.csv"


def layouts(names: Sequence[str], folders: Sequence[Path]) -> tuple[Layout, ...]:
    """The layouts of these names, from the first folder that has each.

    Raises
    ------
    InputError : no folder has one; or anything in its file is wrong.
    """
    return tuple(_layout(name, folders) for name in names)


def _layout(name: str, folders: Sequence[Path]) -> Layout:
    for folder in folders:
        path = folder / LAYOUTS / f"{name}.toml"
        if path.is_file():
            return _read(name, path)
    names = {p.stem for folder in folders for p in (folder / LAYOUTS).glob("*.toml")}
    raise InputError(None, "board.bom", name, one_of(name, sorted(names)))


def _read(name: str, path: Path) -> Layout:
    text = read_text(path, "a layout that can be read", most=_MAX_BYTES)
    table = checked(_File, parse_toml(text, str(path)), str(path))
    for number, column in enumerate(table.columns, start=1):
        if (column.field is None) == (column.text is None):
            value = "neither" if column.field is None else "both"
            raise InputError(path, f"columns[{number}]", value, "field or text")
        if (column.distributor is not None) is not (column.field == ORDER_NUMBER):
            stated = MISSING if column.distributor is None else column.distributor
            expected = f'a distributor with field = "{ORDER_NUMBER}", and only there'
            raise InputError(path, f"columns[{number}].distributor", stated, expected)
    titles = [column.title for column in table.columns]
    twice = next((title for title in titles if titles.count(title) > 1), None)
    if twice is not None or not titles:
        raise InputError(path, "columns", twice or MISSING, "columns, each title once")
    return Layout(name, table.separator, table.columns)


@dataclass(frozen=True)
class _File(FileTable):
    format: Annotated[int, FIRST_FORMAT]
    columns: tuple[LayoutColumn, ...]
    separator: Annotated[str, _TEXT] = " "
    sources: Annotated[tuple[str, ...], lines("a list of where the columns are described")] = ()
