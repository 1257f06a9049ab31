"""The working modes of one piecewise-linear system, as the compiled fast path takes them."""

from __future__ import annotations

import numpy as np

from designer.base.arrays import Array, Index
from designer.dynamics import kernel_mode_tables as kernel
from designer.dynamics.kernel_boards import POINTS, Anchors
from designer.dynamics.kernel_orbit import DONE
from designer.dynamics.piecewise_linear import Drive, PiecewiseLinearSystem

STATES = 4


def of_system(system: PiecewiseLinearSystem) -> kernel.Modes | None:
    """The working modes of one system; None where it has none, or more than the tables hold."""
    keys = system.working
    if not keys:
        return None
    try:
        modes = [system.mode(key) for key in keys]
    except ArithmeticError:  # with ideal op-amps nothing closes the loop between two diodes
        return None
    most = max(len(mode.guards) for mode in modes)
    out = empty_modes(1, len(keys), most)
    for k, mode in enumerate(modes):
        out.A[0, k], out.B[0, k], out.d[0, k] = mode.A, mode.B, mode.d
        out.guards[k], out.side[k] = len(mode.guards), mode.sides[0]
        if mode.sides[0]:
            out.past[0, k] = system.contact_rows(0)[mode.sides[0]]
        for g, guard in enumerate(mode.guards):
            out.guard[0, k, g] = np.concatenate([guard.C, [guard.D, guard.e]])
            out.target[k, g] = keys.index(guard.target) if guard.target in keys else -1
            out.begins[k, g] = guard.clearance >= 0
    return out


def tables(system: PiecewiseLinearSystem, drive: Drive) -> tuple[Array, Index] | None:
    """Tables (K, WIDTH) and (K, INTS) of one system under one drive; None where they do not fit."""
    modes = of_system(system)
    if modes is None:
        return None
    data = np.zeros((len(system.working), kernel.WIDTH))
    ints = np.zeros((len(system.working), kernel.INTS), dtype=np.int64)
    code = kernel.fill(data, ints, modes, 0, drive.omega, drive.amplitude, drive.offset)
    return (data, ints) if code == DONE else None


def anchors(points: int) -> Array:
    """(points, 2) sine and cosine of the drive at the start of each stretch of a period."""
    phases = 2.0 * np.pi * np.arange(points) / points
    return np.stack([np.sin(phases), np.cos(phases)], axis=1)


ANCHORS = Anchors(anchors(1), anchors(32), anchors(POINTS))


def empty_modes(boards: int, modes: int, guards: int) -> kernel.Modes:
    return kernel.Modes(
        A=np.zeros((boards, modes, STATES, STATES)),
        B=np.zeros((boards, modes, STATES)),
        d=np.zeros((boards, modes, STATES)),
        guard=np.zeros((boards, modes, guards, STATES + 2)),
        past=np.zeros((boards, modes, STATES + 2)),
        target=np.full((modes, guards), -1, dtype=np.int64),
        begins=np.zeros((modes, guards), dtype=np.int64),
        guards=np.zeros(modes, dtype=np.int64),
        side=np.zeros(modes, dtype=np.int64),
    )
