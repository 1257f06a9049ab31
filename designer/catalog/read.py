"""Catalogue files, TOML or CSV, ``format = 1`` (docs/catalogue.md), and the folders that hold them.

1. the folder that the caller names, then those of the environment variable DESIGNER_CATALOGS
2. the user's own: ``catalogs`` in the configuration folder of this system
3. the catalogue that comes with the tool

Each rule for part numbers is tried on every value of its family, and on the example that the file
gives with it, when the file is read.
"""

from __future__ import annotations

import hashlib
import importlib.resources
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Annotated

import platformdirs

from designer.base.errors import MISSING, InputError, InputErrors
from designer.base.eseries import series_values
from designer.base.guarded_reading import csv_rows, decode, read_bytes, reading
from designer.base.schema import (
    FIRST_FORMAT,
    Accepts,
    FieldProblems,
    FileTable,
    keys_of,
    one_of,
    validated,
    whole_number,
)
from designer.base.toml_reader import parse_toml
from designer.base.units import format_quantity, parse_quantity
from designer.catalog.entries import (
    UNITS,
    BuildCost,
    CoaxialJack,
    DiodeEntry,
    FamilyBase,
    Header,
    OpAmp,
    PartFamily,
    Price,
    ReferenceEntry,
    SupplyDiodeEntry,
    TrimmerEntry,
)
from designer.catalog.fields import CODE_TEXT, quantities, quantity

Entry = (
    PartFamily | OpAmp | DiodeEntry | ReferenceEntry | SupplyDiodeEntry | TrimmerEntry | Header
    | CoaxialJack | Price | BuildCost
)  # fmt: skip

ENVIRONMENT = "DESIGNER_CATALOGS"
"""Environment variable: folders to search first, separated as in PATH."""
LAYOUTS = "bom-layouts"
"""Folder of layouts beside the catalogue's files (``board.bom_layouts``)."""
FABS = "fabs"
"""Folder of makers of boards beside the catalogue's files (``catalog.fab``)."""
STOCK = "stock"
"""Folder of distributors' lists beside the catalogue's files (``catalog.stock_list``)."""
_MAX_BYTES = 4_000_000


def read_folders(extra: Path | None = None) -> tuple[tuple[Entry, ...], str, tuple[Path, ...]]:
    """The entries of all catalogue folders, the hash of their files' content, and the folders.

    Of entries of the same sort and name, the one in the earliest folder counts.

    extra : a folder that comes first.

    Raises
    ------
    InputError : a named folder does not exist, or a file in one is wrong; names file and field.
    """
    folders = _folders(extra)
    digest = hashlib.sha256()
    by_key: dict[tuple[type[Entry], str], Entry] = {}
    for folder in folders:
        for key, entry in _read_folder(folder, digest).items():
            by_key.setdefault(key, entry)
    return tuple(by_key.values()), digest.hexdigest(), folders


def _folders(extra: Path | None) -> tuple[Path, ...]:
    named = [] if extra is None else [("the catalogue folder", Path(extra))]
    listed = os.environ.get(ENVIRONMENT, "").split(os.pathsep)
    named += [(ENVIRONMENT, Path(text)) for text in listed if text]
    for origin, folder in named:
        if not folder.is_dir():
            raise InputError(None, origin, str(folder), "a folder of catalogue files")
    user_folder = Path(platformdirs.user_config_dir("designer", appauthor=False)) / "catalogs"
    return (
        *(folder for _, folder in named),
        *([user_folder] if user_folder.is_dir() else []),
        _shipped(),
    )


def _shipped() -> Path:
    """The catalogue that comes with the tool: inside the package in a wheel, beside it in a
    checkout."""
    package = Path(str(importlib.resources.files("designer")))
    for folder in (package / "catalogs", package.parent / "catalogs"):
        if folder.is_dir():
            return folder
    raise InputError(None, "catalogs", MISSING, "the catalogue that comes with the tool")


