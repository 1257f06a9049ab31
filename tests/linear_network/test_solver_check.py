"""The solver's self-test: its optima by enumeration, and what it says of a wrong answer."""

from __future__ import annotations

import itertools
import subprocess
import sys
import textwrap
from typing import Any

import cvxpy as cp
import pytest

from designer.linear_network import solver_check


def test_the_optima_by_enumeration() -> None:
    """For each whole number the best of the rest is plain."""
    first = [optimum for _, _, optimum in solver_check.programs()]
    assert first[0] == min(3 * z + 2 * max(4.5 - z, 0.0) for z in range(11) if 4.5 - z <= 10)
    assert first[1] == pytest.approx(
        min(z + 2 * max(20.1 - z, 8.0) for z in range(21) if 20.1 - z <= 20.0)
    )
    assert first[2] == pytest.approx(min(100 * (3 - z) + 0.01 * z for z in (1, 2, 3)))
    losses = [
        10 * (1 - a) * 1000 + 8 * (1 - b) * 1000
        for a, b in itertools.product((0, 1), repeat=2)
        if a + b <= 1
    ]
    assert first[3] == min(losses)


def test_the_solver_that_is_here() -> None:
    words = solver_check.solver_words()
    assert words.startswith("HiGHS 1.")
    assert words.endswith(", right on 4 small programs")


@pytest.mark.parametrize("wrong", [15.0, None, float("nan"), 8.9])
def test_a_wrong_answer_is_said(monkeypatch: pytest.MonkeyPatch, wrong: float | None) -> None:
    """As of 1.14.0, which answers 15 where 9 is the least."""

    def solve(self: Any, **_: object) -> None:
        self._value, self._status = wrong, "optimal"

    monkeypatch.setattr(cp.Problem, "solve", solve)
    words = solver_check.solver_words()
    assert f"answers wrongly (optimal, {wrong}; right is 9)" in words
    assert "2x + 3z" in words
    assert "highspy>=1.15" in words


def test_the_command_line_s_cvxpy_comes_without_what_takes_long() -> None:
    """SciPy's statistics come once the atom that needs them has a value: relative entropy of two
    matrices with the same eigenvectors is that of their eigenvalues. OSQP can be imported later."""
    script = textwrap.dedent(
        """
        import sys
        import numpy as np
        import designer.cli.entry
        from designer.linear_network.milp import import_cvxpy

        import_cvxpy()
        assert not {"scipy.stats", "osqp"} & sys.modules.keys()
        import cvxpy as cp

        p, q = np.array([0.25, 0.75]), np.array([0.5, 0.5])
        value = cp.quantum_rel_entr(np.diag(p), np.diag(q)).value
        assert abs(value - (p * np.log(p / q)).sum()) < 1e-9, value
        from scipy.stats import norm

        assert norm.cdf(0.0) == 0.5
        import osqp

        assert osqp.OSQP
        """
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
