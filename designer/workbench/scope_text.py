"""The text files of oscilloscopes: columns of numbers below a header of the maker's own.

Nothing here asks which maker it was. The lines in the middle of a file show how its cells are
separated and which columns hold numbers; the header is what stands above the first line that looks
like them, and beside them where a maker puts it there. What was seen in files:

- Rigol DS1000Z: ``X,CH1,CH2,Start,Increment,`` / ``Sequence,Volt,Volt,-5.99e-02,2e-05`` /
  ``0,4.72e+01,2.40e+00,`` (header quoted in github.com/vidavidorra/rigol-csv-analyser).
- Rigol MSO5000: ``Time(s),CH1(V)``, its times rounded so that many are equal; from memory
  ``CH1(V),CH2(V),t0 = -25s, tInc = 2e-06s,`` without a column of times.
- Siglent: ``Record Length,Analog:14000`` … ``Second,Volt,Volt``, the names in ``Source,CH1,CH2``
  (github.com/MartinCowen/SigFyCSV).
- Keysight and Agilent InfiniiVision: ``x-axis,1,2`` / ``second,Volt,Volt``; cells of the first rows
  may be empty (InfiniiVision 3000 X-Series User's Guide, "CSV and ASCII XY file structure").
- Tektronix TDS and TBS: words in the first three columns, the numbers beside them from the first
  line on; MSO and DPO: words, an empty line, ``TIME,CH1,CH2``.
- PicoScope 6 and 7: ``Time,Channel A,Channel B`` / ``(ms),(V),(mV)`` / an empty line; in other
  languages ``Zeit;Kanal A`` with decimal commas; also tab-delimited (PicoScope 6 User's Guide,
  "Text formats").
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
import pandas as pd

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.base.guarded_reading import read_bytes, reading

MOST_BYTES = 1 << 26
"""The most bytes of a file: a million and more samples of three channels."""
HEAD = 1 << 16
"""Characters in which a header has to end."""
MIDDLE = 1 << 13
"""Characters in the middle of a file that show what its lines look like."""
FEWEST_LINES = 5
"""Lines of numbers that follow each other where a header has ended."""
EXPECTED = "a record of an oscilloscope: a column of times and columns of volts"
# Digits are not given back: of a long cell that is no number each part would be tried again.
NUMBER = re.compile(r"[+-]?(\d++\.?\d*+|\.\d++)(e[+-]?\d++)?", re.IGNORECASE | re.ASCII)
COMMAS = str.maketrans({",": ".", ".": ","})
"""Turns decimal commas into points, so that a point there makes no number."""
OVERRANGE = re.compile(r"[+-]?(∞|inf(inity)?)", re.IGNORECASE)


@dataclass(frozen=True)
class TextColumns:
    """The columns of a text file that hold numbers, and the words about them."""

    values: Array
    """(k, c) the numbers."""
    places: tuple[int, ...]
    """(c,) where each column stands in the file, from 0."""
    header: tuple[tuple[str, ...], ...]
    """Cells of each line of the header; also of words that stand beside the numbers."""
    lines: tuple[int, ...]
    """(k,) number of each line of numbers, from 1."""


@dataclass(frozen=True)
class _Layout:
    """How a line is cut. delimiter : None where it is any white space. decimal : "." or ","."""

    delimiter: str | None
    decimal: str

    def cells(self, line: str) -> list[str]:
        if self.delimiter is None:
            return line.split()
        return [cell.strip() for cell in next(csv.reader([line], delimiter=self.delimiter), [])]

    def is_number(self, cell: str) -> bool:
        plain = cell.translate(COMMAS) if self.decimal == "," else cell
        return bool(NUMBER.fullmatch(plain) or OVERRANGE.fullmatch(plain))

    def value(self, cell: str) -> float:
        """The number of a cell that is one."""
        return float(cell.translate(COMMAS) if self.decimal == "," else cell)

    def places(self, lines: Sequence[str]) -> tuple[int, ...]:
        """Columns that hold a number in each of these lines."""
        rows = [[self.is_number(cell) for cell in self.cells(line)] for line in lines]
        fewest = min(map(len, rows), default=0)
        return tuple(k for k in range(fewest) if all(row[k] for row in rows))

    def is_data(self, line: str, places: Sequence[int]) -> bool:
        """Whether a line has numbers in these columns; but for the first they may be empty."""
        cells = self.cells(line)
        if len(cells) <= places[0] or not self.is_number(cells[places[0]]):
            return False
        others = [cells[k] for k in places[1:] if k < len(cells)]
        return all(not cell or self.is_number(cell) for cell in others)


def read_columns(path: Path) -> TextColumns:
    """The columns of numbers of a text file.

    Raises
    ------
    InputError : no text, no columns of numbers, or a line among them that has something else: names
        the line, what was found there and what was expected.
    """
    content = read_bytes(path, EXPECTED, most=MOST_BYTES)
    with reading(path, EXPECTED):
        return _columns_of(_decoded(content, path), path)


def _columns_of(text: str, path: Path) -> TextColumns:
    """The columns of a text."""
    middle = _middle(text)
    if not middle:
        found = "a line without end" if text.strip() else "nothing in it"
        raise InputError(path, "the file", found, EXPECTED)
    layout = _layout(middle)
    places = layout.places(middle)
    if not places:
        raise InputError(path, "a line in the middle", middle[0].strip(), EXPECTED)
    head = text[:HEAD].split("\n")
    first = _first_line(head, layout, places)
    if first is None:
        found = head[0].strip() if head else ""
        raise InputError(path, "line 1", found, "a header of at most 64 kB and numbers below it")
    values, begin = _numbers(text, first, layout, places, path)
    header = [*head[:first], *_beside(head[first:], layout, places)]
    cells = tuple(tuple(layout.cells(line.lstrip("#% "))) for line in header)
    filled = (k for k, line in enumerate(text.split("\n"), 1) if k > first and line.strip())
    return TextColumns(values, places, cells, tuple(islice(filled, begin, begin + len(values))))


def _decoded(content: bytes, path: Path) -> str:
    """Text in UTF-8, in UTF-16 with a mark, or else in Latin 1 (the µ of older scopes), whose lines
    end in a line feed: a lone carriage return is the end of a line too."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = content.decode("utf-16")
    elif b"\0" in content:
        raise InputError(path, "the file", "bytes that are no text", f"text: {EXPECTED}")
    else:
        try:
            text = content.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = content.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _middle(text: str) -> list[str]:
    """Whole lines from the middle of a text, those without anything left out."""
    if len(text) <= 2 * MIDDLE:
        lines = [line for line in text.split("\n") if line.strip()]
        return lines[len(lines) // 2 :]
    start = (len(text) - MIDDLE) // 2
    lines = text[start : start + MIDDLE].split("\n")[1:-1]
    return [line for line in lines if line.strip()]


def _layout(lines: Sequence[str]) -> _Layout:
    """The way to cut these lines that makes the most of their cells numbers of the most columns."""
    ways = [
        _Layout(delimiter, decimal)
        for delimiter, decimal in ((";", ","), (";", "."), ("\t", ","), ("\t", "."), (",", "."))
    ]
    ways += [_Layout(None, "."), _Layout(None, ",")]
    return max(ways, key=lambda way: (len(way.places(lines)), way.delimiter is not None))


def _first_line(head: Sequence[str], layout: _Layout, places: Sequence[int]) -> int | None:
    """Index of the line from which on the lines are numbers, as far as the eye reaches."""
    for first, line in enumerate(head):
        if layout.is_data(line, places):
            following = (head[k] for k in range(first, len(head)) if head[k].strip())
            if all(layout.is_data(each, places) for each in islice(following, FEWEST_LINES)):
                return first
    return None


def _beside(lines: Sequence[str], layout: _Layout, places: Sequence[int]) -> list[str]:
    """Lines of numbers that begin with words in columns of their own."""
    if places[0] == 0:
        return []
    return [line for line in lines if layout.cells(line)[:1] not in ([], [""])]


def _numbers(
    text: str, first: int, layout: _Layout, places: Sequence[int], path: Path
) -> tuple[Array, int]:
    """(k, c) the numbers, and how many rows before them are left out; rows that are not whole are,
    at both ends."""
    try:
        frame = pd.read_csv(
            io.StringIO(text),
            sep=layout.delimiter or r"\s+",
            decimal=layout.decimal,
            header=None,
            skiprows=first,
            usecols=list(places),
            dtype=np.float64,
            skipinitialspace=True,
        )
    except ValueError:  # of a cell that is no number, and of a line that is longer than the others
        raise _first_fault(text, first, layout, places, path) from None
    values = frame.to_numpy()
    whole = np.isfinite(values).all(axis=1)
    inside = np.flatnonzero(whole)
    if not len(inside):
        raise _first_fault(text, first, layout, places, path)
    begin, end = int(inside[0]), int(inside[-1]) + 1
    if not whole[begin:end].all() or np.isinf(values).any():
        raise _first_fault(text, first, layout, places, path, skip=begin)
    return np.ascontiguousarray(values[begin:end]), begin


def _first_fault(
    text: str, first: int, layout: _Layout, places: Sequence[int], path: Path, skip: int = 0
) -> InputError:
    """What the message about the first line says that is not one of numbers. skip : lines of
    numbers at the start whose cells may be empty."""
    rows = (
        (number, line)
        for number, line in enumerate(io.StringIO(text), start=1)
        if number > first and line.strip()
    )
    expected = f"numbers in {_columns(places)}"
    for count, (number, line) in enumerate(rows):
        cells = layout.cells(line)
        for place in places:
            cell = cells[place] if place < len(cells) else ""
            if OVERRANGE.fullmatch(cell):
                expected = "volts within the range of the channel: record with a larger range"
                return InputError(path, f"line {number}", cell, expected)
            if not layout.is_number(cell) and (cell or count >= skip):
                return InputError(path, f"line {number}", line.strip() or "nothing", expected)
            if cell and math.isinf(layout.value(cell)):
                return InputError(path, f"line {number}", cell, "numbers that an oscilloscope has")
    return InputError(path, f"line {first + 1}", "lines of different lengths", expected)


def _columns(places: Iterable[int]) -> str:
    return "column " + ", ".join(str(place + 1) for place in places)
