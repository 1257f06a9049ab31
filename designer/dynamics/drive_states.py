"""A drive as more states: its sine and its cosine, then those of its harmonics.

The system then runs by itself: it can be started at any phase of the drive, and a coordinate may
move with the drive.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from designer.dynamics.piecewise_linear import Drive, Mode, ModeKey, PiecewiseLinearSystem


def with_drive_states(system: PiecewiseLinearSystem, drive: Drive) -> PiecewiseLinearSystem:
    """The system with sin ωt and cos ωt as its last two states, then those of each harmonic.

    They carry the drive's amplitude: what is left of it, ``Drive(omega, 0.0, drive.offset)``, is
    what the system is run with.
    """
    n, swing, orders = system.size, drive.amplitude, system.orders or ()
    more = 2 + 2 * len(orders)

    def build(key: ModeKey) -> Mode:
        mode = system.mode(key)
        A = np.zeros((n + more, n + more))
        A[:n, :n] = mode.A
        A[:n, n] = swing * mode.B
        if mode.waves is not None:
            A[:n, n + 1 :] = swing * mode.waves
        for i, order in enumerate((1, *orders)):
            sine = n + 2 * i
            A[sine, sine + 1], A[sine + 1, sine] = order * drive.omega, -order * drive.omega
        none = np.zeros(more - 1)
        guards = tuple(
            replace(g, C=np.concatenate([g.C, [g.D * swing], none])) for g in mode.guards
        )
        B, d = (np.concatenate([vector, np.zeros(more)]) for vector in (mode.B, mode.d))
        return replace(mode, A=A, B=B, d=d, guards=guards, waves=None)

    names = (f"{wave} {order}" for order in orders for wave in ("sine", "cosine"))
    at, rate = [0.0] * (more - 1), [0.0] * (more - 2)

    return PiecewiseLinearSystem(
        states=(*system.states, "sine", "cosine", *names),
        build=build,
        start=system.start,
        clearances=system.clearances,
        displacement=tuple(np.insert(r, n, [swing * r[n], *at]) for r in system.displacement),
        velocity=tuple(
            np.insert(r, n, [0.0, swing * drive.omega * r[n], *rate]) for r in system.velocity
        ),
        continuous=system.continuous,
    )
