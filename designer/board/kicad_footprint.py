"""Footprints as KiCad writes them: in the project's library, and on the board."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from designer.base.sexpr import Expression, expression, lists, word
from designer.board.footprints import FootprintShape, PadShape
from designer.board.kicad_names import BOARD_VERSION, HEAD, LIBRARY, identifier
from designer.board.pins import Pin
from designer.board.placed_component import TEXT, PlacedComponent

ROUND = 0.25
"""Radius of a pad's corners, of its shorter side."""


def module(shape: FootprintShape) -> Expression:
    """The file ``.kicad_mod`` of the project's library."""
    ids = (shape.name,)
    return expression(
        "footprint",
        shape.name,
        *lists(version=BOARD_VERSION, **HEAD, layer="F.Cu"),
        *_texts(shape, "REF**", shape.name, ids),
        _attributes(shape),
        *_drawing(shape, ids),
        *(_pad(pad, 0, ids) for pad in shape.pads),
        *lists(embedded_fonts=False),
    )


def on_board(
    spot: PlacedComponent,
    *,
    owner: tuple[str, str],
    path: str | None,
    sheet: str,
    fields: Iterable[tuple[str, str]],
    nets: Mapping[str, int],
    names: Mapping[str, str],
) -> Expression:
    """The footprint of a component at its place.

    owner : project and reference, which the ids are made from. path : id of its symbol, None of
    what has none. sheet : the schematic's file. fields : of its symbol. nets : number of each net
    by its KiCad name. names : KiCad's name of the net of each pad.
    """
    component, shape = spot.component, spot.footprint
    ids = ("board", *owner)
    pins = {pin.number: pin for pin in component.pins}
    return expression(
        "footprint",
        f"{LIBRARY}:{shape.name}",
        *lists(layer="F.Cu", uuid=identifier(*ids), at=_at(spot.x, spot.y, spot.angle)),
        *_texts(shape, component.reference, component.value, ids, spot.angle, spot.label_at),
        *(
            _property(key, text, (0.0, 0.0), spot.angle, "F.Fab", ids, hide=True)
            for key, text in fields
        ),
        *([] if path is None else lists(path=f"/{path}", sheetname="/", sheetfile=sheet)),
        _attributes(
            shape,
            bought=component.bought is not None,
            fitted=component.fitted,
            drawn=path is not None,
        ),
        *_drawing(shape, ids),
        *(
            _pad(pad, spot.angle, ids, pins.get(pad.number), names.get(pad.number, ""), nets)
            for pad in shape.pads
        ),
        *lists(embedded_fonts=False),
    )


def _texts(
    shape: FootprintShape,
    reference: str,
    value: str,
    ids: tuple[str, ...],
    angle: int = 0,
    at: tuple[float, float] | None = None,
) -> Iterator[Expression]:
    """The reference, and the value on the drawing below the courtyard as it is seen.

    at : middle of the reference, seen from the footprint's place on the board [mm]; above the
    courtyard where None.
    """
    _, top, _, bottom = shape.courtyard
    sign = -1.0 if angle == 180 else 1.0
    below = sign * (-top if angle == 180 else bottom) + sign * (0.25 + TEXT / 2.0)
    x, y = (0.0, top - 0.25 - TEXT / 2.0) if at is None else (sign * at[0], sign * at[1])
    yield _property("Reference", reference, (x, y), angle, "F.SilkS", ids)
    yield _property("Value", value, (0.0, below), angle, "F.Fab", ids)


def _property(
    key: str,
    text: str,
    at: tuple[float, float],
    angle: int,
    layer: str,
    ids: tuple[str, ...],
    hide: bool = False,
) -> Expression:
    return expression(
        "property",
        key,
        text,
        at=_at(round(at[0], 6) + 0.0, round(at[1], 6) + 0.0, angle),
        layer=layer,
        hide=True if hide else None,
        uuid=identifier(*ids, "field", key),
        effects={"font": {"size": (TEXT, TEXT), "thickness": 0.12}},
    )


