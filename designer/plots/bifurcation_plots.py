"""Pictures of sweeps, of maps of n-p-q and of basins of attraction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby, pairwise
from textwrap import wrap
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from designer.base.arrays import Array
from designer.base.figure_style import GRID, INK, MUTED, ON_DARK, ON_LIGHT, new_figure, styled
from designer.base.units import axis_label
from designer.bifurcations.attractor_list import SAME
from designer.bifurcations.basin_shares import AttractorShare, BasinShares
from designer.bifurcations.basins import BasinPlan, Basins
from designer.bifurcations.parameter_map import MapPlan, ParameterMap
from designer.bifurcations.points import Bifurcation
from designer.bifurcations.sweep import DOWN, UP, Sweep, SweepPlan, Window
from designer.dynamics.counts import read_counts
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.steady_state import SteadyMotion
from designer.plots.response_colours import (
    BLACK,
    DOTS,
    MARKS,
    OPEN,
    OTHERS,
    RED,
    REST,
    SHADES,
    TORUS,
    WITHOUT_N,
    palette_legend,
    response_palette,
)
from designer.plots.si_axes import parameter_x, parameter_y, si_y
from designer.plots.titles import title

PALE = 0.45
"""How far the colour of a mirror twin is from that of the other twin towards white."""
DARK = 0.45
"""Luminance below which names are light."""
HIGH, LETTER = 0.11, 0.0068
"""Least height of a stripe that is named, and the width of a letter, in parts of the axes."""


def share_band(axes: Axes, shares: BasinShares) -> None:
    """The stripes, named where there is room; twins lie beside each other, one of them pale."""
    plan, heights = shares.plan, _heights(shares)
    colours = _colours(shares)
    order = _order(shares)
    values = plan.values
    edges = np.concatenate([values[:1], 0.5 * (values[1:] + values[:-1]), values[-1:]])
    bottom = np.zeros(len(values))
    for number in order:
        top = bottom + heights[number]
        axes.stairs(top, edges, baseline=bottom, fill=True, fc=colours[number], ec=MUTED, lw=0.15)
        _names(axes, shares, number, (edges, bottom, top), colours[number])
        bottom = top
    axes.set_ylim(0.0, 1.0)
    axes.set_ylabel(f"share of\n{len(plan.numbers)} starts")


def _heights(shares: BasinShares) -> dict[int, Array]:
    """(N,) share of each attractor at each value; 0 where it was not met."""
    place = {value: k for k, value in enumerate(shares.plan.values.tolist())}
    out: dict[int, Array] = {}
    for number, met in shares.attractors.items():
        out[number] = np.zeros(len(place))
        for value, share in met:
            out[number][place[value]] = share.count / len(shares.plan.numbers)
    return out


def _pairs(shares: BasinShares) -> dict[int, int]:
    """The lower number of an attractor and its twin, by number."""
    out: dict[int, int] = {}
    for number, met in shares.attractors.items():
        twins = [share.twin for _, share in met if share.twin is not None]
        out[number] = min(number, out.get(twins[0], twins[0])) if twins else number
    return out


def _order(shares: BasinShares) -> list[int]:
    """Periodic attractors from below, twins together; what is not periodic on top."""
    pairs, every = _pairs(shares), shares.attractors
    status = {number: met[0][1].status for number, met in every.items()}
    return sorted(
        every, key=lambda k: (status[k] is not OrbitStatus.PERIODIC, status[k], pairs[k], k)
    )


def _colours(shares: BasinShares) -> dict[int, str]:
    """A colour for each pair of twins, those met at the most values first; the rest are grey."""
    pairs, totals = _pairs(shares), dict[int, int]()
    every = shares.attractors
    for number, met in every.items():
        if met[0][1].status is OrbitStatus.PERIODIC:
            count = sum(share.count > 0 for _, share in met)
            totals[pairs[number]] = totals.get(pairs[number], 0) + count
    ranked = sorted(totals, key=lambda k: (-totals[k], k))
    base = dict(zip(ranked, OTHERS, strict=False))
    out = {}
    for number, met in every.items():
        if met[0][1].status is OrbitStatus.PERIODIC:
            colour = base.get(pairs[number], REST)
            out[number] = colour if pairs[number] == number else _pale(colour)
        else:
            out[number] = WITHOUT_N.get(met[0][1].status, OPEN)
    return out


def _pale(colour: str) -> str:
    red, green, blue = (c + PALE * (1.0 - c) for c in to_rgb(colour))
    return to_hex((red, green, blue))


def _names(
    axes: Axes,
    shares: BasinShares,
    number: int,
    stripe: tuple[Array, Array, Array],
    colour: str,
) -> None:
    """The response of an attractor, in each stretch of its stripe that is large enough.

    stripe : (N + 1,) edges of the values, (N,) lower and (N,) upper ends.
    """
    edges, bottom, top = stripe
    met = dict(shares.attractors[number])
    texts = [_text(met.get(value)) for value in shares.plan.values.tolist()]
    k = 0
    for text, steps in groupby(texts):
        first, k = k, k + len(list(steps))
        wide = (edges[k] - edges[first]) / (edges[-1] - edges[0])
        if not text or wide < LETTER * (len(text) + 1):
            continue
        # Judged on the middle half: a stripe that tapers off has room for its name there.
        margin = (k - first) // 4
        inside = slice(first + margin, k - margin)
        low, high = float(bottom[inside].max()), float(top[inside].min())
        if high - low >= HIGH:
            ink: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 7}
            red, green, blue = to_rgb(colour)
            dark = 0.299 * red + 0.587 * green + 0.114 * blue < DARK
            at = 0.5 * (edges[first] + edges[k]), 0.5 * (low + high)
            axes.text(*at, text, color=ON_DARK if dark else ON_LIGHT, **ink)


def _text(share: AttractorShare | None) -> str:
    return "" if share is None or not share.count else share.response


WIDE = 0.012
"""Windows narrower than this share of the sweep get no label."""
NARROW = 0.004
"""Windows narrower than this share of the sweep get no border, which would hide them."""
SECOND_AXIS = 0.42
"""How far below a diagram its axis in SI units stands, in heights of the lowest panel."""
Coloured = tuple[str, Array, list[SteadyMotion]]
"""Colour, values of the parameter, and the motions there."""
SHARE_BAND = 1.6
"""Height of the band of counted basins [inch]."""
STOP_PANEL = 1.8
"""Height of the panel of each stop past the first [inch]."""
PANEL = 30
"""Letters of a line that stands along a panel."""
STRIPS = {DOWN: "↓", UP: "↑"}


def marks(points: Sequence[Bifurcation], low: float, high: float) -> list[Bifurcation]:
    """The marks of stable orbits between two values."""
    return [p for p in points if (p.stable[0] or p.stable[1]) and low <= p.value <= high]


@styled
def diagram(
    sweep: Sweep,
    points: Sequence[Bifurcation] = (),
    name: str = "",
    shares: BasinShares | None = None,
) -> Figure:
    """The paper's Fig. 2: least displacement of each period, impact velocity on each stop that the
    subject shows, where any impact is met, largest Lyapunov exponent, over the swept parameter;
    windows named above.

    points : to be marked. name : the model's title. shares : counted basins, as a band below.
    """
    plan = sweep.plan
    strips = list(plan.tracks) if plan.followed else ["starts"]
    steps = [step for track in sweep.steps.values() for step in track]
    met = any(len(v) for step in steps for v in (step.velocities, *step.further))
    speeds = [2.4, *[STOP_PANEL] * (len(plan.subject.stops) - 1)] if met else []
    band = [] if shares is None else [SHARE_BAND]
    figure = new_figure(9.6, 5.2 + 0.24 * len(strips) + sum(speeds) + sum(band))
    heights = [0.24] * len(strips) + [2.4, *speeds, 1.6, *band]
    _head(figure, title(name, plan, 120))
    rows = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
    for axes, track in zip(rows, strips, strict=False):
        track_windows = [w for w in sweep.windows if w.track == track or not plan.followed]
        _strip(axes, track_windows, plan.values, track if len(strips) > 1 else "")
    coloured = _coloured(sweep)
    panels = rows[len(strips) : len(rows) - len(band)]
    _clouds(panels, sweep, coloured)
    _diagram_axes(panels, plan)
    if shares is not None:
        share_band(rows[-1], shares)
    _swept_axis(rows[-1], plan)
    handles = _key(sweep, coloured) + _marked(panels, points)
    figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 6))
    return figure


def _clouds(panels: Sequence[Axes], sweep: Sweep, coloured: Sequence[Coloured]) -> None:
    """Every step of the sweep in the panels, and limits for the exponent."""
    least, *speeds, growth = panels
    size = min(3.2, max(1.5, 1000.0 / len(sweep.plan.values)))
    for colour, values, steps in coloured:
        ink: dict[str, Any] = {"color": colour, "ls": "", "rasterized": True, "ms": size}
        _cloud(least, values, [s.minima for s in steps], ink)
        for k, speed in enumerate(speeds):
            _cloud(speed, values, [_met(s, k) for s in steps], ink)
        growth.plot(values, [s.lyapunov for s in steps], marker=".", mew=0, **ink)
    growth.axhline(0.0, color=MUTED, lw=0.8, zorder=1)
    finite = np.array([s.lyapunov for steps in sweep.steps.values() for s in steps])
    finite = finite[np.isfinite(finite)]
    if len(finite):
        low, high = float(np.quantile(finite, 0.05)), float(finite.max())
        margin = 0.08 * max(high - low, 1e-12)
        growth.set_ylim(min(low, 0.0) - margin, max(high, 0.0) + margin)


def _diagram_axes(panels: Sequence[Axes], plan: SweepPlan) -> None:
    least, *speeds, growth = panels
    units, si = plan.subject.units, plan.subject.si
    symbol = plan.subject.states[0][0]
    labels = plan.subject.labels
    name = labels.get("displacement", f"{symbol}₁")
    text = f"least {name}\nin each period" if labels else f"least {name} in each period"
    least.set_ylabel(axis_label(_wrapped(text), units.get("x", "")))
    for speed, stop in zip(speeds, plan.subject.stops, strict=False):
        text = f"impact velocity {stop.velocity}\non {stop.name}"
        if len(speeds) > 1:  # their panels are too low for the stop's name beside them
            heading, text = f"on {stop.name}", f"impact velocity\n{stop.velocity}"
            speed.set_title(heading, loc="left", pad=2.0, fontsize=8, color=MUTED, weight="normal")
        speed.set_ylabel(axis_label(_wrapped(text), units.get("v", "")))
        si_y(speed, si.get("x1'"))
    growth.set_ylabel(axis_label("largest Lyapunov\nexponent λ", units.get("λ", "")))
    for axes in panels:
        axes.grid(True, color=GRID, lw=0.5)
    si_y(least, si.get("x1"))


def _swept_axis(lowest: Axes, plan: SweepPlan) -> None:
    """The axis of the swept parameter, below the lowest panel."""
    lowest.set_xlim(*_limits(plan.values))
    parameter_x(lowest, plan.subject, plan.parameter, below=SECOND_AXIS)


def _limits(values: Array) -> tuple[float, float]:
    """The limits of the axis of the swept parameter: its values and a little beside them."""
    aside = 0.004 * float(values[-1] - values[0])
    return float(values[0]) - aside, float(values[-1]) + aside


def _met(step: SteadyMotion, stop: int) -> Array:
    """Impact velocities on one of the shown stops; none of a step that did not come to an end."""
    each = (step.velocities, *step.further)
    return each[stop] if stop < len(each) else np.zeros(0)


def _marked(panels: Sequence[Axes], points: Sequence[Bifurcation]) -> list[Any]:
    """Bifurcation points as lines through the panels; their legend."""
    handles = []
    top = panels[-1].get_xaxis_transform()
    for kind in dict.fromkeys(str(p.kind) for p in points):
        marker, colour = MARKS.get(kind, ("|", INK))
        at = [p.value for p in points if p.kind == kind]
        for axes in panels:
            for value in at:
                axes.axvline(value, color=colour, lw=0.7, ls=(0, (4, 3)), zorder=0.5)
        look: dict[str, Any] = {"ls": "", "marker": marker, "color": colour, "ms": 5}
        panels[-1].plot(at, [1.0] * len(at), transform=top, clip_on=False, zorder=6, **look)
        handles.append(Line2D([], [], label=kind, **look))
    return handles


@styled
def parameter_map(result: ParameterMap, name: str = "") -> Figure:
    """Colours name the response at every point. name : the model's title."""
    plan = result.plan
    figure, axes = _plane(7.6, 5.4, title(name, plan, 92))
    looks = response_palette(result.counts)
    colours = list(dict.fromkeys(looks.values()))
    _cells(axes, plan, [colours.index(looks[c.response]) for c in result.cells], colours)
    _plane_axes(axes, plan)
    legend = palette_legend(result.counts, looks)
    _legend_beside(axes, [_patch(*each) for each in legend])
    return figure


