"""Clearances and their stops, and the dead zones that are like them."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from designer.base.arrays import Array
from designer.laws.force_law import Quantity

Sides = Literal["both", "upper", "lower"]
POSITIONS: dict[Sides, tuple[int, ...]] = {"both": (1, -1), "upper": (1,), "lower": (-1,)}
"""Contact positions that exist: 1 for the upper stop, -1 for the lower."""


@dataclass(frozen=True)
class Side:
    """The stop on one side of a clearance: a spring that pushes back past a gap."""

    gap: float
    """Distance of the stop from the displacement zero; negative: in contact there."""
    stiffness: float
    """Stiffness of the stop."""
    further: tuple[tuple[float, float], ...] = ()
    """(depth, stiffness) of springs that join in deeper, by rising depth: a stop that stiffens in
    steps."""
    preload: float = 0.0
    """Force with which it pushes as soon as it is touched: that of a spring that is held short."""
    rise: float = 0.0
    """Depth over which that force rises from 0; 0: it is there at once."""

    @property
    def own_springs(self) -> tuple[tuple[float, float], ...]:
        """(displacement, stiffness) of every spring of the stop, the first met first."""
        deeper = ((self.gap + depth, stiffness) for depth, stiffness in self.further)
        return ((self.gap, self.stiffness), *deeper)

    @property
    def springs(self) -> tuple[tuple[float, float], ...]:
        """The same with a preload that rises: a spring that joins in where the stop is touched, and
        leaves again where the force has risen."""
        if not self.rise:
            return self.own_springs
        joined: dict[float, float] = defaultdict(float)
        steep = self.preload / self.rise
        for place, stiffness in (*self.own_springs, (self.gap, steep)):
            joined[place] += stiffness
        joined[self.gap + self.rise] -= steep
        return tuple(sorted(joined.items()))

    @property
    def jump(self) -> float:
        """The preload, where it is there at once."""
        return 0.0 if self.rise else self.preload

    def scaled(self, factor: float) -> Side:
        """The same with every length and the preload ``factor`` times as large."""
        further = tuple((factor * depth, stiffness) for depth, stiffness in self.further)
        lengths = factor * self.gap, self.stiffness, further
        return Side(*lengths, factor * self.preload, factor * self.rise)


def combined(row: Array) -> tuple[int, int | None, tuple[float, ...]]:
    """``Clearance.mass``, ``other`` and ``combination`` of a sum (masses,) of displacements."""
    places = np.flatnonzero(row)
    if len(places) == 1 and row[places[0]] == 1.0:
        return int(places[0]), None, ()
    if sorted(row[places].tolist()) == [-1.0, 1.0]:
        return int(np.argmax(row)), int(np.argmin(row)), ()
    return int(np.argmax(np.abs(row))), None, tuple(row.tolist())


@dataclass(frozen=True)
class Clearance:
    """A gap between a mass and ground, or between two masses, with stops on one side or both."""

    name: str
    """Its name, such as "A"."""
    mass: int
    """Index of the mass."""
    other: int | None
    """Index of the other mass; None for ground."""
    upper: Side | None
    """The stop that a positive displacement meets; None where there is none."""
    lower: Side | None
    """The stop that a negative displacement meets; None where there is none."""
    damping: float = 0.0
    """Of the stops, while they are in contact."""
    bend_of: str = ""
    """Of a dead zone that is no clearance: the law or the clearance whose further bends these are.
    n-p-q does not count it, and a stiffness that is negative takes from a slope."""
    quantity: Quantity = "displacement"
    """What the gaps are gaps of."""
    limits: bool = False
    """Of a dead zone whose stiffness is negative and the same on both sides: whether it makes the
    slope between its ends too, from which it would take: a force that rises and then stays."""

    combination: tuple[float, ...] = ()
    """(masses,) factors of the displacements in a sum, where it is neither one mass nor the
    difference of two; ``mass`` is then the one with the largest factor."""
    push: tuple[float, ...] = ()
    """(masses,) factors with which a force of the stops acts on the masses, where they are not
    those of the displacements: of a system that had a mass matrix with couplings
    (``SecondOrderSystem.with_couplings``)."""

    @classmethod
    def even(
        cls, mass: int, stiffness: float, gap: float, sides: Sides = "both", name: str = "A"
    ) -> Clearance:
        """To ground, with the same stop on each side that has one."""
        stop = Side(gap, stiffness)
        ends = dict.fromkeys(POSITIONS[sides], stop)
        return cls(name, mass, None, ends.get(1), ends.get(-1))

    @property
    def sides(self) -> tuple[tuple[int, Side], ...]:
        """The sides that have a stop, 1 upper and -1 lower, each with its stop."""
        pairs = ((1, self.upper), (-1, self.lower))
        return tuple((position, stop) for position, stop in pairs if stop is not None)

    @property
    def positions(self) -> tuple[int, ...]:
        """Sides that have a stop: 1 upper, -1 lower."""
        return tuple(position for position, _ in self.sides)

    @property
    def which(self) -> Sides:
        """The sides that have a stop, in a word."""
        return next(word for word, ends in POSITIONS.items() if ends == self.positions)

    @property
    def first(self) -> Side:
        """The upper stop, or the only one."""
        return self.sides[0][1]

    @property
    def terms(self) -> tuple[tuple[int, float], ...]:
        """(mass, factor) of the displacements in the sum that the gaps are gaps of, ``mass``
        first."""
        if self.combination:
            return _with_first(self.mass, self.combination)
        other = () if self.other is None else ((self.other, -1.0),)
        return ((self.mass, 1.0), *other)

    @property
    def pushed(self) -> tuple[tuple[int, float], ...]:
        """(mass, factor) of the masses that a force of the stops acts on, ``mass`` first."""
        return _with_first(self.mass, self.push) if self.push else self.terms

    @property
    def plain(self) -> bool:
        """Whether it is of one mass, or the difference of two, and pushes these alike."""
        return not (self.combination or self.push)

    @property
    def watched(self) -> int:
        """Index of the state that the gaps are gaps of, or of its first mass: x1, x1', x2, …"""
        return self.state_of(self.mass)

    def state_of(self, mass: int) -> int:
        """Index of a mass's state of the kind that the gaps are gaps of."""
        return 2 * mass + (self.quantity == "velocity")

    @property
    def falls(self) -> bool:
        """Whether its stiffness takes from a slope."""
        return self.first.stiffness < 0.0

    @property
    def jumps(self) -> bool:
        """Whether the force of a stop begins with a jump: a damper makes one, and a preload that
        does not rise."""
        return bool(self.damping) or any(stop.jump for _, stop in self.sides)

    def scaled(self, factor: float) -> Clearance:
        """The same with every length and preload ``factor`` times as large."""
        upper, lower = (stop and stop.scaled(factor) for stop in (self.upper, self.lower))
        return replace(self, upper=upper, lower=lower)


def _with_first(mass: int, factors: tuple[float, ...]) -> tuple[tuple[int, float], ...]:
    """(mass, factor) of those that are not 0, this mass first."""
    there = [(i, factor) for i, factor in enumerate(factors) if factor]
    return tuple(sorted(there, key=lambda term: term[0] != mass))
