"""The last step of sizing a dead zone: one row of each table, by a mixed-integer program.

Least error, then the fewest new values, then the lowest price. The tables are reduced before, so
the program is small; cvxpy states it and HiGHS solves it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import TYPE_CHECKING, Any

import numpy as np

from designer.base.arrays import Array, Index
from designer.linear_network.milp import PRICE_WEIGHT, SOLVER, chosen_row, distinct_values
from designer.synthesis.value_tables import ValueTable, new_values

if TYPE_CHECKING:
    pass

ERROR_WEIGHT = 1e-4
"""Of the error over its limit: it decides where values and price are the same."""


@dataclass(frozen=True)
class TableRows:
    """One table of the program."""

    table: ValueTable
    error: Array
    """(rows,) error of each row."""
    key: Index
    """(rows,) key that the rows chosen from all tables must share."""

    def __len__(self) -> int:
        return len(self.table)

    def take(self, which: Index) -> TableRows:
        """The rows of an index array."""
        return TableRows(self.table.take(which), self.error[which], self.key[which])

    @classmethod
    def stacked(cls, rows: Sequence[TableRows]) -> TableRows:
        """The rows of all of them."""
        error, key = (np.concatenate([getattr(r, n) for r in rows]) for n in ("error", "key"))
        return cls(ValueTable.stacked([r.table for r in rows]), error, key)


@dataclass(frozen=True)
class ValueRule:
    """A rule on the rows chosen: low <= sum over the tables of the chosen row's weight <= high."""

    weights: tuple[Array, ...]
    """Weight of each row, table by table."""
    low: float
    """Least sum that keeps the rule."""
    high: float
    """Largest sum that keeps the rule."""


@dataclass(frozen=True)
class Ranking:
    """What counts after the error."""

    free: frozenset[float]
    """Values that cost nothing."""
    price: Mapping[float, float]
    """Price class by value."""
    tolerance: float
    """Errors up to it count as none."""
    slack: float
    """How far above its least the error may be."""
    most: int | None = None
    """Limit on new values."""


def choose(
    tables: Sequence[TableRows], rules: Sequence[ValueRule], ranking: Ranking
) -> tuple[tuple[int, ...], str] | None:
    """Rows with the same key that keep every rule, and HiGHS' word; None where there are none."""
    common = reduce(np.intersect1d, [t.key for t in tables])
    places = [np.flatnonzero(np.isin(t.key, common)) for t in tables]
    tables, rules = _restricted(tables, rules, places)
    if any(len(t) == 0 for t in tables):
        return None
    # With a limit on the values, only rows that stand in a choice inside it.
    near = [np.arange(len(t)) for t in tables]
    if ranking.most is not None:
        near = _few_enough(tables, rules, ranking)
        if any(len(k) == 0 for k in near):
            return None
    first = _solve(*_restricted(tables, rules, near), ranking, None)
    if first is None:
        return None
    rows, status = _in_full(near, first[0]), first[1]
    reached = max(float(t.error[i]) for t, i in zip(tables, rows, strict=True))
    limit = (max(reached, ranking.tolerance) + ranking.slack) * (1.0 + 1e-9) + 1e-12
    useful = _promising(tables, rules, ranking, limit)
    second = _solve(*_restricted(tables, rules, useful), ranking, limit)
    if second is not None:
        rows = _in_full(useful, second[0])
    return _in_full(places, rows), f"HiGHS: {status}"


def _in_full(places: Sequence[Index], rows: Sequence[int]) -> tuple[int, ...]:
    """Rows of restricted tables as rows of the whole ones."""
    return tuple(int(place[row]) for place, row in zip(places, rows, strict=True))


def _restricted(
    tables: Sequence[TableRows], rules: Sequence[ValueRule], places: Sequence[Index]
) -> tuple[list[TableRows], list[ValueRule]]:
    """The tables with these rows alone, and the rules for them."""
    fewer = [t.take(k) for t, k in zip(tables, places, strict=True)]
    weights = [tuple(w[k] for w, k in zip(rule.weights, places, strict=True)) for rule in rules]
    return fewer, [replace(rule, weights=w) for rule, w in zip(rules, weights, strict=True)]


def _promising(
    tables: Sequence[TableRows], rules: Sequence[ValueRule], ranking: Ranking, limit: float
) -> list[Index]:
    """Places of the rows that stand in some choice inside the limit with the fewest new values.

    The tables are short, so the choices of one key are simply counted; what is left to the program
    is the price, and the error where that is the same too.
    """
    inside = [np.flatnonzero(t.error <= limit) for t in tables]
    best = sum(t.table.values.shape[1] for t in tables)
    choices: list[list[Index]] = []
    for grid, count in _counted(tables, rules, ranking, inside):
        least = int(count.min(initial=best + 1))
        if least < best:
            best, choices = least, []
        if least == best:
            choices.append([np.unique(g[count == best]) for g in grid])
    return _joined(choices, inside)


