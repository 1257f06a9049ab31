"""The schematic: one flat sheet, its symbols embedded, ids derived from names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from designer.base.sexpr import Expression, expression, lists, word
from designer.board import kicad_symbols as symbols
from designer.board.kicad_items import SIMULATION, Entry
from designer.board.kicad_layout import NetLabel, Note, Placed, Sheet, arrange, flow
from designer.board.kicad_names import HEAD, LIBRARY, SHEET_VERSION, identifier, safe_text
from designer.board.kicad_symbols import GRID, SymbolShape, effects, position


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
        *lists(
            version=SHEET_VERSION,
            **HEAD,
            uuid=sheet_id(project),
            paper=sheet.paper,
            title_block={
                "title": safe_text(title),
                "comment": (1, "Parts, nets and values follow from the design"),
            },
            lib_symbols=tuple(
                symbols.symbol(shape, f"{LIBRARY}:{shape.name}") for shape in shapes(sheet)
            ),
        ),
        *(_note(project, cell.title, note) for cell in sheet.cells for note in cell.notes),
        *_wiring(project, sheet),
        *(_label(project, label) for label in dict.fromkeys(sheet.labels)),
        *(_symbol(project, placed, by_reference) for placed in sheet.symbols),
        *lists(
            sheet_instances={"path": ("/", expression("page", "1"))},
            embedded_fonts=False,
        ),
    )


def _note(project: str, cell: str, note: Note) -> Expression:
    return expression(
        "text",
        note.text,
        exclude_from_sim=not note.text.startswith("."),  # a directive
        at=position(*note.at),
        effects=effects("left", "bottom", size=2.0 if note.heading else symbols.TEXT),
        uuid=identifier(project, "text", cell, note.text),
    )


def _wiring(project: str, sheet: Sheet) -> Iterator[Expression]:
    for at in sheet.junctions:
        yield expression(
            "junction",
            at=_at(at),
            diameter=0,
            color=(0, 0, 0, 0),
            uuid=identifier(project, "junction", *map(str, at)),
        )
    for at in (p for cell in sheet.cells for p in cell.open_pins):
        uuid = identifier(project, "open", *map(str, at))
        yield expression("no_connect", at=_at(at), uuid=uuid)
    for a, b in sheet.segments:
        yield expression(
            "wire",
            pts=symbols.points((a, b)),
            stroke={"width": 0, "type": word("default")},
            uuid=identifier(project, "wire", *map(str, (*a, *b))),
        )


def _label(project: str, label: NetLabel) -> Expression:
    return expression(
        "label",
        label.net,
        at=position(*label.at, 180 if label.left else 0),
        effects=effects("right" if label.left else "left", "bottom"),
        uuid=identifier(project, "label", label.net, *map(str, label.at)),
    )


def _symbol(project: str, placed: Placed, entries: Mapping[str, Entry]) -> Expression:
    item = placed.item
    entry, name = entries.get(item.reference), item.reference
    unit = 1 if len(item.shape.units) == 1 else placed.unit
    path = expression("path", f"/{sheet_id(project)}", reference=name, unit=unit)
    return expression(
        "symbol",
        *lists(
            lib_id=f"{LIBRARY}:{item.shape.name}",
            at=position(placed.x, placed.y, placed.angle),
            unit=placed.unit,
            exclude_from_sim=entry is not None and not entry.simulated and not item.shape.power,
            in_bom=entry is not None and entry.bought,
            on_board=entry is not None and entry.placed,
            dnp=entry is not None and not entry.fitted,
            uuid=symbol_id(project, name, placed.unit),
        ),
        *_properties(placed, entry),
        *(
            expression("pin", pin.number, uuid=identifier(project, "pin", name, pin.number))
            for pin in item.shape.units[placed.unit - 1].pins
        ),
        *lists(instances={"project": (project, path)}),
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
    fields = dict(entry.fields) if entry is not None else {}
    fields = {"Footprint": "", "Datasheet": "", "Description": "", **fields}
    for key, text in fields.items():
        yield _property(key, text, placed.x, placed.y, True)


def _property(key: str, text: str, x: float, y: float, hide: bool) -> Expression:
    return expression("property", key, text, at=position(x, y), effects=effects(hide=hide))


def _at(point: tuple[int, int]) -> tuple[float, float]:
    return point[0] * GRID, point[1] * GRID
