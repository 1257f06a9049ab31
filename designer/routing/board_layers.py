"""A board of two or of four copper layers; the inner ones of four are planes of ground."""

from __future__ import annotations

from designer.board.kicad_board import layers
from designer.board.kicad_reader import TRACKS
from designer.board.sexpr import Expression, expression_text, read
from designer.routing.board_copper import FRONT, inner_layers

INNER = {2: (), 4: ((4, "In1.Cu", "power"), (6, "In2.Cu", "power"))}
"""Inner layers by the number of copper layers, as KiCad 9 numbers them."""


def layer_count(text: str) -> int:
    """How many copper layers a ``.kicad_pcb`` has."""
    return 2 + len(inner_layers(read(text)))


def with_layers(text: str, count: int) -> str:
    """A board of another number of copper layers, 2 or 4, without tracks, vias and zones.

    text : of the ``.kicad_pcb``; the new one is given back.
    """
    board = read(text)
    listed, inner = board.get("layers"), inner_layers(board)
    outer = [each for each in listed.children if each.text(0) not in inner]
    at = 1 + next(i for i, each in enumerate(outer) if each.text(0) == FRONT)
    new = Expression((listed.items[0], *outer[:at], *layers(INNER[count]), *outer[at:]))
    gone = (*TRACKS, "via", "zone")
    items = [i for i in board.items if not (isinstance(i, Expression) and i.name in gone)]
    return expression_text(Expression(tuple(new if i is listed else i for i in items)))
