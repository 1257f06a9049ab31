"""Compiled loops of two masses with all terms: the catalogue's tables, joining ratios.

Everything is in logarithms and all loops are exhaustive: what they leave out cannot reach the
level or breaks a condition. The mathematics and the conditions stand in
``linear_network.linear_block``; parts are numbered as in its ``PARTS``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from designer.base.arrays import Array, Index, Mask
from designer.base.jit import callee, compiled

TINY = 1e-12
"""Allowance for rounding in every comparison of logarithms."""
PAIR, COMPLETION = 3, 20
"""Steps that a pair of resistors and a completion count for: a step is some nanoseconds."""
R1, R2, R3, R4, R5, R7, R8, R9, R10, R11, C1, C2, C3, C4 = range(14)


class Values(NamedTuple):
    """A catalogue in logarithms, sorted, with its sums and ratios."""

    r: Array
    """(n,) logarithms of the resistances, ascending."""
    c: Array
    """(m,) logarithms of the capacitances, ascending."""
    ratios: Array
    """(k,) distinct ratios of two resistors, ascending."""
    first: Index
    """(k + 1,) where the pairs of each ratio begin in ``upper`` and ``lower``."""
    upper: Index
    """Index into r of each pair's first resistor."""
    lower: Index
    """Index into r of each pair's second resistor."""
    sums: Array
    """(n·m,) sums of a resistor's and a capacitor's logarithm, ascending."""
    sum_r: Index
    """(n·m,) index into r of each sum."""
    sum_c: Index
    """(n·m,) index into c of each sum."""
    deltas: Array
    """(d,) distinct ratios C4/C2, nearest to zero first."""
    delta_first: Index
    """(d + 1,) where the pairs of each delta begin in ``delta_c2`` and ``delta_c4``."""
    delta_c2: Index
    """Index into c of each pair's C2."""
    delta_c4: Index
    """Index into c of each pair's C4."""


class Rules(NamedTuple):
    """What a choice must keep, beside the level of error."""

    w: Array
    """(8,) ln |wanted| of R2, R3, R4, R5, R8, R9, R10, R11."""
    seconds: Array
    """(2,) range of ln(time scale)."""
    level: float
    """ln of ``linear_block.Bounds.level``."""
    share: float
    """ln of ``linear_block.Bounds.share``."""
    stop: Array
    """(2,) range of ln R4."""
    peaks: Array
    """(4,) ln of the peaks of the states."""
    ties: Mask
    """(14, 14) true where two parts must be equal."""
    free_r: Mask
    """(n,) true for resistances that do not count as distinct."""
    free_c: Mask
    """(m,) true for capacitances that do not count as distinct."""
    most: int
    """Limit on distinct values."""
    six: tuple[Index, Array]
    """Elementary vectors of the six, as (k, 3) places and (k, 3) entries."""
    one: tuple[Index, Array]
    """Elementary vectors that hold values of the first mass, as (k, 3) places and (k, 3)
    entries."""
    two: tuple[Index, Array]
    """Elementary vectors that hold values of the second mass, as (k, 3) places and (k, 3)
    entries."""
    both: tuple[Index, Array]
    """Elementary vectors that hold values of both masses, as (k, 3) places and (k, 3) entries."""


@callee
def below(table: Array, x: float) -> int:
    """How many entries of the sorted table are smaller than x."""
    low, high = 0, len(table)
    while low < high:
        middle = (low + high) // 2
        if table[middle] < x:
            low = middle + 1
        else:
            high = middle
    return low


@callee
def largest(vectors: tuple[Index, Array], v: Array) -> float:
    """Largest |y · v| over elementary vectors y."""
    places, entries = vectors
    out = 0.0
    for k in range(len(places)):
        total = (
            entries[k, 0] * v[places[k, 0]]
            + entries[k, 1] * v[places[k, 1]]
            + entries[k, 2] * v[places[k, 2]]
        )
        out = max(out, abs(total))
    return out


@callee
def agree(rules: Rules, parts: Index, part: int, value: int) -> bool:
    """Whether part number ``part`` may have this value beside those chosen (-1: not yet)."""
    for other in range(14):
        if rules.ties[part, other] and parts[other] >= 0 and parts[other] != value:
            return False
    return True


@callee
def distinct(rules: Rules, parts: Index) -> int:
    """Distinct values among the parts chosen, without the preferred ones."""
    count = 0
    for i in range(14):
        if parts[i] < 0 or (rules.free_r[parts[i]] if i < 10 else rules.free_c[parts[i]]):
            continue
        new = True
        for j in range(0 if i < 10 else 10, i):
            new = new and parts[j] != parts[i]
        count += new
    return count


@callee
def clear(parts: Index) -> None:
    """No part is chosen."""
    for i in range(14):
        parts[i] = -1


