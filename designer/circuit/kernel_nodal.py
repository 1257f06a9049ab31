"""Compiled solution of many boards' nodal equations.

All sums are plain loops over one board, so that its answer has the same bytes alone and among
others, by any number of threads.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from designer.base.jit import compiled
from designer.kernels.kernel_algebra import factor, substitute

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
            for q in range(size):
                a[p, q] /= column[q]
                keep[p, q] = a[p, q]
        least = factor(a, order)
        if not least > 1e-13:
            bad[i] = 1
            continue
        substitute(a, order, r, y[i])
        for p in range(size):
            for q in range(k):
                total = b[p, q]
                for j in range(size):
                    total -= keep[p, j] * y[i, j, q]
                r[p, q] = total
        substitute(a, order, r, b)
        for p in range(size):
            for q in range(k):
                y[i, p, q] = (y[i, p, q] + b[p, q]) / column[p]
