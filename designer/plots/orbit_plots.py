"""Figures of one response: phase portraits and time traces, all engines over each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from designer.base.arrays import Array, Index
from designer.base.figure_style import (
    CIRCUIT_COLOUR,
    CONTACT,
    IMPACT_COLOUR,
    INK,
    MODEL_COLOUR,
    MUTED,
    NGSPICE_COLOUR,
    axis_limits,
    new_figure,
    shade_stops,
    state_plane,
    styled,
)
from designer.check.checked_design import CheckedResponse
from designer.circuit.nominal import Trace
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.model.relative_motion import RelativeMotion

ENGINES = {"model": "model", "circuit": "exact circuit", "ngspice": "ngspice"}
"""Names of the engines, by their keys in ``checked_design.traces``."""

APERIODIC_PERIODS = 8
"""Drive periods of a response without a period that a time trace shows."""

WIDEST_TITLE = 48
"""Characters of a panel's second line; statuses are longer than n-p-q and take a line each."""


@styled
def phase_portrait(
    checked: CheckedResponse,
    traces: Mapping[str, Trace],
    motion: RelativeMotion,
) -> Figure:
    """One response in the plane of displacement and velocity in a clearance, or in several that see
    the same displacement; all engines over each other, in the motion's units.

    The model is a broad light line, the exact circuit a dashed one on it, ngspice dots; triangles
    mark where an impact begins; beyond the stops there is contact.
    """
    figure = new_figure(3.5, 3.2)
    _portrait(figure.subplots(), checked, traces, motion)
    return figure


@styled
def small_portrait(
    checked: CheckedResponse, traces: Mapping[str, Trace], motion: RelativeMotion
) -> Figure:
    """The phase portrait of the model and the exact circuit as a thumbnail without axes."""
    figure = Figure(figsize=(1.4, 1.25))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    orbits = _orbits(checked)
    exact = {name: trace for name, trace in traces.items() if name != "ngspice"}
    curves = _curves(checked, exact, motion)
    limits = state_plane(axes, curves.values(), motion.stops)
    for name, states in curves.items():
        shares = states / np.ptp(limits, axis=1)
        at = _spaced(shares[:, 0], shares[:, 1], 0.01)
        look = _look(name, orbits[name])
        axes.plot(*states[at].T, **look | {"lw": 0.5 * look["lw"]})
    return figure


@styled
def time_traces(
    checked: CheckedResponse, traces: Mapping[str, Trace], motion: RelativeMotion
) -> Figure:
    """The displacement in a clearance over the n periods of the response, with the stops shaded."""
    figure = new_figure(3.5, 1.75)
    axes = figure.subplots()
    period = 2.0 * np.pi / checked.model.omega
    orbits = _orbits(checked)
    n = max((o.n for o in orbits.values() if o.status is OrbitStatus.PERIODIC), default=0)
    span = n or APERIODIC_PERIODS
    reference = traces.get("model")
    curves: list[Array] = []
    for name, trace in _to_draw(traces, orbits).items():
        cycles, x = trace.time / period, _moved(checked, trace, motion)[:, 0]
        if reference is not None and name != "model" and n > 1:
            wanted = _moved(checked, reference, motion)[:, 0]
            x = _shifted(cycles, x, reference.time / period, wanted, n)
        keep = (cycles <= span * (1.0 + 1e-9)) & np.isfinite(x)
        cycles, x = cycles[keep], x[keep]
        if not len(x):
            continue
        curves.append(x)
        if name == "ngspice":
            at = _spaced(cycles / span, x / max(float(np.ptp(x)), 1e-300) * 0.5, 0.035)
            axes.plot(cycles[at], x[at], **_look(name, orbits[name]))
        else:
            axes.plot(cycles, x, **_look(name, orbits[name]))
    limits = axis_limits(np.concatenate([*curves, [0.0]]), motion.gaps)
    axes.set_ylim(limits)
    axes.set_xlim(0.0, span)
    shade_stops(axes, list(motion.stops), limits, across=True)
    axes.xaxis.set_major_locator(MaxNLocator(6, integer=span > 2))
    axes.yaxis.set_major_locator(MaxNLocator(4))
    length = f"{1e3 / checked.excitation.frequency:.3g} ms"
    axes.set_xlabel(f"drive periods ({length} each on the bench)", size=8)
    axes.set_ylabel(motion.axes[0])
    return figure


