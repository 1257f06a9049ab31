"""How far what disturbs a circuit at rest shifts the displacement in each clearance.

A disturbance (an offset, a current into a net) moves the masses and the clearance against each
other. How far follows from the nodal equations of the open mode with one more source; no formula of
the topology enters.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from designer.base.arrays import Array
from designer.catalog.entries import OpAmp
from designer.circuit.board_values import Board, nominal_board
from designer.circuit.netlist import Circuit
from designer.circuit.nodal import Exit, NodalEquations
from designer.dynamics.piecewise_linear import ModeKey
from designer.model.find_responses import ModelResponse
from designer.model.mechanics import MechanicalModel, SecondOrderSystem

BOLTZMANN, KELVIN = 1.380649e-23, 298.15
"""J/K, exact since 2019; room temperature [K]."""


@dataclass(frozen=True)
class Shifts:
    """How far one unit of each disturbance shifts the displacement from the middle of one
    clearance, in volts of its first mass's displacement; of several boards (boards,) each."""

    clearance: str
    """Name of the clearance; "" where a circuit without one has the first mass's displacement."""
    offset: Mapping[str, Any]
    """Shift by section, per volt at its input."""
    current: Mapping[str, Any]
    """Shift by net, per ampere into it."""

    def between(self, a: str, b: str) -> float:
        """Of one ampere that leaves net a and enters net b."""
        return float(self.current.get(b, 0.0) - self.current.get(a, 0.0))

    def over(self, volts: Any) -> Shifts:
        """The shifts as shares of one of so many volts."""
        return replace(
            self,
            offset={name: shift / volts for name, shift in self.offset.items()},
            current={net: shift / volts for net, shift in self.current.items()},
        )


class Statics:
    """The open mode's answer to constant sources.

    board : whose values count, or several in one (``Boards.stacked``); the nominal one if None.
    """

    def __init__(self, circuit: Circuit, board: Board | None = None) -> None:
        self.circuit = circuit
        self._equations = NodalEquations(circuit, board or nominal_board(circuit))
        self._nets = [net for net in circuit.nets if net not in circuit.generator_nets]

    @cached_property
    def shifts(self) -> tuple[Shifts, ...]:
        """Of every section's offset, and of a current into every net: at each clearance in order.

        Raises
        ------
        ArithmeticError : the circuit has no rest.
        """
        names = [stop.clearance for stop in self.circuit.stops] or [""]
        return tuple(map(self._shift, names, self._moved()))

    def _shift(self, clearance: str, moved: Array) -> Shifts:
        """moved : (..., sources) of the displacement, by each section and each net."""
        sections = [s.name for s in self.circuit.sections]
        volts = moved.tolist() if moved.ndim == 1 else list(np.moveaxis(moved, -1, 0))
        return Shifts(
            clearance,
            dict(zip(sections, volts, strict=False)),
            dict(zip(self._nets, volts[len(sections) :], strict=True)),
        )

    def _moved(self) -> list[Array]:
        """How far the mass moves from the middle of each clearance, for each source."""
        c = self.circuit
        n = len(c.states)
        key = c.open
        G, right = self._equations.of(key)
        sections = len(c.sections)
        count = sections + len(self._nets)
        sources = np.zeros((*G.shape[:-1], count))
        for i, row in enumerate(self._section_rows()):
            sources[..., row, i] = -1.0
        for i, net in enumerate(self._nets, sections):
            sources[..., c.nets.index(net), i] = 1.0
        inputs = np.concatenate([right[..., :n], sources, right[..., n + 1 :]], axis=-1)
        y = np.asarray(np.linalg.solve(G, inputs), dtype=np.float64)
        solved = self._equations.solution(y)
        rates = self._equations.rates(key, solved)
        # Where each source holds the states, all else at zero.
        states = np.asarray(-np.linalg.solve(rates[..., :n], rates[..., n:-1]), dtype=np.float64)
        exits = self._equations.exits(key, solved)
        if not c.stops:
            return [np.asarray(states[..., 0, :])]
        return [
            self._from_middle([e for e in exits if e.clearance == k], k, states)
            / self._equations.per_state(k, solved)[..., None]
            for k in range(len(c.stops))
        ]

    def _from_middle(self, ways: Sequence[Exit], clearance: int, states: Array) -> Array:
        """ways : into each contact of a clearance. states : (..., n, sources) displaced so far."""
        n, moved = states.shape[-2], np.zeros(1)
        for way in ways:
            side = self._equations.sides(way.target)[clearance]
            by_states = (way.row[..., None, :n] @ states)[..., 0, :]
            moved = moved + side * (by_states + way.row[..., n:-1])
        return moved / len(ways)

    def _section_rows(self) -> list[int]:
        """The row of each section's own equation, behind nets and state capacitors."""
        first = len(self.circuit.nets) + len(self.circuit.states)
        return [first + i for i in range(len(self.circuit.sections))]


