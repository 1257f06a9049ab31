"""When a way is given up: rarely where its yield is the target, mostly where it is far below."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any, cast

import pytest
from scipy.stats import binom

from designer import cure_ways
from designer.api import synthesise
from designer.cure_branch import Branch
from designer.cure_study import Book, asked, plan_of
from designer.cure_ways import FEW, RARE, Looker, Way, forecast, foretold, settled
from designer.modelfile import parse_model_file
from designer.spread import draw_many
from designer.upgrade import Upgrades
from designer.verdict import Verdict

TARGET = 0.99


class _Boards:
    """Boards of which nobody asks more than their numbers."""

    def __init__(self, which: Sequence[int] = range(2 * FEW)) -> None:
        self.which = which

    def take(self, which: Sequence[int]) -> _Boards:
        return _Boards([self.which[k] for k in which])


def looker(monkeypatch: pytest.MonkeyPatch, lost: dict[int, int], verdict: Verdict) -> Looker:
    """lost : boards without an answer among those from this number on; verdict : that all of them
    have once they are settled."""

    def forecast(boards: _Boards, *_: object) -> list[Verdict | None]:
        first = boards.which[0]
        return [*[None] * lost[first], *[Verdict.OK] * (FEW - lost[first])]

    monkeypatch.setattr(cure_ways, "forecast", forecast)
    monkeypatch.setattr(cure_ways, "settled", lambda boards, *_: [verdict] * len(boards.which))
    nothing = cast(Any, None)
    return Looker(nothing, TARGET, 1, Book(), 0.0, frozenset(), (), 1, lambda: None)


def bounded(
    monkeypatch: pytest.MonkeyPatch, first: int, second: int, verdict: Verdict = Verdict.LOST
) -> Way:
    way = Way(0, "as it is", cast(Any, None), rate=0.5)
    boards = [cast(Any, _Boards())]
    return looker(monkeypatch, {0: first, FEW: second}, verdict).bounded(way, boards)


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


SLOW = """
format = 1
title = "A lightly damped system that does not reach its stops"

[model]
m = 0.5
k = 0.5
k0 = 0.95
c = 0.5
zeta = 0.01
f20 = 0.0
b = 0.25

[[response]]
omega = 2.5
expect = "1-0-0"

[circuit]
opamp = "TL074C"
saturation = 13.0
resistors = "E24"
resistor_grade = 0.01
capacitor_grade = 0.01
"""


@cache
def slow_branch() -> Branch:
    return Branch(Upgrades(), synthesise(parse_model_file(SLOW)), 0.0)


def test_boards_that_settle_slowly_are_not_lost() -> None:
    """1-0-0 far from resonance with ζ = 0.01, which settles at |multiplier| 0.99 a period: longer
    than the compiled way grants on many boards. All are ok, by the plain settling of each."""
    made = slow_branch().made
    (question,) = asked(made, made.found)
    assert question is not None
    plan = plan_of(made, question, 1, 50)
    boards = draw_many(plan.circuit, plan.spread, plan.seed, range(50))
    assert forecast(boards, question, 2).count(None) > 5
    assert set(settled(boards, question, 2)) == {Verdict.OK}
    assert {a.verdict for a in foretold(boards, question, 2)} == {Verdict.OK}
    seeker = Looker(
        slow_branch(), TARGET, 1, Book(), 0.0, frozenset({"place"}), (plan,), 2, lambda: None
    )
    assert not seeker.bounded(Way(0, "as it is", question, rate=0.5), [boards, boards]).hopeless


def test_a_way_that_lost_no_board_is_not_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    sure = Way(0, "omega", cast(Any, None), rate=1.0)
    assert looker(monkeypatch, {0: FEW}, Verdict.LOST).bounded(sure) is sure
    assert sure.certain
