"""Compiled fast path of the exact flow: four states, one stop pair, modal coordinates.

Within a mode the homogeneous motion is two scalar oscillators, y'' + p y' + q y = 0, one for each
real quadratic factor of the characteristic polynomial; the kernel only multiplies tables. A block
of seven steps is looked at together: displacement and rate at its eight nodes are one product with
the modal state. That no boundary is crossed in a step is proved by its cubic Hermite interpolant
and a bound M4 of the fourth derivative; where that fails, the step is halved.

The general kernel (``dynamics.kernel_general``) is the reference that this must equal. Everything
that these functions call stands in this file, or a stale compiled cache would survive an edit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from designer.base.jit import compiled

Float = NDArray[np.float64]
Int = NDArray[np.int64]

DONE, TOO_MANY_EVENTS, DIVERGED = 0, 2, 3
"""Return codes, those of ``flow_kernel``."""
STEPS = 7
"""Steps of a block."""
NODES = STEPS + 1
"""A loop over displacement and rate at all nodes is long enough for LLVM to vectorise it."""
PARTS = 8
"""Tabulated parts of a step: |lambda| times half a part is 1/40."""
TERMS = 8
"""Taylor terms about a part: (1/40)**8/8! is 4e-18."""
LAST = STEPS * PARTS
FINEST = 1e-10
"""Of a step: below it an undecided tangency is taken for none."""


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

# Places in the scratch array.
G, POINT, SMALL, COEF, F, D, STACK = 0, 8, 16, 24, 32, 32 + NODES, 48
ROOM = 84
"""Intervals that the bisection may hold."""


class ModalTables(NamedTuple):
    """What the modal kernel knows of the three modes."""

    data: Float
    """(3 · WIDTH,) values; mode 0 open, 1 upper contact, 2 lower contact; see the columns above."""


# ``m & 3`` and the like tell the compiler that an index is not negative: no wrap-around.


@compiled
def jump_stretch(data: Float, m: int, part: int, work: Float) -> None:
    """POINT = state ``part`` parts after G."""
    o = (m & 3) * WIDTH + JUMP + 10 * (part & 127)
    a, b, c, d = work[G], work[G + 1], work[G + 2], work[G + 3]
    sn, cs, sw, cw = work[G + 4], work[G + 5], data[o + 8], data[o + 9]
    work[POINT] = data[o] * a + data[o + 1] * b
    work[POINT + 1] = data[o + 2] * a + data[o + 3] * b
    work[POINT + 2] = data[o + 4] * c + data[o + 5] * d
    work[POINT + 3] = data[o + 6] * c + data[o + 7] * d
    work[POINT + 4] = sn * cw + cs * sw
    work[POINT + 5] = cs * cw - sn * sw


@compiled
def expand_series(data: Float, m: int, t: float, work: Float) -> float:
    """Time of the part nearest to t; COEF = Taylor series of displacement - CENTRE about it."""
    o = (m & 3) * WIDTH
    part = int(t * data[o + STEP + 2] + 0.5)
    jump_stretch(data, m, part, work)
    for k in range(TERMS):
        total = 0.0
        for j in range(6):
            total += data[o + LOCAL + TERMS * j + k] * work[POINT + j]
        work[COEF + k] = total
    return float(part * data[o + STEP + 1])


@compiled
def series_value(work: Float, s: float) -> tuple[float, float, float]:
    """Displacement, rate and half the acceleration a time s from the expanded part."""
    f = work[COEF + TERMS - 1]
    d = e = 0.0
    for k in range(TERMS - 2, -1, -1):
        e = e * s + d
        d = d * s + f
        f = f * s + work[COEF + k]
    return f, d, e


@compiled
def _carry(data: Float, m: int, part: int, phi: Float) -> None:
    """phi (4, k), in modal coordinates, ← ``part`` parts on."""
    o = (m & 3) * WIDTH + JUMP + 10 * (part & 127)
    for j in range(phi.shape[1]):
        a, b, c, d = phi[0, j], phi[1, j], phi[2, j], phi[3, j]
        phi[0, j], phi[1, j] = data[o] * a + data[o + 1] * b, data[o + 2] * a + data[o + 3] * b
        phi[2, j], phi[3, j] = data[o + 4] * c + data[o + 5] * d, data[o + 6] * c + data[o + 7] * d


@compiled
def _turn(data: Float, o: int, phi: Float) -> None:
    """phi ← the 4 x 4 matrix that stands at o, by columns, times phi."""
    o &= 0xFFFF
    for j in range(phi.shape[1]):
        a, b, c, d = phi[0, j], phi[1, j], phi[2, j], phi[3, j]
        for i in range(4):
            phi[i, j] = data[o + i] * a + data[o + 4 + i] * b
            phi[i, j] += data[o + 8 + i] * c + data[o + 12 + i] * d


@compiled
def move_map(data: Float, m: int, t: float, work: Float, phi: Float) -> None:
    """G ← the state a time t on, 0 <= t <= STEPS · h; phi ← its tangent vectors."""
    o = (m & 3) * WIDTH
    part = int(t * data[o + STEP + 2] + 0.5)
    jump_stretch(data, m, part, work)
    s = t - part * data[o + STEP + 1]
    for i in range(8):
        total = data[o + NEAR + 8 * (TERMS - 1) + i]
        for k in range(TERMS - 2, -1, -1):
            total = total * s + data[o + NEAR + 8 * k + i]
        work[SMALL + i] = total
    p1, q1, p2, q2 = data[o + QUAD], data[o + QUAD + 1], data[o + QUAD + 2], data[o + QUAD + 3]
    r1, s1, r2, s2 = work[SMALL], work[SMALL + 1], work[SMALL + 2], work[SMALL + 3]
    a, b, c, d = work[POINT], work[POINT + 1], work[POINT + 2], work[POINT + 3]
    work[G], work[G + 1] = (r1 + p1 * s1) * a + s1 * b, r1 * b - q1 * s1 * a
    work[G + 2], work[G + 3] = (r2 + p2 * s2) * c + s2 * d, r2 * d - q2 * s2 * c
    sn, cs, sw, cw = work[POINT + 4], work[POINT + 5], work[SMALL + 4], work[SMALL + 5]
    work[G + 4], work[G + 5] = sn * cw + cs * sw, cs * cw - sn * sw
    if phi.shape[0] > 0:
        _carry(data, m, part, phi)
        for j in range(phi.shape[1]):
            a, b, c, d = phi[0, j], phi[1, j], phi[2, j], phi[3, j]
            phi[0, j], phi[1, j] = (r1 + p1 * s1) * a + s1 * b, r1 * b - q1 * s1 * a
            phi[2, j], phi[3, j] = (r2 + p2 * s2) * c + s2 * d, r2 * d - q2 * s2 * c


@compiled
def apply_change(data: Float, o: int, work: Float, place: int) -> None:
    """work[place : place + 4] ← the (4, 7) matrix that stands at o, by columns, times (G, 1)."""
    o &= 0xFFFF
    place &= 0xFF
    a, b, c, d, sn, cs = work[G], work[G + 1], work[G + 2], work[G + 3], work[G + 4], work[G + 5]
    for i in range(4):
        drive = data[o + 16 + i] * sn + data[o + 20 + i] * cs + data[o + 24 + i]
        free = data[o + i] * a + data[o + 4 + i] * b
        work[place + i] = free + (data[o + 8 + i] * c + data[o + 12 + i] * d) + drive


@compiled
def fourth_derivative(data: Float, m: int, work: Float) -> float:
    """A bound of |d⁴ displacement/dt⁴| from here on: a mode's motion cannot grow."""
    o = (m & 3) * WIDTH + BOUND
    a, b, c, d = work[G], work[G + 1], work[G + 2], work[G + 3]
    first = abs(data[o] * a + data[o + 1] * b) + abs(data[o + 2] * a + data[o + 3] * b)
    second = abs(data[o + 4] * c + data[o + 5] * d) + abs(data[o + 6] * c + data[o + 7] * d)
    return float(first + second + data[o + 8])


