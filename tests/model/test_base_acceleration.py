"""A base whose acceleration is given: against closed forms, and against the displacement that it is
at each frequency."""

from __future__ import annotations

import math

import numpy as np
import pytest

from designer.base.errors import InputError
from designer.dynamics.attractors import settle
from designer.dynamics.steady_state import TransientSettings
from designer.explorer.place import read_place
from designer.explorer.saved_model import saved_text
from designer.fidelity import system_runge_kutta
from designer.model.circuit_table import CircuitSpec
from designer.model.driven import model_flow
from designer.model.lumped_system import LumpedSystem
from designer.model.model_file import parse_model_file
from designer.model.si_units import Reader
from designer.model.swept_model import ModelSubject
from designer.synthesis.part_checks import check_system
from tests.shared.system_text import clearance, system_text, table

MASS, SPRING, DAMPER = 2.0, 8e3, 12.0
G = 9.80665
BLOCK = ({"block": "2 kg"}, {("block", "ground"): "8 kN/m"}, {("block", "ground"): "12 N s/m"})
STOP = clearance("A", "block", "ground", upper="4 mm", stiffness="40 kN/m")


def base(amplitude: str, stops: str = "base") -> str:
    return f'[base]\namplitude = {amplitude}\nstops = "{stops}"\n'


def model(*more: str) -> LumpedSystem:
    found = parse_model_file(system_text(*BLOCK, *more)).model
    assert isinstance(found, LumpedSystem)
    return found


def linear(acceleration: float, omega: float) -> complex:
    """Z of the displacement Im(Z exp(iωt)) from the base, without a stop."""
    return acceleration / (SPRING / MASS - omega**2 + 1j * omega * DAMPER / MASS)


@pytest.mark.parametrize(
    ("text", "acceleration"),
    [
        ('"0.05 g"', 0.05 * G),
        ('"50 mg"', 0.05 * G),
        ('"0.4 m/s²"', 0.4),
        ('"0.4 m/s^2"', 0.4),
        ('"400 mm/s²"', 0.4),
    ],
)
def test_without_a_stop_it_is_the_closed_form_at_every_frequency(
    text: str, acceleration: float
) -> None:
    moved = model(base(text))
    omegas = 2.0 * math.pi * np.array([5.0, 10.0, 20.0])
    for omega in omegas:
        z = linear(acceleration, omega)
        orbit = settle(model_flow(moved, omega), np.zeros(2))
        assert orbit.start == pytest.approx([z.imag, omega * z.real], rel=1e-6, abs=1e-9)
    subject = ModelSubject(moved)
    settings = subject.settings([{"omega": omega} for omega in omegas])
    for omega, setting in zip(omegas, settings, strict=True):  # as a sweep over ω has them
        least = setting.steady(np.zeros(2), TransientSettings(settle=200, keep=2)).minima
        assert least == pytest.approx(-abs(linear(acceleration, omega)), rel=1e-5)


@pytest.mark.parametrize("stops", ["base", "fixed"])
@pytest.mark.parametrize("hertz", [8.0, 11.0, 15.0])
def test_it_is_the_displacement_over_omega_squared(stops: str, hertz: float) -> None:
    omega = 2.0 * math.pi * hertz
    given = model(STOP, base('"1.5 g"', stops))
    meant = model(STOP, base(repr(1.5 * G / omega**2), stops))
    ours, theirs = given.second_order(), meant.second_order()
    assert ours.ground(omega) == pytest.approx(theirs.base, rel=1e-14)
    start = np.array([1e-3, 0.1])
    strobes = [model_flow(m, omega).run(start, 3).strobes for m in (given, meant)]
    assert strobes[0] == pytest.approx(strobes[1], rel=1e-9, abs=1e-13)
    coarse = [system_runge_kutta.run(m, omega, start, 1, 200) for m in (given, meant)]
    assert coarse[0] == pytest.approx(coarse[1], rel=1e-10)


def test_a_circuit_has_it_beside_a_force_since_their_ratio_stays() -> None:
    force = table("force", on="block", amplitude="3 N")
    spec = CircuitSpec(dead_zone="rectifier")
    both = model(STOP, force, base('"0.5 g"'))
    check_system(both, spec)
    for omega in (30.0, 90.0):
        wanted = 3.0 + MASS * 0.5 * G
        assert both.second_order().drive_force(omega) == pytest.approx([wanted])
    # Else it takes a channel of its own.
    own = model(STOP, force, base('"0.5 mm"')).second_order()
    assert [own.drive_force(30.0, k) for k in (0, 1)] == pytest.approx([3.0, MASS * 0.45])


def test_it_is_swept_and_saved_in_its_unit() -> None:
    file = parse_model_file(system_text(*BLOCK, STOP, base('"0.5 g"')))
    assert file.model.units["base.amplitude"] == "g"
    read = Reader(file.model, file.si)
    assert read.value("--to", "base.amplitude", "0.8 g") == 0.8
    assert read.value("--to", "base.amplitude", "9.80665 m/s²") == pytest.approx(1.0, rel=1e-15)
    assert read.value("--to", "base.amplitude", "0.8") == 0.8
    with pytest.raises(InputError, match="a text in g or m/s²"):
        read.value("--to", "base.amplitude", "1 mm")
    saved = saved_text(file, read_place(file, {"base.amplitude": "0.8 g"}), [])
    assert 'amplitude = "0.8 g"' in saved
    again = parse_model_file(saved).model
    assert again.second_order().base_acceleration == pytest.approx(0.8 * G, rel=1e-15)


@pytest.mark.parametrize("amplitude", ['"0 g"', '"-1 g"', "0.0", "true", '"1 s"', '"1 m/s"'])
def test_what_is_no_amplitude_is_refused(amplitude: str) -> None:
    with pytest.raises(InputError) as caught:
        model(STOP, base(amplitude))
    assert caught.value.field == "base.amplitude"
    assert 'an acceleration such as "0.5 g"' in caught.value.expected
