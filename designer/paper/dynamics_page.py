"""The page of the report on the paper's dynamics, and its pictures of branches and of 1-p-p."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from designer.base.arrays import Array
from designer.base.figure_style import GRID, MUTED, new_figure, shade_stops, styled
from designer.base.page import Block, Page, PageSection, Picture, Table, bullets, table
from designer.bifurcations.branch_survey import Survey
from designer.bifurcations.continuation import Branch, End
from designer.bifurcations.doubling_cascade import Cascade
from designer.bifurcations.points import Bifurcation
from designer.bifurcations.windows import NOT_LOCATED, BranchWindow
from designer.dynamics.orbit import Orbit
from designer.paper.statements import Statement, main_windows
from designer.plots.response_colours import BLACK, MARKS, RED
from designer.plots.titles import NAMES

KINDS = ("S", "AS")
COLOURS = ("#000000", "#d55e00", "#0072b2", "#009e73", "#cc79a7", "#7f3fbf")
"""Colours of the branches, by how many times they left another."""
CAPTIONS = {
    "borders-b": "Borders of the symmetric responses 1-1-1 to 1-8-8 over ω and b; a response lives "
    "between its two borders.",
    "borders-k0": "The same over ω and k0.",
    "branches": "Followed branches: least x1 of each orbit over ω; solid where stable.",
    "fig3": "Fig. 3: phase portraits of 1-p-p, symmetric and as twins in black and red; shaded: "
    "contact.",
    "fig2a": "Fig. 2(a): ω from 0.1 to 1.8, attractor followed down and up.",
    "fig2b": "Fig. 2(b): the windows at low ω.",
    "fig2c": "Fig. 2(c): around the pitchfork of 1-1-1.",
}


@dataclass(frozen=True)
class Dynamics:
    """Everything that was measured."""

    survey: Survey
    """The branches, with their bifurcation points."""
    windows: tuple[BranchWindow, ...]
    """The windows in which responses are stable."""
    cascades: Mapping[int, Cascade]
    """Period-doubling cascades by p of the main window."""
    after: Mapping[tuple[int, str], str]
    """Response right beyond an end of a main window, by its p and "S low", "S high", "AS low" or
    "AS high"."""
    shared: Mapping[float, tuple[str, ...]]
    """The coexisting responses, by ω."""
    chatter: tuple[tuple[float, Orbit], ...]
    """(ω, orbit) of the response from rest."""
    statements: tuple[Statement, ...]
    """What the paper says, and what is found here."""


def dynamics_page(
    dynamics: Dynamics, pictures: Iterable[str], command: str, *, first: float, starts: int
) -> Page:
    """The page. pictures : their names without endings. first : ω at which the branch of
    symmetric orbits begins. starts : initial states at each ω of ``shared``."""
    head = [
        Markup(f"Made by `{command}`; the data are in `dynamics.json` and `branches.parquet`."),
        "The model is the corrected Eq. (4) with the paper's parameters; ω falls from right to "
        "left. Points and ends of windows are located on the exact flow, to 1e-8 or better; five "
        "digits are shown. S is symmetric, AS stands for the two asymmetric twins.",
    ]
    statements = table(
        ("paper", "found", "verdict", "shown by"),
        [
            (Markup(s.paper), Markup(s.found), Markup(f"**{s.verdict}**"), Markup(f"`{s.command}`"))
            for s in dynamics.statements
        ],
    )
    coexisting = [(f"{w:g}", ", ".join(names)) for w, names in dynamics.shared.items()]
    sections = [
        PageSection("What the paper says, and what is found", [statements]),
        PageSection(
            "Windows of 1-p-p",
            [
                "The widest window of each kind on the branches followed: the symmetric branch "
                f"through 1-1-1 at ω = {first}, and what leaves it. Responses that these do not "
                "lead to are not looked for here; some stand below, under what coexists. What lies "
                "outside is what the last orbit settles to 5e-4 (relative) past the end.",
                _main_windows(dynamics),
            ],
        ),
        PageSection(
            "Cascades",
            [
                "From the main symmetric window of each p, as ω falls:",
                bullets(c.describe() for c in dynamics.cascades.values()),
            ],
        ),
        PageSection(
            "What coexists",
            [
                f"From {starts} starts at each ω (mirror twins count as one, aperiodic motions are "
                "not told apart):",
                table(("ω", "attractors"), coexisting),
            ],
        ),
        PageSection(
            "Narrower windows of 1-p-p and other responses of period 1", [_narrower(dynamics)]
        ),
        PageSection("Pictures", _pictures(dynamics, pictures)),
    ]
    return Page("The paper's Sections 3 and 4, measured", head, sections)


def _main_windows(dynamics: Dynamics) -> Table | None:
    rows = []
    for p in range(1, 9):
        for one, kind in zip(main_windows(dynamics.windows, p), KINDS, strict=True):
            if one is None:
                rows.append((str(p), kind, "none on the branches followed", *[""] * 5))
                continue
            ends = [
                (f"{end.value:.5f}", end.why, dynamics.after[p, f"{kind} {side}"])
                for side, end in (("low", one.low), ("high", one.high))
            ]
            rows.append((str(p), kind, *ends[0], *ends[1]))
    columns = ("p", "kind", "from ω", "ended by", "outside", "to ω", "ended by", "outside")
    return table(columns, rows)


def _narrower(dynamics: Dynamics) -> Table | None:
    main = [w for p in range(1, 9) for w in main_windows(dynamics.windows, p)]
    rows = [
        (
            f"{w.response} {KINDS[0] if w.symmetric else KINDS[1]}",
            f"{w.low.value:.6f}",
            w.low.why,
            f"{w.high.value:.6f}",
            w.high.why,
        )
        for w in dynamics.windows
        if w not in main and w.response.startswith("1-")
    ]
    return table(("response", "from ω", "ended by", "to ω", "ended by"), rows)


def _pictures(dynamics: Dynamics, names: Iterable[str]) -> list[Block]:
    branches = dynamics.survey.branches
    lost = sum(b.ends.count(End.LOST) for b in branches)
    unseen = [w for w in dynamics.windows if NOT_LOCATED in (w.low.why, w.high.why)]
    text = (
        f"{len(branches)} branches were followed, {sum(len(b.points) for b in branches)} orbits "
        f"in all; {lost} of their ends are for want of convergence. {len(unseen)} of the "
        f"{len(dynamics.windows)} windows, those of longer periods included, end where no "
        f"bifurcation was located{_named(unseen)}."
    )
    return [text, *map(shown, names)]


def shown(name: str) -> Picture:
    """One of the report's pictures on its page."""
    return Picture(CAPTIONS[name], CAPTIONS[name], f"{name}.png")


def _named(windows: Sequence[BranchWindow]) -> str:
    if not windows:
        return ""
    names = [f"{w.response} from ω = {w.low.value:.6f} to {w.high.value:.6f}" for w in windows]
    return f" ({'; '.join(names)})"


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
def branch_chart(survey: Survey, low: float, high: float) -> Figure:
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
def portrait_sheet(panels: Mapping[int, Sequence[Portrait]]) -> Figure:
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
    shade_stops(axes, ((-1, -panel.b), (1, panel.b)), (-reach, reach))
    for curve, colour in zip(panel.curves, (BLACK, RED), strict=False):
        axes.plot(curve[:, 0], curve[:, 1], color=colour, lw=0.9, zorder=3 - (colour == RED))
    axes.set_xlim(-reach, reach)
    axes.set_title(panel.title, loc="left")
    axes.set_xlabel("x₁")
    axes.set_ylabel("x₁′")
