"""Modes of many boards at once: those of the fast path, and where a board rests."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array, Index, Mask
from designer.circuit.board_arrays import Boards
from designer.circuit.kernel_nodal import solve_all
from designer.circuit.netlist import Circuit
from designer.circuit.nodal import Exit, NodalEquations
from designer.circuit.nodal_bandwidth import LaggingEquations
from designer.dynamics.piecewise_linear import Guard, Mode, ModeKey, motion_of_states
from designer.dynamics.working_modes import GuardTargets, empty_modes, grown
from designer.kernels import kernel_mode_tables as kernel


def first_keys(circuit: Circuit) -> tuple[ModeKey, ...]:
    """Keys of the working modes in which at most one clearance is not open: others are solved for
    the boards that enter them."""

    def moved(key: ModeKey) -> int:
        pairs = zip(circuit.switches, key, circuit.open, strict=True)
        turned = {name for name, here, there in pairs if here != there}
        return sum(not turned.isdisjoint(stop.switches) for stop in circuit.dead_zones)

    return tuple(key for key in circuit.working if moved(key) <= 1)


SINGULAR, ON_A_GUARD = 1e-12, 1e-9
"""Determinant of scaled rates below which a mode has no rest point; volts past a guard that are
rounding."""


@dataclass(frozen=True)
class _SolvedMode:
    """A mode of N boards: (N, n, n + 2) rates of the states, the ways out, (N,) where it exists."""

    rates: Array
    exits: list[Exit]
    voltage: Mapping[str, Array]
    good: Mask


def _solved(equations: NodalEquations, key: ModeKey) -> _SolvedMode:
    solution = equations.solved(key, _all_solved)
    rates, exits = equations.rates(key, solution), equations.exits(key, solution)
    good = np.asarray(np.isfinite(rates).all(axis=(1, 2)))
    for way in exits:
        good &= np.isfinite(way.row).all(axis=1)
    return _SolvedMode(rates, exits, solution.voltage, good)


def _all_solved(G: Array, right: Array, key: ModeKey) -> Array:
    """y of all boards; nan where a board's equations have no unique answer."""
    y, bad = np.zeros_like(right), np.zeros(len(right), dtype=np.int64)
    solve_all(G, right, y, bad)
    y[bad != 0] = np.nan
    return y


@dataclass(frozen=True)
class ModeRows:
    """What holds in a mode of N boards, over (states, generator, 1)."""

    rates: Array
    """(N, n, n + 2) rows of the rates of the n states."""
    rows: Array
    """(N, nets, n + 2) rows of the voltages [V] of some nets."""


def mode_rows(boards: Boards, key: ModeKey, nets: Sequence[str]) -> ModeRows:
    """The rows of a mode of these boards; nan for a board whose equations have no unique answer
    there."""
    mode = _solved(_equations(boards), key)
    return ModeRows(mode.rates, np.stack([mode.voltage[net] for net in nets], axis=1))


def _equations(boards: Boards, channel: int = 0) -> NodalEquations:
    if boards.bandwidth:
        return LaggingEquations(boards.circuit, boards.stacked, _all_solved, channel=channel)
    return NodalEquations(boards.circuit, boards.stacked, channel=channel)


