"""Pictures of sweeps, of maps of n-p-q and of basins of attraction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from designer.base.arrays import Array
from designer.base.figure_style import GRID, INK, MUTED, new_figure, style
from designer.bifurcations.basins import SAME, Basins
from designer.bifurcations.parameter_map import MapCell, ParameterMap
from designer.bifurcations.points import Bifurcation
from designer.bifurcations.subject import Subject
from designer.bifurcations.sweep import DOWN, UP, Sweep, SweepPlan, Window
from designer.bifurcations.titles import NAMES, title
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.steady_state import Steady
from designer.report.si_axes import si_x, si_y

BLACK, RED = "#000000", "#d40000"
OTHERS = (
    "#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#8c564b", "#f0e442", "#7f3fbf",
    "#17becf", "#b3de69", "#1f3a5f", "#ff9896", "#8a8d0f", "#c5b0d5",
)  # fmt: skip
DOTS = tuple(c for c in OTHERS if c not in ("#f0e442", "#b3de69", "#c5b0d5", "#ff9896"))
"""Those that are dark enough for small dots."""
CHAOS, REST, OPEN = "#3a3a3a", "#c9c9c9", "#ffffff"
"""Of aperiodic motions, of responses too rare for a colour, and of what is not settled."""
NAMED = 12
"""Responses that get a colour of their own in a map."""
WIDE = 0.012
"""Of the sweep: narrower windows get no label."""
SECOND_AXIS = 0.42
"""How far below a diagram its axis in SI units stands, in heights of the lowest panel."""
MARKS = {
    "pitchfork": ("o", "#0072b2"),
    "period-doubling": ("s", "#e69f00"),
    "fold": ("^", "#009e73"),
    "grazing": ("x", "#cc79a7"),
    "torus": ("D", "#7f3fbf"),
}


@dataclass(frozen=True)
class Mark:
    """A bifurcation point to be marked."""

    kind: str
    """"pitchfork", "period-doubling", "fold" or "grazing"."""
    value: float
    """Value of the parameter."""


def marks(points: Sequence[Bifurcation], low: float, high: float) -> list[Mark]:
    """Those of stable orbits, from low to high."""
    return [
        Mark(str(p.kind), p.value)
        for p in points
        if (p.stable[0] or p.stable[1]) and low <= p.value <= high
    ]


def diagram(sweep: Sweep, points: Sequence[Mark] = (), name: str = "") -> Figure:
    """The paper's Fig. 2: least displacement of each period, impact velocity on the upper stop,
    largest Lyapunov exponent, over the swept parameter; windows named above. name : the model's
    title."""
    plan, units = sweep.plan, sweep.plan.subject.units
    strips = list(plan.tracks) if plan.followed else ["starts"]
    with style():
        figure = new_figure(9.6, 7.6 + 0.24 * len(strips))
        heights = [0.24] * len(strips) + [2.4, 2.4, 1.6]
        _head(figure, title(name, plan, 120))
        rows = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
        for axes, track in zip(rows, strips, strict=False):
            shown = [w for w in sweep.windows if w.track == track or not plan.followed]
            _strip(axes, shown, plan.values, track if len(strips) > 1 else "")
        least, speed, growth = rows[len(strips) :]
        symbol = plan.subject.states[0][0]
        size = min(3.2, max(1.5, 1000.0 / len(plan.values)))
        coloured = _coloured(sweep)
        for colour, values, steps in coloured:
            ink: dict[str, Any] = {"color": colour, "ls": "", "rasterized": True, "ms": size}
            _cloud(least, values, [s.minima for s in steps], ink)
            _cloud(speed, values, [s.velocities for s in steps], ink)
            growth.plot(values, [s.lyapunov for s in steps], marker=".", mew=0, **ink)
        growth.axhline(0.0, color=MUTED, lw=0.8, zorder=1)
        least.set_ylabel(_label(f"least {symbol}₁ in each period", units.get("x", "")))
        rate = f"{symbol}₁′" if symbol == "x" else f"{symbol}₂"
        said = f"impact velocity {rate}\non the upper stop (A1)"
        speed.set_ylabel(_label(said, units.get("v", "")))
        growth.set_ylabel(_label("largest Lyapunov\nexponent λ", units.get("λ", "")))
        finite = np.array([s.lyapunov for steps in sweep.steps.values() for s in steps])
        finite = finite[np.isfinite(finite)]
        if len(finite):
            low, high = float(np.quantile(finite, 0.05)), float(finite.max())
            margin = 0.08 * max(high - low, 1e-12)
            growth.set_ylim(min(low, 0.0) - margin, max(high, 0.0) + margin)
        for axes in (least, speed, growth):
            axes.grid(True, color=GRID, lw=0.5)
        span = float(plan.values[-1] - plan.values[0])
        growth.set_xlim(plan.values[0] - 0.004 * span, plan.values[-1] + 0.004 * span)
        growth.set_xlabel(_axis(plan.subject, plan.parameter))
        si = plan.subject.si
        si_x(growth, si.get(plan.parameter), below=SECOND_AXIS)
        si_y(least, si.get("x1"))
        si_y(speed, si.get("x1'"))
        handles = _key(sweep, coloured)
        for kind in dict.fromkeys(p.kind for p in points):
            marker, colour = MARKS.get(kind, ("|", INK))
            at = [p.value for p in points if p.kind == kind]
            for axes in (least, speed, growth):
                for value in at:
                    axes.axvline(value, color=colour, lw=0.7, ls=(0, (4, 3)), zorder=0.5)
            look: dict[str, Any] = {"ls": "", "marker": marker, "color": colour, "ms": 5}
            top = growth.get_xaxis_transform()
            growth.plot(at, [1.0] * len(at), transform=top, clip_on=False, zorder=6, **look)
            handles.append(Line2D([], [], label=kind, **look))
        if handles:
            figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 6))
    return figure


def parameter_map(made: ParameterMap, name: str = "") -> Figure:
    """Colours name the response at every point. name : the model's title."""
    plan = made.plan
    with style():
        figure = new_figure(7.6, 5.4)
        axes = figure.subplots()
        _head(figure, title(name, plan, 92))
        looks = _palette(made.cells, made.counts)
        _grid(axes, made.cells, plan.xs, plan.ys, looks)
        axes.set_xlabel(_axis(plan.subject, plan.x))
        axes.set_ylabel(_axis(plan.subject, plan.y))
        si_x(axes, plan.subject.si.get(plan.x))
        si_y(axes, plan.subject.si.get(plan.y))
        _legend(axes, looks, made.counts, len(made.cells))
    return figure


