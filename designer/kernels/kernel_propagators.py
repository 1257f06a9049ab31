"""Compiled tabulated fast path: any number of states and clearances, models and boards.

Within a mode the state moves in blocks of seven steps (``kernels.kernel_crossing``) by tabulated
propagators. For each boundary that is watched its distance and rate at the block's eight nodes are
one product with the state; the two stops of a clearance are limits of one function where they watch
one displacement. The boundaries that a good board never meets (outputs at their limits, diodes of
the other half) are proved to be far: over the box that the states kept to in a mode, no such guard
comes near zero. States that move together fill little of their box: where that proof fails, the
caller may ask for one step by step (``DrivenModes.closely``). Where that fails too the run is given
up, and the general kernel (``kernels.kernel_general``), which this must equal, does it. Modes get
their tables when they are first entered; one that has not been built yet ends the run with
UNKNOWN_MODE.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from designer.base.jit import compiled, embedded, leaf
from designer.kernels.kernel_crossing import (
    COEF,
    LAST,
    NODES,
    PARTS,
    POINT,
    SCRATCH,
    STACK,
    STEPS,
    TERMS,
    F,
    searches,
    series_value,
    suspect_step,
)
from designer.kernels.kernel_mode_tables import (
    FAR,
    FILLED,
    GUARDS,
    HIGH,
    LOW,
    NEAR,
    NOW,
    PART,
    PER,
    REST,
    SCAN,
    TABLES,
    WATCHED,
    WITHIN,
    DrivenModes,
    H,
    Unit,
    fill,
    function_places,
    table_places,
)
from designer.kernels.kernel_orbit import DIVERGED, DONE, LEFT, TOO_MANY_EVENTS, UNKNOWN_MODE

Float = NDArray[np.float64]
Int = NDArray[np.int64]

TANGENCY = 1e-13
"""Of the sum of a guard's terms' magnitudes: over an interval where it is smaller than that, a
crossing is not looked for."""
MODE, STRETCHES, MEASURE, GUARD = range(4)
"""Places in a run's cursor."""
FINE = 1.0 / PARTS**2
"""How much less a state may be from the chord of a part than from that of a step."""
STANDS = 0
"""Place in the scratch array: the part of the block at which WITHIN stands, -1 for none."""
MASK = 0xFFFFFFFF
"""With it the compiler knows that an index is not negative."""
LONGEST_WALK = 64
"""Mode changes after which the search for the mode of a state gives up."""


class RunTrail(NamedTuple):
    """What a measured run writes; k is the most impacts that are kept."""

    extremes: Float
    """(n + W, 2) least and greatest value of each state, and of each displacement that is none."""
    graze: Float
    """(C, 2) smallest penetration and nearest miss in each clearance."""
    undecided: Float
    """(1,) undecided tangencies."""
    when: Float
    """(k,) times of the impacts."""
    at: Float
    """(k, n) states at the impacts."""
    stop: Int
    """(k, 2) clearance and side of the impacts."""
    met: Int
    """(1,) how many impacts there were."""


class TabulatedFunction(NamedTuple):
    """A linear function in the tables of a mode."""

    place: int
    """Where its columns begin."""
    base: int
    """Where those of its mode begin."""
    unit: Unit
    """(n,) zeros."""


@embedded
def _jump(data: Float, base: int, part: int, unit: Unit, work: Float) -> None:
    """WITHIN = z ``part`` parts after NOW."""
    n = len(unit)
    jump, _, _, _, _ = table_places(n)
    count = n * (n + 3) + 2
    o = (base & MASK) + jump + count * (part & 63)
    for i in range(n):
        total = 0.0
        for j in range(n + 3):
            total += data[o + n * j + i] * data[NOW + j]
        work[POINT + i] = total
    s, q = data[NOW + n], data[NOW + n + 1]
    sine, cosine = data[o + count - 2], data[o + count - 1]
    for i in range(n):
        data[WITHIN + i] = work[POINT + i]
    data[WITHIN + n] = s * cosine + q * sine
    data[WITHIN + n + 1] = q * cosine - s * sine
    data[WITHIN + n + 2] = 1.0


@embedded
def _go(data: Float, base: int, part: int, unit: Unit, work: Float) -> None:
    """``_jump``, unless WITHIN stands there already."""
    if work[STANDS] != part:
        _jump(data, base, part, unit, work)
        work[STANDS] = part


