"""ngspice's word on a candidate: boards it is asked about, what is remembered, what counts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from designer.quantities import between
from designer.reduction import Reduction
from designer.search_distance import STREAM, Stand, Stretched
from designer.search_heard import BOARDS, FEWER, STRETCH, Heard, Listener
from designer.search_memory import Memory
from designer.search_windows import Place
from designer.spread import draw_many
from designer.workers import SpicePool
from tests.search_cases import made, spread


def bench(memory: Memory | None = None) -> tuple[Stretched, Stand]:
    found = Stretched(made().design, spread(), 1, BOARDS, memory=memory)
    (response,) = made().found
    place = Place(response.omega, response.b, response.orbit.start)
    (stand,) = found.stands([(response.spec, place)])
    assert stand is not None
    return found, stand


@pytest.mark.parametrize(
    ("exact", "ngspice", "held"),
    [(16, 16, True), (16, 16 - FEWER, True), (16, 15 - FEWER, False), (0, 0, False)],
)
def test_what_counts_as_borne_out(exact: int, ngspice: int, held: bool) -> None:
    assert Heard(exact, ngspice).borne_out is held


def test_the_boards_are_those_of_the_prediction() -> None:
    boards, stand = bench()
    drawn = draw_many(made().design.circuit, spread(), 1, range(3), STREAM)
    wider = between(drawn, np.full(3, STRETCH))
    subjects = boards.subjects(stand, range(3), STRETCH)
    assert len(subjects) == 3
    for i, subject in enumerate(subjects):
        mine = Reduction(made().design.circuit, wider.board(i)).system()
        assert np.allclose(subject.system.start, mine.start, rtol=0.0, atol=1e-12)
        assert subject.board.values == wider.board(i).values
        assert subject.orbit.response == "1-2-2"
        assert subject.excitation == boards.excitation(stand.place)
    assert boards.nominal(stand).board.values != subjects[0].board.values


@pytest.mark.slow
def test_ngspice_keeps_what_it_keeps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    memory = Memory(tmp_path / "said.jsonl", "mine")
    boards, stand = bench()
    calls: list[int] = []
    with SpicePool(2) as pool:
        (heard,) = Listener(pool, memory)(boards, [stand], lambda: calls.append(1))
        nothing = Listener(pool, memory)(boards, [None])
    assert heard == Heard(BOARDS, BOARDS)
    assert calls == [1]
    assert nothing == (Heard(0, 0),)

    # What is known is not asked again.
    def never(*_: object) -> Sequence[Any]:
        raise AssertionError("asked again")

    monkeypatch.setattr("designer.search_heard.gate.check", never)
    known = Memory(tmp_path / "said.jsonl", "mine")
    with SpicePool(1) as pool:
        assert Listener(pool, known)(boards, [stand]) == (heard,)
