"""Signed distances to the stops at every turning point of an orbit.

Grazing is a turning point that lies on a stop: the tip of a near miss or of a shallow contact, or
the dip between two contacts that become one. The exact flow's own margins have no sign and do not
see dips, so the turning points are found here: exact states at a dense grid, between two nodes the
quintic that matches height, rate and curvature at both. A contact that begins and ends within one
interval errs by the square of its penetration, so the sign of the height and its zero are right.

The velocity that a corner of a law watches turns at a kink where the force of a stop jumps (its
damper's, or a preload). There an interval is split where the mode changes, by the exact motion.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial
from scipy.optimize import brentq

from designer.base.arrays import Array, Index
from designer.dynamics.flow import Flow
from designer.dynamics.mode_tables import augmented, augmented_row, augmented_state
from designer.dynamics.orbit import Orbit
from designer.dynamics.piecewise_linear import Mode, ModeKey

RESOLUTION = 0.05
"""The interval of the grid, over the fastest rate that an orbit meets; it leaves 1e-13 of the
peak."""
FEWEST, MOST = 128, 20_000
"""Intervals in a drive period."""
TERMS = 16
"""Of the Taylor series over an interval."""
PIECES = 64
"""Of an interval, at most: by rounding a tangency may be passed again and again."""


@dataclass(frozen=True)
class TurningPoint:
    """A turning point of the displacement in a clearance, seen from one of its stops."""

    clearance: int
    """Index of the clearance, or number of a corner (``PiecewiseLinearSystem.corners``)."""
    side: int
    """1 for its upper stop, -1 for the lower."""
    tip: bool
    """Whether the displacement is nearest to the stop there, or deepest in it; else it is least
    deep: the dip between two contacts."""
    phase: float
    """When, in drive periods after the orbit's strobe."""
    height: float
    """How far past the stop it lies, positive in contact, in units of the displacement."""


def heights(flow: Flow, orbit: Orbit, clearances: Iterable[int] | None = None) -> Array:
    """(k,) how far past its stop each turning point of each displacement lies, least first.

    Positive in contact; in units of the displacement; tips and dips at both stops, unordered in
    time. Empty for a system without clearances. clearances : those that are looked at; None: all.
    """
    return np.sort([point.height for point in turning_points_of(flow, orbit, clearances)])


def turning_points_of(
    flow: Flow, orbit: Orbit, clearances: Iterable[int] | None = None
) -> list[TurningPoint]:
    """Every turning point of each displacement, seen from each of its stops; see ``heights``."""
    system, drive = flow.system, flow.drive
    rate = max(_rate(flow, orbit), flow.fastest)
    points = int(np.clip(np.ceil(drive.period * rate / RESOLUTION), FEWEST, MOST))
    x = flow.run(orbit.start, orbit.n, mode=orbit.mode or None, points=points).strobes
    angle = 2.0 * np.pi * np.arange(len(x)) / points
    u, du, ddu = drive.at(angle), drive.rate_at(angle), drive.bend_at(angle)
    looked_at = range(len(system.clearances)) if clearances is None else clearances
    stops = [(j, side, row) for j in looked_at for side, row in system.contact_rows(j).items()]
    if not stops:
        return []
    rows = [row for _, _, row in stops]
    past = np.stack([x @ row[:-2] + row[-2] * u + row[-1] for row in rows])
    first, second, mode_of, keys = _derivatives(flow, x, angle)
    step = drive.period / points
    split: dict[int, list[_Piece]] = {}
    if not system.continuous and any(j >= len(system.clearances) for j, *_ in stops):
        for i in np.flatnonzero(mode_of[:-1] != mode_of[1:]).tolist():
            mode = system.mode(keys[mode_of[i]])
            split[i] = _pieces(flow, mode, augmented_state(x[i], angle[i], flow.orders), step)
    turning: list[TurningPoint] = []
    for (clearance, side, row), h in zip(stops, past, strict=True):
        C, D = row[:-2], row[-2]
        kinked = split if clearance >= len(system.clearances) else {}
        found = _turning(h, first @ C + D * du, second @ C + D * ddu, step, but=kinked)
        whole = augmented_row(row, drive, flow.orders)
        found += [
            (i + place, height, tip)
            for i, pieces in kinked.items()
            for place, height, tip in _turning_in(pieces, whole)
        ]
        turning += [
            TurningPoint(clearance, side, tip, node / points, height)
            for node, height, tip in sorted(found)
        ]
    return turning


