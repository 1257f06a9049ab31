"""How far the generator may be turned for one board: the bands of a tuned yield."""

from __future__ import annotations

from dataclasses import dataclass

from designer.base.errors import InputError


@dataclass(frozen=True)
class Bands:
    """Half-widths of the bands that the generator may be tuned in, as fractions.

    Raises
    ------
    InputError : one is negative or not finite, or would turn the frequency or the amplitude to 0.
    """

    frequency: float = 0.05
    """Half-width over the frequency in ``setup.csv``."""
    amplitude: float = 0.10
    """Half-width over the amplitude in ``setup.csv``."""
    offset: float = 0.05
    """Half-width of the DC offset, over the amplitude in ``setup.csv``."""

    def __post_init__(self) -> None:
        for name, most in (("frequency", 1.0), ("amplitude", 1.0), ("offset", float("inf"))):
            value = getattr(self, name)
            if not 0.0 <= value < most:
                bound = "a finite number >= 0" if name == "offset" else "a number in [0, 1)"
                raise InputError(None, f"tuning.{name}", value, bound)

    def as_dict(self) -> dict[str, float]:
        return dict(self.__dict__)
