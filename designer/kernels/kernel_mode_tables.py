"""Compiled tables of the tabulated fast path: what ``kernels.kernel_propagators`` multiplies.

A mode's tables are filled when it is first entered under a drive. z = (x, sin, cos, 1) for n states
x, and ``wide`` is n + 3. The kernels are compiled for each n that is asked for: ``unit`` is a tuple
of n zeros, whose length is a constant to the compiler, so that it unrolls loops over the states.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from designer.base.jit import callee, leaf
from designer.kernels.kernel_algebra import spectral_radius
from designer.kernels.kernel_crossing import BLOCK_STEP, LAST, NODES, PARTS, STEPS, TERMS
from designer.kernels.kernel_orbit import DONE, LEFT

Float = NDArray[np.float64]
Int = NDArray[np.int64]
Unit = tuple[float, ...]

FAR, UNBUILT = -1, -2
"""In place of a mode beyond a guard: a boundary that is only proved to be far; a mode that has not
been built yet."""
BLOCK_TERMS, STEP_TERMS = 16, 9
"""Terms of a bound about the middle of a block and of a step: the most that is left out is
1.4**16/16! = 1e-11 and 0.2**9/9! = 1e-12 of it."""
ONE = (0.0,)
"""For a block of one row."""

# ``DrivenModes.data`` begins with the state at the start of a block, and one within it. They stand
# there because a loop that reads one array and writes another vectorises.
NOW, WITHIN, TABLES = 0, 16, 32
"""z at the start of a block; z at a part of it; where the modes' tables begin."""
# Columns of one mode's tables; ``places`` has those that depend on n.
H, PART, PER, REST = 0, 1, 2, 3
NEAR = 4
"""(wide, TERMS, n) Taylor coefficients of the states over z; those of order 1 are M, x' = M z."""
# Columns of one linear function, from its own place on; ``row_places`` has the others.
SCAN = 0
"""(wide, 2, NODES) value and rate at each node."""
LOW, HIGH = 0, 1
"""Limits within which the mode holds, and the order of the guards there."""
# Columns of one mode's integers; then for each watched function its guards at LOW and HIGH, or -1.
FILLED, WATCHED, GUARDS = 0, 1, 2


class Modes(NamedTuple):
    """Modes of N boards of n states with C clearances: K modes, the first holds at rest."""

    A: Float
    """(N, K, n, n) state matrices."""
    B: Float
    """(N, K, n) input vectors."""
    quadrature: Float
    """(N, K, n) input vectors of the drive's cosine."""
    d: Float
    """(N, K, n) constant terms."""
    guard: Float
    """(N, K, G, n + 2) rows over (states, drive, 1), positive past the guard."""
    past: Float
    """(N, K, C, n + 2) row of the displacement past the stop in contact."""
    displacement: Float
    """(N, C, n + 2) displacement in each clearance over (states, drive, 1)."""
    velocity: Float
    """(N, C, n + 1) velocity in each clearance over (states, the drive's rate)."""
    watched: Int
    """(W,) the clearances whose displacement is not a state."""
    good: Int
    """(N, K) 1 where a board has this mode."""
    target: Int
    """(K, G) mode beyond a guard, FAR or UNBUILT."""
    clearance: Int
    """(K, G) clearance whose contact begins or ends at a guard, or -1."""
    guards: Int
    """(K,) how many guards a mode has."""
    side: Int
    """(K, C) side of the stop in contact: 1 upper, -1 lower, 0 none."""


class DrivenModes(NamedTuple):
    """The modes of one board under a drive, with their tables."""

    modes: Modes
    """Modes of many boards."""
    board: int
    """Which of them."""
    drive: Float
    """(4,) omega, amplitude, offset, most mode changes in a stretch."""
    data: Float
    """(TABLES + K · width,) columns, see ``widths``."""
    ints: Int
    """(K, counts) integers."""
    width: int
    """Columns of one mode."""
    far: int
    """Boundaries that there is room for to prove far."""
    leaps: bool
    """Whether the vector field differs on the two sides of a boundary."""
    closely: bool
    """Whether each step is held against the far boundaries by itself: slower, and where the boxes
    of the states prove too little."""
    unit: Unit
    """(n,) zeros."""