@dataclass(frozen=True)
class _Piece:
    """A part of an interval, in one mode."""

    first: float
    """Where it begins, in intervals."""
    length: float
    """How much of the interval it is."""
    terms: Array
    """(TERMS, N) Taylor terms of the augmented state there."""


def _pieces(flow: Flow, mode: Mode, z: Array, step: float) -> list[_Piece]:
    """The motion over one interval, cut where its mode changes. z : (N,) the augmented state at its
    begin."""
    out, at = list[_Piece](), 0.0
    while len(out) < PIECES:
        M, terms = step * augmented(mode, flow.drive, flow.orders), [z]
        for k in range(1, TERMS):
            terms.append(M @ terms[-1] / k)
        series, length, target = np.array(terms), 1.0 - at, mode
        for guard in mode.guards:
            value = Polynomial(series @ augmented_row(guard.row, flow.drive, flow.orders))
            if value(0.0) < 0.0 < value(length):
                length = float(brentq(value, 0.0, length, xtol=1e-15))
                target = flow.system.mode(guard.target)
        out.append(_Piece(at, length, series))
        if target is mode:
            break
        z, mode, at = length ** np.arange(TERMS) @ series, target, at + length
    return out


def _turning_in(pieces: Sequence[_Piece], row: Array) -> list[tuple[float, float, bool]]:
    """As of ``_turning`` within an interval, of a row over the augmented state: also where the rate
    jumps from one sign to the other."""
    out, before = list[tuple[float, float, bool]](), None
    for piece in pieces:
        height = Polynomial(piece.terms @ row)
        rate = height.deriv()
        rises, ends = bool(rate(0.0) > 0.0), bool(rate(piece.length) > 0.0)
        if before not in (None, rises):
            out.append((piece.first, float(height(0.0)), not rises))
        if rises != ends:
            place = _change(rate, piece.length)
            out.append((piece.first + place, float(height(place)), rises))
        before = ends
    return out


def corner_crossings(flow: Flow, orbit: Orbit) -> tuple[int, ...]:
    """How often an orbit passes each of ``PiecewiseLinearSystem.corners`` in its period."""
    first = len(flow.system.clearances)
    numbers = range(first, first + len(flow.system.corners))
    turning = turning_points_of(flow, orbit, numbers)
    beyond = [[t.height > 0.0 for t in turning if t.clearance == k] for k in numbers]
    return tuple(sum(a != b for a, b in zip(row, row[1:] + row[:1], strict=True)) for row in beyond)


def _rate(flow: Flow, orbit: Orbit) -> float:
    """Largest modulus of an eigenvalue, of the open mode, of those that it leads to, and of those
    beyond corners."""
    rest = flow.system.mode(flow.system.start)
    keys = {orbit.mode or flow.system.start, *(g.target for g in rest.guards if g.clearance >= 0)}
    modes = [rest, *map(flow.system.mode, keys), *flow.system.modes_beyond]
    return max(float(np.abs(np.linalg.eigvals(mode.A)).max()) for mode in modes)


