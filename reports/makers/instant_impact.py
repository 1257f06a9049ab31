"""A mass that bounces on its stop, beside one whose impacts take no time.

One contact with a stop of stiffness k, damping c and mass m, and nothing else, is half a period of
a damped motion: it leaves exp(-π ζ/√(1 - ζ²)) of the speed, ζ = c/(2√(k m)).

An impact that takes no time leaves e of the speed. With one of them a period T = 2π/ω the motion

    x = Q sin(ωt + φ) + exp(-δt) (a cos νt + b sin νt),    0 < t < T

begins and ends at the stop, x(0) = x(T) = -g, and x′(0) = -e x′(T) (S. W. Shaw and P. J. Holmes,
J. Sound Vib. 90, 129, 1983, have it for the linear oscillator). The first two give
b = a (exp(δT) - cos νT)/sin νT and Q sin φ = -g - a. With h the part that is not driven, over a,
the third gives (1 + e) ω Q cos φ = -a (h′(0) + e h′(T)). So a obeys one quadratic equation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

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

KEPT = (0.3, 0.5, 0.7, 0.9)
"""Restitutions of the contacts with the stop alone."""
LEFT_OUT = 1e-9
"""Of spring, damper and force, for a contact with the stop alone."""
STIFFER = (1.0, 10.0, 100.0, 1000.0)
"""Factors on the stop's stiffness, at the same restitution."""
HERTZ = 26.0
MM, MS = 1e3, 1e3
POINTS = 8192
"""Of a period."""
PART = "plunger"
STOP = "seat"


@dataclass(frozen=True)
class Bounce:
    """The motion with one impact a period that takes no time, from the impact on."""

    omega: float
    driven: tuple[float, float]
    """Q and φ."""
    decay: tuple[float, float]
    """δ and ν."""
    free: tuple[float, float]
    """a and b."""

    def at(self, t: float) -> tuple[float, float]:
        """x and x′."""
        (Q, phase), (delta, nu), (a, b) = self.driven, self.decay, self.free
        E, c, s = math.exp(-delta * t), math.cos(nu * t), math.sin(nu * t)
        angle = self.omega * t + phase
        x = Q * math.sin(angle) + E * (a * c + b * s)
        rate = E * ((nu * b - delta * a) * c - (nu * a + delta * b) * s)
        return x, self.omega * Q * math.cos(angle) + rate


def evidence(file: ModelFile) -> list[Evidence]:
    """The part of a report about the restitution and the limit of a stiff stop."""
    assert isinstance(file.model, LumpedSystem)
    model, omega = file.model, 2.0 * math.pi * HERTZ
    contacts = tuple(
        Comparison(f"speed that one contact leaves, restitution = {e:g}", e, contact(model, e))
        for e in KEPT
    )
    bounce = instant(model, omega)
    speed = -MM * bounce.at(2.0 * math.pi / omega)[1]
    limit = tuple(
        Comparison(
            f"speed at the seat in mm/s, stiffness × {factor:g}",
            speed,
            _speed(model, factor, omega),
        )
        for factor in STIFFER
    )
    text = (
        "The plunger meets its seat alone, without spring, damper and force: what is left of its "
        f"speed is the restitution that the file states. Then it is driven at {HERTZ:g} Hz. As the "
        "seat becomes stiffer at the same restitution, its contacts become shorter, and the motion "
        "goes to that with impacts that take no time."
    )
    name = "instant-impact"
    caption = (
        "Displacement over a period from the impact on: with impacts that take no time, with the "
        "seat of the file, and with one 100 times as stiff."
    )
    blocks = [
        text,
        comparison_table(contacts, 6),
        comparison_table(limit, 6),
        figure_block(name, caption),
    ]
    figure = _figure(model, bounce, omega)
    return [Evidence("Beside instant impacts", blocks, {name: figure}, contacts + limit)]


def contact(model: LumpedSystem, restitution: float) -> float:
    """What is left of the speed after one contact with the stop, where there is nothing else."""
    joint = f"{PART}-ground"
    less = (f"{joint}.stiffness", f"{joint}.damping", f"{PART}.amplitude")
    alone = model.changed(
        {name: LEFT_OUT * model.parameter(name) for name in less}
        | {f"{STOP}.restitution": restitution}
    )
    gap = model.parameter(f"{STOP}.lower")
    run = model_flow(alone, 2.0 * math.pi * HERTZ).run(np.array([-gap, -1.0]), 1)
    return float(run.strobes[-1][1])


