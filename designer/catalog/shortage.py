"""Why nothing of a catalogue will do, and what would: what its refusals say.

A board takes parts of certain cases (``[board] mounting``), and a model file may forbid families
(``[circuit] resistor_family``). What would do but for one of these is named with it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from designer.base.errors import Unreachable
from designer.base.eseries import series_values
from designer.base.units import format_quantity
from designer.catalog.entries import UNITS, Kind, Mounting, PartFamily

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
