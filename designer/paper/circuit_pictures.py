"""The paper's Fig. 7 and Fig. 8 drawn again, and what misprints, offsets and methods cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from designer.base.figure_style import (
    CIRCUIT_COLOUR,
    CONTACT,
    GRID,
    INK,
    MODEL_COLOUR,
    NGSPICE_COLOUR,
    new_figure,
    plain_numbers,
    shade_stops,
    styled,
)
from designer.circuit.paper_values import MODEL
from designer.paper.circuit_clock import BASE
from designer.paper.circuits import TITLES

KEPT, LOST, NO_RUN = "#cfe3d6", "#f2c9b4", "#eeeeee"
"""Fills of a table's cells."""
Piece = Mapping[str, Any]


@styled
def dc_curves(circuits: Sequence[Piece]) -> Figure:
    """Fig. 7: output of each nonlinear stage over v1, in thresholds; below, what Eq. (20) leaves.

    Upper row: the exact circuit as a line, ngspice as dots, Eq. (20) dashed. Lower row: the curve
    inside the clearance, much enlarged.
    """
    figure = new_figure(2.5 * len(circuits), 4.6)
    grid = figure.subplots(2, len(circuits), squeeze=False, height_ratios=(2.0, 1.0))
    for column, one in enumerate(circuits):
        dc, threshold = one["dc"], one["threshold"]
        v1 = np.array(dc["v1"]) / threshold
        full = dc["slope_contact"] * threshold
        exact, spice = (np.array(dc[k]) / full for k in ("exact", "ngspice"))
        ideal = v1 - np.clip(v1, -1.0, 1.0)
        above, below = grid[0, column], grid[1, column]
        above.plot(v1, ideal, color=MODEL_COLOUR, lw=4.0)
        above.plot(v1, exact, color=CIRCUIT_COLOUR, lw=1.0)
        above.plot(v1[::8], spice[::8], ls="", marker="o", ms=3.0, color=NGSPICE_COLOUR)
        above.set_title(one["title"], loc="left")
        inside = np.abs(v1) < 1.05
        below.plot(v1[inside], 100.0 * (exact - ideal)[inside], color=CIRCUIT_COLOUR, lw=1.0)
        below.plot(
            v1[inside][::4],
            100.0 * (spice - ideal)[inside][::4],
            ls="",
            marker="o",
            ms=2.5,
            color=NGSPICE_COLOUR,
        )
        below.set_ylim(-1.25, 1.25)
        for axes in (above, below):
            axes.grid(True, color=GRID, lw=0.6)
        below.set_xlabel(f"v₁ / {1e3 * threshold:.4g} mV")
    grid[0, 0].set_ylabel("f / (slope · threshold)")
    grid[1, 0].set_ylabel("less Eq. (20) [%]")
    handles = [
        Line2D([], [], color=MODEL_COLOUR, lw=4.0, label="Eq. (20)"),
        Line2D([], [], color=CIRCUIT_COLOUR, lw=1.0, label="exact circuit"),
        Line2D([], [], ls="", marker="o", ms=3.0, color=NGSPICE_COLOUR, label="ngspice"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


@styled
def portraits(model: Piece, one: Piece) -> Figure:
    """Fig. 8: phase portraits of model, exact circuit and ngspice over each other."""
    pairs = list(zip(model["responses"], one["responses"], strict=True))
    columns = min(4, len(pairs))
    rows = -(-len(pairs) // columns)
    figure = new_figure(2.5 * columns, 2.45 * rows + 0.3)
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in grid[len(pairs) :]:
        axes.set_visible(False)
    for axes, (wanted, shown) in zip(grid, pairs, strict=False):
        _portrait(axes, wanted, shown)
    handles = [
        Line2D([], [], color=MODEL_COLOUR, lw=4.0, label="model"),
        Line2D([], [], color=CIRCUIT_COLOUR, lw=1.0, label="exact circuit"),
        Line2D([], [], color=NGSPICE_COLOUR, lw=1.0, ls=(0, (2, 2)), label="ngspice"),
        Patch(color=CONTACT, label="contact"),
    ]
    figure.suptitle(one["title"], fontsize=10, x=0.01, ha="left")
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure


def _portrait(axes: Axes, wanted: Piece, shown: Piece) -> None:
    x, v = wanted["portrait"]
    reach = 1.15 * max(map(abs, x))
    shade_stops(axes, (-MODEL.b, MODEL.b), (-reach, reach))
    axes.plot(x, v, color=MODEL_COLOUR, lw=4.0, zorder=1)
    axes.plot(*shown["portrait"], color=CIRCUIT_COLOUR, lw=1.0, zorder=2)
    axes.plot(*shown["ngspice_portrait"], color=NGSPICE_COLOUR, lw=1.0, ls=(0, (2, 2)), zorder=3)
    axes.set_xlim(-reach, reach)
    axes.set_title(f"ω = {wanted['omega']:g}: {shown['ngspice'] or shown['circuit']}", loc="left")
    axes.set_xlabel("x₁")
    axes.set_ylabel("x₁′")


@styled
def misprints(rows: Sequence[Piece]) -> Figure:
    """What each misprint alone makes of each response: n-p-q in a grid, waveform error by shade."""
    shown = [r for r in rows if r.get("responses")]
    heads = [f["expected"] for f in shown[0]["responses"]]
    figure = new_figure(1.9 + 0.85 * len(heads), 0.6 + 0.3 * len(shown))
    axes = figure.subplots()
    for i, row in enumerate(shown):
        for j, f in enumerate(row["responses"]):
            text = f["circuit"]
            if f["kept"]:
                text += f"\n{100.0 * f['error']:.2g} %"
            _cell(axes, j, i, text, KEPT if f["kept"] else LOST)
    _table(axes, heads, [r["where"] for r in shown])
    return figure


@styled
def offsets(pieces: Sequence[Piece]) -> Figure:
    """Share of sign patterns on which each response survives, typical and largest offset."""
    kinds = list(pieces[0]["sizes"])
    heads = [r["expected"] for r in pieces[0]["sizes"][kinds[0]]]
    names, rows = [], []
    for one in pieces:
        for kind in kinds:
            size = one["sizes"][kind]
            names.append(f"{TITLES[one['circuit']]}, ± {1e3 * size[0]['size']:g} mV")
            rows.append(size)
    figure = new_figure(2.6 + 0.75 * len(heads), 0.6 + 0.3 * len(rows))
    axes = figure.subplots()
    for i, row in enumerate(rows):
        for j, r in enumerate(row):
            counted = r["counted"]
            decided = sum(counted.values()) - counted["failed"]
            share = counted["ok"] / decided if decided else float("nan")
            fill = NO_RUN if not r["there"] else _between(LOST, KEPT, share)
            _cell(axes, j, i, "not there" if not r["there"] else f"{100.0 * share:.3g} %", fill)
    _table(axes, heads, names)
    return figure


@styled
def times(rows: Sequence[Piece]) -> Figure:
    """Error against CPU time of a drive period, one panel for each response."""
    figure = new_figure(max(3.3 * len(rows), 7.5), 4.2)
    grid = figure.subplots(1, len(rows), sharey=True, squeeze=False)[0]
    floor = 1e-7
    for axes, row in zip(grid, rows, strict=True):
        for number, m in enumerate(row["methods"]):
            error = m["error"]
            y = floor if error is None or error < floor else error
            axes.plot(m["seconds"], y, ls="", marker=_MARKS[number % len(_MARKS)], ms=6,
                      color=_colour(m["name"]), label=m["name"])  # fmt: skip
        base = next(m["seconds"] for m in row["methods"] if m["name"] == BASE)
        axes.axvspan(base / 3.0, base, color=CONTACT, lw=0, zorder=0)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_ylim(0.5 * floor, 1.0)
        plain_numbers(axes.xaxis, axes.yaxis)
        axes.grid(True, color=GRID, lw=0.6)
        axes.set_title(f"ω = {row['omega']:g}, 1-{row['p']}-{row['p']}", loc="left")
        axes.set_xlabel("CPU seconds of a drive period")
    grid[0].set_ylabel("RMS error of x₁ / peak (exact: at the bottom)")
    handles, labels = grid[0].get_legend_handles_labels()
    handles.append(Patch(color=CONTACT))
    labels.append("a third to all of Runge-Kutta in NumPy")
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


_MARKS = "osD^v*PXh<>"


def _colour(name: str) -> str:
    if name.startswith("ngspice"):
        return NGSPICE_COLOUR
    return CIRCUIT_COLOUR if name.startswith("exact") else "#0072b2"


def _cell(axes: Axes, column: int, row: int, text: str, fill: str) -> None:
    axes.fill(
        [column - 0.5, column + 0.5, column + 0.5, column - 0.5],
        [row - 0.5, row - 0.5, row + 0.5, row + 0.5],
        color=fill,
        lw=0,
    )
    axes.text(column, row, text, ha="center", va="center", fontsize=6.5, color=INK)


def _table(axes: Axes, heads: Sequence[str], names: Sequence[str]) -> None:
    axes.set_xlim(-0.5, len(heads) - 0.5)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_xticks(range(len(heads)), list(heads))
    axes.set_yticks(range(len(names)), list(names))
    axes.tick_params(length=0, top=False, labeltop=True, bottom=False, labelbottom=False)
    axes.tick_params(axis="both", colors=INK)
    for i in range(1, len(names)):
        axes.axhline(i - 0.5, color="white", lw=1.5)
    for j in range(1, len(heads)):
        axes.axvline(j - 0.5, color="white", lw=1.5)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _between(low: str, high: str, share: float) -> str:
    if np.isnan(share):
        return NO_RUN
    ends = [np.array(to_rgb(colour)) for colour in (low, high)]
    return to_hex(ends[0] + share * (ends[1] - ends[0]))
