"""A sweep's windows and points as CSV, from the rows of its JSON object."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from designer.base.csv_tables import csv_text

_WINDOW = ("track", "from", "to", "response", "symmetric", "steps")
_END = ("kind", "value", "error", "reason")
_POINT = (
    "kind", "value", "error", "response", "symmetric", "before", "after", "stable_below",
    "stable_above", "side", "stops", "reason", "caption",
)  # fmt: skip


def windows_csv(windows: Sequence[Mapping[str, Any]]) -> str:
    """A row a window, with what is known of its two ends."""
    ends = [(side, key) for side in ("from", "to") for key in _END]
    columns = (*_WINDOW, *(f"{side}_end_{key}" for side, key in ends))
    rows = []
    for window in windows:
        row = {key: window[key] for key in _WINDOW}
        for side, key in ends:
            row[f"{side}_end_{key}"] = window.get(f"{side}_end", {}).get(key)
        rows.append(row)
    return _csv(columns, rows)


def points_csv(points: Sequence[Mapping[str, Any]]) -> str:
    """A row a bifurcation point, or a window's end that was not located."""
    return _csv(_POINT, [{key: point.get(key) for key in _POINT} for point in points])


def _csv(columns: Sequence[str], rows: Iterable[Mapping[str, Any]]) -> str:
    return csv_text(columns, [{key: _text(cell) for key, cell in row.items()} for row in rows])


def _text(cell: object) -> str:
    if cell is None:
        return ""
    return str(cell).lower() if isinstance(cell, bool) else str(cell)
