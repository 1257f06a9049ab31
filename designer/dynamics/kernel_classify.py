"""Compiled naming of a motion: is it periodic, which orbit, how stable, how many impacts.

The rules are those of ``dynamics.attractors`` (near repetition, Newton, stable, near where the
motion had arrived, and drawing it in); the linear algebra is of size four and stands here. As in
``dynamics.kernel_sweep`` the compiled cache is keyed by the files whose functions are called.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from designer.base.jit import compiled
from designer.dynamics import kernel_modal, kernel_sweep
from designer.dynamics.kernel_modal import DONE, STATE, TOO_MANY_EVENTS, WIDTH, ModalTables, advance
from designer.dynamics.kernel_sweep import exponent, mode_of, stamp_of

Float = NDArray[np.float64]
Int = NDArray[np.int64]

PERIODIC, APERIODIC, NOT_SETTLED, CHATTER, DIVERGED = 0, 1, 2, 3, 4
"""What ``classify`` answers."""
SPAN = 200
"""Periods that an exponent has to be taken over before it is believed to be chaos."""
CHAOS, NEAR, CLOSING, STROBE, GAP = 0.02, 0.05, 400, 1e-8, 1e-2
"""The rules of ``dynamics.attractors``, whose constants a test compares with these."""
LONGEST = 16
MORE = 300
"""Periods of a further attempt."""

STAMP = stamp_of(kernel_modal, kernel_sweep)


@compiled
def _solve(M: Float, r: Float) -> bool:
    """r (4,) ← M⁻¹ r by elimination with row exchange; M (4, 4) is spent. False: singular."""
    for j in range(4):
        best = j
        for i in range(j + 1, 4):
            if abs(M[i, j]) > abs(M[best, j]):
                best = i
        if not (abs(M[best, j]) > 0.0):
            return False
        for i in range(4):
            M[j, i], M[best, i] = M[best, i], M[j, i]
        r[j], r[best] = r[best], r[j]
        for i in range(j + 1, 4):
            f = M[i, j] / M[j, j]
            r[i] -= f * r[j]
            for k in range(j, 4):
                M[i, k] -= f * M[j, k]
    for j in range(3, -1, -1):
        for k in range(j + 1, 4):
            r[j] -= M[j, k] * r[k]
        r[j] /= M[j, j]
    return True


@compiled
def _radius(M: Float) -> float:
    """Spectral radius of M (4, 4), as ‖M^(2^k)‖^(1/2^k) for k = 30."""
    A = M.copy()
    B = np.empty((4, 4))
    log, weight = 0.0, 1.0
    for _ in range(31):
        size = 0.0
        for i in range(4):
            for j in range(4):
                size = max(size, abs(A[i, j]))
        if not (size > 0.0):
            return 0.0
        log += weight * np.log(size)
        weight *= 0.5
        for i in range(4):
            for j in range(4):
                A[i, j] /= size
        for i in range(4):
            for j in range(4):
                total = 0.0
                for k in range(4):
                    total += A[i, k] * A[k, j]
                B[i, j] = total
        for i in range(4):
            for j in range(4):
                A[i, j] = B[i, j]
    return float(np.exp(log))


def _laps(stamp: int) -> Callable[..., Any]:
    @compiled
    def lap(
        tables: ModalTables, x: Float, period: float, phi: Float, max_events: int, laps: Float,
        counts: Int,
    ) -> int:  # fmt: skip
        """``advance`` from x, whose mode follows from it; laps (n + 1, 4) with the start too."""
        if stamp == 0:
            return DONE
        place = np.array([mode_of(tables.data, x), 0], dtype=np.int64)
        for i in range(4):
            laps[0, i] = x[i]
        return advance(tables, x.copy(), place, period, phi, max_events, laps, counts)

    return lap


_lap = _laps(STAMP)


def _shoots(stamp: int) -> Callable[..., Any]:
    @compiled
    def shoot(
        tables: ModalTables, x: Float, n: int, period: float, max_events: int, peak: Float,
        monodromy: Float, spent: Int,
    ) -> bool:  # fmt: skip
        """Newton's method on the n-period map: ``attractors.shoot``; x and monodromy are
        written."""
        if stamp == 0:
            return False
        laps = np.empty((n + 1, 4))
        counts = np.empty((n, 2), dtype=np.int64)
        step, M = np.empty(4), np.empty((4, 4))
        last = np.inf
        for _ in range(8):
            monodromy[:, :] = 0.0
            for i in range(4):
                monodromy[i, i] = 1.0
            spent[0] += n
            if _lap(tables, x, period, monodromy, max_events, laps, counts) != DONE:
                return False
            error = 0.0
            for i in range(4):
                step[i] = laps[n, i] - x[i]
                error = max(error, abs(step[i]) / peak[i])
                for j in range(4):
                    M[i, j] = monodromy[i, j]
                M[i, i] -= 1.0
            if error < 1e-11 or (error < 1e-9 and error >= 0.5 * last):
                return True
            if not _solve(M, step):
                return False
            for i in range(4):
                x[i] -= step[i]
                if not (abs(x[i]) < 1e6 * (peak[0] + peak[1] + peak[2] + peak[3])):
                    return False
            last = error
        return False

    return shoot


_shoot = _shoots(STAMP)


@compiled
def _apart(a: Float, b: Float, peak: Float) -> float:
    """Largest difference of two states (4,) relative to each state's peak."""
    out = 0.0
    for i in range(4):
        out = max(out, abs(a[i] - b[i]) / peak[i])
    return float(out)