def places(n: int) -> tuple[int, int, int, int, int]:
    """Where stand, for n states: the propagators (LAST + 1, wide · n + 2), columns (wide, n), sine
    and cosine of the drive's turn; states at the inner nodes of a block (wide, (STEPS - 1) · n);
    moduli (wide, n) that bound h²/8 |x''| within a block; the linear functions, which are the
    states, the displacements that are none, the depth in each clearance, and the boundaries that
    are watched. Last, the columns of a function."""
    wide = n + 3
    jump = NEAR + wide * TERMS * n
    way = jump + (LAST + 1) * (wide * n + 2)
    second = way + wide * (STEPS - 1) * n
    return jump, way, second, second + wide * n, wide * (2 * NODES + TERMS + 1) + 2


def row_places(n: int) -> tuple[int, int, int]:
    """Where stand, within a linear function: its Taylor coefficients (wide, TERMS); moduli (wide,)
    that bound its fourth derivative within a block; LOW and HIGH."""
    wide = n + 3
    return 2 * NODES * wide, (2 * NODES + TERMS) * wide, (2 * NODES + TERMS + 1) * wide


def widths(modes: Modes) -> tuple[int, int, int]:
    """Columns of the tables and of the integers of such modes, and their far boundaries.

    Those are (2 n + 1, far) behind the linear functions: positive and negative part of each
    boundary's row, and its constant; their number is rounded up so that loops over it vectorise.
    """
    n, far = modes.A.shape[-1], (modes.target == FAR) & _there(modes)
    most = int((_there(modes) & ~far).sum(axis=1).max())
    count = -(-int(far.sum(axis=1).max()) // 8) * 8
    _, _, _, rows, one = places(n)
    functions = n + len(modes.watched) + modes.side.shape[1] + most
    return rows + functions * one + (2 * n + 1) * count, GUARDS + 2 * most, count


def _there(modes: Modes) -> NDArray[np.bool_]:
    """(K, G) where a mode has a guard."""
    return np.arange(modes.target.shape[1]) < modes.guards[:, None]


table_places, function_places = leaf(places), leaf(row_places)


@leaf
def _times(unit: Unit, rows: Unit, R: Float, M: Float, w: float, out: Float) -> None:
    """out (wide, r) = R (wide, r) · the generator (wide, wide) whose upper rows are M (n, wide).

    r = len(rows) rows stand side by side, so that a loop over them vectorises.
    """
    n, r = len(unit), len(rows)
    for j in range(r * (n + 3)):
        out[j] = 0.0
    for k in range(n):
        for j in range(n + 3):
            for i in range(r):
                out[r * j + i] += R[r * k + i] * M[k, j]
    for i in range(r):
        out[r * n + i] -= w * R[r * (n + 1) + i]
        out[r * (n + 1) + i] += w * R[r * n + i]


@leaf
def _along(unit: Unit, rows: Unit, R: Float, jump: Float, out: Float) -> None:
    """out (wide, r) = R (wide, r) · the propagator of a table line."""
    n, r = len(unit), len(rows)
    for j in range(n + 3):
        for i in range(r):
            total = 0.0
            for k in range(n):
                total += R[r * k + i] * jump[n * j + k]
            out[r * j + i] = total
    sine, cosine = jump[n * (n + 3)], jump[n * (n + 3) + 1]
    for i in range(r):
        out[r * n + i] += R[r * n + i] * cosine - R[r * (n + 1) + i] * sine
        out[r * (n + 1) + i] += R[r * n + i] * sine + R[r * (n + 1) + i] * cosine
        out[r * (n + 2) + i] += R[r * (n + 2) + i]


@leaf
def _moduli(
    unit: Unit,
    rows: Unit,
    R: Float,
    M: Float,
    w: float,
    jump: Float,
    terms: int,
    half: float,
    work: Float,
    bound: Float,
) -> None:
    """bound (wide, r) ← at least an entrywise bound of |R · exp(M t)| within ``half`` of the time
    of ``jump``, by so many terms about that time. work : (3, wide · r)."""
    count = len(rows) * (len(unit) + 3)
    now, then, total = work[0], work[1], work[2]
    _along(unit, rows, R, jump, now)
    for j in range(count):
        total[j] = abs(now[j])
    for k in range(1, terms):
        _times(unit, rows, now, M, w, then)
        for j in range(count):
            now[j] = then[j] * half / k
            total[j] += abs(now[j])
    for j in range(count):
        bound[j] = max(bound[j], 1.001 * total[j])


@leaf
def _functions(
    unit: Unit, rows: Unit, table: Float, o: int, R: Float, M: Float, w: float, jumps: Float,
    work: Float,
) -> None:  # fmt: skip
    """Tables of the linear functions R · z, one after the other from o; no limits.

    R : (wide, r), a column of each function side by side; left as R · M⁴. work : (4, wide · r).
    """
    n, wide, r = len(unit), len(unit) + 3, len(rows)
    local, fourth, limits = function_places(n)
    _, _, _, _, one = table_places(n)
    rate, along = work[0], work[1]
    _times(unit, rows, R, M, w, rate)
    for k in range(NODES):
        for v in range(2):
            _along(unit, rows, rate if v == 1 else R, jumps[k * PARTS], along)
            for j in range(wide):
                for i in range(r):
                    table[o + one * i + SCAN + 2 * NODES * j + NODES * v + k] = along[r * j + i]
    now, then, fifth = work[0], work[1], work[3]
    for j in range(wide * r):
        now[j] = R[j]
    for k in range(TERMS):
        for j in range(wide):
            for i in range(r):
                table[o + one * i + local + TERMS * j + k] = now[r * j + i]
        _times(unit, rows, now, M, w, then)
        for j in range(wide * r):
            now[j] = then[j] / (k + 1)
            if k == 3:
                R[j] = 24.0 * now[j]
    for j in range(wide * r):
        fifth[j] = 0.0
    half = 0.5 * STEPS * table[H]
    _moduli(unit, rows, R, M, w, jumps[LAST // 2], BLOCK_TERMS, half, work, fifth)
    for i in range(r):
        at = o + one * i
        for j in range(wide):
            table[at + fourth + j] = fifth[r * j + i]
        table[at + limits + LOW], table[at + limits + HIGH] = -np.inf, np.inf


@leaf
def _propagators(unit: Unit, M: Float, w: float, part: float, jumps: Float, work: Float) -> None:
    """jumps (LAST + 1, ·) ← the propagator over each number of parts; each from two of half its
    length. Until the end they stand there less the identity, whose rounding would grow with their
    number. work : (2, wide · n)."""
    n, wide = len(unit), len(unit) + 3
    turn = n * wide
    now, then = work[0], work[1]
    for k in range(LAST + 1):
        jumps[k, turn], jumps[k, turn + 1] = np.sin(k * part * w), np.cos(k * part * w)
    for j in range(turn):
        jumps[0, j] = jumps[1, j] = 0.0
    _identity(unit, now)
    for k in range(1, 14):
        _times(unit, unit, now, M, w, then)
        for j in range(turn):
            now[j] = then[j] * part / k
            jumps[1, j] += now[j]
    for k in range(2, LAST + 1):
        _join(
            unit, jumps[k // 2], jumps[k - k // 2], np.sin(0.5 * (k - k // 2) * part * w), jumps[k]
        )
    for k in range(LAST + 1):
        for i in range(n):
            jumps[k, n * i + i] += 1.0


@leaf
def _identity(unit: Unit, R: Float) -> None:
    """R (wide, n) ← the states as functions of z."""
    n = len(unit)
    for j in range(n + 3):
        for i in range(n):
            R[n * j + i] = 1.0 if i == j else 0.0


@leaf
def _join(unit: Unit, a: Float, b: Float, half: float, out: Float) -> None:
    """out ← the propagator over b, then a, all less the identity. half : sine of half b's turn."""
    n = len(unit)
    turn, sine, cosine = n * (n + 3), n * n, n * (n + 1)
    less = -2.0 * half * half
    for j in range(n + 3):
        for i in range(n):
            total = a[n * j + i] + b[n * j + i]
            for q in range(n):
                total += a[n * q + i] * b[n * j + q]
            out[n * j + i] = total
    for i in range(n):
        out[sine + i] += a[sine + i] * less - a[cosine + i] * b[turn]
        out[cosine + i] += a[sine + i] * b[turn] + a[cosine + i] * less


@leaf
def _over(guard: Float, amplitude: float, offset: float, row: Float) -> None:
    """row (wide,) over z of a row (n + 2,) over (states, drive, 1)."""
    n = guard.shape[0] - 2
    for j in range(n):
        row[j] = guard[j]
    row[n], row[n + 1] = guard[n] * amplitude, 0.0
    row[n + 2] = guard[n + 1] + guard[n] * offset


@leaf
def _generator(driven: DrivenModes, m: int, M: Float) -> None:
    """M (n, wide) of mode m, x' = M z."""
    modes, board, n = driven.modes, driven.board, len(driven.unit)
    amplitude, offset = driven.drive[1], driven.drive[2]
    for i in range(n):
        for j in range(n):
            M[i, j] = modes.A[board, m, i, j]
        M[i, n] = amplitude * modes.B[board, m, i]
        M[i, n + 1] = amplitude * modes.quadrature[board, m, i]
        M[i, n + 2] = modes.d[board, m, i] + offset * modes.B[board, m, i]


@callee
def table_of(driven: DrivenModes, m: int) -> Float:
    """(width,) the columns of mode m."""
    first = TABLES + driven.width * m
    return driven.data[first : first + driven.width]


@callee
def fill(driven: DrivenModes, m: int) -> int:
    """Tables of mode m; DONE, or LEFT if they do not fit."""
    unit, modes, board = driven.unit, driven.modes, driven.board
    n = len(unit)
    wide, omega = n + 3, driven.drive[0]
    if modes.good[board, m] == 0:
        return LEFT
    M, work, row = np.zeros((n, wide)), np.zeros((6, wide * n)), np.zeros(wide)
    _generator(driven, m, M)
    rate = max(spectral_radius(modes.A[board, m], 5), omega)
    if not (rate > 0.0 and rate < np.inf):
        return LEFT
    table, h = table_of(driven, m), BLOCK_STEP / rate
    table[H], table[PART], table[PER], table[REST] = h, h / PARTS, PARTS / h, h * h * h * h / 288.0
    jump, _, _, rows, one = table_places(n)
    count = wide * n + 2
    jumps = table[jump : jump + (LAST + 1) * count].reshape((LAST + 1, count))
    _propagators(unit, M, omega, h / PARTS, jumps, work)
    _states(unit, table, M, omega, jumps, work)
    depths = n + len(modes.watched)
    for r in range(len(modes.watched)):
        displacement = modes.displacement[board, modes.watched[r]]
        _over(displacement, driven.drive[1], driven.drive[2], row)
        _functions(unit, ONE, table, rows + (n + r) * one, row, M, omega, jumps, work)
    for c in range(modes.side.shape[1]):
        if modes.side[m, c] != 0:
            _over(modes.past[board, m, c], driven.drive[1], driven.drive[2], row)
            _functions(unit, ONE, table, rows + (depths + c) * one, row, M, omega, jumps, work)
    _guards(driven, m, M, jumps, row, work)
    driven.ints[m, FILLED] = 1
    return DONE


@leaf
def _states(unit: Unit, table: Float, M: Float, w: float, jumps: Float, work: Float) -> None:
    """Tables of all states. work : (6, wide · n)."""
    n, wide = len(unit), len(unit) + 3
    _, way, second, rows, one = table_places(n)
    local, _, _ = function_places(n)
    R, bound = work[4], work[5]
    _identity(unit, R)
    _functions(unit, unit, table, rows, R, M, w, jumps, work)
    for j in range(wide):
        for i in range(n):
            o = rows + i * one + local + TERMS * j
            R[n * j + i], bound[n * j + i] = 2.0 * table[o + 2], 0.0
            for k in range(TERMS):
                table[NEAR + (TERMS * j + k) * n + i] = table[o + k]
    for k in range(STEPS):
        middle = jumps[PARTS * k + PARTS // 2]
        _moduli(unit, unit, R, M, w, middle, STEP_TERMS, 0.5 * table[H], work, bound)
    for j in range(wide):
        for i in range(n):
            table[second + n * j + i] = bound[n * j + i] * table[H] * table[H] / 8.0
            for k in range(STEPS - 1):
                table[way + (STEPS - 1) * n * j + n * k + i] = jumps[PARTS * (k + 1), n * j + i]


@callee
def _guards(driven: DrivenModes, m: int, M: Float, jumps: Float, row: Float, work: Float) -> None:
    """Tables of what mode m watches, and of the boundaries that it proves to be far."""
    n, modes, board, table, ints = (
        len(driven.unit), driven.modes, driven.board, table_of(driven, m), driven.ints[m],
    )  # fmt: skip
    _, _, _, rows, one = table_places(n)
    _, _, limits = function_places(n)
    unit = driven.unit
    amplitude, offset, w = driven.drive[1], driven.drive[2], driven.drive[0]
    first = rows + (n + len(modes.watched) + modes.side.shape[1]) * one
    count, distant = 0, 0
    for g in range(modes.guards[m]):
        guard = modes.guard[board, m, g]
        if modes.target[m, g] == FAR:
            _over(guard, amplitude, offset, row)
            _distant(table, table.shape[0] - (2 * n + 1) * driven.far + distant, driven.far, row)
            distant += 1
            continue
        other = _opposite(modes.guard[board, m], modes.clearance[m], ints, count, g)
        if other >= 0:
            # The other side of the same displacement: one function with two limits.
            met = ints[GUARDS + 2 * other + HIGH]
            at = first + other * one + limits
            table[at + LOW] = modes.guard[board, m, met, n + 1] + guard[n + 1]
            ints[GUARDS + 2 * other + LOW] = g
            continue
        _over(guard, amplitude, offset, row)
        _functions(unit, ONE, table, first + count * one, row, M, w, jumps, work)
        table[first + count * one + limits + HIGH] = 0.0
        ints[GUARDS + 2 * count + HIGH], ints[GUARDS + 2 * count + LOW] = g, -1
        count += 1
    ints[WATCHED] = count
    for k in range(distant, driven.far):
        for j in range(n + 3):
            row[j] = -1.0 if j == n + 2 else 0.0
        _distant(table, table.shape[0] - (2 * n + 1) * driven.far + k, driven.far, row)


@leaf
def _opposite(guards: Float, clearance: Int, ints: Int, count: int, g: int) -> int:
    """The watched function, of ``count``, that guard g is the other limit of, or -1."""
    for r in range(count):
        other = ints[GUARDS + 2 * r + HIGH]
        opposite = ints[GUARDS + 2 * r + LOW] < 0 and clearance[other] == clearance[g]
        for j in range(guards.shape[1] - 1):
            opposite = opposite and guards[other, j] == -guards[g, j]
        if opposite:
            return r
    return -1


@leaf
def _distant(table: Float, o: int, far: int, row: Float) -> None:
    """A far boundary's column at o: parts of its row by sign, then the largest of what is left."""
    n = row.shape[0] - 3
    for j in range(n):
        table[o + far * j] = max(row[j], 0.0)
        table[o + far * (n + j)] = min(row[j], 0.0)
    table[o + far * 2 * n] = row[n + 2] + abs(row[n])
