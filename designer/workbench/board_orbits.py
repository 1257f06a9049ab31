"""Orbits of boards as a fit needs them: followed from board to board, as voltages of nets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.circuit.netlist import Excitation
from designer.circuit.reduction import FloatingCircuit, Reduction
from designer.dynamics.attractors import peaks_near, shoot
from designer.dynamics.flow import Flow

POINTS = 512
"""Of an orbit per drive period."""


@dataclass(frozen=True)
class NetOrbit:
    """A periodic orbit of a board, as voltages of nets."""

    start: Array
    """(states,) state at drive phase 0."""
    n: int
    """Its period in drive periods."""
    volts: Array
    """(n · POINTS, nets) voltages [V]."""
    monodromy: Array
    """(states, states) its matrix over n periods."""

    @property
    def stable(self) -> bool:
        return bool(np.abs(np.linalg.eigvals(self.monodromy)).max() < 1.0)


def follow(
    reduction: Reduction, excitation: Excitation, nets: Sequence[str], near: Array, n: int
) -> NetOrbit | None:
    """The orbit of period n of a board near a start (states,); None where shooting does not arrive
    or the board has no flow."""
    try:
        flow = Flow(reduction.system(), excitation.drive)
        found = shoot(flow, near, n, peak=peaks_near(flow, near))
        if found is None:
            return None
        states = flow.run(found[0], n, points=POINTS).strobes[:-1]
    except (FloatingCircuit, ArithmeticError, np.linalg.LinAlgError):
        return None
    if len(states) < n * POINTS:
        return None
    return NetOrbit(found[0], n, net_volts(reduction, states, excitation, nets), found[1])


def net_volts(
    reduction: Reduction, states: Array, excitation: Excitation, nets: Sequence[str]
) -> Array:
    """(k, nets) voltages [V] along states (k, n), ``POINTS`` of them a drive period from phase 0.

    A net behind a dead zone changes its law where contact begins. The steps of a rectifier on the
    way there, microvolts wide, are left out.
    """
    circuit, drive = reduction.circuit, excitation.drive
    u = drive.amplitude * np.sin(2.0 * np.pi * np.arange(len(states)) / POINTS) + drive.offset
    whole = np.column_stack([states, u, np.ones(len(states))])
    side = np.zeros((len(states), len(circuit.stops)), dtype=np.int64)
    for c in range(len(circuit.stops)):
        for sign, row in reduction.system().contact_rows(c).items():
            side[whole @ row > 0.0, c] = sign
    volts = np.empty((len(states), len(nets)))
    for sides in np.unique(side, axis=0):
        here = (side == sides).all(axis=1)
        voltage = reduction.solution(circuit.in_contact(sides.tolist())).voltage
        volts[here] = whole[here] @ np.column_stack([voltage[net] for net in nets])
    return volts
