"""A small linear program that is solved many times with other numbers.

By HiGHS itself: a program of some ten variables takes it a tenth of the time of the way through
``scipy.optimize.linprog``. Each is solved from scratch, so no answer depends on those before it.
"""

from __future__ import annotations

from typing import Any

import highspy
import numpy as np

from designer.base.arrays import Array


class LinearProgram:
    """The least cost @ x with rows @ x <= most and low <= x <= high.

    rows : (m, n). low, high : (n,).
    """

    def __init__(self, rows: Array, low: Array, high: Array) -> None:
        m, n = rows.shape
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
            self._solver.setOptionValue(option, value)
        self._solver.passModel(program)

    def solve(self, cost: Array, most: Array, high: Array | None = None) -> Array | None:
        """x (n,); None where no x keeps the limits. high : other upper bounds, from now on."""
        solver = self._solver
        solver.clearSolver()
        solver.changeColsCost(len(self._columns), self._columns, cost)
        solver.changeRowsBounds(len(self._most), self._most, self._free, most)
        if high is not None:
            low = np.array(solver.getLp().col_lower_)
            solver.changeColsBounds(len(self._columns), self._columns, low, high)
        solver.run()
        if solver.getModelStatus() != highspy.HighsModelStatus.kOptimal:
            return None
        return np.array(solver.getSolution().col_value)
