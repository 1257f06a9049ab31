"""Sizing the rectifying dead zone: flat by construction, its threshold set by a reference.

Beyond the threshold Vref R200/R201 a half's output is fv = (R202/R200) (v1 - threshold), so the
stop's slope is R202/(R200 R50). Every pair (R200, R202) with the nearest R50 is looked at, so the
least error is that of the whole catalogue. R201 has to put the threshold inside its window, R206
has to keep the reference's current between its limits.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from designer.base.arrays import Array, Mask
from designer.base.progress import doing
from designer.circuit.coefficients import EXACT
from designer.synthesis.dead_zone_target import DeadZone, DeadZoneTarget, outside
from designer.synthesis.equal_parts import EqualParts
from designer.synthesis.value_program import Ranking, TableRows, choose, fewest
from designer.synthesis.value_tables import (
    ValueTable,
    between,
    combinations,
    distance,
    how_many_between,
    inside,
)

HALVES = {
    "both": ("R200", "R201", "R202", "R206"),
    "upper": ("R200", "R201", "R202", "R206"),
    "lower": ("R203", "R204", "R205", "R207"),
}
"""Input, reference, feedback and feed resistor of the half that is sized."""
EQUAL = (("R200", "R203"), ("R201", "R204"), ("R202", "R205"), ("R206", "R207"))
"""Parts of the two halves that are equal."""
ROOMS = ((1.06, 2.5), (1.2, 2.5))
"""How far below its largest value threshold and fv slope may lie: first and at most."""
LAST_LEVEL, GROWTH = 0.1, 3.0
"""Largest error that is an answer; growth of the level where no row keeps every rule."""
EXPANDED, ROWS, FEEDS = 1_000_000, 400, 12
"""Rows that are completed; rows of the program; feeds for each reference resistor."""


class _Ranges(NamedTuple):
    """Least and largest threshold [V], and fv slope."""

    threshold: tuple[float, float]
    gain: tuple[float, float]


def size(
    target: DeadZoneTarget, resistors: Array, ranking: Ranking, equal: EqualParts
) -> DeadZone | str:
    """The stage, or the name of the condition that leaves none."""
    half = _Half.of(target, resistors, equal)
    best: tuple[float, _Ranges] | None = None
    binding, bound = "", 0.0
    for number, (ranges, last) in enumerate(_stages(target), start=1):
        doing(f"dead zone, range {number}")
        pairs, why = half.pairs(ranges)
        least = half.least_error(pairs)
        if least > LAST_LEVEL:
            # The first ranges are those that a design should have.
            binding = binding or why
            continue
        # A wider range only where it is of use: the narrow one has the better threshold.
        if best is None or least < best[0] - EXACT:
            best = (least, ranges)
        bound = least
        if last:
            break
    if best is None:
        return binding
    least, ranges = best
    level = max(least, EXACT) + ranking.slack
    while level <= LAST_LEVEL * GROWTH:
        choice = half.choose(ranges, level * (1.0 + 1e-9), ranking)
        if choice is not None:
            return _answer(target, *choice, min(bound, least))
        level *= GROWTH
    return "distinct values" if ranking.most is not None else "matched parts"


def _stages(target: DeadZoneTarget) -> list[tuple[_Ranges, bool]]:
    """Ranges to try in turn; whether an answer inside them ends the search."""
    out = []
    for threshold, gain in ROOMS:
        ranges = _Ranges(
            (target.threshold / threshold, target.threshold),
            (target.output_gain / gain, target.output_gain),
        )
        out.append((ranges, target.strict and threshold == ROOMS[-1][0]))
    widest = _Ranges((0.0, np.inf), (0.0, np.inf))
    if target.strict:
        widest = _Ranges((0.0, target.threshold), (0.0, target.output_gain))
    return [*out, (widest, True)]


@dataclass(frozen=True)
class _Half:
    """The half that is sized: names of its input, reference, feedback and feed resistor, and the
    values [ohm] that each part may have."""

    target: DeadZoneTarget
    source: str
    reference: str
    feedback: str
    feed: str
    lists: Mapping[str, Array]
    equal: EqualParts

    @classmethod
    def of(cls, target: DeadZoneTarget, resistors: Array, equal: EqualParts) -> _Half:
        heavy = resistors[resistors >= target.load]
        names = HALVES[target.sides]
        lists = dict.fromkeys((*names[:3], "R50"), heavy) | {names[3]: resistors}
        for name in lists.keys() & equal.value.keys():
            lists[name] = lists[name][np.isclose(lists[name], equal.value[name], rtol=1e-9)]
        return cls(target, *names, lists, equal)

    @property
    def feed_is_tied(self) -> bool:
        """Whether the feed has to equal a part whose value is chosen with the slope."""
        chosen = (self.source, self.reference, self.feedback, "R50")
        return self.equal.of(self.feed) in {self.equal.of(name) for name in chosen}

    def pairs(self, ranges: _Ranges) -> tuple[ValueTable, str]:
        """Every pair of input and feedback for which the other parts exist, and what binds if
        none."""
        pairs = combinations((self.source, self.feedback), self.lists, self.equal.group)
        pairs = pairs.take(inside(pairs[self.feedback] / pairs[self.source], ranges.gain))
        if len(pairs) == 0:
            return pairs, "stop slope"
        inputs, place = np.unique(pairs[self.source], return_inverse=True)
        largest, why = self._largest_reference(ranges, inputs)
        pairs = pairs.take(largest[place] > 0.0)
        if len(pairs) == 0:
            return pairs, why
        # The largest reference resistor leaves the least noise gain.
        noise = self._noise_gain(pairs, largest[place][largest[place] > 0.0])
        pairs = pairs.take(noise <= self.target.noise_gain)
        return pairs, "stop slope" if len(pairs) else "noise gain"

    def least_error(self, pairs: ValueTable) -> float:
        """The least slope error of all pairs with all R50: no choice has a smaller one."""
        low, high = np.log(self.target.slope)
        gain = np.log(pairs[self.feedback] / pairs[self.source])
        stop = np.log(self.lists["R50"])
        return float(distance(stop, gain - high, gain - low).min(initial=np.inf))

    def choose(
        self, ranges: _Ranges, level: float, ranking: Ranking
    ) -> tuple[dict[str, float], str] | None:
        """The values with an error up to ``level`` that cvxpy prefers, and the solver's word."""
        main = self._main_rows(ranges, level, ranking.free)
        if len(main) == 0:
            return None
        tables = [main] if self.feed_is_tied else [main, self._feed_rows(main, ranking.free)]
        choice = choose(tables, (), ranking)
        if choice is None:
            return None
        rows, status = choice
        chosen: dict[str, float] = {}
        for table, i in zip(tables, rows, strict=True):
            chosen |= dict(zip(table.table.names, table.table.values[i].tolist(), strict=True))
        return chosen, status

    def _noise_gain(self, table: ValueTable, reference: Array) -> Array:
        return np.asarray(1.0 + table[self.feedback] * (1.0 / table[self.source] + 1.0 / reference))

    def _largest_reference(self, ranges: _Ranges, inputs: Array) -> tuple[Array, str]:
        """For each input the largest reference resistor that will do, 0 where none will; and what
        binds."""
        allowed = self.lists[self.reference]
        row, hit = between(allowed, *self._reference_range(ranges, inputs))
        out = np.zeros(len(inputs))
        if len(row) == 0:
            return out, "threshold"
        fed = self._can_be_fed(allowed[hit])
        np.maximum.at(out, row[fed], allowed[hit][fed])
        return out, "reference current"

    def _reference_range(self, ranges: _Ranges, inputs: Array) -> tuple[Array, Array]:
        """Range of R201 = Vref R200/threshold for each R200."""
        volts = self.target.reference * inputs
        low = volts / ranges.threshold[1] * (1.0 - 1e-9)
        high = np.full(len(inputs), np.inf)
        if ranges.threshold[0] > 0.0:
            high = volts / ranges.threshold[0] * (1.0 + 1e-9)
        return low, high

    def _current(self, feed: Array, reference: Array) -> Array:
        """Through the reference [A]: what the feed brings less what R201 takes."""
        t = self.target
        return np.asarray((t.supply - t.reference) / feed - t.reference / reference)

    def _can_be_fed(self, reference: Array) -> Mask:
        """Whether some feed keeps the reference's current between its limits, for each R201."""
        least, most = self.target.reference_current
        drop = self.target.supply - self.target.reference
        load = self.target.reference / reference
        high = drop / (least + load) if drop > 0.0 else np.zeros(len(load))
        low = np.maximum(drop, 0.0) / (most + load)
        feeds = self.lists[self.feed]
        return np.asarray(how_many_between(feeds, low * (1 - 1e-9), high * (1 + 1e-9)) > 0)

    def _main_rows(self, ranges: _Ranges, level: float, free: frozenset[float]) -> TableRows:
        """Rows of input, feedback, R50 and reference resistor (and of a feed that equals one of
        them), at most ``ROWS``; the key is the reference resistor's place on its list."""
        pairs, _ = self.pairs(ranges)
        low, high = np.log(self.target.slope)
        gain = np.log(pairs[self.feedback] / pairs[self.source])
        stop = np.log(self.lists["R50"])
        row, hit = between(stop, gain - high - level, gain - low + level)
        table = pairs.take(row).with_column("R50", self.lists["R50"][hit])
        total = gain[row] - stop[hit]
        error = np.maximum(np.maximum(low - total, total - high), 0.0)
        rows = TableRows(table, error, np.zeros(len(table), dtype=np.intp))
        rows = rows.take(np.flatnonzero(self._keeps_equal(table, "R50")))
        rows = rows.take(fewest(rows, free, EXPANDED))
        allowed = self.lists[self.reference]
        row, hit = between(allowed, *self._reference_range(ranges, rows.table[self.source]))
        table = rows.table.take(row).with_column(self.reference, allowed[hit])
        fine = self._noise_gain(table, table[self.reference]) <= self.target.noise_gain
        fine &= self._keeps_equal(table, self.reference)
        rows = TableRows(table, rows.error[row], hit).take(np.flatnonzero(fine))
        if self.feed_is_tied:
            group = self.equal.of(self.feed)
            like = next(name for name in rows.table.names if self.equal.of(name) == group)
            table = rows.table.with_column(self.feed, rows.table[like])
            current = self._current(table[self.feed], table[self.reference])
            fine = inside(current, self.target.reference_current)
            fine &= np.isin(table[self.feed], self.lists[self.feed])
            rows = TableRows(table, rows.error, rows.key)
        else:
            fine = self._can_be_fed(rows.table[self.reference])
        rows = rows.take(np.flatnonzero(fine))
        return rows.take(fewest(rows, free, ROWS))

    def _feed_rows(self, main: TableRows, free: frozenset[float]) -> TableRows:
        """For each reference resistor of the rows the feeds that will do: known values first, then
        the largest."""
        known = np.array(sorted({*free, *np.unique(main.table.values).tolist()}))
        every = self.lists[self.feed]
        feeds: list[Array] = []
        keys = np.unique(main.key)
        for key in keys:
            reference = main.table[self.reference][main.key == key][:1]
            fine = every[inside(self._current(every, reference), self.target.reference_current)]
            order = np.lexsort((-fine, ~np.isin(fine, known)))
            feeds.append(fine[order[:FEEDS]])
        values = np.concatenate(feeds)
        table = ValueTable((self.feed,), values[:, None])
        return TableRows(table, np.zeros(len(values)), np.repeat(keys, [len(v) for v in feeds]))

    def _keeps_equal(self, table: ValueTable, name: str) -> Mask:
        """Which rows have a column equal to the columns that it has to equal."""
        keep: Mask = np.ones(len(table), dtype=bool)
        for other in table.names:
            if other != name and self.equal.of(other) == self.equal.of(name):
                keep &= table[other] == table[name]
        return keep


def _answer(
    target: DeadZoneTarget, chosen: dict[str, float], status: str, bound: float
) -> DeadZone:
    """The stage of these values, with the slope's error and the threshold from the values alone."""
    source, reference, feedback, _ = HALVES[target.sides]
    slope = chosen[feedback] / chosen[source] / chosen["R50"]
    error = outside(slope, target.slope)
    if target.sides == "both":
        chosen = chosen | {other: chosen[name] for name, other in EQUAL}
    bound = min(bound, abs(error))
    return DeadZone(
        values={name: chosen[name] for name in sorted(chosen, key=lambda n: (len(n), n))},
        errors={"stop slope": error},
        threshold=target.reference * chosen[source] / chosen[reference],
        bound=bound,
        proved=abs(error) <= bound + EXACT,
        proof="every pair of R200 and R202 with the nearest R50 of the whole catalogue, where R201 "
        "and R206 exist for it",
        solver=status,
    )
