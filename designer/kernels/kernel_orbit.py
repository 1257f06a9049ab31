"""Compiled rules of a periodic orbit: near repetition, Newton's method, acceptance, counting.

These are the rules of ``dynamics.attractors``, in the same order, for n states and C clearances.
They do not know what carries the state: that is ``lap``, a compiled function

    lap(system, x, cursor, phi, strobes, impacts) -> code

which carries x (n,), at drive phase 0, over the drive periods of ``strobes`` (periods + 1, n) in
the mode cursor[0] (-1: the one that holds at x), writes ``strobes`` with the start, ``impacts``
(periods, 2 C), lower and upper of each clearance, and the mode that it ends in, and carries the
tangent vectors phi (n, k). cursor is (CURSOR,).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from designer.base.jit import callee, leaf
from designer.kernels.kernel_algebra import factor, spectral_radius, substitute

Float = NDArray[np.float64]
Int = NDArray[np.int64]
Lap = Callable[..., int]

DONE, LEFT, TOO_MANY_EVENTS, DIVERGED, PAUSED, UNKNOWN_MODE = range(6)
"""Return codes of every flow; LEFT: the fast path does not fit here; the last two are the general
kernel's: no steps left, a mode that has no tables yet."""
FOUND, NONE, UNDECIDED = 0, 1, 2
"""Answers of ``shoot`` and ``polish``; UNDECIDED: the flow does not know its way."""
MAX_PERIOD = 16
"""Longest period that is looked for, in drive periods."""
STROBE_TOLERANCE = 1e-8
"""Of the peak of each state (docs/definitions.md)."""
WORTH = 1e-2
"""Of the peak: how nearly a strobe must repeat to be worth polishing."""
NEAR = 0.05
"""Of the peak: how far a polished orbit may lie from where settling had arrived."""
CLOSING = 400
"""Most periods that are spent on seeing the settling trajectory close in on a polished orbit."""
CHAOS = 0.02
"""Growth of a tangent vector per drive period that is taken for chaos."""
SPENT, UPPER, LOWER = 1, 2, 3
"""Places in ``counted`` (2 + 2 C,), after n: drive periods spent, then the impacts on the upper and
the lower stop of each clearance."""
CURSOR = 4
"""Places in the cursor of a run: its mode, and three that are the flow's own."""


@leaf
def distance(a: Float, b: Float, peak: Float) -> float:
    """Largest difference of two states (n,), each relative to the state's peak."""
    most = 0.0
    for i in range(len(peak)):
        most = max(most, abs(a[i] - b[i]) / peak[i])
    return float(most)


