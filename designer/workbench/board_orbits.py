"""Orbits of boards as a fit needs them: followed from board to board, as voltages of nets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array, Index
from designer.circuit.netlist import Excitation
from designer.circuit.reduction import FloatingCircuit, Reduction
from designer.dynamics.attractors import peaks_near, shoot
from designer.dynamics.flow import Flow

POINTS = 512
"""Points of an orbit per drive period."""


@dataclass(frozen=True)
class NetOrbit:
    """A periodic orbit of a board, as voltages of nets."""

    start: Array
    """(states,) state at drive phase 0."""
    n: int
    """Its period in drive periods."""
    volts: Array
    """(n · POINTS, nets) voltages [V]."""
    states: Array
    """(n · POINTS, states) states at the same phases."""
    sides: Index
    """(n · POINTS, clearances) side of the contact there: 1 upper, -1 lower, 0 none."""
    beyond: Array
    """(n · POINTS, clearances, 2) how far past the upper and the lower stop [V]: positive
    in contact; -inf where there is no stop."""
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
    beyond = beyond_stops(reduction, states, excitation)
    volts = net_volts(reduction, states, excitation, nets, sides_of(beyond))
    return NetOrbit(found[0], n, volts, states, sides_of(beyond), beyond, found[1])


def whole_states(states: Array, excitation: Excitation) -> Array:
    """(k, n + 2) what rows of a circuit are over: states (k, n), ``POINTS`` of them a drive period
    from phase 0, the generator [V] and 1."""
    u = excitation.drive.at(2.0 * np.pi * np.arange(len(states)) / POINTS)
    return np.column_stack([states, u, np.ones(len(states))])


def beyond_stops(reduction: Reduction, states: Array, excitation: Excitation) -> Array:
    """(k, clearances, 2) the displacement beyond the upper and the lower stop of each clearance
    [V] along states (k, n) as of ``whole_states``; -inf where there is no stop."""
    whole, system = whole_states(states, excitation), reduction.system()
    out = np.full((len(states), len(reduction.circuit.stops), 2), -np.inf)
    for c in range(out.shape[1]):
        for sign, row in system.contact_rows(c).items():
            out[:, c, 0 if sign > 0 else 1] = whole @ row
    return out


def sides_of(beyond: Array) -> Index:
    """(k, clearances) side of the contact, 1 or -1, of ``beyond_stops``; 0 where there is none."""
    return np.asarray((beyond[..., 0] > 0.0).astype(np.int64) - (beyond[..., 1] > 0.0))


def net_volts(
    reduction: Reduction, states: Array, excitation: Excitation, nets: Sequence[str], sides: Index
) -> Array:
    """(k, nets) voltages [V] along states (k, n) as of ``whole_states``, in contact on ``sides``
    (k, clearances).

    A net behind a dead zone changes its law where contact begins. The steps of a rectifier on the
    way there, microvolts wide, are left out.
    """
    whole = whole_states(states, excitation)
    volts = np.empty((len(states), len(nets)))
    for each in np.unique(sides, axis=0):
        here = (sides == each).all(axis=1)
        key = reduction.circuit.in_contact(each.tolist())
        voltage = reduction.solution(key).voltage
        volts[here] = whole[here] @ np.column_stack([voltage[net] for net in nets])
    return volts
