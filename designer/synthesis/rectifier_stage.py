"""Sizing the rectifying dead zone: flat by construction, its threshold set by a reference.

Beyond the threshold Vref R200/R201 a half's output is fv = (R202/R200) (v1 - threshold), so the
stop's slope is R202/(R200 R50). Three lists: every pair (R200, R202) with the nearest R50 is looked
at, so the least error is that of the whole catalogue. R201 has to put the threshold inside its
window, R206 has to keep the reference's current between its limits.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array, Mask
from designer.base.progress import doing
from designer.circuit.coefficients import EXACT
from designer.synthesis.dead_zone_target import DeadZone, DeadZoneTarget, outside
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
EXPANDED, ROWS, FEEDS = 1_000_000, 400, 12


@dataclass(frozen=True)
class Lists:
    """What can be bought for each part, and which parts are equal."""

    names: tuple[str, str, str, str]
    """Names of the parts; the last feeds the stage."""
    of: Mapping[str, Array]
    """Values [ohm] by part name."""
    tie: Mapping[str, str]
    """Group by part name; parts of one group are equal."""

    def group(self, name: str) -> str:
        """The name that all parts equal to this one share."""
        return self.tie.get(name, name)

    @property
    def feed_is_tied(self) -> bool:
        """Whether R206 has to equal a part whose value is chosen with the slope."""
        *others, feed = self.names
        return any(self.group(feed) == self.group(name) for name in [*others, "R50"])


@dataclass(frozen=True)
class ThresholdRange:
    """Ranges (low, high) of the threshold [V] and of the fv slope."""

    threshold: tuple[float, float]
    """Least and largest threshold [V]."""
    gain: tuple[float, float]
    """Least and largest fv slope."""


def size(
    target: DeadZoneTarget,
    resistors: Array,
    ranking: Ranking,
    tie: Mapping[str, str],
    value: Mapping[str, float],
) -> DeadZone | str:
    """The stage, or the name of the condition that leaves none. tie, value : parts that are equal,
    parts that are given."""
    heavy = resistors[resistors >= target.load]
    names = HALVES[target.sides]
    every = dict.fromkeys((*names[:3], "R50"), heavy) | {names[3]: resistors}
    for name, given in value.items():
        if name in every:
            every[name] = every[name][np.isclose(every[name], given, rtol=1e-9)]
    lists = Lists(names, every, tie)
    best: tuple[float, ThresholdRange] | None = None
    binding, looked_at, bound = "", 0, 0.0
    for number, (limits, last) in enumerate(_limits(target), start=1):
        doing(f"dead zone, range {number}")
        pairs, why = _pairs(target, lists, limits)
        looked_at += len(pairs)
        least = _least(target, lists, pairs)
        if least > LAST_LEVEL:
            # The first ranges are those that a design should have.
            binding = binding or why
            continue
        # A wider range only where it is of use: the narrow one has the better threshold.
        if best is None or least < best[0] - EXACT:
            best = (least, limits)
        bound = least
        if last:
            break
    if best is None:
        return binding
    least, limits = best
    level = max(least, EXACT) + ranking.slack
    while level <= LAST_LEVEL * GROWTH:
        found = _choose(target, lists, limits, level * (1.0 + 1e-9), ranking)
        if found is not None:
            chosen, word = found
            return _answer(target, lists, chosen, min(bound, least), word, looked_at)
        level *= GROWTH
    return "distinct values" if ranking.most is not None else "matched parts"


def _limits(target: DeadZoneTarget) -> list[tuple[ThresholdRange, bool]]:
    """Ranges to try in turn; whether an answer inside them ends the search."""
    out = []
    for threshold, gain in ROOMS:
        limits = ThresholdRange(
            (target.threshold / threshold, target.threshold),
            (target.output_gain / gain, target.output_gain),
        )
        out.append((limits, target.strict and threshold == ROOMS[-1][0]))
    if target.strict:
        out.append((ThresholdRange((0.0, target.threshold), (0.0, target.output_gain)), True))
    else:
        out.append((ThresholdRange((0.0, np.inf), (0.0, np.inf)), True))
    return out


def _pairs(target: DeadZoneTarget, lists: Lists, limits: ThresholdRange) -> tuple[ValueTable, str]:
    """Every pair of input and feedback for which the other parts exist, and what binds if none."""
    source, _, feedback, _ = lists.names
    pairs = combinations((source, feedback), lists.of, lists.tie)
    gain = pairs[feedback] / pairs[source]
    pairs = pairs.take(inside(gain, limits.gain))
    if len(pairs) == 0:
        return pairs, "stop slope"
    inputs, place = np.unique(pairs[source], return_inverse=True)
    largest, why = _largest_reference(target, lists, limits, inputs)
    pairs = pairs.take(largest[place] > 0.0)
    if len(pairs) == 0:
        return pairs, why
    # The largest R201 leaves the least noise gain.
    largest = largest[place][largest[place] > 0.0]
    noise = 1.0 + pairs[feedback] * (1.0 / pairs[source] + 1.0 / largest)
    pairs = pairs.take(noise <= target.noise_gain)
    return pairs, "stop slope" if len(pairs) else "noise gain"


def _largest_reference(
    target: DeadZoneTarget, lists: Lists, limits: ThresholdRange, inputs: Array
) -> tuple[Array, str]:
    """For each R200 the largest R201 that will do, 0 where none will; and what binds."""
    low, high = _reference_range(target, limits, inputs)
    allowed = lists.of[lists.names[1]]
    row, hit = between(allowed, low, high)
    out = np.zeros(len(inputs))
    if len(row) == 0:
        return out, "threshold"
    fed = _can_be_fed(target, lists.of[lists.names[3]], allowed[hit])
    np.maximum.at(out, row[fed], allowed[hit][fed])
    return out, "reference current"


def _reference_range(
    target: DeadZoneTarget, limits: ThresholdRange, inputs: Array
) -> tuple[Array, Array]:
    """Range of R201 = Vref R200/threshold for each R200."""
    volts = target.reference * inputs
    low = volts / limits.threshold[1] * (1.0 - 1e-9)
    high = np.full(len(inputs), np.inf)
    if limits.threshold[0] > 0.0:
        high = volts / limits.threshold[0] * (1.0 + 1e-9)
    return low, high


def _current(target: DeadZoneTarget, feed: Array, reference: Array) -> Array:
    """Through the reference [A]: what the feed brings less what R201 takes."""
    return np.asarray((target.supply - target.reference) / feed - target.reference / reference)


def _can_be_fed(target: DeadZoneTarget, feeds: Array, reference: Array) -> Mask:
    """Whether some feed keeps the reference's current between its limits, for each R201."""
    least, most = target.reference_current
    drop = target.supply - target.reference
    load = target.reference / reference
    high = drop / (least + load) if drop > 0.0 else np.zeros(len(load))
    low = np.maximum(drop, 0.0) / (most + load)
    return np.asarray(how_many_between(feeds, low * (1 - 1e-9), high * (1 + 1e-9)) > 0)