@leaf
def _expand(data: Float, function: TabulatedFunction, t: float, work: Float) -> float:
    """Time of the part nearest to t; COEF = Taylor series of the function about it."""
    n, base = len(function.unit), function.base & MASK
    part = int(t * data[base + PER] + 0.5)
    _go(data, base, part, function.unit, work)
    local, _, _ = function_places(n)
    o = (function.place & MASK) + local
    a = b = c = d = e = f = g = h = 0.0
    for j in range(n + 3):
        i, z = o + TERMS * j, data[WITHIN + j]
        a, b, c, d = a + data[i] * z, b + data[i + 1] * z, c + data[i + 2] * z, d + data[i + 3] * z
        i += 4
        e, f, g, h = e + data[i] * z, f + data[i + 1] * z, g + data[i + 2] * z, h + data[i + 3] * z
    work[COEF], work[COEF + 1], work[COEF + 2], work[COEF + 3] = a, b, c, d
    work[COEF + 4], work[COEF + 5], work[COEF + 6], work[COEF + 7] = e, f, g, h
    return float(part * data[base + PART])


@leaf
def _carry(data: Float, base: int, part: int, unit: Unit, phi: Float, work: Float) -> None:
    """phi (n, k) ← ``part`` parts on."""
    n = len(unit)
    jump, _, _, _, _ = table_places(n)
    o = (base & MASK) + jump + (n * (n + 3) + 2) * (part & 63)
    for column in range(phi.shape[1]):
        for i in range(n):
            data[WITHIN + i] = phi[i, column]
        for i in range(n):
            total = 0.0
            for j in range(n):
                total += data[o + n * j + i] * data[WITHIN + j]
            work[POINT + i] = total
        for i in range(n):
            phi[i, column] = work[POINT + i]


@leaf
def _near(data: Float, base: int, s: float, unit: Unit, phi: Float, work: Float) -> None:
    """phi (n, k) ← a time s on, within a part."""
    n = len(unit)
    for j in range(n):
        o = (base & MASK) + NEAR + TERMS * n * j
        for i in range(n):
            total = data[o + n * (TERMS - 1) + i]
            for k in range(TERMS - 2, -1, -1):
                total = total * s + data[o + n * k + i]
            work[STACK + n * j + i] = total
    for column in range(phi.shape[1]):
        for i in range(n):
            data[WITHIN + i] = phi[i, column]
        for i in range(n):
            total = 0.0
            for j in range(n):
                total += work[STACK + n * j + i] * data[WITHIN + j]
            phi[i, column] = total


@embedded
def _move(data: Float, base: int, t: float, w: float, unit: Unit, phi: Float, work: Float) -> None:
    """NOW ← the state a time t on, 0 <= t <= STEPS · h; phi ← its tangent vectors."""
    n, o = len(unit), (base & MASK) + NEAR
    part = int(t * data[(base & MASK) + PER] + 0.5)
    _go(data, base, part, unit, work)
    s = t - part * data[(base & MASK) + PART]
    for k in range(n, TERMS * n):
        total = 0.0
        for j in range(n + 3):
            total += data[o + TERMS * n * j + k] * data[WITHIN + j]
        work[STACK + k] = total
    for i in range(n):
        total = work[STACK + n * (TERMS - 1) + i]
        for k in range(TERMS - 2, 0, -1):
            total = total * s + work[STACK + n * k + i]
        data[NOW + i] = total * s + data[WITHIN + i]
    a = w * s
    y = a * a
    sine = a * (1.0 - y / 6.0 * (1.0 - y / 20.0 * (1.0 - y / 42.0)))
    cosine = 1.0 - y / 2.0 * (1.0 - y / 12.0 * (1.0 - y / 30.0))
    data[NOW + n] = data[WITHIN + n] * cosine + data[WITHIN + n + 1] * sine
    data[NOW + n + 1] = data[WITHIN + n + 1] * cosine - data[WITHIN + n] * sine
    if phi.shape[0] > 0:
        _carry(data, base, part, unit, phi, work)
        _near(data, base, s, unit, phi, work)


@embedded
def _scan(data: Float, place: int, unit: Unit, work: Float) -> float:
    """F, D = value and rate of the function at the nodes; a bound of its fourth derivative."""
    n, o = len(unit), (place & MASK) + SCAN
    for k in range(2 * NODES):
        total = 0.0
        for j in range(n + 3):
            total += data[o + 2 * NODES * j + k] * data[NOW + j]
        work[F + k] = total
    _, fourth, _ = function_places(n)
    bound = 0.0
    for j in range(n + 3):
        bound += data[o + fourth + j] * abs(data[NOW + j])
    return bound


