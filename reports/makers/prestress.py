"""A stop that pushes at once, beside one whose push rises over a depth, as a circuit makes it.

While nothing else touches, the mass m on the spring k and the damper c under A sin ωt moves as

    x = p + Q sin(ωt + φ) + exp(-δt) (a cos νt + b sin νt),    δ = c/(2m),  ν = √(κ/m - δ²)

with κ = k and p = 0 off the stop, κ = k + K and p = (K g - P)/κ on it (gap g, stiffness K, preload
P). An orbit with one contact a period comes to the stop at the drive's angle θ with the velocity v
and leaves it after the time τ. That it is then at the gap, and a period after θ at the gap with the
velocity v again, are three equations for θ, v and τ.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import brentq, fsolve

from designer.base.arrays import Array
from designer.base.figure_style import INK, MUTED, new_figure, styled
from designer.bifurcations.branch_survey import survey
from designer.dynamics.attractors import settle
from designer.model.driven import model_flow
from designer.model.lumped_system import LumpedSystem
from designer.model.model_file import ModelFile
from designer.model.swept_model import ModelSubject
from reports.makers.evidence import (
    Comparison,
    Evidence,
    Example,
    comparison_table,
    figure_block,
    name_axes,
)

OMEGA = 1.0
"""Where the orbits with one contact are compared."""
RISES = (1.0, 0.1, 0.01, 0.001)
"""Factors on the depth over which the push rises."""
ANGLES, BRIEF = 24, 0.3
"""Angles from which the orbit's equations are tried; a first guess of the contact's time."""
FIRST, LAST = 0.72, 0.8
"""Frequencies between which the motion below the stop comes to touch it."""
PART, STOP = "oscillator", "stop"


@dataclass(frozen=True)
class Contact:
    """One contact a period with a stop that pushes at once."""

    numbers: tuple[float, ...]
    """m, c, k, A, g, K and P."""
    omega: float
    angle: float
    """The drive's where the contact begins."""
    speed: float
    """There."""
    time: float
    """How long it lasts."""

    def on(self, t: Array) -> tuple[Array, Array]:
        """x and x′ a time t after the contact's begin, as far as it lasts."""
        _, _, k, _, g, K, P = self.numbers
        return self._moved(k + K, (K * g - P) / (k + K), self.angle, (g, self.speed), t)

    def off(self, t: Array) -> tuple[Array, Array]:
        """x and x′ a time t after the contact's end."""
        k, end = self.numbers[2], self.on(np.array([self.time]))
        begun = float(end[0][0]), float(end[1][0])
        return self._moved(k, 0.0, self.angle + self.omega * self.time, begun, t)

    def _moved(
        self, stiffness: float, rest: float, angle: float, begun: tuple[float, float], t: Array
    ) -> tuple[Array, Array]:
        m, c, _, force, *_ = self.numbers
        w, delta = self.omega, 0.5 * c / m
        nu = math.sqrt(stiffness / m - delta**2)
        driven = force * np.exp(1j * angle) / (stiffness - m * w**2 + 1j * c * w)
        a = begun[0] - rest - driven.imag
        b = (begun[1] - (1j * w * driven).imag + delta * a) / nu
        wave, fall = driven * np.exp(1j * w * t), (a - 1j * b) * np.exp((1j * nu - delta) * t)
        rate = (1j * w * wave).imag + ((1j * nu - delta) * fall).real
        return rest + wave.imag + fall.real, rate


def evidence(file: ModelFile) -> list[Evidence]:
    """The part of a report about the jump as the limit of a rise."""
    assert isinstance(file.model, LumpedSystem)
    model = file.model
    depth, orbit = model.parameter(f"{STOP}.preload_over"), at_once(model, OMEGA)
    largest = float(orbit.on(np.linspace(0.0, orbit.time, 20001))[0].max())
    compared = [Comparison("largest x, force at once", largest, _largest(_jumping(model)))]
    compared += [
        Comparison(
            f"largest x, force over {factor * depth:g}",
            largest,
            _largest(model.changed({f"{STOP}.preload_over": factor * depth})),
        )
        for factor in RISES
    ]
    compared.append(Comparison("ω at which 1-0-0 ends, force at once", touch(model), _end(model)))
    text = (
        f"At ω = {OMEGA:g} the orbit with one contact a period of a stop that pushes at once has a "
        "closed form, but for three roots. The circuit's stop pushes over a depth; as the depth "
        "falls, its orbit goes to that of the jump. Below, the mass moves without contact up to "
        "the frequency at which it fills the gap. At a jump its response ends there, since past it "
        "no orbit of its period is found."
    )
    name = "prestress"
    caption = (
        f"Orbit at ω = {OMEGA:g}: of the stop that pushes at once, closed form (grey), and of the "
        "file's (dots)."
    )
    blocks = [text, comparison_table(compared), figure_block(name, caption)]
    figures = {name: _figure(model, orbit)}
    return [Evidence("Beside a stop that pushes at once", blocks, figures, tuple(compared))]


