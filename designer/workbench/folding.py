"""A record laid on itself: the curve that it repeats after n drive periods, and what is left over.

The curve is a cubic spline through all laps at once, with equal knots round n periods, by least
squares: its error falls with the number of samples, far below the noise of one sample and below a
step of the converter.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from designer.base.arrays import Array, Mask
from designer.workbench.record import Record

SAMPLES = 1024
"""Samples of a drive period that are enough: of more, neighbours are averaged."""
KNOTS = (32, 64, 128, 256, 512)
"""Knots of a drive period that are tried."""
SAMPLES_A_KNOT = 4
"""The fewest samples of a knot."""
POINTS = 1024
"""Points of the curve in a drive period."""
DITHER = 0.5
"""Of a converter's step: noise that makes its rounding independent from sample to sample."""
EXACT = 1e-6
"""Of the largest channel's range: noise of one that has none, as computed signals."""
RIDGE = 1e-9
"""Of the normal matrix' largest entry: what holds a knot that no sample is near."""


@dataclass(frozen=True)
class Samples:
    """The samples of some channels, neighbours averaged where there are more than are needed."""

    time: Array
    """(k,) [s], from the record's first sample."""
    values: Array
    """(k, c) [V]."""
    noise: Array
    """(c,) standard deviation of what is noise in them [V]."""
    cut: Mask
    """(k, c) where a channel is cut off."""
    rounding: Array
    """(c,) standard deviation of a converter's rounding that no noise makes independent from sample
    to sample [V]; 0 where noise does."""


@dataclass(frozen=True)
class Fold:
    """The curve that a record repeats after n drive periods."""

    n: int
    """Drive periods of a lap."""
    curve: Array
    """(n · POINTS, c) voltages at equal phases [V], from the record's first sample on."""
    rate: Array
    """(n · POINTS, c) their rates [V per drive period]."""
    error: Array
    """(c,) standard error of a point of the curve [V]."""
    left: Array
    """(c,) standard deviation of what is left of the samples [V], for the freedom there is."""
    squares: Array
    """(c,) sum of the squares of what is left [V²]."""
    freedom: Array
    """(c,) samples less knots."""
    knots: Array
    """(c,) of the whole lap."""


def samples_of(record: Record, channels: Sequence[str], frequency: float) -> Samples:
    """The samples of these channels for a drive of about this frequency [Hz]."""
    block = max(int(1.0 / (frequency * record.interval * SAMPLES)), 1)
    time, table, clipped = record.means(channels, block)
    noise = np.array([record.noise[c] for c in channels])
    quantum = np.array([record.quantum[c] for c in channels])
    # Rounding averages out only where noise carries the signal from one step to the next.
    carried = noise > DITHER * quantum
    rounding = np.where(carried, 0.0, quantum / math.sqrt(12.0))
    floor = quantum / np.sqrt(12.0 * np.where(carried, block, 1))
    least = EXACT * max(float(np.ptp(table, axis=0).max()), 1e-300)
    noise = np.maximum(noise / math.sqrt(block), floor)
    return Samples(time, table, np.maximum(noise, least), clipped, rounding)


def fold(samples: Samples, frequency: float, n: int, knots: int | Sequence[int]) -> Fold:
    """The curve of n periods at a frequency [Hz]. knots : of one period, of all channels or of
    each."""
    width = samples.values.shape[1]
    each = np.full(width, knots) * n if isinstance(knots, int) else np.asarray(knots) * n
    curve, rate = np.empty((n * POINTS, width)), np.empty((n * POINTS, width))
    squares = np.empty(width)
    for count in np.unique(each):
        of = each == count
        curve[:, of], rate[:, of], squares[of] = _splines(samples, frequency, n, int(count), of)
    freedom = np.maximum(len(samples.time) - each, 1)
    left = np.sqrt(squares / freedom)
    error = left * np.sqrt(each / len(samples.time))
    return Fold(n, curve, rate, error, left, squares, freedom, each)


def _splines(
    samples: Samples, frequency: float, n: int, count: int, of: Mask
) -> tuple[Array, Array, Array]:
    """Curves, rates and squares of what is left of some channels, with so many knots a lap."""
    phase = (samples.time * frequency) % n
    basis = spline_basis(phase * count / n, count)
    normal = (basis.T @ basis).tocsc()
    ridge = RIDGE * float(abs(normal).max())
    solver = splu(normal + ridge * sparse.identity(count, format="csc"))
    weights = solver.solve(basis.T @ samples.values[:, of])
    squares = ((samples.values[:, of] - basis @ weights) ** 2).sum(axis=0)
    grid = np.arange(n * POINTS) * count / (n * POINTS)
    rates = spline_basis(grid, count, rate=True) @ weights * (count / n)
    return np.asarray(spline_basis(grid, count) @ weights), np.asarray(rates), squares


def best_knots(
    samples: Samples, frequency: float, choices: Sequence[int] = KNOTS, n: int = 1
) -> tuple[int, ...]:
    """Knots of a period for each channel, of some choices by generalised cross-validation (Craven
    and Wahba, Numer. Math. 31, 1979) on laps of n periods."""
    count = len(samples.time)
    tried = [k for k in choices if SAMPLES_A_KNOT * k * n <= count] or [choices[0]]
    scores = np.array(
        [fold(samples, frequency, n, k).squares / (1.0 - k * n / count) ** 2 for k in tried]
    )
    return tuple(tried[k] for k in scores.argmin(axis=0))


def left_over(samples: Samples, frequency: float, curve: Fold) -> Array:
    """(k, c) the samples less the curve [V]."""
    phase = (samples.time * frequency) % curve.n
    grid = np.arange(len(curve.curve) + 1) / POINTS
    closed = np.vstack([curve.curve, curve.curve[:1]])
    columns = [np.interp(phase, grid, column) for column in closed.T]
    return np.asarray(samples.values - np.column_stack(columns))


def rates_at(samples: Samples, frequency: float, curve: Fold) -> Array:
    """(k, c) rates of the curve at the samples [V per drive period]."""
    phase = (samples.time * frequency) % curve.n
    place = np.minimum((phase * POINTS).astype(int), len(curve.rate) - 1)
    return np.asarray(curve.rate[place])


def spline_basis(place: Array, count: int, *, rate: bool = False) -> sparse.csr_array:
    """(k, count) values, or rates, of the closed uniform cubic B-splines at ``place`` (k,), in
    knots."""
    cell = np.floor(place).astype(np.int64)
    u = place - cell
    powers = [u**j for j in range(4)]
    if rate:
        powers = [np.zeros_like(u), np.ones_like(u), 2.0 * u, 3.0 * u**2]
    pieces = {3: (1, -3, 3, -1), 2: (4, 0, -6, 3), 1: (1, 3, 3, -3), 0: (0, 0, 0, 1)}
    rows = np.tile(np.arange(len(place)), 4)
    columns = np.concatenate([(cell - back) % count for back in pieces])
    values = [
        sum(c * p for c, p in zip(piece, powers, strict=True)) / 6.0 for piece in pieces.values()
    ]
    return sparse.csr_array((np.concatenate(values), (rows, columns)), shape=(len(place), count))
