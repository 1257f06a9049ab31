"""Small linear programs by HiGHS itself, against known ends and against scipy."""

from __future__ import annotations

import numpy as np
import pytest

from designer.circuit.linear_program import LinearProgram
from designer.circuit.scale_fit import LargestFit, minimax


def test_a_program_is_solved_anew_with_other_numbers() -> None:
    far = np.full(2, 10.0)
    program = LinearProgram(np.array([[1.0, 1.0], [1.0, -1.0]]), -far, far)
    x = program.solve(np.array([-1.0, 0.0]), np.array([3.0, 1.0]))
    assert x == pytest.approx([2.0, 1.0])
    x = program.solve(np.array([0.0, -1.0]), np.array([3.0, 1.0]), np.array([10.0, 2.5]))
    assert x is not None
    assert x[1] == pytest.approx(2.5)
    assert program.solve(np.zeros(2), np.array([-30.0, 1.0])) is None


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
