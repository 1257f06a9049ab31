"""Classical Runge-Kutta with equal steps, blind to the stops, for any mechanical system.

``fidelity.runge_kutta`` has the same for the paper's two masses, in numbers instead of arrays.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from designer.base.arrays import Array
from designer.base.jit import callee, compiled
from designer.model.mechanics import HarmonicForce, MechanicalModel, SecondOrderSystem

Float = NDArray[np.float64]


class SystemRates(NamedTuple):
    """The numbers of y' = A y + B sin ωt + Σ (S sin nωt + C cos nωt) + d - Σ springs, y = x1, x1',
    x2, …, for s springs and w multiples n of the drive's frequency."""

    A: Float
    """(2n, 2n) of the open system."""
    B: Float
    """(2n,) of the drive's sine."""
    S: Float
    """(w, 2n) of further sines."""
    C: Float
    """(w, 2n) of the cosines."""
    order: NDArray[np.int64]
    """(w,) the multiples; none where the drive is a sine."""
    d: Float
    """(2n,) of the constant forces."""
    row: Float
    """(s, 2n + 1) depth in a spring over y and the drive, but for its place."""
    place: Float
    """(s,) depth at which it is met."""
    push: Float
    """(s, 2n) change of y' for a unit of depth."""
    drag: Float
    """(s, 2n, 2n) change of y' for a unit of y while it is met: the damping of its stop."""


def rates_of(system: SecondOrderSystem, omega: float) -> SystemRates:
    """The numbers of a system at a drive frequency."""
    size = 2 * system.size
    B, d = np.zeros(size), np.zeros(size)
    first, *further = system.drive_waves(omega)
    B[1::2] = system.over_mass(first.sine)
    d[1::2] = system.over_mass(system.constant)
    turned = HarmonicForce(1, np.zeros(system.size), first.cosine)
    waves = [] if system.driven_by_sine else [turned, *further]
    S, C = np.zeros((len(waves), size)), np.zeros((len(waves), size))
    for k, wave in enumerate(waves):
        S[k, 1::2], C[k, 1::2] = system.over_mass(wave.sine), system.over_mass(wave.cosine)
    rows, places, pushes, drags = [], [], [], []
    for stop in system.clearances:
        along = system.displacement(stop)
        force = np.zeros(size)
        force[1::2] = system.over_mass(system.push(stop))
        follows = system.fixed_stops and system.ground_moves and stop.other is None
        moves = system.ground(omega) if follows else 0.0
        moves *= float(along.sum())
        rate = np.zeros(size)
        rate[1::2] = along
        for side, spring in stop.sides:
            for number, (place, stiffness) in enumerate(spring.springs):
                row = np.zeros(size + 1)
                row[0:size:2], row[size] = side * along, side * moves
                rows.append(row)
                places.append(place)
                pushes.append(side * stiffness * force)
                drags.append((0.0 if number else stop.damping) * np.outer(force, rate))
    for law in system.laws:
        along, force, watched = np.array(law.row), np.zeros(size), np.zeros(size + 1)
        force[1::2] = system.over_mass(system.push(law))
        watched[(0 if law.quantity == "displacement" else 1) : size : 2] = along
        for side, bends in law.bends.items():
            for place, change in bends:
                rows.append(side * watched)
                places.append(place)
                pushes.append(side * change * force)
                drags.append(np.zeros((size, size)))
    count = len(rows)
    return SystemRates(
        system.state_matrix(),
        B,
        S,
        C,
        np.array([wave.order for wave in waves], dtype=np.int64),
        d,
        np.array(rows).reshape(count, size + 1),
        np.array(places, dtype=float),
        np.array(pushes).reshape(count, size),
        np.array(drags).reshape(count, size, size),
    )


@callee
def _slope(y: Float, angle: float, rates: SystemRates, out: Float) -> None:
    """out ← y' at the drive's phase ``angle``."""
    size, wave = y.shape[0], np.sin(angle)
    for i in range(size):
        total = rates.B[i] * wave + rates.d[i]
        for k in range(rates.order.shape[0]):
            turn = rates.order[k] * angle
            total += rates.S[k, i] * np.sin(turn) + rates.C[k, i] * np.cos(turn)
        for j in range(size):
            total += rates.A[i, j] * y[j]
        out[i] = total
    for s in range(rates.place.shape[0]):
        depth = rates.row[s, size] * wave - rates.place[s]
        for j in range(size):
            depth += rates.row[s, j] * y[j]
        if depth > 0.0:
            for i in range(size):
                total = rates.push[s, i] * depth
                for j in range(size):
                    total += rates.drag[s, i, j] * y[j]
                out[i] -= total


@compiled
def carry(y: Float, rates: SystemRates, omega: float, steps: int, first: int, count: int) -> None:
    """y (2n,) ← the state after ``count`` steps of ``steps`` a drive period, from number first."""
    h = 2.0 * np.pi / omega / steps
    size = y.shape[0]
    k, total, at = np.empty(size), np.empty(size), np.empty(size)
    for i in range(first, first + count):
        phase = (i % steps) * h  # from the period's begin: it does not drift
        _slope(y, omega * phase, rates, k)
        for j in range(size):
            total[j], at[j] = k[j], y[j] + 0.5 * h * k[j]
        half = omega * (phase + 0.5 * h)
        _slope(at, half, rates, k)
        for j in range(size):
            total[j] += 2.0 * k[j]
            at[j] = y[j] + 0.5 * h * k[j]
        _slope(at, half, rates, k)
        for j in range(size):
            total[j] += 2.0 * k[j]
            at[j] = y[j] + h * k[j]
        _slope(at, omega * (phase + h), rates, k)
        for j in range(size):
            y[j] += h / 6.0 * (total[j] + k[j])


def run(model: MechanicalModel, omega: float, start: Array, periods: int, steps: int) -> Array:
    """(2n,) the state after these drive periods from ``start`` (2n,) at phase 0."""
    y = np.array(start, dtype=float)
    carry(y, rates_of(model.second_order(), omega), omega, steps, 0, periods * steps)
    return y


def trace(
    model: MechanicalModel, omega: float, start: Array, periods: int, points: int, steps: int
) -> Array:
    """(periods · points + 1, 2n) states, ``points`` to a drive period; steps : a multiple of it."""
    rates, each = rates_of(model.second_order(), omega), steps // points
    out = np.empty((periods * points + 1, len(start)))
    out[0] = start
    for i in range(periods * points):
        out[i + 1] = out[i]
        carry(out[i + 1], rates, omega, steps, each * (i % points), each)
    return out
