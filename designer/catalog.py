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
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn, TypeVar

import numpy as np
import platformdirs
from numpy.typing import NDArray

from designer.catalogentry import (
    PRICE_CLASSES,
    UNITS,
    Diode,
    Figure,
    Kind,
    OpAmp,
    PartChoice,
    PartFamily,
    PartNumber,
    Price,
    Rating,
    Reference,
    Section,
)
from designer.catalogfile import Entry, read_catalog_file
from designer.errors import InputError, Unreachable
from designer.eseries import SERIES, series_values
from designer.quantity import format_quantity
from designer.schema import one_of

__all__ = [
    "ENVIRONMENT",
    "PRICE_CLASSES",
    "Catalog",
    "Diode",
    "Figure",
    "Kind",
    "OpAmp",
    "PartChoice",
    "PartFamily",
    "PartNumber",
    "Price",
    "Rating",
    "Reference",
    "Section",
    "load_catalog",
]

ENVIRONMENT = "DESIGNER_CATALOGS"
"""Environment variable: folders to search first, separated as in PATH."""

_SAME = 1e-9  # relative; values and grades closer than this are the same
_NamedT = TypeVar("_NamedT", OpAmp, Diode, Reference)


@dataclass(frozen=True)
class Catalog:
    """Everything that the folders hold; earlier entries come from earlier folders.

    ``hash`` is of the content of all files, wherever they lie.
    """

    families: tuple[PartFamily, ...]
    opamps: tuple[OpAmp, ...]
    diodes: tuple[Diode, ...]
    references: tuple[Reference, ...]
    hash: str
    folders: tuple[Path, ...]
    prices: tuple[Price, ...] = ()

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

    def part(self, kind: Kind, value: float, grade: float) -> PartChoice:
        """The cheapest part of this value at ``grade`` or better.

        Among equally cheap ones the better grade, then the one that is listed first.

        Raises
        ------
        Unreachable : no family holds the value at that grade.
        """
        fitting = self._families(kind, grade)
        found = [
            (family, nearest)
            for family in fitting
            for nearest in [min(family.values, key=lambda sold: abs(sold - value))]
            if math.isclose(nearest, value, rel_tol=_SAME)
        ]
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
        family, exact = min(found, key=lambda each: (each[0].price, each[0].grade))
        return PartChoice(
            family,
            exact,
            family.part_number.of(exact),
            family.manufacturer,
            family.footprint,
            family.rating,
            family.price,
        )

    def opamp(self, name: str) -> OpAmp:
        """The op-amp of this name; InputError names the known ones and a likely one."""
        return _named(self.opamps, name, "circuit.opamp")

    def diode(self, name: str) -> Diode:
        """The diode of this name; InputError names the known ones and a likely one."""
        return _named(self.diodes, name, "diode")

    def reference(self, name: str) -> Reference:
        """The voltage reference of this name; InputError as for ``opamp``."""
        return _named(self.references, name, "reference")

    def _families(self, kind: Kind, grade: float) -> list[PartFamily]:
        if kind not in UNITS:
            raise InputError(None, "kind", kind, one_of(kind, UNITS))
        limit = grade * (1.0 + _SAME)
        return [each for each in self.families if each.kind == kind and each.grade <= limit]

    def _best_grade(self, kind: Kind) -> str:
        grades = [family.grade for family in self.families if family.kind == kind]
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
        tuple(entry for entry in entries if isinstance(entry, Price)),
    )


def _read_folder(folder: Path, digest: hashlib._Hash) -> dict[tuple[type[Entry], str], Entry]:
    """The entries of a folder, files in the order of their names; other files are left alone."""
    found: dict[tuple[type[Entry], str], Entry] = {}
    files = (path for path in folder.iterdir() if path.suffix in (".toml", ".csv"))
    for path in sorted(files, key=lambda each: each.name):
        content, entries = read_catalog_file(path)
        digest.update(f"{path.name} {len(content)}\n".encode())
        digest.update(content)
        for entry in entries:
            key = type(entry), entry.name
            if key in found:
                raise InputError(path, "name", entry.name, "names that this folder uses once")
            found[key] = entry
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


def _named(entries: Sequence[_NamedT], name: str, where: str) -> _NamedT:
    for entry in entries:
        if entry.name == name:
            return entry
    raise InputError(None, where, name, one_of(name, [entry.name for entry in entries]))
