"""Figures of a design and its tolerance study: yields, margins, coefficient errors."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator

from designer.base.arrays import Array
from designer.base.figure_style import (
    GRID,
    MODEL_COLOUR,
    MUTED,
    ON_DARK,
    ON_LIGHT,
    name_rows,
    new_figure,
    plain_numbers,
    shade_stops,
    styled,
)
from designer.circuit.coefficients import EXACT
from designer.circuit.law_curves import LawCurve
from designer.verdicts.verdict import Answer, Verdict
from designer.workbench.prediction import PredictedStop
from designer.yields.rare_losses import RareLosses
from designer.yields.yield_count import Yield

VERDICTS = {
    Verdict.OK: "#0072b2",
    Verdict.LOST: "#e69f00",
    Verdict.GRAZING: "#cc79a7",
    Verdict.FAILED: "#9a9a9a",
}
MARKERS = {v: "o" if v is Verdict.OK else "D" for v in Verdict}

MOST_DOTS = 500
"""The most dots of a picture as lines and dots; more stand in it as an image, which does not grow
with them."""


@styled
def stop_chart(name: str, stop: PredictedStop) -> Figure:
    """Output of a dead zone over the displacement, with the stops shaded. name : of the latter."""
    displacement, output = stop_curve(stop)
    figure = new_figure(5.2, 2.6)
    axes = figure.subplots()
    limits = (float(displacement[0]), float(displacement[-1]))
    shade_stops(axes, tuple(stop.ends.items()), limits)
    axes.plot(displacement, output, color=VERDICTS[Verdict.OK], lw=1.6)
    axes.set_xlim(*limits)
    axes.set_xlabel(f"{name} [V]")
    axes.set_ylabel(f"{stop.output} [V]")
    return figure


@styled
def law_chart(curve: LawCurve) -> Figure:
    """A force law: by the model a broad light line, by the nominal board a dashed one; its corners
    as dots, what the responses reach shaded."""
    figure = new_figure(5.2, 2.8)
    axes = figure.subplots()
    if curve.reached is not None:
        axes.axvspan(*curve.reached, color=GRID, lw=0, zorder=0, label="reached by the responses")
    axes.plot(curve.x, curve.wanted, color=MODEL_COLOUR, lw=4.0, label="model")
    axes.plot(curve.x, curve.made, color=ON_LIGHT, lw=1.1, ls="--", label="nominal board")
    corners = np.array(curve.corners)
    axes.plot(corners, np.interp(corners, curve.x, curve.wanted), "o", color=ON_LIGHT, ms=3.0)
    axes.set_xlim(float(curve.x[0]), float(curve.x[-1]))
    axes.set_xlabel(curve.symbol)
    axes.set_ylabel(f"force [{curve.unit}]" if curve.unit else "force")
    axes.set_title(curve.name)
    figure.legend(loc="outside upper center", ncols=3, frameon=False)
    return figure


def stop_curve(stop: PredictedStop) -> tuple[Array, Array]:
    """(k,) displacement and output [V] of a dead zone, from beyond one stop to beyond the other."""
    far = 1.6 * max(map(abs, stop.ends.values()))
    displacement = np.unique([*np.linspace(-far, far, 65), *stop.ends.values()])
    return displacement, stop.output_of(displacement)


@styled
def yield_chart(labels: Sequence[str], yields: Sequence[Yield | None]) -> Figure:
    """Left the yield with its 95 % interval, right what became of all samples; a row each.

    None : the response was left out of the study.
    """
    rows = max(len(labels), 1)
    figure = new_figure(7.4, 0.31 * rows + 1.15)
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(1.0, 1.0))
    for i, counted in enumerate(yields):
        if counted is None or not counted.samples:
            for axes in (left, right):
                axes.text(2.0, i, "left out of the study", va="center", color=MUTED, size=8)
            continue
        _interval(left, i, counted)
        _shares(right, i, counted)
    for axes in (left, right):
        name_rows(axes, labels)
        axes.set_xlim(0.0, 100.0)
        axes.set_xticks([0, 25, 50, 75, 100])
    left.set_xlim(-2.0, 118.0)
    left.spines["bottom"].set_bounds(0.0, 100.0)
    every = any(y is not None and y.census for y in yields)
    left.set_xlabel("yield, of all boards [%]" if every else "yield with its 95 % interval [%]")
    right.set_xlabel("share of the samples [%]; counts inside")
    verdicts = {v for v in Verdict if any(y is not None and getattr(y, str(v)) for y in yields)}
    _verdict_key(figure, verdicts, dict.fromkeys(Verdict, "s"), 7)
    return figure


FEWEST_SHOWN = 1e-4
"""Boards of a million: fewer stand at the axis's end."""


