"""The numerics gate: it finds the step by itself, and the known traps are traps without it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from designer.circuit.netlist import Excitation
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.spice import numerics_gate
from designer.spice.batch_backend import BatchNgspice
from designer.spice.convergence_aids import AidedRun
from designer.spice.deck import SolverSettings
from designer.spice.numerics_gate import BOUND, LEVELS, STEPS_PER_CONTACT, GateResult, GateSubject
from designer.spice.pool import SpicePool
from designer.spice.read_orbit import Read
from designer.spice.simulator import SimulationFailed
from tests.shared.paper_cases import MODEL, flow_of, subject

P = (1, 3, 8)


@pytest.fixture(scope="module")
def pool() -> Iterator[SpicePool]:
    with SpicePool(2) as pool:
        yield pool


@pytest.fixture(scope="module")
def passed(pool: SpicePool) -> dict[int, GateResult]:
    return dict(zip(P, numerics_gate.check(pool, [subject(p) for p in P]), strict=True))


def heard(pool: SpicePool, who: GateSubject, settings: SolverSettings) -> Orbit:
    ((_, found),) = pool.map([numerics_gate.job(who, settings)])
    assert not isinstance(found, SimulationFailed), found.reason
    return found.orbit


def long_run(who: GateSubject) -> GateSubject:
    """Enough periods to call a run aperiodic, from the same orbit."""
    return replace(who, orbit=replace(who.orbit, n=0), start=who.orbit.start)


def shortest_contact(who: GateSubject) -> float:
    """Length of the shortest contact in periods, by a plain count of a dense exact trace."""
    flow = flow_of(who)
    run = flow.run(who.orbit.start, who.orbit.n, points=20_000)
    rows = who.system.contact_rows(0)
    phase = 2.0 * np.pi * np.arange(len(run.strobes)) / 20_000
    u = -who.excitation.amplitude * np.sin(phase)
    shortest = np.inf
    for row in (rows[1], rows[-1]):
        touch = (run.strobes @ row[:-2] + row[-2] * u + row[-1] > 0.0).astype(int)
        edges = np.flatnonzero(np.diff(touch))
        lengths = np.diff(edges)[touch[edges[:-1]] == 0]
        shortest = min(shortest, float(lengths.min()))
    return shortest / 20_000


def test_contacts_are_counted_round_the_lap() -> None:
    def lengths(lap: str) -> list[int]:
        return list(numerics_gate.contact_lengths(np.array([c == "#" for c in lap])))

    assert lengths("..##..#.") == [2, 1]
    assert sorted(lengths("##..#..#")) == [1, 3]  # the last goes on with the first
    assert lengths("#..") == lengths("..#") == [1]
    assert lengths("....") == lengths("####") == []


def test_a_contact_across_the_ends_of_the_lap() -> None:
    """Against a count in the middle of three laps, which it does not interrupt there."""
    system = replace(MODEL, sides="upper").second_order().piecewise_linear()
    excitation = Excitation(1.0 / (2.0 * np.pi), 1.0)
    flow = Flow(system, Drive(1.0, -1.0))
    orbit = settle(flow, np.full(4, 0.3))
    upper = system.contact_rows(0)[1]
    assert orbit.response == "1-1-0"
    assert orbit.start @ upper[:-2] + upper[-1] > 0.0
    trace = flow.run(orbit.start, 3, points=5000).strobes
    u = -np.sin(2.0 * np.pi * np.arange(len(trace)) / 5000)
    touching = (trace @ upper[:-2] + upper[-2] * u + upper[-1] > 0.0).astype(int)
    entry = np.flatnonzero(np.diff(touching) > 0)[0]
    exits = np.flatnonzero(np.diff(touching) < 0)
    length = (exits[exits > entry][0] - entry) / 5000
    found = numerics_gate.shortest_contact(orbit, system, excitation) * excitation.frequency
    assert found == pytest.approx(length, abs=3e-4)
    assert found < 0.9


@pytest.mark.parametrize("p", P)
def test_a_contact_that_no_point_shows_is_shorter_than_their_distance(
    p: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    who, true = subject(p), shortest_contact(subject(p)) * subject(p).period
    for points in (3, 5, 8, 20_000):
        monkeypatch.setattr(numerics_gate, "WAVE_POINTS", points)
        found = numerics_gate.shortest_contact(who.orbit, who.system, who.excitation)
        apart = who.period / points
        assert found == pytest.approx(true, abs=apart)
        assert found <= max(true + apart, apart)


@pytest.mark.parametrize("p", P)
def test_what_passes(passed: dict[int, GateResult], p: int) -> None:
    result, who = passed[p], subject(p)
    assert result.passed
    assert result.difference <= BOUND
    assert isinstance(result.read, Read)
    assert result.read.orbit.response == f"1-{p}-{p}"
    assert result.remedies == ()
    contact = shortest_contact(who)
    finest = min(1.0 / 200.0, contact / STEPS_PER_CONTACT)
    halvings = len(result.tried) - 1
    assert result.settings.max_step == pytest.approx(who.period * finest / 2**halvings, rel=0.02)
    assert result.contact_steps == pytest.approx(
        contact * who.period / result.settings.max_step, rel=0.02
    )
    said = result.as_dict()
    assert (said["method"], said["passed"], said["bound"]) == ("trap", True, BOUND)
    # Tighter where the orbit is slow: 1e-2 (1 - ρ).
    assert said["rms_bound"] == pytest.approx(min(2e-3, 1e-2 * (1.0 - who.orbit.radius)))
    assert said["steps_a_period"] == pytest.approx(who.period / result.settings.max_step)


@pytest.mark.parametrize("net", ["v1", "v1n"])
def test_ngspice_sees_an_op_amp_clip(pool: SpicePool, net: str) -> None:
    """An integrator's, or an inverter's, limit is moved to just beyond what it needs, and to just
    within: on the exact circuit's word."""
    who = subject(1)
    (name,) = (s.name for s in who.circuit.sections if s.output == net)
    low, _ = who.board.rails[name]
    for share, status in ((1.02, OrbitStatus.PERIODIC), (0.98, OrbitStatus.CLIPPED)):
        rails = {**who.board.rails, name: (low, share * float(who.orbit.extremes[0, 1]))}
        reduction = Reduction(who.circuit, replace(who.board, rails=rails))
        orbit = settle(Flow(reduction.system(), who.excitation.drive), who.orbit.start)
        assert orbit.status is status
        clipping = replace(who, reduction=reduction, orbit=orbit)
        found = heard(pool, clipping, SolverSettings("trap", who.period / 800.0, 1e-5))
        assert found.response == orbit.response, found.reason


