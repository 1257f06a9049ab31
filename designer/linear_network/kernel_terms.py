"""Compiled loops of the linear block with any pattern of terms: all choices up to an error.

Everything is in logarithms. A term from state b into the integrator of state a has the error

    T + p_b - p_a - (r + c_a + w)

(T the time scale, p the volts of a state per model unit, r and c the parts, w ln of the wanted
coefficient). T is cut into cells; inside one all terms are limits on differences of two p, kept
closed under addition (shortest paths). Parts are chosen term by term: a term whose two states are
already tied to each other leaves a narrow window of values. Terms come in groups; a group that
nothing later needs is only probed where its states become tied, and chosen at the end. What is
left out cannot reach the level or breaks a condition; what is returned may exceed the level by
half a cell.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from designer.base.arrays import Array, Index, Mask
from designer.base.jit import callee, compiled
from designer.linear_network.kernel_linear import TINY, below

CELL = 0.5
"""Width of a cell of T over the level of error."""
UNDAMPED_CELL = 2e-5
"""Least width where no state is damped by itself: then nothing tells which cells have parts."""


class TermRules(NamedTuple):
    """The terms in the order in which they are chosen, what can be bought, and the conditions."""

    target: Index
    """(k,) state whose integrator each term feeds."""
    source: Index
    """(k,) state that it comes from."""
    wanted: Array
    """(k,) ln of the wanted coefficient."""
    first: Mask
    """(k,) whether the term is the first of its integrator, and so brings the capacitor."""
    probes: Index
    """(j, 3) probes, ascending: before which term, and the range of terms that must have parts."""
    r: Array
    """(n,) logarithms of the resistances, ascending."""
    c: Array
    """(m,) logarithms of the capacitances, ascending."""
    sums: Array
    """(n·m,) sums of a resistor's and a capacitor's logarithm, ascending."""
    sum_r: Index
    """(n·m,) index into r of each sum."""
    sum_c: Index
    """(n·m,) index into c of each sum."""
    allowed: Array
    """(k, 2) range of ln of each term's resistor."""
    apart: Array
    """(s, s) largest p of the row's state minus p of the column's; infinite where free."""
    seconds: Array
    """(2,) range of T."""
    like: Index
    """(k + s,) an earlier part that each resistor, then each capacitor, must equal; or -1."""
    fixed: Index
    """(k + s,) the only value that each resistor, then each capacitor, may have; or -1."""
    free_r: Mask
    """(n,) true for resistances that do not count as distinct."""
    free_c: Mask
    """(m,) true for capacitances that do not count as distinct."""
    prices: Array
    """(m,) price class of each capacitance."""


class _Stack(NamedTuple):
    """Where a search stands: limits before each term, the candidates left, the parts chosen.

    Candidates are taken round from one that ``random`` draws; in their order where it is 0.
    """

    apart: Array
    time: Array
    at: Index
    end: Index
    many: Index
    turn: Index
    random: Index
    kinds: Index
    price: Array
    parts: Index


@callee
def _stack(k: int, s: int) -> _Stack:
    return _Stack(
        np.zeros((k + 1, s, s)),
        np.zeros((k + 1, 2)),
        np.zeros(k, dtype=np.int64),
        np.zeros(k, dtype=np.int64),
        np.zeros(k, dtype=np.int64),
        np.zeros(k, dtype=np.int64),
        np.zeros(1, dtype=np.int64),
        np.zeros(k + 1, dtype=np.int64),
        np.zeros(k + 1),
        np.full(k + s, -1, dtype=np.int64),
    )


@callee
def _copy(source: Array, out: Array) -> None:
    """out ← source, two of one shape. Element by element: the assignment of a whole array would
    bring its error message, which takes long to compile."""
    for i in range(source.shape[0]):
        for j in range(source.shape[1]):
            out[i, j] = source[i, j]


@callee
def _nearer(apart: Array, a: int, b: int, low: float, high: float, out: Array) -> bool:
    """The limits with low <= p_b - p_a <= high too, in ``out``; false where none are left."""
    if high < -apart[a, b] - TINY or low > apart[b, a] + TINY:
        return False
    for i in range(len(apart)):
        to_b, to_a = apart[i, b] + high, apart[i, a] - low
        for j in range(len(apart)):
            out[i, j] = min(apart[i, j], to_b + apart[a, j], to_a + apart[b, j])
    return True


