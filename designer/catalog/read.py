"""Catalogue files, TOML or CSV, ``format = 1`` (docs/catalogue.md), read into entries.

Each rule for part numbers is tried on every value of its family, and on the example that the file
gives with it, when the file is read.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from designer.base.errors import MISSING, InputError, InputErrors, problems_in
from designer.base.eseries import series_values
from designer.base.guarded_reading import csv_rows, decode, read_bytes
from designer.base.schema import one_of, parse_toml, validated
from designer.base.units import format_quantity, parse_quantity
from designer.catalog.entries import (
    UNITS,
    DiodeEntry,
    Header,
    OpAmp,
    PartCase,
    PartFamily,
    PartNumber,
    Price,
    Rating,
    ReferenceEntry,
    SectionPins,
    TrimmerEntry,
)
from designer.catalog.tables import (
    CaseTable,
    DiodeTable,
    FamilyTable,
    FileTables,
    HeaderTable,
    OpAmpTable,
    PriceTable,
    ReferenceTable,
    TrimmerTable,
)
from designer.catalog.vendor_model import read_vendor_model

Entry = PartFamily | OpAmp | DiodeEntry | ReferenceEntry | TrimmerEntry | Header | Price

_MAX_BYTES = 4_000_000


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
    entries = _from_toml(text, str(path))
    # A model beside the file is content too: the catalogue's hash follows it.
    spice = [e.spice for e in entries if isinstance(e, OpAmp) and e.spice is not None]
    return b"\n".join([content, *(model.content for model in spice)]), entries


def _from_toml(text: str, file: str) -> tuple[Entry, ...]:
    data = parse_toml(text, file)
    tables, problems = validated(FileTables, data, file)
    entries: list[Entry] = []
    for key, (table, make) in _SORTS.items():
        rows = _rows(table, data.get(key)) if tables is None else getattr(tables, key)
        for index, row in enumerate(rows, start=1):
            if row is not None:
                _collect(partial(make, row, file, f"{key}[{index}]"), entries, problems)
    return _all_right(entries, problems)


def _rows(table: type[BaseModel], rows: object) -> list[BaseModel | None]:
    """The tables of one sort in a file of which something is wrong; None for those that are."""
    if not isinstance(rows, list):
        return []
    return [validated(table, row, None)[0] if isinstance(row, dict) else None for row in rows]


def _collect(make: Callable[[], Entry], entries: list[Entry], problems: list[InputError]) -> None:
    """Make one more entry, or note what is wrong with it."""
    try:
        entries.append(make())
    except InputError as error:
        problems += problems_in(error)


def _all_right(entries: Sequence[Entry], problems: Sequence[InputError]) -> tuple[Entry, ...]:
    """The entries.

    Raises
    ------
    InputError : the problem, or InputErrors: every problem.
    """
    if problems:
        raise problems[0] if len(problems) == 1 else InputErrors(problems)
    return tuple(entries)


def _from_csv(text: str, file: str) -> tuple[Entry, ...]:
    """Part families, one a row; the columns are the keys of a TOML table, and ``format``."""
    rows = csv_rows(text, file)
    known = ["format", *sorted(FamilyTable.model_fields)]
    entries: list[Entry] = []
    _, header = next(rows, (1, []))
    problems = [
        InputError(file, "line 1", f"unknown column {name!r}", one_of(name, known))
        for name in header
        if name not in known
    ]
    for number, row in rows if not problems else ():
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
        cut = {key: _cell(key, cell) for key, cell in cells.items() if cell}
        table, wrong = validated(FamilyTable, cut, file, within=place)
        problems += wrong
        if table is not None:
            _collect(partial(_family, table, file, place), entries, problems)
    return _all_right(entries, problems)


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
    problems: list[InputError] = []

    def refuse(key: str, found: object, expected: str) -> None:
        problems.append(InputError(file, f"{place}.{key}", found, expected))

    unit = UNITS[table.kind]
    values: tuple[float, ...] = ()
    try:
        values = _values(table, unit)
        if not values:
            refuse("values", MISSING, "values, or series and a range that holds some")
    except InputError as error:  # raised by the series, which do not know the file
        refuse(error.field, error.found, error.expected)
    except ValueError as error:
        refuse("range", str(error), f"quantities in {unit}, ascending")
    for key, stated in (("elements", table.elements), ("matching", table.matching)):
        if (stated is not None) is not (table.use == "array"):
            expected = f'{key} with use = "array", and only there'
            refuse(key, MISSING if stated is None else stated, expected)
    rule = PartNumber(table.part_number.prefix, table.part_number.code, table.part_number.suffix)
    for value in values:
        try:
            rule.of(value)
        except ValueError as error:
            spelled = format_quantity(value, unit)
            refuse("part_number.code", rule.code, f"a code that can spell {spelled} ({error})")
            break
    if table.example is not None:
        try:
            made = rule.of(parse_quantity(table.example.value, unit))
            if made != table.example.part_number:
                refuse("example.part_number", table.example.part_number, f"{made}, by the rule")
        except ValueError as error:
            refuse("example.value", table.example.value, f"a value ({error})")
    _all_right((), problems)
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
    sections = tuple(SectionPins(**dict(section)) for section in table.section)
    problems: list[InputError] = []
    pins = [*table.supply_pins]
    for section in sections:
        pins += [section.inverting, section.noninverting, section.output]
    names = [section.name for section in sections]
    for key, used in (("section.name", names), ("section", pins)):
        for name in dict.fromkeys(used):
            if used.count(name) > 1:
                expected = "a name or pin that is used once"
                problems.append(InputError(file, f"{place}.{key}", name, expected))
    if not sections:
        problems.append(InputError(file, f"{place}.section", MISSING, "at least one section"))
    spice = None
    if table.spice is not None:
        named = table.spice
        try:
            spice = read_vendor_model(named.file, named.subckt, named.pins, Path(file).parent)
        except InputError as error:
            if error.file is None:
                error = InputError(file, f"{place}.{error.field}", error.found, error.expected)
            problems.append(error)
    _all_right((), problems)
    figures = {key: value for key, value in table if key not in ("section", "spice")}
    cases = _cases(table.cases)
    return OpAmp(**{**figures, "pins": sections, "spice": spice, "cases": cases})


def _cases(tables: Iterable[CaseTable]) -> tuple[PartCase, ...]:
    return tuple(PartCase(**dict(table)) for table in tables)


def _cased(entry: type[DiodeEntry] | type[ReferenceEntry]) -> Callable[[Any, str, str], Entry]:
    return lambda table, _file, _place: entry(**{**dict(table), "cases": _cases(table.cases)})


def _trimmer(table: TrimmerTable, _file: str, _place: str) -> TrimmerEntry:
    rating = Rating(**dict(table.rating))
    return TrimmerEntry(**{**dict(table), "rating": rating, "cases": _cases(table.cases)})


def _header(table: HeaderTable, _file: str, _place: str) -> Header:
    return Header(**{**dict(table), "rating": Rating(**dict(table.rating))})


def _price(table: PriceTable, _file: str, _place: str) -> Price:
    return Price(str(table.price_class), table.euro, table.source, table.assumed)


_SORTS: dict[str, tuple[type[BaseModel], Callable[[Any, str, str], Entry]]] = {
    "family": (FamilyTable, _family),
    "opamp": (OpAmpTable, _opamp),
    "diode": (DiodeTable, _cased(DiodeEntry)),
    "reference": (ReferenceTable, _cased(ReferenceEntry)),
    "trimmer": (TrimmerTable, _trimmer),
    "header": (HeaderTable, _header),
    "price": (PriceTable, _price),
}
"""By the name of its tables in a file: what a sort of entry is checked and made by."""