@compiled
def scan_nodes(data: Float, m: int, work: Float) -> None:
    """F, D = displacement and rate at the nodes."""
    o = (m & 3) * WIDTH + SCAN
    a, b, c, d, sn, cs = work[G], work[G + 1], work[G + 2], work[G + 3], work[G + 4], work[G + 5]
    n = 2 * NODES
    for k in range(n):
        i = o + k
        first = data[i] * a + data[i + n] * b
        second = data[i + 2 * n] * c + data[i + 3 * n] * d
        work[F + k] = first + second + data[i + 4 * n] * sn + data[i + 5 * n] * cs


@compiled
def suspect_node(data: Float, m: int, m4: float, count: int, work: Float, k: int) -> int:
    """First step from k on, below count, that is not proved to stay within the limits.

    With end values at or within a limit and both middle Bernstein coefficients at least r within,
    the distance is at least 3 r s (1 - s) - M4 h⁴/24 s² (1 - s)² >= 0 for r = M4 h⁴/288.
    """
    o = (m & 3) * WIDTH
    third, rest = data[o + STEP] / 3.0, m4 * data[o + REST]
    low, high = data[o + LIMIT] - data[o + CENTRE], data[o + LIMIT + 1] - data[o + CENTRE]
    low, high = low + rest, high - rest
    while k < count:
        i = F + (k & 7)
        end = work[i + 1]
        b1, b2 = work[i] + third * work[i + NODES], end - third * work[i + NODES + 1]
        if not (low <= b1 <= high and low <= b2 <= high and low <= end <= high):
            break
        k += 1
    return k


