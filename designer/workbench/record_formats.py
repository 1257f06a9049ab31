"""A record from a file: text of any oscilloscope, or arrays of NumPy.

A ``.npy`` or ``.npz`` file is read without trust in what its headers say. A header is a Python
literal in ASCII: ``{'descr': …, 'fortran_order': …, 'shape': …}`` (NumPy enhancement proposal 1).
Only numbers are read, and only as many as the file holds; an archive is unpacked as far as
`MOST_BYTES`.
"""

from __future__ import annotations

import ast
import io
import math
import re
import struct
import warnings
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import MISSING, InputError
from designer.base.guarded_reading import read_bytes, reading
from designer.workbench.record import Record
from designer.workbench.scope_text import EXPECTED, MOST_BYTES, NUMBER, TextColumns, read_columns

MAGIC = b"\x93NUMPY"
LONGEST_HEADER = 1 << 14
"""Bytes."""
KIND = re.compile(r"[<>|=]?([fiu][1248]|f16|b1)")
"""Types of numbers."""
MOST_ARRAYS = 64
"""The most arrays of an archive."""
ARRAYS_EXPECTED = "arrays of numbers, as NumPy writes them"
PACKED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


def stored_arrays(path: Path) -> dict[str, np.ndarray[Any, Any]]:
    """The arrays of a file by their names.

    A table (k, c) of an ``.npy`` has its columns as "time", "column 2", …; one with named fields
    has those.

    Raises
    ------
    InputError : it is no such file, is damaged, says that it holds more than it does, or holds
        more than `MOST_BYTES`; names the array.
    """
    content = read_bytes(path, ARRAYS_EXPECTED, most=MOST_BYTES)
    if path.suffix.lower() == ".npz":
        with reading(path, ARRAYS_EXPECTED):
            return _unpacked(content, path)
    array = _array(content, path, "the file")
    if array.dtype.names:
        return {name: array[name].ravel() for name in array.dtype.names}
    if array.ndim > 2 or array.size == 0:
        raise InputError(path, "the file", f"shape {array.shape}", "a table (k, c)")
    table = np.atleast_2d(array)
    table = table if table.shape[0] >= table.shape[1] else table.T
    if table.shape[1] > MOST_ARRAYS:
        raise InputError(path, "its columns", table.shape[1], f"at most {MOST_ARRAYS}")
    return {"time" if k == 0 else f"column {k + 1}": c for k, c in enumerate(table.T)}


def _unpacked(content: bytes, path: Path) -> dict[str, np.ndarray[Any, Any]]:
    """The arrays of an archive."""
    out: dict[str, np.ndarray[Any, Any]] = {}
    left = MOST_BYTES
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = archive.infolist()
        if len(members) > MOST_ARRAYS:
            raise InputError(path, "its arrays", len(members), f"at most {MOST_ARRAYS}")
        for member in members:
            name = member.filename.removesuffix(".npy")
            if member.compress_type not in PACKED:
                raise InputError(path, name, f"compression {member.compress_type}", "deflate")
            with archive.open(member) as stream:
                inside = stream.read(left + 1)
            left -= len(inside)
            if left < 0:
                raise InputError(path, name, f"more than {MOST_BYTES} bytes", ARRAYS_EXPECTED)
            out[name] = np.atleast_1d(_array(inside, path, name))
    return out


def _array(content: bytes, path: Path, name: str) -> np.ndarray[Any, Any]:
    """The array in the bytes of an ``.npy``."""
    with reading(path, ARRAYS_EXPECTED, name):
        if content[:6] != MAGIC:
            raise InputError(path, name, "other bytes", ARRAYS_EXPECTED)
        wide = content[6] > 1
        begin = 12 if wide else 10
        (length,) = struct.unpack("<I" if wide else "<H", content[8:begin])
        if length > min(LONGEST_HEADER, len(content) - begin):
            raise InputError(path, name, f"a header of {length} bytes", ARRAYS_EXPECTED)
        with warnings.catch_warnings():  # of escapes in the text of a damaged header
            warnings.simplefilter("ignore")
            header = ast.literal_eval(content[begin : begin + length].decode("utf-8").strip())
        shape, dtype = _shape(header), _dtype(header["descr"])
        count, room = math.prod(shape), len(content) - begin - length
        if count * dtype.itemsize > room:
            found = f"{room} bytes for {count} values of {dtype.itemsize}"
            raise InputError(path, name, found, "as many values as its header says")
        values = np.frombuffer(content, dtype, count, begin + length)
        return values.reshape(shape, order="F" if header["fortran_order"] is True else "C")


