"""What is not to be trusted is said to be, and its near miss is not.

Each check is shown in pairs: a case that it catches, and one just short of it that passes. The
error bound itself is held against 40-digit arithmetic.
"""

from __future__ import annotations

import json
import re
from dataclasses import asdict, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.references import Problem, truth
from designer.base.reason import Reason
from designer.check import checked_design, trust
from designer.check.trust import Trust
from designer.circuit.netlist import Excitation
from designer.cli import entry
from designer.dynamics import attractors
from designer.dynamics.attractors import settle
from designer.dynamics.counts import Counts
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.jobs.study_stage import satisfied
from designer.model.find_responses import ModelResponse
from designer.model.model import Dimensionless
from designer.model.response_table import Response
from designer.report import words as report_words
from designer.spice.deck import SolverSettings
from designer.spice.numerics_gate import GateResult
from designer.spice.read_orbit import Read
from designer.spice.simulator import SimulationFailed
from designer.verbs import tables
from designer.yields.study import trust_of_yield
from designer.yields.yield_count import Yield
from tests.shared.model_text import SMALL

STIFFEST = 1.0 - 2.0**-52
"""The stiffest stop but one that a double can ask for: one impact excites 7e7 of the frequency."""
DAMPED = Problem(0.9, k0=0.999, zeta=0.2, b=0.5, lower=False)


@cache
def found(k0: float) -> tuple[Flow, Orbit]:
    """The 1-1-0 response against a stop of this stiffness."""
    model = Dimensionless(
        DAMPED.m, DAMPED.k, k0, DAMPED.c, DAMPED.zeta, DAMPED.f20, DAMPED.b, sides="upper"
    )
    flow = Flow(model.second_order().piecewise_linear(), Drive(DAMPED.omega))
    return flow, settle(flow, np.zeros(4))


@pytest.mark.parametrize("k0", [0.99, 1.0 - 1e-6, 1.0 - 1e-9, 1.0 - 1e-12])
def test_the_error_is_a_bound_and_not_a_wild_one(k0: float) -> None:
    flow, orbit = found(k0)
    assert orbit.response == "1-1-0"
    exact = truth(replace(DAMPED, k0=k0), orbit.start, 1)
    assert exact is not None
    error = float((np.abs(exact.strobes[-1] - orbit.start) / np.abs(orbit.extremes).max(1)).max())
    said = trust.of_orbit(flow, orbit)
    assert error <= said.error <= 1e5 * max(error, 2.0**-53)


def test_a_stop_too_stiff_for_double_precision() -> None:
    caught, passes = (trust.of_orbit(*found(k0)) for k0 in (STIFFEST, 1.0 - 1e-12))
    assert not caught.trusted
    assert str(caught).startswith("not to be trusted here: rounding errors")
    assert caught.error > attractors.STROBE_TOLERANCE > passes.error > 1e-12
    assert passes.trusted
    assert str(passes) == ""


@pytest.mark.parametrize("margin", [(np.inf, 1.0), (1.0, np.inf)], ids=["miss", "penetration"])
def test_a_count_that_lies_within_the_error(margin: tuple[float, float]) -> None:
    flow, orbit = found(1.0 - 1e-9)
    error = trust.of_orbit(flow, orbit).error
    peak = float(np.abs(orbit.extremes[0]).max())
    near, clear = (
        trust.of_orbit(flow, replace(orbit, graze=factor * error * peak * np.array([margin])))
        for factor in (0.9, 1.1)
    )
    assert [("the count of impacts is open" in r) for r in near.reasons] == [True]
    assert clear.trusted


@pytest.mark.parametrize(("zeta", "trusted"), [(1e-16, False), (1e-12, True)])
def test_a_multiplier_that_cannot_be_told_from_one(zeta: float, trusted: bool) -> None:
    """Without stops the multipliers are exp(λ T), λ the eigenvalues: -ζ times a figure near 1."""
    model = Dimensionless(0.5, 0.5, 0.0, 0.5, zeta, 0.0, 0.25)
    flow = Flow(model.second_order().piecewise_linear(), Drive(0.85))
    reached = attractors.shoot(flow, np.array([0.3, 0.1, 0.2, 0.1]), 1)
    assert reached is not None
    orbit = attractors.describe(flow, reached[0], 1, reached[1], laps=1)
    damped = replace(model, zeta=1e-3).second_order().state_matrix()
    slowest = 1e3 * zeta * float(np.linalg.eigvals(damped).real.max()) * flow.drive.period
    said = trust.of_orbit(flow, orbit)
    assert abs(orbit.radius - np.exp(slowest)) <= said.multiplier_error
    assert (-slowest > said.multiplier_error) is trusted
    assert [("cannot be told from 1" in r) for r in said.reasons] == ([] if trusted else [True])