@callee
def _ranges(
    values: Values,
    rules: Rules,
    delta: float,
    c2: tuple[float, float],
    a: float,
    p: float,
    slack: float,
    out: Array,
) -> bool:
    """Ranges (low, high) of ln R4 and ln R11 that the conditions leave, in out[0], out[1].

    a, p : scales, each within ``slack`` of the nominal ones; c2 : range of ln C2.
    """
    r, w, peaks = values.r, rules.w, rules.peaks
    low, high = r[0], r[-1]
    c_low = max(c2[0], rules.seconds[0] - a) - slack
    c_high = min(c2[1], rules.seconds[1] - a) + slack
    if c_low > c_high:
        return False
    s_low, s_high = values.sums[0], values.sums[-1]
    ratio4, ratio5 = delta + p + w[6] - w[2], delta + p + w[7] - w[3]
    # R4: its own range, R10's, the stop, the levels of x1' and x2', R1 C1.
    centre = peaks[1] - peaks[0] + a - w[2]
    low4 = max(low, low + ratio4 - slack, rules.stop[0] - slack)
    low4 = max(low4, centre - min(rules.level, rules.share))
    low4 = max(low4, centre + peaks[3] - peaks[1] + p - rules.share, c_low + 2 * a - w[2] - s_high)
    high4 = min(high, high + ratio4 + slack, centre + rules.level, c_high + 2 * a - w[2] - s_low)
    high4 = min(high4, rules.stop[1] + slack)
    out[0, 0], out[0, 1] = low4 - 4 * slack, high4 + 4 * slack
    if out[0, 0] > out[0, 1]:
        return False
    # R11: its own range, R5's, the levels of x2' and x2, R7 C3.
    centre = peaks[3] - peaks[2] + a - delta - w[7]
    time = 2 * a - delta - w[7]
    low11 = max(low, low - ratio5 - slack, centre - rules.level, c_low + time - s_high)
    high11 = min(high, high - ratio5 + slack, centre + rules.level, c_high + time - s_low)
    # ln of x2's peak voltage over x1's is q3 - q1 + p + ...; R4 at its largest leaves most room.
    q1 = min(out[0, 1], high) + w[2] - a
    high11 = min(high11, rules.share - peaks[2] + peaks[0] + q1 - p + a - delta - w[7])
    out[1, 0], out[1, 1] = low11 - 4 * slack, high11 + 4 * slack
    return bool(out[1, 0] <= out[1, 1])


@callee
def _tied(rules: Rules, delta: float, p: float, slack: float) -> bool:
    """Whether ties between the masses allow these ratios of capacitors and of velocities.

    Where R1 = R7 and C1 = C3, equal stiffness resistors need equal wanted products.
    """
    if not (rules.ties[R1, R7] and rules.ties[C1, C3]):
        return True
    w = rules.w
    wanted = (-w[2], -p - delta - w[6], p - w[3], -delta - w[7])
    for i, one in enumerate((R4, R10, R5, R11)):
        for j, two in enumerate((R4, R10, R5, R11)):
            if rules.ties[one, two] and abs(wanted[i] - wanted[j]) > slack:
                return False
    return True


@callee
def _ratios(
    values: Values,
    rules: Rules,
    parts: Index,
    pair: tuple[int, int],
    allowed: Array,
    by_upper: bool,
    centre: float,
    half: float,
    most: int,
    pairs: Index,
) -> tuple[int, int]:
    """Ratios within ``half`` of ``centre`` that some allowed pair of resistors has; the steps.

    allowed : range of ln of the upper (else lower) resistor of the pair of parts. most : distinct
    resistors that there may be, with those chosen already.
    """
    count, steps = 0, 0
    k = below(values.ratios, centre - half)
    while k < len(values.ratios) and values.ratios[k] <= centre + half:
        for i in range(values.first[k], values.first[k + 1]):
            steps += PAIR
            upper, lower = values.upper[i], values.lower[i]
            anchor = values.r[upper] if by_upper else values.r[lower]
            if (
                anchor < allowed[0]
                or anchor > allowed[1]
                or not agree(rules, parts, pair[0], upper)
                or not agree(rules, parts, pair[1], lower)
                or (upper != lower and rules.ties[pair[0], pair[1]])
            ):
                continue
            if most < 10:
                parts[pair[0]], parts[pair[1]] = upper, lower
                kinds = distinct(rules, parts)
                parts[pair[0]] = parts[pair[1]] = -1
                if kinds > most:
                    continue
            pairs[count] = k
            count += 1
            break
        k += 1
    return count, steps


