"""From discharged capacitors at any phase: against another integrator, another start, ngspice."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from designer.base.arrays import Array
from designer.circuit.board_arrays import Boards
from designer.circuit.board_values import nominal_board
from designer.circuit.ensemble import Ensemble
from designer.circuit.netlist import Excitation
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive, PiecewiseLinearSystem
from designer.spice import deck
from designer.spice.deck import SolverSettings
from designer.spice.worker import open_simulator
from designer.spread.spread import draw
from designer.verdicts.exact_circuit import Case, settled
from designer.yields.power_up import follow, switched_on, until_strobe
from designer.yields.start_recipe_search import candidates, phase
from tests.shared import bench_plans
from tests.shared.bench_plans import SPREAD
from tests.shared.paper_cases import subject


def plainly(system: PiecewiseLinearSystem, drive: Drive, phase: float, until: float) -> Array:
    """The state after ``until`` [s] from zero, by an explicit method that knows no boundaries."""

    def u(t: float) -> float:
        return drive.amplitude * math.sin(drive.omega * t + phase) + drive.offset

    def rate(t: float, x: Array) -> Array:
        mode = system.mode(system.mode_at(x, u(t)))
        return mode.A @ x + mode.B * u(t) + mode.d

    steps = drive.period / 2000
    found = solve_ivp(
        rate, (0.0, until), np.zeros(system.size), method="DOP853",
        rtol=1e-10, atol=1e-13, max_step=steps,
    )  # fmt: skip
    return np.asarray(found.y[:, -1])


@pytest.mark.parametrize("phase", [2.0, 4.5])
def test_the_first_strobe_is_that_of_another_integrator(phase: float) -> None:
    board = draw(subject(2).circuit, SPREAD, 1, 0)
    system = Reduction(subject(2).circuit, board).system()
    e = subject(2).excitation
    drive = Excitation(e.frequency, 3.0 * e.amplitude, 0.1 * e.amplitude).drive
    met = until_strobe(Flow(system, drive, fast=False), phase)
    assert met is not None
    state, _, clipped = met
    left = (1.0 - phase / (2.0 * math.pi)) * drive.period
    wanted = plainly(system, drive, phase, left)
    assert not clipped
    np.testing.assert_allclose(state, wanted, atol=1e-6 * np.abs(wanted).max())


def test_at_phase_zero_it_is_the_flow_itself() -> None:
    system = subject(3).system
    drive = subject(3).excitation.drive
    met = until_strobe(Flow(system, drive, fast=False), 0.0)
    assert met is not None
    wanted = Flow(system, drive).run(np.zeros(4), 1).strobes[-1]
    np.testing.assert_allclose(met[0], wanted, rtol=1e-10)


def test_half_a_period_later_is_the_mirror_image() -> None:
    """The board with ideal op-amps is mirror symmetric."""
    system = Reduction(subject(3).circuit, nominal_board(subject(3).circuit, ideal=True)).system()
    assert system.mirror is not None
    drive = subject(3).excitation.drive
    one = follow(system, [(drive, 50)], [1.0, 1.0 + math.pi])
    assert one[0] is not None
    assert one[1] is not None
    # Half a period after a strobe of one, the other stands at its image, as the signs of sin are.
    image = -Flow(system, drive).run(one[0].state, 1, points=2).strobes[1]
    peak = np.abs(image).max()
    assert np.abs(one[1].state - image).max() < 1e-6 * peak


def test_clipping_on_the_way_is_noticed() -> None:
    """Four hundred times the drive: the integrators reach their limits."""
    system = subject(1).system
    e = subject(1).excitation
    loud = Excitation(e.frequency, 400.0 * e.amplitude).drive
    (met,) = follow(system, [(loud, 5)], [1.0])
    assert met is not None
    assert met.clipped
    (quiet,) = follow(system, [(e.drive, 5)], [1.0])
    assert quiet is not None
    assert not quiet.clipped
    assert quiet.periods == 6


def test_a_staircase_is_continuous() -> None:
    """Two stages of one setting are one; and stages follow each other at phase 0."""
    system, drive = subject(2).system, subject(2).excitation.drive
    other = Drive(1.05 * drive.omega, drive.amplitude)
    (one,) = follow(system, [(drive, 30)], [2.0])
    (two,) = follow(system, [(drive, 10), (drive, 20)], [2.0])
    assert one is not None
    assert two is not None
    np.testing.assert_allclose(one.state, two.state, rtol=1e-9)
    (three,) = follow(system, [(drive, 30), (other, 7)], [2.0])
    assert three is not None
    wanted = Flow(system, other).run(one.state, 7).strobes[-1]
    np.testing.assert_allclose(three.state, wanted, rtol=1e-12)


@pytest.mark.parametrize(
    ("sample", "degrees"), [(None, 100.0), (None, 10.0), (0, 200.0), (1, 310.0)]
)
def test_ngspice_ends_where_the_exact_circuit_does(sample: int | None, degrees: float) -> None:
    """From zero with ``uic`` and the same phase, 60 periods at ω = 1.55, where 1-1-1 and 3-3-3
    coexist: the last strobes are the same within 2 % of the peak, on the nominal board and on
    others."""
    known = subject(1)
    board = known.board if sample is None else draw(known.circuit, SPREAD, 1, sample)
    system = Reduction(known.circuit, board).system()
    e = known.excitation
    periods = 60
    settings = SolverSettings("trap", 1.0 / e.frequency / 400)
    text = deck.write(
        known.circuit, board, e, settings, title="power-up", stop_time=(periods + 1) / e.frequency
    )
    turned = text.replace(" 0 0 180)", f" 0 0 {180.0 + degrees!r})")
    assert turned != text
    nets = known.circuit.state_nets
    waves = open_simulator("shared").run(turned, nets, (periods + 1) / e.frequency)
    phase = math.radians(degrees)
    met = until_strobe(Flow(system, e.drive, fast=False), phase)
    assert met is not None
    run = Flow(system, e.drive).run(met[0], periods)
    first = (1.0 - degrees / 360.0) / e.frequency
    times = first + np.arange(periods) / e.frequency
    heard = np.interp(times, waves.axis, waves.signals["v1"])
    rest = board.offset["U1A"]  # v1 is the capacitor's voltage and that of the summing node
    exact = run.strobes[:periods, 0] + rest
    peak = np.abs(heard).max()
    assert np.abs(heard[-6:] - exact[-6:]).max() < 0.02 * peak
    orbit = settle(Flow(system, e.drive), run.strobes[-1])
    n = orbit.n
    assert n in (1, 3)
    again = np.abs(heard[-6:] - heard[-6 - n : -n]).max()
    assert again < 0.02 * peak
    if n == 3:
        assert np.abs(heard[-6:] - heard[-7:-1]).max() > 0.1 * peak


def test_ngspice_and_the_exact_circuit_agree_on_a_dc_offset() -> None:
    """The generator's offset has the same sign and weight in both: the centre of v1 moves alike."""
    known = subject(1)
    e = known.excitation
    moved = Excitation(e.frequency, e.amplitude, 0.2 * e.amplitude)
    flow = Flow(known.system, moved.drive)
    orbit = settle(flow, known.orbit.start)
    wanted = flow.run(orbit.start, orbit.n, points=256).strobes[:, 0]
    settings = SolverSettings("trap", 1.0 / e.frequency / 400)
    periods = 20
    text = deck.write(
        known.circuit, known.board, moved, settings,
        title="offset", stop_time=periods / e.frequency, initial=orbit.start,
    )  # fmt: skip
    waves = open_simulator("shared").run(text, ("v1",), periods / e.frequency)
    late = waves.axis > (periods - 3) / e.frequency
    heard = waves.signals["v1"][late]
    centre = 0.5 * (wanted.max() + wanted.min())
    swing = wanted.max() - wanted.min()
    assert abs(centre) > 0.02 * swing
    assert 0.5 * (heard.max() + heard.min()) == pytest.approx(centre, abs=0.004 * swing)


