"""Phases in which dry friction holds, against a block that Coulomb's law stops and lets go."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from designer import parse_model_file, simulate
from designer.verbs.simulate import tables
from tests.shared.exploring import quick
from tests.shared.system_text import system_text, table


def block(
    omega: float,
    force: float,
    velocity: float,
    mass: float = 1.0,
    damping: float = 0.0,
    **more: float,
) -> str:
    """A block on a spring and on a surface, driven. more : further keys of its friction."""
    return system_text(
        {"block": mass},
        {("block", "ground"): 1.0},
        {("block", "ground"): damping} if damping else {},
        table("friction", between=("block", "ground"), force=force, velocity=velocity, **more),
        table("force", on="block", amplitude=1.0),
        table("response", omega=omega),
    )


def coulomb(
    omega: float, force: float, mass: float, static: float, speed: float
) -> tuple[int, float, float]:
    """Phases in one drive period, share of the time and longest phase [drive periods] of a block
    with Coulomb friction on a belt of this speed, from event to event."""
    period = 2.0 * math.pi / omega
    t, x, v, end = 0.0, 0.0, 0.0, 60 * period
    phases = []
    while t < end:
        others = math.sin(omega * t) - x
        if v == speed and abs(others) <= static:  # held until the other forces overcome it
            grid = np.linspace(t, t + period, 200_001)
            places = x + speed * (grid - t)
            beyond = np.flatnonzero(np.abs(np.sin(omega * grid) - places) > static)
            if not len(beyond):
                return 0, 1.0, math.inf
            phases.append((t, grid[beyond[0]]))
            t, x = float(grid[beyond[0]]), float(places[beyond[0]])
            others = math.sin(omega * t) - x
        sign = math.copysign(1.0, v - speed if v != speed else others)

        def rates(t: float, y: np.ndarray, sign: float = sign) -> list[float]:
            return [y[1], (math.sin(omega * t) - y[0] - sign * force) / mass]

        def stops(t: float, y: np.ndarray) -> float:
            return float(y[1] - speed)

        stops.terminal = True  # type: ignore[attr-defined]
        stops.direction = -sign  # type: ignore[attr-defined]
        run = solve_ivp(
            rates, (t, t + period), [x, v], "DOP853", events=stops, rtol=1e-10, atol=1e-12,
            first_step=1e-6,
        )  # fmt: skip
        t, (x, v) = float(run.t[-1]), run.y[:, -1]
        if run.status == 1:
            v = speed
    last = [(a, b) for a, b in phases if end - 2 * period <= a < end - period]
    lengths = [(b - a) / period for a, b in last]
    return len(last), sum(lengths), max(lengths, default=0.0)


@pytest.mark.parametrize(
    ("omega", "force", "mass", "static", "speed"),
    quick(
        [
            (0.3, 0.2, 1.0, 0.2, 0.0),
            (0.2, 0.5, 1.0, 0.5, 0.0),
            (0.25, 0.3, 1.5, 0.3, 0.0),
            (0.12, 0.2, 1.0, 0.2, 0.0),
            (0.3, 0.2, 1.0, 0.3, 0.0),
            (0.3, 0.3, 1.0, 0.3, 0.15),
            (0.6, 0.2, 1.0, 0.2, 0.0),
        ]
    ),
)
def test_phases_come_to_those_of_coulomb_s_law(
    omega: float, force: float, mass: float, static: float, speed: float
) -> None:
    phases, share, longest = coulomb(omega, force, mass, static, speed)
    velocity = 0.004
    more = {"speed": speed}
    if static > force:
        more |= {"static": static, "stribeck": 1.5 * velocity}
    text = block(omega, force, velocity, mass, **more)
    (row,) = simulate(parse_model_file(text), starts=0).answer["responses"]
    assert (row["response"], row["n"]) == ("1-0-0", 1)
    (held,) = row["sticking"] or ()
    assert held["friction"] == "block-ground.friction"
    assert (held["periods"], held["phases"]) == (1, phases)
    assert held["share"] == pytest.approx(share, abs=0.01)
    assert held["longest"] == pytest.approx(longest, abs=0.006)
    assert held["creep"] <= velocity if phases else held["creep"] == 0.0


TWO = system_text(
    {"block": 1.0, "sled": 2.0},
    {("sled", "ground"): 3.0, ("block", "sled"): 1.0},
    {("sled", "ground"): 0.4},
    table("friction", between=("block", "sled"), force=0.4, velocity=0.01),
    table("force", on="sled", amplitude=4.0),
    table("response", omega=0.5),
)


def test_of_two_bodies_it_is_where_they_move_together() -> None:
    """The effective mass is that of both; the phases are those of their difference in velocity,
    which is flat there."""
    made = simulate(parse_model_file(TWO), starts=0)
    (row,) = made.answer["responses"]
    (held,) = row["sticking"] or ()
    period = 2.0 * math.pi / 0.5
    grid = np.linspace(0.0, row["n"] * period, 20_001)
    states = made[0].motion(grid)
    slip = (states["x1'"] - states["x2'"]).to_numpy()
    # Sliding, the difference of the accelerations is of the order of the forces over the masses.
    flat = (np.abs(slip) <= 0.01) & (np.abs(np.gradient(slip, grid)) < 0.05)
    assert 0.1 < held["share"] < 0.9
    assert held["share"] == pytest.approx(flat.mean(), abs=0.03)
    assert held["phases"] == np.count_nonzero(np.diff(np.concatenate([flat, flat[:1]]) * 1) == 1)


def test_with_half_the_clearance_forces_and_velocities_are_half() -> None:
    text = block(0.3, 0.4, 0.008)
    halved: Any = simulate(parse_model_file(text + "b = 0.5\n"), starts=0).answer
    plain = block(0.3, 0.2, 0.004)
    whole: Any = simulate(parse_model_file(plain), starts=0).answer
    (one,), (other,) = halved["responses"][0]["sticking"], whole["responses"][0]["sticking"]
    assert one["phases"] == other["phases"] == 2
    assert one["share"] == pytest.approx(other["share"], abs=0.002)
    assert one["creep"] == pytest.approx(other["creep"], rel=0.02)


@pytest.mark.slow
def test_on_the_circuit_it_is_as_on_the_model() -> None:
    file = Path(__file__).parents[2] / "examples" / "dry-friction.toml"
    model, circuit = (
        simulate(file, engine=engine, starts=0).answer["responses"]
        for engine in ("model", "circuit")
    )
    for one, other in zip(model, circuit, strict=True):
        (held,), (on_board,) = one["sticking"] or (), other["sticking"] or ()
        assert on_board["phases"] == held["phases"]
        assert on_board["share"] == pytest.approx(held["share"], abs=0.01)
        assert on_board["creep"] == pytest.approx(held["creep"], rel=0.1)


def test_a_block_that_is_never_moved_holds_always(capsys: pytest.CaptureFixture[str]) -> None:
    """And one on a belt that is faster than itself never does; both are told."""
    still = block(0.3, 1.5, 0.004)
    answer = simulate(parse_model_file(still), starts=0).answer
    (held,) = answer["responses"][0]["sticking"] or ()
    assert (held["phases"], held["share"], held["longest"]) == (0, 1.0, 1.0)
    tables(answer)
    assert "always" in capsys.readouterr().err
    belt = block(0.3, 0.2, 0.004, damping=0.1, speed=9.0)
    answer = simulate(parse_model_file(belt), starts=0).answer
    (held,) = answer["responses"][0]["sticking"] or ()
    assert (held["phases"], held["share"], held["longest"]) == (0, 0.0, 0.0)
    tables(answer)
    assert "never" in capsys.readouterr().err


def test_the_example_sticks_twice_and_slides_on() -> None:
    file = Path(__file__).parents[2] / "examples" / "dry-friction.toml"
    rows = simulate(file, starts=0).answer["responses"]
    assert [held["phases"] for row in rows for held in row["sticking"] or ()] == [2, 0]
