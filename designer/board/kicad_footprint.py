"""Footprints as KiCad writes them: in the project's library, and on the board."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from itertools import pairwise

from designer.board.footprints import FootprintShape, PadShape
from designer.board.kicad_names import BOARD_VERSION, HEAD, LIBRARY, identifier
from designer.board.pins import Pin
from designer.board.placed_component import STROKE, TEXT, PlacedComponent
from designer.board.sexpr import Expression, expression, lists, word

LINE, BAR, SILK, NOTCH = STROKE, 0.3, 0.18, 0.7
"""Silk: width of a line, of the bar at a cathode; from a pad to the middle of a line; radius of the
notch of a case [mm]."""
ROUND = 0.25
"""Radius of a pad's corners, of its shorter side."""

BODIES = "${KICAD9_3DMODEL_DIR}"
"""Folder of KiCad 9's bodies of parts, as KiCad itself names it."""


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
        *(_pad(pad, 0, own) for pad, own in _with_ids(shape, ids)),
        *lists(embedded_fonts=False),
        *_body(shape),
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
            _pad(pad, spot.angle, own, pins.get(pad.number), names.get(pad.number, ""), nets)
            for pad, own in _with_ids(shape, ids)
        ),
        *lists(embedded_fonts=False),
        *_body(shape),
    )