@styled
def rare_chart(rows: Sequence[tuple[str, RareLosses]]) -> Figure:
    """Boards of a million that lose each response, with the 95 % interval, on a logarithmic axis; a
    tick where a region that no search met would end."""
    figure = new_figure(7.4, 0.31 * max(len(rows), 1) + 1.15)
    axes = figure.subplots()
    every = [v for _, r in rows for v in (*r.per_million, 1e6 * r.unseen)]
    shown = [max(v, FEWEST_SHOWN) for v in every if v > 0.0]
    low = 10.0 ** np.floor(np.log10(min(shown, default=1.0)))
    high = 10.0 ** np.ceil(np.log10(max(shown, default=1.0)) + 0.05)
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    name_rows(axes, [label for label, _ in rows])
    for i, (_, found) in enumerate(rows):
        estimate, first, last = (max(v, low) for v in found.per_million)
        axes.plot([1e6 * found.unseen], [i], "|", color=MUTED, ms=11, mew=1.2)
        if not found.drawn_lost or found.per_million[0] < low:
            few = "none was lost" if not found.drawn_lost else f"{found.per_million[0]:.1g}"
            axes.text(low * 1.15, i, few, va="center", color=MUTED, size=8)
            continue
        axes.plot([first, last], [i, i], color=VERDICTS[Verdict.LOST], lw=2.0)
        axes.plot([estimate], [i], MARKERS[Verdict.LOST], color=VERDICTS[Verdict.LOST], ms=6)
    axes.set_xlabel("boards of a million that lose it, with the 95 % interval")
    handles = [
        Line2D([], [], color=VERDICTS[Verdict.LOST], marker=MARKERS[Verdict.LOST], lw=2.0,
               label="lost"),
        Line2D([], [], color=MUTED, marker="|", ms=11, mew=1.2, lw=0.0,
               label="what an unseen region may hold"),
    ]  # fmt: skip
    figure.legend(handles=handles, loc="outside upper right", ncols=2)
    return figure


@styled
def coefficient_chart(errors: Mapping[str, float]) -> Figure:
    """|error| of each coefficient on a logarithmic axis; up to ``EXACT`` it stands as "exact"."""
    figure = new_figure(7.4, 0.24 * max(len(errors), 1) + 0.8)
    axes = figure.subplots()
    percent = {k: 100.0 * abs(v) for k, v in errors.items()}
    real = [v for v in percent.values() if v > 100.0 * EXACT and np.isfinite(v)]
    high = 10.0 ** np.ceil(np.log10(max(real)) + 0.05) if real else 1.0
    low = 10.0 ** (np.floor(np.log10(min(real))) - 1.0) if real else 1e-2
    edge = low * (high / low) ** 0.05
    axes.set_xscale("log")
    axes.set_xlim(low, high * (high / low) ** 0.12)
    name_rows(axes, list(errors))
    for i, (name, value) in enumerate(percent.items()):
        if not np.isfinite(value):
            axes.text(edge, i, "not known", va="center", color=MUTED, size=8)
        elif value <= 100.0 * EXACT:
            axes.plot([edge], [i], "o", mfc="white", mec=VERDICTS[Verdict.OK], ms=5.5)
            _write_beside(axes, edge, i, "exact")
        else:
            axes.plot([low, value], [i, i], color=GRID, lw=2.5, solid_capstyle="butt")
            axes.plot([value], [i], "o", color=VERDICTS[Verdict.OK], ms=5.5)
            sign = "+" if errors[name] > 0 else "−"
            _write_beside(axes, value, i, f"{sign}{value:.2g} %")
    plain_numbers(axes.xaxis)
    if real:
        axes.set_xlabel(f"|ln(realised/wanted)| [%]; exact: up to {100 * EXACT:g} %")
    else:
        axes.set_xticks([])
        axes.set_xticks([], minor=True)
        axes.spines["bottom"].set_visible(False)
        axes.set_xlabel(f"every coefficient exact, up to {100 * EXACT:g} %")
    return figure


