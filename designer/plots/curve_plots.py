"""Pictures of bifurcation curves over two parameters."""

from __future__ import annotations

from collections.abc import Sequence, Set
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FixedLocator, NullLocator

from designer.base.figure_style import GRID, INK, MUTED, new_figure, styled
from designer.bifurcations.border_curve import BorderCurve
from designer.bifurcations.border_curves import CurvePlan
from designer.bifurcations.response_region import EDGE, ResponseRegion
from designer.plots.response_colours import MARKS, OTHERS, SHADES
from designer.plots.si_axes import parameter_x, parameter_y
from designer.plots.titles import curves_title, parameter_name, parameter_text

MEETINGS = ("o", "s", "D", "^", "v", "P", "X", "<", ">", "*", "h", "p")
"""Marks of points of codimension two, by name."""
Label = tuple[str, float, float]
"""A response, and from where to where along the sweep it is seen."""


BESIDE = 3
"""Points of a curve that lie beside one of codimension two."""
WIDE = 5.0
"""A window whose greatest value is this many times its least: windows of responses crowd at its
lower end."""
SWITCHED = (0, (3.5, 1.2))
"""Dashes of a curve that was begun where others meet."""
UPRIGHT = 0.012
"""Width, as a share of the axes, of a name that is written upwards for want of room."""


def _round_values(low: float, high: float) -> list[float]:
    """1, 1.5, 2, 3, 4, 5, 7 in every decade between two values > 0."""
    decades = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    every = [first * 10.0**k for k in decades for first in (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0)]
    return [value for value in every if low <= value <= high]


@styled
def curves(
    lines: Sequence[BorderCurve],
    plan: CurvePlan,
    name: str = "",
    labels: Sequence[Label] = (),
    region: ResponseRegion | None = None,
) -> Figure:
    """Every curve by its kind: thick where it bounds a stable response, thin elsewhere; points of
    codimension two as marks. name : the model's title. labels : responses along the sweep.

    region : of one response, shaded, with the largest box about its nominal point and the largest
    of all. The first parameter has a logarithmic axis where its window is ``WIDE``.
    """
    low, high = plan.window.first
    log = 0.0 < WIDE * low < high
    figure = new_figure(8.6, 5.6)
    axes = figure.subplots()
    figure.suptitle(curves_title(name, plan, 104), x=0.012, ha="left", fontsize=8.5, color=INK)
    for curve in lines:
        _line(axes, curve)
    handles: list[Any] = [
        Line2D([], [], color=MARKS[kind][1], lw=1.6, label=kind)
        for kind in dict.fromkeys(c.kind for c in lines)
    ]
    if not all(all(c.stable) for c in lines):
        handles.append(Line2D([], [], color=MUTED, lw=0.6, label="no stable orbit beside it"))
    if any(c.begun_at is not None for c in lines):
        handles.append(Line2D([], [], color=MUTED, lw=1.6, ls=SWITCHED, label="begun at a meeting"))
    handles += _meetings(axes, lines)
    second = parameter_name(plan.subject, plan.second)
    at = parameter_text(plan.subject, plan.second, plan.at)
    axes.axhline(plan.at, color=MUTED, lw=0.8, ls=(0, (5, 4)), zorder=1)
    handles.append(Line2D([], [], color=MUTED, lw=0.8, ls=(0, (5, 4)), label=f"{second} = {at}"))
    if region is not None:
        handles += _region(axes, region, {curve.kind for curve in lines})
        labels = [label for label in labels if not label[1] <= region.at[0] <= label[2]]
    if log:
        axes.set_xscale("log")
    _axes(axes, plan)
    if log:
        si = plan.subject.si.get(plan.first)
        scale = si.scale if si is not None and si.own_si else 1.0
        ticks = np.array(_round_values(scale * low, scale * high)) / scale
        axes.xaxis.set_major_locator(FixedLocator(ticks.tolist()))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.xaxis.set_major_formatter(lambda value, _: f"{scale * value:g}")
    _named(axes, plan, labels)
    axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
    return figure


def _line(axes: Axes, curve: BorderCurve) -> None:
    """A curve, thin; on top of it thick what bounds a stable response. Dashed where it was begun at
    a point of codimension two."""
    look: dict[str, Any] = {"color": MARKS[curve.kind][1]}
    look |= {} if curve.begun_at is None else {"ls": SWITCHED}
    axes.plot(*curve.points.T, lw=0.6, zorder=2, **look)
    thick = curve.points.copy()
    thick[~np.array(curve.stable)] = np.nan
    axes.plot(*thick.T, lw=1.6, zorder=3, **look)


