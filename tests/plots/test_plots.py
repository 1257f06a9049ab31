"""Figures: they draw whatever the engines answer, twice the same, and leave no state behind."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from xml.etree import ElementTree

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

from designer.base import figure_style
from designer.check.checked_design import CheckedResponse
from designer.circuit.netlist import Excitation
from designer.circuit.nominal import Trace
from designer.dynamics.counts import Counts
from designer.dynamics.orbit import Orbit, OrbitStatus, failed
from designer.model.find_responses import ModelResponse
from designer.model.relative_motion import RelativeMotion
from designer.model.response_table import Response
from designer.plots import orbit_plots, study_plots
from designer.spice.deck import SolverSettings
from designer.spice.numerics_gate import GateResult
from designer.spice.read_orbit import Read
from designer.spice.simulator import SimulationFailed
from designer.verdicts.verdict import Answer, Verdict
from designer.yields.yield_count import Yield
from tests.shared.exploring import quick
from tests.shared.figure_text import clipped, overlapping

PNG = b"\x89PNG\r\n\x1a\n"
SETTINGS = SolverSettings("trap", 1e-5)
MOTION = RelativeMotion("x₁", "", np.array([1.0, 0.0]), 0.0, ((1, 0.25), (-1, -0.25)), (0, 0))


def _orbit(n: int = 1, p: int = 1, q: int = 1) -> Orbit:
    sides = np.array([1.0] * p + [-1.0] * q)
    return Orbit(
        OrbitStatus.PERIODIC,
        n=n,
        p=p,
        q=q,
        start=np.zeros(4),
        impact_times=np.linspace(0.1, 0.9, p + q),
        impact_velocities=0.4 * sides,
        impact_sides=sides,
        asymmetry=0.0,
    )


def _checked(
    model: Orbit | None = None, circuit: Orbit | None = None, gate: GateResult | None = None
) -> CheckedResponse:
    spec = Response(1.0, Counts(1, ((1, 1),)))
    response = ModelResponse(spec, 0.25, model or _orbit(), (), True)
    return CheckedResponse(response, circuit or _orbit(), Excitation(200.0, 4.0), gate)


def _heard(orbit: Orbit | None = None) -> GateResult:
    return GateResult(SETTINGS, True, 1e-4, Read(orbit or _orbit(), np.zeros((9, 4)), None), (200,))


def _trace(periods: int = 1, points: int = 400, scale: float = 1.0, delay: float = 0.0) -> Trace:
    t = np.linspace(0.0, 2.0 * np.pi * periods, points * periods + 1)
    wave = (t + delay) / periods
    x = scale * 0.4 * (np.sin(wave) + 0.3 * np.sin(2.0 * wave))
    return Trace(t, np.stack([x, np.gradient(x, t), x, x], axis=1))


def _traces(periods: int = 1) -> dict[str, Trace]:
    return {name: _trace(periods) for name in ("model", "circuit", "ngspice")}


def _answer(sample: int, verdict: Verdict, radius: float = 0.5, miss: float = np.inf) -> Answer:
    return Answer(sample, 0, verdict, "1-1-1", "", radius, 0.3, miss, 0.0, 40)


def _figures() -> dict[str, Callable[[], Figure]]:
    whole = _checked(gate=_heard())
    labels = ["ω = 1.55   1-1-1", "ω = 0.85   1-2-2"]
    return {
        "portrait": lambda: orbit_plots.phase_portrait(whole, _traces(), MOTION),
        "time": lambda: orbit_plots.time_traces(whole, _traces(), MOTION),
        "legend": orbit_plots.legend,
        "yields": lambda: study_plots.yield_chart(labels, [Yield(20, 3, 1, 1), None]),
        "coefficients": lambda: study_plots.coefficient_chart({"x1'' x1": 1e-3, "stop slope": 0.0}),
        "margins": lambda: study_plots.margin_chart(
            labels, [[_answer(0, Verdict.OK), _answer(1, Verdict.LOST, np.nan, 0.1)], []]
        ),
    }


@pytest.mark.parametrize("name", quick(sorted(_figures()), 4))
def test_every_figure_renders_and_is_the_same_twice(name: str) -> None:
    draw = _figures()[name]
    first, second = figure_style.to_svg(draw()), figure_style.to_svg(draw())
    assert first == second
    ElementTree.fromstring(first)
    outside = re.findall(r"https?://[^\"' ]+", first)
    assert {u for u in outside if not u.startswith("http://www.w3.org/")} == set()
    assert "<metadata" not in first
    content = figure_style.to_png(draw())
    assert content.startswith(PNG)
    assert len(content) > 1500
    assert content == figure_style.to_png(draw())


@pytest.mark.parametrize("name", quick(sorted(_figures()), 4))
def test_no_text_is_cut_off_or_covered(name: str) -> None:
    figure = _figures()[name]()
    assert clipped(figure) == []
    assert overlapping(figure) == []


@pytest.mark.parametrize("name", quick(sorted(_figures()), 4))
def test_the_last_digits_of_the_layout_do_not_show(name: str) -> None:
    """The layout's solver goes through its variables by address: two processes differ by that."""
    documents = []
    for shift in (0.0, 1e-13):
        figure = _figures()[name]()
        figure_style.to_svg(figure)  # lays it out
        figure.set_layout_engine("none")
        for axes in figure.axes:
            box = axes.get_position()
            axes.set_position((box.x0 + shift, box.y0 + shift, box.width - shift, box.height))
        documents.append(figure_style.to_svg(figure))
    assert documents[0] == documents[1]
    root = ElementTree.fromstring(documents[0])
    names = [e.attrib["id"] for e in root.iter() if "id" in e.attrib]
    assert len(names) == len(set(names))
    meant = set(re.findall(r'(?:href="#|url\(#)([^")]+)', documents[0]))
    assert meant <= set(names)