@compiled
def join(
    values: Values, rules: Rules, level: float, start: int, patience: int, rows: Index,
    errors: Array,
) -> tuple[int, int, int]:  # fmt: skip
    """Rows (delta, R2, R9, R3, R8, R4/R10, R5/R11) whose eight-term error is at most ``level``.

    Begins with pair ``start`` of (delta, R2), counted delta · n + R2, and ends after the last one,
    where ``rows`` is full or after ``patience`` steps. Returns the pair to go on with, the rows
    written, and the steps taken; if the first pair alone fills ``rows``, that pair is ``start``.
    """
    r, w = values.r, rules.w
    n, room = len(r), len(errors)
    w2, w3, w8, w9 = w[0], w[1], w[4], w[5]
    v, allowed = np.zeros(10), np.zeros((2, 2))
    parts = np.zeros(14, dtype=np.int64)
    found4 = np.zeros(len(values.ratios), dtype=np.int64)
    found5 = np.zeros(len(values.ratios), dtype=np.int64)
    fives = np.zeros(len(values.ratios))
    count, steps = 0, 0
    stop = n * len(values.deltas)
    for outer in range(start, stop):
        if steps > patience:
            return outer, count, steps
        begin = count
        i_delta, i2 = outer // n, outer % n
        delta = values.deltas[i_delta]
        if rules.ties[C2, C4] and abs(delta) > TINY:
            continue
        own = values.delta_c2[values.delta_first[i_delta] : values.delta_first[i_delta + 1]]
        c2 = (values.c[own[0]], values.c[own[-1]])
        # C2 and C4 have a value of their own, and where they differ two, unless it is preferred.
        most = rules.most - (0 if rules.free_c.any() else 1 + (abs(delta) > TINY))
        clear(parts)
        parts[R2] = i2
        v[0] = r[i2] + w2
        i9 = below(r, v[0] - delta - w9 - 2 * level - TINY)
        while i9 < n and r[i9] + delta + w9 <= v[0] + 2 * level + TINY:
            parts[R3] = parts[R8] = parts[R9] = -1
            v[1] = r[i9] + delta + w9
            if not agree(rules, parts, R9, i9):
                i9 += 1
                continue
            parts[R9] = i9
            for i3 in range(n):
                steps += 1
                v[2] = r[i3] + w3
                # Half the product R3 R8 is e24 + e42 - e22 - e44 within 4 levels.
                wanted = v[0] + v[1] - v[2] - delta - w8
                if wanted < r[0] - 4 * level - TINY or wanted > r[-1] + 4 * level + TINY:
                    continue
                parts[R3] = parts[R8] = -1
                if not agree(rules, parts, R3, i3):
                    continue
                parts[R3] = i3
                p = v[2] - 0.5 * (v[0] + v[1])
                centre = rules.peaks[1] - rules.peaks[3]
                if abs(p - centre) > rules.level + 4 * level:
                    continue
                if not _tied(rules, delta, p, 8 * level + TINY):
                    continue
                mean = 0.5 * (v[0] + v[1])
                if not _ranges(values, rules, delta, c2, mean, p, 4 * level + TINY, allowed):
                    continue
                i8 = below(r, wanted - 4 * level - TINY)
                while i8 < n and r[i8] <= wanted + 4 * level + TINY:
                    steps += 1
                    v[3] = r[i8] + delta + w8
                    parts[R8] = -1
                    fits = (
                        agree(rules, parts, R8, i8)
                        and abs(0.5 * (v[2] - v[3]) - centre) <= rules.level + TINY
                    )
                    parts[R8] = i8
                    # e22, e44 and e24 + e42: the four alone.
                    spread = max(
                        abs(v[0] - v[1]) / 2,
                        abs(2 * v[0] - v[2] - v[3]) / 4,
                        abs(2 * v[1] - v[2] - v[3]) / 4,
                    )
                    if not fits or spread > level + TINY or distinct(rules, parts) > most:
                        i8 += 1
                        continue
                    half = 4 * level + TINY
                    count4, taken = _ratios(
                        values, rules, parts, (R4, R10), allowed[0], True,
                        delta + p + w[6] - w[2], half, most, found4,
                    )  # fmt: skip
                    steps += taken
                    if count4:
                        count5, taken = _ratios(
                            values, rules, parts, (R5, R11), allowed[1], False,
                            delta + p + w[7] - w[3], half, most, found5,
                        )  # fmt: skip
                        steps += taken
                        for k in range(count5):
                            fives[k] = 0.5 * (values.ratios[found5[k]] - delta + w[3] - w[7])
                        for h in range(count4):
                            v[4] = 0.5 * (values.ratios[found4[h]] - delta + w[2] - w[6])
                            for k in range(count5):
                                steps += PAIR
                                v[5] = fives[k]
                                if abs(v[4] - v[5]) > 2 * level + TINY:
                                    continue
                                error = largest(rules.six, v)
                                if error > level + TINY:
                                    continue
                                if count == room:
                                    return outer, begin, steps
                                rows[count, 0], rows[count, 1], rows[count, 2] = i_delta, i2, i9
                                rows[count, 3], rows[count, 4] = i3, i8
                                rows[count, 5], rows[count, 6] = found4[h], found5[k]
                                errors[count] = error
                                count += 1
                    i8 += 1
            i9 += 1
    return stop, count, steps
