"""The nodal equations with op-amps of finite bandwidth and limits that give way to their current.

An op-amp of one pole holds v+ - v- + offset = w/gain + w'/(2 pi GBW), w its output before the
output resistance. Its own motion dies out within a microsecond, a thousandth of a contact; what
stays is the lag, w' by the static equations: the states' rates are right to first order in 1/GBW
(the slow manifold of singular perturbation: Kokotović, Khalil, O'Reilly, 1986, chapter 1). So a
circuit has as many states as without, and the same engine.

Left out: slew, the second pole, the recovery from a limit, the lag of what the generator drives
straight through an inverter, and that of the amplifiers of a rectifier, with their outputs' way
from one diode to the other.
"""

from __future__ import annotations

import numpy as np

from designer.base.arrays import Array
from designer.circuit.netlist import Board, Circuit, Diode, Section
from designer.circuit.nodal import NodalEquations, Solution, Solver, plus
from designer.dynamics.piecewise_linear import ModeKey


class LaggingEquations(NodalEquations):
    """``NodalEquations`` of op-amps with a bandwidth and an output resistance.

    Raises
    ------
    ValueError : the circuit has no figures of its op-amp.
    """

    def __init__(self, circuit: Circuit, board: Board, solver: Solver) -> None:
        super().__init__(circuit, board)
        if circuit.figures is None:
            raise ValueError("a bandwidth for a circuit without figures of its op-amp")
        self._solver = solver
        self._resistance = circuit.figures.output_resistance.nominal
        self._droop = circuit.output_stage.resistance
        self._loads = circuit.output_loads(board.values)
        self._static: dict[ModeKey, Solution] = {}

    def of(self, key: ModeKey) -> tuple[Array, Array]:
        """As of ``NodalEquations``, a limit being a voltage behind a resistance."""
        G, right = super().of(key)
        for i, section in enumerate(self.circuit.sections):
            if key[i]:
                row = self._first["sections"] + i
                G[..., row, row] -= self._droop  # the unknown is the current into the output
                right[..., row, -1] = self._open_limits(section)[1 if key[i] > 0 else 0]
        return G, right

    def solved(self, key: ModeKey, solver: Solver) -> Solution:
        """What holds in a mode, every linear op-amp behind by its lag."""
        static = self._at_once(key)
        G, right = self.of(key)
        for i, section in enumerate(self.circuit.sections):
            if not key[i]:
                right[..., self._first["sections"] + i, :] += self._lag(section, static)
        return self.solution(solver(G, right, key))

    def leaving(
        self, key: ModeKey, switch: Section | Diode, solved: Solution
    ) -> list[tuple[Array, int]]:
        """As of ``NodalEquations``. A limit is left where it is reached: by the output with its
        lag."""
        i = self.circuit.switches.index(switch.name)
        if isinstance(switch, Diode):
            return super().leaving(key, switch, solved)
        if not key[i]:
            low, high = self._open_limits(switch)
            out = solved.voltage[switch.output] + self._droop * solved.output[switch.name]
            return [(plus(out, -high), 1), (plus(-out, low), -1)]
        linear = (*key[:i], 0, *key[i + 1 :])
        lag = self._lag(switch, self._at_once(linear))
        return [(-key[i] * (self.overdrive(switch, key[i], solved) - lag), 0)]

    def _open_limits(self, section: Section) -> tuple[Array, Array]:
        """What a section's limits [V] would be without a load."""
        stage, load = self.circuit.output_stage, np.asarray(self._loads[section.name])
        low, high = (np.asarray(v) for v in self.board.rails[section.name])
        return stage.unloaded(low, load), stage.unloaded(high, load)

    def _at_once(self, key: ModeKey) -> Solution:
        """What holds in a mode without any lag."""
        known = self._static.get(key)
        if known is None:
            known = self._static[key] = self.solution(self._solver(*self.of(key), key))
        return known

    def _lag(self, section: Section, static: Solution) -> Array:
        """(..., n + 2) differential input [V] that moves a section's output as fast as it goes.

        None of a section that drives diodes: between two that are off its loop is open, and its
        way across is no lag of first order.
        """
        row = static.voltage[section.output] + self._resistance * static.output[section.name]
        if any(section.output in diode.nets for diode in self.circuit.diodes):
            return np.zeros_like(row)
        n = len(self.circuit.states)
        speed = np.einsum("...i,...ij->...j", row[..., :n], self.rates(static))
        gbw = self.board.gain_bandwidth.get(section.name, self.circuit.gain_bandwidth)
        return np.asarray(speed / (2.0 * np.pi * np.asarray(gbw))[..., None])
