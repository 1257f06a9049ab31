"""Small studies on the paper's circuit with exact parts: what tuning and starting are tested on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from designer.circuit.board_arrays import Boards
from designer.circuit.board_values import Board
from designer.circuit.ensemble import Ensemble
from designer.dynamics.counts import Counts
from designer.model.response_table import Response
from designer.spread.spread import Spread
from designer.verdicts import exact_circuit
from designer.verdicts.verdict import Answer, Question, StudyPlan
from designer.yields.yield_count import Yield, count
from tests.shared.paper_cases import OMEGA, subject

SPREAD = Spread(0.01, 0.01, 1e-3, 4e-3)


def question(p: int) -> Question:
    """The 1-p-p response of the nominal circuit."""
    known = subject(p)
    spec = Response(OMEGA[p], Counts(1, ((p, p),)))
    return Question(spec, known.excitation, known.orbit, None)


def plan(*ps: int, spread: Spread = SPREAD, seed: int = 11, samples: int = 25) -> StudyPlan:
    """A study of these 1-p-p responses."""
    return StudyPlan(subject(ps[0]).circuit, spread, seed, samples, tuple(map(question, ps)))


def study_yields(of: StudyPlan, rows: Sequence[Answer]) -> tuple[Yield, ...]:
    """The yield of each question of the plan."""
    return tuple(count(a for a in rows if a.question == k) for k in range(len(of.questions)))


def answers(of: StudyPlan, indices: range) -> list[Answer]:
    """As built."""
    return exact_circuit.block(of, indices, 2)


def ensemble(boards: Sequence[Board], p: int = 1) -> Ensemble:
    return Ensemble(Boards.of(subject(p).circuit, boards))


def shifted(p: int, volts: float, section: str = "U1A") -> Board:
    """The nominal board, with an input offset of one section alone."""
    board = subject(p).board
    return replace(board, offset={**board.offset, section: volts})


def period_counts(strobes: np.ndarray, counts: np.ndarray) -> tuple[int, int, int] | None:
    """n-p-q by eye, from the end of a long run: least n whose strobes repeat three times within
    1e-6 of the largest; None where there is none up to 16."""
    peak = np.abs(strobes).max(axis=0)
    for n in range(1, 17):
        last = strobes[-3 * n - 1 :]
        if (np.abs(last[n:] - last[:-n]) < 1e-6 * peak).all():
            q, p = counts[-n:].sum(axis=(0, 1))
            return n, int(p), int(q)
    return None
