"""What ``search`` says on a terminal beside what ``run`` does."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from designer.cli.tables import add_row, new_console, new_table, print_line


def searched(answer: Mapping[str, Any]) -> None:
    """Places, what limits them, what ngspice confirmed, what each lever is worth."""
    console, search = new_console(), answer["search"]
    places = search["final"]["responses"]
    confirmed = answer["confirmation"]["responses"]
    table = new_table("Places", "response", "ω", "b", "distance", "predicted", "confirmed", gap=1)
    for place, heard in zip(places, confirmed, strict=True):
        distance = place["distance"]
        add_row(
            table,
            place["expected"] or "any",
            f"{place['omega']:.5g}",
            f"{place['b']:.4g}",
            "-" if distance is None else f"{distance:.2f} σ",
            f"{place['predicted_yield']:.4f}",
            f"{heard['agreed']}/{heard['asked']}",
        )
    console.print(table)
    for place, heard in zip(places, confirmed, strict=True):
        if heard["limited_by"]:
            name = place["expected"] or "any"
            print_line(console, f"{name} is limited by {heard['limited_by']['line']}")
    if not search["contributions"]:
        return
    table = new_table("Levers: smallest distance", "lever", "from", "to", "alone", "without", gap=1)
    for lever in search["contributions"]:
        ends = [lever[k]["smallest_distance"] for k in ("alone", "without")]
        shown = ["-" if d is None else f"{d:.2f} σ" for d in ends]
        add_row(table, lever["lever"], lever["from"], lever["to"], *shown)
    console.print(table)