def _shape(header: dict[str, Any]) -> tuple[int, ...]:
    shape = header["shape"]
    if not isinstance(shape, tuple) or not all(type(n) is int and n >= 0 for n in shape):
        raise ValueError(f"shape {shape!r}")
    return shape


def _dtype(descr: Any) -> np.dtype[Any]:
    """The type of an array of numbers, or of named fields that are numbers."""
    fields = [("", descr)] if isinstance(descr, str) else [(name, kind) for name, kind in descr]
    if not fields:
        raise ValueError("values without fields")
    for name, kind in fields:
        if not isinstance(name, str) or not isinstance(kind, str) or not KIND.fullmatch(kind):
            raise ValueError(f"values of type {kind!r}")
    dtype: np.dtype[Any] = np.dtype(descr)
    return dtype


FEWEST_SAMPLES, MOST_SAMPLES = 100, 1 << 21
"""Fewer show no motion; more tell nothing that these do not."""
MOST_CHANNELS = 16
"""The most channels of an oscilloscope."""
LONGEST_NAME = 200
"""Characters of a column's name in a text; the rest is left out."""
MOST_VOLTS, MOST_SECONDS = 1e6, 1e9
"""What a probe is put to, and how long one waits for a record."""
STEPS = (1e-12, 1e3)
"""The least and the greatest time from one sample to the next [s]."""
FARTHEST = 1e11
"""Steps of the first time from 0: a float then has it to a thousandth of a step or better."""
TIME_NAMES = re.compile(r"(time|zeit|temps|tiempo|tempo|x-axis|x|t|s|seconds?)", re.IGNORECASE)
COUNT_NAMES = re.compile(r"(x|sequence|sample|index|nr|no|n|#)", re.IGNORECASE)
UNITS: Mapping[str, tuple[str, float]] = {
    **dict.fromkeys(("s", "sec", "second", "seconds", "sekunden", "secondes"), ("s", 1.0)),
    "ms": ("s", 1e-3),
    **dict.fromkeys(("us", "µs", "μs"), ("s", 1e-06)),
    "ns": ("s", 1e-9),
    "ps": ("s", 1e-12),
    **dict.fromkeys(("v", "volt", "volts", "value"), ("V", 1.0)),
    "mv": ("V", 1e-3),
    **dict.fromkeys(("uv", "µv", "μv"), ("V", 1e-06)),
    "kv": ("V", 1e3),
    "sequence": ("count", 1.0),
}
"""What is measured, and in how much of its SI unit, by the words of scopes in lower case."""
KINDS = (
    (r"increment|tinc\s*=|time\(s\)\|ch\d", "Rigol CSV"),
    (r"x-axis", "Keysight CSV"),
    (r"analog:|second\|val|second\|volt", "Siglent CSV"),
    (r"yzero|time\|ch\d|vertical units", "Tektronix CSV"),
    (r"(channel|kanal|canal|voie|canale) [a-h]\b", "PicoScope CSV"),
)
"""Formats by what their headers have, in lower case with "|" between cells: the first that fits."""
ARRAYS: Mapping[str, tuple[str, Callable[[Path], Mapping[str, Array]]]] = {
    ".npy": ("NumPy", stored_arrays),
    ".npz": ("NumPy", stored_arrays),
}
"""By the end of a file's name: the format, and what reads its arrays by their names."""
UNEVEN = 0.75
"""How far a time may be off, over the step or over the digits that the times are written with."""


@dataclass(frozen=True)
class _Column:
    """A column of a table. measure : "s", "V", "count" or "" where nothing says it."""

    name: str
    measure: str
    values: Array


def read_record(path: Path | str) -> Record:
    """The record in a file: CSV of an oscilloscope, ``.npy``, ``.npz`` or plain columns.

    An ``.npy`` is an array (k, c) whose first column is the time [s], or one with named fields; an
    ``.npz`` has a named array (k,) for each channel and ``time`` (or ``t``), or ``Tstart`` and
    ``Tinterval`` as PicoScope writes them.

    Raises
    ------
    InputError : the file is none of these, its times are not at equal intervals, or it is shorter
        than `FEWEST_SAMPLES`; names file, line or array, found and expected.
    """
    path = Path(path)
    if (arrays := ARRAYS.get(path.suffix.lower())) is not None:
        return _of_arrays(path, *arrays)
    columns = read_columns(path)
    named = _named(columns, path)
    start, interval = _increments(columns.header)
    return _record(path, named, start, interval, _kind(columns.header), columns.lines)


