"""The highest harmonic of an orbit that matters: what the op-amps must still be fast enough for."""

from __future__ import annotations

import numpy as np

from designer.base.arrays import Array
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit, OrbitStatus

SMALLEST = 1e-3
"""Amplitude of the smallest harmonic that matters, of the velocity's largest one."""
POINTS = 1024
"""Points per drive period: harmonics up to 512, past any that is left at ``SMALLEST``."""
UNSETTLED = 30
"""Drive periods that stand for an orbit without a period."""


def fastest(flow: Flow, orbit: Orbit) -> float:
    """Angular frequency of the highest harmonic of the drive that matters.

    It is the highest line, sub- and superharmonics of the drive alike, whose amplitude in one of
    the velocities (every second state) is above ``SMALLEST`` of the largest line in that one; at
    least the drive's own.
    """
    settled = orbit.status is OrbitStatus.PERIODIC
    periods = orbit.n if settled else UNSETTLED
    start = orbit.start if len(orbit.start) else np.zeros(flow.system.size)
    run = flow.run(start, periods, mode=orbit.mode or None, points=POINTS)
    shown = run.strobes[:-1, 1::2]
    if not len(shown):  # the flow gave up at once, as where a force is past all that it resolves
        return flow.drive.omega
    return _highest(shown, settled) * flow.drive.omega / periods


def _highest(samples: Array, periodic: bool) -> float:
    """Highest line that matters of (k, n) samples, in lines per record; at least the drive's."""
    shown = samples - samples.mean(axis=0)
    if not periodic:  # or the jump from the record's end to its start would count
        shown = shown * np.hanning(len(shown))[:, None]
    lines = np.abs(np.fft.rfft(shown, axis=0))
    matters = lines > SMALLEST * lines.max(axis=0, initial=0.0)
    drive = len(samples) // POINTS
    return float(max(drive, *(np.flatnonzero(column).max(initial=0) for column in matters.T)))
