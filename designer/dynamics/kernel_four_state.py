"""Compiled fast path of circuits: four states, a few working modes, every other boundary far away.

In a working mode (no contact, in contact, and what lies between) the state moves in blocks of seven
steps (``dynamics.kernel_crossing``). For each boundary to another working mode its distance and
rate at the block's eight nodes are one product with the state. The other boundaries (outputs at
their limits, diodes of the other half) are proved to be far: over the box that the states kept to,
no such guard comes near zero. Where that proof fails the run is given up, and the general kernel
(``dynamics.kernel_general``), which this must equal, does it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from designer.base.jit import callee, compiled
from designer.dynamics.kernel_crossing import (
    BOX,
    COEF,
    LAST,
    NODES,
    NOW,
    POINT,
    SCRATCH,
    STACK,
    STEPS,
    TERMS,
    F,
    searches,
    suspect_step,
)
from designer.dynamics.kernel_mode_tables import (
    BEGINS,
    DEPTH,
    FAR,
    FOURTH,
    JUMP,
    LIMITS,
    LOCAL,
    MODES,
    N_WATCH,
    PART,
    PER,
    RATE,
    REST,
    ROW,
    ROW_WIDTH,
    ROWS,
    SCAN,
    SECOND,
    SIDE,
    TARGET,
    WATCH,
    WAY,
    H,
)
from designer.dynamics.kernel_orbit import DIVERGED, DONE, LEFT, TOO_MANY_EVENTS

Float = NDArray[np.float64]
Int = NDArray[np.int64]

TANGENCY = 1e-13
"""Over an interval where a distance is smaller than this, a crossing is not looked for."""


class RunTrail(NamedTuple):
    """What a measured run writes; k is the most impacts that are kept."""

    extremes: Float
    """(4, 2) least and greatest value of each state."""
    graze: Float
    """(3,) smallest penetration, nearest miss, undecided tangencies."""
    when: Float
    """(k,) times of the impacts."""
    at: Float
    """(k, 4) states at the impacts."""
    stop: Int
    """(k,) stops of the impacts."""
    met: Int
    """(1,) how many impacts there were."""


@callee
def _jump(table: Float, part: int, work: Float) -> None:
    """POINT = z ``part`` parts after NOW."""
    o = JUMP + 30 * (part & 63)
    a, b, c, d = work[NOW], work[NOW + 1], work[NOW + 2], work[NOW + 3]
    s, q = work[NOW + 4], work[NOW + 5]
    for i in range(4):
        free = table[o + i] * a + table[o + 4 + i] * b
        held = table[o + 16 + i] * s + table[o + 20 + i] * q + table[o + 24 + i]
        work[POINT + i] = free + (table[o + 8 + i] * c + table[o + 12 + i] * d) + held
    work[POINT + 4] = s * table[o + 29] + q * table[o + 28]
    work[POINT + 5] = q * table[o + 29] - s * table[o + 28]


@callee
def _expand(table: Float, r: int, t: float, work: Float) -> float:
    """Time of the part nearest to t; COEF = Taylor series of row r about it."""
    part = int(t * table[PER] + 0.5)
    _jump(table, part, work)
    o = ROW + (r & 7) * ROW_WIDTH + LOCAL
    for k in range(TERMS):
        work[COEF + k] = table[o + 6 * TERMS + k]
    for j in range(6):
        for k in range(TERMS):
            work[COEF + k] += table[o + TERMS * j + k] * work[POINT + j]
    return float(part * table[PART])


@callee
def _carry(table: Float, part: int, phi: Float) -> None:
    """phi (4, k) ← ``part`` parts on."""
    o = JUMP + 30 * (part & 63)
    for j in range(phi.shape[1]):
        a, b, c, d = phi[0, j], phi[1, j], phi[2, j], phi[3, j]
        for i in range(4):
            phi[i, j] = table[o + i] * a + table[o + 4 + i] * b
            phi[i, j] += table[o + 8 + i] * c + table[o + 12 + i] * d


@callee
def _move(table: Float, t: float, work: Float, phi: Float) -> None:
    """NOW ← the state a time t on, 0 <= t <= STEPS · h; phi ← its tangent vectors."""
    part = int(t * table[PER] + 0.5)
    _jump(table, part, work)
    s = t - part * table[PART]
    # Terms of the Taylor series, each M s/k times the one before.
    v0, v1, v2, v3 = work[POINT], work[POINT + 1], work[POINT + 2], work[POINT + 3]
    sn, cs, one = work[POINT + 4], work[POINT + 5], 1.0
    x0, x1, x2, x3, y4, y5 = v0, v1, v2, v3, sn, cs
    o = RATE
    w = work[NOW + 7]
    for k in range(1, TERMS):
        f = s / k
        u0 = table[o] * v0 + table[o + 4] * v1 + (table[o + 8] * v2 + table[o + 12] * v3)
        u1 = table[o + 1] * v0 + table[o + 5] * v1 + (table[o + 9] * v2 + table[o + 13] * v3)
        u2 = table[o + 2] * v0 + table[o + 6] * v1 + (table[o + 10] * v2 + table[o + 14] * v3)
        u3 = table[o + 3] * v0 + table[o + 7] * v1 + (table[o + 11] * v2 + table[o + 15] * v3)
        u0 += table[o + 16] * sn + table[o + 24] * one
        u1 += table[o + 17] * sn + table[o + 25] * one
        u2 += table[o + 18] * sn + table[o + 26] * one
        u3 += table[o + 19] * sn + table[o + 27] * one
        sn, cs = f * w * cs, -f * w * sn
        one = 0.0  # a constant's derivative
        v0, v1, v2, v3 = f * u0, f * u1, f * u2, f * u3
        x0 += v0
        x1 += v1
        x2 += v2
        x3 += v3
        y4 += sn
        y5 += cs
    work[NOW], work[NOW + 1], work[NOW + 2], work[NOW + 3] = x0, x1, x2, x3
    work[NOW + 4], work[NOW + 5] = y4, y5
    if phi.shape[0] > 0:
        _carry(table, part, phi)
        for j in range(phi.shape[1]):
            v0, v1, v2, v3 = phi[0, j], phi[1, j], phi[2, j], phi[3, j]
            for k in range(1, TERMS):
                f = s / k
                u0 = table[o] * v0 + table[o + 4] * v1 + table[o + 8] * v2 + table[o + 12] * v3
                u1 = table[o + 1] * v0 + table[o + 5] * v1 + table[o + 9] * v2 + table[o + 13] * v3
                u2 = table[o + 2] * v0 + table[o + 6] * v1 + table[o + 10] * v2 + table[o + 14] * v3
                u3 = table[o + 3] * v0 + table[o + 7] * v1 + table[o + 11] * v2 + table[o + 15] * v3
                v0, v1, v2, v3 = f * u0, f * u1, f * u2, f * u3
                phi[0, j] += v0
                phi[1, j] += v1
                phi[2, j] += v2
                phi[3, j] += v3


@callee
def _scan(table: Float, r: int, work: Float) -> float:
    """F, D = value and rate of row r at the nodes; a bound of its fourth derivative."""
    o = ROW + (r & 7) * ROW_WIDTH
    a, b, c, d, s, q = (
        work[NOW],
        work[NOW + 1],
        work[NOW + 2],
        work[NOW + 3],
        work[NOW + 4],
        work[NOW + 5],
    )
    n = 2 * NODES
    for k in range(n):
        i = o + k
        first = table[i] * a + table[i + n] * b
        second = table[i + 2 * n] * c + table[i + 3 * n] * d
        work[F + k] = first + second + table[i + 4 * n] * s + table[i + 5 * n] * q
        work[F + k] += table[i + 6 * n]
    i = o + FOURTH
    free = table[i] * abs(a) + table[i + 1] * abs(b) + table[i + 2] * abs(c) + table[i + 3] * abs(d)
    return float(free + table[i + 4] * abs(s) + table[i + 5] * abs(q) + table[i + 6])


@callee
def _empty_box(work: Float, m: int) -> None:
    low = BOX + 8 * (m & 7)
    for j in range(4):
        work[low + j], work[low + 4 + j] = np.inf, -np.inf


@callee
def _keep(low: int, work: Float, at: int, slack: float, reach: Float) -> None:
    """Widen the box of a mode by the state at ``at``, give or take a part of ``reach``."""
    for j in range(4):
        x, more = work[at + j], slack * reach[j]
        work[low + j] = min(work[low + j], x - more)
        work[low + 4 + j] = max(work[low + 4 + j], x + more)


@callee
def _watch(table: Float, m: int, end: float, work: Float, reach: Float) -> None:
    """Widen the box of mode m by the motion over [0, end], whose end is not in it yet."""
    low = BOX + 8 * (m & 7)
    for i in range(4):
        total = 0.0
        for j in range(6):
            total += table[SECOND + 4 * j + i] * abs(work[NOW + j])
        reach[i] = total + table[SECOND + 24 + i]
    share = min(end / table[H], 1.0)
    _keep(low, work, NOW, share * share, reach)
    if end > table[H]:
        a, b, c, d, s, q = (
            work[NOW],
            work[NOW + 1],
            work[NOW + 2],
            work[NOW + 3],
            work[NOW + 4],
            work[NOW + 5],
        )
        for k in range(24):
            i = WAY + k
            first = table[i] * a + table[i + 24] * b
            second = table[i + 48] * c + table[i + 72] * d
            held = table[i + 96] * s + table[i + 120] * q + table[i + 144]
            work[STACK + k] = first + second + held
        for k in range(STEPS - 1):
            if (k + 1) * table[H] < end:
                _keep(low, work, STACK + 4 * k, 1.0, reach)


@callee
def _far(data: Float, work: Float) -> bool:
    """Whether no far boundary comes near over the boxes, which are then emptied."""
    for m in range(data.shape[0]):
        low = BOX + 8 * (m & 7)
        if work[low] > work[low + 4]:
            continue
        table = data[m]
        for g in range(FAR):
            total = table[LIMITS + 8 * FAR + g]
            for j in range(4):
                total += table[LIMITS + FAR * j + g] * work[low + 4 + j]
                total += table[LIMITS + FAR * (4 + j) + g] * work[low + j]
            if not total < 0.0:
                return False
        _empty_box(work, m)
    return True


@callee
def mode_at(data: Float, ints: Int, x: Float) -> int:
    """The working mode that holds at state x (4,) at drive phase 0, or -1."""
    for m in range(data.shape[0]):
        inside = True
        for r in range(ints[m, N_WATCH]):
            o = ROW + r * ROW_WIDTH + SCAN
            total = data[m, o + 10 * NODES] + data[m, o + 12 * NODES]
            for j in range(4):
                total += data[m, o + 2 * NODES * j] * x[j]
            inside = inside and total <= 0.0
        for g in range(FAR):
            total = data[m, LIMITS + 8 * FAR + g]
            for j in range(4):
                part = data[m, LIMITS + FAR * j + g] + data[m, LIMITS + FAR * (4 + j) + g]
                total += part * x[j]
            inside = inside and total < 0.0
        if inside:
            return m
    return -1


@callee
def _widen(extremes: Float, i: int, low: float, high: float) -> None:
    extremes[i, 0], extremes[i, 1] = min(extremes[i, 0], low), max(extremes[i, 1], high)


_find_crossing, _turning_values = searches(_expand)


@callee
def _note(
    table: Float, number: Int, end: float, work: Float, trail: RunTrail, values: Float
) -> float:
    """Extremes, and the misses of a mode without contact, over [0, end]; the greatest depth."""
    deepest = 0.0
    for r in range(ROWS):
        state, depth = r - WATCH, r == DEPTH
        if depth and number[SIDE] == 0:
            continue
        if state < 0 and (r >= number[N_WATCH] or number[BEGINS + r] == 0 or number[SIDE] != 0):
            continue
        m4 = _scan(table, r, work)
        first = work[F]
        count = _turning_values(table, r, end, table[H], m4, work, values)
        if depth:
            deepest = first
            for k in range(count):
                deepest = max(deepest, values[0, k])
        elif state >= 0:
            low = high = first
            for k in range(count):
                low, high = min(low, values[0, k]), max(high, values[0, k])
            _widen(trail.extremes, state, low, high)
        else:
            for k in range(count):
                if values[1, k] > 0.0 and values[0, k] < 0.0:
                    trail.graze[1] = min(trail.graze[1], -values[0, k])
    return float(deepest)


@callee
def _first_crossing(
    table: Float, number: Int, left: float, undecided: Float, work: Float
) -> tuple[float, int]:
    """Time of the first way out of the mode in this block, and the row; -1 for none."""
    h = table[H]
    count, first, through = min(STEPS, int(left / h) + 1), -1.0, -1
    for r in range(number[N_WATCH]):
        m4 = _scan(table, r, work)
        rest = m4 * table[REST]
        k = suspect_step(h, rest, -np.inf, 0.0, count, work, 0)
        while k < count:
            time = _find_crossing(table, r, k, h, m4, 0.0, 1.0, TANGENCY, undecided, work)
            if time >= 0.0:
                if first < 0.0 or time < first:
                    first, through = time, r
                    count = min(count, int(time / h) + 1)
                break
            k = suspect_step(h, rest, -np.inf, 0.0, count, work, k + 1)
    return first, through


@callee
def _log_impact(trail: RunTrail, time: float, stop: int, work: Float) -> None:
    k = trail.met[0]
    trail.met[0] = k + 1
    if k < trail.when.shape[0]:
        trail.when[k], trail.stop[k] = time, stop
        for i in range(4):
            trail.at[k, i] = work[NOW + i]


@compiled
def advance(
    data: Float,
    ints: Int,
    x: Float,
    cursor: Int,
    drive: Float,
    anchor: Float,
    phi: Float,
    strobes: Float,
    impacts: Int,
    trail: RunTrail,
) -> int:
    """Carry x (4,), at drive phase 0, over the stretches of ``strobes`` (stretches + 1, 4).

    cursor : (3,) mode (-1: the one that holds at x) and stretches done, both written, and 1 to
    measure. drive : omega, period, most events in a stretch. anchor : (stretches a period, 2) the
    drive's sine and cosine at the start of each. impacts : (stretches, 2) lower, upper, added to.
    phi : (4, k) tangent vectors, (0, 0) for none.
    """
    if cursor[0] < 0:
        cursor[0] = mode_at(data, ints, x)
        if cursor[0] < 0:
            return LEFT
    m, measure = cursor[0], cursor[2] == 1
    stretch = drive[1] / anchor.shape[0]
    work, reach, values = np.zeros(SCRATCH), np.zeros(4), np.zeros((2, 32))
    for i in range(4):
        work[NOW + i] = strobes[0, i] = x[i]
    work[NOW + 5], work[NOW + 6], work[NOW + 7] = 1.0, 1.0, drive[0]
    for k in range(MODES):
        _empty_box(work, k)
    t, events, done, code = 0.0, 0, 0, DONE
    depth = np.inf if ints[m, SIDE] != 0 else 0.0
    while done < strobes.shape[0] - 1 and code == DONE:
        table, number = data[m], ints[m]
        block, left = STEPS * table[H], stretch - t
        first, through = _first_crossing(table, number, left, trail.graze, work)
        crossed = 0.0 <= first <= left
        end = first if crossed else min(left, block)
        whole = not crossed and block < left
        _watch(table, m, end, work, reach)
        if measure:
            depth = max(depth, _note(table, number, end, work, trail, values))
        if whole:
            _jump(table, LAST, work)
            for i in range(6):
                work[NOW + i] = work[POINT + i]
            if phi.shape[0] > 0:
                _carry(table, LAST, phi)
        else:
            _move(table, end, work, phi)
        t += end
        share = min(end / table[H], 1.0)
        _keep(BOX + 8 * (m & 7), work, NOW, share * share, reach)
        if not (abs(work[NOW]) < 1e12):
            code = DIVERGED
        elif crossed:
            m = number[TARGET + through]
            before, after = number[SIDE], ints[m, SIDE]
            if before != after:
                if before != 0:
                    trail.graze[0] = min(trail.graze[0], depth)
                depth = 0.0
                if after != 0:
                    impacts[done, 0 if after < 0 else 1] += 1
                    if measure:
                        _log_impact(trail, done * stretch + t, after, work)
            events += 1
            if events > drive[2]:
                code = TOO_MANY_EVENTS
        elif not whole:
            if not _far(data, work):
                return LEFT
            t, events = 0.0, 0
            done += 1
            here = done % anchor.shape[0]
            work[NOW + 4], work[NOW + 5] = anchor[here, 0], anchor[here, 1]
            for i in range(4):
                strobes[done, i] = work[NOW + i]
                if measure:
                    _widen(trail.extremes, i, work[NOW + i], work[NOW + i])
    if code != DONE and not _far(data, work):
        return LEFT
    cursor[0], cursor[1] = m, done
    return code
