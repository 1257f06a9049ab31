"""The linear block in logarithms: what the errors are, and the tables that they are joined from.

Every coefficient is a sum of part values and scales. Ten errors (eight terms, two displacement
integrators) share four free scales: alpha = ln(tau/C2), p = ln(volts of x2'/volts of x1'), and
q1, q3 of displacement over velocity of each mass. With q1 and q3 eliminated, ten numbers v are
left that only alpha and p move:

    v0 = r2 + w2                            alpha - v0
    v1 = r9 + delta + w9                    alpha - v1
    v2 = r3 + w3                            alpha + p - v2
    v3 = r8 + delta + w8                    alpha - p - v3
    v4 = (r4 - r10 - delta + w4 - w10)/2    p/2 - v4
    v5 = (r5 - r11 - delta + w5 - w11)/2    p/2 - v5
    v6 = (r4 + w4 + s1 - c2)/2              alpha - v6
    v7 = (r10 + w10 + delta + s1 - c2)/2    alpha - p/2 - v7
    v8 = (r5 + w5 + s3 - c2)/2              alpha + p/2 - v8
    v9 = (r11 + w11 + delta + s3 - c2)/2    alpha - v9

(delta = c4 - c2, s1 = r1 + c1, s3 = r7 + c3, w = ln |wanted|.) The least that the largest of the
right-hand entries can be made is the largest |y · v| over the elementary vectors y of their
coefficients, scaled to unit 1-norm (Farkas). The first six hold ratios only; their error is a
lower bound of the whole.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from designer.base.arrays import Array, Index
from designer.synthesis.kernel_linear import Rules, Values, join

PARTS = ("R1", "R2", "R3", "R4", "R5", "R7", "R8", "R9", "R10", "R11", "C1", "C2", "C3", "C4")
"""The parts of the linear block, in the order of the compiled loops."""
SCALES = np.array(
    [
        (1.0, 0.0), (1.0, 0.0), (1.0, 1.0), (1.0, -1.0), (0.0, 0.5),
        (0.0, 0.5), (1.0, 0.0), (1.0, -0.5), (1.0, 0.5), (1.0, 0.0),
    ]
)  # fmt: skip
"""(10, 2) coefficients of alpha and p."""
SLICE = 50_000
"""Rows that are joined at a time."""
SAME = 1e-12
"""Logarithms of ratios closer than this are one ratio: the rest is rounding."""


@dataclass(frozen=True)
class Targets:
    """The eight terms that the linear block has to realise."""

    w2: float
    """ln |wanted| of the term that R2 realises."""
    w3: float
    """ln |wanted| of the term that R3 realises."""
    w4: float
    """ln |wanted| of the term that R4 realises."""
    w5: float
    """ln |wanted| of the term that R5 realises."""
    w8: float
    """ln |wanted| of the term that R8 realises."""
    w9: float
    """ln |wanted| of the term that R9 realises."""
    w10: float
    """ln |wanted| of the term that R10 realises."""
    w11: float
    """ln |wanted| of the term that R11 realises."""

    @classmethod
    def from_state_matrix(cls, A: Array) -> Targets:
        """From the dimensionless (4, 4) state matrix."""
        w = np.log(np.abs(np.where(A == 0.0, 1.0, A)))
        return cls(w[1, 1], w[1, 3], w[1, 0], w[1, 2], w[3, 1], w[3, 3], w[3, 0], w[3, 2])

    @property
    def logs(self) -> Array:
        """(8,) in the order of the resistors' numbers."""
        own = (self.w2, self.w3, self.w4, self.w5, self.w8, self.w9, self.w10, self.w11)
        return np.array(own, dtype=float)


def residuals_of(r: Array, c: Array, w: Array) -> tuple[Array, Array]:
    """(k, 10) offsets and (10, 4) scales (alpha, p, q1, q3) of the coefficient errors.

    r (k, 10), c (k, 4) : ln of the parts in the order of ``PARTS``. w (8,) : ``Targets.logs``.
    """
    r1, r2, r3, r4, r5, r7, r8, r9, r10, r11 = r.T
    c1, c2, c3, c4 = c.T
    w2, w3, w4, w5, w8, w9, w10, w11 = w
    delta = c4 - c2
    offsets = [
        -r2 - w2, -delta - r9 - w9, -r3 - w3, -delta - r8 - w8, -r4 - w4,
        -delta - r10 - w10, -r5 - w5, -delta - r11 - w11, c2 - r1 - c1, c2 - r7 - c3,
    ]  # fmt: skip
    scales = [
        (1, 0, 0, 0), (1, 0, 0, 0), (1, 1, 0, 0), (1, -1, 0, 0), (1, 0, 1, 0),
        (1, -1, 1, 0), (1, 1, 0, 1), (1, 0, 0, 1), (1, 0, -1, 0), (1, 0, 0, -1),
    ]  # fmt: skip
    return np.stack(offsets, axis=1), np.array(scales, dtype=float)


