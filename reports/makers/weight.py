"""What a weight and a moving base do to a hammer above an anvil.

On its spring of stiffness K the hammer of mass M hangs M g/K lower, which takes from the gap to the
anvil. A base that moves as y sin ωt drives the relative motion by M ω² y, so its amplitude is
y r²/√((1 - r²)² + (2ζr)²) with r = ω/ω₀. The anvil is first touched where the two meet the gap.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
from matplotlib.figure import Figure

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
from reports.makers.first_grazing import located_grazing

RATIOS = (0.5, 0.7, 0.9, 1.0, 1.2, 1.5, 2.0)
"""Drive frequencies over the hammer's own."""
BASE = "base.amplitude"
MM = 1e3


def evidence(file: ModelFile) -> list[Evidence]:
    """The part of a report about the base amplitude at which the anvil is first touched."""
    assert isinstance(file.model, LumpedSystem)
    model = file.model
    own = model.second_order().own_frequency
    compared = tuple(_compared(model, ratio * own) for ratio in RATIOS)
    sag, gap = _sag(model), model.second_order().clearances[0].first.gap
    text = (
        f"The weight takes {MM * sag:.4g} mm of the gap of {MM * gap:.4g} mm: without it the base "
        f"would have to move {gap / (gap - sag):.3g} times as far before the anvil is touched. The "
        "hammer's own frequency is "
        f"{own / (2.0 * math.pi):.4g} Hz; lengths in the table are in mm."
    )
    name = "base-amplitude"
    blocks = [
        text,
        comparison_table(compared),
        figure_block(name, "Base amplitude of the first touch over frequency, with the weight."),
    ]
    return [Evidence("What the weight does", blocks, {name: _figure(model, compared)}, compared)]


def grazing_amplitude(model: LumpedSystem, omega: float, *, weight: bool = True) -> float:
    """Base amplitude of the first touch; with or without the weight."""
    system = model.second_order()
    own, mass = system.own_frequency, float(system.mass[0])
    r, zeta = omega / own, float(system.damping[0, 0]) / (2.0 * mass * own)
    room = system.clearances[0].first.gap - (_sag(model) if weight else 0.0)
    return room * math.hypot(1.0 - r**2, 2.0 * zeta * r) / r**2


def _sag(model: LumpedSystem) -> float:
    """M g/K."""
    return -model.forces[0].constant / model.springs[0].stiffness


def _compared(model: LumpedSystem, omega: float) -> Comparison:
    expected = grazing_amplitude(model, omega)
    computed = located_grazing(model, omega, BASE, expected)
    hertz = omega / (2.0 * math.pi)
    return Comparison(f"touching amplitude at {hertz:.4g} Hz", MM * expected, MM * computed)


def _figure(model: LumpedSystem, compared: tuple[Comparison, ...]) -> Figure:
    curves = {
        "with the weight": lambda omega: grazing_amplitude(model, omega),
        "without": lambda omega: grazing_amplitude(model, omega, weight=False),
    }
    return touching_figure(model, compared, curves, "base amplitude [mm]")


@styled
def touching_figure(
    model: LumpedSystem,
    compared: tuple[Comparison, ...],
    curves: Mapping[str, Callable[[float], float]],
    name: str,
) -> Figure:
    """Amplitudes in m at the first touch over ω: two named curves in closed form, the second
    broken, and those compared, in mm at ``RATIOS``. name : of the axis."""
    figure = new_figure(6.4, 3.0)
    axes = figure.subplots()
    own = model.second_order().own_frequency
    omegas = own * np.geomspace(0.4, 2.4, 300)
    hertz = omegas / (2.0 * math.pi)
    looks = ((INK, "-"), (MUTED, (0, (4, 3))))
    for (label, amplitude), (color, dashes) in zip(curves.items(), looks, strict=True):
        amplitudes = [MM * amplitude(float(omega)) for omega in omegas]
        axes.semilogy(hertz, amplitudes, lw=1.2, color=color, ls=dashes, label=label)
    dots = [ratio * own / (2.0 * math.pi) for ratio in RATIOS]
    axes.plot(dots, [c.computed for c in compared], "o", ms=4.5, mfc="none", color=INK)
    plain_numbers(axes.yaxis)
    name_axes(axes, "frequency [Hz]", name)
    axes.legend()
    return figure


EXAMPLE = Example(
    evidence,
    see="The weight alone takes most of the gap to the anvil, so a small motion of the base is "
    "enough to hit it. Without the weight the base would have to move several times as far.",
    board="Anvil and spring stand on the base, so the circuit computes the motion relative to it. "
    "The generator makes the base's motion, the weight is a current from the reference "
    "voltage into the velocity integrator.",
)
