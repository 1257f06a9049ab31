"""``simulate`` and ``bifurcation`` from the command line: any masses, any clearances."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from designer.cli import entry
from tests.shared.system_text import clearance, system_text, table

Captured = pytest.CaptureFixture[str]

SHAKEN = system_text(
    {"block": "2 kg"},
    {("block", "ground"): "8 kN/m"},
    {("block", "ground"): "12 N s/m"},
    clearance("A", "block", "ground", upper="4 mm", stiffness="40 kN/m"),
    '[base]\namplitude = "3 mm"\nstops = "fixed"\n',
    table("response", frequency="11 Hz", expect="1-1-0"),
)

CHAIN = system_text(
    {"tool": 1.0, "ram": 2.0, "frame": 4.0},
    {("tool", "ram"): 2.0, ("ram", "frame"): 1.0, ("frame", "ground"): 3.0},
    {("tool", "ram"): 0.1, ("ram", "frame"): 0.15, ("frame", "ground"): 0.2},
    clearance(
        "A", "tool", "ground", upper=0.5, lower=0.3, upper_stiffness=20.0, lower_stiffness=12.0
    ),
    clearance("B", "tool", "ram", upper=0.2, stiffness=15.0),
    table("force", on="tool", amplitude=1.0),
    table("response", omega=2.0),
)


@pytest.fixture
def file(tmp_path: Path, request: pytest.FixtureRequest) -> str:
    path = tmp_path / "model.toml"
    path.write_text(request.param, encoding="utf-8")
    return str(path)


def answer_of(capfd: Captured, *words: str) -> Any:
    status = entry.status([*words, "--json", "-q"])
    printed = capfd.readouterr()
    assert printed.err == ""
    assert status in (0, 1)
    return json.loads(printed.out)


def shaken(response: dict[str, Any], base: float = 3e-3) -> NDArray[np.float64]:
    """Absolute displacement of ``SHAKEN`` over a period, densely, by an independent integrator of
    the equation in absolute displacements."""
    omega = response["omega"]

    def rate(t: float, s: NDArray[np.float64]) -> list[float]:
        x, v = s
        y, dy = base * np.sin(omega * t), base * omega * np.cos(omega * t)
        return [v, (-8e3 * (x - y) - 12.0 * (v - dy) - 40e3 * max(x - 4e-3, 0.0)) / 2.0]

    start = response["start"]  # absolute, since the stops stay
    period = 2.0 * np.pi / omega
    steps = np.linspace(0.0, period, 4001)
    tight: dict[str, Any] = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-14}
    run = solve_ivp(rate, (0.0, period), start, t_eval=steps, **tight)
    assert run.y[:, -1] == pytest.approx(start, abs=1e-7)
    return np.asarray(run.y[0])


@pytest.mark.parametrize("file", [SHAKEN], indirect=True)
def test_displacements_are_absolute_where_the_base_moves(file: str, capfd: Captured) -> None:
    answer = answer_of(capfd, "simulate", file, "--starts", "3")
    (r,) = answer["responses"]
    assert answer["masses"] == ["block"]
    assert answer["clearances"] == ["A"]
    assert (r["response"], r["found"]) == ("1-1-0", True)
    assert r["omega"] == pytest.approx(2.0 * np.pi * r["frequency_hz"], rel=1e-15)
    x = shaken(r)
    fine = 1e-6 * np.ptp(x)  # a parabola's top between two of 4000 samples
    assert r["x_max"] == pytest.approx([x.max()], abs=fine)
    assert r["x_min"] == pytest.approx([x.min()], abs=fine)
    assert [r["x1_min"], r["x1_max"]] == [r["x_min"][0], r["x_max"][0]]
    z = x - 3e-3 * np.sin(np.linspace(0.0, 2.0 * np.pi, len(x)))
    assert r["from_base_max"] == pytest.approx([z.max()], abs=fine)
    assert abs(r["x_max"][0] - r["from_base_max"][0]) > 1e-4
    assert r["extremes"]["x1"] == [r["x_min"][0], r["x_max"][0]]
    assert [impact["clearance"] for impact in r["impacts"]] == ["A"]


ACCELERATED = SHAKEN.replace('"3 mm"', '"14 m/s²"')


@pytest.mark.slow
@pytest.mark.parametrize("file", [ACCELERATED], indirect=True)
def test_displacements_from_a_base_of_given_acceleration(
    file: str, tmp_path: Path, capfd: Captured
) -> None:
    """At each frequency against the independent integrator with a displacement of a/ω²."""
    words = ("--frequency", "11 Hz", "--frequency", "12.5 Hz", "--starts", "3")
    answer = answer_of(capfd, "simulate", file, *words)
    for r in answer["responses"]:
        base = 14.0 / r["omega"] ** 2
        x = shaken(r, base)
        steps = np.linspace(0.0, 2.0 * np.pi, len(x))
        z = x - base * np.sin(steps)
        fine = 1e-6 * np.ptp(x)
        assert r["base_amplitude"] == pytest.approx(base)
        assert [*r["x_min"], *r["x_max"]] == pytest.approx([x.min(), x.max()], abs=fine)
        ends = [*r["from_base_min"], *r["from_base_max"]]
        assert ends == pytest.approx([z.min(), z.max()], abs=fine)
    plots = tmp_path / "plots"
    assert entry.status(["simulate", file, *words[:2], "--starts", "2", "--plots", str(plots)]) == 0
    said = capfd.readouterr().err
    for text in ("Displacements from the base", "x1 − y (block)", "11 Hz   ", "± 2.931 mm"):
        assert text in said
    assert "rad/s" not in said
    assert "e-0" not in said
    (picture,) = plots.glob("*-time.svg")
    drawn = picture.read_text("utf-8")
    for text in ("11 Hz: 1-1-0", "x₁ − y (block, from the base) [mm]", "x₁ (block) [mm]"):
        assert text in drawn


@pytest.mark.slow
@pytest.mark.parametrize("file", [CHAIN], indirect=True)
def test_several_masses_and_clearances(file: str, capfd: Captured, tmp_path: Path) -> None:
    plots = tmp_path / "plots"
    assert entry.status(["simulate", file, "--starts", "2", "--plots", str(plots)]) == 0
    table = capfd.readouterr().err
    for head in ("x1 (tool)", "x2 (ram)", "x3 (frame)"):
        assert head in table
    assert "twin)" not in table  # unequal stops have no mirror
    assert sorted(path.name for path in plots.glob("*.svg")) == [
        "omega-2-phase.svg", "omega-2-section.svg", "omega-2-spectrum.svg", "omega-2-time.svg",
    ]  # fmt: skip
    assert len((plots / "omega-2-phase.svg").read_text("utf-8")) > 1000
    (r,) = answer_of(capfd, "simulate", file, "--starts", "2")["responses"]
    extremes = [r["extremes"][name] for name in ("x1", "x2", "x3")]
    assert [list(pair) for pair in zip(r["x_min"], r["x_max"], strict=True)] == extremes
    mapped = answer_of(
        capfd, "bifurcation", file, "--over", "tool-ram.stiffness", "--from", "1.9", "--to", "2.1",
        "--steps", "2", "--map", "B.upper", "0.1", "0.3", "2", "--periods", "20", "--keep", "2",
    )  # fmt: skip
    assert sum(mapped["counts"].values()) == 4


@pytest.mark.parametrize("file", [SHAKEN], indirect=True)
def test_parameters_are_swept_in_their_units(file: str, capfd: Captured, tmp_path: Path) -> None:
    words = ["bifurcation", file, "--steps", "2", "--no-points", "--periods", "50", "--keep", "2"]
    over = ["--over", "A.upper", "--from", "3.5 mm", "--to", "0.004"]
    swept = answer_of(capfd, *words, *over, "--out", str(tmp_path / "gap"))
    ends = [swept["windows"][0]["from"], swept["windows"][-1]["to"]]
    assert ends == pytest.approx([3.5e-3, 4e-3])
    assert swept["unit"] == "m"
    assert entry.status([*words, *over]) == 0
    said = capfd.readouterr().err
    assert "3.5 mm" in said
    assert "0.0035" not in said
    over = ["--over", "block-ground.stiffness", "--from", "8 kN/m", "--to", "9 kN/m"]
    assert answer_of(capfd, *words, *over)["windows"][-1]["to"] == 9e3
    swept = answer_of(capfd, *words, "--from", "11 Hz", "--to", "12 Hz")
    assert (swept["unit"], swept["si_unit"]) == ("rad/s", "Hz")
    assert swept["windows"][0]["from"] == pytest.approx(22.0 * np.pi)
    for wrong, expected in (("b", "b has no unit"), ("block.mass", "a text in kg")):
        assert entry.status([*words, "--over", wrong, "--from", "1 mm", "--to", "2"]) == 2
        assert expected in capfd.readouterr().err


def test_n_p_q_names_every_clearance(tmp_path: Path, capfd: Captured) -> None:
    path = tmp_path / "model.toml"
    for text, expected in ((CHAIN, "1-p-q;p-q, for the clearances A, B"), (SHAKEN, "1-p-q")):
        wrong = "1-1-0" if text == CHAIN else "1-1-0;0-0"
        text = text.replace('expect = "1-1-0"\n', "") + f'expect = "{wrong}"\n'
        path.write_text(text, encoding="utf-8")
        assert entry.status(["simulate", str(path)]) == 2
        message = capfd.readouterr().err
        assert f"response[1].expect: found {wrong}" in message
        assert f"as in {expected}" in message