def _least(target: DeadZoneTarget, lists: Lists, pairs: ValueTable) -> float:
    """The least slope error of all pairs with all R50: no choice has a smaller one."""
    low, high = np.log(target.slope)
    gain = np.log(pairs.values[:, 1] / pairs.values[:, 0])
    stop = np.log(lists.of["R50"])
    return float(distance(stop, gain - high, gain - low).min(initial=np.inf))


def _choose(
    target: DeadZoneTarget, lists: Lists, limits: ThresholdRange, level: float, ranking: Ranking
) -> tuple[dict[str, float], str] | None:
    """The values with an error up to ``level`` that cvxpy prefers, and the solver's word."""
    main = _main_rows(target, lists, limits, level, ranking.free)
    if len(main) == 0:
        return None
    tables = [main]
    if not lists.feed_is_tied:
        tables.append(_feed_rows(target, lists, main, ranking.free))
    found = choose(tables, (), ranking)
    if found is None:
        return None
    chosen: dict[str, float] = {}
    for rows, i in zip(tables, found.rows, strict=True):
        chosen |= dict(zip(rows.table.names, rows.table.values[i].tolist(), strict=True))
    return {name: chosen[name] for name in (*lists.names, "R50")}, found.solver


def _main_rows(
    target: DeadZoneTarget,
    lists: Lists,
    limits: ThresholdRange,
    level: float,
    free: frozenset[float],
) -> TableRows:
    """Rows of R200, R202, R50, R201 (and R206 where it equals one of them), at most ``ROWS``; the
    key is R201's place on its list."""
    source, reference, feedback, feed = lists.names
    pairs, _ = _pairs(target, lists, limits)
    low, high = np.log(target.slope)
    gain = np.log(pairs[feedback] / pairs[source])
    stop = np.log(lists.of["R50"])
    row, hit = between(stop, gain - high - level, gain - low + level)
    table = pairs.take(row).beside(_column("R50", lists.of["R50"][hit]))
    total = gain[row] - stop[hit]
    error = np.maximum(np.maximum(low - total, total - high), 0.0)
    rows = _equal(TableRows(table, error, np.zeros(len(table), dtype=np.intp)), lists, "R50")
    rows = rows.take(fewest(rows, free, EXPANDED))
    allowed = lists.of[reference]
    row, hit = between(allowed, *_reference_range(target, limits, rows.table[source]))
    table = rows.table.take(row).beside(_column(reference, allowed[hit]))
    noise = 1.0 + table[feedback] * (1.0 / table[source] + 1.0 / table[reference])
    fine = noise <= target.noise_gain
    rows = _equal(TableRows(table, rows.error[row], hit), lists, reference, fine)
    if not lists.feed_is_tied:
        fed = _can_be_fed(target, lists.of[feed], rows.table[reference])
        rows = rows.take(np.flatnonzero(fed))
        return rows.take(fewest(rows, free, ROWS))
    like = next(name for name in rows.table.names if lists.group(name) == lists.group(feed))
    table = rows.table.beside(_column(feed, rows.table[like]))
    current = _current(target, table[feed], table[reference])
    fine = inside(current, target.reference_current)
    fine &= np.isin(table[feed], lists.of[feed])
    rows = TableRows(table, rows.error, rows.key).take(np.flatnonzero(fine))
    return rows.take(fewest(rows, free, ROWS))


