"""A cubic spring, force = k1 x + k3 x³, as straight pieces.

On both sides of rest alike the largest error of the force is the same on every piece, above and
below the law: no other continuous choice of as many pieces has a smaller one over the range. The
first piece runs through rest. Its error and that of a chord depend on k3 alone, so the places of
the corners of one unit of length serve for all.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np

MOST_POINTS = 64
"""Of a law; by then the error of a pure cubic is 0.02 % of the force at the end of the range."""
_ERROR = 0.25
"""Error of x³ by straight pieces of which the first ends at 1: 3x/4 - x³ is 1/4 at 1/2, and -1/4
at 1."""


def cubic_points(k1: float, k3: float, span: float, count: int) -> tuple[tuple[float, float], ...]:
    """(x, force) of ``count`` points from -``span`` to ``span``, an even number of at least two."""
    places = _places(count // 2)
    unit = span / places[-1]
    upper = [
        (x, k1 * x + k3 * (x**3 - _ERROR * unit**3))
        for x in (span * t / places[-1] for t in places)
    ]
    return (*((-x, -force) for x, force in reversed(upper)), *upper)


def cubic_error(k1: float, k3: float, span: float, count: int) -> float:
    """Largest error of the force over the range, over the largest force in it."""
    unit = span / _places(count // 2)[-1]
    places = [span]
    if k1 * k3 < 0.0:
        places.append(min(span, math.sqrt(-k1 / (3.0 * k3))))
    largest = max(abs(k1 * x + k3 * x**3) for x in places)
    return _ERROR * abs(k3) * unit**3 / largest if k3 else 0.0


def points_for(k1: float, k3: float, span: float, error: float) -> int | None:
    """The fewest points whose ``cubic_error`` is at most ``error``; None where ``MOST_POINTS`` have
    more."""
    counts = range(2, MOST_POINTS + 1, 2)
    return next((n for n in counts if cubic_error(k1, k3, span, n) <= error), None)


@cache
def _places(count: int) -> tuple[float, ...]:
    """Ends of ``count`` pieces above rest that stand for x³ with the error ``_ERROR``."""
    if count == 1:
        return (1.0,)
    before = _places(count - 1)
    return (*before, _end(before[-1]))


def _end(start: float) -> float:
    """Where a chord of x³ from ``start`` ends that rises above it by twice the error: it does so at
    the x with (x - start)² (2x + start) = twice the error, where 3x² is its slope."""
    roots = np.roots([2.0, -3.0 * start, 0.0, start**3 - 2.0 * _ERROR])
    at = float(roots.real.max())
    return 0.5 * (math.sqrt(12.0 * at * at - 3.0 * start * start) - start)