def test_an_impact_on_the_strobe_is_not_two() -> None:
    """It falls into one lap or the next by its last digit, so counts that differ say nothing."""
    flow, orbit = found(0.999)
    late = float(orbit.impact_times[0])
    at = replace(orbit, impact_times=np.array([flow.drive.period]))
    assert 0.1 < late < flow.drive.period - 0.1
    runs = [flow.run(orbit.start, 1), flow.run(np.zeros(4), 1)]
    assert len({int(run.counts.sum()) for run in runs}) == 2
    assert trust._doubts_of_lap(runs, 0.0, counted=True)
    assert not trust._doubts_of_lap(runs, 0.0, counted=False)
    assert trust._at_strobe(at, flow.drive.period)
    assert not trust._at_strobe(orbit, flow.drive.period)


def test_a_motion_without_a_period_is_judged_by_one_lap() -> None:
    flow, _ = found(0.999)
    start = np.array([0.1, 0.0, 0.0, 0.0])
    said = trust.of_orbit(flow, Orbit(OrbitStatus.APERIODIC, start=start, mode=(0,)))
    assert said.trusted
    assert 0.0 < said.error < 1e-10


def test_where_nothing_was_reached_the_status_speaks() -> None:
    flow, orbit = found(0.999)
    for status in (OrbitStatus.DIVERGED, OrbitStatus.FAILED):
        said = trust.of_orbit(flow, Orbit(status))
        np.testing.assert_equal(asdict(said), asdict(Trust()))
        assert said.as_dict()["trusted"] is said.verdict()["trusted"] is None
    slow = trust.of_orbit(flow, replace(orbit, status=OrbitStatus.NOT_SETTLED))
    assert slow.trusted is None
    assert slow.error > 0.0
    for status in (OrbitStatus.PERIODIC, OrbitStatus.GRAZING, OrbitStatus.CLIPPED):
        assert trust.of_orbit(flow, replace(orbit, status=status)).trusted is True


def _open(orbit: Orbit, flow: Flow, factor: float) -> Trust:
    """Of the orbit with a miss of so many times its error."""
    near = factor * trust.of_orbit(flow, orbit).error * float(np.abs(orbit.extremes[0]).max())
    return trust.of_orbit(flow, replace(orbit, graze=np.array([[np.inf, near]])))


def test_a_verdict_has_no_measured_figures() -> None:
    """Twice the same doubts, measured otherwise: one verdict, two reasons with figures."""
    flow, orbit = found(1.0 - 1e-9)
    laps = [flow.run(orbit.start, 1), flow.run(np.zeros(4), 1), flow.run(2.0 * orbit.start, 3)]
    pairs = [
        [_open(orbit, flow, factor) for factor in (0.9, 0.09)],
        [Trust(doubts=trust._doubts_of_lap(laps[:1], e, counted=True)) for e in (1e-7, 0.4)],
        [
            Trust(doubts=trust._doubts_of_lap(runs, 0.0, counted=True))
            for runs in (laps[:2], laps[1:])
        ],
        [Trust(doubts=trust._doubts_of_orbit(orbit, 0.0, by, 1.0)) for by in (2.0, 30.0)],
        [
            trust.of_gate(GateResult(SETTINGS, False, d, READ, (200,), wave=w, wave_bound=w / 2))
            for d, w in ((2e-3, 0.03), (0.5, 0.2))
        ],
    ]
    for one, other in pairs:
        assert one.trusted is False
        assert one.verdict() == other.verdict()
        assert one.as_dict()["reasons"] != other.as_dict()["reasons"]
        boards = [trust_of_yield(Yield(200, 0, 0, 0), nominal) for nominal in (one, other)]
        assert boards[0].verdict() == boards[1].verdict()
        # The bounds that are asked for, the multiplier's 1, and nothing else.
        figures = re.findall(r"[0-9][0-9.e-]*", " ".join(one.reasons))
        assert set(figures) <= {"1e-08", "0.001", "1"}


