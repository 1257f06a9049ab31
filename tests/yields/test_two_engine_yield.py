"""The estimate from both engines: unbiased, covering, and the exact one where they agree."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from designer.base.proportion import wilson
from designer.verdicts.cross_check import (
    BOUNDARY_SAMPLES,
    OR,
    Ask,
    CrossCheck,
    StartKind,
    Why,
    ask_boundary,
    ask_random,
    is_answer,
)
from designer.verdicts.verdict import Answer, Verdict
from designer.yields.two_engine_yield import (
    Combined,
    Explanation,
    Stratum,
    combine,
    differences,
    interval,
)
from designer.yields.yield_count import Yield
from tests.shared.exploring import quick
from tests.verdicts.test_ngspice_sampling import BLANK, HEARD, question

OK, LOST = "1-2-2", "1-1-1"
QUESTION = question()


def world(
    rng: np.random.Generator, boards: int, rate: float, gain: float, loss: float
) -> tuple[list[Answer], dict[int, bool]]:
    """Boards whose exact verdict is ok at ``rate``; ngspice differs at rates ``gain`` where the
    exact one is lost, ``loss`` where it is ok, four times as often on slow boards and most often
    next to a boundary."""
    ok = rng.uniform(size=boards) < rate
    slow = rng.uniform(size=boards) < 0.15
    depth = rng.uniform(size=boards)
    likely = np.where(ok, loss, gain) * np.where(slow, 4.0, 1.0)
    likely = np.minimum(np.where(depth < 0.02, 0.4, likely), 1.0)
    said = ok ^ (rng.uniform(size=boards) < likely)
    answers = [
        replace(
            BLANK,
            sample=i,
            verdict=Verdict.OK if ok[i] else Verdict.LOST,
            response=OK if ok[i] else LOST,
            radius=0.95 if slow[i] else 0.5,
            penetration=float(depth[i]),
        )
        for i in range(boards)
    ]
    return answers, dict(enumerate(said.tolist()))


def listened(answers: list[Answer], said: dict[int, bool], asks: list[Ask]) -> list[CrossCheck]:
    return [
        replace(HEARD, sample=a.sample, kind=a.kind, why=a.why, response=OK if s else LOST)
        for a in asks
        for s in [said[a.sample]]
    ]


def joined(answers: list[Answer], said: dict[int, bool], boundary: bool = True) -> Combined:
    asks = ask_random(answers)
    if boundary:
        asks += ask_boundary(answers, [QUESTION], asks)
    both = combine(answers, listened(answers, said, asks), QUESTION)
    assert both is not None
    return both


@pytest.mark.parametrize("boundary", quick([True, False]))
@pytest.mark.parametrize(
    ("boards", "rate", "gain", "loss"),
    quick(
        [
            (250, 0.9, 0.1, 0.01),
            (250, 0.5, 0.05, 0.05),
            (250, 0.8, 0.0, 0.04),
            (250, 0.97, 0.0, 0.0),
            (250, 1.0, 0.0, 0.06),  # as much as fifty boards hide one time in twenty
        ]
    ),
)
def test_estimates_are_unbiased_and_intervals_cover(
    boards: int, rate: float, gain: float, loss: float, boundary: bool
) -> None:
    """Over 120 studies: the truth is ngspice's yield over a great many boards of the same world."""
    rng = np.random.default_rng([7, boards])
    _, truth = world(rng, 40_000, rate, gain, loss)
    wanted = float(np.mean(list(truth.values())))
    found = [joined(*world(rng, boards, rate, gain, loss), boundary) for _ in range(120)]
    estimates = np.array([f.estimate for f in found])
    error = estimates.std(ddof=1) / np.sqrt(len(found))
    assert abs(estimates.mean() - wanted) < 4.0 * error + 4e-3
    covered = np.mean([f.low <= wanted <= f.high for f in found])
    assert covered >= 0.95 - 2.0 * np.sqrt(0.95 * 0.05 / len(found))


