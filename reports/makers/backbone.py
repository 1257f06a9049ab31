"""Free vibrations of a mass between two equal stops, and the forced ones beside them.

Between the stops the mass swings at ω₁, beyond them at ω₂ about a middle c, where both springs
together would rest. So a free vibration of the amplitude A > g takes

    T/4 = atan(ω₁ g/v)/ω₁ + acos((g - c)/(A - c))/ω₂,    c = g (1 - ω₁²/ω₂²)

with the velocity v = ω₂ √((A - c)² - (g - c)²) at the stop: the backbone of the resonance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from designer.base.arrays import Array
from designer.base.figure_style import INK, MUTED, new_figure, styled
from designer.bifurcations.branch_survey import survey
from designer.bifurcations.continuation import Branch
from designer.bifurcations.points import PointKind
from designer.model.lumped_system import LumpedSystem
from designer.model.model_file import ModelFile
from designer.model.swept_model import of_model
from reports.makers.evidence import (
    Comparison,
    Evidence,
    Example,
    comparison_table,
    figure_block,
    name_axes,
)
from reports.makers.first_grazing import first_grazings, linear_orbit

SOFTER = (1.0, 0.7, 0.5)
"""Factors on force and damping: the weaker both are, the nearer the fold lies to the backbone."""
LOW, HIGH = 0.9, 4.4
"""Frequencies over ω₁ between which the resonance is followed."""


def evidence(file: ModelFile) -> list[Evidence]:
    """The part of a report about the bent resonance."""
    assert isinstance(file.model, LumpedSystem)
    model = file.model
    branches, compared = [], []
    for factor in SOFTER:
        branch, fold = _resonance(_softer(model, factor))
        branches.append((factor, branch))
        if fold is not None:
            omega, height = fold
            compared.append(
                Comparison(
                    f"ω of the fold, damping and force × {factor:g}",
                    backbone(model, height),
                    omega,
                )
            )
    text = (
        "Free vibrations have a closed form: their frequency rises from ω₁ at the gap towards ω₂. "
        "The forced symmetric orbits are followed over ω, through the fold at which they lose "
        "their stability as ω rises. As damping and force fall together, the fold goes to "
        "the free vibration of the same amplitude."
    )
    name = "backbone"
    blocks = [
        text,
        comparison_table(compared, 6),
        figure_block(
            name, "Largest x over ω: forced orbits (broken where unstable), free ones (grey)."
        ),
    ]
    figure = _figure(model, branches)
    return [Evidence("Resonance and backbone", blocks, {name: figure}, tuple(compared))]


def backbone(model: LumpedSystem, amplitude: float) -> float:
    """Frequency of the free vibration of an amplitude above the gap."""
    system = model.second_order()
    (off,), (on,) = system.natural_frequencies(), system.natural_frequencies(closed=True)
    gap = system.clearances[0].first.gap
    middle = gap * (1.0 - (off / on) ** 2)
    speed = on * math.sqrt((amplitude - middle) ** 2 - (gap - middle) ** 2)
    inside = math.atan2(off * gap, speed) / off
    beyond = math.acos((gap - middle) / (amplitude - middle)) / on
    return float(0.5 * math.pi / (inside + beyond))


def _softer(model: LumpedSystem, factor: float) -> LumpedSystem:
    names = [n for n in model.parameters if n.endswith((".amplitude", "-ground.damping"))]
    return model.changed({name: factor * model.parameter(name) for name in names})


def _resonance(model: LumpedSystem) -> tuple[Branch, tuple[float, float] | None]:
    """The symmetric branch over ω, and (ω, largest x) at its fold of the highest frequency."""
    unit = model.second_order().own_frequency
    low, high = LOW * unit, HIGH * unit
    if first_grazings(model, high)[0].b > model.b:
        raise ArithmeticError(f"the stops are hit at ω = {high:g}")
    known = [(high, linear_orbit(model, high))]
    located = survey(of_model(model, high, "omega"), known, low, high, depth=0)
    folds = [p for p in located.points if p.kind is PointKind.FOLD]
    if not folds:
        return located.branches[0], None
    last = max(folds, key=lambda p: p.value)
    return located.branches[0], (last.value, float(last.point.orbit.extremes[0, 1]))


def _curve(branch: Branch, stable: bool) -> tuple[Array, Array]:
    heights = [p.orbit.extremes[0, 1] if p.stable is stable else math.nan for p in branch.points]
    return branch.values, np.array(heights)


@styled
def _figure(model: LumpedSystem, branches: Sequence[tuple[float, Branch]]) -> Figure:
    figure = new_figure(7.2, 3.6)
    axes = figure.subplots()
    gap = model.second_order().clearances[0].first.gap
    tall = max(float(p.orbit.extremes[0, 1]) for _, b in branches for p in b.points)
    heights = gap * np.geomspace(1.0001, 1.2 * tall / gap, 200)
    free = [backbone(model, float(h)) for h in heights]
    axes.plot(free, heights, color=MUTED, lw=2.4, alpha=0.5)
    for (factor, branch), colour in zip(branches, (INK, "#0072b2", "#009e73"), strict=True):
        axes.plot(*_curve(branch, True), color=colour, lw=1.3, label=f"× {factor:g}")
        axes.plot(*_curve(branch, False), color=colour, lw=0.9, ls=(0, (3, 2)))
    name_axes(axes, "ω", "largest x")
    axes.legend(title="damping and force")
    return figure


EXAMPLE = Example(
    evidence,
    see="The stops on both sides stiffen the motion as it grows, so the resonance leans to higher "
    "frequencies, as that of a hardening spring does. Between the fold at its tip and the "
    "one below, a large and a small motion exist side by side. The free vibrations, in grey, "
    "are the spine about which the forced curves bend.",
    board="Both responses are on the board: one on the flank of the resonance, one below it, where "
    "each stop is hit twice a period. Both lie away from the windows in which another count of "
    "impacts takes over.",
)
