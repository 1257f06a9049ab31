"""The rows of a saturating stage that go into the program, and the program's choice."""

from __future__ import annotations

import numpy as np

from designer.base.arrays import Array
from designer.synthesis.saturating_tables import (
    SaturatingTables,
    bias,
    source_resistance,
    steep_gain,
)
from designer.synthesis.value_program import Ranking, TableRows, ValueRule, choose, fewest
from designer.synthesis.value_tables import (
    DIGITS,
    ValueTable,
    between,
    how_many_between,
    inside,
    new_values,
)

KEYS, ROWS, TRIES = 40, 20, 200
"""Values of u, rows of each table for each, that go into the program; values of u looked at."""
EXPANDED, NULLS = 400_000, 20_000
"""Rows of a join, of the slope's tables and of the others for one u, that are ranked by their new
values before the rest is left out."""
GROWTH = 3.0
"""Of the level, where no row keeps the rules that tie two tables."""


def rows_within(
    t: SaturatingTables, level: float, sure: float, free: frozenset[float]
) -> tuple[TableRows, TableRows] | None:
    """Rows of (R206, R207, R209, R210, R50) and of the rest, with a common u and errors inside
    ``level``; where there are more than the program can hold, those with the fewest new values.
    None where there are none.

    sure : a u that is among them in any case.
    """
    slopes = _slope_rows(t, level, sure, free)
    order = np.argsort(new_values(slopes.table.values, free), kind="stable")
    keys = list(dict.fromkeys(slopes.key[order].tolist()))
    known = int(np.argmin(np.abs(t.u - sure)))
    if known in keys:
        keys = [known, *(k for k in keys if k != known)]
    nulls: list[TableRows] = []
    for key in keys[:TRIES]:
        rows, _ = null_rows(t, key, level, free, NULLS)
        if len(rows):
            nulls.append(_fewest_and_best(rows, free))
        if len(nulls) == KEYS:
            break
    if not nulls:
        return None
    slopes = TableRows.stacked(
        [
            _fewest_and_best(slopes.take(np.flatnonzero(slopes.key == r.key[0])), free)
            for r in sorted(nulls, key=lambda r: int(r.key[0]))
        ]
    )
    return slopes, TableRows.stacked(nulls)


def _fewest_and_best(rows: TableRows, free: frozenset[float]) -> TableRows:
    """The ``ROWS`` rows with the fewest new values, and the one of least error."""
    return rows.take(np.union1d(fewest(rows, free, ROWS), [int(np.argmin(rows.error))]))


def _slope_rows(
    t: SaturatingTables, level: float, sure: float, free: frozenset[float]
) -> TableRows:
    low, high = np.log(t.target.slope)
    u = np.round(t.left_logs, DIGITS)
    q = t.right_logs  # ascending, as the rows of the table are
    count = how_many_between(q, low - level - u, high + level - u)
    # The u that is wanted in any case first, then those with the fewest new values.
    rank = np.lexsort((new_values(t.left.values, free), np.abs(u - sure) > 1e-9))
    rank = rank[count[rank] > 0]
    rank = rank[: max(1, int(np.searchsorted(np.cumsum(count[rank]), EXPANDED)))]
    row, hit = between(q, low - level - u[rank], high + level - u[rank])
    i, j = rank[row], hit
    total = u[i] + t.right_logs[j]
    error = np.maximum(np.maximum(low - total, total - high), 0.0)
    table = t.left.take(i).beside(t.right.take(j))
    return TableRows(table, error, np.searchsorted(t.u, u[i] - 1e-12))


