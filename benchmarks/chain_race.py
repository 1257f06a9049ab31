"""The race against heyoka on chains of masses: systems beside the paper's case.

The equations are written out here for heyoka and, by masses and springs, for the package.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from benchmarks.references import Heyoka, Stops
from designer.base.arrays import Array
from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive
from designer.model.clearance import Clearance
from designer.model.mechanics import SecondOrderSystem

SIZES = tuple(product((1, 2, 3), (1, 2)))
"""Masses and clearances."""
FREQUENCIES = (1.2, 0.5)
STIFFNESS, GAP, DAMPING = 19.0, 0.3, 0.2
"""Of a stop, at which it is touched, and of a damper over the spring beside it."""
TOLERANCE = 1e-12
"""At which heyoka is fastest below an error of 1e-13."""
OUR_PERIODS, PERIODS, ROUNDS = 2000, 200, 15
"""Drive periods of a turn, ours and heyoka's; turns."""
SETTLED, COMPARED = 300, 3
"""Drive periods before the start of all turns; those after which the states are compared."""


@dataclass(frozen=True)
class Race:
    """One system under one drive."""

    masses: int
    """How many masses."""
    clearances: int
    """How many clearances, each with two stops."""
    omega: float
    """Drive frequency."""
    impacts: float
    """Impacts in a drive period."""
    ours: float
    """Drive periods per second of CPU time, the median turn."""
    heyoka: float
    """The same of heyoka."""
    ratio: float
    """Median over the turns of ours over heyoka's."""
    difference: float
    """Largest difference of a state after ``COMPARED`` drive periods."""


def races() -> list[Race]:
    """All systems; [] where heyoka is not installed."""
    try:
        return [_race(n, c, omega) for n, c in SIZES for omega in FREQUENCIES]
    except ImportError:
        return []


def _stops(masses: int, clearances: int) -> list[Stops]:
    second = (
        Stops(0, STIFFNESS, 2.0 * GAP) if masses == 1 else Stops(2 * masses - 2, STIFFNESS, GAP)
    )
    return [Stops(0, STIFFNESS, GAP), second][:clearances]


def _springs(masses: int) -> Array:
    """(masses, masses) stiffness: a spring of 1 to the next mass, the last one's to ground."""
    K = np.eye(masses)
    for i in range(masses - 1):
        K[i + 1, i + 1] += 1.0
        K[i, i + 1] = K[i + 1, i] = -1.0
    return K


def _race(masses: int, clearances: int, omega: float) -> Race:
    K, stops = _springs(masses), _stops(masses, clearances)
    force = np.eye(masses)[0]
    A, B = np.zeros((2 * masses, 2 * masses)), np.zeros(2 * masses)
    A[0::2, 1::2], A[1::2, 0::2], A[1::2, 1::2] = np.eye(masses), -K, -DAMPING * K
    B[1::2] = force
    theirs = Heyoka(A.tolist(), B.tolist(), omega, stops, TOLERANCE)
    even = [
        Clearance.even(s.state // 2, s.stiffness, s.gap, name=name)
        for s, name in zip(stops, "AB", strict=False)
    ]
    system = SecondOrderSystem(np.ones(masses), DAMPING * K, K, force, tuple(even))
    flow = Flow(system.piecewise_linear(omega), Drive(omega))
    start = flow.run(np.zeros(2 * masses), SETTLED).strobes[-1]
    near = flow.run(start, COMPARED)
    turns = np.array(
        [
            [_speed(flow.run, start, OUR_PERIODS), _speed(theirs, start, PERIODS)]
            for _ in range(ROUNDS)
        ]
    )
    return Race(
        masses,
        clearances,
        omega,
        float(flow.run(start, PERIODS).counts.sum()) / PERIODS,
        float(np.median(turns[:, 0])),
        float(np.median(turns[:, 1])),
        float(np.median(turns[:, 0] / turns[:, 1])),
        float(np.abs(near.strobes[-1] - theirs(start, COMPARED)).max()),
    )


def _speed(run: Callable[[Array, int], object], start: Array, periods: int) -> float:
    before = time.process_time()
    run(start, periods)
    return periods / (time.process_time() - before)
