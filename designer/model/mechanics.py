"""Masses, dampers, springs and stops as a piecewise-linear system.

M x'' + C x' + K x + Σ stops = force · u(t), with any number of masses and clearances; Eq. (1)-(2)
of the paper is the case of two masses and one two-sided clearance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from designer.base.arrays import Array
from designer.dynamics.piecewise_linear import Guard, Mode, ModeKey, PiecewiseLinearSystem

Sides = Literal["both", "upper", "lower"]
POSITIONS: dict[Sides, tuple[int, ...]] = {"both": (1, -1), "upper": (1,), "lower": (-1,)}
"""Contact positions that exist: 1 for the upper stop, -1 for the lower."""


@dataclass(frozen=True)
class Clearance:
    """Stops that a mass meets at a distance from its rest position."""

    mass: int
    """Index of the mass."""
    stiffness: float
    """Stiffness of a stop."""
    gap: float
    """Distance of a stop from the rest position."""
    sides: Sides = "both"
    """The stops that exist."""

    @property
    def positions(self) -> tuple[int, ...]:
        """Contact positions that exist: 1 for the upper stop, -1 for the lower."""
        return POSITIONS[self.sides]


@dataclass(frozen=True)
class SecondOrderSystem:
    """Masses, dampers and springs with stops, driven by one force."""

    mass: Array
    """(n,) masses."""
    damping: Array
    """(n, n) damping matrix."""
    stiffness: Array
    """(n, n) stiffness matrix."""
    force: Array
    """(n,) amplitude of the force on each mass."""
    clearances: tuple[Clearance, ...]
    """The clearances, on any of the masses."""

    @property
    def size(self) -> int:
        """Number of masses."""
        return len(self.mass)

    def natural_frequencies(self, *, closed: bool = False) -> Array:
        """(n,) undamped ones, ascending, in rad per unit of time. closed : with every stop in
        contact; else with none."""
        stiffness = self.stiffness.copy()
        if closed:
            for stop in self.clearances:
                stiffness[stop.mass, stop.mass] += stop.stiffness
        root = np.sqrt(self.mass)
        squares = np.linalg.eigvalsh(stiffness / np.outer(root, root))
        return np.asarray(np.sqrt(np.maximum(squares, 0.0)))

    def state_matrix(self) -> Array:
        """(2n, 2n) A of the open system; states x1, x1', x2, x2', … as in Eq. (10)."""
        n = self.size
        A = np.zeros((2 * n, 2 * n))
        for i in range(n):
            A[2 * i, 2 * i + 1] = 1.0
            A[2 * i + 1, 0::2] = -self.stiffness[i] / self.mass[i]
            A[2 * i + 1, 1::2] = -self.damping[i] / self.mass[i]
        return A

    def piecewise_linear(self) -> PiecewiseLinearSystem:
        """States x1, x1', x2, x2', …; one key entry per clearance, in their order."""
        n = self.size
        names = tuple(f"x{i // 2 + 1}" + ("'" if i % 2 else "") for i in range(2 * n))
        A0 = self.state_matrix()
        B = np.zeros(2 * n)
        B[1::2] = self.force / self.mass
        clearances = self.clearances

        def build(key: ModeKey) -> Mode:
            A, d = A0.copy(), np.zeros(2 * n)
            guards = []
            for j, (stop, position) in enumerate(zip(clearances, key, strict=True)):
                row, column = 2 * stop.mass + 1, 2 * stop.mass
                C = np.zeros(2 * n)
                if position:
                    rate = stop.stiffness / self.mass[stop.mass]
                    A[row, column] -= rate
                    d[row] += rate * position * stop.gap
                    C[column] = -position
                    target = (*key[:j], 0, *key[j + 1 :])
                    guards.append(Guard(C, 0.0, stop.gap, target, clearance=j))
                    continue
                for p in stop.positions:
                    C = np.zeros(2 * n)
                    C[column] = p
                    target = (*key[:j], p, *key[j + 1 :])
                    guards.append(Guard(C, 0.0, -stop.gap, target, clearance=j))
            return Mode(A, B, d, tuple(guards), sides=key)

        symmetric = all(stop.sides == "both" for stop in clearances)
        return PiecewiseLinearSystem(
            states=names,
            build=build,
            start=(0,) * len(clearances),
            clearances=tuple(f"A{j + 1}" for j in range(len(clearances))),
            displacement=tuple(2 * stop.mass for stop in clearances),
            mirror=-np.eye(2 * n) if symmetric else None,
        )
