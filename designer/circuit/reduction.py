"""A board's parts and nets reduced to a piecewise-linear system, by modified nodal analysis.

``circuit.nodal`` has the equations. Nothing here knows the formulas that chose the parts, so the
result can be held against the model.

Between two diodes around an op-amp, one off and the other not yet on, nothing closes the loop: its
output crosses the gap while its input moves by the gap over the gain. That is a mode like any
other, microvolts wide, as long as the gain is finite.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from designer.base.arrays import Array
from designer.circuit.board_values import Board
from designer.circuit.netlist import Circuit, Contact, Stop
from designer.circuit.nodal import NodalEquations, Solution
from designer.circuit.nodal_bandwidth import LaggingEquations
from designer.dynamics.piecewise_linear import (
    Guard,
    Mode,
    ModeKey,
    PiecewiseLinearSystem,
    motion_of_states,
)


class FloatingCircuit(ArithmeticError):
    """The nodal equations are singular: a net that nothing determines."""


EVEN = 1e-9
"""Relative: what may differ between the two stops of a board that counts as mirror symmetric."""
WORST_CONDITION = 1e14
"""The condition number of the scaled nodal equations past which a net floats, whatever the solver
says."""


class Reduction:
    """The exact reduction of one board.

    Parameters
    ----------
    circuit, board : what is reduced. bandwidth : whether the op-amps lag behind by their
    gain-bandwidth and their limits give way to their current (``nodal_bandwidth``).

    Raises
    ------
    FloatingCircuit : the nodal equations have no unique answer.
    ValueError : a bandwidth for a circuit without figures of its op-amp.
    """

    def __init__(self, circuit: Circuit, board: Board, *, bandwidth: bool = False) -> None:
        self.circuit = circuit
        self.board = board
        self.bandwidth = bandwidth
        self._solutions: dict[ModeKey, Solution] = {}
        self._seconds: dict[ModeKey, Solution] = {}

    @cached_property
    def _equations(self) -> NodalEquations:
        return self._over(0)

    @cached_property
    def _second_channel(self) -> NodalEquations | None:
        """The nodal equations over the generator's second channel; None where there is none."""
        return None if self.circuit.second is None else self._over(1)

    def _over(self, channel: int) -> NodalEquations:
        if self.bandwidth:
            return LaggingEquations(self.circuit, self.board, _solved, channel=channel)
        return NodalEquations(self.circuit, self.board, channel=channel)

    def system(self) -> PiecewiseLinearSystem:
        """States are the capacitor voltages in volts, time in seconds, the drive in volts.

        A mode's key has one entry per op-amp section in the circuit's order, then one per diode.
        The same each time: what is asked again finds its modes built.
        """
        return self._system

    @cached_property
    def _system(self) -> PiecewiseLinearSystem:
        c = self.circuit
        displacement, velocity = self._motion()
        return PiecewiseLinearSystem(
            states=self._equations.states,
            build=self._mode,
            start=c.open,
            clearances=tuple(s.clearance for s in c.stops),
            displacement=displacement,
            velocity=velocity,
            mirror=self._equations.mirror if self._even() else None,
            reflection=self._equations.mirror,
            continuous=self._equations.states == c.states and not c.dependent_capacitors,
            working=c.working,
        )

    def state(self, capacitors: Array) -> Array:
        """(..., n) a state of ``system`` with these capacitor voltages (..., c).

        What else is a state of a circuit with bandwidth (``nodal_bandwidth``) follows them within a
        small part of a period, and is zero here.
        """
        more = len(self._equations.states) - capacitors.shape[-1]
        return np.pad(capacitors, [(0, 0)] * (capacitors.ndim - 1) + [(0, more)])

    def solution(self, key: ModeKey) -> Solution:
        """Every net's voltage and every capacitor's current in this mode."""
        known = self._solutions.get(key)
        if known is None:
            known = self._solutions[key] = self._equations.solved(key, _solved)
        return known

    def by_second(self, key: ModeKey) -> Solution:
        """The solution over the states, the generator's second channel in the place of the first,
        and 1.

        Raises
        ------
        ValueError : there is no second channel.
        """
        if self._second_channel is None:
            raise ValueError("no second channel")
        known = self._seconds.get(key)
        if known is None:
            known = self._seconds[key] = self._second_channel.solved(key, _solved)
        return known

    def voltages(self, key: ModeKey, x: Array, channels: tuple[float, float]) -> dict[str, float]:
        """Voltage of every net at a state x (n,) and voltages of the generator's channels."""
        inputs = np.concatenate([x, [channels[0], 1.0]])
        out = {net: float(row @ inputs) for net, row in self.solution(key).voltage.items()}
        if self._second_channel is not None:
            second_input = self.by_second(key).voltage
            out = {
                net: volts + channels[1] * float(second_input[net][-2])
                for net, volts in out.items()
            }
        return out

    def output(self, key: ModeKey, net: str, x: Array, u: Array) -> Array:
        """Voltage (k,) of a net along states x (k, n) and generator voltages u (k,)."""
        row = self.solution(key).voltage[net]
        return np.asarray(x @ row[:-2] + row[-2] * u + row[-1])

    def _motion(self) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
        """Rows of the displacement in each clearance and of its velocity: of one mass the states,
        of two the output of their difference amplifier."""
        c = self.circuit
        size, moving = len(self._equations.states), [c.states.index(s.state) for s in c.stops]
        displacement, velocity = map(list, motion_of_states(size, moving))
        for k, (stop, i) in enumerate(zip(c.stops, moving, strict=True)):
            if stop.difference is not None:
                net, sign = stop.difference
                A, row = self._still.A, sign * self.solution(c.open).voltage[net]
                displacement[k] = row
                velocity[k] = np.append(row[:size] @ A / A[i, i + 1], row[size])
        return tuple(displacement), tuple(velocity)

    @cached_property
    def _still(self) -> Mode:
        """The mode with every clearance open."""
        return self._mode(self.circuit.open)

    def _mode(self, key: ModeKey) -> Mode:
        solved, n = self.solution(key), len(self._equations.states)
        rows = self._equations.rates(key, solved)
        exits = self._equations.exits(key, solved)
        second_input, slopes = None, np.zeros(len(exits))
        if self._second_channel is not None:
            second = self.by_second(key)
            second_input = self._second_channel.rates(key, second)[:, n]
            slopes = np.array([e.row[n] for e in self._second_channel.exits(key, second)])
        guards = tuple(
            Guard(e.row[:n], float(e.row[n]), float(e.row[n + 1]), e.target, e.clearance, own)
            for e, own in zip(exits, slopes.tolist(), strict=True)
        )
        return Mode(
            A=rows[:, :n],
            B=rows[:, n],
            d=rows[:, n + 1],
            guards=guards,
            sides=self._equations.sides(key),
            clipped=self._equations.clipped(key),
            second=second_input,
        )

    def _even(self) -> bool:
        """Whether x → -x, u → -u is a symmetry: no DC anywhere, and both stops alike.

        Stops that one switch makes are alike where its limits are; others, and those of a circuit
        that is fed from a rail, are compared by what they do: the flow in contact, and where
        contact begins.
        """
        stops = self.circuit.dead_zones
        if not self.board.mirror_symmetric or (self.circuit.references and not stops):
            return False
        for stop in stops:
            if stop.upper is None or stop.lower is None:
                return False
            if (self.circuit.supplies or not stop.shared) and not self._alike(stop):
                return False
        return True

    def _alike(self, stop: Stop) -> bool:
        assert stop.upper is not None
        assert stop.lower is not None
        c = self.circuit
        rest = self._still
        above, below = (self._mode(c.carrying(contact)) for contact in (stop.upper, stop.lower))
        ends = [self.threshold(stop, contact) for _, contact in stop.contacts]
        M, largest = self._equations.mirror, float(np.abs(above.d).max())
        return (
            _close(M @ above.A @ M.T, below.A, 0.0)
            and _close(M @ above.d, below.d, largest)
            and _close(M @ rest.d, rest.d, largest)
            and abs(ends[0] + ends[1]) <= EVEN * abs(ends[0])
        )

    def threshold(self, stop: Stop, contact: Contact) -> float:
        """Voltage of a dead zone's state at which its contact begins, every other state at zero."""
        c = self.circuit
        switch = c.switches.index(contact.switch)
        guard = next(g for g in self._still.guards if g.target[switch] == contact.position)
        return -guard.e / float(guard.C[c.states.index(stop.state)])


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
