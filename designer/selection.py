"""The mixed-integer program that turns ratios into parts: least error, fewest kinds, least price.

Input is a complete ``RatioTable`` at some level and its completions (``designer.completion``).
cvxpy and HiGHS choose one completion of each mass that agree, with the four scales as continuous
variables. The solver's status is never believed: the choice is rebuilt from its rows and its error
computed afresh.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import cvxpy as cp
import numpy as np

from designer.completion import Bounds, Side, groups_of, sides_of
from designer.linear_block import RatioTable, Targets
from designer.minimax import minimax
from designer.system import Array, Index

KEEP_GROUPS, KEEP_ROWS = 40, 20
"""Where more choices share the least error than the program can hold: how many go in."""
LARGEST = 3000
"""Rows that the program holds without leaving any out."""
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


@dataclass(frozen=True)
class Selection:
    """Values by part name, the error reached, whether nothing was left out, the solver's word."""

    values: dict[str, float]
    error: float
    complete: bool
    solver: str


class Choice(NamedTuple):
    """Row of the first and of the second side, and the solver's word for it."""

    first: int
    second: int
    status: str


@dataclass(frozen=True)
class Shortfall:
    """No completion: what leaves none, and whether every one was looked at."""

    what: str
    whole: bool


@dataclass(frozen=True)
class Pool:
    """What the program chooses from, each row's values in logarithms.

    own : (groups, 6) ln of R2, R3, R8, R9, C2, C4. first, second : completions of the masses.
    """

    groups: RatioTable
    own: Array
    first: Side
    second: Side

    @property
    def rows(self) -> int:
        return len(self.first) + len(self.second)

    def take(self, first: Index, second: Index) -> Pool:
        return Pool(self.groups, self.own, self.first.take(first), self.second.take(second))

    def values(self, i: int, j: int) -> dict[str, float]:
        """ln of every part for row i of the first and row j of the second side."""
        g = int(self.first.group[i])
        names = ("R2", "R3", "R8", "R9", "C2", "C4")
        out = dict(zip(names, (float(v) for v in self.own[g]), strict=True))
        for side, row, parts in (
            (self.first, i, ("R4", "R10", "R1", "C1")),
            (self.second, j, ("R5", "R11", "R7", "C3")),
        ):
            found = (side.upper, side.lower, side.resistor, side.capacitor)
            out |= {name: float(v[row]) for name, v in zip(parts, found, strict=True)}
        return out


def select(
    table: RatioTable,
    resistors: Array,
    capacitors: Array,
    prices: Array,
    t: Targets,
    bounds: Bounds,
    level: float,
) -> Selection | Shortfall:
    """The best completion with error at most ``level``, or what leaves none.

    prices : price class of each capacitor (k,); resistors of a grade cost the same.
    """
    r: Array = np.log(resistors)
    c: Array = np.log(capacitors)
    groups, c2, c4, all_of_them = groups_of(table, c, bounds)
    if len(groups) == 0:
        return Shortfall("frequency", table.complete and all_of_them)
    first, second = sides_of(groups, c2, c4, r, c, t, bounds, level)
    both = np.intersect1d(first.group, second.group)
    whole = table.complete and all_of_them and first.whole and second.whole
    if len(both) == 0:
        return Shortfall("displacement integrators", whole)
    own = np.stack([groups.r2, groups.r3, groups.r8, groups.r9, c2, c4], axis=1)
    pool = Pool(groups, own, first, second).take(
        np.flatnonzero(np.isin(first.group, both)), np.flatnonzero(np.isin(second.group, both))
    )
    found = _least_error(pool, t, bounds, level)
    if found is None:
        return Shortfall("displacement integrators", whole and pool.rows <= LARGEST)
    complete = whole and found[0] is pool and found[1].status == cp.OPTIMAL
    pool, chosen = found
    logs = pool.values(chosen.first, chosen.second)
    error = _error(logs, t)
    if error > level * (1.0 + 1e-6) + 1e-9:
        return Shortfall("coefficients", False)
    few = _promising(pool)
    cost = dict(zip(np.round(c, 9).tolist(), prices.tolist(), strict=True))
    again = _solve(few, t, bounds, error + 1e-9, cost)
    if again is not None:
        fewer = few.values(again.first, again.second)
        logs = fewer if _error(fewer, t) <= error + 2e-9 else logs
    return Selection(
        values={name: float(np.exp(v)) for name, v in logs.items()},
        error=_error(logs, t),
        complete=complete,
        solver=f"HiGHS: {chosen.status}",
    )


