"""Compiled core of the sweeps: a transient with its exponent, and what is seen after it.

Built on the modal fast path (``dynamics.kernel_modal``), whose functions it calls; since a compiled
cache does not see an edit of another file, every function here is made by a factory whose argument
is a hash of that file: numba keys its cache by what a function closes over.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from designer.base.jit import compiled
from designer.dynamics import kernel_modal
from designer.dynamics.kernel_modal import (
    CENTRE,
    CHANGE,
    DONE,
    FINEST,
    LAST,
    LIMIT,
    MODAL,
    NODES,
    POINT,
    ROOM,
    STACK,
    STATE,
    STEP,
    STEPS,
    TOO_MANY_EVENTS,
    WIDTH,
    F,
    G,
    ModalTables,
    advance,
    apply_change,
    expand_series,
    find_crossing,
    fourth_derivative,
    jump_stretch,
    move_map,
    scan_nodes,
    series_value,
    suspect_node,
)

Float = NDArray[np.float64]
Int = NDArray[np.int64]


def stamp_of(*modules: ModuleType) -> int:
    """A number that changes with the source of these modules."""
    text = b"".join(Path(str(m.__file__)).read_bytes() for m in modules)
    return int(hashlib.sha256(text).hexdigest()[:15], 16)


RENEWAL = 5
"""Periods between two normalisations of the tangent vector."""
ALIGN = 10
"""Periods in which the tangent vector turns towards the leading direction; they do not count."""

STAMP = stamp_of(kernel_modal)


def _dips(stamp: int) -> Callable[..., Any]:
    @compiled
    def dip(data: Float, m: int, m4: float, end: float, work: Float, best: float) -> float:
        """The smaller of ``best`` and the least displacement from now to ``end``.

        A part of a step that can hold no smaller value, by the cubic's hull and its remainder, is
        passed over; else it is halved, down to where the rate's sign change encloses a minimum.
        """
        if stamp == 0:
            return best
        o = (m & 3) * WIDTH
        h, centre = data[o + STEP], data[o + CENTRE]
        best -= centre
        k = 0
        while k < STEPS and k * h < end:
            a, b = k * h, (k + 1) * h
            i = F + (k & 7)
            fb, db = work[i + 1], work[i + NODES + 1]
            fa, da = work[i], work[i + NODES]
            if b > end:
                b = end
                fb, db, _ = series_value(work, b - expand_series(data, m, b, work))
            work[STACK], work[STACK + 1] = a, b
            work[STACK + 2], work[STACK + 3] = fa, da
            work[STACK + 4], work[STACK + 5] = fb, db
            top = 1
            while top > 0:
                top -= 1
                s = STACK + 6 * (top & 127)
                a, b = work[s], work[s + 1]
                fa, da, fb, db = work[s + 2], work[s + 3], work[s + 4], work[s + 5]
                w = b - a
                best = min(best, min(fa, fb))
                rest = m4 * w * w * w * w / 384.0
                b1, b2 = fa + w * da / 3.0, fb - w * db / 3.0
                if min(b1, b2) - rest >= best or w < FINEST * h:
                    continue
                slack = 0.00802 * m4 * w * w * w
                middle = 3.0 * (b2 - b1) / w
                if min(min(da, db), middle) - slack > 0.0:
                    continue
                if max(max(da, db), middle) + slack < 0.0:
                    continue
                if da < 0.0 < db and w < 0.2 * h:
                    low, high, t = a, b, a + w * da / (da - db)
                    for _ in range(40):
                        f, d, e = series_value(work, t - expand_series(data, m, t, work))
                        best = min(best, f)
                        low, high = (low, t) if d > 0.0 else (t, high)
                        u = t - 0.5 * d / e if e > 0.0 else low
                        if not (low < u < high):
                            u = 0.5 * (low + high)
                        if abs(u - t) < 1e-9 * h:
                            break
                        t = u
                    continue
                if top + 2 >= ROOM or w < 1e-3 * h:
                    continue
                t = 0.5 * (a + b)
                f, d, _ = series_value(work, t - expand_series(data, m, t, work))
                work[s], work[s + 1] = t, b
                work[s + 2], work[s + 3], work[s + 4], work[s + 5] = f, d, fb, db
                work[s + 6], work[s + 7] = a, t
                work[s + 8], work[s + 9], work[s + 10], work[s + 11] = fa, da, f, d
                top += 2
            k += 1
        return float(best + centre)

    return dip


_dip = _dips(STAMP)


def _observes(stamp: int) -> Callable[..., Any]:
    @compiled
    def observe(
        data: Float,
        cursor: Int,
        period: float,
        max_events: int,
        strobes: Float,
        minima: Float,
        velocities: Float,
        peak: Float,
    ) -> int:
        """``kernel_modal.advance`` from strobes[0] (4,) on, looking.

        cursor : (2,) mode, and on return impacts on the upper stop. minima : (periods,) least
        displacement of each. velocities : rate at each entry into contact with the upper stop, as
        far as it reaches. peak : (4,) largest of each state at what was visited, updated.
        """
        if stamp == 0:
            return DONE
        m = cursor[0]
        work = np.zeros(STACK + 6 * (ROOM + 2))
        phi = np.zeros((0, 0))
        for i in range(4):
            work[G + i] = strobes[0, i]
        work[G + 5] = 1.0
        apply_change(data, m * WIDTH + MODAL, work, G)
        t, events, done, met, code = 0.0, 0, 0, 0, DONE
        minima[0] = np.inf
        while done < minima.shape[0] and code == DONE:
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
            crosses = 0.0 <= first <= left
            end = first if crosses else min(STEPS * h, left)
            minima[done] = _dip(data, m, m4, end, work, minima[done])
            if crosses:
                n = 0
                if m == 0:
                    n = 1 if side > 0 else 2
                    if side > 0:
                        if met < velocities.shape[0]:
                            _, rate, _ = series_value(
                                work, first - expand_series(data, m, first, work)
                            )
                            velocities[met] = rate
                        met += 1
                move_map(data, m, first, work, phi)
                t += first
                apply_change(data, o + CHANGE + 28 * n, work, G)
                m = n
                events += 1
                if events > max_events:
                    code = TOO_MANY_EVENTS
            elif STEPS * h < left:
                jump_stretch(data, m, LAST, work)
                for i in range(6):
                    work[G + i] = work[POINT + i]
                t += STEPS * h
            else:
                move_map(data, m, left, work, phi)
                t, events = 0.0, 0
                done += 1
                if done < minima.shape[0]:
                    minima[done] = np.inf
                work[G + 4], work[G + 5] = 0.0, 1.0
                apply_change(data, o + STATE, work, POINT)
                for i in range(4):
                    strobes[done, i] = work[POINT + i]
            apply_change(data, (m & 3) * WIDTH + STATE, work, POINT)
            for i in range(4):
                peak[i] = max(peak[i], abs(work[POINT + i]))
        cursor[0], cursor[1] = m, met
        return code

    return observe


_observe = _observes(STAMP)


@compiled
def mode_of(data: Float, x: Float) -> int:
    """Open, upper or lower contact, by the displacement x[0]."""
    if x[0] > data[LIMIT + 1]:
        return 1
    return 2 if x[0] < data[LIMIT] else 0


def _exponents(stamp: int) -> Callable[..., Any]:
    @compiled
    def exponent(
        tables: ModalTables, x: Float, cursor: Int, period: float, max_events: int, periods: int
    ) -> float:
        """Carry x (4,), written, over ``periods``; the growth of a tangent vector per period.

        nan where the flow stopped: then cursor[1] holds the kernel's code, else DONE.
        """
        if stamp == 0:
            return 0.0
        phi = np.array([[0.5], [-0.3], [0.7], [0.4]])
        strobes = np.empty((RENEWAL + 1, 4))
        counts = np.empty((RENEWAL, 2), dtype=np.int64)
        place = np.array([cursor[0], 0], dtype=np.int64)
        growth, done, counted = 0.0, 0, 0
        while done < periods:
            n = min(RENEWAL, periods - done)
            code = advance(tables, x, place, period, phi, max_events, strobes[: n + 1], counts[:n])
            if code != DONE:
                cursor[1] = code
                return np.nan
            size = 0.0
            for i in range(4):
                x[i] = strobes[n, i]
                size += phi[i, 0] * phi[i, 0]
            size = max(np.sqrt(size), 1e-300)
            for i in range(4):
                phi[i, 0] /= size
            if done >= ALIGN:
                growth += np.log(size)
                counted += n
            done += n
        cursor[0], cursor[1] = place[0], DONE
        return float(growth / max(counted, 1))

    return exponent


exponent = _exponents(STAMP)


def _travels(stamp: int) -> Callable[..., Any]:
    @compiled
    def travel(
        tables: ModalTables,
        x: Float,
        period: float,
        max_events: int,
        settle: int,
        tangents: int,
        strobes: Float,
        minima: Float,
        velocities: Float,
        peak: Float,
        cursor: Int,
    ) -> float:
        """From x (4,) over ``settle`` periods, the last ``tangents`` of them with a tangent vector,
        then look. Returns the growth per period.

        strobes : (keep + 1, 4), minima : (keep,), velocities, peak : as ``_observe``. cursor : (3,)
        on return mode, impacts on the upper stop, the kernel's code.
        """
        if stamp == 0:
            return 0.0
        data = tables.data
        place = np.array([mode_of(data, x), 0], dtype=np.int64)
        free = settle - tangents
        growth = np.nan
        cursor[2] = DONE
        if free > 0:
            passed = np.empty((free + 1, 4))
            counts = np.empty((free, 2), dtype=np.int64)
            nothing = np.zeros((0, 0))
            code = advance(tables, x, place, period, nothing, max_events, passed, counts)
            cursor[2] = code
            if code != DONE:
                return growth
            for i in range(4):
                x[i] = passed[free, i]
        if tangents > 0:
            growth = float(exponent(tables, x, place, period, max_events, tangents))
            cursor[2] = place[1]
            if place[1] != DONE:
                return growth
        for i in range(4):
            strobes[0, i] = x[i]
        cursor[2] = _observe(data, place, period, max_events, strobes, minima, velocities, peak)
        cursor[0], cursor[1] = place[0], place[1]
        return growth

    return travel


travel = _travels(STAMP)
