"""The arrays of a ``.npy`` or ``.npz`` file, read without trust in what its headers say.

A header is a Python literal in ASCII: ``{'descr': …, 'fortran_order': …, 'shape': …}`` (NumPy
enhancement proposal 1). Only numbers are read, and only as many as the file holds; an archive is
unpacked as far as `MOST_BYTES`.
"""

from __future__ import annotations

import ast
import io
import math
import re
import struct
import warnings
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from designer.base.errors import InputError
from designer.base.guarded_reading import read_bytes, reading
from designer.workbench.scope_text import MOST_BYTES

MAGIC = b"\x93NUMPY"
LONGEST_HEADER = 1 << 14
"""Bytes."""
KIND = re.compile(r"[<>|=]?([fiu][1248]|f16|b1)")
"""Types of numbers."""
MOST_ARRAYS = 64
"""The most arrays of an archive."""
EXPECTED = "arrays of numbers, as NumPy writes them"
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
    content = read_bytes(path, EXPECTED, most=MOST_BYTES)
    if path.suffix.lower() == ".npz":
        with reading(path, EXPECTED):
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
                raise InputError(path, name, f"more than {MOST_BYTES} bytes", EXPECTED)
            out[name] = np.atleast_1d(_array(inside, path, name))
    return out


def _array(content: bytes, path: Path, name: str) -> np.ndarray[Any, Any]:
    """The array in the bytes of an ``.npy``."""
    with reading(path, EXPECTED, name):
        if content[:6] != MAGIC:
            raise InputError(path, name, "other bytes", EXPECTED)
        wide = content[6] > 1
        begin = 12 if wide else 10
        (length,) = struct.unpack("<I" if wide else "<H", content[8:begin])
        if length > min(LONGEST_HEADER, len(content) - begin):
            raise InputError(path, name, f"a header of {length} bytes", EXPECTED)
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
