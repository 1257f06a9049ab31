"""The table ``[search]`` of a model file: what a search may change, and within which bounds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from designer.base.schema import Accepts, FileTable, choice, line, number, several, span
from designer.model.circuit_table import DEAD_ZONES, DeadZone
from designer.model.mechanics import MechanicalModel, check_omega

BAND = (0.15, 2.0)
"""Band in which a frequency is sought, over the model's own."""


def _band() -> Accepts:
    expected = "a range [low, high] of numbers > 0, low < high"
    both = span("", expected, lambda value: value > 0.0)

    def check(value: object) -> tuple[float, float]:
        low, high = both.check(value)
        if not low < high:
            raise ValueError
        return low, high

    return Accepts(expected, check, json=both.json)


@dataclass(frozen=True)
class SearchSpec(FileTable):
    """What a search may change."""

    omega: Annotated[tuple[float, float] | None, _band()] = None
    """Band in which ``omega = "best"`` is sought, in the model's units; None for ``BAND``."""
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
        several("a list of " + ", ".join(DEAD_ZONES), choice(*DEAD_ZONES), least=1),
    ] = DEAD_ZONES
    """Kinds of dead-zone stage that may be tried."""

    def band(self, model: MechanicalModel) -> tuple[float, float]:
        """The band for a model.

        Raises
        ------
        InputError : the file's leaves the range of frequencies that is computed.
        """
        if self.omega is None:
            unit = model.second_order().own_frequency
            return BAND[0] * unit, BAND[1] * unit
        for end in self.omega:
            check_omega("search.omega", end, model)
        return self.omega
