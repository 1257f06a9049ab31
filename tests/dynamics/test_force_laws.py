"""Motion under piecewise-linear laws against what shares nothing with the engine."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from designer.base.arrays import Array
from designer.dynamics.attractors import settle
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.model.driven import model_flow
from designer.model.model_file import parse_model_file
from tests.model.test_force_law import straight_on
from tests.shared.exploring import quick, seeds
from tests.shared.system_text import clearance, system_text, table

Law = tuple[tuple[float, ...], bool, tuple[tuple[float, float], ...]]
GROUNDED = ("a", "ground")
EXAMPLES = Path(__file__).parents[2] / "examples"


def settled(text: str, omega: float, start: list[float] | None = None) -> Orbit:
    flow = model_flow(parse_model_file(text).model, omega)
    x = np.zeros(flow.system.size) if start is None else np.array(start)
    orbit = settle(flow, x)
    assert orbit.status is OrbitStatus.PERIODIC
    return orbit


def drawn(seed: int) -> tuple[str, list[Law], dict[str, Array], float]:
    """A system of two masses with laws of any shape: its file, the laws as (factors, of a velocity,
    points), its matrices, and a drive frequency."""
    rng = np.random.default_rng(seed)
    mass = rng.uniform(0.5, 2.0, 2)
    ground, joint = rng.uniform(0.5, 2.0, 2)
    drag = rng.uniform(0.1, 0.3, 2)
    laws: list[Law] = []
    tables = []
    for number in range(int(rng.integers(1, 4))):
        velocity = bool(rng.random() < 0.4)
        count = int(rng.integers(2, 7))
        x = np.sort(rng.uniform(-1.2, 1.2, count)) + 0.05 * np.arange(count)
        force = rng.uniform(-0.6, 0.6, count)
        x = np.concatenate([[x[0] - 0.5], x, [x[-1] + 0.5]])
        rise = rng.uniform(0.0, 1.0, 2)
        force = np.concatenate([[force[0] - rise[0]], force, [force[-1] + rise[1]]])
        points = tuple((float(a), float(f)) for a, f in zip(x, force, strict=True))
        way = int(rng.integers(0, 3))
        factors = [(1.0, 0.0), (1.0, -1.0), tuple(np.round(rng.uniform(-1.0, 1.0, 2), 3))][way]
        of = f"of = {{ a = {factors[0]}, b = {factors[1]} }}\n"
        joined = ['between = ["a", "ground"]\n', 'between = ["a", "b"]\n', of][way]
        kind = "velocity" if velocity else "displacement"
        pairs = [list(p) for p in points]
        tables.append(table("law", name=f"L{number}", quantity=kind, points=pairs) + joined)
        laws.append((tuple(map(float, factors)), velocity, points))
    omega = float(rng.uniform(0.5, 1.6))
    text = system_text(
        {"a": float(mass[0]), "b": float(mass[1])},
        {("a", "b"): float(joint), ("b", "ground"): float(ground)},
        {("a", "ground"): float(drag[0]), ("b", "ground"): float(drag[1])},
        table("force", on="a", amplitude=1.0, constant=0.1),
        *tables,
    )
    matrices = {
        "mass": mass,
        "K": np.array([[joint, -joint], [-joint, joint + ground]]),
        "C": np.diag(drag),
    }
    return text, laws, matrices, omega


@pytest.mark.parametrize("seed", quick(seeds(6)))
def test_laws_of_any_shape_against_a_tight_integrator(seed: int) -> None:
    """Newton's law with the force looked up piece by piece, DOP853 in short steps."""
    text, laws, matrices, omega = drawn(seed)
    mass, K, C = matrices["mass"], matrices["K"], matrices["C"]

    def rates(t: float, y: Array) -> Array:
        x, v = y[0::2], y[1::2]
        push = np.array([math.sin(omega * t) + 0.1, 0.0]) - K @ x - C @ v
        for factors, velocity, points in laws:
            row = np.array(factors)
            push = push - row * straight_on(points, float(row @ (v if velocity else x)))
        out = np.empty(4)
        out[0::2], out[1::2] = v, push / mass
        return out

    periods, start = 3, np.array([0.3, -0.2, 0.1, 0.4])
    span = periods * 2.0 * np.pi / omega
    exact = model_flow(parse_model_file(text).model, omega).run(start, periods)
    found = solve_ivp(
        rates, (0.0, span), start, "DOP853", rtol=1e-11, atol=1e-12, max_step=span / 6000
    )
    np.testing.assert_allclose(exact.strobes[-1], found.y[:, -1], atol=2e-8)
    assert exact.counts.shape[-1] == 2
    assert not exact.counts.any()


