"""Branches of periodic orbits over a parameter, stable and unstable.

A branch is followed by arclength (``bifurcations.orbit_curve``), so it goes round folds and on past
the point where it loses stability. The flow of a soft stop is continuously differentiable, but its
second derivative is not bounded at grazing: just past a first touch the multipliers change with the
square root of the penetration, and by the stop's stiffness. So the steps follow the multipliers
too, and where the counts of impacts change the branch is halved down to the grazing point from both
sides. Grazing does not end a branch: the orbit goes on with other counts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from designer.base.arrays import Array
from designer.bifurcations.flow_family import Family
from designer.bifurcations.loop_check import images, place
from designer.bifurcations.orbit_curve import Curve, Solved
from designer.dynamics.attractors import describe
from designer.dynamics.counts import Counts
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.turning_points import corner_crossings

FIRST, LEAST, GREATEST = 5e-3, 1e-9, 5e-2
"""Arclength of the first, the shortest and the longest step, in scaled units. Past a grazing point
the tangent changes with the square root of the penetration: beside a fold it may turn within 1e-7.
"""
TURN = 0.97
"""Cosine of the most that the tangent may turn in one step."""
JUMP = 0.15
"""Most that ln(1 + |multiplier|) of the leading multiplier may change in one step."""
KINK = 1e-6
"""Longest step over a kink: a damper begins or ceases to act in contact at the strobe itself."""
NEAREST = 1e-9
"""Arclength to which a grazing point is closed in on."""
FINEST = 2e-5
"""Arclength below which a jump of the multipliers is left as it is."""
CLOSE = 1e-3
"""Arclength from a branch's last point, at most, to where it joins its parent."""
SAME = 1e-7
"""Of the peak: an orbit no farther than this from its mirror image is symmetric."""
LOOP = 1.1
"""Of a step: the way by a point that lies on it, not aside."""
POINTS = 4000
"""Most steps of one branch in one direction."""


class End(StrEnum):
    """Why a branch stops."""

    LIMIT = "limit of the parameter"
    LOST = "no convergence"
    JOINED = "joins its parent branch"
    CLOSED = "closes on itself"
    POINTS = "most points"
    STOPPED = "as asked"


@dataclass(frozen=True)
class BranchPoint:
    """An orbit on a branch."""

    value: float
    orbit: Orbit
    solved: Solved
    """Where on its curve it lies."""
    crossings: tuple[int, ...] = ()
    """As of ``turning_points.corner_crossings``."""

    @property
    def stable(self) -> bool:
        """All multipliers lie inside the unit circle."""
        return self.orbit.radius < 1.0

    @property
    def counts(self) -> Counts:
        """Known at a grazing point too."""
        return self.orbit.counts

    @property
    def response(self) -> str:
        """ "n-p-q"."""
        return str(self.counts)


@dataclass(frozen=True)
class Branch:
    """Orbits that go over into one another, in order of arclength."""

    curve: Curve
    """The curve that the orbits lie on."""
    points: tuple[BranchPoint, ...]
    """The orbits, at least one."""
    ends: tuple[End, End]
    """Why the branch stops at its first and at its last point."""

    @property
    def parameter(self) -> str:
        return self.curve.family.parameter

    @property
    def values(self) -> Array:
        """(points,) of the parameter."""
        return np.array([p.value for p in self.points])

    def reversed(self) -> Branch:
        """The same branch the other way round."""
        return Branch(self.curve, self.points[::-1], (self.ends[1], self.ends[0]))


def start(family: Family, orbit: Orbit, value: float, *, symmetric: bool | None = None) -> Branch:
    """The branch of a single point: an orbit known at a value, solved for anew.

    symmetric : follow by the half-period map; None: if the orbit solved for is symmetric.

    Raises
    ------
    ArithmeticError : no orbit is found there.
    """
    curve = Curve.through(family, orbit.start, value, orbit.n, bool(symmetric))
    solved = curve.near(orbit.start, value)
    point = None if solved is None else at(curve, solved)
    alike = point is not None and orbit.n % 2 == 1 and point.orbit.asymmetry < SAME
    if symmetric is None and point is not None and alike and family.mirrored(value):
        return start(family, point.orbit, value, symmetric=True)
    if point is None:
        raise ArithmeticError(f"no {orbit.response} orbit at {family.parameter} = {value:g}")
    return Branch(curve, (point,), (End.STOPPED, End.STOPPED))


