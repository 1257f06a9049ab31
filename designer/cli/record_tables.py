"""What ``bench`` answers, as tables and lines for people."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from designer.cli.console import say, table
from designer.cli.tables import YES_NO, drive_cells


def benched(answer: Mapping[str, Any]) -> None:
    """What each record shows; then what is not sure, and what would tell."""
    rows = answer["records"]
    table(
        "Records",
        (
            {
                "record": r["file"],
                **drive_cells(r, rows),
                "generator": f"{r['frequency_hz']:.5g} Hz",
                "shows": r["response"],
                "sure": YES_NO[r["sure"]],
                "wanted there": r["wanted"] or "-",
                "exact circuit": (r["exact_circuit"] or {}).get("response", "-"),
            }
            for r in rows
        ),
    )
    for r in rows:
        for cut in r["clipped"]:
            say(f"{r['file']}: {cut['words']}")
        if r["others"]:
            say(f"{r['file']}: {r['response']}, or {' or '.join(r['others'])}")
        if r["reason"]:
            say(f"{r['file']}: not sure, for {r['reason']}. What would tell: {r['would_tell']}.")
    for board in answer["boards"]:
        _fitted(board)
    for kind in answer["spread"]:
        say(
            f"{kind['kind']} differ by {kind['factor']:.2g} times what [spread] says "
            f"({kind['low']:.2g} to {kind['high']:.2g})"
        )


def _fitted(board: Mapping[str, Any]) -> None:
    """What the records tell of a board, and what to turn on it."""
    of = f" {board['board']}" if board["board"] else ""
    if board["reason"]:
        say(f"The board{of} was not found: {board['reason']}")
        return
    rows = (
        {
            "figure": f["name"],
            "unit": f["unit"],
            "this board": f"{f['value']:.5g}",
            "95 %": f"{f['low']:.5g} to {f['high']:.5g}",
            "nominal": f"{f['nominal']:.5g}",
        }
        for f in board["figures"]
    )
    table(f"The board{of}, as its records tell it", rows)
    advised = (
        {
            "wanted": a["expected"],
            **drive_cells(a, board["advice"]),
            "shows as set": next(iter(a["shown"])),
            "advice": a["words"],
            "then, % of boards": f"{100 * a['share']:.0f}",
        }
        for a in board["advice"]
    )
    table("What to turn", advised)
    if board["doubtful"]:
        say(
            f"The records differ from the board that was found by {board['misfit']:.1f} times what "
            "noise explains: it may not be one of this spread, or the generator was set otherwise."
        )
