"""Compiled fast path of the exact flow: four states, one stop pair, modal coordinates.

Within a mode the homogeneous motion is two independent scalar oscillators, y'' + p y' + q y = 0,
one for each real quadratic factor of the characteristic polynomial; a step is two 2 x 2 products
and one rotation of the drive. No complex numbers, no case for critical or overdamped modes but in
the propagator itself. Each step's proof that no boundary is crossed is the Bernstein hull of the
cubic Hermite interpolant with its remainder M4 h⁴/384, where M4 follows from the modal amplitudes
at the mode's entry, which cannot grow for p >= 0; where the hull fails, the step is halved.

The general kernel (``designer.flow_kernel``) is the reference that this must equal. Everything
that these functions call stands in this file, or a stale compiled cache would survive an edit.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import numba
import numpy as np
from numpy.typing import NDArray

Function = TypeVar("Function", bound=Callable[..., Any])
Float = NDArray[np.float64]
Int = NDArray[np.int64]

DONE, TOO_MANY_EVENTS, DIVERGED = 0, 2, 3
"""Return codes, those of ``flow_kernel``."""
PARTS = 32
"""A step's tabulated parts; within half a part the Taylor series of ``_nudge`` is exact."""
FINEST = 1e-10
"""Of a step: below it an undecided tangency is taken for none."""


def _compile(function: Function) -> Function:
    options: dict[str, Any] = {
        "nogil": True,
        "fastmath": {"contract", "nsz", "arcp"},
        "error_model": "numpy",
    }
    try:
        compiled = numba.njit(cache=True, **options)(function)
    except RuntimeError:  # nowhere to keep compiled code: compile for this process only
        compiled = numba.njit(**options)(function)
    return compiled  # type: ignore[no-any-return]


# Columns of ``ModalTables.data``: one array for all, since a compiled call pays for each array.
STEP = 0
LIMIT = 1
"""(2,) displacement below and above which the mode is left."""
OMEGA = 3
QUAD = 4
"""(2, 3) sigma = p/2, q, and D = q - sigma² of each oscillator."""
SHAPE = 10
"""(2, 4) rows of the guarded displacement and its rate over the modal state."""
FORCED = 18
"""(2, 3) the same over (sin, cos, 1)."""
BOUND = 24
"""(3,) factors of M4: the two modal amplitudes, 1."""
PROP = 27
"""(PARTS + 1, 2, 4) propagators over multiples of step/PARTS, by rows."""
TURN = PROP + 8 * (PARTS + 1)
"""(PARTS + 1, 2) sine and cosine of the drive's phase over the same."""
WIDTH = TURN + 2 * (PARTS + 1)


class ModalTables(NamedTuple):
    """What the kernel knows; first axis: mode 0 open, 1 upper contact, 2 lower contact.

    data : (3, WIDTH), see the columns above.
    change : (3, 3, 4, 7) next modal state from (modal state, sin, cos, 1); [m, m] unused.
    to_modal : (3, 4, 7) modal state from (x, sin, cos, 1); to_state : (3, 4, 7) back.
    """

    data: Float
    change: Float
    to_modal: Float
    to_state: Float


@_compile
def _propagator(data: Float, m: int, k: int, t: float, out: Float) -> None:
    """2 x 2 propagator of oscillator k, y'' + 2 sigma y' + q y = 0, over any time t, by rows."""
    sigma, q, d = data[m, QUAD + 3 * k], data[m, QUAD + 3 * k + 1], data[m, QUAD + 3 * k + 2]
    w = math.sqrt(abs(d))
    if d > 0.0:
        fade = math.exp(-sigma * t)
        c, s = fade * math.cos(w * t), fade * math.sin(w * t) / w
    else:  # not cosh and sinh: they overflow where the product does not
        slow, fast = math.exp((w - sigma) * t), math.exp(-(w + sigma) * t)
        c, s = 0.5 * (slow + fast), 0.5 * (slow - fast) / w
    out[0] = c + sigma * s
    out[1] = s
    out[2] = -q * s
    out[3] = c - sigma * s