def test_no_state_is_left_behind_and_none_is_taken_over() -> None:
    draw = _figures()["portrait"]
    plain = figure_style.to_svg(draw())
    with mpl.rc_context({"font.size": 30.0, "axes.facecolor": "red", "svg.hashsalt": None}):
        before = dict(mpl.rcParams)
        assert figure_style.to_svg(draw()) == plain
        assert dict(mpl.rcParams) == before


def _lines(figure: Figure, axes: int = 0) -> dict[str, int]:
    """Points of each engine's line, by engine."""
    colours = {
        figure_style.MODEL_COLOUR: "model",
        figure_style.CIRCUIT_COLOUR: "circuit",
        figure_style.NGSPICE_COLOUR: "ngspice",
    }
    return {
        colours[str(line.get_color())]: len(line.get_xdata())  # type: ignore[arg-type]
        for line in figure.axes[axes].lines
        if line.get_color() in colours
    }


def test_portrait_shows_every_engine_and_names_what_it_shows() -> None:
    figure = orbit_plots.phase_portrait(_checked(gate=_heard()), _traces(), MOTION)
    shown = _lines(figure)
    assert set(shown) == {"model", "circuit", "ngspice"}
    assert 20 < shown["ngspice"] <= 131 < shown["model"]  # dots that hide nothing
    (axes,) = figure.axes
    assert axes.get_title(loc="left") == "ω = 1, wanted 1-1-1"
    assert "model 1-1-1   circuit 1-1-1   ngspice 1-1-1" in {t.get_text() for t in axes.texts}


def test_impacts_stand_on_the_stops() -> None:
    (axes,) = orbit_plots.phase_portrait(_checked(_orbit(1, 3, 2)), _traces(), MOTION).axes
    marks = {str(m.get_marker()): np.asarray(m.get_xdata()) for m in axes.lines}
    assert marks[">"].tolist() == [0.25] * 3
    assert marks["<"].tolist() == [-0.25] * 2


def test_a_model_without_stops_has_no_contact_in_its_pictures() -> None:
    figure = orbit_plots.phase_portrait(
        _checked(), _traces(), replace(MOTION, stops=(), clearances=())
    )
    assert not figure.axes[0].patches
    upper = replace(MOTION, stops=MOTION.stops[:1])
    assert len(orbit_plots.time_traces(_checked(), _traces(), upper).axes[0].patches) == 1


