"""The scales at which the largest coefficient error is least: small linear programs."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

from designer.base.arrays import Array, Mask
from designer.circuit.linear_program import LinearProgram


def least_largest(h: Array, D: Array) -> float:
    """The least of max |h + D s| over all s. h : (m,); D : (m, n).

    Raises
    ------
    ArithmeticError : the solver found nothing, which no finite h and D can cause.
    """
    return float(np.abs(h + D @ _level(h, D)).max())


def minimax(h: Array, D: Array) -> Array:
    """s (n,) that minimises max |h + D s|, and among those the sum of |h + D s|.

    h : (m,); D : (m, n).

    Raises
    ------
    ArithmeticError : the solver found nothing, which no finite h and D can cause.
    """
    m, n = D.shape
    level = _level(h, D)
    worst = float(np.abs(h + D @ level).max())
    # Second pass: |e_i| <= t_i <= worst, least sum of t.
    total = linprog(
        np.concatenate([np.zeros(n), np.ones(m)]),
        A_ub=np.block([[D, -np.eye(m)], [-D, -np.eye(m)]]),
        b_ub=np.concatenate([-h, h]),
        bounds=[(None, None)] * n + [(0.0, worst + 1e-12)] * m,
        method="highs",
    )
    best = level
    if total.x is not None and np.abs(h + D @ total.x[:n]).max() <= worst + 1e-9:
        best = total.x[:n]
    return np.asarray(best, dtype=float)


def _level(h: Array, D: Array) -> Array:
    """s (n,) with the least max |h + D s|."""
    m, n = D.shape
    level = linprog(
        np.concatenate([np.zeros(n), [1.0]]),
        A_ub=np.block([[D, -np.ones((m, 1))], [-D, -np.ones((m, 1))]]),
        b_ub=np.concatenate([-h, h]),
        bounds=[(None, None)] * n + [(0.0, None)],
        method="highs",
    )
    if level.x is None:  # feasible for every h, so only a broken solver comes here
        raise ArithmeticError(f"no minimax scales: {level.message}")
    return np.asarray(level.x[:n], dtype=float)


class LargestFit:
    """The largest error of many choices, each at the scales that are best for it.

    D : (m, n), of all choices. own : (m,) the errors that scales are fitted to; the others are read
    at these scales, which are those of ``minimax``.
    """

    def __init__(self, D: Array, own: Mask) -> None:
        self._slopes, self._own, fitted = D, own, D[own]
        (m, n), inf = fitted.shape, np.inf
        ones, eye = np.ones((m, 1)), np.eye(m)
        free, at_least = np.full(n, -inf), np.zeros(m)
        self._levels = LinearProgram(
            np.block([[fitted, -ones], [-fitted, -ones]]), np.append(free, 0.0), np.full(n + 1, inf)
        )
        self._sums = LinearProgram(
            np.block([[fitted, -eye], [-fitted, -eye]]),
            np.append(free, at_least),
            np.full(n + m, inf),
        )

    def largest(self, h: Array) -> float:
        """The largest |h + D s|, h (m,).

        Raises
        ------
        ArithmeticError : as ``minimax``.
        """
        (m, n), own = self._slopes[self._own].shape, h[self._own]
        ends = np.concatenate([-own, own])
        level = self._levels.solve(np.eye(1, n + 1, n)[0], ends)
        if level is None:
            raise ArithmeticError("no minimax scales")
        errors = h + self._slopes @ level[:n]
        worst = float(np.abs(errors[self._own]).max())
        if not self._own.all():
            cost = np.append(np.zeros(n), np.ones(m))
            most = np.append(np.full(n, np.inf), np.full(m, worst + 1e-12))
            total = self._sums.solve(cost, ends, most)
            if total is not None:
                fitted = h + self._slopes @ total[:n]
                if np.abs(fitted[self._own]).max() <= worst + 1e-9:
                    errors = fitted
        return float(np.abs(errors).max())
