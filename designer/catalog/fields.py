"""What the fields of a catalogue file accept (docs/catalogue.md)."""

from __future__ import annotations

import re

from designer.base.errors import MISSING
from designer.base.eseries import SERIES
from designer.base.schema import (
    Accepts,
    FieldProblems,
    Problem,
    did_you_mean,
    line,
    lines,
    number,
    one_of,
    shown,
)
from designer.base.units import parse_quantity
from designer.catalog.entries import PRICE_CLASSES, Figure

SOURCES = "a list of data sheets: title, revision, section"


def figure(unit: str, *, signed: bool = False) -> Accepts:
    """A table of min, typ, max, source and assumed; numbers above 0 unless ``signed``."""
    measured = ("" if signed else " > 0") + (f" in {unit}" if unit else "")
    expected = f"a table of min, typ, max (numbers{measured}), source and assumed"

    def check(value: object) -> Figure:
        if not isinstance(value, dict):
            raise ValueError
        numbers, problems = _bounds(value, unit, signed)
        problems = [*_unknown(value, _FIGURE), *problems]
        source, assumed = value.get("source", MISSING), value.get("assumed", False)
        if not isinstance(source, str) or not source.strip():
            said = "where the figure stands: title, revision and section of the data sheet"
            problems.append(Problem("source", _shown(source), said))
        if not isinstance(assumed, bool):
            problems.append(Problem("assumed", _shown(assumed), "true or false"))
        if problems:
            raise FieldProblems(problems)
        return Figure(
            numbers.get("min"), numbers.get("typ"), numbers.get("max"), str(source), bool(assumed)
        )

    return Accepts(expected, check)


_BOUNDS = ("min", "typ", "max")
_FIGURE = (*_BOUNDS, "source", "assumed")


def _bounds(
    value: dict[str, object], unit: str, signed: bool
) -> tuple[dict[str, float], list[Problem]]:
    """The numbers of a figure, and what is wrong with them."""
    numbers: dict[str, float] = {}
    problems = []
    for key in (key for key in _BOUNDS if key in value):
        given = value[key]
        expected = "a number" + ("" if signed else " > 0") + (f" in {unit}" if unit else "")
        try:
            if isinstance(given, bool) or not isinstance(given, int | float | str):
                raise ValueError
            if isinstance(given, str) and not unit:
                raise ValueError("without quotes")
            number_ = parse_quantity(given, unit)
            if not signed and number_ <= 0.0:
                raise ValueError
            numbers[key] = number_
        except ValueError as error:
            detail = f" ({error})" if str(error) else ""
            problems.append(Problem(key, _shown(given), expected + detail))
    found = list(numbers.values())
    if not problems and (not found or found != sorted(found)):
        stated = {key: value[key] for key in _BOUNDS if key in value}
        expected = "at least one number of min, typ, max, and min <= typ <= max"
        problems.append(Problem("", _shown(stated) if stated else "no number", expected))
    return numbers, problems


def _unknown(value: dict[str, object], known: tuple[str, ...]) -> list[Problem]:
    """A problem for each key that is none of those known."""
    return [
        Problem(str(key), f"unknown key {key!r}", one_of(str(key), known))
        for key in value
        if key not in known
    ]


def _shown(value: object) -> object:
    return value if value is MISSING else shown(value)


