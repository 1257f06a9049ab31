"""How one quantity varies from board to board: distributions by their inverse, u in [0, 1) → value.

Every draw goes through an inverse, so that a larger uniform number is a larger value whatever the
distribution, and studies that differ in a grade or a shape compare the same boards.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np

from designer.base.arrays import Array


@dataclass(frozen=True)
class Distribution(ABC):
    """A distribution on a bounded interval."""

    @abstractmethod
    def ppf(self, u: Array) -> Array:
        """(N,) values with probabilities u (N,) below them: non-decreasing."""

    def as_dict(self) -> dict[str, Any]:
        """Name and parameters."""
        return {"law": type(self).__name__.lower(), **self.__dict__}


@dataclass(frozen=True)
class Uniform(Distribution):
    """Every value between two limits is equally likely."""

    low: float
    """Lower limit of the values."""
    high: float
    """Upper limit of the values."""

    def ppf(self, u: Array) -> Array:
        return self.low + (self.high - self.low) * u


@dataclass(frozen=True)
class Normal(Distribution):
    """Normal about 0 and cut: what lies beyond was sorted out."""

    sigma: float
    """Standard deviation before the cut."""
    limit: float = 1.0
    """The cut lies at ± this."""

    def ppf(self, u: Array) -> Array:
        if self.sigma == 0.0:
            return np.zeros_like(u)
        cut = self.limit / self.sigma
        # Imported here: to read a model file takes none of it.
        from scipy.special import ndtr, ndtri

        below = float(ndtr(-cut))
        # From the nearer end: the probabilities of the upper tail have no digits to spare.
        lower = np.minimum(u, 1.0 - u)
        z = ndtri(below + lower * (1.0 - 2.0 * below))
        z = np.clip(z, -cut, 0.0)
        return np.asarray(self.sigma * np.where(u < 0.5, z, -z))


@dataclass(frozen=True)
class Binned(Distribution):
    """Uniform about 0 without a middle part: the better grade was picked out."""

    inner: float
    """No value lies within ± this."""
    outer: float = 1.0
    """Every value lies within ± this."""

    def ppf(self, u: Array) -> Array:
        away = (self.outer - self.inner) * np.abs(2.0 * u - 1.0) + self.inner
        return np.asarray(np.where(u < 0.5, -away, away))


@dataclass(frozen=True)
class Split(Distribution):
    """Half of the values lie uniformly on one side of a middle, half on the other.

    This is all that the minimum, typical and maximum of a data sheet say.
    """

    low: float
    """Lower limit of the values."""
    middle: float
    """Half of the values lie below it."""
    high: float
    """Upper limit of the values."""

    def ppf(self, u: Array) -> Array:
        below = self.low + (self.middle - self.low) * 2.0 * u
        above = self.middle + (self.high - self.middle) * (2.0 * u - 1.0)
        return np.asarray(np.where(u < 0.5, below, above))
