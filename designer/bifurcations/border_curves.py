"""The bifurcation curves of a sweep over a second parameter: those through its points, and the
other curves that pass points of codimension two on them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import TYPE_CHECKING

import numpy as np
import shapely

from designer.base.arrays import Array
from designer.base.defaults import CURVE_DEPTH
from designer.base.threads import parallel
from designer.bifurcations.block_store import KeptBlocks, stored
from designer.bifurcations.border_curve import (
    DEEPER,
    FOLLOWED,
    LOST,
    NO_OTHER,
    NOT_BUILT,
    UNSTABLE,
    BorderCurve,
    CurveMeeting,
    CurveOrigin,
)
from designer.bifurcations.curve_switch import OtherCurve, switched
from designer.bifurcations.plane_curves import CLOSED, PlaneWindow, continued
from designer.bifurcations.points import Bifurcation, PointKind
from designer.bifurcations.subject import Subject
from designer.bifurcations.windows import WindowEnd, window
from designer.dynamics.orbit import MOST_COUNTED, Orbit

if TYPE_CHECKING:
    from designer.answers.bifurcation_answer import CurvePlanKeys

BLOCKS = 8
"""Blocks that the curves through the sweep's points are kept in: point number k belongs to block k
modulo this. As many more for the curves of each depth."""
SAME = 1e-6
"""Distance in widths of the window: a point this near to a curve of its kind lies on it."""
BESIDE = 1e-3
"""The same distance, from the straight way between two points of a curve."""


@dataclass(frozen=True)
class CurvePlan:
    """The curves that are asked for."""

    subject: Subject
    """The system whose parameters change."""
    first: str
    """Name of the sweep's parameter."""
    second: str
    """Name of the other parameter."""
    at: float
    """Value of the other parameter along the sweep."""
    window: PlaneWindow
    """The rectangle that curves are followed in."""
    depth: int = CURVE_DEPTH
    """How many times in a row another curve is begun at a point of codimension two."""

    def as_dict(self) -> CurvePlanKeys:
        """What decides the result, beside the sweep."""
        low, high = self.window.second
        return {"name": self.second, "from": low, "to": high, "depth": self.depth}


def run(
    plan: CurvePlan,
    points: Sequence[Bifurcation],
    jobs: int = 1,
    store: KeptBlocks[list[BorderCurve]] | None = None,
    progress: Callable[[], None] = lambda: None,
) -> list[BorderCurve]:
    """The curves through points of the sweep at which a stable orbit changes, each once; then those
    that are switched to from them, as deep as the plan says.

    progress : called once a block, ``BLOCKS`` times for each depth.
    """
    wanted = [p for p in points if any(p.stable)]

    def through_points(number: int) -> list[BorderCurve]:
        plane = plan.subject.plane(plan.first, plan.second)
        curves = [continued(plane, p, plan.at, plan.window) for p in wanted[number::BLOCKS]]
        return [BorderCurve.of(curve) for curve in curves if curve is not None]

    found = _Found(plan.window.widths)
    found.add(_level(plan, 0, through_points, jobs, store, progress))
    for depth in range(1, plan.depth + 1):
        starts = found.starts()

        def from_meetings(number: int, starts: list[_Start] = starts) -> list[BorderCurve]:
            return list(_switched_to(plan, starts, number))

        found.add(_level(plan, depth, from_meetings, jobs, store, progress))
    return found.with_status()


def _level(
    plan: CurvePlan,
    depth: int,
    follow: Callable[[int], list[BorderCurve]],
    jobs: int,
    store: KeptBlocks[list[BorderCurve]] | None,
    progress: Callable[[], None],
) -> list[BorderCurve]:
    """The curves of one depth, or what of them the store has not."""

    def may_be(curves: list[BorderCurve]) -> bool:
        return all(_may_be(curve, plan.subject) for curve in curves)

    def block(number: int) -> list[BorderCurve]:
        place = depth * BLOCKS + number
        curves = stored(store, (place,), may_be, lambda: follow(number))
        progress()
        return curves

    return [c for curves in parallel(block, range(BLOCKS), jobs) for c in curves]


