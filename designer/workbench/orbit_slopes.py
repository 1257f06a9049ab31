"""How a board's orbit moves with the board: its linear variation, all coordinates at once.

Along the orbit x(t) of x' = f(x, t, z), the derivative by a coordinate z_k obeys

    y' = A y + ∂f/∂z_k,

with A and ∂f/∂z_k of the mode that holds. Where a mode begins f is continuous, so y is as well, and
what a coordinate does to a stop is in ∂f/∂z_k of the contact. Steps are those of the orbit's grid:
A by its exponential, ∂f/∂z_k by the trapezoidal rule, a step with an entry or exit shared between
both modes. The orbit's own y closes after n periods.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from designer.base.arrays import Array, Index
from designer.circuit.board_modes import ModeRows, mode_rows
from designer.circuit.netlist import Excitation
from designer.circuit.nodal_bandwidth import swinging_sections
from designer.workbench.board_orbits import POINTS, NetOrbit, whole_states
from designer.workbench.board_prior import PROBE, Prior

TERMS = 12
"""Of Taylor's series of an exponential: 1e-12 where the matrix has a norm of a half."""


@dataclass(frozen=True)
class OrbitSlopes:
    """Derivatives of an orbit by the K coordinates of the board and by the generator's amplitude
    over what it is, which stands last."""

    volts: Array
    """(n · POINTS, nets, K + 1) of its nets' voltages [V]."""
    start: Array
    """(states, K + 1) of its start."""


def orbit_slopes(
    prior: Prior, z: Array, orbit: NetOrbit, excitation: Excitation, nets: tuple[str, ...]
) -> OrbitSlopes:
    """The slopes of the orbit of the board at z (K,) under this setting.

    Where op-amps drive diodes, their lag is left out of the slopes (not of the orbit).
    """
    circuit = prior.circuit
    boards = prior.boards(np.vstack([z, z + PROBE * np.eye(len(z))]))
    sides, which = np.unique(orbit.sides, axis=0, return_inverse=True)
    keys = [circuit.in_contact(each.tolist()) for each in sides]
    if swinging_sections(circuit):
        boards = replace(boards, bandwidth=False)
    modes = [mode_rows(boards, key, nets) for key in keys]
    whole = whole_states(orbit.states[:, : len(circuit.states)], excitation)
    which = which.reshape(-1)
    moved = _variation(modes, which, orbit, whole, excitation)
    volts = np.empty((len(which), len(nets), len(z) + 1))
    for k, mode in enumerate(modes):
        here = which == k
        rows = mode.rows[:, :, :-2]
        volts[here] = np.einsum("ni,mik->mnk", rows[0], moved[here])
        volts[here, :, :-1] += np.einsum("knj,mj->mnk", _change(mode.rows), whole[here])
    more = np.zeros((len(orbit.start) - moved.shape[1], len(z) + 1))
    return OrbitSlopes(volts, np.vstack([moved[0], more]))


def _change(rows: Array) -> Array:
    """(K, ...) derivatives of rows (1 + K, ...) of a board and of those beside it."""
    return np.asarray((rows[1:] - rows[0]) / PROBE)


def _variation(
    modes: list[ModeRows], which: Index, orbit: NetOrbit, whole: Array, excitation: Excitation
) -> Array:
    """(m, states, K + 1) derivatives of the states along the orbit."""
    steps, step = len(which), 1.0 / (excitation.frequency * POINTS)
    n, count = modes[0].rates.shape[1], len(modes[0].rates)
    force = np.zeros((steps, n, count + n))
    for k, mode in enumerate(modes):
        here = which == k
        force[here, :, : count - 1] = np.einsum("kij,mj->mik", _change(mode.rates), whole[here])
        swing = whole[here, n] - excitation.offset
        force[here, :, count - 1] = swing[:, None] * mode.rates[0, :, n]
    after = np.roll(which, -1)
    share = _shares(orbit)
    A = np.stack([mode.rates[0, :, :n] for mode in modes])
    held, at = np.unique(np.column_stack([which, after, share]), axis=0, return_inverse=True)
    first, last, part = held[:, 0].astype(int), held[:, 1].astype(int), held[:, 2, None, None]
    jumps = _exponentials(step * (part * A[first] + (1.0 - part) * A[last]))[at.reshape(-1)]
    # The last n columns are the free motion from each unit vector: the matrix of the whole lap.
    path = np.zeros((steps + 1, n, count + n))
    path[0, :, count:] = np.eye(n)
    for j in range(steps):
        path[j + 1] = jumps[j] @ (path[j] + step * share[j] * force[j])
        path[j + 1] += step * (1.0 - share[j]) * force[(j + 1) % steps]
    lap = path[steps]
    start = np.linalg.solve(np.eye(n) - lap[:, count:], lap[:, :count])
    return np.asarray(path[:steps, :, :count] + path[:steps, :, count:] @ start)


def _exponentials(A: Array) -> Array:
    """(k, n, n) exponentials of small matrices (k, n, n), by Taylor's series of them divided by a
    power of two, then squared: SciPy's, made for large ones, takes a thousand times as long."""
    halvings = max(0, math.ceil(math.log2(max(float(np.abs(A).sum(axis=2).max()), 1e-300))) + 1)
    small, out = A / 2.0**halvings, np.eye(A.shape[1])
    for order in range(TERMS, 0, -1):
        out = np.eye(A.shape[1]) + small @ out / order
    for _ in range(halvings):
        out = out @ out
    return out


def _shares(orbit: NetOrbit) -> Array:
    """(m,) how much of each step of the grid its first mode holds; a half where it does not
    change."""
    share = np.full(len(orbit.sides), 0.5)
    after, ahead = np.roll(orbit.sides, -1, axis=0), np.roll(orbit.beyond, -1, axis=0)
    for j, c in zip(*np.nonzero(after != orbit.sides), strict=True):
        side = orbit.sides[j, c] or after[j, c]
        k = 0 if side > 0 else 1
        here, there = orbit.beyond[j, c, k], ahead[j, c, k]
        share[j] = float(np.clip(here / (here - there), 0.0, 1.0)) if here != there else 0.5
    return share
