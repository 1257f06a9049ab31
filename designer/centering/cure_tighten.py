"""By how much a linear picture's demands are tightened where what it promised was not kept."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from designer.centering.cure_milp import CureProgram
from designer.centering.cure_ways import ResponseWay
from designer.circuit.board_arrays import Boards

TIGHTER = 0.95
"""Of a demand's room: the least by which it is tightened where a promise was not kept."""
LARGEST_STEP = 2.0
"""The factor by which a measurement brings a loss nearer than the picture has it, at most: one that
is so wrong says little about by how much."""


def cut(program: CureProgram, pick: Sequence[int], key: tuple[int, int], parts: int) -> float:
    """A factor on a way's room under which this choice no longer keeps its demands."""
    r, w = key
    own = [d for d in program.demands if d.when == (parts + r, w) and d.room > 0.0]
    shares = [d.variance(pick) / d.room for d in own]
    return min(TIGHTER, 0.999 * max(shares, default=1.0))


def shown(way: ResponseWay, boards: Boards, rate: float) -> float:
    """By which factor the room of a way's demands is to shrink for the picture to promise what was
    measured: the square of the ratio of the distances at which that share of boards is lost; 1
    where more are ok than was promised."""
    assert way.margin is not None
    form = way.margin.of(boards)
    middle = float(np.median(form))
    reach = middle - float(np.quantile(form, min(1.0 - rate, 0.5)))
    if middle <= 0.0 or reach >= middle:
        return 1.0
    return max((reach / middle) ** 2, 1.0 / LARGEST_STEP**2)
