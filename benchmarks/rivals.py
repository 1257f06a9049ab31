"""Other ways to choose the linear block's parts: what the synthesis is measured against.

All give parts from the same values, and their ten errors are computed in the same way, with the
scales as favourable as can be. Parts are indices: ten resistors, then C1 to C4.
"""

from __future__ import annotations

import warnings

import cvxpy as cp
import numpy as np

from designer.base.arrays import Array, Index
from designer.linear_network.kernel_linear import Rules, Values
from designer.linear_network.linear_block import SCALES, elementary
from designer.linear_network.pair_search import residuals

CENTRE = float(np.log(3e4))
"""ln of the resistance around which the continuous solution is laid."""
TO_TEN = np.zeros((10, 10))
"""The ten numbers of ``linear_network.linear_block`` from the offsets of the ten errors."""
for _row, _terms in enumerate(
    [
        {0: -1.0}, {1: -1.0}, {2: -1.0}, {3: -1.0}, {4: -0.5, 5: 0.5}, {6: -0.5, 7: 0.5},
        {4: -0.5, 8: -0.5}, {5: -0.5, 8: -0.5}, {6: -0.5, 9: -0.5}, {7: -0.5, 9: -0.5},
    ]
):  # fmt: skip
    for _column, _factor in _terms.items():
        TO_TEN[_row, _column] = _factor
_PLACES, _ENTRIES = elementary(SCALES)
VECTORS = np.zeros((len(_PLACES), 10))
for _k in range(len(_PLACES)):
    np.add.at(VECTORS[_k], _PLACES[_k], _ENTRIES[_k])
VECTORS = VECTORS @ TO_TEN
"""(k, 10): the least largest error is the largest |VECTORS @ offsets|."""


def errors_of(values: Values, rules: Rules, parts: Index) -> Array:
    """(k,) least largest error of each row of (k, 14) parts; infinite outside the band."""
    h, _ = residuals(values, rules, parts)
    out = np.abs(h @ VECTORS.T).max(axis=1)
    tau = -h[:, :4].mean(axis=1) + values.c[parts[:, 11]]
    good = (tau >= rules.seconds[0]) & (tau <= rules.seconds[1])
    return np.where(good, out, np.inf)


def nearest(table: Array, wanted: Array) -> Index:
    """Index of the nearest entry of a sorted table to each wanted logarithm."""
    right = np.clip(np.searchsorted(table, wanted), 1, len(table) - 1)
    return np.asarray(right - (wanted - table[right - 1] < table[right] - wanted))


def rounded(values: Values, rules: Rules, scales: Array, capacitors: Index) -> Index:
    """(k, 14): the exact resistors for (k, 4) scales and (k, 4) capacitors, each to the nearest.

    scales : ln of time scale, then p, q1, q3 of ``linear_network.linear_block``.
    """
    tau, p, q1, q3 = scales.T
    c1, c2, c3, c4 = values.c[capacitors].T
    w2, w3, w4, w5, w8, w9, w10, w11 = rules.w
    exact = [
        tau - q1 - c1,  # R1
        tau - c2 - w2,
        tau - c2 + p - w3,
        tau - c2 + q1 - w4,
        tau - c2 + p + q3 - w5,
        tau - q3 - c3,  # R7
        tau - c4 - p - w8,
        tau - c4 - w9,
        tau - c4 - p + q1 - w10,
        tau - c4 + q3 - w11,
    ]
    return np.column_stack([*(nearest(values.r, r) for r in exact), capacitors])


def papers_way(values: Values, rules: Rules) -> Index:
    """Four values chosen (C1 = C3, C2 = C4, R1 = R7, R4), the rest by the matching conditions.

    As in the paper 1:10 between the capacitors; time scale in the middle of the band, all states
    to one scale.
    """
    tau = float(rules.seconds.mean())
    low, high = np.log(10e-9), np.log(100e-9)
    c = nearest(values.c, np.array([low, high, low, high]))
    r1 = values.r[nearest(values.r, np.array([tau - values.c[c[0]]]))][0]
    q = tau - r1 - values.c[c[0]]  # so that R1 is the one chosen
    r4 = values.r[nearest(values.r, np.array([tau - values.c[c[1]] + q - rules.w[2]]))][0]
    # R4 too is a choice: the time scale follows from R1 C1 R4 C2.
    tau = 0.5 * (r1 + values.c[c[0]] + r4 + values.c[c[1]] + rules.w[2])
    q = tau - r1 - values.c[c[0]]
    return rounded(values, rules, np.array([[tau, 0.0, q, q]]), c[None, :])


