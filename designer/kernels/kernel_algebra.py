"""Compiled linear algebra of small dense matrices.

All sums are plain loops, so that an answer has the same bytes wherever it is computed; the
numerical libraries do not promise that.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from designer.base.jit import callee, compiled, leaf

Float = NDArray[np.float64]
Int = NDArray[np.int64]


@leaf
def factor(a: Float, order: Int) -> float:
    """a ← its triangular factors, rows exchanged by ``order``; the smallest pivot."""
    size, least = len(a), np.inf
    for p in range(size):
        order[p] = p
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
            ratio = a[q, p] / a[p, p]
            a[q, p] = ratio
            for j in range(p + 1, size):
                a[q, j] -= ratio * a[p, j]
    return float(least)


@leaf
def substitute(a: Float, order: Int, r: Float, y: Float) -> None:
    """y ← the solution for the right-hand sides r (size, k), by the factors of ``factor``."""
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


@callee
def spectral_radius(M: Float, doublings: int) -> float:
    """‖M^(2^k)‖ to the power 2^-k for k = ``doublings``: the largest modulus of an eigenvalue,
    within a few per cent for 5 and to rounding for 48."""
    n = len(M)
    power, square, total, weight = M.copy(), np.zeros((n, n)), 0.0, 1.0
    for _ in range(doublings + 1):
        size = 0.0
        for i in range(n):
            for j in range(n):
                size += power[i, j] * power[i, j]
        size = np.sqrt(size)
        if not (size > 0.0 and size < np.inf):
            return 0.0 if size == 0.0 else np.inf
        total += weight * np.log(size)
        weight *= 0.5
        for i in range(n):
            for j in range(n):
                power[i, j] /= size
        for i in range(n):
            for j in range(n):
                entry = 0.0
                for k in range(n):
                    entry += power[i, k] * power[k, j]
                square[i, j] = entry
        power, square = square, power
    return float(np.exp(total))


@compiled
def exponential_terms(M: Float, h: float, terms: Float) -> None:
    """terms (orders, N, N) ← (M h)^k/k!, k = 0, 1, …, whose sum is exp(M h)."""
    size = len(M)
    for i in range(size):
        for j in range(size):
            terms[0, i, j] = 1.0 if i == j else 0.0
    for k in range(1, len(terms)):
        for i in range(size):
            for j in range(size):
                total = 0.0
                for m in range(size):
                    total += terms[k - 1, i, m] * M[m, j]
                terms[k, i, j] = total * (h / k)


@compiled
def rows_of_terms(row: Float, terms: Float, out: Float) -> None:
    """out (orders, N) ← row · terms, for terms (orders, N, N)."""
    for k in range(len(terms)):
        for j in range(len(row)):
            total = 0.0
            for i in range(len(row)):
                total += row[i] * terms[k, i, j]
            out[k, j] = total


@compiled
def all_rows_of_terms(rows: Float, terms: Float, out: Float) -> None:
    """out (rows, orders, N) ← each of the rows (rows, N) as ``rows_of_terms``."""
    for r in range(len(rows)):
        rows_of_terms(rows[r], terms, out[r])


@compiled
def motion_terms(row: Float, M: Float, h: float, z: Float, out: Float) -> None:
    """out (orders, k) ← row · (M h)^j/j! z, j = 0, 1, …, for columns z (N, k): the Taylor terms
    over h of a linear function along z' = M z."""
    size, columns = z.shape
    power, after = z.copy(), np.empty_like(z)
    for order in range(len(out)):
        for c in range(columns):
            total = 0.0
            for i in range(size):
                total += row[i] * power[i, c]
            out[order, c] = total
        for i in range(size):
            for c in range(columns):
                total = 0.0
                for j in range(size):
                    total += M[i, j] * power[j, c]
                after[i, c] = total * (h / (order + 1))
        power, after = after, power
