"""Points of codimension two on a bifurcation curve: what else happens on the way along it.

Each has a test function that changes sign there; between two points of the curve the root is found
by Brent's method along the curve, every value of it on a converged point.

- cusp: two folds meet, the second derivative of the map along the null vector is zero.
- 1:1 and 1:2 resonance: a second multiplier 1 (on a fold) or -1 (on a doubling); on a torus curve
  the ends, where the pair becomes real, and 1:3 and 1:4 where its sum is -1 and 0.
- Another multiplier 1 or -1, or another pair on the unit circle: fold-flip and its kin.
- Grazing, or a corner, meets another kind: a turning point touches a stop or a corner on the
  curve; on the curve of a grazing or a corner a multiplier reaches the unit circle, or a second
  turning point touches; on that of a corner its own corner once more is passed unseen.
- Degenerate grazing, degenerate corner: the turning point ceases to be one, its curvature is zero.
- Degenerate pitchfork and degenerate period doubling: the orbits of the curve fall together with
  those that they once left. The curve ends there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

from designer.base.arrays import Array, Index
from designer.bifurcations.conditions import (
    Condition,
    Grazing,
    Multiplier,
    MultiplierPair,
    grazings,
)
from designer.bifurcations.extended_system import CurvePoint, ExtendedSystem
from designer.bifurcations.points import PointKind
from designer.dynamics.orbit import Orbit, OrbitStatus
from designer.dynamics.turning_points import corner_crossings

APART = 1e-5
"""The step, in scaled units, of the difference that gives the second derivative of the map."""
ORDER = (
    PointKind.GRAZING,
    PointKind.FOLD,
    PointKind.DOUBLING,
    PointKind.PITCHFORK,
    PointKind.TORUS,
    PointKind.CORNER,
)
"""The order in which the kinds that meet are named."""
SHORT = {PointKind.DOUBLING: "flip"}
ENDS = (
    "degenerate grazing",
    "degenerate pitchfork",
    "degenerate period doubling",
    "degenerate corner",
)
"""The points of codimension two at which every curve ends."""
FALLEN = 1e-7
"""An orbit no farther than this from its partner, in scaled units, has fallen together with it."""

HALVINGS, TRIES = 34, (5, 12)
"""How often an interval in which counts change is halved; after so many halvings the point itself
is tried for."""
CORNER = 2e-2
"""The farthest, in scaled units, from a curve's last point to the grazing that stops it."""
BESIDE = (1e-7, 1e-9)
"""Distances from a stop, over the displacement's peak, that lead on to the grazing itself."""


@dataclass(frozen=True)
class CodimensionTwo:
    """A point of a curve at which a second thing happens."""

    name: str
    """What the point is called."""
    point: CurvePoint
    """The orbit there."""
    position: float
    """Where along the curve: the whole part is the number of the point before it."""
    other: Condition | None = None
    """What holds along the other curve of the same orbits that passes here, set up at the point;
    None where there is none."""
    extra: Array = field(default_factory=lambda: np.zeros(0))
    """(unknowns,) values of the other condition's own unknowns here."""

    @property
    def values(self) -> tuple[float, float]:
        """The values of both parameters."""
        return self.point.values


Event = tuple[str, PointKind | None]
"""Name of a point of codimension two, and kind of the other curve."""


@dataclass(frozen=True)
class WatchedPoint:
    """A point of a curve, with what tells whether something happens on the way to the next."""

    point: CurvePoint
    events: dict[Event, float]
    """The test functions there."""
    partner: Array
    """(states,) from the orbit to its partner; see ``partner``."""
    crossings: tuple[int, ...]
    """As of ``turning_points.corner_crossings``, but for the curve's own corner."""


def watched(system: ExtendedSystem, p: CurvePoint) -> WatchedPoint:
    """The point with its test functions, for ``locate`` on both sides of it."""
    return WatchedPoint(p, events(system, p), partner(system, p), _crossings(system, p))


