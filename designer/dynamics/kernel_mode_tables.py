"""Compiled tables of the fast path of circuits: what ``dynamics.kernel_four_state`` multiplies.

Tables are made for each working mode of a board under a drive. z = (x, sin, cos, 1).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from designer.base.jit import callee, compiled
from designer.dynamics.kernel_algebra import spectral_radius
from designer.dynamics.kernel_crossing import BLOCK_STEP, LAST, NODES, PARTS, STEPS, TERMS
from designer.dynamics.kernel_orbit import DONE, LEFT

Float = NDArray[np.float64]
Int = NDArray[np.int64]

MODES = 8
"""Working modes that there may be."""
WATCH = 3
"""Boundaries that a mode may watch; after their rows come the four states', then the depth's."""
ROWS, DEPTH = WATCH + 5, WATCH + 4
FAR = 32
"""Boundaries that a mode may prove to be far."""
TAIL = 20
"""Terms of a bound about a time: the most that is left out is 1.4**20/20! = 3e-16 of it."""

# Columns of one mode's tables. z = (x, sin, cos, 1).
H, PART, PER, REST = 0, 1, 2, 3
RATE = 4
"""(7, 4) columns of M: x' = M z; then for each row (see ``ROWS``) SCAN, LOCAL and FOURTH."""
ROW = RATE + 28
SCAN = 0
"""(7, 2, NODES) value and rate at each node."""
LOCAL = 14 * NODES
"""(7, TERMS) Taylor coefficients."""
FOURTH = LOCAL + 7 * TERMS
"""(7,) moduli that bound the fourth derivative within a block."""
ROW_WIDTH = FOURTH + 8
JUMP = ROW + ROWS * ROW_WIDTH
"""(LAST + 1, 30) columns (7, 4) of the propagator, sine and cosine of the drive's turn."""
WAY = JUMP + 30 * (LAST + 1)
"""(7, 24) states at the inner nodes of a block."""
SECOND = WAY + 168
"""(7, 4) moduli that bound h²/8 |x''| within a block."""
LIMITS = SECOND + 28
"""(9, FAR) positive and negative part of each far boundary's C, and its constant."""
WIDTH = LIMITS + 9 * FAR

# Columns of one mode's integers: watched, far, side, then targets and whether contact begins there.
N_WATCH, N_FAR, SIDE, TARGET, BEGINS = 0, 1, 2, 3, 3 + WATCH
INTS = 3 + 2 * WATCH


class Modes(NamedTuple):
    """The working modes of N boards: K modes, the first holds at rest."""

    A: Float
    """(N, K, 4, 4) state matrices."""
    B: Float
    """(N, K, 4) input vectors."""
    d: Float
    """(N, K, 4) constant terms."""
    guard: Float
    """(N, K, G, 6) rows over (states, drive, 1), positive past the guard."""
    past: Float
    """(N, K, 6) row of the displacement past the stop in contact."""
    target: Int
    """(K, G) working mode beyond a guard of the circuit, or -1."""
    begins: Int
    """(K, G) 1 where contact begins or ends at a guard of the circuit."""
    guards: Int
    """(K,) how many guards a mode has."""
    side: Int
    """(K,) side of the stop in contact: 1 upper, -1 lower, 0 none."""


@callee
def _times(row: Float, M: Float, w: float, out: Float) -> None:
    """out (7,) = row · the (7, 7) generator whose upper rows are M (4, 7)."""
    for j in range(7):
        total = 0.0
        for k in range(4):
            total += row[k] * M[k, j]
        out[j] = total
    out[4] -= w * row[5]
    out[5] += w * row[4]


