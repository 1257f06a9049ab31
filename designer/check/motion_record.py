"""What a record of a motion shows: its states at drive phase 0, and its power spectrum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import periodogram, welch

from designer.base.arrays import Array
from designer.circuit.nominal import Trace

SEGMENT = 64
"""Drive periods of a segment of a record without a period: the resolution is a 64th of ω."""


@dataclass(frozen=True)
class PowerSpectrum:
    """Lines of a periodic motion, or the density of any other."""

    frequency: Array
    """(k,) frequencies, in drive frequencies; from 0."""
    power: Array
    """(k,) squared amplitudes of the lines (of the mean at 0), or the density of the mean square
    per drive frequency."""
    lines: bool
    """Whether these are lines."""


def section(trace: Trace, omega: float) -> Array:
    """(k, states) states at drive phase 0, in order; without the last one, with which a periodic
    trace ends where it began. omega : of the drive; the trace begins at drive phase 0."""
    period = 2.0 * np.pi / omega
    laps = round(float(trace.time[-1]) / period)
    at = period * np.arange(laps)
    return np.stack([np.interp(at, trace.time, column) for column in trace.states.T], axis=1)


def power_spectrum(time: Array, values: Array, omega: float, *, periodic: bool) -> PowerSpectrum:
    """Of values (k,) at even times (k,) over whole drive periods, both ends included.

    periodic : whether the values end where they began: then every line is exact but for what lies
    above half the rate of the samples. Otherwise by Welch's method (IEEE Trans. Audio
    Electroacoust. 15, 1967, 70): Hann windows of ``SEGMENT`` periods that overlap by half.
    """
    even = np.linspace(time[0], time[-1], len(time))  # ngspice's times are even but for rounding
    x = np.interp(even, time, values)[:-1]
    laps = round(float(time[-1] - time[0]) * omega / (2.0 * np.pi))
    rate = len(x) / laps
    if periodic:
        frequency, power = periodogram(x, rate, detrend=False, scaling="spectrum")
        power[1:] *= 2.0  # squared amplitudes, not mean squares
        return PowerSpectrum(frequency, power, lines=True)
    segment = round(min(SEGMENT, laps) * rate)
    frequency, power = welch(x, rate, "hann", segment, detrend="constant")
    return PowerSpectrum(frequency, power, lines=False)
