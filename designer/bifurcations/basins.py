"""Basins of attraction on a plane of initial states."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from designer.base.arrays import Array
from designer.bifurcations.attractor_list import AttractorList
from designer.bifurcations.block_store import KeptBlocks
from designer.bifurcations.parameter_map import COURSE, MapCell, cell_of, filled
from designer.bifurcations.subject import Subject
from designer.dynamics.steady_state import DrivenSystem, TransientSettings


@dataclass(frozen=True)
class BasinPlan:
    """A grid of starts whose attractors are sought."""

    subject: Subject
    """The system whose parameters change."""
    changes: dict[str, float]
    """Values of parameters that differ from the subject's own, by name."""
    x: str
    """Name of the state along the columns."""
    xs: Array
    """(columns,) values of the state x, ascending."""
    y: str
    """Name of the state along the rows."""
    ys: Array
    """(rows,) values of the state y, ascending."""
    start: Array
    """(states,) the starts; the two states of the plane are replaced."""
    course: TransientSettings = COURSE
    """Periods of each run."""

    def as_dict(self) -> dict[str, Any]:
        """What decides the result."""
        return {
            "subject": self.subject.as_dict(),
            "changes": dict(self.changes),
            "x": [self.x, float(self.xs[0]), float(self.xs[-1]), len(self.xs)],
            "y": [self.y, float(self.ys[0]), float(self.ys[-1]), len(self.ys)],
            "start": self.start.tolist(),
            "periods": dict(self.course.__dict__),
        }

    def state(self, i: int, j: int) -> Array:
        """The initial state of row i, column j."""
        out = self.start.copy()
        out[self.subject.states.index(self.x)] = self.xs[j]
        out[self.subject.states.index(self.y)] = self.ys[i]
        return out


@dataclass(frozen=True)
class Attractor:
    """An attractor that was met."""

    number: int
    """Number of the attractor, from 0."""
    response: str
    """The response, as "n-p-q"."""
    symmetric: bool | None
    """Whether the response is its own mirror image."""
    strobe: tuple[float, ...]
    """A state of it at drive phase 0."""
    twin: int | None
    """Number of its mirror twin, or None."""
    share: float
    """Share of the starts."""


@dataclass(frozen=True)
class Basins:
    """Which start leads to which attractor."""

    plan: BasinPlan
    """The grid of starts that was asked for."""
    cells: tuple[MapCell, ...]
    """The grid row by row, each cell with the number of its attractor."""
    attractors: tuple[Attractor, ...]
    """Most frequent first, numbered from 0. Aperiodic ones are not told apart: they are one."""


def run(
    plan: BasinPlan,
    jobs: int = 1,
    store: KeptBlocks[list[MapCell]] | None = None,
    progress: Callable[[], None] = lambda: None,
) -> Basins:
    """Make the basins, or what of them ``store`` has not; ``progress`` is called once a row."""
    (setting,) = plan.subject.settings([plan.changes])

    def row(i: int) -> list[MapCell]:
        return [
            cell_of(i, j, setting.steady(plan.state(i, j), plan.course))
            for j in range(len(plan.xs))
        ]

    cells = filled(row, len(plan.ys), plan.subject, jobs, store, progress)
    return _named(plan, setting, cells)


def _named(plan: BasinPlan, setting: DrivenSystem, cells: Sequence[MapCell]) -> Basins:
    """Number the attractors: one orbit, whichever of its strobes a start came to."""
    met = AttractorList(setting.flow(), plan.subject.weights)
    numbers = np.array([met.number(c, c.symmetric, np.array(c.strobe)) for c in cells])
    distinct = met.met
    counted = np.bincount(numbers, minlength=len(distinct))
    order = np.argsort(-counted, kind="stable")
    rank = np.empty(len(distinct), dtype=int)
    rank[order] = np.arange(len(distinct))
    twins = {int(rank[k]): met.twin(k) for k in range(len(distinct))}
    attractors = tuple(
        Attractor(
            number,
            distinct[k].motion.response,
            distinct[k].symmetric,
            tuple(float(v) for v in distinct[k].strobes[0]),
            None if twins[number] is None else int(rank[twins[number]]),
            float(counted[k] / len(cells)),
        )
        for number, k in enumerate(order)
    )
    named = tuple(
        replace(cell, attractor=int(rank[k])) for cell, k in zip(cells, numbers, strict=True)
    )
    return Basins(plan, named, attractors)
