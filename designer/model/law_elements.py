"""Elements whose force is not linear, each a table of a model file of ``format = 2``: laws that are
given point by point, cubic springs and friction.

Each stands for one ``ForceLaw``. All numbers are in the file's own consistent units; texts with
units become SI.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

from designer.base.schema import (
    Accepts,
    FileTable,
    choice,
    fraction,
    number,
    physical,
    such,
)
from designer.base.units import has_unit
from designer.model.cubic_law import MOST_POINTS, cubic_error, cubic_points, points_for
from designer.model.element_keys import NAME, combination, signed, two_bodies
from designer.model.force_law import Quantity

DEFAULT_ERROR = 0.001
"""Of a cubic spring that states neither its points nor their error."""

Points = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class LawPoints:
    """The points of a law as a file gives them."""

    values: Points
    """(x, force) by rising x."""
    unit: str
    """"m" or "m/s" where some x is a text with that unit, else ""."""


def _points() -> Accepts:
    expected = (
        f"two to {MOST_POINTS} points [x, force] by rising x, such as "
        '[[-1.0, -2.0], [1.0, 2.0]] or [["-1 mm", "-20 N"], ["1 mm", "20 N"]]'
    )

    def place(value: object) -> tuple[float, str]:
        unit = ""
        if isinstance(value, str):
            unit = "m/s" if has_unit(value, "m/s") else "m"
        return _finite(value, unit), unit

    def check(value: object) -> LawPoints:
        if not isinstance(value, list) or not 2 <= len(value) <= MOST_POINTS:
            raise ValueError
        if not all(isinstance(point, list) and len(point) == 2 for point in value):
            raise ValueError
        places = [place(x) for x, _ in value]
        units = {unit for _, unit in places} - {""}
        if len(units) > 1:
            raise ValueError("x in m and in m/s")
        points = [
            (x, _finite(force, "N")) for (x, _), (_, force) in zip(places, value, strict=True)
        ]
        if not all(before < after for (before, _), (after, _) in pairwise(points)):
            raise ValueError("x does not rise")
        return LawPoints(tuple(points), units.pop() if units else "")

    pair = {"type": "array", "items": {"type": ["number", "string"]}, "minItems": 2, "maxItems": 2}
    json = {"type": "array", "items": pair, "minItems": 2, "maxItems": MOST_POINTS}
    return Accepts(expected, check, json=json)


def _finite(value: object, unit: str) -> float:
    return float(number(unit or "m", "a number").check(value))


@dataclass(frozen=True)
class Law(FileTable):
    """A force that is straight between given points, and straight on beyond them."""

    name: Annotated[str, NAME]
    """Its name."""
    points: Annotated[LawPoints, _points()]
    """[x, force] by rising x. A force above 0 pulls back, as that of a stretched spring."""
    quantity: Annotated[Quantity, choice("displacement", "velocity")] = "displacement"
    """What x is: a displacement or a velocity."""
    between: Annotated[tuple[str, str] | None, two_bodies()] = None
    """What it joins: x is that of the first less that of the second."""
    of: Annotated[tuple[tuple[str, float], ...] | None, combination()] = None
    """In the place of ``between``: x is the sum of the masses' displacements, or velocities, times
    these factors."""

    @property
    def factors(self) -> Mapping[str, float]:
        """What x is the sum of, ground left out of it or not."""
        if self.between is not None:
            first, second = self.between
            return {first: 1.0, second: -1.0}
        return dict(self.of or ())

    @property
    def corners(self) -> Points:
        """``ForceLaw.points``."""
        return self.points.values


def _even() -> Accepts:
    expected = f"an even whole number from 2 to {MOST_POINTS}"
    json = {"type": "integer", "minimum": 2, "maximum": MOST_POINTS, "multipleOf": 2}
    return such(expected, lambda n: type(n) is int and n in range(2, MOST_POINTS + 1, 2), json)


@dataclass(frozen=True)
class CubicSpring(FileTable):
    """A spring with the force k1 x + k3 x³, by straight pieces."""

    between: Annotated[tuple[str, str], two_bodies()]
    """What it joins."""
    k3: Annotated[float, number("", "a number, in N/m³")]
    """Of the cube; negative: it softens."""
    range: Annotated[float, physical("m")]
    """Up to which displacement the pieces stand for the cubic force; beyond it the last one goes
    on."""
    k1: Annotated[float, signed("N/m", "a stiffness, negative for two wells,")] = 0.0
    """Of the linear part."""
    points: Annotated[int | None, _even()] = None
    """How many points the pieces have; or ``error``."""
    error: Annotated[float | None, fraction("0.01 is 1 % of the largest force in the range")] = None
    """Largest error of the force, over the largest force in the range; 0.001 where neither is
    stated."""

    @property
    def count(self) -> int | None:
        """How many points; None where so small an error takes too many."""
        if self.points is not None:
            return self.points
        wanted = DEFAULT_ERROR if self.error is None else self.error
        return points_for(self.k1, self.k3, self.range, wanted)

    @property
    def largest_error(self) -> float:
        """That of the pieces, over the largest force in the range."""
        return cubic_error(self.k1, self.k3, self.range, self.count or MOST_POINTS)

    @property
    def corners(self) -> Points:
        """``ForceLaw.points``."""
        return cubic_points(self.k1, self.k3, self.range, self.count or MOST_POINTS)


@dataclass(frozen=True)
class Friction(FileTable):
    """Dry friction whose force rises with the sliding velocity until it slides."""

    between: Annotated[tuple[str, str], two_bodies()]
    """What slides on what."""
    force: Annotated[float, physical("N", zero=True)]
    """While it slides."""
    velocity: Annotated[float, physical("m/s")]
    """Up to which the force rises in proportion."""
    static: Annotated[float | None, physical("N")] = None
    """The force at ``velocity``, where it is larger than while it slides."""
    stribeck: Annotated[float | None, physical("m/s")] = None
    """The velocity at which it has fallen to ``force``."""
    speed: Annotated[float, signed("m/s", "a velocity")] = 0.0
    """Of the surface that the first body slides on, as that of a belt."""

    @property
    def corners(self) -> Points:
        """``ForceLaw.points``."""
        peak = self.force if self.static is None else self.static
        upper = [(self.velocity, peak)]
        if self.stribeck is not None:
            upper.append((self.stribeck, self.force))
        upper.append((upper[-1][0] + self.velocity, self.force))
        points = [*((-x, -force) for x, force in reversed(upper)), *upper]
        return tuple((x + self.speed, force) for x, force in points)


NonlinearElement = Law | CubicSpring | Friction


def quantity_of(element: NonlinearElement) -> Quantity:
    """What the force of an element depends on."""
    if isinstance(element, Law):
        return element.quantity
    return "velocity" if isinstance(element, Friction) else "displacement"


def factors_of(element: NonlinearElement) -> Mapping[str, float]:
    """What that is the sum of: a factor for each body."""
    if isinstance(element, Law):
        return element.factors
    first, second = element.between
    return {first: 1.0, second: -1.0}
