"""What the reduction of a board says of one dead-zone stage: slopes, thresholds, what it leaves.

Of a dead zone of velocities what is said of displacements holds of velocities.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.circuit.reduction import Reduction
from designer.model.clearance import Clearance


class CutShort(ArithmeticError):
    """An op-amp that is meant to be linear inside the clearance is not."""


@dataclass(frozen=True)
class DeadZoneReading:
    """One clearance of a board, in volts and seconds."""

    clearance: Clearance
    """The clearance as wanted."""
    leftover: Array
    """(n, n) what the stage adds to the state matrix while the clearance is open."""
    constant: Array
    """(n,) what it adds to the rates of the states then, as a constant."""
    slopes: dict[int, Array]
    """(n, n) what it adds to the state matrix in contact, by side; one under 0 where both sides are
    ends of one switch, or where there is only one."""
    nulls: dict[int, float]
    """ln of the null's gain ratio, by side."""
    bias: float
    """Constant force inside the clearance, over the mass's springs at the threshold."""
    thresholds: dict[int, float]
    """Displacement of the mass [V] at which contact begins, by side, positive away from rest."""

    @property
    def first_gap(self) -> tuple[int, float]:
        """The first side whose gap is not zero, and that gap.

        Raises
        ------
        StopIteration : every gap is zero.
        """
        return next((side, stop.gap) for side, stop in self.clearance.sides if stop.gap)

    @classmethod
    def of(cls, reduction: Reduction, index: int, clearance: Clearance) -> DeadZoneReading:
        """The stage of the clearance with this index.

        Raises
        ------
        CutShort : the open mode does not hold up to where contact begins.
        """
        c = reduction.circuit
        stop = c.dead_zones[index]
        system = reduction.system()
        state, row = c.states.index(stop.state), 2 * clearance.mass + 1
        rest, inside = system.mode(c.open), reduction.solution(c.open).voltage[stop.output]
        flat = float(inside[state])
        slopes: dict[int, Array] = {}
        thresholds: dict[int, float] = {}
        nulls: dict[int, float] = {}
        leftover, constant = np.zeros_like(rest.A), np.zeros_like(rest.d)
        bias = 0.0
        for side, contact in stop.contacts:
            key = c.carrying(contact)
            steep = float(reduction.solution(key).voltage[stop.output][state])
            change = system.mode(key).A - rest.A
            per_gain = change / (steep - flat)
            end = reduction.threshold(stop, contact)
            _stays_linear(reduction, index, end, contact.switch)
            if not thresholds and not stop.limits:
                leftover = flat * per_gain
                constant = float(inside[-1]) * per_gain[:, state]
                spring = abs(float((rest.A - leftover)[row, state]))
                bias = float(inside[-1] * per_gain[row, state]) / (spring * abs(end) or np.inf)
            thresholds[side] = side * end
            one = stop.shared or len(stop.contacts) == 1
            left, own = (steep, flat) if stop.limits else (flat, steep)
            nulls[side] = float(np.log1p(-left / own))
            slopes.setdefault(0 if one else side, change if stop.limits else steep * per_gain)
        return cls(clearance, leftover, constant, slopes, nulls, bias, thresholds)


def _stays_linear(reduction: Reduction, index: int, end: float, ends: str) -> None:
    """The open mode has to hold up to where contact begins, at ``end`` [V], whatever the stages of
    other clearances do there, and the amplifiers in front of them. Between two masses ``end`` is
    where one would be with the other one at rest, so only the stage's own amplifiers count."""
    c = reduction.circuit
    zones = c.dead_zones
    state, own = c.states.index(zones[index].state), zones[index].difference
    others = {name for k, stop in enumerate(zones) if k != index for name in stop.switches}
    fronts = {zone.difference[0] for zone in zones if zone.difference not in (None, own)}
    others |= {section.name for section in c.sections if section.output in fronts}
    if own is not None:
        others |= {s.name for s in c.sections if s.output != own[0]} - set(zones[index].switches)
    for guard in reduction.system().mode(c.open).guards:
        pairs = zip(c.switches, c.open, guard.target, strict=True)
        switch = next(name for name, here, there in pairs if here != there)
        reach = abs(float(guard.C[state]) * end) + abs(guard.e)
        if switch not in {ends, *others} and float(guard.C[state]) * end + guard.e > 1e-9 * reach:
            raise CutShort(f"{switch} changes inside the clearance, before v1 = {end:.4g} V")
