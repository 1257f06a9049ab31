"""From one branch of periodic orbits to another, at pitchforks and period doublings."""

from __future__ import annotations

import numpy as np

from designer.bifurcations import Bifurcation, Kind
from designer.continuation import Branch, End, apart, at, follow
from designer.curve import Curve
from designer.orbit import MAX_PERIOD
from designer.system import Array

ASIDE = (3e-3, 1e-3, 1e-2, 3e-4, 3e-2, 1e-4, 3e-5, 1e-5)
"""Arclengths, in scaled units, at which the other branch is looked for, in this order."""


def switch(
    parent: Branch, where: Bifurcation, low: float, high: float, aside: tuple[float, ...] = ASIDE
) -> Branch | None:
    """The branch that leaves ``parent`` at a pitchfork or a period doubling, followed to its end.

    At a pitchfork one of the two asymmetric twins (its mirror image is the other), at a period
    doubling the orbits of twice the period; they set out along the eigenvector of the multiplier
    -1. None where none is found, or its period passes ``MAX_PERIOD``.
    """
    curve = parent.curve
    x, value = where.point.solved.x, where.value
    doubled = where.kind is Kind.DOUBLING
    if where.kind not in (Kind.PITCHFORK, Kind.DOUBLING):
        return None
    n = 2 * curve.n if doubled else curve.n
    if n > MAX_PERIOD:
        return None
    other = Curve(curve.family, n, False, curve.scale)
    border = np.append(_leaving(where.point.solved.jacobian, curve.scale[:-1]), 0.0)
    centre = np.append(x, value)
    for reach in aside:
        guess = centre + reach * curve.scale * border
        solved = other.correct(guess, border)
        point = None if solved is None else at(other, solved)
        if point is None or abs(point.value - value) > 0.1 * float(curve.scale[-1]):
            continue
        if float(np.linalg.norm(apart(other, point))) < 0.5 * reach:
            continue  # fell back onto the parent
        origin = Branch(other, (point,), (End.JOINED, End.STOPPED))
        grown = follow(origin, low, high, 1.0, border=border)
        return Branch(other, grown.points, (End.JOINED, grown.ends[1]))
    return None


def _leaving(jacobian: Array, scale: Array) -> Array:
    """(states,) unit eigenvector, in scaled units, of the multiplier nearest to -1."""
    values, vectors = np.linalg.eig(jacobian * scale / scale[:, None])
    vector = vectors[:, np.argmin(np.abs(values + 1.0))].real
    return np.asarray(vector / np.linalg.norm(vector))
