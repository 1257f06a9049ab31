"""The drive of a record: its frequency, and by the generator's channel its amplitude and phase."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from designer.base.arrays import Array
from designer.workbench.folding import Samples, fold, left_over, rates_at

ROUNDS = 6
"""Steps of Newton's method on the frequency."""
COARSE = 32
"""Knots of a period while the frequency is refined."""
HARMONICS = 24
"""Harmonics of the drive whose power is counted."""
FINE = 8
"""Points of the spectrum for each line that the record can tell."""
MUCH = 0.2
"""Share of the most power that any frequency explains: candidates have more."""
CANDIDATES = 24
"""The most candidates that are tried."""
FEW = 4
"""Tops of a spectrum that are tried for a sine."""
STRAY = 0.3
"""Distance of a frequency from where it was first seen, over the width of a line of the
spectrum."""
FEWEST_LINES = 1.5
"""Periods of a sine that is looked for."""
TWICE, FAINT = 2.0, 0.01
"""A record lies on itself if what is left over is at most twice the least that any frequency leaves
over, and a hundredth of its power: a period of several drive periods may be hidden in that."""
FEWEST_PERIODS = 2.0
"""Drive periods that a record has to last."""


@dataclass(frozen=True)
class SineFit:
    """A sine through a channel: amplitude · sin(2 pi f t + phase) + offset."""

    amplitude: float
    """[V peak]."""
    phase: float
    """Phase at the record's first sample [rad], in [0, 2 pi)."""
    offset: float
    """[V]."""
    left: float
    """Standard deviation of what is left [V]."""


def drive_frequency(samples: Samples, low: float, high: float) -> tuple[float, float]:
    """The drive frequency [Hz] between two bounds, and its standard error.

    Candidates are the tops of the power that all harmonics of a frequency have together, the
    channels counted by their noise. Each is refined; of those at which the record lies on itself
    after one period the largest is taken, for it does so at every whole fraction of it as well.
    """
    tops = _tops(samples, max(low, FEWEST_PERIODS / float(np.ptp(samples.time))), high)
    tried = []
    for top in tops:
        frequency, error = refined_frequency(samples, top)
        if low <= frequency <= high:
            left = fold(samples, frequency, 1, COARSE).squares / len(samples.time)
            tried.append((frequency, error, float((left / samples.noise**2).mean())))
    if not tried:
        return (low * high) ** 0.5, math.inf
    power = float((samples.values.var(axis=0) / samples.noise**2).mean())
    enough = TWICE * min(left for _, _, left in tried) + FAINT * power
    frequency, error, _ = max(each for each in tried if each[2] <= enough)
    return frequency, error


def _tops(samples: Samples, low: float, high: float) -> list[float]:
    """Frequencies [Hz] whose harmonics have much power, to a fraction of a line of the spectrum."""
    values = (samples.values - samples.values.mean(axis=0)) / samples.noise
    count, step = len(samples.time), float(samples.time[1] - samples.time[0])
    size = FINE * count
    spectrum = np.fft.rfft(values * np.hanning(count)[:, None], size, axis=0)
    power = (np.abs(spectrum) ** 2).sum(axis=1)
    line = 1.0 / (size * step)
    frequencies = np.arange(low, high + line, line)
    explained = np.zeros(len(frequencies))
    for harmonic in range(1, HARMONICS + 1):
        place = np.round(harmonic * frequencies / line).astype(int)
        explained += np.where(place < len(power), power[np.minimum(place, len(power) - 1)], 0.0)
    bounded = np.concatenate([[-np.inf], explained, [-np.inf]])
    is_top = (explained >= bounded[:-2]) & (explained >= bounded[2:])
    tops = np.flatnonzero(is_top & (explained > MUCH * explained.max()))
    most = tops[np.argsort(-explained[tops])][:CANDIDATES]
    return [float(frequencies[k]) for k in most]