class BoardModes:
    """Some of the working modes of N boards, in the form of the fast path.

    channel : of the generator, that drives them.
    """

    def __init__(self, boards: Boards, channel: int = 0) -> None:
        circuit, self._boards, self._channel = boards.circuit, boards, channel
        self.targets = GuardTargets(circuit.working)
        between = [c for c, stop in enumerate(circuit.stops) if stop.difference is not None]
        self.modes = empty_modes(
            len(boards), 0, len(circuit.states), len(circuit.stops), 0, between
        )
        self._beyond: dict[tuple[int, int], Array] = {}
        self.add(first_keys(circuit))

    @property
    def good(self) -> Mask:
        """(N,) which boards have all of these modes."""
        return np.asarray(self.modes.good.all(axis=1))

    def take(self, which: Index) -> BoardModes:
        """The modes of some boards, for themselves: what is added to them is not added here."""
        out = object.__new__(BoardModes)
        out._channel = self._channel
        out._boards, out.targets = self._boards.take(which), self.targets.copy()
        parts = {name: getattr(self.modes, name)[which] for name in OF_EACH}
        rest = {
            name: value.copy()
            for name, value in self.modes._asdict().items()
            if name not in OF_EACH
        }
        out.modes = kernel.Modes(**parts, **rest)
        out._beyond = {side: row[which] for side, row in self._beyond.items()}
        return out

    @classmethod
    def joined(cls, boards: Boards, parts: Sequence[BoardModes]) -> BoardModes:
        """The modes of all boards together; all parts have the same modes."""
        out = parts[0].take(np.arange(0))
        out._boards = boards
        of_each = {
            name: np.concatenate([getattr(part.modes, name) for part in parts]) for name in OF_EACH
        }
        out.modes = out.modes._replace(**of_each)
        out._beyond = {
            side: np.concatenate([part._beyond[side] for part in parts])
            for side in parts[0]._beyond
        }
        return out

    def enter(self, keys: Iterable[ModeKey]) -> None:
        """Solve these working modes, and those on the way into the same contacts: a board that
        enters one of them mostly enters the others."""
        ways = self._boards.circuit.ways_in
        groups = (next((way for way in ways if key in way), frozenset()) for key in keys)
        self.add(sorted(frozenset().union(*groups)))

    def alone(self, board: int, second_drive: BoardModes | None = None) -> dict[ModeKey, Mode]:
        """The modes of one board in the form of the general kernel. second_drive : those of the
        generator's second channel."""
        own, n = self.modes, self.modes.A.shape[-1]
        out = {}
        for k, key in enumerate(self.targets.keys):
            if not own.good[board, k] or (
                second_drive is not None and not second_drive.modes.good[board, k]
            ):
                continue
            count = int(own.guards[k])
            rows = own.guard[board, k, :count]
            second = (
                np.zeros(count)
                if second_drive is None
                else second_drive.modes.guard[board, k, :count, n]
            )
            guards = tuple(
                Guard(
                    rows[g, :n].copy(),
                    float(rows[g, n]),
                    float(rows[g, n + 1]),
                    self.targets.beyond(k, g),
                    int(own.clearance[k, g]),
                    float(second[g]),
                )
                for g in range(count)
            )
            out[key] = Mode(
                own.A[board, k].copy(),
                own.B[board, k].copy(),
                own.d[board, k].copy(),
                guards,
                tuple(own.side[k].tolist()),
                second=None if second_drive is None else second_drive.modes.B[board, k].copy(),
            )
        return out

    def enter_all(self) -> bool:
        """Solve all working modes; returns whether one was not there yet."""
        before = len(self.targets.keys)
        self.add(self._boards.circuit.working)
        return len(self.targets.keys) > before

    def add(self, keys: Iterable[ModeKey]) -> None:
        """Solve further modes; those that are there already are left as they are."""
        new = [key for key in keys if key not in self.targets.numbers]
        if not new:
            return
        equations = _equations(self._boards, self._channel)
        solved = [_solved(equations, key) for key in new]
        most = max((len(mode.exits) for mode in solved), default=0)
        self.modes = grown(self.modes, len(self.targets.keys) + len(new), most)
        for key, mode in zip(new, solved, strict=True):
            self._write(equations, key, mode)

    def _move(self, mode: _SolvedMode) -> None:
        """Displacement and velocity in each clearance, as ``Reduction.system`` has them."""
        circuit, out = self._boards.circuit, self.modes
        n = len(circuit.states)
        moving = [circuit.states.index(stop.state) for stop in circuit.stops]
        rows = zip(*motion_of_states(n, moving), strict=True)
        for c, (displacement, velocity) in enumerate(rows):
            out.displacement[:, c], out.velocity[:, c] = displacement, velocity
        for c, (stop, i) in enumerate(zip(circuit.stops, moving, strict=True)):
            if stop.difference is not None:
                net, sign = stop.difference
                row = sign * mode.voltage[net]
                A = mode.rates[..., :n]
                out.displacement[:, c] = row
                out.velocity[:, c, :n] = np.einsum("...i,...ij->...j", row[..., :n], A)
                out.velocity[:, c, :n] /= A[..., i, i + 1][..., None]
                out.velocity[:, c, n] = row[..., n]

    def _write(self, equations: NodalEquations, key: ModeKey, mode: _SolvedMode) -> None:
        out, n = self.modes, mode.rates.shape[1]
        if not self.targets.keys:  # the open mode says how far a displacement is past a stop
            self._move(mode)
            self._beyond = {
                (e.clearance, equations.sides(e.target)[e.clearance]): e.row
                for e in mode.exits
                if e.clearance >= 0
            }
        k = self.targets.add(out, key, [way.target for way in mode.exits])
        out.A[:, k], out.B[:, k] = mode.rates[..., :n], mode.rates[..., n]
        out.d[:, k], out.good[:, k] = mode.rates[..., n + 1], mode.good
        out.side[k] = equations.sides(key)
        for c, side in enumerate(equations.sides(key)):
            if side:
                out.past[:, k, c] = self._beyond[c, side]
        for g, way in enumerate(mode.exits):
            out.guard[:, k, g], out.clearance[k, g] = way.row, way.clearance


