"""What the mixed-integer programs share: HiGHS and its options, and how values are counted.

``MixedProgram`` hands a program of some hundred numbers to HiGHS without cvxpy, whose import takes
longer than most of the search for parts.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import highspy
import numpy as np

from designer.base.arrays import Array, Index

SOLVER: dict[str, float | int] = {
    "mip_rel_gap": 0.0,
    "mip_abs_gap": 1e-9,
    "mip_feasibility_tolerance": 1e-9,
    "primal_feasibility_tolerance": 1e-9,
    "random_seed": 0,
    "threads": 1,
}
"""HiGHS options; they stand in the provenance. No time limit: it would make answers differ."""
NODES = 3000
"""Branch-and-bound nodes of a program that is not expected to end: a limit by count, so that
answers do not depend on time."""
PRICE_WEIGHT = 1e-3
"""Of one price class against one distinct value: price only breaks ties."""


Term = tuple[Index, Array | Index]
"""Variables by their numbers (k,), and what each row has of them (rows, k), or one row (k,)."""
STATUS = {
    "kOptimal": "optimal",
    "kInfeasible": "infeasible",
    "kUnboundedOrInfeasible": "infeasible_or_unbounded",
    "kUnbounded": "unbounded",
    "kTimeLimit": "user_limit",
    "kIterationLimit": "user_limit",
    "kSolutionLimit": "user_limit",
}
"""HiGHS' words for how a program ended, as cvxpy has them."""


class MixedProgram:
    """The least cost @ x whose rows and variables keep their limits."""

    def __init__(self) -> None:
        self._ends: list[tuple[float, float, bool]] = []
        self._equal: list[tuple[Array, tuple[Term, ...]]] = []
        self._most: list[tuple[Array, tuple[Term, ...]]] = []

    def variables(
        self, count: int, low: float = 0.0, high: float = np.inf, *, whole: bool = False
    ) -> Index:
        """The numbers (count,) of new variables."""
        first = len(self._ends)
        self._ends += [(low, high, whole)] * count
        return np.arange(first, first + count)

    def binary(self, count: int) -> Index:
        """Variables that are 0 or 1."""
        return self.variables(count, 0.0, 1.0, whole=True)

    def equal(self, right: float | Array, *terms: Term) -> None:
        """Rows whose terms sum up to this."""
        self._equal.append((np.asarray(right), terms))

    def at_most(self, right: float | Array, *terms: Term) -> None:
        """Rows whose terms sum up to no more than this."""
        self._most.append((np.asarray(right), terms))

    def within(self, limit: float, start: Array, *terms: Term) -> None:
        """Rows whose terms, added to ``start`` (rows,), are no further from 0 than the limit."""
        size = variables = self.variables(len(start))
        low, high = start.copy(), start.copy()
        for which, rows in terms:
            ends = np.array([self._ends[k][:2] for k in which]).T
            products = rows * ends[0], rows * ends[1]
            low += np.minimum(*products).sum(axis=1)
            high += np.maximum(*products).sum(axis=1)
        for k, furthest in zip(variables, np.maximum(-low, high), strict=True):
            self._ends[k] = 0.0, float(furthest), False
        unit = np.eye(len(start))
        self.at_most(-start, *terms, (size, -unit))
        self.at_most(start, *((which, -rows) for which, rows in terms), (size, -unit))
        self.at_most(limit, (size, unit))

    def solve(self, *costs: Term, **options: float) -> tuple[str, Array | None]:
        """How it ended, and x where HiGHS leaves one. options : beside ``SOLVER``."""
        n = len(self._ends)
        (equal, level), (rows, most) = self._rows(self._equal), self._rows(self._most)
        least = np.append(level, np.full(len(most), -np.inf))
        rows, most = np.vstack([equal, rows]), np.append(level, most)
        cost = np.zeros(n)
        for which, weights in costs:
            cost[which] += weights
        program: Any = highspy.HighsLp()
        program.num_col_, program.num_row_ = n, len(most)
        program.col_cost_, program.row_lower_, program.row_upper_ = cost, least, most
        low, high, whole = zip(*self._ends, strict=True)
        program.col_lower_, program.col_upper_ = np.array(low), np.array(high)
        kinds = highspy.HighsVarType
        program.integrality_ = [kinds.kInteger if w else kinds.kContinuous for w in whole]
        column, row = np.nonzero(rows.T)
        matrix = program.a_matrix_
        matrix.format_ = highspy.MatrixFormat.kColwise
        matrix.start_ = np.append(0, np.cumsum(np.bincount(column, minlength=n)))
        matrix.index_, matrix.value_ = row, rows[row, column]
        solver: Any = highspy.Highs()  # type: ignore[no-untyped-call]
        for name, value in {"log_to_console": False, **SOLVER, **options}.items():
            solver.setOptionValue(name, value)
        solver.passModel(program)
        solver.run()
        status, x = solver.getModelStatus().name, np.array(solver.getSolution().col_value)
        return STATUS.get(status, status), x if len(x) == n else None

    def _rows(self, every: Sequence[tuple[Array, tuple[Term, ...]]]) -> tuple[Array, Array]:
        """(rows, n) and (rows,) what they may sum up to."""
        blocks = [self._block(terms) for _, terms in every]
        pairs = zip(every, blocks, strict=True)
        ends = [np.broadcast_to(right, len(block)) for (right, _), block in pairs]
        return np.vstack(blocks), np.concatenate(ends).astype(float)

    def _block(self, terms: tuple[Term, ...]) -> Array:
        parts = [(which, np.atleast_2d(np.asarray(rows, dtype=float))) for which, rows in terms]
        out = np.zeros((len(parts[0][1]), len(self._ends)))
        for which, rows in parts:
            out[:, which] += rows
        return out


def chosen_row(x: Array | None) -> int | None:
    """The one entry that is 1; None where an infeasible or interrupted program left another."""
    if x is None or abs(x.sum() - 1.0) > 1e-6 or abs(x.max() - 1.0) > 1e-6:
        return None
    return int(np.argmax(x))


def new_kinds(
    uses: Sequence[Array | Index], free: Array | Index
) -> tuple[Array, list[tuple[Array, Index]]]:
    """The values that are not free of choices with these (rows,) values of one part; and of each
    choice which of its rows has which value, (values, rows), with the values' places."""
    every = np.unique(np.concatenate([np.asarray(column, dtype=float) for column in uses]))
    every = every[~np.isin(every, free)]
    own = [np.intersect1d(column, every) for column in uses]
    return every, [
        ((column[None, :] == values[:, None]).astype(float), np.searchsorted(every, values))
        for column, values in zip(uses, own, strict=True)
    ]


def count_values(
    program: MixedProgram,
    used: Index,
    uses: Sequence[Index],
    members: Sequence[tuple[Array, Index]],
) -> None:
    """Each value's variable is at least as large as the use that choices make of it. members : as
    of ``new_kinds``, of the variables ``uses`` of each choice."""
    for which, (member, places) in zip(uses, members, strict=True):
        if len(places):
            program.at_most(0.0, (which, member), (used[places], -np.eye(len(places))))
