"""Compiled fast path of the exact flow: four states, one stop pair, modal coordinates.

Within a mode the homogeneous motion is two scalar oscillators, y'' + p y' + q y = 0, one for each
real quadratic factor of the characteristic polynomial; the kernel only multiplies tables. The
general kernel (``kernels.kernel_general``) is the reference that this must equal.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from designer.base.jit import callee, compiled, embedded, leaf
from designer.kernels.kernel_crossing import (
    COEF,
    LAST,
    NODES,
    NOW,
    POINT,
    SCRATCH,
    SMALL,
    STEPS,
    TERMS,
    F,
    searches,
    series_value,
    suspect_step,
)
from designer.kernels.kernel_orbit import DIVERGED, DONE, TOO_MANY_EVENTS

Float = NDArray[np.float64]
Int = NDArray[np.int64]

# Columns of ``ModalTables.data`` within the WIDTH of one mode. One flat array for all, since a
# compiled call pays for each array and each dimension; "state" is g (4,), sine, cosine.
STEP = 0
"""Length h of a step, of a part, and parts per unit of time."""
LIMIT = 3
"""(2,) displacement below and above which the mode is left."""
REST = 5
"""h⁴/288: times M4, what the middle Bernstein coefficients must keep from a limit."""
QUAD = 6
"""(2, 2) p and q of each oscillator."""
CENTRE = 10
"""Constant term of the displacement."""
BOUND = 11
"""(2, 4) two rows over each oscillator whose moduli add up to M4, and M4 of the drive."""
SCAN = 20
"""(6, 2, NODES) displacement and rate over the state, at each node of a block."""
LOCAL = SCAN + 12 * NODES
"""(6, TERMS) Taylor coefficients of the displacement over the state."""
NEAR = LOCAL + 6 * TERMS
"""(TERMS, 8) Taylor coefficients of s1', s1, s2', s2, sin, cos (s the impulse response), 0, 0."""
JUMP = NEAR + 8 * TERMS
"""(LAST + 1, 10) propagators of both oscillators by rows, sine and cosine of the drive's turn."""
STATE = JUMP + 10 * (LAST + 1)
"""(7, 4) x over (state, 1), by columns."""
MODAL = STATE + 28
"""(7, 4) g over (x, sin, cos, 1), by columns."""
CHANGE = MODAL + 28
"""(3, 7, 4) g of each other mode over (state, 1), by columns."""
WIDTH = CHANGE + 84


class ModalTables(NamedTuple):
    """What the modal kernel knows of the three modes."""

    data: Float
    """(3 · WIDTH,) values; mode 0 open, 1 upper contact, 2 lower contact; see the columns above."""


@leaf
def _jump(data: Float, m: int, part: int, work: Float) -> None:
    """POINT = state ``part`` parts after NOW."""
    o = (m & 3) * WIDTH + JUMP + 10 * (part & 127)
    a, b, c, d = work[NOW], work[NOW + 1], work[NOW + 2], work[NOW + 3]
    sn, cs, sw, cw = work[NOW + 4], work[NOW + 5], data[o + 8], data[o + 9]
    work[POINT] = data[o] * a + data[o + 1] * b
    work[POINT + 1] = data[o + 2] * a + data[o + 3] * b
    work[POINT + 2] = data[o + 4] * c + data[o + 5] * d
    work[POINT + 3] = data[o + 6] * c + data[o + 7] * d
    work[POINT + 4] = sn * cw + cs * sw
    work[POINT + 5] = cs * cw - sn * sw


@leaf
def _expand(data: Float, m: int, t: float, work: Float) -> float:
    """Time of the part nearest to t; COEF = Taylor series of displacement - CENTRE about it."""
    o = (m & 3) * WIDTH
    part = int(t * data[o + STEP + 2] + 0.5)
    _jump(data, m, part, work)
    for k in range(TERMS):
        total = 0.0
        for j in range(6):
            total += data[o + LOCAL + TERMS * j + k] * work[POINT + j]
        work[COEF + k] = total
    return float(part * data[o + STEP + 1])


@leaf
def _carry(data: Float, m: int, part: int, phi: Float) -> None:
    """phi (4, k), in modal coordinates, ← ``part`` parts on."""
    o = (m & 3) * WIDTH + JUMP + 10 * (part & 127)
    for j in range(phi.shape[1]):
        a, b, c, d = phi[0, j], phi[1, j], phi[2, j], phi[3, j]
        phi[0, j], phi[1, j] = data[o] * a + data[o + 1] * b, data[o + 2] * a + data[o + 3] * b
        phi[2, j], phi[3, j] = data[o + 4] * c + data[o + 5] * d, data[o + 6] * c + data[o + 7] * d


@leaf
def _turn(data: Float, o: int, phi: Float) -> None:
    """phi ← the 4 x 4 matrix that stands at o, by columns, times phi."""
    o &= 0xFFFF
    for j in range(phi.shape[1]):
        a, b, c, d = phi[0, j], phi[1, j], phi[2, j], phi[3, j]
        for i in range(4):
            phi[i, j] = data[o + i] * a + data[o + 4 + i] * b
            phi[i, j] += data[o + 8 + i] * c + data[o + 12 + i] * d