@styled
def basins(result: Basins, name: str = "") -> Figure:
    """Colours name the attractor that each start goes to; dots are the attractors' strobes.
    name : the model's title."""
    plan = result.plan
    figure, axes = _plane(7.2, 5.2, title(name, plan, 86))
    colours = _attractor_colours(result)
    _cells(axes, plan, [c.attractor for c in result.cells], colours)
    handles: list[Any] = []
    column = (plan.subject.states.index(plan.x), plan.subject.states.index(plan.y))
    flow = plan.subject.settings([plan.changes])[0].flow()
    for a, colour in zip(result.attractors, colours, strict=True):
        text = a.response + (" symmetric" if a.symmetric else "")
        if a.twin is not None and a.twin < a.number:
            text += f", twin of {result.attractors[a.twin].response}"
        handles.append(_patch(colour, text, a.share))
        counts = read_counts(a.response)
        if counts is None:
            continue
        strobes = flow.run(np.array(a.strobe), counts.n).strobes[:-1]
        axes.plot(*strobes[:, column].T, ls="", marker="o", ms=6, mfc=colour, mec="white", mew=1.2)
    axes.set_xlim(plan.xs[0], plan.xs[-1])
    axes.set_ylim(plan.ys[0], plan.ys[-1])
    _plane_axes(axes, plan, " at the start")
    dot: dict[str, Any] = {"marker": "o", "ms": 6, "mfc": MUTED, "mec": "white"}
    handles.append(Line2D([], [], ls="", label="its strobes", **dot))
    _legend_beside(axes, handles)
    return figure


