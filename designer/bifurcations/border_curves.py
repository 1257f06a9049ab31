"""The bifurcation curves of a sweep: those through its points, over a second parameter."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
import shapely

from designer.base.arrays import Array
from designer.base.threads import parallel
from designer.bifurcations.plane_curves import PlaneCurve, PlaneWindow, continued
from designer.bifurcations.points import Bifurcation
from designer.bifurcations.subject import Subject
from designer.bifurcations.windows import WindowEnd, window
from designer.dynamics.orbit import Orbit

BLOCKS = 8
"""Blocks that the curves are kept in: point number k belongs to block k modulo this."""
SAME = 1e-6
"""In widths of the window: a point this near to a curve of its kind lies on it."""
BESIDE = 1e-3
"""The same of the straight way between two points of a curve."""


@dataclass(frozen=True)
class BorderCurve:
    """A bifurcation curve as plain data."""

    kind: str
    """What happens on it; see ``points.PointKind``."""
    response: str
    """The response at the point that it was begun at, as "n-p-q"."""
    symmetric: bool
    """Whether its orbits are symmetric."""
    points: Array
    """(points, 2) values of both parameters, in order of arclength."""
    stable: tuple[bool, ...]
    """For each point, whether the orbit is stable on one side of the curve."""
    ends: tuple[str, str]
    """Why it stops at its first and at its last point; see ``plane_curves.PlaneCurve``."""
    codimension_two: tuple[tuple[str, float, float], ...]
    """(name, values of both parameters) of the points of codimension two, in its order."""

    @classmethod
    def of(cls, curve: PlaneCurve) -> BorderCurve:
        """The plain data of a followed curve."""
        return cls(
            str(curve.kind),
            curve.response,
            curve.system.symmetric,
            curve.values,
            curve.stable,
            curve.ends,
            tuple((c.name, *c.values) for c in curve.codimension_two),
        )

    def as_dict(self) -> dict[str, Any]:
        """Plain, for JSON."""
        return {
            "kind": self.kind,
            "response": self.response,
            "symmetric": self.symmetric,
            "points": self.points.tolist(),
            "stable": list(self.stable),
            "ends": list(self.ends),
            "codimension_two": [
                {"kind": name, "values": [a, b]} for name, a, b in self.codimension_two
            ],
        }

    @property
    def turned(self) -> BorderCurve:
        """The same with its parameters exchanged."""
        met = tuple((name, b, a) for name, a, b in self.codimension_two)
        return replace(self, points=self.points[:, ::-1], codimension_two=met)


class CurveStore(Protocol):
    """Where finished curves are kept."""

    def read(self, block: int) -> list[BorderCurve] | None:
        """The curves of a block; None where there is none."""

    def write(self, block: int, curves: Sequence[BorderCurve]) -> None:
        """Keep a finished block."""


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

    def as_dict(self) -> dict[str, Any]:
        """What decides the result, beside the sweep."""
        return {"name": self.second, "from": self.window.second[0], "to": self.window.second[1]}


def run(
    plan: CurvePlan,
    points: Sequence[Bifurcation],
    jobs: int = 1,
    store: CurveStore | None = None,
    progress: Callable[[], None] = lambda: None,
) -> list[BorderCurve]:
    """The curves through points of the sweep at which a stable orbit changes, each once.

    progress : called once a block.
    """
    wanted = [p for p in points if any(p.stable)]

    def block(number: int) -> list[BorderCurve]:
        curves = None if store is None else store.read(number)
        if curves is None:
            plane = plan.subject.plane(plan.first, plan.second)
            followed = [continued(plane, p, plan.at, plan.window) for p in wanted[number::BLOCKS]]
            curves = [BorderCurve.of(curve) for curve in followed if curve is not None]
            if store is not None:
                store.write(number, curves)
        progress()
        return curves

    out: list[BorderCurve] = []
    for curve in (c for curves in parallel(block, range(BLOCKS), jobs) for c in curves):
        if not any(_is_same(curve, other, plan.window.widths) for other in out):
            out.append(curve)
    return sorted(out, key=lambda c: (c.kind, c.response, float(c.points[0, 0])))


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
    ends = other.points[[0, -1]] / widths
    for turned in (one.points[[0, -1]], one.points[[-1, 0]]):
        if np.abs(turned / widths - ends).max() < SAME:
            return True
    return False


def read_curve(row: Mapping[str, Any]) -> BorderCurve:
    """A curve from its plain data (``BorderCurve.as_dict``)."""
    return BorderCurve(
        row["kind"],
        row["response"],
        row["symmetric"],
        np.array(row["points"], dtype=float),
        tuple(row["stable"]),
        (row["ends"][0], row["ends"][1]),
        tuple((c["kind"], *c["values"]) for c in row["codimension_two"]),
    )
