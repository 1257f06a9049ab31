"""Yield maps against direct settling at single points, and their choices against small tables."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from designer.base.defaults import Over
from designer.base.errors import InputError
from designer.circuit.board_values import nominal_board
from designer.circuit.ensemble import Ensemble
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle, starts
from designer.dynamics.coexisting_attractors import coexisting
from designer.dynamics.counts import Counts
from designer.dynamics.flow import Flow
from designer.model.distributions import Normal
from designer.model.response_table import Response
from designer.plots.map_plots import map_chart, map_files
from designer.spread.spread import OpAmpDrift, Spread, draw
from designer.verdicts.verdict import Question, StudyPlan, Verdict, judge
from designer.yields import yield_maps
from designer.yields.yield_maps import SEED_SHIFT, Axis, YieldMap, yield_map
from tests.shared import paper_cases

B = 0.25


@cache
def plan(p: int = 2) -> StudyPlan:
    subject = paper_cases.subject(p)
    spec = Response(omega=paper_cases.OMEGA[p], expect=Counts(1, ((p, p),)))
    question = Question(spec, subject.excitation, subject.orbit, None)
    spread = Spread(0.01, 0.01, 1e-3, 4e-3)
    return StudyPlan(subject.reduction.circuit, spread, 3, 10, (question,))


@cache
def over_omega() -> YieldMap:
    return yield_map(plan(), 0, "omega", B, samples=8, points=4, jobs=2)


def made(counts: list[list[int]] | list[int], over: Over = "omega", samples: int = 10) -> YieldMap:
    """A map with these numbers of ok boards."""
    ok = np.array(counts)
    names = {"omega": ("omega",), "b": ("b",), "grade": ("grade",)}.get(over, ("omega", "grade"))
    axes = tuple(
        Axis(name, tuple(0.01 * (k + 1) if name == "grade" else 1.0 + 0.1 * k for k in range(n)))
        for name, n in zip(names, ok.shape, strict=True)
    )
    nothing = np.zeros_like(ok)
    return YieldMap(
        over, 0, axes, ok >= 0, np.maximum(ok, 0), samples - ok, nothing, nothing, samples, 1, 1.0,
        None, (False, False), 0, 0.0,
    )  # fmt: skip


@pytest.mark.slow
def test_a_point_is_what_its_boards_do_from_the_nominal_orbit_there() -> None:
    found, study = over_omega(), plan()
    question = study.questions[0]
    omega = found.axes[0].values
    assert question.spec.omega in omega
    assert list(omega) == sorted(omega)
    for i in (0, len(omega) - 1):
        ratio = omega[i] / question.spec.omega
        drive = replace(question.excitation, frequency=question.excitation.frequency * ratio).drive
        system = Reduction(study.circuit, nominal_board(study.circuit)).system()
        start = question.start
        for at in np.linspace(1.0, ratio, 12)[1:]:
            between = replace(drive, omega=drive.omega * at / ratio)
            start = settle(Flow(system, between), start.start)
        tally = dict.fromkeys(Verdict, 0)
        for k in range(found.samples):
            board = draw(study.circuit, study.spread, study.seed + SEED_SHIFT, k)
            flow = Flow(Reduction(study.circuit, board).system(), drive)
            tally[judge(settle(flow, start.start), question.spec, question.start)[0]] += 1
        counted = found.at(i)
        assert found.there[i]
        assert (counted.ok, counted.lost) == (tally[Verdict.OK], tally[Verdict.LOST])


def test_a_forecast_is_the_map_where_the_compiled_way_answers() -> None:
    values, told = over_omega().axes[0].values[:2], list[int]()

    def mapped(quick: bool) -> YieldMap:
        return yield_map(
            plan(), 0, "omega", B, values=values, samples=4, quick=quick,
            progress=lambda: told.append(1),
        )  # fmt: skip

    plain, found = mapped(False), mapped(True)
    assert (found.ok == plain.ok).all()
    assert plain.ok.any()
    assert len(told) >= 2 * plain.ok.sum()


@pytest.mark.slow
def test_boards_that_a_forecast_leaves_open_are_settled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Here all of them, as in a design whose boards reach a mode that the compiled way lacks. A
    setting at which the first board shows the response is as in the plain map; at another one
    all are lost."""
    monkeypatch.setattr(yield_maps, "DOUBTED", 1)
    monkeypatch.setattr(Ensemble, "quick", lambda _, which, *__, **___: [None] * len(which))

    def mapped(samples: int, quick: bool) -> YieldMap:
        values = (*over_omega().axes[0].values, 1.06 * over_omega().axes[0].values[-1])
        return yield_map(plan(), 0, "omega", B, values=values, samples=samples, quick=quick, jobs=2)

    plain, first, found = mapped(8, False), mapped(1, False), mapped(8, True)
    assert np.count_nonzero(first.ok) > 0
    assert (found.ok == np.where(first.ok, plain.ok, 0)).all()
    assert (found.ok + found.lost + found.grazing == 8 * found.there).all()


