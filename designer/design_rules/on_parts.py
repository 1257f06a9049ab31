"""Rules on the parts of a board: each one's value, number, footprint and mark against the design.

They are read from the board file, without KiCad. Each counts the parts that differ and names them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence

from designer.base.units import parse_quantity
from designer.base.views import View
from designer.board.component import Component
from designer.board.footprints import footprint
from designer.board.kicad_names import LIBRARY, footprint_name
from designer.board.kicad_reader import EXCLUDED, PART_NUMBER, BoardFile, PlacedFootprint
from designer.catalog.design_rule import Finding, NotRun

MOST = 5
"""Parts that a message names."""
LONGEST = 40
"""Characters that a message takes of a text on the board."""
UNITS = {"resistor": "Ω", "capacitor": "F", "trimmer": "Ω"}
"""Kinds of parts whose value is a quantity."""

Pair = tuple[Component, PlacedFootprint]


def values(board: BoardFile, components: Sequence[Component]) -> Iterator[Finding]:
    """Parts whose value is another one. A quantity may be written in any way ("22.1k", "22k1")."""
    pairs = [(c, f) for c, f in _pairs(board, components) if c.bought is not None]
    yield from _count(pairs, _other_value)


def numbers(board: BoardFile, components: Sequence[Component]) -> Iterator[Finding]:
    """Parts with another part number than the one that is to be bought, or than its substitute's.

    Raises
    ------
    NotRun : no footprint has the field.
    """
    pairs = [(c, f) for c, f in _pairs(board, components) if c.bought is not None]
    if pairs and all(f.part_number is None for _, f in pairs):
        raise NotRun(f"no footprint has a field {PART_NUMBER}: update the board from the schematic")
    yield from _count(pairs, _other_number)


def footprints(board: BoardFile, components: Sequence[Component]) -> Iterator[Finding]:
    """Parts in another footprint, of the project's library or of KiCad's that has the same name."""
    yield from _count(_pairs(board, components), _other_footprint)


def fitted(board: BoardFile, components: Sequence[Component]) -> Iterator[Finding]:
    """Parts that are left out on the board, or of the files of an order, and not by the design; or
    the other way round."""
    yield from _count(_pairs(board, components), _other_mark)


def pin_holes(board: BoardFile, components: Sequence[Component]) -> Iterator[Finding]:
    """Hole of each pad over the lead that goes through it [mm], where that is known.

    Raises
    ------
    NotRun : no part of the design goes through the board.
    """
    through = False
    for component, there in _pairs(board, components):
        leads = {pad.number: pad.lead for pad in footprint(component.footprint).pads if pad.lead}
        for pad in there.pads:
            if pad.hole and leads.get(pad.number):
                through = True
                room = pad.hole - leads[pad.number]
                more = f"{pad.hole:.3g} mm for a lead of {leads[pad.number]:.3g} mm"
                yield Finding(room, f"{there.reference}.{pad.number}", more=more)
    if not through:
        raise NotRun("no part goes through the board with leads that are known")


READ: Mapping[str, Callable[[BoardFile, Sequence[Component]], Iterator[Finding]]] = {
    "part-value": values,
    "part-number": numbers,
    "part-footprint": footprints,
    "part-fitted": fitted,
    "pin-hole": pin_holes,
}
"""By the rule's id."""


def _pairs(board: BoardFile, components: Sequence[Component]) -> list[Pair]:
    wanted = ((c, board.footprint(c.reference)) for c in components if View.BOARD in c.views)
    return [(component, there) for component, there in wanted if there is not None]


def _count(
    pairs: Sequence[Pair], difference: Callable[[Component, PlacedFootprint], str]
) -> Iterator[Finding]:
    """How many parts differ, and how; nothing where there is no part at all."""
    if not pairs:
        return
    differ = [f"{c.reference} {text}" for c, f in pairs if (text := difference(c, f))]
    more = [f"and {len(differ) - MOST} more"] if len(differ) > MOST else []
    yield Finding(len(differ), more="; ".join(differ[:MOST] + more))


def _other_value(component: Component, there: PlacedFootprint) -> str:
    unit = UNITS.get(component.kind)
    if unit is None or component.quantity is None:
        same = _plain(there.value) == _plain(component.value)
    else:
        try:
            quantity = parse_quantity(there.value, unit)
            same = math.isclose(quantity, component.quantity, rel_tol=1e-6)
        except ValueError:
            same = False
    return "" if same else f"is {_printable(there.value)}, not {component.value}"


def _other_number(component: Component, there: PlacedFootprint) -> str:
    assert component.bought is not None
    actual, wanted = there.part_number or "", component.bought.part_number
    # A substitute is written with its maker in front.
    if actual == wanted or (actual and component.bought.substitute.endswith(f" {actual}")):
        return ""
    return f"is ordered as {_printable(actual)}, not {wanted}"


def _other_footprint(component: Component, there: PlacedFootprint) -> str:
    library = component.footprint.rpartition(":")[0]
    name = footprint_name(component.footprint)
    if there.name != name:
        return f"is in {_printable(there.name)}, not in {name}"
    if there.library not in (LIBRARY, library):
        return f"is of the library {_printable(there.library)}, not of {LIBRARY} or {library}"
    return ""


def _other_mark(component: Component, there: PlacedFootprint) -> str:
    if there.fitted and not component.fitted:
        return "is not marked DNP, and the design leaves it out"
    if component.fitted and not there.fitted:
        return "is marked DNP"
    missed = there.excluded if component.fitted and component.bought is not None else ()
    soldered = not component.footprint or footprint(component.footprint).soldered
    if not (missed and soldered):
        return ""
    return f"is left out of {' and '.join(EXCLUDED[mark] for mark in sorted(missed))}"


def _plain(text: str) -> str:
    return "".join(text.split()).casefold()


def _printable(text: str) -> str:
    """A text of the board in a message: printable, of a bounded length."""
    printable = "".join(ch if ch.isprintable() else "?" for ch in text[:LONGEST])
    return f"{printable}…" if len(text) > LONGEST else printable or "nothing"