def test_engines_that_agree_give_the_exact_estimate() -> None:
    answers, _ = world(np.random.default_rng(1), 500, 0.8, 0.0, 0.0)
    said = {a.sample: a.verdict is Verdict.OK for a in answers}
    both = joined(answers, said)
    counted = Yield(sum(said.values()), 500 - sum(said.values()), 0, 0)
    assert both.estimate == counted.rate
    low, high = counted.interval
    assert both.low < low < high < both.high  # fifty boards may hide a difference
    assert both.high - both.low < 0.9 * _by_wilson(both)
    assert both.disagreement.count == 0
    assert both.differences == ()
    everything = [Ask(i, 0, StartKind.NOMINAL, Why.ALL) for i in range(500)]
    whole = combine(answers, listened(answers, said, everything), QUESTION)
    assert whole is not None
    assert (whole.low, whole.high) == pytest.approx((low, high))


def _by_wilson(both: Combined) -> float:
    """The width if the limits of what was not seen were Wilson's: by hand, for no differences."""
    total = sum(s.samples for s in both.strata)
    low, high = wilson(both.estimate * total, total)
    off_low, off_high = 0.0, 0.0
    for s in both.strata:
        most = wilson(0, s.asked)[1] * np.sqrt(1.0 - s.asked / s.samples) * s.samples / total
        off_low += most**2 if s.could_lose else 0.0
        off_high += most**2 if s.could_gain else 0.0
    low = both.estimate - np.sqrt((both.estimate - low) ** 2 + off_low)
    return float(both.estimate + np.sqrt((high - both.estimate) ** 2 + off_high) - low)


def test_every_board_in_ngspice_gives_its_own_yield() -> None:
    answers, said = world(np.random.default_rng(2), 400, 0.6, 0.2, 0.2)
    everything = [Ask(i, 0, StartKind.NOMINAL, Why.ALL) for i in range(400)]
    both = combine(answers, listened(answers, said, everything), QUESTION)
    assert both is not None
    ok = sum(said.values())
    assert both.estimate == pytest.approx(ok / 400)
    assert (both.low, both.high) == pytest.approx(Yield(ok, 400 - ok, 0, 0).interval)


def test_strata_hold_every_decided_board_once() -> None:
    answers, said = world(np.random.default_rng(3), 300, 0.7, 0.1, 0.1)
    answers[5] = replace(answers[5], verdict=Verdict.FAILED)
    both = joined(answers, said)
    assert sum(s.samples for s in both.strata) == 299
    names = {s.name: s for s in both.strata}
    assert set(names) == {"boundary", "slow", "rest"}
    assert names["boundary"].samples == names["boundary"].asked == BOUNDARY_SAMPLES
    near = sorted((a for a in answers if a.sample != 5), key=lambda a: a.penetration)
    assert near[BOUNDARY_SAMPLES].penetration > 0.0
    for s in both.strata:
        assert s.could_gain + s.could_lose == s.samples
        assert s.gained <= s.could_gain
        assert s.lost <= s.could_lose


def test_a_stratum_without_an_answer_goes_with_the_rest() -> None:
    answers = [replace(BLANK, sample=i, radius=0.95 if i > 250 else 0.5) for i in range(300)]
    both = joined(answers, dict.fromkeys(range(300), True), boundary=False)
    (only,) = both.strata
    assert (only.name, only.samples, only.asked) == ("rest", 300, 50)


def test_boards_without_an_answer_are_bounded() -> None:
    """Sixty asked of 60, five of them in vain: what it would be had these been lost, or ok."""
    answers = [replace(BLANK, sample=i) for i in range(60)]
    heard = [
        replace(
            HEARD, sample=i, kind=StartKind.NOMINAL, why=Why.ALL,
            response="" if i in (7, 20) else "undecided" if i == 33 else "failed" if i > 57
            else LOST if i < 5 else OK,
        )
        for i in range(60)
    ]  # fmt: skip
    both = combine(answers, heard, QUESTION)
    assert both is not None
    assert both.undecided == 5
    assert both.estimate == pytest.approx(50 / 55)
    assert both.if_lost == pytest.approx(50 / 60)
    assert both.if_ok == pytest.approx(55 / 60)
    all_answered = combine(answers, [h for h in heard if is_answer(h.response)], QUESTION)
    assert all_answered is not None
    assert all_answered.if_lost == all_answered.if_ok == all_answered.estimate


