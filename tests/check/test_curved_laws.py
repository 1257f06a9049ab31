"""Cubic springs and Hertzian stops whose pieces are off where a motion draws them: against the
amplitude of a linear oscillator, and against a solver that knows the law itself."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from designer import bifurcation, simulate, synthesise
from designer.answers.shared_rows import SpringMisfit
from designer.base.arrays import Array
from designer.explorer.place import read_place
from designer.explorer.response_view import facts, reached as reached_at
from designer.folders import design_files
from designer.laws.law_elements import cubic_points
from designer.model.model_file import ModelFile, parse_model_file
from designer.verbs.bifurcation import show
from designer.verbs.simulate import tables
from tests.shared.system_text import table

OMEGA, DAMPING, FORCE = 1.4, 0.2, 1.0
LINEAR = FORCE / math.hypot(1.0 - OMEGA**2, DAMPING * OMEGA)


def text(
    k3: float, span: float, between: tuple[str, str] = ("m", "ground"), points: int = 8
) -> str:
    """One mass on a cubic spring."""
    return (
        "format = 2\n"
        + table("mass", name="m", mass=1.0)
        + table("cubic_spring", between=list(between), k1=1.0, k3=k3, range=span, points=points)
        + table("damper", between=["m", "ground"], damping=DAMPING)
        + table("force", on="m", amplitude=FORCE)
        + table("response", omega=OMEGA)
    )


def beyond(modelfile: ModelFile) -> list[SpringMisfit]:
    (row,) = simulate(modelfile, starts=8).answer["responses"]
    return list(row.get("beyond_range", []))


@pytest.mark.parametrize("between", [("m", "ground"), ("ground", "m")])
def test_the_reach_is_that_of_the_linear_motion(between: tuple[str, str]) -> None:
    """With hardly a cube the amplitude is known."""
    (spring,) = beyond(parse_model_file(text(1e-9, 0.9 * LINEAR, between)))
    assert spring["between"] == list(between)
    assert spring["range"] == pytest.approx(0.9 * LINEAR)
    assert spring["reached"] == pytest.approx(LINEAR, rel=1e-3)
    assert not beyond(parse_model_file(text(1e-9, 1.01 * LINEAR, between)))


def test_a_sweep_and_the_page_with_sliders_say_so_too(capsys: pytest.CaptureFixture[str]) -> None:
    """Of a window the step that goes furthest beyond the range."""
    modelfile = parse_model_file(text(1e-9, 0.9 * LINEAR))
    made = bifurcation(modelfile, from_=1.3, to=OMEGA, steps=3, points=False, jobs=1)
    answer: Any = made.answer
    (window,) = answer["windows"]
    (spring,) = window["beyond_range"]
    reached = FORCE / math.hypot(1.0 - 1.3**2, DAMPING * 1.3)
    assert spring["reached"] == pytest.approx(reached, rel=1e-3)
    show(made)
    told = " ".join(capsys.readouterr().err.split())
    assert f"1.3 to 1.4: 1-0-0 draws the cubic spring between m and ground to {reached:.4g}" in told
    place = read_place(modelfile, {"omega": str(OMEGA)})
    (said,) = (value for name, value in facts(reached_at(place)[1], place) if name == "curved law")
    assert said.startswith(f"1-0-0 draws the cubic spring between m and ground to {LINEAR:.4g}")


def test_of_two_orbits_of_one_name_each_window_tells_its_own() -> None:
    """A hardening spring past its resonance: the sweep up stays on the large orbit, the sweep down
    on the small one, about F/(ω² - 1)."""
    stiff = text(1.0, 1.0).replace(f"damping = {DAMPING}", "damping = 0.05")
    modelfile = parse_model_file(stiff.replace(f"amplitude = {FORCE}", "amplitude = 0.2"))
    made = bifurcation(
        modelfile, from_=1.0, to=1.6, steps=7, up=True, down=True, points=False, jobs=1
    )
    answer: Any = made.answer
    down, up = answer["windows"]
    assert (down["track"], up["track"]) == ("down", "up")
    assert (down["response"], down["symmetric"]) == (up["response"], up["symmetric"])
    assert up["beyond_range"][0]["reached"] > 1.0
    assert "beyond_range" not in down
    assert down["coarse_range"][0]["reached"] == pytest.approx(0.2 / (1.6**2 - 1.0), rel=0.1)


def peak_of(k3: float) -> float:
    """Amplitude from rest with the cube itself."""

    def rates(t: float, x: Array) -> list[float]:
        force = FORCE * math.sin(OMEGA * t) - x[0] - k3 * x[0] ** 3 - DAMPING * x[1]
        return [x[1], force]

    period = 2.0 * math.pi / OMEGA
    ends = 60.0 * period, 64.0 * period
    late = solve_ivp(rates, (0.0, ends[1]), [0.0, 0.0], "DOP853", rtol=1e-10, atol=1e-10,
        t_eval=np.linspace(*ends, 4000))  # fmt: skip
    return float(late.y[0].max())


def test_what_stays_inside_the_range_is_the_cube_s_motion(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Beyond it the answer is another one, and is told so; inside it agrees with the cube."""
    peak = peak_of(0.1)
    wide, narrow = text(0.1, 1.6), text(0.1, 0.5)
    inside = simulate(parse_model_file(wide), starts=8).answer["responses"][0]
    assert inside["x1_max"] == pytest.approx(peak, rel=0.02)
    assert "beyond_range" not in inside
    file = tmp_path / "narrow.toml"
    file.write_text(narrow, encoding="utf-8")
    made = simulate(file, starts=8)
    answer: Any = made.answer
    (row,) = answer["responses"]
    assert abs(row["x1_max"] / peak - 1.0) > 0.04
    (spring,) = row["beyond_range"]
    assert spring["reached"] == pytest.approx(row["x1_max"], rel=1e-3)
    told = f"draws the cubic spring between m and ground to {spring['reached']:.4g}, beyond the"
    tables(made.answer)
    assert told in " ".join(capsys.readouterr().err.split())


