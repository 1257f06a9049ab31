"""Pictures of a board's two sides, drawn from its file: SVG, the same for the same board.

Millimetres are the picture's units. Every part is a group with its designator in ``data-part``, by
which a page finds it. Shown are the edge, copper under the mask (tracks, and zones as they are
filled), pads, holes, bodies and what is printed.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from markupsafe import Markup, escape

from designer.board.kicad_reader import BoardFile, pad_corners, turned
from designer.board.outline import pen_path
from designer.board.sexpr import Atom, Expression, read

Side = Literal["top", "bottom"]
Point = tuple[float, float]
MARGIN = 1.0
"""About the board [mm]."""
MASK, COPPER, VIA, PAD, HOLE, PRINT, BODY = (
    "#14532d", "#1f7a43", "#3fa66a", "#d9b55b", "#10131a", "#f4f4ee", "#2b2d33",
)  # fmt: skip
_SHAPES = ("line", "rect", "circle", "arc", "poly", "curve")


@dataclass(frozen=True)
class _View:
    """One side of a board, and how it is seen."""

    side: Side
    box: tuple[float, float, float, float]
    """Left, top, right and bottom of the board's edge [mm]."""

    @property
    def letter(self) -> str:
        """What the names of the side's layers begin with."""
        return "F" if self.side == "top" else "B"

    def shows(self, item: Expression, kind: str) -> bool:
        """Whether something lies on this side's layer of a kind, such as "Cu"."""
        named = [
            name for key in ("layer", "layers") for each in item.all(key) for name in each.atoms
        ]
        return any(f"{start}.{kind}" in named for start in (self.letter, "*", "F&B"))


def board_svg(board: BoardFile, side: Side) -> Markup:
    """One side of a board, the lower one as it is seen from below.

    Raises
    ------
    InputError : an item without what KiCad 9 writes in it.
    """
    edge = board.outline.sides.reshape(-1, 2)
    left, top = edge.min(axis=0).tolist() if len(edge) else (0.0, 0.0)
    right, bottom = edge.max(axis=0).tolist() if len(edge) else (1.0, 1.0)
    view = _View(side, (left, top, right, bottom))
    tree = read(board.text, board.path)
    wide, high = right - left + 2.0 * MARGIN, bottom - top + 2.0 * MARGIN
    turn = "" if side == "top" else f' transform="matrix(-1 0 0 1 {_n(left + right)} 0)"'
    body = Markup("").join(
        [
            *(_path([chain], MASK) for chain in _edges(tree)),
            *_copper(tree, view),
            *_vias(tree),
            *(_part(item, view) for item in tree.all("footprint")),
            *_printed(tree, "gr", view, (0.0, 0.0), 0.0),
        ]
    )
    label = f"The board from {'above' if side == 'top' else 'below'}"
    return Markup(
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" aria-label="{label}" '
        f'width="{_n(wide)}mm" height="{_n(high)}mm" '
        f'viewBox="{_n(left - MARGIN)} {_n(top - MARGIN)} {_n(wide)} {_n(high)}" '
        f'font-family="sans-serif"><g{turn}>{body}</g></svg>\n'
    )


def _n(value: float) -> str:
    """A length in hundredths of a millimetre."""
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _path(chains: Iterable[Sequence[Point]], fill: str) -> Markup:
    data = "".join(f"M{' '.join(f'{_n(x)},{_n(y)}' for x, y in chain)}Z" for chain in chains)
    return Markup(f'<path d="{data}" fill="{fill}" fill-rule="evenodd"/>') if data else Markup("")


def _stroke(points: Sequence[Point], width: float, colour: str) -> Markup:
    data = "M" + " ".join(f"{_n(x)},{_n(y)}" for x, y in points)
    return Markup(
        f'<path d="{data}" fill="none" stroke="{colour}" stroke-width="{_n(width)}" '
        'stroke-linecap="round" stroke-linejoin="round"/>'
    )


def _dot(at: Point, radius: float, fill: str) -> Markup:
    return Markup(f'<circle cx="{_n(at[0])}" cy="{_n(at[1])}" r="{_n(radius)}" fill="{fill}"/>')


def _edges(tree: Expression) -> Iterator[list[Point]]:
    """The closed lines of the edge: pieces joined end to end."""
    pieces = [
        points
        for item in tree.children
        if any(layer.text() == "Edge.Cuts" for layer in item.all("layer"))
        if (points := pen_path(item))
    ]
    while pieces:
        chain = pieces.pop(0)
        while (after := _next(chain, pieces)) is not None:
            chain = [*chain, *after]
        yield chain


def _next(chain: Sequence[Point], pieces: list[list[Point]]) -> list[Point] | None:
    """The piece that goes on where a chain ends, taken from the pieces, the right way round."""
    for piece in pieces:
        for way in (piece, piece[::-1]):
            if math.dist(chain[-1], way[0]) < 0.01:
                pieces.remove(piece)
                return way
    return None