@pytest.mark.parametrize(
    ("counted", "trusted"),
    [
        (Yield(199, 0, 0, 1), True),  # 99.5 to 100 %, inside the interval of 199 of 199
        (Yield(150, 0, 0, 50), False),
        (Yield(100, 100, 0, 4), True),
        (Yield(100, 100, 0, 40), False),
        (Yield(0, 0, 0, 10), False),
        (Yield(0, 10, 0, 0), True),
    ],
)
def test_a_yield_that_boards_without_an_answer_could_move(counted: Yield, trusted: bool) -> None:
    said = trust_of_yield(counted, Trust(answered=True))
    assert said.trusted is trusted
    assert any("boards have no answer" in reason for reason in said.reasons) is not trusted


def test_a_yield_is_no_better_than_the_nominal_response() -> None:
    said = trust_of_yield(Yield(200, 0, 0, 0), Trust(doubts=(Reason("so it is", "by 2"),)))
    assert said.reasons == ("the nominal response: so it is",)
    assert said.as_dict()["reasons"] == ["the nominal response: so it is (by 2)"]


def _checked(k0: float, gate: GateResult | None = None) -> checked_design.CheckedResponse:
    """A response whose circuit's flow is the model's, against a stop of this stiffness."""
    flow, orbit = found(k0)
    response = ModelResponse(Response(0.9, Counts(1, ((1, 0),))), 0.5, orbit, (), True)
    return checked_design.CheckedResponse(response, orbit, Excitation(200.0, 4.0), gate, flow=flow)


@pytest.mark.parametrize(("k0", "trusted"), [(STIFFEST, False), (0.999, True)])
def test_a_report_names_it_among_the_problems(k0: float, trusted: bool) -> None:
    checked = _checked(k0)
    assert checked.trust["circuit"].trusted is trusted
    said = report_words.problem(checked)
    assert ("exact circuit not to be trusted here: rounding errors" in said) is not trusted
    assert bool(said) is not trusted


def test_the_trust_of_a_check_is_measured_when_it_is_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """And once: a search checks hundreds of designs and shows none of it."""
    asked = []

    def measured(flow: Flow, orbit: Orbit) -> Trust:
        asked.append(flow)
        return Trust(answered=True)

    monkeypatch.setattr(trust, "of_orbit", measured)
    checked = _checked(0.999)
    assert checked.agrees
    assert not asked
    assert checked.circuit_trust.trusted
    assert checked.trust["circuit"].trusted
    assert asked == [found(0.999)[0]]


SETTINGS = SolverSettings("trap", 1e-5)
READ = Read(Orbit(OrbitStatus.PERIODIC), np.zeros((9, 4)), None)


@pytest.mark.parametrize(
    ("gate", "trusted", "words"),
    [
        (
            GateResult(SETTINGS, False, 5e-3, READ, (200, 400)),
            False,
            "strobes differ by more than 0.001 of the peak (by 0.005)",
        ),
        (
            GateResult(SETTINGS, False, 5e-4, READ, (200,)),
            False,
            "its runs do not all show the exact circuit's response (the coarsest shows 0-0-0)",
        ),
        (GateResult(SETTINGS, False, np.nan, SimulationFailed("no end"), (200,)), None, "no end"),
        (GateResult(SETTINGS, True, 5e-4, READ, (200,)), True, ""),
    ],
)
def test_ngspice_is_trusted_behind_its_gate_alone(
    gate: GateResult, trusted: bool | None, words: str
) -> None:
    checked = _checked(0.999, gate)
    said = checked.trust["ngspice"]
    assert said.trusted is trusted
    assert checked.ngspice is not None
    assert checked.ngspice.reason.endswith(words)
    assert said.as_dict()["reasons"] == ([words] if trusted is False else [])


