"""Compiled search for crossings and turning points within a block of seven steps.

Both fast paths look at a block together. They know a function of time (a distance to a boundary)
by value and rate at the block's eight nodes, by a bound M4 of its fourth derivative, and by its
Taylor series about each of the 56 tabulated parts. That nothing is crossed in a step is proved by
the cubic Hermite interpolant and M4; where that fails, the step is halved.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from designer.base.jit import embedded, leaf

Float = NDArray[np.float64]
Expand = Callable[[Float, Any, float, Float], float]
FindCrossing = Callable[..., tuple[float, int]]
TurningValues = Callable[..., int]

BLOCK_STEP = 0.4
"""h · max(|lambda|, omega) of a step: longer steps fail the proof more often."""
STEPS = 7
"""Steps of a block."""
NODES = STEPS + 1
"""A loop over value and rate at all nodes is long enough for LLVM to vectorise it."""
PARTS = 8
"""Tabulated parts of a step: |lambda| times half a part is 1/40."""
TERMS = 8
"""Taylor terms about a part: (1/40)**8/8! is 4e-18."""
LAST = STEPS * PARTS
FINEST = 1e-10
"""Of a step: below it an undecided tangency is taken for none."""

# Places in the scratch array.
NOW, POINT, SMALL, COEF, F, D, STACK = 0, 16, 32, 40, 48, 48 + NODES, 64
ROOM = 84
"""Intervals that the bisection may hold."""
SCRATCH = STACK + 6 * (ROOM + 2)

# ``k & 7`` and the like tell the compiler that an index is not negative: no wrap-around.


@leaf
def series_value(work: Float, s: float) -> tuple[float, float, float]:
    """Value, rate and half the second derivative a time s from the expanded part."""
    f = work[COEF + TERMS - 1]
    d = e = 0.0
    for k in range(TERMS - 2, -1, -1):
        e = e * s + d
        d = d * s + f
        f = f * s + work[COEF + k]
    return f, d, e


@leaf
def suspect_step(
    h: float, rest: float, low: float, high: float, count: int, work: Float, k: int
) -> int:
    """First step from k on, below count, in which F is not proved to stay within the limits.

    With end values at or within a limit and both middle Bernstein coefficients at least ``rest``
    within, the distance is at least 3 r s (1 - s) - M4 h⁴/24 s² (1 - s)² >= 0 for
    rest = r = M4 h⁴/288.
    """
    third = h / 3.0
    low, high = low + rest, high - rest
    while k < count:
        i = F + (k & 7)
        end = work[i + 1]
        b1, b2 = work[i] + third * work[i + NODES], end - third * work[i + NODES + 1]
        if not (low <= b1 <= high and low <= b2 <= high and low <= end <= high):
            break
        k += 1
    return k


def searches(expand: Expand) -> tuple[FindCrossing, TurningValues]:
    """The compiled searches of a path that expands its functions by ``expand``.

    ``expand(data, m, t, work)`` writes the Taylor series of the function that the path knows as m
    about the part nearest to t into COEF and returns that part's time.
    """

    @leaf
    def halve(data: Float, m: Any, target: float, sign: float, work: Float, o: int) -> None:
        """Put both halves of the interval at o on the stack, the earlier one on top."""
        a, b, t = work[o], work[o + 1], 0.5 * (work[o] + work[o + 1])
        f, d, _ = series_value(work, t - expand(data, m, t, work))
        f, d = sign * (f - target), sign * d
        work[o + 6], work[o + 7] = a, t
        work[o + 8], work[o + 9], work[o + 10], work[o + 11] = work[o + 2], work[o + 3], f, d
        work[o], work[o + 1], work[o + 2], work[o + 3] = t, b, f, d

    @embedded
    def newton(
        data: Float, m: Any, o: int, h: float, target: float, sign: float, work: Float
    ) -> float:
        """Root in the interval at o, where it rises: the cubic's, then the Taylor polynomial's."""
        o &= 0xFFFF
        a, b, fa, da = work[o], work[o + 1], work[o + 2], work[o + 3]
        fb, db = work[o + 4], work[o + 5]
        w = b - a
        s = fa / (fa - fb)
        c2 = 3.0 * (fb - fa) - w * (2.0 * da + db)
        c3 = 2.0 * (fa - fb) + w * (da + db)
        for _ in range(2):
            s -= (fa + s * (w * da + s * (c2 + s * c3))) / (w * da + s * (2.0 * c2 + 3.0 * s * c3))
        t = a + min(max(s, 0.0), 1.0) * w
        near = np.inf
        for _ in range(60):
            if abs(t - near) > h / (2 * PARTS):
                near = expand(data, m, t, work)
            f, d, e = series_value(work, t - near)
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

    @embedded
    def first_rise(
        data: Float, m: Any, k: int, h: float, m4: float, target: float, sign: float,
        tangency: float, undecided: Float, work: Float,
    ) -> float:  # fmt: skip
        """First time in step k at which sign · (f - target) rises through 0, or -1."""
        k &= 7
        # Rows of the stack: a, b, f(a), f'(a), f(b), f'(b).
        work[STACK], work[STACK + 1] = k * h, (k + 1) * h
        work[STACK + 2], work[STACK + 3] = sign * (work[F + k] - target), sign * work[D + k]
        work[STACK + 4], work[STACK + 5] = sign * (work[F + k + 1] - target), sign * work[D + k + 1]
        top, time = 1, -1.0
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
                time = a if fa > 0.0 else newton(data, m, o, h, target, sign, work)
                break
            if max(max(da, db), middle) + slack < 0.0:
                continue
            nothing = max(max(abs(fa), abs(b1)), max(abs(b2), abs(fb))) + rest < tangency
            if w < FINEST * h or nothing or top + 2 >= ROOM:
                if abs(fa) < tangency:
                    undecided[-1] += 1.0
                continue
            halve(data, m, target, sign, work, o)
            top += 2
        return float(time)

    @embedded
    def find_crossing(
        data: Float, m: Any, k: int, h: float, m4: float, low: float, high: float,
        tangency: float, undecided: Float, work: Float,
    ) -> tuple[float, int]:  # fmt: skip
        """First time in step k at which f leaves [low, high], or -1, and the side, 1 above.

        tangency : an interval over which the function is nearer than this to a limit is not halved
        any more; undecided[-1] counts those. An infinite limit is not looked at.
        """
        first, through = -1.0, 0
        for side in (1.0, -1.0):
            target = high if side > 0.0 else low
            if abs(target) < np.inf:
                time = first_rise(data, m, k, h, m4, target, side, tangency, undecided, work)
                if time >= 0.0 and (first < 0.0 or time < first):
                    first, through = time, int(side)
        return first, through

    @leaf
    def turning_value(
        data: Float, m: Any, low: float, high: float, t: float, rate: float, h: float,
        work: Float,
    ) -> float:  # fmt: skip
        """Value where the rate changes its sign in [low, high], by Newton from t."""
        for _ in range(60):
            _, d, e = series_value(work, t - expand(data, m, t, work))
            low, high = (t, high) if (d > 0.0) == (rate > 0.0) else (low, t)
            u = t - 0.5 * d / e
            if not (low <= u <= high):
                u = 0.5 * (low + high)
            near = abs(u - t) < 1e-9 * h
            t = u
            if near:
                break
        f, _, _ = series_value(work, t - expand(data, m, t, work))
        return float(f)

    @leaf
    def turning_values(
        data: Float, m: Any, end: float, h: float, m4: float, work: Float,
        values: Float,
    ) -> int:  # fmt: skip
        """How many times function m turns within [0, end]; F and D hold its nodes.

        values : (2, k) gets its values there, and 1.0 where it is a greatest value.
        """
        count, k = 0, 0
        while k < STEPS and k * h < end:
            work[STACK], work[STACK + 1] = k * h, min((k + 1) * h, end)
            work[STACK + 2], work[STACK + 3] = work[F + k], work[D + k]
            if work[STACK + 1] < end or end >= (k + 1) * h:
                work[STACK + 4], work[STACK + 5] = work[F + k + 1], work[D + k + 1]
            else:
                f, d, _ = series_value(work, end - expand(data, m, end, work))
                work[STACK + 4], work[STACK + 5] = f, d
            k += 1
            top = 1
            while top > 0:
                top -= 1
                o = STACK + 6 * (top & 127)
                a, b = work[o], work[o + 1]
                fa, da, fb, db = work[o + 2], work[o + 3], work[o + 4], work[o + 5]
                w = b - a
                if not w > 0.0:
                    continue
                slack = 0.00802 * m4 * w * w * w
                middle = 3.0 * ((fb - w * db / 3.0) - (fa + w * da / 3.0)) / w
                if min(min(da, db), middle) > slack or max(max(da, db), middle) < -slack:
                    continue
                if (da > 0.0) != (db > 0.0):
                    if count < values.shape[1]:
                        t = a + w * da / (da - db)
                        values[0, count] = turning_value(data, m, a, b, t, da, h, work)
                        values[1, count] = 1.0 if da > 0.0 else 0.0
                        count += 1
                    continue
                if w < h / 256.0 or top + 2 >= ROOM:
                    continue
                halve(data, m, 0.0, 1.0, work, o)
                top += 2
        return count

    return find_crossing, turning_values
