"""The nodal equations with op-amps of finite bandwidth and limits that give way to their current.

An op-amp of one pole holds v+ - v- + offset = w/gain + w'/(2 pi GBW), w its output before the
output resistance. Its own motion dies out within a microsecond, a thousandth of a contact; what
stays is the lag, w' by the static equations: the states' rates are right to first order in 1/GBW
(the slow manifold of singular perturbation: Kokotović, Khalil, O'Reilly, 1986, chapter 1). So a
circuit has as many states as without, and the same engine.

Not so where an op-amp drives diodes. Between two that are off nothing closes its loop, and its
output crosses from one to the other at 2 pi GBW (v+ - v- + offset - w/gain). So w is a state of its
own there; in every other mode w follows the static equations, without an effect on the others. When
it arrives the loop closes within a tenth of a microsecond, which counts as none: fv jumps, and the
vector field is not continuous. A diode that is off is a capacitor C. Its current C (va - vc)' is a
lag of first order like an op-amp's, but in the crossing, where w' itself is slowed by it, to
1/(1 + 2 pi GBW C z) with z [ohm] what a current into the diode's other net raises v- by.

Left out: slew, the second pole, the recovery from a limit, the lag of what the generator drives
straight through an inverter, and a diode's capacitance as a function of its voltage.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from designer.base.arrays import Array
from designer.circuit.board_values import Board
from designer.circuit.netlist import GROUND, Circuit, Diode, Section
from designer.circuit.nodal import NodalEquations, Solution, Solver, plus
from designer.dynamics.piecewise_linear import ModeKey

REVERSE = 2.0
"""Reverse voltage [V] at which the capacitance of a diode is taken that is off while its op-amp's
loop is closed: a clamp's in a contact of a few volts. In the crossing both are near 0 V."""


