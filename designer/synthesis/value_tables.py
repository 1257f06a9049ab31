"""Tables of part values: every combination of a few lists, with the parts that must be equal.

A table is the first step of each search: it holds the combinations of the parts of one product or
ratio, so that sums of logarithms of two tables can be joined by sorting.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np

from designer.base.arrays import Array, Index, Mask

DIGITS = 11
"""Decimals of a logarithm to which two combinations count as the same."""


@dataclass(frozen=True)
class ValueTable:
    """Combinations of values."""

    names: tuple[str, ...]
    values: Array
    """(rows, parts) values [ohm], parts in the order of ``names``."""

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, name: str) -> Array:
        """(rows,) values of one part."""
        return np.asarray(self.values[:, self.names.index(name)])

    @property
    def columns(self) -> dict[str, Array]:
        """Values by part."""
        return {name: self[name] for name in self.names}

    def take(self, which: Index | Mask) -> ValueTable:
        """The rows of an index or mask array."""
        return ValueTable(self.names, self.values[which])

    def joined_with(self, other: ValueTable) -> ValueTable:
        """The columns of both, row by row."""
        return ValueTable(self.names + other.names, np.hstack([self.values, other.values]))

    def with_column(self, name: str, values: Array) -> ValueTable:
        """The values (rows,) of one more part."""
        return self.joined_with(ValueTable((name,), values[:, None]))

    @classmethod
    def stacked(cls, tables: Sequence[ValueTable]) -> ValueTable:
        """The rows of all tables; their names are the same."""
        return cls(tables[0].names, np.concatenate([t.values for t in tables]))


def combinations(
    names: Sequence[str], lists: Mapping[str, Array], group: Mapping[str, str]
) -> ValueTable:
    """Every combination of the lists; parts of the same group are equal.

    lists : ascending values by part. group : by part; absent: a group of its own.
    """
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(group.get(name, name), []).append(name)
    own = [reduce(np.intersect1d, [lists[name] for name in same]) for same in groups.values()]
    grid = dict(zip(groups, np.meshgrid(*own, indexing="ij"), strict=True))
    columns = [grid[group.get(name, name)].ravel() for name in names]
    return ValueTable(tuple(names), np.stack(columns, axis=1))


def distinct(logs: Array) -> Array:
    """The different entries of an array of logarithms, ascending."""
    return np.unique(np.round(logs, DIGITS))


def sums(first: Array, second: Array) -> Array:
    """Every different sum of one entry of each."""
    return distinct((first[:, None] + second[None, :]).ravel())


def distance(table: Array, low: Array, high: Array) -> Array:
    """The distance from each interval [low, high] to the nearest entry of an ascending table; 0
    inside."""
    if len(table) == 0:
        return np.full(len(low), np.inf)
    right = np.searchsorted(table, low)
    above = table[np.minimum(right, len(table) - 1)] - high
    above = np.where(right < len(table), np.maximum(above, 0.0), np.inf)
    below = np.where(right > 0, low - table[np.maximum(right - 1, 0)], np.inf)
    return np.asarray(np.minimum(above, below))


def between(table: Array, low: Array, high: Array) -> tuple[Index, Index]:
    """(interval, entry) for every entry of an ascending table inside each interval."""
    first = np.searchsorted(table, low, side="left")
    last = np.searchsorted(table, high, side="right")
    count = np.maximum(last - first, 0)
    row = np.repeat(np.arange(len(low)), count)
    offset = np.arange(int(count.sum())) - np.repeat(np.cumsum(count) - count, count)
    return row, np.repeat(first, count) + offset


def how_many_between(table: Array, low: Array, high: Array) -> Index:
    """How many entries of an ascending table each interval holds."""
    first = np.searchsorted(table, low, side="left")
    return np.asarray(np.maximum(np.searchsorted(table, high, side="right") - first, 0))


def new_values(values: Array, free: frozenset[float]) -> Index:
    """(rows,) how many different values each row has that are not free."""
    columns = np.ascontiguousarray(np.moveaxis(values, -1, 0))  # row by row takes twice as long
    fresh = ~np.isin(columns, np.array(sorted(free), dtype=float))
    for k, column in enumerate(columns):
        for before in columns[:k]:
            fresh[k] &= column != before
    return np.asarray(fresh.sum(axis=0))


def fewest_of_each(
    table: ValueTable, logs: Array, free: frozenset[float], largest: Array | None = None
) -> ValueTable:
    """One row for each different logarithm (rows,), ascending: that with the fewest values that are
    not free, and with ``largest`` (rows,) also the one where that is largest; of equals the first.
    """
    if len(table) == 0:
        return table
    keys = np.round(logs, DIGITS)
    order = np.argsort(keys, kind="stable")
    begins = np.append(True, keys[order[1:]] != keys[order[:-1]])
    kept = begins & np.append(begins[1:], True)
    # Of large tables most rows are alone: only the others are ranked.
    rest = np.flatnonzero(~kept)
    rows, group = order[rest], np.cumsum(begins)[rest]
    first = begins[rest]
    kinds = new_values(table.values[rows], free)
    for rank in (kinds, *([] if largest is None else [-largest[rows]])):
        kept[rest[np.lexsort((rank, group))[first]]] = True
    return table.take(order[kept])


def inside(values: Array, limits: tuple[float, float]) -> Mask:
    """Which values lie in a range, its ends included."""
    return np.asarray((values >= limits[0] * (1.0 - 1e-9)) & (values <= limits[1] * (1.0 + 1e-9)))
