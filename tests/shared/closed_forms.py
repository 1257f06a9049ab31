"""Probabilities in closed form."""

from __future__ import annotations

import math


def irwin_hall(count: int, threshold: float) -> float:
    """Probability that the sum of so many uniform numbers is above a threshold, by its formula
    (J. O. Irwin, P. Hall, Biometrika 19, 1927)."""
    rest = count - threshold
    terms = ((-1.0) ** k * math.comb(count, k) * (rest - k) ** count for k in range(int(rest) + 1))
    return math.fsum(terms) / math.factorial(count)
