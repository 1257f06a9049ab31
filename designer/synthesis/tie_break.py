"""The mixed-integer program that chooses among equals: fewest distinct values, least price.

The joins leave every choice that reaches the least error, and elementary inequalities those of
them that can have the fewest distinct values. cvxpy and HiGHS choose one completion of each mass
that agree, with the four scales as continuous variables. The solver is not believed: its choice
is rebuilt from the values and its error computed afresh.
"""

from __future__ import annotations

from dataclasses import dataclass

import cvxpy as cp
import numpy as np

from designer.base.arrays import Array, Index
from designer.base.progress import doing
from designer.circuit.scale_fit import minimax
from designer.synthesis.kernel_linear import Rules, Values, gather
from designer.synthesis.linear_block import PARTS, residuals_of, slice_from

ROOM, GROUPS, COMPLETIONS = 1 << 13, 1 << 12, 1 << 14
"""Completions of one mass that are held for one group; groups and completions in all."""
LARGEST = 300
"""Completions that the program holds; of more, those with the fewest values and least price."""
SOLVER: dict[str, float | int] = {
    "mip_rel_gap": 0.0,
    "mip_abs_gap": 1e-9,
    "mip_feasibility_tolerance": 1e-9,
    "primal_feasibility_tolerance": 1e-9,
    "random_seed": 0,
    "threads": 1,
}
"""HiGHS options; they stand in the provenance. No time limit: it would make answers differ."""
PRICE_WEIGHT = 1e-3
"""Of one price class against one distinct value: price only breaks ties."""
LEAST_UNIT = 1e-9
"""Errors are counted in units of the limit, and that is at least this."""


OWN = [PARTS.index(name) for name in ("R2", "R9", "R3", "R8", "C2", "C4")]
FIRST = [PARTS.index(name) for name in ("R4", "R10", "R1", "C1")]
SECOND = [PARTS.index(name) for name in ("R5", "R11", "R7", "C3")]
"""Places of a row's own parts, and of those that a completion of each mass brings."""


@dataclass(frozen=True)
class Shortfall:
    """There is no choice."""

    what: str
    """What leaves no choice."""
    whole: bool
    """Whether every choice was looked at."""


@dataclass(frozen=True)
class Pool:
    """What the program chooses from: indices of values."""

    parts1: Index
    """(k, 14) completions of the first mass with its group's own parts, -1 elsewhere."""
    group1: Index
    """(k,) group of each completion of the first mass."""
    parts2: Index
    """(k, 14) completions of the second mass with its group's own parts, -1 elsewhere."""
    group2: Index
    """(k,) group of each completion of the second mass."""
    fewest: int
    """Distinct values that can be reached."""
    whole: bool
    """Whether nothing that could have as few is missing."""


@dataclass(frozen=True)
class Selection:
    """What the program chose."""

    parts: Index
    """(14,) indices of the values chosen."""
    solver: str
    """The solver's word."""


def pool_of(
    values: Values, rules: Rules, parts: Index, limit: float, prices: Array, patience: int
) -> tuple[Pool, Index]:
    """The completions that can belong to a choice of the fewest values, and one such choice.

    parts : (14,) a choice with an error of at most ``limit``. patience : steps to take.
    """
    best, fewest = parts.copy(), int(kinds_of(rules, parts[None, :])[0])
    first, second, label = [_rows_of(best, FIRST)], [_rows_of(best, SECOND)], 1
    labels1, labels2 = [np.zeros(1, dtype=np.int64)], [np.zeros(1, dtype=np.int64)]
    start, whole, slices = 0, True, len(values.deltas) * len(values.r)
    while start < slices and patience > 0:
        doing(f"choices of least error, {start / slices:.0%}")
        fewer = rules._replace(most=min(rules.most, fewest))
        piece = slice_from(values, fewer, limit, start, patience)
        groups = np.zeros((GROUPS, 2), dtype=np.int64)
        own1 = np.zeros((COMPLETIONS, 5), dtype=np.int64)
        own2 = np.zeros((COMPLETIONS, 5), dtype=np.int64)
        now = best.copy()
        count, n, n1, n2, full, taken = gather(
            values, fewer, piece.rows, limit, patience, ROOM, fewest, groups, own1, own2, now
        )
        if count < fewest:
            best, fewest = now, count
        own1, own2, rows = own1[:n1], own2[:n2], piece.rows[groups[:n, 0]]
        group = np.full((n, 14), -1, dtype=np.int64)
        group[:, OWN] = np.column_stack(
            [rows[:, 1:5], values.delta_c2[groups[:n, 1]], values.delta_c4[groups[:n, 1]]]
        )
        for own, places, into, labels in (
            (own1, FIRST, first, labels1),
            (own2, SECOND, second, labels2),
        ):
            filled = group[own[:, 0]]
            filled[:, places] = own[:, 1:]
            into.append(filled)
            labels.append(own[:, 0] + label)
        label, start = label + n, piece.following
        whole = whole and full and not piece.cut
        patience -= piece.steps + taken
    whole = whole and start == slices
    pool = Pool(
        np.concatenate(first),
        np.concatenate(labels1),
        np.concatenate(second),
        np.concatenate(labels2),
        fewest,
        whole,
    )
    return _largest(rules, pool, prices), best


