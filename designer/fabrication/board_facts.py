"""What a fab asks of a board before it gives a price: size, layers, finest copper and holes."""

from __future__ import annotations

from dataclasses import dataclass

from designer.base.errors import InputError
from designer.base.sexpr import Expression, read
from designer.board.kicad_reader import BoardFile
from designer.board.outline import LAYER


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
    """Diameter of the smallest hole [mm]; None where there is none."""
    vias: int
    """Number of vias."""
    holes: int
    """Number of holes in pads."""
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


def board_facts(board: BoardFile) -> BoardFacts:
    """The figures of a board with an edge (``check_edge``).

    Raises
    ------
    InputError : a number is missing that KiCad 9 writes.
    """
    tree = read(board.text, board.path)
    tracks = [each.get("width").number() for kind in ("segment", "arc") for each in tree.all(kind)]
    vias = tree.all("via")
    pads = [pad for footprint in tree.all("footprint") for pad in footprint.all("pad")]
    drilled = [size for pad in pads if (size := _drill(pad)) is not None]
    sizes = [*(via.get("drill").number() for via in vias), *drilled]
    edge = board.outline.sides.reshape(-1, 2)
    width, height = edge.max(axis=0) - edge.min(axis=0)
    return BoardFacts(
        width=float(width),
        height=float(height),
        thickness=tree.get("general").get("thickness").number(),
        layers=sum(layer.text(0).endswith(".Cu") for layer in tree.get("layers").children),
        finest_track=min(tracks, default=None),
        smallest_hole=min(sizes, default=None),
        vias=len(vias),
        holes=len(drilled),
        surface_parts=_fitted(tree, "smd"),
        through_parts=_fitted(tree, "through_hole"),
    )


def _drill(pad: Expression) -> float | None:
    """Smaller diameter of a pad's hole [mm]; None on the surface. A slot states two."""
    drill = pad.find("drill")
    sizes = [] if drill is None else [float(a) for a in drill.atoms if a != "oval"]
    return min(sizes, default=None)


def _fitted(tree: Expression, kind: str) -> int:
    """Footprints of this kind that a part is soldered to."""
    attributes = [each.atoms for f in tree.all("footprint") for each in f.all("attr")]
    return sum(kind in words and "dnp" not in words for words in attributes)
