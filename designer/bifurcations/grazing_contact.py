"""The height of one turning point over its stop, and its rate, on the exact flow.

The motion about the turning point is that of one mode: open at a tip, in contact at a dip. It is
taken on smoothly where a shallow contact (or a short gap between two contacts) interrupts it, so
that height and rate are smooth functions of state, phase and parameters. Where the height is zero
nothing interrupts it, and both are exact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowStatus
from designer.dynamics.mode_tables import augmented, augmented_row, augmented_state, step_length
from designer.dynamics.piecewise_linear import Mode
from designer.kernels.kernel_algebra import motion_terms

FEWEST, MOST = 32, 20_000
"""Nodes in a drive period from which the motion is taken on."""
TERMS = 24
"""Terms of the Taylor series from a node on: beyond rounding for a step of the general kernel."""
ORDERS = np.arange(float(TERMS))
"""The orders of those terms."""


@dataclass(frozen=True)
class GrazingContact:
    """Which turning point grazes which stop."""

    clearance: int
    """Index of the clearance, or number of a corner (``PiecewiseLinearSystem.corners``)."""
    side: int
    """1 for its upper stop, -1 for the lower."""
    tip: bool
    """Whether it is the tip of a near miss or a shallow contact; else the dip between two."""


def height(flow: Flow, x: Array, n: int, contact: GrazingContact, phase: float) -> Array | None:
    """(3,) height over the stop, positive in contact, with its first and second derivative by the
    phase, at a phase in drive periods after the strobe x of an orbit of period n.

    None where the flow does not come to an end.
    """
    found = height_along(flow, x, n, contact, phase, np.zeros((len(x), 0)))
    return None if found is None else found[:, 0]


def height_along(
    flow: Flow, x: Array, n: int, contact: GrazingContact, phase: float, tangent: Array
) -> Array | None:
    """(3, 1 + k) the same, and its rates of change along k tangent vectors (states, k) at x."""
    period = flow.drive.period
    nodes = _nodes(flow, contact)
    place = (phase % n) * nodes
    k = int(place)
    state, along = x, tangent
    if k:
        vectors = tangent if tangent.size else None
        run = flow.run(x, -(-k // nodes), points=nodes, stretches=k, tangent=vectors)
        if run.status is not FlowStatus.DONE:
            return None
        state, along = run.strobes[-1], along if run.tangent is None else run.tangent
    angle = 2.0 * np.pi * k / nodes
    drive, orders = flow.drive, flow.orders
    mode = _mode(flow, state, angle, contact)
    row = augmented_row(flow.system.contact_rows(contact.clearance)[contact.side], drive, orders)
    whole = augmented_state(state, angle, orders)
    z = np.zeros((len(whole), 1 + along.shape[1]))
    z[:, 0] = whole
    z[: len(x), 1:] = along
    return _derivatives(
        row, augmented(mode, drive, orders), z, (place - k) * period / nodes, period
    )


def _nodes(flow: Flow, contact: GrazingContact) -> int:
    """Nodes in a drive period: a step of the general kernel apart, in contact too."""
    rest = flow.system.mode(flow.system.start)
    guards = [g for g in rest.guards if g.clearance == contact.clearance]
    contacts = [flow.system.mode(g.target) for g in guards] or flow.system.modes_beyond
    step = min(step_length(mode.A, flow.fastest) for mode in (rest, *contacts))
    return int(np.clip(np.ceil(flow.drive.period / step), FEWEST, MOST))


def _mode(flow: Flow, x: Array, angle: float, contact: GrazingContact) -> Mode:
    """The mode about the turning point: the one at x but for the contact at the stop itself."""
    system = flow.system
    key, number = flow.mode_at(x, angle), contact.clearance - len(system.clearances)
    if number >= 0:
        return system.at_corner(number, key, beyond=not contact.tip)
    mode = system.mode(key)
    wanted = 0 if contact.tip else contact.side
    if mode.sides[contact.clearance] == wanted:
        return mode
    for guard in mode.guards:
        other = system.mode(guard.target)
        if guard.clearance == contact.clearance and other.sides[contact.clearance] == wanted:
            return other
    return mode


def _derivatives(row: Array, M: Array, z: Array, time: float, period: float) -> Array:
    """(3, k) value and first two derivatives, by time over the period, of row · exp(M time) z."""
    terms = np.empty((TERMS, z.shape[1]))
    motion_terms(row, M, period, z, terms)
    powers = (time / period) ** np.arange(TERMS)
    first = terms[1:] * ORDERS[1:, None]
    second = first[1:] * ORDERS[1:-1, None]
    return np.stack([powers @ terms, powers[:-1] @ first, powers[:-2] @ second])
