"""The modified nodal equations of a board, or of many at once, and what is read from them.

Capacitors whose voltages are the states are voltage sources; one whose voltage follows from them
carries C times its rate, which the states' rates say and which moves these in turn, so both are
solved for together. Op-amps are either a virtual short
v+ - v- + offset = v_out/gain or, at a limit, a fixed output voltage. Diodes carry no current or
drop a constant voltage and that of their series resistance, without which a diode between two
op-amps' outputs would have no answer.

Whatever a board has may be one number or an array of N, one for each of N boards; then every
array here has a leading axis (N,).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from designer.base.arrays import Array
from designer.circuit.board_values import Board
from designer.circuit.netlist import GROUND, Circuit, Diode, Section, Stop
from designer.dynamics.piecewise_linear import ModeKey


@dataclass(frozen=True)
class Solution:
    """Linear functions of (states, generator, 1), each a row of length n + 2 for n states."""

    voltage: dict[str, Array]
    """Row of each net's voltage [V]."""
    current: dict[str, Array]
    """Row of the current [A] into each state capacitor and through each diode, by name."""
    output: dict[str, Array]
    """Row of the current [A] out of each op-amp section's output, by name."""


Solver = Callable[[Array, Array, ModeKey], Array]
"""y of G y = right for the mode of this key."""


@dataclass(frozen=True)
class Exit:
    """A way out of a mode."""

    row: Array
    """(..., n + 2) row over (states, generator, 1), positive past it."""
    target: ModeKey
    """Key of the mode beyond."""
    clearance: int
    """Index of the clearance whose contact begins or ends, or -1."""