@_compile
def _nudge(data: Float, m: int, t: float, out: Float) -> None:
    """Carry out (6,), g with sine and cosine, over a time |t| <= h/PARTS/2: Taylor to order 7.

    |lambda| t <= 0.011, so the first term left out is below 1e-20 of the state.
    """
    for k in range(2):
        p, q = 2.0 * data[m, QUAD + 3 * k], data[m, QUAD + 3 * k + 1]
        y, v = out[2 * k], out[2 * k + 1]
        d0, d1 = y, v
        weight = t
        for n in range(1, 8):
            d2 = -p * d1 - q * d0
            y += weight * d1
            v += weight * d2
            d0, d1 = d1, d2
            weight *= t / (n + 1)
        out[2 * k], out[2 * k + 1] = y, v
    a = data[m, OMEGA] * t
    b = a * a
    s = a * (1.0 - b / 6.0 * (1.0 - b / 20.0 * (1.0 - b / 42.0)))
    c = 1.0 - b / 2.0 * (1.0 - b / 12.0 * (1.0 - b / 30.0 * (1.0 - b / 56.0)))
    sn, cs = out[4], out[5]
    out[4] = sn * c + cs * s
    out[5] = cs * c - sn * s


@_compile
def _jump(data: Float, m: int, part: int, g: Float, sn: float, cs: float, out: Float) -> None:
    """Modal state and drive ``part`` parts of a step on, into out (6,)."""
    for k in range(2):
        a, b = g[2 * k], g[2 * k + 1]
        out[2 * k] = data[m, PROP + 8 * part + 4 * k] * a + data[m, PROP + 8 * part + 4 * k + 1] * b
        out[2 * k + 1] = (
            data[m, PROP + 8 * part + 4 * k + 2] * a + data[m, PROP + 8 * part + 4 * k + 3] * b
        )
    sw, cw = data[m, TURN + 2 * part], data[m, TURN + 2 * part + 1]
    out[4] = sn * cw + cs * sw
    out[5] = cs * cw - sn * sw


@_compile
def _at(data: Float, m: int, g: Float, sn: float, cs: float, t: float, out: Float) -> None:
    """Modal state and drive a time 0 <= t <= h on, into out (6,)."""
    width = data[m, STEP] / PARTS
    part = int(t / width + 0.5)
    _jump(data, m, part, g, sn, cs, out)
    _nudge(data, m, t - part * width, out)


@_compile
def _row(data: Float, m: int, k: int, g: Float, sn: float, cs: float) -> float:
    """Guarded displacement (k = 0) or its rate (k = 1). Indices, not views: a view costs more."""
    return (
        data[m, SHAPE + 4 * k] * g[0]
        + data[m, SHAPE + 4 * k + 1] * g[1]
        + data[m, SHAPE + 4 * k + 2] * g[2]
        + data[m, SHAPE + 4 * k + 3] * g[3]
        + data[m, FORCED + 3 * k] * sn
        + data[m, FORCED + 3 * k + 1] * cs
        + data[m, FORCED + 3 * k + 2]
    )


@_compile
def _fourth(data: Float, m: int, g: Float) -> float:
    """A bound of |d⁴ displacement/dt⁴| from here on: the envelopes do not grow.

    Of an oscillator the amplitude; where it is overdamped the sum of both exponentials.
    """
    total = data[m, BOUND + 2]
    for k in range(2):
        sigma, d = data[m, QUAD + 3 * k], data[m, QUAD + 3 * k + 2]
        y = g[2 * k]
        u = g[2 * k + 1] + sigma * y
        if d > 0.0:
            total += data[m, BOUND + k] * math.sqrt(y * y + u * u / d)
        else:
            w = math.sqrt(-d)
            total += data[m, BOUND + k] * 0.5 * (abs(y + u / w) + abs(y - u / w))
    return total


