"""The tables of a catalogue file, key by key: what each accepts (docs/catalogue.md)."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import BaseModel, Field

from designer.base.eseries import SERIES
from designer.base.schema import (
    STRICT,
    Accepts,
    choice,
    did_you_mean,
    exactly,
    flag,
    line,
    lines,
    number,
)
from designer.base.units import VALUE_CODES, parse_quantity
from designer.catalog.entries import PRICE_CLASSES, UNITS, Figure, Kind, Use
from designer.catalog.vendor_model import PINS

# What the fields of a file accept.


def _figure(unit: str, *, signed: bool = False) -> Accepts:
    """A table of min, typ, max, source and assumed; numbers above 0 unless ``signed``."""
    measured = ("" if signed else " > 0") + (f" in {unit}" if unit else "")
    expected = f"a table of min, typ, max (numbers{measured}), source and assumed"

    def check(value: object) -> Figure:
        if not isinstance(value, dict):
            raise ValueError
        for key in value:
            if key not in ("min", "typ", "max", "source", "assumed"):
                raise ValueError(f"unknown key {key}")
        numbers = {}
        for key in ("min", "typ", "max"):
            if key in value:
                if isinstance(value[key], str) and not unit:
                    raise ValueError(f"{key} without quotes")
                numbers[key] = parse_quantity(value[key], unit)
        given = list(numbers.values())
        if not given or given != sorted(given):
            raise ValueError("at least one number, and min <= typ <= max")
        if not signed and given[0] <= 0.0:
            raise ValueError("numbers > 0")
        source, assumed = value.get("source"), value.get("assumed", False)
        if not isinstance(source, str) or not source.strip():
            raise ValueError("source says where the figure stands")
        if not isinstance(assumed, bool):
            raise ValueError("assumed is true or false")
        return Figure(numbers.get("min"), numbers.get("typ"), numbers.get("max"), source, assumed)

    return Accepts(expected, check)


def _positive(unit: str, example: str = "") -> Accepts:
    said = f" in {unit}" if unit else ""
    return number(unit, f"a number > 0{said}{example}", lambda value: value > 0.0)


def _price() -> Accepts:
    def check(value: object) -> int:
        if type(value) is not int or not 1 <= value <= len(PRICE_CLASSES):
            raise ValueError
        return value

    return Accepts(f"a price class, 1 (cheapest) to {len(PRICE_CLASSES)}", check)


def _footprint() -> Accepts:
    def check(value: object) -> str:
        if not isinstance(value, str) or not re.fullmatch(r"[\w.-]+:[\w.,+-]+", value, re.ASCII):
            raise ValueError
        return value

    return Accepts("a KiCad footprint, Library:Name", check)


def _code_text() -> Accepts:
    """Part of a part number: may be empty."""

    def check(value: object) -> str:
        if not isinstance(value, str) or not re.fullmatch(r"[!-~]*", value):
            raise ValueError
        return value

    return Accepts("text without spaces, possibly empty", check)


def _series_names() -> Accepts:
    def check(value: object) -> tuple[str, ...]:
        if not isinstance(value, list):
            raise ValueError
        for name in value:
            if name not in SERIES:
                raise ValueError(did_you_mean(name, SERIES) if isinstance(name, str) else "")
        return tuple(value)

    return Accepts("a list of " + ", ".join(SERIES), check)


def _quantities(expected: str, count: int | None = None) -> Accepts:
    """Numbers or texts with units; the kind of part, in another field, gives the unit."""

    def check(value: object) -> tuple[float | str, ...]:
        if not isinstance(value, list) or (count is not None and len(value) != count):
            raise ValueError
        for item in value:
            if isinstance(item, bool) or not isinstance(item, int | float | str):
                raise ValueError
        return tuple(value)

    return Accepts(expected, check)


def _quantity() -> Accepts:
    one = _quantities("").check
    return Accepts('a number, or text such as "22.1k"', lambda value: one([value])[0])


def _pins(*wanted: str) -> Accepts:
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


def _ways() -> Accepts:
    def check(value: object) -> tuple[int, int]:
        if not isinstance(value, list) or len(value) != 2:
            raise ValueError
        low, high = value
        if type(low) is not int or type(high) is not int or not 1 <= low <= high <= 99:
            raise ValueError
        return low, high

    return Accepts("two whole numbers, the fewest and the most ways, up to 99", check)


def _elements() -> Accepts:
    def check(value: object) -> int:
        if type(value) is not int or not 2 <= value <= 16:
            raise ValueError
        return value

    return Accepts("a whole number from 2 to 16", check)


def _with_ways(expected: str) -> Accepts:
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


def _pair_of_pins() -> Accepts:
    pins = lines("").check

    def check(value: object) -> tuple[str, str]:
        positive, negative = pins(value)
        return positive, negative

    return Accepts('two pins, positive and negative: ["4", "11"]', check)


_SOURCES = "a list of data sheets: title, revision, section"


# The tables of a file, key by key.


class PartNumberTable(BaseModel):
    model_config = STRICT
    prefix: Annotated[str, _code_text()] = ""
    code: Annotated[str, choice(*VALUE_CODES)]
    suffix: Annotated[str, _code_text()] = ""


class ExampleTable(BaseModel):
    model_config = STRICT
    value: Annotated[float | str, _quantity()]
    part_number: Annotated[str, _code_text()]


class RatingTable(BaseModel):
    model_config = STRICT
    power: Annotated[float | None, _positive("W")] = None
    voltage: Annotated[float | None, _positive("V")] = None


class FamilyTable(BaseModel):
    model_config = STRICT
    name: Annotated[str, line("a name of one line")]
    kind: Annotated[Kind, choice(*UNITS)]
    manufacturer: Annotated[str, line("a name of one line")]
    series: Annotated[tuple[str, ...], _series_names()] = ()
    range: Annotated[tuple[float | str, ...], _quantities("a range [low, high]", 2)] = ()
    values: Annotated[tuple[float | str, ...], _quantities("a list of values")] = ()
    grade: Annotated[
        float, number("", "a fraction in (0, 1): 0.01 is 1 %", lambda value: 0.0 < value < 1.0)
    ]
    temperature_coefficient: Annotated[
        float, number("", "a number >= 0, per kelvin: 100e-6", lambda value: value >= 0.0)
    ]
    drift: Annotated[
        float | None, number("", "a fraction in [0, 1): 0.005 is 0.5 %", lambda v: 0.0 <= v < 1.0)
    ] = None
    rating: RatingTable = Field(RatingTable(), description="a table of power and voltage")
    footprint: Annotated[str, _footprint()]
    dielectric: Annotated[str, line("text of one line: what it is made of")]
    price: Annotated[int, _price()]
    part_number: PartNumberTable = Field(description="a table of prefix, code, suffix")
    example: ExampleTable | None = Field(None, description="a table of value, part_number")
    sources: Annotated[tuple[str, ...], lines(_SOURCES)]
    assumed: Annotated[tuple[str, ...], lines("a list of what was not checked")] = ()
    use: Annotated[Use, choice("signal", "supply", "array")] = "signal"
    elements: Annotated[int | None, _elements()] = None
    matching: Annotated[
        float | None, number("", "a fraction in (0, 1): 0.001 is 0.1 %", lambda v: 0.0 < v < 1.0)
    ] = None


class CaseTable(BaseModel):
    model_config = STRICT
    part_number: Annotated[str, _code_text()]
    footprint: Annotated[str, _footprint()]
    manufacturer: Annotated[str | None, line("a name of one line")] = None
    pins: Annotated[dict[str, str] | None, _pins()] = None


class SectionTable(BaseModel):
    model_config = STRICT
    name: Annotated[str, line("a letter or name")]
    inverting: Annotated[str, line("a pin, in quotes")]
    noninverting: Annotated[str, line("a pin, in quotes")]
    output: Annotated[str, line("a pin, in quotes")]


class SpiceTable(BaseModel):
    model_config = STRICT
    file: Annotated[str, line("the name of a file beside this one")]
    subckt: Annotated[str, line("the name of a subcircuit in it")]
    pins: Annotated[tuple[str, ...], lines("its pins in order, of " + ", ".join(PINS))]


class OpAmpTable(BaseModel):
    model_config = STRICT
    name: Annotated[str, line("a name of one line")]
    manufacturer: Annotated[str, line("a name of one line")]
    part_number: Annotated[str, _code_text()]
    section: tuple[SectionTable, ...] = Field(strict=False, description="a list of sections")
    supply_pins: Annotated[tuple[str, str], _pair_of_pins()]
    rated_supply: Annotated[float, _positive("V")]
    supply: Annotated[Figure, _figure("V")]
    swing: Annotated[Figure, _figure("V")]
    saturation: Annotated[Figure, _figure("V")]
    offset: Annotated[Figure, _figure("V", signed=True)]
    bias: Annotated[Figure, _figure("A", signed=True)]
    gain: Annotated[Figure, _figure("V/V")]
    gbw: Annotated[Figure, _figure("Hz")]
    slew: Annotated[Figure, _figure("V/s")]
    output_current: Annotated[Figure, _figure("A")]
    output_resistance: Annotated[Figure, _figure("Ω")]
    common_mode: Annotated[Figure, _figure("V", signed=True)]
    supply_current: Annotated[Figure, _figure("A")]
    noise: Annotated[Figure, _figure("V/√Hz")]
    offset_sigma: Annotated[float, _positive("V")]
    offset_limit: Annotated[float, _positive("V")]
    price: Annotated[int, _price()]
    footprint: Annotated[str, _footprint()]
    sources: Annotated[tuple[str, ...], lines(_SOURCES)]
    recovery: Annotated[Figure | None, _figure("s")] = None
    phase_margin: Annotated[Figure | None, _figure("°")] = None
    swing_2k: Annotated[Figure | None, _figure("V")] = None
    noise_corner: Annotated[Figure | None, _figure("Hz")] = None
    phase_reversal: Annotated[bool, flag()] = False
    spice: SpiceTable | None = Field(None, description="a table of file, subckt, pins")
    input_current: Annotated[Figure | None, _figure("A")] = None
    cases: tuple[CaseTable, ...] = Field(
        (), strict=False, description="a list of tables of part_number, footprint"
    )


class DiodeTable(BaseModel):
    model_config = STRICT
    name: Annotated[str, line("a name of one line")]
    manufacturer: Annotated[str, line("a name of one line")]
    part_number: Annotated[str, _code_text()]
    forward_voltage: Annotated[Figure, _figure("V")]
    reverse_current: Annotated[Figure, _figure("A")]
    capacitance: Annotated[Figure, _figure("F")]
    recovery: Annotated[Figure, _figure("s")]
    reverse_voltage: Annotated[Figure, _figure("V")]
    price: Annotated[int, _price()]
    footprint: Annotated[str, _footprint()]
    sources: Annotated[tuple[str, ...], lines(_SOURCES)]
    pins: Annotated[dict[str, str], _pins("cathode", "anode")] = Field(
        default_factory=lambda: {"cathode": "1", "anode": "2"}
    )
    cases: tuple[CaseTable, ...] = Field(
        (), strict=False, description="a list of tables of part_number, footprint"
    )


class ReferenceTable(BaseModel):
    model_config = STRICT
    name: Annotated[str, line("a name of one line")]
    manufacturer: Annotated[str, line("a name of one line")]
    part_number: Annotated[str, _code_text()]
    voltage: Annotated[float, _positive("V")]
    grade: Annotated[
        float, number("", "a fraction in (0, 1): 0.01 is 1 %", lambda value: 0.0 < value < 1.0)
    ]
    temperature_coefficient: Annotated[
        float, number("", "a number >= 0, per kelvin: 100e-6", lambda value: value >= 0.0)
    ]
    current: Annotated[Figure, _figure("A")]
    price: Annotated[int, _price()]
    footprint: Annotated[str, _footprint()]
    sources: Annotated[tuple[str, ...], lines(_SOURCES)]
    impedance: Annotated[Figure | None, _figure("Ω")] = None
    pins: Annotated[dict[str, str], _pins("cathode", "anode")] = Field(
        default_factory=lambda: {"cathode": "1", "anode": "2"}
    )
    cases: tuple[CaseTable, ...] = Field(
        (), strict=False, description="a list of tables of part_number, footprint"
    )


class TrimmerTable(BaseModel):
    model_config = STRICT
    name: Annotated[str, line("a name of one line")]
    manufacturer: Annotated[str, line("a name of one line")]
    part_number: Annotated[str, _code_text()]
    value: Annotated[float, _positive("Ω")]
    grade: Annotated[
        float, number("", "a fraction in (0, 1): 0.01 is 1 %", lambda value: 0.0 < value < 1.0)
    ]
    rating: RatingTable = Field(RatingTable(), description="a table of power and voltage")
    pins: Annotated[dict[str, str], _pins("low", "wiper", "high")]
    adjustability: Annotated[
        float, number("", "a fraction in [0, 0.1): 1e-4 is ± 0.01 %", lambda v: 0.0 <= v < 0.1)
    ] = 0.0
    price: Annotated[int, _price()]
    footprint: Annotated[str, _footprint()]
    sources: Annotated[tuple[str, ...], lines(_SOURCES)]
    assumed: Annotated[tuple[str, ...], lines("a list of what was not checked")] = ()
    cases: tuple[CaseTable, ...] = Field(
        (), strict=False, description="a list of tables of part_number, footprint"
    )


class HeaderTable(BaseModel):
    model_config = STRICT
    name: Annotated[str, line("a name of one line")]
    manufacturer: Annotated[str, line("a name of one line")]
    part_number: Annotated[str, _with_ways('a part number with "{ways}" or "{ways:02}" in it')]
    ways: Annotated[tuple[int, int], _ways()]
    rating: RatingTable = Field(RatingTable(), description="a table of power and voltage")
    price: Annotated[int, _price()]
    footprint: Annotated[str, _with_ways('a KiCad footprint with "{ways}" or "{ways:02}" in it')]
    sources: Annotated[tuple[str, ...], lines(_SOURCES)]
    assumed: Annotated[tuple[str, ...], lines("a list of what was not checked")] = ()


class PriceTable(BaseModel):
    model_config = STRICT
    price_class: Annotated[int, _price()]
    euro: Annotated[float, number("", "a number >= 0, euro apiece", lambda value: value >= 0.0)]
    source: Annotated[str, line("where the figure comes from")]
    assumed: Annotated[bool, flag()] = False


class FileTables(BaseModel):
    model_config = STRICT
    format: Annotated[int, exactly(1, "1, the format that this version reads")]
    family: tuple[FamilyTable, ...] = Field((), strict=False, description="tables [[family]]")
    opamp: tuple[OpAmpTable, ...] = Field((), strict=False, description="tables [[opamp]]")
    diode: tuple[DiodeTable, ...] = Field((), strict=False, description="tables [[diode]]")
    reference: tuple[ReferenceTable, ...] = Field(
        (), strict=False, description="tables [[reference]]"
    )
    trimmer: tuple[TrimmerTable, ...] = Field((), strict=False, description="tables [[trimmer]]")
    header: tuple[HeaderTable, ...] = Field((), strict=False, description="tables [[header]]")
    price: tuple[PriceTable, ...] = Field((), strict=False, description="tables [[price]]")