@pytest.mark.parametrize(("k0", "trusted"), [(STIFFEST, False), (0.999999999, True)])
def test_simulate_says_it(
    k0: float, trusted: bool, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "model.toml"
    path.write_text(
        f"format = 1\n[model]\nm = 0.5\nk = 0.5\nk0 = {k0!r}\nc = 0.5\nzeta = 0.2\nf20 = 0.0\n"
        'b = 0.5\nsides = "upper"\n'
    )
    words = ["simulate", str(path), "--omega", "0.9", "--starts", "1"]
    assert entry.status([*words, "--json"]) == int(not trusted)
    said = capfd.readouterr()
    (row,) = json.loads(said.out)["responses"]
    assert row["trust"]["trusted"] is trusted
    assert entry.status(words) == int(not trusted)
    assert ("not to be trusted here" in capfd.readouterr().err) is not trusted


def test_the_tables_name_what_is_not_to_be_trusted() -> None:
    fine = Trust(answered=True).as_dict()
    open_ = Trust(doubts=(Reason("first"), Reason("second"))).as_dict()
    assert tables.untrusted({"circuit": fine, "ngspice": None}) == []
    assert tables.untrusted({"circuit": fine, "yield": open_}) == [
        "yield not to be trusted here: first; second"
    ]


def test_a_study_says_why_ngspice_has_no_answer(capsys: pytest.CaptureFixture[str]) -> None:
    """With the figures of its reason, from the folder's files alone."""
    gates: list[Read | SimulationFailed] = [SimulationFailed("timestep too small"), READ]
    rows: list[dict[str, Any]] = []
    for read in gates:
        checked = _checked(0.999, GateResult(SETTINGS, False, 5e-3, read, (200,)))
        heard = checked.ngspice
        assert heard is not None
        row = {"omega": 0.9, "expected": None, "found": True, "model": "", "circuit": ""}
        row |= {"ngspice": heard.response, "ngspice_reason": heard.reason, "yield": None}
        rows.append({**row, "trust": {"ngspice": checked.trust["ngspice"].verdict()}})
    study: Any = {"samples": 1, "responses": rows, "provenance": {"spread": None}}
    tables.tolerance(study)
    said = capsys.readouterr().err
    assert "ngspice gave no answer: timestep too small" in said
    assert re.search(r"ngspice not to be trusted here: .* \(by 0.005\)", said)


@pytest.mark.parametrize(
    ("engine", "counted", "right"),
    [(True, True, True), (True, False, True), (False, True, False), (None, True, False)],
)
def test_a_study_is_satisfied_by_what_can_be_trusted(
    engine: bool | None, counted: bool, right: bool
) -> None:
    """A yield says only how far it is known; an engine without an answer is no agreement."""
    said = {"model": {"trusted": True}, "circuit": {"trusted": engine}}
    row = {"found": True, "engines_agree": True, "trust": {**said, "yield": {"trusted": counted}}}
    answer: Any = {"equation_check": None, "responses": [row]}
    assert satisfied(answer) is right


@pytest.mark.slow
def test_a_study_ends_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """A distrusted exact circuit, everything else as it should be: the row, and exit status 1,
    also where the folder is shown again; of the result in memory likewise."""
    measured = trust.of_orbit
    doubt = Reason("so it is", "by 2e-07")

    def doubted(flow: Flow, orbit: Orbit) -> Trust:
        said = measured(flow, orbit)
        # A period of the circuit takes milliseconds, of the model 2π/ω.
        return said if flow.drive.period > 1.0 else replace(said, doubts=(doubt,))

    monkeypatch.setattr(trust, "of_orbit", doubted)
    model, out = tmp_path / "small.toml", tmp_path / "out"
    model.write_text(SMALL)
    words = ["tolerance", str(model), "--out", str(out), "--samples", "2", "--rung", "exact"]
    words += ["--jobs", "1"]
    assert entry.status([*words, "--json", "-q"]) == 1
    (row,) = json.loads(capfd.readouterr().out)["responses"]
    assert row["found"]
    assert row["engines_agree"]
    assert row["yield"]["ok"] == 2
    assert row["trust"] == {
        "model": {"trusted": True, "reasons": []},
        "circuit": {"trusted": False, "reasons": ["so it is"]},
        "yield": {"trusted": False, "reasons": ["the nominal response: so it is"]},
    }
    assert "exact circuit not to be trusted here: so it is" in (out / "report.md").read_text()
    monkeypatch.undo()
    assert entry.status(words) == 1
    said = capfd.readouterr().err
    assert "circuit not to be trusted here: so it is" in said
    assert "yield not to be trusted here: the nominal response: so it is" in said


@pytest.mark.parametrize(("k0", "trusted"), [(STIFFEST, False), (0.999, True)])
def test_one_engine_that_is_not_trusted_is_enough(k0: float, trusted: bool) -> None:
    checked = _checked(k0)
    checked.__dict__["model_trust"] = Trust(answered=True)
    assert checked.agrees
    assert checked.trusted is trusted