def _may_be(curve: BorderCurve, subject: Subject) -> bool:
    """Whether a stored curve is of this system."""
    clearances = {stop.clearance for stop in subject.stops}
    others = [met.other for met in curve.codimension_two if met.other is not None]
    return bool(np.isfinite(curve.points).all()) and all(
        1 <= other.n <= MOST_COUNTED
        and len(other.state) == len(subject.states)
        and bool(np.isfinite([*other.state, *other.values, other.phase, other.size]).all())
        and (
            other.touch is None
            or (other.touch.clearance in clearances and other.touch.side in (1, -1))
        )
        for other in others
    )


@dataclass(frozen=True)
class _Start:
    """A point of codimension two at which another curve is to be begun."""

    origin: CurveOrigin
    own: PointKind
    """Kind of the curve that it was found on."""
    other: OtherCurve
    """The curve that is to be begun."""

    @property
    def key(self) -> tuple[object, ...]:
        """Where this differs, so does the curve."""
        return self.other.kind, self.other.n, self.other.symmetric


def _switched_to(plan: CurvePlan, starts: Sequence[_Start], number: int) -> Iterator[BorderCurve]:
    """The curves of a block that begin at these points, each once. Curves that may be the same are
    in one block."""
    plane = plan.subject.plane(plan.first, plan.second)
    keys = list(dict.fromkeys(start.key for start in starts))
    curves: list[BorderCurve] = []
    for start in starts:
        if keys.index(start.key) % BLOCKS != number:
            continue
        if any(_meets(c, start.other, start.origin.name, plan.window.widths) for c in curves):
            continue
        followed = switched(plane, start.other, start.origin.name, plan.window)
        if followed is None:
            continue
        # The curve that it was found on is the other one here.
        back = replace(start.other, kind=start.own, touch=None)
        here = CurveMeeting(start.origin.name, start.origin.values, back)
        before = sum(c.position < followed.begun for c in followed.codimension_two)
        border = BorderCurve.of(followed)
        met = (*border.codimension_two[:before], here, *border.codimension_two[before:])
        curves.append(replace(border, codimension_two=met, begun_at=start.origin))
        yield curves[-1]


def _meets(curve: BorderCurve, other: OtherCurve, name: str, widths: Array) -> bool:
    """Whether a curve passes this point of codimension two as the other one.

    One that ends at a grazing may do so from the side that touches: only one that was begun there
    is known to be on the other side.
    """
    if (curve.kind, curve.n, curve.symmetric) != (other.kind, other.n, other.symmetric):
        return False
    if not any(
        m.name == name and _near(m.values, other.values, widths) for m in curve.codimension_two
    ):
        return False
    if other.touch is None or other.kind is PointKind.GRAZING:
        return True
    if curve.begun_at is not None and _near(curve.begun_at.values, other.values, widths):
        return True
    return not any(_near(end, other.values, widths) for end in curve.points[[0, -1]])


def _near(one: Sequence[float], other: Sequence[float], widths: Array) -> bool:
    return bool(np.abs((np.array(one) - other) / widths).max() < SAME)


