"""The bill of materials: one row for each thing to buy, in our columns."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from designer.base.csv_tables import csv_text
from designer.base.frames import frame
from designer.base.natural_sort import natural_key
from designer.base.views import View
from designer.board.board_parts import Designed, board_circuit
from designer.board.component import Component, components, to_buy
from designer.catalog.stock_list import StockRow

if TYPE_CHECKING:
    import pandas as pd

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
    "assumed",
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
    "jack",
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
    grade: str
    """Tolerance, as text."""
    substitute: str = ""
    """Another maker's part number, with the maker in front, or ""."""
    assumed: str = ""
    """Figures of the catalogue that no data sheet was compared with, in words."""
    stock: tuple[StockRow, ...] = ()
    """As what distributors sell it, by their lists, in the order of these."""

    def cells(self) -> dict[str, str]:
        row = {name: str(getattr(self, name)) for name in COLUMNS}
        return {**row, "designators": " ".join(self.designators)}


def bill(listed: Iterable[Component], stock: Sequence[StockRow] = ()) -> tuple[Line, ...]:
    """What is bought of these components, like parts together: by kind, then by value.

    stock : lists of distributors, the nearest first.
    The generator is an instrument and stands on no bill; nor does what is not fitted.
    """
    groups: dict[tuple[object, ...], list[Component]] = {}
    for component in listed:
        if View.BOM in component.views and component.bought is not None:
            bought = component.bought
            key = (component.kind, bought.manufacturer, bought.part_number)
            groups.setdefault(key, []).append(component)
    alike = sorted(groups.values(), key=lambda group: _place(group[0]))
    return tuple(_line(group, stock) for group in alike)


def _place(component: Component) -> tuple[object, ...]:
    number = component.bought.part_number if component.bought else ""
    return KINDS.index(component.kind), component.quantity or 0.0, number


def _line(alike: Sequence[Component], stock: Sequence[StockRow]) -> Line:
    first = alike[0]
    bought = first.bought
    assert bought is not None
    part = bought.part_number, first.kind, first.quantity, first.footprint, bought.grade
    words = [] if first.kind in ("resistor", "capacitor") else [c.description for c in alike]
    if first.kind != "op-amp":
        words += [c.role for c in alike]
    words += [c.bought.note for c in alike if c.bought is not None and c.bought.note]
    return Line(
        quantity=len(alike),
        designators=tuple(sorted((c.reference for c in alike), key=natural_key)),
        value=first.value,
        description="; ".join(dict.fromkeys(words)),
        manufacturer=bought.manufacturer,
        part_number=bought.part_number,
        footprint=first.footprint,
        rating=bought.rating,
        price_class=bought.price_class,
        grade="" if bought.grade is None else f"{bought.grade:.3g}",
        substitute=bought.substitute,
        assumed="; ".join(bought.assumed),
        stock=tuple(row for row in stock if row.fits(*part)),
    )


def bill_csv(lines: Iterable[Line]) -> str:
    """The bill as CSV."""
    return csv_text(COLUMNS, (line.cells() for line in lines))


def bill_of_materials(synthesis: Designed) -> pd.DataFrame:
    """What is to be bought for one board: the rows of ``bom.csv``, with numbers as numbers.

    synthesis : what ``synthesise`` or ``run`` returns. The designators of a row stand in one
    text, and so does the grade, which a part may lack.

    Raises
    ------
    InputError : a case or a part that the catalogue does not have.
    Unreachable : a value that cannot be bought.
    """
    circuit, choice = board_circuit(synthesis)
    lines = bill(to_buy(components(circuit, synthesis.catalog, choice), choice))
    numbers = ("quantity", "price_class")
    rows = [{**line.cells(), **{n: getattr(line, n) for n in numbers}} for line in lines]
    return frame(rows, COLUMNS)