def _attributes(
    shape: FootprintShape, *, bought: bool = True, fitted: bool = True, drawn: bool = True
) -> Expression:
    """drawn : whether it stands on the sheet too."""
    kind = [] if not shape.soldered else ["through_hole" if shape.through_hole else "smd"]
    left_out = [] if shape.soldered else ["exclude_from_pos_files"]
    left_out += [] if bought and fitted and shape.soldered else ["exclude_from_bom"]
    left_out += [] if fitted else ["dnp"]
    left_out += [] if drawn else ["board_only"]
    return expression("attr", *map(word, [*kind, *left_out]))


def _drawing(shape: FootprintShape, ids: tuple[str, ...]) -> Iterator[Expression]:
    """Body, courtyard, an outline in silk, a bar at a cathode, a dot at another pin 1 that
    matters."""
    wide, high = shape.body[0] / 2.0, shape.body[1] / 2.0
    if wide and high:
        yield _box("F.Fab", (-wide, -high, wide, high), 0.1, ids)
    yield _box("F.CrtYd", shape.courtyard, 0.05, ids)
    left, top, right, bottom = shape.extent
    if shape.soldered:
        outline = (left - 0.17, top - 0.17, right + 0.17, bottom + 0.17)
        yield _box("F.SilkS", outline, 0.12, ids)
    if shape.mark and shape.name.startswith("D_"):
        yield expression(
            "fp_line",
            start=(left - 0.36, top - 0.17),
            end=(left - 0.36, bottom + 0.17),
            stroke={"width": 0.2, "type": word("solid")},
            layer="F.SilkS",
            uuid=identifier(*ids, "cathode"),
        )
    elif shape.mark:
        first = next(pad for pad in shape.pads if pad.number == "1")
        # Beside the outline, within the courtyard.
        if first.x < 0.0 or len(shape.pads) == 2 or first.x == 0.0:
            centre = (left - 0.34, first.y)
        else:
            centre = (right + 0.34, first.y)
        yield expression(
            "fp_circle",
            center=centre,
            end=(centre[0] + 0.08, centre[1]),
            stroke={"width": 0.16, "type": word("solid")},
            fill=True,
            layer="F.SilkS",
            uuid=identifier(*ids, "first"),
        )


def _box(
    layer: str, box: tuple[float, float, float, float], width: float, ids: tuple[str, ...]
) -> Expression:
    return expression(
        "fp_rect",
        start=box[:2],
        end=box[2:],
        stroke={"width": width, "type": word("solid")},
        fill=False,
        layer=layer,
        uuid=identifier(*ids, "box", layer),
    )


def _pad(
    pad: PadShape,
    angle: int,
    ids: tuple[str, ...],
    pin: Pin | None = None,
    net: str = "",
    nets: Mapping[str, int] | None = None,
) -> Expression:
    hole = pad.drill > 0.0
    bare = not hole and pad.width == pad.height
    form = "rect" if pad.first else "circle" if hole or bare else "roundrect"
    if hole and pad.width != pad.height and not pad.first:
        form = "oval"
    layers = ["*.Cu", "*.Mask"] if hole else ["F.Cu", "F.Mask"]
    if not hole and not bare:
        layers.append("F.Paste")
    placed = nets is not None
    return expression(
        "pad",
        pad.number,
        word("np_thru_hole" if not pad.plated else "thru_hole" if hole else "smd"),
        word(form),
        at=_at(pad.x, pad.y, angle),
        size=(pad.width, pad.height),
        drill=pad.drill if hole else None,
        layers=tuple(layers),
        remove_unused_layers=False if hole and pad.plated else None,
        roundrect_rratio=ROUND if form == "roundrect" else None,
        net=(nets[net], net) if nets is not None and net else None,
        pinfunction=pin.name if pin is not None and placed else None,
        pintype=pin.electrical if pin is not None and placed else None,
        uuid=identifier(*ids, "pad", pad.number),
    )


def _at(x: float, y: float, angle: int) -> tuple[float, ...]:
    return (x, y, angle) if angle else (x, y)
