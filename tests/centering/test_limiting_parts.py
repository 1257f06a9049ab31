"""What limits a response: named from margins that were made up, and found on a design."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from designer.centering.limiting_parts import (
    COEFFICIENTS,
    COEXISTING,
    GRAZING,
    NEIGHBOUR,
    NOTHING,
    NULL,
    OFFSET,
    RAILS,
    cause,
    joint_boards,
    limiting,
    limitings,
    shares,
)
from designer.check import checked_design
from designer.spread.board_quantities import Quantity, quantities
from designer.spread.spread import Group
from designer.verdicts import exact_circuit
from designer.yields.margins import Limit, Margin
from designer.yields.study_plan import plan_study
from tests.shared import bench_plans, paper_cases
from tests.shared.search_cases import catalog, made

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


def test_parts_that_track_count_with_what_they_share() -> None:
    """Two parts of the dead zone and one of the linear part in a network, against the moments: with
    a share s two deviations have the covariance s²·var, and each the variance (s² + (1 - s)²)·var.
    """
    circuit, s = paper_cases.subject(1).circuit, 0.9
    grouped = Group("network:1", ("R201", "R203", "R4"), s)
    spread = replace(bench_plans.SPREAD, groups=(grouped,))
    drawn = joint_boards(circuit, spread, 3)
    assert drawn is not None
    every = quantities(circuit, drawn)
    parts = tuple(q for q in every if q.part in ("R201", "R203", "R4", "R11"))
    slope = {"R201": 2.0, "R203": -1.0, "R4": 1.5, "R11": 0.5}
    limit = Limit("what", "fold", 1.0, 1.0, np.array([slope[q.part] for q in parts]))
    rho = s**2 / (s**2 + (1.0 - s) ** 2)
    null = 2.0**2 + 1.0 - 2.0 * 2.0 * rho + 1.5 * (2.0 - 1.0) * rho
    rest = 1.5**2 + 0.5**2 + 1.5 * (2.0 - 1.0) * rho
    found = shares(parts, limit, drawn)
    assert found[NULL] == pytest.approx(null / (null + rest), abs=0.03)
    assert found[COEFFICIENTS] == pytest.approx(rest / (null + rest), abs=0.03)
    apart = shares(parts, limit)
    assert apart[NULL] == pytest.approx(5.0 / 7.5)
    assert abs(apart[NULL] - found[NULL]) > 0.1  # so it matters


def test_a_cause_may_take_off_what_another_adds() -> None:
    circuit = paper_cases.subject(1).circuit
    spread = replace(bench_plans.SPREAD, groups=(Group("network:1", ("R201", "R4"), 1.0),))
    drawn = joint_boards(circuit, spread, 3)
    assert drawn is not None
    parts = tuple(q for q in quantities(circuit, drawn) if q.part in ("R201", "R4"))
    slope = {"R201": 2.0, "R4": -1.0}
    limit = Limit("what", "fold", 1.0, 1.0, np.array([slope[q.part] for q in parts]))
    # One number moves both: (2 - 1)² is left of the variance, 2·(2 - 1) and -1·(2 - 1) its parts.
    assert shares(parts, limit, drawn)[NULL] == pytest.approx(2.0)
    assert shares(parts, limit, drawn)[COEFFICIENTS] == pytest.approx(-1.0)


def test_only_what_varies_together_is_drawn() -> None:
    circuit = paper_cases.subject(1).circuit
    assert joint_boards(circuit, bench_plans.SPREAD, 3) is None
    warm = replace(bench_plans.SPREAD, temperature=(10.0, 40.0))
    assert joint_boards(circuit, warm, 3) is not None


def test_causes() -> None:
    assert [cause(q) for q in QUANTITIES] == [COEFFICIENTS, COEFFICIENTS, NULL, OFFSET, RAILS]
    assert cause(Quantity("D1", "reference", 5.0, 0.01)) == NULL
    assert cause(Quantity("VCC", "supply", 15.0, 0.1)) == RAILS
    assert cause(Quantity("R50A", "values", 1e4, 58.0)) == NULL
    assert cause(Quantity("R500", "values", 1e4, 58.0)) == COEFFICIENTS


@pytest.mark.slow
def test_on_a_design_the_shares_add_up() -> None:
    synthesis = made()
    checked = checked_design.check(synthesis.design, synthesis.model_responses, None)
    plan = plan_study(synthesis.modelfile, synthesis.design, checked, catalog(), samples=40, seed=2)
    (found,) = limitings(plan, exact_circuit.block(plan, range(40), 1))
    assert found.distance > 0.0
    assert sum(found.shares.values()) == pytest.approx(1.0)
    assert found.shares[COEFFICIENTS] > found.shares[OFFSET]