def _read_folder(folder: Path, digest: hashlib._Hash) -> dict[tuple[type[Entry], str], Entry]:
    """The entries of a folder, files in the order of their names; other files are left alone."""
    by_key: dict[tuple[type[Entry], str], Entry] = {}
    with reading(folder, "a folder of catalogue files", "the folder"):
        files = [path for path in folder.iterdir() if path.suffix in (".toml", ".csv")]
    for path in sorted(files, key=lambda each: each.name):
        content, entries = read_catalog_file(path)
        _digest(digest, path.name, content)
        twice = []
        for entry in entries:
            key = type(entry), entry.name
            if key in by_key:
                expected = "names that this folder uses once"
                twice.append(InputError(path, "name", entry.name, expected))
            by_key[key] = entry
        _raise(twice)
    for inner, ending in ((LAYOUTS, "toml"), (FABS, "toml"), (STOCK, "csv")):
        for path in sorted((folder / inner).glob(f"*.{ending}"), key=lambda each: each.name):
            _digest(digest, f"{inner}/{path.name}", read_bytes(path, "a file that can be read"))
    return by_key


def _digest(digest: hashlib._Hash, name: str, content: bytes) -> None:
    digest.update(f"{name} {len(content)}\n".encode())
    digest.update(content)


def _raise(problems: Sequence[InputError]) -> None:
    """Raises the only problem, or all of them as InputErrors."""
    if problems:
        raise problems[0] if len(problems) == 1 else InputErrors(problems)


def read_catalog_file(path: Path) -> tuple[bytes, tuple[Entry, ...]]:
    """Content and entries of one file.

    Raises
    ------
    InputError : the file cannot be read.
    InputErrors : more than one thing in it is wrong; names each.
    """
    content = read_bytes(path, "a catalogue file that can be read", most=_MAX_BYTES)
    text = decode(content, path)
    if path.suffix == ".csv":
        return content, _from_csv(text, str(path))
    file, problems = validated(_File, parse_toml(text, str(path)), str(path), folder=path.parent)
    _raise(problems)
    assert file is not None
    # A model beside the file is content too: the catalogue's hash follows it.
    models = [opamp.spice.content for opamp in file.opamp if opamp.spice is not None]
    return b"\n".join([content, *models]), file.entries


@dataclass(frozen=True)
class _Example(FileTable):
    value: Annotated[float | str, Accepts('a number, or text such as "22.1k"', quantity)]
    part_number: Annotated[str, CODE_TEXT]


@dataclass(frozen=True, kw_only=True)
class FamilyTable(FamilyBase):
    """A family as a file states it."""

    range: Annotated[tuple[float | str, ...], quantities("a range [low, high]", 2)] = ()
    """Least and largest value of the series."""
    values: Annotated[tuple[float | str, ...], quantities("a list of values")] = ()
    """Values beside those of the series."""
    example: _Example | None = None
    """A value with its part number, by which the rule is tried."""
    elements: Annotated[int | None, whole_number("a whole number from 2 to 16", 2, 16)] = None
    """Parts in one case of an array."""

    def __post_init__(self) -> None:
        problems = list(self._problems())
        if problems:
            raise FieldProblems(problems)

    @property
    def family(self) -> PartFamily:
        """The family with every value that can be bought."""
        stated = {field.name: getattr(self, field.name) for field in fields(FamilyBase)}
        ends = self._sold[0], self._sold[-1]
        return PartFamily(**stated, range=ends, values=self._sold, elements=self.elements or 1)

    @cached_property
    def _sold(self) -> tuple[float, ...]:
        """What can be bought: the values that are listed, and those of the series in the range."""
        unit = UNITS[self.kind]
        values = {parse_quantity(value, unit) for value in self.values}
        if self.range:
            low, high = (parse_quantity(end, unit) for end in self.range)
            values.update(series_values(self.series, low, high).tolist())
        if any(value <= 0.0 for value in values):
            raise ValueError("a value that is not > 0")
        return tuple(sorted(values))

    def _problems(self) -> Iterator[InputError]:
        unit = UNITS[self.kind]
        sold: tuple[float, ...] = ()
        try:
            sold = self._sold
            if not sold:
                expected = "values, or series and a range that holds some"
                yield InputError(None, "values", MISSING, expected)
        except InputError as error:  # raised by the series
            yield error
        except ValueError as error:
            yield InputError(None, "range", str(error), f"quantities in {unit}, ascending")
        for key, stated in (("elements", self.elements), ("matching", self.matching)):
            if (stated is not None) is not (self.use == "array"):
                expected = f'{key} with use = "array", and only there'
                yield InputError(None, key, MISSING if stated is None else stated, expected)
        for value in sold:
            try:
                self.part_number.of(value)
            except ValueError as error:
                expected = f"a code that can spell {format_quantity(value, unit)} ({error})"
                yield InputError(None, "part_number.code", self.part_number.code, expected)
                break
        if self.example is not None:
            yield from self._wrong_example(self.example, unit)

    def _wrong_example(self, example: _Example, unit: str) -> Iterator[InputError]:
        try:
            number = self.part_number.of(parse_quantity(example.value, unit))
        except ValueError as error:
            yield InputError(None, "example.value", example.value, f"a value ({error})")
            return
        if number != example.part_number:
            expected = f"{number}, by the rule"
            yield InputError(None, "example.part_number", example.part_number, expected)


