"""The bill as a page: which part is R7, found on the board's picture and the other way round.

One file that loads nothing, for keyboard, mouse and phone; ``page.html#R7`` opens at a part.
"""

from __future__ import annotations

from collections.abc import Sequence

from designer.base.html_templates import page_templates
from designer.board.bom import Line
from designer.board.kicad_reader import BoardFile
from designer.fabrication.board_picture import board_svg


def bom_page(title: str, board: BoardFile, bought: Sequence[Line]) -> str:
    """The page as HTML. title : of the model file, as it is."""
    sides = [("From above", board_svg(board, "top")), ("From below", board_svg(board, "bottom"))]
    page = page_templates("designer.fabrication").get_template("bom_page.html.j2")
    return page.render(title=" ".join(title.split()), sides=sides, lines=bought)
