"""Where a board rests with the generator off."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from designer.base.arrays import Array
from designer.circuit.board_arrays import Boards
from designer.circuit.kernel_nodal import solve_all
from designer.circuit.nodal import NodalEquations, stacked


def at_rest(boards: Boards) -> tuple[Array, Mapping[int, Array]]:
    """v1 (N,) [V] at which each board rests inside the clearance with the generator off, and v1 at
    which fv leaves zero, by side: 1 upper, -1 lower. nan for a board without a rest point."""
    circuit = boards.circuit
    equations, key, n = NodalEquations(circuit, stacked(boards)), circuit.rest, len(circuit.states)
    G, right = equations.of(key)
    y, bad = np.zeros_like(right), np.zeros(len(boards), dtype=np.int64)
    solve_all(G, right, y, bad)
    solved = equations.solution(y)
    rows = equations.rates(solved)
    singular = (bad != 0) | ~np.isfinite(rows).all(axis=(1, 2))
    A = np.where(singular[:, None, None], np.eye(n), rows[..., :n])
    x = np.linalg.solve(A, -rows[..., n + 1][..., None])[..., 0]
    if not circuit.stops:
        return np.where(singular, np.nan, x[:, 0]), {}
    j = circuit.states.index(circuit.stops[0].state)
    ways = [e for e in equations.exits(key, solved) if e.clearance == 0]
    stops = {equations.sides(e.target)[0]: -e.row[..., n + 1] / e.row[..., j] for e in ways}
    return np.where(singular, np.nan, x[:, j]), stops
