"""The search for a saturating stage: from few values to the whole catalogue.

The values of u = ln A-/R209 are taken in the order of their slope error. The least largest error is
known as soon as the next slope error exceeds it: an exact minimum over every row of the tables.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from designer.base.arrays import Array
from designer.base.progress import doing
from designer.circuit.coefficients import EXACT
from designer.synthesis import saturating_tables
from designer.synthesis.dead_zone_target import DeadZone, DeadZoneTarget, parts_of
from designer.synthesis.equal_parts import EqualParts, with_equal_parts
from designer.synthesis.saturating_tables import (
    MOST_SHIFT,
    TABLES,
    Dividers,
    SaturatingTables,
    SearchBox,
    bias,
    source_resistance,
    steep_gain,
    tables,
)
from designer.synthesis.value_program import Ranking, TableRows, ValueRule, choose, fewest
from designer.synthesis.value_tables import (
    DIGITS,
    ValueTable,
    between,
    distance,
    distinct,
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
"""The factor on the level where no row keeps the rules that tie two tables."""


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
    table = t.left.take(i).joined_with(t.right.take(j))
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
    table = t.first.take(i[a]).joined_with(t.second.take(j[a])).joined_with(t.divider.take(hit))
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
    both = table.take(row).joined_with(ValueTable(("R211", "R212"), own.take(hit).values[:, 1:]))
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
            chosen = (
                rows[0].table.take(np.array([i])).joined_with(rows[1].table.take(np.array([j])))
            )
            return dict(zip(chosen.names, chosen.values[0].tolist(), strict=True)), status
        level *= GROWTH
    return None


LAST_LEVEL = 0.1
"""Errors above it are no answer."""
JOINT = 150
"""Values of u for which null and bias are sought together."""
LARGEST = 3_000_000
"""Rows of a table past which the whole catalogue is not enumerated."""
ROOMS = ((1.06, 1.6, 2.5), (1.2, 1.6, 2.5))
"""How far below its largest value each of threshold, A- and fv slope may lie: first and at most."""
OPEN = (np.inf, np.inf, np.inf)
HANDY = 8
"""Most values of a resistor that only sets a level, before all are tried."""
LEVEL_SETTERS = ("R200", "R202", "R206", "R208", "R209")
LIGHT = ("R205", "R211", "R212")
"""Resistors that no output drives."""


@dataclass(frozen=True)
class _Stage:
    """One stage of the search: values of each part [ohm] and ranges; whether the slope's tables, or
    all, hold every value that the conditions leave; whether it is only for where the ones before
    have no answer."""

    lists: Mapping[str, Array]
    box: SearchBox
    slope: bool = False
    whole: bool = False
    rescue: bool = False


@dataclass(frozen=True)
class _Least:
    """The least largest error of some tables, the u = ln A-/R209 that has it, and what no row of
    them passes, rules that tie the slope's tables to the others left out."""

    error: float
    u: float
    bound: float


@dataclass(frozen=True)
class _Found:
    """What the stages found: the tables with the least error, a bound of the whole catalogue, and
    where there is nothing the condition that binds."""

    best: tuple[SaturatingTables, _Least] | None
    bound: float
    binding: str

    @property
    def error(self) -> float:
        return LAST_LEVEL if self.best is None else self.best[1].error


def size(
    target: DeadZoneTarget, resistors: Array, base: float, ranking: Ranking, equal: EqualParts
) -> DeadZone | str:
    """The stage, or the name of the condition that leaves none. base : the first value tried for
    resistors that only set a level [ohm]."""
    if target.shift[0] >= MOST_SHIFT:
        return "dead-zone bias"
    so_far, dividers = _Found(None, 0.0, "stop slope"), Dividers()
    stages = _stages(target, resistors, base, ranking.free, equal)
    for number, stage in enumerate(stages, start=1):
        doing(f"dead zone, tables {number}")
        if stage.rescue and so_far.best is not None:
            break
        so_far = _search(target, stage, equal, ranking.free | {base}, so_far, dividers)
        if so_far.best is not None and so_far.error <= max(so_far.bound, 0.0) + EXACT:
            break
        if so_far.best is not None and stage.whole:
            break
    if so_far.best is None:
        return so_far.binding
    t, least = so_far.best
    doing("dead zone, fewest values")
    picked = pick(t, least.error, least.u, ranking, LAST_LEVEL)
    if picked is None:
        without = replace(ranking, most=None)
        free = None if without == ranking else pick(t, least.error, least.u, without, LAST_LEVEL)
        rule = "noise gain" if np.isfinite(target.noise_gain) else "dead-zone bias"
        return rule if free is None else "distinct values"
    values, status = picked
    values = {name: values[name] for name in parts_of(target.kind, target.sides)}
    return _answer(target, values, so_far.bound, status)