def _least_error(
    pool: Pool, t: Targets, bounds: Bounds, level: float
) -> tuple[Pool, Choice] | None:
    """The pool that the program was given, and its rows of least error.

    A pool that is too large is cut to the rows with the fewest kinds; where none of them will do,
    the cut is made wider.
    """
    if pool.rows <= LARGEST:
        chosen = _solve(pool, t, bounds, level, None)
        return None if chosen is None else (pool, chosen)
    for wider in (1, 4, 16):
        few = _fewest_kinds(pool, wider)
        chosen = _solve(few, t, bounds, level, None)
        if chosen is not None:
            return few, chosen
    return None


def residual_system(v: dict[str, float], t: Targets) -> tuple[Array, Array]:
    """(10,) offsets and (10, 4) scales (alpha, p, q1, q3) of the coefficient errors."""
    delta = v["C4"] - v["C2"]
    rows = [
        (-v["R2"] - t.w2, 1, 0, 0, 0),
        (-delta - v["R9"] - t.w9, 1, 0, 0, 0),
        (-v["R3"] - t.w3, 1, 1, 0, 0),
        (-delta - v["R8"] - t.w8, 1, -1, 0, 0),
        (-v["R4"] - t.w4, 1, 0, 1, 0),
        (-delta - v["R10"] - t.w10, 1, -1, 1, 0),
        (-v["R5"] - t.w5, 1, 1, 0, 1),
        (-delta - v["R11"] - t.w11, 1, 0, 0, 1),
        (v["C2"] - v["R1"] - v["C1"], 1, 0, -1, 0),
        (v["C2"] - v["R7"] - v["C3"], 1, 0, 0, -1),
    ]
    table = np.array(rows, dtype=float)
    return table[:, 0], table[:, 1:]


def _error(logs: dict[str, float], t: Targets) -> float:
    """The least max error of these values, from the values alone."""
    h, D = residual_system(logs, t)
    return float(np.abs(h + D @ minimax(h, D)).max())


def _solve(
    pool: Pool, t: Targets, bounds: Bounds, level: float, cost: dict[float, float] | None
) -> Choice | None:
    """Rows of least error, or with ``cost`` of fewest kinds and least price; or None."""
    first, second, own = pool.first, pool.second, pool.own
    z1 = cp.Variable(len(first), boolean=True)
    z2 = cp.Variable(len(second), boolean=True)
    # Bounded, since an infinite bound times a zero coefficient warns inside cvxpy.
    scales, error = cp.Variable(4, bounds=[-60.0, 60.0]), cp.Variable(nonneg=True)
    names = np.unique(first.group)
    member1 = (first.group[None, :] == names[:, None]).astype(float)
    member2 = (second.group[None, :] == names[:, None]).astype(float)
    # Every residual is linear in the choice: its offset with each row's values, the other's zero.
    offsets1 = np.array([_offsets(pool, i, None, t) for i in range(len(first))])
    offsets2 = np.array([_offsets(pool, None, j, t) for j in range(len(second))])
    _, D = residual_system(dict.fromkeys(_PARTS, 0.0), t)
    residuals = offsets1.T @ z1 + offsets2.T @ z2 + D @ scales
    rules = [
        cp.sum(z1) == 1,
        cp.sum(z2) == 1,
        member1 @ z1 == member2 @ z2,
        cp.abs(residuals) <= error,
        error <= level * (1.0 + 1e-6) + 1e-9,
    ]
    if np.isfinite(bounds.share):
        peaks, share = np.log(bounds.peaks), float(np.log(bounds.share))
        # ln of x2's peak voltage over x1's: -q1 + p + q3.
        rules.append(peaks[2] - peaks[0] - scales[2] + scales[1] + scales[3] <= share)
    objective = error
    if cost is not None:
        kinds, used = _kinds(pool, z1, z2)
        price1 = _price(first.capacitor, cost)
        for column in own[:, 4:].T:  # C2 and C4
            price1 = price1 + _price(column[first.group], cost)
        objective = cp.sum(kinds) + PRICE_WEIGHT * (
            price1 @ z1 + _price(second.capacitor, cost) @ z2
        )
        rules += used
    problem = cp.Problem(cp.Minimize(objective), rules)
    problem.solve(solver=cp.HIGHS, **SOLVER)
    for z in (z1, z2):
        if z.value is None or abs(z.value.sum() - 1.0) > 1e-6 or abs(z.value.max() - 1.0) > 1e-6:
            return None
    return Choice(int(np.argmax(z1.value)), int(np.argmax(z2.value)), str(problem.status))