def _copper(tree: Expression, view: _View) -> Iterator[Markup]:
    """Zones as they are filled, and tracks."""
    for zone in tree.all("zone"):
        filled = [each for each in zone.all("filled_polygon") if view.shows(each, "Cu")]
        chains = [[(p.number(0), p.number(1)) for p in f.get("pts").all("xy")] for f in filled]
        yield _path(chains, COPPER)
    for item in (*tree.all("segment"), *tree.all("arc")):
        if view.shows(item, "Cu"):
            points = _track(item)
            yield _stroke(points, item.get("width").number(), COPPER)


def _track(item: Expression) -> list[Point]:
    if item.name == "arc":
        return pen_path(Expression((Atom("gr_arc"), *item.items[1:])))
    return [(item.get(end).number(0), item.get(end).number(1)) for end in ("start", "end")]


def _vias(tree: Expression) -> Iterator[Markup]:
    """Vias under the mask."""
    for via in tree.all("via"):
        at = via.get("at").number(0), via.get("at").number(1)
        yield _dot(at, via.get("size").number() / 2.0, VIA)
        yield _dot(at, via.get("drill").number() / 2.0, HOLE)


def _part(item: Expression, view: _View) -> Markup:
    """A part that stands on this side, or whose pads go through."""
    at = item.get("at")
    origin = at.number(0), at.number(1)
    turn = math.radians(at.number(2) if len(at.atoms) > 2 else 0.0)
    texts = {each.text(0): each for each in item.all("property")}
    reference = texts["Reference"].text(1) if "Reference" in texts else ""
    value = texts["Value"].text(1) if "Value" in texts else ""
    here = view.shows(item, "Cu")
    fitted = not any("dnp" in each.atoms for each in item.all("attr"))
    drawn = [
        *(_bodies(item, view, origin, turn) if here and fitted else ()),
        *(_pad(pad, origin, turn) for pad in item.all("pad") if view.shows(pad, "Cu")),
        *_printed(item, "fp", view, origin, turn),
    ]
    if here and "Reference" in texts and view.shows(texts["Reference"], "SilkS"):
        drawn.append(_text(texts["Reference"], reference, view, origin, turn))
    if not any(drawn):
        return Markup("")
    return Markup('<g data-part="{}"><title>{}</title>{}</g>').format(
        reference, f"{reference} {value}".strip(), Markup("").join(drawn)
    )


def _bodies(item: Expression, view: _View, origin: Point, turn: float) -> Iterator[Markup]:
    for points, _ in _lines(item, "fp", view, "Fab", origin, turn):
        if len(points) > 2:
            yield _path([points], BODY)


def _pad(pad: Expression, origin: Point, turn: float) -> Markup:
    at = pad.get("at")
    place = turned((at.number(0), at.number(1)), origin, turn)
    own = math.radians(at.number(2) if len(at.atoms) > 2 else 0.0)
    drill = pad.find("drill")
    corners = pad_corners(pad, place, own)
    hole = [float(a) for a in drill.atoms if a != "oval"] if drill is not None else []
    return _path([corners] if corners else [], PAD) + (
        _dot(place, hole[0] / 2.0, HOLE) if hole else Markup("")
    )


def _printed(
    tree: Expression, prefix: str, view: _View, origin: Point, turn: float
) -> Iterator[Markup]:
    """What is printed on the board: lines and texts."""
    for points, width in _lines(tree, prefix, view, "SilkS", origin, turn):
        yield _stroke(points, max(width, 0.1), PRINT)
    for item in tree.all(f"{prefix}_text"):
        if view.shows(item, "SilkS"):
            text = item.text(0) if prefix == "gr" else item.text(1)
            yield _text(item, text, view, origin, turn)


def _lines(
    tree: Expression, prefix: str, view: _View, kind: str, origin: Point, turn: float
) -> Iterator[tuple[list[Point], float]]:
    """(points on the board, width) of each shape on this side's layer of a kind."""
    for item in tree.children:
        start, _, shape = item.name.partition("_")
        if start == prefix and shape in _SHAPES and view.shows(item, kind):
            points = pen_path(Expression((Atom(f"gr_{shape}"), *item.items[1:])))
            stroke = item.find("stroke")
            width = 0.0 if stroke is None else stroke.get("width").number()
            yield [turned(point, origin, turn) for point in points], width


def _text(item: Expression, text: str, view: _View, origin: Point, turn: float) -> Markup:
    """A text with its middle at its place, to be read from this side."""
    at, effects = item.get("at"), item.find("effects")
    x, y = turned((at.number(0), at.number(1)), origin, turn)
    size = 1.0 if effects is None else effects.get("font").get("size").number()
    angle = at.number(2) if len(at.atoms) > 2 else 0.0
    turn = -(angle % 180.0) or 0.0  # it is never upside down
    mirror = "" if view.side == "top" else " scale(-1 1)"
    anchor = {"left": "start", "right": "end"}.get(_justified(effects), "middle")
    return Markup(
        f'<text transform="translate({_n(x)} {_n(y)}){mirror} rotate({_n(turn)})" '
        f'font-size="{_n(1.3 * size)}" fill="{PRINT}" text-anchor="{anchor}" '
        f'dominant-baseline="central">{escape(text)}</text>'
    )


def _justified(effects: Expression | None) -> str:
    """Which end of a text stands at its place."""
    stated = None if effects is None else effects.find("justify")
    words = () if stated is None else stated.atoms
    return next((word for word in words if word in ("left", "right")), "")
