"""When a way is given up: rarely where its yield is the target, mostly where it is far below."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.stats import binom

from designer.centering import repair_ways
from designer.centering.repair_branch import PLACE
from designer.centering.repair_measure import MeasuredYield, VerdictCache
from designer.centering.repair_ways import (
    FEW,
    RARE,
    ResponseSurvey,
    ResponseWay,
    first_boards,
    forecast,
    foretold,
    settled,
)
from designer.circuit.board_values import nominal_board
from designer.circuit.coefficients import coefficient_errors
from designer.circuit.netlist import Excitation
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.counts import Counts
from designer.dynamics.flow import Flow
from designer.model.model import Dimensionless
from designer.model.response_table import Response
from designer.spread.spread import Spread
from designer.verdicts.verdict import Question, StudyPlan, Verdict
from designer.yields.yield_count import Yield
from tests.circuit.test_coefficients import exact_for_paper
from tests.circuit.test_reduction import circuit_of

TARGET = 0.99


class _Boards:
    """Boards of which nobody asks more than their numbers."""

    def __init__(self, which: Sequence[int] = range(2 * FEW)) -> None:
        self.which = which

    def take(self, which: Sequence[int]) -> _Boards:
        return _Boards([self.which[k] for k in which])


def survey(
    monkeypatch: pytest.MonkeyPatch, lost: dict[int, int], verdict: Verdict
) -> ResponseSurvey:
    """lost : boards without an answer among those from this number on; verdict : that all of them
    have once they are settled."""

    def forecast(boards: _Boards, *_: object) -> list[Verdict | None]:
        first = boards.which[0]
        return [*[None] * lost[first], *[Verdict.OK] * (FEW - lost[first])]

    monkeypatch.setattr(repair_ways, "forecast", forecast)
    monkeypatch.setattr(repair_ways, "settled", lambda boards, *_: [verdict] * len(boards.which))
    nothing = cast(Any, None)
    return ResponseSurvey(nothing, TARGET, 1, VerdictCache(), 0.0, frozenset(), (), 1, lambda: None)


def bounded(
    monkeypatch: pytest.MonkeyPatch, first: int, second: int, verdict: Verdict = Verdict.LOST
) -> ResponseWay:
    way = ResponseWay(0, "as it is", cast(Any, None), rate=0.5)
    boards = [cast(Any, _Boards())]
    return survey(monkeypatch, {0: first, FEW: second}, verdict).bounded(way, boards)


def test_a_way_is_given_up_rarely_at_the_target_and_mostly_far_below(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """By summing the binomial over every outcome of the two looks."""
    given_up = {(a, b): bounded(monkeypatch, a, b).hopeless for a in range(16) for b in range(16)}
    for share, low, high in ((TARGET, 0.0, 2.0 * RARE), (0.9, 0.9, 1.0)):
        chance = sum(
            float(binom.pmf(a, FEW, 1.0 - share) * binom.pmf(b, FEW, 1.0 - share))
            for (a, b), out in given_up.items()
            if out
        )
        assert low <= chance + float(binom.sf(15, FEW, 1.0 - share)) <= high


def test_the_share_is_that_of_the_boards_that_were_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    assert bounded(monkeypatch, 0, 9).most == 1.0  # the second look is not taken
    assert bounded(monkeypatch, 2, 1).most == 1.0  # open, and too few to settle them
    assert bounded(monkeypatch, 4, 9).most == pytest.approx(1.0 - 13 / (2 * FEW))
    out = bounded(monkeypatch, 20, 0)
    assert out.hopeless
    assert out.most == pytest.approx(1.0 - 20 / FEW)


@pytest.mark.parametrize("verdict", [Verdict.OK, Verdict.GRAZING, Verdict.FAILED])
def test_a_way_is_given_up_for_lost_boards_only(
    monkeypatch: pytest.MonkeyPatch, verdict: Verdict
) -> None:
    assert not bounded(monkeypatch, 20, 20, verdict).hopeless


@cache
def lightly_damped() -> tuple[StudyPlan, Question]:
    """The paper's circuit with a fortieth of its damping, ζ = 0.0025, on its 1-0-0 response at
    ω = 2.5; little varies, so every board is ok."""
    values = exact_for_paper()
    for name in ("R2", "R3", "R8", "R9"):
        values[name] *= 40.0
    circuit = circuit_of(values)
    model = Dimensionless(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.0025, f20=0.0, b=0.25)
    errors = coefficient_errors(circuit, model.second_order())
    assert errors.max_error < 1e-9
    volts = 0.25 / float(errors.drive_gain[0])
    excitation = Excitation(errors.scales.frequency(2.5), volts)
    reduction = Reduction(circuit, nominal_board(circuit))
    orbit = settle(Flow(reduction.system(), excitation.drive), np.zeros(4))
    assert orbit.response == "1-0-0"
    assert float(np.abs(orbit.multipliers).max()) == pytest.approx(0.9975, abs=5e-4)
    question = Question(Response(2.5, Counts(1, ((0, 0),))), excitation, orbit, None)
    return StudyPlan(circuit, Spread(1e-3, 1e-3, 1e-5, 4e-5), 11, FEW, (question,)), question


def test_boards_that_settle_slowly_are_not_lost() -> None:
    """What falls to rest at |multiplier| 0.9975 a period takes longer than the compiled way grants.
    All are ok, by the plain settling of each, and no way is given up for them."""
    plan, question = lightly_damped()
    boards = first_boards(plan, 2 * FEW)
    assert forecast(boards, question, 2).count(None) > 20  # a tenth would give a way up
    assert set(settled(boards, question, 2)) == {Verdict.OK}
    assert {a.verdict for a in foretold(boards, question, 2)} == {Verdict.OK}
    none = cast(Any, None)
    survey = ResponseSurvey(
        none, TARGET, 1, VerdictCache(), 0.0, frozenset(), (plan,), 2, lambda: None
    )
    assert not survey.bounded(ResponseWay(0, "as it is", question, rate=0.5)).hopeless


def test_a_way_that_lost_no_board_is_not_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    sure = ResponseWay(0, "omega", cast(Any, None), rate=1.0)
    assert survey(monkeypatch, {0: FEW}, Verdict.LOST).bounded(sure) is sure
    assert sure.certain


@pytest.mark.parametrize(("missed", "kinds"), [((), 1), ((0,), 2), ((1,), 1)])
def test_what_was_measured_to_miss_gets_further_ways(
    monkeypatch: pytest.MonkeyPatch, missed: tuple[int, ...], kinds: int
) -> None:
    """Though few boards showed it often enough."""
    nothing = cast(Any, None)
    monkeypatch.setattr(repair_ways, "plan_of", lambda *_: nothing)
    monkeypatch.setattr(
        repair_ways, "measure", lambda *_, **__: MeasuredYield(Yield(100, 0, 0, 0), TARGET)
    )
    branch = cast(Any, SimpleNamespace(synthesis=nothing))
    survey = ResponseSurvey(
        branch, TARGET, 1, VerdictCache(), 0.05, frozenset({PLACE}), (), 1, lambda: None, missed
    )
    found = survey.ways(ResponseWay(0, "as it is", nothing, rate=1.0))
    assert [way.kind for way in found] == ["as it is", "trim"][:kinds]
    assert not any(way.hopeless for way in found)
