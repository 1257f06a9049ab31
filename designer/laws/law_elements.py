"""Elements whose force is not linear, each a table of a model file of ``format = 2``: laws that are
given point by point, cubic springs and friction.

Each stands for one ``ForceLaw``. All numbers are in the file's own consistent units; texts with
units become SI. A kind is one class here, named in ``KINDS``, a field of ``Elements`` and a
table of ``model_file``; checks, sweeps, tables, drawings and an equation by points follow from it.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import chain, pairwise
from typing import Annotated, ClassVar, Literal

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import MISSING
from designer.base.schema import (
    GREATEST,
    SMALLEST,
    Accepts,
    FileTable,
    choice,
    fraction,
    number,
    physical,
    such,
)
from designer.base.units import has_unit
from designer.laws.element_keys import (
    NAME,
    NUMBERS,
    check_joined,
    check_size,
    combination,
    refuse,
    signed,
    two_bodies,
)
from designer.laws.force_law import Quantity

DEFAULT_ERROR = 0.001
"""Of a cubic spring that states neither its points nor their error."""

Points = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class LawNumber:
    """A number of such an element, which a sweep may change."""

    least: float
    """The least that it may be."""
    unit: str
    """Its SI unit; "" where it has none of its own."""
    meaning: str
    """What it is, for the table of the elements."""
    idle_at_zero: bool = False
    """Whether the element is as if it had none of it where it is 0."""


@dataclass(frozen=True)
class SmoothLaw:
    """A curved law that straight pieces stand for."""

    text: str
    """The law with its numbers, over x."""
    force: Callable[[Array], Array]
    """(k,) forces at displacements, odd in them."""
    span: float
    """Displacement up to which the pieces are laid."""
    count: int
    """How many points they join."""
    largest_error: float
    """Of the pieces, over the largest force in the span."""


class NonlinearElement(FileTable, ABC):
    """An element whose force is a continuous piecewise-linear function of one displacement or one
    velocity: what every kind has."""

    TABLE: ClassVar[str]
    """Of a model file."""
    LIST: ClassVar[str]
    """The field of ``Elements``."""
    WORDS: ClassVar[str]
    """What it is called in a sketch, such as "cubic spring"; the last word where names have it."""
    PARAMETERS: ClassVar[Mapping[str, LawNumber]] = {}
    """Those that a sweep may change, by their keys; the first stands beside it in a drawing."""
    between: tuple[str, str] | None
    """The two bodies that it connects, a field of each kind; None of a combination of masses."""

    @property
    @abstractmethod
    def quantity(self) -> Quantity:
        """What its force depends on."""

    @property
    @abstractmethod
    def corners(self) -> Points:
        """``ForceLaw.points``."""

    @property
    def factors(self) -> Mapping[str, float]:
        """What that is the sum of: a factor for each body, ground left out of it or not."""
        assert self.between is not None
        first, second = self.between
        return {first: 1.0, second: -1.0}

    @property
    def bodies(self) -> str:
        """The two bodies as a part of its name, such as "a-ground"."""
        return "-".join(self.between or ())

    @property
    def law_name(self) -> str:
        """Its name among all laws; a second one between the same bodies gets a number."""
        return f"{self.bodies}.{self.WORDS.split()[0]}"

    @property
    def drawn(self) -> Literal["spring", "damper", "friction"]:
        """The symbol in a drawing."""
        return "spring" if self.quantity == "displacement" else "damper"

    @property
    def curve(self) -> SmoothLaw | None:
        """The law that its pieces stand for, where that is curved."""
        return None

    @abstractmethod
    def check(self) -> None:
        """Refuse numbers that make no such law.

        Raises
        ------
        InputError : its field is that of the model file.
        """


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
class Law(NonlinearElement):
    """A force that is straight between given points, and straight on beyond them."""

    TABLE, LIST, WORDS = "law", "laws", "law"

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
        return dict(self.of or ()) if self.between is None else super().factors

    @property
    def law_name(self) -> str:
        return self.name

    @property
    def corners(self) -> Points:
        return self.points.values

    def check(self) -> None:
        field = f"law {self.name}"
        check_joined(field, self.between, self.of)
        expected = {"displacement": "m", "velocity": "m/s"}[self.quantity]
        if self.points.unit not in ("", expected):
            text = f"x in {self.points.unit}"
            refuse(f"{field}.points", text, f"x in {expected}: the law is of a {self.quantity}")
        for value in chain.from_iterable(self.corners):
            check_size(f"{field}.points", value, "numbers")
        for i, ((x0, _), (x1, _)) in enumerate(pairwise(self.corners), start=1):
            if not x0 < x1:  # a sweep's: those of a file rise
                text = f"x{i} = {x0:g} and x{i + 1} = {x1:g}"
                refuse(f"{field}.points", text, f"points by rising x, not {text}")
        slopes = [(f1 - f0) / (x1 - x0) for (x0, f0), (x1, f1) in pairwise(self.corners)]
        steepest = max(slopes, key=abs)
        if not abs(steepest) <= NUMBERS[1]:
            expected = f"slopes up to {NUMBERS[1]:g}"
            refuse(f"{field}.points", f"a slope of {steepest:g}", expected)


def _even() -> Accepts:
    expected = f"an even whole number from 2 to {MOST_POINTS}"
    json = {"type": "integer", "minimum": 2, "maximum": MOST_POINTS, "multipleOf": 2}
    return such(expected, lambda n: type(n) is int and n in range(2, MOST_POINTS + 1, 2), json)


@dataclass(frozen=True)
class CubicSpring(NonlinearElement):
    """A spring with the force k1 x + k3 x³, by straight pieces."""

    TABLE, LIST, WORDS = "cubic_spring", "cubic_springs", "cubic spring"
    PARAMETERS: ClassVar[Mapping[str, LawNumber]] = {
        "k1": LawNumber(-GREATEST, "N/m", "linear part of the spring", idle_at_zero=True),
        "k3": LawNumber(-GREATEST, "", "cubic part of the spring (N/m³ in SI)"),
        "range": LawNumber(SMALLEST, "m", "up to which its pieces are laid"),
    }

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
    def quantity(self) -> Quantity:
        return "displacement"

    @property
    def corners(self) -> Points:
        return cubic_points(self.k1, self.k3, self.range, self.count or MOST_POINTS)

    @property
    def curve(self) -> SmoothLaw:
        return SmoothLaw(
            f"{self.k1:.4g} x + {self.k3:.4g} x³",
            lambda x: self.k1 * x + self.k3 * x**3,
            self.range,
            self.count or MOST_POINTS,
            self.largest_error,
        )

    def check(self) -> None:
        field = f"cubic_spring {self.bodies}"
        for key in ("k1", "k3", "range"):
            check_size(f"{field}.{key}", getattr(self, key))
        if self.points is not None and self.error is not None:
            refuse(f"{field}.error", self.error, "none beside points, which decide it")
        if self.count is None:
            reached = f"they reach {self.largest_error:.2g}"
            expected = f"an error that {MOST_POINTS} points reach; {reached}"
            refuse(f"{field}.error", self.error, expected)


@dataclass(frozen=True)
class Friction(NonlinearElement):
    """Dry friction whose force rises with the sliding velocity until it slides."""

    TABLE, LIST, WORDS = "friction", "frictions", "friction"
    PARAMETERS: ClassVar[Mapping[str, LawNumber]] = {
        "force": LawNumber(0.0, "N", "friction", idle_at_zero=True),
        "velocity": LawNumber(SMALLEST, "m/s", "up to which it rises"),
        "static": LawNumber(SMALLEST, "N", "friction there"),
        "stribeck": LawNumber(SMALLEST, "m/s", "where it has fallen"),
        "speed": LawNumber(-GREATEST, "m/s", "of the surface that it slides on", idle_at_zero=True),
    }

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
    def quantity(self) -> Quantity:
        return "velocity"

    @property
    def drawn(self) -> Literal["friction"]:
        return "friction"

    @property
    def corners(self) -> Points:
        peak = self.force if self.static is None else self.static
        upper = [(self.velocity, peak)]
        if self.stribeck is not None:
            upper.append((self.stribeck, self.force))
        upper.append((upper[-1][0] + self.velocity, self.force))
        points = [*((-x, -force) for x, force in reversed(upper)), *upper]
        return tuple((x + self.speed, force) for x, force in points)

    def check(self) -> None:
        field = f"friction {self.bodies}"
        if (self.static is None) != (self.stribeck is None):
            key = "static" if self.static is None else "stribeck"
            refuse(f"{field}.{key}", MISSING, "both static and stribeck, or neither")
        if self.static is not None and self.static < self.force:
            refuse(f"{field}.static", self.static, f"at least force = {self.force:g}")
        if self.stribeck is not None and not self.stribeck > self.velocity:
            expected = f"more than velocity = {self.velocity:g}"
            refuse(f"{field}.stribeck", self.stribeck, expected)


KINDS: tuple[type[NonlinearElement], ...] = (Law, CubicSpring, Friction)
"""Every kind, in the order of equations and tables."""


MOST_POINTS = 64
"""Of a law; by then the error of a pure cubic is 0.02 % of the force at the end of the range."""
_ERROR = 0.25
"""Error of x³ by straight pieces of which the first ends at 1: 3x/4 - x³ is 1/4 at 1/2, and -1/4
at 1."""


def cubic_points(k1: float, k3: float, span: float, count: int) -> tuple[tuple[float, float], ...]:
    """(x, force) of ``count`` points from -``span`` to ``span``, an even number of at least two.

    On both sides of rest alike the largest error of the force is the same on every piece, above and
    below the law: no other continuous choice of as many pieces has a smaller one over the range.
    The first piece runs through rest. Its error and that of a chord depend on k3 alone, so the
    places of the corners of one unit of length serve for all.
    """
    places = _places(count // 2)
    unit = span / places[-1]
    upper = [
        (x, k1 * x + k3 * (x**3 - _ERROR * unit**3))
        for x in (span * t / places[-1] for t in places)
    ]
    return (*((-x, -force) for x, force in reversed(upper)), *upper)


def cubic_error(k1: float, k3: float, span: float, count: int) -> float:
    """Largest error of the force over the range, over the largest force in it."""
    unit = span / _places(count // 2)[-1]
    places = [span]
    if k1 * k3 < 0.0:
        places.append(min(span, math.sqrt(-k1 / (3.0 * k3))))
    largest = max(abs(k1 * x + k3 * x**3) for x in places)
    return _ERROR * abs(k3) * unit**3 / largest if k3 else 0.0


def points_for(k1: float, k3: float, span: float, error: float) -> int | None:
    """The fewest points whose ``cubic_error`` is at most ``error``; None where ``MOST_POINTS`` have
    more."""
    counts = range(2, MOST_POINTS + 1, 2)
    return next((n for n in counts if cubic_error(k1, k3, span, n) <= error), None)


@cache
def _places(count: int) -> tuple[float, ...]:
    """Ends of ``count`` pieces above rest that stand for x³ with the error ``_ERROR``."""
    if count == 1:
        return (1.0,)
    before = _places(count - 1)
    return (*before, _end(before[-1]))


def _end(start: float) -> float:
    """Where a chord of x³ from ``start`` ends that rises above it by twice the error: it does so at
    the x with (x - start)² (2x + start) = twice the error, where 3x² is its slope."""
    roots = np.roots([2.0, -3.0 * start, 0.0, start**3 - 2.0 * _ERROR])
    at = float(roots.real.max())
    return 0.5 * (math.sqrt(12.0 * at * at - 3.0 * start * start) - start)
