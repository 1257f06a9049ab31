"""The coordinates that matter most at the ends of their ranges, in every combination."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from designer.boards import Boards
from designer.circuit import Circuit, nominal_board
from designer.ensemble import Ensemble
from designer.exact import drive_of
from designer.margin_indices import Index
from designer.margins import Margin
from designer.quantities import Quantity, with_column
from designer.system import Index as Places
from designer.verdict import StudyPlan, Verdict, judge

CORNER = 5
"""Coordinates that are put to the ends of their ranges."""


@dataclass(frozen=True)
class Corner:
    """Coordinates at the ends of their ranges, all others nominal.

    coordinates : what was put to its ends; worst : for each "low" or "high" in the corner of the
    least margin; margin : there. verdict, response : on the exact rung. survived : of ``corners``.
    """

    coordinates: tuple[str, ...]
    worst: tuple[str, ...]
    margin: float
    verdict: Verdict
    response: str
    survived: int
    corners: int


def worst_corners(
    plan: StudyPlan,
    margins: Sequence[Margin],
    indices: Sequence[Sequence[Index]],
    jobs: int,
    progress: Callable[[], None],
) -> list[Corner | None]:
    """For each question the corners of its ``CORNER`` largest indices, on the exact rung; None
    where nothing limits. progress : called once an attractor.
    """
    width = len(plan.spread.coordinates(plan.circuit))
    ends = plan.spread.from_cube(
        plan.circuit, np.array([np.zeros(width), np.full(width, 1.0 - 2.0**-53)])
    )
    out: list[Corner | None] = []
    for i, (margin, ranked) in enumerate(zip(margins, indices, strict=True)):
        known = {q.name: q for q in margin.quantities}
        chosen = [known[x.coordinate] for x in ranked if x.coordinate in known][:CORNER]
        if not chosen:
            out.append(None)
            continue
        picks = np.array(list(product((0, 1), repeat=len(chosen))), dtype=np.intp)
        boards = _corner_boards(plan.circuit, chosen, ends, picks)
        question = plan.questions[i]
        orbits = Ensemble(boards).settle(
            range(len(boards)),
            [drive_of(question.excitation)] * len(boards),
            np.tile(question.start.start, (len(boards), 1)),
            jobs=jobs,
            progress=progress,
        )
        verdicts = [judge(o, question.spec, question.start)[0] for o in orbits]
        values = margin.of(boards)
        worst = int(np.argmin(values))
        out.append(
            Corner(
                tuple(q.name for q in chosen),
                tuple("high" if end else "low" for end in picks[worst]),
                float(values[worst]),
                verdicts[worst],
                orbits[worst].response,
                sum(v is Verdict.OK for v in verdicts),
                len(boards),
            )
        )
    return out


def _corner_boards(
    circuit: Circuit, chosen: Sequence[Quantity], ends: Boards, picks: Places
) -> Boards:
    """(2^k,) nominal boards with the chosen quantities at their low (0) or high (1) end."""
    boards = Boards.of(circuit, [nominal_board(circuit)]).take(np.zeros(len(picks), dtype=np.intp))
    for k, q in enumerate(chosen):
        # Of a lower limit too "low" is the smaller number, whichever way it is drawn.
        pair = np.sort(getattr(ends, q.group)[q.part])
        boards = with_column(boards, q, pair[picks[:, k]])
    return boards