def test_a_law_is_a_clearance_whose_impacts_are_not_counted() -> None:
    joints = {("a", "ground"): 1.0}, {("a", "ground"): 0.15}
    force = table("force", on="a", amplitude=1.0)
    stops = clearance(
        "A", "a", "ground", upper=0.5, lower=0.3, upper_stiffness=9.0, lower_stiffness=6.0
    )
    law = table(
        "law",
        name="L",
        between=GROUNDED,
        points=[[-1.3, -6.0], [-0.3, 0.0], [0.5, 0.0], [1.5, 9.0]],
    )
    gap = settled(system_text({"a": 1.0}, *joints, force, stops), 1.3)
    same = settled(system_text({"a": 1.0}, *joints, force, law), 1.3)
    np.testing.assert_allclose(same.start, gap.start, atol=1e-11)
    np.testing.assert_allclose(same.extremes, gap.extremes, atol=1e-11)
    np.testing.assert_allclose(
        np.sort_complex(same.multipliers), np.sort_complex(gap.multipliers), atol=1e-9
    )
    assert gap.counts.total > 0
    assert same.counts.total == 0


@pytest.mark.parametrize(("constant", "images"), [(0.0, (1, 0)), (0.1, (-1, -1))])
def test_corners_are_images_of_each_other_where_the_motion_has_one(
    constant: float, images: tuple[int, int]
) -> None:
    """A constant force leaves an odd law's motion without a mirror image."""
    law = table("law", name="F", between=GROUNDED, points=[[-2, -7], [-1, -1], [1, 1], [2, 7]])
    force = table("force", on="a", amplitude=1.0, constant=constant)
    spring, damper = {GROUNDED: 1.0}, {GROUNDED: 0.2}
    text = system_text({"a": 1.0}, spring, damper, force, law)
    system = model_flow(parse_model_file(text).model, 1.0).system
    places = [-corner.row[-1] / corner.row[0] for corner in system.corners]
    assert system.corner_images == images
    assert sorted(places) == [-1.0, 1.0]


@pytest.mark.parametrize("ratio", [0.6, 0.8, 1.5])
def test_friction_comes_to_den_hartog_s_closed_form(ratio: float) -> None:
    """J. P. Den Hartog, Trans. ASME 53 (1931): a driven mass on a spring with Coulomb friction that
    does not stick. The finite slope is off by its width, ten times less with a tenth of it."""
    friction, amplitude = 0.2, 1.0
    V = 1.0 / (1.0 - ratio**2)
    U = math.sin(math.pi / ratio) / (ratio * (1.0 + math.cos(math.pi / ratio)))
    ideal = amplitude * math.sqrt(V * V - (friction / amplitude * U) ** 2)
    missed = []
    for width in (3e-3, 3e-4):
        text = system_text(
            {"a": 1.0},
            {GROUNDED: 1.0},
            {},
            table("friction", between=GROUNDED, force=friction, velocity=width),
            table("force", on="a", amplitude=amplitude),
        )
        orbit = settled(text, ratio)
        missed.append(abs(orbit.extremes[0, 1] - ideal))
        assert orbit.symmetric
    assert missed[0] < 2.0 * 3e-3
    assert missed[1] < 0.2 * missed[0]


