"""Bifurcation curves over two parameters, from points located along one.

A curve is followed by arclength, through turns in either parameter, to the edge of the window, to
where it closes on itself or ends in a point of codimension two, or to where Newton's method fails,
which is said. States are measured in the peaks of the first orbit, parameters in the widths of the
window.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from designer.base.arrays import Array
from designer.bifurcations.codimension_two import (
    ENDS,
    CodimensionTwo,
    grazing_near,
    locate,
    watched,
)
from designer.bifurcations.conditions import Condition, Multiplier, MultiplierPair, grazings
from designer.bifurcations.extended_system import CurvePoint, ExtendedSystem, hermite
from designer.bifurcations.flow_family import FlowPlane
from designer.bifurcations.points import TOUCHES, Bifurcation, PointKind
from designer.dynamics.attractors import peaks_near
from designer.dynamics.flow import Flow

FIRST, LEAST, GREATEST = 5e-3, 1e-7, 2e-2
"""Arclength of the first, the shortest and the longest step, in scaled units."""
TURN = 0.97
"""Cosine of the most that the tangent may turn in one step."""
OFF = 0.25
"""The most that a point may lie off where it was aimed at, over the step."""
POINTS = 1500
"""Most points of one curve in one direction."""
CAME_BACK = 1e-4
"""A first point that lies so near the way between two others, in scaled units, closes the curve."""


AT_ORIGIN = 1e-5
"""A point of codimension two that lies so near, in scaled units, to one that a curve was begun at,
and has its name, is that one."""


@dataclass(frozen=True)
class PlaneWindow:
    """The rectangle of two parameters that curves are followed in."""

    first: tuple[float, float]
    """Least and greatest value of the first parameter."""
    second: tuple[float, float]
    """Least and greatest value of the second parameter."""

    @property
    def widths(self) -> Array:
        """(2,) of both sides."""
        return np.array([self.first[1] - self.first[0], self.second[1] - self.second[0]])

    def holds(self, first: float, second: float) -> bool:
        """Whether a pair of values lies inside."""
        one, other = self.first, self.second
        return one[0] <= first <= one[1] and other[0] <= second <= other[1]


@dataclass(frozen=True)
class PlaneCurve:
    """A bifurcation curve."""

    system: ExtendedSystem
    """The equations that its points obey, with the condition of each point."""
    kind: PointKind
    """What happens on it."""
    response: str
    """The response at the point that it was begun at, as "n-p-q"."""
    points: tuple[CurvePoint, ...]
    """The points in order of arclength."""
    ends: tuple[str, str]
    """Why it stops at its first and at its last point: "edge of b" (a side of the window), "closes
    on itself", "no convergence", "most points", or the name of a point of codimension two."""
    codimension_two: tuple[CodimensionTwo, ...]
    """The points in order of arclength."""
    begun: int = 0
    """Number of the point that it was begun at."""

    @property
    def values(self) -> Array:
        """(points, 2) of both parameters."""
        return np.array([p.values for p in self.points])

    @property
    def stable(self) -> tuple[bool, ...]:
        """Whether the orbit is stable on one side of the curve, for each point."""
        return tuple(p.stable_aside for p in self.points)


def continued(
    plane: FlowPlane,
    bifurcation: Bifurcation,
    second: float,
    window: PlaneWindow,
    *,
    progress: Callable[[], None] = lambda: None,
) -> PlaneCurve | None:
    """The curve through a point that was located on a branch over the first parameter.

    second : value of the second parameter on the branch. None where the extended equations have no
    solution at the point, and for a pitchfork where the second parameter breaks the symmetry.
    progress : called once a point.
    """
    begun = _begun(plane, bifurcation, second, window)
    if begun is None:
        return None
    system, origin = begun
    return followed(system, origin, str(bifurcation.response), window, progress=progress)


