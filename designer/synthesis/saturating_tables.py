"""The saturating dead zone (Fig. 5, Eq. (17)-(20)): its formulas, and the tables it is sized with.

    fv = -R210 (v11/R208 + v12/R209),  v12 = -A- v1,  A- = R207/R206,  A+ = R201 R203/(R200 R202)
    v11/R208 = clip(A+ v1 + c, ± Esat)/Rt,  Rt = R204 + R208 + R204 R208/R205 (the loaded divider)

One-sided, c = A+ (R200/R211) supply makes U3C reach its limit at the stop alone, and R212 takes
c/Rt out again. In logarithms, with u = ln A-/R209, the errors are

    stop slope       u + ln R210/R50 - ln wanted           (wanted is an interval)
    dead-zone null   mu (ln A+ - ln Rt - u)
    dead-zone bias   mu c/(Esat - c) (ln R200 R212/R211 + u), one-sided only, to first order

so for each value of u every error is the distance to the nearest entry of a sorted table of every
combination that the ranges leave.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from designer.base.arrays import Array, Index
from designer.synthesis.dead_zone_target import DeadZoneTarget, outside
from designer.synthesis.equal_parts import EqualParts
from designer.synthesis.value_tables import (
    ValueTable,
    between,
    combinations,
    distance,
    distinct,
    fewest_of_each,
    how_many_between,
    inside,
)

MOST_SHIFT = 0.9
"""Largest c/Esat: beyond it the threshold is a small difference of two large voltages."""
LEAST_STEEP = 1.25
"""Least A+: below it the clearance lies beyond what the op-amps reach."""
LEAST_FIRST = 1.0
"""Least R201/R200: an amplifier that attenuates adds the offset of the one behind it."""
LEAST_SECOND = 1.15
"""Least R203/R202, so that U3B is still linear where U3C reaches its limit."""
TABLES = (
    ("R206", "R207", "R209"),
    ("R210", "R50"),
    ("R200", "R201"),
    ("R202", "R203"),
    ("R204", "R205", "R208"),
    ("R200", "R211", "R212"),
)
"""Parts of each table."""
Dividers = dict[tuple[bytes, ...], ValueTable]
"""The last table of R204, R205 and R208, by whether noise counts and the values of each."""


def errors(target: DeadZoneTarget, values: Mapping[str, float]) -> dict[str, float]:
    """The errors of finished values: the stop slope's as a logarithm, the others in units of K1."""
    v = {name: np.asarray(value) for name, value in values.items()}
    per_ohm = v["R207"] / v["R206"] / v["R209"]
    total = float(per_ohm * v["R210"] / v["R50"])
    out = {
        "stop slope": outside(total, target.slope),
        "dead-zone null": float(target.mu * np.log(steep_gain(v) / divider(v) / per_ohm)),
    }
    if target.sides != "both":
        out["dead-zone bias"] = float(bias(target, v, per_ohm))
    return out


def threshold(target: DeadZoneTarget, values: Mapping[str, float]) -> float:
    """v1 at the stop [V]: (Esat - c)/A+, Esat by U3C's load."""
    v = {name: np.asarray(value) for name, value in values.items()}
    steep = steep_gain(v)
    shift = steep * target.supply * v["R200"] / v["R211"] if target.sides != "both" else 0.0
    return float((_limit(target, v) - shift) / steep)


def _limit(target: DeadZoneTarget, v: Mapping[str, Array]) -> Array:
    """Esat [V]: U3C drives R203 to a summing node and the divider into another."""
    behind = v["R204"] + v["R205"] * v["R208"] / (v["R205"] + v["R208"])
    return np.asarray(target.output.limit_into(1.0 / (1.0 / v["R203"] + 1.0 / behind)))


def steep_gain(v: Mapping[str, Array]) -> Array:
    """A+."""
    return v["R201"] * v["R203"] / (v["R200"] * v["R202"])


def divider(v: Mapping[str, Array]) -> Array:
    """Rt [ohm]."""
    return v["R204"] + v["R208"] + v["R204"] * v["R208"] / v["R205"]