def refined_frequency(
    samples: Samples, frequency: float, knots: int | Sequence[int] = COARSE, n: int = 1
) -> tuple[float, float]:
    """The frequency [Hz] at which the record lies best on itself after n periods, and its standard
    error, by Newton's method on all channels. knots : of a period, of all channels or of each.

    A curve that moves by δf · t of a period leaves δf · t · rate over, which is fitted.
    """
    error = math.inf
    middle = samples.time - samples.time.mean()
    for _ in range(ROUNDS):
        curve = fold(samples, frequency, n, knots)
        scale = np.maximum(curve.left, 1e-300)
        slope = rates_at(samples, frequency, curve) * middle[:, None] / scale
        left = left_over(samples, frequency, curve) / scale
        weight = max(float((slope**2).sum()), 1e-300)
        step = float((slope * left).sum()) / weight
        frequency, error = frequency + step, 1.0 / math.sqrt(weight)
        if abs(step) < 0.1 * error:
            break
    return frequency, error


def sine(time: Array, values: Array, frequency: float) -> SineFit:
    """The sine of this frequency [Hz] through values (k,) [V] at times (k,) [s], by least
    squares."""
    angle = 2.0 * np.pi * frequency * time
    columns = np.column_stack([np.sin(angle), np.cos(angle), np.ones_like(angle)])
    (a, b, offset), *_ = np.linalg.lstsq(columns, values, rcond=None)
    left = float(np.std(values - columns @ np.array([a, b, offset])))
    return SineFit(math.hypot(a, b), math.atan2(b, a) % (2.0 * math.pi), float(offset), left)


def near_frequency(
    samples: Samples, frequency: float, knots: Sequence[int | Sequence[int]], n: int = 1
) -> tuple[float, float]:
    """``refined_frequency`` with curves of more and more knots, from one [Hz] that it may not leave
    by more than `STRAY`."""
    line = 1.0 / float(np.ptp(samples.time))
    best, error = frequency, STRAY * line
    for each in knots:
        found, spread = refined_frequency(samples, best, each, n)
        if not abs(found - frequency) < STRAY * line:
            break
        best, error = found, spread
    return best, error


def spectrum_tops(time: Array, values: Array, low: float, high: float) -> list[float]:
    """Frequencies [Hz] from low to high at which the spectrum of values (k,) at equal steps has
    tops, the highest first: those above `MUCH` of it, and at most `FEW`."""
    count, step = len(time), float(time[1] - time[0])
    size = 1 << (FINE * count - 1).bit_length()
    power = np.abs(np.fft.rfft(values - values.mean(), size)) ** 2
    line = 1.0 / (size * step)
    begin = max(round(max(low, FEWEST_LINES / (count * step)) / line), 1)
    end = round(min(high / line, len(power) - 2))
    inside = np.arange(begin, end + 1)
    if not len(inside) or not power[inside].max() > 0.0:
        return []
    is_top = (power[inside] >= power[inside - 1]) & (power[inside] >= power[inside + 1])
    tops = inside[is_top & (power[inside] > 0.0)]
    tops = tops if len(tops) else inside[[int(power[inside].argmax())]]
    tops = tops[np.argsort(-power[tops])]
    return [float(k * line) for k in tops[:FEW] if power[k] > MUCH * power[tops[0]]]


def tuned(left: Callable[[float], float], frequency: float, time: Array) -> float:
    """The frequency [Hz] within half a line of the spectrum at which a sine leaves least over.

    left : squares that are left, by frequency.
    """
    half = min(0.5 / float(np.ptp(time)), 0.5 * frequency)
    # The search is exact to a fraction of its variable: so of the way from the middle.
    found = minimize_scalar(
        lambda off: left(frequency + off),
        bounds=(-half, half),
        method="bounded",
        options={"xatol": 1e-7 * half},
    )
    return frequency + float(found.x)


def sine_frequency(time: Array, values: Array, frequency: float) -> float:
    """The frequency [Hz] of a sine within half a line of the spectrum of ``frequency``, by least
    squares of all four numbers."""
    return tuned(lambda each: sine(time, values, each).left, frequency, time)
