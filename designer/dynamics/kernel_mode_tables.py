"""Compiled tables of the tabulated fast path: what ``dynamics.kernel_propagators`` multiplies.

A mode's tables are filled when it is first entered under a drive. z = (x, sin, cos, 1) for n states
x, and ``wide`` is n + 3. The kernels are compiled for each n that is asked for: ``unit`` is a tuple
of n zeros, whose length is a constant to the compiler, so that it unrolls loops over the states.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from designer.base.jit import callee
from designer.dynamics.kernel_algebra import spectral_radius
from designer.dynamics.kernel_crossing import BLOCK_STEP, LAST, NODES, PARTS, STEPS, TERMS
from designer.dynamics.kernel_orbit import DONE, LEFT

Float = NDArray[np.float64]
Int = NDArray[np.int64]
Unit = tuple[float, ...]

FAR, UNBUILT = -1, -2
"""In place of a mode beyond a guard: a boundary that is only proved to be far; a mode that has not
been built yet."""
TAIL = 20
"""Terms of a bound about a time: the most that is left out is 1.4**20/20! = 3e-16 of it."""

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
    boundary's C, and its constant; their number is rounded up so that loops over it vectorise.
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


table_places, function_places = callee(places), callee(row_places)


@callee
def _times(unit: Unit, row: Float, M: Float, w: float, out: Float) -> None:
    """out (wide,) = row · the generator (wide, wide) whose upper rows are M (n, wide)."""
    n = len(unit)
    for j in range(n + 3):
        out[j] = 0.0
    for k in range(n):
        for j in range(n + 3):
            out[j] += row[k] * M[k, j]
    out[n] -= w * row[n + 1]
    out[n + 1] += w * row[n]


@callee
def _along(unit: Unit, row: Float, jump: Float, out: Float) -> None:
    """out (wide,) = row · the propagator of a table line."""
    n = len(unit)
    for j in range(n + 3):
        total = 0.0
        for k in range(n):
            total += row[k] * jump[n * j + k]
        out[j] = total
    turn = n * (n + 3)
    out[n] += row[n] * jump[turn + 1] - row[n + 1] * jump[turn]
    out[n + 1] += row[n] * jump[turn] + row[n + 1] * jump[turn + 1]
    out[n + 2] += row[n + 2]


@callee
def _moduli(
    unit: Unit,
    row: Float,
    M: Float,
    w: float,
    jump: Float,
    order: int,
    half: float,
    work: Float,
    bound: Float,
) -> None:
    """bound (wide,) ← at least an entrywise bound of |row · M^order · exp(M t)| within ``half`` of
    the time of ``jump``. work : (3, wide)."""
    wide = len(unit) + 3
    now, then, total = work[0], work[1], work[2]
    for j in range(wide):
        now[j], total[j] = row[j], 0.0
    for _ in range(order):
        _times(unit, now, M, w, then)
        for j in range(wide):
            now[j] = then[j]
    _along(unit, now, jump, then)
    for j in range(wide):
        now[j] = then[j]
    for k in range(TAIL):
        for j in range(wide):
            total[j] += abs(now[j])
        _times(unit, now, M, w, then)
        for j in range(wide):
            now[j] = then[j] * half / (k + 1)
    for j in range(wide):
        bound[j] = max(bound[j], 1.001 * total[j])


@callee
def _function(
    unit: Unit, table: Float, o: int, row: Float, M: Float, w: float, jumps: Float, work: Float
) -> None:
    """Tables of the linear function row · z, at o; no limits. work : (4, wide)."""
    n, wide = len(unit), len(unit) + 3
    local, fourth, limits = function_places(n)
    now, then = work[0], work[1]
    for j in range(wide):
        now[j] = row[j]
    for v in range(2):
        for k in range(NODES):
            _along(unit, now, jumps[k * PARTS], work[2])
            for j in range(wide):
                table[o + SCAN + 2 * NODES * j + NODES * v + k] = work[2, j]
        _times(unit, row, M, w, now)
    for j in range(wide):
        now[j] = row[j]
    for k in range(TERMS):
        for j in range(wide):
            table[o + local + TERMS * j + k] = now[j]
        _times(unit, now, M, w, then)
        for j in range(wide):
            now[j] = then[j] / (k + 1)
    for j in range(wide):
        work[3, j] = 0.0
    _moduli(unit, row, M, w, jumps[LAST // 2], 4, 0.5 * STEPS * table[H], work, work[3])
    for j in range(wide):
        table[o + fourth + j] = work[3, j]
    table[o + limits + LOW], table[o + limits + HIGH] = -np.inf, np.inf


@callee
def _propagators(unit: Unit, M: Float, w: float, part: float, jumps: Float, work: Float) -> None:
    """jumps (LAST + 1, ·) ← the propagator over each number of parts; each from two of half its
    length. Until the end they stand there less the identity, whose rounding would grow with their
    number. work : (2, wide)."""
    n, wide = len(unit), len(unit) + 3
    turn = n * wide
    row, other = work[0], work[1]
    for k in range(LAST + 1):
        jumps[k, turn], jumps[k, turn + 1] = np.sin(k * part * w), np.cos(k * part * w)
    for j in range(turn):
        jumps[0, j] = jumps[1, j] = 0.0
    for i in range(n):  # row i of exp(M part), as a row of the identity carried along
        for j in range(wide):
            row[j] = 1.0 if i == j else 0.0
        for k in range(1, 14):
            _times(unit, row, M, w, other)
            for j in range(wide):
                row[j] = other[j] * part / k
                jumps[1, n * j + i] += row[j]
    for k in range(2, LAST + 1):
        _join(
            unit, jumps[k // 2], jumps[k - k // 2], np.sin(0.5 * (k - k // 2) * part * w), jumps[k]
        )
    for k in range(LAST + 1):
        for i in range(n):
            jumps[k, n * i + i] += 1.0


@callee
def _join(unit: Unit, a: Float, b: Float, half: float, out: Float) -> None:
    """out ← the propagator over b, then a, all less the identity. half : sine of half b's turn."""
    n = len(unit)
    turn, sine, cosine = n * (n + 3), n * n, n * (n + 1)
    less = -2.0 * half * half
    for j in range(n + 3):
        for i in range(n):
            out[n * j + i] = a[n * j + i] + b[n * j + i]
        for q in range(n):
            factor = b[n * j + q]
            for i in range(n):
                out[n * j + i] += a[n * q + i] * factor
    for i in range(n):
        out[sine + i] += a[sine + i] * less - a[cosine + i] * b[turn]
        out[cosine + i] += a[sine + i] * b[turn] + a[cosine + i] * less


