"""Scrambled Sobol points, number by number those of ``scipy.stats.qmc.Sobol``, whose import takes
longer than most models take to settle.

The points are those of P. Bratley and B. L. Fox, ACM Trans. Math. Softw. 14 (1988) 88, in the order
of Gray's code, with the direction numbers of S. Joe and F. Y. Kuo, SIAM J. Sci. Comput. 30 (2008)
2635 (file new-joe-kuo-6.21201), and J. Matoušek's scramble, J. Complexity 14 (1998) 527: a random
matrix and a random shift.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from designer.base.arrays import Array

BITS = 30
"""Binary digits of a coordinate."""
DIRECTIONS = (
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
"""Of each dimension after the first: its primitive polynomial, by binary digits, and the first
direction numbers."""


def sobol(dimension: int, count: int, seed: int) -> Array:
    """(count, dimension) points in the unit cube.

    count : at most 2^``BITS``.
    """
    if dimension > 1 + len(DIRECTIONS):
        from scipy.stats import qmc  # takes a third of a second, and has the directions of all

        return np.asarray(qmc.Sobol(dimension, seed=seed).random(count))
    random, whole = np.random.default_rng(seed), np.uint32
    places = np.arange(BITS, dtype=whole)
    shift = random.integers(2, size=(dimension, BITS), dtype=whole) << places
    mixing = np.tril(random.integers(2, size=(dimension, BITS, BITS), dtype=whole), -1)
    mixing += np.eye(BITS, dtype=whole)
    places = places[::-1]  # of digits, the highest first
    digits = np.stack([_directions(k) for k in range(dimension)])[:, :, None] >> places & 1
    mixed = np.einsum("dpi,dji->djp", mixing, digits) % 2
    steps = (mixed << places).sum(axis=-1, dtype=whole)
    # Gray's code changes the digit where a 1 is carried to.
    changed = [(k & -k).bit_length() - 1 for k in range(1, count)]
    numbers = np.column_stack([shift.sum(axis=1, dtype=whole), steps[:, changed]])
    return np.asarray(np.bitwise_xor.accumulate(numbers, axis=1).T / 2.0**BITS)


def _directions(axis: int) -> NDArray[np.uint32]:
    """(BITS,) direction numbers of one dimension, as whole numbers of ``BITS`` digits."""
    if axis == 0:
        numbers = [1] * BITS
    else:
        polynomial, first = DIRECTIONS[axis - 1]
        numbers, degree = list(first), len(first)
        for j in range(degree, BITS):
            new = numbers[j - degree]
            for k in range(1, degree + 1):
                if polynomial >> (degree - k) & 1:
                    new ^= numbers[j - k] << k
            numbers.append(new)
    return np.array([m << BITS - 1 - j for j, m in enumerate(numbers)], dtype=np.uint32)
