"""ngspice's word on a candidate: boards it is asked about, what is remembered, what counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from designer.centering.answer_cache import AnswerCache
from designer.centering.ngspice_check import (
    BOARDS_ASKED,
    FEWER,
    LEAST,
    LONGEST,
    STRETCH,
    Agreement,
    AgreementCheck,
)
from designer.centering.response_windows import OperatingPoint
from designer.centering.scaled_sigma import STREAM, OperatingOrbit, ScaledBoards
from designer.circuit.reduction import Reduction
from designer.dynamics.orbit import OrbitStatus
from designer.spice.pool import SpicePool
from designer.spread.board_quantities import between
from designer.spread.spread import draw_many
from designer.verdicts.cross_check import OR, UNDECIDED
from designer.verdicts.ngspice_runs import NgspiceAnswer, Query
from tests.shared.search_cases import made, spread


def bench(memory: AnswerCache | None = None) -> tuple[ScaledBoards, OperatingOrbit]:
    found = ScaledBoards(made().design, spread(), 1, BOARDS_ASKED, memory=memory)
    (response,) = made().model_responses
    place = OperatingPoint(response.omega, response.b, response.orbit.start)
    (operating_orbit,) = found.operating_orbits([(response.spec, place)])
    assert operating_orbit is not None
    return found, operating_orbit


@pytest.mark.parametrize(
    ("exact", "ngspice", "unanswered", "held"),
    [
        (16, 16, 0, True),
        (16, 16 - FEWER, 0, True),
        (16, 15 - FEWER, 0, False),
        (16, 15 - FEWER, 1, True),  # no answer is no loss
        (16, 7, 9, None),  # nor does it bear anything out
        (8, 8 - FEWER, 0, True),
        (8, 7 - FEWER, 0, False),
        (7, 7, 0, None),
        (0, 0, 0, None),
    ],
)
def test_what_counts_as_borne_out(
    exact: int, ngspice: int, unanswered: int, held: bool | None
) -> None:
    assert Agreement(exact, ngspice, unanswered).borne_out is held


@dataclass(frozen=True)
class Gate:
    passed: bool
    settings: None = None


@pytest.mark.parametrize(
    ("spec", "answers", "found"),
    [
        ({}, ("1-2-2",) * 16, Agreement(16, 16)),
        ({"expect": None}, ("1-2-2",) * 16, Agreement(16, 16)),
        ({}, ("1-2-2",) * 12 + ("2-4-4", "chaos", "1-3-2", "aperiodic"), Agreement(16, 12)),
        ({}, ("1-2-2",) * 15 + ("not settled",), Agreement(16, 15, 1)),
        ({}, ("1-2-2",) * 14 + ("1-1-1 or 1-3-3", "1-2-2 or 1-3-3"), Agreement(16, 14, 1)),
        ({}, ("1-2-2",) * 15 + (OrbitStatus.GRAZING,), Agreement(16, 15, 1)),
        ({}, ("1-2-2",) * 13 + (OrbitStatus.FAILED, UNDECIDED, "1-1-1"), Agreement(16, 13, 2)),
    ],
)
def test_what_ngspice_says_is_counted(
    spec: dict[str, Any],
    answers: Sequence[str],
    found: Agreement,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """ngspice is played: these answers."""

    def run_queries(_: object, queries: Sequence[Query]) -> list[NgspiceAnswer]:
        assert all(q.subject.fidelity == "dynamic" for q in queries)
        assert {q.expected for q in queries} == {"1-2-2"}
        return [
            NgspiceAnswer(UNDECIDED, either=a) if OR in a else NgspiceAnswer(a) for a in answers
        ]

    boards, operating_orbit = bench()
    wanted = replace(operating_orbit, spec=replace(operating_orbit.spec, **spec))
    monkeypatch.setattr(
        "designer.centering.ngspice_check.numerics_gate.check", lambda *_: [Gate(passed=True)]
    )
    monkeypatch.setattr("designer.centering.ngspice_check.run_queries", run_queries)
    assert AgreementCheck(None, AnswerCache())(boards, [wanted]) == (found,)  # type: ignore[arg-type]


def test_a_gate_that_does_not_pass_leaves_every_board_open(monkeypatch: pytest.MonkeyPatch) -> None:
    boards, operating_orbit = bench()
    monkeypatch.setattr(
        "designer.centering.ngspice_check.numerics_gate.check", lambda *_: [Gate(passed=False)]
    )
    (found,) = AgreementCheck(None, AnswerCache())(boards, [operating_orbit])  # type: ignore[arg-type]
    assert found == Agreement(BOARDS_ASKED, 0, BOARDS_ASKED)
    assert found.borne_out is None


def test_a_long_way_is_not_gone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where eight boards are left the others are unanswered, where fewer are nobody is asked."""

    def run_queries(_: object, queries: Sequence[Query]) -> list[NgspiceAnswer]:
        return [NgspiceAnswer("1-2-2")] * len(queries)

    boards, operating_orbit = bench()
    monkeypatch.setattr(
        "designer.centering.ngspice_check.numerics_gate.check", lambda *_: [Gate(passed=True)]
    )
    monkeypatch.setattr("designer.centering.ngspice_check.run_queries", run_queries)
    for near, found in (
        (LEAST, Agreement(16, LEAST, 16 - LEAST)),
        (LEAST - 1, Agreement(16, 0, 16)),
    ):
        ways = iter([LONGEST] * near + [LONGEST + 1] * (16 - near))
        monkeypatch.setattr(
            "designer.centering.ngspice_check.way_to_fidelity", lambda _, ways=ways: next(ways)
        )
        assert AgreementCheck(None, AnswerCache())(boards, [operating_orbit]) == (found,)  # type: ignore[arg-type]


def test_the_boards_are_those_of_the_prediction() -> None:
    boards, operating_orbit = bench()
    drawn = draw_many(made().design.circuit, spread(), 1, range(3), STREAM)
    wider = between(drawn, np.full(3, STRETCH))
    subjects = boards.subjects(operating_orbit, range(3), STRETCH)
    assert len(subjects) == 3
    for i, subject in enumerate(subjects):
        mine = Reduction(made().design.circuit, wider.board(i)).system()
        assert np.allclose(subject.system.start, mine.start, rtol=0.0, atol=1e-12)
        assert subject.board.values == wider.board(i).values
        assert subject.orbit.response == "1-2-2"
        assert subject.excitation == boards.excitation(operating_orbit.place)
    assert boards.nominal(operating_orbit).board.values != subjects[0].board.values


@pytest.mark.slow
def test_ngspice_keeps_what_it_keeps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    memory = AnswerCache(tmp_path / "said.jsonl", "mine")
    boards, operating_orbit = bench()
    calls: list[int] = []
    with SpicePool(2) as pool:
        (heard,) = AgreementCheck(pool, memory)(boards, [operating_orbit], lambda: calls.append(1))
        nothing = AgreementCheck(pool, memory)(boards, [None])
    assert heard == Agreement(BOARDS_ASKED, BOARDS_ASKED)
    assert calls == [1]
    assert nothing == (Agreement(0, 0),)

    # What is known is not asked again.
    def never(*_: object) -> Sequence[Any]:
        raise AssertionError("asked again")

    monkeypatch.setattr("designer.centering.ngspice_check.numerics_gate.check", never)
    known = AnswerCache(tmp_path / "said.jsonl", "mine")
    with SpicePool(1) as pool:
        assert AgreementCheck(pool, known)(boards, [operating_orbit]) == (heard,)
