"""A good choice of a linear block where a tree of choices is too large to be searched to its end.

First dives: cells of the time scale all over its range, each searched for a limited number of steps
in a drawn order, at a level that every choice lowers. Then neighbours: all parts of some masses are
free, the others stay, and what is better than the best so far is sought near its time scale. The
draws follow from counts, so the same question has the same answer. Nothing is proved.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, islice

import numpy as np

from designer.base.arrays import Array, Index
from designer.base.progress import best_so_far, doing
from designer.circuit.scale_fit import minimax
from designer.linear_network.kernel_terms import CELL, TermRules, dives
from designer.linear_network.linear_terms import Levels
from designer.linear_network.term_search import FRESH, TermSearch

FIRST_LEVEL = 0.03
"""The level of the first dives: twice the half step of E96 and more."""
LOWER = 0.9
"""From an error that was reached to the next level."""
CELLS = 32
"""Cells of the time scale in one call of the loops."""
DIVE = 10_000
"""Candidates in one cell."""
GOLDEN = 0.5 * (5.0**0.5 - 1.0)
"""Multiples of it, without their whole part, lie evenly in 0 to 1 however many there are."""
FREE = 3
"""Masses whose parts are free together, at most."""


@dataclass
class TermDives:
    """The best choice so far, and the work that it took."""

    search: TermSearch
    """The choices that there are."""
    error: float = np.inf
    """The least error."""
    parts: Index | None = None
    """Its (parts,) indices of values."""
    steps: int = 0
    """Candidates that were looked at."""
    number: int = 0
    """Cells that were begun."""

    def best(self, least: float, patience: int) -> Levels:
        """The best choice that so many steps find; one with an error of ``least`` ends it."""
        most = patience // self.search.candidate
        self._dive(least, most // 2)
        while self.parts is not None and self.error > least and self.steps < most:
            if not self._nearer(most) and not self._dive(least, min(self.steps + most // 8, most)):
                break
        chosen = np.full(len(self.search.question.targets.parts), -1)
        chosen = chosen if self.parts is None else self.parts
        steps = self.steps * self.search.candidate
        return Levels(self.error, chosen, 0.0, False, -1, self.number, steps)

    @property
    def _level(self) -> float:
        return min(FIRST_LEVEL, LOWER * self.error)

    def _dive(self, least: float, most: int) -> bool:
        """Dives all over the time scale, until so many candidates are looked at; whether one was
        better."""
        before = self.error
        while self.error > least and self.steps < most:
            level = self._level
            rules = self.search.rules(level)
            low, high = rules.seconds
            shares = ((self.number + np.arange(CELLS)) * GOLDEN) % 1.0
            doing(f"integrators, dives for an error below {level:.2g}: {self.steps / most:.0%}")
            self._look(rules, level, low + (high - low) * shares)
        return self.error < before

    def _nearer(self, most: int) -> bool:
        """Better choices with all but some masses' parts as they are; whether there was one."""
        before = self.error
        for masses in self._sets():
            if self.steps >= most:
                break
            doing(f"integrators, neighbours of an error of {self.error:.2g}")
            level = LOWER * self.error
            rules = self.search.rules(level)._replace(fixed=self._fixed(masses))
            scales = minimax(self.search.offsets(self._known), self.search.columns)
            near = 2.0 * self.error
            cells = float(scales[0]) + np.arange(-near, near, CELL * level)
            self._look(rules, level, cells)
        return self.error < before

    @property
    def _known(self) -> Index:
        assert self.parts is not None
        return self.parts

    def _sets(self) -> Iterator[tuple[int, ...]]:
        """Sets of masses, single ones first."""
        masses = range(len(self.search.question.targets.coefficients) // 2)
        for size in range(1, min(FREE, len(masses)) + 1):
            yield from islice(combinations(masses, size), len(masses) ** 2)

    def _fixed(self, masses: tuple[int, ...]) -> Index:
        """(parts,) in the order of the loops, the values of parts that touch none of the masses."""
        entries = self.search.order.entries
        own = [a // 2 in masses or b // 2 in masses for a, b in entries]
        states = range(len(self.search.question.targets.coefficients))
        free = np.array(own + [a // 2 in masses for a in states])
        fixed = np.full(len(free), -1)
        fixed[self.search.by_name] = self._known
        return np.where(free, -1, fixed)

    def _look(self, rules: TermRules, level: float, cells: Array) -> None:
        """A choice of one of these cells, if it is better and keeps the conditions."""
        row = np.zeros((1, len(self.search.by_name)), dtype=np.int64)
        most = self.search.question.spec.most_values
        kinds = row.size if most is None else most
        begun, any_found, taken = dives(rules, level, cells, DIVE, kinds, self.number, row)
        self.number += begun
        self.steps += taken + begun
        if not any_found:
            return
        self.steps += FRESH
        parts = row[0][self.search.by_name]
        error = self.search.error(parts)
        if error < self.error and self.search.allowed(parts):
            self.error, self.parts = error, parts
            best_so_far(f"integrators with an error of {error:.2g}", step=True)
