"""From one branch of periodic orbits to another, at pitchforks and period doublings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from designer.base.arrays import Array
from designer.bifurcations.continuation import Branch, BranchPoint, End, apart, at, follow, linked
from designer.bifurcations.orbit_curve import Curve, Solved
from designer.bifurcations.points import Bifurcation, Birth, PointKind
from designer.dynamics.attractors import mirrored_strobes
from designer.dynamics.counts import MAX_PERIOD

ASIDE = (3e-3, 1e-3, 1e-2, 3e-4, 3e-2, 1e-4, 3e-5, 1e-5)
"""Arclengths, in scaled units, at which the other branch is looked for, in this order."""

REACH = 5e-2
"""Arclength, in scaled units, from a branch's last point to where it joins another."""
FIRST = 0.1
"""Of the way from where branches meet to the next point: a point there, since the branch's course
where it sets out, λ going by the square of the distance, cannot be read off the meeting point."""
NEAR = 2.0
"""Of such an arclength: farther from the parent than this lies another branch's orbit."""
CRITICAL = 1e-9
"""Nearer to 1 than this the largest multiplier does not tell whether an orbit is stable."""


def switch(
    parent: Branch,
    bifurcation: Bifurcation,
    low: float,
    high: float,
    *,
    is_followed: Callable[[Branch], bool] = lambda _: False,
) -> Branch | None:
    """The branch that leaves ``parent`` at a pitchfork or a period doubling, followed to its end.

    At a pitchfork one of the two asymmetric twins (its mirror image is the other), at a period
    doubling the orbits of twice the period; they set out along the eigenvector of the multiplier
    -1. The first point is the one it leaves at. The branch is measured in the size of the orbit
    that it leaves, so it is the same wherever the parent was begun. None where none is found, or
    its period passes ``MAX_PERIOD``, or ``is_followed`` is true of its first points.
    """
    out = _setting_out(parent, bifurcation)
    if out is None:
        return None
    first, border = out
    if is_followed(first):
        return None
    origin = Branch(first.curve, first.points[-1:], first.ends)
    grown = follow(origin, low, high, 1.0, border=border)
    return Branch(first.curve, first.points[:-1] + grown.points, (End.JOINED, grown.ends[1]))


def birth(parent: Branch, bifurcation: Bifurcation) -> Birth | None:
    """The orbits that leave ``parent`` at a pitchfork or a period doubling, right beside it.

    None at other points, and where none are found.
    """
    out = _setting_out(parent, bifurcation)
    if out is None:
        return None
    first = out[0]
    for p in first.points[1:]:
        off = p.value - bifurcation.value
        if abs(off) > bifurcation.error and abs(p.orbit.radius - 1.0) > CRITICAL:
            return Birth(p.response, first.curve.symmetric, 1 if off > 0.0 else -1, p.stable)
    return None


def _setting_out(parent: Branch, bifurcation: Bifurcation) -> tuple[Branch, Array] | None:
    """The first points of the branch that leaves ``parent`` at a point, from the point itself on,
    and the direction they set out in; None where there are none."""
    curve = parent.curve
    x, value = bifurcation.point.solved.x, bifurcation.value
    doubled = bifurcation.kind is PointKind.DOUBLING
    if bifurcation.kind not in (PointKind.PITCHFORK, PointKind.DOUBLING):
        return None
    n = 2 * curve.n if doubled else curve.n
    if n > MAX_PERIOD:
        return None
    other = Curve.through(curve.family, x, value, n, False)
    border = np.append(_leaving(bifurcation.point.solved.jacobian, other.scale[:-1]), 0.0)
    centre = np.append(x, value)
    for reach in ASIDE:
        solved = other.correct(centre + reach * other.scale * border, border)
        if solved is None or _length(other, solved.y - centre) > NEAR * reach:
            continue  # another branch crosses the hyperplane too
        point = at(other, solved)
        if point is None:
            continue
        if _parting(other, point) < 0.5 * reach:
            continue  # fell back onto the parent
        root = _meeting(other, bifurcation, point)
        points = None if root is None else _led(other, root, point)
        if points is None:
            continue  # no orbit of this branch, or one beyond more than can be told apart
        return Branch(other, points, (End.JOINED, End.STOPPED)), border
    return None


