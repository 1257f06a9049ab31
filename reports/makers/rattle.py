"""Where two masses with a gap between them do not rattle.

Where springs and dampers to ground are in the ratio of the masses, a force shared in that ratio
moves both masses alike, at every frequency: the gap between them does not change, and no stop is
touched however small it is. Away from that share the relative motion grows in proportion.
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from designer.base.arrays import Array
from designer.base.figure_style import INK, MUTED, new_figure, styled
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
from reports.makers.first_grazing import first_grazings, located_grazing

SHARES = (0.0, 0.2, 0.4, 0.55, 0.6, 0.7, 0.75, 0.9, 1.0)
"""Of the force on the second mass, at which the first touch is located."""


def evidence(file: ModelFile) -> list[Evidence]:
    """The part of a report about the force's share, at the file's first response."""
    assert isinstance(file.model, LumpedSystem)
    omega = file.responses[0].omega
    assert omega is not None
    model, quiet = file.model, quiet_share(file.model)
    compared = tuple(_compared(model, omega, share) for share in SHARES)
    text = (
        f"The second mass is {quiet:.4g} of both, and so are its spring and its damper to ground. "
        f"With that share of the force on it the masses move alike: they never touch. At ω = "
        f"{omega:g} the gap at which they first touch is proportional to the distance from it."
    )
    name = "force-share"
    blocks = [
        text,
        comparison_table(compared),
        figure_block(name, "Gap of the first touch over the force's share on the second mass."),
    ]
    figure = _figure(model, omega, compared)
    return [Evidence("Where nothing rattles", blocks, {name: figure}, compared)]


def quiet_share(model: LumpedSystem) -> float:
    """The second mass over both."""
    first, second = (mass.mass for mass in model.masses)
    return second / (first + second)


def _shared(model: LumpedSystem, share: float) -> LumpedSystem:
    """The same force in all, so much of it on the second mass."""
    names = [f"{name}.amplitude" for name in model.names]
    force = sum(model.parameter(name) for name in names)
    first, second = names
    return model.changed({first: (1.0 - share) * force, second: share * force})


def _gap(model: LumpedSystem, omega: float, share: float) -> float:
    """Of the first touch."""
    shared = _shared(model, share)
    return first_grazings(shared, omega)[0].b * shared.second_order().clearances[0].first.gap


def _compared(model: LumpedSystem, omega: float, share: float) -> Comparison:
    """By the one straight line through the quiet share and the force on the first mass alone."""
    quiet, shared = quiet_share(model), _shared(model, share)
    expected = _gap(model, omega, 0.0) * abs(quiet - share) / quiet
    gap = shared.second_order().clearances[0].first.gap
    b = located_grazing(shared, omega, "b", expected / gap)
    return Comparison(f"gap of the first touch, share {share:g}", expected, b * gap)


@styled
def _figure(model: LumpedSystem, omega: float, compared: tuple[Comparison, ...]) -> Figure:
    figure = new_figure(6.4, 3.0)
    axes = figure.subplots()
    shares: Array = np.array([0.0, quiet_share(model), 1.0])
    axes.plot(shares, [_gap(model, omega, float(s)) for s in shares], color=MUTED, lw=1.2)
    axes.plot(SHARES, [c.computed for c in compared], "o", ms=4.5, mfc="none", color=INK)
    name_axes(axes, "share of the force on the second mass", "gap of the first touch")
    return figure


EXAMPLE = Example(
    evidence,
    see="What matters is the motion of one mass relative to the other. If the force is shared as "
    "the masses are, both move alike and the gap could be as small as one likes: nothing "
    "rattles. The farther the share is from that, the larger the gap that is still closed.",
    board="A difference stage makes the relative displacement, one dead-zone stage makes the "
    "force, and an inverter lets it act on the other mass with the opposite sign.",
)
