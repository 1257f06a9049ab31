"""Sizing the saturating dead zone (Fig. 5, Eq. (17)-(20)), two-sided or one-sided.

    fv = -R210 (v11/R208 + v12/R209),  v12 = -A- v1,  A- = R207/R206,  A+ = R201 R203/(R200 R202)
    v11/R208 = clip(A+ v1 + c, ± Esat)/Rt,  Rt = R204 + R208 + R204 R208/R205 (the loaded divider)

In logarithms, with u = ln A-/R209, the errors are

    stop slope       u + ln R210/R50 - ln wanted           (wanted is an interval)
    dead-zone null   mu (ln A+ - ln Rt - u)
    dead-zone bias   mu c/(Esat - c) (ln R200 R212/R211 + u), one-sided only, to first order

so for each value of u every error is the distance to the nearest entry of a sorted table. Taking
the values of u in the order of their slope error, the least largest error is known as soon as the
next slope error exceeds it: an exact minimum over the whole catalogue.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from designer.dead_zone_target import DeadZoneTarget, outside
from designer.system import Array, Index, Mask
from designer.value_program import Ranking, Rows, Rule, choose, fewest
from designer.value_tables import (
    DIGITS,
    ValueTable,
    between,
    combinations,
    distance,
    distinct,
    how_many_between,
    new_values,
)

LEAST_STEEP = 1.25
"""Least A+: below it the clearance lies beyond what the op-amps reach."""
LEAST_FIRST = 1.0
"""Least R201/R200: an amplifier that attenuates adds the offset of the one behind it."""
LEAST_SECOND = 1.15
"""Least R203/R202, so that U3B is still linear where U3C reaches its limit."""
LAST_LEVEL = 0.1
"""Errors above it are no answer."""
LARGEST = 3_000_000
"""Rows of a table past which the whole catalogue is not enumerated."""
KEYS, ROWS, TRIES = 40, 20, 200
"""Values of u, rows of each table for each, that go into the program; values of u looked at."""
EXPANDED = 400_000
"""Rows of a join that are ranked by their new values before the rest is left out."""
GROWTH = 3.0


@dataclass(frozen=True)
class Box:
    """Ranges (low, high) of A+, A-, R50 [ohm] and, one-sided, c/Esat; least gain of U3B; limit of
    the noise gain."""

    steep: tuple[float, float]
    linear: tuple[float, float]
    stop: tuple[float, float]
    shift: tuple[float, float]
    first: float
    noise_gain: float


def box(target: DeadZoneTarget, threshold: float, linear: float, output: float) -> Box:
    """The ranges where threshold, A- and fv slope are within these factors of their largest."""
    kappa = target.shift
    top = target.saturation * (1.0 - kappa[0]) / target.threshold
    wanted = target.slope[1]
    return Box(
        steep=(max(top, LEAST_STEEP), max(top, LEAST_STEEP) * threshold),
        linear=(target.linear_gain / linear, target.linear_gain),
        stop=(target.output_gain / wanted / output, target.output_gain / wanted),
        shift=kappa,
        first=LEAST_FIRST if np.isfinite(threshold) else 0.0,
        noise_gain=target.noise_gain,
    )


def free_box(target: DeadZoneTarget) -> Box:
    """No limits but those without which the stage is no dead zone."""
    return Box(
        (LEAST_STEEP, np.inf), (0.0, np.inf), (0.0, np.inf), (target.shift[0], 0.9), 0.0, np.inf
    )


@dataclass(frozen=True)
class Tables:
    """The tables of one search; every row keeps its own conditions of the box."""

    target: DeadZoneTarget
    box: Box
    left: ValueTable
    right: ValueTable
    first: ValueTable
    second: ValueTable
    divider: ValueTable
    shift: ValueTable | None

    @cached_property
    def u(self) -> Array:
        """(k,) every different ln A-/R209, ascending."""
        return distinct(self.left_logs)

    @cached_property
    def left_logs(self) -> Array:
        t = self.left
        return np.asarray(np.log(t["R207"] / t["R206"] / t["R209"]))

    @cached_property
    def right_logs(self) -> Array:
        return np.asarray(np.log(self.right["R210"] / self.right["R50"]))

    @cached_property
    def steep_logs(self) -> tuple[Array, Index, Index]:
        """ln A+ inside the box, and the rows of ``first`` and ``second`` that give it."""
        a, order, low, high = self._steep_join()
        row, hit = between(a[1][order], low, high)
        second = order[hit]
        return np.asarray(a[0][row] + a[1][second]), row, second

    def steep_count(self) -> int:
        a, order, low, high = self._steep_join()
        return int(how_many_between(a[1][order], low, high).sum())

    def _steep_join(self) -> tuple[tuple[Array, Array], Index, Array, Array]:
        a1 = np.log(self.first["R201"] / self.first["R200"])
        a2 = np.log(self.second["R203"] / self.second["R202"])
        low, high = np.log(self.box.steep)
        return (a1, a2), np.argsort(a2, kind="stable"), low - a1 - 1e-12, high - a1 + 1e-12

    @cached_property
    def divider_logs(self) -> Array:
        t = self.divider
        return np.asarray(np.log(t["R204"] + t["R208"] + t["R204"] * t["R208"] / t["R205"]))

    @cached_property
    def shift_logs(self) -> Array:
        t = self.shift
        assert t is not None
        return np.asarray(np.log(t["R211"] / t["R212"] / t["R200"]))

    @property
    def bias_weight(self) -> tuple[float, float]:
        """Least and largest bias error per ln, over the range of c."""
        low, high = (self.target.mu * k / (1.0 - k) for k in self.box.shift)
        return low, high

    def empty(self) -> str | None:
        """Name of the condition that leaves a table without rows."""
        if not (len(self.left) and len(self.right)):
            return "stop slope"
        if not (len(self.first) and len(self.second) and len(self.divider)):
            return "dead-zone null"
        if self.shift is not None and len(self.shift) == 0:
            return "dead-zone bias"
        return None


def tables(
    target: DeadZoneTarget,
    lists: Mapping[str, Array],
    tie: Mapping[str, str],
    limits: Box,
    free: frozenset[float],
    level: float = np.inf,
) -> Tables:
    """The tables of these lists. Of rows with the same logarithm, that with the fewest values that
    are not ``free`` stays; of R206, R207, R209 only rows with a slope error up to ``level``."""
    gain = limits.noise_gain
    noisy = bool(np.isfinite(gain))
    right = combinations(("R210", "R50"), lists, tie)
    right = right.take(_inside(right["R50"], limits.stop))
    quiet = -right["R210"] if noisy else None
    right = _fewest_of_each(right, np.log(right["R210"] / right["R50"]), free, quiet)
    left = _left(target, lists, tie, limits, free, right, level)
    first = combinations(("R200", "R201"), lists, tie)
    ratio = first["R201"] / first["R200"]
    first = first.take((ratio >= limits.first) & (1.0 + ratio <= gain))
    second = combinations(("R202", "R203"), lists, tie)
    ratio = second["R203"] / second["R202"]
    second = second.take((ratio >= LEAST_SECOND) & (1.0 + ratio <= gain))
    divider = combinations(("R204", "R205", "R208"), lists, tie)
    shift = None
    if target.sides != "both":
        shift = combinations(("R200", "R211", "R212"), lists, tie)
        # c = A+ supply R200/R211, with both ends of A+.
        ratio = target.supply * shift["R200"] / shift["R211"] / target.saturation
        shift = shift.take(
            (ratio * limits.steep[1] >= limits.shift[0])
            & (ratio * limits.steep[0] <= limits.shift[1])
        )
    out = Tables(target, limits, left, right, first, second, divider, shift)
    if shift is None:  # otherwise R200 stands in the bias too: equal ratios are not the same
        first = _fewest_of_each(first, np.log(first["R201"] / first["R200"]), free)
    return replace(
        out,
        left=_fewest_of_each(left, out.left_logs, free, left["R209"] if noisy else None),
        first=first,
        second=_fewest_of_each(second, np.log(second["R203"] / second["R202"]), free),
        divider=_fewest_of_each(
            divider, out.divider_logs, free, _quiet(divider) if noisy else None
        ),
    )


def _left(
    target: DeadZoneTarget,
    lists: Mapping[str, Array],
    tie: Mapping[str, str],
    limits: Box,
    free: frozenset[float],
    right: ValueTable,
    level: float,
) -> ValueTable:
    """Rows of R206, R207, R209, one value of R209 after the other, so that memory stays bounded."""
    pairs = combinations(("R206", "R207"), lists, tie)
    ratio = pairs["R207"] / pairs["R206"]
    fine = _inside(ratio, limits.linear) & (1.0 + ratio <= limits.noise_gain)
    pairs = pairs.take(fine)
    if tie.get("R209", "R209") not in (tie.get("R206", "R206"), tie.get("R207", "R207")):
        pairs = _fewest_of_each(pairs, np.log(pairs["R207"] / pairs["R206"]), free)
    low, high = np.log(target.slope)
    q = np.log(right["R210"] / right["R50"])
    kept = []
    for value in lists["R209"]:
        own = {**lists, "R209": np.array([value])}
        for name in ("R206", "R207"):
            if tie.get(name, name) == tie.get("R209", "R209"):
                own[name] = np.intersect1d(own[name], own["R209"])
        rows = pairs.take(np.isin(pairs["R206"], own["R206"]) & np.isin(pairs["R207"], own["R207"]))
        u = np.log(rows["R207"] / rows["R206"] / value)
        near = distance(q, low - u, high - u) <= level
        rows = rows.take(near)
        third = ValueTable(("R209",), np.full((len(rows), 1), value))
        kept.append(rows.beside(third))
    names = ("R206", "R207", "R209")
    if not kept:
        return ValueTable(names, np.zeros((0, 3)))
    return ValueTable(names, np.concatenate([rows.values for rows in kept]))


def _inside(values: Array, limits: tuple[float, float]) -> Mask:
    return np.asarray((values >= limits[0] * (1.0 - 1e-9)) & (values <= limits[1] * (1.0 + 1e-9)))


def _fewest_of_each(
    table: ValueTable, logs: Array, free: frozenset[float], quiet: Array | None = None
) -> ValueTable:
    """One row for each different logarithm, ascending: that with the fewest values that are not
    free, and with ``quiet`` also the one where that is largest."""
    if len(table) == 0:
        return table
    kept = []
    for rank in (new_values(table.values, free), None if quiet is None else -quiet):
        if rank is not None:
            order = np.argsort(rank, kind="stable")
            kept.append(order[np.unique(np.round(logs[order], DIGITS), return_index=True)[1]])
    both = np.unique(np.concatenate(kept))
    return table.take(both[np.argsort(np.round(logs[both], DIGITS), kind="stable")])


def _quiet(divider: ValueTable) -> Array:
    """What R208 and the divider behind it are from U3D's summing node to ground [ohm]."""
    v = divider
    return np.asarray(v["R208"] + v["R204"] * v["R205"] / (v["R204"] + v["R205"]))


