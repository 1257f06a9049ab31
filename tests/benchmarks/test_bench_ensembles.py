"""The race over many boards: the competitors carry the boards that ours settles, and the report has
what was measured. heyoka is no dependency: Runge-Kutta is held to the exact flow here."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import bench_ensembles
from benchmarks.bench_tolerance import plan_of
from benchmarks.ensembles import runge_kutta
from designer.circuit.ensemble import Ensemble
from designer.verdicts.verdict import Question, StudyPlan


@pytest.mark.slow
def test_a_quick_look(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench_ensembles, "ROUNDS", 1)
    plan = plan_of("paper", 1)
    row = bench_ensembles.measure(plan, plan.questions[0], count=3, rivals=3)
    assert row.p == 1
    assert 20 < row.periods < 140
    speed, error = row.rivals[bench_ensembles.RUNGE_KUTTA]
    assert error < 1e-3  # of some volts, at the paper's step
    same, needed = row.over(bench_ensembles.RUNGE_KUTTA)
    assert needed / same == pytest.approx(row.needed / row.periods)
    text = bench_ensembles.report([row], 1.0)
    assert f"{speed:,.0f}, {error:.0e}" in text
    _half_a_step_is_a_fraction_of_the_error(plan, plan.questions[0])


def _half_a_step_is_a_fraction_of_the_error(plan: StudyPlan, question: Question) -> None:
    boards, drive = Ensemble(plan.boards(range(2))), question.excitation.drive
    numbers = bench_ensembles.numbers_of(boards, drive, 2)
    starts = np.tile(question.start.start, (2, 1))
    exact = [run.strobes[-1] for run in boards.run((0, 1), [drive] * 2, starts, 1) if run]
    errors = [
        np.abs(runge_kutta(numbers, starts, 1, steps) - exact).max() for steps in (800, 25_600)
    ]
    assert errors[1] < 1e-2 * errors[0]
