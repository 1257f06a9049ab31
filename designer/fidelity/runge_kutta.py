"""Classical Runge-Kutta with equal steps, blind to the stops: how the paper computes its model.

The same arithmetic three times: numbers in plain Python, the same function compiled by numba, and
arrays of NumPy. Two masses, one clearance on the first; states x1, x1', x2, x2'.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.base.jit import compiled
from designer.model.model import Dimensionless

PAPERS_STEP = 0.005
"""Section 4: Δt, in dimensionless time."""


@dataclass(frozen=True)
class Rates:
    """The numbers of the equations of motion."""

    numbers: Array
    """(11,) coefficients of x1, x1', x2, x2' in x1'', the same in x2'', the drive in both, and the
    stop's stiffness over the first mass."""
    low: float
    """Place of the lower stop; -inf where there is none."""
    high: float
    """Place of the upper stop; inf where there is none."""

    @classmethod
    def of(cls, model: Dimensionless) -> Rates:
        """The corrected Eq. (4)."""
        system = model.second_order()
        A = system.state_matrix()
        drive = system.force / system.mass
        stops = system.clearances
        mu = stops[0].first.stiffness / system.mass[0] if stops else 0.0
        positions = stops[0].positions if stops else ()
        gap = stops[0].first.gap if stops else math.inf
        return cls(
            np.concatenate([A[1], A[3], drive, [mu]]),
            -gap if -1 in positions else -math.inf,
            gap if 1 in positions else math.inf,
        )


def numbers(
    x: float, v: float, y: float, u: float, rates: Array, low: float, high: float, omega: float,
    steps: int, first: int, count: int,
) -> tuple[float, float, float, float]:  # fmt: skip
    """The state after ``count`` steps of ``steps`` a drive period, from step number ``first``."""
    a0, a1, a2, a3 = rates[0], rates[1], rates[2], rates[3]
    b0, b1, b2, b3 = rates[4], rates[5], rates[6], rates[7]
    f, g, mu = rates[8], rates[9], rates[10]
    h = 2.0 * math.pi / omega / steps
    half, sixth = 0.5 * h, h / 6.0
    s0 = math.sin(omega * (first % steps) * h)
    for i in range(first, first + count):
        j = i % steps  # from the period's begin: the phase does not drift
        sm, s1 = math.sin(omega * (j + 0.5) * h), math.sin(omega * (j + 1) * h)
        n = min(max(x, low), high)
        kv = a0 * x + a1 * v + a2 * y + a3 * u - mu * (x - n) + f * s0
        ku = b0 * x + b1 * v + b2 * y + b3 * u + g * s0
        p, q, r, w = x + half * v, v + half * kv, y + half * u, u + half * ku
        n = min(max(p, low), high)
        lv = a0 * p + a1 * q + a2 * r + a3 * w - mu * (p - n) + f * sm
        lu = b0 * p + b1 * q + b2 * r + b3 * w + g * sm
        lx, ly = q, w
        p, q, r, w = x + half * lx, v + half * lv, y + half * ly, u + half * lu
        n = min(max(p, low), high)
        mv = a0 * p + a1 * q + a2 * r + a3 * w - mu * (p - n) + f * sm
        mu_ = b0 * p + b1 * q + b2 * r + b3 * w + g * sm
        mx, my = q, w
        p, q, r, w = x + h * mx, v + h * mv, y + h * my, u + h * mu_
        n = min(max(p, low), high)
        nv = a0 * p + a1 * q + a2 * r + a3 * w - mu * (p - n) + f * s1
        nu = b0 * p + b1 * q + b2 * r + b3 * w + g * s1
        x, y = x + sixth * (v + 2.0 * (lx + mx) + q), y + sixth * (u + 2.0 * (ly + my) + w)
        v += sixth * (kv + 2.0 * (lv + mv) + nv)
        u += sixth * (ku + 2.0 * (lu + mu_) + nu)
        s0 = s1
    return x, v, y, u


fast = compiled(numbers)
"""The same, compiled."""


def run(
    model: Dimensionless,
    omega: float,
    start: Array,
    periods: int,
    steps: int,
    *,
    carry: Callable[..., tuple[float, float, float, float]] = fast,
) -> Array:
    """(4,) the state after these drive periods from ``start`` (4,) at phase 0.

    carry : ``fast``, or ``numbers`` for plain Python.
    """
    rates = Rates.of(model)
    coefficients = rates.numbers if carry is fast else rates.numbers.tolist()
    x, v, y, u = (float(s) for s in start)
    count = periods * steps
    return np.array(carry(x, v, y, u, coefficients, rates.low, rates.high, omega, steps, 0, count))


def trace(
    model: Dimensionless, omega: float, start: Array, periods: int, points: int, steps: int
) -> Array:
    """(periods · points + 1, 4) states, ``points`` to a drive period; steps : a multiple of it."""
    rates = Rates.of(model)
    each = steps // points
    out = np.empty((periods * points + 1, 4))
    out[0] = start
    for i in range(periods * points):
        x, v, y, u = (float(s) for s in out[i])
        first = each * (i % points)
        out[i + 1] = fast(
            x, v, y, u, rates.numbers, rates.low, rates.high, omega, steps, first, each
        )
    return out


def run_arrays(model: Dimensionless, omega: float, start: Array, periods: int, steps: int) -> Array:
    """(4,) the same with arrays of four: a right-hand side of a few NumPy calls a stage."""
    rates = Rates.of(model)
    A = np.zeros((4, 4))
    A[0, 1] = A[2, 3] = 1.0
    A[1], A[3] = rates.numbers[:4], rates.numbers[4:8]
    B = np.array([0.0, rates.numbers[8], 0.0, rates.numbers[9]])
    stop = np.array([0.0, rates.numbers[10], 0.0, 0.0])
    h = 2.0 * np.pi / omega / steps

    def slope(t: float, x: Array) -> Array:
        past = x[0] - np.minimum(np.maximum(x[0], rates.low), rates.high)
        return np.asarray(A @ x + B * np.sin(omega * t) - stop * past)

    x = np.asarray(start, dtype=float)
    for i in range(periods * steps):
        t = (i % steps) * h
        k = slope(t, x)
        m = slope(t + 0.5 * h, x + 0.5 * h * k)
        n = slope(t + 0.5 * h, x + 0.5 * h * m)
        p = slope(t + h, x + h * n)
        x = x + h / 6.0 * (k + 2.0 * (m + n) + p)
    return x
