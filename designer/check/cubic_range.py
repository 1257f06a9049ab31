"""Cubic springs that a motion draws further than their pieces stand for the cube."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from designer.base.arrays import Array
from designer.base.si_unit import value_text
from designer.check.absolute_motion import OPEN_PERIODS
from designer.dynamics import step_budget
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowStatus
from designer.dynamics.orbit import ANSWERS, Orbit
from designer.dynamics.step_budget import Budget
from designer.model.law_elements import CubicSpring
from designer.model.lumped_system import LumpedSystem
from designer.model.mechanics import MechanicalModel

POINTS = 200
"""Of a drive period. A wave of the drive's tenth harmonic is missed by at most 1.2 % there."""


@dataclass(frozen=True)
class BeyondRange:
    """A cubic spring that a motion draws beyond its range, where its force goes on straight."""

    between: tuple[str, str]
    """What it joins."""
    range: float
    """Up to which displacement its pieces stand for the cube."""
    reached: float
    """Largest displacement over the motion, in the same unit."""

    def told(self, response: str, *, in_si: bool) -> str:
        """It in words. response : what draws it so far. in_si : whether lengths are in metres."""
        reached, span = (
            value_text(x, "m") if in_si else f"{x:.4g}" for x in (self.reached, self.range)
        )
        one, other = self.between
        return (
            f"{response} draws the cubic spring between {one} and {other} to {reached}, beyond its "
            f"range of {span}, where its force goes on straight: state a larger range"
        )

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def beyond_ranges(
    model: MechanicalModel, flow: Flow, orbit: Orbit, units: Array
) -> tuple[BeyondRange, ...]:
    """Those springs of the model that an orbit of ``flow`` draws beyond their ranges.

    model : at the orbit's clearance. units : (n,) of each state of the flow per unit of the
    model's.
    """
    springs = cubic_springs(model)
    if not springs or orbit.status not in ANSWERS:
        return ()
    with flow.within(Budget(step_budget.SETTLING)):
        mode, periods = orbit.mode or None, orbit.n or OPEN_PERIODS
        run = flow.run(orbit.start, periods, mode=mode, points=POINTS)
    if run.status is not FlowStatus.DONE:
        return ()
    displacements = (run.strobes[:, : len(units)] / units)[:, 0::2]
    out = []
    for law in model.second_order().laws:
        spring = springs.get(law.name)
        if spring is not None:
            reached = float(np.abs(displacements @ np.array(law.row)).max())
            if reached > spring.range:
                out.append(BeyondRange(spring.between, spring.range, reached))
    return tuple(out)


def cubic_springs(model: MechanicalModel) -> Mapping[str, BeyondRange]:
    """The cubic springs by the names of their laws, with nothing reached yet."""
    if not isinstance(model, LumpedSystem):
        return {}
    return {
        name: BeyondRange(each.between, model.b * each.range, 0.0)
        for name, each in model.nonlinear.items()
        if isinstance(each, CubicSpring)
    }