def _derivatives(flow: Flow, x: Array, angle: Array) -> tuple[Array, Array, Index, list[ModeKey]]:
    """(nodes, states) x' and x'', each node in the mode that holds there at its drive phase;
    (nodes,) numbers of these modes, and their keys."""
    drive, orders = flow.drive, flow.system.orders
    u, du = drive.at(angle), drive.rate_at(angle)
    second_drive, moving = drive.second_at(angle), drive.second_rate_at(angle)
    waves = drive.amplitude * flow.system.waves(angle)
    turns = _turned(waves, drive.amplitude * np.sin(angle), drive.omega, orders or ())
    first, second = np.empty_like(x), np.empty_like(x)
    left, near = np.arange(len(x)), None
    mode_of, keys = np.zeros(len(x), dtype=np.int64), list[ModeKey]()
    while len(left):
        near = flow.mode_at(x[left[0]], float(angle[left[0]]), near)
        keys.append(near)
        mode = flow.system.mode(near)
        holds = np.ones(len(left), dtype=bool)
        for guard in mode.guards:
            value = x[left] @ guard.C + guard.D * u[left] + guard.e
            holds &= value + guard.second * second_drive[left] <= 0.0
        holds[0] = True  # by rounding a guard may be above zero where its mode was found
        nodes, left = left[holds], left[~holds]
        mode_of[nodes] = len(keys) - 1
        first[nodes] = x[nodes] @ mode.A.T + u[nodes, None] * mode.B + mode.d
        second[nodes] = du[nodes, None] * mode.B
        if mode.waves is not None:
            first[nodes] += waves[nodes] @ mode.waves.T
            second[nodes] += turns[nodes] @ mode.waves.T
        if mode.second is not None:
            first[nodes] += second_drive[nodes, None] * mode.second
            second[nodes] += moving[nodes, None] * mode.second
        second[nodes] += first[nodes] @ mode.A.T
    return first, second, mode_of, keys


def _turned(waves: Array, sine: Array, omega: float, orders: Sequence[int]) -> Array:
    """Rates of ``PiecewiseLinearSystem.waves`` (k, 1 + 2 h). sine : (k,) the drive's, of which the
    first wave is the cosine."""
    rates = [-omega * sine]
    for i, order in enumerate(orders):
        rates += [order * omega * waves[:, 2 + 2 * i], -order * omega * waves[:, 1 + 2 * i]]
    return np.stack(rates, axis=-1)


def _turning(
    h: Array, dh: Array, ddh: Array, step: float, but: Mapping[int, object]
) -> list[tuple[float, float, bool]]:
    """(place, value, greatest) of h where its rate changes sign; places in nodes. but : intervals
    that are left out."""
    out = []
    for i in np.flatnonzero((dh[:-1] > 0.0) != (dh[1:] > 0.0)):
        if i in but:
            continue
        quintic = Polynomial(_quintic(h[i : i + 2], step * dh[i : i + 2], step**2 * ddh[i : i + 2]))
        rate = quintic.deriv()
        place = _change(rate, 1.0)
        out.append((float(i) + place, float(quintic(place)), bool(rate(0.0) > 0.0)))
    return out


def _change(rate: Polynomial, high: float) -> float:
    """Where a polynomial that has different signs at 0 and at ``high`` changes its own."""
    low, rising = 0.0, bool(rate(0.0) > 0.0)
    for _ in range(60):
        middle = 0.5 * (low + high)
        if (rate(middle) > 0.0) == rising:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def _quintic(h: Array, dh: Array, ddh: Array) -> Array:
    """(6,) coefficients on [0, 1] of the polynomial with these values, rates, curvatures."""
    rise = h[1] - h[0] - dh[0] - 0.5 * ddh[0]
    rate = dh[1] - dh[0] - ddh[0]
    curve = ddh[1] - ddh[0]
    return np.array(
        [
            h[0],
            dh[0],
            0.5 * ddh[0],
            10.0 * rise - 4.0 * rate + 0.5 * curve,
            -15.0 * rise + 7.0 * rate - curve,
            6.0 * rise - 3.0 * rate + 0.5 * curve,
        ]
    )