_PARTS = ("R1", "R2", "R3", "R4", "R5", "R7", "R8", "R9", "R10", "R11", "C1", "C2", "C3", "C4")


def _offsets(pool: Pool, i: int | None, j: int | None, t: Targets) -> Array:
    """Offsets of the residuals that one row brings; the first side brings group and targets too."""
    logs = dict.fromkeys(_PARTS, 0.0)
    if i is not None:
        second = ("R5", "R11", "R7", "C3")
        logs |= {k: v for k, v in pool.values(i, 0).items() if k not in second}
        return residual_system(logs, t)[0]
    assert j is not None
    side = pool.second
    logs |= {"R5": side.upper[j], "R11": side.lower[j], "R7": side.resistor[j]}
    logs["C3"] = side.capacitor[j]
    return residual_system(logs, _NO_TARGETS)[0]


_NO_TARGETS = Targets(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def _price(logs: Array, cost: dict[float, float]) -> Array:
    return np.array([cost.get(round(float(v), 9), 0.0) for v in logs])


def _kinds(pool: Pool, z1: cp.Variable, z2: cp.Variable) -> tuple[cp.Variable, list[object]]:
    """One variable per value, at least as large as the use that any position makes of it."""
    first, second = pool.first, pool.second
    uses = [(z1, column[first.group]) for column in pool.own.T]
    uses += [(z1, v) for v in (first.upper, first.lower, first.resistor, first.capacitor)]
    uses += [(z2, v) for v in (second.upper, second.lower, second.resistor, second.capacitor)]
    every = np.unique(np.round(np.concatenate([v for _, v in uses]), 9))
    kinds = cp.Variable(len(every), nonneg=True)
    rules: list[object] = []
    for z, values in uses:
        own, where = np.unique(np.round(values, 9), return_inverse=True)
        member = (where[None, :] == np.arange(len(own))[:, None]).astype(float)
        rules.append(member @ z <= kinds[np.searchsorted(every, own)])
    return kinds, rules


def _side_values(side: Side) -> Array:
    """(k, 4) ln of a side's own values."""
    return np.stack([side.upper, side.lower, side.resistor, side.capacitor], axis=1)


def _distinct(values: Array) -> Array:
    """How many distinct values each row has."""
    ordered = np.sort(np.round(values, 9), axis=-1)
    return np.asarray(1 + (np.diff(ordered, axis=-1) > 1e-8).sum(axis=-1))


def _kinds_of(pool: Pool, side: Side) -> Array:
    """Distinct values of a row together with its group: no choice with it has fewer."""
    return _distinct(np.concatenate([pool.own[side.group], _side_values(side)], axis=1))


def _fewest_kinds(pool: Pool, wider: int) -> Pool:
    """The groups and rows with the fewest distinct values; ``wider`` times the usual groups."""
    kinds = [_kinds_of(pool, side) for side in (pool.first, pool.second)]
    sides = (pool.first, pool.second)
    least = np.zeros(len(pool.own))
    for side, count in zip(sides, kinds, strict=True):
        best = np.full(len(pool.own), np.inf)
        np.minimum.at(best, side.group, count.astype(float))
        least += best
    chosen = np.argsort(least, kind="stable")[: wider * KEEP_GROUPS]
    keep = []
    for side, count in zip(sides, kinds, strict=True):
        rows: list[int] = []
        for group in chosen:
            own = np.flatnonzero(side.group == group)
            rows += [
                int(k) for k in own[np.argsort(count[own], kind="stable")[: wider * KEEP_ROWS]]
            ]
        keep.append(np.array(rows, dtype=np.intp))
    return pool.take(keep[0], keep[1])


def _promising(pool: Pool) -> Pool:
    """Without the rows that alone have more kinds than the best pair of rows together."""
    first, second = _side_values(pool.first), _side_values(pool.second)
    best = np.inf
    for group in np.unique(pool.first.group):
        a = first[pool.first.group == group]
        b = second[pool.second.group == group]
        i, j = (k.ravel() for k in np.meshgrid(np.arange(len(a)), np.arange(len(b))))
        own = np.tile(pool.own[group], (len(i), 1))
        if len(i):
            best = min(best, float(_distinct(np.concatenate([own, a[i], b[j]], axis=1)).min()))
    keep = [np.flatnonzero(_kinds_of(pool, side) <= best) for side in (pool.first, pool.second)]
    return pool.take(keep[0], keep[1])