@callee
def _window(rules: TermRules, at: _Stack, term: int, level: float) -> None:
    """The candidates of a term, from the limits before it."""
    a, b = rules.target[term], rules.source[term]
    low = at.time[term, 0] - at.apart[term, a, b] - rules.wanted[term] - level - TINY
    high = at.time[term, 1] + at.apart[term, b, a] - rules.wanted[term] + level + TINY
    if rules.first[term]:
        at.at[term], at.end[term] = below(rules.sums, low), below(rules.sums, high)
    else:
        own = rules.c[at.parts[len(rules.target) + a]]
        low = max(low - own, rules.allowed[term, 0] - TINY)
        high = min(high - own, rules.allowed[term, 1] + TINY)
        at.at[term], at.end[term] = below(rules.r, low), below(rules.r, high)
    at.many[term], at.turn[term] = max(at.end[term] - at.at[term], 0), 0
    if at.random[0] > 0 and at.many[term] > 0:
        at.random[0] = (at.random[0] * 1103515245 + 12345) % 2147483648
        at.turn[term] = (at.random[0] // 1024) % at.many[term]


@callee
def _counts(rules: TermRules, at: _Stack, term: int, most: int, least_price: float) -> bool:
    """Whether the parts up to this term are few and cheap enough; they are counted in any case."""
    k, a = len(rules.target), rules.target[term]
    resistor, capacitor = at.parts[term], at.parts[k + a]
    fresh = not rules.free_r[resistor]
    for i in range(term):
        fresh = fresh and at.parts[i] != resistor
    kinds, price = at.kinds[term] + fresh, at.price[term]
    if rules.first[term]:
        price += rules.prices[capacitor]
        fresh = not rules.free_c[capacitor]
        for i in range(term):
            fresh = fresh and at.parts[k + rules.target[i]] != capacitor
        kinds += fresh
    at.kinds[term + 1], at.price[term + 1] = kinds, price
    return bool(kinds < most or (kinds == most and price < least_price))


@callee
def _differs(rules: TermRules, at: _Stack, part: int, value: int) -> bool:
    """Whether a part is to have another value, its own or that of one which it must equal."""
    like, fixed = rules.like[part], rules.fixed[part]
    if fixed >= 0 and fixed != value:
        return True
    return bool(like >= 0 and at.parts[like] >= 0 and at.parts[like] != value)


@callee
def _place(
    rules: TermRules, at: _Stack, term: int, level: float, most: int, least_price: float
) -> bool:
    """Whether the next candidate of a term fits; then the limits after it are set."""
    k, a, b = len(rules.target), rules.target[term], rules.source[term]
    i = at.at[term] + at.turn[term]
    i -= at.many[term] if i >= at.end[term] else 0
    at.at[term] += 1
    resistor, capacitor = i, at.parts[k + a]
    if rules.first[term]:
        resistor, capacitor = rules.sum_r[i], rules.sum_c[i]
        if _differs(rules, at, k + a, capacitor):
            return False
    r = rules.r[resistor]
    if r < rules.allowed[term, 0] - TINY or r > rules.allowed[term, 1] + TINY:
        return False
    if _differs(rules, at, term, resistor):
        return False
    total = r + rules.c[capacitor] + rules.wanted[term]
    before, after = at.time[term], at.time[term + 1]
    after[0], after[1] = before[0], before[1]
    if a == b:
        after[0], after[1] = max(before[0], total - level), min(before[1], total + level)
        if after[0] > after[1] + TINY:
            return False
        _copy(at.apart[term], at.apart[term + 1])
    else:
        low, high = total - level - before[1], total + level - before[0]
        if not _nearer(at.apart[term], a, b, low, high, at.apart[term + 1]):
            return False
    at.parts[term], at.parts[k + a] = resistor, capacitor
    return most >= len(at.parts) or _counts(rules, at, term, most, least_price)


@callee
def _probe(
    rules: TermRules, at: _Stack, other: _Stack, which: int, level: float, patience: int
) -> tuple[bool, int]:
    """Whether the terms of a probe have parts where ``at`` stands; and the steps."""
    now, begin, end = rules.probes[which]
    _copy(at.apart[now], other.apart[begin])
    other.time[begin, 0], other.time[begin, 1] = at.time[now, 0], at.time[now, 1]
    for i in range(len(at.parts)):
        other.parts[i] = at.parts[i]
    for i in range(now, len(rules.target)):  # what is not chosen yet
        other.parts[i] = -1
        if rules.first[i]:
            other.parts[len(rules.target) + rules.target[i]] = -1
    term, steps = begin, 0
    _window(rules, other, term, level)
    while term >= begin and steps <= patience:
        if other.at[term] >= other.end[term]:
            term -= 1
            continue
        steps += 1
        if not _place(rules, other, term, level, len(other.parts), np.inf):
            continue
        if term + 1 == end:
            return True, steps
        term += 1
        _window(rules, other, term, level)
    return False, steps


@callee
def _promising(
    rules: TermRules, at: _Stack, other: _Stack, term: int, level: float, patience: int
) -> tuple[bool, int]:
    """Whether all groups that are probed before this term have parts; and the steps."""
    steps = 0
    for which in range(len(rules.probes)):
        if rules.probes[which, 0] == term:
            good, taken = _probe(rules, at, other, which, level, patience)
            steps += taken
            if not good:
                return False, steps
    return True, steps


@callee
def _next_cell(rules: TermRules, t: float, level: float) -> float:
    """The first T from t on that a damping of a state by itself, if it comes first, has parts
    for."""
    if rules.target[0] != rules.source[0]:
        return t
    i = below(rules.sums, t - rules.wanted[0] - level - TINY)
    return np.inf if i == len(rules.sums) else max(t, rules.sums[i] + rules.wanted[0] - level)


@callee
def _cell(
    rules: TermRules, at: _Stack, other: _Stack, level: float, patience: int, most: int,
    least_price: float, rows: Index, count: int,
) -> tuple[bool, int, int]:  # fmt: skip
    """The choices in the cell of T where ``at`` begins, written from row ``count`` on: whether the
    cell came to its end, the rows written by now and the steps."""
    term, steps = 0, 1
    _window(rules, at, term, level)
    while term >= 0:
        if steps > patience:
            return False, count, steps
        if at.at[term] >= at.end[term]:
            term -= 1
            continue
        steps += 1
        if not _place(rules, at, term, level, most, least_price):
            continue
        if term + 1 == len(rules.target):
            rows[count] = at.parts
            count += 1
            if count == len(rows):
                return False, count, steps
            continue
        good, taken = _promising(rules, at, other, term + 1, level, patience - steps)
        steps += taken
        if good:
            term += 1
            _window(rules, at, term, level)
    return True, count, steps


@callee
def _width(rules: TermRules, level: float) -> float:
    """Width of a cell of T."""
    wide = CELL * level
    return wide if rules.target[0] == rules.source[0] else max(wide, UNDAMPED_CELL)


@compiled
def choices(
    rules: TermRules, level: float, start: float, patience: int, most: int, least_price: float,
    rows: Index,
) -> tuple[float, int, int]:  # fmt: skip
    """Choices (resistor of each term, capacitor of each state) with an error of about ``level``.

    Begins with the cell of T at ``start`` and ends past the last one, at the end of a cell in
    which rows were written, where ``rows`` is full or after ``patience`` steps. most : distinct
    values that a choice may have; with as many, its price is below ``least_price``. Returns where
    to go on (infinite: nowhere), the rows written and the steps; a cell that did not come to its
    end is begun again.
    """
    k, count, steps = len(rules.target), 0, 0
    wide = _width(rules, level)
    at, other = _stack(k, len(rules.apart)), _stack(k, len(rules.apart))
    _copy(rules.apart, at.apart[0])
    t = _next_cell(rules, max(start, rules.seconds[0]), level)
    while t <= rules.seconds[1]:
        at.time[0, 0], at.time[0, 1] = t, min(t + wide, rules.seconds[1])
        whole, count, taken = _cell(
            rules, at, other, level, patience - steps, most, least_price, rows, count
        )
        steps += taken
        if not whole:
            return t, count, steps
        t = _next_cell(rules, t + wide, level)
        if count:
            return t, count, steps
    return np.inf, count, steps


@compiled
def dives(
    rules: TermRules, level: float, cells: Array, patience: int, most: int, seed: int, row: Index
) -> tuple[int, bool, int]:
    """One choice with an error of about ``level``, of no cell of T the best.

    Each of ``cells`` (j,), where a cell begins, is searched for so many steps in an order of
    candidates drawn from ``seed``: what goes wrong early is left, not exhausted. most : distinct
    values that a choice may have. row : (1, k + s), gets the choice. Returns how many cells were
    begun, whether there is a choice, and the steps.
    """
    k, steps, wide = len(rules.target), 0, _width(rules, level)
    at, other = _stack(k, len(rules.apart)), _stack(k, len(rules.apart))
    _copy(rules.apart, at.apart[0])
    for number in range(len(cells)):
        t = _next_cell(rules, max(cells[number], rules.seconds[0]), level)
        if t > rules.seconds[1]:
            continue
        at.random[0] = 1 + (seed + number) * 7919 % 2147483647
        at.time[0, 0], at.time[0, 1] = t, min(t + wide, rules.seconds[1])
        _, count, taken = _cell(rules, at, other, level, patience, most, np.inf, row, 0)
        steps += taken
        if count:
            return number + 1, True, steps
    return len(cells), False, steps
