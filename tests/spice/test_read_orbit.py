"""Reading waveforms: orbits sampled from the exact flow at irregular times come back."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from designer.base.arrays import Array
from designer.dynamics.attractors import settle, starts
from designer.dynamics.coexisting_attractors import coexisting
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.model.clearance import Clearance, Side
from designer.model.mechanics import SecondOrderSystem
from designer.model.model import Dimensionless
from designer.spice.read_orbit import (
    BRIEF,
    ENGINE_ERROR,
    ClearanceRows,
    LinearOutput,
    Read,
    Reading,
    clearance_rows,
    name_in_ngspice,
    read,
)
from designer.spice.simulator import Waveforms

NETS = ("v1", "v2", "v3", "v4")


def flow_at(omega: float, b: float = 0.25) -> Flow:
    model = Dimensionless(0.5, 0.5, 0.95, 0.5, 0.1, 0.0, b)
    return Flow(model.second_order().piecewise_linear(), Drive(omega))


def reading_of(omega: float, *, discard: int = 2, b: float = 0.25, keep: bool = False) -> Reading:
    upper = np.array([1.0, 0, 0, 0, 0, -b])
    lower = np.array([-1.0, 0, 0, 0, 0, -b])
    rows = ClearanceRows(upper, lower, np.eye(6)[0], np.eye(4)[1])
    return Reading(2 * np.pi / omega, discard, NETS, np.zeros(4), (rows,), "vg", keep)


def waveforms(
    flow: Flow, x: Array, periods: int, *, seed: int = 0, steps: int = 2000, thin: float = 0.6,
    ripple: float = 0.0, beyond: float = 0.0,
) -> Waveforms:  # fmt: skip
    """The exact trajectory at a random ``thin`` of the points; t = 0 is missing, as with uic.

    ripple : a smooth error, of the peak. beyond : periods that the run goes on past the last.
    """
    rng = np.random.default_rng(seed)
    total = periods + int(np.ceil(beyond))
    trace = flow.run(x, total, points=steps).strobes
    time = np.arange(len(trace)) * flow.drive.period / steps
    last = round((periods + beyond) * steps)
    keep = rng.uniform(size=len(time)) < thin
    keep[0], keep[last], keep[last + 1 :] = False, True, False
    y = trace + ripple * np.abs(trace).max(axis=0) * np.sin(
        37.0 * time[:, None] / flow.drive.period + np.arange(4)
    )
    signals = {net: y[keep, i] for i, net in enumerate(NETS)}
    signals["vg"] = np.sin(flow.drive.omega * time[keep])
    return Waveforms(axis=time[keep], signals=signals, log="", seconds=0.0)


@cache
def orbit_at(omega: float, n: int) -> Orbit:
    flow = flow_at(omega)
    met = coexisting(flow, starts(np.full(4, 2.0), 32))
    return next(o for o in met if o.n == n)


KNOWN = [(1.55, 1), (1.55, 3), (1.43, 1), (0.85, 1), (0.54, 1), (0.215, 1)]


@pytest.mark.parametrize(("omega", "n"), KNOWN)
@pytest.mark.parametrize("seed", range(2))
def test_a_known_orbit_is_read_back(omega: float, n: int, seed: int) -> None:
    orbit, flow = orbit_at(omega, n), flow_at(omega)
    # Below T/1000 here and there a contact of the eight would be stepped over.
    steps = 2000 if omega > 0.5 else 8000
    waves = waveforms(flow, orbit.start, 2 + max(4 * n, 6), seed=seed, ripple=1e-4, steps=steps)
    got = read(waves, reading_of(omega))
    assert got.orbit.response == orbit.response, got.orbit.reason
    assert got.orbit.extremes == pytest.approx(orbit.extremes, abs=2e-3)
    assert got.orbit.asymmetry == pytest.approx(orbit.asymmetry, abs=5e-3)
    assert sorted(got.orbit.impact_sides) == sorted(orbit.impact_sides)
    assert got.orbit.penetration == pytest.approx(orbit.penetration, abs=1e-3)
    peak = np.abs(orbit.extremes).max(axis=1)
    gap = np.abs(got.strobes[-1] - orbit.start) / peak
    assert gap.max() < 1e-3 or n > 1


def test_impact_times_and_velocities() -> None:
    orbit, flow = orbit_at(0.85, 1), flow_at(0.85)
    got = read(waveforms(flow, orbit.start, 10), reading_of(0.85)).orbit
    assert got.impact_times == pytest.approx(orbit.impact_times, abs=2e-3)
    assert got.impact_velocities == pytest.approx(orbit.impact_velocities, abs=1e-2)
    assert got.impact_sides.tolist() == orbit.impact_sides.tolist()


@settings(max_examples=25)
@given(seed=st.integers(0, 10**6), thin=st.floats(0.3, 1.0))
def test_where_ngspice_steps_does_not_matter(seed: int, thin: float) -> None:
    orbit, flow = orbit_at(1.55, 3), flow_at(1.55)
    waves = waveforms(flow, orbit.start, 14, seed=seed, thin=thin)
    assert read(waves, reading_of(1.55)).orbit.response == "3-3-3"


def test_a_period_two_orbit_is_not_period_one_or_four() -> None:
    """A synthetic one: the same wave with every second lap a little larger."""
    omega, b = 1.0, 0.25
    t = np.linspace(1e-3, 14 * 2 * np.pi, 14 * 1500)
    x = 0.4 * np.sin(t) + 0.02 * np.sin(t / 2)
    v = 0.4 * np.cos(t) + 0.01 * np.cos(t / 2)
    signals = {"v1": x, "v2": v, "v3": x, "v4": v, "vg": np.sin(t)}
    got = read(Waveforms(t, signals, "", 0.0), reading_of(omega, b=b)).orbit
    assert got.response == "2-2-2"
    assert got.symmetric is False


def test_chaos_is_aperiodic() -> None:
    flow = flow_at(1.2)
    x = flow.run(np.zeros(4), 200).strobes[-1]
    got = read(waveforms(flow, x, 70), reading_of(1.2)).orbit
    assert got.status is OrbitStatus.APERIODIC
    assert got.n == 0
    assert got.reason


def test_half_as_many_strobes_show_chaos_but_no_long_period() -> None:
    """Chaos repeats nothing; a period of ten needs forty strobes to be seen, and is not denied."""
    flow = flow_at(1.2)
    x = flow.run(np.zeros(4), 200).strobes[-1]
    reading = reading_of(1.2)
    chaos = waveforms(flow, x, reading.discard + BRIEF)
    assert read(chaos, replace(reading, brief=True)).orbit.status is OrbitStatus.APERIODIC
    assert read(chaos, reading).orbit.status is OrbitStatus.NOT_SETTLED
    t = np.linspace(1e-3, (2 + BRIEF) * 2 * np.pi, (2 + BRIEF) * 1000)
    wave = np.sin(t) + 0.1 * np.sin(t / 10)
    signals = dict.fromkeys((*NETS, "vg"), wave)
    ten = read(Waveforms(t, signals, "", 0.0), replace(reading_of(1.0), brief=True))
    assert ten.orbit.status is OrbitStatus.NOT_SETTLED


def test_a_drifting_start_is_not_periodic() -> None:
    flow = flow_at(1.55)
    got = read(waveforms(flow, np.array([0.5, 0.5, -0.5, 0.0]), 8), reading_of(1.55)).orbit
    assert got.status in (OrbitStatus.APERIODIC, OrbitStatus.NOT_SETTLED)


def test_short_runs_are_not_settled() -> None:
    orbit, flow = orbit_at(1.55, 1), flow_at(1.55)
    got = read(waveforms(flow, orbit.start, 4), reading_of(1.55)).orbit
    assert got.status is OrbitStatus.NOT_SETTLED


@pytest.mark.parametrize("depth", [0.2, -0.2])
def test_grazing_is_undecided(depth: float) -> None:
    """A peak within the engine's error of the clearance, above or below it."""
    free = Flow(
        Dimensionless(0.5, 0.5, 0.0, 0.5, 0.1, 0.0, 0.25).second_order().piecewise_linear(),
        Drive(0.9),
    )
    orbit = settle(free, np.zeros(4))
    top = float(orbit.extremes[0, 1])
    b = top * (1.0 - depth * ENGINE_ERROR)
    got = read(waveforms(free, orbit.start, 10), reading_of(0.9, b=b)).orbit
    assert got.status is OrbitStatus.GRAZING
    clear = read(waveforms(free, orbit.start, 10), reading_of(0.9, b=top * 1.01)).orbit
    assert clear.response == "1-0-0"
    grazed = read(waveforms(free, orbit.start, 10), reading_of(0.9, b=top * 0.99)).orbit
    assert grazed.response == "1-1-1"


