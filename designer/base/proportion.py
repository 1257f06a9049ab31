"""The interval of a proportion: every yield, rate and share has Wilson's; limits on what was hardly
or never seen are by mid-p, what was counted up to a number of hits has exact ones."""

from __future__ import annotations

import math
from functools import lru_cache

from scipy.special import betainc, betaincinv, ndtri

Z = float(ndtri(0.975))
TAIL = 0.025
"""Probability beyond each limit."""


def wilson(count: float, of: int, quantile: float = Z) -> tuple[float, float]:
    """Two-sided interval of count/of (E. B. Wilson, J. Am. Stat. Assoc. 22, 1927, 209): of 95 %, or
    of another quantile of the normal distribution.

    ``count`` need not be whole. (0, 1) where nothing was asked.
    """
    if of == 0:
        return 0.0, 1.0
    p, n, z = count / of, float(of), quantile
    z2 = z * z
    centre = (p + z2 / (2.0 * n)) / (1.0 + z2 / n)
    half = z * math.sqrt(max(p * (1.0 - p), 0.0) / n + z2 / (4.0 * n * n)) / (1.0 + z2 / n)
    # At the ends the limit is exact, and the difference of equals only rounding.
    return (
        0.0 if count <= 0.0 else max(centre - half, 0.0),
        1.0 if count >= n else min(centre + half, 1.0),
    )


@lru_cache(maxsize=4096)
def mid_p(count: int, of: int) -> tuple[float, float]:
    """Two-sided 95 % interval of count/of by the mid-p value: half the probability of what was seen
    counts with each tail (H. O. Lancaster, J. Am. Stat. Assoc. 56, 1961, 223).

    Of a count of 0 the upper limit is 1 - 0.05^(1/of): no limit that holds 95 times in 100 is
    lower, and Wilson's is higher by a fifth. (0, 1) where nothing was asked.
    """
    if of == 0:
        return 0.0, 1.0
    return _lower(count, of), 1.0 - _lower(of - count, of)


def inverse_binomial(count: int, of: int, level: float = 0.95) -> tuple[float, float]:
    """Two-sided interval of a rate where asking ended with hit number ``count``, the last ``of``
    all: each end leaves at most half of 1 - level, exactly, by the negative binomial law.

    count : at least 1.
    """
    tail = 0.5 * (1.0 - level)
    low = float(betaincinv(count, of - count + 1, tail))
    return low, float(betaincinv(count, of - count, 1.0 - tail)) if of > count else 1.0


def _lower(count: int, of: int) -> float:
    """The rate at which ``count`` or more, the count itself by half, has probability ``TAIL``."""
    if count == 0:
        return 0.0

    def excess(rate: float) -> float:
        more = betainc(count + 1, of - count, rate) if count < of else 0.0
        return float(0.5 * (betainc(count, of - count + 1, rate) + more) - TAIL)

    low, high = 0.0, 1.0
    for _ in range(60):  # the excess grows with the rate
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) < 0.0 else (low, middle)
    return low
