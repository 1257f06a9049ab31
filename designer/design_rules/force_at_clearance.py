"""What disturbs a circuit at rest, referred to the clearance as a constant force.

A disturbance (an offset, a current into a net) moves the mass and the clearance against each other.
The equivalent force is the one that moves the mass as far inside the clearance, as a share of the
drive's amplitude. Both come from the nodal equations of the open mode with one more source; no
formula of the topology enters.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from designer.base.arrays import Array
from designer.circuit.netlist import GROUND, Circuit, nominal_board
from designer.circuit.nodal import NodalEquations

BOLTZMANN, KELVIN = 1.380649e-23, 298.15
"""J/K, exact since 2019; room temperature [K]."""


@dataclass(frozen=True)
class Forces:
    """Equivalent force, in volts of the generator, of one unit of each disturbance."""

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
    def forces(self) -> Forces:
        """Of every section's offset, and of a current into every net.

        Raises
        ------
        ArithmeticError : the circuit has no rest.
        """
        sections = [s.name for s in self.circuit.sections]
        moved = self._moved()
        drive, rest = moved[0], moved[1:]
        if drive == 0.0:
            raise ArithmeticError("the generator does not move the mass")
        volts = [float(m / drive) for m in rest]
        return Forces(
            dict(zip(sections, volts, strict=False)),
            dict(zip(self._nets, volts[len(sections) :], strict=True)),
        )

    def _moved(self) -> Array:
        """How far the mass moves from the clearance's middle, for the generator and each source."""
        c = self.circuit
        n = len(c.states)
        key = c.rest
        G, right = self._equations.of(key)
        sections = len(c.sections)
        count = sections + len(self._nets)
        sources = np.zeros((len(G), count))
        for i, row in enumerate(self._section_rows()):
            sources[row, i] = -1.0
        for i, net in enumerate(self._nets, sections):
            sources[c.nets.index(net), i] = 1.0
        known = np.hstack([right[:, : n + 1], sources, right[:, n + 1 :]])
        y = np.asarray(np.linalg.solve(G, known), dtype=np.float64)
        solved = self._equations.solution(y)
        solved.voltage[GROUND] = np.zeros(y.shape[1])
        rates = self._equations.rates(solved)
        # Where each source holds the states, all else at zero.
        states = -np.linalg.solve(rates[:, :n], rates[:, n:-1])
        ways = [e for e in self._equations.exits(key, solved) if e.clearance == 0]
        if not ways:
            return np.asarray(states[0])
        moved = np.zeros(states.shape[1])
        for way in ways:
            side = self._equations.sides(way.target)[0]
            moved += side * (way.row[:n] @ states + way.row[n:-1])
        return moved / len(ways)

    def _section_rows(self) -> list[int]:
        """The row of each section's own equation, behind nets and capacitors."""
        first = len(self.circuit.nets) + len(self.circuit.capacitors)
        return [first + i for i in range(len(self.circuit.sections))]


def thermal(ohms: float) -> float:
    """Current noise of a resistor [A/sqrt(Hz)]."""
    return float(np.sqrt(4.0 * BOLTZMANN * KELVIN / ohms))


def leftover(circuit: Circuit, values: Mapping[str, float] | None = None) -> float:
    """Stiffness that the dead zone leaves inside the clearance, over that of the stop.

    From the rate of the moving mass in the open mode and in contact: the nonlinear stage's output
    is the only path that differs, so its slope against the displacement is read there. values :
    ohm and farad in the place of the circuit's.
    """
    board = nominal_board(circuit)
    if values is not None:
        board = replace(board, values={**circuit.values, **values})
    equations = NodalEquations(circuit, board)
    stop = circuit.stops[0]
    place = circuit.states.index(stop.state)
    slopes = []
    for key in (circuit.open, *(circuit.carrying(c) for _, c in stop.contacts)):
        G, right = equations.of(key)
        y = np.asarray(np.linalg.solve(G, right), dtype=np.float64)
        solved = equations.solution(y)
        slopes.append(float(solved.voltage[stop.output][place]))
    contact = float(np.mean(slopes[1:])) - slopes[0]
    return slopes[0] / contact