def _feed_rows(
    target: DeadZoneTarget, lists: Lists, main: TableRows, free: frozenset[float]
) -> TableRows:
    """For each R201 of the rows the feeds that will do: known values first, then the largest."""
    reference, feed = lists.names[1], lists.names[3]
    known = np.array(sorted({*free, *np.unique(main.table.values).tolist()}))
    found: list[tuple[Array, int]] = []
    for key in np.unique(main.key):
        value = main.table[reference][main.key == key][:1]
        every = lists.of[feed]
        fine = every[inside(_current(target, every, value), target.reference_current)]
        order = np.lexsort((-fine, ~np.isin(fine, known)))
        found.append((fine[order[:FEEDS]], int(key)))
    values = np.concatenate([v for v, _ in found])
    keys = np.concatenate([np.full(len(v), key) for v, key in found])
    return TableRows(_column(feed, values), np.zeros(len(values)), keys)


def _equal(rows: TableRows, lists: Lists, name: str, fine: Mask | None = None) -> TableRows:
    """The rows where a new column equals the columns that it is tied to."""
    keep: Mask = np.ones(len(rows), dtype=bool) if fine is None else fine
    for other in rows.table.names:
        if other != name and lists.group(other) == lists.group(name):
            keep = keep & (rows.table[other] == rows.table[name])
    return rows.take(np.flatnonzero(keep))


def _column(name: str, values: Array) -> ValueTable:
    return ValueTable((name,), values[:, None])


def errors(target: DeadZoneTarget, values: Mapping[str, float]) -> dict[str, float]:
    """The slope's error of finished values; both halves are alike."""
    source, _, feedback, _ = HALVES[target.sides]
    return {"stop slope": outside(values[feedback] / values[source] / values["R50"], target.slope)}


def threshold(target: DeadZoneTarget, values: Mapping[str, float]) -> float:
    """v1 at the stop [V]."""
    source, reference, _, _ = HALVES[target.sides]
    return target.reference * values[source] / values[reference]


def _answer(
    target: DeadZoneTarget,
    lists: Lists,
    chosen: dict[str, float],
    bound: float,
    word: str,
    looked_at: int,
) -> DeadZone:
    values = {"R50": chosen["R50"]} | {name: chosen[name] for name in lists.names}
    if target.sides == "both":
        values |= {other: values[name] for name, other in EQUAL}
    found = errors(target, values)
    worst = abs(found["stop slope"])
    bound = min(bound, worst)
    return DeadZone(
        values={name: values[name] for name in sorted(values, key=lambda n: (len(n), n))},
        errors=found,
        threshold=threshold(target, values),
        bound=bound,
        proved=worst <= bound + EXACT,
        proof="every pair of R200 and R202 with the nearest R50 of the whole catalogue, where R201 "
        "and R206 exist for it",
        solver=word,
        looked_at=looked_at,
        seconds=0.0,
    )