@pytest.mark.parametrize("p", P)
def test_two_steps_and_two_methods_say_the_same(
    pool: SpicePool, passed: dict[int, GateResult], p: int
) -> None:
    """Three runs made here, on every strobe of the last 1-p-p lap."""
    settings = passed[p].settings
    half = settings.max_step / 2.0
    runs = [
        settings,
        replace(settings, max_step=half),
        SolverSettings("gear", half, settings.reltol),
    ]
    found = [
        r
        for _, r in sorted(
            pool.map([numerics_gate.job(subject(p), s) for s in runs]), key=lambda r: r[0]
        )
    ]
    reads = [r for r in found if isinstance(r, Read)]
    assert [r.orbit.response for r in reads] == [f"1-{p}-{p}"] * 3
    peak = np.abs(subject(p).orbit.extremes).max(axis=1)
    gaps = [np.abs(a.strobes[-1] - b.strobes[-1]) / peak for a in reads for b in reads]
    assert np.max(gaps) == pytest.approx(passed[p].difference, rel=1e-9)


def rms(who: GateSubject, read: Read) -> float:
    """On an even grid, ngspice's points joined by a cubic spline; worst state, of its peak."""
    assert read.trace is not None
    exact = flow_of(who).run(who.orbit.start, 1, points=5000).strobes
    grid = np.linspace(0.0, who.period, len(exact))
    gap = CubicSpline(*read.trace)(grid) - exact
    return float((np.sqrt((gap**2).mean(axis=0)) / np.abs(exact).max(axis=0)).max())


@pytest.mark.parametrize("p", P)
def test_the_wave_is_the_exact_circuit_s(passed: dict[int, GateResult], p: int) -> None:
    read = passed[p].read
    assert isinstance(read, Read)
    assert rms(subject(p), read) == pytest.approx(passed[p].wave, rel=0.1)
    assert passed[p].wave < 2e-3


@pytest.mark.slow
def test_the_wave_at_every_p(pool: SpicePool) -> None:
    for who, result in zip(
        map(subject, range(1, 9)),
        numerics_gate.check(pool, [subject(p) for p in range(1, 9)]),
        strict=True,
    ):
        assert result.passed
        assert isinstance(result.read, Read)
        assert rms(who, result.read) < 2e-3


@pytest.mark.parametrize(("share", "passes"), [(4e-7, True), (1e-4, False)])
def test_of_a_state_at_rest_no_more_is_asked_than_ngspice_gives(share: float, passes: bool) -> None:
    """4 µV beside 10 V is no error of a state whose own peak is 10 nV; 1 mV is one."""
    who = subject(1)
    extremes = who.orbit.extremes.copy()
    extremes[2:] *= 1e-9
    still = replace(who, orbit=replace(who.orbit, extremes=extremes))
    points = numerics_gate.WAVE_POINTS
    states = Flow(who.system, who.excitation.drive).run(who.orbit.start, 1, points=points).strobes
    time = np.arange(points + 1) * who.period / points
    noise = share * np.abs(extremes).max() * np.eye(4)[2]

    def run(off: float) -> AidedRun[Read]:
        read = Read(still.orbit, states[[0, 0]] + off * noise, (time, states + off * noise))
        return AidedRun(read, SolverSettings("trap", who.period / 400.0))

    result = numerics_gate._judge(still, [run(1.0), run(0.0), run(-1.0)], (400,), who.period)
    assert result.passed is passes
    assert (result.wave <= result.wave_bound) is passes
    assert (result.difference <= BOUND) is passes


