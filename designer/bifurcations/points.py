"""Bifurcation points on a branch of periodic orbits, located to 1e-8 of the parameter or better.

Each kind has a test function of the orbit that changes sign where it happens; between two points of
a branch with different signs the root is found by Brent's method along the branch, every value of
it on a converged orbit.

- fold: the branch turns back, dλ/ds = 0 (a multiplier +1).
- pitchfork: the half-period map of a symmetric orbit has the multiplier -1. Its square is +1 in
  the whole period, and its eigenvector changes sign under the mirror half a period later: that is
  what leaves the symmetric orbits. (Half-period multiplier +1: a fold among symmetric orbits. A
  period doubling of one would need ±i, a pair: Swift and Wiesenfeld, Phys. Rev. Lett. 52, 1984.)
- period doubling: a multiplier -1.
- torus: a pair of complex multipliers crosses the unit circle.
- grazing: a turning point of a displacement lies on a stop (``dynamics.turning_points``): in a
  clearance whose counts of impacts change.
- corner: a turning point lies on a corner of a force (of a law, a friction, a preload that has
  risen), which it passes more or less often from there on. The multipliers change beyond it as
  beyond a grazing; the counts stay.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import brentq

from designer.bifurcations.continuation import Branch, BranchPoint, End, at, joined, parted
from designer.bifurcations.orbit_curve import CONVERGED, Curve
from designer.dynamics.counts import read_counts
from designer.dynamics.orbit import SYMMETRY_TOLERANCE
from designer.dynamics.turning_points import heights, turning_points_of

if TYPE_CHECKING:
    from designer.answers.bifurcation_answer import BirthRow, PointRow

ROUNDING = 1e-11
"""Of the parameter's size: no error is stated below it. Where an orbit stalled before
``orbit_curve.CONVERGED`` of its peak, as many times more."""
ZERO = 1e-3
"""A test function that is more than this at its root, over its values on either side, jumped."""
TOUCHED = 1e-6
"""Of the orbit's peak: how far from a stop it turns, at most, whose branch was lost by grazing."""


class PointKind(StrEnum):
    """What happens at a bifurcation point."""

    PITCHFORK = "pitchfork"
    DOUBLING = "period-doubling"
    FOLD = "fold"
    GRAZING = "grazing"
    TORUS = "torus"
    CORNER = "corner"


TOUCHES = (PointKind.GRAZING, PointKind.CORNER)
"""At which a turning point lies on a border of the equations."""


@dataclass(frozen=True)
class Birth:
    """The orbits that leave a branch at a point: twins at a pitchfork, doubled at a doubling."""

    response: str
    """Response of one of them, as "n-p-q"."""
    symmetric: bool
    """Whether one of them is its own mirror image."""
    side: int
    """1 where they lie above the point's value of the parameter, -1 below."""
    stable: bool
    """Whether they are stable there."""

    def as_dict(self) -> BirthRow:
        """Plain, for JSON."""
        return {
            "response": self.response,
            "symmetric": self.symmetric,
            "side": SIDES[self.side],
            "stable": self.stable,
        }


SIDES = {1: "above", -1: "below"}
"""The words for the sides of a value of the parameter."""