OF_EACH = ("A", "B", "quadrature", "d", "guard", "past", "good", "displacement", "velocity")
"""What of ``kernel.Modes`` has an axis of boards."""


def at_rest(boards: Boards, clearance: int = 0) -> tuple[Array, Mapping[int, Array]]:
    """Displacement (N,) [V] in a clearance at which each board rests with the generator off, open
    or against a preloaded stop, and the displacement at which the stage's output leaves zero, by
    side: 1 upper, -1 lower. nan for a board without a rest point. Without clearances that of the
    first mass, and no side.

    clearance : its index. Of one between two masses the displacement is the voltage of its
    difference amplifier.
    """
    circuit = boards.circuit
    equations, n = NodalEquations(circuit, boards.stacked), len(circuit.states)
    mode = _solved(equations, circuit.rest)
    still = mode if circuit.rest == circuit.open else _solved(equations, circuit.open)
    A = np.where(mode.good[:, None, None], mode.rates[..., :n], np.eye(n))
    x = np.linalg.solve(A, -mode.rates[..., n + 1][..., None])[..., 0]
    row = _displacement(circuit, still, clearance)
    moved = (row[..., :n] * x).sum(axis=-1) + row[..., n + 1]
    stops = {}
    for way in still.exits:
        if way.clearance == clearance:  # scaled to displacement: side · displacement + a constant
            side = equations.sides(way.target)[clearance]
            stops[side] = row[..., n + 1] - side * way.row[..., n + 1]
    return np.where(mode.good, moved, np.nan), stops


def resting_voltages(boards: Boards, nets: Sequence[str]) -> Array:
    """(N, nets) voltages [V] at which each board rests with the generator off, in whichever working
    mode that is; nan for a board without a rest point in any of them."""
    circuit = boards.circuit
    equations, n = _equations(boards), len(circuit.states)
    out = np.full((len(boards), len(nets)), np.nan)
    left = np.ones(len(boards), dtype=bool)
    for key in dict.fromkeys([circuit.rest, circuit.open, *circuit.working]):
        if not left.any():
            break
        mode = _solved(equations, key)
        regular = mode.good & (np.abs(np.linalg.det(_scaled(mode.rates[..., :n]))) > SINGULAR)
        A = np.where(regular[:, None, None], mode.rates[..., :n], np.eye(n))
        x = np.linalg.solve(A, -mode.rates[..., n + 1][..., None])[..., 0]
        holds = left & regular
        for way in mode.exits:
            holds &= (way.row[..., :n] * x).sum(axis=-1) + way.row[..., n + 1] <= ON_A_GUARD
        rows = np.stack([mode.voltage[net] for net in nets], axis=1)
        volts = np.einsum("bkn,bn->bk", rows[..., :n], x) + rows[..., n + 1]
        out[holds] = volts[holds]
        left &= ~holds
    return out


def _scaled(A: Array) -> Array:
    """Matrices with rows of length 1, so that a determinant says how near to singular they are."""
    lengths = np.linalg.norm(A, axis=-1, keepdims=True)
    return np.asarray(np.divide(A, lengths, out=np.zeros_like(A), where=lengths > 0.0))


def _displacement(circuit: Circuit, still: _SolvedMode, clearance: int) -> Array:
    """(..., n + 2) row of the displacement in a clearance over (states, drive, 1)."""
    n = len(circuit.states)
    if not circuit.stops:
        return np.asarray(np.eye(1, n + 2)[0])
    stop = circuit.stops[clearance]
    if stop.difference is None:
        return np.asarray(np.eye(1, n + 2, circuit.states.index(stop.state))[0])
    net, sign = stop.difference
    return np.asarray(sign * still.voltage[net])
