"""Catalogues: what can be bought, and what its data sheets say (docs/catalogue.md).

A catalogue is a folder of TOML and CSV files, ``format = 1``. Folders are searched in this order,
and an entry of the same kind and name in an earlier folder replaces the later one:

1. the folder that the caller names, then those of the environment variable DESIGNER_CATALOGS
2. the user's own: ``catalogs`` in the configuration folder of this system
3. the catalogue that comes with the tool
"""

from __future__ import annotations

import hashlib
import importlib.resources
import math
import os
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NoReturn, TypeVar

import numpy as np
import platformdirs
from numpy.typing import NDArray

from designer.base.errors import InputError, Unreachable
from designer.base.eseries import SERIES, series_values
from designer.base.reading import read_bytes, reading
from designer.base.schema import one_of
from designer.base.units import format_quantity
from designer.catalog.entries import (
    PRICE_CLASSES,
    UNITS,
    Diode,
    Figure,
    Header,
    Kind,
    Mounting,
    OpAmp,
    PartChoice,
    PartFamily,
    PartNumber,
    Price,
    Rating,
    Reference,
    Section,
    Trimmer,
    Use,
    mounting_of,
)
from designer.catalog.read import Entry, read_catalog_file

__all__ = [
    "ENVIRONMENT",
    "PRICE_CLASSES",
    "Catalog",
    "Diode",
    "Figure",
    "Header",
    "Kind",
    "Mounting",
    "OpAmp",
    "PartChoice",
    "PartFamily",
    "PartNumber",
    "Price",
    "Rating",
    "Reference",
    "Section",
    "Trimmer",
    "Use",
    "load_catalog",
]

ENVIRONMENT = "DESIGNER_CATALOGS"
"""Environment variable: folders to search first, separated as in PATH."""

LAYOUTS = "bom-layouts"
"""Folder of layouts beside the catalogue's files (``board.bom_layouts``)."""
_SAME = 1e-9  # relative; values and grades closer than this are the same
_NamedT = TypeVar("_NamedT", OpAmp, Diode, Reference, PartFamily)
_CasedT = TypeVar("_CasedT", OpAmp, Diode, Reference, Trimmer)


