"""A force that is a continuous piecewise-linear function of one displacement or one velocity.

Between its corners it is straight, and straight on beyond the outermost. The piece on which the
system is at rest is part of the linear equations; at every corner away from it a spring, or a
damper, joins in whose constant is the change of the slope.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np

from designer.base.arrays import Array

Quantity = Literal["displacement", "velocity"]
Point = tuple[float, float]
ROUNDING = 1e-12
"""Of the force, over the sizes that it is made of: a point that is no further off the line between
its neighbours is no corner."""


@dataclass(frozen=True)
class ForceLaw:
    """One such force. Where it is positive it pulls back, as a spring does that is stretched, or a
    damper that is drawn out."""

    name: str
    row: tuple[float, ...]
    """(n,) coefficients over the masses' displacements, or velocities, of what it depends on. The
    force acts on each mass with the negative of its coefficient, or of ``push``."""
    quantity: Quantity
    points: tuple[tuple[float, float], ...]
    """(x, force) by rising x, at least two: corners, and a point on each piece beyond them. Those
    where the slope stays are left out."""
    push: tuple[float, ...] = ()
    """(n,) as of ``Clearance.push``; () where it is ``row``."""
    curved: bool = False
    """Whether its pieces stand for a curve, whose corners are none."""

    def __post_init__(self) -> None:
        threes = zip(self.points, self.points[1:], self.points[2:], strict=False)
        inner = (b for a, b, c in threes if _bent(a, b, c))
        object.__setattr__(self, "points", (self.points[0], *inner, self.points[-1]))

    @cached_property
    def slopes(self) -> tuple[float, ...]:
        """Of the pieces, from the lowest on."""
        return tuple((f1 - f0) / (x1 - x0) for (x0, f0), (x1, f1) in pairwise(self.points))

    @property
    def corners(self) -> tuple[float, ...]:
        """Where the slope changes."""
        return tuple(x for x, _ in self.points[1:-1])

    @property
    def rest(self) -> int:
        """Number of the piece that holds at 0; of a corner there, the upper piece."""
        return sum(x <= 0.0 for x in self.corners)

    @property
    def slope(self) -> float:
        """Of the piece at rest."""
        return self.slopes[self.rest]

    @property
    def offset(self) -> float:
        """The force at 0."""
        (x0, f0), (x1, f1) = self.points[self.rest : self.rest + 2]
        return (f0 * x1 - f1 * x0) / (x1 - x0)  # exactly 0 between a point and its negative

    @cached_property
    def bends(self) -> Mapping[int, tuple[tuple[float, float], ...]]:
        """(distance from 0, change of the slope) of the corners on each side, 1 upwards and -1
        downwards, the nearest first; a side without one has none."""
        changes = [after - before for before, after in pairwise(self.slopes)]
        corners = list(zip(self.corners, changes, strict=True))
        upper = tuple(corners[self.rest :])
        lower = tuple((-x, -change) for x, change in reversed(corners[: self.rest]))
        return {side: found for side, found in ((1, upper), (-1, lower)) if found}

    @property
    def ends(self) -> tuple[float, float]:
        """Slopes below the lowest corner and above the highest."""
        return self.slopes[0], self.slopes[-1]

    @property
    def mean_slope(self) -> float:
        """Of the force over the points, rises and falls counted alike: what it is like for a motion
        that spans them."""
        way = sum(abs(f1 - f0) for (_, f0), (_, f1) in pairwise(self.points))
        return way / (self.points[-1][0] - self.points[0][0])

    @property
    def reach(self) -> float:
        """The corner that is furthest from 0; 0 where there is none."""
        return max(map(abs, self.corners), default=0.0)

    @property
    def even(self) -> bool:
        """Whether the force at -x is the negative of that at x."""
        return self.bends.get(1) == self.bends.get(-1) and self.offset == 0.0

    def force(self, x: Array) -> Array:
        """The force at each x."""
        total = self.offset + self.slope * x
        for side, bends in self.bends.items():
            for place, change in bends:
                total = total + side * change * np.maximum(side * x - place, 0.0)
        return np.asarray(total)

    def scaled(self, factor: float) -> ForceLaw:
        """The same with every length, speed and force ``factor`` times as large."""
        points = tuple((factor * x, factor * force) for x, force in self.points)
        return replace(self, points=points)


def _bent(before: Point, point: Point, after: Point) -> bool:
    """Whether the slope changes at a point, but for rounding."""
    (x0, f0), (x, force), (x1, f1) = before, point, after
    slope = (f1 - f0) / (x1 - x0)
    size = max(abs(f0), abs(f1)) + abs(slope) * max(abs(x0), abs(x1))
    return abs(force - f0 - slope * (x - x0)) > ROUNDING * size
