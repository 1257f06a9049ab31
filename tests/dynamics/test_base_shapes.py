"""Bases that move by another phase or shape, against closed forms and another integrator."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.check.absolute_motion import absolute_extremes
from designer.dynamics.attractors import settle
from designer.dynamics.orbit import OrbitStatus
from designer.fidelity.system_runge_kutta import rates_of, run
from designer.model.driven import model_flow
from designer.model.model_file import parse_model_file
from designer.model.relative_motion import companion_motions, ground_of
from designer.plots.system_equations import equations_of
from tests.shared.exploring import quick
from tests.shared.system_text import clearance, system_text, table

GROUNDED = ("a", "ground")
BLOCK = system_text({"a": 2.0}, {GROUNDED: 3.0}, {GROUNDED: 0.4})
STOP = clearance("S", *GROUNDED, upper=0.3, stiffness=20.0)
FIXED = STOP.replace("upper", "damping = 0.2\nupper")
"""Of a base that moves without it."""
OMEGA = 0.8
SHAPES = {
    "a phase": ('phase = "70 deg"', [(1, 0.3, math.radians(70.0))]),
    "harmonics": (
        'harmonics = [[2, 0.1, "30 deg"], [3, "0.05 m", 0.0]]',
        [(1, 0.3, 0.0), (2, 0.1, math.radians(30.0)), (3, 0.05, 0.0)],
    ),
    "a waveform": (
        'waveform = "triangle"\nterms = 2\nphase = 0.4',
        [(1, 0.3 * 8 / math.pi**2, 0.4), (3, -0.3 * 8 / (9 * math.pi**2), 1.2)],
    ),
}


def base(keys: str, amplitude: str = "0.3") -> str:
    return f"[base]\namplitude = {amplitude}\n{keys}\n"


@pytest.mark.parametrize("shape", quick(SHAPES))
@pytest.mark.parametrize("stop", ["", STOP, FIXED])
def test_the_absolute_motion_is_another_integrators(shape: str, stop: str) -> None:
    """m x″ + c (x − y)′ + k (x − y) + stop(x − y) = 0 in absolute x, with y as the file says; of a
    stop that stays, stop(x)."""
    keys, waves = SHAPES[shape]
    stays = 'stops = "fixed"\n' if stop == FIXED else ""
    model = parse_model_file(BLOCK + stop + base(stays + keys)).model
    flow = model_flow(model, OMEGA)
    orbit = settle(flow, np.zeros(2))
    assert orbit.status is OrbitStatus.PERIODIC

    def ground(t: Array) -> tuple[Array, Array]:
        y = sum(size * np.sin(n * OMEGA * t + turn) for n, size, turn in waves)
        rate = sum(n * OMEGA * size * np.cos(n * OMEGA * t + turn) for n, size, turn in waves)
        return np.asarray(y), np.asarray(rate)

    def rates(t: float, state: Array) -> Array:
        y, rate = ground(np.array(t))
        z, w = state[0] - y, state[1] - rate
        push = 20.0 * max(float(z) - 0.3, 0.0) if stop == STOP else 0.0
        if stays and state[0] > 0.3:
            push = 20.0 * (state[0] - 0.3) + 0.2 * state[1]
        return np.array([state[1], -(0.4 * w + 3.0 * z + push) / 2.0])

    span = orbit.n * 2.0 * math.pi / OMEGA
    times = np.linspace(0.0, span, 4001)
    y, rate = ground(times)
    start = orbit.start if stays else orbit.start + np.array([y[0], rate[0]])
    # A damper's force jumps where its contact begins.
    kept = solve_ivp(
        rates, (0.0, span), start, "DOP853", times,
        rtol=1e-11, atol=1e-13, max_step=0.002 if stays else np.inf,
    )  # fmt: skip
    assert kept.y[:, -1] == pytest.approx(start, abs=1e-5 if stays else 1e-8)
    other = kept.y - [y, rate] if stays else kept.y
    ground_ = ground_of(model, OMEGA)
    found = absolute_extremes(flow, orbit, -ground_ if stays else ground_)
    seen = np.column_stack([other.min(axis=1), other.max(axis=1)])
    assert found[0] == pytest.approx(seen[0], abs=1e-5)
    if stop:
        states = flow.run(orbit.start, orbit.n, mode=orbit.mode, points=64).strobes
        (companion,) = companion_motions(model.second_order())
        at = np.linspace(0.0, span, len(states))
        shown = companion.of(at, states, OMEGA)
        assert shown[:, 0] == pytest.approx(np.interp(at, times, other[0]), abs=1e-4)
        assert shown[:, 1] == pytest.approx(np.interp(at, times, other[1]), abs=1e-4)


@pytest.mark.parametrize("stays", quick([True, False]))
def test_a_force_whose_cosine_the_base_cancels_at_one_frequency_is_kept_at_others(
    stays: bool,
) -> None:
    """x″ + 0.1 (x − y)′ + (x − y) + stop = F sin(ωt + φ), the stop over x or over x − y: with what
    the base's damper does, or its inertia, all forces are a sine at ω = 1."""
    omega, phase = 2.0, math.pi / 2 if stays else math.pi / 4
    amplitude, turn = (-0.1, 0.0) if stays else (-math.sqrt(2.0), math.pi / 2)
    text = system_text({"a": 1.0}, {GROUNDED: 1.0}, {GROUNDED: 0.1})
    text += table("force", on="a", amplitude=amplitude, phase=phase)
    text += clearance("S", *GROUNDED, upper=0.2, stiffness=4.0)
    text += base('stops = "fixed"' if stays else f"phase = {turn}", "1.0")
    model = parse_model_file(text).model
    system = model.second_order()
    assert not system.driven_by_sine
    assert abs(system.drive_waves(1.0)[0].cosine[0]) < 1e-15 < abs(system.drive_waves(1.0)[0].sine)
    orbit = settle(model_flow(model, omega), np.zeros(2))
    assert orbit.status is OrbitStatus.PERIODIC

    def ground(t: float) -> Array:
        return np.array([math.sin(omega * t + turn), omega * math.cos(omega * t + turn)])

    def rates(t: float, state: Array) -> Array:
        z, w = state - ground(t)
        push = 4.0 * max((state[0] if stays else z) - 0.2, 0.0)
        force = amplitude * math.sin(omega * t + phase)
        return np.array([state[1], force - 0.1 * w - z - push])

    start = orbit.start + (0.0 if stays else ground(0.0))
    span = orbit.n * 2.0 * math.pi / omega
    kept = solve_ivp(rates, (0.0, span), start, "DOP853", rtol=1e-11, atol=1e-13)
    assert kept.y[:, -1] == pytest.approx(start, abs=1e-8)
    assert run(model, omega, orbit.start, orbit.n, 4000) == pytest.approx(orbit.start, abs=1e-6)