def _plane(width: float, height: float, text: str) -> tuple[Figure, Axes]:
    figure = new_figure(width, height)
    axes = figure.subplots()
    _head(figure, text)
    return figure, axes


def _plane_axes(axes: Axes, plan: MapPlan | BasinPlan, ending: str = "") -> None:
    parameter_x(axes, plan.subject, plan.x, ending)
    parameter_y(axes, plan.subject, plan.y, ending)


def _patch(colour: str, text: str, share: float) -> Patch:
    return Patch(fc=colour, ec=MUTED, lw=0.4, label=f"{text}: {share:.1%}")


def _head(figure: Figure, text: str) -> None:
    figure.suptitle(text, x=0.012, ha="left", fontsize=8.5, color=INK)


def _legend_beside(axes: Axes, handles: Sequence[Any]) -> None:
    """A legend at the right of the axes, below the heading, which takes the whole width."""
    axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)


def _coloured(sweep: Sweep) -> list[Coloured]:
    """(colour, values, steps): followed tracks one each; of fixed starts the attractor from the
    first start black, its mirror twin red, the others by response."""
    plan = sweep.plan
    if plan.followed:
        colours = dict(zip(plan.tracks, (BLACK, OTHERS[0]), strict=False))
        return [(colours[t], plan.values, list(sweep.steps[t])) for t in plan.tracks]
    names: dict[str, str] = {}
    out: dict[str, tuple[list[float], list[SteadyMotion]]] = {}
    for i, value in enumerate(plan.values):
        distinct: list[SteadyMotion] = []
        for track in plan.tracks:
            step = sweep.steps[track][i]
            if any(_same(step, other) for other in distinct):
                continue
            distinct.append(step)
            if len(distinct) == 1:
                colour = BLACK
            elif _twins(plan, float(value), distinct[0], step):
                colour = RED
            else:
                colour = names.setdefault(_family(step), DOTS[len(names) % len(DOTS)])
            values, steps = out.setdefault(colour, ([], []))
            values.append(float(value))
            steps.append(step)
    return [(c, np.array(v), s) for c, (v, s) in out.items()]