def test_a_motion_over_few_pieces_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    """The error that a file states counts against the force at the end of the range."""
    peak = peak_of(1.0)
    made = simulate(parse_model_file(text(1.0, 6.0)), starts=8)
    answer: Any = made.answer
    (row,) = answer["responses"]
    assert abs(row["x1_max"] / peak - 1.0) > 0.05
    assert "beyond_range" not in row
    (spring,) = row["coarse_range"]
    # The first of the minimax pieces of x³, up to e, has the slope 3 e²/4 (Chebyshev).
    reached, end = spring["reached"], cubic_points(1.0, 1.0, 6.0, 8)[4][0]
    assert reached < 0.5 * end
    off = 0.75 * end**2 * reached - reached**3
    assert spring["error"] == pytest.approx(off / (reached + reached**3), rel=1e-6)
    tables(made.answer)
    told = f"to {reached:.4g} of the range of 6, where few points stand for the law"
    assert told in " ".join(capsys.readouterr().err.split())
    (fine,) = simulate(parse_model_file(text(1.0, 1.6, points=20)), starts=8).answer["responses"]
    assert fine["x1_max"] == pytest.approx(peak, rel=0.01)
    assert "coarse_range" not in fine


@pytest.mark.slow
@pytest.mark.usefixtures("figures_are_blank")
def test_a_circuit_of_it_says_so_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(design_files, "start_recipes", lambda made, *_: [None])
    modelfile = parse_model_file(text(0.1, 0.9))
    made = synthesise(modelfile, out=tmp_path / "made")
    (warning,) = [w for w in made.answer["warnings"] if "cubic spring" in w]
    assert warning.startswith("At ω = 1.4 the response 1-0-0 draws the cubic spring")
    (row,) = simulate(tmp_path / "made", engine="circuit", starts=8).answer["responses"]
    assert row["beyond_range"][0]["range"] == pytest.approx(0.9)
    swept: Any = bifurcation(
        tmp_path / "made", circuit=True, over="omega", from_=1.4, to=1.41, steps=2, points=False
    )
    (window,) = swept.answer["windows"]
    assert window["beyond_range"][0]["reached"] == pytest.approx(
        row["beyond_range"][0]["reached"], rel=1e-3
    )


STOP = 0.3


def on_a_ball(depth: float, pieces: int = 4) -> str:
    """One mass on a linear spring that meets a ball."""
    return (
        "format = 2\n"
        + table("mass", name="m", mass=1.0)
        + table("spring", between=["m", "ground"], stiffness=1.0)
        + table("damper", between=["m", "ground"], damping=DAMPING)
        + table("clearance", name="A", between=["m", "ground"], upper=STOP, law="hertz",
                constant=8.0, depth=depth, pieces=pieces)
        + table("force", on="m", amplitude=FORCE)
        + table("response", omega=OMEGA)
    )  # fmt: skip


def peak_on_a_ball() -> float:
    """Largest displacement from rest with the Hertzian law itself."""

    def rates(t: float, x: Array) -> list[float]:
        stop = 8.0 * max(x[0] - STOP, 0.0) ** 1.5
        return [x[1], FORCE * math.sin(OMEGA * t) - x[0] - stop - DAMPING * x[1]]

    period = 2.0 * math.pi / OMEGA
    ends = 60.0 * period, 64.0 * period
    late = solve_ivp(rates, (0.0, ends[1]), [0.0, 0.0], "DOP853", rtol=1e-10, atol=1e-10,
        max_step=period / 100, t_eval=np.linspace(*ends, 4000))  # fmt: skip
    return float(late.y[0].max())


@pytest.mark.parametrize(
    ("depth", "key", "told"),
    [
        (0.05, "beyond_depth", "beyond the depth of 0.05, where the force goes on straight"),
        (20.0, "coarse_depth", "of the depth of 20, where few pieces stand for the law"),
    ],
)
def test_stops_that_are_not_laid_for_the_motion_are_told(
    depth: float, key: str, told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    peak = peak_on_a_ball()
    answer: Any = simulate(parse_model_file(on_a_ball(depth)), starts=8).answer
    (row,) = answer["responses"]
    assert abs(row["x1_max"] / peak - 1.0) > 0.02
    (stops,) = row[key]
    assert (stops["clearance"], stops["depth"]) == ("A", depth)
    assert stops["reached"] == pytest.approx(row["x1_max"] - STOP, rel=1e-2)
    assert stops["error"] > 0.05
    tables(answer)
    assert told in " ".join(capsys.readouterr().err.split())


def test_stops_that_are_laid_for_the_motion_are_those_of_the_law() -> None:
    peak = peak_on_a_ball()
    depth = 1.1 * (peak - STOP)
    (row,) = simulate(parse_model_file(on_a_ball(depth)), starts=8).answer["responses"]
    assert row["x1_max"] == pytest.approx(peak, rel=5e-3)
    assert not {"beyond_depth", "coarse_depth"} & set(row)
