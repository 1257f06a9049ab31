"""The answers of ``catalog`` and ``new``."""

from __future__ import annotations

from collections.abc import Sequence

from typing_extensions import TypedDict


class CatalogNames(TypedDict):
    """What can be bought, by name."""

    format: int
    opamps: Sequence[str]
    families: Sequence[str]
    diodes: Sequence[str]
    references: Sequence[str]
    supply_diodes: Sequence[str]
    trimmers: Sequence[str]
    headers: Sequence[str]
    coaxial_jacks: Sequence[str]
    hash: str


class FigureCheckRow(TypedDict):
    figure: str
    unit: str
    expected: float
    measured: float
    tolerance: float
    """Relative."""
    assumed: bool
    agrees: bool


class OpAmpChecks(TypedDict):
    """What ``catalog --check`` prints."""

    format: int
    opamp: str
    checks: Sequence[FigureCheckRow]
    hash: str


class NewAnswer(TypedDict):
    format: int
    files: Sequence[str]
