"""What changes at a point, by direction, and titles that say what a picture shows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from designer.bifurcations import (
    basins,
    parameter_map,
    sweep,
    window_ends,
)
from designer.bifurcations.basins import BasinPlan
from designer.bifurcations.parameter_map import MapPlan
from designer.bifurcations.points import Bifurcation
from designer.bifurcations.sweep import Sweep, SweepPlan
from designer.circuit.swept_board import UNITS, BoardSubject
from designer.cli import entry
from designer.dynamics import attractors
from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive
from designer.dynamics.steady_state import TransientSettings
from designer.model.model_file import parse_model_file
from designer.model.swept_model import ModelSubject
from designer.plots import bifurcation_plots, captions, point_captions, titles
from tests.dynamics.test_modal_tables import PAPER
from tests.shared.figure_text import clipped, overlapping

QUICK = TransientSettings(40, 16, 400)
ONE_STOP = """
format = 2
[[mass]]
name = "m"
mass = 1.0
[[spring]]
between = ["m", "ground"]
stiffness = 1.0
[[damper]]
between = ["m", "ground"]
damping = 0.1
[[clearance]]
name = "A"
between = ["m", "ground"]
upper = 0.5
stiffness = 10.0
[[force]]
on = "m"
amplitude = 1.0
"""


@pytest.fixture(scope="module")
def both() -> Sweep:
    """From below the end of 1-1-2 to above the pitchfork, down and up."""
    values = np.linspace(1.30, 1.55, 101)
    return sweep.run(SweepPlan(ModelSubject(PAPER), "omega", values, ("down", "up")), jobs=2)


@pytest.fixture(scope="module")
def points(both: Sweep) -> list[Bifurcation]:
    return window_ends.locate(both, jobs=2)


def _settled(omega: float, start: Any) -> tuple[str, bool | None]:
    flow = Flow(PAPER.second_order().piecewise_linear(), Drive(omega))
    orbit = attractors.settle(flow, start)
    return orbit.response, orbit.symmetric


@pytest.mark.slow
def test_what_changes_is_told_for_each_direction(both: Sweep, points: list[Bifurcation]) -> None:
    """At the pitchfork a track loses or gains the symmetry; a fold ends an orbit for the track
    that comes from it, and the other does not meet it. Settling from the orbit's own state, past
    the point, says the same."""
    (fork,) = [p for p in points if p.kind == "pitchfork" and p.value > 1.4]
    symmetric, asymmetric = "1-1-1 symmetric", "1-1-1 asymmetric"
    told = {c.track: c.text for c in captions.changes(both, fork)}
    assert told == {
        "down": f"{symmetric} → {asymmetric}",
        "up": f"{asymmetric} → {symmetric}",
    }
    ends = [
        (p, c)
        for p in points
        if p.kind == "fold"
        for c in captions.changes(both, p)
        if c.track is not None and "ends (fold)" in c.text
    ]
    assert ends
    for point, change in ends:
        step = 0.004 if change.track == "up" else -0.004
        assert change.track is not None
        before = both.steps[change.track][
            int(np.searchsorted(both.plan.values, point.value - step / 2))
        ]
        response, _ = _settled(point.value - step / 2, before.start)
        assert captions.family(response) == captions.family(change.before.split()[0])
        gone = _settled(point.value + step, before.start)
        assert point_captions.label(*gone) != change.before


@pytest.mark.slow
def test_a_point_that_no_track_meets_has_no_track(points: list[Bifurcation]) -> None:
    """By a sweep that stays above the pitchfork, its point is only the branch's."""
    (fork,) = [p for p in points if p.kind == "pitchfork" and p.value > 1.4]
    values = np.linspace(1.50, 1.55, 3)
    above = sweep.run(SweepPlan(ModelSubject(PAPER), "omega", values, ("up",), course=QUICK))
    (change,) = captions.changes(above, fork)
    assert (change.track, change.after) == (None, "")
    assert change.text == (
        "pitchfork of 1-1-1 symmetric: stable above, unstable below; "
        "its two asymmetric twins 1-1-1 are born below, stable"
    )


