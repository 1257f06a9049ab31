"""Compiled loops of two masses with all terms: completing joined ratios to values.

All loops are exhaustive, as in ``linear_network.kernel_linear``; the mathematics stands in
``linear_network.linear_block``.
"""

from __future__ import annotations

import numpy as np

from designer.base.arrays import Array, Index
from designer.base.jit import callee, compiled
from designer.linear_network.kernel_linear import (
    C1,
    C2,
    C3,
    C4,
    COMPLETION,
    PAIR,
    R1,
    R2,
    R3,
    R4,
    R5,
    R7,
    R8,
    R9,
    R10,
    R11,
    TINY,
    Rules,
    Values,
    agree,
    below,
    clear,
    distinct,
    largest,
)


@callee
def _own(
    values: Values, rules: Rules, row: Index, pick: int, parts: Index, v: Array
) -> tuple[bool, float, float]:
    """Put a row's own parts and capacitors in ``parts`` and its six numbers in ``v``.

    Returns whether ties and time scale allow it, and the nominal scales alpha and p.
    """
    r, w = values.r, rules.w
    delta = values.deltas[row[0]]
    clear(parts)
    v[0], v[1] = r[row[1]] + w[0], r[row[2]] + delta + w[5]
    v[2], v[3] = r[row[3]] + w[1], r[row[4]] + delta + w[4]
    v[4] = 0.5 * (values.ratios[row[5]] - delta + w[2] - w[6])
    v[5] = 0.5 * (values.ratios[row[6]] - delta + w[3] - w[7])
    parts[R2], parts[R9], parts[R3], parts[R8] = row[1], row[2], row[3], row[4]
    parts[C2] = values.delta_c2[pick]
    alpha, p = 0.25 * (v[0] + v[1] + v[2] + v[3]), 0.5 * (v[2] - v[3])
    tau = alpha + values.c[parts[C2]]
    good = tau >= rules.seconds[0] - TINY and tau <= rules.seconds[1] + TINY
    good = good and agree(rules, parts, C4, values.delta_c4[pick])
    parts[C4] = values.delta_c4[pick]
    return good, alpha, p


@callee
def _side(
    values: Values,
    rules: Rules,
    parts: Index,
    v: Array,
    delta: float,
    scales: tuple[float, float],
    second: bool,
    ratio: int,
    level: float,
    completions: Index,
    numbers: Array,
) -> tuple[int, bool, int]:
    """Completions of one mass: stiffness pair, displacement integrator; error at most ``level``.

    completions (room, 4) gets the upper and lower resistor, then the integrator's resistor and
    capacitor; numbers (room, 4) the two further numbers of the minimax, the scale q and the error
    so far. Returns how many, whether there was room, and the steps.
    """
    r, w, peaks = values.r, rules.w, rules.peaks
    alpha, p = scales
    c2 = values.c[parts[C2]]
    upper, lower, resistor, capacitor = (R5, R11, R7, C3) if second else (R4, R10, R1, C1)
    w_up, w_low = (w[3], w[7]) if second else (w[2], w[6])
    place = 8 if second else 6
    middle, count, steps = 0.5 * (v[0] + v[1]), 0, 0
    for k in range(values.first[ratio], values.first[ratio + 1]):
        steps += PAIR
        up, low = values.upper[k], values.lower[k]
        parts[upper] = parts[lower] = parts[resistor] = parts[capacitor] = -1
        if not agree(rules, parts, upper, up):
            continue
        parts[upper] = up
        if not agree(rules, parts, lower, low):
            continue
        parts[lower] = low
        if second:
            q = r[low] + w_low - (alpha - delta)
            good = abs(peaks[3] - peaks[2] - q) <= rules.level + TINY
        else:
            q = r[up] + w_up - alpha
            velocity = peaks[1] - peaks[0] - q
            good = abs(velocity) <= rules.level + TINY
            good = good and rules.stop[0] - TINY <= r[up] <= rules.stop[1] + TINY
            good = good and max(velocity, velocity + peaks[3] - peaks[1] + p) <= rules.share + TINY
        if not good:
            continue
        # The first mass's upper and the second's lower resistor belong to inverted states.
        anchor = delta + r[low] + w_low if second else r[up] + w_up
        wanted = 2 * middle + c2 - anchor
        i = below(values.sums, wanted - 4 * level - TINY)
        while i < len(values.sums) and values.sums[i] <= wanted + 4 * level + TINY:
            steps += COMPLETION
            parts[resistor] = parts[capacitor] = -1
            fits = agree(rules, parts, resistor, values.sum_r[i])
            fits = fits and agree(rules, parts, capacitor, values.sum_c[i])
            parts[resistor], parts[capacitor] = values.sum_r[i], values.sum_c[i]
            fits = fits and (rules.most >= 14 or distinct(rules, parts) <= rules.most)
            v[place] = 0.5 * (r[up] + w_up + values.sums[i] - c2)
            v[place + 1] = 0.5 * (delta + r[low] + w_low + values.sums[i] - c2)
            if fits:
                error = max(largest(rules.six, v), largest(rules.two if second else rules.one, v))
                if error <= level + TINY:
                    if count == len(completions):
                        return count, False, steps
                    completions[count, 0], completions[count, 1] = up, low
                    completions[count, 2], completions[count, 3] = values.sum_r[i], values.sum_c[i]
                    numbers[count, 0], numbers[count, 1] = v[place], v[place + 1]
                    numbers[count, 2], numbers[count, 3] = q, error
                    count += 1
            i += 1
    parts[upper] = parts[lower] = parts[resistor] = parts[capacitor] = -1
    return count, True, steps


