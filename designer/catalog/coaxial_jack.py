"""A coaxial jack on the board, for the cable of a generator or an oscilloscope."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from designer.base.schema import choice
from designer.catalog import fields
from designer.catalog.entries import BoardEntry, Rating

Series = Literal["sma", "bnc"]


@dataclass(frozen=True, kw_only=True)
class CoaxialJack(BoardEntry):
    """A coaxial jack that is soldered to the board."""

    series: Annotated[Series, choice("sma", "bnc")]
    """The cables that fit."""
    rating: Rating = field(default_factory=Rating)
    """Power and voltage that it stands."""
    pins: Annotated[Mapping[str, str], fields.pins("signal", "shell")] = field(
        default_factory=lambda: {"signal": "1", "shell": "2"}, hash=False
    )
    """Number of the footprint's pads by name; KiCad's have the inner conductor at 1."""
    assumed: Annotated[tuple[str, ...], fields.ASSUMED] = ()
    """What could not be compared with a data sheet, in words."""