def bias(target: DeadZoneTarget, v: Mapping[str, Array], per_ohm: Array) -> Array:
    """mu (leftover current)/(A-/R209 · threshold): the constant force in units of K1 times b."""
    shift = steep_gain(v) * target.supply * v["R200"] / v["R211"]
    threshold = (_limit(target, v) - shift) / steep_gain(v)
    left = shift / divider(v) - target.supply / v["R212"]
    # A shift as large as the range leaves no threshold: such rows are no choice, whatever is left.
    return np.asarray(target.mu * left / (per_ohm * np.maximum(threshold, 1e-12)))


def source_resistance(v: Mapping[str, Array]) -> Array:
    """What R208 and the divider behind it are from U3D's summing node to ground [ohm]."""
    return np.asarray(v["R208"] + v["R204"] * v["R205"] / (v["R204"] + v["R205"]))


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

    @classmethod
    def near(
        cls, target: DeadZoneTarget, threshold: float, linear: float, output: float
    ) -> SearchBox:
        """Threshold, A- and fv slope within these factors of their largest."""
        shift = target.shift[0], min(target.shift[1], MOST_SHIFT)
        top = max(target.farthest * (1.0 - shift[0]) / target.threshold, LEAST_STEEP)
        wanted = target.slope[1]
        return cls(
            steep=(top, top * threshold),
            linear=(target.linear_gain / linear, target.linear_gain),
            stop=(target.output_gain / wanted / output, target.output_gain / wanted),
            shift=shift,
            first=LEAST_FIRST if np.isfinite(threshold) else 0.0,
            noise_gain=target.noise_gain,
        )

    @classmethod
    def unlimited(cls, target: DeadZoneTarget) -> SearchBox:
        """No limits but those without which the stage is no dead zone."""
        any_size = (0.0, np.inf)
        shift = (target.shift[0], MOST_SHIFT)
        return cls((LEAST_STEEP, np.inf), any_size, any_size, shift, 0.0, np.inf)


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
    def divider_logs(self) -> Array:
        return np.asarray(np.log(divider(self.divider.columns)))

    @cached_property
    def shift_logs(self) -> Array:
        t = self.shift
        assert t is not None
        return np.asarray(np.log(t["R211"] / t["R212"] / t["R200"]))

    @cached_property
    def steep_logs(self) -> tuple[Array, Index, Index]:
        """ln A+ inside the box, and the rows of ``first`` and ``second`` that give it."""
        first, second, order, low, high = self._steep_join
        row, hit = between(second[order], low, high)
        return np.asarray(first[row] + second[order[hit]]), row, order[hit]

    @cached_property
    def steep_count(self) -> int:
        """How many pairs of rows ``steep_logs`` has."""
        _, second, order, low, high = self._steep_join
        return int(how_many_between(second[order], low, high).sum())

    @cached_property
    def _steep_join(self) -> tuple[Array, Array, Index, Array, Array]:
        """Logarithms of both gains, the order of the second, its range for each of the first."""
        first = np.log(self.first["R201"] / self.first["R200"])
        second = np.log(self.second["R203"] / self.second["R202"])
        low, high = np.log(self.box.steep)
        order = np.argsort(second, kind="stable")
        return first, second, order, low - first - 1e-12, high - first + 1e-12

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

    @cached_property
    def slope_errors(self) -> Array:
        """(k,) for each u the least slope error."""
        low, high = np.log(self.target.slope)
        return distance(self.right_logs, low - self.u, high - self.u)

    @property
    def relaxed_errors(self) -> Array:
        """(k,) for each u a lower bound of the largest of slope and bias error."""
        if self.shift is None:
            return self.slope_errors
        x = distance(np.sort(self.shift_logs), self.u, self.u)
        return np.asarray(np.maximum(self.slope_errors, self.bias_weight * -np.expm1(-x)))

    def empty(self) -> str | None:
        """Name of the condition that leaves a table without rows."""
        if not (len(self.left) and len(self.right)):
            return "stop slope"
        if not (len(self.first) and len(self.second) and len(self.divider)):
            return "dead-zone null"
        return "dead-zone bias" if self.shift is not None and len(self.shift) == 0 else None


