"""The netlist of the board, ``.net``: written from the components, not from the sheet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from designer.base.views import View
from designer.board.component import Component, joined
from designer.board.kicad_board import open_net
from designer.board.kicad_items import Entry
from designer.board.kicad_names import kicad_net, symbol_id
from designer.board.sexpr import Expression, expression, lists

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