@dataclass(frozen=True)
class Catalog:
    """Everything that the folders hold; earlier entries come from earlier folders.

    ``hash`` is of the content of all files, wherever they lie, layouts of bills among them.
    mounting : the cases that a board takes; what is sold in no such case is no choice.
    """

    families: tuple[PartFamily, ...]
    opamps: tuple[OpAmp, ...]
    diodes: tuple[Diode, ...]
    references: tuple[Reference, ...]
    hash: str
    folders: tuple[Path, ...]
    trimmers: tuple[Trimmer, ...] = ()
    headers: tuple[Header, ...] = ()
    prices: tuple[Price, ...] = ()
    mounting: Mounting = "mixed"

    def mounted(self, mounting: Mounting) -> Catalog:
        """The same catalogue for a board that takes these cases."""
        return replace(self, mounting=mounting)

    def euro(self, price_class: int) -> float:
        """What a part of this class counts with, in euro apiece.

        Raises
        ------
        InputError : no file states it.
        """
        for price in self.prices:
            if price.price_class == price_class:
                return price.euro
        raise InputError(None, "price", price_class, "a class with a table [[price]]")

    def values(
        self, kind: Kind, series: Sequence[str], lo: float, hi: float, grade: float
    ) -> NDArray[np.float64]:
        """Values of the series within [lo, hi] that can be bought at ``grade`` or better, sorted.

        Raises
        ------
        InputError : an unknown series or a range that is not one.
        Unreachable : no such value can be bought; says what stands in the way.
        """
        for name in series:
            if name not in SERIES:
                raise InputError(None, f"circuit.{kind}s", name, one_of(name, SERIES))
        wanted = series_values(series, lo, hi)
        fitting = self._families(kind, grade)
        sold = {value for family in fitting for value in family.values}
        result = np.array([value for value in wanted if value in sold], dtype=np.float64)
        if len(result) == 0:
            self._explain(kind, series, (lo, hi), grade, sold)
        return result

    def part(self, kind: Kind, value: float, grade: float, use: Use = "signal") -> PartChoice:
        """The cheapest part of this value at ``grade`` or better.

        Among equally cheap ones the better grade, then the one that is listed first.

        Raises
        ------
        Unreachable : no family holds the value at that grade.
        """
        fitting = self._families(kind, grade, use)
        found = self._holding(fitting, value)
        if not found:
            unit = UNITS[kind]
            sold = sorted({each for family in fitting for each in family.values})
            near = sorted(sold, key=lambda each: abs(math.log(each / value)))[:2]
            expected = " or ".join(format_quantity(each, unit) for each in sorted(near))
            raise Unreachable(
                None,
                kind,
                f"{format_quantity(value, unit)} at {grade:.4g}",
                f"a value that can be bought at this grade, such as {expected}"
                if near
                else f"a grade that can be bought: {self._best_grade(kind)}",
            )
        return _choice(*min(found, key=lambda each: (each[0].price, each[0].grade)))

    def array(self, name: str, value: float) -> PartChoice:
        """The array of this family with parts of this value.

        Raises
        ------
        InputError : no such family of arrays, or not in a case that the board takes.
        Unreachable : it has no such value.
        """
        arrays = [f for f in self.families if f.use == "array"]
        family = _named(arrays, name, "array")
        if self.mounting not in ("mixed", family.mounting):
            expected = f'"{family.mounting}" or "mixed": {name} is sold in no other case'
            raise InputError(None, "board.mounting", self.mounting, expected)
        found = self._holding([family], value)
        if not found:
            low, high = (format_quantity(v, UNITS[family.kind]) for v in family.range)
            spelled = format_quantity(value, UNITS[family.kind])
            said = f"a value that {name} is sold in: {' '.join(family.series)}, {low} to {high}"
            raise Unreachable(None, "array", spelled, said)
        return _choice(*found[0])

    def substitute(self, part: PartChoice, grade: float) -> PartChoice | None:
        """Another maker's part of the same value, grade or better, use and footprint; the cheapest,
        or None where the catalogue has none."""
        family = part.family
        found = [
            (other, exact)
            for other, exact in self._holding(
                self._families(family.kind, grade, family.use), part.value
            )
            if other.footprint == part.footprint and other.manufacturer != part.manufacturer
        ]
        if not found:
            return None
        return _choice(*min(found, key=lambda each: (each[0].price, each[0].grade)))

    def opamp(self, name: str) -> OpAmp:
        """The op-amp of this name; InputError names the known ones and a likely one, or says that
        it is not sold in a case that the board takes."""
        return self._cased(_named(self.opamps, name, "circuit.opamp"))

    def diode(self, name: str) -> Diode:
        """The diode of this name; InputError names the known ones and a likely one."""
        return self._cased(_named(self.diodes, name, "diode"))

    def reference(self, name: str) -> Reference:
        """The voltage reference of this name; InputError as for ``opamp``."""
        return self._cased(_named(self.references, name, "reference"))

    def trimmer(self, value: float) -> Trimmer:
        """The first trimmer of this value [Ω]; InputError names the values that there are."""
        for entry in self.trimmers:
            if math.isclose(entry.value, value, rel_tol=_SAME):
                return self._cased(entry)
        known = ", ".join(format_quantity(entry.value, "Ω") for entry in self.trimmers)
        raise InputError(None, "trimmer", format_quantity(value, "Ω"), f"one of {known}")

    def header(self, ways: int) -> Header:
        """The first pin header of so many ways; InputError where there is none."""
        for entry in self.headers:
            if entry.ways[0] <= ways <= entry.ways[1]:
                return entry
        most = max((entry.ways[1] for entry in self.headers), default=0)
        raise InputError(None, "header", ways, f"a number of ways up to {most}")

    def _cased(self, entry: _CasedT) -> _CasedT:
        """The entry in the first of its cases that the board takes."""
        if self.mounting in ("mixed", mounting_of(entry.footprint)):
            return entry
        for case in entry.cases:
            if mounting_of(case.footprint) == self.mounting:
                moved = replace(
                    entry,
                    part_number=case.part_number,
                    footprint=case.footprint,
                    manufacturer=case.manufacturer or entry.manufacturer,
                )
                if case.pins is None or isinstance(moved, OpAmp):
                    return moved
                return replace(moved, pins=case.pins)
        sold = mounting_of(entry.footprint)
        raise InputError(
            None,
            "board.mounting",
            self.mounting,
            f'"{sold}" or "mixed": {entry.name} is in the catalogue in no other case',
        )

    def _families(self, kind: Kind, grade: float, use: Use = "signal") -> list[PartFamily]:
        if kind not in UNITS:
            raise InputError(None, "kind", kind, one_of(kind, UNITS))
        limit = grade * (1.0 + _SAME)
        return [
            each
            for each in self.families
            if each.kind == kind
            and each.use == use
            and each.grade <= limit
            and self.mounting in ("mixed", each.mounting)
        ]

    @staticmethod
    def _holding(families: Sequence[PartFamily], value: float) -> list[tuple[PartFamily, float]]:
        """Those that hold a value, with that value as they have it."""
        return [
            (family, nearest)
            for family in families
            for nearest in [_nearest(family.values, value)]
            if math.isclose(nearest, value, rel_tol=_SAME)
        ]

    def _best_grade(self, kind: Kind) -> str:
        grades = [family.grade for family in self._families(kind, 1.0)]
        return f"{min(grades):.4g} or more" if grades else f"the catalogue has no {kind}s"

    def _explain(
        self,
        kind: Kind,
        series: Sequence[str],
        limits: tuple[float, float],
        grade: float,
        sold: set[float],
    ) -> NoReturn:
        """Raise ``Unreachable`` naming what stands in the way: grade, range or series."""
        if not sold:
            raise Unreachable(None, f"circuit.{kind}_grade", grade, self._best_grade(kind))
        unit = UNITS[kind]
        low, high = (format_quantity(end, unit) for end in limits)
        on_series = [
            value for value in sorted(sold) if value in series_values(series, value, value)
        ]
        if not on_series:
            raise Unreachable(
                None,
                f"circuit.{kind}s",
                ", ".join(series),
                "a series of which values can be bought",
            )
        ends = " to ".join(format_quantity(end, unit) for end in (on_series[0], on_series[-1]))
        raise Unreachable(
            None,
            f"circuit.{kind}_range",
            f"{low} to {high}",
            f"a range with values that can be bought at {grade:.4g}: within {ends}",
        )


