"""Where, on the straight line from the nominal board to a lost one, the response is lost."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from designer.circuit.board_arrays import Boards
from designer.circuit.ensemble import Ensemble
from designer.dynamics.orbit import Orbit
from designer.spread.board_quantities import between
from designer.yields.verdict import Question, Verdict, judge

PACE = 0.25
"""Of the way: the first steps; then the gap is halved."""
ROUNDS = 10
"""Attractors sought for a board, at most."""


@dataclass(frozen=True)
class Crossing:
    """Where on the way from the nominal board to a lost one the response ends.

    Where it was met on the board itself, ``inside`` and ``outside`` are 1: the response is there,
    and the nominal orbit leads to another attractor.
    """

    board: int
    """The lost board, by its place in the ensemble."""
    question: int
    """Number of the question of the plan."""
    inside: float
    """The farthest share of the way at which the response was met."""
    outside: float
    """The nearest share of the way at which the response was not met."""
    orbit: Orbit
    """The orbit at ``inside``."""

    @property
    def there(self) -> bool:
        return self.inside == 1.0


def crossings(
    boards: Boards,
    which: Sequence[int],
    asked: Sequence[int],
    questions: Sequence[Question],
    *,
    jobs: int = 1,
    progress: Callable[[], None] = lambda: None,
) -> list[Crossing]:
    """For each k the crossing of board ``which[k]`` for question ``asked[k]``, along the attractor.

    progress : called ``ROUNDS`` times for each.
    """
    size = len(which)
    inside, outside = np.zeros(size), np.full(size, np.inf)
    orbits = [questions[number].start for number in asked]
    for _ in range(ROUNDS):
        met = [k for k in range(size) if inside[k] < 1.0]
        share = np.array([_next(inside[k], outside[k]) for k in met])
        for _ in range(size - len(met)):
            progress()
        if not met:
            continue
        ensemble = Ensemble(between(boards.take([which[k] for k in met]), share))
        found = ensemble.settle(
            range(len(met)),
            [questions[asked[k]].excitation.drive for k in met],
            np.array([orbits[k].start for k in met]),
            jobs=jobs,
            progress=progress,
        )
        for k, at, orbit in zip(met, share, found, strict=True):
            question = questions[asked[k]]
            if judge(orbit, question.spec, question.start)[0] is Verdict.OK:
                inside[k], orbits[k] = at, orbit
                if at == 1.0:
                    outside[k] = 1.0
            else:
                outside[k] = at
    return [
        Crossing(which[k], asked[k], float(inside[k]), float(outside[k]), orbits[k])
        for k in range(size)
    ]


def _next(inside: float, outside: float) -> float:
    if np.isinf(outside):
        return min(inside + PACE, 1.0)
    return 0.5 * (inside + outside)