def _meetings(axes: Axes, lines: Sequence[BorderCurve]) -> list[Line2D]:
    """Points of codimension two beside which a stable orbit lives, a mark for each name; their
    legend. The others stand in the tables."""
    widths = np.ptp(np.concatenate([curve.points for curve in lines]), axis=0) if lines else 1.0
    places: dict[str, list[tuple[float, float]]] = {}
    for curve in lines:
        for met in curve.codimension_two:
            off = (curve.points - met.values) / np.maximum(widths, 1e-300)
            nearest = np.argsort(np.linalg.norm(off, axis=1))[:BESIDE]
            if any(curve.stable[k] for k in nearest):
                places.setdefault(met.name, []).append(met.values)
    handles = []
    for k, (name, at) in enumerate(sorted(places.items())):
        look: dict[str, Any] = {"marker": MEETINGS[k % len(MEETINGS)], "ms": 4, "mew": 0.8}
        look |= {"color": OTHERS[k % len(OTHERS)], "mfc": "white", "ls": ""}
        axes.plot(*np.transpose(at), **look, zorder=4)
        handles.append(Line2D([], [], label=name, **look))
    return handles


def _region(axes: Axes, region: ResponseRegion, named: Set[str]) -> list[Any]:
    """A response's region, a dot at each ray's end for what happens there, and the boxes; their
    legend. named : kinds that are in the legend already."""
    shade: dict[str, Any] = {"color": SHADES[region.symmetric], "lw": 0, "alpha": 0.6}
    axes.fill(*region.border.T, zorder=1, **shade)
    axes.plot(*region.at, marker="+", ms=8, color=INK, ls="", zorder=5)
    handles: list[Any] = [Patch(label=f"{region.response}, seen from +", **shade)]
    kinds = np.array(region.kinds)
    for kind in dict.fromkeys(k for k in region.kinds if k != EDGE):
        dots: dict[str, Any] = {"color": MARKS[kind][1] if kind in MARKS else MUTED}
        dots |= {"ls": "", "marker": "o", "ms": 2.4}
        axes.plot(*region.border[kinds == kind].T, zorder=4, **dots)
        handles += [] if kind in named else [Line2D([], [], label=f"{kind} at a ray's end", **dots)]
    for box, line, text in (
        (region.around, ":", f"± {region.around.share:.1%} about +"),
        (region.best, "-", f"± {region.best.share:.1%}, the most"),
    ):
        (a, b), (wide, tall) = box.centre, box.half_widths
        x, y = [a - wide, a + wide, a + wide, a - wide], [b - tall, b - tall, b + tall, b + tall]
        axes.plot([*x, x[0]], [*y, y[0]], color=INK, lw=1.0, ls=line, zorder=4)
        handles.append(Line2D([], [], color=INK, lw=1.0, ls=line, label=text))
    if region.spread is not None:
        (a, b), (c, d) = region.spread.low, region.spread.high
        look: dict[str, Any] = {"color": INK, "lw": 1.0, "ls": (0, (4, 2, 1, 2))}
        axes.plot([a, c, c, a, a], [b, b, d, d, b], zorder=4, **look)
        text = f"{region.spread.share:.0%} of boards, each way"
        handles.append(Line2D([], [], label=text, **look))
    for ellipse, line in ((region.ellipse_around, ":"), (region.ellipse_best, "-")):
        (wide, tall), turn = ellipse.half_axes, np.linspace(0.0, 2.0 * np.pi, 181)
        curve = ellipse.centre[0] + wide * np.cos(turn), ellipse.centre[1] + tall * np.sin(turn)
        axes.plot(*curve, color=MUTED, lw=0.9, ls=line, zorder=4)
    shares = f"± {region.ellipse_around.share:.1%}, {region.ellipse_best.share:.1%}"
    handles.append(Line2D([], [], color=MUTED, lw=0.9, label=f"ellipses {shares}"))
    return handles


def _axes(axes: Axes, plan: CurvePlan) -> None:
    subject, window = plan.subject, plan.window
    axes.set_xlim(*window.first)
    axes.set_ylim(*window.second)
    axes.grid(True, color=GRID, lw=0.5)
    parameter_x(axes, subject, plan.first)
    parameter_y(axes, subject, plan.second)


def _named(axes: Axes, plan: CurvePlan, labels: Sequence[Label]) -> None:
    """Names of responses on the sweep's line, those for which there is room."""
    to_axes = axes.transAxes.inverted().transform
    last = -np.inf
    for text, low, high in sorted(labels, key=lambda label: label[1]):
        ends = to_axes(axes.transData.transform([(low, plan.at), (high, plan.at)]))[:, 0]
        wide, middle = 0.011 * len(text), float(ends.mean())
        upright = ends[1] - ends[0] < wide
        wide = UPRIGHT if upright else wide
        if ends[1] - ends[0] < wide or middle - 0.5 * wide < last:
            continue
        centre = float(np.sqrt(low * high)) if axes.get_xscale() == "log" else 0.5 * (low + high)
        # Across the line where there is little room: so it stands between slanting borders.
        off: dict[str, Any] = {"textcoords": "offset points", "ha": "center"}
        off["xytext"] = (0, 0 if upright else 6)
        off |= {"path_effects": [withStroke(linewidth=2.5, foreground="white")], "zorder": 6}
        off |= {"rotation": 90, "va": "center"} if upright else {}
        axes.annotate(text, (centre, plan.at), fontsize=7, color=INK, **off)
        last = middle + 0.5 * wide
