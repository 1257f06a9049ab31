"""Branches, points, sweeps, maps and basins of systems that are not the paper's."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from designer import bifurcation
from designer.bifurcations import basins, parameter_map, sweep
from designer.bifurcations.basins import BasinPlan
from designer.bifurcations.branch_survey import survey
from designer.bifurcations.continuation import End, start, trace
from designer.bifurcations.flow_family import Family
from designer.bifurcations.parameter_map import MapPlan
from designer.bifurcations.points import PointKind, locate
from designer.bifurcations.sweep import SweepPlan
from designer.dynamics.attractors import settle
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.steady_state import TransientSettings
from designer.folders.sweep_store import WorkFiles, grid_blocks, sweep_blocks
from designer.model.model_file import parse_model_file
from designer.model.swept_model import ModelSubject
from designer.plots.point_captions import caption
from tests.shared.event_integrator import GROUND, Gap, Mechanism, integrate
from tests.shared.mechanisms import CHAIN, absolute, flow_of
from tests.shared.system_text import clearance, system_text, table

FREE = replace(
    CHAIN,
    gaps=[Gap(0, GROUND, upper=((0.9, 8.0),)), Gap(2, 1, upper=((0.45, 10.0),), damping=0.4)],
)


def between(system: Mechanism, omega: float, a: int, b: int) -> float:
    """Amplitude of the displacement between two masses without stops, by the complex response."""
    impedance = np.diag(-(omega**2) * np.array(system.masses)).astype(complex)
    for links, factor in ((system.springs, 1.0), (system.dampers, 1j * omega)):
        for i, j, value in links:
            impedance[i, i] += factor * value
            if j != GROUND:
                impedance[j, j] += factor * value
                impedance[[i, j], [j, i]] -= factor * value
    x = np.append(np.linalg.solve(impedance, np.array(system.forces, dtype=complex)), 0.0)
    return float(abs(x[a] - x[b]))


@pytest.mark.parametrize(("name", "a", "b", "gap"), [("A", 0, GROUND, 0.9), ("B", 2, 1, 0.45)])
def test_grazing_is_where_the_free_response_fills_a_clearance(
    name: str, a: int, b: int, gap: float
) -> None:
    """Of each clearance at its own frequency; the caption names the stop."""
    wanted = brentq(lambda w: between(FREE, w, a, b) - gap, 0.3, 0.62)
    wide = replace(
        FREE, gaps=[g if g.mass == a else replace(g, upper=((2.0, 8.0),)) for g in FREE.gaps]
    )
    over = Family("omega", 0.2, 3.0, lambda w: flow_of(wide, w))
    orbit = settle(over.flow(0.99 * wanted), np.zeros(6))
    assert orbit.response == "1-0-0;0-0"
    branch = trace(start(over, orbit, 0.99 * wanted), 0.985 * wanted, 1.005 * wanted)
    (point,) = [p for p in locate(branch) if p.kind is PointKind.GRAZING]
    assert point.value == pytest.approx(wanted, rel=1e-9)
    assert point.as_dict()["stops"] == f"the upper stop of {name}"
    assert f"grazing at the upper stop of {name} at ω = " in caption(point, "ω")


def test_grazing_over_an_entry_of_a_matrix() -> None:
    """Where the free response of the coupled masses fills the gap, by the complex response."""
    omega, gap = 0.8, 0.9
    text = """format = 2
