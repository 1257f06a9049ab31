"""How much of a blame is done: all of it where that stays within a budget, else a stated share.

The unit is a step: an attractor that is sought, or an orbit that is followed. How many there are
is known before the first, so that progress can say how long it takes. What a budget leaves out are
boards: fewer lost ones are replayed and followed, of every response in turn, never fewer parts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from designer.circuit.board_arrays import Boards
from designer.spread.board_quantities import quantities
from designer.spread.spread import draw_many
from designer.yields.blame_replay import KEPT, LOST, ExactChange, Replay, changes, replays
from designer.yields.corners import CORNER
from designer.yields.crossings import ROUNDS
from designer.yields.margins import lost_boards
from designer.yields.verdict import Answer, StudyPlan, Verdict

BUDGET = 20_000
"""Steps of a blame, about, where nobody says another number."""
DRAWN = 256
"""Boards, at least, from which the standard deviations of the quantities are taken."""


@dataclass(frozen=True)
class Extent:
    """What a blame of these answers does."""

    boards: Boards
    """Boards of the study, by sample."""
    rows: tuple[tuple[Answer, ...], ...]
    """The answers to each question, by sample."""
    made: tuple[ExactChange, ...]
    """What is made exact."""
    replays: tuple[Replay, ...]
    """Boards that are asked again."""
    crossings: tuple[tuple[int, int], ...]
    """Lost boards that are followed from the nominal one, as (question, sample)."""
    steps: int
    """Steps of all this, at most."""
    whole: int
    """Steps of all this without a budget."""

    @property
    def share(self) -> float:
        """Of the whole work, that which is done."""
        return self.steps / self.whole if self.whole else 1.0

    @property
    def hopeless(self) -> list[bool]:
        """Of each question, whether boards were lost and none is ok."""
        return [
            any(a.verdict is Verdict.LOST for a in row)
            and not any(a.verdict is Verdict.OK for a in row)
            for row in self.rows
        ]


def extent_of(
    plan: StudyPlan,
    answers: Sequence[Answer],
    budget: int | None = None,
    *,
    lost: int = LOST,
    kept: int = KEPT,
) -> Extent:
    """What a blame of these answers does within a budget of so many steps; without one, all.

    answers : of any of the plan's samples, in any order. lost, kept : boards of each response that
    are replayed, at most. The nominal board and the corners are always looked at, and so is one
    board at least of each response that lost any.
    """
    boards = draw_many(
        plan.circuit,
        plan.spread,
        plan.seed,
        range(max(1 + max((a.sample for a in answers), default=0), DRAWN)),
    )
    rows = tuple(
        tuple(sorted((a for a in answers if a.question == i), key=lambda a: a.sample))
        for i in range(len(plan.questions))
    )
    again, followed = replays(rows, (lost, kept)), _in_turn(lost_boards(rows))
    samples = sorted({r.sample for r in again})
    made = changes(plan.circuit, boards.take(samples)) if samples else []
    around = 2 * len(quantities(plan.circuit, boards))
    least = len(rows) * (around + 2**CORNER)
    costs = (len(made), ROUNDS + around)
    whole = least + len(again) * costs[0] + len(followed) * costs[1]
    if budget is not None and budget < whole:
        share = max(budget - least, 0) / (whole - least)
        # The first boards in turn are one of each response.
        again = again[: max(int(share * len(again)), len({r.question for r in again}))]
        followed = followed[: max(int(share * len(followed)), len({q for q, _ in followed}))]
    steps = least + len(again) * costs[0] + len(followed) * costs[1]
    return Extent(boards, rows, tuple(made), tuple(again), tuple(followed), steps, whole)


def _in_turn(pairs: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
    """The first of each question, then the second of each, …"""
    place: dict[int, int] = {}
    keyed = []
    for question, sample in pairs:
        place[question] = place.get(question, -1) + 1
        keyed.append((place[question], question, sample))
    return [(question, sample) for _, question, sample in sorted(keyed)]
