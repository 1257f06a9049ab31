"""Orbits of systems with several clearances, and dampers that act in contact only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from designer.dynamics.attractors import (
    asymmetry,
    describe,
    mirrored_strobes,
    settle,
    shoot,
    twin,
)
from designer.dynamics.coexisting_attractors import coexisting
from designer.dynamics.flow import Flow
from designer.dynamics.lyapunov_exponent import lyapunov
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.dynamics.steady_state import TransientSettings, by_flow
from designer.model.clearance import Side
from tests.shared.event_integrator import GROUND, Array, Gap, Mechanism, integrate
from tests.shared.mechanisms import CHAIN, absolute, flow_of
from tests.shared.symmetric_shooting import shoot_symmetric

EVEN = replace(
    CHAIN,
    gaps=[
        Gap(0, GROUND, upper=((0.5, 8.0),), lower=((0.5, 8.0),)),
        Gap(2, 1, upper=((0.3, 10.0),), lower=((0.3, 10.0),)),
    ],
)


def settled(system: Mechanism) -> tuple[Flow, Orbit]:
    flow = flow_of(system)
    orbit = settle(flow, np.zeros(flow.system.size))
    assert orbit.status is OrbitStatus.PERIODIC
    return flow, orbit


def map_of(system: Mechanism, x: Array, periods: int) -> Array:
    """The state some periods after x, by the independent integrator."""
    y, _ = integrate(system, absolute(system, x), periods * 2.0 * np.pi / system.omega)
    n = len(system.masses)
    speed = y[n:] - system.base * system.omega
    return np.stack([y[:n], speed], axis=1).ravel()


def test_impacts_are_counted_for_each_clearance() -> None:
    flow, orbit = settled(CHAIN)
    span = orbit.n * flow.drive.period
    _, entries = integrate(CHAIN, absolute(CHAIN, orbit.start), span)
    pairs = tuple(
        tuple(sum((e.gap, e.side) == (k, side) for e in entries) for side in (1, -1))
        for k in (0, 1)
    )
    assert orbit.counts.impacts == pairs
    assert min(sum(pair) for pair in pairs) > 0
    assert orbit.response == str(orbit.counts)
    assert orbit.impact_clearances.tolist() == [e.gap for e in entries]
    assert orbit.impact_sides.tolist() == [e.side for e in entries]
    assert orbit.impact_velocities == pytest.approx([e.velocity for e in entries], abs=1e-8)


@pytest.mark.parametrize("gap", [CHAIN.gaps[1], Gap(2, 1, upper=((0.1, 10.0),), preload=0.2)])
def test_the_monodromy_of_contacts_that_begin_with_a_force(gap: Gap) -> None:
    """By central differences of the independent integrator. Without the jump of the tangent
    vectors it would be off by what the damper, or the preload, does at each contact."""
    system = replace(CHAIN, gaps=[CHAIN.gaps[0], gap])
    flow, orbit = settled(system)
    assert not flow.system.continuous
    found = shoot(flow, orbit.start, orbit.n)
    assert found is not None
    h, columns = 1e-5, []
    for direction in np.eye(len(orbit.start))[:3]:
        ends = [map_of(system, orbit.start + s * h * direction, orbit.n) for s in (1.0, -1.0)]
        columns.append((ends[0] - ends[1]) / (2.0 * h))
    wanted = np.stack(columns, axis=1)
    assert found[1][:, :3] == pytest.approx(wanted, abs=1e-6)
    smooth = Flow(replace(flow.system, continuous=True), flow.drive)
    off = smooth.run(orbit.start, orbit.n, tangent=np.eye(6)).tangent
    assert off is not None
    assert np.abs(off[:, :3] - wanted).max() > 1e-3


def test_a_preload_that_rises_is_a_spring_that_leaves_again() -> None:
    """The force is continuous then, and the orbit that of the independent integrator."""
    side = Side(0.1, 10.0, (), preload=0.2, rise=0.1)
    assert np.array(side.springs) == pytest.approx(np.array([[0.1, 12.0], [0.2, -2.0]]))
    larger = np.array(side.scaled(3.0).springs)
    assert larger == pytest.approx(np.array([[0.3, 12.0], [0.6, -2.0]]))
    system = replace(CHAIN, gaps=[CHAIN.gaps[0], Gap(2, 1, upper=side.springs)])
    flow, orbit = settled(system)
    assert flow.system.continuous
    assert orbit.counts is not None
    assert orbit.counts.impacts[1][0] > 0
    assert map_of(system, orbit.start, orbit.n) == pytest.approx(orbit.start, abs=1e-7)


def test_a_mass_that_rests_on_a_preloaded_stop() -> None:
    """It rattles ever faster between pushing and not pushing: that ends with a status."""
    rig = Mechanism(
        masses=[1.0],
        springs=[(0, GROUND, 1.0)],
        dampers=[(0, GROUND, 0.2)],
        forces=[0.3],
        omega=0.9,
        gaps=[Gap(0, upper=((0.1, 10.0),), preload=1.0)],
        constants=[0.5],
    )
    orbit = settle(flow_of(rig), np.zeros(2))
    assert orbit.status is OrbitStatus.NOT_SETTLED
    assert "rattles on it lower and faster without end" in orbit.reason


def test_the_exponent_of_damped_contacts_is_that_of_the_multipliers() -> None:
    flow, orbit = settled(CHAIN)
    growth = lyapunov(flow, orbit.start, orbit.mode, 300)
    assert growth.value == pytest.approx(orbit.lyapunov, rel=2e-2)


def test_a_sweep_reads_the_first_clearance_and_the_stops_of_interest() -> None:
    """The least displacement in it and the velocities at each stop, though the gap lies between two
    masses or the stop stands still while the ground moves."""
    between = replace(CHAIN, gaps=[Gap(2, 1, upper=((0.4, 10.0),)), CHAIN.gaps[0]])
    fixed = replace(CHAIN, base=0.3, fixed_stops=True)
    for system in (between, fixed):
        flow, orbit = settled(system)
        stops = tuple((k, side) for k, gap in enumerate(system.gaps) for side in (1, -1))
        steady = by_flow(flow, orbit.start, TransientSettings(20, orbit.n, 100), stops)
        assert steady.counts == orbit.counts
        for (k, side), met in zip(stops, (steady.velocities, *steady.further), strict=True):
            here = (orbit.impact_clearances == k) & (orbit.impact_sides == side)
            wanted = np.sort(orbit.impact_velocities[here])
            assert np.sort(met) == pytest.approx(wanted, abs=1e-7)
        times = np.linspace(0.0, orbit.n * flow.drive.period, 64 * orbit.n + 1)
        trace = flow.run(orbit.start, orbit.n, points=64).strobes
        n, y = len(system.masses), np.zeros(2 * len(system.masses))
        least = np.inf
        for t, x in zip(times, trace, strict=True):
            y[:n] = x[0::2] + (0.0 if system.fixed_stops else system.ground(float(t))[0])
            least = min(least, system.in_gap(system.gaps[0], float(t), y)[0])
        assert steady.minima.min() == pytest.approx(least, abs=5e-3)
        assert steady.minima.min() <= least


def test_a_contact_is_judged_by_the_swing_in_its_own_clearance() -> None:
    """One clearance a million times as narrow as the other, and its contacts as shallow."""
    tiny = 1e-6
    system = Mechanism(
        masses=[1.0, 1.0],
        springs=[(0, GROUND, 1.0), (1, GROUND, 1.0)],
        dampers=[(0, GROUND, 0.2), (1, GROUND, 0.2)],
        forces=[1.0, tiny],
        omega=0.8,
        gaps=[Gap(0, upper=((0.5, 5.0),)), Gap(1, upper=((0.5 * tiny, 5.0),))],
    )
    flow, orbit = settled(system)
    assert orbit.counts.impacts[0] == orbit.counts.impacts[1]
    run = flow.run(orbit.start, orbit.n, measure=True)
    assert run.spans[1] == pytest.approx(tiny * run.spans[0], rel=1e-7)
    assert run.graze[1, 0] == pytest.approx(tiny * run.graze[0, 0], rel=1e-6)


def test_even_clearances_have_a_mirror() -> None:
    assert flow_of(CHAIN).system.mirror is None
    for constants in ([], [0.1, 0.0, 0.0]):
        system = flow_of(replace(EVEN, constants=constants)).system
        assert (system.mirror is None) == bool(constants)
    flow = flow_of(EVEN)
    orbits = coexisting(flow, [np.zeros(6), 0.3 * np.ones(6), np.arange(6) / 5.0])
    for orbit in (o for o in orbits if o.status is OrbitStatus.PERIODIC):
        image = describe_at(flow, mirrored_strobes(flow, orbit)[0], orbit.n)
        assert image.counts == orbit.counts.mirrored
        assert image.counts.family == orbit.counts.family
        if orbit.symmetric is False:
            other = twin(flow, orbit)
            assert other is not None
            assert other.counts == orbit.counts.mirrored


def describe_at(flow: Flow, x: Array, n: int) -> Orbit:
    found = shoot(flow, x, n)
    assert found is not None
    return describe(flow, found[0], n, found[1])


def test_a_mirror_that_changes_the_masses_about() -> None:
    """Two equal masses, the upper stop on one and the lower on the other: the mirror image of a
    motion is that of the other mass, reflected."""
    system = Mechanism(
        masses=[1.0, 1.0],
        springs=[(0, GROUND, 1.0), (1, GROUND, 1.0), (0, 1, 0.5)],
        dampers=[(0, GROUND, 0.1), (1, GROUND, 0.1)],
        forces=[1.0, 1.0],
        omega=0.9,
        gaps=[Gap(0, upper=((0.6, 6.0),)), Gap(1, lower=((0.6, 6.0),))],
    )
    swap = -np.kron(np.array([[0.0, 1.0], [1.0, 0.0]]), np.eye(2))
    flow = flow_of(system)
    assert flow.system.mirror is None
    flow = Flow(replace(flow.system, mirror=swap), Drive(system.omega))
    orbit = settle(flow, np.zeros(4))
    assert orbit.status is OrbitStatus.PERIODIC
    found = shoot_symmetric(flow, orbit.start, 1)
    assert found is not None
    same = describe(flow, found[0], 1, found[1], laps=1)
    peak = np.abs(same.extremes).max(axis=1)
    assert asymmetry(flow, found[0], 1, peak) < 1e-9
    assert same.extremes[0, 1] == pytest.approx(-same.extremes[2, 0], abs=1e-9)
