"""Phases in which dry friction holds, against a block that Coulomb's law stops and lets go."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from designer import parse_model_file, simulate
from designer.verbs.simulate import tables

BLOCK = """format = 2
[[mass]]
name = "block"
mass = {mass}
[[spring]]
between = ["block", "ground"]
stiffness = 1.0
[[friction]]
between = ["block", "ground"]
force = {force}
velocity = {velocity}
[[force]]
on = "block"
amplitude = 1.0
[[response]]
omega = {omega}
"""


def coulomb(omega: float, force: float, mass: float) -> tuple[int, float, float]:
    """Phases in one drive period, share of the time and longest phase [drive periods] of a block
    with Coulomb friction, from event to event."""
    period = 2.0 * math.pi / omega
    t, x, v, end = 0.0, 0.0, 0.0, 40 * period
    phases = []
    while t < end:
        others = math.sin(omega * t) - x
        if v == 0.0 and abs(others) <= force:  # it holds until the other forces overcome it
            grid = np.linspace(t, t + period, 200_001)
            beyond = np.flatnonzero(np.abs(np.sin(omega * grid) - x) > force)
            if not len(beyond):
                return 0, 1.0, math.inf
            phases.append((t, grid[beyond[0]]))
            t = grid[beyond[0]]
            others = math.sin(omega * t) - x
        sign = math.copysign(1.0, v if v else others)

        def rates(t: float, y: np.ndarray, sign: float = sign) -> list[float]:
            return [y[1], (math.sin(omega * t) - y[0] - sign * force) / mass]

        def stops(t: float, y: np.ndarray) -> float:
            return float(y[1])

        stops.terminal = True  # type: ignore[attr-defined]
        stops.direction = -sign  # type: ignore[attr-defined]
        run = solve_ivp(
            rates, (t, t + period), [x, v], "DOP853", events=stops, rtol=1e-10, atol=1e-12,
            first_step=1e-6,
        )  # fmt: skip
        t, (x, v) = float(run.t[-1]), run.y[:, -1]
        if run.status == 1:
            v = 0.0
    last = [(a, b) for a, b in phases if end - 2 * period <= a < end - period]
    lengths = [(b - a) / period for a, b in last]
    return len(last), sum(lengths), max(lengths, default=0.0)


@pytest.mark.parametrize(
    ("omega", "force", "mass"),
    [(0.3, 0.2, 1.0), (0.2, 0.5, 1.0), (0.12, 0.2, 1.0), (0.6, 0.2, 1.0)],
)
def test_phases_come_to_those_of_coulomb_s_law(omega: float, force: float, mass: float) -> None:
    phases, share, longest = coulomb(omega, force, mass)
    velocity = 0.004
    text = BLOCK.format(omega=omega, force=force, mass=mass, velocity=velocity)
    (row,) = simulate(parse_model_file(text), starts=0).answer["responses"]
    assert (row["response"], row["n"]) == ("1-0-0", 1)
    (held,) = row["sticking"]
    assert held["friction"] == "block-ground.friction"
    assert (held["periods"], held["phases"]) == (1, phases)
    assert held["share"] == pytest.approx(share, abs=0.01)
    assert held["longest"] == pytest.approx(longest, abs=0.006)


def test_a_block_that_is_never_moved_holds_always(capsys: pytest.CaptureFixture[str]) -> None:
    """And one on a belt that is faster than itself never does; both are told."""
    still = BLOCK.format(omega=0.3, force=1.5, mass=1.0, velocity=0.004)
    answer = simulate(parse_model_file(still), starts=0).answer
    (held,) = answer["responses"][0]["sticking"]
    assert (held["phases"], held["share"], held["longest"]) == (0, 1.0, 1.0)
    tables(answer)
    assert "always" in capsys.readouterr().err
    belt = still.replace("force = 1.5", "force = 0.2\nspeed = 9.0").replace(
        "[[force]]",
        '[[damper]]\nbetween = ["block", "ground"]\ndamping = 0.1\n[[force]]',
    )
    answer = simulate(parse_model_file(belt), starts=0).answer
    (held,) = answer["responses"][0]["sticking"]
    assert (held["phases"], held["share"], held["longest"]) == (0, 0.0, 0.0)
    tables(answer)
    assert "never" in capsys.readouterr().err


def test_the_example_sticks_twice_and_slides_on() -> None:
    file = Path(__file__).parents[2] / "examples" / "dry-friction.toml"
    rows = simulate(file, starts=0).answer["responses"]
    assert [row["sticking"][0]["phases"] for row in rows] == [2, 0]
