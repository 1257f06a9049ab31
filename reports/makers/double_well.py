"""Swings of a mass in two wells, with straight pieces in the place of the cubic spring.

Without damper and force x″ + k₁ x + k₃ x³ = 0 (mass 1, k₁ < 0) has its wells at ± √(-k₁/k₃) and
near one of them swings at √(-2k₁). A swing between x = a in one well and the turn on this side of
the middle is a dn(a √(k₃/2) t), with the parameter 2 - 2 (x₀/a)², x₀ the place of the well; one
through both wells is cn, with half the inverse of 1 - (x₀/a)². So their frequencies are

    within a well:   π a √(k₃/2)/K(2 - 2 (x₀/a)²),                 x₀ < a < √2 x₀
    over both:       π √(k₁ + k₃ a²)/(2 K(k₃ a²/(2 (k₁ + k₃ a²)))),     a > √2 x₀

K the complete elliptic integral of the first kind (G. Duffing, 1918; P. J. Holmes, Phil. Trans.
R. Soc. A 292, 419, 1979, has the driven one).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import brentq
from scipy.special import ellipk

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

ERRORS = (0.01, 0.001, 0.0004)
"""Of the pieces, over the largest force in their range: the file's, and smaller ones."""
WITHIN, OVER = 1.3, 1.6
"""Furthest places of the swings that are compared."""
LEFT = 1e-8
"""Of damper and force: all that a swing feels but the spring."""
ROOM = 0.2
"""Of a frequency, on either side of the closed form: where the free swing's is looked for."""
JOINT = "beam-ground"


def evidence(file: ModelFile) -> list[Evidence]:
    """The part of a report about the swings of the undriven beam."""
    assert isinstance(file.model, LumpedSystem)
    model = file.model
    compared = []
    for error in ERRORS:
        finer = with_error(model, error)
        compared += [
            Comparison(f"place of the well, error {error:g}", well(model), _rest(finer)),
            *(
                Comparison(
                    f"frequency from x = {a:g}, error {error:g}",
                    frequency(model, a),
                    _swing(finer, a),
                )
                for a in (WITHIN, OVER)
            ),
        ]
    text = (
        "Without damper and force the swings of the cubic spring have closed forms. A small one in "
        f"a well has the frequency √(-2k₁) = {small(model):.6g}; that of a larger one is an "
        f"elliptic integral. From x = {WITHIN:g} the beam stays in its well, from {OVER:g} it "
        "passes over both. The straight pieces come to the same as their error becomes smaller."
    )
    name = "swings"
    caption = (
        "Frequency of a free swing over its furthest place: closed form (grey), and with the "
        "pieces of the file (dots). Where the beam comes to rest in the middle, it is 0."
    )
    blocks = [text, comparison_table(compared, 6), figure_block(name, caption)]
    return [Evidence("Beside the cubic spring", blocks, {name: _figure(model)}, tuple(compared))]


def well(model: LumpedSystem) -> float:
    """Place of the upper well."""
    k1, k3 = _spring(model)
    return math.sqrt(-k1 / k3)


def small(model: LumpedSystem) -> float:
    """Frequency of a small swing in a well, of a mass of 1."""
    return math.sqrt(-2.0 * _spring(model)[0])


def frequency(model: LumpedSystem, a: float) -> float:
    """Of the free swing from rest at ``a``, past the well, of a mass of 1."""
    k1, k3 = _spring(model)
    share = (well(model) / a) ** 2
    if 2.0 * share > 1.0:
        return float(math.pi * a * math.sqrt(0.5 * k3) / ellipk(2.0 - 2.0 * share))
    square = k1 + k3 * a * a
    return float(0.5 * math.pi * math.sqrt(square) / ellipk(0.5 * k3 * a * a / square))


def with_error(model: LumpedSystem, error: float) -> LumpedSystem:
    """The model with other pieces of its cubic spring."""
    (spring,) = model.cubic_springs
    return replace(model, cubic_springs=(replace(spring, error=error),))


def _spring(model: LumpedSystem) -> tuple[float, float]:
    return model.parameter(f"{JOINT}.k1"), model.parameter(f"{JOINT}.k3")


def _rest(model: LumpedSystem) -> float:
    """Where the beam comes to rest in the upper well, with next to no force."""
    still = model.changed({"beam.amplitude": LEFT})
    orbit = settle(model_flow(still, 1.0), np.array([well(model), 0.0]))
    return float(orbit.start[0])


def _swing(model: LumpedSystem, a: float) -> float:
    """The frequency of a drive in whose period the beam, left alone, is back at ``a``."""
    alone = model.changed({f"{JOINT}.damping": LEFT, "beam.amplitude": LEFT})

    def speed(omega: float) -> float:
        return float(model_flow(alone, omega).run(np.array([a, 0.0]), 1).strobes[-1][1])

    middle = frequency(model, a)
    return float(brentq(speed, (1.0 - ROOM) * middle, (1.0 + ROOM) * middle, xtol=1e-12))


@styled
def _figure(model: LumpedSystem) -> Figure:
    figure = new_figure(7.2, 3.2)
    axes = figure.subplots()
    middle = math.sqrt(2.0) * well(model)
    for low, high in ((1.02 * well(model), 0.999 * middle), (1.001 * middle, 1.8)):
        places = np.linspace(low, high, 200)
        axes.plot(places, [frequency(model, float(a)) for a in places], color=MUTED, lw=2.4)
        few = np.linspace(low + 0.15 * (high - low), high - 0.15 * (high - low), 8)
        axes.plot(few, [_swing(model, float(a)) for a in few], "o", color=INK, ms=3.5)
    name_axes(axes, "furthest x", "frequency ω")
    return figure


EXAMPLE = Example(
    evidence,
    see="In each well the beam swings the slower the further it goes, until it passes the middle; "
    "beyond, it swings over both and becomes faster. Driven at frequencies between, it finds no "
    "period: chaos over both wells.",
    board="Five dead zones make the pieces. The generator leaves the beam in one well, and the "
    "tolerances decide how far from the chaos it stays.",
)