def _few_enough(
    tables: Sequence[TableRows], rules: Sequence[ValueRule], ranking: Ranking
) -> list[Index]:
    """Places of the rows that stand in a choice of least error among those with at most
    ``ranking.most`` new values; none where there is no such choice."""
    every = [np.arange(len(t)) for t in tables]
    best, choices = np.inf, list[list[Index]]()
    for grid, count in _counted(tables, rules, ranking, every):
        few = count <= (len(count) if ranking.most is None else ranking.most)
        grid = [g[few] for g in grid]
        error = np.max([t.error[g] for t, g in zip(tables, grid, strict=True)], axis=0)
        least = float(error.min(initial=np.inf))
        if least < best:
            best, choices = least, []
        if len(error) and least == best:
            choices.append([np.unique(g[error == best]) for g in grid])
    return _joined(choices, [np.zeros(0, dtype=np.intp)] * len(tables))


def _counted(
    tables: Sequence[TableRows],
    rules: Sequence[ValueRule],
    ranking: Ranking,
    places: Sequence[Index],
) -> Iterator[tuple[list[Index], Index]]:
    """For each key the choices that keep the rules, and how many new values each has."""
    for key in np.unique(tables[0].key):
        own = [k[t.key[k] == key] for t, k in zip(tables, places, strict=True)]
        grid = [a.ravel() for a in np.meshgrid(*own, indexing="ij")]
        good = np.ones(len(grid[0]), dtype=bool)
        for rule in rules:
            total = sum(w[g] for w, g in zip(rule.weights, grid, strict=True))
            good &= (total >= rule.low) & (total <= rule.high)
        grid = [g[good] for g in grid]
        values = np.hstack([t.table.values[g] for t, g in zip(tables, grid, strict=True)])
        yield grid, new_values(values, ranking.free)


def _joined(choices: Sequence[Sequence[Index]], without: list[Index]) -> list[Index]:
    """The places of all keys together."""
    if not choices:
        return without
    return [np.unique(np.concatenate(places)) for places in zip(*choices, strict=True)]


def _solve(
    tables: Sequence[TableRows], rules: Sequence[ValueRule], ranking: Ranking, limit: float | None
) -> tuple[tuple[int, ...], str] | None:
    """Rows of least error; with a ``limit`` of the error, of fewest values and least price."""
    import cvxpy as cp  # takes a second

    picks = [cp.Variable(len(t), boolean=True) for t in tables]
    error = cp.Variable(nonneg=True)
    constraints: list[object] = [cp.sum(z) == 1 for z in picks]
    keys = np.unique(tables[0].key)
    members = [(t.key[None, :] == keys[:, None]).astype(float) for t in tables]
    if len(keys) > 1:
        for member, z in zip(members[1:], picks[1:], strict=True):
            constraints.append(members[0] @ picks[0] == member @ z)
    for rule in rules:
        total = sum(w @ z for w, z in zip(rule.weights, picks, strict=True))
        constraints += [total >= rule.low] if np.isfinite(rule.low) else []
        constraints += [total <= rule.high] if np.isfinite(rule.high) else []
    constraints += [t.error @ z <= error for t, z in zip(tables, picks, strict=True)]
    objective: Any = error
    if limit is not None or ranking.most is not None:
        uses = [(z, c) for t, z in zip(tables, picks, strict=True) for c in t.table.values.T]
        kinds, at_least = distinct_values(uses, np.array(sorted(ranking.free), dtype=float))
        constraints += at_least
    if ranking.most is not None:
        constraints.append(cp.sum(kinds) <= ranking.most)
    if limit is not None:
        price: Any = 0.0
        for z, column in uses:
            cost = np.array([ranking.price.get(float(v), 0.0) for v in column])
            price = price + cost @ z if cost.any() else price
        objective = cp.sum(kinds) + PRICE_WEIGHT * price + ERROR_WEIGHT / limit * error
        constraints.append(error <= limit)
    problem = cp.Problem(cp.Minimize(objective), constraints)
    problem.solve(solver=cp.HIGHS, **SOLVER)
    chosen = [chosen_row(z) for z in picks]
    rows = tuple(row for row in chosen if row is not None)
    return (rows, str(problem.status)) if len(rows) == len(chosen) else None


def fewest(rows: TableRows, free: frozenset[float], most: int) -> Index:
    """Places of the ``most`` rows with the fewest new values, then the smallest error."""
    count = new_values(rows.table.values, free)
    enough = np.partition(count, most - 1)[most - 1] if most < len(count) else np.inf
    few = np.flatnonzero(count <= enough)
    return np.asarray(few[np.lexsort((rows.error[few], count[few]))[:most]])