def at(curve: Curve, solved: Solved) -> BranchPoint | None:
    """The orbit at a solved point, or None where it does not close."""
    flow = curve.family.flow(solved.value)
    orbit = describe(flow, solved.x, curve.n, curve.monodromy(solved), laps=1)
    if orbit.status is OrbitStatus.NOT_SETTLED:
        return None
    crossings = corner_crossings(flow, orbit) if flow.system.corners else ()
    return BranchPoint(solved.value, orbit, solved, crossings)


def trace(
    origin: Branch,
    low: float,
    high: float,
    *,
    until: Callable[[BranchPoint], bool] = lambda _: False,
) -> Branch:
    """A branch followed from its only or its first point, both ways, once round where it is a loop;
    see ``follow``."""
    up = follow(origin, low, high, 1.0, until=until)
    if up.ends[1] is End.CLOSED:
        return Branch(up.curve, up.points, (End.CLOSED, End.CLOSED))
    down = follow(origin, low, high, -1.0, until=until)
    return Branch(up.curve, down.points[:0:-1] + up.points, (down.ends[1], up.ends[1]))


def follow(
    origin: Branch,
    low: float,
    high: float,
    direction: float,
    *,
    until: Callable[[BranchPoint], bool] = lambda _: False,
    border: Array | None = None,
) -> Branch:
    """The branch from the first point of ``origin`` on, until it ends; it starts with that point.

    low, high : values of the parameter that it does not leave; its last point lies on them where
    they end it. direction : 1 towards greater values at first, -1 towards less. until : stop after
    the first point for which this is true. border : (states + 1,) direction to set out in, instead.
    """
    curve, first = origin.curve, origin.points[0]
    tangent = first.solved.tangent
    toward = np.zeros(len(tangent)) if border is None else border
    if border is None:
        toward[-1] = direction
    tangent = tangent if tangent @ toward >= 0.0 else -tangent
    points, step = [first], FIRST
    away = parted(curve, first)  # else Newton's method may fall onto the parent near its end
    end = End.POINTS
    while len(points) < POINTS:
        current = points[-1]
        if current.value == (high if tangent[-1] > 0.0 else low):
            end = End.LIMIT
            break
        new, solved = None, _step(curve, current.solved, tangent, step)
        if solved is not None and not low <= solved.value <= high:
            edge = low if solved.value < low else high
            last = _onto(curve, current.solved, solved, edge)
            point = None if last is None else at(curve, last)
            inner = None if point is None else _between(curve, current, point)
            if point is not None and inner is not None:
                points += [*inner, point]
                end = End.LIMIT
                break
            solved = None
        if solved is not None:
            new = at(curve, solved)
        fallen = new is not None and away and not parted(curve, new)
        if new is None or solved is None or fallen:
            step *= 0.5
            if step < LEAST:
                end = End.JOINED if fallen else End.LOST
                break
            continue
        if joined(curve, current, new):
            step *= 0.5
            if step < CLOSE:
                end = End.JOINED
                break
            continue
        inner = _between(curve, current, new)
        back = inner is not None and _retraces(curve, points, new)
        if back and (closing := _closing(curve, points, new)):
            points += closing
            end = End.CLOSED
            break
        if inner is None or back:  # nothing shows that it leads there, or it turns back
            step *= 0.5
            if step < LEAST:
                end = End.LOST
                break
            continue
        points += [*inner, new]
        if until(new):
            end = End.STOPPED
            break
        change = abs(_size(current) - _size(new))
        turned = float(tangent @ solved.tangent)
        tangent = solved.tangent
        if solved.iterations <= 3 and change < 0.5 * JUMP and turned > 0.995:
            step = min(1.5 * step, GREATEST)
        elif solved.iterations > 5 or change > JUMP:
            step = max(0.5 * step, FIRST * 0.1)
    return Branch(curve, tuple(points), (End.STOPPED, end))


def _retraces(curve: Curve, points: list[BranchPoint], new: BranchPoint) -> bool:
    """Whether a branch goes on along itself."""
    return place(curve, [p.solved for p in points], images(curve, new.solved)) is not None


