"""The answer of ``export``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from typing_extensions import TypedDict

from designer.answers.shared_rows import ProvenanceRow


class RoutingRow(TypedDict):
    board: str
    layers: int
    open: Mapping[str, int]
    """Connections by net."""
    length_mm: float
    vias: int


class ExportExtras(TypedDict, total=False):
    """By option."""

    fabs: Sequence[str]
    refused: Sequence[str]
    """Why there is no order."""
    dsn: str
    routing: RoutingRow


class ExportJson(ExportExtras):
    """What ``export`` prints."""

    format: int
    files: Sequence[str]
    provenance: ProvenanceRow