def _body(shape: FootprintShape) -> Iterator[Expression]:
    """The part's body in KiCad's own library of bodies, where that is installed; y upwards."""
    if shape.library:
        x, y = shape.origin
        yield expression(
            "model",
            f"{BODIES}/{shape.library}.3dshapes/{shape.name}.step",
            offset={"xyz": (x, -y, 0.0)},
            scale={"xyz": (1.0, 1.0, 1.0)},
            rotate={"xyz": (0.0, 0.0, 0.0)},
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
        effects={"font": {"size": (TEXT, TEXT), "thickness": STROKE}},
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
    """Body, courtyard, an outline in silk, a dot at a pin 1 that matters."""
    wide, high = shape.body[0] / 2.0, shape.body[1] / 2.0
    if wide and high:
        yield _box("F.Fab", (-wide, -high, wide, high), 0.1, ids)
    yield _box("F.CrtYd", shape.courtyard, 0.05, ids)
    if shape.soldered:
        yield from _silk(shape, ids)
    if shape.mark and not shape.diode:
        yield _first_pin(shape, ids)


def _silk(shape: FootprintShape, ids: tuple[str, ...]) -> Iterator[Expression]:
    """An outline past body and pads: with a notch where a case with two rows of pins has its own,
    and of a diode as its case looks, with the bar at the cathode."""
    left, top, right, bottom = shape.extent
    box = (left - SILK, top - SILK, right + SILK, bottom + SILK)
    if shape.diode and shape.through_hole:
        yield from _lying_diode(shape, ids)
    elif shape.diode:
        yield from _standing_bar(shape, box, ids)
    elif shape.two_rows:
        yield from _notched(box, ids)
    else:
        yield _box("F.SilkS", box, LINE, ids)


def _standing_bar(
    shape: FootprintShape, box: tuple[float, float, float, float], ids: tuple[str, ...]
) -> Iterator[Expression]:
    """Two lines to the anode's pad, and a bar that closes them at the cathode."""
    left, top, _, bottom = box
    anode = next(pad for pad in shape.pads if pad.number == "2")
    end = anode.x - anode.width / 2.0
    yield _line((left, top), (end, top), ids, "upper")
    yield _line((left, bottom), (end, bottom), ids, "lower")
    at = left + LINE / 2.0 - BAR / 2.0
    yield _line((at, top), (at, bottom), ids, "cathode", BAR)


def _lying_diode(shape: FootprintShape, ids: tuple[str, ...]) -> Iterator[Expression]:
    """The body between the holes with its ring at the cathode, and a line along each lead."""
    wide, high = shape.body[0] / 2.0, shape.body[1] / 2.0
    yield _box("F.SilkS", (-wide, -high, wide, high), LINE, ids)
    ring = -wide + 2.0 * BAR
    yield _line((ring, -high), (ring, high), ids, "cathode", BAR)
    for pad in shape.pads:
        side = 1.0 if pad.x > 0.0 else -1.0
        reach = abs(pad.x) - pad.width / 2.0 - SILK
        yield _line((side * wide, 0.0), (side * reach, 0.0), ids, f"lead {pad.number}")


def _notched(box: tuple[float, float, float, float], ids: tuple[str, ...]) -> Iterator[Expression]:
    """A box with a half circle cut into its upper side."""
    left, top, right, bottom = box
    around = [(-NOTCH, top), (left, top), (left, bottom), (right, bottom), (right, top)]
    for i, (a, b) in enumerate(pairwise([*around, (NOTCH, top)])):
        yield _line(a, b, ids, f"side {i}")
    yield expression(
        "fp_arc",
        start=(NOTCH, top),
        mid=(0.0, top + NOTCH),
        end=(-NOTCH, top),
        stroke={"width": LINE, "type": word("solid")},
        layer="F.SilkS",
        uuid=identifier(*ids, "notch"),
    )


def _first_pin(shape: FootprintShape, ids: tuple[str, ...]) -> Expression:
    """A dot beside pin 1, between the outline and the courtyard."""
    left, _, right, _ = shape.extent
    first = next(pad for pad in shape.pads if pad.number == "1")
    if first.x < 0.0 or len(shape.pads) == 2 or first.x == 0.0:
        centre = (left - 0.34, first.y)
    else:
        centre = (right + 0.34, first.y)
    return expression(
        "fp_circle",
        center=centre,
        end=(centre[0] + 0.08, centre[1]),
        stroke={"width": 0.16, "type": word("solid")},
        fill=True,
        layer="F.SilkS",
        uuid=identifier(*ids, "first"),
    )


def _line(
    start: tuple[float, float],
    end: tuple[float, float],
    ids: tuple[str, ...],
    name: str,
    width: float = LINE,
) -> Expression:
    return expression(
        "fp_line",
        start=start,
        end=end,
        stroke={"width": width, "type": word("solid")},
        layer="F.SilkS",
        uuid=identifier(*ids, name),
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


def _with_ids(
    shape: FootprintShape, ids: tuple[str, ...]
) -> Iterator[tuple[PadShape, tuple[str, ...]]]:
    """Each pad with what its id is made from; pads of one number are told apart by their order."""
    earlier: Counter[str] = Counter()
    for pad in shape.pads:
        again = earlier[pad.number]
        yield pad, (*ids, "pad", pad.number, *([str(again)] if again else []))
        earlier[pad.number] += 1


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
    shape = "rect" if pad.first else "circle" if hole or bare else "roundrect"
    if hole and pad.width != pad.height and not pad.first:
        shape = "oval"
    layers = ["*.Cu", "*.Mask"] if hole else ["F.Cu", "F.Mask"]
    if not hole and not bare:
        layers.append("F.Paste")
    placed = nets is not None
    return expression(
        "pad",
        pad.number,
        word("np_thru_hole" if not pad.plated else "thru_hole" if hole else "smd"),
        word(shape),
        at=_at(pad.x, pad.y, angle),
        size=(pad.width, pad.height),
        drill=pad.drill if hole else None,
        layers=tuple(layers),
        remove_unused_layers=False if hole and pad.plated else None,
        roundrect_rratio=ROUND if shape == "roundrect" else None,
        solder_mask_margin=pad.margin or None,
        clearance=pad.margin or None,
        net=(nets[net], net) if nets is not None and net else None,
        pinfunction=pin.name if pin is not None and placed else None,
        pintype=pin.electrical if pin is not None and placed else None,
        uuid=identifier(*ids),
    )


def _at(x: float, y: float, angle: int) -> tuple[float, ...]:
    return (x, y, angle) if angle else (x, y)
