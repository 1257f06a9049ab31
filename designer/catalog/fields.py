"""What the fields of a catalogue file accept (docs/catalogue.md)."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, fields

from designer.base.errors import MISSING, InputError
from designer.base.eseries import SERIES
from designer.base.schema import (
    Accepts,
    FieldProblems,
    choice,
    fraction,
    line,
    lines,
    literal,
    number,
    one_of,
    several,
    text,
    whole_number,
)
from designer.base.units import VALUE_CODES, parse_quantity

PRICE_CLASSES = (0.01, 0.05, 0.25, 1.0, 5.0, math.inf)
"""Upper ends, in euro apiece at a hundred pieces, of the price classes 1 to 6."""

NAME = line("a name of one line")
CODE_TEXT = text("[!-~]*", "text without spaces, possibly empty")
VALUE_CODE = choice(*VALUE_CODES)
FOOTPRINT = text(r"[\w.-]+:[\w.,+-]+", "a KiCad footprint, Library:Name")
PRICE = whole_number(f"a price class, 1 (cheapest) to {len(PRICE_CLASSES)}", 1, len(PRICE_CLASSES))
GRADE = fraction("0.01 is 1 %")
SOURCES = lines("a list of data sheets: title, revision, section")
ASSUMED = lines("a list of what was not checked")
SERIES_NAMES = several("one or a list of " + ", ".join(SERIES), choice(*SERIES), single=True)
PIN = line("a pin, in quotes")


@dataclass(frozen=True)
class Figure:
    """A figure of a data sheet."""

    min: float | None
    """Minimum; None where the sheet gives none."""
    typ: float | None
    """Typical; None where the sheet gives none."""
    max: float | None
    """Maximum; None where the sheet gives none."""
    source: str
    """Where in which data sheet the figure stands."""
    assumed: bool = False
    """Whether no data sheet gives it, or it could not be compared with one."""

    @property
    def nominal(self) -> float:
        """The typical value; where none is given, the bound that is."""
        return next(v for v in (self.typ, self.max, self.min) if v is not None)

    @property
    def given(self) -> tuple[float, ...]:
        """What the sheet gives of it, ascending."""
        return tuple(v for v in (self.min, self.typ, self.max) if v is not None)

    @property
    def usual(self) -> float:
        """The typical value; where none is given, the middle of what is."""
        return sum(self.given) / len(self.given) if self.typ is None else self.typ

    @property
    def about_zero(self) -> tuple[float, float]:
        """(standard deviation, bound) of a figure that gives the size of something of either sign.

        The typical size is taken for the deviation. Of the two, the one that the sheet does not
        give is a third of the other, or three times it.
        """
        sigma = self.nominal / 3.0 if self.typ is None else self.typ
        return sigma, 3.0 * sigma if self.max is None else self.max


_BOUNDS = ("min", "typ", "max")


def figure(unit: str, *, signed: bool = False) -> Accepts:
    """A table of min, typ, max, source and assumed; numbers above 0 unless ``signed``."""
    measured = ("" if signed else " > 0") + f" in {unit}"
    bound = number(unit, f"a number{measured}", lambda value: signed or value > 0.0)
    by_kelvin = _READ_BY_KELVIN.get(unit)

    def check(value: object) -> Figure:
        if not isinstance(value, dict):
            raise ValueError
        problems = _unknown(value)
        numbers: dict[str, float] = {}
        for key in (key for key in _BOUNDS if key in value):
            try:
                numbers[key] = bound.read(
                    value[key] if by_kelvin is None else by_kelvin(value[key])
                )
            except ValueError as error:
                problems.append(InputError(None, key, literal(value[key]), str(error)))
        ascending = list(numbers.values())
        if len(numbers) == len(value.keys() & set(_BOUNDS)) and (
            not numbers or ascending != sorted(ascending)
        ):
            stated = {key: value[key] for key in numbers}
            expected = "at least one number of min, typ, max, and min <= typ <= max"
            problems.append(
                InputError(None, "", literal(stated) if stated else "no number", expected)
            )
        problems += _without_source(value)
        if problems:
            raise FieldProblems(problems)
        bounds = {key: numbers.get(key) for key in _BOUNDS}
        return Figure(**bounds, source=value["source"], assumed=value.get("assumed", False))

    expected = f"a table of min, typ, max (numbers{measured}), source and assumed"
    return Accepts(expected, check)


def _unknown(value: dict[str, object]) -> list[InputError]:
    """A problem for each key that a figure does not have."""
    keys = [field.name for field in fields(Figure)]
    return [
        InputError(None, str(key), f"unknown key {key!r}", one_of(str(key), keys))
        for key in value
        if key not in keys
    ]


def _without_source(value: dict[str, object]) -> list[InputError]:
    """What is wrong with where a figure comes from."""
    problems = []
    source, assumed = value.get("source", MISSING), value.get("assumed", False)
    if not isinstance(source, str) or not source.strip():
        stated = source if source is MISSING else literal(source)
        expected = "where the figure stands: title, revision and section of the data sheet"
        problems.append(InputError(None, "source", stated, expected))
    if not isinstance(assumed, bool):
        problems.append(InputError(None, "assumed", literal(assumed), "true or false"))
    return problems


_PER_KELVIN = re.compile(r"(.*?)\s*(ppm|%)?\s*1?/\s*(?:K|°C)")
_PARTS = {"ppm": 1e6, "%": 1e2, None: 1.0}


def _share_per_kelvin(value: object) -> object:
    """The number of a text that ends in /K, ppm/K or %/K; anything else as it is."""
    if not isinstance(value, str):
        return value
    # One space for many: the pattern would try each of them in three places.
    stated = _PER_KELVIN.fullmatch(" ".join(value.split()))
    if stated is None:
        return value
    return parse_quantity(stated[1], "") / _PARTS[stated[2]]


def _of_kelvins(value: object) -> object:
    """Text in which a difference of temperatures, or one per degree, is in kelvins."""
    return value.replace("°C", "K") if isinstance(value, str) else value


_READ_BY_KELVIN: dict[str, Callable[[object], object]] = {
    "1/K": _share_per_kelvin,
    "V/K": _of_kelvins,
    "K": _of_kelvins,
}
"""How a figure's text is read before its number, by the unit."""