def basins(made: Basins, name: str = "") -> Figure:
    """Colours name the attractor that each start goes to; dots are the attractors' strobes.
    name : the model's title."""
    plan = made.plan
    with style():
        figure = new_figure(7.2, 5.2)
        axes = figure.subplots()
        _head(figure, title(name, plan, 86))
        colours = _attractor_colours(made)
        grid = np.array([c.attractor for c in made.cells]).reshape(len(plan.ys), len(plan.xs))
        _cells(axes, plan.xs, plan.ys, grid, colours)
        handles: list[Any] = []
        column = (plan.subject.states.index(plan.x), plan.subject.states.index(plan.y))
        flow = plan.subject.settings([plan.changes])[0].flow()
        for a, colour in zip(made.attractors, colours, strict=True):
            said = a.response + {True: " symmetric", False: "", None: ""}[a.symmetric]
            if a.twin is not None and a.twin < a.number:
                said += f", twin of {made.attractors[a.twin].response}"
            handles.append(Patch(fc=colour, ec=MUTED, lw=0.4, label=f"{said}: {a.share:.1%}"))
            if a.response.count("-") != 2:
                continue
            laps = int(a.response.split("-")[0])
            strobes = flow.run(np.array(a.strobe), laps).strobes[:-1]
            axes.plot(
                *strobes[:, column].T, ls="", marker="o", ms=6, mfc=colour, mec="white", mew=1.2
            )
        axes.set_xlim(plan.xs[0], plan.xs[-1])
        axes.set_ylim(plan.ys[0], plan.ys[-1])
        axes.set_xlabel(_axis(plan.subject, plan.x) + " at the start")
        axes.set_ylabel(_axis(plan.subject, plan.y) + " at the start")
        si_x(axes, plan.subject.si.get(plan.x))
        si_y(axes, plan.subject.si.get(plan.y))
        handles.append(
            Line2D([], [], ls="", marker="o", ms=6, mfc=MUTED, mec="white", label="its strobes")
        )
        _legend_beside(axes, handles)
    return figure


# ---------------------------------------------------------------------------------------------


def _head(figure: Figure, text: str) -> None:
    figure.suptitle(text, x=0.012, ha="left", fontsize=8.5, color=INK)


def _legend_beside(axes: Axes, handles: Sequence[Any]) -> None:
    """A legend at the right of the axes, below the heading, which takes the whole width."""
    axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)


Coloured = tuple[str, Array, list[Steady]]


