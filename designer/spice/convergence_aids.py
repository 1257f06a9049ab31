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

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Generic, Literal, TypeVar

from designer.spice.deck import SolverSettings
from designer.spice.pool import SpicePool
from designer.spice.simulator import SimulationFailed, SpiceJob

T = TypeVar("T")

Remedy = Literal["step", "method", "tolerance", "start"]
REMEDIES: tuple[Remedy, ...] = ("step", "method", "tolerance", "start")
SMALLER_STEP = 0.25
LOOSER = 10.0
NUDGE = 1e-3
"""Of each capacitor's initial voltage: half the strobe tolerance of docs/definitions.md."""

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
    pool: SpicePool, tasks: Sequence[Task[T]], allowed: Sequence[Remedy] = REMEDIES
) -> Iterator[tuple[int, AidedRun[T]]]:
    """Run tasks and yield ``(index, outcome)`` as they finish, in no certain order.

    All tasks are run first; those that did not converge go on to the next remedy together, so
    that the workers stay busy. ``allowed`` : in the order of `REMEDIES`.

    Raises
    ------
    EnvironmentMissing : see `SpicePool.map`.
    """
    tried: tuple[Remedy, ...] = ()
    left = list(range(len(tasks)))
    for remedy in (None, *allowed):
        tried = tried if remedy is None else (*tried, remedy)
        changed = [_changed(tasks[i].settings, tried) for i in left]
        jobs = (
            tasks[i].make(settings, nudge)
            for i, (settings, nudge) in zip(left, changed, strict=True)
        )
        again = []
        for k, result in pool.map(jobs):
            curable = isinstance(result, SimulationFailed) and did_not_converge(result)
            if curable and len(tried) < len(allowed):
                again.append(left[k])
            else:
                yield left[k], AidedRun(result, changed[k][0], tried)
        left = sorted(again)
        if not left:
            return


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
