"""Windows: the intervals of a parameter over which a response is stable, and what ends them."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

from designer.attractor import settle
from designer.bifurcations import Bifurcation, Kind, locate
from designer.continuation import Branch, BranchPoint, End, start, trace
from designer.family import Family
from designer.orbit import Orbit
from designer.survey import Survey

OUTSIDE = 5e-4
"""Of the parameter's size: how far past the end of a window its orbit is let go."""
MEETING = 2e-3
"""Of the parameter: how far from its parent's bifurcation point a branch's last orbit may be."""


@dataclass(frozen=True)
class WindowEnd:
    """An end of a window.

    value, error : of the parameter. why : the bifurcation's kind, or why the branch stops there.
    point : the bifurcation, if it is one. orbit : at the end, or the last one before it.
    """

    value: float
    error: float
    why: str
    point: Bifurcation | None
    orbit: Orbit


@dataclass(frozen=True)
class Window:
    """A stretch of a branch on which a response is stable.

    response : "n-p-q". symmetric : by the branch it lies on. low, high : its ends. branch : the
    number of the branch.
    """

    parameter: str
    response: str
    symmetric: bool
    low: WindowEnd
    high: WindowEnd
    branch: int

    @property
    def width(self) -> float:
        return self.high.value - self.low.value

    def as_dict(self) -> dict[str, object]:
        """Plain, for JSON."""
        return {
            "response": self.response,
            "symmetric": self.symmetric,
            "from": self.low.value,
            "to": self.high.value,
            "from_error": self.low.error,
            "to_error": self.high.error,
            "from_kind": self.low.why,
            "to_kind": self.high.why,
            "branch": self.branch,
        }


def windows(branch: Branch, points: Sequence[Bifurcation], number: int = 0) -> list[Window]:
    """The windows on a branch, in its order.

    points : the branch's bifurcation points (``bifurcations.locate``). A stretch between two of
    them that holds no point of the branch is too short to be judged, and is left out.
    """
    out = []
    ends = [None, *sorted(points, key=lambda p: p.position), None]
    for before, after in itertools.pairwise(ends):
        first = 0 if before is None else int(before.position) + 1
        last = len(branch.points) - 1 if after is None else int(after.position)
        inside = branch.points[first : last + 1]
        if not inside or not all(p.stable for p in inside):
            continue
        a = _end(branch, before, branch.points[0], 0)
        b = _end(branch, after, branch.points[-1], 1)
        low, high = (a, b) if a.value <= b.value else (b, a)
        symmetric = branch.curve.symmetric
        out.append(Window(branch.parameter, inside[0].response, symmetric, low, high, number))
    return out


def all_windows(found: Survey) -> list[Window]:
    """The windows on every branch; one that reaches to the parent branch ends at its point."""
    out: list[Window] = []
    for number, branch in enumerate(found.branches):
        above = found.parents[number]
        meetings = [] if above < 0 else _meetings(branch, found.branches[above], found.on(above))
        out += [
            replace(w, low=_met(w.low, meetings), high=_met(w.high, meetings))
            for w in windows(branch, found.on(number), number)
        ]
    return sorted(out, key=lambda w: w.low.value)


def _meetings(branch: Branch, parent: Branch, points: Sequence[Bifurcation]) -> list[Bifurcation]:
    """Where branches of this one's period may leave the parent."""
    kind = Kind.PITCHFORK if branch.curve.n == parent.curve.n else Kind.DOUBLING
    return [p for p in points if p.kind is kind]


def _met(end: WindowEnd, meetings: Sequence[Bifurcation]) -> WindowEnd:
    """The parent's bifurcation point, for an end where a branch joins its parent."""
    if end.why != End.JOINED:
        return end
    for p in sorted(meetings, key=lambda p: abs(p.value - end.value)):
        if abs(p.value - end.value) < MEETING * abs(p.value):
            return WindowEnd(p.value, p.error, str(p.kind), p, p.point.orbit)
        break
    return end


def window(family: Family, orbit: Orbit, value: float, low: float, high: float) -> Window:
    """The window of a stable orbit that is known at a value, within [low, high].

    Raises
    ------
    ArithmeticError : there is no such orbit, or it is not stable.
    """
    origin = start(family, orbit, value)
    counts = origin.points[0].counts

    def over(p: BranchPoint) -> bool:
        return not p.stable or p.counts != counts

    branch = trace(origin, low, high, until=over)
    for found in windows(branch, locate(branch)):
        if found.low.value <= value <= found.high.value:
            return found
    raise ArithmeticError(f"{orbit.response} at {family.parameter} = {value:g} is not stable")


def outside(family: Family, end: WindowEnd, direction: float) -> tuple[float, Orbit]:
    """What the orbit at a window's end settles to just past it, and at which value.

    direction : 1 past the upper end, -1 past the lower.
    """
    size = abs(end.value) if end.value else 1.0
    value = end.value + direction * OUTSIDE * size
    return value, settle(family.flow(value), end.orbit.start)


def _end(branch: Branch, where: Bifurcation | None, point: BranchPoint, side: int) -> WindowEnd:
    if where is None:
        return WindowEnd(point.value, 0.0, str(branch.ends[side]), None, point.orbit)
    return WindowEnd(where.value, where.error, str(where.kind), where, where.point.orbit)