def test_a_board_that_is_lost_by_either_step_is_lost() -> None:
    """Undecided between two other responses; between one of them and the wanted one it is open."""
    answers = [replace(BLANK, sample=i) for i in range(10)]
    says = {3: OR.join((LOST, "aperiodic")), 7: OR.join((LOST, OK))}
    heard = [
        replace(
            HEARD, sample=i, kind=StartKind.NOMINAL, why=Why.ALL,
            response="undecided" if i in says else OK, either=says.get(i, ""),
        )
        for i in range(10)
    ]  # fmt: skip
    assert [heard[i].survives(QUESTION) for i in (0, 3, 7)] == [True, False, None]
    both = combine(answers, heard, QUESTION)
    assert both is not None
    assert both.estimate == pytest.approx(8 / 9)
    assert both.undecided == 1
    assert both.if_lost == pytest.approx(8 / 10)
    assert (both.disagreement.count, both.disagreement.of) == (1, 9)
    assert [(d.sample, d.ngspice) for d in both.differences] == [(3, "1-1-1 or aperiodic")]


def test_no_answer_from_ngspice_is_no_estimate() -> None:
    heard = [
        replace(HEARD, kind=StartKind.NOMINAL, response=r) for r in ("failed", "undecided", "")
    ]
    assert combine([BLANK], [], QUESTION) is None
    assert combine([BLANK], [HEARD], QUESTION) is None  # from its own orbit alone
    assert all(combine([BLANK], [h], QUESTION) is None for h in heard)


@given(st.data())
def test_limits_lie_about_the_estimate(data: st.DataObject) -> None:
    strata = []
    for name in data.draw(st.lists(st.sampled_from("abc"), min_size=1, max_size=3, unique=True)):
        ok, lost = data.draw(st.integers(0, 200)), data.draw(st.integers(0, 200))
        if ok + lost == 0:
            continue
        asked_ok, asked_lost = data.draw(st.integers(0, ok)), data.draw(st.integers(0, lost))
        if asked_ok + asked_lost == 0:
            continue
        gained = data.draw(st.integers(0, asked_lost))
        drop = data.draw(st.integers(0, asked_ok))
        asked = asked_ok + asked_lost
        strata.append(Stratum(name, ok + lost, asked, gained, drop, lost, ok))
    if strata:
        estimate, low, high = interval(sum(s.could_lose for s in strata), strata)
        assert 0.0 <= low <= estimate <= high <= 1.0


@pytest.mark.parametrize(
    ("answer", "said", "stayed", "expected"),
    [
        ({"response": "grazing"}, {}, False, Explanation.GRAZING),
        ({"penetration": 1e-3}, {}, False, Explanation.GRAZING),
        ({"miss": 1e-3}, {}, True, Explanation.GRAZING),
        ({"response": "clipped"}, {}, False, Explanation.CLIPPED),
        ({}, {"kind": StartKind.NOMINAL}, True, Explanation.BASIN),
        ({"radius": 0.95}, {"kind": StartKind.NOMINAL}, False, Explanation.NONE),
        ({"radius": 0.95}, {"kind": StartKind.NOMINAL}, True, Explanation.BASIN),
        ({"response": "5-1-1"}, {}, False, Explanation.NONE),
        ({"response": "aperiodic"}, {}, False, Explanation.NONE),
        ({}, {}, False, Explanation.NONE),
    ],
)
def test_every_difference_is_listed_with_what_explains_it(
    answer: dict[str, object], said: dict[str, object], stayed: bool, expected: Explanation
) -> None:
    nominal = replace(QUESTION.start, extremes=np.array([[-1.0, 1.0]] * 4))
    asked = replace(QUESTION, start=nominal)
    mine = replace(BLANK, **answer)  # type: ignore[arg-type]
    heard = [replace(HEARD, response="3-7-7", **said)]  # type: ignore[arg-type]
    if stayed:
        heard.append(replace(HEARD, response=mine.response))
    (found,) = differences([mine], heard, asked)
    assert (found.exact, found.ngspice) == (mine.response, "3-7-7")
    assert found.explanation is expected
