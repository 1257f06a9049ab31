"""Extremes of absolute displacements, where the equations count them from a moving base.

x = z + ground · sin ωt is no state, so its extremes are none of the flow's. Here the drive becomes
two states (sin ωt, cos ωt), and x takes the place of z: a system of the same modes without a drive,
whose flow refines the extremes of x as it does those of z.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from designer.base.arrays import Array
from designer.dynamics import step_budget
from designer.dynamics.flow import Flow, FlowStatus
from designer.dynamics.orbit import Orbit
from designer.dynamics.piecewise_linear import Drive, Guard, Mode, ModeKey, PiecewiseLinearSystem
from designer.dynamics.step_budget import Budget

OPEN_PERIODS = 200
"""Drive periods over which a motion without a period is measured."""


def absolute_extremes(flow: Flow, orbit: Orbit, ground: Array) -> Array:
    """(states, 2) least and greatest x = z + ground · sin ωt along an orbit of ``flow``.

    ground : (states,) amplitude of the ground's displacement in each state's unit; 0 for a state
    that it does not move. (0, 2) of an orbit that has no extremes.
    """
    if not len(orbit.extremes) or not ground.any():
        return orbit.extremes
    moved = Flow(_with_drive(flow, ground), Drive(flow.drive.omega), fast=False)
    start = np.concatenate([orbit.start, [0.0, 1.0]])
    with moved.within(Budget(step_budget.SETTLING)):
        run = moved.run(start, orbit.n or OPEN_PERIODS, mode=orbit.mode or None, measure=True)
    if run.status is not FlowStatus.DONE:
        return np.zeros((0, 2))
    return np.asarray(run.extremes[:-2])


def _with_drive(flow: Flow, ground: Array) -> PiecewiseLinearSystem:
    """The system of the states (z + ground sin ωt, sin ωt, cos ωt); it counts no impacts."""
    system, drive, n = flow.system, flow.drive, flow.system.size

    def build(key: ModeKey) -> Mode:
        mode = system.mode(key)
        A = np.zeros((n + 2, n + 2))
        A[:n, :n] = mode.A
        A[:n, n] = drive.amplitude * mode.B - mode.A @ ground
        A[:n, n + 1] = drive.omega * ground
        A[n, n + 1], A[n + 1, n] = drive.omega, -drive.omega
        d = np.concatenate([mode.d + drive.offset * mode.B, [0.0, 0.0]])
        guards = tuple(_guard(g, drive, ground) for g in mode.guards)
        return Mode(A, np.zeros(n + 2), d, guards, sides=())

    return replace(
        system,
        states=(*system.states, "sin", "cos"),
        build=build,
        clearances=(),
        displacement=(),
        velocity=(),
        mirror=None,
        working=(),
        _modes={},
    )


def _guard(guard: Guard, drive: Drive, ground: Array) -> Guard:
    on_sine = drive.amplitude * guard.D - float(guard.C @ ground)
    return Guard(
        np.concatenate([guard.C, [on_sine, 0.0]]),
        0.0,
        guard.e + drive.offset * guard.D,
        guard.target,
    )
