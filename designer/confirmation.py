"""ngspice's word on samples: which runs it makes, and how long.

Two starts. On the sample's own orbit of the exact circuit rung ngspice only has to stay there. From
the nominal design's orbit it has to find its way, as the exact rung did: at least 5/(1 - ρ) drive
periods (times n for a period of n), and no fewer than the exact trajectory from that very start
takes to come within `REMAINDER` of its attractor.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from designer import gate, remedies
from designer.deck import SolverSettings
from designer.flow import Flow, FlowStatus
from designer.gate import Subject
from designer.ngspice import SimulationFailed
from designer.orbit import Orbit, OrbitStatus
from designer.system import Array
from designer.waveform_orbit import Read
from designer.workers import SpicePool

OWN_SAMPLES = 40
"""How many samples of each response ngspice repeats from their own orbit (all, where fewer)."""
NOMINAL_SAMPLES = 50
"""How many it starts from the nominal orbit. Boards are independent draws from (seed, index), so
the first fifty are a random subset, and the same one however many samples follow."""
SLOW = 0.9
"""Every sample with a larger multiplier starts from the nominal orbit too, whatever its index."""
UNKNOWN_PERIODS = 20
"""Drive periods for a sample without a period: 64 more follow, in which none must be found."""
REMAINDER = 5e-4
"""Of the peak: a quarter of the strobe tolerance."""
MOST_PERIODS = 400
"""Longest way to an attractor that ngspice is sent, in drive periods; beyond it a sample is left
out by name: the run would take minutes."""
OWN_REFINEMENTS, NOMINAL_REFINEMENTS = 2, 1
"""How often the step is halved where ngspice disagrees, until two step sizes say the same."""
UNDECIDED = "undecided"
"""What is heard where the last two step sizes still say different things."""


@dataclass(frozen=True)
class Query:
    """One run of ngspice. expected : the exact circuit's response."""

    subject: Subject
    settings: SolverSettings
    expected: str


@dataclass(frozen=True)
class Heard:
    """What ngspice said: n-p-q, status or `UNDECIDED`, with the reason and the remedies of the last
    run. An undecided one's reason has both answers."""

    response: str
    reason: str = ""
    remedies: str = ""


def starts_from_nominal(sample: int, orbit: Orbit) -> bool:
    """Whether a sample belongs to those that ngspice starts from the nominal orbit."""
    return sample < NOMINAL_SAMPLES or orbit.radius > SLOW


def periods_to_settle(flow: Flow, start: Array, orbit: Orbit) -> int | None:
    """Drive periods from ``start`` (states,) to the attractor ``orbit``; None if too many.

    At least n · 5/(1 - ρ), rounded up, and until every later strobe of the exact trajectory is
    within `REMAINDER` of a strobe of the orbit.
    """
    if orbit.n == 0:
        return UNKNOWN_PERIODS
    if not orbit.radius < 1.0:
        return None
    least = math.ceil(orbit.n * 5.0 / (1.0 - orbit.radius))
    if least > MOST_PERIODS:
        return None
    way = flow.run(start, MOST_PERIODS)
    laps = flow.run(orbit.start, orbit.n, mode=orbit.mode or None).strobes[:-1]
    if way.status is not FlowStatus.DONE:
        return None
    peak = np.abs(orbit.extremes).max(axis=1)
    gap = (np.abs(way.strobes[:, None] - laps) / peak).max(axis=2).min(axis=1)
    far = np.flatnonzero(gap > REMAINDER)
    arrived = int(far[-1]) + 1 if len(far) else 0
    if arrived > MOST_PERIODS:
        return None
    return max(least, arrived)


def confirm(
    pool: SpicePool,
    queries: Sequence[Query],
    refinements: int,
    progress: Callable[[], None] = lambda: None,
) -> list[Heard]:
    """ngspice's answers, in order.

    A first answer that is the expected one stands: its settings have passed the gate at two step
    sizes. Where it is another the step is halved, at most ``refinements`` times, until two step
    sizes say the same, whichever it is; where they never do, the answer is `UNDECIDED`. A failed
    run is no answer: it is neither the same as another nor different. ``progress`` is called once
    a query.
    """
    heard: list[Heard | None] = [None] * len(queries)
    answered: list[str | None] = [None] * len(queries)
    asked = [(k, q.settings) for k, q in enumerate(queries)]
    for level in range(refinements + 1):
        tasks = [gate.task(queries[k].subject, settings) for k, settings in asked]
        again = []
        for i, outcome in remedies.run(pool, tasks):
            k, settings = asked[i]
            before, said = answered[k], _heard(outcome)
            failed = said.response == OrbitStatus.FAILED
            settled = not failed and said.response == (before or queries[k].expected)
            if settled or level == refinements:
                heard[k] = said if settled or failed else _undecided(before, said)
                progress()
            else:
                again.append((k, replace(settings, max_step=settings.max_step / 2.0)))
            answered[k] = before if failed else said.response
        asked = sorted(again, key=lambda item: item[0])
    return [h for h in heard if h is not None]


def _undecided(before: str | None, said: Heard) -> Heard:
    only = f"only one run had an answer: {said.response}"
    both = f"{before}, at a smaller step {said.response}"
    return Heard(UNDECIDED, only if before is None else both, said.remedies)


def _heard(outcome: remedies.Outcome[Read]) -> Heard:
    tried = " ".join(outcome.tried)
    if isinstance(outcome.result, SimulationFailed):
        return Heard(str(OrbitStatus.FAILED), outcome.result.reason, tried)
    orbit = outcome.result.orbit
    return Heard(orbit.response, orbit.reason, tried)
