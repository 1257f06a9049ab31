"""Whether the mixed-integer solver that is installed here answers small programs rightly.

HiGHS 1.14.0 called wrong answers optimal (issues 2957, 3043, 3073 and 3094 of ERGO-Code/HiGHS), and
nothing downstream can see that a better choice of parts was missed.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib.metadata import version
from typing import TYPE_CHECKING

from designer.linear_network.milp import SOLVER

if TYPE_CHECKING:
    import cvxpy as cp

Program = tuple[str, "cp.Problem", float]
"""In words, and its optimum."""


def programs() -> Iterator[Program]:
    """Programs of a few variables, each of a form that a version of HiGHS answered wrongly."""
    import cvxpy as cp  # takes a second

    x, z = cp.Variable(nonneg=True), cp.Variable(integer=True)
    yield (
        "min 2x + 3z, x + z ≥ 4.5, 0 ≤ x ≤ 10, 0 ≤ z ≤ 10 whole",
        cp.Problem(cp.Minimize(2 * x + 3 * z), [x + z >= 4.5, x <= 10, z >= 0, z <= 10]),
        9.0,
    )
    yield (
        "min z + 2x, x + z ≥ 20.1, 8 ≤ x ≤ 20, 0 ≤ z ≤ 20 whole",
        cp.Problem(cp.Minimize(z + 2 * x), [x + z >= 20.1, x >= 8, x <= 20, z >= 0, z <= 20]),
        28.2,
    )
    yield (
        "min 100x + 0.01|z|, x + z = 3, x ≥ 0, z ≥ 0.45 whole",
        cp.Problem(cp.Minimize(100 * x + 0.01 * cp.abs(z)), [x + z == 3, z <= 3, z >= 0.45]),
        0.03,
    )
    y, loss = cp.Variable(2, boolean=True), cp.Variable(2, nonneg=True)
    kept = cp.Variable(2, nonneg=True)
    limits = [kept <= 1000 * y, kept + loss == 1000, cp.sum(y) <= 1]
    yield (
        "min 10a + 8b, one of a and b at most 1000, the other 0",
        cp.Problem(cp.Minimize(10 * loss[0] + 8 * loss[1]), limits),
        8000.0,
    )


def solver_words() -> str:
    """The solver's version, and that its answers are right or which is not."""
    import cvxpy as cp  # takes a second

    name = f"HiGHS {version('highspy')}"
    asked = list(programs())
    for words, program, optimum in asked:
        try:
            program.solve(solver=cp.HIGHS, **SOLVER)
        except cp.SolverError as error:
            return f"{name} fails: {error}"
        found = program.value
        if found is None or not abs(float(found) - optimum) <= 1e-6 * optimum:
            answer = f"{program.status}, {found}"
            return (
                f"{name} answers wrongly ({answer}; right is {optimum:g}): {words}; its choices of "
                "parts may not be the best: pip install 'highspy>=1.15'"
            )
    return f"{name}, right on {len(asked)} small programs"
