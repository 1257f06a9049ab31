"""The table ``[search]`` of a model file: what a search may change, and within which bounds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pydantic import BaseModel

from designer.base.schema import STRICT, Accepts, did_you_mean, number, span
from designer.model.circuit_table import DeadZone

DEAD_ZONES: tuple[DeadZone, ...] = ("saturation", "rectifier")


@dataclass(frozen=True)
class SearchSpec:
    """What a search may change."""

    omega: tuple[float, float] = (0.15, 2.0)
    """Dimensionless band in which ``omega = "best"`` is sought."""
    match_error: float = 0.005
    """Largest coefficient error that a design may have."""
    opamps: tuple[str, ...] = ()
    """Names of op-amps in the catalogue that may be tried; the file's own if empty."""
    dead_zones: tuple[DeadZone, ...] = DEAD_ZONES
    """Kinds of dead-zone stage that may be tried."""


def _band() -> Accepts:
    expected = "a range [low, high] of numbers from 0.001 to 1000, low < high"
    both = span("", expected, lambda value: 1e-3 <= value <= 1e3)

    def check(value: object) -> tuple[float, float]:
        low, high = both.check(value)
        if not low < high:
            raise ValueError
        return low, high

    return Accepts(expected, check)


def _names(expected: str, known: tuple[str, ...] = ()) -> Accepts:
    def check(value: object) -> tuple[str, ...]:
        if not isinstance(value, list) or not value:
            raise ValueError
        for name in value:
            if not isinstance(name, str):
                raise ValueError
            if known and name not in known:
                raise ValueError(did_you_mean(name, known))
        return tuple(dict.fromkeys(value))

    return Accepts(expected, check)


class SearchTable(BaseModel):
    """The keys of ``[search]``, each with what it accepts."""

    model_config = STRICT
    omega: Annotated[tuple[float, float], _band()] = SearchSpec.omega
    match_error: Annotated[
        float, number("", "a number from 0 to 1", lambda value: 0.0 <= value <= 1.0)
    ] = SearchSpec.match_error
    opamps: Annotated[tuple[str, ...], _names("a list of op-amps of the catalogue")] = ()
    dead_zones: Annotated[
        tuple[DeadZone, ...], _names("a list of saturation, rectifier", DEAD_ZONES)
    ] = DEAD_ZONES
