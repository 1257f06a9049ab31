"""What disturbs a circuit at rest, referred to the clearance as a constant force.

A disturbance (an offset, a current into a net) moves the mass and the clearance against each other.
The equivalent force is the one that moves the mass as far inside the clearance, as a share of the
drive's amplitude. Both come from the nodal equations of the open mode with one more source; no
formula of the topology enters.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from designer.base.arrays import Array
from designer.circuit.board_values import nominal_board
from designer.circuit.netlist import GROUND, Circuit
from designer.circuit.nodal import Exit, NodalEquations
from designer.dynamics.piecewise_linear import ModeKey

BOLTZMANN, KELVIN = 1.380649e-23, 298.15
"""J/K, exact since 2019; room temperature [K]."""


@dataclass(frozen=True)
class Forces:
    """Equivalent force at one clearance, in volts of the generator, of one unit of each
    disturbance."""

    clearance: str
    """Name of the clearance; "" where a circuit without one has the first mass's displacement."""
    offset: Mapping[str, float]
    """Force by section, per volt at its input."""
    current: Mapping[str, float]
    """Force by net, per ampere into it."""

    def between(self, a: str, b: str) -> float:
        """Of one ampere that leaves net a and enters net b."""
        return self.current.get(b, 0.0) - self.current.get(a, 0.0)


class Statics:
    """The open mode's answer to constant sources."""

    def __init__(self, circuit: Circuit) -> None:
        self.circuit = circuit
        self._equations = NodalEquations(circuit, nominal_board(circuit))
        self._nets = [net for net in circuit.nets if net != circuit.generator.net]

    @cached_property
    def forces(self) -> tuple[Forces, ...]:
        """Of every section's offset, and of a current into every net: at each clearance in order.

        Raises
        ------
        ArithmeticError : the circuit has no rest, or the generator does not move a clearance.
        """
        names = [stop.clearance for stop in self.circuit.stops] or [""]
        return tuple(map(self._force, names, self._moved()))

    def _force(self, clearance: str, moved: Array) -> Forces:
        """moved : of the displacement, by the generator, by each section and each net."""
        sections = [s.name for s in self.circuit.sections]
        drive, rest = moved[0], moved[1:]
        if drive == 0.0:
            mass_name = f"the mass at clearance {clearance}" if clearance else "the mass"
            raise ArithmeticError(f"the generator does not move {mass_name}")
        volts = [float(m / drive) for m in rest]
        return Forces(
            clearance,
            dict(zip(sections, volts, strict=False)),
            dict(zip(self._nets, volts[len(sections) :], strict=True)),
        )

    def _moved(self) -> list[Array]:
        """How far the mass moves from the middle of each clearance, for the generator and each
        source."""
        c = self.circuit
        n = len(c.states)
        key = c.open
        G, right = self._equations.of(key)
        sections = len(c.sections)
        count = sections + len(self._nets)
        sources = np.zeros((len(G), count))
        for i, row in enumerate(self._section_rows()):
            sources[row, i] = -1.0
        for i, net in enumerate(self._nets, sections):
            sources[c.nets.index(net), i] = 1.0
        inputs = np.hstack([right[:, : n + 1], sources, right[:, n + 1 :]])
        y = np.asarray(np.linalg.solve(G, inputs), dtype=np.float64)
        solved = self._equations.solution(y)
        solved.voltage[GROUND] = np.zeros(y.shape[1])
        rates = self._equations.rates(key, solved)
        # Where each source holds the states, all else at zero.
        states = np.asarray(-np.linalg.solve(rates[:, :n], rates[:, n:-1]), dtype=np.float64)
        exits = self._equations.exits(key, solved)
        if not c.stops:
            return [np.asarray(states[0])]
        return [
            self._from_middle([e for e in exits if e.clearance == k], k, states)
            for k in range(len(c.stops))
        ]

    def _from_middle(self, ways: Sequence[Exit], clearance: int, states: Array) -> Array:
        """ways : into each contact of a clearance. states : (n, sources) displaced so far."""
        n, moved = len(states), np.zeros(states.shape[1])
        for way in ways:
            side = self._equations.sides(way.target)[clearance]
            moved += side * (way.row[:n] @ states + way.row[n:-1])
        return moved / len(ways)

    def _section_rows(self) -> list[int]:
        """The row of each section's own equation, behind nets and capacitors."""
        first = len(self.circuit.nets) + len(self.circuit.capacitors)
        return [first + i for i in range(len(self.circuit.sections))]


def thermal(ohms: float) -> float:
    """Current noise of a resistor [A/sqrt(Hz)]."""
    return float(np.sqrt(4.0 * BOLTZMANN * KELVIN / ohms))


def leftovers(circuit: Circuit, values: Mapping[str, float] | None = None) -> Array:
    """(stops,) stiffness that each dead zone leaves inside its clearance, over that of its stops.

    From the slope of the stage's output against the displacement, open and in contact: the output
    is the only path that differs. Of unequal stops the mean counts. values : ohm and farad in the
    place of the circuit's.
    """
    board = nominal_board(circuit)
    if values is not None:
        board = replace(board, values={**circuit.values, **values})
    equations = NodalEquations(circuit, board)

    def slopes(key: ModeKey) -> Array:
        """(stops,) of each output against the displacement of its mass."""
        G, right = equations.of(key)
        solved = equations.solution(np.asarray(np.linalg.solve(G, right), dtype=np.float64))
        places = (circuit.states.index(stop.state) for stop in circuit.stops)
        pairs = zip(circuit.stops, places, strict=True)
        return np.array([solved.voltage[stop.output][place] for stop, place in pairs])

    inside = slopes(circuit.open)
    contact = [
        np.mean([slopes(circuit.carrying(c))[k] for _, c in stop.contacts])
        for k, stop in enumerate(circuit.stops)
    ]
    return np.asarray(inside / (np.array(contact) - inside))
