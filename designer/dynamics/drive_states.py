"""A drive as more states: its sine and its cosine, then those of its harmonics.

The system then runs by itself: it can be started at any phase of the drive, and a coordinate may
move with the drive.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from designer.dynamics.mode_tables import drive_row, second_row
from designer.dynamics.piecewise_linear import Drive, Mode, ModeKey, PiecewiseLinearSystem


def with_drive_states(system: PiecewiseLinearSystem, drive: Drive) -> PiecewiseLinearSystem:
    """The system with sin ωt and cos ωt as its last two states, then those of each harmonic.

    They carry the drive's amplitude: what is left of it, ``Drive(omega, 0.0, drive.offset)``, is
    what the system is run with.
    """
    n, orders = system.size, system.orders or drive.orders
    more = 2 + 2 * len(orders)
    drives, others = (np.delete(row(drive, orders), 2) for row in (drive_row, second_row))
    speeds = np.repeat([1, *orders], 2) * drive.omega
    # A sine's rate is a cosine, a cosine's a sine turned over.
    rate = np.empty(more)
    rate[1::2], rate[0::2] = speeds[0::2] * drives[0::2], -speeds[1::2] * drives[1::2]

    def build(key: ModeKey) -> Mode:
        mode = system.mode(key)
        A = np.zeros((n + more, n + more))
        A[:n, :n] = mode.A
        A[:n, n:] = np.outer(mode.B, drives)
        if mode.second is not None:
            A[:n, n:] += np.outer(mode.second, others)
        if mode.waves is not None:
            A[:n, n + 1 :] += drive.amplitude * mode.waves
        for i, order in enumerate((1, *orders)):
            sine = n + 2 * i
            A[sine, sine + 1], A[sine + 1, sine] = order * drive.omega, -order * drive.omega
        guards = tuple(
            replace(g, C=np.concatenate([g.C, g.D * drives + g.second * others]), second=0.0)
            for g in mode.guards
        )
        B, d = (np.concatenate([vector, np.zeros(more)]) for vector in (mode.B, mode.d))
        return replace(mode, A=A, B=B, d=d, guards=guards, waves=None, second=None)

    names = (f"{wave} {order}" for order in orders for wave in ("sine", "cosine"))

    return PiecewiseLinearSystem(
        states=(*system.states, "sine", "cosine", *names),
        build=build,
        start=system.start,
        clearances=system.clearances,
        displacement=tuple(np.insert(r, n, r[n] * drives) for r in system.displacement),
        velocity=tuple(np.insert(r, n, r[n] * rate) for r in system.velocity),
        continuous=system.continuous,
        working=system.working,
    )