def aligned_curves(
    checked: CheckedResponse, traces: Mapping[str, Trace], motion: RelativeMotion
) -> dict[str, Array]:
    """(k, 3) drive periods, displacement and velocity in a clearance by engine, each begun at the
    phase that lies closest to the model's; ngspice's as the points that are drawn."""
    orbits, period = _orbits(checked), 2.0 * np.pi / checked.model.omega
    drawn: dict[str, Array] = {}
    for name, trace in _to_draw(traces, orbits).items():
        curve = np.column_stack([trace.time / period, _moved(checked, trace, motion)])
        curve = curve[np.isfinite(curve).all(axis=1)]
        n = orbits[name].n
        if "model" in drawn and n > 1 and orbits["model"].n == n:
            at = (curve[:, 0] + _delay(curve, drawn["model"], n)) % n
            curve[:, 1:] = np.transpose([np.interp(at, curve[:, 0], x) for x in curve[:, 1:].T])
        if name == "ngspice":
            shares = curve[:, 1:] / np.maximum(np.ptp(curve[:, 1:], axis=0), 1e-300)
            curve = curve[_spaced(shares[:, 0], shares[:, 1], 0.045)]
        drawn[name] = curve
    return drawn


@styled
def legend(*, ngspice: bool = True, stops: bool = True) -> Figure:
    """The key to portraits and traces, for a page that shows many without one."""
    names = [name for name in ENGINES if ngspice or name != "ngspice"]
    figure = new_figure(3.9, 0.48)
    figure.legend(handles=_keys(names, stops=stops), loc="center left", ncols=3, borderpad=0.0)
    return figure


def _orbits(checked: CheckedResponse) -> dict[str, Orbit]:
    orbits = {"model": checked.model.orbit, "circuit": checked.circuit}
    if checked.ngspice is not None:
        orbits["ngspice"] = checked.ngspice
    return orbits


def _to_draw(traces: Mapping[str, Trace], orbits: Mapping[str, Orbit]) -> dict[str, Trace]:
    """The traces to draw, by engine; a failed run of ngspice is not drawn."""
    return {
        name: traces[name]
        for name in ENGINES
        if name in traces and name in orbits and orbits[name].status is not OrbitStatus.FAILED
    }


def _moved(checked: CheckedResponse, trace: Trace, motion: RelativeMotion) -> Array:
    """(k, 2) displacement and velocity in a clearance; nan where a state is not finite."""
    finite = np.isfinite(trace.states).all(axis=1, keepdims=True)
    states = np.where(finite, trace.states, np.nan)
    return motion.of(trace.time, states, checked.model.omega)


def _curves(
    checked: CheckedResponse, traces: Mapping[str, Trace], motion: RelativeMotion
) -> dict[str, Array]:
    """(points, 2) displacement and velocity in a clearance, of each engine that has an orbit."""
    moved = {
        name: _moved(checked, trace, motion)
        for name, trace in _to_draw(traces, _orbits(checked)).items()
    }
    return {name: states[np.isfinite(states).all(axis=1)] for name, states in moved.items()}


