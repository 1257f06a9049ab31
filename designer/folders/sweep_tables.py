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


def windows_csv(windows: Sequence[Mapping[str, Any]], suffix: str = "") -> str:
    """A row a window, with what is known of its two ends. suffix : of the keys with the swept
    quantity in its SI unit, such as "hz"; "" where it has none."""
    end_keys = (*_END, *_in_unit(("value",), suffix))
    window_keys = (*_WINDOW, *_in_unit(("from", "to"), suffix))
    ends = [(side, key) for side in ("from", "to") for key in end_keys]
    columns = (*window_keys, *(f"{side}_end_{key}" for side, key in ends), "family")
    rows = []
    for window in windows:
        row = {key: window[key] for key in window_keys}
        for side, key in ends:
            row[f"{side}_end_{key}"] = window.get(f"{side}_end", {}).get(key)
        row["family"] = window.get("family")
        rows.append(row)
    return _csv(columns, rows)


def points_csv(points: Sequence[Mapping[str, Any]], suffix: str = "") -> str:
    """A row a bifurcation point, or a window's end that was not located. suffix : as of
    ``windows_csv``."""
    columns = (*_POINT, *_in_unit(("value",), suffix))
    return _csv(columns, [{key: point.get(key) for key in columns} for point in points])


def _in_unit(keys: Sequence[str], suffix: str) -> tuple[str, ...]:
    return tuple(f"{key}_{suffix}" for key in keys) if suffix else ()


def _csv(columns: Sequence[str], rows: Iterable[Mapping[str, Any]]) -> str:
    return csv_text(columns, [{key: _text(cell) for key, cell in row.items()} for row in rows])


def _text(cell: object) -> str:
    if cell is None:
        return ""
    return str(cell).lower() if isinstance(cell, bool) else str(cell)