@callee
def count_impacts(strobes: Float, impacts: Int, n: int, peak: Float, counted: Int) -> bool:
    """counted ← n and the impacts of an orbit by some laps of n periods; False if the strobe
    drifts."""
    periods = impacts.shape[0]
    for k in range(periods + 1):
        if not distance(strobes[k], strobes[k % n], peak) <= STROBE_TOLERANCE:
            return False
    laps = float(periods // n)
    counted[0] = n
    for c in range(impacts.shape[1] // 2):
        lower, upper = 0, 0
        for k in range(periods):
            lower, upper = lower + impacts[k, 2 * c], upper + impacts[k, 2 * c + 1]
        counted[UPPER + 2 * c], counted[LOWER + 2 * c] = (
            int(upper / laps + 0.5), int(lower / laps + 0.5),
        )  # fmt: skip
    return True


def polisher(lap: Lap) -> Callable[..., int]:
    """The compiled ``polish`` of a flow that is carried by ``lap``."""

    @callee
    def shoot(
        system: Any, x: Float, n: int, peak: Float, monodromy: Float, columns: int
    ) -> int:  # fmt: skip
        """``attractors.shoot``: x, monodromy ← a fixed point of the n-period map, its matrix.

        columns : of the impacts, 2 C.
        """
        size, last = len(x), np.inf
        strobes, impacts = np.zeros((n + 1, size)), np.zeros((n, columns), dtype=np.int64)
        cursor, order = np.zeros(CURSOR, dtype=np.int64), np.zeros(size, dtype=np.int64)
        matrix = np.zeros((size, size))
        step, change = np.zeros((size, 1)), np.zeros((size, 1))
        for _ in range(8):
            for i in range(size):
                for j in range(size):
                    monodromy[i, j] = 1.0 if i == j else 0.0
            cursor[0] = -1
            code = lap(system, x, cursor, monodromy, strobes, impacts)
            if code != DONE:
                # A step that leads far away leads to no orbit near the start.
                return UNDECIDED if code == UNKNOWN_MODE else NONE
            error = 0.0
            for i in range(size):
                step[i, 0] = strobes[n, i] - x[i]
                error = max(error, abs(step[i, 0]) / peak[i])
                for j in range(size):
                    matrix[i, j] = monodromy[i, j] - (1.0 if i == j else 0.0)
            if error < 1e-11 or (error < 1e-9 and error >= 0.5 * last):
                return FOUND
            if not factor(matrix, order) > 0.0:
                return NONE
            substitute(matrix, order, step, change)
            largest = 0.0
            for i in range(size):
                largest = max(largest, peak[i])
            for i in range(size):
                x[i] -= change[i, 0]
                if not abs(x[i]) <= 1e6 * largest:
                    return NONE
            last = error
        return NONE

    @callee
    def least_period(
        system: Any, x: Float, n: int, peak: Float, columns: int
    ) -> int:  # fmt: skip
        """The smallest divisor of n after which the strobe repeats; 0 where the run ends early, -1
        where the flow was LEFT or met an UNKNOWN_MODE."""
        strobes, impacts = np.zeros((n + 1, len(x))), np.zeros((n, columns), dtype=np.int64)
        cursor = np.zeros(CURSOR, dtype=np.int64)
        cursor[0] = -1
        code = lap(system, x, cursor, np.zeros((0, 0)), strobes, impacts)
        if code != DONE:
            return -1 if code in (LEFT, UNKNOWN_MODE) else 0
        for d in range(1, n):
            if n % d == 0 and distance(strobes[d], x, peak) <= STROBE_TOLERANCE:
                return d
        return n

    @callee
    def after_periods(
        system: Any, end: Float, mode: int, periods: int, x: Float, peak: Float, columns: int
    ) -> float:  # fmt: skip
        """Distance from x after these periods from ``end``; infinite where the run ends early, -1
        where the flow was LEFT or met an UNKNOWN_MODE."""
        strobes = np.zeros((periods + 1, len(x)))
        impacts, cursor = (
            np.zeros((periods, columns), dtype=np.int64), np.zeros(CURSOR, dtype=np.int64),
        )  # fmt: skip
        cursor[0] = mode
        code = lap(system, end, cursor, np.zeros((0, 0)), strobes, impacts)
        if code != DONE:
            return -1.0 if code in (LEFT, UNKNOWN_MODE) else np.inf
        return float(distance(strobes[periods], x, peak))

    @callee
    def polish(
        system: Any, strobes: Float, mode: int, peak: Float, x: Float, monodromy: Float,
        counted: Int,
    ) -> int:  # fmt: skip
        """Try to turn the end of a run, ``strobes`` in the mode ``mode``, into a stable orbit.

        x, monodromy ← a strobe of it and its matrix; counted[0] ← its period, counted[SPENT] plus
        the drive periods that this is charged.
        """
        k, columns = strobes.shape[0] - 1, len(counted) - UPPER
        end = strobes[k]
        for n in range(1, min(MAX_PERIOD, k) + 1):
            if not distance(end, strobes[k - n], peak) <= WORTH:
                continue
            for i in range(len(x)):
                x[i] = end[i]
            code = shoot(system, x, n, peak, monodromy, columns)
            least = n
            counted[SPENT] += 8 * n
            if code == FOUND and n > 1:
                least = least_period(system, x, n, peak, columns)
                if least < 1:
                    code = NONE if least == 0 else UNDECIDED
                elif least < n:
                    code = shoot(system, x, least, peak, monodromy, columns)
            if code == UNDECIDED:
                return UNDECIDED
            before = distance(end, x, peak)
            if code == NONE or before >= NEAR:
                continue
            radius = spectral_radius(monodromy, 48)
            if not radius < 1.0:
                continue
            turns = int(np.log(1e-4) / np.log(max(radius, 1e-3)))
            turns = min(max(turns, 2), CLOSING // n)
            counted[SPENT] += turns * n
            if before > STROBE_TOLERANCE:  # does the motion itself go there? A passing one leaves
                after = after_periods(system, end, mode, turns * n, x, peak, columns)
                if after < 0.0:
                    return UNDECIDED
                if not after <= max(10.0 * radius**turns * before, STROBE_TOLERANCE):
                    continue
            counted[0] = least
            counted[SPENT] += 5 * n
            return FOUND
        return NONE

    return polish