@dataclass(frozen=True)
class Least:
    """The least largest error of a search, the u that has it, values of u looked at, and whether
    the minimum is exact or the search ended below the tolerance."""

    error: float
    u: float
    looked_at: int


def slope_errors(t: Tables) -> Array:
    """(k,) for each u the least slope error, and bias error where there is one."""
    low, high = np.log(t.target.slope)
    error = distance(t.right_logs, low - t.u, high - t.u)
    if t.shift is not None:
        wanted = t.u
        error = np.maximum(
            error, t.bias_weight[0] * distance(np.sort(t.shift_logs), wanted, wanted)
        )
    return error


def least_error(t: Tables, tolerance: float) -> Least:
    """The minimum over every row of the tables, conditions that tie two tables left out."""
    error = slope_errors(t)
    order = np.argsort(error, kind="stable")
    steep = distinct(t.steep_logs[0])
    divider = distinct(t.divider_logs)
    best, where, looked_at = np.inf, float("nan"), 0
    for k in order:
        if error[k] >= best or best <= tolerance:
            break
        looked_at += 1
        wanted = steep - t.u[k]
        null = t.target.mu * float(distance(divider, wanted, wanted).min(initial=np.inf))
        if max(error[k], null) < best:
            best, where = float(max(error[k], null)), float(t.u[k])
    return Least(best, where, looked_at)