@embedded
def _reach(data: Float, base: int, unit: Unit, reach: Float) -> None:
    """reach (n,) ← how far each state may be from the chord of a step, in this block."""
    n, o = len(unit), base & MASK
    _, _, second, _, _ = table_places(n)
    for i in range(n):
        total = 0.0
        for j in range(n + 3):
            total += data[o + second + n * j + i] * abs(data[NOW + j])
        reach[i] = total


@embedded
def _keep(boxes: Float, m: int, n: int, x: Float, at: int, slack: float, reach: Float) -> None:
    """Widen the box (2 n,) of mode m by the state at ``at``, give or take a part of ``reach``."""
    for j in range(n):
        more = slack * reach[j]
        boxes[m, j] = min(boxes[m, j], x[at + j] - more)
        boxes[m, n + j] = max(boxes[m, n + j], x[at + j] + more)


@embedded
def _watch(
    data: Float, base: int, boxes: Float, m: int, end: float, slack: float, unit: Unit, work: Float,
    reach: Float,
) -> None:  # fmt: skip
    """Widen the box of mode m by the motion over [0, end], whose end is not in it yet. slack : for
    the first step."""
    n, o = len(unit), base & MASK
    _, way, _, _, _ = table_places(n)
    h = data[o + H]
    _keep(boxes, m, n, data, NOW, slack, reach)
    if end > h:
        count = (STEPS - 1) * n
        for k in range(count):
            total = 0.0
            for j in range(n + 3):
                total += data[o + way + count * j + k] * data[NOW + j]
            work[STACK + k] = total
        for k in range(STEPS - 1):
            if (k + 1) * h < end:
                _keep(boxes, m, n, work, STACK + n * k, 1.0, reach)


@leaf
def _clear(driven: DrivenModes, m: int, at: int, slack: float, reach: Float, guards: Float) -> bool:
    """Whether no far boundary of mode m is near the state at ``at``, give or take a part of
    ``reach``. guards : (far,) scratch."""
    n, far, data = len(driven.unit), driven.far, driven.data
    o = (TABLES + driven.width * (m + 1) - (2 * n + 1) * far) & MASK
    for g in range(far):
        guards[g] = data[o + 2 * n * far + g]
    for j in range(n):
        high, low = data[at + j] + slack * reach[j], data[at + j] - slack * reach[j]
        for g in range(far):
            guards[g] += data[o + far * j + g] * high + data[o + far * (n + j) + g] * low
    near = 0
    for g in range(far):
        near += not guards[g] < 0.0
    return near == 0


@leaf
def _clear_way(
    driven: DrivenModes, base: int, m: int, end: float, slack: float, work: Float, reach: Float,
    guards: Float,
) -> bool:  # fmt: skip
    """Whether no far boundary comes near in mode m over [0, end], the end left out: by the ends of
    each step, and where these prove nothing by those of its parts. slack : for the first step."""
    data, unit = driven.data, driven.unit
    part, clear = data[(base & MASK) + PART], _clear(driven, m, NOW, slack, reach, guards)
    for k in range(STEPS):
        first = PARTS * k
        if not first * part < end:
            return True
        following = False
        if (first + PARTS) * part <= end:
            _go(data, base, first + PARTS, unit, work)
            following = _clear(driven, m, WITHIN, 1.0, reach, guards)
        if not (clear and following):
            for p in range(first, first + PARTS + 1):
                if p * part < end:
                    _go(data, base, p, unit, work)
                    if not _clear(driven, m, WITHIN, min(FINE, slack), reach, guards):
                        return False
        clear = following
    return True


@leaf
def _all_far(driven: DrivenModes, boxes: Float) -> bool:
    """Whether no far boundary comes near over the boxes (K, 2 n), which are then emptied."""
    n, far, data = len(driven.unit), driven.far, driven.data
    for m in range(boxes.shape[0]):
        if boxes[m, 0] > boxes[m, n]:
            continue
        o = (TABLES + driven.width * (m + 1) - (2 * n + 1) * far) & MASK
        for g in range(far):
            total = data[o + 2 * n * far + g]
            for j in range(n):
                total += data[o + far * j + g] * boxes[m, n + j]
                total += data[o + far * (n + j) + g] * boxes[m, j]
            if not total < 0.0:
                return False
        _empty(boxes, m, n)
    return True


