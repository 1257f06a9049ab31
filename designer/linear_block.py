"""The linear block's best parts: tables reduced by inequalities, then a mixed-integer program.

In logarithms every coefficient is a sum of part values and scales. Ten errors (two displacement
integrators, eight terms) share four free scales: alpha = ln(tau/C2), p, q1, q3. Six combinations of
errors contain no scale at all, and four of them only resistor ratios and the ratio of C4 to C2;
each must lie inside a window of (sum of |coefficients|) · eps. Joining tables of pairs through
these windows leaves every choice that can reach eps, and no other: an empty join at eps proves
that no choice has a smaller error. What remains (absolute values, capacitors, fewest distinct
values) is decided by HiGHS through cvxpy (``designer.selection``).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from designer.system import Array, Index, Mask

FIRST_LEVEL, GROWTH, LAST_LEVEL = 1e-9, 2.0, 0.1
MAX_ROWS = 400_000
"""Rows past which a join is cut and the answer no longer proved."""


@dataclass(frozen=True)
class Targets:
    """ln |wanted| of the eight terms, by the resistor that realises them."""

    w2: float
    w3: float
    w4: float
    w5: float
    w8: float
    w9: float
    w10: float
    w11: float

    @classmethod
    def from_state_matrix(cls, A: Array) -> Targets:
        """From the dimensionless (4, 4) state matrix."""
        w = np.log(np.abs(np.where(A == 0.0, 1.0, A)))
        return cls(w[1, 1], w[1, 3], w[1, 0], w[1, 2], w[3, 1], w[3, 3], w[3, 0], w[3, 2])


@dataclass(frozen=True)
class RatioTable:
    """Rows of the join: everything about the linear block that no common factor changes.

    Columns, each (k,): delta = ln C4/C2; r2, r3, r8, r9 = ln of the resistors; ratio4 = ln R4/R10,
    ratio5 = ln R5/R11; error: the least max error of the eight terms; alpha, p: scales there.
    complete : no row with an error up to the level is missing.
    """

    delta: Array
    r2: Array
    r9: Array
    r3: Array
    r8: Array
    ratio4: Array
    ratio5: Array
    error: Array
    alpha: Array
    p: Array
    complete: bool

    def __len__(self) -> int:
        return len(self.error)

    def take(self, which: Index | Mask) -> RatioTable:
        """The rows of an index or mask array."""
        columns = {k: v[which] for k, v in self.__dict__.items() if k != "complete"}
        return RatioTable(**columns, complete=self.complete)


def _elementary() -> Array:
    """Elementary vectors of the 6 x 2 system of ``_offsets``, each scaled to unit 1-norm.

    The minimax over the two scales of |a - D s| is the largest |y · a| over them (Farkas).
    """
    D = np.array([[1.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, -1.0], [0.0, 0.5], [0.0, 0.5]])
    found = []
    for size in (2, 3):
        for rows in combinations(range(6), size):
            _, s, vt = np.linalg.svd(D[list(rows)].T)
            if size - int((s > 1e-12).sum()) != 1:
                continue
            y = np.zeros(6)
            y[list(rows)] = vt[-1]
            if (np.abs(y[list(rows)]) > 1e-12).all():
                found.append(y / np.abs(y).sum())
    return np.array(found)


_SCALES = np.array([[1.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, -1.0], [0.0, 0.5], [0.0, 0.5]])
_ELEMENTARY = _elementary()


def ratio_table(
    resistors: Array,
    capacitors: Array,
    t: Targets,
    level: float,
    p_range: tuple[float, float] = (-np.inf, np.inf),
) -> RatioTable:
    """Every ratio choice whose eight-term error is at most ``level``.

    resistors, capacitors : values that may be used [ohm], [F]. p_range : limits of p, the ln of
    the second velocity's volts over the first's.
    """
    r = np.log(np.sort(resistors))
    c = np.log(np.sort(capacitors))
    deltas = _distinct((c[:, None] - c[None, :]).ravel())
    # Where a join is cut, capacitors of like size stay: they are the most likely to be of use.
    deltas = deltas[np.argsort(np.abs(deltas), kind="stable")]
    # e22 - e44: R9 against R2, window 2 eps.
    grid = np.meshgrid(np.arange(len(deltas)), np.arange(len(r)), indexing="ij")
    d_i, r2_i = (a.ravel() for a in grid)
    centre = r[r2_i] - deltas[d_i] + t.w2 - t.w9
    row, hit, full = window(r, centre, 2 * level)
    delta, r2, r9 = deltas[d_i[row]], r[r2_i[row]], r[hit]
    # e24 + e42 - e22 - e44: the product R3 R8, window 4 eps.
    pair_i, pair_j = (a.ravel() for a in np.meshgrid(np.arange(len(r)), np.arange(len(r))))
    sums = r[pair_i] + r[pair_j]
    order = np.argsort(sums, kind="stable")
    row, hit, cut = window(sums[order], r2 + r9 + t.w2 + t.w9 - t.w3 - t.w8, 4 * level)
    full &= cut
    delta, r2, r9 = delta[row], r2[row], r9[row]
    r3, r8 = r[pair_i[order[hit]]], r[pair_j[order[hit]]]
    # e21 - e41 and e23 - e43 against p = e24 - e22: ratios of displacement resistors, 4 eps.
    ratios = _distinct((r[:, None] - r[None, :]).ravel())
    p = r3 + t.w3 - r2 - t.w2
    kept = np.flatnonzero((p >= p_range[0] - 2 * level) & (p <= p_range[1] + 2 * level))
    delta, r2, r9, r3, r8, p = (a[kept] for a in (delta, r2, r9, r3, r8, p))
    row, hit, cut = window(ratios, delta + p + t.w10 - t.w4, 4 * level)
    full &= cut
    delta, r2, r9, r3, r8, p = (a[row] for a in (delta, r2, r9, r3, r8, p))
    ratio4 = ratios[hit]
    row, hit, cut = window(ratios, delta + p + t.w11 - t.w5, 4 * level)
    full &= cut
    delta, r2, r9, r3, r8, ratio4 = (a[row] for a in (delta, r2, r9, r3, r8, ratio4))
    table = _evaluate(delta, r2, r9, r3, r8, ratio4, ratios[hit], t, full)
    table = table.take(np.flatnonzero(table.error <= level))
    return table.take(np.argsort(table.error, kind="stable"))


def _evaluate(
    delta: Array,
    r2: Array,
    r9: Array,
    r3: Array,
    r8: Array,
    ratio4: Array,
    ratio5: Array,
    t: Targets,
    complete: bool,
) -> RatioTable:
    a = np.stack(
        [
            r2 + t.w2,
            r9 + delta + t.w9,
            r3 + t.w3,
            r8 + delta + t.w8,
            0.5 * (ratio4 - delta + t.w4 - t.w10),
            0.5 * (ratio5 - delta + t.w5 - t.w11),
        ]
    )
    error = np.abs(_ELEMENTARY @ a).max(axis=0) if a.size else np.zeros(0)
    # Least squares for a start; ``selection`` finds the scales themselves.
    scales = np.linalg.pinv(_SCALES) @ a
    return RatioTable(delta, r2, r9, r3, r8, ratio4, ratio5, error, scales[0], scales[1], complete)


def _distinct(values: Array) -> Array:
    """Sorted values without those that differ only by rounding."""
    ordered = np.sort(values)
    if len(ordered) == 0:
        return ordered
    fresh = np.concatenate([[True], np.diff(ordered) > 1e-12])
    return np.asarray(ordered[fresh])


def window(table: Array, centre: Array, half: float) -> tuple[Index, Index, bool]:
    """Join: pairs (i, j) with |table[j] - centre[i]| <= half; whether all of them are there."""
    slack = half + 1e-12
    low = np.searchsorted(table, centre - slack, side="left")
    count = np.searchsorted(table, centre + slack, side="right") - low
    total = np.cumsum(count)
    complete = True
    if len(total) and total[-1] > MAX_ROWS:
        keep = int(np.searchsorted(total, MAX_ROWS, side="right"))
        count = np.where(np.arange(len(count)) < keep, count, 0)
        complete = False
    row = np.repeat(np.arange(len(centre)), count)
    first = np.repeat(np.cumsum(count) - count, count)
    return row, low[row] + (np.arange(len(row)) - first), complete