def test_an_orbit_with_impacts_on_one_side_is_not_symmetric() -> None:
    """At grazing 1-1-0 is the orbit without impacts, which is its own mirror image."""
    values = np.linspace(1.6, 1.85, 11)
    system = parse_model_file(ONE_STOP, Path("one.toml")).model
    swept = sweep.run(SweepPlan(ModelSubject(system), "omega", values, ("down",), course=QUICK))
    (grazing,) = [p for p in window_ends.locate(swept) if p.kind == "grazing"]
    assert "1-1-0 asymmetric below, 1-0-0 symmetric above" in point_captions.caption(grazing)


def _texts(figure: Any) -> str:
    said = [figure.get_suptitle()]
    said += [axes.get_ylabel() for axes in figure.axes]
    said += [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    return " ".join(" ".join(said).split())


def test_pictures_can_be_read_alone() -> None:
    few = np.linspace(1.30, 1.55, 11)
    both = sweep.run(SweepPlan(ModelSubject(PAPER), "omega", few, ("down", "up"), course=QUICK))
    said = _texts(bifurcation_plots.diagram(both, name="Small"))
    parts = (
        "Small bifurcation diagram", "over ω, followed down and followed up", "b = 0.25", "ζ = 0.1",
        "impact velocity x₁′ on the upper stop (A1)",
    )  # fmt: skip
    for part in parts:
        assert part in said
    assert "ω = " not in said  # it is swept
    assert ("aperiodic" in said) == any(w.response == "aperiodic" for w in both.windows)
    subject, values = ModelSubject(PAPER, 1.43), np.linspace(0.2, 0.3, 2)
    plan: Any = MapPlan(subject, "b", values, "k0", np.array([0.9, 0.95]), course=QUICK)
    figure = bifurcation_plots.parameter_map(parameter_map.run(plan), "Small")
    assert (clipped(figure), overlapping(figure)) == ([], [])
    said = _texts(figure)
    assert "Small responses n-p-q of the model over b and k₀, from rest" in said
    assert "held: ω = 1.43, m = 0.5" in said
    assert "b = " not in said
    plan = BasinPlan(
        subject, {"omega": 1.43}, "x1", values, "x1'", values, np.zeros(4), course=QUICK
    )
    figure = bifurcation_plots.basins(basins.run(plan), f"Small{' AND RATHER LONG' * 5}")
    assert (clipped(figure), overlapping(figure)) == ([], [])  # heading and legend
    said = _texts(figure)
    assert "by the initial x₁ and x₁′" in said
    assert "ω = 1.43" in said
    assert "b = 0.25" in said


def test_a_board_is_told_in_hertz_and_volts() -> None:
    board: Any = BoardSubject.__new__(BoardSubject)
    board.frequency, board.amplitude, board.offset, board.units = None, 0.5, 0.0, UNITS
    board.states = ("v1", "v2")
    said = titles.title("Small", SweepPlan(board, "frequency", np.array([200.0, 320.0])))
    assert said.splitlines() == [
        "Small",
        "bifurcation diagram of the nominal board over generator frequency, followed down",
        "held: generator amplitude (peak) = 0.5 V, generator offset = 0 V",
    ]


@pytest.mark.slow
def test_aperiodic_stretches_are_in_the_table_and_the_legend(
    capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    model = Path(__file__).parents[2] / "examples" / "paper.toml"
    values = np.linspace(1.2, 1.4, 41)
    plan = SweepPlan(ModelSubject(PAPER), "omega", values, ("down",))
    made = sweep.run(plan)
    stretches = [w for w in made.windows if w.response == "aperiodic"]
    assert stretches
    assert "aperiodic" in _texts(bifurcation_plots.diagram(made))
    words = "--from 1.2 --to 1.4 --steps 41 --no-points".split()
    assert entry.status(["bifurcation", str(model), *words]) == 0
    table = capfd.readouterr().err
    assert table.count("aperiodic") == len(stretches)
    for window in stretches:
        assert f"{window.low:.6g}" in table


def test_help_says_where_each_report_goes(capfd: pytest.CaptureFixture[str]) -> None:
    assert entry.status(["reproduce", "--help"]) == 0
    said = "".join(capfd.readouterr().out.replace("│", " ").split())  # help is wrapped at hyphens
    for name in ("paper-dynamics", "paper-circuit", "tolerance"):
        assert f"reports/{name}" in said