def _family(step: SteadyMotion) -> str:
    """The response up to its mirror image."""
    return str(step.counts.family) if step.status is OrbitStatus.PERIODIC else step.response


def _twins(plan: SweepPlan, value: float, a: SteadyMotion, b: SteadyMotion) -> bool:
    """Whether b is the mirror image of a: one of a's strobes half a period on, reflected."""
    alike = a.status is OrbitStatus.PERIODIC and a.counts == b.counts.mirrored
    if not alike or a.symmetric or b.symmetric:
        return False
    flow = plan.subject.settings([{plan.parameter: value}])[0].flow()
    if flow.system.mirror is None:
        return False
    trace = flow.run(a.start, a.n, points=2).strobes
    image = trace[1:-1:2] @ flow.system.mirror.T
    return bool((np.abs(image - b.start).max(axis=1) <= SAME * np.abs(image).max()).any())


def _same(a: SteadyMotion, b: SteadyMotion) -> bool:
    if a.response != b.response or a.symmetric is not b.symmetric:
        return False
    if a.status is not OrbitStatus.PERIODIC:
        return True
    size = max(float(np.abs(a.minima).max()), 1e-300)
    return bool(abs(a.minima.min() - b.minima.min()) < 1e-4 * size)


def _cloud(axes: Axes, values: Array, clouds: Sequence[Array], ink: Mapping[str, Any]) -> None:
    """Different dots at each value alone: many periods that show the same are one dot."""
    every = np.concatenate(clouds) if clouds else np.zeros(0)
    if not len(every):
        return
    fine = max(float(np.ptp(every)), 1e-12) * 2e-4
    x, y = [], []
    for value, cloud in zip(values, clouds, strict=True):
        dots = np.unique(np.round(cloud / fine)) * fine
        x.append(np.full(len(dots), value))
        y.append(dots)
    axes.plot(np.concatenate(x), np.concatenate(y), marker=".", mew=0, **ink)