@dataclass(frozen=True)
class _File(FileTable):
    """The tables of a TOML file."""

    format: Annotated[int, FIRST_FORMAT]
    family: tuple[FamilyTable, ...] = ()
    opamp: tuple[OpAmp, ...] = ()
    diode: tuple[DiodeEntry, ...] = ()
    reference: tuple[ReferenceEntry, ...] = ()
    supply_diode: tuple[SupplyDiodeEntry, ...] = ()
    trimmer: tuple[TrimmerEntry, ...] = ()
    header: tuple[Header, ...] = ()
    coaxial_jack: tuple[CoaxialJack, ...] = ()
    price: tuple[Price, ...] = ()
    build_cost: tuple[BuildCost, ...] = ()

    @property
    def entries(self) -> tuple[Entry, ...]:
        families = (table.family for table in self.family)
        others: tuple[tuple[Entry, ...], ...] = (
            self.opamp, self.diode, self.reference, self.supply_diode, self.trimmer, self.header,
            self.coaxial_jack, self.price, self.build_cost,
        )  # fmt: skip
        return (*families, *(entry for entries in others for entry in entries))


def _from_csv(text: str, file: str) -> tuple[Entry, ...]:
    """Part families, one a row; the columns are the keys of a TOML table, and ``format``."""
    rows = csv_rows(text, file)
    columns = ["format", *sorted(keys_of(FamilyTable))]
    _, header = next(rows, (1, []))
    problems = [
        InputError(file, "line 1", f"unknown column {name!r}", one_of(name, columns))
        for name in header
        if name not in columns
    ]
    _raise(problems)
    families = []
    for number, row in rows:
        place = f"line {number}"
        if not row:
            continue
        if len(row) != len(header):
            expected = f"{len(header)}, as the header"
            problems.append(InputError(file, place, f"{len(row)} cells", expected))
            continue
        cells = dict(zip(header, (cell.strip() for cell in row), strict=True))
        if cells.pop("format", "") != "1":
            expected = "1 in a column format"
            problems.append(InputError(file, f"{place}.format", "no 1", expected))
        stated = {key: _cell(key, cell) for key, cell in cells.items() if cell}
        table, wrong = validated(FamilyTable, stated, file, within=place)
        problems += wrong
        if table is not None:
            families.append(table.family)
    _raise(problems)
    return tuple(families)


def _cell(key: str, cell: str) -> object:
    """A cell as TOML would give it: lists by spaces (prose by "|"), tables as "key=value …"."""
    if key in ("sources", "assumed"):
        return [part.strip() for part in cell.split("|")]
    if key in ("series", "range", "values"):
        return cell.split()
    if key in ("rating", "part_number", "example"):
        return {word.partition("=")[0]: word.partition("=")[2] for word in cell.split()}
    if key in ("price", "elements"):
        return int(cell) if cell.isdecimal() and cell.isascii() else cell
    if key in ("grade", "temperature_coefficient", "drift", "matching"):
        try:
            return parse_quantity(cell, "")
        except ValueError:
            return cell
    return cell
