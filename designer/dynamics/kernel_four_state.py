"""Compiled fast path of circuits: four states, a few working modes, every other boundary far away.

In a working mode (no contact, in contact, and what lies between) the state moves in blocks of seven
steps. For each boundary to another working mode its distance and rate at the block's eight nodes
are one product with the state; that it is not crossed within a step is proved by the cubic Hermite
interpolant and a bound of the fourth derivative, or it is bisected. The other boundaries (outputs
at their limits, diodes of the other half) are proved to be far: over the box that the states kept
to, no such guard comes near zero. Where that proof fails the run is given up, and the general
kernel (``dynamics.kernel_general``), which this must equal, does it.

Everything that these functions call stands in this file, or a stale compiled cache would survive
an edit. All sums are plain loops, so a board's answer has the same bytes wherever it is computed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from designer.base.jit import compiled

Float = NDArray[np.float64]
Int = NDArray[np.int64]

DONE, LEFT, TOO_MANY_EVENTS, DIVERGED = 0, 1, 2, 3
"""Return codes; LEFT: a boundary that was to be far may not be."""
STEP = 0.4
"""h · max(|lambda|, omega)."""
STEPS, PARTS, TERMS = 7, 8, 8
"""Steps of a block; tabulated parts of a step; Taylor terms about a part (1/40)**8/8! is 4e-18."""
NODES, LAST = STEPS + 1, STEPS * PARTS
WATCH = 3
"""Boundaries that a mode may watch; after their rows come the four states', then the depth's."""
ROWS, DEPTH = WATCH + 5, WATCH + 4
FAR = 32
"""Boundaries that a mode may prove to be far."""
TAIL = 20
"""Terms of a bound about a time: the most that is left out is 1.4**20/20! = 3e-16 of it."""
FINEST = 1e-10
"""Of a step: below it an undecided tangency is taken for none."""
TANGENCY = 1e-13

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

# Places in the scratch array.
Z, POINT, COEF, F, D, LOW, STACK = 0, 8, 16, 24, 32, 48, 128
ROOM = 84
WORK = STACK + 6 * (ROOM + 2)
MODES = 8
"""Working modes that there may be: LOW has room for eight numbers each."""

POINTS = 128
"""Of an orbit per drive period, for its asymmetry and its waveform."""
LONGEST = 4
"""Longest period that ``respond`` polishes; longer ones are left to the caller."""
IMPACTS = 512


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


# -------------------------------------------------------------------------------------------------
# Tables


@compiled
def _rate(A: Float) -> float:
    """The largest modulus of an eigenvalue, within a few per cent: ‖A³²‖ to the power 1/32."""
    square, scale = A.copy(), 0.0
    other = np.zeros((4, 4))
    for turn in range(6):
        size = 0.0
        for i in range(4):
            for j in range(4):
                size += square[i, j] * square[i, j]
        size = np.sqrt(size)
        if not (size > 0.0 and size < np.inf):
            return 0.0
        scale += np.log(size) / 2.0**turn
        if turn == 5:
            break
        for i in range(4):
            for j in range(4):
                square[i, j] /= size
        for i in range(4):
            for j in range(4):
                total = 0.0
                for k in range(4):
                    total += square[i, k] * square[k, j]
                other[i, j] = total
        for i in range(4):
            for j in range(4):
                square[i, j] = other[i, j]
    return float(np.exp(scale))


@compiled
def _times(row: Float, M: Float, w: float, out: Float) -> None:
    """out (7,) = row · the (7, 7) generator whose upper rows are M (4, 7)."""
    for j in range(7):
        total = 0.0
        for k in range(4):
            total += row[k] * M[k, j]
        out[j] = total
    out[4] -= w * row[5]
    out[5] += w * row[4]


@compiled
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
    for j in range(7):
        work[0, j] = 0.0
    _moduli(row, M, w, jumps[LAST // 2], 4, 0.5 * STEPS * h, work)
    for j in range(7):
        data[o + FOURTH + j] = work[0, j]


@compiled
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


@compiled
def _moduli(
    row: Float, M: Float, w: float, jump: Float, order: int, half: float, work: Float
) -> None:
    """work[0] ← at least an entrywise bound of |row · M^order · exp(M t)| within ``half`` of the
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
        work[0, j] = max(work[0, j], 1.001 * total[j])