def test_the_window_ends_where_the_nominal_circuit_loses_the_response() -> None:
    found, study = over_omega(), plan()
    assert found.window is not None
    question = study.questions[0]
    system = Reduction(study.circuit, nominal_board(study.circuit)).system()
    for edge, sign, open_ in zip(found.window, (-1.0, 1.0), found.open, strict=True):
        assert not open_
        verdicts = []
        for omega in (edge, edge + sign * 1e-3 * found.used):
            e = question.excitation
            drive = replace(e, frequency=e.frequency * omega / found.used).drive
            orbit = question.start
            for at in np.linspace(found.used, omega, 40)[1:]:
                flow = Flow(system, replace(drive, omega=drive.omega * at / omega))
                orbit = settle(flow, orbit.start) if len(orbit.start) else orbit
            verdicts.append(judge(orbit, question.spec, question.start)[0] is Verdict.OK)
        assert verdicts == [True, False]


def test_outside_the_window_the_response_is_not_there_and_the_yield_is_0() -> None:
    found = yield_map(plan(), 0, "omega", B, values=[0.85, 1.3], samples=3)
    assert found.there.tolist() == [True, False]
    assert found.window is None
    assert found.rate[1] == found.low[1] == found.high[1] == 0.0
    assert (found.ok[1], found.lost[1]) == (0, 0)


@cache
def asymmetric() -> StudyPlan:
    """The asymmetric 1-1-1 at ω = 1.43, of the board on which 1-1-1 is symmetric at 1.55."""
    study, subject = plan(1), paper_cases.subject(1)
    e = subject.excitation
    excitation = replace(e, frequency=e.frequency * 1.43 / paper_cases.OMEGA[1])
    met = coexisting(
        Flow(subject.system, excitation.drive), starts(3.0 * np.abs(subject.orbit.start), 32)
    )
    orbit = next(o for o in met if o.response == "1-1-1" and not o.symmetric)
    spec = Response(omega=1.43, expect=Counts(1, ((1, 1),)), symmetric=False)
    return replace(study, questions=(Question(spec, excitation, orbit, None),))


def test_the_window_of_an_asymmetric_response_ends_at_the_pitchfork() -> None:
    """The model's is at ω = 1.4605. On the circuit bias currents leave 1e-3 to 4e-3 of asymmetry
    just past it, where no twin is left."""
    study = asymmetric()
    values = [1.43, 1.455, 1.463, 1.659]
    found = yield_map(study, 0, "omega", B, values=values, samples=1)
    assert found.there.tolist() == [True, True, False, False]
    assert found.recommended == (1.43,)
    (question,) = study.questions
    either = replace(question, spec=replace(question.spec, symmetric=None))
    free = yield_map(replace(study, questions=(either,)), 0, "omega", B, values=values, samples=1)
    assert free.there.all()


