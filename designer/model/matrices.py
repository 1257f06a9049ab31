"""A linear part that is given by its matrices: the table ``[matrices]`` of ``format = 2``.

Such as a finite-element model or a measurement gives it. A matrix is written out, row by row, or
named by a NumPy file beside the model file, which is written out when the file is read: the text
then says everything.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.base.guarded_reading import UNREADABLE, inside, reason
from designer.base.schema import Accepts, FileTable
from designer.base.units import parse_quantity
from designer.laws.element_keys import NAME

Rows = tuple[tuple[float, ...], ...]
LARGEST = 64
"""Rows of a matrix that is read: many more than masses that a system may have."""
ALIKE = 1e-9
"""Of the largest entry: two entries that differ by less are one."""
_HEADER = re.compile(r"\s*\[+\s*([A-Za-z0-9_]+)\s*\]+\s*(?:#.*)?")
_NAMED = re.compile(r"""(\s*(?:mass|damping|stiffness)\s*=\s*)(["'])([^"']*)\2(\s*(?:#.*)?)""")


def _names() -> Accepts:
    expected = 'a list of the masses\' names, such as ["tip", "middle"]'

    def check(value: object) -> tuple[str, ...]:
        if not isinstance(value, list) or not value:
            raise ValueError
        return tuple(NAME.check(each) for each in value)

    json = {"type": "array", "items": NAME.json, "minItems": 1}
    return Accepts(expected, check, json=json)


def _rows(*, diagonal: bool = False) -> Accepts:
    expected = "a matrix, a list of its rows such as [[2.0, -1.0], [-1.0, 2.0]]"
    if diagonal:
        expected += ", or the list of its diagonal"
    expected += ', or the name of a NumPy file beside the model file, such as "stiffness.npy"'

    def check(value: object) -> Rows:
        if not isinstance(value, list) or not value:
            raise ValueError
        if len(value) > LARGEST:  # before a diagonal is filled up
            raise ValueError(f"at most {LARGEST} rows")
        flat = diagonal and not any(isinstance(row, list) for row in value)
        size = range(len(value))
        rows = (
            [[x if i == j else 0.0 for j in size] for i, x in enumerate(value)] if flat else value
        )
        if not all(isinstance(row, list) and len(row) == len(value) for row in rows):
            raise ValueError("as many rows as columns")
        for entry in (entry for row in rows for entry in row):
            if isinstance(entry, bool) or not isinstance(entry, int | float):
                raise ValueError("numbers, in the file's own units")
        return tuple(tuple(parse_quantity(entry, "") for entry in row) for row in rows)

    row = {"type": "array", "items": {"type": "number"}}
    items = {"anyOf": [row, {"type": "number"}]} if diagonal else row
    json = {"anyOf": [{"type": "array", "items": items}, {"type": "string"}]}
    return Accepts(expected, check, json=json)


@dataclass(frozen=True)
class Matrices(FileTable):
    """Mass, damping and stiffness matrix of a system, in the place of masses, springs and dampers.

    Rows and columns are displacements from ground, in the order of ``names``.
    """

    names: Annotated[tuple[str, ...], _names()]
    """Names of the masses."""
    mass: Annotated[Rows, _rows(diagonal=True)]
    """Mass matrix."""
    stiffness: Annotated[Rows, _rows()]
    """Stiffness matrix."""
    damping: Annotated[Rows, _rows()]
    """Damping matrix, with gyroscopic terms or without."""

    def __post_init__(self) -> None:
        for key in ("mass", "stiffness"):
            object.__setattr__(self, key, _symmetric(getattr(self, key)))

    def check(self) -> None:
        """Refuse what is no linear part of a mechanical system.

        Raises
        ------
        InputError : a matrix of another size, one that is not symmetric, a mass matrix that is not
            positive definite.
        """
        for key in ("mass", "stiffness", "damping"):
            matrix = np.array(getattr(self, key))
            field = f"matrices.{key}"
            if len(matrix) != len(self.names):
                text = f"{len(matrix)} rows"
                raise InputError(None, field, text, f"{len(self.names)}, one for each of names")
            off = np.abs(matrix - matrix.T)
            if key != "damping" and off.max() > 0.0:
                i, j = (int(k) for k in np.unravel_index(np.argmax(off), off.shape))
                text = f"{matrix[i, j]:g} and {matrix[j, i]:g} across the diagonal"
                raise InputError(None, field, text, f"a symmetric matrix (row {i + 1})")
        if not np.linalg.eigvalsh(self.mass_matrix)[0] > 0.0:
            expected = "a positive definite matrix: every motion has a mass"
            raise InputError(None, "matrices.mass", "a motion without mass", expected)

    @property
    def mass_matrix(self) -> Array:
        """(n, n) mass matrix, symmetric to the last digit."""
        return np.array(self.mass)

    @property
    def stiffness_matrix(self) -> Array:
        """(n, n) stiffness matrix, symmetric to the last digit."""
        return np.array(self.stiffness)

    @property
    def damping_matrix(self) -> Array:
        """(n, n) damping matrix."""
        return np.array(self.damping)

    @property
    def entries(self) -> Iterator[tuple[str, str, str, tuple[int, int]]]:
        """(matrix, name of the row, of the column, indices) of every entry that may differ from the
        others: of mass and stiffness those on and above the diagonal."""
        for key in ("mass", "damping", "stiffness"):
            for i, name in enumerate(self.names):
                for j, other in enumerate(self.names):
                    if j >= i or key == "damping":
                        yield key, name, other, (i, j)

    @property
    def coupled(self) -> Iterator[tuple[str, str]]:
        """The pairs of masses that an entry of one of the matrices couples."""
        for matrix in (self.mass, self.stiffness, self.damping):
            for name, row in zip(self.names, matrix, strict=False):
                there = zip(self.names, row, strict=False)
                yield from ((name, other) for other, entry in there if entry and other != name)

    def joints(self, matrix: Array, ground: str) -> Iterator[tuple[tuple[str, str], float]]:
        """What joins two masses, or a mass and ``ground``, and by how much: the springs, or
        dampers, that make a symmetric matrix. Its asymmetric part joins nothing."""
        even = 0.5 * (matrix + matrix.T)
        small = ALIKE * float(np.abs(even).max())
        for i, name in enumerate(self.names):
            if abs(even[i].sum()) > small:
                yield (name, ground), float(even[i].sum())
            for j in range(i):
                if abs(even[i, j]) > small:
                    yield (name, self.names[j]), -float(even[i, j])


def _symmetric(rows: Rows) -> Rows:
    """With the mean of entries that are alike across the diagonal; as it stands if some are not."""
    matrix = np.array(rows)
    with np.errstate(over="ignore"):  # sizes are looked at later
        off = np.abs(matrix - matrix.T).max()
    if off > ALIKE * np.abs(matrix).max():
        return rows
    mean = matrix + 0.5 * (matrix.T - matrix)
    even = np.triu(mean) + np.triu(mean, 1).T
    return tuple(tuple(row) for row in even.tolist())


def written_out(text: str, folder: Path) -> str:
    """The text of a model file with the NumPy files that [matrices] names in the place of their
    names.

    Raises
    ------
    InputError : a file that is not there, lies outside the folder, or holds no matrix.
    """
    table, lines = "", list[str]()
    for line in text.splitlines(keepends=True):
        bare = line.rstrip("\r\n")
        if header := _HEADER.fullmatch(bare):
            table = header[1]
        named = _NAMED.fullmatch(bare) if table == "matrices" else None
        if named is not None:
            matrix = _read(folder, named[3], f"matrices.{named[1].split('=')[0].strip()}")
            ending = line[len(bare) :]
            line = f"{named[1]}{matrix.tolist()!r}{named[4]}{ending}"
        lines.append(line)
    return "".join(lines)


def _read(folder: Path, name: str, field: str) -> Array:
    expected = f"a NumPy file (.npy) of a matrix of numbers, at most {LARGEST} by {LARGEST}"
    path = inside(folder, name, field)
    try:
        with warnings.catch_warnings():  # of headers that Python 2 wrote, or damage made
            warnings.simplefilter("ignore")
            # Mapped, so that a file with a huge array is not read before its shape is seen.
            array = np.load(path, mmap_mode="r", allow_pickle=False)
    except UNREADABLE as error:
        raise InputError(None, field, f"{name}, {reason(error)}", expected) from None
    shape = getattr(array, "shape", ())
    if not 1 <= len(shape) <= 2 or max(shape, default=0) > LARGEST or array.dtype.kind not in "fiu":
        what = f"{name} with an array of shape {shape}" if shape else f"{name} without a matrix"
        raise InputError(None, field, what, expected)
    with np.errstate(all="ignore"):  # what is no finite number then is refused as an entry
        return np.array(array, dtype=float)