@compiled
def find_crossing(
    data: Float, m: int, k: int, m4: float, target: float, sign: float, work: Float
) -> float:
    """First time in step k at which sign · (displacement - target) rises through 0, or -1."""
    h = data[(m & 3) * WIDTH + STEP]
    target -= data[(m & 3) * WIDTH + CENTRE]
    k &= 7
    # Rows of the stack: a, b, f(a), f'(a), f(b), f'(b).
    work[STACK], work[STACK + 1] = k * h, (k + 1) * h
    work[STACK + 2], work[STACK + 3] = sign * (work[F + k] - target), sign * work[D + k]
    work[STACK + 4], work[STACK + 5] = sign * (work[F + k + 1] - target), sign * work[D + k + 1]
    top = 1
    while top > 0:
        top -= 1
        o = STACK + 6 * (top & 127)
        a, b = work[o], work[o + 1]
        fa, da, fb, db = work[o + 2], work[o + 3], work[o + 4], work[o + 5]
        w = b - a
        rest = m4 * w * w * w * w / 384.0
        b1, b2 = fa + w * da / 3.0, fb - w * db / 3.0
        if max(max(fa, b1), max(b2, fb)) + rest < 0.0:
            continue
        # Rate: Bernstein coefficients of the interpolant's derivative and its remainder,
        # |f' - H'| <= sqrt(3)/216 · M4 w³.
        slack = 0.00802 * m4 * w * w * w
        middle = 3.0 * (b2 - b1) / w
        if min(min(da, db), middle) - slack > 0.0:
            if fb <= 0.0:
                continue
            if fa > 0.0:
                return float(a)
            return _newton(data, m, o, target, sign, work)
        if max(max(da, db), middle) + slack < 0.0:
            continue
        if w < FINEST * h or top + 2 >= ROOM:
            continue
        t = 0.5 * (a + b)
        f, d, _ = series_value(work, t - expand_series(data, m, t, work))
        f, d = sign * (f - target), sign * d
        work[o], work[o + 1] = t, b
        work[o + 2], work[o + 3], work[o + 4], work[o + 5] = f, d, fb, db
        work[o + 6], work[o + 7] = a, t
        work[o + 8], work[o + 9], work[o + 10], work[o + 11] = fa, da, f, d
        top += 2
    return -1.0


