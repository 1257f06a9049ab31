"""Compiled descents to choices of parts whose rounded values make small errors.

A resistor follows from z as a logarithm weights @ z + constant, and its error is that of the value
nearest to it. One entry of z at a time is moved to where the sum of the sixth powers of all errors
is least, with a penalty for limits that are not kept: the time scale, the volts and pairs of these
by drawn steps, each free part over the values near its own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from designer.base.arrays import Array, Index
from designer.base.jit import compiled, leaf

UNIT = 0.005
"""An error that counts 1 in the sum of sixth powers."""
BROKEN = 1e4
"""What a limit that is missed by a unit of its logarithm counts, beside 1 for missing it."""
WINDOW = 0.45
"""Of a free part: how far from its value others are tried, in its logarithm."""
STEPS = 24
"""Drawn steps of a scale that are tried."""


class Move(NamedTuple):
    """A direction in z."""

    by: Array
    """(rows + limits,) change of each row and limit with a step along it."""
    which: Index
    """The rows, then the limits whose cost changes."""
    ends: Index
    """(2,) where those rows and those limits end in ``which``."""


class Rounding(NamedTuple):
    """A program of rounding, in arrays."""

    rows: Array
    """(rows, z) change of each resistor's logarithm with z."""
    constants: Array
    """(rows,) logarithms where z is 0."""
    sizes: Array
    """(rows,) what an error of each counts."""
    held: Array
    """(rows,) 1 where an error counts beside that of row ``lead``, which itself counts nothing."""
    lead: int
    """Such a row; -1 without one."""
    row_values: Array
    """Logarithms of the values that each row may have, one row's after the other's."""
    row_first: Index
    """(rows + 1,) where each row's begin."""
    limits: Array
    """(limits, z) of what may not exceed 0."""
    limit_constants: Array
    """(limits,) where z is 0."""
    values: Array
    """Logarithms of the values of each entry of z, one's after the other's."""
    first: Index
    """(z + 1,) where each entry's begin; none of a number that is free."""


@leaf
def nearest_log(values: Array, low: int, high: int, wanted: float) -> float:
    """Of values[low:high], ascending, the one nearest to ``wanted``: looked for where it would be
    if they were evenly spaced, and from there on."""
    a, last = low, max(high - 2, low)
    span = values[high - 1] - values[low]
    if span > 0.0 and wanted > values[low]:
        a = low + int(min((wanted - values[low]) / span, 1.0) * (high - 1 - low))
        a = min(a, last)
    while a > low and values[a] > wanted:
        a -= 1
    while a < last and values[a + 1] <= wanted:
        a += 1
    b = min(a + 1, high - 1)
    best: float = values[a] if wanted - values[a] <= values[b] - wanted else values[b]
    return best


@leaf
def row_error(rounding: Rounding, row: int, log: float) -> float:
    """Of one resistor's logarithm."""
    low, high = rounding.row_first[row], rounding.row_first[row + 1]
    return nearest_log(rounding.row_values, low, high, log) - log


@leaf
def limit_cost(over: float) -> float:
    """Of one limit."""
    return 0.0 if over <= 1e-9 else 1.0 + BROKEN * over


@leaf
def moved(rounding: Rounding, one: int, other: int, ratio: float, move: Move) -> None:
    """Note the change of every row and limit with entry ``one`` of z, and ``ratio`` of it with
    another, and which costs change with it."""
    rows, lead = len(rounding.constants), rounding.lead
    for row in range(rows):
        move.by[row] = rounding.rows[row, one] + ratio * rounding.rows[row, other]
    follows, count = lead >= 0 and move.by[lead] != 0.0, 0
    for row in range(rows):
        if move.by[row] != 0.0 or (follows and rounding.held[row] != 0.0):
            move.which[count] = row
            count += 1
    move.ends[0] = count
    for k in range(len(rounding.limit_constants)):
        change = rounding.limits[k, one] + ratio * rounding.limits[k, other]
        move.by[rows + k] = change
        if change != 0.0:
            move.which[count] = k
            count += 1
    move.ends[1] = count


@leaf
def cost_of(rounding: Rounding, logs: Array, overs: Array, move: Move, step: float) -> float:
    """What of the cost changes with a move, after so large a step of it."""
    rows, lead, first, total = len(logs), rounding.lead, 0.0, 0.0
    if lead >= 0:
        first = row_error(rounding, lead, logs[lead] + step * move.by[lead])
    for place in range(move.ends[0]):
        row = move.which[place]
        error = row_error(rounding, row, logs[row] + step * move.by[row])
        error -= rounding.held[row] * first
        square = (rounding.sizes[row] * error / UNIT) ** 2
        total += square * square * square
    for place in range(move.ends[0], move.ends[1]):
        k = move.which[place]
        total += limit_cost(overs[k] + step * move.by[rows + k])
    return total


@compiled
def descend(rounding: Rounding, start: Array, draws: Array) -> Array:
    """z of a choice near ``start``. draws : numbers in 0 … 1, used in turn."""
    z = start.copy()
    size, rows, limits = len(z), len(rounding.constants), len(rounding.limit_constants)
    scales = 0
    for i in range(size):
        if rounding.first[i + 1] == rounding.first[i]:
            scales += 1
        else:
            z[i] = nearest_log(rounding.values, rounding.first[i], rounding.first[i + 1], z[i])
    logs = rounding.rows @ z + rounding.constants
    overs = rounding.limits @ z + rounding.limit_constants
    nowhere = Move(
        np.zeros(rows + limits),
        np.concatenate((np.arange(rows), np.arange(limits))),
        np.array([rows, rows + limits]),
    )
    move = Move(
        np.zeros(rows + limits),
        np.zeros(rows + limits, dtype=np.int64),
        np.zeros(2, dtype=np.int64),
    )
    cost = cost_of(rounding, logs, overs, nowhere, 0.0)
    draw, width, still = 0, 0.04, 0
    while still < 3:
        before = cost
        for turn in range(size + scales):
            i, other, ratio = turn, turn, 0.0
            if turn >= size:  # a scale with another one
                i = turn - size
                other = int(draws[draw % len(draws)] * scales) % scales
                draw += 1
                ratio = 1.0 if draws[draw % len(draws)] < 0.5 else -1.0
                draw += 1
                if other == i:
                    continue
            moved(rounding, i, other, ratio, move)
            best, step = cost_of(rounding, logs, overs, move, 0.0), 0.0
            if rounding.first[i + 1] == rounding.first[i]:
                for _ in range(STEPS):
                    by = width * (2.0 * draws[draw % len(draws)] - 1.0)
                    draw += 1
                    now = cost_of(rounding, logs, overs, move, by)
                    if now < best:
                        best, step = now, by
            else:
                for k in range(rounding.first[i], rounding.first[i + 1]):
                    by = rounding.values[k] - z[i]
                    if abs(by) <= WINDOW:
                        now = cost_of(rounding, logs, overs, move, by)
                        if now < best:
                            best, step = now, by
            if step != 0.0:
                z[i] += step
                z[other] += ratio * step
                logs += step * move.by[:rows]
                overs += step * move.by[rows:]
        cost = cost_of(rounding, logs, overs, nowhere, 0.0)
        if cost > 0.9 * before:
            still += 1
            width *= 0.3
    return z