def instant(model: LumpedSystem, omega: float) -> Bounce:
    """The motion with one impact a period that takes no time: of the two that the quadratic
    equation gives that which comes down to the stop."""
    system, gap = model.second_order(), model.parameter(f"{STOP}.lower")
    mass, damping = float(system.mass[0]), float(system.damping[0, 0])
    stiffness, force = float(system.stiffness[0, 0]), float(system.force[0])
    e, T = model.parameter(f"{STOP}.restitution"), 2.0 * math.pi / omega
    delta = damping / (2.0 * mass)
    nu = math.sqrt(stiffness / mass - delta * delta)
    Q = force / math.hypot(stiffness - mass * omega**2, damping * omega)
    E, c, s = math.exp(-delta * T), math.cos(nu * T), math.sin(nu * T)
    ratio = (1.0 / E - c) / s
    first = nu * ratio - delta
    last = E * (first * c - (nu + delta * ratio) * s)
    turned = -(first + e * last) / ((1.0 + e) * omega)
    bounces = []
    for a in np.roots([1.0 + turned**2, 2.0 * gap, gap * gap - Q * Q]).real.tolist():
        phase = math.atan2(-gap - a, turned * a)
        bounces.append(Bounce(omega, (Q, phase), (delta, nu), (a, ratio * a)))
    return min(bounces, key=lambda bounce: bounce.at(T)[1])


def _speed(model: LumpedSystem, factor: float, omega: float) -> float:
    """Of the plunger where it meets the seat, in mm/s."""
    x, rate, i = _after_impact(_stiffer(model, factor), omega)
    step, short = 2.0 * math.pi / omega / POINTS, x[i] + model.parameter(f"{STOP}.lower")
    before = (rate[i] - rate[i - 1]) / step
    return -MM * float(rate[i] - before * short / rate[i])


def _after_impact(model: LumpedSystem, omega: float) -> tuple[Array, Array, int]:
    """(2 · POINTS + 1,) displacements and velocities over two periods of the motion with one
    impact, and the number of the last that is before an impact, of the first period."""
    bounce, system = instant(model, omega), model.second_order()
    stiffness = float(system.stiffness[0, 0] - system.mass[0] * omega**2)
    lag = math.atan2(float(system.damping[0, 0]) * omega, stiffness)
    start = bounce.at((-(bounce.driven[1] + lag) % (2.0 * math.pi)) / omega)
    flow = model_flow(model, omega)
    orbit = settle(flow, np.array(start))
    if orbit.response != "1-0-1":
        raise ArithmeticError(f"{orbit.response} in the place of 1-0-1")
    x, rate = flow.run(orbit.start, 2, points=POINTS).strobes.T
    gap = model.parameter(f"{STOP}.lower")
    down = np.flatnonzero((x[:-1] > -gap) & (x[1:] <= -gap))
    return x, rate, int(next(i for i in down if i))


def _stiffer(model: LumpedSystem, factor: float) -> LumpedSystem:
    name = f"{STOP}.stiffness"
    return model.changed({name: factor * model.parameter(name)})


@styled
def _figure(model: LumpedSystem, bounce: Bounce, omega: float) -> Figure:
    figure = new_figure(7.2, 3.2)
    axes = figure.subplots()
    times = 2.0 * math.pi / omega * np.arange(POINTS + 1) / POINTS
    instants = [MM * bounce.at(float(t))[0] for t in times]
    axes.plot(MS * times, instants, color=MUTED, lw=2.6, label="impacts that take no time")
    for factor, dashes, label in (
        (1.0, "-", "the seat of the file"),
        (100.0, (0, (4, 3)), "100 times as stiff"),
    ):
        x, _, i = _after_impact(_stiffer(model, factor), omega)
        y = MM * x[i : i + POINTS + 1]
        axes.plot(MS * times, y, color=INK, lw=1.1, ls=dashes, label=label)
    axes.legend()
    name_axes(axes, "time from the impact on [ms]", "displacement [mm]")
    return figure


EXAMPLE = Example(
    evidence,
    see="A stop that takes energy from each contact: the damper beside its spring is the one that "
    "leaves the stated share of the speed. With the drive above the plunger's own frequency it "
    "bounces once a period, below it twice.",
    board="A capacitor beside the resistor of the stop's stiffness makes its damper: the output of "
    "the dead zone changes with the velocity in contact, and not outside it.",
)
