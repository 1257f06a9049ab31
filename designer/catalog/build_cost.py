"""What a board costs beside its parts, by the size of the order."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from designer.base.schema import FileTable, flag, line, number, whole_number

_EURO = number("", "a number >= 0, in euro", lambda value: value >= 0.0)


@dataclass(frozen=True)
class BuildCost(FileTable):
    """What an order of so many boards is charged with, in euro without tax and transport."""

    boards: Annotated[int, whole_number("a whole number of boards, at least 1", 1)]
    """How many boards are ordered at once."""
    part_factor: Annotated[float, number("", "a factor > 0", lambda value: value > 0.0)]
    """A part's price at this size of order, against the one at a hundred pieces."""
    board_order: Annotated[float, _EURO]
    """For each order of bare boards."""
    board_area: Annotated[float, _EURO]
    """For each dm² of a bare board with two layers."""
    assembly_order: Annotated[float, _EURO]
    """For each order that is assembled: set-up and stencil."""
    assembly_line: Annotated[float, _EURO]
    """For each line of the bill that the assembler loads, an order."""
    surface_part: Annotated[float, _EURO]
    """For each part that is soldered on the surface."""
    through_part: Annotated[float, _EURO]
    """For each part that is soldered through holes."""
    source: Annotated[str, line("where the figures come from")]
    """Where the figures come from."""
    assumed: Annotated[bool, flag()] = False
    """Whether they are assumptions."""

    @property
    def name(self) -> str:
        return str(self.boards)
