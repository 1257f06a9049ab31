"""Cubic springs that a motion draws beyond their ranges: against the amplitude of a linear
oscillator, and against a solver that knows the cube itself."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from designer import simulate, synthesise
from designer.base.arrays import Array
from designer.model.model_file import ModelFile, parse_model_file
from designer.verbs.simulate import tables
from tests.shared.system_text import table

OMEGA, DAMPING, FORCE = 1.4, 0.2, 1.0
LINEAR = FORCE / math.hypot(1.0 - OMEGA**2, DAMPING * OMEGA)


def text(k3: float, span: float, between: tuple[str, str] = ("m", "ground")) -> str:
    """One mass on a cubic spring."""
    return (
        "format = 2\n"
        + table("mass", name="m", mass=1.0)
        + table("cubic_spring", between=list(between), k1=1.0, k3=k3, range=span, points=8)
        + table("damper", between=["m", "ground"], damping=DAMPING)
        + table("force", on="m", amplitude=FORCE)
        + table("response", omega=OMEGA)
    )


def beyond(modelfile: ModelFile) -> list[dict[str, object]]:
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


def test_what_stays_inside_the_range_is_the_cube_s_motion(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Beyond it the answer is another one, and is told so; inside it agrees with the cube."""

    def rates(t: float, x: Array) -> list[float]:
        force = FORCE * math.sin(OMEGA * t) - x[0] - 0.1 * x[0] ** 3 - DAMPING * x[1]
        return [x[1], force]

    period = 2.0 * math.pi / OMEGA
    ends = 60.0 * period, 64.0 * period
    late = solve_ivp(rates, (0.0, ends[1]), [0.0, 0.0], "DOP853", rtol=1e-10, atol=1e-10,
        t_eval=np.linspace(*ends, 4000))  # fmt: skip
    peak = float(late.y[0].max())
    wide, narrow = text(0.1, 1.6), text(0.1, 0.5)
    inside = simulate(parse_model_file(wide), starts=8).answer["responses"][0]
    assert inside["x1_max"] == pytest.approx(peak, rel=0.02)
    assert "beyond_range" not in inside
    file = tmp_path / "narrow.toml"
    file.write_text(narrow, encoding="utf-8")
    made = simulate(file, starts=8)
    (row,) = made.answer["responses"]
    assert abs(row["x1_max"] / peak - 1.0) > 0.04
    (spring,) = row["beyond_range"]
    assert spring["reached"] == pytest.approx(row["x1_max"], rel=1e-3)
    told = f"draws the cubic spring between m and ground to {spring['reached']:.4g}, beyond its"
    tables(made.answer)
    assert told in " ".join(capsys.readouterr().err.split())


def test_a_circuit_of_it_says_so_too(tmp_path: Path) -> None:
    modelfile = parse_model_file(text(0.1, 0.9))
    made = synthesise(modelfile, out=tmp_path / "made")
    (warning,) = [w for w in made.answer["warnings"] if "cubic spring" in w]
    assert warning.startswith("At ω = 1.4 the response 1-0-0 draws the cubic spring")
    (row,) = simulate(tmp_path / "made", engine="circuit", starts=8).answer["responses"]
    assert row["beyond_range"][0]["range"] == pytest.approx(0.9)
