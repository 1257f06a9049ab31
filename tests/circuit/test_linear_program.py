"""The linear program that is solved many times: what one solve leaves for the next, and what it
says where the solver comes to no end; largest errors by it, against those of the minimax."""

from __future__ import annotations

import numpy as np
import pytest

from designer.circuit.linear_program import LinearProgram
from designer.circuit.scale_fit import LargestFit, minimax

COST = np.array([-1.0, -2.0])


def program(high: float) -> LinearProgram:
    """x + y <= 4 from 0 to ``high``."""
    return LinearProgram(np.ones((1, 2)), np.zeros(2), np.full(2, high))


def test_other_bounds_are_of_one_solve() -> None:
    asked, most = program(3.0), np.array([4.0])
    assert asked.solve(COST, most) == pytest.approx([1.0, 3.0])
    assert asked.solve(COST, most, np.array([3.0, 1.0])) == pytest.approx([3.0, 1.0])
    assert asked.solve(COST, most) == pytest.approx([1.0, 3.0])


def test_none_says_that_no_point_keeps_the_limits() -> None:
    asked = program(3.0)
    assert asked.solve(COST, np.array([-1.0])) is None
    assert asked.solve(COST, np.array([4.0])) is not None


def test_a_solver_that_gives_up_says_nothing_of_the_limits() -> None:
    asked = program(3.0)
    asked._solver.setOptionValue("simplex_iteration_limit", 0)
    assert asked.solve(COST, np.array([4.0])) == pytest.approx([1.0, 3.0])


def test_a_program_without_a_least_is_refused() -> None:
    with pytest.raises(ArithmeticError, match="is not solved"):
        LinearProgram(-np.ones((1, 2)), np.zeros(2), np.full(2, np.inf)).solve(COST, np.zeros(1))
    with pytest.raises(ArithmeticError, match="not finite"):
        program(np.nan).solve(COST, np.array([4.0]))


@pytest.mark.parametrize("seed", range(5))
def test_the_largest_error_is_that_at_the_scales_of_the_minimax(seed: int) -> None:
    random = np.random.default_rng(seed)
    D = random.integers(-1, 2, size=(20, 4)).astype(float)
    every, own = np.ones(20, dtype=bool), np.arange(20) < 17
    for h in 0.01 * random.standard_normal((3, 20)):
        whole = np.abs(h + D @ minimax(h, D)).max()
        assert LargestFit(D, every).largest(h) == pytest.approx(whole, abs=1e-9)
        part = np.abs(h + D @ minimax(h[own], D[own])).max()
        assert LargestFit(D, own).largest(h) == pytest.approx(part, abs=1e-7)