def at_once(model: LumpedSystem, omega: float) -> Contact:
    """The orbit with one contact a period of the stop without a rise.

    Raises
    ------
    ArithmeticError : none is found.
    """
    names = [f"{PART}.mass", f"{PART}-ground.damping", f"{PART}-ground.stiffness"]
    names += [f"{PART}.amplitude", f"{STOP}.upper", f"{STOP}.stiffness", f"{STOP}.preload"]
    numbers = tuple(model.parameter(name) for name in names)
    gap, period = numbers[4], 2.0 * math.pi / omega

    def off(unknown: Array) -> Array:
        orbit = Contact(numbers, omega, *unknown)
        (left,), _ = orbit.on(np.array([orbit.time]))
        (back,), (speed,) = orbit.off(np.array([period - orbit.time]))
        return np.array([left - gap, back - gap, speed - orbit.speed])

    for angle in np.linspace(0.0, 2.0 * math.pi, ANGLES, endpoint=False):
        found, _, solved, _ = fsolve(off, [angle, 1.0, BRIEF], full_output=True, xtol=1e-13)
        orbit = Contact(numbers, omega, *found)
        if solved != 1 or not (0.0 < orbit.time < 0.5 * period and orbit.speed > 0.0):
            continue
        free = orbit.off(np.linspace(0.0, period - orbit.time, 4001)[1:-1])[0]
        if free.max() < gap < orbit.on(np.array([0.5 * orbit.time]))[0][0]:
            return orbit
    raise ArithmeticError("no orbit with one contact a period")


def touch(model: LumpedSystem) -> float:
    """Frequency at which the motion without contact has the gap for its amplitude, from below."""
    stiffness, damping = (model.parameter(f"{PART}-ground.{n}") for n in ("stiffness", "damping"))
    mass, force = model.parameter(f"{PART}.mass"), model.parameter(f"{PART}.amplitude")

    def past(omega: float) -> float:
        reach = force / math.hypot(stiffness - mass * omega**2, damping * omega)
        return reach - model.parameter(f"{STOP}.upper")

    return float(brentq(past, FIRST, LAST, xtol=1e-14))


def _jumping(model: LumpedSystem) -> LumpedSystem:
    return replace(model, gaps=(replace(model.gaps[0], preload_over=None),))


def _largest(model: LumpedSystem) -> float:
    return float(settle(model_flow(model, OMEGA), np.zeros(2)).extremes[0, 1])


def _end(model: LumpedSystem) -> float:
    family = ModelSubject(_jumping(model), FIRST).family("omega")
    orbit = settle(family.flow(FIRST), np.zeros(2))
    (point,) = survey(family, [(FIRST, orbit)], FIRST, LAST, depth=0).points
    return point.value


@styled
def _figure(model: LumpedSystem, orbit: Contact) -> Figure:
    figure = new_figure(4.6, 3.4)
    axes = figure.subplots()
    rest = 2.0 * math.pi / OMEGA - orbit.time
    both = orbit.on(np.linspace(0.0, orbit.time, 400)), orbit.off(np.linspace(0.0, rest, 1600))
    axes.plot(*np.concatenate(both, axis=1), color=MUTED, lw=2.4)
    flow = model_flow(model, OMEGA)
    run = flow.run(settle(flow, np.zeros(2)).start, 1, points=96)
    axes.plot(*run.strobes.T, ".", color=INK, ms=3.0)
    name_axes(axes, "x", "x′")
    return figure


EXAMPLE = Example(
    evidence,
    see="A stop that pushes at once changes the trace of the map's Jacobian by an inverse square "
    "root at the first touch, as the report on preloaded.toml derives. So the response without "
    "contact ends there.",
    board="Two dead zones make the stop: one from the gap on, as steep as the rise, and one that "
    "takes the rise away again past its depth. The steeper, the nearer to the jump, and the more "
    "the second one's threshold counts.",
)
