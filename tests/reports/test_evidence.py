"""What the reports on the examples show, against closed forms and integrals of their own."""

from __future__ import annotations

import csv
import itertools
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from designer.base.arrays import Array
from designer.model.lumped_system import LumpedSystem
from designer.model.model_file import read_model_file
from reports.makers import (
    double_well,
    example_report,
    frequency_sweep,
    grazing_map,
    instant_impact,
    persistence,
    prestress,
    rattle,
    standing_post,
)
from reports.makers.backbone import backbone
from reports.makers.bilinear import bilinear_frequency
from reports.makers.chain_modes import chain_frequencies
from reports.makers.den_hartog import ideal_amplitude
from reports.makers.first_grazing import first_grazings

EXAMPLES = Path(__file__).parents[2] / "examples"


def system(name: str) -> LumpedSystem:
    model = read_model_file(EXAMPLES / f"{name}.toml").model
    assert isinstance(model, LumpedSystem)
    return model


@pytest.mark.parametrize("stop", grazing_map.STOPS, ids=lambda stop: stop.name)
def test_near_grazing_map_trace_and_determinant_follow_the_theory(
    stop: grazing_map.StopKind,
) -> None:
    measured = grazing_map.grazing_map(system("preloaded"), 0.8, stop)
    power = 0.5 if stop.preload else 1.5
    assert measured.kick_power == pytest.approx(power, abs=2e-3)
    assert measured.trace_power == pytest.approx(power - 1.0, abs=2e-3)
    for shown, expected in zip(
        (measured.kicks, measured.traces, measured.determinants), measured.expected.T, strict=True
    ):
        assert shown[:2] == pytest.approx(expected[:2], rel=1e-3)


