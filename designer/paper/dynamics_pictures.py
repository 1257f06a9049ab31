"""Pictures of the branches of periodic orbits, and of the 1-p-p responses with their twins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from designer.base.arrays import Array
from designer.base.figure_style import GRID, MUTED, new_figure, shade_stops, styled
from designer.bifurcations.branch_survey import Survey
from designer.bifurcations.continuation import Branch
from designer.bifurcations.points import Bifurcation
from designer.bifurcations.titles import NAMES
from designer.report.bifurcation_plots import BLACK, MARKS, RED

COLOURS = ("#000000", "#d55e00", "#0072b2", "#009e73", "#cc79a7", "#7f3fbf")
"""Of the branches, by how many times they left another."""


@dataclass(frozen=True)
class Portrait:
    """An orbit in the plane (x1, x1'), and its mirror twin where it has one of its own."""

    title: str
    """Title above the panel."""
    b: float
    """Dimensionless clearance."""
    curves: tuple[Array, ...]
    """(points, 2) closed curves of the orbit and of its twin."""


@styled
def branches(survey: Survey, low: float, high: float) -> Figure:
    """Least first displacement of each orbit over the parameter: solid where stable."""
    figure = new_figure(9.6, 5.4)
    axes = figure.subplots()
    depths: list[int] = []  # a parent comes before its branches
    for number, branch in enumerate(survey.branches):
        above = survey.parents[number]
        depths.append(0 if above < 0 else depths[above] + 1)
        _line(axes, branch, survey.on(number), _colour(depths[-1]))
    handles = [
        Line2D([], [], color=MUTED, lw=1.6, label="stable"),
        Line2D([], [], color=MUTED, lw=0.6, ls=(0, (3, 2)), label="unstable"),
    ]
    names = ("symmetric", "asymmetric twins", "their doubled orbits")
    for depth in range(max(depths) + 1):
        label = names[depth] if depth < len(names) else f"left another {depth} times"
        handles.append(Line2D([], [], color=_colour(depth), lw=1.6, label=label))
    stable = [p for p in survey.points if p.stable[0] or p.stable[1]]
    for kind in dict.fromkeys(p.kind for p in stable):
        marker, colour = MARKS[str(kind)]
        look: dict[str, Any] = {"marker": marker, "color": colour, "mfc": "white", "ms": 4.5}
        at = [(p.value, p.point.orbit.extremes[0, 0]) for p in stable if p.kind is kind]
        axes.plot(*np.transpose(at), ls="", **look, zorder=4)
        handles.append(Line2D([], [], ls="", **look, label=str(kind)))
    axes.grid(True, color=GRID, lw=0.5)
    axes.set_xlim(low, high)
    axes.set_xlabel(NAMES.get(survey.parameter, survey.parameter))
    axes.set_ylabel("least x₁ of the orbit")
    figure.legend(handles=handles, loc="outside lower center", ncols=5)
    return figure


def _colour(depth: int) -> str:
    return COLOURS[min(depth, len(COLOURS) - 1)]


def _line(axes: Axes, branch: Branch, points: Sequence[Bifurcation], colour: str) -> None:
    """A branch with its bifurcation points as nodes, so that both kinds of line reach to them."""
    nodes = [(float(i), p.value, p.orbit, p.stable) for i, p in enumerate(branch.points)]
    nodes += [(p.position, p.value, p.point.orbit, p.stable[1]) for p in points]
    nodes.sort(key=lambda node: node[0])
    here = np.array([[value, orbit.extremes[0, 0]] for _, value, orbit, _ in nodes])
    axes.plot(here[:, 0], here[:, 1], color=colour, lw=0.6, ls=(0, (3, 2)), zorder=2)
    for a, b, start, end in zip(here, here[1:], nodes, nodes[1:], strict=False):
        at_bifurcation = end[0] != int(end[0])
        if start[3] and (end[3] or at_bifurcation):
            both = np.stack([a, b])
            axes.plot(both[:, 0], both[:, 1], color=colour, lw=1.6, zorder=3)


@styled
def portraits(panels: Mapping[int, Sequence[Portrait]]) -> Figure:
    """The paper's Fig. 3: for each p a row of panels, twins in black and red."""
    columns = max(len(row) for row in panels.values())
    across = 2 if len(panels) > 4 else 1
    rows = -(-len(panels) // across)
    figure = new_figure(2.45 * columns * across, 2.35 * rows)
    grid = figure.subplots(rows, columns * across, squeeze=False)
    for axes in grid.ravel():
        axes.set_visible(False)
    for place, row in enumerate(panels.values()):
        for column, panel in enumerate(row):
            axes = grid[place % rows, columns * (place // rows) + column]
            axes.set_visible(True)
            _panel(axes, panel)
    handles = [
        Line2D([], [], color=BLACK, lw=1.2, label="orbit"),
        Line2D([], [], color=RED, lw=1.2, label="its mirror twin"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def _panel(axes: Axes, panel: Portrait) -> None:
    reach = 1.12 * max(float(np.abs(c[:, 0]).max()) for c in panel.curves)
    shade_stops(axes, (-panel.b, panel.b), (-reach, reach))
    for curve, colour in zip(panel.curves, (BLACK, RED), strict=False):
        axes.plot(curve[:, 0], curve[:, 1], color=colour, lw=0.9, zorder=3 - (colour == RED))
    axes.set_xlim(-reach, reach)
    axes.set_title(panel.title, loc="left")
    axes.set_xlabel("x₁")
    axes.set_ylabel("x₁′")