def _strip(axes: Axes, windows: Sequence[Window], values: Array, name: str) -> None:
    """Windows as bars with their names: symmetric or not by colour, aperiodic and quasi-periodic
    stretches dark."""
    span = float(values[-1] - values[0])
    half = 0.5 * span / (len(values) - 1)
    axes.set_ylim(0.0, 1.0)
    axes.set_yticks([])
    axes.tick_params(bottom=False)
    for side in axes.spines.values():
        side.set_visible(False)
    if name:
        axes.set_ylabel(STRIPS.get(name, name), rotation=0, ha="right", va="center")
    for window in windows:
        if window.response in WITHOUT_N:
            # Beside what coexists with it, where several starts share the strip.
            top = 1.0 if window.track in (DOWN, UP) else 0.3
            ends = (window.low - half, window.high + half)
            axes.axvspan(*ends, ymax=top, color=WITHOUT_N[window.response], lw=0, zorder=1.5)
    named = sorted((w for w in windows if read_counts(w.response)), key=lambda w: w.low)
    last = -np.inf
    for window in named:
        axes.axvspan(
            window.low - half, window.high + half, color=SHADES[bool(window.symmetric)], lw=0
        )
    for before, window in pairwise(named):
        narrowest = min(w.high - w.low for w in (before, window)) + 2.0 * half
        borders = abs(window.low - before.high - 2.0 * half) < half
        if (
            narrowest >= NARROW * span
            and borders
            and bool(before.symmetric) is bool(window.symmetric)
        ):
            axes.axvline(window.low - half, color="white", lw=0.8)
    left, right = _limits(values)
    for window in named:
        low, high = max(window.low - half, left), min(window.high + half, right)  # what is seen
        centre = 0.5 * (low + high)
        text = window.response
        wide = len(text) * 0.0068 * span
        if high - low >= wide and centre - 0.5 * wide > last:
            axes.text(centre, 0.5, text, ha="center", va="center", fontsize=7, color=INK)
            last = centre + 0.5 * wide
        elif high - low >= WIDE * span / 2 and centre - 0.004 * span > last:
            tilt: dict[str, Any] = {"rotation": 60, "ha": "left", "va": "bottom"}
            axes.text(centre - 0.004 * span, 1.3, text, fontsize=6.5, color=INK, **tilt)
            axes.plot([centre] * 2, [0.5, 1.4], color=MUTED, lw=0.6, clip_on=False)
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
                # Named as it was met: of a model without a mirror the image is no response.
                families = list({_family(s): s.response for s in reversed(steps)}.values())[::-1]
                some = ", ".join(families[:3]) + (" …" if len(families) > 3 else "")
                handles.append(Line2D([], [], color=colour, label=f"also {some}", **dot))
    shown = {bool(w.symmetric) for w in sweep.windows if read_counts(w.response)}
    words = {True: "symmetric", False: "not symmetric"}
    handles += [Patch(fc=SHADES[s], label=text) for s, text in words.items() if s in shown]
    met = {w.response for w in sweep.windows}
    handles += [Patch(fc=colour, label=name) for name, colour in WITHOUT_N.items() if name in met]
    return handles


