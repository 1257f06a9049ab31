"""Modes of many boards at once: those of the fast path, and where a board rests."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array, Mask
from designer.circuit.board_arrays import Boards
from designer.circuit.kernel_nodal import solve_all
from designer.circuit.netlist import Circuit
from designer.circuit.nodal import Exit, NodalEquations
from designer.dynamics import kernel_mode_tables as kernel
from designer.dynamics.piecewise_linear import ModeKey
from designer.dynamics.working_modes import STATES, empty_modes


def working_keys(circuit: Circuit) -> tuple[ModeKey, ...]:
    """Keys of the modes between which a good board moves: open, and on the way into each contact
    one switch after the other. None where the fast path does not fit."""
    if len(circuit.states) != STATES or len(circuit.stops) != 1:
        return ()
    names = circuit.switches
    keys = [circuit.open]
    for _, contact in circuit.stops[0].contacts:
        key = list(circuit.open)
        for switch, position in ((contact.switch, contact.position), *contact.others):
            key[names.index(switch)] = position
            keys.append(tuple(key))
    return tuple(keys) if len(keys) <= kernel.MODES and len(set(keys)) == len(keys) else ()


@dataclass(frozen=True)
class _SolvedMode:
    """A mode of N boards: (N, n, n + 2) rates of the states, the ways out, (N,) where it exists."""

    rates: Array
    exits: list[Exit]
    good: Mask


def _solved(equations: NodalEquations, key: ModeKey) -> _SolvedMode:
    G, right = equations.of(key)
    y, bad = np.zeros_like(right), np.zeros(len(right), dtype=np.int64)
    solve_all(G, right, y, bad)
    solution = equations.solution(y)
    rates, exits = equations.rates(solution), equations.exits(key, solution)
    good = (bad == 0) & np.isfinite(rates).all(axis=(1, 2))
    for way in exits:
        good &= np.isfinite(way.row).all(axis=1)
    return _SolvedMode(rates, exits, good)


def of_boards(boards: Boards) -> tuple[kernel.Modes | None, Mask]:
    """The working modes of N boards, and which boards (N,) have them all."""
    keys = working_keys(boards.circuit)
    if not keys:
        return None, np.zeros(len(boards), dtype=np.bool_)
    equations = NodalEquations(boards.circuit, boards.stacked)
    modes = [_solved(equations, key) for key in keys]
    out = empty_modes(len(boards), len(keys), max(len(mode.exits) for mode in modes))
    # How far past a stop: what rest says of it.
    beyond = {equations.sides(e.target)[0]: e.row for e in modes[0].exits if e.clearance == 0}
    for k, (key, mode) in enumerate(zip(keys, modes, strict=True)):
        out.A[:, k], out.B[:, k] = mode.rates[..., :STATES], mode.rates[..., STATES]
        out.d[:, k] = mode.rates[..., STATES + 1]
        out.guards[k], out.side[k] = len(mode.exits), equations.sides(key)[0]
        if out.side[k]:
            out.past[:, k] = beyond[int(out.side[k])]
        for g, way in enumerate(mode.exits):
            out.guard[:, k, g] = way.row
            out.target[k, g] = keys.index(way.target) if way.target in keys else -1
            out.begins[k, g] = way.clearance >= 0
    return out, np.logical_and.reduce([mode.good for mode in modes])


def at_rest(boards: Boards) -> tuple[Array, Mapping[int, Array]]:
    """v1 (N,) [V] at which each board rests inside the clearance with the generator off, and v1 at
    which fv leaves zero, by side: 1 upper, -1 lower. nan for a board without a rest point."""
    circuit = boards.circuit
    equations, n = NodalEquations(circuit, boards.stacked), len(circuit.states)
    mode = _solved(equations, circuit.rest)
    A = np.where(mode.good[:, None, None], mode.rates[..., :n], np.eye(n))
    x = np.linalg.solve(A, -mode.rates[..., n + 1][..., None])[..., 0]
    j = circuit.states.index(circuit.stops[0].state) if circuit.stops else 0
    stops = {
        equations.sides(way.target)[0]: -way.row[..., n + 1] / way.row[..., j]
        for way in mode.exits
        if way.clearance == 0
    }
    return np.where(mode.good, x[:, j], np.nan), stops
