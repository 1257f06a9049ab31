"""Compiled core of the exact flow: steps, guards, impacts, extremes.

The functions release the GIL and know nothing of Python objects; set-up (matrix functions, tables)
is done by ``dynamics.flow`` in NumPy.

The state is augmented with the drive's sine, cosine and the constant 1, z = (x, sin, cos, 1), so a
mode is autonomous: z' = M z. A step of length h has the propagator E = exp(M h); inside a step z
and every guard are Taylor polynomials in s = t/h, exact to rounding since ‖M h‖ <= 1/2.

Proof that no boundary is stepped over: first the chord bound, max(g0, g1) + |g''| h²/8 < 0, with
|g''| bounded by an entrywise majorant of r M² exp(M t), r the guard's row over z; where that fails,
interval subdivision of the guard's polynomial with a bound on its second derivative. Only an
interval shorter than 1e-10 of a step that still cannot be decided counts as grazing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from designer.base.jit import callee, compiled, leaf
from designer.kernels.kernel_orbit import DIVERGED, DONE, PAUSED, TOO_MANY_EVENTS, UNKNOWN_MODE

Float = NDArray[np.float64]
Int = NDArray[np.int64]

ORDER = 18
"""Taylor order: 0.5**19/19! is 1.6e-23."""
CHANGE, TANGENT = 20.0, 4.0
"""What a change of mode, and a step that carries tangent vectors, cost, in plain steps."""
FINEST = 1e-10
TANGENCY = 1e-13
"""Of the sum of a guard's terms' magnitudes: below it a value is not told from zero."""


class ModeTables(NamedTuple):
    """What ``advance`` knows of the modes; first axis: mode index."""

    step: Float
    """(m,) step length h."""
    propagator: Float
    """(m, N, N) propagator over one step."""
    taylor: Float
    """(m, ORDER + 1, N, N) Taylor terms (M h)^k/k! of the propagator."""
    guard: Float
    """(m, g, ORDER + 1, N) Taylor rows of the guards."""
    chord: Float
    """(m, g, N) majorant of |g''| h²/8."""
    guards: Int
    """(m,) how many guards a mode has."""
    target: Int
    """(m, g) mode index, -1 while unknown."""
    clearance: Int
    """(m, g) clearance whose contact begins or ends at a guard, or -1."""
    depth: Float
    """(m, c, ORDER + 1, N) Taylor rows of the displacement past the stop that is touched."""
    watched: Float
    """(m, r, ORDER + 1, N) Taylor rows of those displacements in a clearance that are no state."""
    side: Int
    """(m, c) side of each clearance: -1 lower stop, 0 open, 1 upper stop."""
    clipped: Int
    """(m,) whether an element that ought to be linear is at its limit."""


class Log(NamedTuple):
    """What ``advance`` writes."""

    strobes: Float
    """(stretches + 1, n) states at the start and after each stretch."""
    impacts: Int
    """(stretches, c, 2) impacts in each stretch, lower stop, then upper."""
    when: Float
    """(capacity,) time of each impact."""
    at: Float
    """(capacity, n) state at each impact."""
    stop: Int
    """(capacity, 2) clearance and side of each impact."""
    extremes: Float
    """(n + r, 2) least and greatest value of each state, then of each watched displacement."""
    graze: Float
    """(c, 2) smallest penetration and nearest miss in each clearance."""
    tangencies: Int
    """(1,) undecided tangencies."""
    clipped: Float
    """(1,) time spent clipped."""


@leaf
def _value(c: Float, s: float) -> float:
    total = 0.0
    for k in range(c.shape[0] - 1, -1, -1):
        total = total * s + c[k]
    return total


@leaf
def _slope(c: Float, s: float) -> float:
    total = 0.0
    for k in range(c.shape[0] - 1, 0, -1):
        total = total * s + k * c[k]
    return total


@leaf
def _curvature_bound(c: Float, end: float) -> float:
    """Bound of |p''| on [0, end]."""
    total = 0.0
    for k in range(c.shape[0] - 1, 1, -1):
        total = total * end + k * (k - 1) * abs(c[k])
    return total


@leaf
def _root(c: Float, a: float, b: float) -> float:
    """The root of p in [a, b], where p is monotone and changes sign: Newton kept by bisection."""
    rising = _value(c, b) > _value(c, a)
    s = 0.5 * (a + b)
    for _ in range(80):
        p = _value(c, s)
        if p == 0.0:
            return s
        if (p > 0.0) == rising:
            b = s
        else:
            a = s
        d = _slope(c, s)
        t = s - p / d if d != 0.0 else a
        if not (a < t < b):
            t = 0.5 * (a + b)
        if abs(t - s) <= 1e-16 * (1.0 + abs(s)) or t in (a, b):
            return t
        s = t
    return s


@callee
def _first_rise(c: Float, end: float, rounding: float, tangencies: Int) -> float:
    """First s in [0, end] where p goes from negative to positive; -1.0 if there is none.

    rounding : what cannot be told from zero.
    """
    bound = _curvature_bound(c, end)
    left = np.empty(80)
    right = np.empty(80)
    left[0], right[0] = 0.0, end
    top = 1
    while top > 0:
        top -= 1
        a, b = left[top], right[top]
        m, r = 0.5 * (a + b), 0.5 * (b - a)
        p, d = _value(c, m), _slope(c, m)
        if p + abs(d) * r + 0.5 * bound * r * r < 0.0:
            continue
        if d - bound * r > 0.0:
            if _value(c, b) <= 0.0:
                continue
            return a if _value(c, a) > 0.0 else _root(c, a, b)
        if d + bound * r < 0.0:
            continue
        # A guard that is nothing but rounding over an interval is not cut to its last pieces.
        if r < FINEST or abs(p) + abs(d) * r + 0.5 * bound * r * r <= rounding:
            if abs(p) <= rounding:
                tangencies[0] += 1
            continue
        left[top], right[top] = m, b
        left[top + 1], right[top + 1] = a, m
        top += 2
    return -1.0


@callee
def _stationary(c: Float, end: float, points: Float) -> int:
    """Writes the points of [0, end] where p' = 0 into ``points``; returns how many."""
    n = c.shape[0]
    q = np.empty(n - 1)
    for k in range(1, n):
        q[k - 1] = k * c[k]
    bound = _curvature_bound(q, end)
    left = np.empty(80)
    right = np.empty(80)
    left[0], right[0] = 0.0, end
    top, count = 1, 0
    while top > 0 and count < points.shape[0]:
        top -= 1
        a, b = left[top], right[top]
        m, r = 0.5 * (a + b), 0.5 * (b - a)
        p, d = _value(q, m), _slope(q, m)
        if abs(p) - abs(d) * r - 0.5 * bound * r * r > 0.0:
            continue
        if abs(d) - bound * r > 0.0:
            va, vb = _value(q, a), _value(q, b)
            if (va <= 0.0 < vb) or (vb <= 0.0 < va):
                points[count] = _root(q, a, b)
                count += 1
            continue
        if r < FINEST:
            points[count] = m
            count += 1
            continue
        left[top], right[top] = m, b
        left[top + 1], right[top + 1] = a, m
        top += 2
    return count


