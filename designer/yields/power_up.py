"""A circuit from the moment it is switched on: every capacitor discharged, the generator anywhere
in its period.

The flow starts at drive phase 0. The rest of the first period is run with the generator as two more
states, sine and cosine, which start at any phase: as exact as everything else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.dynamics.flow import Flow, FlowStatus
from designer.dynamics.piecewise_linear import Drive, Guard, Mode, ModeKey, PiecewiseLinearSystem

WATCHED = 20
"""Drive periods after switching on in which clipping is looked for."""


def until_strobe(
    system: PiecewiseLinearSystem, drive: Drive, phase: float
) -> tuple[Array, bool] | None:
    """The state (n,) at the first strobe after switching on at drive phase ``phase`` [rad], and
    whether an element that ought to be linear was at its limit on the way; None if the flow fails.
    """
    return _until_strobe(with_generator(system, drive), drive, phase)


def _until_strobe(
    driven: PiecewiseLinearSystem, drive: Drive, phase: float
) -> tuple[Array, bool] | None:
    left = 1.0 - (phase / (2.0 * np.pi)) % 1.0
    start = np.zeros(driven.size)
    start[-2:] = np.sin(phase), np.cos(phase)
    # The generator's swing is in the states: what is left of the drive is its offset.
    rest = Drive(drive.omega / left, 0.0, drive.offset)
    run = Flow(driven, rest).run(start, 1, measure=True)
    if run.status is not FlowStatus.DONE:
        return None
    return run.strobes[-1][:-2], run.clipped_time > 0.0


def with_generator(system: PiecewiseLinearSystem, drive: Drive) -> PiecewiseLinearSystem:
    """The system with the generator's sine and cosine as its last two states."""
    n = system.size

    def build(key: ModeKey) -> Mode:
        mode = system.mode(key)
        A = np.zeros((n + 2, n + 2))
        A[:n, :n] = mode.A
        A[:n, n] = drive.amplitude * mode.B
        A[n, n + 1], A[n + 1, n] = drive.omega, -drive.omega
        guards = tuple(
            Guard(
                np.concatenate([g.C, [g.D * drive.amplitude, 0.0]]),
                g.D,
                g.e,
                g.target,
                g.clearance,
            )
            for g in mode.guards
        )
        none = np.zeros(2)
        return Mode(
            A,
            np.concatenate([mode.B, none]),
            np.concatenate([mode.d, none]),
            guards,
            mode.sides,
            mode.clipped,
        )

    return PiecewiseLinearSystem(
        states=(*system.states, "sine", "cosine"),
        build=build,
        start=system.start,
        clearances=system.clearances,
        displacement=system.displacement,
    )


@dataclass(frozen=True)
class Arrival:
    """Where a power-up led."""

    state: Array
    """(n,) state at drive phase 0."""
    periods: int
    """Drive periods that it took."""
    clipped: bool
    """Whether an element that ought to be linear was at its limit in the first ``WATCHED``
    periods."""


def follow(
    system: PiecewiseLinearSystem, stages: Sequence[tuple[Drive, int]], phases: Sequence[float]
) -> list[Arrival | None]:
    """Switch on at each of these drive phases [rad] under the first drive, then each drive for its
    whole periods, phase-continuous; None where the flow fails.

    Raises
    ------
    ArithmeticError : no mode of the system holds at some state on the way.
    """
    driven = with_generator(system, stages[0][0])
    starts = [_until_strobe(driven, stages[0][0], phase) for phase in phases]
    arrivals = [None if met is None else Arrival(met[0], 1, met[1]) for met in starts]
    for number, (drive, periods) in enumerate(stages):
        flow = Flow(system, drive)  # one for all phases: its tables cost more than a few periods
        watched = min(periods, WATCHED) if number == 0 else 0
        arrivals = [_on(flow, a, watched, True) for a in arrivals]
        arrivals = [_on(flow, a, periods - watched, False) for a in arrivals]
    return arrivals


def _on(flow: Flow, arrival: Arrival | None, periods: int, measure: bool) -> Arrival | None:
    if arrival is None or periods == 0:
        return arrival
    run = flow.run(arrival.state, periods, measure=measure)
    if run.status is not FlowStatus.DONE:
        return None
    clipped = arrival.clipped or run.clipped_time > 0.0
    return Arrival(run.strobes[-1], arrival.periods + periods, clipped)
