"""Windows: the intervals of a parameter over which a response is stable, and what ends them."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from designer.bifurcations.branch_survey import Survey
from designer.bifurcations.continuation import Branch, BranchPoint, End, start, trace
from designer.bifurcations.flow_family import Family
from designer.bifurcations.points import Bifurcation, PointKind, locate
from designer.dynamics.attractors import settle
from designer.dynamics.counts import Counts
from designer.dynamics.orbit import Orbit

OUTSIDE = 5e-4
"""Of the parameter's size: how far past the end of a window its orbit is let go."""
NOT_LOCATED = "not located"
"""Why a window ends between two points of a branch where no bifurcation point was located."""


@dataclass(frozen=True)
class WindowEnd:
    """An end of a window."""

    value: float
    error: float
    """Half the width of the interval of the parameter that holds the end."""
    why: str
    """The bifurcation's kind, or why the branch stops there."""
    point: Bifurcation | None
    """The bifurcation, if it is one."""
    orbit: Orbit
    """The orbit at the end, or the last one before it."""


@dataclass(frozen=True)
class BranchWindow:
    """A stretch of a branch on which a response is stable."""

    parameter: str
    response: str
    """The response that is stable, as "n-p-q"."""
    symmetric: bool
    """Whether the response is its own mirror image, by the branch it lies on."""
    low: WindowEnd
    high: WindowEnd
    branch: int
    span: tuple[int, int] = (0, -1)
    """The numbers of its first and of its last point on the branch."""

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


def windows(branch: Branch, points: Sequence[Bifurcation], number: int = 0) -> list[BranchWindow]:
    """The windows on a branch, in its order.

    points : the branch's bifurcation points (``points.locate``). A stretch between two of
    them that holds no point of the branch is too short to be judged, and is left out. Where
    stability or the counts change within a stretch, the window ends there as ``NOT_LOCATED``.
    """
    out = []
    # Where branches meet a multiplier is 1 but for rounding: that orbit judges nothing.
    meets = [int(end is End.JOINED) for end in branch.ends]
    # A corner of a law ends no response.
    ended = [p for p in points if p.kind is not PointKind.CORNER]
    ends = [None, *sorted(ended, key=lambda p: p.position), None]
    for before, after in itertools.pairwise(ends):
        first = meets[0] if before is None else int(before.position) + 1
        last = len(branch.points) - 1 - meets[1] if after is None else int(after.position)
        for i, j in _alike(branch, first, last):
            if not branch.points[i].stable:
                continue
            a = _end(branch, before, 0) if i == first else _unlocated(branch, i - 1, i)
            b = _end(branch, after, 1) if j == last else _unlocated(branch, j + 1, j)
            low, high = (a, b) if a.value <= b.value else (b, a)
            response, symmetric = branch.points[j].response, branch.curve.symmetric
            between = (low, high, number, (i, j))
            out.append(BranchWindow(branch.parameter, response, symmetric, *between))
    return out


def _alike(branch: Branch, first: int, last: int) -> list[tuple[int, int]]:
    """First and last number of each run of points that agree in stability and counts."""

    def key(i: int) -> tuple[bool, Counts]:
        return branch.points[i].stable, branch.points[i].counts

    runs = [list(run) for _, run in itertools.groupby(range(first, last + 1), key)]
    return [(run[0], run[-1]) for run in runs]


def all_windows(survey: Survey) -> list[BranchWindow]:
    """The windows on every branch; one that reaches to the parent branch ends at its point."""
    out: list[BranchWindow] = []
    points = survey.points
    for number, branch in enumerate(survey.branches):
        out += [
            replace(w, low=_on_junction(w.low, points), high=_on_junction(w.high, points))
            for w in windows(branch, survey.on(number), number)
        ]
    return sorted(out, key=lambda w: w.low.value)


def _on_junction(end: WindowEnd, points: Sequence[Bifurcation]) -> WindowEnd:
    """The bifurcation point that a branch was led on to where it joins another."""
    if end.why != End.JOINED:
        return end
    for p in points:
        if p.value == end.value and p.kind in (PointKind.PITCHFORK, PointKind.DOUBLING):
            return WindowEnd(p.value, p.error, str(p.kind), p, p.point.orbit)
    return end


def window(
    family: Family,
    orbit: Orbit,
    value: float,
    low: float,
    high: float,
    *,
    progress: Callable[[], None] = lambda: None,
) -> BranchWindow:
    """The window of a stable orbit that is known at a value, within [low, high].

    progress : called once a point of the branch.

    Raises
    ------
    ArithmeticError : there is no such orbit, or it is not stable.
    """
    origin = start(family, orbit, value)
    counts = origin.points[0].counts

    def over(p: BranchPoint) -> bool:
        progress()
        return not p.stable or p.counts != counts

    branch = trace(origin, low, high, until=over)
    for candidate in windows(branch, locate(branch)):
        if candidate.low.value <= value <= candidate.high.value:
            return candidate
    raise ArithmeticError(f"{orbit.response} at {family.parameter} = {value:g} is not stable")


def outside(family: Family, end: WindowEnd, direction: float) -> tuple[float, Orbit]:
    """What the orbit at a window's end settles to just past it, and at which value.

    direction : 1 past the upper end, -1 past the lower.
    """
    size = abs(end.value) if end.value else 1.0
    value = end.value + direction * OUTSIDE * size
    return value, settle(family.flow(value), end.orbit.start)


def _unlocated(branch: Branch, outer: int, inner: int) -> WindowEnd:
    """The end between two neighbouring points, the second of which still belongs to the window."""
    a, b = branch.points[outer], branch.points[inner]
    half = 0.5 * abs(a.value - b.value)
    return WindowEnd(0.5 * (a.value + b.value), half, NOT_LOCATED, None, b.orbit)


def _end(branch: Branch, end: Bifurcation | None, side: int) -> WindowEnd:
    if end is None:
        point, inner = branch.points[-side], side * (len(branch.points) - 3) + 1
        if branch.ends[side] is End.JOINED and branch.points[inner].counts != point.counts:
            return _unlocated(branch, -side, inner)
        return WindowEnd(point.value, 0.0, str(branch.ends[side]), None, point.orbit)
    return WindowEnd(
        end.value,
        end.error,
        str(end.kind),
        end,
        end.point.orbit,
    )