@leaf
def _product(matrix: Float, z: Float, n: int, weight: float, out: Float) -> None:
    """out += weight · matrix z. The rows of the drive, from n on, hold a pair of waves, or the
    constant, and nothing else; of a sine alone they are too few to be told apart."""
    size = z.shape[0]
    whole = size if size == n + 3 else n
    for i in range(whole):
        total = 0.0
        for j in range(size):
            total += matrix[i, j] * z[j]
        out[i] += weight * total
    if whole == size:
        return
    out[n + 2] += weight * matrix[n + 2, n + 2] * z[n + 2]
    first = n
    while first < size:
        sine, cosine = z[first], z[first + 1]
        for i in range(first, first + 2):
            out[i] += weight * (matrix[i, first] * sine + matrix[i, first + 1] * cosine)
        first += 3 if first == n else 2


@leaf
def _partial(taylor: Float, z: Float, n: int, s: float, out: Float) -> None:
    """out = Σ s^k (M h)^k/k! z, by columns of the table. n : states in z."""
    for i in range(z.shape[0]):
        out[i] = 0.0
    weight = 1.0
    for k in range(taylor.shape[0]):
        _product(taylor[k], z, n, weight, out)
        weight *= s


@callee
def _tangent(taylor: Float, propagator: Float, n: int, s: float, phi: Float, work: Float) -> None:
    """phi ← (state block of exp(M s h)) phi; s = 1 uses the propagator."""
    for i in range(n):
        for j in range(n):
            if s == 1.0:
                work[i, j] = propagator[i, j]
            else:
                total = 0.0
                for k in range(taylor.shape[0] - 1, -1, -1):
                    total = total * s + taylor[k, i, j]
                work[i, j] = total
    for j in range(phi.shape[1]):
        column = phi[:, j].copy()
        for i in range(n):
            total = 0.0
            for k in range(n):
                total += work[i, k] * column[k]
            phi[i, j] = total