def _coloured(sweep: Sweep) -> list[Coloured]:
    """(colour, values, steps): followed tracks one each; of fixed starts the attractor from the
    first start black, its mirror twin red, the others by response."""
    plan = sweep.plan
    if plan.followed:
        colours = dict(zip(plan.tracks, (BLACK, OTHERS[0]), strict=False))
        return [(colours[t], plan.values, list(sweep.steps[t])) for t in plan.tracks]
    names: dict[str, str] = {}
    out: dict[str, tuple[list[float], list[Steady]]] = {}
    for i, value in enumerate(plan.values):
        met: list[Steady] = []
        for track in plan.tracks:
            step = sweep.steps[track][i]
            if any(_same(step, other) for other in met):
                continue
            met.append(step)
            if len(met) == 1:
                colour = BLACK
            elif _twins(plan, float(value), met[0], step):
                colour = RED
            else:
                colour = names.setdefault(_family(step), DOTS[len(names) % len(DOTS)])
            values, steps = out.setdefault(colour, ([], []))
            values.append(float(value))
            steps.append(step)
    return [(c, np.array(v), s) for c, (v, s) in out.items()]


def _family(step: Steady) -> str:
    """The response up to its mirror image."""
    p, q = sorted((step.p, step.q))
    return f"{step.n}-{p}-{q}" if step.status is OrbitStatus.PERIODIC else step.response


def _twins(plan: SweepPlan, value: float, a: Steady, b: Steady) -> bool:
    """Whether b is the mirror image of a: one of a's strobes half a period on, reflected."""
    alike = a.status is OrbitStatus.PERIODIC and (a.n, a.p, a.q) == (b.n, b.q, b.p)
    if not alike or a.symmetric or b.symmetric:
        return False
    flow = plan.subject.settings([{plan.parameter: value}])[0].flow()
    if flow.system.mirror is None:
        return False
    trace = flow.run(a.start, a.n, points=2).strobes
    image = trace[1:-1:2] @ flow.system.mirror.T
    return bool((np.abs(image - b.start).max(axis=1) <= SAME * np.abs(image).max()).any())


def _same(a: Steady, b: Steady) -> bool:
    if a.response != b.response or a.symmetric is not b.symmetric:
        return False
    if a.status is not OrbitStatus.PERIODIC:
        return True
    size = max(float(np.abs(a.minima).max()), 1e-300)
    return bool(abs(a.minima.min() - b.minima.min()) < 1e-4 * size)


def _cloud(axes: Axes, values: Array, clouds: Sequence[Array], ink: Mapping[str, Any]) -> None:
    """One dot for each place at a value: many periods that show the same are one dot."""
    every = np.concatenate(clouds) if clouds else np.zeros(0)
    if not len(every):
        return
    fine = max(float(np.ptp(every)), 1e-12) * 2e-4
    x, y = [], []
    for value, cloud in zip(values, clouds, strict=True):
        places = np.unique(np.round(cloud / fine)) * fine
        x.append(np.full(len(places), value))
        y.append(places)
    axes.plot(np.concatenate(x), np.concatenate(y), marker=".", mew=0, **ink)


def _strip(axes: Axes, windows: Sequence[Window], values: Array, name: str) -> None:
    """Windows as bars with their names: symmetric or not by colour, aperiodic stretches dark."""
    span = float(values[-1] - values[0])
    half = 0.5 * span / (len(values) - 1)
    axes.set_ylim(0.0, 1.0)
    axes.set_yticks([])
    axes.tick_params(bottom=False)
    for side in axes.spines.values():
        side.set_visible(False)
    if name:
        axes.set_ylabel({DOWN: "↓", UP: "↑"}.get(name, name), rotation=0, ha="right", va="center")
    for window in windows:
        if window.response == OrbitStatus.APERIODIC:
            # Beside what coexists with it, where several starts share the strip.
            top = 1.0 if window.track in (DOWN, UP) else 0.3
            ends = (window.low - half, window.high + half)
            axes.axvspan(*ends, ymax=top, color=CHAOS, lw=0, zorder=1.5)
    named = [w for w in windows if w.response.count("-") == 2]
    last = -np.inf
    for window in sorted(named, key=lambda w: w.low):
        low, high = window.low - half, window.high + half
        shade = "#b9cfe4" if window.symmetric else "#ecd9b4"
        axes.axvspan(low, high, color=shade, lw=0)
        centre = 0.5 * (low + high)
        text = window.response
        wide = len(text) * 0.0068 * span
        if high - low >= wide and centre - 0.5 * wide > last:
            axes.text(centre, 0.5, text, ha="center", va="center", fontsize=7, color=INK)
            last = centre + 0.5 * wide
        elif high - low >= WIDE * span / 2 and centre - 0.004 * span > last:
            tilt: dict[str, Any] = {"rotation": 60, "ha": "left", "va": "bottom"}
            axes.text(centre - 0.004 * span, 1.1, text, fontsize=6.5, color=INK, **tilt)
            last = centre + 0.008 * span


