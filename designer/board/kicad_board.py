"""The board file: every component placed, every pad with its net, nothing routed."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Sequence

from designer.base.seal import sha256
from designer.board.kicad_footprint import on_board
from designer.board.kicad_items import Entry
from designer.board.kicad_names import (
    BOARD_VERSION,
    HEAD,
    PAPERS,
    identifier,
    kicad_net,
    safe_text,
    symbol_id,
)
from designer.board.kicad_placement import SCREW, Placement
from designer.board.placed_component import LETTER, STROKE, TEXT
from designer.board.sexpr import Expression, expression, lists, word

LAYERS = (
    (0, "F.Cu", "signal"),
    (2, "B.Cu", "signal"),
    (9, "F.Adhes", "user"),
    (11, "B.Adhes", "user"),
    (13, "F.Paste", "user"),
    (15, "B.Paste", "user"),
    (5, "F.SilkS", "user"),
    (7, "B.SilkS", "user"),
    (1, "F.Mask", "user"),
    (3, "B.Mask", "user"),
    (17, "Dwgs.User", "user"),
    (19, "Cmts.User", "user"),
    (21, "Eco1.User", "user"),
    (23, "Eco2.User", "user"),
    (25, "Edge.Cuts", "user"),
    (27, "Margin", "user"),
    (31, "F.CrtYd", "user"),
    (29, "B.CrtYd", "user"),
    (35, "F.Fab", "user"),
    (33, "B.Fab", "user"),
)
"""KiCad 9's numbers of the layers of a board with two sides."""
THICKNESS = 1.6
"""Thickness of the board [mm]."""
LINE, LINES, SHORTEST = 1.7, 4, 12
"""From one line of the title to the next [mm]; how many there is room for; letters of one that are
written however narrow the board is."""


def board(
    project: str, title: str, entries: Sequence[Entry], placement: Placement, date: str = ""
) -> Expression:
    """The file ``.kicad_pcb``. title : from the model file, as it is. date : of the design."""
    by_reference = {e.item.reference: e for e in entries}
    pads = {
        spot.component.reference: _pad_nets(by_reference[spot.component.reference])
        for spot in placement.spots
    }
    names = sorted({net for of_pads in pads.values() for net in of_pads.values() if net})
    nets = {"": 0} | {name: i for i, name in enumerate(names, start=1)}
    box = placement.outline
    return expression(
        "kicad_pcb",
        *lists(
            version=BOARD_VERSION,
            **HEAD,
            general={"thickness": THICKNESS, "legacy_teardrops": False},
            paper=_paper(placement),
            title_block={
                "title": safe_text(title),
                **({"date": date} if date else {}),
                "rev": revision(entries),
            },
            layers=layers(LAYERS),
            setup={"pad_to_mask_clearance": 0, "allow_soldermask_bridges_in_footprints": False},
        ),
        *(expression("net", number, name) for name, number in nets.items()),
        *(
            on_board(
                spot,
                owner=(project, spot.component.reference),
                path=symbol_id(project, spot.component.reference),
                sheet=f"{project}.kicad_sch",
                fields=_fields(by_reference[spot.component.reference]),
                nets=nets,
                names=pads[spot.component.reference],
            )
            for spot in placement.spots
        ),
        *(
            on_board(
                hole,
                owner=(project, hole.component.reference),
                path=None,
                sheet=f"{project}.kicad_sch",
                fields=(),
                nets=nets,
                names={},
            )
            for hole in (*placement.holes, *placement.fiducials)
        ),
        *_texts(project, f"{safe_text(title)}  {revision(entries)}", placement),
        expression(
            "gr_rect",
            start=(box.left, box.top),
            end=(box.right, box.bottom),
            stroke={"width": 0.05, "type": word("default")},
            fill=False,
            layer="Edge.Cuts",
            uuid=identifier(project, "outline"),
        ),
        *lists(embedded_fonts=False),
    )