def _portrait(
    axes: Axes,
    checked: CheckedResponse,
    traces: Mapping[str, Trace],
    motion: RelativeMotion,
) -> None:
    orbits, curves = _orbits(checked), _curves(checked, traces, motion)
    limits = state_plane(axes, curves.values(), motion.stops)
    for name, states in curves.items():
        if name == "ngspice":
            scaled = states / np.ptp(limits, axis=1)
            states = states[_spaced(scaled[:, 0], scaled[:, 1], 0.045)]
        axes.plot(states[:, 0], states[:, 1], **_look(name, orbits[name]))
    for side, place, entry in motion.impacts(checked.model.orbit):
        axes.plot(
            np.full(len(entry), place),
            entry,
            ls="",
            marker=">" if side > 0 else "<",
            **_IMPACT,
            zorder=5,
            clip_on=False,
        )
    axes.xaxis.set_major_locator(MaxNLocator(5))
    axes.yaxis.set_major_locator(MaxNLocator(5))
    x_label, y_label = motion.axes
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    names = [f"{name} {orbit.response}" for name, orbit in orbits.items()]
    text = "   ".join(names)
    if len(text) > WIDEST_TITLE:
        text = "\n".join(names)
    wanted = f", wanted {checked.model.expected}" if checked.model.expected else ""
    pad = 17.0 + 11.0 * text.count("\n")
    axes.set_title(
        f"{checked.model.spec.place_text()}{wanted}", loc="left", weight="bold", color=INK, pad=pad
    )
    axes.annotate(
        text, (0.0, 1.0), (0, 6), xycoords="axes fraction", textcoords="offset points",
        color=MUTED, size=8,
    )  # fmt: skip


_IMPACT: dict[str, Any] = {"mfc": IMPACT_COLOUR, "mec": "white", "mew": 0.5, "ms": 6.0}


def _look(name: str, orbit: Orbit) -> dict[str, Any]:
    """How an engine is drawn; a response without a period in thin lines, or it is a blot."""
    periodic = orbit.status is OrbitStatus.PERIODIC
    if name == "ngspice":
        return {"ls": "", "marker": "o", "ms": 3.0, "mew": 0, "color": NGSPICE_COLOUR, "zorder": 4}
    dense = orbit.counts.total > 6 * max(orbit.n, 1) or orbit.n > 2
    broad = 2.6 if dense else 4.0
    width = {"model": broad, "circuit": 0.9} if periodic else {"model": 1.0, "circuit": 0.4}
    style: dict[str, Any] = {"lw": width[name], "solid_capstyle": "round"}
    if name == "model":
        return {**style, "color": MODEL_COLOUR, "zorder": 2}
    return {**style, "color": CIRCUIT_COLOUR, "ls": (0, (4.0, 2.2)), "zorder": 3}


def _keys(names: Sequence[str], *, stops: bool) -> list[Line2D]:
    periodic = Orbit(OrbitStatus.PERIODIC)
    handles = [Line2D([], [], **_look(name, periodic), label=ENGINES[name]) for name in names]
    if stops:
        box: dict[str, Any] = {"ms": 9, "mfc": CONTACT, "mec": MUTED, "mew": 0.6}
        handles += [
            Line2D([], [], ls="", marker=">", **_IMPACT, label="impact begins"),
            Line2D([], [], ls="", marker="s", **box, label="contact"),
        ]
    return handles


def _spaced(x: Array, y: Array, step: float) -> Index:
    """Indices of points that lie ``step`` apart along the path (x, y), whatever its sampling."""
    path = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    marks = (
        np.arange(0.0, path[-1], step) if len(x) and path[-1] > 0.0 else np.zeros(min(len(x), 1))
    )
    return np.unique(np.clip(np.searchsorted(path, marks), 0, max(len(x) - 1, 0)))


def _shifted(cycles: Array, x: Array, wanted_at: Array, wanted: Array, n: int) -> Array:
    """x delayed by the whole number of periods that brings it closest to ``wanted``.

    An orbit of n periods has n phases, and each engine begins at one of its own.
    """
    curve, aim = np.column_stack([cycles, x]), np.column_stack([wanted_at, wanted])
    return np.interp((cycles + _delay(curve, aim, n)) % n, cycles, x)


def _delay(curve: Array, wanted: Array, n: int) -> int:
    """The whole number of periods after which a curve (k, 2 or 3) of periods and displacement lies
    closest to ``wanted``."""
    cycles, x = curve[:, 0], curve[:, 1]
    aim = np.interp(cycles, wanted[:, 0], wanted[:, 1])
    moved = [np.interp((cycles + k) % n, cycles, x) for k in range(n)]
    return int(np.argmin([float(np.abs(m - aim).sum()) for m in moved]))
