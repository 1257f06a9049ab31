"""A Hertzian contact, force = constant · depth^1.5, as springs that join in one after the other.

Straight pieces are laid so that the largest error of the force, above and below the law, is the
same on all of them: no other choice of as many pieces from zero force has a smaller one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

POWER = 1.5
"""Of the depth, for two round bodies (H. Hertz, 1881)."""


@dataclass(frozen=True)
class HertzPieces:
    """The springs that stand for a Hertzian contact."""

    stiffness: float
    """Stiffness from the first touch on."""
    further: tuple[tuple[float, float], ...]
    """(depth, stiffness) of the springs that join in."""
    largest_error: float
    """Largest error of the force down to the depth, over the force there."""


def hertz_pieces(constant: float, depth: float, pieces: int) -> HertzPieces:
    """``pieces`` straight pieces down to ``depth``.

    constant : force over depth^1.5. The law scales, so the pieces of one unit of depth and force
    serve for all.
    """
    error = _least_error(pieces)
    knots = _knots(error, pieces)
    slopes = [(f1 - f0) / (x1 - x0) for (x0, f0), (x1, f1) in pairwise(knots)]
    unit = constant * depth ** (POWER - 1.0)
    joins = zip(knots[1:], slopes, slopes[1:], strict=False)
    return HertzPieces(
        unit * slopes[0],
        tuple((depth * x, unit * (after - before)) for (x, _), before, after in joins),
        error,
    )


def _least_error(pieces: int) -> float:
    """The error at which so many pieces just reach a depth of 1."""

    def short(error: float) -> float:
        return 1.0 - _knots(error, pieces)[-1][0]

    return _root(short, 1e-9, 1.0)


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    # Imported here: a model file without such a contact does not wait for it.
    from scipy.optimize import brentq

    return float(brentq(function, low, high, xtol=1e-15, rtol=1e-14))


def _knots(error: float, pieces: int) -> list[tuple[float, float]]:
    """(depth, force) where pieces meet: each but the first begins and ends ``error`` below the law
    and rises above it by no more."""
    knots = [(0.0, 0.0)]
    for _ in range(pieces):
        x, f = knots[-1]
        end = _end(x, f, error)
        knots.append((end, end**POWER - error))
    return knots


def _end(x: float, f: float, error: float) -> float:
    """Where a piece from (x, f) ends, ``error`` below the law, that rises above it by ``error``."""

    def excess(end: float) -> float:
        slope = (end**POWER - error - f) / (end - x)
        touch = (slope / POWER) ** (1.0 / (POWER - 1.0))
        return float(f + slope * (touch - x) - touch**POWER - error)

    high = x + 1.0
    while excess(high) < 0.0:
        high += high
    low = max(x, error ** (1.0 / POWER)) * (1.0 + 1e-12) + 1e-12
    return _root(excess, low, high)
