"""How many periods ngspice needs after a start on the exact circuit's orbit.

At the fidelity ``ideal`` the start is right and two periods are enough. Op-amps with a pole and a
slew limit have an orbit of their own nearby, so there is a way to go, which shrinks by the
multiplier ρ with every n periods: after k of them c·ρᵏ is left. c is read off a short run of that
fidelity (how far the strobe still moves, over 1 - ρ). ρ is the exact circuit's, or what the short
run shows where that is slower: the fidelity's own orbit may be less stable than the exact
circuit's.
"""

from __future__ import annotations

import math

import numpy as np

from designer.base.arrays import Array
from designer.spice.read_orbit import STROBE_TOLERANCE

PROBE = 12
"""Laps of n periods in the short run. The first strobe is left out: op-amps with a memory settle
within microseconds of the start, but not before it."""
SLOWEST = 0.999
"""A multiplier that a short run seems to show above this one is taken for this one."""


def periods(strobes: Array, n: int, radius: float, peak: Array) -> tuple[int, float]:
    """Drive periods until the predicted remainder is below the strobe tolerance, and ρ a lap.

    strobes : (k, states) of the short run from its start, every drive period. radius : the exact
    circuit's. peak : (states,).
    """
    laps = strobes[n::n]
    moves = (np.abs(np.diff(laps, axis=0)) / peak).max(axis=1)
    rho = max(radius, _seen(moves)) if math.isfinite(radius) else _seen(moves)
    rho = min(max(rho, 1e-3), SLOWEST)
    left = moves / (1.0 - rho)
    far = np.flatnonzero(left > STROBE_TOLERANCE)
    if len(far) == 0:
        return n, rho
    last = int(far[-1])
    if last + 1 < len(left):
        return n * (last + 2), rho
    more = math.ceil(math.log(STROBE_TOLERANCE / left[-1]) / math.log(rho))
    return n * (last + 1 + more), rho


def _seen(moves: Array) -> float:
    """Geometric mean of the last ratios of successive moves; 0 where they are lost in noise."""
    quiet = 0.05 * STROBE_TOLERANCE
    tail = moves[-5:]
    if len(tail) < 2 or tail.min() < quiet:
        return 0.0
    return float((tail[-1] / tail[0]) ** (1.0 / (len(tail) - 1)))
