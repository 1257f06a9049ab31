"""Whether period 1 lives on through grazing, as the drive of a soft impact oscillator grows.

Kundu, Banerjee, Ing, Pavlovskaia and Wiercigroch, "Singularities in soft-impacting systems",
Physica D 241 (2012) 553: beyond grazing the trace of the map's Jacobian has a singular term with
the factor exp(-ζT) sin(ω_d T)/ω_d, which vanishes where m = 2 ω₀/ω is a whole number. There the
orbit of period 1 goes on with an impact; in between it is lost at once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from designer.base.arrays import Array
from designer.base.figure_style import GRID, INK, MUTED, new_figure, plain_numbers, styled
from designer.base.page import table
from designer.dynamics.attractors import settle
from designer.model.driven import model_flow
from designer.model.mechanics import MechanicalModel
from designer.model.model_file import ModelFile
from reports.makers.evidence import (
    Comparison,
    Evidence,
    Example,
    comparison_table,
    figure_block,
)
from reports.makers.first_grazing import linear_state, located_grazing

RATIOS = (2.5, 3.0, 3.5, 4.0, 4.5, 5.0)
"""m = 2 ω₀/ω that are looked at."""
CLOSED_FORM = (0.7, 0.8, 0.9, 1.1, 1.4)
"""Frequencies over the natural one at which the grazing amplitude is compared, beside those."""
BASE = "base.amplitude"
BEYOND = np.geomspace(1e-4, 0.3, 60)
"""(a - a_g)/a_g at which the attractor is looked at."""
SHOWN = 40
"""Periods shown at each."""


@dataclass(frozen=True)
class Passage:
    """What the drive of one frequency leads to beyond grazing."""

    m: float
    """Twice the natural frequency over the drive's."""
    omega: float
    """The drive frequency."""
    grazing: float
    """The amplitude at grazing."""
    responses: tuple[str, ...]
    """What is reached at each of ``BEYOND``, each from the one before."""
    strobes: Array
    """(BEYOND, SHOWN) displacement at the strobe over the amplitude's share of grazing."""

    @property
    def persists(self) -> float:
        """Up to which of ``BEYOND`` every response has period 1; 0 where the first has not."""
        end = 0.0
        for excess, response in zip(BEYOND, self.responses, strict=True):
            if not response.startswith("1-"):
                break
            end = float(excess)
        return end


def evidence(file: ModelFile) -> list[Evidence]:
    """The parts of a report about the grazing amplitude and about what follows it."""
    model = file.model
    own = model.second_order().own_frequency
    omegas = sorted({own * r for r in CLOSED_FORM} | {2.0 * own / m for m in RATIOS})
    compared = tuple(_compared(model, omega) for omega in omegas)
    text = (
        "The open oscillator's amplitude reaches the gap e at the base amplitude "
        "a = e √((1 − ω²)² + (2ζω)²)/ω². The tool follows the orbits of period 1 over the base "
        "amplitude and locates the grazing point."
    )
    first = Evidence(
        "Where the stop is first touched", [text, comparison_table(compared)], {}, compared
    )
    passages = [passage(model, m) for m in RATIOS]
    return [first, _passages(passages)]


def grazing_amplitude(model: MechanicalModel, omega: float) -> float:
    """Base amplitude at which one mass on one spring first touches its only stop."""
    system = model.second_order()
    own, mass = system.own_frequency, float(system.mass[0])
    ratio, zeta = omega / own, float(system.damping[0, 0]) / (2.0 * mass * own)
    gap = system.clearances[0].first.gap
    return gap * math.hypot(1.0 - ratio**2, 2.0 * zeta * ratio) / ratio**2


def passage(model: MechanicalModel, m: float) -> Passage:
    """The attractor followed from the grazing orbit on, as the base amplitude grows."""
    omega = 2.0 * model.second_order().own_frequency / m
    grazing = grazing_amplitude(model, omega)
    x = linear_state(model.changed({BASE: grazing}), omega)
    responses, strobes = [], []
    for excess in BEYOND:
        flow = model_flow(model.changed({BASE: grazing * (1.0 + excess)}), omega)
        orbit = settle(flow, x)
        x = orbit.start if len(orbit.start) else x
        responses.append(orbit.response)
        strobes.append(flow.run(x, SHOWN).strobes[1:, 0])
    return Passage(m, omega, grazing, tuple(responses), np.array(strobes))


def _compared(model: MechanicalModel, omega: float) -> Comparison:
    expected = grazing_amplitude(model, omega)
    computed = located_grazing(model, omega, BASE, expected)
    return Comparison(f"grazing amplitude at ω = {omega:.4g}", expected, computed)


def _passages(passages: Sequence[Passage]) -> Evidence:
    text = (
        "Above the grazing amplitude the attractor is followed from the grazing orbit, each time "
        "from where the last one ended. Kundu and others (2012) report that period 1 lives on "
        "where m = 2ω₀/ω is a whole number, and not in between. The table says what comes right "
        "after grazing, and how far beyond it every response has period 1."
    )
    rows = [
        (f"{p.m:g}", f"{p.omega:.4g}", f"{p.grazing:.4g}", p.responses[0], _until(p))
        for p in passages
    ]
    head = ("m", "ω", "grazing amplitude a", f"at a (1 + {BEYOND[0]:.0e})", "period 1 up to")
    name = "through-grazing"
    caption = (
        "Displacement at the strobe over the base amplitude, from grazing on; above: m = 2ω₀/ω."
    )
    return Evidence(
        "Period 1 through grazing",
        [text, table(head, rows, numeric=(0, 1, 2)), figure_block(name, caption)],
        {name: _figure(passages)},
    )


def _until(passage: Passage) -> str:
    if not passage.persists:
        return "lost at grazing"
    if passage.persists == BEYOND[-1]:
        return f"a (1 + {BEYOND[-1]:g}), the last looked at"
    return f"a (1 + {passage.persists:.2g})"


@styled
def _figure(passages: Sequence[Passage]) -> Figure:
    figure = new_figure(9.0, 5.0)
    grid = figure.subplots(2, -(-len(passages) // 2), sharex=True, squeeze=False)
    for axes, each in zip(grid.T.ravel(), passages, strict=False):
        whole = float(each.m).is_integer()
        across = np.repeat(BEYOND, SHOWN)
        axes.semilogx(across, each.strobes.ravel(), ".", ms=3.2, mew=0, color=INK, rasterized=True)
        axes.set_title(f"m = {each.m:g}" + (" (whole)" if whole else ""), color=INK)
        axes.grid(True, color=GRID, lw=0.5)
    plain_numbers(grid[0, 0].xaxis)
    for axes in grid[-1]:
        axes.set_xlabel("base amplitude over grazing, less 1", color=MUTED)
    for axes in grid[:, 0]:
        axes.set_ylabel("x at the strobe")
    return figure


EXAMPLE = Example(
    evidence,
    see="Turn the base amplitude up until the mass just touches the stop. At most frequencies the "
    "period-1 motion is lost at once, and a wide band of strobe points appears. Where twice "
    "the natural frequency is a whole multiple of the drive's, the same motion goes on with a "
    "soft impact, and nothing is seen to happen.",
    board="The stop stands on the base, so what the circuit computes is the motion relative to the "
    "base. A base that moves as a sin ωt is a force of ω² a on that motion: the generator "
    "makes it, and its amplitude is set anew for each frequency. A stop that stands still "
    "while the base moves would need the base's motion as a voltage of its own, and is "
    "refused.",
)
