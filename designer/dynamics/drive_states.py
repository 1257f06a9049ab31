"""A drive as two more states, its sine and its cosine.

The system then runs by itself: it can be started at any phase of the drive, and a coordinate may
move with the drive.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from designer.dynamics.piecewise_linear import Drive, Mode, ModeKey, PiecewiseLinearSystem


def with_drive_states(system: PiecewiseLinearSystem, drive: Drive) -> PiecewiseLinearSystem:
    """The system with sin ωt and cos ωt as its last two states.

    They carry the drive's amplitude: what is left of it, ``Drive(omega, 0.0, drive.offset)``, is
    what the system is run with.
    """
    n, swing = system.size, drive.amplitude

    def build(key: ModeKey) -> Mode:
        mode = system.mode(key)
        A = np.zeros((n + 2, n + 2))
        A[:n, :n] = mode.A
        A[:n, n] = swing * mode.B
        A[n, n + 1], A[n + 1, n] = drive.omega, -drive.omega
        guards = tuple(replace(g, C=np.concatenate([g.C, [g.D * swing, 0.0]])) for g in mode.guards)
        B, d = (np.concatenate([vector, np.zeros(2)]) for vector in (mode.B, mode.d))
        return replace(mode, A=A, B=B, d=d, guards=guards)

    return PiecewiseLinearSystem(
        states=(*system.states, "sine", "cosine"),
        build=build,
        start=system.start,
        clearances=system.clearances,
        displacement=tuple(np.insert(r, n, [swing * r[n], 0.0]) for r in system.displacement),
        velocity=tuple(np.insert(r, n, [0.0, swing * drive.omega * r[n]]) for r in system.velocity),
        continuous=system.continuous,
    )
