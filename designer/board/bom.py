"""The bill of materials: one row for each thing to buy, in our columns."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from designer.base.csv_tables import csv_text
from designer.base.natural_sort import natural_key
from designer.base.views import View
from designer.board.component import Component

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
    "substitute",
)
KINDS = (
    "resistor",
    "array",
    "capacitor",
    "diode",
    "reference",
    "op-amp",
    "trimmer",
    "connector",
    "test point",
)
"""Kinds of components in the order of the bill."""


@dataclass(frozen=True)
class Line:
    """A line of the bill: pieces of one part."""

    quantity: int
    """How many pieces."""
    designators: tuple[str, ...]
    """Designators on the board, where the pieces go."""
    value: str
    """Value as people write it."""
    description: str
    """What it is, in words."""
    manufacturer: str
    """Name of the maker."""
    part_number: str
    """The maker's part number, which is ordered."""
    footprint: str
    """Footprint in KiCad, as "Library:Name"."""
    rating: str
    """What it has to stand."""
    price_class: int
    """Price class, from 1."""
    grade: str
    """Tolerance, as text."""
    substitute: str = ""
    """Another maker's part number, with the maker in front, or ""."""

    def cells(self) -> dict[str, str]:
        row = {name: str(getattr(self, name)) for name in COLUMNS}
        return {**row, "designators": " ".join(self.designators)}


def bill(found: Iterable[Component]) -> tuple[Line, ...]:
    """What is bought of these components, like parts together: by kind, then by value.

    The generator is an instrument and stands on no bill; nor does what is not fitted.
    """
    groups: dict[tuple[str, str, str], list[Component]] = {}
    for component in found:
        if View.BOM in component.views and component.bought is not None:
            bought = component.bought
            key = (component.kind, bought.manufacturer, bought.part_number)
            groups.setdefault(key, []).append(component)
    lines = [(_place(here[0]), _line(here)) for here in groups.values()]
    return tuple(line for _, line in sorted(lines, key=lambda pair: pair[0]))


def _place(component: Component) -> tuple[object, ...]:
    number = component.bought.part_number if component.bought else ""
    return KINDS.index(component.kind), component.quantity or 0.0, number


def _line(here: Sequence[Component]) -> Line:
    first = here[0]
    bought = first.bought
    assert bought is not None
    said = [] if first.kind in ("resistor", "capacitor") else [c.description for c in here]
    if first.kind != "op-amp":
        said += [c.role for c in here]
    said += [c.bought.note for c in here if c.bought is not None and c.bought.note]
    return Line(
        quantity=len(here),
        designators=tuple(sorted((c.reference for c in here), key=natural_key)),
        value=first.value,
        description="; ".join(dict.fromkeys(said)),
        manufacturer=bought.manufacturer,
        part_number=bought.part_number,
        footprint=first.footprint,
        rating=bought.rating,
        price_class=bought.price_class,
        grade="" if bought.grade is None else f"{bought.grade:.3g}",
        substitute=bought.substitute,
    )


def bill_csv(lines: Iterable[Line]) -> str:
    """The bill as CSV."""
    return csv_text(COLUMNS, (line.cells() for line in lines))