class _Found:
    """The curves that were followed, each once, in the order of their numbers."""

    def __init__(self, widths: Array) -> None:
        self.widths = widths
        self.levels: list[list[BorderCurve]] = []
        self.joined: dict[CurveOrigin, int] = {}

    @property
    def curves(self) -> list[BorderCurve]:
        """All of them; number k is the one at k - 1."""
        return [curve for level in self.levels for curve in level]

    def add(self, curves: Sequence[BorderCurve]) -> None:
        """The curves of the next depth, without those that are there."""
        known, new = self.curves, list[BorderCurve]()
        for curve in sorted(curves, key=lambda c: (c.kind, c.response, float(c.points[0, 0]))):
            same = next(
                (k for k, c in enumerate([*known, *new], 1) if _is_same(curve, c, self.widths)), 0
            )
            if not same:
                new.append(curve)
            elif curve.begun_at is not None:
                self.joined[curve.begun_at] = same
        self.levels.append(new)

    def starts(self) -> list[_Start]:
        """Where the curves of the last depth meet others that are not followed yet."""
        number = count(1 + sum(len(level) for level in self.levels[:-1]))
        return [
            _Start(CurveOrigin(k, m.name, m.values), PointKind(curve.kind), m.other)
            for k, curve in zip(number, self.levels[-1], strict=False)
            for m in curve.codimension_two
            if m.other is not None and m.other.stable and not self._passing(m, k)
        ]

    def _passing(self, met: CurveMeeting, number: int) -> int:
        """Number of the other curve at a point of codimension two of a curve; 0 of none."""
        assert met.other is not None
        for k, curve in enumerate(self.curves, 1):
            others = tuple(m for m in curve.codimension_two if m is not met)
            if _meets(replace(curve, codimension_two=others), met.other, met.name, self.widths):
                return k
        return self.joined.get(CurveOrigin(number, met.name, met.values), 0)

    def with_status(self) -> list[BorderCurve]:
        """All curves, with what became of the other curve at each point of codimension two."""
        out = []
        for k, curve in enumerate(self.curves, 1):
            last = k > sum(len(level) for level in self.levels[:-1])
            met = [self._with_status(m, k, deepest=last) for m in curve.codimension_two]
            out.append(replace(curve, codimension_two=tuple(met)))
        return out

    def _with_status(self, met: CurveMeeting, number: int, *, deepest: bool) -> CurveMeeting:
        if met.other is None:
            return replace(met, status=NO_OTHER if met.name == "cusp" else NOT_BUILT)
        passing = self._passing(met, number)
        if passing:
            return replace(met, curve=passing, status=FOLLOWED)
        unseen = UNSTABLE if not met.other.stable else DEEPER if deepest else LOST
        return replace(met, status=unseen)


def around(
    plan: CurvePlan, orbit: Orbit, value: float, progress: Callable[[], None] = lambda: None
) -> Iterator[BorderCurve]:
    """The curves through both ends of the window of one stable orbit, over the first parameter and
    over the second; each once, and each as soon as it is followed.

    orbit : of period n, where the first parameter has this value and the second ``plan.at``.
    progress : called once a point of a branch or of a curve.
    """
    turned = CurvePlan(
        plan.subject,
        plan.second,
        plan.first,
        value,
        PlaneWindow(plan.window.second, plan.window.first),
    )
    found: list[BorderCurve] = []
    for each, other in ((plan, turned), (turned, plan)):
        plane = each.subject.plane(each.first, each.second)
        for end in _ends(each, orbit, other.at, progress):
            place = (end.value, each.at) if each is plan else (each.at, end.value)
            if end.point is None or any(_passes(c, end, place, plan.window) for c in found):
                continue
            curve = continued(plane, end.point, each.at, each.window, progress=progress)
            if curve is not None:
                border = BorderCurve.of(curve)
                found.append(border if each is plan else border.turned)
                yield found[-1]


def _ends(
    plan: CurvePlan, orbit: Orbit, value: float, progress: Callable[[], None]
) -> tuple[WindowEnd, ...]:
    """Both ends of the window over the first parameter; () where the orbit cannot be followed."""
    family = plan.subject.family(plan.first)
    try:
        stable = window(family, orbit, value, *plan.window.first, progress=progress)
    except ArithmeticError:
        return ()
    return stable.low, stable.high


def _passes(
    curve: BorderCurve, end: WindowEnd, place: tuple[float, float], within: PlaneWindow
) -> bool:
    """Whether a curve of the kind of a window's end passes it."""
    if curve.kind != end.why or len(curve.points) < 2:
        return False
    line = shapely.LineString(curve.points / within.widths)
    return bool(line.distance(shapely.Point(np.array(place) / within.widths)) < BESIDE)


def _is_same(one: BorderCurve, other: BorderCurve, widths: Array) -> bool:
    """Whether two curves are one: of the same kind and orbits, and with the same ends."""
    if (one.kind, one.symmetric) != (other.kind, other.symmetric):
        return False
    if {one.ends, other.ends} == {(CLOSED, CLOSED)}:
        lines = (shapely.LineString(curve.points / widths) for curve in (one, other))
        return bool(shapely.hausdorff_distance(*lines) < BESIDE)
    ends = other.points[[0, -1]] / widths
    for turned in (one.points[[0, -1]], one.points[[-1, 0]]):
        if np.abs(turned / widths - ends).max() < SAME:
            return True
    return False