@compiled
def fill(
    data: Float, ints: Int, modes: Modes, board: int, omega: float, amplitude: float, offset: float
) -> int:
    """Tables of each working mode of a board under a drive; DONE, or LEFT if they do not fit.

    data : (K, WIDTH); ints : (K, INTS).
    """
    M = np.zeros((4, 7))
    jumps = np.zeros((LAST + 1, 30))
    row = np.zeros(7)
    work = np.zeros((2, 7))
    for m in range(modes.A.shape[1]):
        for i in range(4):
            for j in range(4):
                M[i, j] = modes.A[board, m, i, j]
            M[i, 4] = amplitude * modes.B[board, m, i]
            M[i, 6] = modes.d[board, m, i] + offset * modes.B[board, m, i]
        table, number = data[m], ints[m]
        rate = max(_rate(modes.A[board, m]), omega)
        if not (rate > 0.0 and rate < np.inf):
            return LEFT
        h = STEP / rate
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
                work[0, j] = 0.0
            for k in range(STEPS):
                _moduli(row, M, omega, jumps[PARTS * k + PARTS // 2], 2, 0.5 * h, work)
            for j in range(7):
                table[SECOND + 4 * j + i] = work[0, j] * h * h / 8.0
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


@compiled
def _over(guard: Float, amplitude: float, offset: float, row: Float) -> None:
    """row (7,) over z of a row over (states, drive, 1)."""
    for j in range(4):
        row[j] = guard[j]
    row[4], row[5] = guard[4] * amplitude, 0.0
    row[6] = guard[5] + guard[4] * offset


@compiled
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


# -------------------------------------------------------------------------------------------------
# Motion within a mode


@compiled
def _jump(table: Float, part: int, work: Float) -> None:
    """POINT = z ``part`` parts after Z."""
    o = JUMP + 30 * (part & 63)
    a, b, c, d = work[Z], work[Z + 1], work[Z + 2], work[Z + 3]
    s, q = work[Z + 4], work[Z + 5]
    for i in range(4):
        free = table[o + i] * a + table[o + 4 + i] * b
        held = table[o + 16 + i] * s + table[o + 20 + i] * q + table[o + 24 + i]
        work[POINT + i] = free + (table[o + 8 + i] * c + table[o + 12 + i] * d) + held
    work[POINT + 4] = s * table[o + 29] + q * table[o + 28]
    work[POINT + 5] = q * table[o + 29] - s * table[o + 28]


@compiled
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


@compiled
def _value(work: Float, s: float) -> tuple[float, float, float]:
    """Value, rate and half the second derivative a time s from the expanded part."""
    f = work[COEF + TERMS - 1]
    d = e = 0.0
    for k in range(TERMS - 2, -1, -1):
        e = e * s + d
        d = d * s + f
        f = f * s + work[COEF + k]
    return f, d, e


@compiled
def _carry(table: Float, part: int, phi: Float) -> None:
    """phi (4, k) ← ``part`` parts on."""
    o = JUMP + 30 * (part & 63)
    for j in range(phi.shape[1]):
        a, b, c, d = phi[0, j], phi[1, j], phi[2, j], phi[3, j]
        for i in range(4):
            phi[i, j] = table[o + i] * a + table[o + 4 + i] * b
            phi[i, j] += table[o + 8 + i] * c + table[o + 12 + i] * d


@compiled
def _move(table: Float, t: float, work: Float, phi: Float) -> None:
    """Z ← the state a time t on, 0 <= t <= STEPS · h; phi ← its tangent vectors."""
    part = int(t * table[PER] + 0.5)
    _jump(table, part, work)
    s = t - part * table[PART]
    # Terms of the Taylor series, each M s/k times the one before.
    v0, v1, v2, v3 = work[POINT], work[POINT + 1], work[POINT + 2], work[POINT + 3]
    sn, cs, one = work[POINT + 4], work[POINT + 5], 1.0
    x0, x1, x2, x3, y4, y5 = v0, v1, v2, v3, sn, cs
    o = RATE
    w = work[Z + 7]
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
    work[Z], work[Z + 1], work[Z + 2], work[Z + 3] = x0, x1, x2, x3
    work[Z + 4], work[Z + 5] = y4, y5
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


@compiled
def _scan(table: Float, r: int, work: Float) -> float:
    """F, D = value and rate of row r at the nodes; a bound of its fourth derivative."""
    o = ROW + (r & 7) * ROW_WIDTH
    a, b, c, d, s, q = work[Z], work[Z + 1], work[Z + 2], work[Z + 3], work[Z + 4], work[Z + 5]
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


@compiled
def _suspect(table: Float, m4: float, count: int, work: Float, k: int) -> int:
    """First step from k on, below count, in which the row is not proved to stay at or below 0.

    With end values at or below 0 and both middle Bernstein coefficients at least r below, the
    distance is at least 3 r s (1 - s) - M4 h⁴/24 s² (1 - s)² >= 0 for r = M4 h⁴/288.
    """
    third, rest = table[H] / 3.0, m4 * table[REST]
    while k < count:
        i = F + (k & 7)
        end = work[i + 1]
        b1, b2 = work[i] + third * work[i + NODES], end - third * work[i + NODES + 1]
        if not (b1 <= -rest and b2 <= -rest and end <= -rest):
            break
        k += 1
    return k


@compiled
def _crossing(table: Float, r: int, k: int, m4: float, work: Float, graze: Float) -> float:
    """First time in step k at which row r rises through 0, or -1."""
    h = table[H]
    k &= 7
    # Rows of the stack: a, b, f(a), f'(a), f(b), f'(b).
    work[STACK], work[STACK + 1] = k * h, (k + 1) * h
    work[STACK + 2], work[STACK + 3] = work[F + k], work[D + k]
    work[STACK + 4], work[STACK + 5] = work[F + k + 1], work[D + k + 1]
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
            return _newton(table, r, o, work)
        if max(max(da, db), middle) + slack < 0.0:
            continue
        nothing = max(max(abs(fa), abs(b1)), max(abs(b2), abs(fb))) + rest < TANGENCY
        if w < FINEST * h or nothing or top + 2 >= ROOM:
            if abs(fa) < TANGENCY:
                graze[2] += 1.0
            continue
        t = 0.5 * (a + b)
        f, d, _ = _value(work, t - _expand(table, r, t, work))
        work[o], work[o + 1] = t, b
        work[o + 2], work[o + 3], work[o + 4], work[o + 5] = f, d, fb, db
        work[o + 6], work[o + 7] = a, t
        work[o + 8], work[o + 9], work[o + 10], work[o + 11] = fa, da, f, d
        top += 2
    return -1.0


@compiled
def _newton(table: Float, r: int, o: int, work: Float) -> float:
    """Root in the interval at o, where the row rises: the cubic's, then the Taylor polynomial's."""
    a, b, fa, da = work[o], work[o + 1], work[o + 2], work[o + 3]
    fb, db = work[o + 4], work[o + 5]
    h = table[H]
    w = b - a
    s = fa / (fa - fb)
    c2 = 3.0 * (fb - fa) - w * (2.0 * da + db)
    c3 = 2.0 * (fa - fb) + w * (da + db)
    for _ in range(2):
        s -= (fa + s * (w * da + s * (c2 + s * c3))) / (w * da + s * (2.0 * c2 + 3.0 * s * c3))
    t = a + min(max(s, 0.0), 1.0) * w
    for _ in range(60):
        f, d, e = _value(work, t - _expand(table, r, t, work))
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
def _turns(table: Float, r: int, end: float, m4: float, work: Float, found: Float) -> int:
    """Values of row r where it turns within [0, end], and whether it falls there; how many.

    F and D hold its nodes. found : (2, k) values, and 1.0 where the turn is a greatest value.
    """
    h, count, k = table[H], 0, 0
    while k < STEPS and k * h < end:
        work[STACK], work[STACK + 1] = k * h, min((k + 1) * h, end)
        work[STACK + 2], work[STACK + 3] = work[F + k], work[D + k]
        if work[STACK + 1] < end or end >= (k + 1) * h:
            work[STACK + 4], work[STACK + 5] = work[F + k + 1], work[D + k + 1]
        else:
            f, d, _ = _value(work, end - _expand(table, r, end, work))
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
                low, high = a, b
                t = a + w * da / (da - db)
                for _ in range(60):
                    f, d, e = _value(work, t - _expand(table, r, t, work))
                    low, high = (t, high) if (d > 0.0) == (da > 0.0) else (low, t)
                    u = t - 0.5 * d / e
                    if not (low <= u <= high):
                        u = 0.5 * (low + high)
                    near = abs(u - t) < 1e-9 * h
                    t = u
                    if near:
                        break
                f, d, e = _value(work, t - _expand(table, r, t, work))
                if count < found.shape[1]:
                    found[0, count], found[1, count] = f, 1.0 if da > 0.0 else 0.0
                    count += 1
                continue
            if w < h / 256.0 or top + 2 >= ROOM:
                continue
            t = 0.5 * (a + b)
            f, d, _ = _value(work, t - _expand(table, r, t, work))
            work[o], work[o + 1] = t, b
            work[o + 2], work[o + 3], work[o + 4], work[o + 5] = f, d, fb, db
            work[o + 6], work[o + 7] = a, t
            work[o + 8], work[o + 9], work[o + 10], work[o + 11] = fa, da, f, d
            top += 2
    return count


# -------------------------------------------------------------------------------------------------
# The flow


@compiled
def _keep(low: int, work: Float, at: int, slack: float, reach: Float) -> None:
    """Widen the box of a mode by the state at ``at``, give or take a part of ``reach``."""
    for j in range(4):
        x, more = work[at + j], slack * reach[j]
        work[low + j] = min(work[low + j], x - more)
        work[low + 4 + j] = max(work[low + 4 + j], x + more)


@compiled
def _watch(table: Float, m: int, end: float, work: Float, reach: Float) -> None:
    """Widen the box of mode m by the motion over [0, end], whose end is not in it yet."""
    low = LOW + 8 * (m & 7)
    for i in range(4):
        total = 0.0
        for j in range(6):
            total += table[SECOND + 4 * j + i] * abs(work[Z + j])
        reach[i] = total + table[SECOND + 24 + i]
    share = min(end / table[H], 1.0)
    _keep(low, work, Z, share * share, reach)
    if end > table[H]:
        a, b, c, d, s, q = work[Z], work[Z + 1], work[Z + 2], work[Z + 3], work[Z + 4], work[Z + 5]
        for k in range(24):
            i = WAY + k
            first = table[i] * a + table[i + 24] * b
            second = table[i + 48] * c + table[i + 72] * d
            held = table[i + 96] * s + table[i + 120] * q + table[i + 144]
            work[STACK + k] = first + second + held
        for k in range(STEPS - 1):
            if (k + 1) * table[H] < end:
                _keep(low, work, STACK + 4 * k, 1.0, reach)


@compiled
def _far(data: Float, work: Float) -> bool:
    """Whether no far boundary comes near over the boxes, which are then emptied."""
    for m in range(data.shape[0]):
        low = LOW + 8 * (m & 7)
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
        for j in range(4):
            work[low + j], work[low + 4 + j] = np.inf, -np.inf
    return True


@compiled
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


@compiled
def _note(
    table: Float, number: Int, end: float, work: Float, trail: RunTrail, found: Float
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
        count = _turns(table, r, end, m4, work, found)
        if depth:
            deepest = first
            for k in range(count):
                deepest = max(deepest, found[0, k])
        elif state >= 0:
            low = high = first
            for k in range(count):
                low, high = min(low, found[0, k]), max(high, found[0, k])
            trail.extremes[state, 0] = min(trail.extremes[state, 0], low)
            trail.extremes[state, 1] = max(trail.extremes[state, 1], high)
        else:
            for k in range(count):
                if found[1, k] > 0.0 and found[0, k] < 0.0:
                    trail.graze[1] = min(trail.graze[1], -found[0, k])
    return float(deepest)


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

    cursor : (3,) mode and stretches done, both written, and 1 to measure. drive : omega, period,
    most events in a stretch. anchor : (stretches a period, 2) the drive's sine and cosine at the
    start of each. impacts : (stretches, 2) lower, upper, added to. phi : (4, k) tangent vectors,
    (0, 0) for none.
    """
    m, measure = cursor[0], cursor[2] == 1
    omega, stretch = drive[0], drive[1] / anchor.shape[0]
    work = np.zeros(WORK)
    reach = np.zeros(4)
    found = np.zeros((2, 32))
    for i in range(4):
        work[Z + i] = x[i]
        strobes[0, i] = x[i]
    work[Z + 4], work[Z + 5], work[Z + 6], work[Z + 7] = 0.0, 1.0, 1.0, omega
    for k in range(MODES):
        for j in range(4):
            work[LOW + 8 * k + j], work[LOW + 8 * k + 4 + j] = np.inf, -np.inf
    t, events, done, code = 0.0, 0, 0, DONE
    depth = np.inf if ints[m, SIDE] != 0 else 0.0
    while done < strobes.shape[0] - 1 and code == DONE:
        table, number = data[m], ints[m]
        h = table[H]
        left = stretch - t
        count = min(STEPS, int(left / h) + 1)
        first, through = -1.0, -1
        for r in range(number[N_WATCH]):
            m4 = _scan(table, r, work)
            k = _suspect(table, m4, count, work, 0)
            while k < count:
                time = _crossing(table, r, k, m4, work, trail.graze)
                if time >= 0.0:
                    if first < 0.0 or time < first:
                        first, through = time, r
                        count = min(count, int(time / h) + 1)
                    break
                k = _suspect(table, m4, count, work, k + 1)
        crossed = 0.0 <= first <= left
        end = first if crossed else min(left, STEPS * h)
        whole = not crossed and STEPS * h < left
        _watch(table, m, end, work, reach)
        if measure:
            depth = max(depth, _note(table, number, end, work, trail, found))
        if whole:
            _jump(table, LAST, work)
            for i in range(6):
                work[Z + i] = work[POINT + i]
            if phi.shape[0] > 0:
                _carry(table, LAST, phi)
            t += end
        else:
            _move(table, end, work, phi)
            t += end
        share = min(end / h, 1.0)
        _keep(LOW + 8 * (m & 7), work, Z, share * share, reach)
        if not (abs(work[Z]) < 1e12):
            code = DIVERGED
        elif crossed:
            other = number[TARGET + through]
            before, after = number[SIDE], ints[other, SIDE]
            if before != after:
                if before != 0:
                    trail.graze[0] = min(trail.graze[0], depth)
                depth = 0.0
                if after != 0:
                    impacts[done, 0 if after < 0 else 1] += 1
                    if measure:
                        k = trail.met[0]
                        trail.met[0] = k + 1
                        if k < len(trail.when):
                            trail.when[k] = done * stretch + t
                            trail.stop[k] = after
                            for i in range(4):
                                trail.at[k, i] = work[Z + i]
            m = other
            events += 1
            if events > drive[2]:
                code = TOO_MANY_EVENTS
        elif not whole:
            if not _far(data, work):
                return LEFT
            t, events = 0.0, 0
            done += 1
            here = done % anchor.shape[0]
            work[Z + 4], work[Z + 5] = anchor[here, 0], anchor[here, 1]
            for i in range(4):
                strobes[done, i] = work[Z + i]
                if measure:
                    trail.extremes[i, 0] = min(trail.extremes[i, 0], work[Z + i])
                    trail.extremes[i, 1] = max(trail.extremes[i, 1], work[Z + i])
    if code != DONE and not _far(data, work):
        return LEFT
    cursor[0], cursor[1] = m, done
    return code


# -------------------------------------------------------------------------------------------------
# Settling


class Answers(NamedTuple):
    """What ``respond_all`` writes for each of E questions."""

    whole: Int
    """(E, 7) ints: FOUND or ASK, n, p, q, drive periods spent, mode at the start, impacts."""
    real: Float
    """(E, 32): start (4), monodromy (16), extremes (8), penetration, miss, asymmetry, 1.0 where a
    tangency is undecided."""
    when: Float
    """(E, IMPACTS) times of the impacts over two laps."""
    speed: Float
    """(E, IMPACTS) velocities at the impacts over two laps."""
    stop: Int
    """(E, IMPACTS) stops of the impacts over two laps."""
    trace: Float
    """(E, LONGEST · POINTS) the displacement over n drive periods."""


class Ways(NamedTuple):
    """The drive's sine and cosine at the start of each stretch of a period."""

    one: Float
    """(1, 2) at the start of the one stretch."""
    few: Float
    """(32, 2) of 32 stretches."""
    many: Float
    """(POINTS, 2) of POINTS stretches."""


ASK, FOUND = 0, 1
"""ASK: nothing that the compiled code decides; the caller settles it."""
MODE = 5
"""Place in ``Answers.whole``."""


@compiled
def _power(M: Float) -> float:
    """Spectral radius of M (4, 4) from ‖M^(2^48)‖, each square brought to norm 1."""
    square, other, scale, weight = M.copy(), np.zeros((4, 4)), 0.0, 1.0
    for _ in range(49):
        size = 0.0
        for i in range(4):
            for j in range(4):
                size += square[i, j] * square[i, j]
        size = np.sqrt(size)
        if not (size > 0.0 and size < np.inf):
            return 0.0 if size == 0.0 else np.inf
        scale += weight * np.log(size)
        weight *= 0.5
        for i in range(4):
            for j in range(4):
                square[i, j] /= size
        for i in range(4):
            for j in range(4):
                total = 0.0
                for k in range(4):
                    total += square[i, k] * square[k, j]
                other[i, j] = total
        for i in range(4):
            for j in range(4):
                square[i, j] = other[i, j]
    return float(np.exp(scale))


@compiled
def _newton_step(T: Float, step: Float, x: Float) -> bool:
    """x ← x - (T - 1)⁻¹ step, by elimination with row exchanges; False where that is singular."""
    a = np.zeros((4, 5))
    for i in range(4):
        for j in range(4):
            a[i, j] = T[i, j] - (1.0 if i == j else 0.0)
        a[i, 4] = step[i]
    for p in range(4):
        best = p
        for q in range(p + 1, 4):
            best = q if abs(a[q, p]) > abs(a[best, p]) else best
        if not abs(a[best, p]) > 0.0:
            return False
        for j in range(5):
            a[p, j], a[best, j] = a[best, j], a[p, j]
        for q in range(4):
            factor = a[q, p] / a[p, p]
            if q != p:
                for j in range(p, 5):
                    a[q, j] -= factor * a[p, j]
    for i in range(4):
        x[i] -= a[i, 4] / a[i, i]
    return True


@compiled
def _shoot(
    data: Float,
    ints: Int,
    x: Float,
    n: int,
    peak: Float,
    drive: Float,
    ways: Ways,
    T: Float,
    trail: RunTrail,
) -> int:
    """``attractors.shoot``: x and T ← fixed point and monodromy matrix. 1 found, 0 none, -1
    left."""
    last, largest = np.inf, max(max(peak[0], peak[1]), max(peak[2], peak[3]))
    strobes, impacts = np.zeros((n + 1, 4)), np.zeros((n, 2), dtype=np.int64)
    cursor, step = np.zeros(3, dtype=np.int64), np.zeros(4)
    for _ in range(8):
        cursor[0] = mode_at(data, ints, x)
        if cursor[0] < 0:
            return -1
        for i in range(4):
            for j in range(4):
                T[i, j] = 1.0 if i == j else 0.0
        code = advance(data, ints, x, cursor, drive, ways.one, T, strobes, impacts, trail)
        if code != DONE:
            return -1 if code == LEFT else 0
        error = 0.0
        for i in range(4):
            step[i] = strobes[n, i] - x[i]
            error = max(error, abs(step[i]) / peak[i])
        if error < 1e-11 or (error < 1e-9 and error >= 0.5 * last):
            return 1
        if not _newton_step(T, step, x):
            return 0
        for i in range(4):
            if not abs(x[i]) <= 1e6 * largest:
                return 0
        last = error
    return 0


@compiled
def _gap(a: Float, b: Float, peak: Float) -> float:
    """Largest difference of two states over the peaks."""
    most = 0.0
    for i in range(4):
        most = max(most, abs(a[i] - b[i]) / peak[i])
    return float(most)


@compiled
def respond(
    data: Float,
    ints: Int,
    x: Float,
    drive: Float,
    ways: Ways,
    j: int,
    e: int,
    answers: Answers,
    trail: RunTrail,
) -> int:
    """``attractors.settle`` from x (4,) as long as the way is the usual one: FOUND or ASK.

    drive : omega, period, most events, and of the rules of ``attractor`` the gap that is worth
    shooting at, near, closing, strobe tolerance. j : which state is the displacement.
    """
    stages = (20, 20, 100)
    strobes, impacts = np.zeros((401, 4)), np.zeros((400, 2), dtype=np.int64)
    dense = np.zeros((LONGEST * POINTS + 1, 4))
    hits = np.zeros((LONGEST * POINTS, 2), dtype=np.int64)
    cursor, peak, point = np.zeros(3, dtype=np.int64), np.zeros(4), np.zeros(4)
    nothing, T = np.zeros((0, 0)), np.zeros((4, 4))
    state, end = x.copy(), np.zeros(4)
    mode, spent = mode_at(data, ints, state), 0
    if mode < 0:
        return ASK
    for stage in range(3):
        length = stages[stage]
        cursor[0] = mode
        code = advance(
            data,
            ints,
            state,
            cursor,
            drive,
            ways.one,
            nothing,
            strobes[: length + 1],
            impacts[:length],
            trail,
        )
        if code != DONE:
            return ASK
        spent += length
        mode = cursor[0]
        for i in range(4):
            end[i] = state[i] = strobes[length, i]
        # Peaks of each state over a drive period.
        cursor[0] = mode
        code = advance(
            data, ints, end, cursor, drive, ways.few, nothing, dense[:33], hits[:32], trail
        )
        if code != DONE:
            return ASK
        top = 0.0
        for i in range(4):
            peak[i] = 0.0
            for k in range(33):
                peak[i] = max(peak[i], abs(dense[k, i]))
            top = max(top, peak[i])
        for i in range(4):
            peak[i] = max(peak[i], max(1e-9 * top, 1e-300))
        spent += 1
        for n in range(1, min(16, length) + 1):
            if not _gap(end, strobes[length - n], peak) <= drive[3]:
                continue
            if n > LONGEST:
                return ASK
            for i in range(4):
                point[i] = end[i]
            got = _shoot(data, ints, point, n, peak, drive, ways, T, trail)
            if got < 0:
                return ASK
            spent += 8 * n
            if got == 0:
                continue
            least = n
            if n > 1:
                cursor[0] = mode_at(data, ints, point)
                if cursor[0] < 0:
                    return ASK
                code = advance(
                    data,
                    ints,
                    point,
                    cursor,
                    drive,
                    ways.one,
                    nothing,
                    dense[: n + 1],
                    hits[:n],
                    trail,
                )
                if code != DONE:
                    return ASK
                for d in range(n, 0, -1):
                    if n % d == 0 and _gap(dense[d], point, peak) <= drive[6]:
                        least = d
            if least < n:
                got = _shoot(data, ints, point, least, peak, drive, ways, T, trail)
                if got < 0:
                    return ASK
                if got == 0:
                    continue
            radius = _power(T)
            before = _gap(point, end, peak)
            if radius >= 1.0 or before >= drive[4]:
                continue
            turns = int(np.log(1e-4) / np.log(max(radius, 1e-3)))
            turns = min(max(turns, 2), int(drive[5]) // n)
            spent += turns * n
            cursor[0] = mode
            code = advance(
                data,
                ints,
                end,
                cursor,
                drive,
                ways.one,
                nothing,
                strobes[: turns * n + 1],
                impacts[: turns * n],
                trail,
            )
            if code != DONE:
                return ASK
            after = _gap(strobes[turns * n], point, peak)
            if after > max(10.0 * radius**turns * before, drive[6]):
                return ASK  # the strobes are overwritten: the caller settles it
            if not _describe(
                data,
                ints,
                point,
                least,
                drive,
                ways,
                T,
                j,
                e,
                answers,
                trail,
                dense,
                hits,
            ):
                return ASK
            answers.whole[e, 4] = spent + 5 * n
            return FOUND
    return ASK


@compiled
def _describe(
    data: Float,
    ints: Int,
    x: Float,
    n: int,
    drive: Float,
    ways: Ways,
    T: Float,
    j: int,
    e: int,
    answers: Answers,
    trail: RunTrail,
    dense: Float,
    hits: Int,
) -> bool:
    """``attractors.describe`` of the orbit through x, written as answer e; False if it drifts."""
    cursor, nothing, peak = np.zeros(3, dtype=np.int64), np.zeros((0, 0)), np.zeros(4)
    point = x.copy()
    start = mode_at(data, ints, x)
    if start < 0:
        return False
    cursor[0], cursor[2] = start, 1
    for i in range(4):
        trail.extremes[i, 0], trail.extremes[i, 1] = np.inf, -np.inf
    trail.graze[0], trail.graze[1], trail.graze[2], trail.met[0] = np.inf, np.inf, 0.0, 0
    hits[: 3 * n] = 0
    # Measured over two laps, so that a contact that lasts over the strobe is seen whole once.
    twice, met = 2 * n, 0
    for lap in range(2):
        first, last = (0, twice) if lap == 0 else (twice, 3 * n)
        cursor[2] = 1 - lap
        code = advance(
            data,
            ints,
            point,
            cursor,
            drive,
            ways.one,
            nothing,
            dense[first : last + 1],
            hits[first:last],
            trail,
        )
        if code != DONE:
            return False
        if lap == 0:
            met = trail.met[0]
            answers.real[e, 28], answers.real[e, 29] = trail.graze[0], trail.graze[1]
        for i in range(4):
            point[i] = dense[last, i]
    if met > len(trail.when):
        return False
    real = answers.real[e]
    for i in range(4):
        peak[i] = max(abs(trail.extremes[i, 0]), abs(trail.extremes[i, 1]))
        real[i] = x[i]
        real[20 + 2 * i], real[21 + 2 * i] = trail.extremes[i, 0], trail.extremes[i, 1]
        for k in range(4):
            real[4 + 4 * i + k] = T[i, k]
    lower = upper = 0
    for k in range(3 * n):
        lower, upper = lower + hits[k, 0], upper + hits[k, 1]
    for k in range(3 * n + 1):
        for i in range(4):
            if not abs(dense[k, i] - dense[k % n, i]) <= drive[6] * peak[i]:
                return False
    real[31] = trail.graze[2]
    for k in range(met):
        answers.when[e, k], answers.stop[e, k] = trail.when[k], trail.stop[k]
        answers.speed[e, k] = trail.at[k, j + 1] if j < 3 else 0.0
    whole = answers.whole[e]
    whole[1], whole[2], whole[3] = n, int(upper / 3.0 + 0.5), int(lower / 3.0 + 0.5)
    whole[MODE], whole[6] = start, met
    cursor[0], cursor[2] = start, 0
    length = n * POINTS
    code = advance(
        data, ints, x, cursor, drive, ways.many, nothing, dense[: length + 1], hits[:length], trail
    )
    if code != DONE:
        return False
    worst = 0.0
    for k in range(length):
        answers.trace[e, k] = dense[k, j]
        for i in range(4):
            pair = dense[k, i] + dense[(k + length // 2) % length, i]
            worst = max(worst, abs(pair) / peak[i])
    real[30] = worst if n % 2 == 1 else np.nan
    return True


@compiled
def respond_all(
    modes: Modes,
    which: Int,
    drives: Float,
    starts: Float,
    rules: Float,
    ways: Ways,
    j: int,
    answers: Answers,
) -> None:
    """Each of E questions: board which[e] under drives[e] from starts[e].

    which : (E,); drives : (E, 3) omega, amplitude, offset; starts : (E, 4).
    rules : most events and those of ``attractor``, as ``respond`` takes them from the third on.
    """
    count = modes.A.shape[1]
    data, ints = np.zeros((count, WIDTH)), np.zeros((count, INTS), dtype=np.int64)
    trail = RunTrail(
        np.zeros((4, 2)),
        np.zeros(3),
        np.zeros(IMPACTS),
        np.zeros((IMPACTS, 4)),
        np.zeros(IMPACTS, dtype=np.int64),
        np.zeros(1, dtype=np.int64),
    )
    drive = np.zeros(2 + len(rules))
    drive[2:] = rules
    fits = LEFT
    for e in range(len(which)):
        same = e > 0 and which[e] == which[e - 1]
        for k in range(3):
            same = same and drives[e, k] == drives[e - 1, k]
        if not same:
            fits = fill(data, ints, modes, which[e], drives[e, 0], drives[e, 1], drives[e, 2])
            drive[0], drive[1] = drives[e, 0], 2.0 * np.pi / drives[e, 0]
        answers.whole[e, 0] = ASK
        if fits == DONE:
            answers.whole[e, 0] = respond(data, ints, starts[e], drive, ways, j, e, answers, trail)