def _key(sweep: Sweep, coloured: Sequence[Coloured]) -> list[Any]:
    plan = sweep.plan
    dot: dict[str, Any] = {"ls": "", "marker": ".", "ms": 7}
    handles: list[Any] = []
    if plan.followed:
        for track, colour in zip(plan.tracks, (BLACK, OTHERS[0]), strict=False):
            handles.append(Line2D([], [], color=colour, label=f"followed {track}", **dot))
    else:
        handles.append(Line2D([], [], color=BLACK, label="from rest", **dot))
        if RED in [c for c, _, _ in coloured]:
            handles.append(Line2D([], [], color=RED, label="its mirror twin", **dot))
        for colour, _, steps in coloured:
            if colour not in (BLACK, RED):
                families = list(dict.fromkeys(_family(s) for s in steps))
                some = ", ".join(families[:3]) + (" …" if len(families) > 3 else "")
                handles.append(Line2D([], [], color=colour, label=f"also {some}", **dot))
    handles.append(Patch(fc="#b9cfe4", label="symmetric"))
    handles.append(Patch(fc="#ecd9b4", label="not symmetric"))
    if any(w.response == OrbitStatus.APERIODIC for w in sweep.windows):
        handles.append(Patch(fc=CHAOS, label="aperiodic"))
    return handles


def _palette(cells: Sequence[MapCell], counts: Mapping[str, int]) -> dict[str, str]:
    """Colour by response: the most frequent ones, then one for all others."""
    periodic = {c.response for c in cells if c.status is OrbitStatus.PERIODIC}
    named = [r for r in counts if r in periodic][:NAMED]
    named.sort(key=lambda r: [int(k) for k in r.split("-")])
    looks = dict(zip(named, OTHERS, strict=False))
    for response in counts:
        if response in periodic:
            looks.setdefault(response, REST)
        else:
            looks[response] = CHAOS if response == OrbitStatus.APERIODIC else OPEN
    return looks


def _grid(
    axes: Axes, cells: Sequence[MapCell], xs: Array, ys: Array, looks: Mapping[str, str]
) -> None:
    colours = list(dict.fromkeys(looks.values()))
    numbers = np.array([colours.index(looks[c.response]) for c in cells])
    _cells(axes, xs, ys, numbers.reshape(len(ys), len(xs)), colours)


def _cells(axes: Axes, xs: Array, ys: Array, numbers: Array, colours: Sequence[str]) -> None:
    axes.pcolormesh(
        xs,
        ys,
        numbers,
        cmap=ListedColormap(list(colours)),
        vmin=-0.5,
        vmax=len(colours) - 0.5,
        shading="nearest",
        rasterized=True,
    )


def _legend(axes: Axes, looks: Mapping[str, str], counts: Mapping[str, int], total: int) -> None:
    handles = []
    for response, colour in looks.items():
        if colour not in (REST, OPEN):
            share = counts[response] / total
            handles.append(Patch(fc=colour, ec=MUTED, lw=0.4, label=f"{response}: {share:.1%}"))
    for colour, said in ((REST, "other periodic"), (OPEN, "not settled")):
        share = sum(counts[r] for r, c in looks.items() if c == colour) / total
        if share:
            handles.append(Patch(fc=colour, ec=MUTED, lw=0.4, label=f"{said}: {share:.1%}"))
    _legend_beside(axes, handles)


def _attractor_colours(made: Basins) -> list[str]:
    """The most frequent one black, its twin red; twins of others in the next colour."""
    out: list[str] = []
    free = iter(OTHERS * (1 + len(made.attractors) // len(OTHERS)))
    for a in made.attractors:
        if a.number == 0:
            out.append(BLACK)
        elif a.twin == 0:
            out.append(RED)
        elif a.response == OrbitStatus.APERIODIC:
            out.append("#8c8c8c")
        else:
            out.append(OPEN if a.response == OrbitStatus.NOT_SETTLED else next(free))
    return out


def _axis(subject: Subject, name: str) -> str:
    return _label(NAMES.get(name, name), subject.units.get(name, ""))


def _label(text: str, unit: str) -> str:
    return f"{text} [{unit}]" if unit else text