def _record(
    path: Path,
    columns: Sequence[_Column],
    start: float | None,
    interval: float | None,
    kind: str,
    lines: Sequence[int] = (),
) -> Record:
    """The record of these columns. start, interval : of the times [s], where the header says them;
    lines : of the file where the numbers stand."""
    times = [c for c in columns if c.measure == "s"]
    voltages = [c for c in columns if c.measure in ("V", "")]
    if not times and interval is None:
        raise InputError(path, "its times", MISSING, "a column of times, or their step in a header")
    if not voltages:
        raise InputError(path, "its channels", MISSING, "a column of volts beside the times")
    if len(voltages) > MOST_CHANNELS:
        raise InputError(path, "its channels", len(voltages), f"at most {MOST_CHANNELS}")
    count = len(columns[0].values)
    if not FEWEST_SAMPLES <= count <= MOST_SAMPLES:
        expected = f"at least {FEWEST_SAMPLES} and at most {MOST_SAMPLES}"
        raise InputError(path, "its samples", count, expected)
    for column in columns:
        limit, unit = (MOST_SECONDS, "s") if column.measure == "s" else (MOST_VOLTS, "V")
        wrong = np.flatnonzero(~(np.abs(column.values) <= limit))
        if len(wrong) and column.measure != "count":
            bad = int(wrong[0])
            found, expected = f"{column.values[bad]:.6g} {unit}", f"at most {limit:g} {unit}"
            raise InputError(path, f"{column.name}, {_place(bad, lines)}", found, expected)
    steps = np.arange(count, dtype=np.float64)
    time = (start or 0.0) + (interval or 0.0) * steps
    if times:
        time = _even(times[0].values, path, lines)
    _check_times(path, time, interval if not times else None)
    return Record(time, {c.name: c.values for c in voltages}, path.name, kind)


def _place(sample: int, lines: Sequence[int]) -> str:
    """Where a sample stands in the file."""
    return f"line {lines[sample]}" if sample < len(lines) else f"sample {sample}"


def _even(times: Array, path: Path, lines: Sequence[int]) -> Array:
    """(k,) equal steps through these times.

    Scopes write times with few digits: a step may be smaller than the last of them.
    """
    k = np.arange(len(times))
    step, begin = np.polyfit(k, times, 1)
    gaps = np.abs(np.diff(times))
    digit = float(gaps[gaps > 0.0].min()) if (gaps > 0.0).any() else 0.0
    allowed = UNEVEN * max(abs(float(step)), digit)
    off = np.abs(times - begin - step * k)
    rises = step > 0.0 and times[-1] > times[0]
    if not rises or float(off.max()) > allowed:
        worst = int(np.argmax(off)) if rises else int(np.argmax(np.diff(times) <= 0.0)) + 1
        expected = "times at equal steps: one record without gaps, not segments one after the other"
        raise InputError(path, _place(worst, lines), f"{times[worst]:.9g} s", expected)
    return np.asarray(begin + step * k)


def _check_times(path: Path, time: Array, stated: float | None) -> None:
    """InputError for steps that no oscilloscope has, or that the digits of a number do not hold.
    stated : the step that a header says [s]."""
    step = float(time[-1] - time[0]) / (len(time) - 1) if stated is None else stated
    low, high = STEPS
    if not low <= step <= high:
        expected = f"from {low:g} s to {high:g} s"
        raise InputError(path, "the step of its times", f"{step:.6g} s", expected)
    first = float(time[0])
    if not abs(first) <= FARTHEST * step:
        expected = f"within {FARTHEST:g} steps of {step:.3g} s from 0"
        raise InputError(path, "its first time", f"{first:.6g} s", expected)


# -- text -------------------------------------------------------------------------------------


def _named(columns: TextColumns, path: Path) -> list[_Column]:
    """The columns with their names, in volts and seconds, by the words of the header."""
    names, units = _words(columns)
    found, taken = [], set()
    for k, place in enumerate(columns.places):
        name, unit = names[k], units[k] or _unit_in(names[k])
        measure, factor = _measure(unit, path)
        plain = re.sub(r"\s*[(\[].*[)\]]\s*", "", name).strip()
        if not measure and COUNT_NAMES.fullmatch(plain) and _counts(columns.values[:, k]):
            measure = "count"
        elif not measure and TIME_NAMES.fullmatch(plain):
            measure = "s"
        label = plain or f"column {place + 1}"
        label = label if label not in taken else f"{label} in column {place + 1}"
        taken.add(label)
        found.append(_Column(label, measure, columns.values[:, k] * factor))
    first = found[0]
    has_time = any(c.measure in ("s", "count") for c in found)
    if not has_time and len(found) > 1 and bool((np.diff(first.values) > 0.0).all()):
        found[0] = _Column(first.name, "s", first.values)
    return found


