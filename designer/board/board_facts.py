"""What a fab asks of a board before it gives a price: size, layers, finest copper and holes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from designer.base.errors import InputError
from designer.board.kicad_reader import TRACKS, BoardFile, drilled
from designer.board.outline import LAYER
from designer.board.sexpr import Expression, read

SILK = ".SilkS"
"""How the names of the two layers of silk screen end."""
SCREW = 2.5
"""Least diameter of a hole that is taken for a screw's [mm]."""
TEXTS = ("property", "fp_text", "gr_text")


@dataclass(frozen=True)
class BoardFacts:
    """Figures of a board, read from its file."""

    width: float
    """Width of the rectangle around its edge [mm]."""
    height: float
    """Height of that rectangle [mm]."""
    thickness: float
    """Thickness [mm]."""
    layers: int
    """Number of copper layers."""
    finest_track: float | None
    """Width of the finest track [mm]; None where there is none."""
    smallest_hole: float | None
    """Diameter of the smallest round hole [mm]; None where there is none."""
    largest_hole: float | None
    """Diameter of the largest round hole [mm]; None where there is none."""
    narrowest_slot: float | None
    """Width of the narrowest slot in a pad [mm]; None where there is none."""
    via_ring: float | None
    """Thinnest ring of copper round a via's hole [mm]; None where there is no via."""
    pad_ring: float | None
    """Thinnest ring of copper round a plated hole in a pad [mm]; None where there is none."""
    silk_height: float | None
    """Height of the lowest letters in silk [mm]; None where there are none."""
    silk_stroke: float | None
    """Width of the finest line in silk [mm]; None where there is none."""
    vias: int
    holes: int
    """Number of holes in pads."""
    screw_holes: int
    """Bare holes that a screw of 2.5 mm goes through."""
    bare_layers: tuple[str, ...]
    """Inner layers without a track, a zone or a pad of their own, while another has a track."""
    surface_parts: int
    """Parts that are soldered on the surface."""
    through_parts: int
    """Parts that are soldered through holes."""


def check_edge(board: BoardFile) -> None:
    """Whether a board has an edge that a maker can mill.

    Raises
    ------
    InputError : it has none, or one that is not closed.
    """
    found = None if len(board.outline.sides) else "no edge"
    if (at := board.outline.open_at) is not None:
        found = f"an edge that is not closed at ({at[0]:.2f} mm, {at[1]:.2f} mm)"
    if found is not None:
        raise InputError(board.path, LAYER, found, f"a closed line on {LAYER}")


def facts_of(board: BoardFile) -> BoardFacts:
    """The figures of a board; of one without an edge, width and height are nan (``check_edge``).

    Raises
    ------
    InputError : a number is missing that KiCad 9 writes.
    """
    tree = read(board.text, board.path)
    tracks = [each.get("width").number() for kind in TRACKS for each in tree.all(kind)]
    vias = tree.all("via")
    pads = [pad for footprint in tree.all("footprint") for pad in footprint.all("pad")]
    holes = [(pad, hole) for pad in pads if (hole := drilled(pad)) is not None]
    round_ = [x for _, (x, y) in holes if x == y]
    sizes = [*(via.get("drill").number() for via in vias), *round_]
    letters = [font for text in _silk_texts(tree) for font in text.get("effects").all("font")]
    edge = board.outline.sides.reshape(-1, 2)
    width, height = np.ptp(edge, axis=0) if len(edge) else (math.nan, math.nan)
    return BoardFacts(
        width=float(width),
        height=float(height),
        thickness=tree.get("general").get("thickness").number(),
        layers=sum(layer.text(0).endswith(".Cu") for layer in tree.get("layers").children),
        finest_track=min(tracks, default=None),
        smallest_hole=min(sizes, default=None),
        largest_hole=max(sizes, default=None),
        narrowest_slot=min((min(hole) for _, hole in holes if hole[0] != hole[1]), default=None),
        via_ring=min(
            ((via.get("size").number() - via.get("drill").number()) / 2.0 for via in vias),
            default=None,
        ),
        pad_ring=min((_ring(pad, hole) for pad, hole in holes if _plated(pad)), default=None),
        silk_height=min((font.get("size").number(0) for font in letters), default=None),
        silk_stroke=min([*_letter_strokes(letters), *_silk_lines(tree)], default=None),
        vias=len(vias),
        holes=len(holes),
        screw_holes=sum(not _plated(pad) and min(hole) >= SCREW for pad, hole in holes),
        bare_layers=_bare_layers(tree),
        surface_parts=_fitted(tree, "smd"),
        through_parts=_fitted(tree, "through_hole"),
    )


def _bare_layers(tree: Expression) -> tuple[str, ...]:
    laid = {each.get("layer").text() for kind in TRACKS for each in tree.all(kind)}
    if not laid:
        return ()
    owners = [each for zone in tree.all("zone") for each in zone.children]
    owners += [pad for footprint in tree.all("footprint") for pad in footprint.all("pad")]
    used = laid | {
        layer
        for owner in (*owners, *tree.all("zone"))
        for each in (*owner.all("layer"), *owner.all("layers"))
        for layer in each.atoms
    }
    return tuple(
        name
        for layer in tree.get("layers").children
        if (name := layer.text(0)).endswith(".Cu") and name not in {*used, "F.Cu", "B.Cu"}
    )


def _plated(pad: Expression) -> bool:
    return pad.text(1) != "np_thru_hole"


def _ring(pad: Expression, hole: tuple[float, float]) -> float:
    """The copper that is left beside a pad's hole where that is in the pad's middle [mm]; an offset
    takes from it."""
    size, drill = pad.get("size"), pad.get("drill")
    offset = drill.find("offset")
    off = (0.0, 0.0) if offset is None else (abs(offset.number(0)), abs(offset.number(1)))
    return min((size.number(k) - hole[k]) / 2.0 - off[k] for k in (0, 1))


def _on_silk(item: Expression) -> bool:
    return any(layer.text().endswith(SILK) for layer in item.all("layer"))


def _silk_texts(tree: Expression) -> Iterator[Expression]:
    """Every text that is printed on the board."""
    for owner in (tree, *tree.all("footprint")):
        for kind in TEXTS:
            yield from (t for t in owner.all(kind) if _on_silk(t) and not _hidden(t))


def _hidden(text: Expression) -> bool:
    """KiCad 9 says so in a list of its own, KiCad 7 in a word."""
    hide = text.find("hide")
    words = [*text.atoms, *text.get("effects").atoms]
    return "hide" in words or (hide is not None and hide.text() == "yes")


def _letter_strokes(fonts: Sequence[Expression]) -> Iterator[float]:
    for font in fonts:
        stroke = font.find("thickness")
        if stroke is not None:
            yield stroke.number()


def _silk_lines(tree: Expression) -> Iterator[float]:
    """Width of every line drawn in silk [mm]; a filled shape has none."""
    for owner in (tree, *tree.all("footprint")):
        for item in owner.children:
            stroke = item.find("stroke")
            if stroke is None or not _on_silk(item):
                continue
            width = stroke.get("width").number()
            if width > 0.0:
                yield width


def _fitted(tree: Expression, kind: str) -> int:
    """Footprints of this kind that a part is soldered to."""
    attributes = [each.atoms for f in tree.all("footprint") for each in f.all("attr")]
    return sum(kind in words and "dnp" not in words for words in attributes)
