"""A bench's list of measured values: CSV, ``part,value[,tolerance][,board]`` (docs/spread.md).

    part,value,tolerance
    R203,10.02k,0.1%
    C1,"99.1 nF"
    U1A.offset,-1.3mV,50µV

Whatever is wrong with the file ends in an ``InputError`` that names its line.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

from designer.base.errors import InputError
from designer.base.guarded_reading import csv_rows, decode, read_bytes
from designer.base.schema import one_of
from designer.base.units import parse_quantity

_MOST_BYTES = 4_000_000
_COLUMNS = ("part", "value", "tolerance", "board")
_UNITS = (
    (re.compile(r"R[1-9]\d{0,3}[AB]?", re.ASCII), "Ω"),
    (re.compile(r"C[1-9]\d{0,3}[AB]?", re.ASCII), "F"),
    (re.compile(r"VR[1-9]\d{0,3}|VCC|VEE", re.ASCII), "V"),
    (re.compile(r"U[1-9]\d{0,3}[A-Z]\.(offset|low|high)", re.ASCII), "V"),
    (re.compile(r"U[1-9]\d{0,3}[A-Z]\.bias", re.ASCII), "A"),
    (re.compile(r"U[1-9]\d{0,3}[A-Z]\.gbw", re.ASCII), "Hz"),
)
_PARTS = "a part such as R203, C1, VR1, VCC, U1A.offset, U1A.high, U1A.low, U1A.bias or U1A.gbw"


@dataclass(frozen=True)
class MeasuredBoards:
    """Measured values of one board or several."""

    boards: tuple[str, ...]
    """The boards' names in the file's order; one without a name where there is no column for it."""
    values: Mapping[str, tuple[float, ...]]
    """(boards,) values by quantity, in SI units; nan where a board's was not measured."""
    tolerances: Mapping[str, tuple[float, ...]]
    """(boards,) half-widths by quantity, in the same units."""
    content: bytes = field(repr=False)
    """Content of the file, byte by byte."""
    source: Path | None = None
    """The file that it was read from."""
    lines: Mapping[str, int] = field(default_factory=dict)
    """Line on which each quantity first stands."""

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the boards; empty where the list is of one board without a name."""
        return () if self.boards == ("",) else self.boards

    @property
    def sha256(self) -> str:
        """Hash of the file."""
        return hashlib.sha256(self.content).hexdigest()

    def as_dict(self) -> dict[str, Any]:
        """What decides the boards; the values by the hash of their file."""
        return {"sha256": self.sha256, "boards": list(self.boards), "parts": sorted(self.values)}


def read_measured(path: Path) -> MeasuredBoards:
    """Read a list of measured values.

    Raises
    ------
    InputError : the file cannot be read, or anything in it is wrong.
    """
    content = read_bytes(path, "a list of measured values (CSV)", most=_MOST_BYTES)
    return _Reader(path, content).read(decode(content, path))


class _Reader:
    def __init__(self, path: Path, content: bytes) -> None:
        self.path, self.content = path, content
        self.row = 1

    def refuse(self, found: object, expected: str) -> NoReturn:
        raise InputError(self.path, f"line {self.row}", found, expected) from None

    def read(self, text: str) -> MeasuredBoards:
        entries: dict[tuple[str, str], tuple[float, float]] = {}
        lines: dict[str, int] = {}
        for cells in self.rows(text):
            name, board = cells["part"], cells.get("board", "")
            if not board and "board" in cells:
                self.refuse("no board", "the name of the board in each line")
            if (name, board) in entries:
                self.refuse(f"{name} a second time", "each part once" + " a board" * bool(board))
            unit = next((unit for form, unit in _UNITS if form.fullmatch(name)), None)
            if unit is None:
                self.refuse(name, _PARTS)
            value = self.number(cells["value"], unit)
            entries[name, board] = (value, self.tolerance(cells.get("tolerance", ""), unit, value))
            lines.setdefault(name, self.row)
        if not entries:
            self.refuse("no measured value", "a line for each part that was measured")
        boards = tuple(dict.fromkeys(board for _, board in entries))
        missing = (math.nan, 0.0)

        def column(which: int) -> dict[str, tuple[float, ...]]:
            return {n: tuple(entries.get((n, b), missing)[which] for b in boards) for n in lines}

        return MeasuredBoards(boards, column(0), column(1), self.content, self.path, lines)

    def rows(self, text: str) -> Iterator[dict[str, str]]:
        """Cells by column; ``row`` is the line of each while it is looked at."""
        rows = csv_rows(text, self.path)
        header = [cell.strip() for cell in next(rows, (1, []))[1]]
        for name in header:
            if name not in _COLUMNS:
                self.refuse(f"column {name!r}", one_of(name, _COLUMNS))
        if len(set(header)) < len(header) or not {"part", "value"} <= set(header):
            self.refuse(",".join(header), "columns part, value, and tolerance, board at will")
        for self.row, row in rows:
            if not any(cell.strip() for cell in row):
                continue
            if len(row) != len(header):
                self.refuse(f"{len(row)} cells", f"{len(header)}, as the header")
            yield dict(zip(header, (cell.strip() for cell in row), strict=True))

    def number(self, text: str, unit: str) -> float:
        try:
            return parse_quantity(text, unit)
        except ValueError as error:
            self.refuse(text, f"a value in {unit} ({error})")

    def tolerance(self, text: str, unit: str, value: float) -> float:
        """Half-width in the unit of the value, of a fraction, a percentage or a quantity."""
        expected = f'a fraction, "0.1%", or a quantity in {unit}'
        if not text:
            return 0.0
        try:
            if text.endswith("%"):
                width = abs(value) * float(text[:-1]) / 100.0
            elif text.endswith(unit):
                width = parse_quantity(text, unit)
            else:
                width = abs(value) * float(text)
        except ValueError:
            self.refuse(text, expected)
        if not 0.0 <= width < math.inf:
            self.refuse(text, f"{expected}, not below 0")
        return width
