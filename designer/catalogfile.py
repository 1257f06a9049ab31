"""Catalogue files, TOML or CSV, ``format = 1`` (docs/catalogue.md), read into entries.

Each rule for part numbers is tried on every value of its family, and on the example that the file
gives with it, when the file is read.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, Field

from designer.catalogentry import (
    PRICE_CLASSES,
    UNITS,
    Diode,
    Figure,
    Kind,
    OpAmp,
    PartFamily,
    PartNumber,
    Rating,
    Reference,
    Section,
)
from designer.errors import InputError
from designer.eseries import SERIES, series_values
from designer.quantity import VALUE_CODES, format_quantity, parse_quantity
from designer.schema import (
    STRICT,
    Accepts,
    checked,
    choice,
    did_you_mean,
    exactly,
    flag,
    line,
    lines,
    number,
    one_of,
    parse_toml,
)
from designer.vendor_model import PINS, read_vendor_model

Entry = PartFamily | OpAmp | Diode | Reference

_MAX_BYTES = 4_000_000


def read_catalog_file(path: Path) -> tuple[bytes, tuple[Entry, ...]]:
    """Content and entries of one file.

    Raises
    ------
    InputError : the file cannot be read, or anything in it is wrong.
    """
    try:
        with path.open("rb") as stream:
            content = stream.read(_MAX_BYTES + 1)
    except OSError as error:
        reason = error.strerror or "unreadable"
        raise InputError(path, "the file", reason, "a catalogue file that can be read") from None
    if len(content) > _MAX_BYTES:
        raise InputError(path, "the file", f"more than {_MAX_BYTES} bytes", "a catalogue file")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        row = content[: error.start].count(b"\n") + 1
        found = f"byte 0x{content[error.start]:02x}"
        raise InputError(path, f"line {row}", found, "text in UTF-8") from None
    if path.suffix == ".csv":
        return content, tuple(_from_csv(text, str(path)))
    entries = tuple(_from_toml(text, str(path)))
    # A model beside the file is content too: the catalogue's hash follows it.
    spice = [e.spice for e in entries if isinstance(e, OpAmp) and e.spice is not None]
    return b"\n".join([content, *(model.content for model in spice)]), entries


def _from_toml(text: str, file: str) -> Iterable[Entry]:
    tables = checked(_File, parse_toml(text, file), file)
    for index, family in enumerate(tables.family, start=1):
        yield _family(family, file, f"family[{index}]")
    for index, opamp in enumerate(tables.opamp, start=1):
        yield _opamp(opamp, file, f"opamp[{index}]")
    for diode in tables.diode:
        yield Diode(**dict(diode))
    for reference in tables.reference:
        yield Reference(**dict(reference))


def _from_csv(text: str, file: str) -> Iterable[Entry]:
    """Part families, one a row; the columns are the keys of a TOML table, and ``format``."""
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    known = ["format", *sorted(_FamilyTable.model_fields)]
    try:
        header = next(reader, [])
        for name in header:
            if name not in known:
                raise InputError(file, "line 1", f"unknown column {name!r}", one_of(name, known))
        for row in reader:
            place = f"line {reader.line_num}"
            if not row:
                continue
            if len(row) != len(header):
                raise InputError(file, place, f"{len(row)} cells", f"{len(header)}, as the header")
            cells = dict(zip(header, (cell.strip() for cell in row), strict=True))
            if cells.pop("format", "") != "1":
                raise InputError(file, f"{place}.format", "no 1", "1 in a column format")
            table = {key: _cell(key, cell) for key, cell in cells.items() if cell}
            yield _family(checked(_FamilyTable, table, file, within=place), file, place)
    except csv.Error as error:
        raise InputError(file, f"line {reader.line_num}", str(error), "a CSV file") from None


def _cell(key: str, cell: str) -> object:
    """A cell as TOML would give it: lists by spaces (prose by "|"), tables as "key=value …"."""
    if key in ("sources", "assumed"):
        return [part.strip() for part in cell.split("|")]
    if key in ("series", "range", "values"):
        return cell.split()
    if key in ("rating", "part_number", "example"):
        return {word.partition("=")[0]: word.partition("=")[2] for word in cell.split()}
    if key == "price":
        return int(cell) if cell.isdecimal() and cell.isascii() else cell
    if key in ("grade", "temperature_coefficient"):
        try:
            return parse_quantity(cell, "")
        except ValueError:
            return cell
    return cell


def _family(table: _FamilyTable, file: str, place: str) -> PartFamily:
    def refuse(key: str, found: object, expected: str) -> InputError:
        return InputError(file, f"{place}.{key}", found, expected)

    unit = UNITS[table.kind]
    try:
        values = _values(table, unit)
    except InputError as error:  # raised by the series, which do not know the file
        raise refuse(error.field, error.found, error.expected) from None
    except ValueError as error:
        raise refuse("range", str(error), f"quantities in {unit}, ascending") from None
    if not values:
        raise refuse("values", "nothing", "values, or series and a range that holds some")
    rule = PartNumber(table.part_number.prefix, table.part_number.code, table.part_number.suffix)
    for value in values:
        try:
            rule.of(value)
        except ValueError as error:
            spelled = format_quantity(value, unit)
            raise refuse(
                "part_number.code", rule.code, f"a code that can spell {spelled} ({error})"
            ) from None
    if table.example is not None:
        try:
            made = rule.of(parse_quantity(table.example.value, unit))
        except ValueError as error:
            raise refuse("example.value", table.example.value, f"a value ({error})") from None
        if made != table.example.part_number:
            raise refuse("example.part_number", table.example.part_number, f"{made}, by the rule")
    return PartFamily(
        name=table.name,
        kind=table.kind,
        manufacturer=table.manufacturer,
        series=table.series,
        range=(values[0], values[-1]),
        grade=table.grade,
        temperature_coefficient=table.temperature_coefficient,
        rating=Rating(table.rating.power, table.rating.voltage),
        footprint=table.footprint,
        dielectric=table.dielectric,
        price=table.price,
        part_number=rule,
        sources=table.sources,
        assumed=table.assumed,
        values=values,
    )


def _values(table: _FamilyTable, unit: str) -> tuple[float, ...]:
    """What can be bought: the values that are listed, and those of the series in the range."""
    values = {parse_quantity(value, unit) for value in table.values}
    if table.range:
        low, high = (parse_quantity(end, unit) for end in table.range)
        values.update(series_values(table.series, low, high).tolist())
    if any(value <= 0.0 for value in values):
        raise ValueError("a value that is not > 0")
    return tuple(sorted(values))


def _opamp(table: _OpAmpTable, file: str, place: str) -> OpAmp:
    sections = tuple(Section(**dict(section)) for section in table.section)
    pins = [*table.supply_pins]
    for section in sections:
        pins += [section.inverting, section.noninverting, section.output]
    names = [section.name for section in sections]
    for key, used in (("section.name", names), ("section", pins)):
        for name in used:
            if used.count(name) > 1:
                raise InputError(file, f"{place}.{key}", name, "a name or pin that is used once")
    if not sections:
        raise InputError(file, f"{place}.section", "nothing", "at least one section")
    spice = None
    if table.spice is not None:
        named = table.spice
        try:
            spice = read_vendor_model(named.file, named.subckt, named.pins, Path(file).parent)
        except InputError as error:
            if error.file is not None:
                raise
            raise InputError(file, f"{place}.{error.field}", error.found, error.expected) from None
    figures = {key: value for key, value in table if key not in ("section", "spice")}
    return OpAmp(**{**figures, "pins": sections, "spice": spice})


# What the fields of a file accept.


def _figure(unit: str) -> Accepts:
    """A table of min, typ, max, source and assumed."""
    measured = f" in {unit}" if unit else ""
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


def _pair_of_pins() -> Accepts:
    pins = lines("").check

    def check(value: object) -> tuple[str, str]:
        positive, negative = pins(value)
        return positive, negative

    return Accepts('two pins, positive and negative: ["4", "11"]', check)


_SOURCES = "a list of data sheets: title, revision, section"


# The tables of a file, key by key.


class _PartNumberTable(BaseModel):
    model_config = STRICT
    prefix: Annotated[str, _code_text()] = ""
    code: Annotated[str, choice(*VALUE_CODES)]
    suffix: Annotated[str, _code_text()] = ""


class _ExampleTable(BaseModel):
    model_config = STRICT
    value: Annotated[float | str, _quantity()]
    part_number: Annotated[str, _code_text()]


class _RatingTable(BaseModel):
    model_config = STRICT
    power: Annotated[float | None, _positive("W")] = None
    voltage: Annotated[float | None, _positive("V")] = None


class _FamilyTable(BaseModel):
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
    rating: _RatingTable = Field(_RatingTable(), description="a table of power and voltage")
    footprint: Annotated[str, _footprint()]
    dielectric: Annotated[str, line("text of one line: what it is made of")]
    price: Annotated[int, _price()]
    part_number: _PartNumberTable = Field(description="a table of prefix, code, suffix")
    example: _ExampleTable | None = Field(None, description="a table of value, part_number")
    sources: Annotated[tuple[str, ...], lines(_SOURCES)]
    assumed: Annotated[tuple[str, ...], lines("a list of what was not checked")] = ()


class _SectionTable(BaseModel):
    model_config = STRICT
    name: Annotated[str, line("a letter or name")]
    inverting: Annotated[str, line("a pin, in quotes")]
    noninverting: Annotated[str, line("a pin, in quotes")]
    output: Annotated[str, line("a pin, in quotes")]


class _SpiceTable(BaseModel):
    model_config = STRICT
    file: Annotated[str, line("the name of a file beside this one")]
    subckt: Annotated[str, line("the name of a subcircuit in it")]
    pins: Annotated[tuple[str, ...], lines("its pins in order, of " + ", ".join(PINS))]


class _OpAmpTable(BaseModel):
    model_config = STRICT
    name: Annotated[str, line("a name of one line")]
    manufacturer: Annotated[str, line("a name of one line")]
    part_number: Annotated[str, _code_text()]
    section: tuple[_SectionTable, ...] = Field(strict=False, description="a list of sections")
    supply_pins: Annotated[tuple[str, str], _pair_of_pins()]
    rated_supply: Annotated[float, _positive("V")]
    supply: Annotated[Figure, _figure("V")]
    swing: Annotated[Figure, _figure("V")]
    saturation: Annotated[Figure, _figure("V")]
    offset: Annotated[Figure, _figure("V")]
    bias: Annotated[Figure, _figure("A")]
    gain: Annotated[Figure, _figure("V/V")]
    gbw: Annotated[Figure, _figure("Hz")]
    slew: Annotated[Figure, _figure("V/s")]
    output_current: Annotated[Figure, _figure("A")]
    output_resistance: Annotated[Figure, _figure("Ω")]
    common_mode: Annotated[Figure, _figure("V")]
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
    spice: _SpiceTable | None = Field(None, description="a table of file, subckt, pins")


class _DiodeTable(BaseModel):
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


class _ReferenceTable(BaseModel):
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


class _File(BaseModel):
    model_config = STRICT
    format: Annotated[int, exactly(1, "1, the format that this version reads")]
    family: tuple[_FamilyTable, ...] = Field((), strict=False, description="tables [[family]]")
    opamp: tuple[_OpAmpTable, ...] = Field((), strict=False, description="tables [[opamp]]")
    diode: tuple[_DiodeTable, ...] = Field((), strict=False, description="tables [[diode]]")
    reference: tuple[_ReferenceTable, ...] = Field(
        (), strict=False, description="tables [[reference]]"
    )