@callee
def _over(guard: Float, amplitude: float, offset: float, row: Float) -> None:
    """row (wide,) over z of a row (n + 2,) over (states, drive, 1)."""
    n = guard.shape[0] - 2
    for j in range(n):
        row[j] = guard[j]
    row[n], row[n + 1] = guard[n] * amplitude, 0.0
    row[n + 2] = guard[n + 1] + guard[n] * offset


@callee
def _generator(driven: DrivenModes, m: int, M: Float) -> None:
    """M (n, wide) of mode m, x' = M z."""
    modes, board, n = driven.modes, driven.board, len(driven.unit)
    amplitude, offset = driven.drive[1], driven.drive[2]
    for i in range(n):
        for j in range(n):
            M[i, j] = modes.A[board, m, i, j]
        M[i, n], M[i, n + 1] = amplitude * modes.B[board, m, i], 0.0
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
    M, work, row = np.zeros((n, wide)), np.zeros((4, wide)), np.zeros(wide)
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
    for i in range(n):
        _state(unit, table, i, M, omega, jumps, row, work)
    depths = n + len(modes.watched)
    for r in range(len(modes.watched)):
        displacement = modes.displacement[board, modes.watched[r]]
        _over(displacement, driven.drive[1], driven.drive[2], row)
        _function(unit, table, rows + (n + r) * one, row, M, omega, jumps, work)
    for c in range(modes.side.shape[1]):
        if modes.side[m, c] != 0:
            _over(modes.past[board, m, c], driven.drive[1], driven.drive[2], row)
            _function(unit, table, rows + (depths + c) * one, row, M, omega, jumps, work)
    _guards(driven, m, M, jumps, row, work)
    driven.ints[m, FILLED] = 1
    return DONE


@callee
def _state(
    unit: Unit, table: Float, i: int, M: Float, w: float, jumps: Float, row: Float, work: Float
) -> None:
    """Tables of state i."""
    n, wide = len(unit), len(unit) + 3
    _, way, second, rows, one = table_places(n)
    local, _, _ = function_places(n)
    for j in range(wide):
        row[j] = 1.0 if i == j else 0.0
    _function(unit, table, rows + i * one, row, M, w, jumps, work)
    bound, half = work[3], 0.5 * table[H]
    for j in range(wide):
        bound[j] = 0.0
        for k in range(TERMS):
            table[NEAR + (TERMS * j + k) * n + i] = table[rows + i * one + local + TERMS * j + k]
    for k in range(STEPS):
        _moduli(unit, row, M, w, jumps[PARTS * k + PARTS // 2], 2, half, work, bound)
    for j in range(wide):
        table[second + n * j + i] = bound[j] * table[H] * table[H] / 8.0
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
        _function(unit, table, first + count * one, row, M, w, jumps, work)
        table[first + count * one + limits + HIGH] = 0.0
        ints[GUARDS + 2 * count + HIGH], ints[GUARDS + 2 * count + LOW] = g, -1
        count += 1
    ints[WATCHED] = count
    for k in range(distant, driven.far):
        for j in range(n + 3):
            row[j] = -1.0 if j == n + 2 else 0.0
        _distant(table, table.shape[0] - (2 * n + 1) * driven.far + k, driven.far, row)


@callee
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


@callee
def _distant(table: Float, o: int, far: int, row: Float) -> None:
    """A far boundary's column at o: parts of C by sign, then the largest of what is left."""
    n = row.shape[0] - 3
    for j in range(n):
        table[o + far * j] = max(row[j], 0.0)
        table[o + far * (n + j)] = min(row[j], 0.0)
    table[o + far * 2 * n] = row[n + 2] + abs(row[n])