def tables(
    target: DeadZoneTarget,
    lists: Mapping[str, Array],
    equal: EqualParts,
    box: SearchBox,
    free: frozenset[float],
    level: float = np.inf,
    dividers: Dividers | None = None,
) -> SaturatingTables:
    """The tables of these lists. Of rows with the same logarithm, that with the fewest values that
    are not ``free`` stays; of R206, R207, R209 only rows with a slope error up to ``level``.

    dividers : the last one of the same groups and free values; another takes its place.
    """
    noisy = bool(np.isfinite(box.noise_gain))
    right = combinations(("R210", "R50"), lists, equal.group)
    right = right.take(inside(right["R50"], box.stop))
    least_noise = -right["R210"] if noisy else None
    right = fewest_of_each(right, np.log(right["R210"] / right["R50"]), free, least_noise)
    first = combinations(("R200", "R201"), lists, equal.group)
    ratio = first["R201"] / first["R200"]
    first = first.take((ratio >= box.first) & (1.0 + ratio <= box.noise_gain))
    second = combinations(("R202", "R203"), lists, equal.group)
    ratio = second["R203"] / second["R202"]
    second = second.take((ratio >= LEAST_SECOND) & (1.0 + ratio <= box.noise_gain))
    shift = None
    if target.sides != "both":
        shift = combinations(("R200", "R211", "R212"), lists, equal.group)
        # c = A+ supply R200/R211, with both ends of A+.
        ratio = target.supply * shift["R200"] / shift["R211"] / target.farthest
        low, high = box.shift
        shift = shift.take((ratio * box.steep[1] >= low) & (ratio * box.steep[0] <= high))
    else:  # with a shift R200 stands in the bias too: equal ratios are not the same
        first = fewest_of_each(first, np.log(first["R201"] / first["R200"]), free)
    t = SaturatingTables(
        target,
        box,
        _left(target, lists, equal, box, free, right, level),
        right,
        first,
        fewest_of_each(second, np.log(second["R203"] / second["R202"]), free),
        _divider(lists, equal, noisy, free, {} if dividers is None else dividers),
        shift,
    )
    loud = t.left["R209"] if noisy else None
    return replace(t, left=fewest_of_each(t.left, t.left_logs, free, loud))


def _divider(
    lists: Mapping[str, Array],
    equal: EqualParts,
    noisy: bool,
    free: frozenset[float],
    known: Dividers,
) -> ValueTable:
    """Rows of R204, R205 and R208."""
    names = "R204", "R205", "R208"
    key = (repr(noisy).encode(), *(lists[name].tobytes() for name in names))
    if key not in known:
        known.clear()  # one is large
        every = combinations(names, lists, equal.group)
        light = source_resistance(every.columns) if noisy else None
        known[key] = fewest_of_each(every, np.log(divider(every.columns)), free, light)
    return known[key]


def _left(
    target: DeadZoneTarget,
    lists: Mapping[str, Array],
    equal: EqualParts,
    box: SearchBox,
    free: frozenset[float],
    right: ValueTable,
    level: float,
) -> ValueTable:
    """Rows of R206, R207, R209, one value of R209 after the other, so that memory stays bounded."""
    pairs = combinations(("R206", "R207"), lists, equal.group)
    ratio = pairs["R207"] / pairs["R206"]
    pairs = pairs.take(inside(ratio, box.linear) & (1.0 + ratio <= box.noise_gain))
    tied = [name for name in ("R206", "R207") if equal.of(name) == equal.of("R209")]
    if not tied:
        pairs = fewest_of_each(pairs, np.log(pairs["R207"] / pairs["R206"]), free)
    low, high = np.log(target.slope)
    q = np.log(right["R210"] / right["R50"])
    by_value = [ValueTable(("R206", "R207", "R209"), np.zeros((0, 3)))]
    for value in lists["R209"]:
        rows = pairs
        for name in tied:
            rows = rows.take(rows[name] == value)
        u = np.log(rows["R207"] / rows["R206"] / value)
        rows = rows.take(distance(q, low - u, high - u) <= level)
        by_value.append(rows.with_column("R209", np.full(len(rows), value)))
    return ValueTable.stacked(by_value)
