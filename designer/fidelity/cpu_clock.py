"""What a method costs: CPU time, all methods taking turns, so that a busy machine slows them alike.

Ratios are taken within a round and their median over the rounds is what counts. A run of ngspice
is timed in its worker process, reading the deck included.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.spice.pool import SpicePool
from designer.spice.simulator import SimulationFailed, SpiceJob, Waveforms

LEAST = 0.02
"""CPU seconds of a run at least, where a method can be repeated: the clock is coarse."""


@dataclass(frozen=True)
class Entrant:
    """One that runs against the clock."""

    name: str
    periods: int
    """Drive periods of one run."""
    work: Callable[[], float]
    """Runs once and returns the CPU seconds that it took; nan where it failed."""


def here(name: str, run: Callable[[int], object], periods: int) -> Entrant:
    """A method in this process: ``run`` carries a state over so many drive periods.

    Compiled and measured once; more periods are taken where a run is too short for the clock.
    """
    run(periods)
    began = time.process_time()
    run(periods)
    spent = max(time.process_time() - began, 1e-6)
    many = periods * max(1, int(np.ceil(LEAST / spent)))

    def work() -> float:
        began = time.process_time()
        run(many)
        return time.process_time() - began

    return Entrant(name, many, work)


class SpiceClock:
    """CPU time of runs of ngspice in the one worker of a pool.

    pool : of one worker; with more a difference of two readings means nothing.
    """

    def __init__(self, pool: SpicePool) -> None:
        self._pool = pool

    def entrant(self, name: str, job: SpiceJob[object], periods: int) -> Entrant:
        """A run of a deck over so many drive periods."""

        def work() -> float:
            before = self._reading(_TRIVIAL)
            after = self._reading(SpiceJob(job.netlist, job.signals, job.stop, _now))
            if before is None or after is None or before[0] != after[0]:
                return float("nan")
            return after[1] - before[1]

        return Entrant(name, periods, work)

    def _reading(self, job: SpiceJob[tuple[int, float]]) -> tuple[int, float] | None:
        for _, answer in self._pool.map([job]):
            return None if isinstance(answer, SimulationFailed) else answer
        return None


def rounds(
    entrants: Sequence[Entrant], count: int, progress: Callable[[], None] = lambda: None
) -> Array:
    """(count, entrants) CPU seconds per drive period; all take turns in each round."""
    out = np.full((count, len(entrants)), np.nan)
    for row in out:
        for i, one in enumerate(entrants):
            row[i] = one.work() / one.periods
        progress()
    return out


def _now(_: Waveforms) -> tuple[int, float]:
    return os.getpid(), time.process_time()


_TRIVIAL: SpiceJob[tuple[int, float]] = SpiceJob(
    "a resistor\nV1 a 0 1\nR1 a 0 1\n.tran 1 2\n.end\n", ("a",), 2.0, _now
)