@leaf
def _empty(boxes: Float, m: int, n: int) -> None:
    for j in range(n):
        boxes[m, j], boxes[m, n + j] = np.inf, -np.inf


@leaf
def _worst(driven: DrivenModes, m: int, x: Float) -> tuple[float, int]:
    """Greatest value of mode m's guards at state x (n,) at drive phase 0, and the guard."""
    modes, board, n = driven.modes, driven.board, len(driven.unit)
    most, worst = -np.inf, -1
    for g in range(modes.guards[m]):
        row = modes.guard[board, m, g]
        total = row[n + 1] + row[n] * driven.drive[2]
        for j in range(n):
            total += row[j] * x[j]
        if total > most:
            most, worst = total, g
    return most, worst


@leaf
def mode_at(driven: DrivenModes, x: Float, cursor: Int) -> int:
    """Looks for the mode that holds at state x (n,) at drive phase 0, and writes it into
    cursor[MODE]: DONE, LEFT where there is none, or UNKNOWN_MODE as ``advance``."""
    modes = driven.modes
    for m in range(modes.side.shape[0]):
        if modes.good[driven.board, m] != 0:
            most, _ = _worst(driven, m, x)
            if most <= 0.0:
                cursor[MODE] = m
                return DONE
    m = 0
    for _ in range(LONGEST_WALK):
        _, g = _worst(driven, m, x)
        target = modes.target[m, g]
        if target < 0:
            cursor[MODE], cursor[GUARD] = m, g
            return LEFT if target == FAR else UNKNOWN_MODE
        m = target
    return LEFT


@leaf
def _widen(extremes: Float, i: int, low: float, high: float) -> None:
    extremes[i, 0], extremes[i, 1] = min(extremes[i, 0], low), max(extremes[i, 1], high)


_find_crossing, _turning_values = searches(_expand)


@leaf
def _measure(
    driven: DrivenModes, m: int, end: float, work: Float, trail: RunTrail, values: Float,
    depth: Float,
) -> None:  # fmt: skip
    """Extremes, depths, and the misses of clearances without contact, over [0, end]."""
    data, clearances = driven.data, driven.modes.side.shape[1]
    n = len(driven.unit)
    depths = n + len(driven.modes.watched)
    base = TABLES + driven.width * m
    _, _, _, rows, one = table_places(n)
    h = data[base + H]
    for r in range(depths + clearances):
        if r >= depths and driven.modes.side[m, r - depths] == 0:
            continue
        function = TabulatedFunction(base + rows + one * r, base, driven.unit)
        m4 = _scan(data, function.place, driven.unit, work)
        low = high = work[F]
        for k in range(_turning_values(data, function, end, h, m4, work, values)):
            low, high = min(low, values[0, k]), max(high, values[0, k])
        if r >= n and r < depths:  # a state's value at the end is noted there
            f, _, _ = series_value(work, end - _expand(data, function, end, work))
            low, high = min(low, f), max(high, f)
        if r < depths:
            _widen(trail.extremes, r, low, high)
        else:
            depth[r - depths] = max(depth[r - depths], high)
    for r in range(driven.ints[m, WATCHED]):
        clearance = driven.modes.clearance[m, driven.ints[m, GUARDS + 2 * r + HIGH]]
        if clearance < 0 or driven.modes.side[m, clearance] != 0:
            continue
        function = TabulatedFunction(
            base + rows + one * (depths + clearances + r), base, driven.unit
        )
        m4 = _scan(data, function.place, driven.unit, work)
        count = _turning_values(data, function, end, h, m4, work, values)
        _misses(data, function, count, values, clearance, trail.graze)


@leaf
def _misses(
    data: Float,
    function: TabulatedFunction,
    count: int,
    values: Float,
    clearance: int,
    graze: Float,
) -> None:
    """Note how near the turning values (2, count) of a clearance's function come to its limits."""
    _, _, limits = function_places(len(function.unit))
    low, high = data[function.place + limits + LOW], data[function.place + limits + HIGH]
    for k in range(count):
        miss = high - values[0, k] if values[1, k] > 0.0 else values[0, k] - low
        if miss > 0.0:
            graze[clearance, 1] = min(graze[clearance, 1], miss)


