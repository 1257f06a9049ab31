"""The bill of materials: one row for each thing to buy."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from designer import catalogentry
from designer.catalog import Catalog, Kind, Rating
from designer.circuit import Capacitor, Circuit, Diode, Reference, Resistor
from designer.modelfile import CircuitSpec
from designer.quantity import format_quantity

COLUMNS = (
    "quantity",
    "designators",
    "value",
    "description",
    "manufacturer",
    "part_number",
    "footprint",
    "rating",
    "price_class",
    "grade",
)
_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")


@dataclass(frozen=True)
class Line:
    """quantity pieces of one part; designators name where they go."""

    quantity: int
    designators: tuple[str, ...]
    value: str
    description: str
    manufacturer: str
    part_number: str
    footprint: str
    rating: str
    price_class: int
    grade: str

    def cells(self) -> dict[str, str]:
        row = {name: str(getattr(self, name)) for name in COLUMNS}
        return {**row, "designators": " ".join(self.designators)}


def bill(
    circuit: Circuit,
    spec: CircuitSpec,
    catalog: Catalog,
    grades: Mapping[str, float] | None = None,
) -> tuple[Line, ...]:
    """Passives, diodes, references and op-amp packages; the generator is an instrument, no part.

    grades : of the parts that are bought at another grade than their kind (``partgrades.bought``).

    Raises
    ------
    Unreachable : a value that cannot be bought at the grade.
    InputError : a diode, a reference or an op-amp that is not in the catalogue.
    """
    passives: tuple[tuple[Kind, str, float, Sequence[Resistor | Capacitor]], ...] = (
        ("resistor", "Ω", spec.resistor_grade, circuit.resistors),
        ("capacitor", "F", spec.capacitor_grade, circuit.capacitors),
    )
    lines = []
    for kind, unit, grade, parts in passives:
        of = {p.name: (grades or {}).get(p.name, grade) for p in parts}
        for value, own in sorted({(p.value, of[p.name]) for p in parts}):
            here = [p for p in parts if (p.value, of[p.name]) == (value, own)]
            part = catalog.part(kind, value, own)
            lines.append(
                Line(
                    quantity=len(here),
                    designators=tuple(sorted((p.name for p in here), key=natural)),
                    value=format_quantity(value, unit),
                    description="; ".join(dict.fromkeys(p.role for p in here)),
                    manufacturer=part.manufacturer,
                    part_number=part.part_number,
                    footprint=part.footprint,
                    rating=_rating(part.rating),
                    price_class=part.price,
                    grade=f"{part.family.grade:.3g}",
                )
            )
    lines += [*_diodes(circuit, catalog), *_references(circuit, catalog)]
    opamp = catalog.opamp(circuit.opamp)
    if circuit.packages:
        lines.append(
            Line(
                quantity=len(circuit.packages),
                designators=circuit.packages,
                value=opamp.name,
                description=f"op-amp, {opamp.sections} sections; {len(circuit.sections)} used",
                manufacturer=opamp.manufacturer,
                part_number=opamp.part_number,
                footprint=opamp.footprint,
                rating=f"± {circuit.supply:g} V supply",
                price_class=opamp.price,
                grade="",
            )
        )
    return tuple(lines)


def _diodes(circuit: Circuit, catalog: Catalog) -> Iterator[Line]:
    for name in sorted({d.model.name for d in circuit.diodes}):
        here = [d for d in circuit.diodes if d.model.name == name]
        part = catalog.diode(name)
        volts = format_quantity(part.reverse_voltage.nominal, "V")
        yield _named(part, here, "diode", f"{volts} reverse", "")


def _references(circuit: Circuit, catalog: Catalog) -> Iterator[Line]:
    for name in sorted({r.model for r in circuit.references}):
        here = [r for r in circuit.references if r.model == name]
        part = catalog.reference(name)
        volts = format_quantity(part.voltage, "V")
        yield _named(part, here, "shunt reference", volts, f"{part.grade:.3g}")


def _named(
    part: catalogentry.Diode | catalogentry.Reference,
    here: Sequence[Diode | Reference],
    kind: str,
    rating: str,
    grade: str,
) -> Line:
    """The line of parts that are bought by name."""
    return Line(
        quantity=len(here),
        designators=tuple(sorted((p.name for p in here), key=natural)),
        value=part.name,
        description="; ".join([kind, *dict.fromkeys(p.role for p in here)]),
        manufacturer=part.manufacturer,
        part_number=part.part_number,
        footprint=part.footprint,
        rating=rating,
        price_class=part.price,
        grade=grade,
    )


def bill_csv(lines: Iterable[Line]) -> str:
    """The bill as CSV."""
    return csv_text(COLUMNS, (line.cells() for line in lines))


def csv_text(columns: Sequence[str], rows: Iterable[Mapping[str, str]]) -> str:
    """CSV in which no cell of text can start a formula when a spreadsheet opens it."""
    out = io.StringIO()
    writer = csv.DictWriter(out, columns, lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({name: safe_cell(row[name]) for name in columns})
    return out.getvalue()


def safe_cell(text: str) -> str:
    """The text, after an apostrophe where it would start a formula; numbers stay numbers."""
    if not text.startswith(_FORMULA):
        return text
    try:
        float(text)
    except ValueError:
        return "'" + text
    return text


def natural(name: str) -> tuple[object, ...]:
    """Sort key: R2 before R10."""
    return tuple(int(t) if t.isdigit() else t for t in re.split(r"(\d+)", name))


def _rating(rating: Rating) -> str:
    shown = []
    if rating.power is not None:
        shown.append(format_quantity(rating.power, "W"))
    if rating.voltage is not None:
        shown.append(format_quantity(rating.voltage, "V"))
    return ", ".join(shown)