@callee
def _jump(
    tables: ModeTables, mode: int, other: int, guard: int, z: Float, n: int, phi: Float
) -> None:
    """phi ← (I + (f₊ - f₋) r/g') phi where the guard g = r x + … is crossed at z.

    The saltation matrix: r (n,) is the guard's row over the states, f₋ and f₊ are the vector fields
    before and after, g' = r f₋ + D u' is the guard's rate
    (Aizerman and Gantmakher, Quart. J. Mech. Appl. Math. 11, 1958).
    """
    row, rate = tables.guard[mode, guard], 0.0
    for j in range(z.shape[0]):
        rate += row[1, j] * z[j] / tables.step[mode]
    if rate == 0.0:
        return
    leap = np.zeros(n)
    for i in range(n):
        for j in range(z.shape[0]):
            leap[i] += tables.taylor[other, 1, i, j] * z[j] / tables.step[other]
            leap[i] -= tables.taylor[mode, 1, i, j] * z[j] / tables.step[mode]
    for k in range(phi.shape[1]):
        along = 0.0
        for j in range(n):
            along += row[0, j] * phi[j, k]
        for i in range(n):
            phi[i, k] += leap[i] * along / rate


@leaf
def _series(rows: Float, z: Float, c: Float) -> None:
    """c ← Taylor coefficients of a guard or a depth from its rows (ORDER + 1, N)."""
    for k in range(c.shape[0]):
        total = 0.0
        for j in range(z.shape[0]):
            total += rows[k, j] * z[j]
        c[k] = total


@callee
def _measure(
    tables: ModeTables, mode: int, z: Float, n: int, end: float, depth: Float, log: Log
) -> None:
    """Extremes of the states, of the displacements and of the distances to the stops in a step."""
    c = np.empty(tables.taylor.shape[1])
    points = np.empty(16)
    for i in range(log.extremes.shape[0]):
        rows = tables.taylor[mode, :, i] if i < n else tables.watched[mode, i - n]
        _series(rows, z, c)
        count = _stationary(c, end, points)
        for q in range(count + 2):
            v = c[0] if q == count else _value(c, end if q > count else points[q])
            log.extremes[i, 0] = min(log.extremes[i, 0], v)
            log.extremes[i, 1] = max(log.extremes[i, 1], v)
    for j in range(tables.side.shape[1]):
        if tables.side[mode, j] == 0:
            continue
        _series(tables.depth[mode, j], z, c)
        count = _stationary(c, end, points)
        for q in range(count):
            depth[j] = max(depth[j], _value(c, points[q]))
        depth[j] = max(depth[j], _value(c, end))
    for g in range(tables.guards[mode]):
        j = tables.clearance[mode, g]
        if j < 0 or tables.side[mode, j] != 0:
            continue
        _series(tables.guard[mode, g], z, c)
        count = _stationary(c, end, points)
        for q in range(count):
            v = _value(c, points[q])
            falls = _slope(c, min(points[q] + 1e-6, end)) <= 0.0
            if v < 0.0 and falls and 0.0 < points[q] < end:
                log.graze[j, 1] = min(log.graze[j, 1], -v)


