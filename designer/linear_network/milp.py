"""What the mixed-integer programs share: HiGHS' options, and how values and choices are stated."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

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
STATISTICS, QUADRATIC, COMMAND_LINE = "scipy.stats", "osqp", "designer.cli.entry"
"""Modules."""


class _Deferred(ModuleType):
    """A module, or something of one, that is imported when it is called or something is asked of
    it that it has."""

    def __init__(self, module: str, name: str = "") -> None:
        super().__init__(module)
        self._of = module, name

    def __getattr__(self, name: str) -> Any:
        module, own = self._of
        if name.startswith("__"):  # what an import looks for
            raise AttributeError(name)
        return getattr(self._real, name) if own else _Deferred(module, name)

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        return self._real(*arguments, **named)

    @property
    def _real(self) -> Any:
        module, name = self._of
        return getattr(import_module(module), name)


def import_cvxpy() -> None:
    """Import cvxpy without what takes longest of it. SciPy's statistics take four times as long as
    all else: one of its atoms calls one function of theirs. OSQP comes with a template engine, and
    no program here is quadratic.

    Both are there in a process that is not the command line's own, whose other threads might ask
    for them meanwhile, and where a version of cvxpy needs more of them.
    """
    modules: dict[str, ModuleType | None] = sys.modules  # type: ignore[assignment]
    every = {STATISTICS: _Deferred(STATISTICS), QUADRATIC: None}
    stand_ins = {name: stand_in for name, stand_in in every.items() if name not in modules}
    if COMMAND_LINE in modules and "cvxpy" not in modules:
        modules |= stand_ins
        try:
            import_module("cvxpy")
        except Exception:  # whatever it made of the stand-ins
            for name in [name for name in modules if name.partition(".")[0] == "cvxpy"]:
                del modules[name]
        finally:
            for name, stand_in in stand_ins.items():
                if name in modules and modules[name] is stand_in:
                    del modules[name]
    import_module("cvxpy")


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