def test_a_clearance_between_masses_is_seen_by_what_moves_in_it() -> None:
    """The second clearance: its own displacement, its own stops, its own impacts."""
    motion = RelativeMotion(
        "x₁ − x₂", "", np.array([1.0, -1.0]), 0.0, ((1, 0.1), (-1, -0.4)), (1, 1)
    )
    sides, stops = np.array([1.0, 1.0, -1.0]), np.array([0, 1, 1])
    orbit = replace(_orbit(1, 2, 1), impact_sides=sides, impact_clearances=stops)
    traces = {"model": _trace()}
    (axes,) = orbit_plots.phase_portrait(_checked(orbit), traces, motion).axes
    marks = {str(m.get_marker()): np.asarray(m.get_xdata()) for m in axes.lines}
    assert (marks[">"].tolist(), marks["<"].tolist()) == ([0.1], [-0.4])
    (line,) = (m for m in axes.lines if len(m.get_xdata()) > 100)  # type: ignore[arg-type]
    states = traces["model"].states
    assert np.asarray(line.get_xdata()) == pytest.approx(states[:, 0] - states[:, 2])
    assert np.asarray(line.get_ydata()) == pytest.approx(states[:, 1] - states[:, 3])
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x₁ − x₂", "x₁′ − x₂′")


def test_stops_of_two_clearances_stand_in_one_portrait() -> None:
    """The upper stops of two clearances of one displacement, each with its own impacts."""
    motion = replace(MOTION, stops=((1, 0.1), (1, 0.3)), clearances=(0, 1))
    sides, stops = np.array([1.0, 1.0, 1.0]), np.array([0, 1, 1])
    orbit = replace(_orbit(1, 3, 0), impact_sides=sides, impact_clearances=stops)
    (axes,) = orbit_plots.phase_portrait(_checked(orbit), {}, motion).axes
    places = [np.asarray(m.get_xdata()).tolist() for m in axes.lines if m.get_marker() == ">"]
    assert places == [[0.1], [0.3, 0.3]]


def test_a_model_in_metres_is_shown_in_millimetres() -> None:
    """One figure read twice: in the model's units, and a thousand times as large."""
    checked, traces = _checked(_orbit(1, 1, 0)), {"model": _trace()}
    shown = MOTION.in_unit(1e3, "mm")
    for draw in (orbit_plots.phase_portrait, orbit_plots.time_traces):
        (own,), (axes,) = (draw(checked, traces, m).axes for m in (MOTION, shown))
        across = 1 if draw is orbit_plots.time_traces else 1e3
        for line, larger in zip(own.lines, axes.lines, strict=True):
            if len(np.asarray(line.get_xdata())) > 2:
                x, y = line.get_xydata().T  # type: ignore[union-attr]
                assert larger.get_xdata() == pytest.approx(across * x)
                assert larger.get_ydata() == pytest.approx(1e3 * y)
        assert axes.get_ylim() == pytest.approx(1e3 * np.array(own.get_ylim()))
    (axes,) = orbit_plots.phase_portrait(checked, traces, shown).axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x₁ [mm]", "x₁′ [mm/s]")
    (impact,) = (line for line in axes.lines if line.get_marker() == ">")
    assert impact.get_xydata() == pytest.approx(np.array([[250.0, 400.0]]))


def test_failed_ngspice_is_named_but_not_drawn() -> None:
    gate = GateResult(SETTINGS, False, np.nan, SimulationFailed("timestep too small"), (200,))
    figure = orbit_plots.phase_portrait(_checked(gate=gate), _traces(), MOTION)
    assert "ngspice" not in _lines(figure)
    assert any("ngspice failed" in t.get_text() for t in figure.axes[0].texts)


def test_statuses_that_are_long_take_lines_of_their_own() -> None:
    odd = Orbit(OrbitStatus.NOT_SETTLED, reason="no period")
    figure = orbit_plots.phase_portrait(_checked(odd, odd, _heard(odd)), _traces(30), MOTION)
    assert any(t.get_text().count("\n") == 2 for t in figure.axes[0].texts)


