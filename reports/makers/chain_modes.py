"""The modes of a chain of equal masses and springs, free at one end.

The k-th of n has the frequency 2 √(K/M) sin((2k - 1)π/(4n + 2)). Near each the chain moves
most, and its clearances are hit; which of them, and how often, is what n-p-q of each says.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from designer.base.arrays import Array
from designer.base.figure_style import INK, MUTED, new_figure, plain_numbers, styled
from designer.model.lumped_system import LumpedSystem
from designer.model.model_file import ModelFile
from reports.makers.evidence import (
    Comparison,
    Evidence,
    Example,
    comparison_table,
    figure_block,
    name_axes,
)
from reports.makers.first_grazing import first_grazings

GRID_POINTS = 400
"""Frequencies at which the first touch of each stop is drawn."""


def evidence(file: ModelFile) -> list[Evidence]:
    """The part of a report about the modes, and which stops they reach."""
    assert isinstance(file.model, LumpedSystem)
    model = file.model
    compared = _compared(model)
    text = (
        "Three equal masses on equal springs have the frequencies 2√(K/M) sin((2k − 1)π/14). The "
        "picture says for each stop the factor b on its gap below which the linear response "
        "reaches it: above the curve of a stop it is not touched, as long as no other is."
    )
    name = "first-touches"
    blocks = [
        text,
        comparison_table(compared),
        figure_block(name, "Factor b of each stop's first touch over ω; broken: the modes."),
    ]
    return [Evidence("Modes of the chain", blocks, {name: _figure(model)}, compared)]


def chain_frequencies(masses: int, mass: float, stiffness: float) -> Array:
    """(masses,) of such a chain."""
    k = np.arange(1, masses + 1)
    return 2.0 * math.sqrt(stiffness / mass) * np.sin((2 * k - 1) * np.pi / (4 * masses + 2))


def _compared(model: LumpedSystem) -> tuple[Comparison, ...]:
    system = model.second_order()
    expected = chain_frequencies(system.size, model.masses[0].mass, model.springs[0].stiffness)
    return tuple(
        Comparison(f"frequency of mode {k + 1}", float(one), float(other))
        for k, (one, other) in enumerate(zip(expected, system.natural_frequencies(), strict=True))
    )


def _grazings(model: LumpedSystem, omega: float) -> Mapping[tuple[str, int], float]:
    return {(t.clearance, t.side): t.b for t in first_grazings(model, omega)}


@styled
def _figure(model: LumpedSystem) -> Figure:
    figure = new_figure(7.2, 3.4)
    axes = figure.subplots()
    modes = model.second_order().natural_frequencies()
    omegas = np.linspace(0.3 * modes[0], 1.3 * modes[-1], GRID_POINTS)
    curves = [_grazings(model, float(w)) for w in omegas]
    labels: dict[tuple[float, ...], str] = {}
    for clearance, side in sorted(curves[0]):
        values = tuple(curve[clearance, side] for curve in curves)
        word = {1: "upper", -1: "lower"}[side]
        known = labels.get(values)
        labels[values] = f"{clearance} {word}" if known is None else f"{known} and {word}"
    for values, label in labels.items():
        axes.semilogy(omegas, values, lw=1.4, label=label)
    for mode in modes:
        axes.axvline(float(mode), color=MUTED, lw=0.8, ls=(0, (4, 3)))
    axes.axhline(model.b, color=INK, lw=0.7)
    plain_numbers(axes.yaxis)
    name_axes(axes, "ω", "b of the first touch")
    axes.legend()
    return figure


EXAMPLE = Example(
    evidence,
    see="Near each mode the chain moves in its own shape, and each clearance is reached first "
    "where its mass moves most. The two responses of the file differ only in frequency: at the "
    "lower one the first mass hits each of its stops twice a period.",
    board="Each clearance has a stage of its own, with its own thresholds and slope. Diodes make "
    "them: the thresholds of amplifiers that clip do not keep a ratio.",
)