@pytest.mark.parametrize("shape", SHAPES)
def test_an_acceleration_is_a_force_of_that_shape(shape: str) -> None:
    """Where accelerations are given, M A sin(nωt + φ) on the mass is the same system."""
    keys, waves = SHAPES[shape]
    keys = keys.replace("0.05 m", "0.05 m/s²")
    moved = parse_model_file(BLOCK + STOP + base(keys, '"0.3 m/s²"')).model
    first = next(wave for wave in waves if wave[0] == 1)
    more = [[n, 2.0 * size, turn] for n, size, turn in waves if n > 1]
    force = f'[[force]]\non = "a"\namplitude = {2.0 * first[1]}\nphase = {first[2]}\n'
    force += f"harmonics = {more}\n" if more else ""
    pushed = parse_model_file(BLOCK + STOP + force).model
    one, two = (settle(model_flow(model, OMEGA), np.zeros(2)) for model in (moved, pushed))
    assert one.response == two.response
    assert one.start == pytest.approx(two.start, abs=1e-9)
    numbers = [rates_of(model.second_order(), OMEGA) for model in (moved, pushed)]
    assert pytest.approx(numbers[1].S, abs=1e-12) == numbers[0].S
    assert pytest.approx(numbers[1].C, abs=1e-12) == numbers[0].C


@pytest.mark.parametrize(
    ("text", "field"),
    [
        (base('harmonics = [[2, "0.1 g", 0.0]]'), "base.harmonics"),
        (base("harmonics = [[1, 0.1, 0.0]]"), "base.harmonics"),
        (base('waveform = "square"'), "base.terms"),
        (base("terms = 3"), "base.waveform"),
        (
            base('phase = 0.1\nstops = "fixed"')
            + table("cubic_spring", between=GROUNDED, k1=0.1, k3=1.0, range=1.0),
            "base.stops",
        ),
        (base('phase = "0.1 m"'), "base.phase"),
    ],
)
def test_what_is_no_shape_is_refused(text: str, field: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_model_file(BLOCK + STOP + text)
    assert caught.value.field == field


def test_it_is_told_in_equations() -> None:
    model = parse_model_file(BLOCK + STOP + base(SHAPES["harmonics"][0])).model
    line = equations_of(model)[-1]  # type: ignore[arg-type]
    assert line == "y = Y sin ωt + Y.2 sin(2ωt + φ.2) + Y.3 sin 3ωt"
