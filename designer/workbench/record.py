"""A record of an oscilloscope, and what its channels are of the board.

Both say nothing of how the file was written (``record_formats``) nor of what the motion is
(``naming``).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from designer.base.arrays import Array, Index, Mask

ORDERS = range(1, 7)
"""The orders of the differences that the noise is estimated from."""
NORMAL = 0.6744897501960817
"""Median of the absolute value of a standard normal number."""
MOST_LEVELS = 2**16
"""Different values of a channel up to which they may be the levels of a converter."""
FEWEST_REPEATS = 4
"""Samples a level, in the mean, from which on the values are taken for a converter's levels."""
DITHER_SEED = 1
"""The seed of the numbers that spread values over a step."""
FEWEST_CUT, CUT_SHARE, OFTEN, BESIDE = 8, 5e-3, 6, 4
"""Of a channel that is cut off, at its last value: samples, share of all, and times as many as at
any of so many values before it."""
MEANS, LONG, FEWEST_FLAT, FLAT_SHARE, ROUND = 9, 12, 100, 0.03, 0.4
"""Of flat tops: samples of a mean, and of one flat top; samples in their middles, their share of
the record, and how much lower a round one is at least outside its middle, in standard deviations of
the noise."""
LEAST_VOLTS, ROUNDING = 1e-9, 1e-12
"""Span of a channel that is no signal [V], and of its largest value."""
ON_LEVEL = 0.1
"""How far from its level a value may be written, over the step."""


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
        """The time from one sample to the next [s]."""
        return float(self.time[-1] - self.time[0]) / (len(self.time) - 1)

    @property
    def duration(self) -> float:
        """The time from the first sample to the last [s]."""
        return float(self.time[-1] - self.time[0])

    @cached_property
    def limits(self) -> Mapping[str, tuple[float, float]]:
        """Lowest and highest voltage of each channel at which it is cut off [V]; infinite where it
        is not."""
        return {name: limits_of(signal) for name, signal in self.signals.items()}

    @property
    def clipped(self) -> tuple[str, ...]:
        """The channels that are cut off."""
        return tuple(n for n, ends in self.limits.items() if np.isfinite(ends).any())

    def cut(self, channel: str) -> Mask:
        """(k,) whether a sample stands where its channel is cut off."""
        low, high = self.limits[channel]
        return np.asarray((self.signals[channel] <= low) | (self.signals[channel] >= high))

    @cached_property
    def quantum(self) -> Mapping[str, float]:
        """Step of the converter in each channel [V]; 0 where the values show none."""
        return {name: step_of(signal[~self.cut(name)]) for name, signal in self.signals.items()}

    @cached_property
    def noise(self) -> Mapping[str, float]:
        """Standard deviation of what is in each channel and no signal [V], the converter's rounding
        included: see ``noise_of``."""
        return {
            name: max(
                noise_of(signal, self.quantum[name], self.cut(name)),
                self.quantum[name] / math.sqrt(12.0),
            )
            for name, signal in self.signals.items()
        }

    @cached_property
    def span(self) -> Mapping[str, float]:
        """Largest less smallest value of each channel [V]."""
        return {name: float(np.ptp(signal)) for name, signal in self.signals.items()}

    def means(
        self, channels: Sequence[str], width: int, most: int | None = None
    ) -> tuple[Array, Array, Mask]:
        """Means of so many neighbours: times since the first sample (m,) [s], voltages of channels
        (m, c) [V], and where one of the neighbours is cut off (m, c). most : of these means."""

        def grouped(samples: Array | Mask) -> Any:
            count = len(samples) // width
            return samples[: count * width].reshape(count, width)[:most]

        values = [grouped(self.signals[c]).mean(axis=1) for c in channels]
        clipped = [grouped(self.cut(c)).any(axis=1) for c in channels]
        time = grouped(self.time - self.time[0]).mean(axis=1)
        return time, np.column_stack(values), np.column_stack(clipped)

    def moves(self, channel: str) -> bool:
        """Whether a channel shows more than rounding."""
        largest = float(np.abs(self.signals[channel]).max())
        return self.span[channel] > max(LEAST_VOLTS, ROUNDING * largest)


@dataclass(frozen=True)
class RecordedMotion:
    """A record with the part that each channel plays, and the drive as it shows."""

    record: Record
    channels: Mapping[str, str]
    """Channel by the net of the board that it shows: "v1", "v3", "fv", the generator's, …."""
    generator: str
    """Net of the generator, a key of ``channels`` where it was recorded."""
    frequency: float
    """The frequency of the drive [Hz]."""
    frequency_error: float
    """Standard error of it [Hz]."""
    amplitude: float
    """The amplitude of the drive [V peak]; nan where the generator was not recorded."""
    offset: float
    """Mean of the generator's channel [V], the scope's own offset included; nan where it was not
    recorded."""
    phase: float
    """Phase of the drive at the first sample [rad], in [0, 2 pi): 0 where amplitude · sin(phase + 2
    pi f t) rises through its mean; nan where the generator was not recorded."""
    doubt: str = ""
    """What may be otherwise: which channel shows what, or the drive frequency; "" where nothing
    is."""
    remedy: str = ""
    """What would take the doubt away."""

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


