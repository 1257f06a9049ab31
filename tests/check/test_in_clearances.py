"""How far a response goes in each clearance, and how fast it meets the stops, against Newton's law
integrated by itself."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from designer import parse_model_file, simulate
from designer.verbs.simulate import tables
from tests.shared.event_integrator import Mechanism
from tests.shared.mechanism_file import mechanism_of
from tests.shared.system_text import clearance, system_text, table

BETWEEN = system_text(
    {"tool": "1 kg", "ram": "1.6 kg"},
    {("tool", "ground"): "2 kN/m", ("ram", "ground"): "5 kN/m"},
    {("tool", "ground"): "6 N s/m", ("ram", "ground"): "9 N s/m"},
    clearance("A", "tool", "ram", upper="1 mm", lower="0.6 mm", stiffness="30 kN/m"),
    clearance("B", "ram", "ground", lower="0.8 mm", stiffness="20 kN/m"),
    table("force", on="tool", amplitude="4 N"),
)
FIXED = system_text(
    {"tool": "1 kg"},
    {("tool", "ground"): "2 kN/m"},
    {("tool", "ground"): "6 N s/m"},
    clearance("A", "tool", "ground", upper="1 mm", stiffness="30 kN/m"),
    "[base]\n" + 'amplitude = "0.6 mm"\nstops = "fixed"\n',
)
POINTS = 8000
"""In the motion that is looked at, here."""


def followed(system: Mechanism, row: Any, periods: int) -> list[tuple[Any, Any]]:
    """(displacements, speeds at entries by side) in each clearance, from the start of a response.
    The stops have no dampers, so that the force is the same on both sides of an entry."""
    n, start = len(system.masses), np.array(row["start"])
    at, rate = (0.0, 0.0) if system.fixed_stops else system.ground(0.0)
    y0 = np.concatenate([start[0::2] + at, start[1::2] + rate])
    span = periods * 2.0 * math.pi / system.omega

    def rates(t: float, y: Any) -> Any:
        past = [[d > 0.0 for d in each] for each in system.distances(t, y)]
        return system.rates(t, y, past)

    grid = np.linspace(0.0, span, POINTS + 1)
    y = solve_ivp(
        rates, (0.0, span), y0, "DOP853", t_eval=grid, rtol=1e-9, atol=1e-12, max_step=span / 500
    ).y.T
    assert y[-1] == pytest.approx(y0, abs=1e-5 * np.abs(y[:, :n]).max() * system.omega)
    out = []
    for gap in system.gaps:
        moved = np.array([system.in_gap(gap, t, each) for t, each in zip(grid, y, strict=True)])
        met: dict[int, list[float]] = {1: [], -1: []}
        for side, _, place, _ in gap.thresholds:
            into = side * moved[:, 0] > place
            first = np.flatnonzero(into[1:] & ~into[:-1]) + 1
            met[side] += [abs(float(moved[i, 1])) for i in first]
        out.append((moved[:, 0], met))
    return out


@pytest.mark.parametrize(("text", "hertz"), [(BETWEEN, 13.0), (BETWEEN, 7.0), (FIXED, 8.0)])
def test_depths_and_speeds_are_those_of_the_motion(
    text: str, hertz: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "it.toml"
    path.write_text(text + table("response", frequency=f"{hertz} Hz"), encoding="utf-8")
    answer: Any = simulate(path, starts=0).answer
    (row,) = answer["responses"]
    system, _ = mechanism_of(path, row["omega"])
    truth = followed(system, row, row["n"])
    assert [each["clearance"] for each in row["in_clearances"]] == list(answer["clearances"])
    stops = 0
    for each, gap, (moved, met) in zip(row["in_clearances"], system.gaps, truth, strict=True):
        size = np.abs(moved).max()
        assert (each["min"], each["max"]) == pytest.approx((moved.min(), moved.max()), rel=1e-4)
        for side, key, springs in ((1, "upper", gap.upper), (-1, "lower", gap.lower)):
            if not springs:
                assert each[key] is None
                continue
            depth = (side * moved).max() - springs[0][0]
            assert each[key]["depth"] == pytest.approx(depth, abs=1e-4 * size)
            assert (each[key]["speed"] is None) == (depth < 0.0)
            if met[side]:
                stops += 1
                assert each[key]["speed"] == pytest.approx(max(met[side]), rel=5e-3)
    assert stops
    tables(answer)
    said = " ".join(capsys.readouterr().err.split())
    assert "furthest into each stop, and fastest impact" in said
    one = next(each for each in row["in_clearances"] if (each["upper"] or {}).get("speed"))
    assert f"{1e3 * one['upper']['depth']:.4g} mm {1e3 * one['upper']['speed']:.4g} mm/s" in said


@pytest.mark.slow
def test_without_a_period_it_is_what_many_periods_show() -> None:
    """A free motion on a torus: the ends of a long integration."""
    text = system_text(
        {"m1": "1 kg", "m2": 1.4},
        {("m1", "ground"): 1.0, ("m2", "m1"): 1.3},
        {("m1", "ground"): 0.05, ("m2", "m1"): 0.05},
        clearance("A", "m1", "ground", upper=0.2, stiffness=8.0),
        table("force", on="m1", amplitude=1.0),
    )
    made = simulate(parse_model_file(text), 1.25, starts=0)
    answer: Any = made.answer
    (row,) = answer["responses"]
    assert row["impacts"] == []
    (each,) = row["in_clearances"]
    motion = made[0].motion(np.linspace(0.0, 200 * 2.0 * math.pi / 1.25, 40_000))
    assert each["max"] == pytest.approx(motion.x1.max(), rel=1e-3)
    assert each["upper"]["depth"] == pytest.approx(motion.x1.max() - 0.2, rel=1e-3)
    into = motion.x1.to_numpy() > 0.2
    entries = np.flatnonzero(into[1:] & ~into[:-1]) + 1
    assert each["upper"]["speed"] == pytest.approx(
        motion["x1'"].to_numpy()[entries].max(), rel=0.02
    )