def _rows_of(parts: Index, places: list[int]) -> Index:
    """(1, 14) the group's own parts and those of one mass."""
    kept = np.isin(np.arange(14), [*OWN, *places])
    return np.where(kept, parts, -1)[None, :]


def _largest(rules: Rules, pool: Pool, prices: Array) -> Pool:
    """Without the rows that have too many values by themselves, and no larger than the program
    can be: groups and rows with the fewest values and the lowest price first, and always the
    choice that is known."""
    sides = []
    for parts, group in ((pool.parts1, pool.group1), (pool.parts2, pool.group2)):
        kinds = kinds_of(rules, parts)
        price = np.where(parts[:, 10:] >= 0, prices[np.maximum(parts[:, 10:], 0)], 0.0).sum(axis=1)
        order = np.lexsort((np.arange(len(parts)), price, kinds))
        order = order[kinds[order] <= pool.fewest]
        sides.append((parts[order], group[order], kinds[order]))
    (parts1, group1, kinds1), (parts2, group2, kinds2) = sides
    both = np.intersect1d(group1, group2)
    least = [kinds1[group1 == g].min() + kinds2[group2 == g].min() for g in both]
    taken1, taken2 = np.zeros(len(parts1), dtype=bool), np.zeros(len(parts2), dtype=bool)
    room, cut = LARGEST, False
    for g in [0, *both[np.argsort(least, kind="stable")].tolist()]:
        for group, taken in ((group1, taken1), (group2, taken2)):
            own = np.flatnonzero((group == g) & ~taken)
            share = max(room // 2, 0)
            taken[own[:share]] = True
            cut = cut or len(own) > share
        room = LARGEST - int(taken1.sum() + taken2.sum())
    return Pool(
        parts1[taken1],
        group1[taken1],
        parts2[taken2],
        group2[taken2],
        pool.fewest,
        pool.whole and not cut,
    )


def select(
    values: Values, rules: Rules, pool: Pool, parts: Index, limit: float, prices: Array
) -> Selection:
    """The choice of the pool with the fewest distinct values, then the lowest price.

    parts : (14,) a choice with an error of at most ``limit`` and ``pool.fewest`` values, which
    stands where the program has none. prices : price class of each capacitor.
    """
    status, found = _solve(values, rules, pool, limit, prices)
    if found is None:
        return Selection(parts, f"HiGHS: {status}")
    kept = (
        error_of(values, rules, found) <= limit + 2e-9
        and kinds_of(rules, found[None, :])[0] <= pool.fewest
        and _price(found, prices) <= _price(parts, prices)
        and not any(found[i] != found[j] for i, j in np.argwhere(rules.ties))
    )
    return Selection(found if kept else parts, f"HiGHS: {status}")


def residuals(values: Values, rules: Rules, parts: Index) -> tuple[Array, Array]:
    """(k, 10) offsets and (10, 4) scales (alpha, p, q1, q3) of the coefficient errors.

    parts : (k, 14) indices.
    """
    return residuals_of(values.r[parts[:, :10]], values.c[parts[:, 10:]], rules.w)


def error_of(values: Values, rules: Rules, parts: Index) -> float:
    """The least max error of one choice, by linear programming from its values alone."""
    h, D = residuals(values, rules, parts[None, :])
    return float(np.abs(h[0] + D @ minimax(h[0], D)).max())


def kinds_of(rules: Rules, parts: Index) -> Index:
    """Distinct values of each row of (k, 14) parts; without the preferred, -1 is no part."""
    many = len(rules.free_r)
    code = np.where(parts < 0, -1, parts + np.where(np.arange(14) < 10, 0, many)[None, :])
    free = np.concatenate([rules.free_r, rules.free_c, [True]])
    ordered = np.sort(np.where(free[code], -1, code), axis=1)
    fresh = np.diff(ordered, axis=1, prepend=-1) > 0
    return np.asarray(fresh.sum(axis=1))


def _price(parts: Index, prices: Array) -> float:
    return float(prices[parts[10:]].sum())


def _nominal(values: Values, rules: Rules, parts: Index) -> Array:
    """(k, 4) scales that make the errors small; q1 of first rows, q3 of second ones."""
    whole = np.maximum(parts, 0)
    h, _ = residuals(values, rules, whole)
    alpha = -h[:, :4].mean(axis=1)
    p = 0.5 * (h[:, 3] - h[:, 2])
    return np.stack([alpha, p, -h[:, 4] - alpha, -h[:, 7] - alpha], axis=1)


def _solve(
    values: Values, rules: Rules, pool: Pool, limit: float, prices: Array
) -> tuple[str, Index | None]:
    """The solver's status and the parts it chose, if it chose any."""
    unit = max(limit, LEAST_UNIT)
    z1 = cp.Variable(len(pool.parts1), boolean=True)
    z2 = cp.Variable(len(pool.parts2), boolean=True)
    shift = cp.Variable(4, bounds=[-100.0, 100.0])
    # Errors relative to each row's nominal scales, in units of the limit: small numbers only.
    offsets, scales = [], []
    for parts in (pool.parts1, pool.parts2):
        h, D = residuals(values, rules, np.maximum(parts, 0))
        own = _nominal(values, rules, parts)
        offsets.append((h + own @ D.T) / unit)
        scales.append(own)
    second = np.isin(np.arange(10), (6, 7, 9))
    offsets[0][:, second] = 0.0
    offsets[1][:, ~second] = 0.0
    groups = np.unique(pool.group1)
    member = [(g[None, :] == groups[:, None]).astype(float) for g in (pool.group1, pool.group2)]
    kinds, rest = _kinds(rules, pool, z1, z2)
    rest += [
        cp.sum(z1) == 1,
        cp.sum(z2) == 1,
        member[0] @ z1 == member[1] @ z2,
        cp.abs(offsets[0].T @ z1 + offsets[1].T @ z2 + D @ shift) <= 1.0 + 1e-7,
        kinds == pool.fewest,
    ]
    if np.isfinite(rules.share):
        # ln of x2's peak voltage over x1's: p - q1 + q3.
        first = scales[0][:, 1] - scales[0][:, 2]
        room = rules.share - rules.peaks[2] + rules.peaks[0] + 1e-9
        rest.append(first @ z1 + scales[1][:, 3] @ z2 <= room)
    for i, j in np.argwhere(rules.ties):
        if i not in SECOND and j in SECOND:
            rest.append(pool.parts1[:, i] @ z1 == pool.parts2[:, j] @ z2)
    price1 = prices[pool.parts1[:, [10, 11, 13]]].sum(axis=1)
    price2 = prices[pool.parts2[:, 12]]
    objective = kinds + PRICE_WEIGHT * (price1 @ z1 + price2 @ z2)
    problem = cp.Problem(cp.Minimize(objective), rest)
    problem.solve(solver=cp.HIGHS, **SOLVER)
    status = str(problem.status)
    for z in (z1, z2):
        if z.value is None or abs(z.value.sum() - 1.0) > 1e-6 or abs(z.value.max() - 1.0) > 1e-6:
            return status, None
    parts = pool.parts1[int(np.argmax(z1.value))].copy()
    parts[SECOND] = pool.parts2[int(np.argmax(z2.value))][SECOND]
    return status, parts


def _kinds(
    rules: Rules, pool: Pool, z1: cp.Variable, z2: cp.Variable
) -> tuple[cp.Expression, list[cp.Constraint]]:
    """The number of distinct values, at least as large as the use that any position makes."""
    many = len(rules.free_r)
    free = np.concatenate([rules.free_r, rules.free_c])
    uses = []
    for z, parts, places in (
        (z1, pool.parts1, [k for k in range(14) if k not in SECOND]),
        (z2, pool.parts2, SECOND),
    ):
        uses += [(z, parts[:, k] + (0 if k < 10 else many)) for k in places]
    every = np.unique(np.concatenate([code for _, code in uses]))
    every = every[~free[every]]
    used = cp.Variable(max(len(every), 1), nonneg=True)
    constraints: list[cp.Constraint] = []
    for z, code in uses:
        own = every[np.isin(every, code)]
        if len(own):
            member = (code[None, :] == own[:, None]).astype(float)
            constraints.append(member @ z <= used[np.searchsorted(every, own)])
    return cp.sum(used), constraints
