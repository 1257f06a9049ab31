"""Jumps between orbits of one name, and windows that one orbit goes through: a mass whose spring is
stiffer from 0.5 on, once as stops, whose impacts are counted, and once as a law, which is not.

Both are the same equations. As stops they tell by names what the law shows without them.
"""

from __future__ import annotations

import numpy as np
import pytest

from designer.bifurcations import sweep
from designer.bifurcations.sweep import Sweep, SweepPlan, follow
from designer.bifurcations.window_ends import families
from designer.dynamics.steady_state import TransientSettings
from designer.model.model_file import parse_model_file
from designer.model.swept_model import ModelSubject
from tests.shared.system_text import clearance, system_text, table

GROUND = ("mass", "ground")
LAW = table("law", name="L", between=GROUND, points=[[-1.5, -19], [-0.5, 0], [0.5, 0], [1.5, 19]])


def swept(low: float, high: float, steps: int, *, counted: bool) -> Sweep:
    """Down and up. counted : whether the stiffer spring is two stops, or a law beside stops that
    nothing reaches."""
    stop = 0.5 if counted else 50.0
    file = parse_model_file(
        system_text(
            {"mass": 1.0},
            {GROUND: 1.0},
            {GROUND: 0.2},
            clearance("A", *GROUND, upper=stop, lower=stop, stiffness=19.0),
            "" if counted else LAW,
            table("force", on="mass", amplitude=1.0),
            table("response", omega=1.0),
        )
    )
    values, course = np.linspace(low, high, steps), TransientSettings(150, 8, 400)
    tracks = follow("down", "up")
    return sweep.run(SweepPlan(ModelSubject(file.model), "omega", values, course=course, **tracks))


def shown(made: Sweep) -> list[tuple[str, str, int]]:
    return [(w.track, w.response, w.steps) for w in made.windows]


def test_a_window_ends_where_the_sweep_jumps_to_another_orbit_of_its_name() -> None:
    """Down, the small motion jumps to the large one at a fold; up, the large one goes on. The stops
    say by their impacts where; the law's motions have none."""
    stops = swept(1.62, 2.58, 25, counted=True)
    assert shown(stops) == [("down", "1-1-1", 3), ("down", "1-0-0", 22), ("up", "1-1-1", 25)]
    law = swept(1.62, 2.58, 25, counted=False)
    assert shown(law) == [("down", "1-0-0", 3), ("down", "1-0-0", 22), ("up", "1-0-0", 25)]
    assert families(stops) == families(law) == (1, 2, 1)


@pytest.mark.slow
def test_windows_that_an_orbit_goes_through_are_one_family() -> None:
    """The asymmetric orbit gains an impact by grazing and loses it again; the law has no impacts,
    and one window. The sweeps come to twins, which are two orbits, and leave by a pitchfork for the
    symmetric one, which is another."""
    stops = swept(0.48, 0.56, 5, counted=True)
    down = [("down", name, steps) for name, steps in (("1-2-2", 1), ("1-3-2", 1), ("1-2-2", 2))]
    up = [("up", name, steps) for name, steps in (("1-2-2", 1), ("1-2-3", 1), ("1-2-2", 2))]
    symmetric = ("1-2-2", 1)
    assert shown(stops) == [*down, ("down", *symmetric), *up, ("up", *symmetric)]
    assert families(stops) == (1, 1, 1, 2, 3, 3, 3, 2)
    law = swept(0.48, 0.56, 5, counted=False)
    assert [w.steps for w in law.windows] == [4, 1, 4, 1]
    assert families(law) == (1, 2, 3, 2)
