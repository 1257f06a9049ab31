"""A mixture of tilted densities on the cube of uniform numbers that boards are made of.

Each component leans every coordinate u by exp(λ u): the exponential tilt of a uniform number, which
stays within its range, so that no board outlies what its parts may be. The first component leans
nothing. With a share α of it in the mixture no weight is above 1/α, whatever the others miss (T.
Hesterberg, Technometrics 37, 1995, 185). Weights are those of the whole mixture, as if a board had
been drawn of it (the balance heuristic: E. Veach, L. J. Guibas, SIGGRAPH 1995, 419).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array, Index

STEEPEST = 40.0
"""Largest tilt: then a number lies within 1/40 of its end, in the mean."""
_SMALL = 1e-4
"""Below this tilt the series of its formulas are used."""


def mean_of(tilt: Array) -> Array:
    """Mean of numbers in [0, 1] with these tilts."""
    small = np.abs(tilt) < _SMALL
    safe = np.where(small, 1.0, tilt)
    far = 1.0 / -np.expm1(-safe) - 1.0 / safe
    return np.asarray(np.where(small, 0.5 + tilt / 12.0, far))


def width_of(tilt: Array) -> Array:
    """Standard deviation of numbers in [0, 1] with these tilts."""
    small = np.abs(tilt) < 100.0 * _SMALL
    safe = np.where(small, 1.0, tilt)
    # 1/λ² - 1/(4 sinh²(λ/2))
    square = 1.0 / safe**2 - 0.25 / np.sinh(0.5 * safe) ** 2
    return np.asarray(np.sqrt(np.where(small, 1.0 / 12.0, square)))


def tilt_of(mean: Array) -> Array:
    """Tilts with these means in (0, 1), at most ``STEEPEST``: by bisection, since the mean rises
    with the tilt."""
    low, high = np.full(mean.shape, -STEEPEST), np.full(mean.shape, STEEPEST)
    for _ in range(60):
        middle = 0.5 * (low + high)
        less = mean_of(middle) < mean
        low, high = np.where(less, middle, low), np.where(less, high, middle)
    return np.asarray(0.5 * (low + high))


@dataclass(frozen=True)
class TiltedCube:
    """The mixture."""

    tilts: Array
    """(components, coordinates); the first row is 0."""
    shares: Array
    """(components,) of the mixture, with the sum 1."""

    @classmethod
    def of(cls, tilts: Sequence[Array], plain: float, size: int, parts: Array) -> TiltedCube:
        """A mixture of a plain part and of these tilts (size,), which share the rest as ``parts``
        (tilts,) of the sum 1 say; of none it is plain."""
        if not tilts:
            return cls(np.zeros((1, size)), np.ones(1))
        shares = np.concatenate([[plain], (1.0 - plain) * parts])
        return cls(np.vstack([np.zeros((1, size)), *tilts]), shares)

    def drawn(self, count: int, rng: np.random.Generator) -> tuple[Array, Index]:
        """About ``count`` points (N, coordinates), and the component of each: of each component
        its share, so that chance has no part in how many there are."""
        each = np.maximum(np.round(count * self.shares).astype(int), 1)
        component = np.repeat(np.arange(len(each)), each)
        tilt = self.tilts[component]
        v = rng.random(tilt.shape)
        small = np.abs(tilt) < _SMALL
        safe = np.where(small, 1.0, tilt)
        u = np.where(small, v, np.log1p(v * np.expm1(safe)) / safe)
        return np.clip(u, 0.0, np.nextafter(1.0, 0.0)), component

    def densities(self, points: Array) -> Array:
        """(N, components) density of each component, times its share, over that of plain boards."""
        small = np.abs(self.tilts) < _SMALL
        safe = np.where(small, 1.0, np.abs(self.tilts))
        # Log of the mean of e^(λu), (e^λ - 1)/λ: for λ < 0 that of -λ, less by -λ.
        scale = np.where(small, self.tilts / 2.0, np.log(np.expm1(safe) / safe))
        scale = np.where(~small & (self.tilts < 0.0), scale - safe, scale)
        return np.asarray(np.exp(points @ self.tilts.T - scale.sum(axis=1)) * self.shares)

    def weights(self, points: Array) -> Array:
        """(N,) density of plain boards over that of the mixture."""
        return np.asarray(1.0 / self.densities(points).sum(axis=1))
