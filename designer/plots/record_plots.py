"""A record over the prediction: phase portrait and traces in one picture."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from designer.base.arrays import Array
from designer.base.figure_style import (
    CIRCUIT_COLOUR,
    MUTED,
    NGSPICE_COLOUR,
    new_figure,
    styled,
)
from designer.workbench.folding import samples_of
from designer.workbench.naming import NamedMotion
from designer.workbench.overlay import Overlay

SAMPLE_COLOUR, RECORD_COLOUR = "#c6dff0", "#0072b2"
SHOWN = 2
"""Drive periods of a trace at least."""
DOTS = 6000
"""Samples that are drawn, at most."""
RAW_PERIODS = 4
"""Drive periods that are drawn of a record without a period."""


@styled
def record_figure(named: NamedMotion, overlay: Overlay | None) -> Figure:
    """Left the first displacement against its rate, right every recorded net over the phase of the
    drive: samples, the curve of all laps, the exact circuit, ngspice."""
    nets = named.nets
    figure = new_figure(7.6, 1.1 + 1.35 * max(len(nets), 2))
    parts: Any = figure.subfigures(1, 2, width_ratios=[0.8, 1.2])
    left, right = parts
    portrait = left.subplots()
    panels = right.subplots(len(nets), 1, sharex=True, squeeze=False)[:, 0]
    if named.curve is None:
        _raw(portrait, panels, named)
    else:
        _portrait(portrait, named, overlay)
        for axes, net in zip(panels, nets, strict=True):
            _trace(axes, named, overlay, net)
    panels[-1].set_xlabel("drive periods")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, markerscale=4.0)
    return figure


def _portrait(axes: Axes, named: NamedMotion, overlay: Overlay | None) -> None:
    assert named.curve is not None
    hertz = named.motion.frequency
    place = named.nets.index(named.moving)
    curve, rate = named.curve.curve[:, place], named.curve.rate[:, place] * hertz
    axes.plot(_closed(curve), _closed(rate) / 1e3, color=RECORD_COLOUR, lw=1.1)
    if overlay is not None:
        for waves, look in _predicted(overlay):
            wave = waves[:, place]
            slope = (np.roll(wave, -1) - np.roll(wave, 1)) * (0.5 * overlay.points * hertz)
            axes.plot(_closed(wave), _closed(slope) / 1e3, **look)
    for zone in named.dead_zones.values():
        for end in zone.ends.values():
            axes.axvline(end, color=MUTED, lw=0.6, ls=":")
    axes.set_xlabel(f"{named.moving} [V]")
    axes.set_ylabel(f"rate of {named.moving} [V/ms]")


def _trace(axes: Axes, named: NamedMotion, overlay: Overlay | None, net: str) -> None:
    curve, motion = named.curve, named.motion
    assert curve is not None
    place = named.nets.index(net)
    periods = max(math.ceil(SHOWN / curve.n), 1) * curve.n
    samples = samples_of(motion.record, [motion.channels[n] for n in named.nets], motion.frequency)
    phase = (samples.time * motion.frequency) % periods
    every = max(len(phase) // DOTS, 1)
    axes.plot(
        phase[::every],
        samples.values[::every, place],
        ls="",
        marker=".",
        ms=1.4,
        color=SAMPLE_COLOUR,
        label="samples",
        rasterized=True,
    )
    laps = np.tile(curve.curve[:, place], periods // curve.n)
    axes.plot(_phases(laps, periods), laps, color=RECORD_COLOUR, lw=1.1, label="record")
    if overlay is not None:
        for waves, look in _predicted(overlay):
            wave = np.resize(waves[:, overlay.nets.index(net)], periods * overlay.points)
            axes.plot(_phases(wave, periods), wave, **look)
        difference = f"difference {100.0 * overlay.errors[net]:.2g} % of the peak"
        if overlay.ngspice is not None:
            difference += f", ngspice's {100.0 * overlay.ngspice.errors[net]:.2g} %"
        axes.text(
            1.0,
            1.02,
            difference,
            transform=axes.transAxes,
            ha="right",
            va="bottom",
            color=MUTED,
        )
    axes.set_ylabel(f"{net} [V]")
    axes.set_xlim(0.0, periods)


def _predicted(overlay: Overlay) -> Iterator[tuple[Array, dict[str, Any]]]:
    """(k, nets) waves of each engine, with how they are drawn."""
    exact: dict[str, Any] = {
        "color": CIRCUIT_COLOUR,
        "lw": 0.8,
        "ls": "--",
        "label": "exact circuit, nominal",
    }
    yield overlay.predicted, exact
    if overlay.ngspice is not None:
        board = "fitted board" if overlay.ngspice.fitted else "nominal"
        look: dict[str, Any] = {
            "color": NGSPICE_COLOUR,
            "lw": 0.9,
            "ls": ":",
            "label": f"ngspice, {board}",
        }
        yield overlay.ngspice.waves, look


def _raw(portrait: Axes, panels: Sequence[Axes], named: NamedMotion) -> None:
    """A record without a period: its first periods as they are."""
    motion = named.motion
    samples = samples_of(motion.record, [motion.channels[n] for n in named.nets], motion.frequency)
    phase = samples.time * motion.frequency
    first = phase < RAW_PERIODS
    for axes, net, values in zip(panels, named.nets, samples.values.T, strict=True):
        axes.plot(phase[first], values[first], color=RECORD_COLOUR, lw=0.7, label="record")
        axes.set_ylabel(f"{net} [V]")
    other = samples.values[:, min(1, samples.values.shape[1] - 1)]
    portrait.plot(samples.values[:, 0], other, color=RECORD_COLOUR, lw=0.3)
    portrait.set_xlabel(f"{named.nets[0]} [V]")
    portrait.set_ylabel(f"{named.nets[min(1, len(named.nets) - 1)]} [V]")


def _closed(values: Array) -> Array:
    return np.append(values, values[0])


def _phases(values: Array, periods: int) -> Array:
    return np.arange(len(values)) * periods / len(values)
