"""A mass on a shaking table beside a post that stays.

A table that moves as Y sin ωt shakes the mass through its spring and damper: without contact the
mass moves by Y V, V = √((1 + (2ζr)²)/((1 - r²)² + (2ζr)²)), r = ω/ω₀. A post on the floor is first
touched where that meets its gap; one on the table, where the relative motion Y r²/√((1 - r²)² +
(2ζr)²) does.
"""

from __future__ import annotations

import math
from dataclasses import replace

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
from reports.makers.weight import BASE, MM, RATIOS, grazing_amplitude


def evidence(file: ModelFile) -> list[Evidence]:
    """The part of a report about the table's amplitude at which the post is first touched."""
    assert isinstance(file.model, LumpedSystem)
    model = file.model
    own = model.second_order().own_frequency
    compared = tuple(
        Comparison(
            f"touching amplitude at {ratio * own / (2.0 * math.pi):.4g} Hz",
            MM * touching_amplitude(model, ratio * own),
            MM * located_grazing(model, ratio * own, BASE, touching_amplitude(model, ratio * own)),
        )
        for ratio in RATIOS
    )
    text = (
        "The post is first touched where the motion of the mass, not that between mass and table, "
        f"meets the gap. The mass's own frequency is {own / (2.0 * math.pi):.4g} Hz; lengths in "
        "the table are in mm."
    )
    name = "table-amplitude"
    caption = (
        "Amplitude of the table at the first touch over frequency: of the post on the floor, and "
        "of one on the table (broken line)."
    )
    blocks = [text, comparison_table(compared), figure_block(name, caption)]
    return [Evidence("A post that stays", blocks, {name: _figure(model, compared)}, compared)]


def touching_amplitude(model: LumpedSystem, omega: float) -> float:
    """Amplitude of the table at the first touch of a post on the floor."""
    system = model.second_order()
    own, mass = system.own_frequency, float(system.mass[0])
    r, zeta = omega / own, float(system.damping[0, 0]) / (2.0 * mass * own)
    passed = math.hypot(1.0, 2.0 * zeta * r) / math.hypot(1.0 - r**2, 2.0 * zeta * r)
    return system.clearances[0].first.gap / passed


@styled
def _figure(model: LumpedSystem, compared: tuple[Comparison, ...]) -> Figure:
    figure = new_figure(6.4, 3.0)
    axes = figure.subplots()
    assert model.base is not None
    with_table = replace(model, base=replace(model.base, stops="base"))
    own = model.second_order().own_frequency
    omegas = own * np.geomspace(0.4, 2.4, 300)
    hertz = omegas / (2.0 * math.pi)
    stays = [MM * touching_amplitude(model, float(w)) for w in omegas]
    moves = [MM * grazing_amplitude(with_table, float(w), weight=False) for w in omegas]
    axes.semilogy(hertz, stays, lw=1.2, color=INK, label="on the floor")
    axes.semilogy(hertz, moves, lw=1.2, color=MUTED, ls=(0, (4, 3)), label="on the table")
    dots = [ratio * own / (2.0 * math.pi) for ratio in RATIOS]
    axes.plot(dots, [c.computed for c in compared], "o", ms=4.5, mfc="none", color=INK)
    plain_numbers(axes.yaxis)
    name_axes(axes, "frequency [Hz]", "amplitude of the table [mm]")
    axes.legend()
    return figure


EXAMPLE = Example(
    evidence,
    see="Far below its own frequency the mass moves with the table, so it meets the post where the "
    "table itself would, while a post on the table would hardly be met.",
    board="Spring and damper to the moving ground become one force of the generator, a sine ahead "
    "of the table's motion; displacements are absolute.",
)