def rows_within(t: Tables, level: float, sure: float, free: frozenset[float]) -> tuple[Rows, Rows]:
    """Rows of (R206, R207, R209, R210, R50) and of the rest, with a common u and errors inside
    ``level``; where there are more than the program can hold, those with the fewest new values.

    sure : a u that is among them in any case.
    """
    slopes = _slope_rows(t, level, sure, free)
    order = np.argsort(new_values(slopes.table.values, free), kind="stable")
    keys = list(dict.fromkeys(slopes.key[order].tolist()))
    known = int(np.argmin(np.abs(t.u - sure)))
    if known in keys:
        keys = [known, *(k for k in keys if k != known)]
    found: list[Rows] = []
    for key in keys[:TRIES]:
        rows = _null_rows(t, key, level, free)
        if len(rows):
            found.append(rows)
        if len(found) == KEYS:
            break
    names = _null_names(t)
    if not found:
        none = ValueTable(names, np.zeros((0, len(names))))
        return slopes, Rows(none, np.zeros(0), np.zeros(0, dtype=np.intp))
    nulls = Rows(
        ValueTable(names, np.concatenate([r.table.values for r in found])),
        np.concatenate([r.error for r in found]),
        np.concatenate([r.key for r in found]),
    )
    kept = []
    for key in np.unique(nulls.key):
        own = np.flatnonzero(slopes.key == key)
        kept.append(own[fewest(slopes.take(own), free, ROWS)])
    return slopes.take(np.concatenate(kept)), nulls


