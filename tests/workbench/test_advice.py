"""Advice, held against the general kernel: the board at the setting that is named."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from designer.circuit.ensemble import Ensemble
from designer.model.tuning_bands import Bands
from designer.verdicts.exact_circuit import settled
from designer.verdicts.verdict import Verdict
from designer.workbench import advice as advice_module
from designer.workbench.advice import SURE, Advice, advise
from designer.workbench.board_fit import BoardFit
from designer.workbench.board_prior import Prior
from tests.shared.bench_plans import SPREAD, question
from tests.shared.paper_cases import subject

P = 2


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """The fits below leave nothing open, so the boards that a setting is asked of are all alike."""
    monkeypatch.setattr(advice_module, "SAMPLES", 8)
    monkeypatch.setattr(advice_module, "FEW", 4)


def known_board(z: np.ndarray) -> BoardFit:
    """A fit that leaves nearly nothing of this board open."""
    prior = Prior(subject(P).circuit, SPREAD, bandwidth=False)
    covariance = 1e-8 * np.eye(prior.size)
    return BoardFit(prior, (), z, covariance, (), (), (), (), (), 0)


@cache
def lost() -> BoardFit:
    """The first board of the spread that does not show 1-2-2 as it is set."""
    fit = known_board(np.zeros(Prior(subject(P).circuit, SPREAD).size))
    for z in fit.prior.draws(30)[1:]:
        if verdict(known_board(z), Advice(question(P), {}, 0.0)) is Verdict.LOST:
            return known_board(z)
    raise AssertionError("no board lost")


def verdict(fit: BoardFit, advice: Advice, without: tuple[str, ...] = ()) -> Verdict:
    """Of the most probable board at the advised setting, by the general kernel."""
    boards = fit.prior.boards(fit.centre[None]).exact(without)
    case = (0, advice.question, advice.excitation, advice.question.start.start)
    return settled(Ensemble(boards, fast=False), [case])[0][1]


@pytest.mark.slow
def test_a_lost_board_is_brought_back() -> None:
    (advice,) = advise(lost(), [question(P)], Bands())
    assert advice.as_set == 0.0
    assert advice.helps
    assert advice.share == pytest.approx(1.0)
    assert advice.parts == ()
    assert verdict(lost(), advice) is Verdict.OK
    answer = advice.as_dict()
    assert answer["turn"]
    assert answer["expected"] == "1-2-2"
    assert answer["offset_v"] == pytest.approx(
        answer["change"]["offset"] * question(P).excitation.amplitude
    )


@pytest.mark.slow
def test_where_no_lever_may_be_turned_a_part_is_named() -> None:
    (advice,) = advise(lost(), [question(P)], Bands(0.0, 0.0, 0.0))
    assert not advice.helps
    assert not advice.as_dict()["turn"]
    assert advice.parts
    first = advice.parts[0].part
    circuit = lost().prior.circuit
    names = tuple(s.name for s in circuit.sections if s.package == first) or (first,)
    assert verdict(lost(), advice, names) is Verdict.OK


def test_a_good_board_is_left_alone() -> None:
    fit = known_board(np.zeros(lost().prior.size))
    (advice,) = advise(fit, [question(P)], Bands())
    assert advice.as_set >= SURE
    assert not advice.as_dict()["turn"]
    assert dict(advice.shown) == {"1-2-2": 1.0}