@leaf
def _move(data: Float, m: int, t: float, work: Float, phi: Float) -> None:
    """NOW ← the state a time t on, 0 <= t <= STEPS · h; phi ← its tangent vectors."""
    o = (m & 3) * WIDTH
    part = int(t * data[o + STEP + 2] + 0.5)
    _jump(data, m, part, work)
    s = t - part * data[o + STEP + 1]
    for i in range(8):
        total = data[o + NEAR + 8 * (TERMS - 1) + i]
        for k in range(TERMS - 2, -1, -1):
            total = total * s + data[o + NEAR + 8 * k + i]
        work[SMALL + i] = total
    p1, q1, p2, q2 = data[o + QUAD], data[o + QUAD + 1], data[o + QUAD + 2], data[o + QUAD + 3]
    r1, s1, r2, s2 = work[SMALL], work[SMALL + 1], work[SMALL + 2], work[SMALL + 3]
    a, b, c, d = work[POINT], work[POINT + 1], work[POINT + 2], work[POINT + 3]
    work[NOW], work[NOW + 1] = (r1 + p1 * s1) * a + s1 * b, r1 * b - q1 * s1 * a
    work[NOW + 2], work[NOW + 3] = (r2 + p2 * s2) * c + s2 * d, r2 * d - q2 * s2 * c
    sn, cs, sw, cw = work[POINT + 4], work[POINT + 5], work[SMALL + 4], work[SMALL + 5]
    work[NOW + 4], work[NOW + 5] = sn * cw + cs * sw, cs * cw - sn * sw
    if phi.shape[0] > 0:
        _carry(data, m, part, phi)
        for j in range(phi.shape[1]):
            a, b, c, d = phi[0, j], phi[1, j], phi[2, j], phi[3, j]
            phi[0, j], phi[1, j] = (r1 + p1 * s1) * a + s1 * b, r1 * b - q1 * s1 * a
            phi[2, j], phi[3, j] = (r2 + p2 * s2) * c + s2 * d, r2 * d - q2 * s2 * c


@leaf
def _apply(data: Float, o: int, work: Float, place: int) -> None:
    """work[place : place + 4] ← the (4, 7) matrix that stands at o, by columns, times (NOW,
    1)."""
    o &= 0xFFFF
    place &= 0xFF
    a, b, c, d, sn, cs = (
        work[NOW],
        work[NOW + 1],
        work[NOW + 2],
        work[NOW + 3],
        work[NOW + 4],
        work[NOW + 5],
    )
    for i in range(4):
        drive = data[o + 16 + i] * sn + data[o + 20 + i] * cs + data[o + 24 + i]
        free = data[o + i] * a + data[o + 4 + i] * b
        work[place + i] = free + (data[o + 8 + i] * c + data[o + 12 + i] * d) + drive


@leaf
def _fourth_derivative(data: Float, m: int, work: Float) -> float:
    """A bound of |d⁴ displacement/dt⁴| from here on: a mode's motion cannot grow."""
    o = (m & 3) * WIDTH + BOUND
    a, b, c, d = work[NOW], work[NOW + 1], work[NOW + 2], work[NOW + 3]
    first = abs(data[o] * a + data[o + 1] * b) + abs(data[o + 2] * a + data[o + 3] * b)
    second = abs(data[o + 4] * c + data[o + 5] * d) + abs(data[o + 6] * c + data[o + 7] * d)
    return float(first + second + data[o + 8])