@pytest.mark.parametrize(("m", "lives"), [(2.5, False), (3.0, True)])
def test_period_1_lives_through_grazing_where_m_is_whole(
    m: float, lives: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(persistence, "BEYOND", np.geomspace(1e-3, 0.1, 5))
    passage = persistence.passage(system("aberdeen"), m)
    assert passage.persists == (0.1 if lives else 0.0)


def test_the_grazing_amplitude_of_the_aberdeen_rig() -> None:
    model = system("aberdeen")
    assert persistence.grazing_amplitude(model, 0.8) == pytest.approx(0.709, abs=5e-4)
    (grazing,) = first_grazings(model, 0.8)
    assert persistence.grazing_amplitude(model, 0.8) == pytest.approx(1.0 / grazing.b, rel=1e-12)


@pytest.mark.parametrize("amplitude", [0.51, 0.7, 3.0])
def test_the_backbone_is_the_time_that_energy_takes(amplitude: float) -> None:
    """T/4 = ∫ dx/v with v²/2 the energy that is left."""
    model = system("duffing-gap")
    gap, k, stop = 0.5, 1.0, 19.0

    def potential(x: float) -> float:
        return 0.5 * k * x * x + 0.5 * stop * max(x - gap, 0.0) ** 2

    def slowness(phase: float) -> float:
        x = amplitude * math.sin(phase)
        left = 2.0 * (potential(amplitude) - potential(x))
        return amplitude * math.cos(phase) / math.sqrt(left)

    corner = math.asin(gap / amplitude)
    quarter = sum(quad(slowness, *ends)[0] for ends in ((0.0, corner), (corner, 0.5 * math.pi)))
    assert backbone(model, amplitude) == pytest.approx(0.5 * math.pi / quarter, rel=1e-7)


def test_the_bilinear_frequency_is_that_of_two_half_swings() -> None:
    half = 0.5 * (2.0 * math.pi / 1.0 + 2.0 * math.pi / 3.0)
    assert bilinear_frequency(system("shaw-holmes")) == pytest.approx(2.0 * math.pi / half)


def test_a_force_shared_as_the_masses_does_not_rattle() -> None:
    model = system("backlash")
    quiet = rattle.quiet_share(model)
    assert quiet == pytest.approx(2.0 / 3.0)
    for omega in (0.5, 1.0, 1.7):
        shared = model.changed({"driver.amplitude": 1.0 - quiet, "load.amplitude": quiet})
        assert first_grazings(shared, omega)[0].b < 1e-12


def test_the_modes_of_a_chain() -> None:
    modes = system("three-masses").second_order().natural_frequencies()
    assert modes == pytest.approx(chain_frequencies(3, 1.0, 1.0), rel=1e-12)


@pytest.mark.slow
def test_a_report_without_a_board(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frequency_sweep, "STEPS", 12)
    out = tmp_path / "new" / "three-masses"
    example_report.report(EXAMPLES / "three-masses.toml", out, circuit=False, jobs=1)
    page = (out / "README.md").read_text("utf-8")
    assert "2√(K/M) sin((2k − 1)π/14)" in page
    assert page.startswith("# Three masses and two unequal clearances")
    for name in ("example.json", "first-touches.png", "frequency-sweep.png"):
        assert (out / name).stat().st_size > 1000
        assert name in page


@pytest.mark.slow
def test_a_report_with_a_board(tmp_path: Path) -> None:
    """The cheapest example: its circuit, 20 boards in both engines, the board, and the files that
    stand beside the page."""
    out = tmp_path / "shaw-holmes"
    example_report.report(EXAMPLES / "shaw-holmes.toml", out, samples=20)
    page = (out / "README.md").read_text("utf-8")
    for name in re.findall(r"\]\(([\w.-]+)\)", page):
        assert 200 < (out / name).stat().st_size < 150_000, name
    board = json.loads((out / "example.json").read_text("utf-8"))["parts"][-1]
    assert board["max_error"] < 1e-3
    for answer in board["responses"]:
        assert answer["expected"] == answer["model"] == answer["circuit"] == answer["ngspice"]
        assert answer["yield"]["ok"] == answer["yield"]["samples"] == 20
        assert answer["agreement"]["agreed"] == answer["agreement"]["asked"] > 0
    assert all(finding["passed"] for finding in board["equation_check"]["findings"])
    assert {line["reference"] for line in _bill(out / "bom.csv")} >= {"R1", "C1", "U1"}


def _bill(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return [{**row, "reference": name} for row in rows for name in row["designators"].split()]


def test_bad_input_ends_in_a_message(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert example_report.main([str(tmp_path / "none.toml"), str(tmp_path / "out")]) == 2
    assert "none.toml" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_bounce_that_takes_no_time_repeats_itself() -> None:
    """Newton's law from one impact to the next by another integrator: back at the seat after a
    period for the first time, at the speed of which seven tenths were left."""
    omega, gap = 2.0 * math.pi * 26.0, 1e-3
    bounce = instant_impact.instant(system("restitution"), omega)
    lag = math.atan2(0.4 * omega, 800.0 - 0.05 * omega**2)
    turn = bounce.driven[1] + lag

    def rates(t: float, y: Array) -> Array:
        force = 1.5 * math.sin(omega * t + turn) - 0.4 * y[1] - 800.0 * y[0]
        return np.array([y[1], force / 0.05])

    start = bounce.at(0.0)
    times = np.linspace(0.0, 2.0 * math.pi / omega, 400)
    ends = 0.0, float(times[-1])
    kept = solve_ivp(rates, ends, np.array(start), "DOP853", times, rtol=1e-11, atol=1e-13)
    assert start[0] == pytest.approx(-gap, rel=1e-12)
    assert kept.y[0, -1] == pytest.approx(-gap, rel=1e-8)
    assert kept.y[0, 1:-1].min() > -gap
    assert start[1] == pytest.approx(-0.7 * kept.y[1, -1], rel=1e-8)
    assert start[1] > 0.0


@pytest.mark.parametrize("place", [1.05, 1.3, 1.41, 1.42, 1.6])
def test_a_swing_takes_the_time_that_energy_takes(place: float) -> None:
    """Twice the integral of dx/v between its ends, v²/2 the energy that is left."""
    square = place * place
    near = math.sqrt(2.0 - square) if square < 2.0 else -place
    middle, half = 0.5 * (place + near), 0.5 * (place - near)

    def slowness(angle: float) -> float:
        # x² - x⁴/2 less that at the end is (a² - x²)(x² + a² - 2)/2.
        x = middle + half * math.sin(angle)
        return half * math.cos(angle) / math.sqrt((square - x * x) * (x * x + square - 2.0) / 2.0)

    time = 2.0 * quad(slowness, -0.5 * math.pi, 0.5 * math.pi, epsrel=1e-10, limit=200)[0]
    found = double_well.frequency(system("double-well"), place)
    assert found == pytest.approx(2.0 * math.pi / time, rel=1e-7)


def test_a_small_swing_in_a_well() -> None:
    model = system("double-well")
    assert double_well.frequency(model, 1.0 + 1e-6) == pytest.approx(math.sqrt(2.0), rel=1e-5)
    assert double_well.small(model) == pytest.approx(math.sqrt(2.0))


@pytest.mark.parametrize("omega", [30.0, 70.0, 120.0])
def test_a_post_that_stays_is_touched_by_the_motion_of_the_mass(omega: float) -> None:
    """M x″ = -K (x - y) - C (x - y)′."""
    ratio = abs((6e3 + 12j * omega) / (6e3 + 12j * omega - 1.2 * omega**2))
    wanted = 2e-3 / ratio
    assert standing_post.touching_amplitude(system("fixed-stop"), omega) == pytest.approx(wanted)


def test_the_orbit_of_a_stop_that_pushes_at_once() -> None:
    """By another integrator it comes back to where its contact began, and leaves the stop when it
    says."""
    orbit = prestress.at_once(system("prestressed"), 1.0)

    def rates(t: float, x: Array) -> Array:
        pushed = 1.0 + 29.0 * (x[0] - 1.26) if t < orbit.time else 0.0
        return np.array([x[1], 0.5 * math.sin(orbit.angle + t) - 0.1 * x[1] - x[0] - pushed])

    ends, x = (0.0, orbit.time, 2.0 * math.pi), np.array([1.26, orbit.speed])
    for begin, end in itertools.pairwise(ends):
        within = (begin, np.nextafter(end, begin))
        x = solve_ivp(rates, within, x, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
        assert x[0] == pytest.approx(1.26, abs=1e-9)
        assert (x[1] < 0.0) is (end == orbit.time)
    assert x[1] == pytest.approx(orbit.speed, abs=1e-9)


def test_what_a_rise_is_off_falls_with_its_depth() -> None:
    (evidence,) = prestress.evidence(read_model_file(EXAMPLES / "prestressed.toml"))
    at_once, *rises, end = evidence.comparisons
    assert max(abs(at_once.difference), abs(end.difference)) < 1e-8
    off = [each.difference for each in rises]
    for coarse, fine in itertools.pairwise(off):
        assert fine == pytest.approx(0.1 * coarse, rel=0.01)


@pytest.mark.parametrize("ratio", [0.6, 0.8, 1.5])
def test_den_hartog_s_mass_slides_half_a_period_and_stops(ratio: float) -> None:
    """From its furthest place against the friction, x″ + x + f = sin(ωt + φ), it comes to the
    mirror image of that place half a period later, at rest at both: two equations for x₀ and φ."""
    friction, half = 0.2, math.pi / ratio
    drive = 1.0 / (1.0 - ratio**2)
    # x = f + drive sin(ωt + φ) + a cos t + b sin t while it falls; x′(0) = x′(π/ω) = 0.
    # x(π/ω) = -x(0) gives a (1 + cos half) + b sin half = -2 f, the rates -a sin half + b cos half
    # = -b; with x′(0): b = -ω drive cos φ.
    matrix = [[1.0 + math.cos(half), math.sin(half)], [-math.sin(half), 1.0 + math.cos(half)]]
    a, b = np.linalg.solve(matrix, [-2.0 * friction, 0.0])
    cosine = -b / (ratio * drive)
    reach = friction + a + drive * math.copysign(math.sqrt(1.0 - cosine**2), drive)
    assert ideal_amplitude(system("dry-friction"), ratio) == pytest.approx(reach, rel=1e-12)