def continuous_then_rounded(values: Values, rules: Rules, draws: int = 0) -> Index:
    """(k, 14) exact solutions in real numbers, rounded.

    Without draws the one whose resistors lie closest to 30 kΩ for capacitors of 10 nF and 100 nF;
    with draws that many at random scales and capacitors (seed 1).
    """
    middle = nearest(values.c, np.log(np.array([10e-9, 100e-9, 10e-9, 100e-9])))
    if not draws:
        zero = np.zeros((1, 4))
        tau = float(rules.seconds.mean())
        zero[0, 0] = tau
        slopes = np.array(
            [
                (0, -1, 0), (0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 0, 1),
                (0, 0, -1), (-1, 0, 0), (0, 0, 0), (-1, 1, 0), (0, 0, 1),
            ],
            dtype=float,
        )  # fmt: skip
        c1, c2, c3, c4 = values.c[middle]
        w2, w3, w4, w5, w8, w9, w10, w11 = rules.w
        at = tau - np.array([c1, c2 + w2, c2 + w3, c2 + w4, c2 + w5, c3, c4 + w8, c4 + w9,
                             c4 + w10, c4 + w11])  # fmt: skip
        zero[0, 1:] = np.linalg.lstsq(slopes, CENTRE - at, rcond=None)[0]
        return rounded(values, rules, zero, middle[None, :])
    rng = np.random.default_rng(1)
    scales = np.column_stack(
        [
            rng.uniform(rules.seconds[0], rules.seconds[1], draws),
            *(rng.uniform(-2.0, 2.0, draws) for _ in range(3)),
        ]
    )
    return rounded(values, rules, scales, rng.integers(0, len(values.c), (draws, 4)))


def annealed(values: Values, rules: Rules, start: Index, evaluations: int, seed: int) -> Index:
    """Simulated annealing from a start: one part a move, up to six places up or down the list."""
    rng = np.random.default_rng(seed)
    # The errors' elementary combinations are linear in the 14 logarithms.
    logs = np.concatenate([values.r[start[:10]], values.c[start[10:]]])
    table, shift = _linear(values, rules)
    tables = [values.r] * 10 + [values.c] * 4
    band = rules.seconds
    limits = np.repeat([len(values.r), len(values.c)], [10, 4])
    places, moves = rng.integers(0, 14, evaluations), rng.integers(1, 7, evaluations)
    moves *= rng.choice([-1, 1], evaluations)
    chances, heat = rng.uniform(size=evaluations), np.geomspace(0.01, 2e-4, evaluations)
    here, sums = start.copy(), table @ logs + shift
    cost = float(np.abs(sums[:-1]).max())
    best, least = here.copy(), cost
    for place, move, chance, temperature in zip(places, moves, chances, heat, strict=True):
        old = here[place]
        new = min(max(old + move, 0), limits[place] - 1)
        after = sums + table[:, place] * (tables[place][new] - tables[place][old])
        now = float(np.abs(after[:-1]).max())
        good = band[0] <= after[-1] <= band[1]
        if good and (now <= cost or chance < np.exp((cost - now) / temperature)):
            here[place], sums, cost = new, after, now
            if cost < least:
                best, least = here.copy(), cost
    return best


def _linear(values: Values, rules: Rules) -> tuple[Array, Array]:
    """(k + 1, 14) and (k + 1,): combinations of errors, last the time scale, of the logarithms."""
    zero = values._replace(r=np.zeros(1), c=np.zeros(1))
    none = np.zeros((1, 14), dtype=np.int64)
    h0 = residuals(zero, rules, none)[0][0]
    columns = []
    for i in range(14):
        one = zero._replace(r=np.array([0.0, 1.0]), c=np.array([0.0, 1.0]))
        parts = none.copy()
        parts[0, i] = 1
        columns.append(residuals(one, rules, parts)[0][0] - h0)
    M = np.column_stack(columns)
    tau = -M[:4].mean(axis=0)
    tau[11] += 1.0
    return np.vstack([VECTORS @ M, tau]), np.append(VECTORS @ h0, -h0[:4].mean())


def one_hot(values: Values, rules: Rules, seconds: float) -> tuple[Index | None, float]:
    """The naive program: one binary for each value in each place. Parts and the bound it proved."""
    choice = [cp.Variable(len(values.r if i < 10 else values.c), boolean=True) for i in range(14)]
    logs = [(values.r if i < 10 else values.c) @ z for i, z in enumerate(choice)]
    r1, r2, r3, r4, r5, r7, r8, r9, r10, r11, c1, c2, c3, c4 = logs
    w2, w3, w4, w5, w8, w9, w10, w11 = rules.w
    tau = cp.Variable(bounds=[float(rules.seconds[0]), float(rules.seconds[1])])
    p, q1, q3 = (cp.Variable(bounds=[-20.0, 20.0]) for _ in range(3))
    error = cp.Variable(bounds=[0.0, 10.0])
    ten = [
        tau - r2 - c2 - w2, tau - r9 - c4 - w9, tau + p - r3 - c2 - w3, tau - p - r8 - c4 - w8,
        tau + q1 - r4 - c2 - w4, tau - p + q1 - r10 - c4 - w10, tau + p + q3 - r5 - c2 - w5,
        tau + q3 - r11 - c4 - w11, tau - q1 - r1 - c1, tau - q3 - r7 - c3,
    ]  # fmt: skip
    rules_ = [cp.sum(z) == 1 for z in choice]
    rules_ += [cp.abs(e) <= error for e in ten]
    problem = cp.Problem(cp.Minimize(error), rules_)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # cvxpy warns that a time limit was reached
        problem.solve(solver=cp.HIGHS, time_limit=seconds, threads=1, random_seed=0)
    stats = problem.solver_stats.extra_stats
    bound = float(getattr(stats, "mip_dual_bound", 0.0))
    if choice[0].value is None:
        return None, bound
    return np.array([int(np.argmax(z.value)) for z in choice], dtype=np.int64), bound