def _closing(curve: Curve, points: list[BranchPoint], new: BranchPoint) -> list[BranchPoint]:
    """The points that lead from a branch's last point to its first, on the way to ``new``; none
    where the branch did not come back to its first point."""
    current = points[-1]
    step = curve.distance(current.solved, new.solved)

    def way(y: Array) -> float:
        """The length of the way by y from the last point to the new one."""
        ends = (current.solved.y, new.solved.y)
        return float(sum(np.linalg.norm((end - y) / curve.scale) for end in ends))

    y = min(images(curve, points[0].solved), key=way)
    border = (new.solved.y - current.solved.y) / curve.scale / step
    solved = curve.correct(y, border) if way(y) < LOOP * step else None
    last = None if solved is None else at(curve, solved)
    return [] if last is None else [*(_between(curve, current, last) or ()), last]


def _step(curve: Curve, current: Solved, tangent: Array, step: float) -> Solved | None:
    """A step along the tangent, if it ends where it aimed at and the curve did not turn much."""
    guess = current.y + step * curve.scale * tangent
    solved = curve.correct(guess, tangent)
    if solved is None:
        return None
    off = float(np.linalg.norm((solved.y - guess) / curve.scale))
    if step < KINK and not curve.family.flow(current.value).system.continuous:
        return solved if off < 2.0 * step and tangent @ solved.tangent > 0.0 else None
    return solved if off < 0.5 * step and tangent @ solved.tangent > TURN else None


def _onto(curve: Curve, current: Solved, past: Solved, value: float) -> Solved | None:
    """The point of the branch at a value between two points."""
    share = (value - current.value) / (past.value - current.value)
    guess = current.y + share * (past.y - current.y)
    solved = curve.near(guess[:-1], value, 1.0 if past.value > current.value else -1.0)
    if solved is None or curve.distance(current, solved) > 2.0 * curve.distance(current, past):
        return None
    return solved


def _size(point: BranchPoint) -> float:
    return float(np.log1p(point.orbit.radius))


def _between(curve: Curve, a: BranchPoint, b: BranchPoint) -> list[BranchPoint] | None:
    """Points between two, down to where no count changes and no multiplier jumps from one to the
    next, or they lie too close to be told apart.

    None where the curve does not lead from one to the other: the second is another branch's.
    """
    out: list[BranchPoint] = []
    stack = [(a, b)]
    while stack:
        a, b = stack.pop()
        length = curve.distance(a.solved, b.solved)
        counts = (a.counts, a.crossings) != (b.counts, b.crossings) and length > NEAREST
        jump = abs(_size(a) - _size(b)) > JUMP and length > FINEST
        middle = None
        if counts or jump:
            solved = curve.between(a.solved, b.solved, 0.5)
            middle = None if solved is None else at(curve, solved)
        if middle is not None:
            stack += [(middle, b), (a, middle)]
        elif (counts or jump) and length > FINEST:
            return None
        else:
            out.append(b)
    return out[:-1]


def linked(curve: Curve, a: BranchPoint, b: BranchPoint) -> tuple[BranchPoint, ...] | None:
    """Two neighbouring points of a branch and those between them that tell its events apart, or
    None where the branch does not lead from one to the other."""
    inner = _between(curve, a, b)
    return None if inner is None else (a, *inner, b)


def apart(curve: Curve, point: BranchPoint) -> Array:
    """(states,) scaled: from the orbit to its partner, which it meets where it left its parent.

    The partner is half the orbit later: mirrored for odd n (its twin), as it is for even n.
    """
    flow, n = curve.family.flow(point.value), curve.n
    run = flow.run(point.solved.x, n, points=2, stretches=n)
    partner = run.strobes[-1]
    if n % 2:
        if flow.system.mirror is None:
            return np.zeros(len(partner))
        partner = flow.system.mirror @ partner
    return np.asarray((partner - point.solved.x) / curve.scale[:-1])


def parted(curve: Curve, point: BranchPoint) -> bool:
    """Whether an orbit and its partner are two, or it has none: odd n without a mirror."""
    if curve.symmetric:
        return False
    alone = curve.n % 2 == 1 and curve.family.flow(point.value).system.mirror is None
    return alone or bool(np.abs(apart(curve, point)).max() > SAME)


def joined(curve: Curve, a: BranchPoint, b: BranchPoint) -> bool:
    """Whether an orbit and its partner changed places between two points."""
    if curve.symmetric:
        return False
    one, other = apart(curve, a), apart(curve, b)
    return bool(one @ other < 0.0 and min(np.abs(one).max(), np.abs(other).max()) > SAME)