def _null_names(t: Tables) -> tuple[str, ...]:
    extra = () if t.shift is None else ("R211", "R212")
    return ("R200", "R201", "R202", "R203", "R204", "R205", "R208", *extra)


def _slope_rows(t: Tables, level: float, sure: float, free: frozenset[float]) -> Rows:
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
    return Rows(table, error, np.searchsorted(t.u, u[i] - 1e-12))


def _null_rows(t: Tables, key: int, level: float, free: frozenset[float]) -> Rows:
    """The rows for one u, at most ``ROWS``."""
    steep, i, j = t.steep_logs
    u = float(t.u[key])
    wide = level / t.target.mu
    d = t.divider_logs  # ascending, as the rows of the table are
    wanted = steep - u
    chosen = np.arange(len(steep))
    if t.shift is not None:
        near = t.shift.take(np.abs(t.shift_logs - u) <= level / t.bias_weight[0])
        chosen = np.flatnonzero(np.isin(t.first["R200"][i], near["R200"]))
    count = how_many_between(d, wanted[chosen] - wide, wanted[chosen] + wide)
    rank = chosen[count > 0]
    if count.sum() > EXPANDED:
        kinds = new_values(np.hstack([t.first.values[i[rank]], t.second.values[j[rank]]]), free)
        order = np.argsort(kinds, kind="stable")
        total = np.cumsum(count[count > 0][order])
        rank = rank[order[: max(1, int(np.searchsorted(total, EXPANDED)))]]
    row, hit = between(d, wanted[rank] - wide, wanted[rank] + wide)
    a = rank[row]
    table = t.first.take(i[a]).beside(t.second.take(j[a])).beside(t.divider.take(hit))
    error = t.target.mu * np.abs(wanted[a] - d[hit])
    if t.shift is not None:
        table, error = _with_shift(t, near, table, error, u, level)
    rows = Rows(table, error, np.full(len(table), key))
    return rows.take(fewest(rows, free, ROWS))


