"""A board's parts and nets reduced to a piecewise-linear system, by modified nodal analysis.

Capacitors become voltage sources (their voltages are the states), op-amps either a virtual short
v+ - v- + offset = v_out/gain or, at a limit, a fixed output voltage. Nothing here knows the
formulas that chose the parts, so the result can be held against the model.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.circuit import GROUND, Board, Circuit, Section
from designer.system import Array, Guard, Mode, ModeKey, PiecewiseLinearSystem


class FloatingCircuit(ArithmeticError):
    """The nodal equations are singular: a net that nothing determines."""


@dataclass(frozen=True)
class Solution:
    """Linear functions of (states, generator, 1), each a row of length n + 2.

    voltage : by net; current : into each state capacitor, by name; output : out of each op-amp
    section's output, by name [A].
    """

    voltage: dict[str, Array]
    current: dict[str, Array]
    output: dict[str, Array]


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
        self._matrix, self._right = self._assemble()
        self._solutions: dict[ModeKey, Solution] = {}

    def system(self) -> PiecewiseLinearSystem:
        """States are the capacitor voltages in volts, time in seconds, the drive in volts.

        A mode's key has one entry per op-amp section in the circuit's order.
        """
        c = self.circuit
        return PiecewiseLinearSystem(
            states=c.states,
            build=self._mode,
            start=(0,) * len(c.sections),
            clearances=tuple(s.clearance for s in c.stops),
            displacement=tuple(c.states.index(s.state) for s in c.stops),
            mirror=-np.eye(len(c.states)) if self.board.mirror_symmetric else None,
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
        sections, n = c.sections, len(c.states)
        nodes = len(self._nets)
        size = nodes + len(c.capacitors) + len(sections) + 1
        G = np.zeros((size, size))
        right = np.zeros((size, n + 2))

        def stamp(row: int, net: str, value: float) -> None:
            if net != GROUND:
                G[row, self._nets[net]] += value

        def current(net: str, column: int, value: float) -> None:
            if net != GROUND:
                G[self._nets[net], column] += value

        for r in c.resistors:
            g = 1.0 / board.values[r.name]
            for here, there in ((r.a, r.b), (r.b, r.a)):
                if here != GROUND:
                    stamp(self._nets[here], here, g)
                    stamp(self._nets[here], there, -g)
        for i, cap in enumerate(c.capacitors):
            row = nodes + i
            stamp(row, cap.plus, 1.0)
            stamp(row, cap.minus, -1.0)
            right[row, c.states.index(cap.name)] = 1.0
            current(cap.plus, row, 1.0)
            current(cap.minus, row, -1.0)
        for i, s in enumerate(sections):
            row = nodes + len(c.capacitors) + i
            current(s.output, row, 1.0)
            for net in (s.inverting, s.noninverting):
                if net != GROUND:
                    right[self._nets[net], n + 1] -= board.bias
        row = size - 1
        stamp(row, c.generator.net, 1.0)
        current(c.generator.net, row, 1.0)
        right[row, n] = 1.0
        return G, right

    def _solve(self, key: ModeKey) -> Solution:
        c, board = self.circuit, self.board
        G, right = self._matrix.copy(), self._right.copy()
        nodes, n = len(self._nets), len(c.states)
        for i, (s, position) in enumerate(zip(c.sections, key, strict=True)):
            row = nodes + len(c.capacitors) + i
            if position:
                G[row, self._nets[s.output]] = 1.0
                right[row, n + 1] = board.rails[s.name][1 if position > 0 else 0]
                continue
            for net, sign in ((s.noninverting, 1.0), (s.inverting, -1.0)):
                if net != GROUND:
                    G[row, self._nets[net]] += sign
            G[row, self._nets[s.output]] -= board.inverse_gain
            right[row, n + 1] = -board.offset.get(s.name, 0.0)
        y = _solved(G, right, key)
        voltage = {net: y[i] for net, i in self._nets.items()}
        voltage[GROUND] = np.zeros(n + 2)
        # The unknown is the current that leaves ``plus`` through the source: into the capacitor.
        amps = {cap.name: y[nodes + i] for i, cap in enumerate(c.capacitors)}
        first = nodes + len(c.capacitors)
        out = {s.name: -y[first + i] for i, s in enumerate(c.sections)}
        return Solution(voltage, amps, out)

    def _mode(self, key: ModeKey) -> Mode:
        c, board = self.circuit, self.board
        solved, n = self.solution(key), len(c.states)
        rows = np.array([solved.current[name] / board.values[name] for name in c.states])
        guards: list[Guard] = []
        stops = {stop.section: j for j, stop in enumerate(c.stops)}
        for i, (s, position) in enumerate(zip(c.sections, key, strict=True)):
            for row, to in self._exits(s, position, solved):
                j = stops.get(s.name, -1)
                scale = 1.0
                if j >= 0:
                    across = abs(row[c.states.index(c.stops[j].state)])
                    scale = across if across > 1e-9 else 1.0
                guards.append(
                    Guard(
                        C=row[:n] / scale,
                        D=float(row[n] / scale),
                        e=float(row[n + 1] / scale),
                        target=(*key[:i], to, *key[i + 1 :]),
                        clearance=j,
                    )
                )
        position_of = dict(zip((s.name for s in c.sections), key, strict=True))
        return Mode(
            A=rows[:, :n],
            B=rows[:, n],
            d=rows[:, n + 1],
            guards=tuple(guards),
            sides=tuple(stop.upper * position_of[stop.section] for stop in c.stops),
            clipped=any(p != 0 and not s.limits for s, p in zip(c.sections, key, strict=True)),
        )

    def _exits(self, s: Section, position: int, solved: Solution) -> list[tuple[Array, int]]:
        """Rows that become positive where the section leaves its position, with the next one."""
        low, high = self.board.rails[s.name]
        one = np.zeros(len(self.circuit.states) + 2)
        one[-1] = 1.0
        if position == 0:
            out = solved.voltage[s.output]
            return [(out - high * one, 1), (low * one - out, -1)]
        across = solved.voltage[s.noninverting] - solved.voltage[s.inverting]
        across = across + self.board.offset.get(s.name, 0.0) * one
        limit = (high if position > 0 else low) * self.board.inverse_gain
        return [(-position * (across - limit * one), 0)]


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