@_compile
def _crossing(
    data: Float,
    m: int,
    g: Float,
    sn: float,
    cs: float,
    h: float,
    m4: float,
    ends: Float,
    target: float,
    sign: float,
    stack: Float,
    point: Float,
) -> float:
    """First time in [0, h] at which sign · (displacement - target) rises through 0, or -1.

    ends : (4,) displacement and rate at both ends.
    """
    # stack rows: a, b, f(a), f'(a), f(b), f'(b)
    stack[0, 0], stack[0, 1] = 0.0, h
    stack[0, 2], stack[0, 3] = sign * (ends[0] - target), sign * ends[1]
    stack[0, 4], stack[0, 5] = sign * (ends[2] - target), sign * ends[3]
    top = 1
    while top > 0:
        top -= 1
        a, b = stack[top, 0], stack[top, 1]
        fa, da, fb, db = stack[top, 2], stack[top, 3], stack[top, 4], stack[top, 5]
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
                return a
            return _newton(data, m, g, sn, cs, a, b, fa, da, fb, db, target, sign, point)
        if max(max(da, db), middle) + slack < 0.0:
            continue
        if w < FINEST * h or top + 2 >= stack.shape[0]:
            continue
        t = 0.5 * (a + b)
        _at(data, m, g, sn, cs, t, point)
        f = sign * (_row(data, m, 0, point, point[4], point[5]) - target)
        d = sign * _row(data, m, 1, point, point[4], point[5])
        stack[top, 0], stack[top, 1] = t, b
        stack[top, 2], stack[top, 3], stack[top, 4], stack[top, 5] = f, d, fb, db
        top += 1
        stack[top, 0], stack[top, 1] = a, t
        stack[top, 2], stack[top, 3], stack[top, 4], stack[top, 5] = fa, da, f, d
        top += 1
    return -1.0


@_compile
def _newton(
    data: Float,
    m: int,
    g: Float,
    sn: float,
    cs: float,
    a: float,
    b: float,
    fa: float,
    da: float,
    fb: float,
    db: float,
    target: float,
    sign: float,
    point: Float,
) -> float:
    """Root in [a, b], where the displacement rises: the cubic's, then Newton on the exact one."""
    w = b - a
    s = fa / (fa - fb)
    c2 = 3.0 * (fb - fa) - w * (2.0 * da + db)
    c3 = 2.0 * (fa - fb) + w * (da + db)
    for _ in range(4):
        f = fa + s * (w * da + s * (c2 + s * c3))
        d = w * da + s * (2.0 * c2 + 3.0 * s * c3)
        step = f / d
        s -= step
        if abs(step) < 1e-9:
            break
    s = min(max(s, 0.0), 1.0)
    t = a + s * w
    for _ in range(60):
        _at(data, m, g, sn, cs, t, point)
        f = sign * (_row(data, m, 0, point, point[4], point[5]) - target)
        d = sign * _row(data, m, 1, point, point[4], point[5])
        if f > 0.0:
            b = t
        else:
            a = t
        u = t - f / d
        if not (a <= u <= b):
            u = 0.5 * (a + b)
        # Newton squares the error: the next one would be rounding.
        if abs(u - t) < 1e-7 * data[m, STEP]:
            return u
        t = u
    return t


@_compile
def _carry(data: Float, to_modal: Float, to_state: Float, m: int, t: float, phi: Float) -> None:
    """phi ← (linear flow of mode m over t) phi, in state coordinates."""
    column = np.empty(4)
    modal = np.empty(4)
    first = np.empty(4)
    second = np.empty(4)
    _propagator(data, m, 0, t, first)
    _propagator(data, m, 1, t, second)
    for j in range(phi.shape[1]):
        for i in range(4):
            total = 0.0
            for k in range(4):
                total += to_modal[m, i, k] * phi[k, j]
            modal[i] = total
        column[0] = first[0] * modal[0] + first[1] * modal[1]
        column[1] = first[2] * modal[0] + first[3] * modal[1]
        column[2] = second[0] * modal[2] + second[1] * modal[3]
        column[3] = second[2] * modal[2] + second[3] * modal[3]
        for i in range(4):
            total = 0.0
            for k in range(4):
                total += to_state[m, i, k] * column[k]
            phi[i, j] = total