@pytest.mark.parametrize("omega", [1.55, 0.85])
@pytest.mark.parametrize("shift", [-1e-4, -1e-7, 0.0, 1e-7, 1e-4])
def test_impacts_at_the_window_s_edges_are_counted_once(omega: float, shift: float) -> None:
    """The strobe is moved onto an impact: one lap more or less must not appear."""
    flow = flow_at(omega)
    orbit = orbit_at(omega, 1)
    when = float(orbit.impact_times[0]) + shift
    steps = 4000
    trace = flow.run(orbit.start, 14, points=steps).strobes
    time = np.arange(len(trace)) * flow.drive.period / steps
    grid = np.linspace(2e-3, 12 * flow.drive.period, 12 * 1500)
    signals = {net: np.interp(grid + when, time, trace[:, i]) for i, net in enumerate(NETS)}
    signals["vg"] = np.sin(omega * (grid + when))
    got = read(Waveforms(grid, signals, "", 0.0), reading_of(omega)).orbit
    assert got.response == orbit.response, got.reason


@pytest.mark.parametrize("beyond", [0.3, 0.7])
def test_a_run_that_goes_on_past_the_last_strobe(beyond: float) -> None:
    """Impacts after the window closes are no impacts of the window."""
    orbit, flow = orbit_at(0.85, 1), flow_at(0.85)
    got = read(waveforms(flow, orbit.start, 10, beyond=beyond), reading_of(0.85)).orbit
    assert got.response == orbit.response, got.reason