[matrices]
names = ["a", "b"]
mass = [1.0, 1.5]
stiffness = [[2.0, -0.6], [-0.6, 3.0]]
damping = [[0.2, 0.0], [0.0, 0.1]]
"""
    text += clearance("A", "a", "ground", upper=gap, stiffness=9.0)
    text += table("force", on="b", amplitude=2.0)

    def amplitude(entry: float) -> float:
        K = np.array([[2.0, entry], [entry, 3.0]], dtype=complex)
        whole = K - omega**2 * np.diag([1.0, 1.5]) + 1j * omega * np.diag([0.2, 0.1])
        return float(abs(np.linalg.solve(whole, [0.0, 2.0])[0]))

    wanted = brentq(lambda entry: amplitude(entry) - gap, -1.0, -0.1)
    family = ModelSubject(parse_model_file(text).model, omega).family("stiffness.a.b")
    orbit = settle(family.flow(0.9 * wanted), np.zeros(4))
    assert orbit.response == "1-0-0"
    branch = trace(start(family, orbit, 0.9 * wanted), 1.1 * wanted, 0.8 * wanted)
    (point,) = [p for p in locate(branch) if p.kind is PointKind.GRAZING]
    assert point.value == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize(("omega", "survives"), [(0.8, False), (0.7, False), (0.5, True)])
def test_grazing_on_a_moving_ground(omega: float, survives: bool) -> None:
    """The soft-impact rig: a = e √((1 - ω²)² + (2ζω)²)/ω² (Ing and others, Phil. Trans. R. Soc. A
    366, 2008), 0.709 at ω = 0.8. Past it period 1 stays stable where 2ω₀/ω is an integer (Kundu
    and others, Physica D 241, 2012)."""
    zeta, gap = 0.01, 1.26
    rig = Mechanism(
        masses=[1.0],
        springs=[(0, GROUND, 1.0)],
        dampers=[(0, GROUND, 2.0 * zeta)],
        forces=[0.0],
        omega=omega,
        gaps=[Gap(0, upper=((gap, 29.0),))],
    )
    wanted = gap * np.hypot(1.0 - omega**2, 2.0 * zeta * omega) / omega**2
    over = Family("base", 1e-3, 10.0, lambda a: flow_of(replace(rig, base=a)))
    half = settle(over.flow(0.49 * wanted), np.zeros(2))
    orbit = replace(half, start=2.0 * half.start)  # free of the stop, motion follows amplitude
    branch = trace(start(over, orbit, 0.98 * wanted), 0.97 * wanted, 1.005 * wanted)
    first = min(p.value for p in locate(branch) if p.kind is PointKind.GRAZING)
    assert first == pytest.approx(wanted, rel=1e-9)
    assert branch.points[-1].stable is survives


@pytest.mark.slow
def test_a_survey_of_three_masses_and_two_clearances() -> None:
    """Its orbits close in the independent integrator too, with their impacts. At ω = 0.6221 the
    damped contact ends at the very strobe: the branch goes on over the kink."""
    over = Family("omega", 0.2, 3.0, lambda w: flow_of(CHAIN, w))
    orbit = settle(over.flow(0.6235), np.zeros(6))
    made = survey(over, [(0.6235, orbit)], 0.6215, 0.6245)
    points = [(p.kind, p.stops, p.before, p.after) for p in made.points]
    assert points == [
        (PointKind.GRAZING, "the upper stop of A", "1-2-1;3-0", "1-1-1;3-0"),
    ]
    branch = made.branches[0]
    assert branch.ends == (End.LIMIT, End.LIMIT)
    for point in branch.points[:: max(len(branch.points) // 4, 1)]:
        system = replace(CHAIN, omega=point.value)
        periods = branch.curve.n * 2.0 * np.pi / point.value
        end, entries = integrate(system, absolute(system, point.orbit.start), periods)
        assert end == pytest.approx(absolute(system, point.orbit.start), abs=1e-8)
        near = min(point.orbit.penetration, point.orbit.miss)
        assert len(entries) == point.counts.total or near < 1e-4


TEXT = system_text(
    {"hammer": 1.0, "arm": 0.8, "casing": 1.2},
    {("hammer", "ground"): 1.0, ("hammer", "arm"): 1.5, ("arm", "casing"): 1.0},
    {("hammer", "ground"): 0.2, ("hammer", "arm"): 0.1, ("arm", "casing"): 0.1},
    clearance("A", "hammer", "ground", upper=0.5, lower=0.7, stiffness=8.0),
    clearance("B", "casing", "arm", upper=0.2, stiffness=10.0),
    table("force", on="hammer", amplitude=1.0),
)
BRIEF = TransientSettings(30, 4, 100)


def subject() -> ModelSubject:
    return ModelSubject(parse_model_file(TEXT).model, omega=0.7)


def test_a_sweep_and_its_store(tmp_path: Path) -> None:
    plan = SweepPlan(subject(), "omega", np.linspace(0.7, 0.72, 3), course=BRIEF)
    store = sweep_blocks(plan, WorkFiles(tmp_path, "w", {}))
    made = sweep.run(plan, store=store)
    for value, step in zip(plan.values, made.steps["down"], strict=True):
        flow = plan.subject.settings([{"omega": float(value)}])[0].flow()
        assert settle(flow, step.end).counts == step.counts
    again = store.read("down", 0)
    assert again is not None
    assert [s.response for s in again[::-1]] == [s.response for s in made.steps["down"]]
    assert len(made.steps["down"][0].counts.impacts) == 2


def test_a_map_and_basins(tmp_path: Path) -> None:
    axes = ("omega", np.linspace(0.7, 0.72, 2), "A.upper", np.linspace(0.5, 0.6, 2))
    plan = MapPlan(subject(), *axes, course=BRIEF)
    store = grid_blocks(plan, WorkFiles(tmp_path, "w", {}))
    made = parameter_map.run(plan, store=store)
    assert parameter_map.run(plan, store=store) == made
    for cell in made.cells:
        if cell.status is OrbitStatus.PERIODIC:
            assert len(cell.counts.impacts) == 2
    few = np.linspace(-0.5, 0.5, 2)
    found = basins.run(BasinPlan(subject(), {}, "x1", few, "x3'", few, np.zeros(6), BRIEF))
    assert sum(a.share for a in found.attractors) == pytest.approx(1.0)
    assert {c.response for c in found.cells} == {a.response for a in found.attractors}


TO_GROUND = ("m", "ground")
ALIKE = parse_model_file(
    system_text(
        {"m": 1.0},
        {TO_GROUND: 1.0},
        {TO_GROUND: 0.1},
        clearance("A", *TO_GROUND, upper=0.5, lower=0.5, stiffness=30.0),
        table("force", on="m", amplitude=1.0),
    )
)
"""Its two gaps are equal, so that it has a mirror; with any others it has none."""


@pytest.mark.parametrize(("parameter", "value"), [("A.upper", 0.5), ("m.constant", 0.0)])
def test_a_branch_goes_through_the_one_value_that_has_a_mirror(
    parameter: str, value: float
) -> None:
    family = ModelSubject(ALIKE.model, 1.3).family(parameter)
    orbit = settle(family.flow(value), np.zeros(2))
    assert orbit.symmetric
    branch = trace(start(family, orbit, value), value - 0.1, value + 0.1)
    assert branch.ends == (End.LIMIT, End.LIMIT)
    for point in (branch.points[0], branch.points[-1]):
        reached = settle(family.flow(point.value), orbit.start)
        assert point.orbit.start == pytest.approx(reached.start, abs=1e-8)
        assert reached.symmetric is False


def test_a_domain_narrower_than_a_thousandth_hides_no_mirror_of_one_value_alone() -> None:
    family = ModelSubject(ALIKE.model, 1.3).family("m.constant")
    assert family.flow(0.0).system.mirror is not None
    assert not replace(family, low=-1e-4, high=1e-4).mirrored(0.0)


@pytest.mark.slow
def test_a_grazing_curve_goes_through_equal_gaps() -> None:
    """Each stop is touched where the response without one is as large as its gap."""
    found: Any = bifurcation(ALIKE, from_=1.7, to=2.5, steps=17, and_=("A.upper", 0.45, 0.55))

    def free(w: float, gap: float) -> float:
        return math.hypot(1.0 - w * w, 0.1 * w) - 1.0 / gap

    upper = [brentq(free, 1.2, 3.0, args=(gap,)) for gap in (0.45, 0.5, 0.55)]
    curves = [c["points"] for c in found.answer["curves"] if c["kind"] == "grazing"]
    ends = {tuple(np.round(points[k], 5)) for points in curves for k in (0, -1)}
    assert (round(upper[0], 5), 0.45) in ends
    assert (round(upper[1], 5), 0.55) in ends
