"""What limits a response: named from margins that were made up, and found on a design."""

from __future__ import annotations

import numpy as np
import pytest

from designer import exact, pipeline
from designer.limiting import (
    COEFFICIENTS,
    COEXISTING,
    GRAZING,
    NEIGHBOUR,
    NOTHING,
    NULL,
    OFFSET,
    RAILS,
    cause,
    limiting,
    limitings,
    shares,
)
from designer.margins import Limit, Margin
from designer.quantities import Quantity
from tests.search_cases import catalog, made

QUANTITIES = (
    Quantity("R1", "values", 1e4, 58.0),
    Quantity("C1", "values", 1e-8, 1e-10),
    Quantity("R203", "values", 1e4, 58.0),
    Quantity("U1A", "offset", 0.0, 3e-3),
    Quantity("U3A", "high", 13.0, 0.4),
)


def margin(kind: str, slopes: list[float], sought: int = 0, there: int = 0) -> Margin:
    limit = Limit("what", kind, 2.0, 0.5, np.array(slopes))
    return Margin(QUANTITIES, (limit,), sought=sought, there=there)


@pytest.mark.parametrize(
    ("kind", "slopes", "mechanism"),
    [
        ("contact", [1.0, 1.0, 0.1, 0.1, 0.1], GRAZING),
        ("miss", [1.0, 1.0, 0.1, 0.1, 0.1], GRAZING),
        ("fold", [1.0, 1.0, 0.1, 0.1, 0.1], NEIGHBOUR),
        ("doubling", [1.0, -1.0, 1.0, 1.0, 0.0], NEIGHBOUR),
        ("contact", [0.1, 0.1, 0.1, -3.0, 0.1], OFFSET),
        ("fold", [0.1, 0.1, 3.0, 0.1, 0.1], NULL),
        ("fold", [0.1, 0.1, 0.1, 0.1, 3.0], RAILS),
    ],
)
def test_the_mechanism_is_the_border_s_unless_something_else_moves_it(
    kind: str, slopes: list[float], mechanism: str
) -> None:
    found = limiting(margin(kind, slopes))
    assert found.mechanism == mechanism
    assert found.distance == 4.0
    assert found.line.startswith(f"{mechanism}: what, 4.0 σ away")
    assert sum(found.shares.values()) == pytest.approx(1.0)


def test_boards_that_have_the_response_all_the_same() -> None:
    there = margin("fold", [1.0] * 5, sought=8, there=5)
    assert limiting(there).mechanism == COEXISTING
    assert "5 of 8" in limiting(there).line
    assert limiting(margin("fold", [1.0] * 5, sought=8, there=4)).mechanism == NEIGHBOUR


def test_nothing_limits() -> None:
    assert limiting(Margin(QUANTITIES, ())).mechanism == NOTHING


def test_shares_are_of_the_variance() -> None:
    limit = Limit("what", "fold", 1.0, 1.0, np.array([1.0, 2.0, 0.0, 1.0, 0.0]))
    found = shares(QUANTITIES, limit)
    assert found == {OFFSET: pytest.approx(1 / 6), NULL: 0.0, RAILS: 0.0,
                     COEFFICIENTS: pytest.approx(5 / 6)}  # fmt: skip


def test_causes() -> None:
    assert [cause(q) for q in QUANTITIES] == [COEFFICIENTS, COEFFICIENTS, NULL, OFFSET, RAILS]
    assert cause(Quantity("D1", "reference", 5.0, 0.01)) == NULL
    assert cause(Quantity("VCC", "supply", 15.0, 0.1)) == RAILS
    assert cause(Quantity("R50A", "values", 1e4, 58.0)) == NULL
    assert cause(Quantity("R500", "values", 1e4, 58.0)) == COEFFICIENTS


def test_on_a_design_the_shares_add_up() -> None:
    synthesis = made()
    checked = pipeline.check(synthesis.design, synthesis.found, None)
    plan = pipeline.plan_study(
        synthesis.modelfile, synthesis.design, checked, catalog(), samples=40, seed=2
    )
    (found,) = limitings(plan, exact.block(plan, range(40), 1))
    assert found.distance > 0.0
    assert sum(found.shares.values()) == pytest.approx(1.0)
    assert found.shares[COEFFICIENTS] > found.shares[OFFSET]