class NodalEquations:
    """G y = right for each mode: y are the nets' voltages and the branches' currents.

    further : names of states beside the capacitors' voltages, which stand first. channel : of the
    generator, that the rows are over; the other is at 0 V.
    """

    def __init__(
        self, circuit: Circuit, board: Board, further: tuple[str, ...] = (), *, channel: int = 0
    ) -> None:
        self.circuit = circuit
        self._channel = channel
        self.board = board
        self.states = (*circuit.states, *further)
        self.lead = np.shape(board.inverse_gain)
        self._sections, self._diodes = circuit.sections, circuit.diodes
        self._moving = [circuit.states.index(stop.state) for stop in circuit.stops]
        self._nets = {net: i for i, net in enumerate(circuit.nets)}
        self._first = _layout(circuit, len(self._nets))
        self._number = {name: i for i, name in enumerate(circuit.switches)}
        self._sided: dict[ModeKey, tuple[int, ...]] = {}
        self._matrix, self._right = self._assemble()

    def of(self, key: ModeKey) -> tuple[Array, Array]:
        """(..., size, size) and (..., size, n + 2): G and right of a mode."""
        board = self.board
        G, right = self._matrix.copy(), self._right.copy()
        first = self._first
        amplifiers = len(self._sections)
        for row, (s, position) in enumerate(
            zip(self._sections, key[:amplifiers], strict=True), first["sections"]
        ):
            if position:
                G[..., row, self._nets[s.output]] = 1.0
                right[..., row, -1] = board.rails[s.name][1 if position > 0 else 0]
                continue
            for net, sign in ((s.noninverting, 1.0), (s.inverting, -1.0)):
                if net != GROUND:
                    G[..., row, self._nets[net]] += sign
            G[..., row, self._nets[s.output]] -= board.inverse_gain
            right[..., row, -1] = -np.asarray(board.offset.get(s.name, 0.0))
        for row, (d, position) in enumerate(
            zip(self._diodes, key[amplifiers:], strict=True), first["diodes"]
        ):
            if not position:
                G[..., row, row] = 1.0  # no current
                continue
            for net, sign in ((d.anode, 1.0), (d.cathode, -1.0)):
                if net != GROUND:
                    G[..., row, self._nets[net]] += sign
            G[..., row, row] = -d.model.resistance
            right[..., row, -1] = board.drop[d.name]
        return G, right

    def solved(self, key: ModeKey, solver: Solver) -> Solution:
        """What holds in a mode, its equations solved by ``solver``."""
        return self.answer(*self.of(key), key, solver)

    def answer(self, G: Array, right: Array, key: ModeKey, solver: Solver) -> Solution:
        """What holds where G y = right, with the currents of the dependent capacitors.

        Such a capacitor joins outputs, which its current does not move, to summing nodes, and the
        generator drives neither at once: so its voltage is a function of the states alone, of
        those that are capacitors' voltages.
        """
        dependent, n = self.circuit.dependent_capacitors, len(self.circuit.states)
        if not dependent:
            return self.solution(solver(G, right, key))
        columns = right.shape[-1]
        amperes = np.zeros((*right.shape[:-1], len(dependent)))
        for k, cap in enumerate(dependent):
            for net, sign in ((cap.plus, -1.0), (cap.minus, 1.0)):
                if net != GROUND:
                    amperes[..., self._nets[net], k] = sign
        y = solver(G, np.concatenate([right, amperes], axis=-1), key)
        wide = self.solution(y)
        rates = self.capacitor_rates(wide)
        farads = np.stack([np.asarray(self.board.values[cap.name]) for cap in dependent], axis=-1)
        across = np.stack(
            [wide.voltage[cap.plus] - wide.voltage[cap.minus] for cap in dependent], axis=-2
        )
        # i = C d/dt(across), and the rates are rates[known] + rates[own] i.
        slope = farads[..., None] * np.einsum("...ki,...ij->...kj", across[..., :n], rates)
        own = np.eye(len(dependent)) - slope[..., columns:]
        current = np.linalg.solve(own, slope[..., :columns])
        more = np.einsum("...yk,...kj->...yj", y[..., columns:], current)
        return self.solution(y[..., :columns] + more)

    def solution(self, y: Array) -> Solution:
        """y (..., size, n + 2) by names."""
        c, first = self.circuit, self._first
        voltage = {net: y[..., i, :] for net, i in self._nets.items()}
        voltage[GROUND] = np.zeros((*self.lead, y.shape[-1]))
        # The unknown is the current that leaves ``plus`` through the source: into the capacitor.
        amps = {cap: y[..., i, :] for i, cap in enumerate(c.states, first["states"])}
        amps |= {d.name: y[..., i, :] for i, d in enumerate(self._diodes, first["diodes"])}
        out = {s.name: -y[..., i, :] for i, s in enumerate(self._sections, first["sections"])}
        return Solution(voltage, amps, out)

    def rates(self, key: ModeKey, solved: Solution) -> Array:
        """(..., n, n + 2): how fast each state changes in a mode."""
        return self.capacitor_rates(solved)

    def capacitor_rates(self, solved: Solution) -> Array:
        """(..., c, n + 2): how fast the voltage of each of the c state capacitors changes."""
        values = self.board.values
        names = self.circuit.states
        rows = [solved.current[name] / np.asarray(values[name])[..., None] for name in names]
        return np.stack(rows, axis=-2)

    @property
    def mirror(self) -> Array:
        """(n, n) what x → -x, u → -u does to the states, where both stops are alike."""
        return -np.eye(len(self.states))

    def exits(self, key: ModeKey, solved: Solution) -> list[Exit]:
        """Every way out of a mode, those of contacts scaled to displacement."""
        n = len(self.states)
        sides = self.sides(key)
        touching = {contact.switch for s in self.circuit.stops for _, contact in s.contacts}
        ways: list[Exit] = []
        switches: tuple[Section | Diode, ...] = (*self._sections, *self._diodes)
        for i, switch in enumerate(switches):
            for row, to in self.leaving(key, switch, solved):
                target = (*key[:i], to, *key[i + 1 :])
                j = -1
                if switch.name in touching:
                    there = self.sides(target)
                    j = next((c for c, side in enumerate(there) if side != sides[c]), -1)
                if j >= 0 or isinstance(switch, Diode):
                    largest = np.abs(row[..., :n]).max(axis=-1, initial=0.0)
                    if j >= 0:
                        across, per = np.abs(row[..., self._moving[j]]), self.per_state(j, solved)
                        # A difference amplifier at its limit shows no displacement.
                        moves = (across > 1e-9 * largest * per) & (per > 0.0)
                        scale = np.divide(across, per, out=np.ones_like(across), where=moves)
                    else:  # amperes beside volts: bring both to states
                        scale = np.where(largest > 0.0, largest, 1.0)
                    row = row / scale[..., None]
                ways.append(Exit(row, target, j))
        return ways

    def sides(self, key: ModeKey) -> tuple[int, ...]:
        """For each stop 1, 0 or -1: in contact with its upper side, open, with its lower."""
        known = self._sided.get(key)
        if known is None:
            known = tuple(self._side(stop, key) for stop in self.circuit.stops)
            self._sided[key] = known
        return known

    def per_state(self, j: int, solved: Solution) -> Any:
        """Volts of the displacement in a clearance per volt of the first mass's state."""
        difference = self.circuit.stops[j].difference
        if difference is None:
            return np.float64(1.0)
        return np.abs(solved.voltage[difference[0]][..., self._moving[j]])

    def clipped(self, key: ModeKey) -> bool:
        """Whether an op-amp that ought to be linear is at a limit."""
        pairs = zip(self._sections, key, strict=False)
        return any(position and not self.circuit.may_limit(s, position) for s, position in pairs)

    def _side(self, stop: Stop, key: ModeKey) -> int:
        for side, contact in stop.contacts:
            if key[self._number[contact.switch]] == contact.position:
                return side
        return 0

    def leaving(
        self, key: ModeKey, switch: Section | Diode, solved: Solution
    ) -> list[tuple[Array, int]]:
        """Rows that become positive where the switch leaves its position in a mode, with the next
        position."""
        board, position = self.board, key[self._number[switch.name]]
        if isinstance(switch, Diode):
            if position:
                return [(-solved.current[switch.name], 0)]
            across = solved.voltage[switch.anode] - solved.voltage[switch.cathode]
            return [(plus(across, -np.asarray(board.drop[switch.name])), 1)]
        low, high = board.rails[switch.name]
        if position == 0:
            out = solved.voltage[switch.output]
            return [(plus(out, -np.asarray(high)), 1), (plus(-out, np.asarray(low)), -1)]
        return [(-position * self.overdrive(switch, position, solved), 0)]

    def overdrive(self, section: Section, position: int, solved: Solution) -> Array:
        """(..., n + 2) differential input of a section at this limit, beyond what it takes to be
        there [V]: with the limit's sign as long as the section stays."""
        low, high = self.board.rails[section.name]
        across = solved.voltage[section.noninverting] - solved.voltage[section.inverting]
        across = plus(across, np.asarray(self.board.offset.get(section.name, 0.0)))
        limit = np.asarray(high if position > 0 else low) * self.board.inverse_gain
        return plus(across, -limit)

    def _assemble(self) -> tuple[Array, Array]:
        """What is the same in every mode."""
        c, board = self.circuit, self.board
        n, nodes = len(self.states), len(self._nets)
        # Each branch has its current as an unknown and a row of its own, in this order.
        first = self._first
        size = first["generators"] + len(c.generators)
        G = np.zeros((*self.lead, size, size))
        right = np.zeros((*self.lead, size, n + 2))

        def stamp(row: int, net: str, value: Any) -> None:
            if net != GROUND:
                G[..., row, self._nets[net]] += value

        def current(net: str, column: int, value: float) -> None:
            if net != GROUND:
                G[..., self._nets[net], column] += value

        def source(row: int, plus: str, minus: str) -> None:
            """v(plus) - v(minus) is given; the unknown is the current that leaves plus into it."""
            stamp(row, plus, 1.0)
            stamp(row, minus, -1.0)
            current(plus, row, 1.0)
            current(minus, row, -1.0)

        for r in c.resistors:
            g = 1.0 / np.asarray(board.values[r.name])
            for here, there in ((r.a, r.b), (r.b, r.a)):
                if here != GROUND:
                    stamp(self._nets[here], here, g)
                    stamp(self._nets[here], there, -g)
        capacitors = {cap.name: cap for cap in c.capacitors}
        for k, name in enumerate(c.states):
            source(nodes + k, capacitors[name].plus, capacitors[name].minus)
            right[..., nodes + k, k] = 1.0
        for i, s in enumerate(c.sections, first["sections"]):
            current(s.output, i, 1.0)
            for net in (s.inverting, s.noninverting):
                if net != GROUND:
                    right[..., self._nets[net], n + 1] -= board.bias.get(s.name, 0.0)
        for i, d in enumerate(c.diodes, first["diodes"]):
            current(d.anode, i, 1.0)
            current(d.cathode, i, -1.0)
        for i, ref in enumerate(c.references, first["references"]):
            source(i, ref.cathode, ref.anode)
            right[..., i, n + 1] = board.reference[ref.name]
        for i, rail in enumerate(c.supplies, first["supplies"]):
            source(i, rail.net, GROUND)
            right[..., i, n + 1] = board.supply.get(rail.name, rail.volts)
        for i, net in enumerate(c.generator_nets, first["generators"]):
            source(i, net, GROUND)
        right[..., first["generators"] + self._channel, n] = 1.0
        return G, right


def plus(row: Array, constant: Any) -> Array:
    """A row over (states, generator, 1) with this added to its constant."""
    out = row.copy()
    out[..., -1] += constant
    return out


def _layout(circuit: Circuit, nodes: int) -> Mapping[str, int]:
    """First unknown of each group of branches; the nets' voltages come before them all."""
    groups = {
        "states": circuit.states,
        "sections": circuit.sections,
        "diodes": circuit.diodes,
        "references": circuit.references,
        "supplies": circuit.supplies,
        "generators": circuit.generators,
    }
    first, at = {}, nodes
    for name, members in groups.items():
        first[name] = at
        at += len(members)
    return first