@styled
def margin_chart(labels: Sequence[str], answers: Sequence[Sequence[Answer]]) -> Figure:
    """How near each board is to losing its response; a row of dots each, one dot a board.

    Left the largest modulus of the multipliers (1 is the end of stability), right the smaller of
    the shallowest contact and the nearest miss in volts (0 is the end of n-p-q). A lost board
    stands where its new response has these.
    """
    rows = max(len(labels), 1)
    figure = new_figure(7.4, 0.38 * rows + 1.15)
    left, right = figure.subplots(1, 2, sharey=True)
    verdicts: set[Verdict] = set()
    positive: list[float] = []
    for i, row in enumerate(answers):
        for verdict in Verdict:
            boards = [a for a in row if a.verdict is verdict]
            shift = np.array([_jitter(a.sample) for a in boards])
            for axes, values in (
                (left, np.array([a.radius for a in boards])),
                (right, np.array([min(a.penetration, a.miss) for a in boards])),
            ):
                fine = np.isfinite(values) & (values > 0.0)
                if not fine.any():
                    continue
                verdicts.add(verdict)
                positive += list(values[fine]) if axes is right else []
                axes.plot(
                    values[fine],
                    i + shift[fine],
                    ls="",
                    marker=MARKERS[verdict],
                    ms=3.2,
                    mew=0,
                    alpha=0.75,
                    color=VERDICTS[verdict],
                    rasterized=len(answers) * len(row) > MOST_DOTS,
                )
    for axes in (left, right):
        name_rows(axes, labels, rules=True)
    left.set_xlim(0.0, 1.05)
    left.axvline(1.0, color=MUTED, lw=0.9)
    left.set_xlabel("largest multiplier; stable below 1")
    if positive:
        right.set_xscale("log")
        low, high = min(positive) / 2.0, max(positive) * 2.0
        right.set_xlim(low, high)
        subs = (1.0,) if high / low > 300.0 else (1.0, 2.0, 5.0)
        right.xaxis.set_major_locator(LogLocator(subs=subs))
        plain_numbers(right.xaxis)
    right.set_xlabel("shallowest contact or nearest miss [V]")
    _verdict_key(figure, verdicts, MARKERS, 5)
    return figure


def _verdict_key(
    figure: Figure, verdicts: Collection[Verdict], markers: Mapping[Verdict, str], size: float
) -> None:
    look: dict[str, Any] = {"ls": "", "ms": size}
    handles = [
        Line2D([], [], marker=markers[v], color=VERDICTS[v], label=str(v), **look)
        for v in Verdict
        if v in verdicts
    ]
    if handles:
        figure.legend(handles=handles, loc="outside upper right", ncols=len(handles))


def _write_beside(axes: Axes, x: float, row: int, text: str) -> None:
    """A text to the right of a dot."""
    axes.annotate(text, (x, row), (7, 0), textcoords="offset points", va="center", size=8)


def _interval(axes: Axes, row: int, counted: Yield) -> None:
    low, high = (100.0 * v for v in counted.interval)
    axes.plot([low, high], [row, row], color=VERDICTS[Verdict.OK], lw=2.2, solid_capstyle="butt")
    if np.isfinite(counted.rate):
        rate = 100.0 * counted.rate
        axes.plot([rate], [row], "o", color=VERDICTS[Verdict.OK], mec="white", mew=0.7, ms=6)
        axes.text(118.0, row, f"{rate:.3g} %", ha="right", va="center", size=8)
    else:
        axes.text(118.0, row, "open", ha="right", va="center", color=MUTED, size=8)


def _shares(axes: Axes, row: int, counted: Yield) -> None:
    start = 0.0
    for verdict in Verdict:
        number = int(getattr(counted, str(verdict)))
        width = 100.0 * number / counted.samples
        if not number:
            continue
        axes.barh(row, width, left=start, height=0.66, color=VERDICTS[verdict], ec="white", lw=0.8)
        if width >= 4.0:
            ink = ON_DARK if verdict is Verdict.OK else ON_LIGHT
            axes.text(
                start + width / 2.0, row, str(number), ha="center", va="center_baseline",
                color=ink, size=7.5,
            )  # fmt: skip
        start += width


def _jitter(sample: int) -> float:
    """A displacement within ±0.3 that depends on the sample alone."""
    return 0.6 * ((sample * 0.6180339887498949) % 1.0) - 0.3
