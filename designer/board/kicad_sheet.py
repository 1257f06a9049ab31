"""The schematic: one flat sheet, its symbols embedded, ids derived from names."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from designer.base.sexpr import Expression, expression
from designer.board import kicad_symbols as symbols
from designer.board.kicad_items import SIMULATION, Entry
from designer.board.kicad_layout import Item, NetLabel, Note, Placed, Sheet, arrange, flow
from designer.board.kicad_names import LIBRARY, identifier, safe_text
from designer.board.kicad_symbols import GRID, SymbolShape, effects, position, stroke

FILE_VERSION = 20250114
"""Of schematics, as KiCad 9 writes them."""


def layout(entries: Sequence[Entry], directives: Sequence[str]) -> Sheet:
    """Where everything stands."""
    simulated = [e.item for e in entries if SIMULATION in e.item.stages.values()]
    others = [e.item for e in entries if e.item not in simulated]
    return arrange(others, flow(SIMULATION, simulated, directives))


def shapes(sheet: Sheet) -> tuple[SymbolShape, ...]:
    """Each symbol that the sheet uses, by name."""
    return tuple({s.item.shape.name: s.item.shape for s in sheet.symbols}.values())


def sheet_id(project: str) -> str:
    """The id of the one sheet."""
    return identifier(project, "sheet")


def symbol_id(project: str, reference: str, unit: int = 1) -> str:
    """The id of a unit of a symbol; the board's footprints refer to it."""
    return identifier(project, "symbol", reference, str(unit))


def schematic(project: str, title: str, entries: Sequence[Entry], sheet: Sheet) -> Expression:
    """The file ``.kicad_sch``. title : from the model file, as it is."""
    by_reference = {e.item.reference: e for e in entries}
    return expression(
        "kicad_sch",
        expression("version", FILE_VERSION),
        expression("generator", LIBRARY),
        expression("generator_version", "9.0"),
        expression("uuid", sheet_id(project)),
        expression("paper", sheet.paper),
        expression(
            "title_block",
            expression("title", safe_text(title)),
            expression("comment", 1, "Parts, nets and values follow from the design"),
        ),
        expression(
            "lib_symbols",
            *(symbols.symbol(shape, f"{LIBRARY}:{shape.name}") for shape in shapes(sheet)),
        ),
        *_texts(project, sheet),
        *_wiring(project, sheet),
        *(_label(project, label) for label in _distinct(sheet.labels)),
        *(_symbol(project, placed, by_reference) for placed in sheet.symbols),
        expression("sheet_instances", expression("path", "/", expression("page", "1"))),
        expression("embedded_fonts", False),
    )


def _texts(project: str, sheet: Sheet) -> Iterator[Expression]:
    for cell in sheet.cells:
        for note in cell.notes:
            yield _note(project, cell.title, note)


def _note(project: str, cell: str, note: Note) -> Expression:
    directive = note.text.startswith(".")
    return expression(
        "text",
        note.text,
        expression("exclude_from_sim", not directive),
        position(*note.at, 0),
        effects("left", "bottom", size=2.0 if note.heading else symbols.TEXT),
        _id(project, "text", cell, note.text),
    )


def _wiring(project: str, sheet: Sheet) -> Iterator[Expression]:
    for at in sheet.junctions:
        yield expression(
            "junction",
            _at(at),
            expression("diameter", 0),
            expression("color", 0, 0, 0, 0),
            _id(project, "junction", *map(str, at)),
        )
    for at in (p for cell in sheet.cells for p in cell.open_pins):
        yield expression("no_connect", _at(at), _id(project, "open", *map(str, at)))
    for a, b in sheet.segments:
        yield expression(
            "wire", symbols.points((a, b)), stroke(), _id(project, "wire", *map(str, (*a, *b)))
        )


def _label(project: str, label: NetLabel) -> Expression:
    return expression(
        "label",
        label.net,
        position(*label.at, 180 if label.left else 0),
        effects("right" if label.left else "left", "bottom"),
        _id(project, "label", label.net, *map(str, label.at)),
    )


def _symbol(project: str, placed: Placed, entries: Mapping[str, Entry]) -> Expression:
    item = placed.item
    entry = entries.get(item.reference)
    one = len(item.shape.units) == 1
    own = identifier(project, "symbol", item.reference, str(placed.unit))
    name = item.reference
    return expression(
        "symbol",
        expression("lib_id", f"{LIBRARY}:{item.shape.name}"),
        position(placed.x, placed.y, placed.angle),
        expression("unit", placed.unit),
        expression(
            "exclude_from_sim", entry is not None and not entry.simulated and not _power(item)
        ),
        expression("in_bom", entry is not None and entry.bought),
        expression("on_board", entry is not None and entry.placed),
        expression("dnp", entry is not None and not entry.fitted),
        expression("uuid", own),
        *_properties(placed, entry),
        *(
            expression("pin", pin.number, _id(project, "pin", name, pin.number))
            for pin in item.shape.units[placed.unit - 1].pins
        ),
        expression(
            "instances",
            expression(
                "project",
                project,
                expression(
                    "path",
                    f"/{sheet_id(project)}",
                    expression("reference", name),
                    expression("unit", 1 if one else placed.unit),
                ),
            ),
        ),
    )


def _properties(placed: Placed, entry: Entry | None) -> Iterator[Expression]:
    item = placed.item
    (rx, ry), (vx, vy) = item.shape.texts
    supply = len(item.shape.units) > 1 and placed.unit == len(item.shape.units)
    hidden = item.value in ("GND", "PWR_FLAG") if item.shape.power else item.shape.prefix == "TP"
    if supply:
        rx, ry = 3.5, 0.0
    yield _property("Reference", item.reference, placed.x + rx, placed.y - ry, item.shape.power)
    yield _property("Value", item.value, placed.x + vx, placed.y - vy, hidden or supply)
    found = dict(entry.fields) if entry is not None else {}
    found = {"Footprint": "", "Datasheet": "", "Description": "", **found}
    for key, text in found.items():
        yield _property(key, text, placed.x, placed.y, True)


def _property(key: str, text: str, x: float, y: float, hide: bool) -> Expression:
    return expression("property", key, text, position(x, y, 0), effects(hide=hide))


def _power(item: Item) -> bool:
    return item.shape.power


def _distinct(labels: Iterable[NetLabel]) -> tuple[NetLabel, ...]:
    return tuple(dict.fromkeys(labels))


def _at(point: tuple[int, int]) -> Expression:
    return expression("at", point[0] * GRID, point[1] * GRID)


def _id(*what: str) -> Expression:
    return expression("uuid", identifier(*what))
