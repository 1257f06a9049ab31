"""A board's parts and nets reduced to a piecewise-linear system, by modified nodal analysis.

Capacitors become voltage sources (their voltages are the states), op-amps either a virtual short
v+ - v- + offset = v_out/gain or, at a limit, a fixed output voltage. Diodes carry no current or
drop a constant voltage and that of their series resistance, without which a diode between two
op-amps' outputs would have no answer. Nothing here knows the formulas that chose the parts, so the
result can be held against the model.

Between two diodes around an op-amp, one off and the other not yet on, nothing closes the loop: its
output crosses the gap while its input moves by the gap over the gain. That is a mode like any
other, microvolts wide, as long as the gain is finite.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.circuit import GROUND, Board, Circuit, Diode, Section, Stop
from designer.system import Array, Guard, Mode, ModeKey, PiecewiseLinearSystem


class FloatingCircuit(ArithmeticError):
    """The nodal equations are singular: a net that nothing determines."""


@dataclass(frozen=True)
class Solution:
    """Linear functions of (states, generator, 1), each a row of length n + 2.

    voltage : by net; current : into each state capacitor and through each diode, by name; output :
    out of each op-amp section's output, by name [A].
    """

    voltage: dict[str, Array]
    current: dict[str, Array]
    output: dict[str, Array]


EVEN = 1e-9
"""Relative: what may differ between the two stops of a board that counts as mirror symmetric."""
WORST_CONDITION = 1e14
"""Of the scaled nodal equations: past it a net floats, whatever the solver says."""


class Reduction:
    """The exact reduction of one board.

    Parameters
    ----------
    circuit, board : what is reduced.

    Raises
    ------
    FloatingCircuit : the nodal equations have no unique answer.
    """

    def __init__(self, circuit: Circuit, board: Board) -> None:
        self.circuit = circuit
        self.board = board
        self._nets = {net: i for i, net in enumerate(circuit.nets)}
        self._first = _layout(circuit, len(self._nets))
        self._matrix, self._right = self._assemble()
        self._number = {name: i for i, name in enumerate(circuit.switches)}
        self._solutions: dict[ModeKey, Solution] = {}

    def system(self) -> PiecewiseLinearSystem:
        """States are the capacitor voltages in volts, time in seconds, the drive in volts.

        A mode's key has one entry per op-amp section in the circuit's order, then one per diode.
        """
        c = self.circuit
        return PiecewiseLinearSystem(
            states=c.states,
            build=self._mode,
            start=c.rest,
            clearances=tuple(s.clearance for s in c.stops),
            displacement=tuple(c.states.index(s.state) for s in c.stops),
            mirror=-np.eye(len(c.states)) if self._even() else None,
        )

    def solution(self, key: ModeKey) -> Solution:
        """Every net's voltage and every capacitor's current in this mode."""
        known = self._solutions.get(key)
        if known is None:
            known = self._solutions[key] = self._solve(key)
        return known

    def output(self, key: ModeKey, net: str, x: Array, u: Array) -> Array:
        """Voltage (k,) of a net along states x (k, n) and generator voltages u (k,)."""
        row = self.solution(key).voltage[net]
        return np.asarray(x @ row[:-2] + row[-2] * u + row[-1])

    def _assemble(self) -> tuple[Array, Array]:
        c, board = self.circuit, self.board
        n, nodes = len(c.states), len(self._nets)
        # Each branch has its current as an unknown and a row of its own, in this order.
        first = self._first
        size = first["generator"] + 1
        G = np.zeros((size, size))
        right = np.zeros((size, n + 2))

        def stamp(row: int, net: str, value: float) -> None:
            if net != GROUND:
                G[row, self._nets[net]] += value

        def current(net: str, column: int, value: float) -> None:
            if net != GROUND:
                G[self._nets[net], column] += value

        def source(row: int, plus: str, minus: str) -> None:
            """v(plus) - v(minus) is given; the unknown is the current that leaves plus into it."""
            stamp(row, plus, 1.0)
            stamp(row, minus, -1.0)
            current(plus, row, 1.0)
            current(minus, row, -1.0)

        for r in c.resistors:
            g = 1.0 / board.values[r.name]
            for here, there in ((r.a, r.b), (r.b, r.a)):
                if here != GROUND:
                    stamp(self._nets[here], here, g)
                    stamp(self._nets[here], there, -g)
        for i, cap in enumerate(c.capacitors, nodes):
            source(i, cap.plus, cap.minus)
            right[i, c.states.index(cap.name)] = 1.0
        for i, s in enumerate(c.sections, first["sections"]):
            current(s.output, i, 1.0)
            for net in (s.inverting, s.noninverting):
                if net != GROUND:
                    right[self._nets[net], n + 1] -= board.bias.get(s.name, 0.0)
        for i, d in enumerate(c.diodes, first["diodes"]):
            current(d.anode, i, 1.0)
            current(d.cathode, i, -1.0)
        for i, ref in enumerate(c.references, first["references"]):
            source(i, ref.cathode, ref.anode)
            right[i, n + 1] = board.reference[ref.name]
        for i, rail in enumerate(c.supplies, first["supplies"]):
            source(i, rail.net, GROUND)
            right[i, n + 1] = board.supply.get(rail.name, rail.volts)
        source(first["generator"], c.generator.net, GROUND)
        right[first["generator"], n] = 1.0
        return G, right

    def _solve(self, key: ModeKey) -> Solution:
        c, board = self.circuit, self.board
        G, right = self._matrix.copy(), self._right.copy()
        nodes, n, first = len(self._nets), len(c.states), self._first
        amplifiers = len(c.sections)
        for row, (s, position) in enumerate(
            zip(c.sections, key[:amplifiers], strict=True), first["sections"]
        ):
            if position:
                G[row, self._nets[s.output]] = 1.0
                right[row, n + 1] = board.rails[s.name][1 if position > 0 else 0]
                continue
            for net, sign in ((s.noninverting, 1.0), (s.inverting, -1.0)):
                if net != GROUND:
                    G[row, self._nets[net]] += sign
            G[row, self._nets[s.output]] -= board.inverse_gain
            right[row, n + 1] = -board.offset.get(s.name, 0.0)
        for row, (d, position) in enumerate(
            zip(c.diodes, key[amplifiers:], strict=True), first["diodes"]
        ):
            if not position:
                G[row, row] = 1.0  # no current
                continue
            for net, sign in ((d.anode, 1.0), (d.cathode, -1.0)):
                if net != GROUND:
                    G[row, self._nets[net]] += sign
            G[row, row] = -d.model.resistance
            right[row, n + 1] = board.drop[d.name]
        y = _solved(G, right, key)
        voltage = {net: y[i] for net, i in self._nets.items()}
        voltage[GROUND] = np.zeros(n + 2)
        # The unknown is the current that leaves ``plus`` through the source: into the capacitor.
        amps = {cap.name: y[i] for i, cap in enumerate(c.capacitors, nodes)}
        amps |= {d.name: y[i] for i, d in enumerate(c.diodes, first["diodes"])}
        out = {s.name: -y[i] for i, s in enumerate(c.sections, first["sections"])}
        return Solution(voltage, amps, out)

    def _mode(self, key: ModeKey) -> Mode:
        c, board = self.circuit, self.board
        solved, n = self.solution(key), len(c.states)
        rows = np.array([solved.current[name] / board.values[name] for name in c.states])
        guards: list[Guard] = []
        sides = self._sides(key)
        switches: tuple[Section | Diode, ...] = (*c.sections, *c.diodes)
        for i, (switch, position) in enumerate(zip(switches, key, strict=True)):
            for row, to in self._exits(switch, position, solved):
                target = (*key[:i], to, *key[i + 1 :])
                changed = [j for j, s in enumerate(self._sides(target)) if s != sides[j]]
                j = changed[0] if changed else -1
                largest = float(np.abs(row[:n]).max(initial=0.0))
                scale = 1.0
                if j >= 0:
                    across = abs(row[c.states.index(c.stops[j].state)])
                    scale = across if across > 1e-9 * largest else 1.0
                elif isinstance(switch, Diode) and largest > 0.0:
                    scale = largest  # amperes beside volts: bring both to states
                guards.append(
                    Guard(
                        C=row[:n] / scale,
                        D=float(row[n] / scale),
                        e=float(row[n + 1] / scale),
                        target=target,
                        clearance=j,
                    )
                )
        amplifiers = zip(c.sections, key, strict=False)
        return Mode(
            A=rows[:, :n],
            B=rows[:, n],
            d=rows[:, n + 1],
            guards=tuple(guards),
            sides=sides,
            clipped=any(position and not c.may_limit(s, position) for s, position in amplifiers),
        )

    def _sides(self, key: ModeKey) -> tuple[int, ...]:
        """For each stop 1, 0 or -1: in contact with its upper side, open, with its lower."""
        return tuple(self._side(stop, key) for stop in self.circuit.stops)

    def _side(self, stop: Stop, key: ModeKey) -> int:
        for side, contact in stop.contacts:
            if key[self._number[contact.switch]] == contact.position:
                return side
        return 0

    def _exits(
        self, switch: Section | Diode, position: int, solved: Solution
    ) -> list[tuple[Array, int]]:
        """Rows that become positive where the switch leaves its position, with the next one."""
        one = np.zeros(len(self.circuit.states) + 2)
        one[-1] = 1.0
        if isinstance(switch, Diode):
            if position:
                return [(-solved.current[switch.name], 0)]
            across = solved.voltage[switch.anode] - solved.voltage[switch.cathode]
            return [(across - self.board.drop[switch.name] * one, 1)]
        low, high = self.board.rails[switch.name]
        if position == 0:
            out = solved.voltage[switch.output]
            return [(out - high * one, 1), (low * one - out, -1)]
        across = solved.voltage[switch.noninverting] - solved.voltage[switch.inverting]
        across = across + self.board.offset.get(switch.name, 0.0) * one
        limit = (high if position > 0 else low) * self.board.inverse_gain
        return [(-position * (across - limit * one), 0)]

    def _even(self) -> bool:
        """Whether x → -x, u → -u is a symmetry: no DC anywhere, and both stops alike.

        Stops that one switch makes are alike where its limits are; others are compared by what
        they do: the flow in contact, and where contact begins.
        """
        if not self.board.mirror_symmetric:
            return False
        for stop in self.circuit.stops:
            if stop.upper is None or stop.lower is None:
                return False
            if not stop.shared and not self._alike(stop):
                return False
        return True

    def _alike(self, stop: Stop) -> bool:
        assert stop.upper is not None
        assert stop.lower is not None
        c = self.circuit
        rest = self._mode(c.rest)
        above, below = (self._mode(c.carrying(contact)) for contact in (stop.upper, stop.lower))
        ends = sorted(-g.e for g in rest.guards if g.clearance == c.stops.index(stop))
        return (
            _close(above.A, below.A, 0.0)
            and _close(above.d, -below.d, float(np.abs(above.d).max()))
            and _close(rest.d, -rest.d, float(np.abs(above.d).max()))
            and len(ends) == 2
            and ends[1] - ends[0] <= EVEN * abs(ends[1])
        )


def _layout(circuit: Circuit, nodes: int) -> dict[str, int]:
    """First unknown of each group of branches; the nets' voltages come before them all."""
    groups = {
        "capacitors": circuit.capacitors,
        "sections": circuit.sections,
        "diodes": circuit.diodes,
        "references": circuit.references,
        "supplies": circuit.supplies,
    }
    first, at = {}, nodes
    for name, members in groups.items():
        first[name] = at
        at += len(members)
    return {**first, "generator": at}


def _close(a: Array, b: Array, scale: float) -> bool:
    return bool(np.abs(a - b).max() <= EVEN * max(float(np.abs(a).max()), scale))


def _solved(G: Array, right: Array, key: ModeKey) -> Array:
    """G y = right with rows and columns brought to like size first."""
    rows = np.abs(G).max(axis=1)
    if rows.min() == 0.0:
        raise FloatingCircuit(f"a net without any part, in mode {key}")
    scaled = G / rows[:, None]
    columns = np.abs(scaled).max(axis=0)
    if columns.min() == 0.0:
        raise FloatingCircuit(f"a net without any part, in mode {key}")
    scaled /= columns
    try:
        inverse = np.linalg.inv(scaled)
    except np.linalg.LinAlgError as error:
        raise FloatingCircuit(f"singular nodal equations in mode {key}") from error
    size = float(np.abs(scaled).sum(axis=0).max() * np.abs(inverse).sum(axis=0).max())
    if not size < WORST_CONDITION:
        raise FloatingCircuit(f"singular nodal equations in mode {key}")
    y = inverse @ (right / rows[:, None])
    # One step of refinement: the inverse alone loses digits.
    y += inverse @ (right / rows[:, None] - scaled @ y)
    return np.asarray(y / columns[:, None])