class LaggingEquations(NodalEquations):
    """``NodalEquations`` of op-amps with a bandwidth and an output resistance.

    Raises
    ------
    ValueError : the circuit has no figures of its op-amp.
    """

    def __init__(self, circuit: Circuit, board: Board, solver: Solver, *, channel: int = 0) -> None:
        if circuit.figures is None:
            raise ValueError("a bandwidth for a circuit without figures of its op-amp")
        self._swinging = swinging_sections(circuit)
        further = tuple(s.output for s in self._swinging)
        super().__init__(circuit, board, further, channel=channel)
        self._solver = solver
        self._resistance = circuit.figures.output_resistance.nominal
        self._droop = circuit.output_stage.resistance
        self._loads = circuit.output_loads(board.values)
        self._static: dict[ModeKey, Solution] = {}
        self._guiding: dict[ModeKey, Solution] = {}

    def of(self, key: ModeKey) -> tuple[Array, Array]:
        """As of ``NodalEquations``, a limit being a voltage behind a resistance, and the output of
        an op-amp whose loop is open a state."""
        G, right = super().of(key)
        for i, section in enumerate(self.circuit.sections):
            row = self._first["sections"] + i
            if key[i]:
                G[..., row, row] -= self._droop  # the unknown is the current into the output
                right[..., row, -1] = self._open_limits(section)[1 if key[i] > 0 else 0]
            elif self._is_open(section, key):
                G[..., row, :] = right[..., row, :] = 0.0
                G[..., row, self._nets[section.output]] = 1.0
                right[..., row, self.states.index(section.output)] = 1.0
        return G, right

    @property
    def mirror(self) -> Array:
        """The outputs of the two halves of a stop change places."""
        out = super().mirror
        for stop in self.circuit.dead_zones:
            pair = [self.states.index(s.output) for s in self._swinging if s.name in stop.switches]
            out[pair] = out[pair[::-1]]
        return out

    def solved(self, key: ModeKey, solver: Solver) -> Solution:
        """What holds in a mode, every linear op-amp behind by its lag and every diode that is off
        with its capacitance."""
        guiding = self._guided(key)
        if not self._swinging:
            return guiding
        static = self._at_once(key)
        speeds = self._rates(key, static, guiding)
        G, right = self.of(key)
        self._delay(key, self.circuit.sections, static, speeds, right)
        self._charge(key, static, speeds, right)
        return self.answer(G, right, key, solver)

    def rates(self, key: ModeKey, solved: Solution) -> Array:
        """As of ``NodalEquations``, with the outputs that cross."""
        return self._rates(key, solved, self._guided(key))

    def leaving(
        self, key: ModeKey, switch: Section | Diode, solved: Solution
    ) -> list[tuple[Array, int]]:
        """As of ``NodalEquations``. A limit is left where it is reached: by the output with its
        lag. Diodes switch where the currents say so that no closed loop delays: then an output
        leaves one just where it begins to cross."""
        i = self.circuit.switches.index(switch.name)
        if isinstance(switch, Diode):
            return super().leaving(key, switch, self._guided(key))
        if not key[i]:
            low, high = self._open_limits(switch)
            out = solved.voltage[switch.output] + self._droop * solved.output[switch.name]
            return [(plus(out, -high), 1), (plus(-out, low), -1)]
        linear = (*key[:i], 0, *key[i + 1 :])
        static = self._at_once(linear)
        lag = self._lag(switch, static, self._rates(linear, static, static))
        if switch in self._swinging:
            lag = np.zeros_like(lag)
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
            known = self._static[key] = self.answer(*self.of(key), key, self._solver)
        return known

    def _guided(self, key: ModeKey) -> Solution:
        """What holds in a mode but for what delays the loops that drive diodes: continuous from
        mode to mode, so that the diodes can switch by it."""
        known = self._guiding.get(key)
        if known is None:
            static = self._at_once(key)
            G, right = self.of(key)
            others = [s for s in self.circuit.sections if s not in self._swinging]
            self._delay(key, others, static, self._rates(key, static, static), right)
            known = self._guiding[key] = self.answer(G, right, key, self._solver)
        return known

    def _delay(
        self,
        key: ModeKey,
        sections: Iterable[Section],
        static: Solution,
        speeds: Array,
        right: Array,
    ) -> None:
        """Add the lag of these sections, where they are linear and their loop is closed."""
        for i, section in enumerate(self.circuit.sections):
            if section in sections and not key[i] and not self._is_open(section, key):
                row = self._first["sections"] + i
                right[..., row, :] += self._lag(section, static, speeds)

    def _charge(self, key: ModeKey, static: Solution, speeds: Array, right: Array) -> None:
        """Add the currents that charge the diodes that are off."""
        for diode in self.circuit.diodes:
            if key[self._number[diode.name]]:
                continue
            across = static.voltage[diode.anode] - static.voltage[diode.cathode]
            amperes = self._capacitance(diode, key) * self._speed(across, speeds)
            for net, sign in ((diode.anode, -1.0), (diode.cathode, 1.0)):
                if net != GROUND:
                    right[..., self._nets[net], :] += sign * amperes

    def _rates(self, key: ModeKey, solved: Solution, guiding: Solution) -> Array:
        """(..., n, n + 2): capacitors by ``solved``, outputs that cross by ``guiding``."""
        capacitors = self.capacitor_rates(solved)
        if not self._swinging:
            return capacitors
        rows = [
            self._crossing(s, key, guiding) if self._is_open(s, key) else self._slaved(s, guiding)
            for s in self._swinging
        ]
        return np.concatenate([capacitors, np.stack(rows, axis=-2)], axis=-2)

    def _crossing(self, section: Section, key: ModeKey, guiding: Solution) -> Array:
        """(..., n + 2) rate [V/s] of an output in its open loop."""
        across = guiding.voltage[section.noninverting] - guiding.voltage[section.inverting]
        across = plus(across, np.asarray(self.board.offset.get(section.name, 0.0)))
        gain = np.asarray(self.board.inverse_gain)[..., None]
        pole = self._pole(section)
        slowed = pole / (1.0 + pole * self._held_back(section, key))
        return np.asarray(slowed[..., None] * (across - gain * guiding.voltage[section.output]))

    def _slaved(self, section: Section, guiding: Solution) -> Array:
        """(..., n + 2) rate of an output that follows the static equations: what strays from them
        dies out as fast as the fastest capacitor changes."""
        capacitors = self.capacitor_rates(guiding)
        n = capacitors.shape[-2]
        row = guiding.voltage[section.output]
        rate = np.einsum("...i,...ij->...j", row[..., :n], capacitors)
        fastest = np.abs(capacitors[..., :n]).sum(axis=-1).max(axis=-1)
        rate = rate + fastest[..., None] * row
        rate[..., self.states.index(section.output)] -= fastest
        return np.asarray(rate)

    def _held_back(self, section: Section, key: ModeKey) -> Array:
        """(...,) C z [s], summed over the two diodes that are off."""
        G, _ = self.of(key)
        diodes = _loop_diodes(section, self.circuit)
        amperes = np.zeros((*G.shape[:-1], len(diodes)))
        for k, diode in enumerate(diodes):
            nets = sorted(diode.nets, key=lambda net: net != section.inverting)
            net = next(net for net in nets if net != section.output)
            if net != GROUND:
                amperes[..., self._nets[net], k] = 1.0
        raised = self._solver(G, amperes, key)[..., self._nets[section.inverting], :]
        return np.asarray(raised @ np.array([self._capacitance(d, key) for d in diodes]))

    def _capacitance(self, diode: Diode, key: ModeKey) -> float:
        """[F] of a diode that is off."""
        crosses = any(
            self._is_open(s, key) and diode in _loop_diodes(s, self.circuit) for s in self._swinging
        )
        return diode.model.capacitance_at(0.0 if crosses else REVERSE)

    def _is_open(self, section: Section, key: ModeKey) -> bool:
        """Whether nothing closes the loop of a section in a mode."""
        if section not in self._swinging or key[self._number[section.name]]:
            return False
        return not any(key[self._number[d.name]] for d in _loop_diodes(section, self.circuit))

    def _lag(self, section: Section, static: Solution, speeds: Array) -> Array:
        """(..., n + 2) differential input [V] that moves a section's output as fast as it goes."""
        row = static.voltage[section.output] + self._resistance * static.output[section.name]
        return np.asarray(self._speed(row, speeds) / self._pole(section)[..., None])

    def _pole(self, section: Section) -> Array:
        """(...,) gain-bandwidth [rad/s] of a section."""
        gbw = self.board.gain_bandwidth.get(section.name, self.circuit.gain_bandwidth)
        return np.asarray(2.0 * np.pi * np.asarray(gbw))

    def _speed(self, row: Array, speeds: Array) -> Array:
        """(..., n + 2) rate of a linear function of the states (its drive stands still)."""
        return np.asarray(np.einsum("...i,...ij->...j", row[..., : len(self.states)], speeds))


def swinging_sections(circuit: Circuit) -> tuple[Section, ...]:
    """The sections that drive diodes: their outputs cross between two that are off."""
    return tuple(
        s for s in circuit.sections if any(s.output in diode.nets for diode in circuit.diodes)
    )


def _loop_diodes(section: Section, circuit: Circuit) -> list[Diode]:
    """Those that close a section's loop, one at a time."""
    ends = {section.output, section.inverting}
    return [diode for diode in circuit.diodes if not ends.isdisjoint(diode.nets)]
