"""The picture of a sweep of a model with two stops in two clearances."""

from __future__ import annotations

import numpy as np
import pytest

from designer.bifurcations import sweep
from designer.bifurcations.sweep import SweepPlan, follow
from designer.dynamics.steady_state import TransientSettings
from designer.model.model_file import parse_model_file, read_model_file
from designer.model.swept_model import ModelSubject
from designer.plots.bifurcation_plots import diagram
from designer.plots.response_colours import response_palette
from tests.shared.figure_text import clipped, overlapping
from tests.shared.house import ROOT
from tests.shared.mechanism_file import HAMMER

LAST_OF_THE_FIRST = 41.0
"""rad/s: 1-2-0;0-1 ends by grazing between 41 and 42."""


def test_a_sweep_in_hertz_has_no_axis_in_radians() -> None:
    file = parse_model_file(HAMMER)
    assert file.si is not None
    for parameter, ends, label in (
        ("omega", (41.0, 61.0), "drive frequency [Hz]"),
        ("anvil.upper", (3e-4, 5e-4), "anvil.upper [mm]"),
    ):
        subject = ModelSubject(file.model, 50.0, scales=file.si)
        swept = sweep.run(SweepPlan(subject, parameter, np.linspace(*ends, 5)))
        figure = diagram(swept)
        figure.canvas.draw()
        lowest = figure.axes[-1]
        assert lowest.get_xlabel() == label
        assert not lowest.child_axes  # no second axis
        scale = 1e3 if parameter != "omega" else 1.0 / (2.0 * np.pi)
        shown = [t for t in lowest.get_xticklabels() if t.get_text()]
        assert len(shown) > 2
        for tick in shown:  # round in the unit that is shown
            assert float(tick.get_text()) == pytest.approx(scale * tick.get_position()[0])
            assert len(tick.get_text()) < 6
        title = figure.get_suptitle()
        assert "rad/s" not in title
        assert "e-0" not in title
        assert "drive frequency" in title


def test_a_map_has_a_colour_for_a_period_that_cannot_be_wanted() -> None:
    counts = {"17-4-0": 5, "3-1-0": 4, "aperiodic": 2, "40-9-1": 1}
    looks = response_palette(counts)
    assert list(looks) == ["3-1-0", "17-4-0", "40-9-1", "aperiodic"]
    assert len(set(looks.values())) == 4


@pytest.mark.slow
def test_windows_and_panels_of_two_stops_are_told_apart() -> None:
    file = parse_model_file(HAMMER)
    values = np.linspace(LAST_OF_THE_FIRST, 61.0, 21)
    swept = sweep.run(SweepPlan(ModelSubject(file.model, scales=file.si), "omega", values))
    assert [w.response for w in swept.windows] == ["1-2-0;0-1", "1-1-0;0-1"]
    figure = diagram(swept)
    assert (clipped(figure), overlapping(figure)) == ([], [])
    panels = [axes.get_title(loc="left") for axes in figure.axes]
    assert panels == ["", "", "on the upper stop of anvil", "on the lower stop of pad", ""]
    strip = figure.axes[0]
    places = {line.get_color(): set(np.asarray(line.get_xdata())) for line in strip.lines}
    (border,) = places.pop("white")
    assert border == pytest.approx(LAST_OF_THE_FIRST + 0.5)
    left, _ = strip.get_xlim()
    ((name,),) = places.values()  # to the tilted one, from the middle of what is seen
    assert name == pytest.approx(0.5 * (left + border))
    # Nothing is symmetric, so the key does not say what symmetric looks like.
    (legend,) = figure.legends
    assert [t.get_text() for t in legend.get_texts()] == ["followed down", "not symmetric"]


@pytest.mark.slow
def test_the_name_of_a_window_at_the_edge_keeps_clear_of_the_arrow_of_its_track() -> None:
    """Half a step of it lies beside the axes: there is room for what is seen of it alone."""
    file = parse_model_file(HAMMER)
    values = np.linspace(LAST_OF_THE_FIRST, 61.0, 11)
    subject = ModelSubject(file.model, scales=file.si)
    figure = diagram(sweep.run(SweepPlan(subject, "omega", values, **follow("down", "up"))))
    assert [axes.get_ylabel() for axes in figure.axes[:2]] == ["↓", "↑"]
    assert (clipped(figure), overlapping(figure)) == ([], [])


def test_a_long_label_of_a_panel_takes_several_lines() -> None:
    """The clearance of the gears is between four coordinates, whose names are all on the axis."""
    subject = ModelSubject(read_model_file(ROOT / "examples/gears.toml").model)
    quick = TransientSettings(4, 2, 8)
    figure = diagram(sweep.run(SweepPlan(subject, "omega", np.linspace(1.1, 1.2, 3), course=quick)))
    assert (clipped(figure), overlapping(figure)) == ([], [])
    label = figure.axes[1].get_ylabel()
    assert " ".join(label.split()) == f"least {subject.labels['displacement']} in each period"


@pytest.mark.parametrize(("example", "panels"), [("dry-friction", 3), ("gears", 4)])
def test_impacts_have_panels_where_any_is_met(example: str, panels: int) -> None:
    """Beside the strip of the track, the least displacement and the Lyapunov exponent."""
    subject = ModelSubject(read_model_file(ROOT / f"examples/{example}.toml").model)
    quick = TransientSettings(4, 2, 8)
    figure = diagram(sweep.run(SweepPlan(subject, "omega", np.linspace(1.1, 1.2, 3), course=quick)))
    assert (len(figure.axes), clipped(figure), overlapping(figure)) == (panels, [], [])
    assert figure.axes[1].get_ylabel().startswith("least")
    assert figure.axes[-1].get_ylabel().startswith("largest Lyapunov")
