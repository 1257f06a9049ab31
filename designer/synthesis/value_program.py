"""The last step of sizing a dead zone: one row of each table, by a mixed-integer program.

Least error, then the fewest new values, then the lowest price. The tables are reduced before, so
the program is small; HiGHS solves it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from designer.base.arrays import Array, Index
from designer.linear_network.milp import (
    PRICE_WEIGHT,
    MixedProgram,
    Term,
    chosen_row,
    count_values,
    new_kinds,
)
from designer.synthesis.value_tables import ValueTable, new_values

ERROR_WEIGHT = 1e-4
"""Of the error over its limit: it decides where values and price are the same."""


@dataclass(frozen=True)
class TableRows:
    """One table of the program."""

    table: ValueTable
    """Values of the table."""
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
    program, columns = MixedProgram(), [t.table.values.T for t in tables]
    uses = [column for own in columns for column in own]
    free = np.array(sorted(ranking.free), dtype=float)
    every, members = new_kinds(uses, free)
    prices = [np.sum([_prices(c, ranking) for c in own], axis=0) for own in columns]
    # The order decides which of equal choices HiGHS finds: what the aim names comes first.
    aim = limit is not None
    kinds = max(len(every), 1)
    used = program.variables(kinds if aim else 0)
    picks = {k: program.binary(len(t)) for k, t in enumerate(tables) if aim and prices[k].any()}
    error = program.variables(1)
    picks |= {k: program.binary(len(t)) for k, t in enumerate(tables) if k not in picks}
    places = [picks[k] for k in range(len(tables))]
    for z in places:
        program.equal(1.0, (z, np.ones(len(z))))
    keys = np.unique(tables[0].key)
    own_keys = [(t.key[None, :] == keys[:, None]).astype(float) for t in tables]
    if len(keys) > 1:
        for member, z in zip(own_keys[1:], places[1:], strict=True):
            program.equal(0.0, (places[0], own_keys[0]), (z, -member))
    for rule in rules:
        total = list(zip(places, rule.weights, strict=True))
        if np.isfinite(rule.low):
            program.at_most(-rule.low, *((z, -w) for z, w in total))
        if np.isfinite(rule.high):
            program.at_most(rule.high, *total)
    for t, z in zip(tables, places, strict=True):
        program.at_most(0.0, (z, t.error), (error, -np.ones(1)))
    if ranking.most is not None and not aim:
        used = program.variables(kinds)
    if len(used):
        of_uses = [z for z, own in zip(places, columns, strict=True) for _ in own]
        count_values(program, used, of_uses, members)
    if ranking.most is not None:
        program.at_most(ranking.most, (used, np.ones(len(used))))
    costs: list[Term] = [(error, np.ones(1))]
    if limit is not None:
        costs = [(error, np.array([ERROR_WEIGHT / limit])), (used, np.ones(len(used)))]
        costs += [(z, PRICE_WEIGHT * price) for z, price in zip(places, prices, strict=True)]
        program.at_most(limit, (error, np.ones(1)))
    status, x = program.solve(*costs)
    chosen = [chosen_row(None if x is None else x[z]) for z in places]
    rows = tuple(row for row in chosen if row is not None)
    return (rows, status) if len(rows) == len(chosen) else None


def _prices(values: Array, ranking: Ranking) -> Array:
    return np.array([ranking.price.get(float(v), 0.0) for v in values])


def fewest(rows: TableRows, free: frozenset[float], most: int) -> Index:
    """Places of the ``most`` rows with the fewest new values, then the smallest error."""
    count = new_values(rows.table.values, free)
    return np.lexsort((rows.error, count))[:most]
