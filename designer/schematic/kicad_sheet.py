"""The schematic: one flat sheet, its symbols embedded, ids derived from names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from designer.board import kicad_symbols as symbols
from designer.board.kicad_board import revision
from designer.board.kicad_items import Entry
from designer.board.kicad_names import (
    HEAD,
    LIBRARY,
    SHEET_VERSION,
    identifier,
    safe_text,
    sheet_id,
    symbol_id,
)
from designer.board.kicad_symbols import GRID, SymbolShape, effects, position
from designer.board.sexpr import Expression, expression, lists, word
from designer.schematic.sheet_drawing import SIZES, NetLabel, Note, Placed, Sheet


def shapes(sheet: Sheet) -> tuple[SymbolShape, ...]:
    """Each symbol that the sheet uses, by name."""
    return tuple({s.item.shape.name: s.item.shape for s in sheet.symbols}.values())


def schematic(
    project: str, title: str, entries: Sequence[Entry], sheet: Sheet, date: str = ""
) -> Expression:
    """The file ``.kicad_sch``. title : from the model file, as it is. date : of the design."""
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
                **({"date": date} if date else {}),
                "rev": revision(entries),
                "comment": (1, "Parts, nets and values follow from the design"),
            },
            lib_symbols=tuple(
                symbols.symbol(shape, f"{LIBRARY}:{shape.name}") for shape in shapes(sheet)
            ),
        ),
        *(_note(project, note) for cell in sheet.cells for note in cell.notes),
        *_wiring(project, sheet),
        *(_label(project, label) for label in dict.fromkeys(sheet.labels)),
        *(_symbol(project, placed, by_reference) for placed in sheet.symbols),
        *lists(
            sheet_instances={"path": ("/", expression("page", "1"))},
            embedded_fonts=False,
        ),
    )


def _note(project: str, note: Note) -> Expression:
    """KiCad measures a text of several lines from its first one."""
    size = SIZES[note.kind]
    role = note.kind == "role"
    x, y = note.at
    return expression(
        "text",
        note.text,
        exclude_from_sim=not note.text.startswith("."),  # a directive
        at=position(x, y),
        effects=effects(
            *(("left",) if note.left or not role else ()), "top" if role else "bottom", size=size
        ),
        uuid=identifier(project, "text", note.kind, note.owner),
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
    reference, value = placed.names_at()
    supply = len(item.shape.units) > 1 and placed.unit == len(item.shape.units)
    hidden = item.value in ("GND", "PWR_FLAG") if item.shape.power else item.shape.prefix == "TP"
    if supply:
        reference = placed.x - 3.8, float(placed.y)
    # KiCad turns the texts of a symbol that stands with it: these are turned back.
    angle = 90 if placed.upright else 0
    yield _property("Reference", item.reference, *reference, item.shape.power, angle)
    yield _property("Value", item.value, *value, hidden or supply, angle)
    fields = dict(entry.fields) if entry is not None else {}
    fields = {"Footprint": "", "Datasheet": "", "Description": "", **fields}
    for key, text in fields.items():
        yield _property(key, text, placed.x, placed.y, True)


def _property(key: str, text: str, x: float, y: float, hide: bool, angle: int = 0) -> Expression:
    return expression("property", key, text, at=position(x, y, angle), effects=effects(hide=hide))


def _at(point: tuple[int, int]) -> tuple[float, float]:
    return point[0] * GRID, point[1] * GRID