def events(system: ExtendedSystem, p: CurvePoint) -> dict[Event, float]:
    """The test functions at a point; a change of sign from one point to the next is an event."""
    kind = p.condition.kind
    flip = PointKind.PITCHFORK if system.symmetric else PointKind.DOUBLING
    characteristic = np.polynomial.Polynomial(np.poly(p.jacobian)[::-1])
    out: dict[Event, float] = {}
    if isinstance(p.condition, Multiplier):
        at, other_kind = p.condition.value, PointKind.FOLD if kind is not PointKind.FOLD else flip
        # A half-period multiplier -1 twice is 1 twice in the period.
        name = "1:1 resonance" if at > 0.0 or system.symmetric else "1:2 resonance"
        out[name, PointKind.TORUS] = float(characteristic.deriv()(at))
        out[meeting(kind, other_kind), other_kind] = float(characteristic(-at))
        if kind is PointKind.FOLD:
            out["cusp", None] = _second_derivative(system, p, p.condition)
    elif isinstance(p.condition, MultiplierPair):
        total = p.condition.total
        real = {"1:1 resonance": PointKind.FOLD if total > 0.0 else flip}
        real |= {} if system.symmetric else {"1:2 resonance": flip}
        for name, off in _resonances(total, symmetric=system.symmetric).items():
            out[name, real.get(name)] = off
        others = p.condition.others(p.multipliers)
        for value, other_kind in ((1.0, PointKind.FOLD), (-1.0, flip)):
            out[meeting(kind, other_kind), other_kind] = float(np.prod(value - others).real)
    elif isinstance(p.condition, Grazing):
        n = system.states
        phase = float(p.z[n])
        curvature = p.condition.curvature(system.flow(p.z), p.z[:n], phase)
        out[f"degenerate {kind}", None] = curvature
        for value, other_kind in ((1.0, PointKind.FOLD), (-1.0, flip)):
            out[meeting(kind, other_kind), other_kind] = float(characteristic(value))
    if not isinstance(p.condition, MultiplierPair):
        out[meeting(kind, PointKind.TORUS), PointKind.TORUS] = _pair(p)
    return out


def _resonances(total: float, *, symmetric: bool) -> dict[str, float]:
    """How far a pair on the unit circle is from each strong resonance, by its sum. symmetric : the
    pair is that of the half-period map, and its square that of the period."""
    off = {"1:1": total - 2.0, "1:2": total + 2.0, "1:3": total + 1.0, "1:4": total}
    if symmetric:
        square = total * total
        off = {"1:1": square - 4.0, "1:2": total, "1:3": square - 1.0, "1:4": square - 2.0}
    return {f"{name} resonance": value for name, value in off.items()}


def meeting(one: PointKind, other: PointKind) -> str:
    """Name of the point where curves of two kinds meet on the same orbit."""
    if one is other:
        touches = {PointKind.GRAZING: "two grazings", PointKind.CORNER: "two corners"}
        return touches.get(one, f"double {one}")
    a, b = sorted((one, other), key=ORDER.index)
    if b is PointKind.CORNER:
        return f"corner meets {a}"
    if a is PointKind.GRAZING:
        return f"grazing meets {b}"
    return f"{SHORT.get(a, a)}-{SHORT.get(b, b)}"


def locate(
    system: ExtendedSystem, before: WatchedPoint, after: WatchedPoint, index: int
) -> list[CodimensionTwo]:
    """The points between two neighbouring points of a curve, in its order.

    Of two events of one kind between them neither is found.
    """
    found = []
    a, b = before.point, after.point
    for event, value in before.events.items():
        if value * after.events.get(event, 0.0) < 0.0:
            found.append((event, _root(system, a, b, event)))
    ended = _falls_together(system, before, after)
    if ended:
        found.append(((ended, None), _nearest_to_partner(system, before, after)))
    out = [
        CodimensionTwo(event[0], root[1], index + root[0], _other(root[1], event))
        for event, root in found
        if root is not None
    ]
    changed = [] if np.array_equal(a.impacts, b.impacts) else [False]
    # None where a law has lost a corner, or got one.
    if before.crossings != after.crossings and len(before.crossings) == len(after.crossings):
        changed.append(True)
    for corners in changed:
        grazed = _bisected(system, a, b, corners=corners)
        out += [] if grazed is None else [replace(grazed, position=index + grazed.position)]
    return sorted(out, key=lambda c: c.position)


def _other(p: CurvePoint, event: Event) -> Condition | None:
    """What holds along the other curve at an event on a curve; None where there is none."""
    name, kind = event
    if kind is None:
        return None
    if kind is not PointKind.TORUS:
        return Multiplier.at(kind, p.jacobian)
    if isinstance(p.condition, Multiplier) and name.endswith("resonance"):
        return MultiplierPair(2.0 * p.condition.value)
    return MultiplierPair.at(p.jacobian) if _pair(p) else None


