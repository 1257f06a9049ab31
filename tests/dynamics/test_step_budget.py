"""Extreme parameters: work is bounded by a count of steps, and what stops it is said."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from designer.base.errors import InputError
from designer.check import coexistence
from designer.cli import entry
from designer.dynamics import flow, step_budget
from designer.dynamics.attractors import settle
from designer.dynamics.coexisting_attractors import coexisting
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowStatus
from designer.dynamics.orbit import ANSWERS
from designer.dynamics.piecewise_linear import Drive
from designer.dynamics.step_budget import Budget
from designer.model.model import Dimensionless
from designer.model.model_file import parse_model_file
from tests.shared.model_text import PAPER_TABLE

PAPER = Dimensionless(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25)
ENOUGH = 300_000


def wide(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high).map(lambda e: 10.0**e)


near_one = wide(-17, 0).map(lambda gap: 1.0 - gap)
share = wide(-320, 0) | near_one


@settings(max_examples=60, deadline=None)
@given(
    m=share, k=share, k0=share, c=share, zeta=wide(-320, 308), f20=share, b=wide(-320, 308),
    omega=wide(-3, 3),
)  # fmt: skip
def test_any_model_is_refused_by_name_or_takes_no_more_than_its_budget(
    m: float, k: float, k0: float, c: float, zeta: float, f20: float, b: float, omega: float
) -> None:
    refused, model = "", None
    try:
        model = Dimensionless(m=m, k=k, k0=k0, c=c, zeta=zeta, f20=f20, b=b)
    except InputError as error:
        refused = error.field
    if model is None:
        assert refused.startswith("model.")
        return
    with np.errstate(all="ignore"):
        made = Flow(model.second_order().piecewise_linear(), Drive(omega))
        budget = Budget(ENOUGH)
        orbit = settle(made, np.zeros(4), budget=budget)
    # A fast path looks at the budget once in so many steps.
    assert budget.spent <= ENOUGH + flow.SLICE
    assert orbit.status in ANSWERS or orbit.reason


def test_settling_that_is_cut_short_says_after_how_many_periods() -> None:
    stiff = Dimensionless(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=1e4, f20=0.0, b=0.25)
    made = Flow(stiff.second_order().piecewise_linear(), Drive(0.85), fast=False)
    rate = np.abs(np.linalg.eigvals(stiff.second_order().state_matrix())).max()
    assert made.steps_a_period >= rate * made.drive.period
    budget = Budget(5.5 * made.steps_a_period)
    orbit = settle(made, np.zeros(4), budget=budget)
    assert (str(orbit.status), orbit.periods) == ("not settled", 5)
    assert "no period was found in 5 drive periods" in orbit.reason
    assert budget.left <= 0.0
    with made.within(Budget(0.0)):
        assert made.run(np.zeros(4), 1).status is FlowStatus.TOO_LONG
    assert made.run(np.zeros(4), 1).status is FlowStatus.DONE


@pytest.mark.parametrize("omega", [1e-3, 1e3])
def test_a_single_period_without_end_is_cut_short(omega: float) -> None:
    """A mass of 1e-9 takes 200 million steps to a drive period of ω = 1e-3: the fast paths, which
    stop at strobes alone, took minutes of it."""
    light = Dimensionless(m=1e-9, k=0.5, k0=0.5, c=0.5, zeta=0.1, f20=0.0, b=0.25)
    made = Flow(light.second_order().piecewise_linear(), Drive(omega))
    budget = Budget(ENOUGH)
    orbit = settle(made, np.zeros(4), budget=budget)
    assert str(orbit.status) == "not settled"
    assert "the fastest motion of the model" in orbit.reason
    assert budget.spent <= ENOUGH + flow.SLICE
    if omega < 1.0:
        assert made.steps_a_period * flow.FAST_STEP > flow.SLICE
        assert orbit.periods == 0


def test_all_starts_together_have_a_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(step_budget, "STARTS", 3000)
    made = Flow(PAPER.second_order().piecewise_linear(), Drive(0.85))
    met = coexistence.of_flow(made, np.ones(4), 50, 1)
    assert 0 < met.starts < met.wanted_starts == 50
    assert met.starts == sum(b.count for b in met.basins) + met.not_settled
    count = [0]

    def states() -> object:
        for x in coexistence.random_starts(np.ones(4), 50, 1):
            count[0] += 1
            yield x

    coexisting(made, states())  # type: ignore[arg-type]
    assert 0 < count[0] < 50


@pytest.mark.parametrize(
    ("key", "value"),
    [("zeta", "1e300"), ("m", "1e-300"), ("k", "1e-300"), ("c", "0.9999999999999999")],
)
def test_what_cannot_be_run_is_refused_by_name(key: str, value: str) -> None:
    lines = PAPER_TABLE.splitlines()
    text = "\n".join(f"{key} = {value}" if x.split(" =")[0] == key else x for x in lines)
    with pytest.raises(InputError) as caught:
        parse_model_file("format = 1\n" + text, Path("odd.toml"))
    assert (caught.value.file, caught.value.field) == ("odd.toml", f"model.{key}")
    assert str(float(value)) in str(caught.value) or value in str(caught.value)
    assert "expected a number from" in str(caught.value)


def test_simulate_ends_with_the_reason(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(step_budget, "SETTLING", 100_000)
    monkeypatch.setattr(step_budget, "STARTS", 100_000)
    path = tmp_path / "model.toml"
    text = PAPER_TABLE.replace("zeta = 0.1", "zeta = 1e6")
    assert text != PAPER_TABLE
    path.write_text("format = 1\n" + text, encoding="utf-8")
    assert entry.status(["simulate", str(path), "--omega", "0.85", "--json", "-q"]) == 1
    (row,) = json.loads(capfd.readouterr().out)["responses"]
    assert row["status"] == "not settled"
    assert "steps to a drive period" in row["reason"]
    assert row["starts"]["count"] < row["starts"]["asked"] == 200


def test_a_budget_begins_with_nothing_spent() -> None:
    budget = Budget(10.0)
    budget.take(4.0)
    budget.take(7.0)
    assert (budget.left, budget.spent) == (-1.0, 11.0)
