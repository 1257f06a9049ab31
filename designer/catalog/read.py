"""Catalogue files, TOML or CSV, ``format = 1`` (docs/catalogue.md), read into entries.

Each rule for part numbers is tried on every value of its family, and on the example that the file
gives with it, when the file is read.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from designer.base.errors import InputError
from designer.base.eseries import series_values
from designer.base.reading import csv_rows, decode, read_bytes
from designer.base.schema import checked, one_of, parse_toml
from designer.base.units import format_quantity, parse_quantity
from designer.catalog.entries import (
    UNITS,
    Case,
    Diode,
    Header,
    OpAmp,
    PartFamily,
    PartNumber,
    Price,
    Rating,
    Reference,
    Section,
    Trimmer,
)
from designer.catalog.tables import CaseTable, FamilyTable, FileTables, OpAmpTable
from designer.catalog.vendor_model import read_vendor_model

Entry = PartFamily | OpAmp | Diode | Reference | Trimmer | Header | Price

_MAX_BYTES = 4_000_000


def read_catalog_file(path: Path) -> tuple[bytes, tuple[Entry, ...]]:
    """Content and entries of one file.

    Raises
    ------
    InputError : the file cannot be read, or anything in it is wrong.
    """
    content = read_bytes(path, "a catalogue file that can be read", most=_MAX_BYTES)
    text = decode(content, path)
    if path.suffix == ".csv":
        return content, tuple(_from_csv(text, str(path)))
    entries = tuple(_from_toml(text, str(path)))
    # A model beside the file is content too: the catalogue's hash follows it.
    spice = [e.spice for e in entries if isinstance(e, OpAmp) and e.spice is not None]
    return b"\n".join([content, *(model.content for model in spice)]), entries


def _from_toml(text: str, file: str) -> Iterable[Entry]:
    tables = checked(FileTables, parse_toml(text, file), file)
    for index, family in enumerate(tables.family, start=1):
        yield _family(family, file, f"family[{index}]")
    for index, opamp in enumerate(tables.opamp, start=1):
        yield _opamp(opamp, file, f"opamp[{index}]")
    for diode in tables.diode:
        yield Diode(**{**dict(diode), "cases": _cases(diode.cases)})
    for reference in tables.reference:
        yield Reference(**{**dict(reference), "cases": _cases(reference.cases)})
    for trimmer in tables.trimmer:
        rating = Rating(**dict(trimmer.rating))
        yield Trimmer(**{**dict(trimmer), "rating": rating, "cases": _cases(trimmer.cases)})
    for header in tables.header:
        yield Header(**{**dict(header), "rating": Rating(**dict(header.rating))})
    for price in tables.price:
        yield Price(str(price.price_class), price.euro, price.source, price.assumed)


def _from_csv(text: str, file: str) -> Iterable[Entry]:
    """Part families, one a row; the columns are the keys of a TOML table, and ``format``."""
    rows = csv_rows(text, file)
    known = ["format", *sorted(FamilyTable.model_fields)]
    _, header = next(rows, (1, []))
    for name in header:
        if name not in known:
            raise InputError(file, "line 1", f"unknown column {name!r}", one_of(name, known))
    for number, row in rows:
        place = f"line {number}"
        if not row:
            continue
        if len(row) != len(header):
            raise InputError(file, place, f"{len(row)} cells", f"{len(header)}, as the header")
        cells = dict(zip(header, (cell.strip() for cell in row), strict=True))
        if cells.pop("format", "") != "1":
            raise InputError(file, f"{place}.format", "no 1", "1 in a column format")
        table = {key: _cell(key, cell) for key, cell in cells.items() if cell}
        yield _family(checked(FamilyTable, table, file, within=place), file, place)


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


def _family(table: FamilyTable, file: str, place: str) -> PartFamily:
    def refuse(key: str, found: object, expected: str) -> InputError:
        return InputError(file, f"{place}.{key}", found, expected)

    unit = UNITS[table.kind]
    try:
        values = _values(table, unit)
    except InputError as error:  # raised by the series, which do not know the file
        raise refuse(error.field, error.found, error.expected) from None
    except ValueError as error:
        raise refuse("range", str(error), f"quantities in {unit}, ascending") from None
    for key, stated in (("elements", table.elements), ("matching", table.matching)):
        if (stated is not None) is not (table.use == "array"):
            expected = f'{key} with use = "array", and only there'
            raise refuse(key, "nothing" if stated is None else stated, expected)
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
        drift=table.drift,
        use=table.use,
        elements=table.elements or 1,
        matching=table.matching,
    )


def _values(table: FamilyTable, unit: str) -> tuple[float, ...]:
    """What can be bought: the values that are listed, and those of the series in the range."""
    values = {parse_quantity(value, unit) for value in table.values}
    if table.range:
        low, high = (parse_quantity(end, unit) for end in table.range)
        values.update(series_values(table.series, low, high).tolist())
    if any(value <= 0.0 for value in values):
        raise ValueError("a value that is not > 0")
    return tuple(sorted(values))


def _opamp(table: OpAmpTable, file: str, place: str) -> OpAmp:
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
    cases = _cases(table.cases)
    return OpAmp(**{**figures, "pins": sections, "spice": spice, "cases": cases})


def _cases(tables: Iterable[CaseTable]) -> tuple[Case, ...]:
    return tuple(Case(**dict(table)) for table in tables)
