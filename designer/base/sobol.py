"""A scrambled Sobol set, the same as ``scipy.stats.qmc.Sobol`` draws.

SciPy's statistics take a third of a second to import: more than most models take to find a response
from these points.
"""

from __future__ import annotations

import numpy as np

from designer.base.arrays import Array

BITS = 30
"""Of a coordinate."""
DIRECTIONS = (
    (1, (1,)),
    (3, (1,)),
    (7, (1, 3)),
    (11, (1, 3, 1)),
    (13, (1, 1, 1)),
    (19, (1, 1, 3, 3)),
    (25, (1, 3, 5, 13)),
    (37, (1, 1, 5, 5, 17)),
    (41, (1, 1, 5, 5, 5)),
    (47, (1, 1, 7, 11, 19)),
    (55, (1, 1, 5, 1, 1)),
    (59, (1, 1, 1, 3, 11)),
    (61, (1, 3, 5, 5, 31)),
    (67, (1, 3, 3, 9, 7, 49)),
    (91, (1, 1, 1, 15, 21, 21)),
    (97, (1, 3, 1, 13, 27, 49)),
)
"""Of each dimension the primitive polynomial, its coefficients as bits, and the first direction
numbers: S. Joe and F. Y. Kuo, SIAM J. Sci. Comput. 30 (2008) 2635-2654, new-joe-kuo-6.21201."""


def sobol(dimensions: int, count: int, seed: int) -> Array:
    """(count, dimensions) points in [0, 1), scrambled by a lower triangular matrix and a shift
    (J. Matoušek, J. Complexity 14 (1998) 527-556)."""
    if dimensions > len(DIRECTIONS):
        from scipy.stats import qmc

        return np.asarray(qmc.Sobol(dimensions, seed=seed).random(count))
    random, place = np.random.default_rng(seed), np.arange(BITS)
    powers = 2**place
    draws = random.integers(2, size=(dimensions, BITS), dtype=np.uint32)
    lower = np.tril(random.integers(2, size=(dimensions, BITS, BITS), dtype=np.uint32))
    lower[:, place, place] = 1
    plain = np.array([_directions(*own) for own in DIRECTIONS[:dimensions]])
    bits = plain[:, None, :] // powers[::-1, None] % 2  # of each direction, the highest first
    directions = powers[::-1] @ (lower @ bits % 2)
    # In the order of the Gray code each point differs from the one before in one direction.
    changed = [(k & -k).bit_length() - 1 for k in range(1, count)]
    steps = np.vstack([draws @ powers, directions[:, changed].T])
    return np.asarray(np.bitwise_xor.accumulate(steps) / 2.0**BITS)


def _directions(polynomial: int, first: tuple[int, ...]) -> list[int]:
    """``BITS`` direction numbers, each the numerator over 2 ** ``BITS``."""
    degree = polynomial.bit_length() - 1
    numbers = list(first) if degree else [1] * BITS
    while len(numbers) < BITS:
        new = numbers[-degree]
        for k in range(1, degree + 1):
            new ^= (polynomial >> (degree - k) & 1) * (numbers[-k] << k)
        numbers.append(new)
    return [number << (BITS - 1 - k) for k, number in enumerate(numbers)]
