"""Two masses with all terms: levels of error searched by joins.

At each level every ratio choice that can reach it is joined (``linear_network.linear_block``) and
completed to values, best first. Among the choices of least error cvxpy and HiGHS choose those with
the fewest distinct values and the lowest price (``linear_network.tie_break``).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from designer.base.arrays import Index
from designer.base.progress import best_so_far, doing
from designer.linear_network.kernel_completions import complete
from designer.linear_network.kernel_linear import Rules, Values
from designer.linear_network.linear_block import PARTS, catalogue, rules_of, slice_from
from designer.linear_network.linear_terms import Levels, LinearQuestion
from designer.linear_network.tie_break import ROOM, error_of, fewest_values


@dataclass(frozen=True)
class PairSearch:
    """The choices of two masses with all terms."""

    question: LinearQuestion
    """What is searched."""
    first: float = 1e-9
    """The first level of error; the next is 1e-6."""
    growth: float = 1.6
    """From level to level after that."""

    @cached_property
    def values(self) -> Values:
        """The tables of what can be bought."""
        return catalogue(self.question.resistors, self.question.capacitors)

    @cached_property
    def rules(self) -> Rules:
        """The conditions."""
        q = self.question
        return rules_of(self.values, q.targets, q.bounds, q.spec)

    def error(self, parts: Index) -> float:
        """The least max error of one choice, by linear programming from its values alone."""
        return error_of(self.values, self.rules, parts)

    def fewest(self, parts: Index, limit: float, patience: int) -> tuple[Index, str]:
        """The choice of fewest values, least price, of those up to the limit."""
        prices = self.question.prices
        return fewest_values(self.values, self.rules, parts, limit, prices, patience)

    def level(self, level: float, patience: int) -> Levels:
        """The least error at most ``level``; each slice is searched below the best so far."""
        values, rules = self.values, self.rules
        best, parts = np.inf, np.full(len(PARTS), -1)
        start, whole, reached, rows, steps = 0, True, -1, 0, 0
        slices = len(values.deltas) * len(values.r)
        while start < slices:
            share = start / slices
            tried = f": {share:.0%} of the joins" if share >= 0.01 else ""
            doing(f"integrators with errors up to {level:.2g}{tried}")
            below = min(level, best)
            piece = slice_from(values, rules, below, start, patience - steps)
            left = patience - steps - piece.steps
            now = np.full(len(PARTS), -1)
            error, far, full, taken = complete(
                values, rules, piece.rows, piece.errors, below, max(left, 0), ROOM, now
            )
            if error < best:
                best, parts = error, now
                best_so_far(f"integrators with an error of {best:.2g}", step=True)
            whole = whole and full and not piece.cut
            reached = max(reached, far) if len(piece.rows) else reached
            rows, steps, start = (
                rows + len(piece.rows),
                steps + piece.steps + taken,
                piece.following,
            )
            if steps >= patience:
                whole = whole and start == slices
                break
        return Levels(best, parts, 0.0, whole, reached, rows, steps)
