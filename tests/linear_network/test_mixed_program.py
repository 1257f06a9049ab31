"""Mixed-integer programs for HiGHS against every choice there is."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from designer.linear_network.milp import MixedProgram, chosen_row, count_values, new_kinds

CHOICES, ROWS = 4, 5


@pytest.mark.parametrize("seed", range(4))
def test_fewest_values_within_an_error(seed: int) -> None:
    """Each choice has a row of a value and an error; one shift is free for all errors, two choices
    have the same value, the sum of prices has a limit. 3 is a value that does not count."""
    random = np.random.default_rng(seed)
    values = random.integers(0, 6, (CHOICES, ROWS))
    errors, prices = random.uniform(-1.0, 1.0, (2, CHOICES, ROWS))
    limit, room = 0.7, 0.2

    def cost(rows: tuple[int, ...]) -> float:
        own = np.array(rows), np.arange(CHOICES)
        error, price, value = errors[own[1], own[0]], prices[own[1], own[0]], values[own[1], own[0]]
        if np.ptp(error) > 2.0 * limit or price.sum() > room or value[0] != value[1]:
            return np.inf
        return len(set(value.tolist()) - {3}) + 0.01 * float(price.sum())

    best = min(product(range(ROWS), repeat=CHOICES), key=cost)
    assert np.isfinite(cost(best))

    program = MixedProgram()
    every, members = new_kinds(list(values), np.array([3]))
    used, shift = program.variables(len(every)), program.variables(1, -5.0, 5.0)
    picks = [program.binary(ROWS) for _ in range(CHOICES)]
    count_values(program, used, picks, members)
    for pick in picks:
        program.equal(1.0, (pick, np.ones(ROWS)))
    program.equal(0.0, (picks[0], values[0]), (picks[1], -values[1]))
    own = [
        (pick, np.outer(unit, error))
        for pick, unit, error in zip(picks, np.eye(CHOICES), errors, strict=True)
    ]
    program.within(limit, np.full(CHOICES, 0.5), *own, (shift, np.ones((CHOICES, 1))))
    program.at_most(room, *zip(picks, prices, strict=True))
    costs = [(pick, 0.01 * price) for pick, price in zip(picks, prices, strict=True)]
    status, x = program.solve((used, np.ones(len(used))), *costs)
    assert status == "optimal"
    assert x is not None
    rows = tuple(row for pick in picks if (row := chosen_row(x[pick])) is not None)
    assert cost(rows) == pytest.approx(cost(best), abs=1e-9)


def test_a_program_without_a_choice_says_so() -> None:
    program = MixedProgram()
    pick = program.binary(3)
    program.equal(1.0, (pick, np.ones(3)))
    program.at_most(0.5, (pick, np.ones(3)))
    assert program.solve((pick, np.ones(3)))[0] == "infeasible"