@dataclass(frozen=True)
class Bifurcation:
    """A bifurcation point."""

    parameter: str
    value: float
    """Value of the parameter at the point."""
    kind: PointKind
    error: float
    """Half the width of an interval of the parameter that was seen to hold the point: the test
    function has different signs (for grazing: the counts of impacts differ) at its ends."""
    point: BranchPoint
    """The orbit there."""
    before: str
    """The branch's response right before it, in the branch's own order; "" where it begins."""
    after: str
    """The branch's response right after it, in the branch's own order; "" where it ends."""
    stable: tuple[bool, bool]
    """Whether the branch is stable right before and right after it."""
    direction: int
    """1 where the parameter rises along the branch, -1 where it falls, 0 at a fold."""
    position: float
    """Where along the branch: the whole part is the number of the point before it."""
    branch: int = 0
    """Number of the branch among those it was found with."""
    side: int = 0
    """Side of a fold, 1 where its orbits lie above the value, -1 below; else 0."""
    symmetric: bool = False
    """Whether the orbit is symmetric (without an exact mirror: to ``orbit.SYMMETRY_TOLERANCE``)."""
    born: Birth | None = None
    """What leaves the branch here, where that was looked for (``branch_switch.birth``)."""
    stops: str = ""
    """The stops that are grazed, "the upper stop of A" or "both stops of A", where there are more
    clearances than one; of a corner "NAME at X"."""

    @property
    def response(self) -> str:
        """ "n-p-q" of the orbit at the point; of a grazing one, on the branch's first side."""
        same = self.before == self.after or self.kind is PointKind.GRAZING
        return self.before or self.after if same else self.point.response

    @property
    def stable_sides(self) -> dict[int, bool] | None:
        """Whether the branch is stable above (1) and below (-1); None at a fold, on one side."""
        if not self.direction:
            return None
        return {self.direction: self.stable[1], -self.direction: self.stable[0]}

    def as_dict(self) -> PointRow:
        """Plain, for JSON."""
        row: PointRow = {
            "parameter": self.parameter,
            "kind": str(self.kind),
            "value": self.value,
            "error": self.error,
            "before": self.before,
            "after": self.after,
            "stable_before": self.stable[0],
            "stable_after": self.stable[1],
            "direction": self.direction,
            "branch": self.branch,
            "response": self.response,
            "symmetric": self.symmetric,
            "stable_above": None if self.stable_sides is None else self.stable_sides[1],
            "stable_below": None if self.stable_sides is None else self.stable_sides[-1],
            "side": SIDES.get(self.side),
            "born": None if self.born is None else self.born.as_dict(),
        }
        if self.stops:
            row["stops"] = self.stops
        return row


def locate(branch: Branch, number: int = 0) -> list[Bifurcation]:
    """Every bifurcation point on a branch, in its order. number : the branch's number, from 0.

    Of two bifurcations of one kind between two neighbouring points neither is found.
    """
    points = []
    for index, (a, b) in enumerate(zip(branch.points, branch.points[1:], strict=False)):
        for kind, test in _tests(branch.curve, a, b):
            located = _locate(branch.curve, a, b, kind, test, index, number)
            if located is not None:
                points.append(located)
    points.sort(key=lambda p: p.position)
    within = [_with_sides(branch, point, points) for point in points]
    first, last = (_touched_at_end(branch, side, number) for side in (0, 1))
    return [point for point in (first, *within, last) if point is not None]


def _touched_at_end(branch: Branch, side: int, number: int) -> Bifurcation | None:
    """The grazing at which a branch was lost, where it was: if the force of a stop jumps, the map
    has a square root there, and orbits of the period need not go on.

    side : 0 for its beginning, 1 for its end.
    """
    if branch.ends[side] is not End.LOST or len(branch.points) < 2:
        return None
    point, inner = branch.points[-side], branch.points[1 - 3 * side]
    flow = branch.curve.family.flow(point.value)
    turning = [] if flow.system.continuous else turning_points_of(flow, point.orbit)
    nearest = min(turning, key=lambda t: abs(t.height), default=None)
    peak = float(np.abs(branch.curve.scale[:-1]).max())
    if nearest is None or abs(nearest.height) > TOUCHED * peak:
        return None
    way, gap = point.value - inner.value, _gap(branch.curve, {nearest.clearance})
    # From the contact's side the way to the stop is that of the square root of the depth.
    power = 0.5 if nearest.height > 0.0 else 1.0
    left, before = (abs(gap(each)) ** power for each in (point, inner))
    error = abs(way * left / (before - left)) if before != left else abs(way)
    shares = (point.stable, False) if side else (False, point.stable)
    stop = f"the {'upper' if nearest.side > 0 else 'lower'} stop of "
    stop += flow.system.clearances[nearest.clearance]
    return Bifurcation(
        parameter=branch.parameter,
        value=point.value,
        kind=PointKind.GRAZING,
        error=max(error, ROUNDING * float(branch.curve.scale[-1])),
        point=point,
        before=point.response if side else "",
        after="" if side else point.response,
        stable=shares,
        direction=int(np.sign(way)) * (1 if side else -1),
        position=float(len(branch.points) - 1) if side else -1.0,
        branch=number,
        symmetric=_symmetric(branch.curve, point),
        stops=stop if len(flow.system.clearances) > 1 else "",
    )


