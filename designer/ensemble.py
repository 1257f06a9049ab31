"""The attractors of many boards of one circuit: what every study of yields is made of."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from designer.attractor import settle
from designer.boards import Boards
from designer.flow import Flow
from designer.orbit import Orbit, failed
from designer.reduction import FloatingCircuit, Reduction
from designer.system import Array, Drive
from designer.threads import parallel


class Ensemble:
    """N boards, reduced once each and asked as often as is wanted."""

    def __init__(self, boards: Boards) -> None:
        self.boards = boards
        self._reductions: dict[int, Reduction] = {}

    def __len__(self) -> int:
        return len(self.boards)

    def reduction(self, index: int) -> Reduction:
        """The exact reduction of one board."""
        known = self._reductions.get(index)
        if known is None:
            board = self.boards.board(index)
            known = self._reductions[index] = Reduction(self.boards.circuit, board)
        return known

    def settle(
        self,
        which: Sequence[int],
        drives: Sequence[Drive],
        starts: Array,
        *,
        jobs: int = 1,
        progress: Callable[[], None] = lambda: None,
    ) -> list[Orbit]:
        """The attractor of board ``which[k]`` under ``drives[k]`` from ``starts[k]``, for each k.

        A board may be asked more than once. starts : (len(which), states), at drive phase 0.
        Equal to ``designer.attractor.settle`` of each; a board without an answer gives a failed
        orbit with the reason. progress : called once an answer.
        """

        def one(k: int) -> Orbit:
            try:
                flow = Flow(self.reduction(which[k]).system(), drives[k])
                orbit = settle(flow, starts[k])
            except (FloatingCircuit, ArithmeticError, np.linalg.LinAlgError) as error:
                orbit = failed(str(error))
            progress()
            return orbit

        return list(parallel(one, range(len(which)), jobs))