@embedded
def _first_crossing(
    data: Float, base: int, first: int, watched: int, left: float, unit: Unit, undecided: Float,
    work: Float,
) -> tuple[float, int]:  # fmt: skip
    """Time of the first way out of the mode in this block, and which limit of which function, 2 r +
    HIGH or LOW; -1 for none. first : place of the first watched function."""
    n = len(unit)
    h, part = data[(base & MASK) + H], data[(base & MASK) + REST]
    _, _, limits = function_places(n)
    _, _, _, _, one = table_places(n)
    count, earliest, through = min(STEPS, int(left / h) + 1), -1.0, -1
    for r in range(watched):
        at = (first + one * r) & MASK
        low, high = data[at + limits + LOW], data[at + limits + HIGH]
        function = TabulatedFunction(at, base, unit)
        m4 = _scan(data, at, unit, work)
        rest = m4 * part
        k, tangency = suspect_step(h, rest, low, high, count, work, 0), 0.0
        if k < count:
            for j in range(n + 3):
                tangency += TANGENCY * abs(data[at + SCAN + 2 * NODES * j] * data[NOW + j])
        while k < count:
            time, side = _find_crossing(
                data, function, k, h, m4, low, high, tangency, undecided, work
            )
            if time >= 0.0:
                if earliest < 0.0 or time < earliest:
                    earliest, through = time, 2 * r + (HIGH if side > 0 else LOW)
                    count = min(count, int(time / h) + 1)
                break
            k = suspect_step(h, rest, low, high, count, work, k + 1)
    return earliest, through


@leaf
def _log_impact(trail: RunTrail, time: float, clearance: int, side: int, data: Float) -> None:
    k = trail.met[0]
    trail.met[0] = k + 1
    if k < trail.when.shape[0]:
        trail.when[k], trail.stop[k, 0], trail.stop[k, 1] = time, clearance, side
        for i in range(trail.at.shape[1]):
            trail.at[k, i] = data[NOW + i]


@leaf
def _leap(
    data: Float, place: int, before: int, after: int, unit: Unit, phi: Float, work: Float
) -> None:
    """phi ← (I + (f₊ - f₋) r/g') phi where the guard at ``place``, r x + …, is crossed.

    The saltation matrix: r (n,) is the guard's row over the states, f₋ and f₊ are the vector fields
    of the modes before and after, g' is the guard's rate
    (Aizerman and Gantmakher, Quart. J. Mech. Appl. Math. 11, 1958).
    """
    n, rate = len(unit), 0.0
    local, _, _ = function_places(n)
    for i in range(n):
        work[POINT + i] = 0.0
    for j in range(n + 3):
        z, first = data[NOW + j], NEAR + n * (TERMS * j + 1)
        rate += data[place + local + TERMS * j + 1] * z
        for i in range(n):
            work[POINT + i] += (data[after + first + i] - data[before + first + i]) * z
    if rate == 0.0:
        return
    for k in range(phi.shape[1]):
        along = 0.0
        for j in range(n):
            along += data[place + local + TERMS * j] * phi[j, k]
        for i in range(n):
            phi[i, k] += work[POINT + i] * along / rate


@embedded
def _touch(
    side: Int, before: int, after: int, impacts: Int, done: int, graze: Float, depth: Float
) -> int:
    """Count the contacts that begin where mode ``after`` takes the place of ``before``, and end
    the depths of those that are over. The clearance of the last that begins, or -1."""
    begins = -1
    for c in range(depth.shape[0]):
        was, now = side[before, c], side[after, c]
        if was == now:
            continue
        if was != 0:
            graze[c, 0] = min(graze[c, 0], depth[c])
        depth[c] = 0.0
        if now != 0:
            impacts[done, 2 * c + (0 if now < 0 else 1)] += 1
            begins = c
    return begins


