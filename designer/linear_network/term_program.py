"""The mixed-integer program that mixes the values of known choices of a linear block.

One-hot in logarithms: each part has one of the values that it has in some choice, all scales are
free, the largest error stays within a limit. Fewest distinct values, then the lowest price; cvxpy
states it and HiGHS solves it, with a limit on its nodes.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from designer.base.arrays import Array, Index, Mask
from designer.linear_network.linear_terms import Targets, scale_columns
from designer.linear_network.milp import NODES, PRICE_WEIGHT, SOLVER, chosen_row, distinct_values
from designer.linear_network.term_conditions import TermConditions

if TYPE_CHECKING:
    pass

MOST = 12
"""Choices whose values are mixed: the last ones, which are the best."""


@dataclass(frozen=True)
class TermProgram:
    """What the program chooses from."""

    choices: Index
    """(k, parts) indices of values, in the order of ``Targets.parts``."""
    logs: tuple[Array, Array]
    """ln of the resistances and of the capacitances."""
    free: Mask
    """Which resistances, then which capacitances do not count as distinct."""
    prices: Array
    """Price class of each capacitance."""
    targets: Targets
    conditions: TermConditions
    """The side conditions."""
    equal: Index
    """(j, 2) places of parts that must be equal."""

    def solve(self, limit: float, most: int) -> tuple[str, Index | None]:
        """HiGHS' status, and the choice of fewest values with an error up to ``limit``, if it has
        one. most : distinct values that are known to do."""
        import cvxpy as cp  # takes a second

        known, terms = self.choices[-1], len(self.targets.entries)
        values = [np.unique(column) for column in self.choices[-MOST:].T]
        picks = [cp.Variable(len(own), boolean=True) for own in values]
        r, c = self.logs
        # Relative to a choice that is known: small numbers only.
        logs = [(r if k < terms else c) for k in range(len(picks))]
        moved = [
            (log[own] - log[known[k]]) @ pick
            for k, (log, own, pick) in enumerate(zip(logs, values, picks, strict=True))
        ]
        states = [a for a, _ in self.targets.entries]
        change = cp.hstack([-(moved[k] + moved[terms + a]) for k, a in enumerate(states)])
        start = -(r[known[:terms]] + c[known[terms:]][states] + self.targets.wanted)
        columns = scale_columns(self.targets)
        near = np.linalg.lstsq(columns, -start, rcond=None)[0]
        shift = cp.Variable(columns.shape[1], bounds=[-20.0, 20.0])
        errors = start + columns @ near + change + columns @ shift
        G, g = self.conditions.inequalities
        shifted = [own + (0 if k < terms else len(r)) for k, own in enumerate(values)]
        used, rest = distinct_values(
            list(zip(picks, shifted, strict=True)), np.flatnonzero(self.free)
        )
        rest += [cp.sum(pick) == 1 for pick in picks]
        rest += [cp.abs(errors) <= limit, cp.sum(used) <= most]
        rest += [G @ start + G @ change <= g] if len(g) else []
        rest += [values[i] @ picks[i] == values[j] @ picks[j] for i, j in self.equal if i < j]
        price = sum(
            self.prices[own] @ pick for own, pick in zip(values[terms:], picks[terms:], strict=True)
        )
        problem = cp.Problem(cp.Minimize(cp.sum(used) + PRICE_WEIGHT * price), rest)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of an answer at the limit of nodes
            problem.solve(solver=cp.HIGHS, **SOLVER, mip_max_nodes=NODES)
        rows = [chosen_row(pick) for pick in picks]
        if any(row is None for row in rows):
            return str(problem.status), None
        chosen = [own[row] for own, row in zip(values, rows, strict=True)]
        return str(problem.status), np.array(chosen, dtype=np.int64)