def followed(
    system: ExtendedSystem,
    origin: CurvePoint,
    response: str,
    window: PlaneWindow,
    *,
    ways: Sequence[float] = (1.0, -1.0),
    begun_at: str = "",
    progress: Callable[[], None] = lambda: None,
) -> PlaneCurve:
    """The curve through a point, both ways, once round where it is a loop.

    ways : 1 along the tangent, -1 against it; one alone where the curve ends at the point. begun_at
    : name of the point where it is one of codimension two, which is not listed a second time.
    """
    turned = replace(origin, tangent=-origin.tangent)
    begun = origin if ways[0] > 0.0 else turned
    up = _follow(system, begun, window, begun_at, progress)
    kind = origin.condition.kind
    if up.end == CLOSED or len(ways) < 2:
        ends = (CLOSED if up.end == CLOSED else begun_at, up.end)
        return PlaneCurve(system, kind, response, up.points, ends, up.met)
    down = _follow(system, turned, window, begun_at, progress)
    back = len(down.points) - 1
    points = tuple(replace(p, tangent=-p.tangent) for p in down.points[:0:-1]) + up.points
    met = [replace(c, position=back - c.position) for c in down.met[::-1]]
    met += [replace(c, position=back + c.position) for c in up.met]
    return PlaneCurve(system, kind, response, points, (down.end, up.end), tuple(met), back)


CLOSED = "closes on itself"
LOST = "no convergence"


@dataclass(frozen=True)
class _Followed:
    """One direction of a curve."""

    points: tuple[CurvePoint, ...]
    """The origin first."""
    end: str
    """Why it stops."""
    met: tuple[CodimensionTwo, ...]
    """Points of codimension two, in its order."""


def _begun(
    plane: FlowPlane, bifurcation: Bifurcation, second: float, window: PlaneWindow
) -> tuple[ExtendedSystem, CurvePoint] | None:
    """The equations of a located point's curve, and the point solved for by them."""
    solved, flow = bifurcation.point.solved, plane.flow(bifurcation.value, second)
    x, n = solved.x, bifurcation.point.orbit.n
    by_half = bifurcation.symmetric and flow.system.mirror is not None
    halved = by_half and plane.mirrored(bifurcation.value, second)
    if by_half and not halved and bifurcation.kind is PointKind.PITCHFORK:
        return None  # where the second parameter breaks the symmetry there is none
    peaks = peaks_near(flow, x)
    jacobian = solved.jacobian if halved or not by_half else solved.jacobian @ solved.jacobian
    jacobian = jacobian * peaks / peaks[:, None]
    values = (bifurcation.value, second)
    for condition, extra in _conditions(bifurcation, jacobian, flow, symmetric=halved):
        system = system_at(plane, values, x, n, extra, window, symmetric=halved)
        z = np.concatenate([x, extra, values])
        border = np.zeros(len(z))
        border[-1] = 1.0
        found = system.correct(z, border, condition)
        if found is not None and abs(found.values[0] - bifurcation.value) < _near(bifurcation):
            return system, found
    return None


def system_at(
    plane: FlowPlane,
    values: tuple[float, float],
    x: Array,
    n: int,
    extra: Array,
    window: PlaneWindow,
    *,
    symmetric: bool,
) -> ExtendedSystem:
    """The equations of a curve near an orbit of period n with state x at the strobe.

    values : of both parameters there. extra : the condition's own unknowns.
    """
    peaks = peaks_near(plane.flow(*values), x)
    scale = np.concatenate([peaks, np.ones(len(extra)), window.widths])
    return ExtendedSystem(plane, n, symmetric, len(x), scale)


def _near(bifurcation: Bifurcation) -> float:
    """How far the extended equations may lie off a located point."""
    return 10.0 * bifurcation.error + 1e-6 * max(abs(bifurcation.value), 1e-300)


def _conditions(
    bifurcation: Bifurcation, jacobian: Array, flow: Flow, *, symmetric: bool
) -> list[tuple[Condition, Array]]:
    """What may hold at a located point, most likely first, with the condition's own unknowns."""
    kind = bifurcation.kind
    if kind is PointKind.TORUS:
        return [(MultiplierPair.at(jacobian), np.zeros(0))]
    if kind not in TOUCHES:
        return [(Multiplier.at(kind, jacobian), np.zeros(0))]
    x, n = bifurcation.point.solved.x, bifurcation.point.orbit.n
    near = grazings(flow, x, n, symmetric=symmetric, corners=kind is PointKind.CORNER)[:4]
    return [(grazing, np.array([phase])) for grazing, phase in near]


