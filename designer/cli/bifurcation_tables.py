"""Windows, points, maps and basins as tables for people, on standard error."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from designer.base.si_unit import suffix, value_text
from designer.cli.tables import add_row, files, new_console, new_table, print_line

LONGEST = 40
"""Lines of a table; the JSON object has them all."""


def show(answer: Mapping[str, Any], out: Path | None, reused: bool) -> None:
    """What the verb found, and where it was written."""
    {"sweep": _sweep, "map": _map, "basins": _basins}[answer["kind"]](answer)
    if out is not None:
        files(out, reused)


def _sweep(answer: Mapping[str, Any]) -> None:
    console = new_console()
    unit = f" [{answer['unit']}]" if answer["unit"] else ""
    wide = answer["windows"]
    widest = sorted(wide, key=lambda w: -w["steps"])[:LONGEST]
    si = answer.get("si_unit")
    heads = ["from (SI)", "to (SI)"] if si else []
    table = new_table(
        "Windows", "track", f"from{unit}", "to", *heads, "response", "symmetric", "steps"
    )
    for w in sorted(widest, key=lambda w: (w["track"], w["from"])):
        symmetric = {True: "yes", False: "no", None: "-"}[w["symmetric"]]
        ends: tuple[str, ...] = (f"{w['from']:.6g}", f"{w['to']:.6g}")
        ends += (_si(w, "from", si), _si(w, "to", si)) if si else ()
        add_row(table, w["track"], *ends, w["response"], symmetric, str(w["steps"]))
    console.print(table)
    if len(wide) > len(widest):
        print_line(console, f"and {len(wide) - len(widest)} narrower ones (--json has them all)")
    if answer["points"]:
        print_line(console, "\nBifurcation points")
        for text in _points(answer["points"][:LONGEST], si):
            print_line(console, text)


def _points(points: Sequence[Mapping[str, Any]], si: str | None) -> Iterator[str]:
    """What happens at each point on its branch, and below it what the sweep's tracks show."""
    for p in points:
        # Folders of older versions have no caption.
        text = p.get("caption", f"{p['kind']} at {p['value']:.9g}: {p['before']} → {p['after']}")
        yield f"{text} ({_si(p, 'value', si)})" if si else text
        for c in p.get("changes", []):
            if c["track"] is not None:
                yield f"  {c['track']}: {c['text']}"


def _si(row: Mapping[str, Any], key: str, unit: str) -> str:
    """A value in its SI unit, with more digits than elsewhere: ends of windows lie close."""
    return value_text(row[f"{key}_{suffix(unit)}"], unit, digits=6)


def _map(answer: Mapping[str, Any]) -> None:
    table = new_table(
        f"Map over {answer['x']['name']} and {answer['y']['name']}", "response", "share"
    )
    total = answer["x"]["steps"] * answer["y"]["steps"]
    for response, count in list(answer["counts"].items())[:LONGEST]:
        add_row(table, response, f"{count / total:.2%}")
    new_console().print(table)


def _basins(answer: Mapping[str, Any]) -> None:
    table = new_table("Attractors", "number", "response", "symmetric", "twin", "share of starts")
    for a in answer["attractors"][:LONGEST]:
        symmetric = {True: "yes", False: "no", None: "-"}[a["symmetric"]]
        twin = "-" if a["twin"] is None else str(a["twin"])
        add_row(table, str(a["number"]), a["response"], symmetric, twin, f"{a['share']:.2%}")
    new_console().print(table)
