"""The cheapest choice of upgrades under limits on variances: a mixed-integer linear program.

One option of every slot is taken. Slots are independent, so the variance of a linear form is the
sum of what each slot's option contributes, and a demand "variance of this form at most so much" is
linear in the choice. A demand may hold only while a certain option is taken. cvxpy states the
program and HiGHS solves it; the answer is rebuilt from the options and checked outside the solver.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.linear_network.milp import SOLVER, chosen_row

SLACK = 1e-7
"""Share of a demand's room by which the solver's tolerance may exceed it."""
TIE = 1e-5
"""What one unit of trouble weighs against the price. Trouble decides between equal prices only."""


@dataclass(frozen=True)
class Option:
    """One way of filling a slot."""

    name: str
    price: float
    """Price over that of the slot as it is."""
    trouble: float = 0.0
    """What it asks of people rather than of the purse; it decides where the price is the same."""


@dataclass(frozen=True)
class Slot:
    """One thing that is decided."""

    name: str
    options: tuple[Option, ...]
    """Its options; the first is the design as it is."""


@dataclass(frozen=True)
class Demand:
    """A demand on a linear form: its variance stays below a limit."""

    name: str
    room: float
    """Largest variance of the linear form."""
    variances: tuple[Array, ...]
    """What each option contributes, an array (options,) for each slot."""
    when: tuple[int, int] | None = None
    """(slot, option) by their numbers: the demand holds only while that option is taken; None:
    always."""

    def variance(self, pick: Sequence[int]) -> float:
        """The variance of the form under this choice."""
        return float(sum(v[i] for v, i in zip(self.variances, pick, strict=True)))

    def holds(self, pick: Sequence[int]) -> bool:
        """Whether the choice keeps it, or it does not apply."""
        if self.when is not None and pick[self.when[0]] != self.when[1]:
            return True
        return self.variance(pick) <= self.room + SLACK * abs(self.room)


@dataclass(frozen=True)
class RepairProgram:
    """What is to be chosen, and what the choice must keep."""

    slots: tuple[Slot, ...]
    """What is decided."""
    demands: tuple[Demand, ...]
    """What the choice must keep."""

    def price(self, pick: Sequence[int]) -> float:
        """Sum of the options' prices."""
        return float(sum(s.options[i].price for s, i in zip(self.slots, pick, strict=True)))

    def trouble(self, pick: Sequence[int]) -> float:
        """Sum of the options' trouble."""
        return float(sum(s.options[i].trouble for s, i in zip(self.slots, pick, strict=True)))

    def cost(self, pick: Sequence[int]) -> float:
        """What is minimised."""
        return self.price(pick) + TIE * self.trouble(pick)

    def keeps(self, pick: Sequence[int]) -> bool:
        """Whether every demand holds."""
        return all(d.holds(pick) for d in self.demands)

    def picks(self) -> Iterator[tuple[int, ...]]:
        """Every choice there is."""
        yield from itertools.product(*(range(len(s.options)) for s in self.slots))


def cheapest(program: RepairProgram) -> tuple[int, ...] | None:
    """The number of the option taken of each slot; None where no choice keeps the demands.

    Raises
    ------
    ArithmeticError : what the solver calls optimal does not keep the demands.
    """
    import cvxpy as cp  # takes a second

    takes = [cp.Variable(len(s.options), boolean=True) for s in program.slots]
    constraints: list[object] = [cp.sum(x) == 1 for x in takes]
    for d in program.demands:
        if d.when is not None and d.room < 0.0:
            constraints.append(takes[d.when[0]][d.when[1]] == 0)
            continue
        # In shares of the room, so that every row has the same size.
        scale = abs(d.room) if d.room else 1.0
        total = sum((v / scale) @ x for v, x in zip(d.variances, takes, strict=True))
        room: object = d.room / scale
        if d.when is not None:
            most = sum(float(v.max()) for v in d.variances) / scale
            room = d.room / scale + max(most - d.room / scale, 0.0) * (
                1.0 - takes[d.when[0]][d.when[1]]
            )
        constraints.append(total <= room)
    cost = sum(
        np.array([o.price + TIE * o.trouble for o in s.options]) @ x
        for s, x in zip(program.slots, takes, strict=True)
    )
    problem = cp.Problem(cp.Minimize(cost), constraints)
    problem.solve(solver=cp.HIGHS, **SOLVER)
    rows = [chosen_row(x) for x in takes]
    pick = tuple(row for row in rows if row is not None)
    if len(pick) < len(rows):
        return None
    if not program.keeps(pick):
        raise ArithmeticError(f"the solver's choice breaks a demand ({problem.status})")
    return pick
