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
from designer.model.model import Dimensionless, SiScales
from designer.model.response_table import HertzResponse, Response, placed
from designer.spice.deck import SolverSettings
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


def chaotic(exponent: float, error: float) -> Orbit:
    return Orbit(OrbitStatus.APERIODIC, lyapunov=exponent, lyapunov_error=error)


def without_period(status: OrbitStatus, least: float | None = None) -> Response:
    return Response(omega=1.0, expect=status, least_exponent=least)


TORUS = Orbit(OrbitStatus.QUASI_PERIODIC, lyapunov=0.0, lyapunov_error=1e-4)
CHAOS = without_period(OrbitStatus.APERIODIC)


def test_ngspice_has_the_op_amps_of_the_boards_and_its_steps_fill_a_period() -> None:
    of = plan()
    assert of.fidelity == "ideal"
    assert replace(of, bandwidth=True).fidelity == "dynamic"
    settings = SolverSettings("gear", 1.0 / (500.0 * of.questions[0].excitation.frequency))
    assert replace(of.questions[0], settings=settings).steps == pytest.approx(500.0)


def test_a_drive_frequency_for_people_is_in_hertz_where_the_model_is() -> None:
    assert HertzResponse(72.0 * math.pi).place_text() == "36 Hz"
    assert Response(0.85).place_text() == "ω = 0.85"


@pytest.mark.parametrize(
    ("orbit", "spec", "verdict"),
    [
        (chaotic(0.1, 0.01), CHAOS, Verdict.OK),
        (periodic(3, 0, 0), CHAOS, Verdict.LOST),
        (TORUS, CHAOS, Verdict.LOST),
        (TORUS, without_period(OrbitStatus.QUASI_PERIODIC), Verdict.OK),
        (chaotic(0.1, 0.01), without_period(OrbitStatus.QUASI_PERIODIC), Verdict.LOST),
        (chaotic(0.1, 0.01), wanted("1-1-1"), Verdict.LOST),
        (Orbit(OrbitStatus.GRAZING, n=2), CHAOS, Verdict.LOST),
        (Orbit(OrbitStatus.NOT_SETTLED), CHAOS, Verdict.FAILED),
        # 4 standard errors decide: 0.1 against 0.05, 0.07 and 0.15 with an error of 0.01.
        (chaotic(0.1, 0.01), without_period(OrbitStatus.APERIODIC, 0.05), Verdict.OK),
        (chaotic(0.1, 0.01), without_period(OrbitStatus.APERIODIC, 0.07), Verdict.FAILED),
        (chaotic(0.1, 0.01), without_period(OrbitStatus.APERIODIC, 0.15), Verdict.LOST),
    ],
)
def test_what_survives_without_a_period(orbit: Orbit, spec: Response, verdict: Verdict) -> None:
    assert judge(orbit, spec, chaotic(0.1, 0.01))[0] is verdict


def test_an_exponent_counts_in_the_models_time() -> None:
    """A unit of the model's time is 2 ms on this board: 50 per second is 0.1 of the model."""
    spec = without_period(OrbitStatus.APERIODIC, 0.09)
    question = Question(
        spec, Excitation(1.0 / (2.0 * math.pi * 2e-3), 1.0), chaotic(50.0, 0.5), None
    )
    assert question.judge(chaotic(50.0, 0.5))[0] is Verdict.OK
    assert question.judge(chaotic(40.0, 0.5))[0] is Verdict.LOST
    assert question.steps == 0.0, "ngspice has no settings here and is not asked"


def test_without_an_expectation_the_nominal_motion_without_a_period_is_wanted() -> None:
    nominal = chaotic(0.1, 0.01)
    assert judge(chaotic(0.2, 0.01), wanted(None), nominal)[0] is Verdict.OK
    assert judge(periodic(1, 1, 1), wanted(None), nominal)[0] is Verdict.LOST


def test_a_response_at_another_place_keeps_its_key_and_its_unit() -> None:
    table = {"omega": 0.85, "expect": "1-2-2"}
    assert placed(table, 1.2, 0.3, None) == {"omega": 1.2, "expect": "1-2-2", "b": 0.3}
    assert placed(table, None, None, None) == table
    assert placed({"expect": "1-2-2"}, 1.2, None, None) == {"expect": "1-2-2", "omega": 1.2}
    turns = 7.0 / (2.0 * math.pi)
    assert placed({"Omega": 3.0}, 7.0, None, SiScales()) == {"Omega": pytest.approx(7.0)}
    text = placed({"frequency": "3 Hz"}, 7.0, None, SiScales())["frequency"]
    assert float(text.removesuffix(" Hz")) == pytest.approx(turns)


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
    if orbit.status is OrbitStatus.PERIODIC:
        named = spec.completed(NOMINAL).accepts_text(
            orbit.response, symmetric=orbit.symmetric is True
        )
        assert named is (verdict is Verdict.OK)


def test_a_status_in_words_survives_where_it_is_wanted() -> None:
    assert CHAOS.accepts_text("aperiodic", symmetric=False)
    assert not CHAOS.accepts_text("quasi-periodic", symmetric=False)
    assert not wanted("1-1-1").accepts_text("aperiodic", symmetric=True)


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


# A small study on the exact circuit.


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
