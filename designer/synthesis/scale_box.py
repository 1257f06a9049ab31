"""The box of what may be chosen: its points, and what in it conflicts.

Side conditions are linear in logarithms, or convex: a convex one is kept by tangents, added where a
point breaks it. So each linear program is wider than the box, and where it has no point the box has
none: a proof, before any value is looked at. Then the limits are taken away one by one as long as
there is still no point (a deletion filter). What stays is irreducible: together they conflict, and
without any one of them they do not. How far each would have to give, the others kept, is one more
linear program.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import linprog

from designer.base.arrays import Array
from designer.circuit.linear_program import LinearProgram
from designer.synthesis.scale_program import LinearBound, ScaleProgram, StatedLimit

FAR = 60.0
"""A logarithm further than any scale or value."""
TINY = 1e-7
"""A limit on a logarithm that is kept to so much is kept."""
TANGENTS = 60
"""Rounds of tangents; a few do."""
LEVELS, OUTPUTS = 0.05, 0.3
"""What the mean of the states' levels, and of the stages' outputs, counts beside the lowest
threshold: an output that stays low brings its offset into the force resistor."""


@dataclass(frozen=True)
class Conflict:
    """One of some limits that cannot be kept together."""

    limit: StatedLimit
    needed: float
    """What it would have to be for a choice of scales, the others as they are; infinite, or 0,
    where no number helps."""
    frees: bool
    """Whether there are scales without any limit of its condition."""


@dataclass
class ScaleBox:
    """The scales and free parts that keep the limits of a program."""

    program: ScaleProgram
    """What is kept."""
    cuts: list[LinearBound] = field(default_factory=list)
    """Tangents that were needed."""

    def best(self) -> Array | None:
        """The point with the highest threshold, and with the levels of all states high; None where
        the box is empty, which is a proof."""
        return self.point(self._worth()[0])

    def worth(self, z: Array) -> float:
        """What ``best`` makes large, at a point."""
        weights, constant = self._worth()
        thresholds = [log.at(z) for log in self.program.thresholds]
        return float(weights[:-1] @ z) + constant + min(thresholds, default=0.0)

    def points(self, count: int, loss: float, seed: int) -> list[Array]:
        """Corners of the box in drawn directions where ``worth`` is within ``loss`` of its
        largest."""
        best = self.best()
        if best is None:
            return []
        weights, constant = self._worth()
        top = self.worth(best)
        # The lowest threshold is a variable of its own.
        rows, most = self._limits(self._bounds())
        far = np.full(self._size + 1, FAR)
        program = LinearProgram(np.vstack([rows, -weights]), -far, far)
        ends = np.append(most, constant + loss - top)
        random = np.random.default_rng(seed)
        out = [best]
        for _ in range(count):
            direction = np.append(random.standard_normal(self._size), 0.0)
            x = program.solve(-direction, ends)
            if x is not None:
                out.append(x[:-1])
        return out

    def point(
        self,
        worth: Array,
        *,
        without: Collection[StatedLimit] = (),
    ) -> Array | None:
        """The point of the box with the largest worth @ (z, lowest threshold); None where there is
        none, by a proof. without : limits that are left out."""
        for _ in range(TANGENTS):
            bounds = [b for b in self._bounds() if b.limit not in without]
            z = self._solve(worth, bounds)
            if z is None:
                return z
            over = [s for s in self.program.broken(z, TINY) if s.limit not in without]
            if not over:
                return z
            self.cuts += [s.tangent(z) for s in over]
        return z

    def conflicts(self) -> list[Conflict]:
        """An irreducible set of limits that cannot be kept together, with what each would have to
        be; empty where the box is not."""
        any_point = np.zeros(self._size + 1)
        if self.point(any_point) is not None:
            return []
        stated = [b.limit for b in self.program.bounds] + [s.limit for s in self.program.sums]
        limits = list(dict.fromkeys(stated))
        gone: list[StatedLimit] = []
        for limit in limits:
            if self.point(any_point, without={*gone, limit}) is None:
                gone.append(limit)
        held = [limit for limit in limits if limit not in gone]
        by_condition = {
            limit.condition: [one for one in limits if one.condition == limit.condition]
            for limit in held
        }
        frees = {
            name: self.point(any_point, without=own) is not None
            for name, own in by_condition.items()
        }
        return [Conflict(limit, self._needed(limit), frees[limit.condition]) for limit in held]

    def _needed(self, limit: StatedLimit) -> float:
        """What a limit would have to be, with all others kept."""
        for _ in range(TANGENTS):
            bounds = self._bounds()
            weights = np.array([b.log.weights for b in bounds])
            give = np.array([-1.0 if b.limit == limit else 0.0 for b in bounds])
            ends = -np.array([b.log.constant for b in bounds])
            solved = linprog(
                np.append(np.zeros(self._size), 1.0),
                A_ub=np.column_stack([weights, give]),
                b_ub=ends,
                bounds=[(-FAR, FAR)] * self._size + [(0.0, FAR)],
                method="highs",
            )
            if solved.x is None:
                return 0.0 if limit.least else float("inf")
            z, given = solved.x[:-1], float(solved.x[-1])
            over = [
                s for s in self.program.sums if s.at(z) > TINY + (given if s.limit == limit else 0)
            ]
            if not over:
                break
            self.cuts += [s.tangent(z) for s in over]
        return limit.value * float(np.exp(-given if limit.least else given))

    @property
    def _size(self) -> int:
        return len(self.program.lists)

    def _bounds(self) -> list[LinearBound]:
        return [*self.program.bounds, *self.cuts]

    def _worth(self) -> tuple[Array, float]:
        """Weights of z and of the lowest threshold, and a constant."""
        weights, constant = np.zeros(self._size), 0.0
        program = self.program
        for share, logs in ((LEVELS, program.levels), (OUTPUTS, program.outputs)):
            for log in logs:
                weights = weights + share / len(logs) * log.weights
                constant += share / len(logs) * log.constant
        return np.append(weights, 1.0 if program.thresholds else 0.0), constant

    def _limits(self, bounds: Sequence[LinearBound]) -> tuple[Array, Array]:
        """(limits, z + 1) and (limits,): the rows, which may not exceed these ends. The last
        variable is the lowest threshold."""
        low = self.program.thresholds
        weights = [b.log.weights for b in bounds] + [-log.weights for log in low]
        lowest = np.repeat([0.0, 1.0], [len(bounds), len(low)])
        ends = [-b.log.constant for b in bounds] + [log.constant for log in low]
        return np.column_stack([np.array(weights), lowest]), np.array(ends)

    def _solve(self, worth: Array, bounds: Sequence[LinearBound]) -> Array | None:
        """z of one linear program, whose rows the next has not: a LinearProgram is for many solves
        of the same."""
        rows, ends = self._limits(bounds)
        solved = linprog(
            -worth,
            A_ub=rows,
            b_ub=ends,
            bounds=[(-FAR, FAR)] * (self._size + 1),
            method="highs",
        )
        return None if solved.x is None else np.asarray(solved.x[:-1])
