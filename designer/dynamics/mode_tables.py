"""Tables of the general kernel: Taylor terms of each mode and of its guards."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from scipy.linalg import matrix_balance

from designer.base.arrays import Array
from designer.dynamics.drive_shape import Shape
from designer.dynamics.piecewise_linear import Drive, Mode
from designer.kernels import kernel_general as kernel
from designer.kernels.kernel_algebra import all_rows_of_terms, exponential_terms, rows_of_terms

STEP = 0.5
"""‖A h‖ of one step, after balancing."""
ORDERS = np.arange(kernel.ORDER + 1.0)
CHORD = ORDERS * (ORDERS - 1.0) / 8.0
"""Entrywise |C M² exp(M t)| h²/8 over the step is k (k - 1) |c_k| / 8, plus the cut-off tail."""


def augmented(mode: Mode, drive: Drive, orders: Sequence[int] = ()) -> Array:
    """(N, N) M with z' = M z for z = (x, sin, cos, 1), and the sine and cosine of each harmonic."""
    n, more = len(mode.d), 2 * len(orders)
    M = np.zeros((n + 3 + more, n + 3 + more))
    M[:n, :n] = mode.A
    M[:n, n:] = np.outer(mode.B, drive_row(drive, orders))
    M[:n, n + 2] += mode.d
    if mode.second is not None:
        M[:n, n:] += np.outer(mode.second, second_row(drive, orders))
    M[n, n + 1] = drive.omega
    M[n + 1, n] = -drive.omega
    if mode.waves is not None:
        M[:n, n + 1] += drive.amplitude * mode.waves[:, 0]
        M[:n, n + 3 :] += drive.amplitude * mode.waves[:, 1:]
    for i, order in enumerate(orders):
        sine = n + 3 + 2 * i
        M[sine, sine + 1], M[sine + 1, sine] = order * drive.omega, -order * drive.omega
    return M


def augmented_state(x: Array, angle: float, orders: Sequence[int] = ()) -> Array:
    """(N,) z of the state x (n,) at the drive's phase ``angle``."""
    waves = [f(order * angle) for order in orders for f in (np.sin, np.cos)]
    return np.concatenate([x, [np.sin(angle), np.cos(angle), 1.0], waves])


def augmented_row(row: Array, drive: Drive, orders: Sequence[int] = ()) -> Array:
    """A row over (x, u, 1) as one over z."""
    ends = row[-2] * drive_row(drive, orders)
    ends[2] += row[-1]
    return np.concatenate([row[:-2], ends])


def drive_row(drive: Drive, orders: Sequence[int] = ()) -> Array:
    """(N - n,) the drive as a row over what z has beside the state."""
    row = _row(drive.amplitude, drive.shape, orders)
    row[2] = drive.offset
    return row


def second_row(drive: Drive, orders: Sequence[int] = ()) -> Array:
    """(N - n,) the second drive likewise; zero where there is none."""
    if drive.second is None:
        return np.zeros(3 + 2 * len(orders))
    return _row(drive.second.amplitude, drive.second.shape, orders)


def _row(amplitude: float, shape: Shape, orders: Sequence[int]) -> Array:
    row = np.zeros(3 + 2 * len(orders))
    for order, *waves in shape:
        first = 0 if order == 1 else 3 + 2 * list(orders).index(order)
        row[first : first + 2] = amplitude * np.array(waves)
    return row


def step_length(A: Array, omega: float) -> float:
    """Length of a step in a mode with the state matrix A. omega : of the drive's fastest wave."""
    return STEP / max(_balanced_norm(A.tobytes(), len(A)), omega)


@lru_cache(maxsize=256)
def _balanced_norm(entries: bytes, size: int) -> float:
    """The norm of a state matrix after balancing. It is kept, for flows along a curve differ in the
    drive."""
    A = np.frombuffer(entries).reshape(size, size)
    balanced, _ = matrix_balance(A, permute=False)
    return float(np.linalg.norm(balanced, 2))


def fill(
    tables: kernel.ModeTables,
    i: int,
    mode: Mode,
    touched: Sequence[Array | None],
    watched: Sequence[Array],
    drive: Drive,
    orders: Sequence[int] = (),
) -> None:
    """Write the tables of mode number i.

    touched : for each clearance the row of the displacement past the stop in contact.
    watched : rows of displacements that are no state.
    """
    M = augmented(mode, drive, orders)
    h = step_length(mode.A, drive.omega * max(orders, default=1))
    powers = tables.taylor[i]
    exponential_terms(M, h, powers)
    tables.step[i] = h
    tables.propagator[i] = powers[::-1].sum(axis=0)
    tables.guards[i] = len(mode.guards)
    tables.side[i] = mode.sides
    tables.clipped[i] = mode.clipped
    for j, past in enumerate(touched):
        if past is not None:
            rows_of_terms(augmented_row(past, drive, orders), powers, tables.depth[i, j])
    for r, row in enumerate(watched):
        rows_of_terms(augmented_row(row, drive, orders), powers, tables.watched[i, r])
    count, taylors = len(mode.guards), tables.guard[i]
    if count:
        C, D, e = mode.guard_rows
        ahead = np.column_stack([C, np.outer(D, drive_row(drive, orders))])
        ahead[:, C.shape[1] + 2] += e  # as of ``augmented_row``
        ahead[:, C.shape[1] :] += np.outer(mode.second_guards, second_row(drive, orders))
        all_rows_of_terms(ahead, powers, taylors)
        chords = np.einsum("k,gkj->gj", CHORD, np.abs(taylors[:count]))
        tables.chord[i, :count] = chords * (1.0 + 1e-9)
        tables.target[i, :count] = -1
        tables.clearance[i, :count] = [guard.clearance for guard in mode.guards]


def empty_tables(
    modes: int, guards: int, width: int, clearances: int, watched: int
) -> kernel.ModeTables:
    """Room for so many modes with so many guards each."""
    order = kernel.ORDER + 1
    return kernel.ModeTables(
        step=np.zeros(modes),
        propagator=np.zeros((modes, width, width)),
        taylor=np.zeros((modes, order, width, width)),
        guard=np.zeros((modes, guards, order, width)),
        chord=np.zeros((modes, guards, width)),
        guards=np.zeros(modes, dtype=np.int64),
        target=np.full((modes, guards), -1, dtype=np.int64),
        clearance=np.full((modes, guards), -1, dtype=np.int64),
        depth=np.zeros((modes, clearances, order, width)),
        watched=np.zeros((modes, watched, order, width)),
        side=np.zeros((modes, clearances), dtype=np.int64),
        clipped=np.zeros(modes, dtype=np.int64),
    )