def per_kelvin() -> Accepts:
    """A magnitude per kelvin: a number, or text that ends in /K or ppm/K."""
    pattern = re.compile(r"(.*?)\s*(ppm)?\s*1?/\s*(?:K|°C)")

    def check(value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            raise ValueError
        if isinstance(value, str):
            stated = pattern.fullmatch(value.strip())
            if stated is None:
                raise ValueError
            value = parse_quantity(stated[1] + ("u" if stated[2] else ""), "")
        read = parse_quantity(value, "")
        if read < 0.0:
            raise ValueError
        return read

    expected = 'a number >= 0, per kelvin: 100e-6, or text such as "100 ppm/K"'
    return Accepts(expected, check)


def positive(unit: str, example: str = "") -> Accepts:
    said = f" in {unit}" if unit else ""
    return number(unit, f"a number > 0{said}{example}", lambda value: value > 0.0)


def price() -> Accepts:
    def check(value: object) -> int:
        if type(value) is not int or not 1 <= value <= len(PRICE_CLASSES):
            raise ValueError
        return value

    return Accepts(f"a price class, 1 (cheapest) to {len(PRICE_CLASSES)}", check)


def footprint() -> Accepts:
    def check(value: object) -> str:
        if not isinstance(value, str) or not re.fullmatch(r"[\w.-]+:[\w.,+-]+", value, re.ASCII):
            raise ValueError
        return value

    return Accepts("a KiCad footprint, Library:Name", check)


def code_text() -> Accepts:
    """Part of a part number: may be empty."""

    def check(value: object) -> str:
        if not isinstance(value, str) or not re.fullmatch(r"[!-~]*", value):
            raise ValueError
        return value

    return Accepts("text without spaces, possibly empty", check)


def series_names() -> Accepts:
    def check(value: object) -> tuple[str, ...]:
        names = [value] if isinstance(value, str) else value
        if not isinstance(names, list):
            raise ValueError
        for name in names:
            if name not in SERIES:
                raise ValueError(did_you_mean(name, SERIES) if isinstance(name, str) else "")
        return tuple(names)

    return Accepts("one or a list of " + ", ".join(SERIES), check)


def quantities(expected: str, count: int | None = None) -> Accepts:
    """Numbers or texts with units; the kind of part, in another field, gives the unit."""

    def check(value: object) -> tuple[float | str, ...]:
        if not isinstance(value, list) or (count is not None and len(value) != count):
            raise ValueError
        for item in value:
            if isinstance(item, bool) or not isinstance(item, int | float | str):
                raise ValueError
        return tuple(value)

    return Accepts(expected, check)


def quantity() -> Accepts:
    one = quantities("").check
    return Accepts('a number, or text such as "22.1k"', lambda value: one([value])[0])


def pins(*wanted: str) -> Accepts:
    """A table of pin numbers by name; these names have to be there."""
    one = line("").check
    listed = f" with {', '.join(wanted)}" if wanted else ""

    def check(value: object) -> dict[str, str]:
        if not isinstance(value, dict) or not set(wanted) <= value.keys():
            raise ValueError
        numbers = {str(name): str(one(number)) for name, number in value.items()}
        if len(set(numbers.values())) != len(numbers):
            raise ValueError("each number once")
        return numbers

    return Accepts(f'a table of pins by name{listed}: {{ anode = "2" }}', check)


def ways() -> Accepts:
    def check(value: object) -> tuple[int, int]:
        if not isinstance(value, list) or len(value) != 2:
            raise ValueError
        low, high = value
        if type(low) is not int or type(high) is not int or not 1 <= low <= high <= 99:
            raise ValueError
        return low, high

    return Accepts("two whole numbers, the fewest and the most ways, up to 99", check)


def elements() -> Accepts:
    def check(value: object) -> int:
        if type(value) is not int or not 2 <= value <= 16:
            raise ValueError
        return value

    return Accepts("a whole number from 2 to 16", check)


def with_ways(expected: str) -> Accepts:
    """Text in which "{ways}" or "{ways:02}" stands for the number of ways."""

    def check(value: object) -> str:
        if not isinstance(value, str) or not value.isprintable():
            raise ValueError
        if not re.search(r"\{ways(:02)?\}", value) or set("{}") & set(
            re.sub(r"\{ways(:02)?\}", "", value)
        ):
            raise ValueError("{ways} or {ways:02} has to stand in it")
        return value

    return Accepts(expected, check)


def pair_of_pins() -> Accepts:
    pins = lines("").check

    def check(value: object) -> tuple[str, str]:
        positive, negative = pins(value)
        return positive, negative

    return Accepts('two pins, positive and negative: ["4", "11"]', check)
