"""Maps of n-p-q over two parameters: what one start leads to at every point of a grid."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from designer.base.arrays import Array
from designer.base.threads import parallel
from designer.bifurcations.block_store import KeptBlocks, stored
from designer.bifurcations.subject import Subject
from designer.dynamics.counts import Pairs
from designer.dynamics.orbit import Motion, OrbitStatus
from designer.dynamics.steady_state import SteadyMotion, TransientSettings
from designer.dynamics.step_budget import Budget

COURSE = TransientSettings(settle=134, keep=16, patience=1000)
"""150 periods a point, and up to a thousand more where they leave the motion undecided."""


@dataclass(frozen=True)
class MapCell(Motion):
    """What a grid point shows; other fields as of ``SteadyMotion``."""

    i: int
    """Row of the cell."""
    j: int
    """Column of the cell."""
    status: OrbitStatus
    n: int
    p: int
    q: int
    symmetric: bool | None
    lyapunov: float
    strobe: tuple[float, ...]
    """A state of the motion at drive phase 0."""
    attractor: int = 0
    """Its number in a basin, 0 in a map."""
    more: Pairs = ()


@dataclass(frozen=True)
class MapPlan:
    """A grid of two parameters whose steady states are sought."""

    subject: Subject
    """The system whose parameters change."""
    x: str
    """Name of the parameter along the columns."""
    xs: Array
    """(columns,) values of the parameter x, ascending."""
    y: str
    """Name of the parameter along the rows."""
    ys: Array
    """(rows,) values of the parameter y, ascending."""
    start: Array = field(default_factory=lambda: np.zeros(0))
    """(states,) start of every point; rest where it is not given."""
    course: TransientSettings = COURSE
    """Periods of each run."""

    def __post_init__(self) -> None:
        if not len(self.start):
            object.__setattr__(self, "start", np.zeros(len(self.subject.states)))

    def as_dict(self) -> dict[str, Any]:
        """What decides the result."""
        return {
            "subject": self.subject.as_dict(),
            "x": [self.x, float(self.xs[0]), float(self.xs[-1]), len(self.xs)],
            "y": [self.y, float(self.ys[0]), float(self.ys[-1]), len(self.ys)],
            "start": self.start.tolist(),
            "periods": dict(self.course.__dict__),
        }


@dataclass(frozen=True)
class ParameterMap:
    """The steady states over two parameters."""

    plan: MapPlan
    """The grid of parameters that was asked for."""
    cells: tuple[MapCell, ...]
    """(rows · columns,) the steady states, row by row."""

    @property
    def counts(self) -> dict[str, int]:
        """How many points show each response, most frequent first."""
        return count(self.cells)


def run(
    plan: MapPlan,
    jobs: int = 1,
    store: KeptBlocks[list[MapCell]] | None = None,
    progress: Callable[[], None] = lambda: None,
) -> ParameterMap:
    """Make the map, or what of it ``store`` has not; ``progress`` is called once a row."""

    def row(i: int) -> list[MapCell]:
        return list(cells_at(plan, [(i, j) for j in range(len(plan.xs))]))

    return ParameterMap(plan, filled(row, len(plan.ys), plan.subject, jobs, store, progress))


def filled(
    row: Callable[[int], list[MapCell]],
    rows: int,
    subject: Subject,
    jobs: int,
    store: KeptBlocks[list[MapCell]] | None,
    progress: Callable[[], None],
) -> tuple[MapCell, ...]:
    """The cells of a grid, row by row. row : makes one that ``store`` has not."""

    def may_be(cells: list[MapCell]) -> bool:
        return all(c.countable and len(c.strobe) == len(subject.states) for c in cells)

    def kept(i: int) -> list[MapCell]:
        cells = stored(store, (i,), may_be, lambda: row(i))
        progress()
        return cells

    return tuple(cell for cells in parallel(kept, range(rows), jobs) for cell in cells)


def cells_at(
    plan: MapPlan, places: Sequence[tuple[int, int]], steps: float | None = None
) -> Iterator[MapCell]:
    """The cells at some (row, column) of the grid, one after the other. steps : of the budget of
    each (``DrivenSystem.steady``)."""
    changes = [{plan.x: float(plan.xs[j]), plan.y: float(plan.ys[i])} for i, j in places]
    for (i, j), setting in zip(places, plan.subject.settings(changes), strict=True):
        budget = None if steps is None else Budget(steps)
        yield cell_of(i, j, setting.steady(plan.start, plan.course, budget))


def cell_of(i: int, j: int, steady: SteadyMotion) -> MapCell:
    """The cell that shows this motion."""
    s, strobe = steady, tuple(steady.start.tolist())
    named = (s.status, s.n, s.p, s.q, s.symmetric, s.lyapunov)
    return MapCell(i, j, *named, strobe, more=s.more)


def count(cells: tuple[MapCell, ...]) -> dict[str, int]:
    """How many cells show each response, most frequent first."""
    out: dict[str, int] = {}
    for cell in cells:
        out[cell.response] = out.get(cell.response, 0) + 1
    return dict(sorted(out.items(), key=lambda item: (-item[1], item[0])))