@pytest.mark.parametrize("sample", [0, 3])
def test_the_compiled_way_through_a_sweep_is_the_plain_one(sample: int) -> None:
    board = draw(subject(2).circuit, SPREAD, 1, sample)
    ensemble = Ensemble(Boards.of(subject(2).circuit, [board]))
    system, e = Reduction(subject(2).circuit, board).system(), subject(2).excitation
    drives = [Excitation(e.frequency * (1.0 + 0.02 * k), e.amplitude).drive for k in (3, 2, 1, 0)]
    stages = [(drive, 15) for drive in drives] + [(drives[-1], 60)]
    phases = [0.4, 2.0, 4.5]
    plain = follow(system, stages, phases)
    fast = follow(system, stages, phases, partial(ensemble.swept, 0))
    assert ensemble.swept(0, stages, np.zeros((1, system.size)))[1].all()
    for one, two in zip(plain, fast, strict=True):
        assert one is not None
        assert two is not None
        np.testing.assert_allclose(two.state, one.state, atol=1e-9 * np.abs(one.state).max())
        assert two[1:] == one[1:]


def test_a_board_that_clips_on_the_way_is_followed_all_the_same() -> None:
    board = draw(subject(2).circuit, SPREAD, 1, 0)
    ensemble = Ensemble(Boards.of(subject(2).circuit, [board]))
    system, e = Reduction(subject(2).circuit, board).system(), subject(2).excitation
    loud = [(Excitation(e.frequency, 400.0 * e.amplitude).drive, 5), (e.drive, 5)]
    assert not ensemble.swept(0, loud, np.zeros((1, system.size)))[1].any()
    (one,) = follow(system, loud, [1.0])
    (two,) = follow(system, loud, [1.0], partial(ensemble.swept, 0))
    assert one is not None
    assert two is not None
    assert one.clipped
    # The second stage, in which nothing clips, goes the compiled way.
    np.testing.assert_allclose(two.state, one.state, atol=1e-9 * np.abs(one.state).max())
    assert two[1:] == one[1:]


def test_a_start_that_has_come_to_its_orbit_need_not_wait() -> None:
    """At ω = 1.55, where 1-1-1 and 3-3-3 coexist: each start ends as it does after all of the
    recipe's wait."""
    plan = bench_plans.plan(1, samples=2)
    (question,) = plan.questions
    ensemble = Ensemble(plan.boards(range(2)))
    (recipe, *_) = candidates(question, ensemble.reduction(0).system())
    starts = [(k % 2, question, recipe, phase(k)) for k in range(12)]
    cases: list[Case] = [(k, question, question.excitation, question.start.start) for k in (0, 1)]
    known = [settled(ensemble, cases)[board][0] for board, *_ in starts]
    waited = switched_on(ensemble, starts)
    assert {end.orbit.response for end in waited} > {"1-1-1"}
    early = switched_on(ensemble, starts, known=known)
    assert [end.orbit.response for end in early] == [end.orbit.response for end in waited]
    assert [end.verdict for end in early] == [end.verdict for end in waited]
    assert sum(e.arrival.periods for e in early if e.arrival) < 0.9 * sum(
        e.arrival.periods for e in waited if e.arrival
    )
