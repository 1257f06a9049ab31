"""The program of the repair against enumeration."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from designer.centering.repair_milp import Demand, Option, RepairProgram, Slot, cheapest


def enumerated(program: RepairProgram) -> float | None:
    """The least cost of all choices that keep the demands, by trying each."""
    costs = [program.cost(pick) for pick in program.picks() if program.keeps(pick)]
    return min(costs, default=None)


def random_program(seed: int) -> RepairProgram:
    """A few slots of one to three options; some demands apply under one option alone."""
    rng = np.random.default_rng(seed)
    slots = tuple(
        Slot(
            f"s{k}",
            tuple(
                Option(f"o{i}", float(rng.choice([0.0, 0.1, 0.5, 1.0])), float(rng.integers(3)))
                for i in range(rng.integers(1, 4))
            ),
        )
        for k in range(5)
    )
    demands = []
    for number in range(int(rng.integers(1, 5))):
        variances = tuple(rng.exponential(1.0, len(s.options)) for s in slots)
        total = sum(float(v.mean()) for v in variances)
        when = None
        if rng.random() < 0.5:
            slot = int(rng.integers(5))
            when = (slot, int(rng.integers(len(slots[slot].options))))
        room = -1.0 if rng.random() < 0.1 else total * float(rng.uniform(0.4, 1.2))
        demands.append(Demand(f"d{number}", room, variances, when))
    return RepairProgram(slots, tuple(demands))


@settings(max_examples=25)
@given(st.integers(0, 10_000))
def test_the_cheapest_choice_is_the_enumerated_one(seed: int) -> None:
    program = random_program(seed)
    pick, least = cheapest(program), enumerated(program)
    if least is None:
        assert pick is None
    else:
        assert pick is not None
        assert program.keeps(pick)
        assert program.cost(pick) == pytest.approx(least, abs=1e-9)


def test_both_outcomes_are_among_the_random_programs() -> None:
    answers = {enumerated(random_program(seed)) is None for seed in range(40)}
    assert answers == {True, False}


def test_trouble_decides_between_equal_prices_only() -> None:
    free = Slot("place", (Option("as is", 0.0), Option("moved", 0.0, 1.0), Option("trim", 0.0, 9)))
    parts = Slot("R1", (Option("as is", 0.0), Option("0.1 %", 0.02)))
    variances = (np.array([0.0, 0.0, 0.0]), np.array([4.0, 1.0]))
    held = [Demand("stated", 2.0, variances, (0, 0)), Demand("moved", 5.0, variances, (0, 1))]
    assert cheapest(RepairProgram((free, parts), tuple(held))) == (1, 0)
    held[1] = Demand("moved", 2.0, variances, (0, 1))
    assert cheapest(RepairProgram((free, parts), tuple(held))) == (2, 0)
    held.append(Demand("trim", -1.0, variances, (0, 2)))
    assert cheapest(RepairProgram((free, parts), tuple(held))) == (0, 1)
