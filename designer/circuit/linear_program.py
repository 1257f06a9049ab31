"""A small linear program that is solved many times with other numbers.

By HiGHS itself: a program of some ten variables takes it a tenth of the time of the way through
``scipy.optimize.linprog``. Each is solved from scratch, so no answer depends on those before it.
"""

from __future__ import annotations

from typing import Any

import highspy
import numpy as np
from scipy.optimize import linprog

from designer.base.arrays import Array


class LinearProgram:
    """The least cost @ x with rows @ x <= most and low <= x <= high. One thread may use it.

    rows : (m, n). low, high : (n,).
    """

    def __init__(self, rows: Array, low: Array, high: Array) -> None:
        m, n = rows.shape
        self._rows, self._low, self._high = rows, low, high
        self._most, self._columns = np.arange(m, dtype=np.int32), np.arange(n, dtype=np.int32)
        self._free = np.full(m, -np.inf)
        program = highspy.HighsLp()
        program.num_row_, program.num_col_ = m, n
        program.col_cost_, program.col_lower_, program.col_upper_ = np.zeros(n), low, high
        program.row_lower_, program.row_upper_ = self._free, np.zeros(m)
        row, column = np.nonzero(rows)
        matrix = program.a_matrix_
        matrix.format_ = highspy.MatrixFormat.kRowwise
        matrix.start_ = np.append(0, np.cumsum(np.bincount(row, minlength=m)))
        matrix.index_, matrix.value_ = column, rows[row, column]
        self._solver: Any = highspy.Highs()  # type: ignore[no-untyped-call]
        for option, value in (("output_flag", False), ("threads", 1), ("presolve", "off")):
            _taken(self._solver.setOptionValue(option, value))
        _taken(self._solver.passModel(program))

    def solve(self, cost: Array, most: Array, high: Array | None = None) -> Array | None:
        """x (n,); None where no x keeps the limits. high : upper bounds of this solve alone.

        Raises
        ------
        ArithmeticError : the program is not finite, has no least, or no solver comes to its end.
        """
        solver, high = self._solver, self._high if high is None else high
        _taken(solver.clearSolver())
        _taken(solver.changeColsCost(len(self._columns), self._columns, cost))
        _taken(solver.changeRowsBounds(len(self._most), self._most, self._free, most))
        _taken(solver.changeColsBounds(len(self._columns), self._columns, self._low, high))
        solver.run()
        status, known = solver.getModelStatus(), highspy.HighsModelStatus
        if status == known.kOptimal:
            return np.array(solver.getSolution().col_value)
        return None if status == known.kInfeasible else self._otherwise(cost, most, high)

    def _otherwise(self, cost: Array, most: Array, high: Array) -> Array | None:
        """Where HiGHS says neither: with its presolve, and what else SciPy tries."""
        bounds = list(zip(self._low, high, strict=True))
        found = linprog(cost, A_ub=self._rows, b_ub=most, bounds=bounds, method="highs")
        if found.status == 0:
            return np.asarray(found.x)
        if found.status == 2:  # infeasible
            return None
        raise ArithmeticError(f"a linear program is not solved: {found.message}")


def _taken(status: Any) -> None:
    if status == highspy.HighsStatus.kError:
        raise ArithmeticError("a linear program is not finite")
