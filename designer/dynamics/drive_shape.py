"""Shapes of a periodic drive: sums of a sine and its harmonics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from designer.base.arrays import Array

Shape = tuple[tuple[int, float, float], ...]
"""(n, amplitude of sin nωt, amplitude of cos nωt) of each wave of a sum."""
SINE: Shape = ((1, 1.0, 0.0),)
POINTS = 64
"""Of a period of the highest harmonic, on which a shape's peaks are looked for."""
NEWTON = 6
"""Steps from the best of them to a peak: each doubles its digits."""
LARGEST = 3.0
"""Of the largest force: what a channel's part of a force may be before another pair of shapes is
better."""
ROUNDING = 1e-9
"""Relative: waves of two forces that differ by no more are the same."""


def wave(shape: Shape, angle: Array) -> Array:
    """(k,) the shape at angles ωt (k,)."""
    terms = (
        sine * np.sin(n * angle) + (cosine * np.cos(n * angle) if cosine else 0.0)
        for n, sine, cosine in shape
    )
    return np.asarray(sum(terms, np.zeros_like(angle)))


def has_harmonics(*shapes: Shape) -> bool:
    """Whether any of them is more than a sine of whichever phase."""
    return any(n > 1 for shape in shapes for n, *_ in shape)


def slope(shape: Shape) -> Shape:
    """Its derivative by ωt."""
    return tuple((n, -n * cosine, n * sine) for n, sine, cosine in shape)


def extremes(shape: Shape) -> tuple[float, float]:
    """Its least and its greatest value."""
    count = POINTS * max(n for n, *_ in shape)
    angle = 2.0 * np.pi * np.arange(count) / count
    values, first, second = wave(shape, angle), slope(shape), slope(slope(shape))
    ends = []
    for sign in (-1.0, 1.0):
        high = sign * values
        tops = angle[(high >= np.roll(high, 1)) & (high >= np.roll(high, -1))]
        for _ in range(NEWTON):
            bend = wave(second, tops)
            step = np.divide(wave(first, tops), bend, out=np.zeros_like(bend), where=bend != 0.0)
            tops = tops - np.clip(step, -angle[1], angle[1])
        ends.append(sign * max(float(high.max()), float((sign * wave(shape, tops)).max())))
    return ends[0], ends[1]


def peak(shape: Shape) -> float:
    """Its largest size."""
    return max(map(abs, extremes(shape)))


@dataclass(frozen=True)
class Channel:
    """Forces of one shape."""

    shape: Shape
    """What they are the sum of, with a peak of 1."""
    force: Array
    """(n,) amplitude of it in each force."""


def channels(waves: Mapping[int, Array]) -> tuple[Channel, ...] | None:
    """The fewest channels, one or two, whose sum the forces are; None where it takes more.

    Two are the shapes of two of the forces: a pair whose sums do not nearly cancel (``LARGEST``),
    of those the pair that takes the fewest parts, amplitudes that are not 0 and signs that differ.

    waves : by order the (2, n) amplitudes of sine and cosine in each force. A shape has the sign of
    the first force that has it.
    """
    orders = [n for n in sorted(waves) if waves[n].any()]
    if not orders:
        return (Channel(SINE, np.zeros(len(next(iter(waves.values()))[0]))),)
    whole = np.concatenate([waves[n] for n in orders])
    shapes = _distinct(whole)
    bases = [shapes[:, :1]] if shapes.shape[1] == 1 else []
    if not bases:
        bases = [shapes[:, pair] for pair in combinations(range(shapes.shape[1]), 2)]
    fits = [fit for fit in (_fit(basis, whole) for basis in bases) if fit is not None]
    if not fits:
        return None
    largest = np.linalg.norm(whole, axis=0).max()
    basis, sizes = min(fits, key=lambda fit: _parts(fit[1] / largest))
    return tuple(_channel(orders, own, size) for own, size in zip(basis.T, sizes, strict=True))


def _distinct(whole: Array) -> Array:
    """(2k, m) the different directions of the columns (2k, n), each of length 1."""
    lengths = np.linalg.norm(whole, axis=0)
    out: list[Array] = []
    for column, length in zip(whole.T, lengths.tolist(), strict=True):
        if length <= ROUNDING * lengths.max():
            continue
        own = column / length
        if all(np.linalg.norm(own - (own @ each) * each) > ROUNDING for each in out):
            out.append(own)
    return np.stack(out, axis=1)


def _fit(basis: Array, whole: Array) -> tuple[Array, Array] | None:
    """The basis with the (m, n) amplitudes by which it makes the columns; None where it does
    not."""
    sizes, *_ = np.linalg.lstsq(basis, whole, rcond=None)
    lengths = np.linalg.norm(whole, axis=0)
    if (np.linalg.norm(whole - basis @ sizes, axis=0) > ROUNDING * lengths.max()).any():
        return None
    return basis, np.where(np.abs(sizes) > ROUNDING * np.abs(sizes).max(), sizes, 0.0)


def _parts(sizes: Array) -> tuple[bool, int, int, float]:
    """sizes : (m, n) over the largest force."""
    both = (sizes > 0.0).any(axis=1) & (sizes < 0.0).any(axis=1)
    most = round(float(np.abs(sizes).max()), 6)  # equal pairs stay so
    return most > LARGEST, int(np.count_nonzero(sizes)), int(both.sum()), most


def _channel(orders: list[int], own: Array, sizes: Array) -> Channel:
    first = sizes[np.flatnonzero(sizes)[0]] if sizes.any() else 1.0
    sign = -1.0 if first < 0.0 else 1.0
    pairs = zip(orders, (sign * own).reshape(-1, 2).tolist(), strict=True)
    raw: Shape = tuple((n, sine, cosine) for n, (sine, cosine) in pairs if sine or cosine)
    size = peak(raw)
    shape = tuple((n, sine / size, cosine / size) for n, sine, cosine in raw)
    return Channel(shape, sign * size * sizes)
