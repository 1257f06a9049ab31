"""Figures of the attribution: losses avoided by part and response, and the margins' indices."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from designer.base.figure_style import (
    INK,
    MUTED,
    name_rows,
    new_figure,
    number_cells,
    say,
    styled,
)
from designer.yields.loss_attribution import ResponseAttribution
from designer.yields.loss_replay import PartAttribution
from designer.yields.worst_corner import NOISE

PARTS_SHOWN = 16
INDICES_SHOWN = 8
LEAST_HEIGHT = 2.0
"""Inches, so that the label of the colour bar stands beside it."""
COLOURS = "cividis"
"""Even in lightness and told apart with every common form of colour blindness."""
_FIRST, _TOTAL = "#0072b2", "#9fcbe6"


@styled
def avoided_chart(
    labels: Sequence[str], attributions: Sequence[ResponseAttribution | None]
) -> Figure:
    """Share of the losses avoided if one part, or one group, were exact: a row for each, a column
    for each response that lost boards. Groups stand above the line, then the parts that help
    most."""
    attributed = [
        (t, b) for t, b in zip(labels, attributions, strict=True) if b is not None and b.subjects
    ]
    if not attributed:
        figure = new_figure(7.4, 1.2)
        say(figure.subplots(), "no board was lost")
        return figure
    groups, parts = _rows([b for _, b in attributed])
    rows = groups + parts
    if not rows:
        figure = new_figure(7.4, 1.2)
        say(figure.subplots(), "no part that was made exact saved a board")
        return figure
    figure = new_figure(7.4, max(0.2 * len(rows) + 1.3, LEAST_HEIGHT))
    axes = figure.subplots()
    values = np.full((len(rows), len(attributed)), np.nan)
    for j, (_, b) in enumerate(attributed):
        subject_of = {s.name: s for s in b.subjects}
        for i, name in enumerate(rows):
            if name in subject_of:
                values[i, j] = 100.0 * subject_of[name].share
    image = axes.imshow(values, cmap=COLOURS, vmin=0.0, vmax=100.0, aspect="auto")
    axes.set_yticks(range(len(rows)), rows, color=INK)
    ticks = [f"{_short(t)}\n{b.lost} lost" for t, b in attributed]
    axes.set_xticks(range(len(attributed)), ticks, color=INK, size=7)
    axes.tick_params(length=0)
    for spine in axes.spines.values():
        spine.set_visible(False)
    if groups and parts:
        axes.axhline(len(groups) - 0.5, color="white", lw=3.0)
    number_cells(axes, values, least=0.5)
    bar = figure.colorbar(image, ax=axes, pad=0.015, fraction=0.04)
    bar.set_label("losses avoided\nif exact [%]")
    bar.outline.set_visible(False)
    return figure


@styled
def index_chart(
    labels: Sequence[str], attributions: Sequence[ResponseAttribution | None]
) -> Figure:
    """Sobol indices of each response's margin: its largest coordinates, first-order and total, each
    with its 95 % interval."""
    attributed = [
        (t, b) for t, b in zip(labels, attributions, strict=True) if b is not None and b.indices
    ]
    if not attributed:
        figure = new_figure(7.4, 1.2)
        say(figure.subplots(), "no limit of a response was found")
        return figure
    columns = min(3, len(attributed))
    lines = -(-len(attributed) // columns)
    figure = new_figure(7.4, lines * (0.19 * INDICES_SHOWN + 0.75) + 0.5)
    grid = figure.subplots(lines, columns, squeeze=False, sharex=True)
    for axes in grid.flat[len(attributed) :]:
        axes.set_axis_off()
    largest = max(
        100.0 * (x.total + (NOISE * x.total_error if x.total_error > 0.0 else 0.0))
        for _, b in attributed
        for x in b.indices[:1]
    )
    end = next((end for end in (25.0, 50.0) if largest <= end), 100.0)
    for axes, (title, b) in zip(grid.flat, attributed, strict=False):
        _indices(axes, title, b)
        axes.set_xlim(0.0, end)
    figure.supxlabel("share of the margin’s variance [%]", size=8.5)  # wider than one panel
    handles = [
        axes.barh([0], [0], color=_TOTAL, label="total index"),
        axes.barh([0], [0], color=_FIRST, label="first-order index"),
    ]
    figure.legend(handles=handles, loc="outside upper right", ncols=2)
    return figure


def _indices(axes: Axes, title: str, b: ResponseAttribution) -> None:
    top = b.indices[:INDICES_SHOWN]
    place = range(len(top))
    axes.barh(place, [100.0 * max(x.total, 0.0) for x in top], color=_TOTAL, height=0.75)
    axes.barh(place, [100.0 * max(x.first, 0.0) for x in top], color=_FIRST, height=0.36)
    # Each above or below the middle, so that both are seen where they overlap.
    _noise(axes, [k - 0.28 for k in place], [(x.total, x.total_error) for x in top])
    _noise(axes, [k + 0.09 for k in place], [(x.first, x.first_error) for x in top])
    name_rows(axes, [x.coordinate for x in top])
    axes.set_ylim(INDICES_SHOWN - 0.4, -0.6)
    axes.set_title(title, size=8, color=INK, loc="left")
    axes.tick_params(axis="y", labelsize=7)
    axes.tick_params(axis="x", labelbottom=True)
    decided = b.prediction.ok + b.prediction.lost
    if decided:
        text = f"sign foretells {b.prediction.right} of {decided}"
        axes.text(
            0.98, 0.04, text, ha="right", va="bottom", size=6.5, color=MUTED,
            transform=axes.transAxes,
        )  # fmt: skip


def _noise(axes: Axes, rows: Sequence[float], values: Sequence[tuple[float, float]]) -> None:
    """The 95 % interval of each index, where its noise is known."""
    known = [(row, v, NOISE * e) for row, (v, e) in zip(rows, values, strict=True) if e > 0.0]
    if known:
        places, middles, halves = zip(*known, strict=True)
        low, high = (
            [100.0 * max(v + sign * h, 0.0) for v, h in zip(middles, halves, strict=True)]
            for sign in (-1.0, 1.0)
        )
        axes.hlines(places, low, high, color=INK, lw=0.9, zorder=3)


def _rows(attributions: Sequence[ResponseAttribution]) -> tuple[list[str], list[str]]:
    """Names of the groups, and of the parts that avoid most losses over all responses."""

    def worth(subjects: Sequence[PartAttribution], group: bool) -> list[str]:
        best: dict[str, float] = {}
        for s in subjects:
            if (s.kind == "group") == group and np.isfinite(s.share):
                best[s.name] = max(best.get(s.name, 0.0), s.share)
        return sorted(best, key=lambda name: (-best[name], name))

    every = [s for b in attributions for s in b.subjects]
    return worth(every, True), worth(every, False)[:PARTS_SHOWN]


def _short(label: str) -> str:
    """ "ω = 0.54   1-3-3" on two lines."""
    return "\n".join(label.split("   ", 1))
