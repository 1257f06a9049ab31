"""A record of an oscilloscope, and what its channels are of the board.

Both say nothing of how the file was written (``record_formats``) nor of what the motion is
(``naming``).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from designer.base.arrays import Array

ORDERS = range(1, 7)
"""Of the differences that the noise is estimated from."""
NORMAL = 0.6744897501960817
"""Median of the absolute value of a standard normal number."""
MOST_LEVELS = 2**16
"""Different values of a channel up to which they may be the levels of a converter."""
FEWEST_REPEATS = 4
"""Samples a level, in the mean, from which on the values are taken for a converter's levels."""
DITHER_SEED = 1
"""Of the numbers that spread values over a step."""
ON_LEVEL = 0.1
"""Of a step: how far from its level a value may be written."""


@dataclass(frozen=True)
class Record:
    """Signals that were sampled together at equal intervals."""

    time: Array
    """(k,) time of each sample [s]: equal steps of ``interval``, from wherever the scope counts."""
    signals: Mapping[str, Array]
    """(k,) voltage [V] of each channel, by the name that the file has for it, in the file's order;
    at the probe's tip, as the scope has it."""
    source: str
    """The file that it was read from, or where else it is from."""
    kind: str = ""
    """The format of the file in words, such as "Rigol CSV"."""

    @property
    def interval(self) -> float:
        """From one sample to the next [s]."""
        return float(self.time[-1] - self.time[0]) / (len(self.time) - 1)

    @property
    def duration(self) -> float:
        """From the first sample to the last [s]."""
        return float(self.time[-1] - self.time[0])

    @cached_property
    def quantum(self) -> Mapping[str, float]:
        """Step of the converter in each channel [V]; 0 where the values show none."""
        return {name: step_of(signal) for name, signal in self.signals.items()}

    @cached_property
    def noise(self) -> Mapping[str, float]:
        """Standard deviation of what is in each channel and no signal [V], the converter's rounding
        included: see ``noise_of``."""
        return {
            name: max(noise_of(signal, self.quantum[name]), self.quantum[name] / math.sqrt(12.0))
            for name, signal in self.signals.items()
        }

    @cached_property
    def span(self) -> Mapping[str, float]:
        """Largest less smallest value of each channel [V]."""
        return {name: float(np.ptp(signal)) for name, signal in self.signals.items()}


@dataclass(frozen=True)
class RecordedMotion:
    """A record with the part that each channel plays, and the drive as it shows."""

    record: Record
    """The record."""
    channels: Mapping[str, str]
    """Channel by the net of the board that it shows: "v1", "v3", "fv", the generator's, …."""
    generator: str
    """Net of the generator, a key of ``channels`` where it was recorded."""
    frequency: float
    """Of the drive [Hz]."""
    frequency_error: float
    """Standard error of it [Hz]."""
    amplitude: float
    """Of the drive [V peak]; nan where the generator was not recorded."""
    offset: float
    """Mean of the generator's channel [V], the scope's own offset included; nan where it was not
    recorded."""
    phase: float
    """Of the drive at the first sample [rad], in [0, 2 pi): 0 where amplitude · sin(phase + 2 pi f
    t) rises through its mean; nan where the generator was not recorded."""

    @property
    def periods(self) -> float:
        """Drive periods that the record lasts."""
        return self.record.duration * self.frequency

    def signal(self, net: str) -> Array:
        """(k,) voltage of a net of the board [V]; KeyError where it was not recorded."""
        return self.record.signals[self.channels[net]]

    def noise(self, net: str) -> float:
        """Standard deviation of the noise on it [V]."""
        return self.record.noise[self.channels[net]]

    def has(self, net: str) -> bool:
        """Whether a net was recorded."""
        return net in self.channels


def step_of(signal: Array) -> float:
    """The step [V] that all differences of a channel's values are multiples of; 0 without one.

    signal : (k,) values [V]. Found where the values come back often, as those of a converter do:
    the least distance between two of them, refined over all, if every value is then a whole number
    of steps from the first to a tenth of one.
    """
    levels = np.unique(signal)
    if len(levels) < 2:
        return 0.0
    gaps = np.diff(levels)
    # A converter's levels are written with rounding errors: values closer than these are one level.
    apart = gaps[gaps > 1e-3 * float(np.median(gaps))]
    if len(apart) + 1 > MOST_LEVELS or len(signal) < FEWEST_REPEATS * (len(apart) + 1):
        return 0.0
    step = float(np.percentile(apart, 5))
    for _ in range(4):
        numbers = np.round((levels - levels[0]) / step)
        if numbers[-1] < 1.0:
            return 0.0
        step = float((numbers @ (levels - levels[0])) / (numbers @ numbers))
    off = np.abs(levels - levels[0] - step * np.round((levels - levels[0]) / step))
    return step if float(off.max()) <= ON_LEVEL * step else 0.0


def noise_of(signal: Array, step: float = 0.0) -> float:
    """Standard deviation [V] of white noise on a signal that is smooth from sample to sample.

    signal : (k,) values [V]. step : of the converter [V]; the values are spread evenly over it
    first, for the median of a few levels is no measure, and that is taken off again.

    The d-th differences of white noise have variance C(2d, d) σ²; a smooth signal adds less to them
    the higher d is, until its own kinks do. The least of the robust estimates (median of the
    absolute value over 0.674) for d = 1 … 6 is returned, which is too large for a signal with few
    samples a turn, never too small but by chance (differences of variance: Gasser, Sroka and
    Jennen-Steinmetz, Biometrika 73, 1986).
    """
    estimates = []
    dither = step * (np.random.default_rng(DITHER_SEED).random(len(signal)) - 0.5)
    differences = np.asarray(signal, dtype=np.float64) + dither
    for order in ORDERS:
        differences = np.diff(differences)
        if len(differences) < 2:
            break
        middle = float(np.median(np.abs(differences)))
        estimates.append(middle / NORMAL / math.sqrt(math.comb(2 * order, order)))
    least = min(estimates, default=0.0)
    return math.sqrt(max(least**2 - step**2 / 12.0, 0.0))