def close(branch: Branch, points: Sequence[Bifurcation]) -> Branch:
    """A branch whose far end joins another, led on to the pitchfork or doubling where it does.

    points : those where it may. Unchanged where none of them lies near.
    """
    if branch.ends[1] is not End.JOINED:
        return branch
    last = branch.points[-1]
    for bifurcation in sorted(points, key=lambda p: abs(p.value - last.value)):
        if abs(bifurcation.value - last.value) > REACH * float(branch.curve.scale[-1]):
            break
        root = _meeting(branch.curve, bifurcation, last)
        if root is not None:
            more = (_led(branch.curve, root, last) or (root, last))[-2::-1]
            return Branch(branch.curve, branch.points + more, branch.ends)
    return branch


def _led(curve: Curve, root: BranchPoint, near: BranchPoint) -> tuple[BranchPoint, ...] | None:
    """From where branches meet to a point of one of them, with all that tells its events apart;
    None where the branch is not seen to lead there."""
    points = linked(curve, root, near)
    if points is None:
        return None
    solved = curve.between(root.solved, points[1].solved, FIRST)
    first = None if solved is None else at(curve, solved)
    if first is not None and _parting(curve, first) < 0.5 * FIRST * _parting(curve, points[1]):
        first = None  # the parent's, where it crosses the hyperplane
    after = points[1:] if first is None else (first, *points[1:])
    chord = (after[0].solved.y - root.solved.y) / curve.scale
    tangent = chord / np.linalg.norm(chord)
    return (replace(root, solved=replace(root.solved, tangent=tangent)), *after)


def _meeting(curve: Curve, bifurcation: Bifurcation, near: BranchPoint) -> BranchPoint | None:
    """The orbit of a bifurcation point as one of a curve that leaves there, or None if ``near``,
    the curve's point next to it, is far from it in all of its periods and their mirror images."""
    flow = curve.family.flow(bifurcation.value)
    n = bifurcation.point.orbit.n
    wanted = n if bifurcation.kind is PointKind.PITCHFORK else 2 * n
    if bifurcation.kind not in (PointKind.PITCHFORK, PointKind.DOUBLING) or wanted != curve.n:
        return None
    laps = list(flow.run(bifurcation.point.solved.x, n).strobes[:-1])
    if flow.system.mirror is not None:
        laps += list(mirrored_strobes(flow, bifurcation.point.orbit))
    x = min(laps, key=lambda lap: float(np.abs((lap - near.solved.x) / curve.scale[:-1]).max()))
    y = np.append(x, bifurcation.value)
    step = (near.solved.y - y) / curve.scale
    length = float(np.linalg.norm(step))
    image = curve.image(x, bifurcation.value)
    if image is None or not 0.0 < length < REACH:
        return None
    residual = float(np.abs((image[0] - x) / curve.scale[:-1]).max())
    return at(curve, Solved(y, image[1], step / length, 0, residual))


def _parting(curve: Curve, point: BranchPoint) -> float:
    return float(np.linalg.norm(apart(curve, point)))


def _length(curve: Curve, step: Array) -> float:
    return float(np.linalg.norm(step / curve.scale))


def _leaving(jacobian: Array, scale: Array) -> Array:
    """(states,) unit eigenvector, in scaled units, of the multiplier nearest to -1.

    Its greatest component is positive: which of two twins is followed is not left to rounding.
    """
    values, vectors = np.linalg.eig(jacobian * scale / scale[:, None])
    vector = vectors[:, np.argmin(np.abs(values + 1.0))].real
    size = float(np.linalg.norm(vector))
    return np.asarray(vector / (size if vector[np.argmax(np.abs(vector))] > 0.0 else -size))
