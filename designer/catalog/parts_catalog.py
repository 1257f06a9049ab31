"""Catalogues: what can be bought, and what its data sheets say (docs/catalogue.md).

A catalogue is a folder of TOML and CSV files, ``format = 1``. Several folders are searched, and an
entry of the same kind and name in an earlier one replaces the later one (``catalog.read``).

A board takes parts of certain cases (``[board] mounting``), and a model file may forbid families
(``[circuit] resistor_family``). What would do but for one of these is named with it.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from designer.base.errors import InputError, Unreachable
from designer.base.eseries import SERIES, series_values
from designer.base.schema import one_of
from designer.base.units import format_quantity
from designer.catalog.entries import (
    FORBIDDEN,
    UNITS,
    BuildCost,
    CoaxialJack,
    DiodeEntry,
    Header,
    Kind,
    Mounting,
    OpAmp,
    PartChoice,
    PartFamily,
    Price,
    ReferenceEntry,
    SupplyDiodeEntry,
    TrimmerEntry,
    Use,
    mounting_of,
)
from designer.catalog.read import STOCK, Entry, read_folders
from designer.catalog.stock_list import StockRow, read_stock

CASES = {"smd": "surface-mounted", "tht": "through-hole"}
"""What a board takes, in words."""
MOST = 5
"""Families that a message names before it counts the rest."""


@dataclass(frozen=True)
class Offer:
    """The families of one kind at a grade or better, and what keeps some of them from being
    bought."""

    kind: Kind
    grade: float
    """The grade that is asked for, a fraction."""
    families: tuple[PartFamily, ...]
    """All families of the kind."""
    mounting: Mounting
    """The cases that the board takes."""
    refused: frozenset[str]
    """Names of the families that the model file forbids."""

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return UNITS[self.kind]

    def bars(self, family: PartFamily) -> bool:
        """Whether it may not be bought here."""
        cased = self.mounting in ("mixed", family.mounting)
        return family.name in self.refused or not cased

    @property
    def values(self) -> list[float]:
        """What may be bought, ascending."""
        return sorted({v for f in self.families if not self.bars(f) for v in f.values})

    def reason(self, families: Sequence[PartFamily]) -> str:
        """What keeps these from being bought, after a semicolon; "" where nothing does."""
        forbidden = [f for f in families if f.name in self.refused]
        cased = [f for f in families if self.bars(f) and f not in forbidden]
        text = ""
        if cased:
            has = "has" if len(cased) == 1 else "have"
            text += f"; {_listed(cased)} {has} no {CASES[self.mounting]} form"
        if forbidden:
            text += f"; circuit.{self.kind}_family leaves out {_listed(forbidden)}"
        return text


def _listed(families: Sequence[PartFamily]) -> str:
    """Families with their grades and the ranges of their values."""
    phrases = []
    for f in families[:MOST]:
        low, high = (format_quantity(end, UNITS[f.kind]) for end in f.range)
        phrases.append(f"{f.name} ({100 * f.grade:g} %, {low} to {high})")
    more = f" and {len(families) - MOST} more" if len(families) > MOST else ""
    return ", ".join(phrases) + more


def no_values(
    offer: Offer, series: Sequence[str], limits: tuple[float, float], others: Offer
) -> Unreachable:
    """The refusal where no value of the series within the limits can be bought: grade, range or
    series binds.

    others : the offer at any grade.
    """
    kind, grade = offer.kind, offer.grade
    wanted = set(series_values(series, *limits).tolist())
    barred = offer.reason([f for f in offer.families if wanted & set(f.values)])
    values = offer.values
    if not others.values:
        return _nothing(others)
    if not values:
        expected = best_grade(others) + (barred or offer.reason(offer.families))
        return Unreachable(None, f"circuit.{kind}_grade", grade, expected)
    on_series = [value for value in values if value in series_values(series, value, value)]
    if not on_series:
        expected = "a series of which values can be bought"
        return Unreachable(None, f"circuit.{kind}s", ", ".join(series), expected)
    low, high = (format_quantity(end, offer.unit) for end in limits)
    first, last = (format_quantity(end, offer.unit) for end in (on_series[0], on_series[-1]))
    expected = f"a range with values that can be bought at {grade:.4g}: within {first} to {last}"
    return Unreachable(None, f"circuit.{kind}_range", f"{low} to {high}", expected + barred)


def _nothing(others: Offer) -> Unreachable:
    """The refusal where no part of the kind can be bought at any grade: the model file's families
    or the cases bind."""
    kind, refused = others.kind, others.refused
    would = [f for f in others.families if others.mounting in ("mixed", f.mounting)]
    if would:
        named = [f for f in others.families if f.name not in refused]
        text = f"nothing but {_listed(named)}" if named else "every family forbidden"
        expected = f"families that the board takes, such as {_listed(would)}"
        reason = others.reason(named)
        return Unreachable(None, f"circuit.{kind}_family", text, expected + reason)
    if others.families:
        expected = f'"mixed", or {kind}s in the catalogue that have such a case'
        reason = others.reason(others.families)
        return Unreachable(None, "board.mounting", others.mounting, expected + reason)
    return Unreachable(None, f"circuit.{kind}s", "a catalogue without any", f"a family of {kind}s")


def no_part(
    offer: Offer, value: float, holding: Sequence[PartFamily], others: Offer
) -> Unreachable:
    """The refusal where one value cannot be bought at the grade.

    holding : families of the offer that have it, none of which may be bought. others : the offer
    at any grade.
    """
    near = sorted(offer.values, key=lambda each: abs(math.log(each / value)))[:2]
    nearest = " or ".join(format_quantity(each, offer.unit) for each in sorted(near))
    if not others.values:
        return _nothing(others)
    expected = (
        f"a value that can be bought at this grade, such as {nearest}"
        if near
        else f"a grade that can be bought: {best_grade(others)}"
    )
    text = f"{format_quantity(value, offer.unit)} at {offer.grade:.4g}"
    return Unreachable(None, offer.kind, text, expected + offer.reason(holding))


def best_grade(offer: Offer) -> str:
    """The grades that may be bought, in words; some may."""
    return f"{min(f.grade for f in offer.families if not offer.bars(f)):.4g} or more"


def other_case(name: str, mounting: Mounting, sold: str, sort: str, others: Sequence[str]) -> str:
    """What would do where a part is sold in no case that the board takes.

    sold : the mounting that it is sold in. sort : parts of its sort, in words; others : the names
    of those that have such a case.
    """
    instead = f"{sort} that have one: {', '.join(others) or 'none'}"
    return f'"{sold}" or "mixed": {name} has no {CASES[mounting]} case in the catalogue; {instead}'


_SAME = 1e-9  # relative; values and grades closer than this are the same
_NamedT = TypeVar("_NamedT", OpAmp, DiodeEntry, ReferenceEntry, PartFamily, SupplyDiodeEntry)
_EntryT = TypeVar("_EntryT", bound=Entry)
_Cased = OpAmp | DiodeEntry | ReferenceEntry | TrimmerEntry | SupplyDiodeEntry
_CasedT = TypeVar("_CasedT", OpAmp, DiodeEntry, ReferenceEntry, TrimmerEntry, SupplyDiodeEntry)


@dataclass(frozen=True)
class Catalog:
    """Everything that the folders hold; earlier entries come from earlier folders."""

    families: tuple[PartFamily, ...]
    """Resistors and capacitors that can be bought."""
    opamps: tuple[OpAmp, ...]
    """Op-amps that can be bought."""
    diodes: tuple[DiodeEntry, ...]
    """Diodes that can be bought."""
    references: tuple[ReferenceEntry, ...]
    """Shunt voltage references that can be bought."""
    hash: str
    """Hash of the content of all files, wherever they lie; layouts of bills, fabs and lists of
    distributors are among them."""
    folders: tuple[Path, ...]
    """The folders that were read, in order."""
    trimmers: tuple[TrimmerEntry, ...] = ()
    """Trimming potentiometers that can be bought."""
    supply_diodes: tuple[SupplyDiodeEntry, ...] = ()
    """Diodes against a supply of the wrong polarity."""
    headers: tuple[Header, ...] = ()
    """Pin headers that can be bought."""
    coaxial_jacks: tuple[CoaxialJack, ...] = ()
    """Coaxial jacks that can be bought."""
    prices: tuple[Price, ...] = ()
    """What a part of each price class counts with."""
    build_costs: tuple[BuildCost, ...] = ()
    """What orders of boards are charged with beside the parts."""
    stock: tuple[StockRow, ...] = ()
    """What distributors sell, by their lists; rows of nearer folders first."""
    mounting: Mounting = "mixed"
    """The cases that a board takes; what is sold in no such case is no choice."""
    refused: frozenset[str] = frozenset()
    """Names of the families that a model file does not let parts be bought from."""
    temperatures: tuple[float, float] | None = None
    """Lowest and highest temperature of the boards [°C], over which bounds of op-amps have to hold
    (``OpAmp.over``); None: ``ROOM`` alone."""

    def mounted(self, mounting: Mounting) -> Catalog:
        """The same catalogue for a board that takes these cases."""
        return replace(self, mounting=mounting)

    def at(self, temperatures: tuple[float, float] | None) -> Catalog:
        """The same catalogue for boards of these temperatures."""
        return replace(self, temperatures=temperatures)

    def bought_from(self, choice: Mapping[Kind, Sequence[str]]) -> Catalog:
        """The same catalogue with the choice of families that a model file states.

        choice : by kind, the families that are bought from, or, each with ``FORBIDDEN`` in front,
        those that are not; none: every one.

        Raises
        ------
        InputError : no family of signal parts has that name; lists those that there are.
        """
        refused: set[str] = set()
        for kind, names in choice.items():
            signal_families = [
                f.name for f in self.families if f.kind == kind and f.use == "signal"
            ]
            bare = [name.removeprefix(FORBIDDEN) for name in names]
            for name in bare:
                if name not in signal_families:
                    raise InputError(
                        None, f"circuit.{kind}_family", name, one_of(name, signal_families)
                    )
            forbids = any(name.startswith(FORBIDDEN) for name in names)
            refused |= {n for n in signal_families if names and (n in bare) is forbids}
        return replace(self, refused=frozenset(refused))

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
            raise no_values(self._offer(kind, grade), series, (lo, hi), self._offer(kind, 1.0))
        return result

    def sold(
        self, kind: Kind, value: float, grade: float, use: Use = "signal"
    ) -> PartChoice | None:
        """What is bought of this value where ``grade`` is asked for; None where nothing can be.

        Everything that buys or draws a part asks here: the bill of materials buys this part, and
        a study draws it at the grade of its family. It is the cheapest of that very grade. Where
        nobody sells the value in it, it is the cheapest of a better one, and of equally cheap ones
        the best. Then it is the one that is listed first.
        """
        return _best(
            self._holding(self._families(kind, grade, use), value),
            lambda family: _preference(family, grade),
        )

    def cheapest(self, kind: Kind, value: float, grade: float) -> PartChoice | None:
        """The cheapest signal part of this value at ``grade`` or better, whatever its grade; of
        equally cheap ones the best. None where nobody sells it."""
        return _best(
            self._holding(self._families(kind, grade), value),
            lambda family: (family.price, family.grade),
        )

    def part(self, kind: Kind, value: float, grade: float, use: Use = "signal") -> PartChoice:
        """As ``sold``, where something has to be bought.

        Raises
        ------
        Unreachable : no family holds the value at that grade or a better one.
        """
        part = self.sold(kind, value, grade, use)
        if part is None:
            offer = self._offer(kind, grade, use)
            holding = [family for family, _ in self._holding(offer.families, value)]
            raise no_part(offer, value, holding, self._offer(kind, 1.0, use))
        return part

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
        holding = self._holding([family], value)
        if not holding:
            low, high = (format_quantity(v, UNITS[family.kind]) for v in family.range)
            spelled = format_quantity(value, UNITS[family.kind])
            expected = f"a value that {name} is sold in: {' '.join(family.series)}, {low} to {high}"
            raise Unreachable(None, "array", spelled, expected)
        return _choice(*holding[0])

    def substitute(self, part: PartChoice, grade: float) -> PartChoice | None:
        """Another maker's part of the same value, use and footprint, chosen as ``part`` is; None
        where the catalogue has none."""
        others = [
            family
            for family in self._families(part.family.kind, grade, part.family.use)
            if family.footprint == part.footprint and family.manufacturer != part.manufacturer
        ]
        return _best(self._holding(others, part.value), lambda family: _preference(family, grade))

    def opamp(self, name: str, supply: float | None = None) -> OpAmp:
        """The op-amp of this name; InputError names the known ones and a likely one, or says that
        it is not sold in a case that the board takes, and which others are.

        supply : rails [V] that those others have to stand; None: those that its figures hold at.
        """
        named = _named(self.opamps, name, "circuit.opamp")
        rails = named.rated_supply if supply is None else supply
        others = [other for other in self.opamps if other.takes(rails)]
        return self._cased(named, f"op-amps for ± {rails:g} V", others)

    def opamps_at(self, supply: float) -> tuple[OpAmp, ...]:
        """Those for rails of ± ``supply`` [V] that are sold in a case which the board takes."""
        return tuple(each for each in self.opamps if each.takes(supply) and self._takes(each))

    def diode(self, name: str) -> DiodeEntry:
        """The diode of this name; InputError as for ``opamp``."""
        return self._cased(_named(self.diodes, name, "circuit.diode"), "diodes", self.diodes)

    def reference(self, name: str) -> ReferenceEntry:
        """The voltage reference of this name; InputError as for ``opamp``."""
        named = _named(self.references, name, "circuit.reference")
        same = [r for r in self.references if math.isclose(r.voltage, named.voltage, rel_tol=_SAME)]
        return self._cased(named, f"references of {format_quantity(named.voltage, 'V')}", same)

    def supply_diode(self, name: str) -> SupplyDiodeEntry:
        """The diode of this name against a supply of the wrong polarity; InputError as for
        ``opamp``."""
        named = _named(self.supply_diodes, name, "board.reverse_protection")
        return self._cased(named, "diodes of a supply", self.supply_diodes)

    def trimmer(self, value: float) -> TrimmerEntry:
        """The first trimmer of this value [Ω]; InputError names the values that there are."""
        same = [t for t in self.trimmers if math.isclose(t.value, value, rel_tol=_SAME)]
        if same:
            return self._cased(same[0], f"trimmers of {format_quantity(value, 'Ω')}", same)
        values = ", ".join(format_quantity(entry.value, "Ω") for entry in self.trimmers)
        raise InputError(None, "trimmer", format_quantity(value, "Ω"), f"one of {values}")

    def header(self, ways: int, keyed: bool = False) -> Header:
        """The first pin header of so many ways; InputError where there is none.

        keyed : take one whose plug goes in one way alone, where there is one.
        """
        for wanted in (keyed, not keyed):
            for entry in self.headers:
                if entry.keyed is wanted and entry.ways[0] <= ways <= entry.ways[1]:
                    return entry
        most = max((entry.ways[1] for entry in self.headers), default=0)
        raise InputError(None, "header", ways, f"a number of ways up to {most}")

    def coaxial_jack(self, series: str) -> CoaxialJack:
        """The first jack of a series, "sma" or "bnc"; InputError where there is none."""
        for entry in self.coaxial_jacks:
            if entry.series == series:
                return entry
        listed = ", ".join(sorted({entry.series for entry in self.coaxial_jacks})) or "none"
        raise InputError(
            None, "board.connectors", series, f'"pins", or a jack of the catalogue: {listed}'
        )

    def _cased(self, entry: _CasedT, sort: str, others: Sequence[_CasedT]) -> _CasedT:
        """The entry in the first of its cases that the board takes.

        sort, others : parts that may be taken instead, in words and as entries.

        Raises
        ------
        InputError : it has no such case; names those of ``others`` that have one.
        """
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
        cased = [other.name for other in others if other != entry and self._takes(other)]
        expected = other_case(entry.name, self.mounting, sold, sort, cased)
        raise InputError(None, "board.mounting", self.mounting, expected)

    def _takes(self, entry: _Cased) -> bool:
        """Whether the board takes it in one of the cases that it is sold in."""
        footprints = entry.footprint, *(case.footprint for case in entry.cases)
        return self.mounting in ("mixed", *map(mounting_of, footprints))

    def _families(self, kind: Kind, grade: float, use: Use = "signal") -> list[PartFamily]:
        """Those of this grade or a better one that the board takes and the file lets be bought."""
        return [
            each
            for each in self._of_kind(kind, grade, use)
            if self.mounting in ("mixed", each.mounting) and each.name not in self.refused
        ]

    def _offer(self, kind: Kind, grade: float, use: Use = "signal") -> Offer:
        families = tuple(self._of_kind(kind, grade, use))
        return Offer(kind, grade, families, self.mounting, self.refused)

    def _of_kind(self, kind: Kind, grade: float, use: Use) -> list[PartFamily]:
        """Those of this grade or a better one, whether they may be bought or not."""
        if kind not in UNITS:
            raise InputError(None, "kind", kind, one_of(kind, UNITS))
        limit = grade * (1.0 + _SAME)
        return [
            each
            for each in self.families
            if each.kind == kind and each.use == use and each.grade <= limit
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


def load_catalog(extra: Path | None = None) -> Catalog:
    """Read all catalogue folders, ``extra`` first.

    Raises
    ------
    InputError : a named folder does not exist, or a file in one is wrong; names file and field.
    """
    entries, content_hash, folders = read_folders(extra)

    def of(sort: type[_EntryT]) -> tuple[_EntryT, ...]:
        return tuple(entry for entry in entries if isinstance(entry, sort))

    return Catalog(
        families=of(PartFamily),
        opamps=of(OpAmp),
        diodes=of(DiodeEntry),
        references=of(ReferenceEntry),
        hash=content_hash,
        folders=folders,
        trimmers=of(TrimmerEntry),
        supply_diodes=of(SupplyDiodeEntry),
        headers=of(Header),
        coaxial_jacks=of(CoaxialJack),
        prices=of(Price),
        build_costs=of(BuildCost),
        stock=read_stock(folders, STOCK),
    )


def _nearest(ascending: Sequence[float], value: float) -> float:
    """The one that is nearest to the value, the smaller of two that are as near."""
    above = bisect_left(ascending, value)
    return min(ascending[max(above - 1, 0) : above + 1], key=lambda each: abs(each - value))


def _preference(family: PartFamily, grade: float) -> tuple[bool, int, float]:
    """Least for the family that is bought from where ``grade`` is asked for."""
    return not math.isclose(family.grade, grade, rel_tol=_SAME), family.price, family.grade


def _best(
    holding: Sequence[tuple[PartFamily, float]], key: Callable[[PartFamily], tuple[float, ...]]
) -> PartChoice | None:
    """The part of the family for which the key is least."""
    return _choice(*min(holding, key=lambda each: key(each[0]))) if holding else None


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


def _named(entries: Sequence[_NamedT], name: str, field: str) -> _NamedT:
    for entry in entries:
        if entry.name == name:
            return entry
    raise InputError(None, field, name, one_of(name, [entry.name for entry in entries]))