Root = tuple[float, CurvePoint]
"""Share of the way between two points, and the point there."""


def _root(system: ExtendedSystem, a: CurvePoint, b: CurvePoint, event: Event) -> Root | None:
    """An event's root between two points; None where its function jumps or points fail."""
    known = {0.0: a, 1.0: b}

    def at(share: float) -> float:
        if share not in known:
            point = system.between(a, b, share)
            if point is None:
                raise ArithmeticError
            known[share] = point
        return events(system, known[share]).get(event, np.nan)

    try:
        share = float(brentq(at, 0.0, 1.0, xtol=1e-12, rtol=1e-12, maxiter=60))
        left = abs(at(share))
    except (ArithmeticError, RuntimeError, ValueError):
        return None
    jumped = not left <= 1e-3 * max(abs(at(0.0)), abs(at(1.0)))
    return None if jumped else (share, known[share])


def _crossings(system: ExtendedSystem, p: CurvePoint) -> tuple[int, ...]:
    """``WatchedPoint.crossings``."""
    flow = system.flow(p.z)
    if not flow.system.corners:
        return ()
    orbit = Orbit(OrbitStatus.PERIODIC, n=system.n, start=p.z[: system.states])
    counts = list(corner_crossings(flow, orbit))
    if isinstance(p.condition, Grazing) and p.condition.kind is PointKind.CORNER:
        own = p.condition.contact.clearance - len(flow.system.clearances)
        for number in {own, flow.system.corner_images[own]} - {-1}:
            counts[number] = 0
    return tuple(counts)


def _bisected(
    system: ExtendedSystem, a: CurvePoint, b: CurvePoint, *, corners: bool
) -> CodimensionTwo | None:
    """Where the counts of impacts, or how often corners are passed, change between two points:
    closed in on, then solved for.

    Its position is the share of the way.
    """

    def counts(p: CurvePoint) -> Index | tuple[int, ...]:
        return _crossings(system, p) if corners else p.impacts

    def met(p: CurvePoint, share: float, more: Sequence[Any]) -> CodimensionTwo:
        # The curve of a corner itself is that of any point of a branch.
        return CodimensionTwo(name, p, share, *(() if corners else more))

    name = meeting(a.condition.kind, PointKind.CORNER if corners else PointKind.GRAZING)
    low, high, found, beyond = 0.0, 1.0, a, b
    begun = counts(a)
    for halving in range(HALVINGS):
        middle = 0.5 * (low + high)
        point = system.between(a, b, middle)
        if point is None:
            break
        if np.array_equal(counts(point), begun):
            low, found = middle, point
        else:
            high, beyond = middle, point
        if halving in TRIES:
            reach = 2.0 * (high - low) * system.distance(a.z, b.z)
            if grazed := _grazing_within(system, found, reach, corners=corners):
                return met(grazed[0], low, grazed[1:])
    if high - low >= 1e-6:
        # No point lies between them at a corner; it is smooth from the side that is clear.
        reach = 2.0 * (high - low) * system.distance(a.z, b.z)
        for p in (found, beyond):
            if grazed := _grazing_within(system, p, reach, corners=corners):
                return met(grazed[0], low, grazed[1:])
        return None
    grazing, phase = next(iter(_turning(system, found, corners=corners)), (None, 0.0))
    return met(found, low, (grazing, np.array([phase])))


def _grazing_within(
    system: ExtendedSystem, p: CurvePoint, reach: float, *, corners: bool = False
) -> tuple[CurvePoint, Grazing, Array] | None:
    """The point no farther than ``reach`` from p at which a turning point touches its stop, or
    corner, with that condition and its unknowns."""
    for grazing, phase in _turning(system, p, corners=corners)[:2]:
        found = system.meet(p, grazing, np.array([phase]))
        found = _from_clear_of(system, p, grazing, phase) if found is None else found
        if found is not None and system.distance(p.z, found[0].z) <= reach:
            return found[0], grazing, found[1]
    return None


