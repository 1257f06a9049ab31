"""What a search says while it works: one progress over its designs, and the best so far."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from designer.base.progress import MINUTE, ProgressLines
from designer.centering import design_search
from designer.centering.candidate import Candidate
from designer.centering.levers import DesignChoice
from designer.centering.response_windows import OperatingPoint, Stretch
from designer.model.find_responses import ModelResponse
from tests.shared.search_cases import catalog, file, made


class Heard(ProgressLines):
    """Counts the steps of each stage; a minute passes with each design."""

    def __init__(self) -> None:
        self.now = 0.0
        super().__init__(lambda: self.now)
        self.stages: list[tuple[str, int | None]] = []
        self.counts: dict[str, int] = {}
        self.said: list[str] = []
        self.noted: list[str] = []

    def stage(self, text: str, total: int | None = None) -> Callable[[], None]:
        step = super().stage(text, total)
        self.stages.append((text, total))

        def counted() -> None:
            self.counts[text] = self.counts.get(text, 0) + 1
            step()

        return counted

    def note(self, text: str) -> None:
        self.noted.append(text)
        super().note(text)

    def _say(self, line: str) -> None:
        self.said.append(line)
        super()._say(line)


@pytest.fixture
def searched(monkeypatch: pytest.MonkeyPatch) -> Heard:
    """A search of two dead zones whose designs cost nothing: the third is the best by far."""
    heard, number = Heard(), [0]

    def make(_: object, choice: DesignChoice, responses: tuple[ModelResponse, ...]) -> Candidate:
        number[0] += 1
        heard.now += MINUTE
        heard.beat()
        scored: Any = SimpleNamespace(reliability_index=3.0 if number[0] == 3 else 1.0)
        return Candidate(choice, made().design, responses, (scored,))

    monkeypatch.setattr(design_search._DesignSearch, "_made", make)
    monkeypatch.setattr(design_search._DesignSearch, "_synthesis", lambda *_: made())
    asked = file('omega = 0.85\nexpect = "1-2-2"', zones='"rectifier", "saturation"')
    start = made().model_responses[0].orbit.start
    windows = ((Stretch((OperatingPoint(0.85, 0.25, start),)),),)
    with heard:
        design_search.search(asked, catalog(), windows=windows)
    return heard


def test_all_designs_are_one_progress_with_the_time_left(searched: Heard) -> None:
    """As many as are made: of each dead zone, and with each setting of a lever that is not the
    file's own."""
    (name, total), worth = searched.stages
    assert (name, total) == ("designs", searched.counts["designs"])
    assert worth == ("what each lever is worth", searched.counts["what each lever is worth"])
    assert [line for line in searched.said if " left" in line]


def test_the_best_yield_so_far_is_told(searched: Heard) -> None:
    told = [line for line in searched.noted if "best so far" in line]
    assert told[0].endswith("design, best so far after 0:01:00: none yet")
    assert "predicted yield 0.8413" in told[1]  # a standard deviation
    assert "predicted yield 0.9987" in told[3]  # three
