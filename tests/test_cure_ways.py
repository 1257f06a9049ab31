"""When a way is given up: rarely where its yield is the target, mostly where it is far below."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import pytest
from scipy.stats import binom

from designer import cure_ways
from designer.cure_study import Book
from designer.cure_ways import FEW, RARE, Looker, Way
from designer.verdict import Verdict

TARGET = 0.99


class _Boards:
    """Boards of which nobody asks more than the first's number."""

    def __init__(self, start: int = 0) -> None:
        self.start = start

    def take(self, which: Sequence[int]) -> _Boards:
        return _Boards(which[0])


def looker(settles: bool, monkeypatch: pytest.MonkeyPatch, lost: dict[int, int]) -> Looker:
    """lost : boards without an answer among those from this number on."""

    def forecast(boards: _Boards, *_: object) -> list[Any]:
        return [None] * lost[boards.start] + ["ok"] * (FEW - lost[boards.start])

    monkeypatch.setattr(cure_ways, "forecast", forecast)
    monkeypatch.setattr(cure_ways, "judge", lambda *_: (Verdict.OK, ""))
    monkeypatch.setattr(Looker, "_any_settles", lambda *_: settles)
    nothing = cast(Any, None)
    return Looker(
        nothing, TARGET, 1, Book(), 0.0, frozenset(), cast(Any, _Boards()), nothing, 1, lambda: None
    )


def bounded(monkeypatch: pytest.MonkeyPatch, first: int, second: int, settles: bool = False) -> Way:
    way = Way(0, "as it is", cast(Any, type("Q", (), {"spec": None, "start": None})()), rate=0.5)
    return looker(settles, monkeypatch, {0: first, FEW: second}).bounded(way)


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
    assert bounded(monkeypatch, 2, 1).most == pytest.approx(1.0 - 3 / (2 * FEW))
    out = bounded(monkeypatch, 20, 0)
    assert out.hopeless
    assert out.most == pytest.approx(1.0 - 20 / FEW)


def test_a_way_stays_where_an_open_board_settles(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not bounded(monkeypatch, 20, 0, settles=True).hopeless


def test_a_way_that_lost_no_board_is_not_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    sure = Way(0, "omega", cast(Any, None), rate=1.0)
    assert looker(False, monkeypatch, {0: FEW}).bounded(sure) is sure
    assert sure.certain
