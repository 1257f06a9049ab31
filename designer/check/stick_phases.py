"""How often and how long dry friction holds its bodies together over a response."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from designer.base.arrays import Array
from designer.check.absolute_motion import followed
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import ANSWERS, Orbit
from designer.laws.law_elements import Friction
from designer.model.lumped_system import LumpedSystem
from designer.model.mechanics import MechanicalModel

if TYPE_CHECKING:
    from designer.answers.simulate_answer import OrbitRow

POINTS = 1000
"""Of a drive period: a phase that is shorter than one of the stretches between them is not met."""


@dataclass(frozen=True)
class Sticking:
    """What one friction does over a response.

    It holds while its sliding velocity is within the one up to which its force rises, and the other
    forces on it do not overcome it. With that velocity against 0 this is the sticking of Coulomb's
    law; with a finite one the bodies creep meanwhile.
    """

    friction: str
    """What it joins, with a number where there are several: "block-ground.friction"."""
    periods: int
    """Drive periods that were looked at: those of the response, or many of a motion without a
    period."""
    phases: int
    """How often it begins to hold in these; 0 where it never holds, or always."""
    share: float
    """Of the time, that in which it holds."""
    longest: float
    """Longest phase, in drive periods."""
    creep: float
    """Largest sliding velocity while it holds: how far it is from sticking."""


def stick_phases(
    model: MechanicalModel, flow: Flow, orbit: Orbit, units: Array, seconds: float
) -> tuple[Sticking, ...] | None:
    """What each friction of the model does over an orbit of ``flow``; nothing without any, None
    where the orbit could not be followed.

    model : at the orbit's clearance. units : (n,) of each state of the flow per unit of the
    model's. seconds : of the flow's time per unit of the model's.
    """
    if not isinstance(model, LumpedSystem) or not model.frictions or orbit.status not in ANSWERS:
        return ()
    states = followed(flow, orbit, POINTS)
    if states is None:
        return None
    velocities = (states[:, : len(units)] / units)[:, 1::2] / model.b
    step = flow.drive.period / seconds / POINTS
    found = []
    for name, friction in model.nonlinear.items():
        if isinstance(friction, Friction):
            slip = velocities @ model.row_of(friction.factors) - friction.speed
            holds = _holds(model, friction, slip, step)
            creep = model.b * float(np.abs(slip[1:][holds]).max(initial=0.0))
            found.append(_sticking(name, holds, creep, periodic=orbit.n > 0))
    return tuple(found)


def _holds(model: LumpedSystem, friction: Friction, slip: Array, step: float) -> Array:
    """(k,) whether it holds in each stretch. slip : (k + 1,) the sliding velocity at b = 1."""
    row = model.row_of(friction.factors)
    force = np.interp(slip, *np.transpose([(x - friction.speed, f) for x, f in friction.corners]))
    mass = 1.0 / float(row @ np.linalg.solve(model.mass_matrix, row))
    middle = 0.5 * (slip[1:] + slip[:-1])
    others = mass * np.diff(slip) / step + 0.5 * (force[1:] + force[:-1])
    peak = max(friction.force, friction.static or 0.0)
    return np.asarray((np.abs(middle) <= friction.velocity) & (np.abs(others) <= peak))


def _sticking(name: str, holds: Array, creep: float, *, periodic: bool) -> Sticking:
    """What the stretches say. periodic : whether the last one is followed by the first."""
    periods = len(holds) // POINTS
    if holds.all() or not holds.any():
        whole = bool(holds.all())
        return Sticking(name, periods, 0, float(whole), float(periods * whole), creep)
    if periodic:  # begin with one that slides
        holds = np.roll(holds, -int(np.argmin(holds)))
    edges = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]]).astype(int)))
    lengths = edges[1::2] - edges[::2]
    longest = float(lengths.max()) / POINTS
    return Sticking(name, periods, len(lengths), float(holds.mean()), longest, creep)


def sticking_in(answer: OrbitRow) -> tuple[Sticking, ...]:
    """Those that stand in the JSON object of a response."""
    return tuple(Sticking(**each) for each in answer.get("sticking") or ())