@compiled
def advance(
    tables: ModeTables,
    z: Float,
    clock: Float,
    cursor: Int,
    stretch: float,
    anchor: Float,
    phi: Float,
    depth: Float,
    max_events: int,
    until: int,
    measure: bool,
    jumps: bool,
    log: Log,
) -> int:
    """Carry z to strobe number ``until`` of ``log``; resumable.

    z : (N,) augmented state, overwritten. clock : (3,) time in the stretch, impacts met (logged
    as far as the log reaches), steps that are left: with none left it returns PAUSED.
    cursor : (4,) stretch index, mode index, events in this stretch and, on UNKNOWN_MODE, the guard
    whose target is missing. anchor : (stretches a period, N - n - 1) the drive's exact sine and
    cosine at the start of each stretch, so that its phase does not drift, then its harmonics'.
    phi : (n, k) tangent vectors, (0, 0) for none. depth : (c,) deepest penetration of the running
    contact. jumps : whether the vector field differs on the two sides of a boundary.
    """
    size = z.shape[0]
    n = log.strobes.shape[1]
    z1 = np.empty(size)
    work = np.empty((n, n))
    c = np.empty(tables.guard.shape[2])
    while cursor[0] < until:
        if clock[2] <= 0.0:
            return PAUSED
        clock[2] -= 1.0 if phi.shape[0] == 0 else TANGENT
        mode = cursor[1]
        h = tables.step[mode]
        left = stretch - clock[0]
        whole = left > h
        end = 1.0 if whole else left / h
        if whole:
            for i in range(size):
                z1[i] = 0.0
            _product(tables.propagator[mode], z, n, 1.0, z1)
        else:
            _partial(tables.taylor[mode], z, n, end, z1)
        first, through = end, -1
        for g in range(tables.guards[mode]):
            g0, g1, swing, terms = 0.0, 0.0, 0.0, 0.0
            for j in range(size):
                term = tables.guard[mode, g, 0, j] * z[j]
                g0 += term
                terms += abs(term)
                g1 += tables.guard[mode, g, 0, j] * z1[j]
                swing += tables.chord[mode, g, j] * abs(z[j])
            if max(g0, g1) + swing < 0.0:
                continue
            _series(tables.guard[mode, g], z, c)
            s = _first_rise(c, first, TANGENCY * terms, log.tangencies)
            if s >= 0.0 and (s < first or through < 0):
                first, through = s, g
        if through >= 0:
            if tables.target[mode, through] < 0:
                cursor[3] = through
                return UNKNOWN_MODE
            _partial(tables.taylor[mode], z, n, first, z1)
        if measure:
            _measure(tables, mode, z, n, first, depth, log)
        if phi.shape[0] > 0:
            _tangent(
                tables.taylor[mode],
                tables.propagator[mode],
                n,
                1.0 if whole and through < 0 else first,
                phi,
                work,
            )
        if tables.clipped[mode] != 0:
            log.clipped[0] += first * h
        for i in range(size):
            z[i] = z1[i]
        if not (abs(z[0]) < 1e12):
            return DIVERGED
        if through >= 0:
            clock[0] += first * h
            other = tables.target[mode, through]
            if jumps and phi.shape[0] > 0:
                _jump(tables, mode, other, through, z, n, phi)
            for j in range(tables.side.shape[1]):
                before, after = tables.side[mode, j], tables.side[other, j]
                if after == before:
                    continue
                if before != 0:
                    log.graze[j, 0] = min(log.graze[j, 0], depth[j])
                depth[j] = 0.0
                if after == 0:
                    continue
                log.impacts[cursor[0], j, 0 if after < 0 else 1] += 1
                k = int(clock[1])
                clock[1] += 1.0
                if k < log.when.shape[0]:
                    log.when[k] = cursor[0] * stretch + clock[0]
                    log.stop[k, 0] = j
                    log.stop[k, 1] = after
                    for i in range(n):
                        log.at[k, i] = z[i]
            cursor[1] = other
            cursor[2] += 1
            clock[2] -= CHANGE
            if cursor[2] > max_events:
                return TOO_MANY_EVENTS
            continue
        if whole:
            clock[0] += h
            continue
        clock[0] = 0.0
        cursor[2] = 0
        cursor[0] += 1
        here = cursor[0] % anchor.shape[0]
        z[n] = anchor[here, 0]
        z[n + 1] = anchor[here, 1]
        for i in range(n + 3, size):
            z[i] = anchor[here, i - n - 1]
        for i in range(n):
            log.strobes[cursor[0], i] = z[i]
    return DONE