@leaf
def _scan(data: Float, m: int, work: Float) -> None:
    """F, D = displacement and rate at the nodes."""
    o = (m & 3) * WIDTH + SCAN
    a, b, c, d, sn, cs = (
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
        first = data[i] * a + data[i + n] * b
        second = data[i + 2 * n] * c + data[i + 3 * n] * d
        work[F + k] = first + second + data[i + 4 * n] * sn + data[i + 5 * n] * cs


class Watch(NamedTuple):
    """What a run that is watched writes; arrays of length 0 for one that is not."""

    minima: Float
    """(periods,) least displacement of each period."""
    velocities: Float
    """(k,) rate at each entry into contact with the upper stop, as far as it reaches."""
    peak: Float
    """(4,) largest of each state at what was visited, updated."""
    entries: Int
    """(1,) how many entries there were, added to."""


@callee
def unwatched() -> Watch:
    """Nothing to write."""
    none = np.zeros(0)
    return Watch(none, none, none, np.zeros(1, dtype=np.int64))


@leaf
def mode_of(data: Float, x: Float) -> int:
    """Open, upper or lower contact, by the displacement x[0]."""
    if x[0] > data[LIMIT + 1]:
        return 1
    return 2 if x[0] < data[LIMIT] else 0


_find_crossing, _turning_values = searches(_expand)


@embedded
def _first_crossing(
    data: Float, m: int, m4: float, left: float, undecided: Float, work: Float
) -> tuple[float, int]:
    """Time of the first way out of the mode in this block, and the limit's side; -1 for none."""
    o = (m & 3) * WIDTH
    h, centre = data[o + STEP], data[o + CENTRE]
    low, high = data[o + LIMIT] - centre, data[o + LIMIT + 1] - centre
    count, rest = min(STEPS, int(left / h) + 1), m4 * data[o + REST]
    first, side, k = -1.0, 0, suspect_step(h, rest, low, high, count, work, 0)
    while k < count:
        first, side = _find_crossing(data, m, k, h, m4, low, high, 0.0, undecided, work)
        if first >= 0.0:
            break
        k = suspect_step(h, rest, low, high, count, work, k + 1)
    return first, side


@leaf
def _least(
    data: Float, m: int, m4: float, end: float, work: Float, values: Float, least: float
) -> float:
    """The smaller of ``least`` and the least displacement from now to ``end``."""
    o = (m & 3) * WIDTH
    h, centre = data[o + STEP], data[o + CENTRE]
    least -= centre
    if suspect_step(h, m4 * data[o + REST], least, np.inf, STEPS, work, 0) < STEPS:
        f, _, _ = series_value(work, end - _expand(data, m, end, work))
        least = min(least, min(f, work[F]))
        for k in range(_turning_values(data, m, end, h, m4, work, values)):
            least = min(least, values[0, k])
    return float(least + centre)


@callee
def carry(
    tables: ModalTables,
    x: Float,
    cursor: Int,
    period: float,
    phi: Float,
    max_events: int,
    strobes: Float,
    impacts: Int,
    watch: Watch,
) -> int:
    """``advance``, watched."""
    data = tables.data
    m, watched = cursor[0], watch.minima.shape[0] > 0
    work, undecided, values = np.zeros(SCRATCH), np.zeros(1), np.zeros((2, 32))
    for i in range(4):
        work[NOW + i] = strobes[0, i] = x[i]
    work[NOW + 5] = 1.0
    _apply(data, m * WIDTH + MODAL, work, NOW)
    if phi.shape[0] > 0:
        _turn(data, m * WIDTH + MODAL, phi)
    t, events, done, code, low = 0.0, 0, 0, DONE, np.inf
    while done < strobes.shape[0] - 1 and code == DONE:
        o = (m & 3) * WIDTH
        block = STEPS * data[o + STEP]
        left = period - t
        m4 = _fourth_derivative(data, m, work)
        _scan(data, m, work)
        first, side = _first_crossing(data, m, m4, left, undecided, work)
        crosses = 0.0 <= first <= left
        end = first if crosses else min(block, left)
        if watched:
            low = _least(data, m, m4, end, work, values, low)
        if crosses:
            n = 0
            if m == 0:
                n = 1 if side > 0 else 2
                impacts[done, 1 if side > 0 else 0] += 1
                if n == 1 and watched:
                    met = watch.entries[0]
                    if met < watch.velocities.shape[0]:
                        _, rate, _ = series_value(work, end - _expand(data, m, end, work))
                        watch.velocities[met] = rate
                    watch.entries[0] = met + 1
            _move(data, m, end, work, phi)
            t += end
            _apply(data, o + CHANGE + 28 * n, work, NOW)
            if phi.shape[0] > 0:
                _turn(data, o + CHANGE + 28 * n, phi)
            m = n
            events += 1
            if events > max_events:
                code = TOO_MANY_EVENTS
        elif block < left:
            _jump(data, m, LAST, work)
            for i in range(6):
                work[NOW + i] = work[POINT + i]
            if phi.shape[0] > 0:
                _carry(data, m, LAST, phi)
            t += block
        else:
            _move(data, m, left, work, phi)
            t, events = 0.0, 0
            done += 1
            work[NOW + 4], work[NOW + 5] = 0.0, 1.0
            _apply(data, o + STATE, work, POINT)
            for i in range(4):
                strobes[done, i] = work[POINT + i]
            if not (abs(strobes[done, 0]) < 1e12):
                code = DIVERGED
            if watched:
                watch.minima[done - 1], low = low, np.inf
        if watched:
            _apply(data, (m & 3) * WIDTH + STATE, work, POINT)
            for i in range(4):
                watch.peak[i] = max(watch.peak[i], abs(work[POINT + i]))
    if phi.shape[0] > 0:
        _turn(data, m * WIDTH + STATE, phi)
    cursor[0], cursor[1] = m, done
    return code


@compiled
def advance(
    tables: ModalTables,
    x: Float,
    cursor: Int,
    period: float,
    phi: Float,
    max_events: int,
    strobes: Float,
    impacts: Int,
) -> int:
    """Carry x (4,) over the periods of ``strobes`` (periods + 1, 4).

    cursor : (2,) mode and periods done, both written. impacts : (periods, 2) lower, upper,
    added to. phi : (4, k) tangent vectors in state coordinates, (0, 0) for none.
    """
    return carry(tables, x, cursor, period, phi, max_events, strobes, impacts, unwatched())
