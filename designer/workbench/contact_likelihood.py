"""How likely contact with a stop is at an extreme of the displacement, by the samples about it.

The displacement's curve says how far the extreme is from the stop, with an error. Whatever that is,
it says the course of the dead zone's output about the extreme too: its samples there, which the
curve itself does not rest on, are held against every distance.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from designer.base.arrays import Array, Index, Mask
from designer.workbench.contact_count import PROMINENT, extremes

FAR = 8.0
"""Standard errors beyond which the curve alone decides."""
DISTANCES = 321
"""That are tried within ``FAR`` of either side of the curve's own."""


@dataclass(frozen=True)
class ContactLikelihood:
    """What a curve and the samples near a stop say of contact with it; positive is beyond it."""

    trace: Array
    """(k,) the displacement less the stop along a lap [V]."""
    errors: Array
    """(k,) standard error of it [V]."""
    noise: float
    """Standard error from one extreme to the next [V]."""
    place: Array
    """(m,) points of the lap at which samples near the stop were taken."""
    depth: Array
    """(m,) the depth of the contact [V] by the output there: 0 but for noise without contact."""
    depth_error: float
    """Standard deviation of the noise of one [V]."""

    @cached_property
    def _turns(self) -> Index:
        return np.sort(extremes(self.trace, PROMINENT * self.noise))

    def ratio(self, at: int) -> float:
        """Logarithm of the likelihood of contact over that of none at an extreme, each at the
        distance from the stop that is best for it."""
        curve, error = float(self.trace[at]), float(self.errors[at])
        if abs(curve) > FAR * error:
            return 0.5 * curve * abs(curve) / error**2
        beyond = np.append(curve + error * np.linspace(-FAR, FAR, DISTANCES), 0.0)
        here = self._about(at)
        closed = np.append(self.trace, self.trace[0])
        shape = np.interp(self.place[here], np.arange(len(closed)), closed) - curve
        left = self.depth[here] - np.maximum(beyond[:, None] + shape, 0.0)
        squares = (left**2).sum(axis=1) / self.depth_error**2 + ((beyond - curve) / error) ** 2
        without, touching = squares[beyond <= 0.0].min(), squares[beyond >= 0.0].min()
        return float(0.5 * (without - touching))

    def _about(self, at: int) -> Mask:
        """(m,) which samples lie between the extremes on either side."""
        size, turns = len(self.trace), self._turns
        others = (turns - at) % size
        others = others[others > 0]
        after = int(others.min(initial=size))
        before = size - int(others.max(initial=0))
        way = (self.place - at + 0.5 * size) % size - 0.5 * size
        return np.asarray((way > -before) & (way < after))
