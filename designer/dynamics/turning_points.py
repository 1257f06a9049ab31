"""Signed distances to the stops at every turning point of an orbit.

Grazing is a turning point that lies on a stop: the tip of a near miss or of a shallow contact, or
the dip between two contacts that become one. The exact flow's own margins have no sign and do not
see dips, so the turning points are found here: exact states at a dense grid, between two nodes the
quintic that matches height, rate and curvature at both. A contact that begins and ends within one
interval errs by the square of its penetration, so the sign of the height and its zero are right.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit

RESOLUTION = 0.05
"""The interval of the grid, over the fastest rate that an orbit meets; it leaves 1e-13 of the
peak."""
FEWEST, MOST = 128, 20_000
"""Intervals in a drive period."""


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
    first, second = _derivatives(flow, x, angle)
    step = drive.period / points
    turning: list[TurningPoint] = []
    for (clearance, side, row), h in zip(stops, past, strict=True):
        C, D = row[:-2], row[-2]
        turning += [
            TurningPoint(clearance, side, tip, node / points, height)
            for node, height, tip in _turning(h, first @ C + D * du, second @ C + D * ddu, step)
        ]
    return turning


def corner_crossings(flow: Flow, orbit: Orbit) -> tuple[int, ...]:
    """How often an orbit passes each of ``PiecewiseLinearSystem.corners`` in its period."""
    first = len(flow.system.clearances)
    numbers = range(first, first + len(flow.system.corners))
    turning = turning_points_of(flow, orbit, numbers)
    beyond = [[t.height > 0.0 for t in turning if t.clearance == k] for k in numbers]
    return tuple(sum(a != b for a, b in zip(row, row[1:] + row[:1], strict=True)) for row in beyond)


def _rate(flow: Flow, orbit: Orbit) -> float:
    """Largest modulus of an eigenvalue, of the open mode and of those that it leads to."""
    rest = flow.system.mode(flow.system.start)
    keys = {orbit.mode or flow.system.start, *(g.target for g in rest.guards if g.clearance >= 0)}
    keys |= {corner.target for corner in flow.system.corners}
    matrices = [rest.A, *(flow.system.mode(key).A for key in keys)]
    return max(float(np.abs(np.linalg.eigvals(A)).max()) for A in matrices)


def _derivatives(flow: Flow, x: Array, angle: Array) -> tuple[Array, Array]:
    """(nodes, states) x' and x'', each node in the mode that holds there at its drive phase."""
    drive, orders = flow.drive, flow.system.orders
    u, du = drive.at(angle), drive.rate_at(angle)
    second_drive, moving = drive.second_at(angle), drive.second_rate_at(angle)
    waves = drive.amplitude * flow.system.waves(angle)
    turns = _turned(waves, drive.amplitude * np.sin(angle), drive.omega, orders or ())
    first, second = np.empty_like(x), np.empty_like(x)
    left, near = np.arange(len(x)), None
    while len(left):
        near = flow.mode_at(x[left[0]], float(angle[left[0]]), near)
        mode = flow.system.mode(near)
        holds = np.ones(len(left), dtype=bool)
        for guard in mode.guards:
            value = x[left] @ guard.C + guard.D * u[left] + guard.e
            holds &= value + guard.second * second_drive[left] <= 0.0
        holds[0] = True  # by rounding a guard may be above zero where its mode was found
        nodes, left = left[holds], left[~holds]
        first[nodes] = x[nodes] @ mode.A.T + u[nodes, None] * mode.B + mode.d
        second[nodes] = du[nodes, None] * mode.B
        if mode.waves is not None:
            first[nodes] += waves[nodes] @ mode.waves.T
            second[nodes] += turns[nodes] @ mode.waves.T
        if mode.second is not None:
            first[nodes] += second_drive[nodes, None] * mode.second
            second[nodes] += moving[nodes, None] * mode.second
        second[nodes] += first[nodes] @ mode.A.T
    return first, second


def _turned(waves: Array, sine: Array, omega: float, orders: Sequence[int]) -> Array:
    """Rates of ``PiecewiseLinearSystem.waves`` (k, 1 + 2 h). sine : (k,) the drive's, of which the
    first wave is the cosine."""
    rates = [-omega * sine]
    for i, order in enumerate(orders):
        rates += [order * omega * waves[:, 2 + 2 * i], -order * omega * waves[:, 1 + 2 * i]]
    return np.stack(rates, axis=-1)


def _turning(h: Array, dh: Array, ddh: Array, step: float) -> list[tuple[float, float, bool]]:
    """(place, value, greatest) of h where its rate changes sign; places in nodes."""
    out = []
    for i in np.flatnonzero((dh[:-1] > 0.0) != (dh[1:] > 0.0)):
        quintic = _quintic(h[i : i + 2], step * dh[i : i + 2], step**2 * ddh[i : i + 2])
        rate = np.polynomial.Polynomial(quintic).deriv()
        low, high = 0.0, 1.0
        rising = bool(rate(0.0) > 0.0)
        for _ in range(60):
            middle = 0.5 * (low + high)
            if (rate(middle) > 0.0) == rising:
                low = middle
            else:
                high = middle
        place = 0.5 * (low + high)
        out.append((float(i) + place, float(np.polynomial.Polynomial(quintic)(place)), rising))
    return out


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