def test_over_b_the_amplitude_goes_as_its_inverse() -> None:
    """At b a linear amplitude change: the same as a study whose generator is set so."""
    study = plan()
    found = yield_map(study, 0, "b", B, values=[0.24], samples=5)
    question = study.questions[0]
    e = question.excitation
    louder = replace(question, excitation=replace(e, amplitude=e.amplitude * 0.25 / 0.24))
    system = Reduction(study.circuit, nominal_board(study.circuit)).system()
    start = settle(Flow(system, louder.excitation.drive), question.start.start)
    again = yield_map(
        replace(study, questions=(replace(louder, start=start),)), 0, "b", 0.24, values=[0.24],
        samples=5,
    )  # fmt: skip
    assert found.at(0) == again.at(0)


def test_over_the_grade_the_same_numbers_are_drawn() -> None:
    study = plan()
    found = yield_map(study, 0, "grade", B, grades=(1e-6, 0.01), samples=6)
    exact = replace(study, spread=replace(study.spread, resistor=0.01, capacitor=0.01))
    same = yield_map(exact, 0, "omega", B, values=[found.used], samples=6)
    assert found.at(1) == same.at(0)
    both = yield_map(study, 0, "omega-grade", B, values=[0.85], grades=(1e-6, 0.01), samples=6)
    assert both.ok.shape == (1, 2)
    assert (both.ok[0] == found.ok).all()


@pytest.mark.slow
def test_over_the_temperature_the_same_boards_get_warm() -> None:
    """Point by point what a plan of boards at that temperature says, with the same numbers; warm
    boards of a limit that falls steeply lose the response, and nothing is recommended."""
    study = plan()
    falling = OpAmpDrift(offset=Normal(1e-5, 3e-5), bias_doubling=10.0, limit=-0.05)
    warm = replace(study.spread, temperature=(25.0, 25.0), opamps=falling)
    points = (25.0, 60.0, 150.0)
    found = yield_map(study, 0, "temperature", B, temperatures=points, warmed=warm, samples=6)
    assert found.axes == (Axis("temperature", points),)
    assert found.used == 25.0
    assert found.recommended is None
    for i, celsius in enumerate(points):
        here = replace(study, spread=replace(warm, temperature=(celsius, celsius)))
        same = yield_map(here, 0, "omega", B, values=[study.questions[0].spec.omega], samples=6)  # type: ignore[list-item]
        assert found.at(i) == same.at(0)
    assert found.ok[0] > found.ok[2]
    figure = map_chart("ω = 0.85", found)
    assert figure.axes[0].get_xlabel() == "temperature of the boards [°C]"
    # The TL074C is specified from 0 to 70 °C.
    assert [found.outside(celsius) for celsius in points] == [False, False, True]
    assert found.as_dict()["specified"] == [0.0, 70.0]
    assert found.as_dict()["op_amps"]["bias_doubling"] == 10.0
    (legend,) = figure.legends
    assert "op-amp not specified" in {text.get_text() for text in legend.get_texts()}


def test_the_recommended_setting_is_the_one_in_use_unless_another_is_better() -> None:
    """Wilson's intervals at 20 boards: 2 in 3 … 30 %, 10 in 30 … 70, 17 in 64 … 95, 20 in 84 …."""

    def chosen(counts: list[list[int]] | list[int], over: Over = "omega") -> list[float]:
        best = replace(made(counts, over, 20), used=1.1).recommended
        assert best is not None
        return [round(v, 9) for v in best]

    assert chosen([2, 2, 20, 20, 20, 2, 20]) == [1.3]
    assert chosen([2, 10, 17, 2]) == [1.1]
    assert chosen([2, 2, 17, 20, 17, 2, 17, 17, 17, 17]) == [1.3]
    assert chosen([20, 17, 2]) == [1.1]
    assert chosen([20, 20, 16], "grade") == [0.02]
    assert chosen([[18, 20, 3], [2, 2, 3], [2, 20, 1]], "omega-grade") == [1.0, 0.02]
    assert chosen([[18, 20, 3], [20, 18, 3], [2, 20, 1]], "omega-grade") == [1.1, 0.02]


