"""The tables that the saturating stage is sized with: every combination that the ranges leave.

In logarithms, with u = ln A-/R209, the errors are

    stop slope       u + ln R210/R50 - ln wanted           (wanted is an interval)
    dead-zone null   mu (ln A+ - ln Rt - u)
    dead-zone bias   mu c/(Esat - c) (ln R200 R212/R211 + u), one-sided only, to first order

so for each value of u every error is the distance to the nearest entry of a sorted table.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from designer.base.arrays import Array, Index
from designer.synthesis.dead_zone_target import DeadZoneTarget
from designer.synthesis.saturating_stage import quiet
from designer.synthesis.value_tables import (
    DIGITS,
    ValueTable,
    between,
    combinations,
    distance,
    distinct,
    how_many_between,
    inside,
    new_values,
)

MOST_SHIFT = 0.9
"""Largest c/Esat: beyond it the threshold is a small difference of two large voltages."""
LEAST_STEEP = 1.25
"""Least A+: below it the clearance lies beyond what the op-amps reach."""
LEAST_FIRST = 1.0
"""Least R201/R200: an amplifier that attenuates adds the offset of the one behind it."""
LEAST_SECOND = 1.15
"""Least R203/R202, so that U3B is still linear where U3C reaches its limit."""


@dataclass(frozen=True)
class SearchBox:
    """The ranges (low, high) that a search of the saturating stage looks at."""

    steep: tuple[float, float]
    """Least and largest A+."""
    linear: tuple[float, float]
    """Least and largest A-."""
    stop: tuple[float, float]
    """Least and largest R50 [ohm]."""
    shift: tuple[float, float]
    """Least and largest c/Esat, one-sided only."""
    first: float
    """Least gain of U3B."""
    noise_gain: float
    """Limit of the noise gain."""


def box(target: DeadZoneTarget, threshold: float, linear: float, output: float) -> SearchBox:
    """The ranges where threshold, A- and fv slope are within these factors of their largest."""
    kappa = target.shift[0], min(target.shift[1], MOST_SHIFT)
    top = target.saturation * (1.0 - kappa[0]) / target.threshold
    wanted = target.slope[1]
    return SearchBox(
        steep=(max(top, LEAST_STEEP), max(top, LEAST_STEEP) * threshold),
        linear=(target.linear_gain / linear, target.linear_gain),
        stop=(target.output_gain / wanted / output, target.output_gain / wanted),
        shift=kappa,
        first=LEAST_FIRST if np.isfinite(threshold) else 0.0,
        noise_gain=target.noise_gain,
    )


def free_box(target: DeadZoneTarget) -> SearchBox:
    """No limits but those without which the stage is no dead zone."""
    return SearchBox(
        (LEAST_STEEP, np.inf),
        (0.0, np.inf),
        (0.0, np.inf),
        (target.shift[0], MOST_SHIFT),
        0.0,
        np.inf,
    )


@dataclass(frozen=True)
class SaturatingTables:
    """The tables of one search; every row keeps its own conditions of the box."""

    target: DeadZoneTarget
    """What the stage has to do."""
    box: SearchBox
    """The ranges that the rows keep to."""
    left: ValueTable
    """Values of R206, R207 and R209."""
    right: ValueTable
    """Values of R210 and R50."""
    first: ValueTable
    """Values of R200 and R201."""
    second: ValueTable
    """Values of R202 and R203."""
    divider: ValueTable
    """Values of R204, R205 and R208."""
    shift: ValueTable | None
    """Values of R200, R211 and R212, for a one-sided dead zone; None with both stops."""

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
    def bias_weight(self) -> float:
        """The bias error is at least this times 1 - exp(-x), x = |ln R200 R212/R211 + u|.

        To first order it is mu c/(Esat - c) x, of which a null error inside the level can take
        the c/Esat-th part back; 6 % of that for the second order, at levels up to 0.1.
        """
        least = self.box.shift[0]
        return self.target.mu * least / (1.0 + 0.06 * least)

    def shift_reach(self, level: float) -> float:
        """Largest x whose bias error can be inside the level."""
        share = level / self.bias_weight
        return float(-np.log1p(-share)) if share < 1.0 else np.inf

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
    limits: SearchBox,
    free: frozenset[float],
    level: float = np.inf,
) -> SaturatingTables:
    """The tables of these lists. Of rows with the same logarithm, that with the fewest values that
    are not ``free`` stays; of R206, R207, R209 only rows with a slope error up to ``level``."""
    gain = limits.noise_gain
    noisy = bool(np.isfinite(gain))
    right = combinations(("R210", "R50"), lists, tie)
    right = right.take(inside(right["R50"], limits.stop))
    least_noise = -right["R210"] if noisy else None
    right = _fewest_of_each(right, np.log(right["R210"] / right["R50"]), free, least_noise)
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
    out = SaturatingTables(target, limits, left, right, first, second, divider, shift)
    if shift is None:  # otherwise R200 stands in the bias too: equal ratios are not the same
        first = _fewest_of_each(first, np.log(first["R201"] / first["R200"]), free)
    return replace(
        out,
        left=_fewest_of_each(left, out.left_logs, free, left["R209"] if noisy else None),
        first=first,
        second=_fewest_of_each(second, np.log(second["R203"] / second["R202"]), free),
        divider=_fewest_of_each(
            divider, out.divider_logs, free, quiet(divider.columns) if noisy else None
        ),
    )


def _left(
    target: DeadZoneTarget,
    lists: Mapping[str, Array],
    tie: Mapping[str, str],
    limits: SearchBox,
    free: frozenset[float],
    right: ValueTable,
    level: float,
) -> ValueTable:
    """Rows of R206, R207, R209, one value of R209 after the other, so that memory stays bounded."""
    pairs = combinations(("R206", "R207"), lists, tie)
    ratio = pairs["R207"] / pairs["R206"]
    fine = inside(ratio, limits.linear) & (1.0 + ratio <= limits.noise_gain)
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


def slope_errors(t: SaturatingTables) -> Array:
    """(k,) for each u the least slope error."""
    low, high = np.log(t.target.slope)
    return distance(t.right_logs, low - t.u, high - t.u)


def relaxed_errors(t: SaturatingTables) -> Array:
    """(k,) for each u a lower bound of the largest of slope and bias error."""
    error = slope_errors(t)
    if t.shift is None:
        return error
    x = distance(np.sort(t.shift_logs), t.u, t.u)
    return np.asarray(np.maximum(error, t.bias_weight * -np.expm1(-x)))
