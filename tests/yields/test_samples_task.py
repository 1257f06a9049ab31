"""The layer of exact answers: the same on any number of threads, and board by board."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from designer.circuit.netlist import Resistor
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.spread.spread import draw
from designer.verdicts.verdict import Verdict, judge
from designer.yields.layers import samples_task
from tests.verdicts.test_verdict import nothing, plan


@pytest.mark.slow
def test_jobs_do_not_change_the_answers() -> None:
    one = [a for block in plan().blocks() for a in samples_task(plan(), block)(1, nothing)]
    two = [a for block in plan().blocks() for a in samples_task(plan(), block)(2, nothing)]
    assert [repr(a) for a in one] == [repr(a) for a in two]
    assert [(a.sample, a.question) for a in one] == [(i, q) for i in range(30) for q in range(2)]
    longer = samples_task(replace(plan(), samples=60), range(25))(2, nothing)
    assert [repr(a) for a in longer] == [repr(a) for a in one[:50]]


def test_answers_are_those_of_the_boards_one_by_one() -> None:
    p = plan()
    answers = samples_task(p, range(5, 9))(2, nothing)
    for a in answers:
        question = p.questions[a.question]
        board = draw(p.circuit, p.spread, p.seed, a.sample)
        flow = Flow(
            Reduction(p.circuit, board).system(),
            Drive(2 * np.pi * question.excitation.frequency, -question.excitation.amplitude),
        )
        orbit = settle(flow, question.start.start)
        assert a.response == orbit.response
        assert a.verdict is judge(orbit, question.spec, question.start)[0]
        # Independently of settling: a long plain run ends on the same strobe and counts.
        if orbit.status is OrbitStatus.PERIODIC:
            run = flow.run(question.start.start, 600)
            lap = run.counts[-orbit.n :].sum(axis=(0, 1))
            assert lap.tolist() == [orbit.q, orbit.p]


def test_progress_is_called_once_an_answer() -> None:
    calls: list[int] = []
    answers = samples_task(plan(), range(4))(2, lambda: calls.append(1))
    assert len(calls) == len(answers) == 8


def test_a_board_that_cannot_be_reduced_is_failed_with_its_reason() -> None:
    p = plan()
    broken = replace(p.circuit, parts=(*p.circuit.parts, Resistor("R999", "e1", "e2", 1e3, "")))
    answers = samples_task(replace(p, circuit=broken), range(2))(1, nothing)
    assert {a.verdict for a in answers} <= {Verdict.FAILED}
    assert all(a.reason for a in answers)