@callee
def _copy(into: Index, parts: Index) -> None:
    for i in range(len(parts)):
        into[i] = parts[i]


@callee
def _put(parts: Index, completion: Index, second: bool) -> None:
    """Put one completion (its four indices) among the parts."""
    if second:
        parts[R5], parts[R11] = completion[0], completion[1]
        parts[R7], parts[C3] = completion[2], completion[3]
    else:
        parts[R4], parts[R10] = completion[0], completion[1]
        parts[R1], parts[C1] = completion[2], completion[3]


@callee
def _pair(
    rules: Rules, parts: Index, v: Array, p: float, completion: Index, one: Array, two: Array
) -> float:
    """Error of a completion of both masses; infinite where the two do not go together.

    The first mass's parts are in place; found, two : of the second; one : of the first.
    """
    # ln of x2's peak voltage over x1's.
    if rules.peaks[2] - rules.peaks[0] - one[2] + p + two[2] > rules.share + TINY:
        return np.inf
    parts[R5] = parts[R11] = parts[R7] = parts[C3] = -1
    for k, part in enumerate((R5, R11, R7, C3)):
        if not agree(rules, parts, part, completion[k]):
            return np.inf
    v[6], v[7], v[8], v[9] = one[0], one[1], two[0], two[1]
    return float(max(one[3], two[3], largest(rules.both, v)))


@callee
def _sorted(keys: Array) -> Index:
    """Places of the keys in ascending order, equal ones as they come (Shell's method)."""
    n = len(keys)
    order = np.zeros(n, dtype=np.int64)
    for i in range(n):
        order[i] = i
    gap = 1
    while 3 * gap + 1 < n:
        gap = 3 * gap + 1
    while gap > 0:
        for i in range(gap, n):
            moved, j = order[i], i
            while j >= gap:
                other = order[j - gap]
                a, b = keys[other], keys[moved]
                if a < b or (a == b and other < moved):
                    break
                order[j] = other
                j -= gap
            order[j] = moved
        gap //= 3
    return order


@compiled
def complete(
    values: Values, rules: Rules, rows: Index, errors: Array, level: float, patience: int,
    room: int, best: Index,
) -> tuple[float, int, bool, int]:  # fmt: skip
    """The choice of least ten-term error that is at most ``level`` among these rows.

    rows come in ascending order of their eight-term error, so that the rest cannot be better once
    it passes the best. best (14,) gets the parts. Returns the error (infinite if there is none),
    how far any row came (0: no time scale, 1: no completion, 2: no pair, 3: found), whether
    nothing was left out for want of room or ``patience`` steps, and the steps.
    """
    gain = 1e-11
    found1, found2 = np.zeros((room, 4), dtype=np.int64), np.zeros((room, 4), dtype=np.int64)
    numbers1, numbers2 = np.zeros((room, 4)), np.zeros((room, 4))
    parts, v = np.zeros(14, dtype=np.int64), np.zeros(10)
    least, reached, whole, steps, any_found = level + gain, 0, True, 0, False
    for i in range(len(rows)):
        if errors[i] > least - gain:
            break
        if steps > patience:
            whole = False
            break
        row = rows[i]
        delta = values.deltas[row[0]]
        for pick in range(values.delta_first[row[0]], values.delta_first[row[0] + 1]):
            steps += COMPLETION
            good, alpha, p = _own(values, rules, row, pick, parts, v)
            if not good:
                continue
            reached = max(reached, 1)
            scales = (alpha, p)
            n1, full1, taken1 = _side(
                values, rules, parts, v, delta, scales, False, row[5], least, found1, numbers1
            )
            steps += taken1
            if n1 == 0:
                continue
            n2, full2, taken2 = _side(
                values, rules, parts, v, delta, scales, True, row[6], least, found2, numbers2
            )
            whole = whole and full1 and full2
            steps += taken2
            if n2 == 0:
                continue
            reached = max(reached, 2)
            order1 = _sorted(numbers1[:n1, 3])
            order2 = _sorted(numbers2[:n2, 3])
            for j in order1:
                if numbers1[j, 3] > least - gain:
                    break
                if steps > patience:
                    whole = False
                    break
                for k in order2:
                    if numbers2[k, 3] > least - gain:
                        break
                    steps += COMPLETION
                    _put(parts, found1[j], False)
                    error = _pair(rules, parts, v, p, found2[k], numbers1[j], numbers2[k])
                    if error > least - gain:
                        continue
                    _put(parts, found2[k], True)
                    if distinct(rules, parts) <= rules.most:
                        least, reached, any_found = error, 3, True
                        _copy(best, parts)
            clear(parts)
    return (least if any_found else np.inf), reached, whole, steps


