"""Tables of the general kernel: Taylor terms of each mode and of its guards."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from scipy.linalg import matrix_balance

from designer.base.arrays import Array
from designer.dynamics.piecewise_linear import Drive, Mode
from designer.kernels import kernel_general as kernel
from designer.kernels.kernel_algebra import exponential_terms, rows_of_terms

STEP = 0.5
"""‖A h‖ of one step, after balancing."""
ORDERS = np.arange(kernel.ORDER + 1.0)
CHORD = ORDERS * (ORDERS - 1.0) / 8.0
"""Entrywise |C M² exp(M t)| h²/8 over the step is k (k - 1) |c_k| / 8, plus the cut-off tail."""


def augmented(mode: Mode, drive: Drive) -> Array:
    """(n + 3, n + 3) M with z' = M z for z = (x, sin, cos, 1)."""
    n = len(mode.d)
    M = np.zeros((n + 3, n + 3))
    M[:n, :n] = mode.A
    M[:n, n] = drive.amplitude * mode.B
    M[:n, n + 2] = mode.d + drive.offset * mode.B
    M[n, n + 1] = drive.omega
    M[n + 1, n] = -drive.omega
    return M


def augmented_row(row: Array, drive: Drive) -> Array:
    """A row over (x, u, 1) as one over (x, sin, cos, 1)."""
    C, D, e = row[:-2], row[-2], row[-1]
    return np.concatenate([C, [D * drive.amplitude, 0.0, e + D * drive.offset]])


def step_length(A: Array, omega: float) -> float:
    """Length of a step in a mode with the state matrix A."""
    return STEP / max(_balanced_norm(A.tobytes(), len(A)), omega)


@lru_cache(maxsize=256)
def _balanced_norm(entries: bytes, size: int) -> float:
    """Of a state matrix, after balancing; kept, for flows along a curve differ in the drive."""
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
) -> None:
    """Write the tables of mode number i.

    touched : for each clearance the row of the displacement past the stop in contact.
    watched : rows of displacements that are no state.
    """
    M = augmented(mode, drive)
    h = step_length(mode.A, drive.omega)
    powers = tables.taylor[i]
    exponential_terms(M, h, powers)
    tables.step[i] = h
    tables.propagator[i] = powers[::-1].sum(axis=0)
    tables.guards[i] = len(mode.guards)
    tables.side[i] = mode.sides
    tables.clipped[i] = mode.clipped
    for j, past in enumerate(touched):
        if past is not None:
            rows_of_terms(augmented_row(past, drive), powers, tables.depth[i, j])
    for r, row in enumerate(watched):
        rows_of_terms(augmented_row(row, drive), powers, tables.watched[i, r])
    count, taylors = len(mode.guards), tables.guard[i]
    if count:
        C, D, e = mode.guard_rows
        ahead = np.column_stack(
            [C, D * drive.amplitude, np.zeros(count), e + D * drive.offset]
        )  # as of ``augmented_row``
        for g in range(count):
            rows_of_terms(ahead[g], powers, taylors[g])
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
