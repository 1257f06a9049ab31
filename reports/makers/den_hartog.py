"""A driven mass with Coulomb friction beside one whose friction rises with the velocity.

Where the mass does not stick, J. P. Den Hartog (Trans. ASME 53, 1931) has the amplitude of a mass m
on a spring k under P sin ωt and the friction F, with r = ω/√(k/m):

    X = (P/k) √(V² - (F U/P)²),    V = 1/(1 - r²),    U = sin(π/r)/(r (1 + cos(π/r)))

A circuit has no such friction: within the velocity v₀ it is a damper F/v₀. What that changes is of
the size of v₀.
"""

from __future__ import annotations

import math

import numpy as np
from matplotlib.figure import Figure

from designer.base.arrays import Array
from designer.base.figure_style import INK, MUTED, new_figure, styled
from designer.dynamics.attractors import settle
from designer.model.driven import model_flow
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

NAME = "block-ground"
RATIOS = (0.6, 0.8, 1.5)
"""ω over that of the free mass, at which the slopes are compared: it slides on there."""
STEEPER = (1.0, 0.1, 0.01)
"""Factors on the velocity within which the friction is a damper."""
DRAWN = ((0.6, 0.85), (1.15, 1.6))
"""Ends of the frequencies in the picture: on either side of the resonance, which friction alone
does not bound."""


def evidence(file: ModelFile) -> list[Evidence]:
    """The part of a report about friction with a finite slope."""
    assert isinstance(file.model, LumpedSystem)
    model, own = file.model, file.model.second_order().own_frequency
    width = model.parameter(f"{NAME}.velocity")
    compared = tuple(
        Comparison(
            f"amplitude at ω = {ratio * own:g}, v₀ = {factor * width:g}",
            ideal_amplitude(model, ratio * own),
            _amplitude(model.changed({f"{NAME}.velocity": factor * width}), ratio * own),
        )
        for ratio in RATIOS
        for factor in STEEPER
    )
    text = (
        "Den Hartog (1931) has the amplitude in closed form where the mass slides on all the time. "
        "The friction of the file is a damper within the velocity v₀. As v₀ falls, the amplitude "
        "goes to his."
    )
    name = "den-hartog"
    caption = "Amplitude over ω: Den Hartog's (grey), and with the slope of the file (dots)."
    blocks = [text, comparison_table(compared, 6), figure_block(name, caption)]
    return [Evidence("Beside Den Hartog's friction", blocks, {name: _figure(model)}, compared)]


def ideal_amplitude(model: LumpedSystem, omega: float) -> float:
    """Den Hartog's, of a mass that slides on all the time."""
    stiffness, force = model.parameter("block-ground.stiffness"), model.parameter("block.amplitude")
    r = omega / math.sqrt(stiffness / model.parameter("block.mass"))
    V = 1.0 / (1.0 - r * r)
    U = math.sin(math.pi / r) / (r * (1.0 + math.cos(math.pi / r)))
    lost = model.parameter(f"{NAME}.force") / force * U
    return force / stiffness * math.sqrt(V * V - lost * lost)


def _amplitude(model: LumpedSystem, omega: float) -> float:
    orbit = settle(model_flow(model, omega), np.zeros(2))
    return float(orbit.extremes[0, 1])


@styled
def _figure(model: LumpedSystem) -> Figure:
    figure = new_figure(7.2, 3.2)
    axes = figure.subplots()
    own = model.second_order().own_frequency
    for low, high in DRAWN:
        omegas: Array = own * np.linspace(low, high, 100)
        axes.plot(omegas, [ideal_amplitude(model, w) for w in omegas], color=MUTED, lw=2.4)
        few = omegas[::9]
        axes.plot(few, [_amplitude(model, w) for w in few], "o", color=INK, ms=3.5)
    name_axes(axes, "ω", "largest x")
    return figure


EXAMPLE = Example(
    evidence,
    see="Dry friction takes a fixed force however slow the mass is, so it holds the mass twice a "
    "period where the drive is slow, and lets it slide on where it is fast. Alone it bounds no "
    "resonance.",
    board="A stage that limits makes the friction: a resistor below v₀, a fixed current above. "
    "So the board has the finite slope of the file, not Coulomb's jump. Op-amps' offsets act "
    "as forces, the more the smaller v₀ is.",
)
