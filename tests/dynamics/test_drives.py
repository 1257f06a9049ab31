"""Forces of other phases and shapes, against what shares nothing with the engine."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import signal
from scipy.integrate import solve_ivp

import designer
from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.check.absolute_motion import absolute_extremes
from designer.dynamics.attractors import settle
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.turning_points import heights
from designer.model.driven import model_flow
from designer.model.lumped_elements import Waveform, series
from designer.model.model_file import ModelFile, parse_model_file
from designer.model.relative_motion import ground_of
from tests.shared.exploring import quick
from tests.shared.system_text import clearance, system_text, table

GROUNDED = ("a", "ground")


def one_mass(*forces: str, gap: bool = True) -> ModelFile:
    stops = (clearance("A", "a", "ground", upper=0.4, lower=0.6, stiffness=8.0),) if gap else ()
    joints = {GROUNDED: 1.0}, {GROUNDED: 0.2}
    return parse_model_file(system_text({"a": 1.0}, *joints, *stops, *forces))


def drawn(seed: int) -> tuple[str, list[tuple[int, int, float, float]], float, float]:
    """A file of two masses with a clearance between them; its waves as (mass, n, amplitude, phase);
    the base's amplitude, 0 without one; a drive frequency."""
    rng = np.random.default_rng(seed)
    waves, tables = list[tuple[int, int, float, float]](), list[str]()
    for mass, name in enumerate("ab"):
        amplitude, phase = (float(v) for v in rng.uniform(-1.0, 1.0, 2))
        orders = rng.choice(np.arange(2, 8), int(rng.integers(0, 3)), replace=False)
        sizes = rng.uniform(-0.5, 0.5, (len(orders), 2)).tolist()
        each = [(int(n), float(a), float(p)) for n, (a, p) in zip(orders, sizes, strict=True)]
        more = {"harmonics": each} if each else {}
        tables.append(table("force", on=name, amplitude=amplitude, phase=phase, **more))
        waves.append((mass, 1, amplitude, phase))
        waves += [(mass, n, a, p) for n, a, p in each]
    base = float(rng.uniform(0.1, 0.3)) if seed % 2 else 0.0
    moving = f"[base]\namplitude = {base}\n" if base else ""
    gap = clearance("G", "a", "b", upper=0.3, lower=0.2, stiffness=6.0)
    joints = {("a", "b"): 1.0, ("b", "ground"): 1.5}, {GROUNDED: 0.1, ("b", "ground"): 0.2}
    text = system_text({"a": 1.0, "b": 2.0}, *joints, gap, *tables, moving)
    return text, waves, base, float(rng.uniform(0.6, 1.4))


def by_newton(
    waves: list[tuple[int, int, float, float]], base: float, omega: float, span: float, x: Array
) -> Array:
    """(k, 4) absolute displacements and velocities of ``drawn``'s masses along ``span``."""

    def rates(t: float, y: Array) -> list[float]:
        xa, va, xb, vb = y
        ground, speed = base * math.sin(omega * t), base * omega * math.cos(omega * t)
        push = [0.0, 0.0]
        for mass, n, amplitude, phase in waves:
            push[mass] += amplitude * math.sin(n * omega * t + phase)
        u = xa - xb
        joint = u + 6.0 * (max(u - 0.3, 0.0) - max(-u - 0.2, 0.0))
        fa = push[0] - joint - 0.1 * (va - speed)
        fb = push[1] + joint - 1.5 * (xb - ground) - 0.2 * (vb - speed)
        return [va, fa, vb, fb / 2.0]

    times = np.linspace(0.0, span, 4001)
    found = solve_ivp(
        rates, (0.0, span), x, "DOP853", times, rtol=1e-11, atol=1e-12, max_step=span / 8000
    )
    return np.asarray(found.y.T)


# With harmonics and without, base and none.
@pytest.mark.parametrize("seed", quick([0, 1, 2, 4, 5]))
def test_any_phases_and_harmonics_against_a_tight_integrator(seed: int) -> None:
    text, waves, base, omega = drawn(seed)
    model = parse_model_file(text).model
    flow, start = model_flow(model, omega), np.array([0.1, 0.2, -0.1, 0.3])
    ground = np.array([0.0, base * omega, 0.0, base * omega])
    periods = 3
    run = flow.run(start, periods)
    found = by_newton(waves, base, omega, periods * flow.drive.period, start + ground)
    np.testing.assert_allclose(run.strobes[-1] + ground, found[-1], atol=3e-8)
    assert run.counts.sum() > 0
    harmonics = any(n > 1 for _, n, _, _ in waves)
    assert flow.kernel == ("general" if harmonics else "tabulated")


@pytest.mark.parametrize("seed", quick([1, 4]))
def test_turning_points_and_absolute_extremes_of_an_orbit(seed: int) -> None:
    text, waves, base, omega = drawn(seed)
    model = parse_model_file(text).model
    flow = model_flow(model, omega)
    orbit = settle(flow, np.zeros(4))
    assert orbit.status is OrbitStatus.PERIODIC
    assert orbit.symmetric is not True
    ground = ground_of(model, omega)
    moved = orbit.start + np.array([0.0, base * omega, 0.0, base * omega])
    found = by_newton(waves, base, omega, orbit.n * flow.drive.period, moved)
    extremes = absolute_extremes(flow, orbit, ground)
    np.testing.assert_allclose(extremes[0::2, 0], found.min(axis=0)[0::2], atol=1e-5)
    np.testing.assert_allclose(extremes[0::2, 1], found.max(axis=0)[0::2], atol=1e-5)
    u = found[:, 0] - found[:, 2]
    assert heights(flow, orbit)[-1] == pytest.approx(max(u.max() - 0.3, -u.min() - 0.2), abs=1e-5)


