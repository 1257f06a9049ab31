"""The picture of a comparison: errors, peak outputs and offsets, design beside design."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator

from designer.base.figure_style import INK, name_rows, new_figure, plain_numbers, say, styled
from designer.circuit.coefficients import EXACT
from designer.report.compare_table import peaks

if TYPE_CHECKING:
    from designer.answers.design_answer import ComparedColumn, LoadRow

MARKS = (
    ("#d55e00", "s"),
    ("#cc79a7", "D"),
    ("#8a8a8a", "^"),
    ("#0072b2", "o"),
)
"""Colour and marker of each design; this tool's own is always the last."""
OFFSETS = {"typical": "typical offsets", "maximum": "largest offsets"}


@styled
def comparison(columns: Sequence[ComparedColumn]) -> Figure:
    """Three panels that share one legend; ``columns`` as ``comparison_json`` has them.

    Left, the size of each coefficient's error in percent on a logarithmic axis; what is exact
    stands at the edge. Right above, each op-amp's peak output against its limit; right below, the
    shift of the operating point by the op-amps' offsets over the clearance.
    """
    names = list(dict.fromkeys(n for c in columns for n in c["errors"] or ()))
    sections = list(dict.fromkeys(n for c in columns for n in peaks(c)))
    rows = max(len(names), len(sections) + 5, 10)
    figure = new_figure(9.6, 0.27 * rows + 1.6)
    grid = figure.add_gridspec(2, 2, height_ratios=(max(len(sections), 4), 3.2))
    marks = [MARKS[len(MARKS) - len(columns) + i] for i in range(len(columns))]
    _errors(figure.add_subplot(grid[:, 0]), names, columns, marks)
    _peaks(figure.add_subplot(grid[0, 1]), sections, columns, marks)
    _offsets(figure.add_subplot(grid[1, 1]), columns, marks)
    handles = [Line2D([], [], ls="", marker=m, ms=5.5, color=c) for c, m in marks]
    figure.legend(
        handles, [c["name"] for c in columns], loc="outside upper center", ncols=len(columns)
    )
    return figure


def _errors(
    axes: Axes,
    names: Sequence[str],
    columns: Sequence[ComparedColumn],
    marks: Sequence[tuple[str, str]],
) -> None:
    axes.set_title("Error of each coefficient: equation, state", loc="left")
    if not names:
        say(axes, "no coefficient could be compared")
        return
    sizes = [[100.0 * abs((c["errors"] or {}).get(n, np.nan)) for n in names] for c in columns]
    real = [v for row in sizes for v in row if np.isfinite(v) and v > 100.0 * EXACT]
    high = 10.0 ** np.ceil(np.log10(max(real)) + 0.05) if real else 1.0
    low = 10.0 ** (np.floor(np.log10(min(real))) - 1.0) if real else 1e-3
    name_rows(axes, names, rules=True)
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    edge = low * 10.0**0.35
    axes.axvspan(low, low * 10.0**0.7, color="#f1f1f1", lw=0, zorder=0)
    axes.set_xlabel("|ln(realised / wanted)| [%]")
    decades = np.arange(np.log10(low) + 1.0, np.log10(high) + 0.5, 2.0 if high / low > 1e6 else 1.0)
    ticks = [edge, *(float(10.0**d) for d in np.round(decades))]
    axes.set_xticks(ticks, ["exact", *(f"{t:.10g}" for t in ticks[1:])])
    axes.xaxis.set_minor_locator(NullLocator())
    for i, (row, mark) in enumerate(zip(sizes, marks, strict=True)):
        dots = [edge if v <= 100.0 * EXACT else v for v in row]
        _dots(axes, dots, i, len(columns), mark)


def _peaks(
    axes: Axes,
    names: Sequence[str],
    columns: Sequence[ComparedColumn],
    marks: Sequence[tuple[str, str]],
) -> None:
    axes.set_title("Peak output of each op-amp, all wanted responses", loc="left")
    if not names:
        say(axes, "no response is wanted")
        return
    name_rows(axes, names, rules=True)
    limits = sorted({float(c["saturation"]) for c in columns})
    for limit in limits:
        axes.axvline(limit, color=INK, lw=0.9, ls=(0, (4, 2)))
    positive: list[float] = []
    for i, (c, mark) in enumerate(zip(columns, marks, strict=True)):
        values = [_peak(peaks(c).get(n)) for n in names]
        positive += [v for v in values if v > 0.0]
        _dots(axes, values, i, len(columns), mark)
    axes.set_xscale("log")
    axes.set_xlim(min([*positive, 0.04]) / 2.0, 1.4 * limits[-1])
    plain_numbers(axes.xaxis)
    words = " and ".join(f"{v:g} V" for v in limits)
    axes.set_xlabel(f"peak output [V]; dashed: the op-amps' limit, {words}")


def _offsets(
    axes: Axes, columns: Sequence[ComparedColumn], marks: Sequence[tuple[str, str]]
) -> None:
    axes.set_title("Shift by the op-amps' offsets over the clearance", loc="left")
    if not any(c["offset"] for c in columns):
        say(axes, "no clearance")
        return
    name_rows(axes, list(OFFSETS.values()), rules=True)
    axes.axvline(1.0, color=INK, lw=0.9, ls=(0, (4, 2)))
    values = []
    for i, (c, mark) in enumerate(zip(columns, marks, strict=True)):
        shifts = c["offset"]
        ends = (None, None) if shifts is None else (shifts["typical"], shifts["maximum"])
        row = [np.nan if end is None else end for end in ends]
        values += [v for v in row if v > 0.0]
        _dots(axes, row, i, len(columns), mark)
    axes.set_xscale("log")
    axes.set_xlim(min([*values, 0.02]) / 2.0, max([*values, 2.0]) * 2.0)
    plain_numbers(axes.xaxis)
    axes.set_xlabel("shift / clearance; past 1 (dashed) the mass rests on a stop")


def _dots(
    axes: Axes, values: Sequence[float], number: int, count: int, mark: tuple[str, str]
) -> None:
    """One design's dots, a little above or below each other so that none hides another."""
    colour, shape = mark
    shift = 0.62 * ((number + 0.5) / count - 0.5)
    axes.plot(
        values,
        [i + shift for i in range(len(values))],
        ls="",
        marker=shape,
        ms=4.2,
        mew=0,
        color=colour,
        clip_on=False,
    )


def _peak(load: LoadRow | None) -> float:
    return float("nan") if load is None else max(abs(load["low"]), abs(load["high"]))
