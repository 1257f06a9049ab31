"""The table ``[search]`` of a model file: what a search may change, and within which bounds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from designer.base.schema import Accepts, FileTable, choice, line, number, several, span
from designer.model.circuit_table import DeadZone

DEAD_ZONES: tuple[DeadZone, ...] = ("saturation", "rectifier")


def _band() -> Accepts:
    expected = "a range [low, high] of numbers from 0.001 to 1000, low < high"
    both = span("", expected, lambda value: 1e-3 <= value <= 1e3)

    def check(value: object) -> tuple[float, float]:
        low, high = both.check(value)
        if not low < high:
            raise ValueError
        return low, high

    return Accepts(expected, check)


@dataclass(frozen=True)
class SearchSpec(FileTable):
    """What a search may change."""

    omega: Annotated[tuple[float, float], _band()] = (0.15, 2.0)
    """Dimensionless band in which ``omega = "best"`` is sought."""
    match_error: Annotated[
        float, number("", "a number from 0 to 1", lambda value: 0.0 <= value <= 1.0)
    ] = 0.005
    """Largest coefficient error that a design may have."""
    opamps: Annotated[
        tuple[str, ...], several("a list of op-amps of the catalogue", line(""), least=1)
    ] = ()
    """Names of op-amps in the catalogue that may be tried; the file's own if empty."""
    dead_zones: Annotated[
        tuple[DeadZone, ...],
        several("a list of saturation, rectifier", choice(*DEAD_ZONES), least=1),
    ] = DEAD_ZONES
    """Kinds of dead-zone stage that may be tried."""