@callee
def _row(data: Float, o: int, row: Float, M: Float, w: float, jumps: Float) -> None:
    """Tables of the linear function row · z, at o."""
    h = data[H]
    work = np.zeros((2, 7))
    turn = np.zeros((2, 7))
    for j in range(7):
        work[0, j] = row[j]
    _times(row, M, w, work[1])
    for v in range(2):
        for k in range(NODES):
            _along(work[v], jumps[k * PARTS], turn[0])
            for j in range(7):
                data[o + SCAN + 2 * NODES * j + NODES * v + k] = turn[0, j]
    for j in range(7):
        turn[0, j] = row[j]
    for k in range(TERMS):
        for j in range(7):
            data[o + LOCAL + TERMS * j + k] = turn[0, j]
        _times(turn[0], M, w, turn[1])
        for j in range(7):
            turn[0, j] = turn[1, j] / (k + 1)
    bound = np.zeros(7)
    _moduli(row, M, w, jumps[LAST // 2], 4, 0.5 * STEPS * h, bound)
    for j in range(7):
        data[o + FOURTH + j] = bound[j]


@callee
def _along(row: Float, jump: Float, out: Float) -> None:
    """out = row · the (7, 7) propagator of a table line."""
    for j in range(7):
        total = 0.0
        for k in range(4):
            total += row[k] * jump[4 * j + k]
        out[j] = total
    out[4] += row[4] * jump[29] - row[5] * jump[28]
    out[5] += row[4] * jump[28] + row[5] * jump[29]
    out[6] += row[6]


@callee
def _moduli(
    row: Float, M: Float, w: float, jump: Float, order: int, half: float, bound: Float
) -> None:
    """bound (7,) ← at least an entrywise bound of |row · M^order · exp(M t)| within ``half`` of the
    time of ``jump``."""
    now, then, total = np.zeros(7), np.zeros(7), np.zeros(7)
    for j in range(7):
        now[j] = row[j]
    for _ in range(order):
        _times(now, M, w, then)
        for j in range(7):
            now[j] = then[j]
    _along(now, jump, then)
    for j in range(7):
        now[j] = then[j]
    for k in range(TAIL):
        for j in range(7):
            total[j] += abs(now[j])
        _times(now, M, w, then)
        for j in range(7):
            now[j] = then[j] * half / (k + 1)
    for j in range(7):
        bound[j] = max(bound[j], 1.001 * total[j])


@compiled
def fill(
    data: Float, ints: Int, modes: Modes, board: int, omega: float, amplitude: float, offset: float
) -> int:
    """Tables of each working mode of a board under a drive; DONE, or LEFT if they do not fit.

    data : (K, WIDTH); ints : (K, INTS).
    """
    M = np.zeros((4, 7))
    jumps = np.zeros((LAST + 1, 30))
    row, bound = np.zeros(7), np.zeros(7)
    for m in range(modes.A.shape[1]):
        for i in range(4):
            for j in range(4):
                M[i, j] = modes.A[board, m, i, j]
            M[i, 4] = amplitude * modes.B[board, m, i]
            M[i, 6] = modes.d[board, m, i] + offset * modes.B[board, m, i]
        table, number = data[m], ints[m]
        rate = max(spectral_radius(modes.A[board, m], 5), omega)
        if not (rate > 0.0 and rate < np.inf):
            return LEFT
        h = BLOCK_STEP / rate
        table[H], table[PART], table[PER] = h, h / PARTS, PARTS / h
        table[REST] = h * h * h * h / 288.0
        for j in range(7):
            for i in range(4):
                table[RATE + 4 * j + i] = M[i, j]
        _propagators(M, omega, h / PARTS, jumps)
        for k in range(LAST + 1):
            for j in range(30):
                table[JUMP + 30 * k + j] = jumps[k, j]
        for i in range(4):
            for j in range(7):
                row[j] = 1.0 if i == j else 0.0
            _row(table, ROW + (WATCH + i) * ROW_WIDTH, row, M, omega, jumps)
            for j in range(7):
                bound[j] = 0.0
            for k in range(STEPS):
                _moduli(row, M, omega, jumps[PARTS * k + PARTS // 2], 2, 0.5 * h, bound)
            for j in range(7):
                table[SECOND + 4 * j + i] = bound[j] * h * h / 8.0
                for k in range(STEPS - 1):
                    table[WAY + 24 * j + 4 * k + i] = jumps[PARTS * (k + 1), 4 * j + i]
        number[SIDE] = modes.side[m]
        number[N_WATCH] = number[N_FAR] = 0
        if modes.side[m] != 0:
            _over(modes.past[board, m], amplitude, offset, row)
            _row(table, ROW + DEPTH * ROW_WIDTH, row, M, omega, jumps)
        for g in range(modes.guards[m]):
            _over(modes.guard[board, m, g], amplitude, offset, row)
            if modes.target[m, g] >= 0:
                n = number[N_WATCH]
                if n == WATCH:
                    return LEFT
                _row(table, ROW + n * ROW_WIDTH, row, M, omega, jumps)
                number[TARGET + n] = modes.target[m, g]
                number[BEGINS + n] = modes.begins[m, g]
                number[N_WATCH] = n + 1
                continue
            n = number[N_FAR]
            if n == FAR:
                return LEFT
            for j in range(4):
                table[LIMITS + FAR * j + n] = max(row[j], 0.0)
                table[LIMITS + FAR * (4 + j) + n] = min(row[j], 0.0)
            table[LIMITS + FAR * 8 + n] = row[6] + abs(row[4])
            number[N_FAR] = n + 1
        for n in range(number[N_FAR], FAR):
            for j in range(8):
                table[LIMITS + FAR * j + n] = 0.0
            table[LIMITS + FAR * 8 + n] = -1.0
    return DONE


@callee
def _over(guard: Float, amplitude: float, offset: float, row: Float) -> None:
    """row (7,) over z of a row over (states, drive, 1)."""
    for j in range(4):
        row[j] = guard[j]
    row[4], row[5] = guard[4] * amplitude, 0.0
    row[6] = guard[5] + guard[4] * offset


@callee
def _propagators(M: Float, w: float, part: float, jumps: Float) -> None:
    """(LAST + 1, 30) the propagator over each number of parts; each from two of half its length."""
    column, other = np.zeros(7), np.zeros(7)
    for k in range(2):
        for j in range(7):
            for i in range(4):
                jumps[k, 4 * j + i] = 1.0 if i == j and k == 0 else 0.0
        jumps[k, 28], jumps[k, 29] = np.sin(k * part * w), np.cos(k * part * w)
    for i in range(4):  # row i of exp(M part), as a row of the identity carried along
        for j in range(7):
            column[j] = 1.0 if i == j else 0.0
        for k in range(14):
            for j in range(7):
                jumps[1, 4 * j + i] += column[j]
            _times(column, M, w, other)
            for j in range(7):
                column[j] = other[j] * part / (k + 1)
    for k in range(2, LAST + 1):
        a, b = jumps[k // 2], jumps[k - k // 2]
        for i in range(4):
            for j in range(7):
                total = 0.0
                for q in range(4):
                    total += a[4 * q + i] * b[4 * j + q]
                jumps[k, 4 * j + i] = total
            jumps[k, 16 + i] += a[16 + i] * b[29] - a[20 + i] * b[28]
            jumps[k, 20 + i] += a[16 + i] * b[28] + a[20 + i] * b[29]
            jumps[k, 24 + i] += a[24 + i]
        jumps[k, 28], jumps[k, 29] = np.sin(k * part * w), np.cos(k * part * w)