def load_catalog(extra: Path | None = None) -> Catalog:
    """Read all catalogue folders, ``extra`` first.

    Raises
    ------
    InputError : a named folder does not exist, or a file in one is wrong; names file and field.
    """
    folders = _folders(extra)
    digest = hashlib.sha256()
    kept: dict[tuple[type[Entry], str], Entry] = {}
    for folder in folders:
        for key, entry in _read_folder(folder, digest).items():
            kept.setdefault(key, entry)
    entries = kept.values()
    return Catalog(
        tuple(entry for entry in entries if isinstance(entry, PartFamily)),
        tuple(entry for entry in entries if isinstance(entry, OpAmp)),
        tuple(entry for entry in entries if isinstance(entry, Diode)),
        tuple(entry for entry in entries if isinstance(entry, Reference)),
        digest.hexdigest(),
        folders,
        tuple(entry for entry in entries if isinstance(entry, Trimmer)),
        tuple(entry for entry in entries if isinstance(entry, Header)),
        tuple(entry for entry in entries if isinstance(entry, Price)),
    )


def _read_folder(folder: Path, digest: hashlib._Hash) -> dict[tuple[type[Entry], str], Entry]:
    """The entries of a folder, files in the order of their names; other files are left alone."""
    found: dict[tuple[type[Entry], str], Entry] = {}
    with reading(folder, "a folder of catalogue files", "the folder"):
        files = [path for path in folder.iterdir() if path.suffix in (".toml", ".csv")]
    for path in sorted(files, key=lambda each: each.name):
        content, entries = read_catalog_file(path)
        digest.update(f"{path.name} {len(content)}\n".encode())
        digest.update(content)
        for entry in entries:
            key = type(entry), entry.name
            if key in found:
                raise InputError(path, "name", entry.name, "names that this folder uses once")
            found[key] = entry
    for path in sorted((folder / LAYOUTS).glob("*.toml"), key=lambda each: each.name):
        content = read_bytes(path, "a layout that can be read")
        digest.update(f"{LAYOUTS}/{path.name} {len(content)}\n".encode())
        digest.update(content)
    return found


def _folders(extra: Path | None) -> tuple[Path, ...]:
    named = [] if extra is None else [("the catalogue folder", Path(extra))]
    listed = os.environ.get(ENVIRONMENT, "").split(os.pathsep)
    named += [(ENVIRONMENT, Path(text)) for text in listed if text]
    for origin, folder in named:
        if not folder.is_dir():
            raise InputError(None, origin, str(folder), "a folder of catalogue files")
    own = Path(platformdirs.user_config_dir("designer", appauthor=False)) / "catalogs"
    return (
        *(folder for _, folder in named),
        *([own] if own.is_dir() else []),
        _shipped(),
    )


def _shipped() -> Path:
    """In a wheel inside the package; in a checkout at its top level, beside the package."""
    package = Path(str(importlib.resources.files("designer")))
    for folder in (package / "catalogs", package.parent / "catalogs"):
        if folder.is_dir():
            return folder
    raise InputError(None, "catalogs", "nothing", "the catalogue that comes with the tool")


def _nearest(ascending: Sequence[float], value: float) -> float:
    """The one that is nearest to the value, the smaller of two that are as near."""
    above = bisect_left(ascending, value)
    return min(ascending[max(above - 1, 0) : above + 1], key=lambda each: abs(each - value))


def _choice(family: PartFamily, value: float) -> PartChoice:
    return PartChoice(
        family,
        value,
        family.part_number.of(value),
        family.manufacturer,
        family.footprint,
        family.rating,
        family.price,
    )


def _named(entries: Sequence[_NamedT], name: str, where: str) -> _NamedT:
    for entry in entries:
        if entry.name == name:
            return entry
    raise InputError(None, where, name, one_of(name, [entry.name for entry in entries]))
