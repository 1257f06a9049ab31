"""The exact circuit of a study: waveform errors against an independent integration, twins,
bytes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from designer.base.arrays import Array
from designer.circuit.board_values import nominal_board
from designer.circuit.ensemble import Ensemble, displacement
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import OrbitStatus, failed
from designer.dynamics.piecewise_linear import Drive, PiecewiseLinearSystem
from designer.kernels.kernel_boards import POINTS
from designer.model.response_table import Response
from designer.spread.spread import draw, draw_many
from designer.verdicts import exact_circuit
from designer.verdicts.verdict import Question, Verdict
from tests.circuit.test_ensemble import FEW, STAGES, nominal
from tests.verdicts.test_verdict import plan


def integrated(system: PiecewiseLinearSystem, drive: Drive, x: Array, periods: int) -> Array:
    """(periods · POINTS,) the first state by DOP853, which knows nothing of modes or events."""
    key = system.start

    def rate(t: float, state: Array) -> Array:
        nonlocal key
        u = drive.amplitude * np.sin(drive.omega * t) + drive.offset
        key = system.mode_at(state, u, key)
        mode = system.mode(key)
        return np.asarray(mode.A @ state + mode.B * u + mode.d)

    times = np.arange(periods * POINTS) * drive.period / POINTS
    run = solve_ivp(
        rate, (0.0, times[-1]), x, "DOP853", times, rtol=1e-8, atol=1e-9, max_step=drive.period / 40
    )
    return np.asarray(run.y[0])


@pytest.mark.parametrize("kind", sorted(STAGES))
def test_waveform_error_is_that_of_an_independent_integration(kind: str) -> None:
    circuit = STAGES[kind]
    drive, orbit = nominal(kind, 2)
    system = Reduction(circuit, nominal_board(circuit)).system()
    wanted = integrated(system, drive, orbit.start, 1)
    (found,) = Ensemble(draw_many(circuit, FEW[kind], 7, range(3, 4))).respond(
        [0], [drive], orbit.start[None, :]
    )
    board = Reduction(circuit, draw(circuit, FEW[kind], 7, 3)).system()
    shown = integrated(board, drive, found.orbit.start, 1)
    truth = float(np.sqrt(np.mean((shown - wanted) ** 2)) / np.abs(wanted).max())
    nominal_trace = displacement(Flow(system, drive), orbit)
    got = exact_circuit.waveform_error(found.trace, exact_circuit.images(nominal_trace))
    assert truth > 1e-3, "the test wants a difference"
    assert got == pytest.approx(truth, rel=1e-4)


def test_waveform_error_forgives_whole_periods_and_the_twin() -> None:
    t = np.arange(3 * POINTS) / POINTS
    wanted = np.sin(2 * np.pi * t) + 0.3 * np.cos(2 * np.pi * t / 3) + 0.1
    peak = float(np.abs(wanted).max())
    plain, both = exact_circuit.images(wanted), exact_circuit.images(wanted, mirror=True)
    assert exact_circuit.waveform_error(np.roll(wanted, 2 * POINTS), plain) == pytest.approx(
        0.0, abs=1e-12
    )
    assert exact_circuit.waveform_error(wanted + 0.01, plain) == pytest.approx(0.01 / peak)
    # The twin: mirrored, and half a drive period on.
    twin = -np.roll(wanted, POINTS // 2)
    assert exact_circuit.waveform_error(twin, plain) > 0.1
    assert exact_circuit.waveform_error(twin, both) == pytest.approx(0.0, abs=1e-12)
    assert exact_circuit.waveform_error(np.roll(twin, POINTS), both) < 1e-12
    assert np.isnan(exact_circuit.waveform_error(wanted[:POINTS], plain))


@pytest.mark.slow
def test_answers_do_not_depend_on_the_block() -> None:
    p = replace(plan(), samples=60)
    whole = exact_circuit.block(p, range(60), 2)
    parts = [
        a
        for first, last in ((0, 1), (1, 37), (37, 60))
        for a in exact_circuit.block(p, range(first, last), 1)
    ]
    assert [repr(a) for a in whole] == [repr(a) for a in parts]
    assert any(np.isfinite(a.waveform) for a in whole)


def test_boards_with_bandwidth_are_judged_as_each_alone() -> None:
    """From the nominal orbit without bandwidth; the verdict by the same rule."""
    asked = plan(2)
    answers = exact_circuit.block(replace(asked, bandwidth=True), range(2), 1)
    without = exact_circuit.block(asked, range(2), 1)
    for answer in answers:
        board = draw(asked.circuit, asked.spread, asked.seed, answer.sample)
        system = Reduction(asked.circuit, board, bandwidth=True).system()
        drive = asked.questions[answer.question].excitation.drive
        orbit = settle(Flow(system, drive), asked.questions[answer.question].start.start)
        assert answer.response == orbit.response
        assert answer.verdict is asked.questions[answer.question].judge(orbit)[0]
        assert answer.radius == pytest.approx(orbit.radius, abs=1e-8)
    assert all(a.radius != b.radius for a, b in zip(answers, without, strict=True))


@pytest.mark.parametrize(("within", "shown"), [(None, Verdict.LOST), (9, Verdict.FAILED)])
def test_an_exponent_that_does_not_tell_is_measured_longer_unless_periods_are_counted(
    monkeypatch: pytest.MonkeyPatch, within: int | None, shown: Verdict
) -> None:
    """At least 0.2 is wanted. 0.18 ± 0.05 may be that, 0.18 ± 0.001 is not."""
    asked = plan().questions[0]
    spec = Response(1.55, OrbitStatus.APERIODIC, least_exponent=0.2)
    seconds = asked.excitation.seconds(1.55)
    rough = replace(failed(""), status=OrbitStatus.APERIODIC, lyapunov=0.18 / seconds)
    rough = replace(rough, lyapunov_error=0.05 / seconds)
    fine = replace(rough, lyapunov_error=0.001 / seconds)
    ensemble = Ensemble(draw_many(plan().circuit, plan().spread, 1, range(1)))
    monkeypatch.setattr(ensemble, "settle", lambda *_, **__: [rough])
    monkeypatch.setattr(exact_circuit, "with_exponent", lambda *_: fine)
    question = Question(
        spec, asked.excitation, replace(asked.start, status=OrbitStatus.APERIODIC), None
    )
    case = (0, question, asked.excitation, asked.start.start)
    ((_, verdict, _),) = exact_circuit.settled(ensemble, [case], within=within)
    assert verdict is shown


def test_what_ngspice_is_given_is_the_board_of_the_answer() -> None:
    """Of samples that do not begin with the first: each is the reduction of its own draw."""
    p = plan()
    pairs = exact_circuit.subjects(p, range(3, 5), 1)
    assert [(answer.sample, answer.question) for answer, _ in pairs] == [
        (3, 0), (3, 1), (4, 0), (4, 1)
    ]  # fmt: skip
    for answer, subject in pairs:
        assert subject is not None
        alone = Reduction(p.circuit, draw(p.circuit, p.spread, p.seed, answer.sample)).system()
        shown = subject.system.mode(subject.system.start)
        np.testing.assert_allclose(shown.A, alone.mode(alone.start).A, rtol=1e-12)
        assert subject.excitation == p.questions[answer.question].excitation
        assert subject.orbit.response == answer.response