def _polishes(stamp: int) -> Callable[..., Any]:
    @compiled
    def polish(
        tables: ModalTables, strobes: Float, period: float, max_events: int, peak: Float,
        orbit: Float, facts: Float, counted: Int,
    ) -> bool:  # fmt: skip
        """Try to turn the end of a run, strobes (k, 4), into a periodic orbit.

        orbit : (4,) a strobe of it; facts : (2,) spectral radius, and largest |x(nT/2) + x(0)| over
        the peak (nan for even n); counted : (4,) n, p, q, and periods spent (added to).
        """
        if stamp == 0:
            return False
        k = strobes.shape[0] - 1
        end = strobes[k]
        monodromy = np.empty((4, 4))
        nothing = np.zeros((0, 0))
        spent = np.zeros(1, dtype=np.int64)
        for n in range(1, min(LONGEST, k) + 1):
            if _apart(end, strobes[k - n], peak) > GAP:
                continue
            for i in range(4):
                orbit[i] = end[i]
            if not _shoot(tables, orbit, n, period, max_events, peak, monodromy, spent):
                counted[3] += spent[0]
                spent[0] = 0
                continue
            laps = np.empty((3 * n + 1, 4))
            counts = np.zeros((3 * n, 2), dtype=np.int64)
            code = _lap(tables, orbit, period, nothing, max_events, laps, counts)
            counted[3] += spent[0] + 3 * n
            spent[0] = 0
            least, fine = n, code == DONE
            for d in range(1, n):
                if n % d == 0 and least == n and _apart(laps[d], orbit, peak) <= STROBE:
                    least = d
            for j in range(3 * n + 1):
                fine = fine and _apart(laps[j], laps[j % least], peak) <= STROBE
            radius = _radius(monodromy) ** (least / n)
            if not fine or not (radius < 1.0) or _apart(orbit, end, peak) >= NEAR:
                continue
            before = _apart(end, orbit, peak)
            if before > STROBE:  # does the trajectory itself go there? A passing one leaves
                turns = int(np.log(1e-4) / np.log(max(radius ** (n / least), 1e-3)))
                turns = max(2, min(turns, CLOSING // n))
                later = np.empty((turns * n + 1, 4))
                more = np.empty((turns * n, 2), dtype=np.int64)
                code = _lap(tables, end, period, nothing, max_events, later, more)
                counted[3] += turns * n
                left = 10.0 * radius ** (turns * n / least) * before
                if code != DONE or _apart(later[turns * n], orbit, peak) > max(left, STROBE):
                    continue
            lower = upper = 0
            for j in range(3 * n):
                lower += counts[j, 0]
                upper += counts[j, 1]
            over = 3 * n // least
            counted[0], counted[1] = least, int(upper / over + 0.5)
            counted[2] = int(lower / over + 0.5)
            facts[0], facts[1] = radius, np.nan
            if least % 2 == 1:
                half, data = 0.5 * least * period, tables.data
                place = np.array([mode_of(data, orbit), 0], dtype=np.int64)
                advance(
                    tables, orbit.copy(), place, half, nothing, max_events, laps[:2], counts[:1]
                )
                for i in range(4):  # it ends with the drive's cosine at 1, and here that is -1
                    laps[1, i] -= 2.0 * data[place[0] * WIDTH + STATE + 20 + i]
                facts[1] = _apart(-laps[1], orbit, peak)
            return True
        return False

    return polish


_polish = _polishes(STAMP)


def _classifies(stamp: int) -> Callable[..., Any]:
    @compiled
    def classify(
        tables: ModalTables, strobes: Float, period: float, max_events: int, patience: int,
        growth: float, span: int, peak: Float, orbit: Float, facts: Float, counted: Int,
    ) -> int:  # fmt: skip
        """What the motion at the end of strobes (k, 4) is: PERIODIC … DIVERGED.

        growth : of a tangent vector per period over ``span`` periods. patience : periods that may
        be added where it is neither periodic nor chaotic. orbit, facts (3,), counted : as
        ``_polish``; facts[2] the growth per period, of the orbit where there is one.
        """
        if stamp == 0:
            return NOT_SETTLED
        if _polish(tables, strobes, period, max_events, peak, orbit, facts, counted):
            facts[2] = np.log(max(facts[0], 1e-300)) / counted[0]
            return PERIODIC
        facts[2] = growth
        x = strobes[strobes.shape[0] - 1].copy()
        for i in range(4):
            orbit[i] = x[i]
        if span >= SPAN and growth > CHAOS:
            return APERIODIC
        place = np.array([mode_of(tables.data, x), 0], dtype=np.int64)
        tail = np.empty((2 * LONGEST + 1, 4))
        counts = np.empty((2 * LONGEST, 2), dtype=np.int64)
        added = 0
        while added + MORE + 2 * LONGEST <= patience:
            growth = exponent(tables, x, place, period, max_events, MORE)
            if place[1] != DONE:
                return CHATTER if place[1] == TOO_MANY_EVENTS else DIVERGED
            nothing = np.zeros((0, 0))
            code = _lap(tables, x, period, nothing, max_events, tail, counts)
            if code != DONE:
                return CHATTER if code == TOO_MANY_EVENTS else DIVERGED
            added += MORE + 2 * LONGEST
            counted[3] += MORE + 2 * LONGEST
            if _polish(tables, tail, period, max_events, peak, orbit, facts, counted):
                facts[2] = np.log(max(facts[0], 1e-300)) / counted[0]
                return PERIODIC
            facts[2] = growth
            for i in range(4):
                x[i] = tail[2 * LONGEST, i]
                orbit[i] = x[i]
            place[0] = mode_of(tables.data, x)
            if growth > CHAOS:
                return APERIODIC
        return NOT_SETTLED

    return classify


classify = _classifies(STAMP)
