"""What the mixed-integer programs share: HiGHS' options, and how values and choices are stated."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from designer.base.arrays import Array, Index

if TYPE_CHECKING:
    import cvxpy as cp

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


def chosen_row(choice: cp.Variable) -> int | None:
    """The one entry that is 1; None where an infeasible or interrupted program left another."""
    x = choice.value
    if x is None or abs(x.sum() - 1.0) > 1e-6 or abs(x.max() - 1.0) > 1e-6:
        return None
    return int(np.argmax(x))


def distinct_values(
    uses: Sequence[tuple[cp.Variable, Array | Index]], free: Array | Index
) -> tuple[cp.Variable, list[cp.Constraint]]:
    """One variable for each value that is not free, at least as large as the use made of it.

    uses : each choice of a row with the (rows,) values of one part.
    """
    import cvxpy as cp  # takes a second

    every = np.unique(np.concatenate([column for _, column in uses]))
    every = every[~np.isin(every, free)]
    used = cp.Variable(max(len(every), 1), nonneg=True)
    constraints: list[cp.Constraint] = []
    for choice, column in uses:
        own = np.intersect1d(column, every)
        if len(own):
            member = (column[None, :] == own[:, None]).astype(float)
            constraints.append(member @ choice <= used[np.searchsorted(every, own)])
    return used, constraints