@_compile
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
    data, change = tables.data, tables.change
    to_modal, to_state = tables.to_modal, tables.to_state
    m = cursor[0]
    g = np.empty(4)
    after = np.empty(6)
    point = np.empty(6)
    ends = np.empty(4)
    stack = np.empty((84, 6))
    sn, cs = 0.0, 1.0
    for i in range(4):
        total = to_modal[m, i, 4] * sn + to_modal[m, i, 5] * cs
        total += to_modal[m, i, 6]
        for k in range(4):
            total += to_modal[m, i, k] * x[k]
        g[i] = total
    ends[0] = _row(data, m, 0, g, sn, cs)
    ends[1] = _row(data, m, 1, g, sn, cs)
    m4 = _fourth(data, m, g)
    stay, t, events = 0.0, 0.0, 0
    done = 0
    while done < strobes.shape[0] - 1:
        h = data[m, STEP]
        whole = period - t > h
        if whole:
            _jump(data, m, PARTS, g, sn, cs, after)
        else:
            h = period - t
            _at(data, m, g, sn, cs, h, after)
        ends[2] = _row(data, m, 0, after, after[4], after[5])
        ends[3] = _row(data, m, 1, after, after[4], after[5])
        b1, b2 = ends[0] + h * ends[1] / 3.0, ends[2] - h * ends[3] / 3.0
        rest = m4 * h * h * h * h / 384.0
        high = max(max(ends[0], b1), max(b2, ends[2])) + rest
        low = min(min(ends[0], b1), min(b2, ends[2])) - rest
        first, side = -1.0, 0
        if high >= data[m, LIMIT + 1]:
            first = _crossing(
                data, m, g, sn, cs, h, m4, ends, data[m, LIMIT + 1], 1.0, stack, point
            )
            side = 1
        if low <= data[m, LIMIT]:
            other = _crossing(data, m, g, sn, cs, h, m4, ends, data[m, LIMIT], -1.0, stack, point)
            if other >= 0.0 and (first < 0.0 or other < first):
                first, side = other, -1
        if first >= 0.0:
            _at(data, m, g, sn, cs, first, after)
            t += first
            stay += first
            if phi.shape[0] > 0:
                _carry(data, to_modal, to_state, m, stay, phi)
            stay = 0.0
            n = 0
            if m == 0:
                n = 1 if side > 0 else 2
                impacts[done, 1 if side > 0 else 0] += 1
            sn, cs = after[4], after[5]
            for i in range(4):
                total = change[m, n, i, 4] * sn + change[m, n, i, 5] * cs
                total += change[m, n, i, 6]
                for k in range(4):
                    total += change[m, n, i, k] * after[k]
                g[i] = total
            m = n
            m4 = _fourth(data, m, g)
            ends[0] = _row(data, m, 0, g, sn, cs)
            ends[1] = _row(data, m, 1, g, sn, cs)
            events += 1
            if events > max_events:
                cursor[0], cursor[1] = m, done
                return TOO_MANY_EVENTS
            continue
        for i in range(4):
            g[i] = after[i]
        sn, cs = after[4], after[5]
        ends[0], ends[1] = ends[2], ends[3]
        stay += h
        if whole:
            t += h
            continue
        t, events = 0.0, 0
        done += 1
        sn, cs = 0.0, 1.0
        for i in range(4):
            total = to_state[m, i, 5] + to_state[m, i, 6]
            for k in range(4):
                total += to_state[m, i, k] * g[k]
            strobes[done, i] = total
        if not (abs(strobes[done, 0]) < 1e12):
            cursor[0], cursor[1] = m, done
            return DIVERGED
    if phi.shape[0] > 0:
        _carry(data, to_modal, to_state, m, stay, phi)
    cursor[0], cursor[1] = m, done
    return DONE