@compiled
def advance(
    driven: DrivenModes,
    x: Float,
    cursor: Int,
    period: float,
    anchor: Float,
    phi: Float,
    strobes: Float,
    impacts: Int,
    trail: RunTrail,
) -> int:
    """Carry x (n,), at drive phase 0, over the stretches of ``strobes`` (stretches + 1, n).

    cursor : (4,) mode (-1: the one that holds at x) and stretches done, both written, 1 to measure,
    and on UNKNOWN_MODE the guard of the mode beyond which there is none yet. anchor : (stretches a
    period, 2 + w) the drive's sine and cosine at the start of each, then the last w states, which
    are waves of it. impacts : (stretches, 2 C) lower
    and upper of each clearance, added to. phi : (n, k) tangent vectors, (0, 0) for none.
    """
    n, unit, far = len(driven.unit), driven.unit, driven.far
    data, ints, graze, undecided = driven.data, driven.ints, trail.graze, trail.undecided
    target, side, width = driven.modes.target, driven.modes.side, driven.width
    most = driven.drive[3]
    if cursor[MODE] < 0:
        code = mode_at(driven, x, cursor)
        if code != DONE:
            return code
    m, measure, clearances = cursor[MODE], cursor[MEASURE] == 1, driven.modes.side.shape[1]
    _, _, _, rows, one = table_places(n)
    stretch, omega = period / anchor.shape[0], driven.drive[0]
    watch = rows + one * (n + len(driven.modes.watched) + clearances)
    work, reach, values = np.zeros(SCRATCH), np.zeros(n), np.zeros((2, 32))
    boxes, depth, guards = np.zeros((len(target), 2 * n)), np.zeros(clearances), np.zeros(far)
    for i in range(n):
        data[NOW + i] = strobes[0, i] = x[i]
    data[NOW + n], data[NOW + n + 1], data[NOW + n + 2] = 0.0, 1.0, 1.0
    for k in range(len(boxes)):
        _empty(boxes, k, n)
    # A contact that was already running has an unknown deepest point so far.
    for c in range(clearances):
        depth[c] = np.inf if driven.modes.side[m, c] != 0 else 0.0
    t, events, done, code, slack = 0.0, 0, 0, DONE, 0.0
    if ints[m, FILLED] == 0:
        code = fill(driven, m)
    while done < strobes.shape[0] - 1 and code == DONE:
        base = (TABLES + width * m) & MASK
        h, left = data[base + H], stretch - t
        block = STEPS * h
        work[STANDS] = -1.0
        first, through = _first_crossing(
            data, base, base + watch, ints[m, WATCHED], left, unit, undecided, work
        )
        crossed = 0.0 <= first <= left
        end = first if crossed else min(left, block)
        whole = not crossed and block < left
        if far > 0:
            _reach(data, base, unit, reach)
            slack = min(end / h, 1.0) ** 2
            if not driven.closely:
                _watch(data, base, boxes, m, end, slack, unit, work, reach)
            elif not _clear_way(driven, base, m, end, slack, work, reach, guards):
                return LEFT
        if measure:
            _measure(driven, m, end, work, trail, values, depth)
        if whole:
            _jump(data, base, LAST, unit, work)
            for i in range(n + 2):
                data[NOW + i] = data[WITHIN + i]
            if phi.shape[0] > 0:
                _carry(data, base, LAST, unit, phi, work)
        else:
            _move(data, base, end, omega, unit, phi, work)
        t += end
        if far > 0 and not driven.closely:
            _keep(boxes, m, n, data, NOW, slack, reach)
        elif far > 0 and not _clear(driven, m, NOW, min(FINE, slack), reach, guards):
            return LEFT
        if not (abs(data[NOW]) < 1e12):
            code = DIVERGED
        elif crossed:
            guard = ints[m, GUARDS + through]
            other = target[m, guard]
            if other < 0:
                cursor[MODE], cursor[GUARD] = m, guard
                return UNKNOWN_MODE
            begins = _touch(side, m, other, impacts, done, graze, depth)
            if measure and begins >= 0:
                _log_impact(trail, done * stretch + t, begins, side[other, begins], data)
            m = other
            if ints[m, FILLED] == 0:
                code = fill(driven, m)
            if driven.leaps and phi.shape[0] > 0 and code == DONE:
                place = base + watch + one * (through // 2)
                _leap(data, place, base, (TABLES + width * m) & MASK, unit, phi, work)
            events += 1
            if events > most:
                code = TOO_MANY_EVENTS
        elif not whole:
            if far > 0 and not _all_far(driven, boxes):
                return LEFT
            t, events = 0.0, 0
            done += 1
            here = done % anchor.shape[0]
            data[NOW + n], data[NOW + n + 1] = anchor[here, 0], anchor[here, 1]
            for j in range(2, anchor.shape[1]):
                data[NOW + n + j - anchor.shape[1]] = anchor[here, j]
            for i in range(n):
                strobes[done, i] = data[NOW + i]
                if measure:
                    _widen(trail.extremes, i, data[NOW + i], data[NOW + i])
    if code != DONE and far > 0 and not _all_far(driven, boxes):
        return LEFT
    cursor[MODE], cursor[STRETCHES] = m, done
    return code
