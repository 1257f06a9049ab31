"""The scales at which the largest coefficient error is least: a small linear program."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

from designer.base.arrays import Array


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
