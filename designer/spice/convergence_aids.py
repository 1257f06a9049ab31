"""What is tried where ngspice does not converge: a stated sequence, in this order, each kept.

1. ``step``: a quarter of the largest step.
2. ``method``: gear instead of the trapezoidal rule, at that step (gear damps what rings).
3. ``tolerance``: ten times the relative, current and voltage tolerances.
4. ``start``: capacitors a thousandth off their voltages, so that no op-amp starts on its corner.

Only a run that did not converge is treated. A deck that is refused or wrong, a floating node (a
singular matrix), a worker that died and an analysis that failed are not made right by other
settings. What was tried stands in the outcome, whether it helped or not.
"""

from __future__ import annotations

import itertools
import re
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Generic, Literal, TypeVar

from designer.spice.deck import SolverSettings
from designer.spice.pool import SpicePool
from designer.spice.simulator import SimulationFailed, SpiceJob

T = TypeVar("T")
R = TypeVar("R")
J = TypeVar("J")

Remedy = Literal["step", "method", "tolerance", "start"]
REMEDIES: tuple[Remedy, ...] = ("step", "method", "tolerance", "start")
SMALLER_STEP = 0.25
LOOSER = 10.0
NUDGE = 1e-3
"""Change of each capacitor's initial voltage, as a share: half the strobe tolerance of
docs/definitions.md."""

_NOT_CONVERGED = re.compile(
    r"ngspice said: .*(timestep too small|stepping failed|convergence|iteration limit"
    r"|transient op failed|doanalyses: (tran|dc|ac))|the run ends at",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Task(Generic[T]):
    """A run that can be made with other settings."""

    make: Callable[[SolverSettings, float], SpiceJob[T]]
    """(settings, nudge) → job; ``nudge`` is the fraction by which every initial voltage is raised,
    0 at first."""
    settings: SolverSettings
    """The first that are tried."""


@dataclass(frozen=True)
class AidedRun(Generic[T]):
    """A run that was repeated with other settings until it converged."""

    result: T | SimulationFailed
    """Result of the last attempt."""
    settings: SolverSettings
    """Settings of the last attempt."""
    tried: tuple[Remedy, ...] = ()
    """Remedies in order, none where the first attempt converged; if ``result`` is no failure, the
    last of them helped."""


def did_not_converge(failure: SimulationFailed) -> bool:
    """Whether other settings may help."""
    return bool(_NOT_CONVERGED.match(failure.reason))


def run(
    pool: SpicePool, tasks: Iterable[Task[T] | None], allowed: Sequence[Remedy] = REMEDIES
) -> Iterator[tuple[int, AidedRun[T]]]:
    """Run tasks and yield ``(index, outcome)`` as they finish, in no certain order.

    A run that did not converge is made again with the next remedy before another task begins.

    Parameters
    ----------
    tasks : taken as the jobs of `SpicePool.map`, with None where the next task depends on an
        outcome that is still to come.
    allowed : in the order of `REMEDIES`.

    Raises
    ------
    EnvironmentMissing : see `SpicePool.map`.
    """
    first = (None if task is None else (task, ()) for task in tasks)
    queue: RunQueue[tuple[Task[T], tuple[Remedy, ...]], SpiceJob[T]] = RunQueue(first, _job)
    for number, result in pool.map(queue):
        index, (task, tried) = queue.ended(number)
        curable = isinstance(result, SimulationFailed) and did_not_converge(result)
        if curable and len(tried) < len(allowed):
            queue.again.append((index, (task, (*tried, allowed[len(tried)]))))
        else:
            yield index, AidedRun(result, _changed(task.settings, tried)[0], tried)


class RunQueue(Iterator[J | None], Generic[R, J]):
    """Runs as a pool takes them, those that follow from another first; ``make`` makes the job.

    It gives None while there is none but one may follow from those under way.
    """

    def __init__(self, first: Iterator[R | None], make: Callable[[R], J]) -> None:
        self.again: deque[tuple[int, R]] = deque()
        """Runs that follow from others, each with the index in ``first`` of the one it began as."""
        self._first, self._make = first, make
        self._indices, self._numbers = itertools.count(), itertools.count()
        self._begun: dict[int, tuple[int, R]] = {}

    def __next__(self) -> J | None:
        if self.again:
            index, run = self.again.popleft()
        else:
            new = next(self._first, None)
            if new is None:
                if self._begun:
                    return None
                raise StopIteration
            index, run = next(self._indices), new
        self._begun[next(self._numbers)] = index, run
        return self._make(run)

    def ended(self, number: int) -> tuple[int, R]:
        """The run that was taken as so many-th, with its index; it is then forgotten."""
        return self._begun.pop(number)


def _job(run: tuple[Task[T], tuple[Remedy, ...]]) -> SpiceJob[T]:
    task, tried = run
    return task.make(*_changed(task.settings, tried))


def _changed(settings: SolverSettings, remedies: Sequence[Remedy]) -> tuple[SolverSettings, float]:
    """Settings and nudge with these remedies applied."""
    nudge = 0.0
    for remedy in remedies:
        if remedy == "step":
            settings = replace(settings, max_step=settings.max_step * SMALLER_STEP)
        elif remedy == "method":
            settings = replace(settings, method="gear")
        elif remedy == "tolerance":
            settings = replace(
                settings,
                reltol=settings.reltol * LOOSER,
                abstol=settings.abstol * LOOSER,
                vntol=settings.vntol * LOOSER,
            )
        else:
            nudge = NUDGE
    return settings, nudge
