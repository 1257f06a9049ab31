"""The region of two parameters in which one response lives, seen from a point inside it.

Along straight rays from the point the orbit is followed (``bifurcations.windows``) until it loses
its stability or its counts of impacts change: that end is located to 1e-8 of the ray and named by
what happens there. What lies inside the ends is the part of the region that is seen from the point;
folds of the border that hide behind it are left out, so that no box is promised too much. Between
two neighbouring rays the border is taken as straight.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely

from designer.base.arrays import Array
from designer.base.plain_json import plain
from designer.base.threads import parallel
from designer.bifurcations.flow_family import Family, FlowPlane
from designer.bifurcations.plane_curves import PlaneWindow
from designer.bifurcations.windows import window
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit

if TYPE_CHECKING:
    from designer.answers.bifurcation_answer import RegionRow, SpreadBoxRow

RAYS = 72
"""Straight ways from the point to the border; eight of them lead along axes and diagonals."""
BEHIND = 1e-3
"""Of a ray: how far it is followed the other way, so that its first point has two sides."""
BEYOND = 0.1
"""Of a ray: how far past the window Newton's method may look, where the parameters' domains let."""
EDGE = "edge of the window"
"""What a border is called where the response lives on beyond the window."""
HELD = 0.95
"""Share of the boards between the ends of a spread's box in each parameter."""
ROUND = 1e-6
"""Error of the largest ellipse, over the region's size."""
GRID, ROUNDS, NARROWER = 41, 8, 0.25
"""The best box is sought on a grid of so many points a side, then on ever narrower ones."""


@dataclass(frozen=True)
class ToleranceBox:
    """A box of equal relative half widths in both parameters."""

    centre: tuple[float, float]
    """Values of both parameters in its middle."""
    half_widths: tuple[float, float]
    """Half widths of both parameters."""
    share: float
    """Half widths over the nominal values."""


@dataclass(frozen=True)
class ToleranceEllipse:
    """An ellipse of equal relative half axes in both parameters, which it has along its axes."""

    centre: tuple[float, float]
    """Values of both parameters in its middle."""
    half_axes: tuple[float, float]
    """Half axes of both parameters."""
    share: float
    """Half axes over the nominal values."""


@dataclass(frozen=True)
class SpreadBox:
    """How far boards that should be equal lie from the nominal point, in the plane's parameters."""

    low: tuple[float, float]
    """Least values of both parameters."""
    high: tuple[float, float]
    """Greatest values of both parameters."""
    share: float
    """Share of the boards that lie between the ends of each parameter."""
    boards: int
    """Boards that were drawn."""
    inside: float
    """Share of the boards that lie in the part of the region that is seen."""

    @classmethod
    def about(cls, at: tuple[float, float], ratios: Array, border: Array) -> SpreadBox:
        """The box of boards that lie at these ratios (boards, 2) to the nominal point."""
        places = np.array(at) * ratios
        tail = 0.5 * (1.0 - HELD)
        (a, b), (c, d) = np.quantile(places, (tail, 1.0 - tail), axis=0).tolist()
        within = shapely.contains_xy(shapely.Polygon(border), places)
        return cls((a, b), (c, d), HELD, len(places), float(within.mean()))

    def as_dict(self) -> SpreadBoxRow:
        """Plain, for JSON."""
        return {
            "from": list(self.low),
            "to": list(self.high),
            "share": self.share,
            "boards": self.boards,
            "inside": self.inside,
        }


@dataclass(frozen=True)
class ResponseRegion:
    """The part of a response's region that is seen from a nominal point."""

    at: tuple[float, float]
    """Values of both parameters at the nominal point."""
    response: str
    """The response there, as "n-p-q"."""
    symmetric: bool
    """Whether it is its own mirror image."""
    border: Array
    """(rays, 2) values of both parameters at the ends of the rays, once round."""
    kinds: tuple[str, ...]
    """What happens at each of them: a bifurcation's kind, ``EDGE``, or "no convergence"."""
    around: ToleranceBox
    """The largest box about the nominal point that lies inside."""
    best: ToleranceBox
    """The largest box of these proportions inside, wherever its centre."""
    ellipse_around: ToleranceEllipse
    """The largest ellipse about the nominal point that lies inside."""
    ellipse_best: ToleranceEllipse
    """The largest ellipse of these proportions inside, wherever its centre."""
    spread: SpreadBox | None = None
    """The box of the boards' spread about the nominal point, where boards differ in both."""

    def as_dict(self) -> RegionRow:
        """Plain, for JSON."""
        return {
            "at": list(self.at),
            "response": self.response,
            "symmetric": self.symmetric,
            "border": [
                {"values": values, "kind": kind}
                for values, kind in zip(self.border.tolist(), self.kinds, strict=True)
            ],
            "around": plain(self.around),
            "best": plain(self.best),
            "ellipse_around": plain(self.ellipse_around),
            "ellipse_best": plain(self.ellipse_best),
            "spread": None if self.spread is None else self.spread.as_dict(),
        }


