"""The one guard of every reader: what cannot be read, or is something else, is an ``InputError``.

Files come from other people, other versions and damaged disks. A reader takes their bytes with
``read_bytes`` or ``read_text``, their values with ``parse_json`` or ``csv_rows``, and does the rest
inside ``reading``. Then a missing file, a folder in its place, other bytes, a cut-off end, values
nested without end, numbers too long or not finite and values of another type all end in a message
that names the file, the field, what was found and what was expected.
"""

from __future__ import annotations

import contextlib
import csv
import io
import json
import math
import stat
import struct
import tokenize
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn
from zipfile import BadZipFile

from designer.base.errors import MISSING, InputError

UNREADABLE = (
    OSError,
    ValueError,  # also undecodable text, JSON and integers of too many digits
    LookupError,
    TypeError,
    AttributeError,
    ArithmeticError,
    EOFError,
    MemoryError,  # a damaged size
    RuntimeError,  # also values nested too deeply, and archives in a way that is not there
    SyntaxError,
    BadZipFile,
    zlib.error,
    struct.error,
    csv.Error,
    tokenize.TokenError,  # of NumPy, on the header of an array
)
"""What Python and its libraries raise on files that are not what they ought to be."""
MOST_DIGITS = 300
"""Digits of an integer: one more would not fit into a float."""


@contextlib.contextmanager
def reading(file: Path | str | None, expected: str, field: str = "the file") -> Iterator[None]:
    """A block that reads a file; what goes wrong in it is the file's fault.

    file, field, expected : of the message.

    Raises
    ------
    InputError : any of ``UNREADABLE`` in the block; one that is raised in it passes.
    """
    try:
        yield
    except UNREADABLE as error:
        problem = MISSING if isinstance(error, FileNotFoundError) else reason(error)
        raise InputError(file, field, problem, expected) from None


def read_bytes(
    path: Path, expected: str, field: str = "the file", most: int | None = None
) -> bytes:
    """The content of a regular file of at most ``most`` bytes.

    Raises
    ------
    InputError : there is none, it is larger, or it is a folder or a device.
    """
    with reading(path, expected, field):
        mode = path.stat().st_mode
        if not stat.S_ISREG(mode):
            kind = "a folder" if stat.S_ISDIR(mode) else "no regular file"
            raise InputError(path, field, kind, expected)
        with path.open("rb") as stream:
            content = stream.read(-1 if most is None else most + 1)
    if most is not None and len(content) > most:
        raise InputError(path, field, f"more than {most} bytes", expected)
    return content


def decode(content: bytes, file: Path | str | None) -> str:
    """Text in UTF-8, without a byte order mark.

    Raises
    ------
    InputError : names the line of the first byte that is none.
    """
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        row = content[: error.start].count(b"\n") + 1
        raise InputError(
            file, f"line {row}", f"byte 0x{content[error.start]:02x}", "text in UTF-8"
        ) from None


def read_text(path: Path, expected: str, field: str = "the file", most: int | None = None) -> str:
    """The text of a regular file, in UTF-8; InputError as of ``read_bytes`` and ``decode``."""
    return decode(read_bytes(path, expected, field, most), path)


def parse_json(
    content: bytes | str, file: Path | str | None, expected: str = "JSON", field: str = "the file"
) -> Any:
    """The value of a strict JSON text.

    Raises
    ------
    InputError : it is none, or holds a number that is not finite or too long, or is nested too
        deeply.
    """
    with reading(file, expected, field):
        text = content if isinstance(content, str) else decode(content, file)
        return json.loads(text, parse_constant=_no_number, parse_float=_finite, parse_int=_integer)


def csv_rows(text: str, file: Path | str | None) -> Iterator[tuple[int, list[str]]]:
    """Rows of a CSV text, each with the number of its last line, from 1.

    Raises
    ------
    InputError : it is no CSV, or a cell is too long; names the line.
    """
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        for row in reader:
            yield reader.line_num, row
    except csv.Error as error:
        raise InputError(file, f"line {reader.line_num}", str(error), "a CSV file") from None


def inside(folder: Path, name: str, field: str) -> Path:
    """The file of this name in a folder.

    Raises
    ------
    InputError : no file, or not inside the folder (symbolic links count as outside); ``field`` is
        where the name was found.
    """
    expected = f"a file inside {folder}, no symbolic link"
    relative, root = Path(name), folder.resolve()
    path = root / relative
    outside = relative.is_absolute() or not relative.parts or ".." in relative.parts
    if outside or path.resolve() != path:
        raise InputError(None, field, name, expected)
    if not path.exists():
        raise InputError(None, field, f"{name}, which does not exist", f"a file in {folder}")
    if not path.is_file():
        raise InputError(None, field, name, expected)
    return path


def reason(error: BaseException) -> str:
    """What went wrong, in words for the writer of a file."""
    if isinstance(error, UnicodeError):
        return "bytes that are no text in UTF-8"
    if isinstance(error, OSError):
        return error.strerror or str(error) or "unreadable"
    if isinstance(error, RecursionError):
        return "values nested too deeply"
    if isinstance(error, MemoryError):
        return "a size that does not fit into memory"
    if isinstance(error, KeyError):
        return f"no {error.args[0]!r}" if error.args else "a name that is missing"
    text = "" if isinstance(error, tokenize.TokenError) else str(error)
    if "integer string conversion" in text:
        return "a number of too many digits"
    return text or type(error).__name__


def _no_number(text: str) -> NoReturn:
    raise ValueError(f"{text}, no finite number")


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text[:40]}, too large a number")
    return value


def _integer(text: str) -> int:
    if len(text) > MOST_DIGITS:
        raise ValueError("a number of too many digits")
    return int(text)