def test_a_phase_of_the_only_force_shifts_the_motion() -> None:
    """The same orbits, exponents and bifurcations, by the fast engine and by the general one."""
    plain = one_mass(table("force", on="a", amplitude=1.0))
    turned = one_mass(table("force", on="a", amplitude=1.0, phase="90 deg"))
    orbits = []
    for file in (plain, turned):
        flow = model_flow(file.model, 1.3)
        orbits.append(settle(flow, np.zeros(2)))
    np.testing.assert_allclose(orbits[0].extremes, orbits[1].extremes, atol=1e-9)
    assert orbits[0].response == orbits[1].response
    one, other = (np.sort_complex(orbit.multipliers) for orbit in orbits)
    np.testing.assert_allclose(one, other, atol=1e-8)


@pytest.mark.slow
def test_bifurcations_do_not_depend_on_the_phase_of_the_only_force(tmp_path: Path) -> None:
    points = []
    for phase in (None, 0.7):
        more = {} if phase is None else {"phase": phase}
        path = tmp_path / f"{phase}.toml"
        path.write_text(one_mass(table("force", on="a", amplitude=0.45, **more)).text)
        answer: Any = designer.bifurcation(path, from_=0.5, to=1.5, steps=21, up=True).answer
        points.append([(p["kind"], p["value"]) for p in answer["points"]])
    assert [kind for kind, _ in points[0]] == [kind for kind, _ in points[1]]
    assert "grazing" in dict(points[0])
    np.testing.assert_allclose([v for _, v in points[0]], [v for _, v in points[1]], rtol=1e-6)


@pytest.mark.parametrize("waveform", ["square", "triangle", "sawtooth"])
def test_the_series_come_to_the_waveforms(waveform: Waveform) -> None:
    """SciPy's, away from their jumps; its sawtooth begins at -1 and a triangle is half of one."""
    angle = np.linspace(0.3, 2.7, 50)
    exact = {
        "square": signal.square(angle),
        "triangle": signal.sawtooth(angle + 0.5 * np.pi, 0.5),
        "sawtooth": signal.sawtooth(angle + np.pi),
    }[waveform]
    found = sum(size * np.sin(n * angle) for n, size in series(waveform, 400))
    np.testing.assert_allclose(found, exact, atol=5e-3)


def test_a_waveform_is_its_harmonics() -> None:
    square = one_mass(table("force", on="a", amplitude=1.0, phase=0.4, waveform="square", terms=3))
    sines = [[n, 4.0 / (math.pi * n), 0.4 * n] for n in (3, 5)]
    force = table("force", on="a", amplitude=4.0 / math.pi, phase=0.4, harmonics=sines)
    one, other = (
        model_flow(file.model, 0.8).run(np.zeros(2), 5) for file in (square, one_mass(force))
    )
    np.testing.assert_allclose(one.strobes, other.strobes, atol=1e-12)


def test_without_stops_every_harmonic_has_its_own_amplitude() -> None:
    """Superposition: the closed form of each, summed on a fine grid."""
    waves = [[2, 0.4, 0.3], [5, -0.3, 1.0]]
    file = one_mass(table("force", on="a", amplitude=1.0, phase=-0.5, harmonics=waves), gap=False)
    omega = 0.45
    orbit = settle(model_flow(file.model, omega), np.zeros(2))
    angle = np.linspace(0.0, 2.0 * np.pi, 20_001)
    x = np.zeros_like(angle)
    for n, amplitude, phase in ([1, 1.0, -0.5], *waves):
        response = amplitude / (1.0 - (n * omega) ** 2 + 0.2j * n * omega)
        x += (response * np.exp(1j * (n * angle + phase))).imag
    assert orbit.extremes[0] == pytest.approx([x.min(), x.max()], abs=1e-6)
    assert orbit.symmetric is not True


@pytest.mark.parametrize("phase", ["180 deg", math.pi, "360°", "-540 deg", 0.0])
def test_half_a_turn_is_antiphase(phase: str | float) -> None:
    """A circuit makes it: nothing is left beside the sine."""
    force = table("force", on="a", amplitude=1.0, phase=phase, harmonics=[[2, 0.0, 0.0]])
    system = one_mass(force).model.second_order()
    assert system.driven_by_sine
    assert abs(system.force[0]) == 1.0


def test_files_without_shapes_keep_their_hashes() -> None:
    told = json.dumps(one_mass(table("force", on="a", amplitude=1.0)).model.as_dict()["forces"])
    assert told == '[{"on": "a", "amplitude": 1.0, "constant": 0.0}]'


@pytest.mark.parametrize(
    ("keys", "field", "expected"),
    [
        ({"phase": "90 kg"}, "force[1].phase", "an angle in rad"),
        ({"phase": "3 m"}, "force[1].phase", "no unit of an angle"),
        ({"harmonics": [[1, 1.0, 0.0]]}, "force[1].harmonics", "from 2 to 64"),
        ({"harmonics": [[2, 1.0, 0.0], [2, 1.0, 0.0]]}, "force[1].harmonics", "one n twice"),
        ({"harmonics": [[2, 1.0]]}, "force[1].harmonics", "[n, amplitude, phase]"),
        ({"waveform": "square"}, "force on a.terms", "both waveform and terms"),
        ({"terms": 3}, "force on a.waveform", "both waveform and terms"),
        ({"waveform": "pulse", "terms": 3}, "force[1].waveform", '"square", "triangle"'),
    ],
)
def test_what_is_no_drive_is_refused(keys: dict[str, object], field: str, expected: str) -> None:
    with pytest.raises(InputError) as refused:
        one_mass(table("force", on="a", amplitude=1.0, **keys))
    assert refused.value.field == field
    assert expected in refused.value.expected
