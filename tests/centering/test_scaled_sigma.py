"""The reliability index: the fit against the law that it assumes, and boards against the exact
circuit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.stats import norm

from designer.centering.answer_cache import AnswerCache
from designer.centering.response_windows import OperatingPoint
from designer.centering.scaled_sigma import LADDER, STREAM, ScaledBoards, StretchCounts
from designer.circuit.ensemble import Ensemble
from designer.dynamics.attractors import STAGES
from designer.spread.board_quantities import between
from designer.spread.spread import draw_many
from designer.verdicts.verdict import Verdict, judge
from tests.shared.search_cases import made, spread

COUNT = 6
PATIENCE = sum(STAGES[:3])
"""Drive periods after which the compiled way gives up."""


def counts(index: float, boards: int = 10**7) -> StretchCounts:
    """What so many boards show where the law holds."""
    shown = [round(boards * float(norm.cdf(index / s))) for s in LADDER]
    return StretchCounts(LADDER, (boards,) * len(LADDER), tuple(shown))


@given(st.floats(-3.0, 4.5))
def test_an_index_is_found_again(index: float) -> None:
    assert counts(index).reliability_index == pytest.approx(index, abs=2e-3)


@given(st.lists(st.integers(0, 40), min_size=4, max_size=4), st.integers(0, 3), st.integers(1, 5))
def test_more_boards_that_show_it_are_never_nearer(shown: list[int], place: int, more: int) -> None:
    better = list(shown)
    better[place] = min(better[place] + more, 40)
    asked = (40,) * 4
    near = StretchCounts(LADDER, asked, tuple(shown)).reliability_index
    assert StretchCounts(LADDER, asked, tuple(better)).reliability_index >= near - 1e-3


def test_without_a_loss_it_is_finite() -> None:
    found = StretchCounts(LADDER, (64,) * 4, (64,) * 4)
    # All but half a board at the largest stretch: the law's own answer for that yield.
    assert 4.0 < found.reliability_index < 12.0
    assert found.predicted > 0.9999


def test_the_boards_are_the_spread_s_stretched() -> None:
    """The compiled shortcut counts what the exact circuit, asked one by one, says."""
    synthesis, response = made(), made().model_responses[0]
    bench = ScaledBoards(synthesis.design, spread(), 5, COUNT)
    place = OperatingPoint(response.omega, response.b, response.orbit.start)
    (operating_orbit,) = bench.operating_orbits([(response.spec, place)])
    assert operating_orbit is not None
    (found,) = bench.ask([operating_orbit], range(COUNT))

    drawn = draw_many(synthesis.design.circuit, spread(), 5, range(COUNT), STREAM)
    seen = 0
    for number, stretch in enumerate(LADDER):
        boards = Ensemble(between(drawn, np.full(COUNT, stretch)), fast=False)
        orbits = boards.settle(
            range(COUNT),
            [operating_orbit.drive] * COUNT,
            np.tile(operating_orbit.orbit.start, (COUNT, 1)),
        )
        ok = [judge(o, response.spec, operating_orbit.orbit)[0] is Verdict.OK for o in orbits]
        answered = Ensemble(boards.boards).quick(
            range(COUNT),
            [operating_orbit.drive] * COUNT,
            np.tile(operating_orbit.orbit.start, (COUNT, 1)),
        )
        # A board that takes long, or clips on its way, stays open: lost, in a prediction.
        soon = sum(good and quick is not None for good, quick in zip(ok, answered, strict=True))
        assert found.ok[number] == soon
        assert all(o.periods <= PATIENCE for o in answered if o is not None)
        seen += soon
    assert seen > len(LADDER) * COUNT // 2


def test_a_place_without_the_response_has_no_orbit() -> None:
    bench = ScaledBoards(made().design, spread(), 5, 1)
    response = made().model_responses[0]
    there = OperatingPoint(0.85, 0.25, response.orbit.start)
    elsewhere = OperatingPoint(0.6, 0.25, response.orbit.start)
    operating_orbits = bench.operating_orbits([(response.spec, there), (response.spec, elsewhere)])
    assert operating_orbits[0] is not None
    assert operating_orbits[1] is None


def test_what_is_known_is_not_asked_again(monkeypatch: pytest.MonkeyPatch) -> None:
    memory, response = AnswerCache(), made().model_responses[0]
    place = OperatingPoint(response.omega, response.b, response.orbit.start)
    asked, quick = [], Ensemble.quick

    def counted(self: Ensemble, which: Sequence[int], *rest: Any, **more: Any) -> Any:
        asked.append(len(which))
        return quick(self, which, *rest, **more)

    monkeypatch.setattr(Ensemble, "quick", counted)
    answers = []
    for _ in range(2):
        bench = ScaledBoards(made().design, spread(), 5, COUNT, memory=memory)
        (operating_orbit,) = bench.operating_orbits([(response.spec, place)])
        assert operating_orbit is not None
        answers.append(bench.ask([operating_orbit], range(COUNT)))
    assert answers[0] == answers[1]
    places = [1, 1]  # where the nominal board is, each time
    assert sorted(asked) == [*places, COUNT * len(LADDER)]
