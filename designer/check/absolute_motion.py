"""Orbits followed once more: for extremes of absolute displacements, where the equations count
them from a moving base, and point by point.

x = z + y is no state, so its extremes are none of the flow's. Here the drive becomes states (its
sine, its cosine, and those of harmonics), and x takes the place of z: a system of the same modes
without a drive, whose flow refines the extremes of x as it does those of z.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from designer.base.arrays import Array
from designer.dynamics import step_budget
from designer.dynamics.drive_states import with_drive_states
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowStatus
from designer.dynamics.orbit import Orbit
from designer.dynamics.piecewise_linear import Drive, Mode, ModeKey, PiecewiseLinearSystem
from designer.dynamics.step_budget import Budget

OPEN_PERIODS = 200
"""Drive periods over which a motion without a period is measured."""


def absolute_extremes(flow: Flow, orbit: Orbit, ground: Array) -> Array:
    """(states, 2) least and greatest x = z + y along an orbit of ``flow``.

    ground : (states, 2 + 2h) the ground's displacement in each state's unit, as of
    ``relative_motion.ground_of``; 0 for a state that it does not move. (0, 2) of an orbit that has
    no extremes.
    """
    if not len(orbit.extremes) or not ground.any():
        return orbit.extremes
    rest = Drive(flow.drive.omega, 0.0, flow.drive.offset)
    moved = Flow(_in_absolute_terms(flow, ground), rest, fast=False)
    waves = np.tile([0.0, 1.0], 1 + len(flow.system.orders or ()))
    start = np.concatenate([orbit.start + ground @ waves[: ground.shape[1]], waves])
    with moved.within(Budget(step_budget.SETTLING)):
        run = moved.run(start, orbit.n or OPEN_PERIODS, mode=orbit.mode or None, measure=True)
    if run.status is not FlowStatus.DONE:
        return np.zeros((0, 2))
    return np.asarray(run.extremes[: flow.system.size])


def followed(flow: Flow, orbit: Orbit, points: int) -> Array | None:
    """(k + 1, states) an orbit of ``flow`` over its period, or ``OPEN_PERIODS`` without one, at so
    many points of each drive period; None where the steps run out."""
    with flow.within(Budget(step_budget.SETTLING)):
        mode, periods = orbit.mode or None, orbit.n or OPEN_PERIODS
        run = flow.run(orbit.start, periods, mode=mode, points=points)
    return run.strobes if run.status is FlowStatus.DONE else None


def _in_absolute_terms(flow: Flow, ground: Array) -> PiecewiseLinearSystem:
    """The system of the states (z + y, sin ωt, cos ωt, …); it counts no impacts."""
    driven, n = with_drive_states(flow.system, flow.drive), flow.system.size
    forth, back = np.eye(driven.size), np.eye(driven.size)
    waves = slice(n, n + ground.shape[1])
    forth[:n, waves], back[:n, waves] = ground, -ground

    def build(key: ModeKey) -> Mode:
        mode = driven.mode(key)
        guards = tuple(replace(g, C=g.C @ back, clearance=-1) for g in mode.guards)
        return replace(mode, A=forth @ mode.A @ back, guards=guards, sides=())

    return replace(driven, build=build, clearances=(), displacement=(), velocity=(), _modes={})