def _follow(
    system: ExtendedSystem,
    origin: CurvePoint,
    window: PlaneWindow,
    begun_at: str,
    progress: Callable[[], None],
) -> _Followed:
    """The curve from the origin on, in the direction of its tangent."""
    points, met = [origin], list[CodimensionTwo]()
    current = watched(system, origin)
    step, end = FIRST, "most points"
    while len(points) < POINTS:
        new = _step(system, points, step)
        if new is None:
            step *= 0.5
            if step < LEAST:
                end = LOST
                break
            continue
        edge = None if window.holds(*new.values) else _onto_edge(system, points[-1], new, window)
        if not window.holds(*new.values) and edge is None:
            step *= 0.5
            if step < LEAST:
                end = LOST
                break
            continue
        new, end_here = (new, "") if edge is None else edge
        before, current = current, watched(system, new)
        here = locate(system, before, current, len(points) - 1)
        if len(points) == 1:
            here = [c for c in here if c.name != begun_at or not _at_origin(system, c, origin)]
        last = next((c for c in here if c.name in ENDS or _pair_ends(c)), None)
        if last is not None:
            met += here[: here.index(last) + 1]
            points.append(last.point)
            end = last.name
            break
        met += here
        if len(points) > 3 and (closing := _closing(system, points, new)):
            points.append(closing)
            end = CLOSED
            break
        points.append(new)
        progress()
        if end_here:
            end = end_here
            break
        if new.iterations <= 4:
            step = min(1.5 * step, GREATEST)
        elif new.iterations > 7:
            step = max(0.6 * step, LEAST)
    if end == LOST and (last := grazing_near(system, points[-1], len(points) - 1)):
        points.append(last.point)
        met.append(last)
        end = last.name
    return _Followed(tuple(points), end, tuple(met))


def _at_origin(system: ExtendedSystem, c: CodimensionTwo, origin: CurvePoint) -> bool:
    return system.distance(c.point.z, origin.z) < AT_ORIGIN


def _pair_ends(c: CodimensionTwo) -> bool:
    """Whether a torus curve ends: beyond such a resonance the pair is real."""
    condition = c.point.condition
    real = isinstance(condition, MultiplierPair) and abs(condition.total) > 1.9
    return real and c.name in ("1:1 resonance", "1:2 resonance")


def _step(system: ExtendedSystem, points: list[CurvePoint], step: float) -> CurvePoint | None:
    """The next point, if it lies where it was aimed at and the curve did not turn much."""
    current = points[-1]
    guess = current.z + step * system.scale * current.tangent
    if len(points) > 1:
        before = points[-2]
        share = step / max(system.distance(before.z, current.z), 1e-300)
        if share < 2.0:
            guess, _ = hermite(before, current, 1.0 + share, system.scale)
    new = system.correct(guess, current.tangent, current.condition)
    if new is None:
        return None
    off = system.distance(guess, new.z)
    turned = float(current.tangent @ new.tangent)
    if new is current or off > OFF * step or turned < TURN:
        return None
    return new


def _onto_edge(
    system: ExtendedSystem, inside: CurvePoint, outside: CurvePoint, window: PlaneWindow
) -> tuple[CurvePoint, str] | None:
    """The point on the side of the window that is crossed first, and its name."""
    names = system.plane.parameters
    best: tuple[float, int, float] | None = None
    for i, (low, high) in enumerate((window.first, window.second)):
        a, b = inside.values[i], outside.values[i]
        if low <= b <= high:
            continue
        edge = low if b < low else high
        share = (edge - a) / (b - a)
        if best is None or share < best[0]:
            best = (share, i, edge)
    assert best is not None
    share, i, edge = best
    guess, _ = hermite(inside, outside, share, system.scale)
    place = len(guess) - 2 + i
    guess[place] = edge
    border = np.zeros(len(guess))
    border[place] = 1.0
    found = system.correct(guess, border, inside.condition, along=inside.tangent)
    reach = 2.0 * system.distance(inside.z, outside.z)
    if found is None or system.distance(inside.z, found.z) > reach:
        return None
    z = found.z.copy()
    z[place] = edge
    return replace(found, z=z), f"edge of {names[i]}"


def _closing(
    system: ExtendedSystem, points: list[CurvePoint], new: CurvePoint
) -> CurvePoint | None:
    """The curve's first point, if it lies on the way from the last to a new one."""
    current, first = points[-1], points[0]
    chord = (new.z - current.z) / system.scale
    off = (first.z - current.z) / system.scale
    share = float(off @ chord) / float(chord @ chord)
    if not 0.0 < share <= 1.0:
        return None
    aside = float(np.linalg.norm(off - share * chord))
    return first if aside < max(CAME_BACK, 0.05 * float(np.linalg.norm(chord))) else None
