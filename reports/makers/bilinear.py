"""Resonances of a mass that meets a second spring at its rest position.

With no gap the free oscillator spends half a period π/ω₁ off the stop and half a period π/ω₂ on it,
so it swings at ω_b = 2 ω₁ ω₂/(ω₁ + ω₂) at any amplitude (S. W. Shaw and P. J. Holmes, J. Sound Vib.
90, 129, 1983). A weakly damped one answers a drive near n ω_b with one impact in n periods.
"""

from __future__ import annotations

import math

import numpy as np
from matplotlib.figure import Figure

from designer.base.arrays import Array
from designer.base.figure_style import INK, MUTED, new_figure, plain_numbers, styled
from designer.base.page import table
from designer.dynamics.attractors import settle
from designer.dynamics.orbit import OrbitStatus
from designer.model.driven import model_flow
from designer.model.lumped_system import LumpedSystem
from designer.model.mechanics import MechanicalModel
from designer.model.model_file import ModelFile
from reports.makers.evidence import (
    Comparison,
    Evidence,
    Example,
    comparison_table,
    figure_block,
    name_axes,
)

ORDERS = (1, 2, 3, 4)
"""Periods n of the resonances that are looked for."""
ACROSS = 0.3
"""Of ω_b, on either side of n ω_b."""
STEPS = 121


def evidence(file: ModelFile) -> list[Evidence]:
    """The part of a report about subharmonic resonances at the gap 0."""
    assert isinstance(file.model, LumpedSystem)
    model = file.model.changed({f"{file.model.gaps[0].name}.upper": 0.0})
    bilinear = bilinear_frequency(model)
    rows, compared, curves = [], [], []
    for n in ORDERS:
        omegas = bilinear * (n + ACROSS * np.linspace(-1.0, 1.0, STEPS))
        heights, responses = _resonance(model, omegas, n)
        best = int(np.argmax(heights))
        compared.append(
            Comparison(f"frequency of the largest {n}-1-0", n * bilinear, float(omegas[best]))
        )
        rows.append((f"{n}", responses[best], f"{heights[best]:.4g}"))
        curves.append((n, omegas / bilinear, heights))
    text = (
        "At the gap 0 the stop divides each free period into half a swing at ω₁ and half a swing "
        f"at ω₂, so that ω_b = 2ω₁ω₂/(ω₁ + ω₂) = {bilinear:.6g}. Each resonance is followed from "
        "n ω_b, both ways, on a grid of frequencies: damping shifts its largest amplitude."
    )
    name = "subharmonics"
    caption = "Largest displacement of the orbits with one impact in n periods, over ω/ω_b."
    blocks = [
        text,
        comparison_table(compared, 6),
        table(("n", "response at the largest", "largest displacement"), rows, numeric=(0, 2)),
        figure_block(name, caption),
    ]
    return [Evidence("Subharmonic resonances", blocks, {name: _figure(curves)}, tuple(compared))]


def bilinear_frequency(model: MechanicalModel) -> float:
    """2 ω₁ ω₂/(ω₁ + ω₂) of one mass with one stop."""
    system = model.second_order()
    (off,), (on,) = system.natural_frequencies(), system.natural_frequencies(closed=True)
    return float(2.0 * off * on / (off + on))


def _resonance(model: MechanicalModel, omegas: Array, n: int) -> tuple[Array, list[str]]:
    """Largest displacement of n-1-0 at each frequency, followed from the middle; nan where it is
    not stable."""
    heights, responses = np.full(len(omegas), math.nan), [""] * len(omegas)
    middle = len(omegas) // 2
    for indices in (range(middle, len(omegas)), range(middle, -1, -1)):
        x = np.zeros(2)
        for i in indices:
            orbit = settle(model_flow(model, float(omegas[i])), x)
            wanted = orbit.status is OrbitStatus.PERIODIC and orbit.response == f"{n}-1-0"
            if not wanted:
                break
            x = orbit.start
            heights[i], responses[i] = float(orbit.extremes[0, 1]), orbit.response
    return np.where(np.isnan(heights), -math.inf, heights), responses


@styled
def _figure(curves: list[tuple[int, Array, Array]]) -> Figure:
    figure = new_figure(7.2, 3.2)
    axes = figure.subplots()
    for n, omegas, heights in curves:
        axes.plot(omegas, np.where(np.isfinite(heights), heights, np.nan), color=INK, lw=1.3)
        axes.axvline(n, color=MUTED, lw=0.7, ls=(0, (4, 3)))
        axes.annotate(f"{n}-1-0", (n, 1.0), xycoords=("data", "axes fraction"), ha="center")
    axes.set_yscale("log")
    plain_numbers(axes.yaxis)
    name_axes(axes, "ω/ω_b", "largest x")
    return figure


EXAMPLE = Example(
    evidence,
    see="The mass meets its second spring on one side only, so half of each swing is fast and "
    "half is slow. It answers a drive at twice its own frequency with one impact in two drive "
    "periods: the subharmonic resonance. In its place the small motion without impacts "
    "exists too; which of them is met depends on the start.",
    board="Both responses are on the board. The stage with diodes makes the stop. One of clipping "
    "amplifiers leaves a stiffness inside the clearance where its resistors are off their values, "
    "and a light oscillator feels it.",
)
