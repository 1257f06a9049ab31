"""The table ``[tuning]`` of a model file: how far the generator may be turned for one board."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from designer.base.schema import FileTable, check_values, number

_FRACTION = number("", "a number in [0, 1)", lambda value: 0.0 <= value < 1.0)


@dataclass(frozen=True)
class Bands(FileTable):
    """Half-widths of the bands that the generator may be tuned in, as fractions.

    Raises
    ------
    InputError : one is negative or not finite, or would turn the frequency or the amplitude to 0.
    """

    frequency: Annotated[float, _FRACTION] = 0.05
    """Half-width over the frequency in ``setup.csv``."""
    amplitude: Annotated[float, _FRACTION] = 0.10
    """Half-width over the amplitude in ``setup.csv``."""
    offset: Annotated[float, number("", "a number >= 0", lambda value: value >= 0.0)] = 0.05
    """Half-width of the DC offset, over the amplitude in ``setup.csv``."""

    def __post_init__(self) -> None:
        check_values(self, "tuning")

    def as_dict(self) -> dict[str, float]:
        return dict(self.__dict__)
