"""What moves in each clearance, and what a displacement is called where people read it.

The equations count displacements from the base (``mechanics``). People read the absolute ones: x of
a mass, y of the base, and in a clearance the difference that the stops see.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from designer.base.arrays import Array
from designer.dynamics.drive_shape import SINE, Shape
from designer.dynamics.orbit import Orbit
from designer.model.mechanics import MechanicalModel, SecondOrderSystem, displacement_shape

_SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


@dataclass(frozen=True)
class RelativeMotion:
    """The displacement in one clearance; the first mass's where there is no clearance."""

    symbol: str
    """Such as "x₁", "x₁ − y" or "x₁ − x₂"."""
    names: str
    """The same by the names of the masses, such as "tool − ram"; "" where they have none."""
    row: Array
    """(masses,) coefficients of the displacements relative to the base."""
    base: float
    """Amplitude of the base's motion in it, where that is the same at every frequency."""
    stops: tuple[tuple[int, float], ...]
    """(side, displacement) where contact begins, 1 upper and -1 lower."""
    clearances: tuple[int, ...] = ()
    """The index of the clearance of each stop."""
    scale: float = 1.0
    """How many of the units that values are shown in are one unit of the model."""
    unit: str = ""
    """Unit that displacements are shown in, such as "mm"; "" for the model's own without a name."""
    base_acceleration: float = 0.0
    """Amplitude of the base's acceleration in it, where that is the same at every frequency."""
    base_shape: Shape = SINE
    """What the base's motion is the sum of, over that amplitude."""

    def in_unit(self, scale: float, unit: str) -> RelativeMotion:
        """The same motion of a model in metres in another unit, of which ``scale`` are a metre."""
        return replace(
            self,
            row=scale * self.row,
            base=scale * self.base,
            base_acceleration=scale * self.base_acceleration,
            stops=tuple((side, scale * place) for side, place in self.stops),
            scale=scale,
            unit=unit,
        )

    @property
    def axes(self) -> tuple[str, str]:
        """What the axes of displacement and velocity are called, with their units."""
        if not self.unit:
            return self.symbol, self.rate
        return f"{self.symbol} [{self.unit}]", f"{self.rate} [{self.unit}/s]"

    @property
    def label(self) -> str:
        """The symbol with the names behind it."""
        return f"{self.symbol} ({self.names})" if self.names else self.symbol

    @property
    def rate(self) -> str:
        """Symbol of the velocity, such as "x₁′ − x₂′"."""
        return " − ".join(f"{part}′" for part in self.symbol.split(" − "))

    @property
    def gaps(self) -> tuple[float, ...]:
        """Where the stops stand."""
        return tuple(place for _, place in self.stops)

    def impacts(self, orbit: Orbit) -> Iterator[tuple[int, float, Array]]:
        """(side, displacement, (k,) velocities) of an orbit's impacts on each stop."""
        for (side, place), clearance in zip(self.stops, self.clearances, strict=True):
            here = (orbit.impact_sides == side) & (orbit.impact_clearances == clearance)
            yield side, place, self.scale * orbit.impact_velocities[here]

    def of(self, time: Array, states: Array, omega: float) -> Array:
        """(k, 2) displacement and velocity along a trace: time (k,), states (k, 2 masses)."""
        moved = np.stack([states[:, 0::2] @ self.row, states[:, 1::2] @ self.row], axis=1)
        waves = displacement_shape(self.base, self.base_acceleration, self.base_shape, omega)
        for n, sine, cosine in waves:
            sin, cos, rate = np.sin(n * omega * time), np.cos(n * omega * time), n * omega
            moved[:, 0] += sine * sin + cosine * cos
            moved[:, 1] += rate * (sine * cos - cosine * sin)
        return moved


def relative_motions(system: SecondOrderSystem) -> tuple[RelativeMotion, ...]:
    """One for each clearance in their order; that of the first mass where there is none."""
    if system.clearances:
        return tuple(_of(system, k) for k in range(len(system.clearances)))
    return (mass_motion(system, 0),)


def mass_motion(system: SecondOrderSystem, mass: int) -> RelativeMotion:
    """The absolute displacement of a mass, without stops."""
    return RelativeMotion(
        subscripted(f"x{mass + 1}"),
        _names(system, [mass]),
        np.eye(system.size)[mass],
        system.base if system.ground_moves else 0.0,
        (),
        base_acceleration=system.base_acceleration if system.ground_moves else 0.0,
        base_shape=system.base_shape,
    )


def companion_motions(system: SecondOrderSystem) -> tuple[RelativeMotion, ...]:
    """Where the ground moves, the other displacement of each mass that has a clearance to it: the
    absolute one where the stops move with the ground, the one from the ground where they stay."""
    if not system.driven_by_ground:
        return ()
    masses = dict.fromkeys(stop.mass for stop in system.clearances if stop.other is None)
    return tuple(_companion(system, mass) for mass in masses)


