"""Set-up of the fast path of circuits: the working modes of one board, or of many at once."""

from __future__ import annotations

import numpy as np

from designer.base.arrays import Mask
from designer.circuit.board_arrays import Boards
from designer.circuit.kernel_nodal import solve_all
from designer.circuit.netlist import Circuit
from designer.circuit.nodal import NodalEquations, stacked
from designer.dynamics import kernel_four_state as kernel
from designer.dynamics.piecewise_linear import ModeKey
from designer.dynamics.working_modes import STATES, empty_modes


def working_keys(circuit: Circuit) -> tuple[ModeKey, ...]:
    """Keys of the modes between which a good board moves: at rest, and on the way into each contact
    one switch after the other. None where the fast path does not fit."""
    if len(circuit.states) != STATES or len(circuit.stops) != 1:
        return ()
    names = circuit.switches
    keys = [circuit.rest]
    for _, contact in circuit.stops[0].contacts:
        key = list(circuit.rest)
        for switch, position in ((contact.switch, contact.position), *contact.others):
            key[names.index(switch)] = position
            keys.append(tuple(key))
    return tuple(keys) if len(keys) <= kernel.MODES and len(set(keys)) == len(keys) else ()


def of_boards(boards: Boards) -> tuple[kernel.Modes | None, Mask]:
    """The working modes of N boards, and which boards (N,) have them all."""
    circuit, keys = boards.circuit, working_keys(boards.circuit)
    good = np.ones(len(boards), dtype=np.bool_)
    if not keys:
        return None, ~good
    equations = NodalEquations(circuit, stacked(boards))
    n = STATES
    parts = []
    bad = np.zeros(len(boards), dtype=np.int64)
    for key in keys:
        G, right = equations.of(key)
        y = np.zeros_like(right)
        solve_all(G, right, y, bad)
        good &= bad == 0
        solved = equations.solution(y)
        parts.append((equations.rates(solved), equations.exits(key, solved)))
    out = empty_modes(len(boards), len(keys), max(len(exits) for _, exits in parts))
    beyond = {}  # how far past a stop: what rest says of it
    for way in parts[0][1]:
        if way.clearance == 0:
            beyond[equations.sides(way.target)[0]] = way.row
    for k, (key, (rows, exits)) in enumerate(zip(keys, parts, strict=True)):
        out.A[:, k], out.B[:, k], out.d[:, k] = rows[..., :n], rows[..., n], rows[..., n + 1]
        out.guards[k], out.side[k] = len(exits), equations.sides(key)[0]
        if out.side[k]:
            out.past[:, k] = beyond[int(out.side[k])]
        for g, way in enumerate(exits):
            out.guard[:, k, g] = way.row
            out.target[k, g] = keys.index(way.target) if way.target in keys else -1
            out.begins[k, g] = way.clearance >= 0
    for array in (out.A, out.B, out.d, out.guard):
        good &= np.isfinite(array).all(axis=tuple(range(1, array.ndim)))
    return out, good