def _from_clear_of(
    system: ExtendedSystem, p: CurvePoint, grazing: Grazing, phase: float
) -> tuple[CurvePoint, Array] | None:
    """The meeting of a curve with a grazing from where the turning point is clear of its stop.

    Where it touches, multipliers change with the square root of the penetration, which misleads
    Newton's method. So the nearest orbit that grazes comes first; then the curve at two small
    distances from the stop, and the line through both. None on a grazing curve.
    """
    if isinstance(p.condition, Grazing):
        return None
    n = system.states
    _, turning = system.instead(p, grazing, np.array([phase]))
    if turning is None:
        return None
    near, extra = replace(p, z=np.delete(turning.z, n)), turning.z[n : n + 1]
    met = []
    for clear in BESIDE:
        found = system.meet(near, replace(grazing, clear=clear), extra)
        if found is None:
            return None
        near, extra = found
        met.append(np.concatenate([near.z, extra]))
    onward = (BESIDE[1] - grazing.clear) / (BESIDE[0] - BESIDE[1])
    on = met[1] + onward * (met[1] - met[0])
    return system.meet(replace(near, z=on[:-1]), grazing, on[-1:])


def grazing_near(system: ExtendedSystem, p: CurvePoint, index: int) -> CodimensionTwo | None:
    """Where a curve that cannot be followed past its point number ``index`` meets grazing: there it
    has a corner, for beyond it the multipliers change with the square root of the penetration."""
    if isinstance(p.condition, Grazing):
        return None
    if grazed := _grazing_within(system, p, CORNER):
        name = meeting(p.condition.kind, PointKind.GRAZING)
        return CodimensionTwo(name, grazed[0], float(index + 1), *grazed[1:])
    if cornered := _grazing_within(system, p, CORNER, corners=True):
        name = meeting(p.condition.kind, PointKind.CORNER)
        return CodimensionTwo(name, cornered[0], float(index + 1))
    return None


def _turning(
    system: ExtendedSystem, p: CurvePoint, *, corners: bool = False
) -> list[tuple[Grazing, float]]:
    """The orbit's turning points but the curve's own, nearest to its stop, or corner, first."""
    n = system.states
    own = (p.condition, float(p.z[n])) if isinstance(p.condition, Grazing) else None
    kinds = {"symmetric": system.symmetric, "corners": corners}
    return grazings(system.flow(p.z), p.z[:n], system.n, own, **kinds)


def partner(system: ExtendedSystem, p: CurvePoint) -> Array:
    """(states,) scaled: from the orbit to the one that it fell together with where it began.

    Half the orbit later, mirrored for odd n and as it is for even n; zeros where there is none.
    """
    flow, n = system.flow(p.z), system.n
    x = p.z[: system.states]
    if system.symmetric or (n % 2 and flow.system.mirror is None):
        return np.zeros(len(x))
    later = flow.run(x, n, points=2, stretches=n).strobes[-1]
    if n % 2:
        later = flow.system.mirror @ later
    return np.asarray((later - x) / system.scale[: len(x)])


def _falls_together(system: ExtendedSystem, a: WatchedPoint, b: WatchedPoint) -> str:
    """What the point is called where the orbit and its partner change places; "" elsewhere."""
    one, other = a.partner, b.partner
    if one @ other >= 0.0 or min(np.abs(one).max(), np.abs(other).max()) < FALLEN:
        return ""
    return ENDS[1] if system.n % 2 else ENDS[2]


def _nearest_to_partner(system: ExtendedSystem, a: WatchedPoint, b: WatchedPoint) -> Root | None:
    """The point where orbit and partner are one, by the secant alone: the curve's equations are
    singular there."""
    one, other = (float(np.linalg.norm(p.partner)) for p in (a, b))
    share = one / (one + other)
    for shift in (0.0, 1e-4, -1e-4, 1e-2, -1e-2):
        point = system.between(a.point, b.point, share + shift)
        if point is not None:
            return share + shift, point
    return None


def _pair(p: CurvePoint) -> float:
    """ln of the greatest modulus of a complex pair that the condition does not bind; 0 without."""
    others = p.condition.others(p.multipliers)
    pairs = others[np.abs(others.imag) > 1e-9 * np.abs(others)]
    return float(np.log(np.abs(pairs).max())) if len(pairs) else 0.0


def _second_derivative(system: ExtendedSystem, p: CurvePoint, condition: Multiplier) -> float:
    """u'·D²P(w, w) with the null vectors of J - 1."""
    n = system.states
    ends = []
    for sign in (1.0, -1.0):
        z = p.z.copy()
        z[:n] += sign * APART * condition.right * system.scale[:n]
        image = system.image(z)
        if image is None:
            return float("nan")
        ends.append(image.jacobian)
    return float(condition.left @ (ends[0] - ends[1]) @ condition.right) / (2.0 * APART)