def _counts(values: Array) -> bool:
    """Whether a column numbers its rows."""
    return bool((np.diff(values) == 1.0).all())


def _words(columns: TextColumns) -> tuple[list[str], list[str]]:
    """Name and unit of each column, "" where the header has none."""
    width = len(columns.places)
    names, units = [""] * width, [""] * width
    for cells in columns.header:
        row = [cells[k][:LONGEST_NAME] if k < len(cells) else "" for k in columns.places]
        if not all(row) or any(NUMBER.fullmatch(cell) for cell in row[:1]):
            continue
        if _bare(row[0]) in UNITS:
            units = row
        else:
            names = row
    source = next((c[1:] for c in columns.header if c[:1] and c[0].lower() == "source"), ())
    if source and (not any(names) or names[0].lower() == "source"):
        named = (cell[:LONGEST_NAME] for cell in source)
        channels = [cell for cell in named if cell and not NUMBER.fullmatch(cell)]
        names = ["", *channels, *([""] * width)][:width]
    return names, units


def _bare(word: str) -> str:
    return word.strip().strip("()[]").strip().lower()


def _unit_in(name: str) -> str:
    """The unit that stands in brackets in a name."""
    found = re.search(r"[(\[]([^)\]]*)[)\]]", name)
    return found[1] if found else ""


def _measure(unit: str, path: Path) -> tuple[str, float]:
    """What is measured and the factor to its SI unit; "" without a unit."""
    if not unit:
        return "", 1.0
    if _bare(unit) not in UNITS:
        raise InputError(path, "the unit of a column", unit, "volts (V, mV, …) or seconds")
    return UNITS[_bare(unit)]


def _increments(header: Iterable[Sequence[str]]) -> tuple[float | None, float | None]:
    """First time and step [s] where the header says them beside the columns."""
    rows = [list(cells) for cells in header]
    text = "|".join(cell for cells in rows for cell in cells)
    start = re.search(r"\bt0\s*=\s*([-+.\de]+)", text, re.IGNORECASE)
    step = re.search(r"\btinc\s*=\s*([-+.\de]+)", text, re.IGNORECASE)
    for above, below in pairwise(rows):
        if "Increment" in above and "Start" in above:
            values = dict(zip(above, below, strict=False))
            return _number(values.get("Start", "")), _number(values.get("Increment", ""))
    return _number(start[1] if start else ""), _number(step[1] if step else "")


def _number(cell: str) -> float | None:
    value = float(cell) if NUMBER.fullmatch(cell) else math.nan
    return value if math.isfinite(value) else None


def _kind(header: Iterable[Sequence[str]]) -> str:
    text = "|".join(cell.lower() for cells in header for cell in cells)
    return next((kind for pattern, kind in KINDS if re.search(pattern, text)), "columns")


# -- arrays -----------------------------------------------------------------------------------


def _of_arrays(path: Path, kind: str, read: Callable[[Path], Mapping[str, Array]]) -> Record:
    arrays = {name: _floats(values) for name, values in read(path).items()}
    start, interval = (_single(arrays, name, path) for name in ("Tstart", "Tinterval"))
    arrays.pop("Length", None)
    return _record(path, _checked(arrays, path), start, interval, kind)


def _floats(values: Array) -> Array:
    """The numbers as floats; what is too large for one is infinite."""
    with np.errstate(over="ignore", invalid="ignore"):
        return np.asarray(values, dtype=np.float64)


def _single(arrays: dict[str, Any], name: str, path: Path) -> float | None:
    """A named number, taken out of the arrays."""
    if name not in arrays:
        return None
    values = arrays.pop(name).ravel()
    if len(values) != 1 or not np.isfinite(values[0]):
        found = f"{values[0]:g}" if len(values) == 1 else f"{len(values)} numbers"
        raise InputError(path, name, found, "one finite number of seconds")
    return float(values[0])


def _checked(arrays: Mapping[str, Array], path: Path) -> list[_Column]:
    """Named arrays as columns of one length and finite numbers."""
    if not arrays:
        raise InputError(path, "its arrays", MISSING, EXPECTED)
    count = max(values.size for values in arrays.values())
    for name, values in arrays.items():
        if values.shape != (count,):
            raise InputError(path, name, f"shape {values.shape}", f"({count},), as the longest")
        if not np.isfinite(values).all():
            bad = int(np.flatnonzero(~np.isfinite(values))[0])
            raise InputError(path, f"{name}[{bad}]", float(values[bad]), "a finite number")
    return [
        _Column(name, "s" if name.lower() in ("t", "time") else "V", values)
        for name, values in arrays.items()
    ]