def _search(
    target: DeadZoneTarget,
    stage: _Stage,
    equal: EqualParts,
    free: frozenset[float],
    so_far: _Found,
    dividers: Dividers,
) -> _Found:
    """One stage, for every value of the parts that are equal across tables. dividers : as of
    ``tables``."""
    best, binding, bound = so_far.best, so_far.binding, np.inf
    for lists in with_equal_parts(stage.lists, equal, TABLES):
        if lists is None:
            bound = 0.0
            break
        level = LAST_LEVEL if best is None else best[1].error
        t = tables(target, lists, equal, stage.box, free, level, dividers)
        why = t.empty()
        if why is not None:
            binding = why if best is None else binding
            continue
        slope = float(t.slope_errors.min())
        if t.steep_count > LARGEST:
            bound = min(bound, slope)
            continue
        least = _least_error(t, level)
        bound = min(bound, least.bound if stage.whole else slope)
        # A wider range only where it is of use: the narrow one has the better threshold.
        margin = 0.0 if best is None or best[0].box == stage.box else EXACT
        if least.error <= (LAST_LEVEL if best is None else best[1].error - margin - 1e-12):
            best = (t, least)
        elif best is None:
            binding = "dead-zone null" if t.shift is None else "dead-zone bias"
        if best is not None and best[1].error <= EXACT:
            break
    if best is not None:
        bound = min(bound, best[1].error)  # no row of the tables is better than the best known
    if not (stage.slope or stage.whole) or (best is not None and best[1].error <= EXACT):
        bound = 0.0
    return _Found(best, bound, binding)


def _answer(
    target: DeadZoneTarget, values: dict[str, float], bound: float, status: str
) -> DeadZone:
    errors = saturating_tables.errors(target, values)
    worst = max(abs(e) for e in errors.values())
    bound = min(bound, worst)
    if worst <= EXACT:
        proof = "nothing to improve: every error of the dead zone is at most 1e-6"
    elif worst <= bound + EXACT:
        proof = (
            "every value of R206, R207, R209 with the nearest R210/R50, in the order of the slope "
            "error, each with the nearest A+ and loaded divider of the whole catalogue"
        )
    else:
        proof = "best found; the whole catalogue was not searched"
    return DeadZone(
        values=values,
        errors=errors,
        threshold=saturating_tables.threshold(target, values),
        bound=bound,
        proved=worst <= max(bound, 0.0) + EXACT,
        proof=proof,
        solver=status,
    )


def _stages(
    target: DeadZoneTarget,
    resistors: Array,
    base: float,
    free: frozenset[float],
    equal: EqualParts,
) -> Iterator[_Stage]:
    near, far = (SearchBox.near(target, *room) for room in ROOMS)
    names = parts_of(target.kind, target.sides)
    heavy = resistors[resistors >= target.load]
    every = {name: resistors if name in LIGHT else heavy for name in names}
    every |= {name: heavy[np.isclose(heavy, v, rtol=1e-9)] for name, v in equal.value.items()}
    handy = _handy(heavy, base, free)
    few = {name: np.intersect1d(every[name], handy[:1]) for name in LEVEL_SETTERS}
    some = {name: np.intersect1d(every[name], handy) for name in LEVEL_SETTERS}
    given = {name: every[name] for name in equal.value}
    slopes = every | some | given | {name: every[name] for name in ("R206", "R209")}
    fits = len(resistors) ** 3 <= LARGEST
    yield _Stage(every | few | given, near)
    yield _Stage(every | few | given, far)
    yield _Stage(every | some | given, far)
    yield _Stage(slopes, far, slope=target.strict)
    if target.strict:
        if fits:
            yield _Stage(every, far, whole=True)
        last = SearchBox.near(target, *OPEN)
    else:
        last = SearchBox.unlimited(target)
        yield _Stage(slopes, replace(last, steep=far.steep), slope=True)
    lists = every if fits else slopes
    yield _Stage(lists, last, slope=True, whole=fits, rescue=target.strict)


def _handy(heavy: Array, base: float, free: frozenset[float]) -> Array:
    """Values for resistors that only set a level, the first first: few where the list is long."""
    if len(heavy) == 0:
        return heavy
    room = [v for v in sorted(free) if base <= v <= 10.0 * base]
    wanted = [base, *room, *(base * f for f in (2.0, 5.0, 10.0, 3.0, 1.5, 4.0, 7.0))]
    near = [float(heavy[np.argmin(np.abs(np.log(heavy / v)))]) for v in wanted]
    most = int(np.clip(LARGEST / 2.5 / len(heavy) ** 2, 2, HANDY))
    return np.array(list(dict.fromkeys(near))[:most])


def _least_error(t: SaturatingTables, most: float) -> _Least:
    """The minimum over every row of the tables, sought below ``most``."""
    error = t.relaxed_errors
    steep = distinct(t.steep_logs[0])
    divider = distinct(t.divider_logs)
    best, where, completed, floor = np.inf, float("nan"), 0, np.inf
    for k in np.argsort(error, kind="stable"):
        if error[k] >= min(best, most) or best <= EXACT:
            break
        if t.shift is not None and completed >= JOINT:
            floor = min(floor, float(error[k]))
            break
        wanted = steep - t.u[k]
        null = t.target.mu * float(distance(divider, wanted, wanted).min(initial=np.inf))
        reached = max(float(error[k]), null)
        if reached >= min(best, most):
            continue
        completed += 1
        if completed % 16 == 0:
            doing(f"dead zone, {completed} values of R206, R207, R209 looked at")
        if t.shift is not None:
            least, cut = _joint_error(t, int(k), reached, min(best, most))
            floor = min(floor, reached) if cut else floor
            reached = max(reached, least)
        if reached < best:
            best, where = reached, float(t.u[k])
    return _Least(best, where, min(best, floor))


def _joint_error(t: SaturatingTables, key: int, start: float, most: float) -> tuple[float, bool]:
    """Least of the larger of null and bias error for one u, infinite above ``most``; and whether
    rows were left out on the way."""
    level, cut = max(start, EXACT), False
    while True:
        rows, shortened = null_rows(t, key, min(level, most))
        cut = cut or shortened
        if len(rows) or level >= most:
            return float(rows.error.min(initial=np.inf)), cut
        level *= 2.0