def region(
    plane: FlowPlane,
    orbit: Orbit,
    at: tuple[float, float],
    inside: PlaneWindow,
    *,
    rays: int = RAYS,
    jobs: int = 1,
    progress: Callable[[], None] = lambda: None,
) -> ResponseRegion:
    """The region about a point with a stable periodic orbit, within a window.

    progress : called once a ray.

    Raises
    ------
    ArithmeticError : the orbit is not stable at the point.
    """
    angles = 2.0 * np.pi * np.arange(rays) / rays
    ways = inside.widths * np.column_stack([np.cos(angles), np.sin(angles)])

    def end(way: Array) -> tuple[Array, str]:
        reach = _to_edge(np.array(at), way, inside)
        found = _end(plane, orbit, np.array(at), reach * way)
        progress()
        return found

    ends = list(parallel(end, ways, jobs))
    border = np.array([values for values, _ in ends])
    # Relative to the point; in widths of the window where that lies at 0.
    nominal = np.where(np.array(at) == 0.0, inside.widths, np.abs(np.array(at)))
    around, best = _boxes(border / nominal, np.array(at) / nominal)
    near, widest = _circles(border / nominal, np.array(at) / nominal)
    return ResponseRegion(
        at,
        orbit.response,
        bool(orbit.symmetric),
        border,
        tuple(kind for _, kind in ends),
        _box(*around, nominal),
        _box(*best, nominal),
        _ellipse(*near, nominal),
        _ellipse(*widest, nominal),
    )


def _to_edge(at: Array, way: Array, inside: PlaneWindow) -> float:
    """How many times a way fits between the point and the window's edge."""
    reaches = [np.inf]
    for start, step, (low, high) in zip(at, way, (inside.first, inside.second), strict=True):
        if abs(step) > 1e-12 * (high - low):
            reaches.append(((high if step > 0.0 else low) - start) / step)
    return float(min(reaches))


def _end(plane: FlowPlane, orbit: Orbit, at: Array, way: Array) -> tuple[Array, str]:
    """Where the response ends on the way from a point, and what happens there."""

    def build(share: float) -> Flow:
        return plane.flow(*(at + share * way).tolist())

    past = 1.0 + BEYOND
    most = past if plane.contains(*(at + past * way).tolist()) else 1.0
    high = window(Family("share", -2.0 * BEHIND, most, build), orbit, 0.0, -BEHIND, 1.0).high
    reached = high.point is None and high.value > 1.0 - BEHIND
    return at + high.value * way, EDGE if reached else high.why


def _box(centre: Array, share: float, nominal: Array) -> ToleranceBox:
    a, b = (centre * nominal).tolist()
    wide, tall = (share * nominal).tolist()
    return ToleranceBox((a, b), (wide, tall), share)


def _ellipse(centre: Array, share: float, nominal: Array) -> ToleranceEllipse:
    box = _box(centre, share, nominal)
    return ToleranceEllipse(box.centre, box.half_widths, box.share)


def _circles(border: Array, at: Array) -> tuple[tuple[Array, float], tuple[Array, float]]:
    """(centre, radius) of the largest circle about a point and of the largest anywhere, inside a
    polygon (k, 2)."""
    polygon = shapely.Polygon(border)
    around = (at, float(polygon.exterior.distance(shapely.Point(at))))
    ray = shapely.maximum_inscribed_circle(polygon, tolerance=ROUND * np.ptp(border))
    best = (np.array(ray.coords[0]), float(ray.length))
    return around, best if best[1] > around[1] else around


def _boxes(border: Array, at: Array) -> tuple[tuple[Array, float], tuple[Array, float]]:
    """(centre, half width) of the largest square about a point and of the largest anywhere, inside
    a polygon (k, 2)."""
    low, high = border.min(axis=0), border.max(axis=0)
    centre, best = at, float(room(border, at[None])[0])
    around = (at, best)
    middle, reach = 0.5 * (low + high), 0.5 * (high - low)
    for _ in range(ROUNDS):
        axes = [np.linspace(m - r, m + r, GRID) for m, r in zip(middle, reach, strict=True)]
        points = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
        rooms = room(border, points)
        k = int(np.argmax(rooms))
        if rooms[k] > best:
            centre, best = points[k], float(rooms[k])
        middle, reach = centre, NARROWER * reach
    return around, (centre, best)


def room(border: Array, points: Array) -> Array:
    """(points,) half width of the largest square about each point inside a polygon; 0 outside."""
    a = border[None] - points[:, None]
    b = np.roll(border, -1, axis=0)[None] - points[:, None]
    step = b - a
    shares = [np.zeros(a.shape[:2]), np.ones(a.shape[:2])]
    with np.errstate(divide="ignore", invalid="ignore"):
        shares += [-a[..., 0] / step[..., 0], -a[..., 1] / step[..., 1]]
        shares += [(a[..., 1] - a[..., 0]) / (step[..., 0] - step[..., 1])]
        shares += [-(a[..., 1] + a[..., 0]) / (step[..., 0] + step[..., 1])]
    near = np.full(a.shape[:2], np.inf)
    for share in shares:
        s = np.clip(np.nan_to_num(share), 0.0, 1.0)[..., None]
        near = np.minimum(near, np.abs(a + s * step).max(axis=-1))
    crosses = (a[..., 1] > 0.0) != (b[..., 1] > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        right = a[..., 0] - a[..., 1] * step[..., 0] / step[..., 1] > 0.0
    within = (crosses & right).sum(axis=1) % 2 == 1
    return np.where(within, near.min(axis=1), 0.0)
