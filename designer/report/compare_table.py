"""A comparison as a table for people: a row for each figure, a column for each design."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from designer.circuit.coefficients import EXACT

if TYPE_CHECKING:
    from designer.answers.design_answer import (
        ComparedColumn,
        ComparedResponseRow,
        Comparison,
        LargestCurrent,
        LoadRow,
    )

NONE = "-"


def rows(answer: Comparison) -> list[tuple[str, ...]]:
    """Label and one cell for each column of ``comparison_json``; the first row names them."""
    columns: Sequence[ComparedColumn] = answer["columns"]
    table = [("", *(c["name"] for c in columns))]
    for label, cells in _rows(columns):
        table.append((label, *cells))
    return table


def _rows(columns: Sequence[ComparedColumn]) -> Iterator[tuple[str, list[str]]]:
    yield "largest error", [_largest(c) for c in columns]
    names = dict.fromkeys(name for c in columns for name in c["errors"] or ())
    for name in names:
        yield f"  {name}", [_percent((c["errors"] or {}).get(name)) for c in columns]
    yield "k0 as built", [_number(c["k0"]) for c in columns]
    yield "f20 as built", [_number(c["f20"]) for c in columns]
    yield "b as driven", [_number(c["b"]) for c in columns]
    yield "frequency error", [_percent(c["frequency_error"]) for c in columns]
    yield (
        "generator at ω = 1",
        [f"{c['frequency_hz']:.5g} Hz, {c['amplitude_v_peak']:.4g} V" for c in columns],
    )
    yield "threshold", [_number(c["threshold"], " V") for c in columns]
    yield "op-amp, its limit", [f"{c['opamp']}, {c['saturation']:g} V" for c in columns]
    loads = [peaks(c) for c in columns]
    for section in dict.fromkeys(name for section_peaks in loads for name in section_peaks):
        yield f"  peak {section}", [_peak(section_peaks.get(section)) for section_peaks in loads]
    yield "largest current", [_current(c["largest_current"]) for c in columns]
    offsets = [c["offset"] for c in columns]
    yield "typical offset / clearance", [_number(o and o["typical"]) for o in offsets]
    yield "maximum offset / clearance", [_number(o and o["maximum"]) for o in offsets]
    yield "responses kept", [_wanted_count(c["responses"]) for c in columns]
    for i, response in enumerate(columns[0]["responses"]):
        wanted = f" ({response['expected']})" if response["expected"] else ""
        yield (
            f"  ω = {response['omega']:g}{wanted}",
            [
                r["circuit"] + ("" if r["kept"] else ", lost")
                for r in (c["responses"][i] for c in columns)
            ],
        )
    yield "parts", [str(c["part_count"]) for c in columns]
    yield "op-amp packages", [str(c["packages"]) for c in columns]
    yield "distinct values", [str(c["distinct_values"]) for c in columns]
    yield "parts not for sale", [str(len(c["unsold"])) for c in columns]
    yield "price of the rest, at most", [_number(c["price_at_most_eur"], " €") for c in columns]


def peaks(column: ComparedColumn) -> dict[str, LoadRow]:
    """The loads of a column by the names that the paper's columns have for its amplifiers."""
    names = column.get("paper_names", {})
    return {names.get(section, section): load for section, load in column["peaks"].items()}


def notes(answer: Comparison) -> list[str]:
    """What the columns are, and what could not be computed."""
    out = []
    for c in answer["columns"]:
        out.append(f"{c['name']}: {c['what']}")
        out += [f"{c['name']}, ω = {name}: {why}" for name, why in c["not_run"].items()]
    return out


def _largest(column: ComparedColumn) -> str:
    error = column["max_error"]
    return column["reason"] or NONE if error is None else _percent(error).lstrip("+")


def _percent(value: float | None) -> str:
    if value is None:
        return NONE
    return f"{100 * value:+.3g} %" if abs(value) > EXACT else "0"


def _number(value: float | None, unit: str = "") -> str:
    return NONE if value is None else f"{value:.4g}{unit}"


def _peak(load: LoadRow | None) -> str:
    return NONE if load is None else f"{max(abs(load['low']), abs(load['high'])):.3g} V"


def _current(load: LargestCurrent | None) -> str:
    return NONE if load is None else f"{1e3 * load['ampere']:.3g} mA, {load['section']}"


def _wanted_count(responses: Sequence[ComparedResponseRow]) -> str:
    return f"{sum(r['kept'] for r in responses)} of {len(responses)}" if responses else NONE