@pytest.mark.parametrize("traces", [{}, {"model": _trace()}], ids=["none", "model"])
def test_engines_without_a_trace_are_left_out(traces: dict[str, Trace]) -> None:
    checked = _checked(failed("no mode holds") if not traces else None, failed("x"), _heard())
    figure_style.to_svg(orbit_plots.phase_portrait(checked, traces, MOTION))
    figure_style.to_svg(orbit_plots.time_traces(checked, traces, MOTION))


def test_states_that_are_not_finite_are_left_out() -> None:
    broken = _trace()
    broken.states[5:] = np.inf
    figure_style.to_svg(orbit_plots.phase_portrait(_checked(), {"model": broken}, MOTION))
    figure_style.to_svg(orbit_plots.time_traces(_checked(), {"model": broken}, MOTION))


def test_empty_charts() -> None:
    for figure in (
        study_plots.yield_chart([], []),
        study_plots.coefficient_chart({}),
        study_plots.margin_chart([], []),
    ):
        figure_style.to_svg(figure)


def test_time_traces_of_a_longer_period_are_brought_into_phase() -> None:
    n, late = 3, _trace(3, delay=2.0 * np.pi)
    checked = _checked(_orbit(n), _orbit(n))
    (axes,) = orbit_plots.time_traces(checked, {"model": _trace(3), "circuit": late}, MOTION).axes
    model, circuit = (line for line in axes.lines if len(line.get_xdata()) > 100)  # type: ignore[arg-type]
    assert np.allclose(np.asarray(model.get_ydata()), np.asarray(circuit.get_ydata()), atol=1e-9)
    assert axes.get_xlim() == (0.0, 3.0)


def test_coefficients_that_are_exact_say_so() -> None:
    errors = {"a": 0.0, "b": -4e-15, "c": -2e-3, "d": float("nan")}
    (axes,) = study_plots.coefficient_chart(errors).axes
    said = [t.get_text() for t in axes.texts]
    assert said == ["exact", "exact", "−0.2 %", "not known"]
    (axes,) = study_plots.coefficient_chart({"a": 0.0}).axes
    assert "every coefficient exact" in axes.get_xlabel()


def test_yields_show_all_counts_and_what_is_open() -> None:
    figure = study_plots.yield_chart(
        ["a", "b", "c", "d"],
        [Yield(150, 30, 15, 5), Yield(0, 0, 0, 20), None, Yield(0, 0, 0, 0)],
    )
    left, right = figure.axes
    assert len(right.patches) == 5
    said = [t.get_text() for t in (*left.texts, *right.texts)]
    assert "76.9 %" in said  # 150 of 195 decided
    assert "open" in said
    assert said.count("left out of the study") == 4


def test_margins_keep_verdicts_apart() -> None:
    answers = [_answer(0, Verdict.OK), _answer(1, Verdict.LOST), _answer(2, Verdict.OK, 0.9, 0.01)]
    left, right = study_plots.margin_chart(["a"], [answers]).axes
    points = {str(m.get_color()): np.asarray(m.get_xdata()) for m in left.lines}
    assert points[study_plots.VERDICTS[Verdict.OK]].tolist() == [0.5, 0.9]
    assert points[study_plots.VERDICTS[Verdict.LOST]].tolist() == [0.5]
    nearest = [np.asarray(m.get_xdata()) for m in right.lines]
    assert any(0.01 in x for x in nearest)


def test_a_narrow_range_of_margins_has_more_than_one_number() -> None:
    near = [_answer(k, Verdict.OK, 0.5, 0.45 + 0.1 * k) for k in range(3)]
    figure = study_plots.margin_chart(["a"], [near])
    figure.canvas.draw()
    low, high = figure.axes[1].get_xlim()
    assert sum(low <= tick <= high for tick in figure.axes[1].get_xticks()) >= 2


def test_a_label_is_text_and_never_a_formula() -> None:
    figure_style.to_svg(study_plots.yield_chart(["$\\frac{1", "<b>&"], [Yield(1, 0, 0, 0)] * 2))


def test_model_that_was_not_found_is_drawn_all_the_same() -> None:
    checked = _checked()
    lost = replace(checked, model=replace(checked.model, found=False))
    assert set(_lines(orbit_plots.phase_portrait(lost, _traces(), MOTION))) == {"model", "circuit"}