def _with_sides(branch: Branch, point: Bifurcation, every: list[Bifurcation]) -> Bifurcation:
    """A point with the branch's responses and stability right beside it.

    Those are the neighbouring points' of the branch, unless something else happens before them, or
    they are where the branch meets another and their multipliers tell nothing.
    """
    index = int(point.position)
    ends = branch.points[index], branch.points[index + 1]
    neighbours = []
    for k, end in enumerate(ends):
        others = [
            p.position
            for p in every
            if int(p.position) == index and (p.position - point.position) * (k - 0.5) > 0.0
        ]
        meets = branch.ends[k] is End.JOINED and index + k == k * (len(branch.points) - 1)
        neighbour = None
        if others or meets:
            edge = min(others, key=lambda s: abs(s - point.position), default=float(index + k))
            share = 0.5 * (edge + point.position) - index
            solved = branch.curve.between(ends[0].solved, ends[1].solved, share)
            neighbour = None if solved is None else at(branch.curve, solved)
        neighbours.append(end if neighbour is None else neighbour)
    a, b = neighbours
    return replace(point, before=a.response, after=b.response, stable=(a.stable, b.stable))


Test = Callable[[BranchPoint], float]


def _tests(curve: Curve, a: BranchPoint, b: BranchPoint) -> list[tuple[PointKind, Test]]:
    """The test functions that change sign between two points of a branch."""
    if joined(curve, a, b):
        return []  # the branch joined its parent: that is where the point is located
    chord = (b.solved.y - a.solved.y) / curve.scale
    eye = np.eye(len(chord) - 1)

    def fold(p: BranchPoint) -> float:
        tangent = p.solved.tangent
        return float(tangent[-1] if tangent @ chord > 0.0 else -tangent[-1])

    def flip(p: BranchPoint) -> float:
        return float(np.linalg.det(eye + p.solved.jacobian))

    flips = PointKind.PITCHFORK if curve.symmetric else PointKind.DOUBLING
    tests: list[tuple[PointKind, Test]] = [(PointKind.FOLD, fold), (flips, flip)]
    if _pair(a) * _pair(b) < 0.0:
        tests.append((PointKind.TORUS, _pair))
    out = [(kind, test) for kind, test in tests if test(a) * test(b) < 0.0]
    if not curve.symmetric and not (parted(curve, a) and parted(curve, b)):
        # Where it leaves its parent λ turns: that is no fold, and rounding decides the sign.
        out = [(kind, test) for kind, test in out if kind is not PointKind.FOLD]
    if a.counts != b.counts:
        out.append((PointKind.GRAZING, _gap(curve, {k for k, _ in _changed(a, b)})))
    if corners := _corners(a, b):
        first = len(curve.family.flow(a.value).system.clearances)
        out.append((PointKind.CORNER, _gap(curve, {first + k for k in corners})))
    return out


def _corners(a: BranchPoint, b: BranchPoint) -> list[int]:
    """Numbers of the corners that are not passed as often at both; none where a law has another
    number of them."""
    if len(a.crossings) != len(b.crossings):
        return []
    pairs = enumerate(zip(a.crossings, b.crossings, strict=True))
    return [k for k, (before, after) in pairs if before != after]


def _pair(p: BranchPoint) -> float:
    """ln of the greatest modulus of a complex multiplier; 0 without one: no change of sign."""
    multipliers = p.orbit.multipliers
    pairs = multipliers[np.abs(multipliers.imag) > 1e-9 * np.abs(multipliers)]
    return float(np.log(np.abs(pairs).max())) if len(pairs) else 0.0


def _changed(a: BranchPoint, b: BranchPoint) -> list[tuple[int, int]]:
    """(clearance, 0 upper or 1 lower) of each stop on which the counts of impacts differ."""
    pairs = enumerate(zip(a.counts.impacts, b.counts.impacts, strict=True))
    return [(k, i) for k, both in pairs for i in (0, 1) if both[0][i] != both[1][i]]