def null_rows(
    t: SaturatingTables,
    key: int,
    level: float,
    free: frozenset[float] = frozenset(),
    most: int = EXPANDED,
) -> tuple[TableRows, bool]:
    """Every row of R200 … R205, R208 (and R211, R212) for one u with errors inside ``level``, and
    whether some with many new values had to be left out."""
    steep, i, j = t.steep_logs
    u = float(t.u[key])
    wide = level / t.target.mu
    d = t.divider_logs  # ascending, as the rows of the table are
    wanted = steep - u
    rank = np.arange(len(steep))
    if t.shift is not None:
        near = t.shift.take(np.abs(t.shift_logs - u) <= t.shift_reach(level))
        rank = np.flatnonzero(np.isin(t.first["R200"][i], near["R200"]))
    count = how_many_between(d, wanted[rank] - wide, wanted[rank] + wide)
    rank, count = rank[count > 0], count[count > 0]
    cut = bool(count.sum() > most)
    if cut:
        kinds = new_values(np.hstack([t.first.values[i[rank]], t.second.values[j[rank]]]), free)
        order = np.argsort(kinds, kind="stable")
        rank = rank[order[: max(1, int(np.searchsorted(np.cumsum(count[order]), most)))]]
    row, hit = between(d, wanted[rank] - wide, wanted[rank] + wide)
    a = rank[row]
    table = t.first.take(i[a]).beside(t.second.take(j[a])).beside(t.divider.take(hit))
    error = t.target.mu * np.abs(wanted[a] - d[hit])
    if t.shift is not None:
        table, error = _with_shift(t, near, table, error, u, level)
    return TableRows(table, error, np.full(len(table), key)), cut


def _with_shift(
    t: SaturatingTables, near: ValueTable, table: ValueTable, error: Array, u: float, level: float
) -> tuple[ValueTable, Array]:
    """The rows completed by R211 and R212 with the same R200, their bias error counted."""
    order = np.argsort(near["R200"], kind="stable")
    own = near.take(order)
    row, hit = between(own["R200"], table["R200"] - 1e-6, table["R200"] + 1e-6)
    both = table.take(row).beside(ValueTable(("R211", "R212"), own.take(hit).values[:, 1:]))
    error = error[row]
    shift = steep_gain(both.columns) * t.target.supply * both["R200"] / both["R211"]
    # Only what lies in the range of c has a threshold at all.
    good = np.flatnonzero(inside(shift / t.target.farthest, t.box.shift))
    both, error = both.take(good), error[good]
    worst = np.maximum(error, np.abs(bias(t.target, both.columns, np.exp(u))))
    good = np.flatnonzero(worst <= level)
    return both.take(good), worst[good]


def noise_rules(t: SaturatingTables, slopes: TableRows, nulls: TableRows) -> list[ValueRule]:
    """U3D's noise gain 1 + R210/R209 + R210/(R208 + R204 || R205), as one rule in logarithms."""
    if not np.isfinite(t.box.noise_gain):
        return []
    s, n = slopes.table, nulls.table
    rest = t.box.noise_gain - 1.0 - s["R210"] / s["R209"]
    # Where R209 alone takes all of it, no row of the other table will do.
    need = np.where(rest > 0.0, np.log(s["R210"] / np.where(rest > 0.0, rest, 1.0)), 1e3)
    have = np.log(source_resistance(n.columns))
    return [ValueRule((-need, have), -1e-9, np.inf)]


def pick(
    t: SaturatingTables, least: float, u: float, ranking: Ranking, last: float
) -> tuple[dict[str, float], str] | None:
    """Values that keep every rule, with the error as small as the program finds; and its word."""
    level = max(least, ranking.tolerance) + ranking.slack
    while level <= last * GROWTH:
        rows = rows_within(t, level * (1.0 + 1e-9) + 1e-10, u, ranking.free)
        choice = None if rows is None else choose(rows, noise_rules(t, *rows), ranking)
        if rows is not None and choice is not None:
            (i, j), status = choice
            chosen = rows[0].table.take(np.array([i])).beside(rows[1].table.take(np.array([j])))
            return dict(zip(chosen.names, chosen.values[0].tolist(), strict=True)), status
        level *= GROWTH
    return None
