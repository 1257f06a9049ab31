"""What a run of the flow comes to: how it ended, its strobes, impacts and extremes."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from designer.base.arrays import Array, Index
from designer.dynamics.orbit import largest_speeds
from designer.dynamics.piecewise_linear import ModeKey


class FlowStatus(StrEnum):
    """How a run of the flow ended."""

    DONE = "done"
    CHATTER = "too many events"
    DIVERGED = "diverged"
    TOO_LONG = "too many steps"


@dataclass(frozen=True)
class Impacts:
    """Entries into contact in order of time."""

    time: Array
    """(k,) times of the entries."""
    clearance: Index
    """(k,) ints, index of the clearance."""
    side: Index
    """(k,) ints, 1 at the upper and -1 at the lower stop."""
    velocity: Array
    """(k,) velocities in the clearance at the entries."""
    state: Array
    """(k, n) states at the entries."""


@dataclass(frozen=True)
class FlowResult:
    """What happened over ``periods`` drive periods."""

    status: FlowStatus
    """How the run ended."""
    strobes: Array
    """(periods · points + 1, n) states at the start and after each stretch."""
    counts: Index
    """(periods · points, clearances, 2) impacts on the lower and the upper stop."""
    mode: ModeKey
    """Key of the mode that was reached."""
    tangent: Array | None
    """(n, k) tangent vectors carried along, or None."""
    impacts: Impacts
    """Entries into contact, where they were measured."""
    extremes: Array
    """(n, 2) least and greatest value of each state, where they were measured."""
    spans: Array
    """(clearances, 2) least and greatest displacement in each clearance, where measured."""
    graze: Array
    """(clearances, 2) the smallest of all contacts' greatest penetrations, and the nearest approach
    to a stop without contact; inf where there is none."""
    tangencies: int
    """Undecided tangencies to a stop."""
    clipped_time: float
    """Time spent in modes where an element that ought to be linear is at its limit."""

    @property
    def speeds(self) -> Array:
        """(clearances, 2) as of ``Orbit``, where the impacts were measured."""
        met = self.impacts
        return largest_speeds(met.velocity, met.side, met.clearance, len(self.spans))

    @property
    def penetration(self) -> float:
        """The smallest of all contacts' greatest penetrations."""
        return float(self.graze[:, 0].min(initial=np.inf))

    @property
    def miss(self) -> float:
        """The nearest approach to a stop without contact; inf where there is none."""
        return float(self.graze[:, 1].min(initial=np.inf))