def test_a_cubic_spring_comes_to_the_cubic() -> None:
    """Its amplitude near resonance against the curved force, by a tight integrator."""
    omega, k1, k3, damping, force = 1.4, 1.0, 0.8, 0.2, 0.5

    def rates(t: float, y: Array) -> list[float]:
        pull = k1 * y[0] + k3 * y[0] ** 3 + damping * y[1]
        return [y[1], force * math.sin(omega * t) - pull]

    span = 60 * 2.0 * np.pi / omega
    found = solve_ivp(
        rates, (0.0, span), [1.0, 0.0], "DOP853", rtol=1e-11, atol=1e-12, dense_output=True
    )
    assert found.sol is not None
    wave = found.sol(np.linspace(span - 2.0 * np.pi / omega, span, 20_001))[0]
    missed = []
    for points in (8, 16):
        text = system_text(
            {"a": 1.0},
            {},
            {GROUNDED: damping},
            table("cubic_spring", between=GROUNDED, k1=k1, k3=k3, range=1.5, points=points),
            table("force", on="a", amplitude=force),
        )
        orbit = settled(text, omega, [1.0, 0.0])
        missed.append(abs(orbit.extremes[0, 1] / wave.max() - 1.0))
    assert missed[0] < 0.02
    assert missed[1] < 0.4 * missed[0]


def test_two_wells_have_the_linear_motion_of_each() -> None:
    """Near the bottom of a well of straight pieces a small motion is linear: its amplitude and its
    place are known, and the other well has its mirror image."""
    spring = table("cubic_spring", between=GROUNDED, k1=-1.0, k3=1.0, range=2.0, points=12)
    text = system_text(
        {"a": 1.0}, {}, {GROUNDED: 0.3}, spring, table("force", on="a", amplitude=0.05)
    )
    omega = 0.9
    (law,) = parse_model_file(text).model.second_order().laws
    pairs = pairwise(law.points)
    (x0, f0), (x1, f1) = next(p for p in pairs if p[0][0] > 0.0 and p[0][1] < 0.0 < p[1][1])
    slope = (f1 - f0) / (x1 - x0)
    bottom = x0 - f0 / slope
    amplitude = 0.05 / abs(slope - omega**2 + 0.3j * omega)
    for side in (1.0, -1.0):
        orbit = settled(text, omega, [side * 1.05, 0.0])
        low, high = orbit.extremes[0]
        assert 0.5 * (low + high) == pytest.approx(side * bottom, abs=1e-10)
        assert 0.5 * (high - low) == pytest.approx(amplitude, rel=1e-9)
        assert x0 < abs(low) < x1
        assert not orbit.symmetric


def test_the_examples_are_the_systems_that_they_name() -> None:
    """Den Hartog's block, and Duffing and Holmes' beam in one well by a tight integrator."""
    block = (EXAMPLES / "dry-friction.toml").read_text("utf-8")
    V, U = 1.0 / (1.0 - 0.36), math.sin(math.pi / 0.6) / (0.6 * (1.0 + math.cos(math.pi / 0.6)))
    ideal = math.sqrt(V * V - (0.2 * U) ** 2)
    assert settled(block, 0.6).extremes[0, 1] == pytest.approx(ideal, abs=2.0 * 0.04)
    orbit = settled((EXAMPLES / "double-well.toml").read_text("utf-8"), 0.5, [1.0, 0.0])

    def rates(t: float, y: Array) -> list[float]:
        return [y[1], 0.3 * math.sin(0.5 * t) + y[0] - y[0] ** 3 - 0.25 * y[1]]

    span = 40 * 2.0 * np.pi / 0.5
    times = np.linspace(0.95 * span, span, 20_001)
    found = solve_ivp(rates, (0.0, span), [1.0, 0.0], "DOP853", times, rtol=1e-10, atol=1e-11)
    assert orbit.extremes[0] == pytest.approx([found.y[0].min(), found.y[0].max()], abs=0.03)