def revision(entries: Sequence[Entry]) -> str:
    """Eight digits that change with a value, a part, a case or a connection of the board."""
    components = [e.component for e in entries if e.component is not None]
    numbers = [c.bought.part_number if c.bought is not None else "" for c in components]
    listed = [
        (c.reference, c.value, c.footprint, number, sorted(c.nets.items()))
        for c, number in zip(components, numbers, strict=True)
    ]
    return sha256(repr(listed).encode("utf-8"))[:8]


def _texts(project: str, title: str, placement: Placement) -> Iterator[Expression]:
    """The title between the lower screws, and what stands at connectors."""
    box = placement.outline
    lines = title_lines(title, placement)
    middle = 0.5 * (box.left + box.right)
    for number, line in enumerate(lines):
        down = (number - (len(lines) - 1) / 2.0) * LINE
        yield _text(line, (middle, box.bottom - SCREW + down), (project, "title", str(number)))
    for spot in placement.spots:
        right, below = spot.courtyard.right + 0.1, spot.courtyard.bottom + 0.1
        for label, pad in zip(spot.pin_labels, spot.footprint.pads, strict=False):
            x, y = spot.pad(pad.number)
            ids = project, spot.component.reference, pad.number
            if spot.footprint.across:
                yield _text(label, (x, below), ids, justify="right", angle=90)
            else:
                yield _text(label, (right, y), ids, justify="left")
        if spot.caption:
            under = spot.x, spot.courtyard.bottom + 0.25 + TEXT / 2.0
            yield _text(spot.caption, under, (project, spot.component.reference, "caption"))


def title_lines(title: str, placement: Placement) -> list[str]:
    """The title in as many lines as stand between the lower screws and marks; what is longer than
    ``LINES`` of them ends in the revision."""
    most = int((placement.outline.width - 2.0 * placement.beside_title) / LETTER)
    lines = textwrap.wrap(title, max(most, SHORTEST))
    if len(lines) > LINES:
        kept, (*_, revised) = lines[: LINES - 1], title.split()
        lines = [*kept[:-1], f"{kept[-1][: most - 2].rstrip()} …", revised]
    return lines


def _text(
    text: str,
    at: tuple[float, float],
    ids: tuple[str, ...],
    justify: str | None = None,
    angle: int = 0,
) -> Expression:
    return expression(
        "gr_text",
        text,
        at=(*at, angle),
        layer="F.SilkS",
        uuid=identifier("text", *ids),
        effects={
            "font": {"size": (TEXT, TEXT), "thickness": STROKE},
            **({} if justify is None else {"justify": word(justify)}),
        },
    )


def layers(listed: Iterable[tuple[int, str, str]]) -> tuple[Expression, ...]:
    """The layers of a board: number, name and kind of each."""
    return tuple(expression(str(number), name, word(kind)) for number, name, kind in listed)


def _paper(placement: Placement) -> str:
    """The smallest sheet on which the board stands clear of the title block."""
    box = placement.outline
    for name, (width, height) in PAPERS.items():
        if box.right < width - 15.0 and box.bottom < height - 50.0:
            return name
    return "A0"


def _pad_nets(entry: Entry) -> dict[str, str]:
    """KiCad's name of the net of each pad."""
    component = entry.component
    assert component is not None
    return {
        pin.number: kicad_net(pin.net)
        if pin.net
        else open_net(component.reference, pin.name, pin.number)
        for pin in component.pins
    }


def open_net(reference: str, name: str, number: str) -> str:
    """What KiCad calls the net of a pin that is not connected."""
    pad = f"Pad{number}" if not name or name == number else f"{name}-Pad{number}"
    return f"unconnected-({reference}-{pad})"


def _fields(entry: Entry) -> list[tuple[str, str]]:
    """Fields of the symbol that the board repeats."""
    fields = {"Datasheet": "", "Description": "", **dict(entry.fields)}
    return [(key, text) for key, text in fields.items() if key != "Footprint"]
