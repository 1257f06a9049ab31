"""A study of boards whose op-amps lag, against each board reduced and settled by itself."""

from __future__ import annotations

from dataclasses import replace

import pytest

from designer.base.errors import InputError
from designer.circuit.board_values import nominal_board
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import OrbitStatus
from designer.spread.spread import draw
from designer.verdicts import exact_circuit
from designer.yields.study_identity import study_hash
from designer.yields.tolerance_study import lagging_plan
from tests.shared.bench_plans import plan


def test_boards_with_bandwidth_start_on_its_nominal_orbit_and_are_judged_alone() -> None:
    without = plan(2)
    asked, left, gone = lagging_plan(without, None)
    assert (left, gone) == ((0,), {})
    (question,) = asked.questions
    drive = question.excitation.drive
    nominal = Reduction(asked.circuit, nominal_board(asked.circuit), bandwidth=True).system()
    run = Flow(nominal, drive, fast=False).run(question.start.start, question.start.n)
    assert run.strobes[-1] == pytest.approx(question.start.start, abs=1e-9)
    moved = question.start.start - without.questions[0].start.start
    assert max(abs(moved)) > 1e-3  # volts: bandwidth is in it

    for answer in exact_circuit.block(asked, range(3), 1):
        board = draw(asked.circuit, asked.spread, asked.seed, answer.sample)
        system = Reduction(asked.circuit, board, bandwidth=True).system()
        orbit = settle(Flow(system, drive), question.start.start)
        assert answer.response == orbit.response
        assert answer.verdict is question.judge(orbit)[0]
        assert answer.radius == pytest.approx(orbit.radius, abs=1e-8)
        assert answer.waveform < 0.2  # of the nominal orbit with bandwidth


def test_its_rows_are_not_taken_for_those_of_another_study() -> None:
    without = plan(2)
    assert study_hash(replace(without, bandwidth=True)) != study_hash(without)


@pytest.mark.slow
def test_what_the_nominal_circuit_with_bandwidth_does_not_show_is_left_out_by_name() -> None:
    """Op-amps of 10 kHz: at p = 2 the lag leaves no period, at p = 5 another response."""
    p = plan(2, 5)
    figures = p.circuit.figures
    assert figures is not None
    slow = replace(figures, gbw=replace(figures.gbw, min=None, typ=1e4))
    asked, left, gone = lagging_plan(replace(p, circuit=replace(p.circuit, figures=slow)), None)
    system = Reduction(asked.circuit, nominal_board(asked.circuit), bandwidth=True).system()
    for k, q in enumerate(p.questions):
        orbit = settle(Flow(system, q.excitation.drive), q.start.start)
        assert (k in left) is (orbit.status is OrbitStatus.PERIODIC)
        if k in gone:
            assert gone[k] == f"the nominal circuit with bandwidth is {orbit.response}"
    assert (left, list(gone)) == ((1,), [0])


def test_an_op_amp_without_figures_is_refused() -> None:
    p = plan(2)
    with pytest.raises(InputError, match="--rung"):
        lagging_plan(replace(p, circuit=replace(p.circuit, figures=None)), None)