@compiled
def gather(
    values: Values,
    rules: Rules,
    rows: Index,
    level: float,
    patience: int,
    room: int,
    fewest: int,
    groups: Index,
    first: Index,
    second: Index,
    best: Index,
) -> tuple[int, int, int, int, bool, int]:
    """Every completion of both masses that can belong to a choice of the fewest distinct values.

    Only choices with an error of at most ``level``. groups (g, 2) gets the row and the pair of
    capacitors; first, second (k, 5) the group and the four indices of a completion; best (14,) a
    choice of the fewest. fewest : a number of distinct values that is known to be reached, or
    more. Returns the fewest values, how many groups and completions were written, whether nothing
    was left out for want of room or ``patience`` steps, and the steps.
    """
    found1, found2 = np.zeros((room, 4), dtype=np.int64), np.zeros((room, 4), dtype=np.int64)
    numbers1, numbers2 = np.zeros((room, 4)), np.zeros((room, 4))
    kinds1, kinds2 = np.zeros((room, 1)), np.zeros((room, 1))
    parts, v = np.zeros(14, dtype=np.int64), np.zeros(10)
    n_groups, n_first, n_second, whole, steps = 0, 0, 0, True, 0
    for i in range(len(rows)):
        if steps > patience:
            whole = False
            break
        row = rows[i]
        delta = values.deltas[row[0]]
        for pick in range(values.delta_first[row[0]], values.delta_first[row[0] + 1]):
            good, alpha, p = _own(values, rules, row, pick, parts, v)
            if not good or distinct(rules, parts) > fewest:
                continue
            scales = (alpha, p)
            n1, full1, taken1 = _side(
                values, rules, parts, v, delta, scales, False, row[5], level, found1, numbers1
            )
            n2, full2, taken2 = _side(
                values, rules, parts, v, delta, scales, True, row[6], level, found2, numbers2
            )
            whole = whole and full1 and full2
            steps += COMPLETION + taken1 + taken2
            for k in range(n1):
                _put(parts, found1[k], False)
                kinds1[k, 0] = distinct(rules, parts)
            parts[R4] = parts[R10] = parts[R1] = parts[C1] = -1
            for k in range(n2):
                _put(parts, found2[k], True)
                kinds2[k, 0] = distinct(rules, parts)
            parts[R5] = parts[R11] = parts[R7] = parts[C3] = -1
            order1 = _sorted(kinds1[:n1, 0])
            order2 = _sorted(kinds2[:n2, 0])
            reached = False
            for j in order1:
                if kinds1[j, 0] > fewest:
                    break
                for k in order2:
                    if kinds2[k, 0] > fewest or (
                        reached and max(kinds1[j, 0], kinds2[k, 0]) >= fewest
                    ):
                        break
                    steps += COMPLETION
                    _put(parts, found1[j], False)
                    _put(parts, found2[k], True)
                    kinds = distinct(rules, parts)
                    if kinds > fewest or (reached and kinds == fewest):
                        continue
                    error = _pair(rules, parts, v, p, found2[k], numbers1[j], numbers2[k])
                    if error <= level + TINY:
                        reached = True
                        if kinds < fewest:
                            _put(parts, found2[k], True)
                            _copy(best, parts)
                        fewest = kinds
            if not reached:
                continue
            kept1, kept2 = 0, 0
            for k in range(n1):
                kept1 += kinds1[k, 0] <= fewest
            for k in range(n2):
                kept2 += kinds2[k, 0] <= fewest
            full = n_groups < len(groups)
            full = full and n_first + kept1 <= len(first) and n_second + kept2 <= len(second)
            if not full:
                whole = False
                continue
            for k in range(n1):
                if kinds1[k, 0] <= fewest:
                    first[n_first, 0] = n_groups
                    _copy(first[n_first, 1:], found1[k])
                    n_first += 1
            for k in range(n2):
                if kinds2[k, 0] <= fewest:
                    second[n_second, 0] = n_groups
                    _copy(second[n_second, 1:], found2[k])
                    n_second += 1
            groups[n_groups, 0], groups[n_groups, 1] = i, pick
            n_groups += 1
    return fewest, n_groups, n_first, n_second, whole, steps
