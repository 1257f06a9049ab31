"""The bill of materials of a design as a pandas frame."""

from __future__ import annotations

from typing import TYPE_CHECKING

from designer.base.frames import frame
from designer.board.board_parts import Designed, board_circuit
from designer.board.bom import COLUMNS, bill
from designer.board.component import components, to_buy

if TYPE_CHECKING:
    import pandas as pd


def bill_of_materials(made: Designed) -> pd.DataFrame:
    """What is to be bought for one board: the rows of ``bom.csv``, with numbers as numbers.

    made : what ``synthesise`` or ``run`` gives. Designators stand in one text, and so does the
    grade, which a part may lack.

    Raises
    ------
    InputError : a case or a part that the catalogue does not have.
    Unreachable : a value that cannot be bought.
    """
    circuit, choice = board_circuit(made)
    lines = bill(to_buy(components(circuit, made.catalog, choice), choice))
    numbers = ("quantity", "price_class")
    rows = [{**line.cells(), **{n: getattr(line, n) for n in numbers}} for line in lines]
    return frame(rows, COLUMNS)
