"""The uniform numbers of a study: one stream for each named coordinate.

The number of (seed, name, sample index) depends on nothing else: not on how many workers there
are, which block a sample is in, or which other coordinates exist. So two designs, two grades or
two spreads of one design compare the same boards wherever they have a coordinate in common.
"""

from __future__ import annotations

from collections.abc import Sequence
from zlib import crc32

import numpy as np

from designer.base.arrays import Array


def uniforms(seed: int, name: str, indices: range) -> Array:
    """(N,) uniform numbers in [0, 1) of a coordinate for these samples.

    indices : ascending by 1, from 0 up. Number i is the i-th of PCG64 seeded with (seed, CRC-32 of
    the name).
    """
    if indices.step != 1 or indices.start < 0:
        raise ValueError("samples are counted upwards from 0")
    stream = np.random.PCG64(np.random.SeedSequence([seed, crc32(name.encode("utf-8"))]))
    stream.advance(indices.start)
    return np.random.Generator(stream).random(len(indices))


def cube(seed: int, names: Sequence[str], indices: range) -> Array:
    """(N, K) uniform numbers: a row for each sample, a column for each coordinate."""
    return np.stack([uniforms(seed, name, indices) for name in names], axis=1)