def per_kelvin() -> Accepts:
    """A magnitude per kelvin: a number, or text that ends in /K, ppm/K or %/K."""

    def check(value: object) -> float:
        share = _share_per_kelvin(value)
        if isinstance(share, bool) or not isinstance(share, int | float):
            raise ValueError
        magnitude = parse_quantity(share, "")
        if magnitude < 0.0:
            raise ValueError
        return magnitude

    return Accepts('a number >= 0, per kelvin: 100e-6, or text such as "100 ppm/K"', check)


def positive(unit: str) -> Accepts:
    return number(unit, f"a number > 0 in {unit}", lambda value: value > 0.0)


def quantity(value: object) -> float | str:
    """A number, or text with a unit; the kind of part, in another field, gives the unit."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError
    return value


def quantities(expected: str, count: int | None = None) -> Accepts:
    def check(value: object) -> tuple[float | str, ...]:
        if not isinstance(value, list) or (count is not None and len(value) != count):
            raise ValueError
        return tuple(map(quantity, value))

    return Accepts(expected, check)


def pins(*wanted: str) -> Accepts:
    """A table of pin numbers by name; these names have to be there."""

    def check(value: object) -> dict[str, str]:
        if not isinstance(value, dict) or not set(wanted) <= value.keys():
            raise ValueError
        numbers = {str(name): str(PIN.check(number)) for name, number in value.items()}
        if len(set(numbers.values())) != len(numbers):
            raise ValueError("each number once")
        return numbers

    listed = f" with {', '.join(wanted)}" if wanted else ""
    return Accepts(f'a table of pins by name{listed}: {{ anode = "2" }}', check)


def pair_of_pins() -> Accepts:
    def check(value: object) -> tuple[str, str]:
        if not isinstance(value, list):
            raise ValueError
        positive, negative = map(PIN.check, value)
        return positive, negative

    return Accepts('two pins, positive and negative: ["4", "11"]', check)


def ways() -> Accepts:
    way = whole_number("", 1, 99)

    def check(value: object) -> tuple[int, int]:
        if not isinstance(value, list) or len(value) != 2:
            raise ValueError
        low, high = map(way.check, value)
        if low > high:
            raise ValueError
        return low, high

    return Accepts("two whole numbers, the fewest and the most ways, up to 99", check)


def with_ways(expected: str) -> Accepts:
    """Text in which "{ways}" or "{ways:02}" stands for the number of ways."""

    def check(value: object) -> str:
        if not isinstance(value, str) or not value.isprintable():
            raise ValueError
        rest, count = re.subn(r"\{ways(:02)?\}", "", value)
        if not count or set("{}") & set(rest):
            raise ValueError("{ways} or {ways:02} has to stand in it")
        return value

    return Accepts(expected, check)
