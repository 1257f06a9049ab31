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

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from designer.base.arrays import Array, Index, Mask
from designer.linear_network.kernel_linear import Rules, Values, join
from designer.linear_network.linear_terms import (
    Bounds,
    LinearErrors,
    Targets,
    equal_values,
    errors_of_terms,
    preferred_logs,
    sums,
)
from designer.model.circuit_table import CircuitSpec

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


def errors_of(values: Mapping[str, float], targets: Targets) -> LinearErrors:
    """The errors of these parts, by name [ohm, F]: with the scales alpha, p, q1, q3 for two masses
    with all terms."""
    if not targets.fully_coupled_pair:
        return errors_of_terms(values, targets)
    logs = np.log([values[name] for name in PARTS])
    h, D = residuals_of(logs[None, :10], logs[None, 10:], targets.logs)
    return LinearErrors(
        offsets=h[0],
        columns=D,
        volts=np.array([(0, 0, 0, 0), (0, 0, -1, 0), (0, 1, -1, 1), (0, 1, -1, 0)], dtype=float),
        rates=np.array([(1, 0, 1, 0), (1, 0, 0, 1)], dtype=float),
        rate_offsets=np.array([0.0, logs[11] - logs[13]]),
    )


def elementary(D: Array) -> tuple[Index, Array]:
    """Elementary vectors y of D (m, 2), y D = 0: (k, 3) rows of D and entries, each of unit 1-norm.

    Where a vector has two entries only, the third is that of row 0 with the value 0.
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
    by_sum, sum_r, sum_c = sums(r, c)
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
        sums=by_sum,
        sum_r=sum_r,
        sum_c=sum_c,
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
    is_first = np.diff(ordered, prepend=-np.inf) > SAME
    begins = np.flatnonzero(is_first).astype(np.int64)
    return ordered[begins], np.append(begins, len(order)).astype(np.int64), order


def rules_of(values: Values, t: Targets, bounds: Bounds, spec: CircuitSpec) -> Rules:
    """The side conditions, and the parts and values that ``spec`` asks for, for the compiled loops.

    The conditions are stated on nominal scales, which need no solver: alpha is the mean of v0 to
    v3, p half of v2 - v3, q1 = r4 + w4 - alpha, q3 = r11 + w11 + delta - alpha. At error eps they
    are within 2 eps of those that make the error least.
    """
    places, entries = elementary(SCALES)

    def vectors(which: Mask) -> tuple[Index, Array]:
        return np.ascontiguousarray(places[which]), np.ascontiguousarray(entries[which])

    def uses(*numbers: int) -> Mask:
        return np.asarray((np.isin(places, numbers) & (entries != 0.0)).any(axis=1))

    one, two = uses(6, 7), uses(8, 9)
    return Rules(
        w=t.logs,
        seconds=np.log(np.maximum(bounds.seconds, 1e-300)),
        level=float(np.log(bounds.level)),
        share=float(np.log(bounds.share)),
        stop=np.log(np.array([max(bounds.stop, 1e-300), bounds.stop_most])),
        peaks=np.log(bounds.peaks),
        ties=equal_values(PARTS, spec.matched),
        free_r=preferred_logs(values.r, spec.preferred),
        free_c=preferred_logs(values.c, spec.preferred),
        most=min(len(PARTS) if spec.most_values is None else spec.most_values, len(PARTS)),
        six=vectors(~one & ~two),
        one=vectors(one & ~two),
        two=vectors(two & ~one),
        both=vectors(one & two),
    )


@dataclass(frozen=True)
class _Slice:
    """Rows joined from one stretch of the outermost tables: (k, 7) indices by ascending error,
    their (k,) errors, where the next slice begins, the steps of the loops, and whether rows of this
    one are missing."""

    rows: Index
    errors: Array
    following: int
    steps: int
    cut: bool


def slice_from(values: Values, rules: Rules, level: float, start: int, patience: int) -> _Slice:
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
    return _Slice(rows[order], errors[order], following + stuck, steps, stuck)
