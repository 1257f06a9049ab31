"""How near a record is to the orbits that boards settle on: where a fit begins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.dynamics.orbit import OrbitStatus
from designer.workbench.board_orbits import POINTS, NetOrbit, follow
from designer.workbench.board_prior import Prior
from designer.workbench.observation import Observation

LOOK = 1024
"""Samples of a record that it takes."""
SAME = 1e-6
"""Relative difference of two starts of one orbit."""


@dataclass(frozen=True)
class OrbitMatch:
    """How far a record is from an orbit, at the shift at which it is nearest."""

    cost: float
    """Squares of what is left of the record, over what is allowed for."""
    orbit: NetOrbit
    shift: float
    """In time [drive periods]."""


def matches(
    prior: Prior, draws: Array, obs: Observation, starts: Sequence[Array]
) -> dict[int, OrbitMatch]:
    """For each of the boards at draws (N, K) that settles on the record's period from one of the
    starts, by its number: its orbit that is nearest to the record."""
    boards = prior.ensemble(draws)
    which = [i for i in range(len(draws)) for _ in starts]
    asked = np.array([state for _ in draws for state in starts])
    asked = asked.reshape(len(which), len(prior.circuit.states))
    settled = boards.settle(which, [obs.excitation.drive] * len(which), asked)
    best: dict[int, OrbitMatch] = {}
    seen: dict[int, list[Array]] = {}
    for i, motion in zip(which, settled, strict=True):
        if motion.status is not OrbitStatus.PERIODIC or obs.n not in (None, motion.n):
            continue
        known = seen.setdefault(i, [])
        if any(np.allclose(motion.start, start, rtol=SAME, atol=0.0) for start in known):
            continue
        known.append(motion.start)
        orbit = follow(boards.reduction(i), obs.excitation, obs.nets, motion.start, motion.n)
        look = None if orbit is None else _nearest(obs, orbit)
        if look is not None and (i not in best or look.cost < best[i].cost):
            best[i] = look
    return best


def _nearest(obs: Observation, orbit: NetOrbit) -> OrbitMatch:
    """At the best of the shifts that the record allows."""
    width = max(1, len(obs.phase) // LOOK)
    phase, volts = obs.phase[::width], obs.volts[::width]
    sigma = obs.spread_of(np.abs(orbit.volts).max(axis=0)) / np.sqrt(width)
    fine = 1 if obs.aligned else 64
    costs = []
    for k in range(orbit.n * fine):
        shown = interpolated(orbit.volts, phase + k / fine)
        rest = (volts - shown - (volts - shown).mean(axis=0)) / sigma
        costs.append((float((rest**2).sum()), k / fine))
    cost, shift = min(costs)
    return OrbitMatch(cost, orbit, shift)


def interpolated(values: Array, phase: Array) -> Array:
    """(k, ...) periodic values (m, ...) of whole drive periods at phases (k,), straight between the
    points of the grid."""
    place = phase * POINTS
    cell = np.floor(place).astype(np.int64)
    share = (place - cell).reshape(-1, *(1,) * (values.ndim - 1))
    size = len(values)
    return np.asarray((1.0 - share) * values[cell % size] + share * values[(cell + 1) % size])