def test_the_frequency_axis_is_in_hertz_too() -> None:
    found = replace(over_omega(), frequency=500.0)
    figure = map_chart("ω = 0.85", found)
    (axes,) = figure.axes
    (top,) = axes.child_axes
    figure.draw_without_rendering()
    assert top.get_xlabel() == "generator frequency [Hz]"
    assert np.allclose(top.get_xlim(), np.array(axes.get_xlim()) * 500.0 / 0.85)


@pytest.mark.parametrize("two", [False, True])
def test_where_omega_is_in_rad_s_the_map_is_over_hertz(two: bool) -> None:
    found = made([[3, 8], [9, 10]], "omega-grade") if two else made([3, 9], "omega")
    found = replace(found, frequency=500.0)
    figure = map_chart("36 Hz", found, angular=True)
    axes = figure.axes[0]
    figure.draw_without_rendering()
    assert axes.get_xlabel() == "drive frequency [Hz]"
    low, high = axes.get_xlim()
    hertz = np.array(found.axes[0].values) / (2.0 * np.pi)
    assert low <= hertz.min() < hertz.max() <= high < 1.5 * hertz.max()
    (top,) = axes.child_axes
    assert np.allclose(top.get_xlim(), np.array([low, high]) * 2.0 * np.pi * 500.0 / found.used)
    shown = " ".join(text.get_text() for text in figure.legends[0].get_texts())
    assert "ω" not in shown
    assert f"in use: {found.used / (2.0 * np.pi):.4g}" in shown


def test_where_nothing_survives_nothing_is_recommended(tmp_path: Path) -> None:
    for counts, over in (
        ([0, 0, 0], "omega"),
        ([0, 0], "grade"),
        ([[0, 0], [0, 0]], "omega-grade"),
    ):
        found = made(counts, over)  # type: ignore[arg-type]
        assert found.recommended is None
        assert found.as_dict()["recommended"] is None
        for name, content in map_files([found], ["ω = 0.85   1-2-2"], {}).items():
            assert content
            (tmp_path / name).write_bytes(content)
    assert len(list(tmp_path.glob("*.png"))) == 3


def test_only_a_point_where_the_nominal_circuit_shows_it_is_recommended() -> None:
    """A yield there is none of the response's; and beside the others it does not count as one."""
    found = made([9, 3, 0, 3], "omega")
    best = replace(found, there=np.array([False, True, True, True])).recommended
    assert best == (1.1,)
    assert replace(found, there=np.zeros(4, dtype=bool)).recommended is None


def test_files_hold_what_the_maps_say() -> None:
    found = [over_omega(), made([10, 8, 2], "grade")]
    out = map_files(found, ["ω = 0.85   1-2-2"], {"versions": {"designer": "x"}})
    assert set(out) == {"maps.json", "map-omega-1.png", "map-grade-1.png"}
    said = json.loads(out["maps.json"])
    assert said["format"] == 1
    assert said["versions"] == {"designer": "x"}
    assert said["maps"][0]["ok"] == found[0].ok.tolist()
    best = found[0].recommended
    assert best is not None
    assert said["maps"][0]["recommended"] == list(best)
    assert all(content[:4] == b"\x89PNG" for name, content in out.items() if name.endswith("png"))


@pytest.mark.parametrize(
    "wrong",
    [
        {"over": "voltage"},
        {"samples": 0},
        {"values": []},
        {"values": [-1.0]},
        {"over": "grade", "grades": [0.0]},
        {"points": 0},
    ],
)
def test_what_cannot_be_mapped_is_refused(wrong: dict[str, object]) -> None:
    asked: dict[str, object] = {"over": "omega", **wrong}
    with pytest.raises(InputError):
        yield_map(plan(), 0, b=B, **asked)  # type: ignore[arg-type]
