"""Verdicts and blocks of boards: the logic of the study by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from designer.circuit.board_values import nominal_board
from designer.circuit.coefficients import coefficient_errors
from designer.circuit.netlist import Excitation
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.counts import Counts
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.model.model import Dimensionless
from designer.model.response_table import Response
from designer.spread.spread import Spread
from designer.verdicts.verdict import BLOCK, Question, StudyPlan, Verdict, judge
from tests.circuit.test_coefficients import exact_for_paper
from tests.circuit.test_reduction import circuit_of

PAPER = Dimensionless(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25)


def periodic(n: int, p: int, q: int, asymmetry: float = 0.0) -> Orbit:
    return Orbit(OrbitStatus.PERIODIC, n=n, p=p, q=q, asymmetry=asymmetry)


def wanted(text: str | None, **more: object) -> Response:
    expect = None if text is None else Counts.parse(text)
    return Response(omega=1.0, expect=expect, **more)  # type: ignore[arg-type]


def nothing() -> None:
    return None


NOMINAL = periodic(1, 1, 2, 0.3)


@pytest.mark.parametrize(
    ("orbit", "spec", "verdict"),
    [
        (periodic(1, 2, 2), wanted("1-2-2"), Verdict.OK),
        (periodic(1, 1, 2), wanted("1-1-2"), Verdict.OK),
        (periodic(1, 2, 1), wanted("1-1-2"), Verdict.OK),
        (periodic(1, 2, 1), wanted("1-1-2", twin="exact"), Verdict.LOST),
        (periodic(1, 1, 2), wanted("1-1-2", twin="exact"), Verdict.OK),
        (periodic(2, 2, 2), wanted("1-1-1"), Verdict.LOST),
        (periodic(1, 1, 1), wanted("1-2-2"), Verdict.LOST),
        (periodic(1, 1, 1, 0.2), wanted("1-1-1"), Verdict.OK),
        (periodic(1, 1, 1, 0.2), wanted("1-1-1", symmetric=True), Verdict.LOST),
        (periodic(1, 1, 1, 1e-4), wanted("1-1-1", symmetric=True), Verdict.OK),
        (periodic(1, 1, 1, 1e-4), wanted("1-1-1", symmetric=False), Verdict.OK),
        (periodic(1, 1, 2), wanted(None), Verdict.OK),
        (periodic(1, 2, 1), wanted(None), Verdict.OK),
        (periodic(1, 2, 2), wanted(None), Verdict.LOST),
        (Orbit(OrbitStatus.APERIODIC), wanted("1-1-1"), Verdict.LOST),
        (Orbit(OrbitStatus.CLIPPED, n=1, p=1, q=1), wanted("1-1-1"), Verdict.LOST),
        (Orbit(OrbitStatus.GRAZING, n=1, p=1, q=1), wanted("1-1-1"), Verdict.GRAZING),
        (Orbit(OrbitStatus.NOT_SETTLED), wanted("1-1-1"), Verdict.FAILED),
        (Orbit(OrbitStatus.DIVERGED), wanted("1-1-1"), Verdict.LOST),
        (periodic(22, 44, 44), wanted("1-2-2"), Verdict.LOST),
        (Orbit(OrbitStatus.FAILED, reason="why"), wanted("1-1-1"), Verdict.FAILED),
    ],
)
def test_verdicts(orbit: Orbit, spec: Response, verdict: Verdict) -> None:
    got, reason = judge(orbit, spec, NOMINAL)
    assert got is verdict
    if verdict in (Verdict.LOST, Verdict.FAILED):
        assert reason


def test_lost_says_to_what() -> None:
    assert judge(periodic(3, 4, 4), wanted("1-1-1"), NOMINAL)[1] == "to 3-4-4"
    clipped = Orbit(OrbitStatus.CLIPPED, n=1, p=1, q=1)
    assert judge(clipped, wanted("1-1-1"), NOMINAL)[1] == "clipped"
    assert judge(Orbit(OrbitStatus.DIVERGED), wanted("1-1-1"), NOMINAL)[1] == "diverged"
    assert judge(periodic(22, 44, 46), wanted("1-2-2"), NOMINAL)[1] == "to 22-44-46"


def test_symmetry_of_even_periods() -> None:
    assert periodic(2, 2, 2, math.nan).symmetric is False
    assert judge(periodic(2, 2, 2, math.nan), wanted("2-2-2", symmetric=True), NOMINAL)[0] is (
        Verdict.LOST
    )


# A small study on the exact rung.


@cache
def plan(samples: int = 30) -> StudyPlan:
    circuit = circuit_of(exact_for_paper())
    errors = coefficient_errors(circuit, PAPER.second_order())
    system = Reduction(circuit, nominal_board(circuit)).system()
    questions = []
    for omega, expect in ((1.55, "1-1-1"), (0.85, "1-2-2")):
        model = Flow(PAPER.second_order().piecewise_linear(), Drive(omega))
        orbit = settle(model, np.zeros(4))
        volts = 1.0 / errors.drive_gain[0]
        excitation = Excitation(errors.scales.frequency(omega), volts)
        drive = Drive(2 * np.pi * excitation.frequency, -volts)
        start = settle(Flow(system, drive), orbit.start * errors.scales.volts)
        assert start.response == expect, (omega, start.response)
        questions.append(Question(replace(wanted(expect), omega=omega), excitation, start, None))
    return StudyPlan(circuit, Spread(0.01, 0.01, 1e-3, 4e-3), 11, samples, tuple(questions))


@pytest.mark.parametrize("samples", [1, BLOCK - 1, BLOCK, BLOCK + 1, 2 * BLOCK, 3 * BLOCK - 2])
def test_blocks_cover_every_sample_once(samples: int) -> None:
    blocks = list(replace(plan(), samples=samples).blocks())
    assert [i for block in blocks for i in block] == list(range(samples))
    assert all(block.start % BLOCK == 0 for block in blocks)
