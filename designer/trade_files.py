"""What a trade is told in: JSON by the keys of docs/contract.md, a table, and the front."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter

from designer.jsonout import FORMAT, plain
from designer.plots import CIRCUIT, GRID, MUTED, NGSPICE, new_figure, styled
from designer.plots import MODEL as OF_THE_MODEL
from designer.trade import BOARD, EQUATIONS, RESPONSE, WAVEFORM, Cheapest, Compared, Trade, Truth
from designer.trade_rungs import RUNGS
from designer.trade_yield import BoardTrade

TITLES = {
    "rk4": "model, Runge-Kutta",
    "model": "model, exact",
    "circuit": "circuit, exact",
    "ideal": "ngspice, ideal op-amps",
    "dynamic": "ngspice, bandwidth and slew",
    "full": "ngspice, full op-amps",
}
_LOOKS = {
    "rk4": ("#0072b2", "s"),
    "model": (OF_THE_MODEL, "o"),
    "circuit": (CIRCUIT, "o"),
    "ideal": ("#e6a817", "^"),
    "dynamic": (NGSPICE, "D"),
    "full": ("#8c1c13", "v"),
}


def trade_json(
    found: Trade, provenance: Mapping[str, Any], seconds: float, title: str
) -> dict[str, Any]:
    """``rungs``, ``cheapest``, ``truths`` and ``boards``."""
    document = {
        "format": FORMAT,
        "title": title,
        "rungs": [_row(row) for some in found.rows for row in some],
        "truths": [
            _truth(some[0], t) for some, t in zip(found.rows, found.truths, strict=True) if some
        ],
        "boards": [_boards(b) for b in found.boards if b is not None],
        "cheapest": [_cheapest(c) for c in found.cheapest],
        "provenance": dict(provenance),
        "cost": {"seconds": seconds},
    }
    return dict(plain(document))


def _row(row: Compared) -> dict[str, Any]:
    a = row.answer
    return {
        "rung": a.rung,
        "level": a.level,
        "settings": a.settings,
        "omega": row.omega,
        "expected": row.expected,
        "response": a.orbit.response,
        "reason": a.reason,
        "right": dict(row.right),
        "error": row.error[BOARD],
        "error_of_equations": row.error[EQUATIONS],
        "impact_velocity_error": row.velocity[BOARD],
        "impact_velocity_error_of_equations": row.velocity[EQUATIONS],
        "numerical_error": row.numerical,
        "seconds_per_period": a.seconds,
    }


def _truth(row: Compared, truth: Truth) -> dict[str, Any]:
    return {
        "omega": row.omega,
        "response": truth.orbit.response,
        "sure": truth.sure,
        "uncertainty": truth.error,
        "impact_velocity_uncertainty": truth.velocity,
    }


def _boards(b: BoardTrade) -> dict[str, Any]:
    difference, low, high = b.difference
    return {
        **{k: v for k, v in b.__dict__.items() if k != "seconds"},
        "difference": difference,
        "low": low,
        "high": high,
        "seconds_per_board": b.seconds,
    }


def _cheapest(c: Cheapest) -> dict[str, Any]:
    return {
        "question": c.question,
        "of": c.of,
        "omega": c.omega,
        "rung": c.rung,
        "level": c.level,
        "bound": c.bound,
        "measured": c.measured,
        "shown": c.shown,
        "seconds": c.seconds,
    }


def sheet(answer: Mapping[str, Any]) -> str:
    """trade.md: the cheapest rung for each question, then every rung, from the JSON object."""
    lines = [
        f"# Time and error: {answer['title']}",
        "",
        "The cheapest rung and setting that answers each question, for all responses together. "
        "`board` is the nominal circuit with full op-amps in ngspice at the finest step, "
        "`equations` the exact flow of the model. Where the bound is not kept by any rung, the one "
        "that comes nearest is named.",
        "",
        "| question | of | rung | setting | measured | kept | CPU seconds |",
        "|---|---|---|---|---|---|---|",
    ]
    alone = len({row["omega"] for row in answer["rungs"]}) == 1
    lines += [
        f"| {c['question']} | {c['of']} | {TITLES[c['rung']]} | {c['level']} | "
        f"{_measured(c)} | {'yes' if c['shown'] else 'no'} | {_short(c['seconds'])} |"
        for c in answer["cheapest"]
        if c["omega"] is None or alone
    ]
    lines += [
        "",
        "Seconds are of one drive period of each response, for yields of one board of each. "
        "Measured is the largest error with the uncertainty of what it is measured against, or the "
        "number of responses with another n-p-q.",
        "",
        "## By response",
        "",
        "Error of x₁ (RMS over its peak) against the board, and CPU milliseconds of a drive period;"
        " another n-p-q than the board's is named.",
        "",
    ]
    omegas = list(dict.fromkeys(row["omega"] for row in answer["rungs"]))
    kinds = list(dict.fromkeys((row["rung"], row["level"]) for row in answer["rungs"]))
    heads = [f"{t['response']} at {t['omega']:g}" for t in answer["truths"]]
    lines += ["| rung | setting | " + " | ".join(heads) + " |", "|---" * (2 + len(heads)) + "|"]
    by = {(row["rung"], row["level"], row["omega"]): row for row in answer["rungs"]}
    for rung, level in kinds:
        cells = [_cell(by.get((rung, level, omega))) for omega in omegas]
        lines.append(f"| {TITLES[rung]} | {level} | {' | '.join(cells)} |")
    if answer["boards"]:
        lines += [
            "",
            "## Boards",
            "",
            "Yield of the exact circuit less ngspice's on the same boards, with its 95 % interval.",
            "",
            "| ω | boards | ok | only exact | only ngspice | undecided | difference | interval |",
            "|---|---|---|---|---|---|---|---|",
        ]
        lines += [
            f"| {b['omega']:g} | {b['boards']} | {b['ok']} | {b['lost']} | {b['gained']} | "
            f"{b['undecided']} | {_percent(b['difference'])} | {_percent(b['low'])} to "
            f"{_percent(b['high'])} |"
            for b in answer["boards"]
        ]
    return "\n".join(lines) + "\n"


def _measured(c: Mapping[str, Any]) -> str:
    if c["measured"] is None:
        return "–"
    return f"{c['measured']:.0f} wrong" if c["question"] == RESPONSE else _percent(c["measured"])


def _cell(row: Mapping[str, Any] | None) -> str:
    if row is None:
        return "–"
    error = _percent(row["error"]) if row["right"][BOARD] else row["response"]
    seconds = row["seconds_per_period"]
    return f"{error}, {_short(None if seconds is None else 1e3 * seconds)}"


def _percent(value: float | None) -> str:
    return "–" if value is None else f"{100.0 * value:.2g} %"


def _short(value: float | None) -> str:
    """To two figures, without an exponent where it need not be."""
    if value is None:
        return "–"
    return f"{float(f'{value:.2g}'):.10g}"


KEYS = {"trade": "error", "trade-numerics": "numerical_error"}
"""Pictures, and which error each shows."""
_AXES = {"error": "RMS error of x₁ / peak", "numerical_error": "numerics alone: RMS of x₁ / peak"}


@styled
def front(answer: Mapping[str, Any], key: str = "error") -> Figure:
    """Error over the time of a drive period, a panel for each response; hollow where the n-p-q is
    not the board's. What the error is measured against is not shown.

    key : "error", against the board, where a line joins what no other rung beats in both; or
    "numerical_error", against the rung's own equations, so that rungs do not compete.
    """
    omegas = list(dict.fromkeys(row["omega"] for row in answer["rungs"]))
    columns = min(3, len(omegas))
    rows = -(-len(omegas) // columns)
    figure = new_figure(max(3.3 * columns, 7.2), 2.7 * rows + 0.9)
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).ravel()
    for axes in grid[len(omegas) :]:
        axes.set_visible(False)
    # Neither none nor exactly 0: those are not on the axes.
    shown = [row for row in answer["rungs"] if row[key] and row["seconds_per_period"]]
    for i, (axes, omega) in enumerate(zip(grid, omegas, strict=False)):
        _panel(axes, [row for row in shown if row["omega"] == omega], key)
        said = next(t["response"] for t in answer["truths"] if t["omega"] == omega)
        axes.set_title(f"ω = {omega:g}: {said}", loc="left")
        if i % columns == 0:
            axes.set_ylabel(_AXES[key])
        if i + columns >= len(omegas):
            axes.set_xlabel("CPU seconds of a drive period")
    used = [r for r in RUNGS if any(row["rung"] == r for row in shown)]
    handles = [
        Line2D([], [], ls="", marker=_LOOKS[r][1], color=_LOOKS[r][0], ms=5, label=TITLES[r])
        for r in used
    ]
    if key == "error":
        handles.append(Line2D([], [], color=MUTED, lw=0.9, label="front"))
    handles.append(Line2D([], [], color=MUTED, lw=0.9, ls=(0, (4, 2)), label="0.1 %"))
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure


def _panel(axes: Axes, rows: Sequence[Mapping[str, Any]], key: str) -> None:
    points = []
    for row in rows:
        colour, marker = _LOOKS[row["rung"]]
        right = row["right"][BOARD]
        at = row["seconds_per_period"], row[key]
        face = colour if right else "white"
        axes.plot(*at, ls="", marker=marker, ms=5, color=colour, mfc=face, zorder=3)
        if right:
            points.append(at)
    line: list[tuple[float, float]] = []
    for at in sorted(points):
        if not line or at[1] < line[-1][1]:
            line.append(at)
    if key == "error" and line:
        axes.plot([p[0] for p in line], [p[1] for p in line], color=MUTED, lw=0.9, zorder=2)
    axes.axhline(WAVEFORM, color=MUTED, lw=0.9, ls=(0, (4, 2)), zorder=1)
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
        axis.set_minor_formatter(NullFormatter())
    axes.grid(True, color=GRID, lw=0.6)