def least_drive(model: MechanicalModel, responses: Sequence[ModelResponse]) -> float:
    """Amplitudes of all forces of the drive together, in model units at the model's clearance, of
    the wanted response that is driven least."""
    system = model.second_order()
    drives = [(r.omega, model.b / r.b) for r in responses] or [(system.own_frequency, 1.0)]
    channels = range(len(system.drive_shapes(system.own_frequency)))
    return min(
        sum(float(np.abs(system.drive_force(omega, k)).sum()) for k in channels) * share
        for omega, share in drives
    )


def forces(
    circuit: Circuit,
    system: SecondOrderSystem,
    volts: Array,
    drive: float,
    board: Board | None = None,
) -> tuple[Shifts, ...]:
    """Disturbances as constant forces at each clearance, between its mass and the other or the
    ground, that shift it as far; as shares of ``drive``, a force in model units.

    volts : (..., states) per model unit. board : as of ``Statics``.

    Raises
    ------
    ArithmeticError : the circuit has no rest.
    """
    zones = system.dead_zones[: len(system.clearances)]
    rows = [(c.mass, system.displacement(c), system.push(c)) for c in zones]
    first = np.eye(system.size)[0]
    rows = rows or [(0, first, first)]
    shifts = Statics(circuit, board).shifts
    out = []
    for (mass, row, push), shift in zip(rows, shifts, strict=True):
        compliance = abs(float(row @ np.linalg.solve(system.stiffness, push)))
        own = volts[..., 2 * mass]
        out.append(shift.over(compliance * drive * (own if own.ndim else float(own))))
    return tuple(out)


def largest_offset(opamp: OpAmp) -> float:
    """An op-amp's largest offset [V]: its data sheet's, or what the offsets are cut off at."""
    figure = opamp.offset
    return figure.max if figure.max is not None else opamp.offset_limit


def offset_forces(shifts: Shifts, limit: float) -> dict[str, Any]:
    """By section, what an offset of ``limit`` [V] does; independent of each other."""
    return {name: abs(shift) * limit for name, shift in shifts.offset.items()}


def thermal(ohms: float) -> float:
    """Current noise of a resistor [A/sqrt(Hz)]."""
    return float(np.sqrt(4.0 * BOLTZMANN * KELVIN / ohms))


def far_slope(
    circuit: Circuit, chain: str, side: int, values: Mapping[str, float] | None = None
) -> float:
    """Slope beyond every bend of a law, or of a stop, on one side: what the velocity of its mass
    loses by what it depends on [1/s² or 1/s], with all that is linear.

    chain : its name in ``Circuit.chains``. values : as of ``leftovers``.
    """
    zones = circuit.chains[chain]
    sides = [side * (zone in zones and side in dict(zone.contacts)) for zone in circuit.dead_zones]
    state = circuit.states.index(zones[0].state)
    board = _with(circuit, values)
    equations, key = NodalEquations(circuit, board), circuit.in_contact(sides)
    G, right = equations.of(key)
    solved = equations.solution(np.asarray(np.linalg.solve(G, right), dtype=np.float64))
    return -float(equations.rates(key, solved)[state | 1, state])


def _with(circuit: Circuit, values: Mapping[str, float] | None) -> Board:
    """The nominal board with these values."""
    board = nominal_board(circuit)
    return board if values is None else replace(board, values={**circuit.values, **values})


def leftovers(circuit: Circuit, values: Mapping[str, float] | None = None) -> Array:
    """(dead zones,) stiffness that each leaves inside its clearance, over that of its stops; of one
    that limits, beyond its ends over that between them.

    From the slope of the stage's output against the displacement, open and in contact: the output
    is the only path that differs. Of unequal stops the mean counts. values : ohm and farad in the
    place of the circuit's.
    """
    equations = NodalEquations(circuit, _with(circuit, values))

    def slopes(key: ModeKey) -> Array:
        """(dead zones,) of each output against the state that it watches."""
        G, right = equations.of(key)
        solved = equations.solution(np.asarray(np.linalg.solve(G, right), dtype=np.float64))
        places = (circuit.states.index(stop.state) for stop in circuit.dead_zones)
        pairs = zip(circuit.dead_zones, places, strict=True)
        return np.array([solved.voltage[stop.output][place] for stop, place in pairs])

    inside = slopes(circuit.open)
    contact = [
        np.mean([slopes(circuit.carrying(c))[k] for _, c in stop.contacts])
        for k, stop in enumerate(circuit.dead_zones)
    ]
    beyond = np.array(contact)
    limits = np.array([stop.limits for stop in circuit.dead_zones], dtype=bool)
    left, own = np.where(limits, beyond, inside), np.where(limits, inside, beyond)
    return np.asarray(left / (own - left))