@compiled
def _newton(data: Float, m: int, o: int, target: float, sign: float, work: Float) -> float:
    """Root in the interval at o, where it rises: the cubic's, then the Taylor polynomial's."""
    o &= 0xFFFF
    a, b, fa, da = work[o], work[o + 1], work[o + 2], work[o + 3]
    fb, db = work[o + 4], work[o + 5]
    h = data[(m & 3) * WIDTH + STEP]
    w = b - a
    s = fa / (fa - fb)
    c2 = 3.0 * (fb - fa) - w * (2.0 * da + db)
    c3 = 2.0 * (fa - fb) + w * (da + db)
    for _ in range(2):
        s -= (fa + s * (w * da + s * (c2 + s * c3))) / (w * da + s * (2.0 * c2 + 3.0 * s * c3))
    t = a + min(max(s, 0.0), 1.0) * w
    for _ in range(60):
        f, d, e = series_value(work, t - expand_series(data, m, t, work))
        f, d, e = sign * (f - target), sign * d, sign * e
        a, b = (a, t) if f > 0.0 else (t, b)
        step = f / d
        bend = step * e / d
        u = t - step * (1.0 + bend)  # Chebyshev's third-order step
        if not (a <= u <= b):
            u = 0.5 * (a + b)
        elif abs(bend) < 1e-3 or abs(step) < 1e-7 * h:
            # What is left is bend² of the step, and a time's error costs the state its square.
            return float(u)
        t = u
    return float(t)


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
    written. phi : (4, k) tangent vectors in state coordinates, (0, 0) for none.
    """
    data = tables.data
    m = cursor[0]
    work = np.zeros(STACK + 6 * (ROOM + 2))
    for i in range(4):
        work[G + i] = x[i]
    work[G + 5] = 1.0
    apply_change(data, m * WIDTH + MODAL, work, G)
    if phi.shape[0] > 0:
        _turn(data, m * WIDTH + MODAL, phi)
    t, events, done, code = 0.0, 0, 0, DONE
    while done < strobes.shape[0] - 1 and code == DONE:
        o = (m & 3) * WIDTH
        h, low, high = data[o + STEP], data[o + LIMIT], data[o + LIMIT + 1]
        left = period - t
        m4 = fourth_derivative(data, m, work)
        scan_nodes(data, m, work)
        count = min(STEPS, int(left / h) + 1)
        first, side = -1.0, 0
        k = suspect_node(data, m, m4, count, work, 0)
        while k < count:
            if high < np.inf:
                first, side = find_crossing(data, m, k, m4, high, 1.0, work), 1
            if low > -np.inf:
                other = find_crossing(data, m, k, m4, low, -1.0, work)
                if other >= 0.0 and (first < 0.0 or other < first):
                    first, side = other, -1
            if first >= 0.0:
                break
            k = suspect_node(data, m, m4, count, work, k + 1)
        if 0.0 <= first <= left:
            move_map(data, m, first, work, phi)
            t += first
            n = 0
            if m == 0:
                n = 1 if side > 0 else 2
                impacts[done, 1 if side > 0 else 0] += 1
            apply_change(data, o + CHANGE + 28 * n, work, G)
            if phi.shape[0] > 0:
                _turn(data, o + CHANGE + 28 * n, phi)
            m = n
            events += 1
            if events > max_events:
                code = TOO_MANY_EVENTS
        elif first < 0.0 and STEPS * h < left:
            jump_stretch(data, m, LAST, work)
            for i in range(6):
                work[G + i] = work[POINT + i]
            if phi.shape[0] > 0:
                _carry(data, m, LAST, phi)
            t += STEPS * h
        else:
            move_map(data, m, left, work, phi)
            t, events = 0.0, 0
            done += 1
            work[G + 4], work[G + 5] = 0.0, 1.0
            apply_change(data, o + STATE, work, POINT)
            for i in range(4):
                strobes[done, i] = work[POINT + i]
            if not (abs(strobes[done, 0]) < 1e12):
                code = DIVERGED
    if phi.shape[0] > 0:
        _turn(data, m * WIDTH + STATE, phi)
    cursor[0], cursor[1] = m, done
    return code
