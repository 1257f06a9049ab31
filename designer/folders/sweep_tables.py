"""What a sweep shows as CSV: windows and points from its JSON object, counted basins, curves."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from designer.base.csv_tables import csv_text
from designer.base.si_unit import Unit
from designer.bifurcations.basin_shares import BasinShares
from designer.bifurcations.border_curve import BorderCurve

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


def shares_csv(shares: BasinShares) -> str:
    """A row for each attractor at each value: its share of the starts with its limits (95 %), its
    response, and its first strobe."""
    plan, starts = shares.plan, len(shares.plan.numbers)
    columns = (
        plan.parameter, "attractor", "response", "symmetric", "twin", "count", "starts", "share",
        "low", "high", *plan.subject.states,
    )  # fmt: skip
    rows = []
    for value, step in zip(plan.values.tolist(), shares.steps, strict=True):
        for s in step:
            cells = (
                value, s.attractor, s.response, s.symmetric, s.twin, s.count, starts,
                s.count / starts, *shares.interval(s.count), *s.strobes[0],
            )  # fmt: skip
            rows.append(dict(zip(columns, cells, strict=True)))
    return _csv(columns, rows)


def curves_csv(
    curves: Sequence[BorderCurve], first: str, second: str, units: Mapping[str, Unit] | None = None
) -> str:
    """A row a point: the curve's number, kind, response, symmetry, both values, whether the orbit
    is stable on one side, and where the curve was begun if it was switched to; points of
    codimension two follow their curve, with their name as kind. units : of the parameters that have
    an SI unit; such a one's values stand in it too, last."""
    in_si = {name: unit for name, unit in (units or {}).items() if name in (first, second)}
    columns = [
        "curve", "kind", "response", "symmetric", first, second, "stable", "begun_at",
        *(f"{name}_{unit.suffix}" for name, unit in in_si.items()),
    ]  # fmt: skip

    def place(values: Sequence[float]) -> dict[str, float]:
        at = dict(zip((first, second), values, strict=True))
        return at | {f"{n}_{unit.suffix}": at[n] * unit.scale for n, unit in in_si.items()}

    rows = []
    for number, c in enumerate(curves, 1):
        begun = c.begun_at and f"{c.begun_at.name} of curve {c.begun_at.curve}"
        head = {"curve": number, "response": c.response, "symmetric": c.symmetric}
        points = zip(c.points.tolist(), c.stable, strict=True)
        shown: list[tuple[str, Any, bool | None]]
        shown = [(c.kind, values, stable) for values, stable in points]
        shown += [(met.name, met.values, None) for met in c.codimension_two]
        rows += [
            {**head, "kind": kind, **place(values), "stable": stable, "begun_at": begun}
            for kind, values, stable in shown
        ]
    return _csv(columns, rows)


def _in_unit(keys: Sequence[str], suffix: str) -> tuple[str, ...]:
    return tuple(f"{key}_{suffix}" for key in keys) if suffix else ()


def _csv(columns: Sequence[str], rows: Iterable[Mapping[str, Any]]) -> str:
    return csv_text(columns, [{key: _text(cell) for key, cell in row.items()} for row in rows])


def _text(cell: object) -> str:
    if cell is None:
        return ""
    return str(cell).lower() if isinstance(cell, bool) else str(cell)