def limits_of(signal: Array) -> tuple[float, float]:
    """Lowest and highest voltage [V] at which a channel is cut off; infinite where it is not.

    signal : (k,) values [V]. Cut off by the converter, many samples have one and the same value,
    the last one. Of a turning point none is so frequent: a parabola of N samples in the last step
    of a converter has 0.41 N in the step before, and noise gives the last step fewer than that.
    Cut off before the noise comes in, its tops are flat.
    """
    values, counts = np.unique(signal, return_counts=True)
    step = step_of(signal)
    noise = max(noise_of(signal, step), step, ROUNDING * float(np.abs(values).max()))
    low = float(values[0]) if _piled(counts, len(signal)) else -_flat_top(-signal, noise)
    high = float(values[-1]) if _piled(counts[::-1], len(signal)) else _flat_top(signal, noise)
    return low, high


def _piled(counts: Index, total: int) -> bool:
    """Whether samples pile up at the first of some values. counts : (m,) samples at each."""
    last, neighbours = int(counts[0]), counts[1 : 1 + BESIDE]
    return (
        len(neighbours) > 0
        and last >= max(FEWEST_CUT, CUT_SHARE * total)
        and last > OFTEN * int(neighbours.max())
    )


def _flat_top(signal: Array, noise: float) -> float:
    """From where on a signal (k,) has flat tops [V]; infinite where they are round.

    Its longest stretches within some standard deviations of its top, as means of neighbours show
    them, are held against parabolas: a round top is lower by 1.5 standard deviations outside the
    middle of such a stretch. Tops that those means do not reach are narrower than a mean, and too
    few samples to be called flat.
    """
    means = np.convolve(signal, np.full(MEANS, 1.0 / MEANS), mode="same")
    if means.max() < signal.max() - 6.0 * noise:
        return math.inf
    level = float(np.median(signal[means >= means.max() - 6.0 * noise]))
    floor = level - 3.0 * noise
    edges = np.flatnonzero(np.diff(np.concatenate([[False], means > floor, [False]])))
    middles, outers = [], []
    for begin, end in edges.reshape(-1, 2):
        if end - begin >= LONG:
            place = np.abs(np.linspace(-1.0, 1.0, end - begin))
            stretch = signal[begin:end]
            middles.append(stretch[place < 0.5])
            outers.append(stretch[(place > 0.5) & (place < 0.8)])
    if not middles:
        return math.inf
    middle, outer = np.concatenate(middles), np.concatenate(outers)
    if len(middle) < max(FEWEST_FLAT, 0.5 * FLAT_SHARE * len(signal)):
        return math.inf
    round_by = float(middle.mean() - outer.mean())
    return floor if round_by < ROUND * noise else math.inf


def noise_of(signal: Array, step: float = 0.0, cut: Mask | None = None) -> float:
    """Standard deviation [V] of white noise on a signal that is smooth from sample to sample.

    signal : (k,) values [V]. step : of the converter [V]; the values are spread evenly over it
    first, for the median of a few levels is no measure, and that is taken off again. cut : (k,)
    samples that say nothing of noise, for the channel is cut off there.

    The d-th differences of white noise have variance C(2d, d) σ²; a smooth signal adds less to them
    the higher d is, until its own kinks do. The least of the robust estimates (median of the
    absolute value over 0.674) for d = 1 … 6 is returned, which is too large for a signal with few
    samples a turn, never too small but by chance (differences of variance: Gasser, Sroka and
    Jennen-Steinmetz, Biometrika 73, 1986).
    """
    estimates = []
    dither = step * (np.random.default_rng(DITHER_SEED).random(len(signal)) - 0.5)
    differences = np.asarray(signal, dtype=np.float64) + dither
    free = np.ones(len(signal), dtype=bool) if cut is None else ~cut
    for order in ORDERS:
        differences = np.diff(differences)
        free = free[1:] & free[:-1]
        if np.count_nonzero(free) < 2:
            break
        middle = float(np.median(np.abs(differences[free])))
        estimates.append(middle / NORMAL / math.sqrt(math.comb(2 * order, order)))
    least = min(estimates, default=0.0)
    return math.sqrt(max(least**2 - step**2 / 12.0, 0.0))
