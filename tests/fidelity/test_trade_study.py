"""What accuracy costs: how fidelities are judged, the yield's bound, the verb and its folder."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.stats import multinomial

from designer.base.design_folder import Folder
from designer.base.errors import InputError
from designer.base.manifest import ManifestStage
from designer.base.plain_json import dumps
from designer.base.progress import Progress, report_to
from designer.base.si_unit import drive_text
from designer.catalog.parts_catalog import load_catalog
from designer.catalog.vendor_model import PINS, VendorModel
from designer.circuit.board_values import nominal_board
from designer.circuit.netlist import Excitation
from designer.circuit.reduction import Reduction
from designer.cli import entry
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.fidelity import fidelity_answers, pieces, yields
from designer.fidelity.cpu_clock import SpiceClock
from designer.fidelity.fidelity_answers import FidelityAnswer
from designer.fidelity.fidelity_errors import (
    BOARD,
    EQUATIONS,
    ResponseLabel,
    alike,
    compare,
    difference,
)
from designer.fidelity.trade_files import front, sheet, trade_json
from designer.fidelity.trade_study import (
    IDEAL,
    IMPACT,
    ITSELF,
    NO_IMPACTS,
    NO_PERIOD,
    RESPONSE,
    SHARE,
    UNSURE,
    WAVE,
    Trade,
    TradedResponse,
    cheapest,
    trade,
)
from designer.fidelity.yields import BoardTrade, LeftOut, Tally
from designer.jobs import fidelity_choice
from designer.jobs.fidelity_choice import choose, with_fidelity
from designer.jobs.options import Options
from designer.jobs.trade_job import NAMES
from designer.kernels.kernel_boards import POINTS
from designer.model.model import SiScales
from designer.spice import numerics_gate
from designer.spice.deck import SolverSettings
from designer.spice.numerics_gate import BOUND, RELTOL
from designer.spice.pool import SpicePool
from designer.spice.read_orbit import Read
from designer.spice.simulator import SimulationFailed
from designer.verdicts import cross_check
from tests.circuit.test_reduction import EXACT, circuit_of
from tests.shared.model_text import PAPER_TABLE
from tests.shared.paper_cases import synthesised

WAVEFORM = np.sin(2.0 * np.pi * np.arange(POINTS) / POINTS)
MODEL = f"""format = 1
title = "one response"
{PAPER_TABLE}[[response]]
omega = 1.55
expect = "1-1-1"
"""


def orbit(
    p: int = 1, q: int = 1, up: tuple[float, ...] = (1.0,), down: tuple[float, ...] = (1.0,)
) -> Orbit:
    return Orbit(
        OrbitStatus.PERIODIC,
        1,
        p,
        q,
        impact_velocities=np.array([*up, *(-v for v in down)]),
        impact_sides=np.array([1.0] * len(up) + [-1.0] * len(down)),
    )


def said(
    fidelity: str, level: str, error: float, seconds: float, kind: Orbit | None = None
) -> FidelityAnswer:
    """An answer whose displacement is off by ``error`` of the peak, RMS, and its velocities too."""
    found = orbit(up=(1.0 + error,), down=(1.0,)) if kind is None else kind
    shown = WAVEFORM + math.sqrt(2.0) * error * np.cos(2.0 * np.pi * 7 * np.arange(POINTS) / POINTS)
    return FidelityAnswer(fidelity, level, {}, found, shown, seconds)


ONE = ResponseLabel(1, 1.55, 0.25, "1-1-1")


def answered(
    *answers: FidelityAnswer, label: ResponseLabel = ONE, boards: BoardTrade | LeftOut | None = None
) -> TradedResponse:
    return TradedResponse(*compare(label, answers), boards)


def judged(*answers: FidelityAnswer, boards: BoardTrade | LeftOut | None = None) -> Trade:
    return trade([answered(*answers, boards=boards)])


LADDER = (
    said("rk4", "Δt = 0.01", 0.02, 1e-5),
    said("model", "exact", 0.02, 1e-6),
    said("circuit", "exact", 0.004, 2e-6),
    said("ideal", "step ×1", 0.004, 5e-3),
    said("full", "step ×2", 0.0005, 1e-2),
    said("full", "step ×1", 0.0001, 2e-2),
    said("full", "step ×0.5", 0.0, 4e-2),
)


def picked(found: Trade, question: str, of: str = BOARD) -> Any:
    (one,) = (c for c in found.cheapest if c.question == question and c.of == of)
    return one


def told(answer: Any) -> str:
    """trade.md without what lines its tables up."""
    return re.sub(" +", " ", sheet(answer))


def test_the_cheapest_keeps_the_bound_with_the_truths_own_uncertainty() -> None:
    found = judged(*LADDER)
    (one,) = found.responses
    truth = one.truth
    assert truth.error == pytest.approx(1e-4)
    assert truth.sure
    response, impact, wave = (picked(found, q) for q in (RESPONSE, IMPACT, WAVE))
    assert (response.rung, response.measured, response.shown) == ("model", 0.0, True)
    assert math.isnan(response.convergence), "against something else"
    assert impact.rung == "circuit"
    assert impact.measured == pytest.approx(0.004 + 1e-4, rel=1e-3)
    assert (wave.rung, wave.level) == ("full", "step ×2")
    assert wave.convergence == pytest.approx(0.0005 + 1e-4, rel=1e-3), "of its own steps"
    own = picked(found, WAVE, EQUATIONS)
    assert (own.rung, own.convergence, own.shown) == ("model", 0.0, True)
    assert math.isnan(own.measured), "nothing measures itself"


def test_where_no_fidelity_keeps_the_bound_the_nearest_is_named() -> None:
    """Not the truth itself, which is nearest to itself always."""
    found = judged(
        said("model", "exact", 0.02, 1e-6),
        said("circuit", "exact", 0.01, 1e-6),
        said("full", "step ×1", 0.005, 1e-2),
        said("full", "step ×0.5", 0.0, 2e-2),
    )
    wave = picked(found, WAVE)
    assert not wave.shown
    assert (wave.rung, wave.level, wave.note) == ("full", "step ×1", "")
    assert wave.convergence == pytest.approx(0.005 + 0.005, rel=1e-3)


def test_where_nothing_less_will_do_the_truth_is_the_answer() -> None:
    """The next finer setting did not pass the gate: what the truth's two finest steps differ by is
    below the bound all the same."""
    found = judged(*LADDER[:4], replace(LADDER[5], gate=False), LADDER[6])
    wave = picked(found, WAVE)
    assert (wave.rung, wave.level, wave.shown, wave.note) == ("full", "step ×0.5", True, ITSELF)
    assert wave.convergence == pytest.approx(1e-4, rel=1e-3)
    assert math.isnan(wave.measured)
    assert picked(found, IMPACT).note == ""
    assert f"| – | 0.01 % | yes | 0.04 | {ITSELF} |" in told(document(found))
    doubted = judged(*LADDER[:4], *(replace(a, gate=False) for a in LADDER[5:]))
    assert picked(doubted, WAVE).rung == "circuit"  # a truth that its gate speaks against is none
    assert not picked(doubted, WAVE).shown


def test_a_fidelity_whose_time_is_not_known_is_not_the_cheapest() -> None:
    untimed = said("rk4", "Δt = 0.01", 0.0, math.nan)
    found = judged(untimed, *LADDER[1:])
    assert picked(found, RESPONSE).rung == "model"
    text = told(document(found))
    assert "| model, Runge-Kutta | Δt = 0.01 | 0 %, – |" in text


def test_a_truth_that_is_not_sure_answers_nothing() -> None:
    found = judged(
        said("model", "exact", 0.0, 1e-6),
        said("full", "step ×1", 0.0, 1e-2, orbit(2, 2, (1.0, 1.0), (1.0, 1.0))),
        said("full", "step ×0.5", 0.0, 2e-2),
    )
    assert not found.responses[0].truth.sure
    for question in (RESPONSE, IMPACT, WAVE):
        one = picked(found, question)
        assert (one.rung, one.shown, one.note) == (None, False, UNSURE)
    assert f"| {WAVE} | board | – | – | – | – | no | – | {UNSURE} |" in told(document(found))
    both = cheapest(
        RESPONSE, BOARD, [answered(*LADDER, label=ResponseLabel(2, 2.0, 0.2, "")), *found.responses]
    )
    assert both is not None
    assert (both.shown, both.note) == (False, f"{UNSURE} (response 1)")


def test_of_a_motion_without_a_period_only_the_n_p_q_is_asked() -> None:
    """No impact of it was compared, and no wave."""
    chaos = [replace(a, orbit=Orbit(OrbitStatus.APERIODIC), shown=np.zeros(0)) for a in LADDER]
    found = judged(*chaos)
    assert picked(found, RESPONSE).shown
    for of in (BOARD, EQUATIONS):
        for question in (IMPACT, WAVE):
            one = picked(found, question, of)
            assert (one.rung, one.shown, one.note) == (None, None, NO_PERIOD)
    assert math.isnan(difference(chaos[0].orbit, chaos[1].orbit))


def test_a_fidelity_with_another_response_keeps_no_bound() -> None:
    wrong = said("circuit", "exact", 0.0, 1e-6, orbit(1, 2, (1.0,), (1.0, 1.0)))
    found = judged(said("model", "exact", 0.02, 1e-5), wrong, *LADDER[4:])
    assert picked(found, RESPONSE).rung == "model"
    assert picked(found, WAVE).rung == "full"


def test_all_responses_together_ask_one_setting() -> None:
    """The cheapest alone differs; together the one that is right on both is taken."""
    good = answered(*LADDER)
    bad = answered(
        said("rk4", "Δt = 0.01", 0.02, 1e-5),
        said("model", "exact", 0.02, 1e-6, orbit(2, 2, (1.0, 1.0), (1.0, 1.0))),
        *LADDER[2:],
    )
    both = cheapest(RESPONSE, BOARD, [good, bad])
    assert both is not None
    assert both.label is None
    assert both.rung == "circuit"
    assert both.seconds == pytest.approx(4e-6)


def test_two_responses_at_one_frequency_are_told_apart() -> None:
    """By number and b, wherever one of them is named."""
    other = [replace(a, orbit=orbit(2, 2, (1.0, 1.0), (1.0, 1.0))) for a in LADDER]
    labels = ResponseLabel(1, 1.55, 0.25, "1-1-1"), ResponseLabel(2, 1.55, 0.3, "1-2-2")
    answer = document(
        trade(
            [
                answered(*LADDER, label=labels[0]),
                answered(*other, label=labels[1], boards=LeftOut(labels[1], "a reason")),
            ]
        )
    )
    for key in ("rungs", "truths"):
        assert {(r["number"], r["b"]) for r in answer[key]} == {(1, 0.25), (2, 0.3)}
    assert {r["response"] for r in answer["rungs"] if r["number"] == 2} == {"1-2-2"}
    of_each = [c for c in answer["cheapest"] if c["question"] == RESPONSE and c["of"] == BOARD]
    assert [(c["number"], c["omega"], c["b"]) for c in of_each] == [
        (1, 1.55, 0.25), (2, 1.55, 0.3), (None, None, None)
    ]  # fmt: skip
    text = told(answer)
    assert "1: ω = 1.55, b = 0.25: 1-1-1 | 2: ω = 1.55, b = 0.3: 1-2-2" in text
    assert "- 2: ω = 1.55, b = 0.3: a reason" in text
    titles = [axes.get_title(loc="left") for axes in front(answer).axes]
    assert titles == ["1: ω = 1.55, b = 0.25: 1-1-1", "2: ω = 1.55, b = 0.3: 1-2-2"]


def test_a_setting_that_did_not_pass_the_gate_is_never_named() -> None:
    """It is the cheapest that keeps every bound, by luck; and the only one near the waveform."""
    lucky = replace(said("ideal", "step ×4", 0.0004, 1e-9), gate=False)
    named = judged(lucky, *LADDER)
    assert {c.level for c in named.cheapest if c.rung == "ideal"} == set()
    alone = judged(lucky, *(a for a in LADDER if a.fidelity != "full"), *LADDER[-2:])
    assert picked(alone, WAVE).rung != "ideal"
    passed = judged(replace(lucky, gate=True), *LADDER)
    assert picked(passed, WAVE).level == "step ×4"
    answer = document(named)
    assert "| ngspice, ideal op-amps | step ×4 | 0.04 %, 1e-06 (gate not passed) |" in told(answer)
    shown = [text.get_text() for text in front(answer).legends[0].get_texts()]
    assert "pale: gate not passed" in shown


def test_where_nothing_strikes_no_impact_velocity_is_asked() -> None:
    still = orbit(0, 0, (), ())
    quiet = [replace(a, orbit=still) for a in LADDER]
    found = judged(*quiet)
    for of in (BOARD, EQUATIONS):
        one = picked(found, IMPACT, of)
        assert (one.rung, one.level, one.shown, one.note) == (None, None, None, NO_IMPACTS)
        assert picked(found, RESPONSE, of).shown
    assert f"| {IMPACT} | board | – | – | – | – | – | – | no impacts |" in told(document(found))
    second = answered(*quiet, label=ResponseLabel(2, 1.55, 1.5, "1-0-0"))
    both = cheapest(IMPACT, BOARD, [answered(*LADDER), second])
    assert both is not None
    assert (both.rung, both.shown, both.note) == ("circuit", True, "without response 2: no impacts")


@pytest.mark.parametrize("fidelity", ["dynamic", "full"])
def test_the_gate_of_a_setting_asks_two_steps_and_two_methods(fidelity: str) -> None:
    def run(kind: Orbit, off: float = 0.0) -> Any:
        return Read(kind, np.full((9, 4), 1.0 + off), None)

    found = replace(orbit(), extremes=np.array([[-1.0, 2.0]] * 4))
    subject: Any = SimpleNamespace(fidelity=fidelity, orbit=found)
    near, far = run(found, 1.9 * BOUND), run(found, 2.1 * BOUND)  # over a peak of 2
    same, other = run(found), run(replace(found, p=2))
    assert fidelity_answers.passes(subject, same, (near, same))
    assert fidelity_answers.passes(subject, other, (other, other))  # the fidelity's own n-p-q
    for odd in (far, other, SimulationFailed("a reason")):
        assert not fidelity_answers.passes(subject, odd, (same, same))
        assert not fidelity_answers.passes(subject, same, (odd, same))
        assert not fidelity_answers.passes(subject, same, (same, odd))
    unknown = run(Orbit(OrbitStatus.NOT_SETTLED))
    assert not fidelity_answers.passes(subject, unknown, (unknown, unknown))
    ideal: Any = SimpleNamespace(fidelity="ideal", orbit=found)
    assert not fidelity_answers.passes(ideal, other, (other, other))
    half, gear = fidelity_answers.companions(SolverSettings("trap", 2e-6, 1e-5))
    assert (half.method, half.max_step, half.reltol) == ("trap", 1e-6, 1e-5)
    assert (gear.method, gear.max_step, gear.reltol) == ("gear", 1e-6, 1e-5)


@pytest.mark.slow
def test_a_setting_passes_where_the_gate_of_a_study_passes_it() -> None:
    """1-6-6 of the paper's design: neither the gate's first step passes nor half of it."""
    design = synthesised()
    response = next(r for r in design.model_responses if r.omega == 0.284)
    with SpicePool(2, timeout=900.0) as pool, SpicePool(1, timeout=900.0) as timed:
        (word,) = numerics_gate.check(pool, [fidelity_answers.subject(design, response)])
        found = fidelity_answers.measured(
            design,
            response,
            pool,
            SpiceClock(timed),
            levels=((1.0, RELTOL), (0.5, RELTOL), (0.25, RELTOL)),
            rounds_=1,
        )
    ideal = [a for a in found.answers if a.fidelity == "ideal"]
    assert word.tried == tuple(a.settings["steps_a_period"] for a in ideal)
    assert [a.gate for a in ideal] == [False, False, word.passed] == [False, False, True]
    assert found.settings == word.settings
    assert found.seconds > 0.0


def test_velocities_are_compared_in_order_of_size_and_across_twins() -> None:
    a = orbit(2, 1, (1.0, 0.5), (0.8,))
    assert difference(a, orbit(2, 1, (0.5, 1.01), (0.8,))) == pytest.approx(0.01 / 1.01)
    assert difference(a, orbit(1, 2, (0.8,), (0.5, 1.0))) == pytest.approx(0.0)
    assert math.isnan(difference(a, orbit(1, 1)))
    assert alike(a, orbit(1, 2, (0.8,), (0.5, 1.0)))
    assert not alike(a, orbit())
    assert alike(Orbit(OrbitStatus.APERIODIC), Orbit(OrbitStatus.APERIODIC))
    assert not alike(Orbit(OrbitStatus.FAILED), Orbit(OrbitStatus.FAILED))


def of_boards(boards: int, gained: int, lost: int, undecided: int = 0) -> BoardTrade:
    return BoardTrade(
        ONE,
        boards,
        boards - gained,
        gained,
        lost,
        undecided,
        10.0,
        {"circuit": 1e-4, "ideal": 0.05},
    )


@given(st.lists(st.integers(0, 50), min_size=8, max_size=8), st.integers(1, 7))
def test_boards_counted_in_pieces_are_the_boards(counts: list[int], cut: int) -> None:
    first = Tally(*(c * cut // 7 for c in counts))
    rest = Tally(*(c - c * cut // 7 for c in counts))
    assert first + rest == Tally(*counts)


def test_pieces_come_back_as_they_were() -> None:
    rows, truth = compare(ONE, [replace(LADDER[0], seconds=math.nan), *LADDER[1:]])
    settings = SolverSettings("trap", 1.0 / 3.0, 1e-5)
    said = json.loads(dumps(pieces.fidelities_json(rows, truth, settings, 0.1)))
    back = pieces.fidelities(said)
    assert repr(back) == repr((rows, truth, settings, 0.1))  # nan is not nan
    lost = pieces.fidelities(json.loads(dumps(pieces.fidelities_json((), truth, None, math.nan))))
    assert lost[2] is None
    assert math.isnan(lost[3])


@given(st.integers(1, 2000), st.data())
def test_the_interval_of_a_difference_holds_it_and_shrinks(n: int, data: st.DataObject) -> None:
    gained = data.draw(st.integers(0, n))
    lost = data.draw(st.integers(0, n - gained))
    one = of_boards(n, gained, lost)
    d, low, high = one.difference
    assert d == pytest.approx((lost - gained) / n)
    assert low - 1e-12 <= d <= high + 1e-12
    assert one.bound >= abs(d) - 1e-12
    wide = of_boards(4 * n, 4 * gained, 4 * lost)
    assert wide.bound <= one.bound + 1e-12


def test_boards_without_a_difference_leave_room_for_one() -> None:
    """0 of n: a rate that shows none in 5 studies of 100 is the mid-p limit, by hand."""
    for n in (40, 400):
        assert of_boards(n, 0, 0).bound == pytest.approx(1.0 - 0.05 ** (1.0 / n))
    assert of_boards(40, 0, 0).bound > 0.01
    assert not of_boards(40, 0, 0).off(0.01)
    assert of_boards(40, 30, 0).off(0.01)


@given(st.integers(0, 60), st.integers(0, 6), st.data())
def test_the_interval_holds_however_undecided_boards_turn_out(
    decided: int, undecided: int, data: st.DataObject
) -> None:
    """Against every way to decide them, whose interval is then that of decided boards alone."""
    gained = data.draw(st.integers(0, decided))
    lost = data.draw(st.integers(0, decided - gained))
    one = of_boards(decided, gained, lost, undecided)
    d, low, high = one.difference
    assert one.asked == decided + undecided
    assert -1.0 - 1e-12 <= low <= high <= 1.0 + 1e-12
    if decided:
        assert d == pytest.approx((lost - gained) / decided)
        assert low - 1e-12 <= d <= high + 1e-12
    ends = [
        of_boards(one.asked, gained + theirs, lost + mine).difference[1:]
        for theirs, mine in product(range(undecided + 1), repeat=2)
        if theirs + mine <= undecided
    ]
    assert low == pytest.approx(min(end[0] for end in ends), abs=1e-12)
    assert high == pytest.approx(max(end[1] for end in ends), abs=1e-12)


def test_undecided_boards_are_no_evidence(tmp_path: Path) -> None:
    """1000 boards without a difference show 1 %; with 20 undecided they do not, and a difference
    that only the decided ones show is not shown either."""
    some = judged(*LADDER, boards=of_boards(980, 0, 0, 20))
    share = picked(some, SHARE, IDEAL)
    assert (share.rung, share.shown) == ("circuit", False)
    assert share.measured > 0.02
    answer = document(some)
    assert "20 of 1000 boards undecided" in told(answer)
    reason = choose(folder_with(tmp_path / "some", answer)).reason
    assert f"within {100.0 * share.measured:.2g} % of ngspice's yield" in reason
    assert "20 of 1000 boards undecided" in reason
    off = judged(*LADDER, boards=of_boards(400, 20, 0))
    assert picked(off, SHARE, IDEAL).rung == "ideal"
    open_ = judged(*LADDER, boards=of_boards(400, 20, 0, 20))
    assert (picked(open_, SHARE, IDEAL).rung, picked(open_, SHARE, IDEAL).shown) == (
        "circuit", False
    )  # fmt: skip
    none = of_boards(0, 0, 0, 40)
    assert none.bound == 1.0
    assert not none.off(0.01)


@pytest.mark.slow
def test_the_interval_covers_the_truth_nineteen_times_in_twenty() -> None:
    """Summed over all outcomes that matter, for 150 boards."""
    for up, down in ((0.02, 0.0), (0.05, 0.03), (0.3, 0.2)):
        chances = multinomial(150, [up, down, 1.0 - up - down])
        held = 0.0
        for lost, gained in np.ndindex(81, 61):
            chance = float(chances.pmf([lost, gained, 150 - lost - gained]))
            if chance > 1e-6:
                _, low, high = of_boards(150, gained, lost).difference
                held += chance * (low <= up - down <= high)
        assert held > 0.945


def test_the_yield_goes_to_the_exact_circuit_unless_it_is_shown_to_be_off() -> None:
    near = judged(*LADDER, boards=of_boards(1000, 0, 0))
    assert (picked(near, SHARE, IDEAL).rung, picked(near, SHARE, IDEAL).shown) == ("circuit", True)
    few = judged(*LADDER, boards=of_boards(40, 0, 0))
    assert (picked(few, SHARE, IDEAL).rung, picked(few, SHARE, IDEAL).shown) == ("circuit", False)
    off = judged(*LADDER, boards=of_boards(200, 60, 0))
    assert (picked(off, SHARE, IDEAL).rung, picked(off, SHARE, IDEAL).shown) == ("ideal", True)
    assert "off by more than 1 %" in picked(off, SHARE, IDEAL).note


def test_yields_of_all_responses_name_those_that_were_not_asked() -> None:
    labels = [ResponseLabel(n, 1.55, 0.25, "1-1-1") for n in (1, 2)]
    asked = replace(of_boards(1000, 0, 0), label=labels[0])
    found = trade(
        [
            answered(*LADDER, label=labels[0], boards=asked),
            answered(*LADDER, label=labels[1], boards=LeftOut(labels[1], "a reason")),
        ]
    )
    shares = [c for c in found.cheapest if c.question == SHARE]
    assert [(c.label, c.note) for c in shares] == [
        (labels[0], ""), (None, "without response 2")
    ]  # fmt: skip


ORIGIN: Any = {"seed": 1, "settings": {"trade": {"boards": 40}}}


def document(found: Trade) -> Any:
    return trade_json(found, ORIGIN, 1.0, "a title")


def test_with_si_values_every_row_of_a_response_has_its_hertz() -> None:
    found = judged(*LADDER, boards=of_boards(40, 1, 0))
    answer: Any = trade_json(found, ORIGIN, 1.0, "a title", SiScales())
    rows = [r for k in ("rungs", "truths", "boards") for r in answer[k]]
    assert rows
    for row in rows:
        assert row["frequency_hz"] == pytest.approx(row["omega"] / (2.0 * math.pi))
    hertz = drive_text(rows[0]["omega"], rows[0]["frequency_hz"])
    assert hertz.endswith("Hz")
    assert f"1: {hertz}, b = " in told(answer)
    assert "ω = " not in told(answer)


def test_the_json_has_the_keys_of_the_contract_and_the_sheet_says_them() -> None:
    answer = document(judged(*LADDER, boards=of_boards(40, 1, 0)))
    assert json.loads(json.dumps(answer, allow_nan=False)) == answer
    for row in answer["rungs"]:
        assert {"rung", "settings", "omega", "error", "seconds_per_period"} <= set(row)
    by = {(row["rung"], row["level"]): row for row in answer["rungs"]}
    assert by["full", "step ×0.5"]["error"] is by["full", "step ×2"]["error"] is None
    assert by["full", "step ×2"]["convergence"] == pytest.approx(0.0005, rel=1e-3)
    assert by["full", "step ×0.5"]["convergence"] is None, "there is no finer one"
    assert by["model", "exact"]["error_of_equations"] is None
    assert by["model", "exact"]["error"] > 0.0
    text = told(answer)
    assert "`--boards 40 --seed 1`" in text
    assert (
        "| waveform within 0.1 % | board | ngspice, full op-amps | step ×2 | – | 0.06 % | yes |"
        in text
    )
    assert "| 1: ω = 1.55, b = 0.25 | 40 | 39 | 0 | 1 | 0 | 0 | -2.5 % |" in text
    for key in ("error", "numerical_error"):
        assert len(front(answer, key).axes) == 1


def test_what_bandwidth_changes_of_a_yield_is_told_of_the_same_boards() -> None:
    counts = Tally(decided=40, ok=39, lagging_decided=50, lagging_ok=41, lagging_gained=1,
                   lagging_lost=6, lagging_seconds=0.4)  # fmt: skip
    one = BoardTrade.of(ONE, counts + Tally(decided=10, ok=7, lagging_seconds=0.1), 1.0)
    assert one.seconds["bandwidth"] == pytest.approx(0.5 / 50)
    answer = document(judged(*LADDER, boards=one))
    (boards,) = answer["boards"]
    found = boards["bandwidth"]
    assert {k: found[k] for k in ("boards", "ok", "gained", "lost")} == {
        "boards": 50, "ok": 41, "gained": 1, "lost": 6
    }  # fmt: skip
    assert found["difference"] == pytest.approx(-0.1)
    # The difference of two yields, as that of the engines is.
    like = of_boards(50, 6, 1).difference
    assert (found["low"], found["high"]) == pytest.approx(like[1:])
    assert "| 1: ω = 1.55, b = 0.25 | 50 | 41 | 1 | 6 | -10 % |" in told(answer)
    none = BoardTrade.of(ONE, Tally(decided=40, ok=39), 1.0)
    assert document(judged(*LADDER, boards=none))["boards"][0]["bandwidth"] is None


def test_the_full_op_amps_err_against_a_vendor_s_macromodel() -> None:
    """What was convergence while they stood for the board is an error against something else."""
    beyond = [said("vendor", "step ×1", 0.0101, 0.1), said("vendor", "step ×0.5", 0.01, 0.2)]
    rows, truth = compare(ONE, [*LADDER, *beyond], "vendor")
    answer = document(trade([TradedResponse(rows, truth)]))
    by = {(row["rung"], row["level"]): row for row in answer["rungs"]}
    assert by["full", "step ×0.5"]["error"] == pytest.approx(0.01, rel=1e-2)
    assert by["vendor", "step ×1"]["error"] is None
    assert by["vendor", "step ×1"]["convergence"] == pytest.approx(1e-4, rel=1e-2)
    assert "the vendor's macromodel of the op-amps" in told(answer)
    assert len(front(answer).axes) == 1


def test_a_vendor_s_truth_needs_a_vendor_s_model(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "model.toml").write_text(MODEL, encoding="utf-8")
    words = ["trade", str(tmp_path / "model.toml"), "--out", str(tmp_path / "out")]
    assert entry.status([*words, "--truth", "vendor", "-q"]) == 2
    assert "no vendor's model of TL074C" in capfd.readouterr().err
    assert not (tmp_path / "out").exists()


def test_with_a_vendor_s_model_full_is_still_the_data_sheet_s() -> None:
    figures = load_catalog().opamp("TL074C")
    plain = replace(circuit_of(EXACT), figures=figures)
    run = replace(orbit(), start=np.zeros(4))
    reduction = Reduction(plain, nominal_board(plain))
    one = numerics_gate.GateSubject(reduction, Excitation(400.0, 1.0), run)
    assert set(fidelity_answers.in_ngspice(one, "full")) == {"ideal", "dynamic", "full"}
    lines = (".subckt own inp inn out vcc vee", "E42 out 0 inp inn 1e5", ".ends own")
    vendor = VendorModel("part.lib", "own", PINS, lines, b"")
    circuit = replace(plain, figures=replace(figures, spice=vendor))
    asked = replace(one, reduction=Reduction(circuit, nominal_board(circuit)))
    on = fidelity_answers.in_ngspice(asked, "vendor")
    settings = SolverSettings("trap", one.period / 200.0)
    decks = {name: numerics_gate.job(of, settings).netlist for name, of in on.items()}
    assert [name for name, deck in decks.items() if "E42" in deck] == ["vendor"]
    same = replace(one, fidelity="full", start=on["full"].start)
    assert decks["full"] == numerics_gate.job(same, settings).netlist
    assert on["ideal"].start is None, "only op-amps with a bandwidth begin on its orbit"


# ---------------------------------------------------------------------------------------------
# The fidelity of a study


def folder_with(path: Path, answer: dict[str, Any] | None) -> Folder:
    folder = Folder(path)
    folder.begin({"trade": ({}, ["trade.json"])}, {})
    if answer is not None:
        folder.write("trade.json", json.dumps(answer))
        folder.finish("trade")
    return Folder(path)


def test_a_study_takes_the_fidelity_that_was_measured(tmp_path: Path) -> None:
    assert choose(Folder(tmp_path / "none")) == fidelity_choice.FidelityChoice("auto", "")
    assert choose(folder_with(tmp_path / "begun", None)).rung == "auto"
    near = document(judged(*LADDER, boards=of_boards(1000, 0, 0)))
    choice = choose(folder_with(tmp_path / "near", near))
    assert choice.rung == "auto"
    assert "40 boards of each response" in choice.reason
    off = document(judged(*LADDER, boards=of_boards(200, 60, 0)))
    choice = choose(folder_with(tmp_path / "off", off))
    assert choice.rung == "ngspice"
    assert "every board in ngspice" in choice.reason


def test_a_response_that_ideal_op_amps_do_not_show_is_named(tmp_path: Path) -> None:
    other = orbit(2, 2, (1.0, 1.0), (1.0, 1.0))
    answers = [replace(a, orbit=other) if a.fidelity == "full" else a for a in LADDER]
    choice = choose(folder_with(tmp_path / "d", document(judged(*answers))))
    told = "at ω = 1.55, b = 0.25 the exact circuit is not shown to have the nominal board's n-p-q"
    assert told in choice.reason
    near = of_boards(1000, 0, 0)
    wrong = [replace(a, orbit=other) if a.fidelity == "circuit" else a for a in LADDER]
    choice = choose(folder_with(tmp_path / "c", document(judged(*wrong, boards=near))))
    assert told in choice.reason  # though a model that shows it is cheaper still
    off = of_boards(200, 60, 0)
    choice = choose(folder_with(tmp_path / "n", document(judged(*wrong, boards=off))))
    assert "n-p-q" not in choice.reason


def test_boards_that_were_left_out_say_why(tmp_path: Path) -> None:
    found = judged(*LADDER, boards=LeftOut(ONE, "the numerics gate did not pass"))
    choice = choose(folder_with(tmp_path / "d", document(found)))
    assert choice.rung == "auto"
    assert "no boards (ω = 1.55, b = 0.25: the numerics gate did not pass)" in choice.reason


@pytest.mark.parametrize("fidelity", ["exact", "ngspice"])
def test_what_was_asked_for_stands(tmp_path: Path, fidelity: Any) -> None:
    near = document(judged(*LADDER, boards=of_boards(1000, 0, 0)))
    folder = folder_with(tmp_path / "near", near)
    options = Options(rung=fidelity)
    assert with_fidelity(folder, options) is options
    notes: list[str] = []

    class Heard(Progress):
        def note(self, text: str) -> None:
            notes.append(text)

    with report_to(Heard()):
        assert with_fidelity(folder, Options()).rung == "auto"
        assert len(notes) == 1
        assert with_fidelity(Folder(tmp_path / "no"), Options()).rung == "auto"
    assert len(notes) == 1


def test_ngspice_is_asked_about_forty_boards_at_least() -> None:
    assert fidelity_choice.LEAST >= 40
    answers: Any = [
        SimpleNamespace(sample=i, question=0, verdict="ok", response="1-1-1", radius=0.1)
        for i in range(200)
    ]
    asks = cross_check.ask_random(answers)
    asked = [a for a in asks if a.kind is cross_check.StartKind.NOMINAL]
    assert len(asked) >= fidelity_choice.LEAST


def test_a_trade_that_somebody_changed_is_refused(tmp_path: Path) -> None:
    folder = folder_with(tmp_path / "d", {"format": 1, "cheapest": [{"question": SHARE}]})
    with pytest.raises(InputError, match="what trade wrote"):
        choose(folder)


def test_a_stage_of_its_own_that_goes_with_the_design() -> None:
    from designer.base.manifest import OF_DESIGN, STAGES

    assert "trade" in STAGES
    assert "trade" in OF_DESIGN
    assert ManifestStage({"a": 1}).hash == ManifestStage({"a": 1}).hash


# ---------------------------------------------------------------------------------------------
# The verb


@pytest.mark.slow
def test_trade_measures_a_design_and_keeps_it(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    model, out = tmp_path / "model.toml", tmp_path / "out"
    model.write_text(MODEL, encoding="utf-8")
    words = ["trade", str(model), "--out", str(out), "--boards", "2", "--jobs", "2"]
    assert entry.status([*words, "--json", "-q"]) == 0
    answer = json.loads(capfd.readouterr().out)
    assert set(NAMES) <= {p.name for p in out.iterdir()}
    rows = answer["rungs"]
    assert {row["rung"] for row in rows} == set(fidelity_answers.FIDELITIES) - {
        fidelity_answers.VENDOR
    }
    assert all(row["seconds_per_period"] > 0.0 for row in rows)
    by = {
        fidelity: [r for r in rows if r["rung"] == fidelity]
        for fidelity in ("rk4", "model", "ideal")
    }
    assert by["model"][0]["error_of_equations"] is None
    steps = [r["error_of_equations"] for r in by["rk4"]]
    assert steps[-1] < steps[0] / 10.0  # four times eight the steps of a method of order 4
    assert by["ideal"][-1]["numerical_error"] < 1e-3
    assert [r["gate"] for r in by["rk4"] + by["model"]] == [None] * 5
    assert by["ideal"][2]["gate"]  # the paper's case passes at the gate's first step
    # At the coarsest settings rounding decides whether a run has settled; the gate refuses them.
    assert {r["response"] for r in rows if r["gate"] is not False} == {"1-1-1"}
    assert answer["boards"][0]["bandwidth"]["boards"] == 2
    questions = {(c["question"], c["of"]) for c in answer["cheapest"]}
    assert questions == {*product((RESPONSE, IMPACT, WAVE), (BOARD, EQUATIONS)), (SHARE, IDEAL)}
    assert entry.status(["trade", str(out), "--boards", "2", "--json", "-q"]) == 0
    assert json.loads(capfd.readouterr().out) == answer  # reused
    assert entry.status(["trade", str(out), "--boards", "3", "-q"]) == 2
    assert "--overwrite" in capfd.readouterr().err
    assert entry.status(["tolerance", str(out), "--samples", "2", "--jobs", "2"]) == 0
    assert "rung by trade.json" in capfd.readouterr().err


@pytest.mark.slow
def test_an_interrupted_trade_goes_on_where_it_was(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C after the fidelities and the first boards; then neither is done again, and the boards
    are those of one go."""
    model, out = tmp_path / "model.toml", tmp_path / "out"
    model.write_text(MODEL, encoding="utf-8")
    words = ["trade", str(model), "--out", str(out), "--boards", "6", "--jobs", "2", "-q"]
    monkeypatch.setattr("designer.jobs.trade_job.CHUNK", 3)
    count, done = yields.tally, list[range]()

    def interrupted(plan: Any, samples: range, *rest: Any) -> Any:
        if done:
            raise KeyboardInterrupt
        done.append(samples)
        return count(plan, samples, *rest)

    monkeypatch.setattr("designer.fidelity.yields.tally", interrupted)
    assert entry.status(words) == 130
    assert done == [range(3)]
    assert not json.loads((out / "manifest.json").read_text())["complete"]
    kept = json.loads((out / pieces.PIECES).read_text())["pieces"]
    assert set(kept) == {"rungs 1", "boards 1, 0 to 2"}
    monkeypatch.setattr("designer.fidelity.yields.tally", count)
    measured = fidelity_answers.measured
    # To call it would fail.
    monkeypatch.setattr("designer.fidelity.fidelity_answers.measured", None)
    assert entry.status(words) == 2
    assert "--resume" in capfd.readouterr().err
    # Of a damaged file the pieces that are whole are taken, and the others made again.
    path = out / pieces.PIECES
    path.write_text(path.read_text()[:-9])
    done.clear()

    def counted(plan: Any, samples: range, *rest: Any) -> Any:
        done.append(samples)
        return count(plan, samples, *rest)

    monkeypatch.setattr("designer.fidelity.yields.tally", counted)
    loud = [word for word in words if word != "-q"]
    assert entry.status([*loud, "--resume", "--json"]) == 0
    assert done == [range(3), range(3, 6)]
    shown = capfd.readouterr()
    assert f"{pieces.PIECES}: 1 entry is damaged" in shown.err
    answer = json.loads(shown.out)
    assert json.loads((out / "manifest.json").read_text())["complete"]
    assert not (out / pieces.PIECES).exists()
    assert answer["rungs"][-1]["seconds_per_period"] == kept["rungs 1"]["rows"][-1]["seconds"]
    monkeypatch.setattr("designer.fidelity.fidelity_answers.measured", measured)
    monkeypatch.setattr("designer.jobs.trade_job.CHUNK", 100)
    once = ["trade", str(model), "--boards", "6", "--jobs", "2", "-q", "--json"]
    assert entry.status(once) == 0
    (mine,), (theirs,) = answer["boards"], json.loads(capfd.readouterr().out)["boards"]
    for key in ("boards", "ok", "gained", "lost", "undecided", "periods"):
        assert mine[key] == theirs[key]


def test_numbers_that_cannot_be_are_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "model.toml"
    model.write_text(MODEL, encoding="utf-8")
    assert entry.status(["trade", str(model), "--boards", "-1"]) == 2
    assert "--boards" in capfd.readouterr().err
    model.write_text(MODEL[: MODEL.index("[[")], encoding="utf-8")
    assert entry.status(["trade", str(model), "--out", str(tmp_path / "out")]) == 2
    assert "response" in capfd.readouterr().err
    assert not (tmp_path / "out").exists()
