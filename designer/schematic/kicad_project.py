"""A KiCad project: every file of it, as text, from a circuit and its components."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from designer.base.views import View
from designer.board import kicad_sim, kicad_symbols as symbols
from designer.board.component import Component, joined
from designer.board.kicad_board import board, open_net, revision
from designer.board.kicad_footprint import module
from designer.board.kicad_items import Entry, entries
from designer.board.kicad_names import (
    HEAD,
    LIBRARY,
    SHEET_VERSION,
    identifier,
    kicad_net,
    project_name,
    safe_text,
    sheet_id,
    symbol_id,
)
from designer.board.kicad_placement import place
from designer.board.kicad_symbols import GRID, SymbolShape, effects, library, position
from designer.board.net_classes import net_settings
from designer.board.sexpr import Expression, expression, expression_text, lists, word
from designer.check.deck_runs import FirstRun
from designer.circuit.netlist import GROUND, NEGATIVE, POSITIVE, Circuit
from designer.schematic.sheet_drawing import SIZES, NetLabel, Note, Placed, Sheet
from designer.schematic.sheet_layout import layout

Pads = Mapping[str, tuple[tuple[str, str], ...]]


def netlist(project: str, entries: Sequence[Entry]) -> Expression:
    """The file ``.net``: components of the board with their fields, and what each net joins."""
    placed = [e for e in entries if e.component is not None and e.placed]
    components = [e.component for e in placed if e.component is not None]
    nodes = enumerate(nets(components).items(), 1)
    return expression(
        "export",
        version="E",
        design={"source": f"{project}.kicad_sch"},
        components=tuple(_component(project, entry) for entry in placed),
        nets=tuple(_net(code, name, pads) for code, (name, pads) in nodes),
    )


def nets(components: Sequence[Component]) -> Pads:
    """KiCad's name of each net of the board → its (reference, pad); open pins have one each."""
    placed = [c for c in components if View.BOARD in c.views]
    out = {kicad_net(net): pads for net, pads in joined(placed).items()}
    for component in placed:
        for pin in component.pins:
            if not pin.net:
                name = open_net(component.reference, pin.name, pin.number)
                out[name] = ((component.reference, pin.number),)
    return dict(sorted(out.items()))


def _component(project: str, entry: Entry) -> Expression:
    fields = dict(entry.fields)
    reference, footprint = entry.item.reference, fields.pop("Footprint")
    listed = {key: text for key, text in fields.items() if not key.startswith("Sim.")}
    return expression(
        "comp",
        ref=reference,
        value=entry.item.value,
        footprint=footprint,
        fields=tuple(
            expression("field", expression("name", key), text) for key, text in listed.items()
        ),
        sheetpath={"names": "/", "tstamps": "/"},
        tstamps=symbol_id(project, reference),
    )


def _net(code: int, name: str, pads: Sequence[tuple[str, str]]) -> Expression:
    nodes = (expression("node", ref=reference, pin=pin) for reference, pin in pads)
    return expression("net", *lists(code=str(code), name=name), *nodes)


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


@dataclass(frozen=True)
class Project:
    """What a project is made from."""

    title: str
    """Title of the model file."""
    circuit: Circuit
    components: tuple[Component, ...]
    run: FirstRun
    """What the simulation of the project shows."""
    rules: str
    """Text of the ``.kicad_dru``."""
    limits: Mapping[str, float]
    """Limits of KiCad's own check (``kicad_rules.project_rules``) [mm]."""
    date: str = ""
    """Date in the title blocks, such as "2026-11-23"; "" where there is none."""

    @property
    def name(self) -> str:
        """Name of its files."""
        return project_name(self.title)


def files(project: Project) -> dict[str, str]:
    """Every file by its name inside the project's folder.

    Raises
    ------
    InputError : a footprint that is not known here.
    """
    name, circuit = project.name, project.circuit
    models = f"{name}.lib"
    listed = entries(circuit, project.components, project.run, models)
    sheet = layout(circuit, listed, kicad_sim.directives(circuit, project.run))
    placed = place(circuit, [c for e in listed if e.placed and (c := e.component) is not None])
    cases = {
        s.footprint.name: s.footprint for s in (*placed.spots, *placed.holes, *placed.fiducials)
    }
    drawn = schematic(name, project.title, listed, sheet, project.date)
    pads = board(name, project.title, listed, placed, project.date)
    out = {
        f"{name}.kicad_sch": expression_text(drawn),
        f"{name}.kicad_pcb": expression_text(pads),
        f"{name}.kicad_pro": settings(name, circuit, project.limits),
        f"{name}.net": expression_text(netlist(name, listed)),
        models: kicad_sim.models(circuit, project.components, project.run),
        f"{LIBRARY}.kicad_sym": expression_text(library(shapes(sheet))),
        "sym-lib-table": _table("sym_lib_table", f"{LIBRARY}.kicad_sym"),
        "fp-lib-table": _table("fp_lib_table", f"{LIBRARY}.pretty"),
        f"{name}.kicad_dru": project.rules,
    }
    for case, shape in sorted(cases.items()):
        out[f"{LIBRARY}.pretty/{case}.kicad_mod"] = expression_text(module(shape))
    return out


def settings(name: str, circuit: Circuit, limits: Mapping[str, float]) -> str:
    """The file ``.kicad_pro``: net classes, which nets are in them, and the limits of KiCad's own
    check [mm]."""
    summing = sorted({s.inverting for s in circuit.sections} - {GROUND})
    supply = (GROUND, POSITIVE, NEGATIVE, *circuit.supply_inputs)
    value: dict[str, Any] = {
        "board": {"design_settings": {"defaults": {}, "rules": dict(limits), "track_widths": []}},
        "meta": {"filename": f"{name}.kicad_pro", "version": 3},
        "net_settings": net_settings(map(kicad_net, summing), map(kicad_net, supply)),
        "schematic": {"legacy_lib_dir": "", "legacy_lib_list": []},
        "sheets": [[sheet_id(name), "Root"]],
        "text_variables": {},
    }
    return json.dumps(value, indent=2, sort_keys=True) + "\n"


def _table(kind: str, file: str) -> str:
    row = {
        "name": LIBRARY,
        "type": "KiCad",
        "uri": f"${{KIPRJMOD}}/{file}",
        "options": "",
        "descr": "of this project alone",
    }
    return expression_text(expression(kind, version=7, lib=row))