def _with_shift(
    t: Tables, near: ValueTable, table: ValueTable, error: Array, u: float, level: float
) -> tuple[ValueTable, Array]:
    """The rows completed by R211 and R212 with the same R200, their bias error counted."""
    order = np.argsort(near["R200"], kind="stable")
    own = near.take(order)
    row, hit = between(own["R200"], table["R200"] - 1e-6, table["R200"] + 1e-6)
    both = table.take(row).beside(ValueTable(("R211", "R212"), own.take(hit).values[:, 1:]))
    values = {name: both[name] for name in both.names}
    null = np.exp(np.log(_steep(values) / _through(values)) - u)
    shift = _steep(values) * t.target.supply * values["R200"] / values["R211"]
    bias = np.abs(_bias(t.target, values, np.exp(u)))
    worst = np.maximum(error[row], bias)
    good = _inside(shift / t.target.saturation, t.box.shift) & (worst <= level) & (null > 0.0)
    return both.take(np.flatnonzero(good)), worst[good]


def _steep(v: Mapping[str, Array]) -> Array:
    return v["R201"] * v["R203"] / (v["R200"] * v["R202"])


def _through(v: Mapping[str, Array]) -> Array:
    return v["R204"] + v["R208"] + v["R204"] * v["R208"] / v["R205"]


def _bias(target: DeadZoneTarget, v: Mapping[str, Array], per_ohm: Array) -> Array:
    """mu (leftover current)/(A-/R209 · threshold): the constant force in units of K1 times b."""
    shift = _steep(v) * target.supply * v["R200"] / v["R211"]
    threshold = (target.saturation - shift) / _steep(v)
    left = shift / _through(v) - target.supply / v["R212"]
    return np.asarray(target.mu * left / (per_ohm * threshold))


def noise_rules(t: Tables, slopes: Rows, nulls: Rows) -> list[Rule]:
    """U3D's noise gain 1 + R210/R209 + R210/(R208 + R204 || R205), as one rule in logarithms."""
    if not np.isfinite(t.box.noise_gain):
        return []
    s, n = slopes.table, nulls.table
    rest = t.box.noise_gain - 1.0 - s["R210"] / s["R209"]
    # Where R209 alone takes all of it, no row of the other table will do.
    need = np.where(rest > 0.0, np.log(s["R210"] / np.where(rest > 0.0, rest, 1.0)), 1e3)
    have = np.log(_quiet(n))
    return [Rule((-need, have), -1e-9, np.inf)]


def pick(t: Tables, least: Least, ranking: Ranking) -> tuple[dict[str, float], str] | None:
    """Values that keep every rule, with the error as small as the program finds; and its word."""
    level = max(least.error, ranking.tolerance) + ranking.slack
    while level <= LAST_LEVEL * GROWTH:
        slopes, nulls = rows_within(t, level * (1.0 + 1e-9) + 1e-10, least.u, ranking.free)
        if len(nulls):
            found = choose((slopes, nulls), noise_rules(t, slopes, nulls), ranking)
            if found is not None:
                i, j = found.rows
                names = slopes.table.names + nulls.table.names
                chosen = np.concatenate([slopes.table.values[i], nulls.table.values[j]])
                return dict(zip(names, chosen.tolist(), strict=True)), found.solver
        level *= GROWTH
    return None


def errors(target: DeadZoneTarget, values: Mapping[str, float]) -> dict[str, float]:
    """The errors of finished values, from the formulas above."""
    v = {name: np.asarray(value) for name, value in values.items()}
    per_ohm = v["R207"] / v["R206"] / v["R209"]
    total = float(per_ohm * v["R210"] / v["R50"])
    out = {
        "stop slope": outside(total, target.slope),
        "dead-zone null": float(target.mu * np.log(_steep(v) / _through(v) / per_ohm)),
    }
    if target.sides != "both":
        out["dead-zone bias"] = float(_bias(target, v, per_ohm))
    return out


def threshold(target: DeadZoneTarget, values: Mapping[str, float]) -> float:
    """v1 at the stop [V]: (Esat - c)/A+."""
    v = {name: np.asarray(value) for name, value in values.items()}
    shift = np.asarray(0.0)
    if target.sides != "both":
        shift = _steep(v) * target.supply * v["R200"] / v["R211"]
    return float((target.saturation - shift) / _steep(v))
