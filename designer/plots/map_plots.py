"""The yield maps of a study: a curve with its interval, or a heat map over ω and grade."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from designer.base.figure_style import GRID, INK, MUTED, ON_DARK, new_figure, styled, to_png
from designer.base.si_unit import drive_text
from designer.yields.yield_maps import YieldMap

FORMAT = 1
_LINE, _BAND, _BEST = "#0072b2", "#c6dff0", "#d55e00"
PER_TURN = 1.0 / (2.0 * math.pi)
"""Hz per rad/s."""
_HERTZ = "drive frequency [Hz]"
_AXES = {
    "omega": "drive frequency ω",
    "b": "clearance b (the generator’s amplitude goes as 1/b)",
    "grade": "grade of resistors and capacitors [%]",
    "temperature": "temperature of the boards [°C]",
}


def map_files(
    maps: Sequence[YieldMap],
    labels: Sequence[str],
    provenance: Mapping[str, Any],
    *,
    angular: bool = False,
) -> dict[str, bytes]:
    """``maps.json`` and a picture for each map, by file name.

    labels : of the plan's questions, such as "ω = 0.54   1-3-3". angular : as of ``map_chart``.
    """
    rows, pictures = [], {}
    for one in maps:
        label, name = labels[one.question], f"map-{one.over}-{one.question + 1}.png"
        pictures[name] = to_png(map_chart(" ".join(label.split()), one, angular=angular))
        cost = {"attractors": one.attractors, "seconds": one.seconds}
        rows.append({"response": label, "picture": name, **one.as_dict(), "cost": cost})
    document = {"format": FORMAT, **provenance, "maps": rows}
    text = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False)
    return {"maps.json": f"{text}\n".encode(), **pictures}


@styled
def map_chart(label: str, one: YieldMap, *, angular: bool = False) -> Figure:
    """A yield map of the response ``label``, readable alone.

    angular : ω is in rad/s, and is shown in hertz.
    """
    if len(one.axes) == 2:
        return _heat(label, one, angular)
    figure = new_figure(6.2, 3.1)
    axes = figure.subplots()
    name = one.axes[0].name
    scale = 100.0 if name == "grade" else _scale(one, angular)
    x = scale * np.array(one.axes[0].values)
    axes.fill_between(x, 100.0 * one.low, 100.0 * one.high, color=_BAND, lw=0.0)
    axes.plot(x, 100.0 * one.rate, "-o", color=_LINE, ms=3.6, lw=1.2)
    absent = ~one.there
    if absent.any():
        axes.plot(x[absent], np.zeros(absent.sum()), "x", color=MUTED, ms=6, clip_on=False)
    if name == "grade":
        axes.set_xscale("log")
        axes.set_xticks(x, [f"{v:g}" for v in x])
        axes.xaxis.set_minor_formatter(NullFormatter())
    _marks(axes, one, scale)
    axes.set_ylim(0.0, 103.0)
    axes.set_ylabel("yield with its 95 % interval [%]")
    axes.set_xlabel(_HERTZ if scale == PER_TURN else _AXES[name])
    _generator(axes, one, scale)
    axes.grid(color=GRID, lw=0.7)
    axes.set_title(f"{label}; {one.samples} boards a point", loc="left", color=INK, size=9)
    handles, names = axes.get_legend_handles_labels()
    if handles:
        figure.legend(handles, names, loc="outside lower center", ncols=len(handles))
    return figure


def _marks(axes: Axes, one: YieldMap, scale: float) -> None:
    if one.over == "temperature":
        axes.axvline(one.used, color=INK, lw=0.9, ls="--", label="where figures of parts hold")
        _shade_outside(axes, one)
        return
    word = "coarsest of the best" if one.over == "grade" else "recommended"
    best = None if one.recommended is None else scale * one.recommended[0]
    if best is None:
        axes.plot([], [], color=_BEST, lw=1.2, label=f"{word}: nowhere")
    elif best == scale * one.used and one.over != "grade":
        axes.axvline(best, color=_BEST, lw=1.2, label=f"recommended, in use: {best:.4g}")
    else:
        axes.axvline(best, color=_BEST, lw=1.2, label=f"{word}: {best:.4g}")
    if one.over == "grade":
        return
    if best != scale * one.used:
        used = scale * one.used
        axes.axvline(used, color=INK, lw=0.9, ls="--", label=f"in use: {used:.4g}")
    if one.window is not None:
        for edge, open_ in zip(one.window, one.open, strict=True):
            if not open_:
                axes.axvline(scale * edge, color=MUTED, lw=0.9, ls=":")
        axes.plot([], [], color=MUTED, lw=0.9, ls=":", label="edge of the nominal window")
    if (~one.there).any():
        axes.plot([], [], "x", color=MUTED, label="not there nominally")


def _shade_outside(axes: Axes, one: YieldMap) -> None:
    """Temperatures for which the op-amp is not specified."""
    ends = axes.get_xlim()
    label = "op-amp not specified"
    for low, high in ((ends[0], one.specified[0]), (one.specified[1], ends[1])):
        if low is not None and high is not None and low < high:
            axes.axvspan(low, high, color=GRID, lw=0.0, zorder=0, label=label)
            label = "_"
    axes.set_xlim(ends)


def _scale(one: YieldMap, angular: bool) -> float:
    """The function from a value of the first axis to what is shown."""
    return PER_TURN if angular and one.axes[0].name == "omega" else 1.0


def _generator(axes: Axes, one: YieldMap, shown: float) -> None:
    """The generator's frequency above the drive's. shown : as of ``_scale``."""
    if one.axes[0].name != "omega" or one.frequency is None:
        return
    scale = one.frequency / one.used / shown
    top = axes.secondary_xaxis(
        "top", functions=(partial(np.multiply, scale), partial(np.multiply, 1.0 / scale))
    )
    top.set_xlabel("generator frequency [Hz]")


def _heat(label: str, one: YieldMap, angular: bool) -> Figure:
    figure = new_figure(6.6, 3.3)
    axes = figure.subplots()
    scale = _scale(one, angular)
    omega, grade = scale * np.array(one.axes[0].values), np.array(one.axes[1].values)
    values = np.where(one.there, 100.0 * one.rate, np.nan)
    edges = _edges(omega)
    image = axes.pcolormesh(
        edges, np.arange(len(grade) + 1) - 0.5, values.T, cmap="cividis", vmin=0.0, vmax=100.0
    )
    axes.set_yticks(range(len(grade)), [f"{100 * g:g}" for g in grade])
    axes.set_xlabel(_HERTZ if scale == PER_TURN else _AXES["omega"])
    _generator(axes, one, scale)
    axes.set_ylabel(_AXES["grade"])
    axes.axvline(scale * one.used, color=ON_DARK, lw=1.0, ls="--")
    best = one.recommended
    marker = ([], []) if best is None else ([scale * best[0]], [one.axes[1].values.index(best[1])])
    text = "nowhere" if best is None else f"{_drive(best[0], scale)} at {100 * best[1]:g} %"
    axes.plot(
        *marker, "o", ms=8, mfc="none", mec=_BEST, mew=2.0, label=f"recommended: {text}"
    )  # fmt: skip
    axes.plot([], [], color=MUTED, lw=1.0, ls="--", label=f"in use: {_drive(one.used, scale)}")
    axes.set_facecolor("#d9d9d9")
    bar = figure.colorbar(image, ax=axes, pad=0.015, format=FuncFormatter(lambda v, _: f"{v:g}"))
    bar.set_label("yield [%]")
    axes.set_title(f"{label}; {one.samples} boards a point", loc="left", color=INK, size=9)
    figure.legend(loc="outside lower center", ncols=2)
    return figure


def _drive(omega: float, scale: float) -> str:
    return drive_text(omega, scale * omega if scale == PER_TURN else None)


def _edges(centres: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> list[float]:
    """Cell edges around these centres."""
    if len(centres) == 1:
        return [float(centres[0]) * 0.995, float(centres[0]) * 1.005]
    middle = 0.5 * (centres[1:] + centres[:-1])
    first, last = 2.0 * centres[0] - middle[0], 2.0 * centres[-1] - middle[-1]
    return [float(first), *map(float, middle), float(last)]