def test_a_generator_with_an_offset(pool: SpicePool) -> None:
    """Its DC shifts the orbit by a tenth of the peak, in ngspice as on the exact circuit: the
    opposite sign would be twice that away."""
    who = subject(1)
    moved = replace(who, excitation=replace(who.excitation, offset=0.1 * who.excitation.amplitude))
    orbit = settle(flow_of(moved), who.orbit.start)
    peak = np.abs(who.orbit.extremes).max(axis=1)
    assert np.abs((orbit.start - who.orbit.start) / peak).max() > 0.05
    (result,) = numerics_gate.check(pool, [replace(moved, orbit=orbit)])
    assert result.passed
    assert result.wave < 2e-3


# ---------------------------------------------------------------------------------------------
# Traps


@pytest.mark.slow
def test_gear_at_default_tolerance_makes_a_periodic_orbit_look_aperiodic(
    pool: SpicePool, passed: dict[int, GateResult]
) -> None:
    who = long_run(subject(3))
    naive = SolverSettings("gear", who.period / 200.0, reltol=1e-3, vntol=1e-6)
    job = numerics_gate.job(who, naive)
    # Of ngspice's defaults too: Newton's steps without bounds.
    ((_, found),) = pool.map([replace(job, netlist=re.sub(" convlimit.*", "", job.netlist))])
    assert isinstance(found, Read)
    assert found.orbit.status is OrbitStatus.APERIODIC
    assert heard(pool, who, passed[3].settings).response == "1-3-3"


@pytest.mark.slow
def test_two_hundred_steps_a_period_miscount_eight_impacts(
    pool: SpicePool, passed: dict[int, GateResult]
) -> None:
    who = long_run(subject(8))
    naive = SolverSettings("trap", who.period / 200.0, reltol=1e-3, vntol=1e-6)
    miscounted = heard(pool, who, naive)
    assert miscounted.status is not OrbitStatus.PERIODIC or (miscounted.p, miscounted.q) != (8, 8)
    assert heard(pool, who, passed[8].settings).response == "1-8-8"
    assert passed[8].settings.max_step < who.period / 800.0


def test_newton_s_method_does_not_step_from_limit_to_limit() -> None:
    """ngspice's own account of its work: every such cycle costs a hundred iterations; without them
    there is one iteration to solve, one to see it, and a few at each limit."""
    who = subject(3)
    job = numerics_gate.job(who, SolverSettings("trap", who.period / 568.0, 1e-5))
    text = job.netlist.replace("noopiter", "acct noopiter")
    bounds = text[text.index(" convlimit") : text.index("\n.save")]
    account = []
    for netlist in (text, text.replace(bounds, "")):
        log = BatchNgspice().run(netlist, job.signals, job.stop).log
        account.append(
            [
                int(re.findall(rf"{what} *= *(\d+)", log)[0])
                for what in ("Transient iterations", "Transient timepoints")
            ]
        )
    (iterations, points), (more_iterations, _) = account
    assert iterations < 3 * points
    assert more_iterations > 1.8 * iterations


# ---------------------------------------------------------------------------------------------
# No


def test_a_response_without_a_period_is_compared_by_name_alone(
    pool: SpicePool,
) -> None:
    """An orbit that only the exact side calls aperiodic does not pass; one that both do, does."""
    who = subject(1)
    nameless = replace(who, orbit=Orbit(OrbitStatus.APERIODIC, start=who.orbit.start))
    ((_, ran),) = pool.map([numerics_gate.job(who, SolverSettings("trap", who.period / 400.0))])
    assert isinstance(ran, Read)
    for own, passes in ((ran.orbit, False), (Orbit(OrbitStatus.APERIODIC), True)):
        outcome = AidedRun(replace(ran, orbit=own), SolverSettings("trap", who.period / 400.0))
        result = numerics_gate._judge(nameless, [outcome] * 3, (400,), who.period)
        assert result.passed is passes
        assert np.isnan([result.difference, result.wave, result.wave_bound]).all()


@pytest.mark.slow
def test_engines_that_disagree_do_not_pass(pool: SpicePool) -> None:
    """An orbit that the circuit does not show: no step makes ngspice say so."""
    who = subject(1)
    wrong = replace(who, orbit=replace(who.orbit, p=2, q=2))
    (result,) = numerics_gate.check(pool, [wrong])
    assert not result.passed
    assert len(result.tried) == LEVELS
    assert isinstance(result.read, Read)
    assert result.read.orbit.response == "1-1-1"


@pytest.mark.slow
def test_runs_that_fail_do_not_pass(pool: SpicePool) -> None:
    who = subject(1)
    broken = replace(who, start=np.full(4, np.nan))
    (result,) = numerics_gate.check(pool, [broken])
    assert not result.passed
    assert isinstance(result.read, SimulationFailed)
    assert np.isnan(result.difference)