def _cells(
    axes: Axes, plan: MapPlan | BasinPlan, numbers: Sequence[int], colours: Sequence[str]
) -> None:
    axes.pcolormesh(
        plan.xs,
        plan.ys,
        np.array(numbers).reshape(len(plan.ys), len(plan.xs)),
        cmap=ListedColormap(list(colours)),
        vmin=-0.5,
        vmax=len(colours) - 0.5,
        shading="nearest",
        rasterized=True,
    )


def _attractor_colours(result: Basins) -> list[str]:
    """The most frequent one black, its twin red; twins of others in the next colour."""
    out: list[str] = []
    free = iter(OTHERS * (1 + len(result.attractors) // len(OTHERS)))
    for a in result.attractors:
        if a.number == 0:
            out.append(BLACK)
        elif a.twin == 0:
            out.append(RED)
        elif a.response == OrbitStatus.APERIODIC:
            out.append("#8c8c8c")
        elif a.response == OrbitStatus.QUASI_PERIODIC:
            out.append(TORUS)
        else:
            out.append(OPEN if a.response == OrbitStatus.NOT_SETTLED else next(free))
    return out


def _wrapped(text: str) -> str:
    """A panel's label on as many lines as keep it within the panel: names may be long."""
    return "\n".join(part for line in text.split("\n") for part in wrap(line, PANEL))
