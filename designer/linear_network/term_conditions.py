"""The side conditions of a linear block with any pattern of terms, on its nominal scales.

Nominal scales need no solver: they are the least squares of the errors. At an error eps they lie
within a fixed multiple of eps of any scales with that error, so the compiled loops, which know
scales only to eps, keep the conditions with so much room.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from designer.base.arrays import Array, Index
from designer.linear_network.linear_terms import Bounds, Targets, scale_columns

ROUNDING = 1e-9
"""Allowance for rounding in the comparison of logarithms."""


@dataclass(frozen=True)
class TermConditions:
    """The conditions of ``Bounds`` for these terms."""

    targets: Targets
    bounds: Bounds

    def hold(self, offsets: Array) -> bool:
        """Whether they hold for a choice with these (terms,) offsets of the errors."""
        G, g = self.inequalities
        return bool((G @ offsets <= g + ROUNDING).all())

    @cached_property
    def inequalities(self) -> tuple[Array, Array]:
        """G (k, terms), g (k,): the conditions are G @ offsets <= g."""
        constant, matrix = self._nominal
        pairs = np.argwhere(np.isfinite(self._limits) & ~np.eye(len(self._limits), dtype=bool))
        rows = [(matrix[1 + i] - matrix[1 + j]) for i, j in pairs]
        ends = [self._limits[i, j] - constant[1 + i] + constant[1 + j] for i, j in pairs]
        for sign, end in zip((-1.0, 1.0), self._ends, strict=True):
            if np.isfinite(end):
                rows.append(sign * matrix[0])
                ends.append(sign * (end - constant[0]))
        return np.array(rows).reshape(-1, matrix.shape[1]), np.array(ends)

    def apart(self, level: float) -> Array:
        """(2n, 2n) largest ln volts of the row's state over the column's, at an error ``level``."""
        constant, matrix = self._nominal
        room = np.abs(matrix[1:, None, :] - matrix[None, 1:, :]).sum(axis=2)
        apart = self._limits + level * room + ROUNDING
        for i, j in self._joined:
            apart[j, i] = min(apart[j, i], constant[1 + j] - constant[1 + i] + ROUNDING)
            apart[i, j] = min(apart[i, j], constant[1 + i] - constant[1 + j] + ROUNDING)
        np.fill_diagonal(apart, 0.0)
        for k in range(len(apart)):
            apart = np.minimum(apart, apart[:, k : k + 1] + apart[k : k + 1, :])
        return np.asarray(apart)

    def seconds(self, level: float) -> Array:
        """(2,) range of ln of the time scale, at an error ``level``."""
        room = level * np.abs(self._nominal[1][0]).sum() + ROUNDING
        return np.asarray(self._ends + np.array([-room, room]))

    @cached_property
    def _ends(self) -> Array:
        return np.asarray(np.log(np.maximum(self.bounds.seconds, 1e-300)))

    @cached_property
    def _limits(self) -> Array:
        """(2n, 2n) largest ln volts of the row's state over the column's; infinite where free."""
        states, peaks = len(self.targets.coefficients), np.log(self.bounds.peaks)
        level, reference = np.log(self.bounds.level), 2 * self.bounds.mass
        ratio = np.full((states, states), np.inf)
        ratio[1::2, 1::2] = level
        for i in range(0, states, 2):
            ratio[i, i + 1] = ratio[i + 1, i] = level
        ratio[:, reference] = np.minimum(ratio[:, reference], np.log(self.bounds.share))
        np.fill_diagonal(ratio, 0.0)
        return np.asarray(ratio - peaks[:, None] + peaks[None, :])

    @cached_property
    def _joined(self) -> Index:
        """(j, 2) states that get equal peak voltages: they join what no term joins."""
        sets = list(range(len(self.targets.coefficients)))
        for a, b in self.targets.entries:
            sets = [sets[a] if number == sets[b] else number for number in sets]
        first = sorted({number: i for i, number in reversed(list(enumerate(sets)))}.values())
        return np.array([(0, i) for i in first[1:]], dtype=np.int64).reshape(-1, 2)

    @cached_property
    def _nominal(self) -> tuple[Array, Array]:
        """The nominal scales, T and the 2n of ln volts, are constant + matrix @ offsets."""
        terms, states = len(self.targets.entries), len(self.targets.coefficients)
        columns = np.insert(scale_columns(self.targets), 1, 0.0, axis=1)
        equal = np.eye(1 + states)[1:]
        joins = np.array([equal[j] - equal[i] for i, j in self._joined]).reshape(-1, 1 + states)
        peaks = np.log(self.bounds.peaks)
        wanted = np.array([peaks[i] - peaks[j] for i, j in self._joined])
        inverse = np.zeros((1 + states, terms + len(joins)))
        free = [0, *range(2, 1 + states)]  # the volts of x1 are 1
        inverse[free] = np.linalg.pinv(np.concatenate([columns, joins])[:, free])
        return inverse[:, terms:] @ wanted, -inverse[:, :terms]
