"""A KiCad project: every file of it, as text, from a circuit and its components."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from designer.board import kicad_sim
from designer.board.component import Component
from designer.board.kicad_board import board
from designer.board.kicad_footprint import module
from designer.board.kicad_items import entries
from designer.board.kicad_names import LIBRARY, kicad_net, project_name, sheet_id
from designer.board.kicad_netlist import netlist
from designer.board.kicad_placement import place
from designer.board.kicad_symbols import library
from designer.board.net_classes import net_settings
from designer.board.sexpr import expression, expression_text
from designer.check.deck_runs import FirstRun
from designer.circuit.netlist import GROUND, NEGATIVE, POSITIVE, Circuit
from designer.schematic.kicad_sheet import schematic, shapes
from designer.schematic.sheet_layout import layout


@dataclass(frozen=True)
class Project:
    """What a project is made from."""

    title: str
    """Title of the model file."""
    circuit: Circuit
    components: tuple[Component, ...]
    """The components of the board."""
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
        """Of its files."""
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
    cases = {s.footprint.name: s.footprint for s in (*placed.spots, *placed.holes)}
    drawn = schematic(name, project.title, listed, sheet, project.date)
    pads = board(name, project.title, listed, placed, project.date)
    out = {
        f"{name}.kicad_sch": expression_text(drawn),
        f"{name}.kicad_pcb": expression_text(pads),
        f"{name}.kicad_pro": settings(name, circuit, project.limits),
        f"{name}.net": expression_text(netlist(name, listed)),
        models: kicad_sim.models(circuit, project.components),
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
