"""A mass on a shaking table beside a post that stays.

A table that moves as Y sin ωt shakes the mass through its spring and damper: without contact the
mass moves by Y V, V = √((1 + (2ζr)²)/((1 - r²)² + (2ζr)²)), r = ω/ω₀. A post on the floor is first
touched where that meets its gap; one on the table, where the relative motion Y r²/√((1 - r²)² +
(2ζr)²) does.
"""

from __future__ import annotations

import math
from dataclasses import replace

from matplotlib.figure import Figure

from designer.model.lumped_system import LumpedSystem
from designer.model.model_file import ModelFile
from reports.makers.evidence import (
    Comparison,
    Evidence,
    Example,
    comparison_table,
    figure_block,
)
from reports.makers.first_grazing import located_grazing
from reports.makers.weight import BASE, MM, RATIOS, grazing_amplitude, touching_figure


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


def _figure(model: LumpedSystem, compared: tuple[Comparison, ...]) -> Figure:
    assert model.base is not None
    with_table = replace(model, base=replace(model.base, stops="base"))
    curves = {
        "on the floor": lambda omega: touching_amplitude(model, omega),
        "on the table": lambda omega: grazing_amplitude(with_table, omega, weight=False),
    }
    return touching_figure(model, compared, curves, "amplitude of the table [mm]")


EXAMPLE = Example(
    evidence,
    see="Far below its own frequency the mass moves with the table, so it meets the post where the "
    "table itself would, while a post on the table would hardly be met.",
    board="Spring and damper to the moving ground become one force of the generator, a sine ahead "
    "of the table's motion; displacements are absolute.",
)