def _stops(curve: Curve, a: BranchPoint, b: BranchPoint, kind: PointKind) -> str:
    """``Bifurcation.stops`` of what happens between two points."""
    system = curve.family.flow(a.value).system
    if kind is PointKind.CORNER:
        touched = (str(system.corners[k].corner) for k in _corners(a, b))
        return " and ".join(dict.fromkeys(touched))  # on a board two stages may share one
    names = system.clearances
    changed = _changed(a, b)
    words = []
    for k in sorted({k for k, _ in changed}):
        sides = [("upper", "lower")[i] for j, i in changed if j == k]
        stops = f"the {sides[0]} stop" if len(sides) == 1 else "both stops"
        words.append(f"{stops} of {names[k]}")
    return " and ".join(words) if len(names) > 1 else ""


def _gap(curve: Curve, clearances: set[int]) -> Test:
    """Signed distance to its stop of the turning point that lies nearest to one."""

    def gap(p: BranchPoint) -> float:
        distances = heights(curve.family.flow(p.value), p.orbit, sorted(clearances))
        return float(distances[np.argmin(np.abs(distances))])

    return gap


def _locate(
    curve: Curve,
    a: BranchPoint,
    b: BranchPoint,
    kind: PointKind,
    test: Test,
    index: int,
    number: int,
) -> Bifurcation | None:
    """The root of a test function between two points of a branch; None where orbits fail."""
    evaluated: dict[float, BranchPoint] = {0.0: a, 1.0: b}

    def point(s: float) -> BranchPoint:
        if s not in evaluated:
            solved = curve.between(a.solved, b.solved, s)
            branch_point = None if solved is None else at(curve, solved)
            if branch_point is None:
                raise ArithmeticError(f"no orbit at {s} between two points")
            evaluated[s] = branch_point
        return evaluated[s]

    def on_first_side(p: BranchPoint) -> bool:
        """Whether a point lies on a's side."""
        if kind is PointKind.CORNER:
            return p.crossings == a.crossings
        return p.counts == a.counts if kind is PointKind.GRAZING else test(p) * test(a) > 0.0

    try:
        if test(a) * test(b) < 0.0:
            root = float(brentq(lambda s: test(point(s)), 0.0, 1.0, xtol=1e-15, rtol=1e-14))
        elif kind in TOUCHES:
            root = _bisect(lambda s: on_first_side(point(s)))
        else:
            return None
        middle = point(root)
        if kind not in TOUCHES and abs(test(middle)) > ZERO * max(abs(test(a)), abs(test(b))):
            return None  # a jump over zero: two complex multipliers that became real
        stalled = max(1.0, middle.solved.residual / CONVERGED)
        error = _width(point, on_first_side, root, stalled * ROUNDING * float(curve.scale[-1]))
    except ArithmeticError:
        return None
    return Bifurcation(
        parameter=curve.family.parameter,
        value=middle.value,
        kind=kind,
        error=error,
        point=middle,
        before=a.response,
        after=b.response,
        stable=(a.stable, b.stable),
        direction=0 if kind is PointKind.FOLD else int(np.sign(b.value - a.value)),
        position=index + root,
        branch=number,
        side=int(np.sign(a.value + b.value - 2.0 * middle.value)) if kind is PointKind.FOLD else 0,
        symmetric=_symmetric(curve, middle),
        stops=_stops(curve, a, b, kind) if kind in TOUCHES else "",
    )


def _symmetric(curve: Curve, p: BranchPoint) -> bool:
    """Whether an orbit is symmetric: by its branch, or by the tolerance without a mirror."""
    if curve.family.flow(p.value).system.mirror is not None:
        return curve.symmetric
    counts = read_counts(p.response)
    alike = counts is not None and counts.symmetric
    return alike and curve.n % 2 == 1 and p.orbit.asymmetry < SYMMETRY_TOLERANCE


def _bisect(left: Callable[[float], bool]) -> float:
    low, high = 0.0, 1.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        if left(middle):
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def _width(
    point: Callable[[float], BranchPoint],
    left: Callable[[BranchPoint], bool],
    root: float,
    least: float,
) -> float:
    """Half the width in the parameter of the least bracket around the root that is seen as one, or
    ``least`` if that is more."""
    reach = 1e-12
    while reach < 1.0:
        low, high = max(root - reach, 0.0), min(root + reach, 1.0)
        before, after = point(low), point(high)
        if left(before) and not left(after):
            ends = [before.value, after.value, point(root).value]
            return max(0.5 * (max(ends) - min(ends)), least)
        reach *= 8.0
    return 0.5 * abs(point(1.0).value - point(0.0).value)