def elementary(D: Array) -> tuple[Index, Array]:
    """Elementary vectors y of D (m, 2), y D = 0: (k, 3) places and entries, each of unit 1-norm.

    Where a vector has two entries only, the third stands at place 0 with the value 0.
    """
    places, entries = [], []
    for size in (2, 3):
        for rows in combinations(range(len(D)), size):
            _, s, vt = np.linalg.svd(D[list(rows)].T)
            y = vt[-1]
            if size - int((s > 1e-12).sum()) != 1 or (np.abs(y) < 1e-12).any():
                continue
            places.append([*rows, 0][:3])
            entries.append([*(y / np.abs(y).sum()), 0.0][:3])
    return np.array(places, dtype=np.int64), np.array(entries, dtype=np.float64)


def catalogue(resistors: Array, capacitors: Array) -> Values:
    """Sorted logarithms of what can be bought [ohm], [F], with the tables that joins need."""
    r, c = np.log(np.sort(resistors)), np.log(np.sort(capacitors))
    n, m = len(r), len(c)
    i, j = _pairs(n, n)
    ratios, first, order = _grouped(r[i] - r[j])
    upper, lower = i[order], j[order]
    i, j = _pairs(n, m)
    by_sum = np.argsort(r[i] + c[j], kind="stable")
    c2, c4 = _pairs(m, m)
    deltas, delta_first, order = _grouped(c[c4] - c[c2])
    near = np.argsort(np.abs(deltas), kind="stable")
    spans = [np.sort(order[delta_first[k] : delta_first[k + 1]]) for k in near]
    chosen = np.concatenate([*spans, np.zeros(0, dtype=np.int64)]).astype(np.int64)
    return Values(
        r=r,
        c=c,
        ratios=ratios,
        first=first,
        upper=upper,
        lower=lower,
        sums=(r[i] + c[j])[by_sum],
        sum_r=i[by_sum],
        sum_c=j[by_sum],
        deltas=deltas[near],
        delta_first=np.cumsum([0, *(len(span) for span in spans)]).astype(np.int64),
        delta_c2=c2[chosen],
        delta_c4=c4[chosen],
    )


def _pairs(n: int, m: int) -> tuple[Index, Index]:
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    return i.ravel().astype(np.int64), j.ravel().astype(np.int64)


def _grouped(numbers: Array) -> tuple[Array, Index, Index]:
    """(distinct numbers ascending, where each begins in the order, the order)."""
    order = np.argsort(numbers, kind="stable").astype(np.int64)
    ordered = numbers[order]
    fresh = np.diff(ordered, prepend=-np.inf) > SAME
    begins = np.flatnonzero(fresh).astype(np.int64)
    return ordered[begins], np.append(begins, len(order)).astype(np.int64), order


@dataclass(frozen=True)
class Slice:
    """Rows that were joined from one stretch of the outermost tables."""

    rows: Index
    """(k, 7) indices, by ascending error."""
    errors: Array
    """(k,) error of each row."""
    following: int
    """Where the next slice begins."""
    steps: int
    """Steps of the loops."""
    cut: bool
    """Whether rows of this one are missing."""


def slice_from(values: Values, rules: Rules, level: float, start: int, patience: int) -> Slice:
    """Join on from a pair of the outermost tables until a slice is full."""
    room, steps = SLICE, 0
    while True:
        rows, errors = np.zeros((room, 7), dtype=np.int64), np.zeros(room)
        following, count, taken = join(
            values, rules, level, start, max(patience - steps, 0), rows, errors
        )
        steps += taken
        if count or following > start or steps >= patience:
            break
        room *= 4  # one pair alone fills the slice
    order = np.argsort(errors[:count], kind="stable")
    stuck = following == start
    return Slice(rows[order], errors[order], following + stuck, steps, stuck)
