"""The attractors that many starts lead to under one setting, told apart by their strobes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array, Mask
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Motion, OrbitStatus

SAME = 1e-5
"""Of the largest state: strobes of one orbit, from different starts, lie nearer than this."""


@dataclass(frozen=True)
class MetAttractor:
    """An attractor that a start led to."""

    motion: Motion
    """The motion on it, as the first start showed it."""
    symmetric: bool | None
    """Whether it is its own mirror image; None unless periodic."""
    strobes: Array
    """(n, states) its states at drive phase 0 in order; of what is not periodic (1, states), where
    the motion was left."""

    @property
    def periodic(self) -> bool:
        return self.motion.status is OrbitStatus.PERIODIC

    @property
    def label(self) -> tuple[str, bool | None]:
        """What it is called; what is not periodic is not told apart further."""
        return self.motion.response, self.symmetric


class AttractorList:
    """Attractors by number, from 0 in the order in which they were met.

    weights : (states,) factors that make the states comparable in size (``Subject.weights``).
    """

    def __init__(self, flow: Flow, weights: Array) -> None:
        self.flow = flow
        self.weights = weights
        self.met: list[MetAttractor] = []

    def number(self, motion: Motion, symmetric: bool | None, x: Array) -> int:
        """Number of the attractor of a motion with the strobe x (states,); it is added if new."""
        periodic = motion.status is OrbitStatus.PERIODIC
        for number, known in enumerate(self.met):
            if known.label == (motion.response, symmetric) and (
                not periodic or self._near(known.strobes, x).any()
            ):
                return number
        strobes = self.flow.run(x, motion.n).strobes[:-1] if periodic else x[None]
        self.met.append(MetAttractor(motion, symmetric, strobes))
        return len(self.met) - 1

    def at(self, x: Array) -> int | None:
        """Number of the periodic attractor that has the strobe x (states,), if one is known."""
        for number, known in enumerate(self.met):
            if known.periodic and self._near(known.strobes, x).any():
                return number
        return None

    def twin(self, number: int) -> int | None:
        """Number of an attractor's mirror twin among those that were met."""
        one, mirror = self.met[number], self.flow.system.mirror
        if mirror is None or one.symmetric is not False:
            return None
        n = len(one.strobes)
        image = self.flow.run(one.strobes[0], n, points=2).strobes[1:-1:2] @ mirror.T
        for other, known in enumerate(self.met):
            if other == number or len(known.strobes) != n or not known.periodic:
                continue
            if self._near(known.strobes, image[0]).any():
                return other
        return None

    def distance(self, x: Array, y: Array) -> float:
        """Distance of two states (states,), relative to the largest entry of y."""
        size = max(float(np.abs(self.weights * y).max()), 1e-300)
        return float(np.abs(self.weights * (x - y)).max()) / size

    def same(self, x: Array, y: Array) -> bool:
        """Whether two states (states,) are the same strobe."""
        return bool(self._near(y[None], x).all())

    def _near(self, strobes: Array, x: Array) -> Mask:
        """(n,) which strobes of an orbit a state is."""
        away = np.abs(self.weights * (strobes - x)).max(axis=1)
        return np.asarray(away <= SAME * np.abs(self.weights * strobes).max())
