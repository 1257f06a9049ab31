"""The coordinates that matter most at the ends of their ranges, in every combination.

The corners are those of the cube that boards are drawn from. So temperature, ageing and what parts
have in common are coordinates like any other, and a part's value at a corner is one that a board
can have: its temperature coefficient acts with the board's temperature, not beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from designer.base.arrays import Index as Places
from designer.circuit.board_arrays import Boards
from designer.circuit.ensemble import Ensemble
from designer.spread.board_quantities import column
from designer.spread.spread import BOARD
from designer.yields.blame_pieces import StoredParts, counted
from designer.yields.margins import Margin
from designer.yields.sobol import Index
from designer.yields.verdict import StudyPlan, Verdict, judge

CORNER = 5
"""Coordinates that are put to the ends of their ranges."""
LAST = 1.0 - 2.0**-53
"""End of a coordinate of the cube."""


@dataclass(frozen=True)
class Corner:
    """Coordinates at the ends of their ranges, all others in the middle of theirs."""

    coordinates: tuple[str, ...]
    """What was put to its ends."""
    worst: tuple[str, ...]
    """For each "low" or "high", the smaller or larger number, in the corner of the least margin."""
    margin: float
    """Margin in the worst corner."""
    verdict: Verdict
    """What became of the corner's board on the exact rung."""
    response: str
    """n-p-q or status of the corner's board on the exact rung."""
    survived: int
    """Of ``corners`` corners, those whose board shows the response."""
    corners: int
    """Corners that were asked."""


def worst_corners(
    plan: StudyPlan,
    margins: Sequence[Margin],
    indices: Sequence[Sequence[Index]],
    jobs: int,
    progress: Callable[[], None],
    pieces: StoredParts | None = None,
) -> list[Corner | None]:
    """For each question the corners of its ``CORNER`` largest indices, on the exact rung; None
    where nothing limits. progress : called once an attractor. pieces : what is known already, and
    where the rest goes.
    """
    pieces = StoredParts() if pieces is None else pieces
    out: list[Corner | None] = []
    for number, (margin, ranked) in enumerate(zip(margins, indices, strict=True)):

        def corner(
            step: Callable[[], None],
            number: int = number,
            margin: Margin = margin,
            ranked: Sequence[Index] = ranked,
        ) -> Corner | None:
            return _worst(plan, number, margin, ranked, jobs, step)

        # A margin of more crossings is another margin.
        name = f"corner {number} of {margin.sought}"
        out.append(counted(pieces, name, progress, corner))
    return out


def _worst(
    plan: StudyPlan,
    number: int,
    margin: Margin,
    ranked: Sequence[Index],
    jobs: int,
    progress: Callable[[], None],
) -> Corner | None:
    """The corner of one question."""
    # Measured boards are in no order, so they have no ends.
    chosen = [x.coordinate for x in ranked if x.total > 0.0 and x.coordinate != BOARD][:CORNER]
    if not chosen:
        return None
    places = {name: k for k, name in enumerate(plan.spread.coordinates(plan.circuit))}
    columns = [places[name] for name in chosen]
    picks = np.array(list(product((0, 1), repeat=len(chosen))), dtype=np.intp)
    boards = _at(plan, columns, picks)
    falling = _falling(plan, columns, chosen, margin)
    question = plan.questions[number]
    orbits = Ensemble(boards).settle(
        range(len(boards)),
        [question.excitation.drive] * len(boards),
        np.tile(question.start.start, (len(boards), 1)),
        jobs=jobs,
        progress=progress,
    )
    verdicts = [judge(o, question.spec, question.start)[0] for o in orbits]
    values = margin.of(boards)
    worst = int(np.argmin(values))
    return Corner(
        tuple(chosen),
        tuple("low" if end == 0 else "high" for end in picks[worst] ^ falling),
        float(values[worst]),
        verdicts[worst],
        orbits[worst].response,
        sum(v is Verdict.OK for v in verdicts),
        len(boards),
    )


def _at(plan: StudyPlan, columns: Sequence[int], picks: Places) -> Boards:
    """Boards with these coordinates at their first (0) or last (1) end, a row of ``picks`` each."""
    cube = np.full((len(picks), len(plan.spread.coordinates(plan.circuit))), 0.5)
    cube[:, columns] = np.where(picks == 1, LAST, 0.0)
    return plan.spread.from_cube(plan.circuit, cube)


def _falling(
    plan: StudyPlan, columns: Sequence[int], chosen: Sequence[str], margin: Margin
) -> Places:
    """(k,) 1 where the quantity of a coordinate's name falls with it, as a lower limit does."""
    known = {q.name: q for q in margin.quantities}
    out = np.zeros(len(chosen), dtype=np.intp)
    for k, (place, name) in enumerate(zip(columns, chosen, strict=True)):
        if name in known:
            first, last = column(_at(plan, [place], np.array([[0], [1]])), known[name])
            out[k] = last < first
    return out
