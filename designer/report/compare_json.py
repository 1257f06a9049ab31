"""A comparison as one JSON object, by the keys of docs/contract.md."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from designer.base.plain_json import FORMAT, plain
from designer.circuit import paper_values
from designer.circuit.packing import QUAD
from designer.report.comparison import DesignColumn


def comparison_json(columns: Sequence[DesignColumn]) -> dict[str, Any]:
    """``columns`` in order, and the sources of the printed values where they are one of them."""
    known = {s.output: s.name for s in columns[0].candidate.circuit.sections} if columns else {}
    answer: dict[str, Any] = {"columns": [_column(c) | _paper_names(c, known) for c in columns]}
    printed = [c for c in columns if c.candidate.name == paper_values.AS_PRINTED]
    if printed:
        names = printed[0].candidate.circuit.values
        answer["printed_in"] = {name: paper_values.SOURCE[name] for name in names}
    return dict(plain(answer))


def file_json(
    answer: Mapping[str, Any], title: str, provenance: Mapping[str, Any], seconds: float
) -> dict[str, Any]:
    """What ``compare.json`` holds."""
    head = {"format": FORMAT, "title": title}
    return {**head, **answer, "provenance": provenance, "cost": {"seconds": seconds}}


def in_answer(file: Mapping[str, Any]) -> dict[str, Any]:
    """The key ``comparison`` of what ``synthesise`` prints, from the object of the file."""
    return {k: v for k, v in file.items() if k in ("columns", "printed_in")}


def _paper_names(column: DesignColumn, known: Mapping[str, str]) -> dict[str, dict[str, str]]:
    """``paper_names``: what the paper calls each section, where its op-amps are no quads.

    known : names by the net of the output, of a circuit with the paper's op-amps.
    """
    circuit = column.candidate.circuit
    if circuit.figures is None or circuit.figures.sections == len(QUAD):
        return {}
    names = {s.name: known.get(s.output, s.name) for s in circuit.sections}
    return {"paper_names": names} if any(new != old for old, new in names.items()) else {}


def _column(column: DesignColumn) -> dict[str, Any]:
    candidate, errors, bill = column.candidate, column.errors, column.bill
    circuit, current, offset = candidate.circuit, column.current, column.offset
    return {
        "name": candidate.name,
        "what": candidate.what,
        "opamp": circuit.opamp,
        "supply": circuit.supply,
        "saturation": circuit.saturation,
        "parts": circuit.values,
        "errors": None if errors is None else errors.errors,
        "max_error": None if errors is None else errors.max_error,
        "reason": column.reason,
        "k0": column.k0,
        "f20": column.f20,
        "b": column.b,
        "threshold": None if errors is None else errors.scales.threshold,
        "frequency_hz": candidate.frequency,
        "frequency_error": column.frequency_error,
        "amplitude_v_peak": candidate.amplitude,
        "responses": [
            {
                "omega": s.omega,
                "expected": s.expected,
                "circuit": s.orbit.response,
                "kept": s.kept,
                "reason": s.orbit.reason,
            }
            for s in column.shown
        ],
        "peaks": {
            load.section: {k: v for k, v in load.__dict__.items() if k != "section"}
            for load in column.loads.sections
        },
        "not_run": column.loads.left_out,
        "largest_current": None
        if current is None
        else {
            "ampere": current.current,
            "section": current.section,
            "response": current.current_in,
        },
        "offset": None if offset is None else dict(offset.__dict__),
        "part_count": bill.parts,
        "packages": bill.packages,
        "distinct_values": bill.distinct,
        "unsold": bill.unsold,
        "price_at_most_eur": bill.price if math.isfinite(bill.price) else None,
    }
