"""Where the response of the open system grows so large that a stop is touched.

Below the first touch the system is linear, so that amplitude has a closed form. With K, C and M
the matrices of the open system, f the amplitudes of its forces and c the constant ones,

    Z = (K - ω² M + iωC)⁻¹ f,      z₀ = K⁻¹ c

the displacement in a clearance with row r is r·z₀ ± |r·Z|. Gaps and constant forces b times as
large meet it where |r·Z| = b (gap - r·z₀) at the upper stop, b (gap + r·z₀) at the lower.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.bifurcations.branch_survey import survey
from designer.bifurcations.points import Bifurcation, PointKind
from designer.dynamics.attractors import settle
from designer.dynamics.orbit import Complex, Orbit
from designer.model.clearance import Clearance
from designer.model.driven import model_flow
from designer.model.mechanics import MechanicalModel, SecondOrderSystem
from designer.model.swept_model import of_model


@dataclass(frozen=True)
class FirstGrazing:
    """The first touch of a stop by the linear response."""

    clearance: str
    """Name of the clearance."""
    side: int
    """1 for the upper stop, -1 for the lower."""
    b: float
    """Factor on gaps and constant forces at which it happens: below it the stop is hit."""


def first_grazings(model: MechanicalModel, omega: float) -> tuple[FirstGrazing, ...]:
    """Of every stop, the first one to be hit (greatest b) first; () where one is in contact at
    rest, since the response is then not that of the open system."""
    system = model.second_order()
    wave, rest = _linear_response(system, omega)
    out = []
    for clearance in system.clearances:
        swing = abs(_in_clearance(system, clearance, wave, system.ground(omega)))
        middle = float(np.real(_in_clearance(system, clearance, rest.astype(complex))))
        for side, stop in clearance.sides:
            room = stop.gap - side * middle
            if room <= 0.0:
                return ()
            out.append(FirstGrazing(clearance.name, side, model.b * swing / room))
    return tuple(sorted(out, key=lambda grazing: -grazing.b))


def linear_state(model: MechanicalModel, omega: float) -> Array:
    """(2n,) state at drive phase 0 of the response of the open system, x1, x1', x2, x2', …"""
    system = model.second_order()
    wave, rest = _linear_response(system, omega)
    state = np.zeros(2 * system.size)
    state[0::2] = wave.imag + rest  # z = Im(Z exp(iωt)) + z₀
    state[1::2] = omega * wave.real
    return state


def linear_orbit(model: MechanicalModel, omega: float) -> Orbit:
    """The same as an orbit of the model, which holds while no stop is touched."""
    return settle(model_flow(model, omega), linear_state(model, omega))


def located_grazing(model: MechanicalModel, omega: float, parameter: str, value: float) -> float:
    """The first touch as the tool locates it: a grazing point on the branch of the open system's
    orbits over a parameter.

    value : of the parameter, where it is about; orbits are followed from 5 % aside.

    Raises
    ------
    ArithmeticError : no grazing point lies there.
    """
    return grazing_point(model, omega, parameter, value).value


def grazing_point(
    model: MechanicalModel, omega: float, parameter: str, value: float
) -> Bifurcation:
    """The grazing point of ``located_grazing``."""
    low, high = sorted((0.95 * value, 1.02 * value))
    if parameter == "b":
        low, high = 0.98 * value, 1.05 * value
    begin = high if parameter == "b" else low
    orbit = linear_orbit(model.changed({parameter: begin}), omega)
    branches = survey(of_model(model, omega, parameter), [(begin, orbit)], low, high, depth=0)
    grazing = [p for p in branches.points if p.kind is PointKind.GRAZING]
    if not grazing:
        raise ArithmeticError(f"no grazing point near {parameter} = {value:g}")
    return min(grazing, key=lambda p: abs(p.value - value))


def _linear_response(system: SecondOrderSystem, omega: float) -> tuple[Complex, Array]:
    """Z and z₀ of the module's text."""
    dynamic = (
        system.stiffness
        - omega**2 * np.diag(system.mass)
        + 1j * omega * system.damping.astype(complex)
    )
    first = system.drive_waves(omega)[0]
    wave = np.linalg.solve(dynamic, first.sine + 1j * first.cosine)
    rest = np.linalg.solve(system.stiffness, system.constant)
    return np.asarray(wave, dtype=complex), np.asarray(rest, dtype=float)


def _in_clearance(
    system: SecondOrderSystem, clearance: Clearance, wave: Complex, ground: float = 0.0
) -> complex:
    """The displacement in a clearance. ground : its displacement, which stops that stay see beside
    displacements from it."""
    out = complex(system.displacement(clearance) @ wave)
    if system.fixed_stops and system.ground_moves and clearance.other is None:
        out += ground
    return out
