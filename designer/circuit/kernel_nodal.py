"""Compiled solution of many boards' nodal equations.

All sums are plain loops over one board, so that its answer has the same bytes alone and among
others, by any number of threads; the numerical libraries do not promise that.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from designer.base.jit import compiled

Float = NDArray[np.float64]
Int = NDArray[np.int64]


@compiled
def solve_all(G: Float, right: Float, y: Float, bad: Int) -> None:
    """y ← G⁻¹ right for each of N systems (N, s, s), (N, s, k), by elimination with row exchanges
    after bringing rows and columns to like size, and one step of refinement. bad (N,) : 1 where a
    pivot all but vanishes."""
    size, k = G.shape[1], right.shape[2]
    a = np.zeros((size, size))
    keep = np.zeros((size, size))
    r = np.zeros((size, k))
    b = np.zeros((size, k))
    row, column = np.zeros(size), np.zeros(size)
    order = np.zeros(size, dtype=np.int64)
    for i in range(G.shape[0]):
        bad[i] = 0
        for p in range(size):
            row[p] = column[p] = 0.0
        for p in range(size):
            for q in range(size):
                row[p] = max(row[p], abs(G[i, p, q]))
            if not (row[p] > 0.0 and row[p] < np.inf):
                bad[i] = 1
        for p in range(size):
            for q in range(size):
                a[p, q] = G[i, p, q] / row[p]
                column[q] = max(column[q], abs(a[p, q]))
            for q in range(k):
                b[p, q] = right[i, p, q] / row[p]
                r[p, q] = b[p, q]
        for q in range(size):
            if not column[q] > 0.0:
                bad[i] = 1
        if bad[i] == 1:
            continue
        for p in range(size):
            order[p] = p
            for q in range(size):
                a[p, q] /= column[q]
                keep[p, q] = a[p, q]
        least = _factor(a, order)
        if not least > 1e-13:
            bad[i] = 1
            continue
        _substitute(a, order, r, y[i])
        for p in range(size):
            for q in range(k):
                total = b[p, q]
                for j in range(size):
                    total -= keep[p, j] * y[i, j, q]
                r[p, q] = total
        _substitute(a, order, r, b)
        for p in range(size):
            for q in range(k):
                y[i, p, q] = (y[i, p, q] + b[p, q]) / column[p]


@compiled
def _factor(a: Float, order: Int) -> float:
    """a ← its triangular factors, rows exchanged by ``order``; the smallest pivot."""
    size, least = len(a), np.inf
    for p in range(size):
        best, at = abs(a[p, p]), p
        for q in range(p + 1, size):
            if abs(a[q, p]) > best:
                best, at = abs(a[q, p]), q
        least = min(least, best)
        if not best > 0.0:
            return 0.0
        if at != p:
            for j in range(size):
                a[p, j], a[at, j] = a[at, j], a[p, j]
            order[p], order[at] = order[at], order[p]
        for q in range(p + 1, size):
            if a[q, p] == 0.0:
                continue
            factor = a[q, p] / a[p, p]
            a[q, p] = factor
            for j in range(p + 1, size):
                a[q, j] -= factor * a[p, j]
    return float(least)


@compiled
def _substitute(a: Float, order: Int, r: Float, y: Float) -> None:
    size, k = len(a), r.shape[1]
    for p in range(size):
        for j in range(k):
            y[p, j] = r[order[p], j]
        for q in range(p):
            if a[p, q] != 0.0:
                for j in range(k):
                    y[p, j] -= a[p, q] * y[q, j]
    for p in range(size - 1, -1, -1):
        for q in range(p + 1, size):
            if a[p, q] != 0.0:
                for j in range(k):
                    y[p, j] -= a[p, q] * y[q, j]
        for j in range(k):
            y[p, j] /= a[p, p]