def test_no_clearance_no_impacts() -> None:
    orbit, flow = orbit_at(0.85, 1), flow_at(0.85)
    reading = reading_of(0.85)
    bare = Reading(reading.period, 2, NETS, np.zeros(4), (), "vg")
    got = read(waveforms(flow, orbit.start, 10), bare).orbit
    assert got.response == "1-0-0"


def test_one_sided_clearance() -> None:
    orbit, flow = orbit_at(0.85, 1), flow_at(0.85)
    full = reading_of(0.85)
    only = replace(full, clearances=(replace(full.clearances[0], lower=None),))
    assert read(waveforms(flow, orbit.start, 10), only).orbit.response == "1-2-0"


def test_an_output_at_its_limit_makes_the_orbit_clipped() -> None:
    """An inverter of the first state, read over the last laps alone."""
    orbit, flow = orbit_at(0.85, 1), flow_at(0.85)
    waves, reading = waveforms(flow, orbit.start, 10), reading_of(0.85)
    volts = -waves.signals["v1"]
    volts[waves.axis < 1.9 * reading.period] = 9.0  # on the way, which is not judged
    signals = {**waves.signals, "inverted": volts}
    low, high = -orbit.extremes[0, 1], -orbit.extremes[0, 0]
    for scale, status in ((1.001, OrbitStatus.PERIODIC), (0.999, OrbitStatus.CLIPPED)):
        for ends in ((scale * low, np.inf), (-np.inf, scale * high)):
            output = LinearOutput("inverted", *ends)
            got = read(replace(waves, signals=signals), replace(reading, outputs=(output,))).orbit
            assert got.status is status
            assert (got.n, got.p, got.q) == (orbit.n, orbit.p, orbit.q)


def test_a_trace_is_kept_on_request_over_n_periods() -> None:
    orbit, flow = orbit_at(1.55, 3), flow_at(1.55)
    got: Read = read(waveforms(flow, orbit.start, 14), reading_of(1.55, keep=True))
    assert got.trace is not None
    time, states = got.trace
    assert time[0] == 0.0
    assert time[-1] == pytest.approx(3 * flow.drive.period, rel=1e-9)
    # It begins on a strobe to the interpolation's error, not at the next step of ngspice.
    assert states[0] == pytest.approx(flow.run(orbit.start, 11).strobes[-1], abs=1e-6)
    assert states.shape == (len(time), 4)
    assert read(waveforms(flow, orbit.start, 14), reading_of(1.55)).trace is None


def test_impacts_are_counted_clearance_by_clearance() -> None:
    """Two masses, one clearance to ground and one between them: the exact flow's own counts,
    velocities and clearances."""
    system = SecondOrderSystem(
        mass=np.array([1.0, 1.0]),
        damping=np.array([[0.3, -0.3], [-0.3, 0.7]]),
        stiffness=np.array([[1.0, -1.0], [-1.0, 2.0]]),
        force=np.array([1.0, 0.0]),
        clearances=(
            Clearance("A", 0, None, Side(0.5, 5.0), Side(0.6, 6.0)),
            Clearance("B", 0, 1, Side(0.3, 4.0), None),
        ),
    ).piecewise_linear()
    flow = Flow(system, Drive(1.3))
    orbit = settle(flow, np.zeros(4))
    assert orbit.status is OrbitStatus.PERIODIC
    assert len(set(orbit.impact_clearances)) == 2
    reading = Reading(flow.drive.period, 2, NETS, np.zeros(4), clearance_rows(system), "vg")
    got = read(waveforms(flow, orbit.start, 4 + 6 * orbit.n), reading).orbit
    assert got.response == orbit.response, got.reason
    assert got.more == orbit.more
    assert got.impact_clearances.tolist() == orbit.impact_clearances.tolist()
    assert got.impact_sides == pytest.approx(orbit.impact_sides)
    assert got.impact_velocities == pytest.approx(orbit.impact_velocities, abs=5e-3)


def test_what_ngspice_does_not_tell_apart_it_calls_aperiodic() -> None:
    for response in ("aperiodic", "quasi-periodic", "17-1-0", "20-44-44;0-1"):
        assert name_in_ngspice(response) == "aperiodic"
    for response in ("16-1-0", "1-2-2;0-1", "grazing", "not settled"):
        assert name_in_ngspice(response) == response