def _companion(system: SecondOrderSystem, mass: int) -> RelativeMotion:
    motion = mass_motion(system, mass)
    names = f"{motion.names}, " if motion.names else ""
    if not system.fixed_stops:
        return replace(motion, names=f"{names}absolute")
    turned = -1.0 if system.absolute else 0.0
    return replace(
        motion,
        symbol=f"{motion.symbol} − y",
        names=f"{names}from the base",
        base=turned * system.base,
        base_acceleration=turned * system.base_acceleration,
    )


def different_motions(system: SecondOrderSystem) -> tuple[RelativeMotion, ...]:
    """Those of ``relative_motions`` that differ: clearances in which the same displacement is seen
    have one, with the stops of all of them."""
    different: dict[tuple[str, float, float], RelativeMotion] = {}
    for motion in relative_motions(system):
        key = (motion.symbol, motion.base, motion.base_acceleration)
        known = different.get(key)
        different[key] = (
            motion
            if known is None
            else replace(
                known,
                stops=known.stops + motion.stops,
                clearances=known.clearances + motion.clearances,
            )
        )
    return tuple(different.values())


def shown_stops(system: SecondOrderSystem) -> tuple[tuple[int, int], ...]:
    """(index of the clearance, side) of the stops whose impacts a diagram shows: of the one
    clearance of an even system the upper one, since the lower is its mirror image; else every
    stop."""
    stops = system.clearances
    if len(stops) == 1 and system.even:
        return ((0, 1),)
    return tuple((k, side) for k, stop in enumerate(stops) for side in stop.positions)


def ground_of(model: MechanicalModel, omega: float) -> Array:
    """(states, 2 + 2h) the ground's displacement in each state at a drive frequency, over the
    drive's sine and cosine and those of each of the h ``SecondOrderSystem.orders``; without
    columns that are 0 of a sine."""
    system = model.second_order()
    orders = (1, *system.orders) if system.driven_by_ground else (1,)
    ground = np.zeros((2 * system.size, 2 * len(orders)))
    for n, sine, cosine in system.ground_shape(omega):
        place = 2 * orders.index(n)
        ground[0::2, place], ground[0::2, place + 1] = sine, cosine
    return ground


def _of(system: SecondOrderSystem, number: int) -> RelativeMotion:
    stop = system.clearances[number]
    masses = [stop.mass] if stop.other is None else [stop.mass, stop.other]
    fixed = system.ground_moves and system.fixed_stops and stop.other is None
    row = system.displacement(stop)
    if stop.combination:
        return _of_combination(system, number, row)
    symbols = [subscripted(f"x{mass + 1}") for mass in masses]
    if stop.other is None and system.ground_moves and not fixed:
        symbols.append("y")
    stops = tuple((side, side * spring.gap) for side, spring in stop.sides)
    return RelativeMotion(
        " − ".join(symbols),
        _names(system, masses),
        system.displacement(stop),
        system.base if fixed else 0.0,
        stops,
        (number,) * len(stops),
        base_acceleration=system.base_acceleration if fixed else 0.0,
    )


def _of_combination(system: SecondOrderSystem, number: int, row: Array) -> RelativeMotion:
    """The same of a sum of displacements, from the base where the stops move with it."""
    stop = system.clearances[number]
    fixed = float(row.sum()) if system.ground_moves and system.fixed_stops else 0.0
    names = system.names or [subscripted(f"x{mass + 1}") for mass in range(system.size)]
    terms = [f"{factor:+.4g} {name}" for factor, name in zip(row, names, strict=True) if factor]
    return RelativeMotion(
        stop.name,
        " ".join(terms).replace("-", "−"),
        row,
        fixed * system.base,
        tuple((side, side * spring.gap) for side, spring in stop.sides),
        (number,) * len(stop.sides),
        base_acceleration=fixed * system.base_acceleration,
    )


def _names(system: SecondOrderSystem, masses: Sequence[int]) -> str:
    return " − ".join(system.names[mass] for mass in masses) if system.names else ""


def state_labels(system: SecondOrderSystem) -> list[str]:
    """What the states are called, displacement and velocity of each mass from the base: "x₁ − y
    (hammer)", "x₁′ − y′ (hammer)", …"""
    labels = []
    for mass, name in enumerate(system.names or [""] * system.size):
        for prime in ("", "′"):
            symbol = subscripted(f"x{mass + 1}") + prime
            symbol += f" − y{prime}" if system.ground_moves else ""
            labels.append(f"{symbol} ({name})" if name else symbol)
    return labels


def subscripted(text: str) -> str:
    """The text with its digits as subscripts."""
    return text.translate(_SUBSCRIPTS)
