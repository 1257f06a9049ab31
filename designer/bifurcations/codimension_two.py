"""Points of codimension two on a bifurcation curve: what else happens on the way along it.

Each has a test function that changes sign there; between two points of the curve the root is found
by Brent's method along the curve, every value of it on a converged point.

- cusp: two folds meet, the second derivative of the map along the null vector is zero.
- 1:1 and 1:2 resonance: a second multiplier 1 (on a fold) or -1 (on a doubling); on a torus curve
  the ends, where the pair becomes real, and 1:3 and 1:4 where its sum is -1 and 0.
- Another multiplier 1 or -1, or another pair on the unit circle: fold-flip and its kin.
- Grazing meets another kind: a turning point touches a stop on the curve; on a grazing curve a
  multiplier reaches the unit circle, or a second turning point touches.
- Degenerate grazing: the turning point ceases to be one, its curvature is zero.
- Degenerate pitchfork and degenerate period doubling: the orbits of the curve fall together with
  those that they once left. The curve ends there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from designer.base.arrays import Array
from designer.bifurcations.conditions import Grazing, Multiplier, MultiplierPair, grazings
from designer.bifurcations.extended_system import CurvePoint, ExtendedSystem
from designer.bifurcations.points import PointKind

APART = 1e-5
"""In scaled units: step of the difference that gives the second derivative of the map."""
ORDER = (
    PointKind.GRAZING,
    PointKind.FOLD,
    PointKind.DOUBLING,
    PointKind.PITCHFORK,
    PointKind.TORUS,
)
"""In which the kinds that meet are named."""
SHORT = {PointKind.DOUBLING: "flip"}
ENDS = ("degenerate grazing", "degenerate pitchfork", "degenerate period doubling")
"""Those at which every curve ends."""
FALLEN = 1e-7
"""In scaled units: an orbit no farther than this from its partner has fallen together with it."""

HALVINGS, TRIES = 34, (5, 12)
"""Of an interval in which counts change; after so many of them the point itself is tried for."""
NEAREST, CORNER = 1e-6, 2e-2
"""In scaled units: first step from a curve's last point to the grazing that stops it, and how far
off that may be."""


@dataclass(frozen=True)
class CodimensionTwo:
    """A point of a curve at which a second thing happens."""

    name: str
    """What the point is called."""
    point: CurvePoint
    """The orbit there."""
    position: float
    """Where along the curve: the whole part is the number of the point before it."""
    other: PointKind | None = None
    """Kind of the other curve that meets this one here; None where it is the curve's own."""

    @property
    def values(self) -> tuple[float, float]:
        """Of both parameters."""
        return self.point.values

    def as_dict(self) -> dict[str, object]:
        """Plain, for JSON."""
        return {"kind": self.name, "values": list(self.values)}


Event = tuple[str, PointKind | None]
"""Name of a point of codimension two, and kind of the other curve."""


@dataclass(frozen=True)
class WatchedPoint:
    """A point of a curve, with what tells whether something happens on the way to the next."""

    point: CurvePoint
    """The point."""
    events: dict[Event, float]
    """The test functions there."""
    partner: Array
    """(states,) from the orbit to its partner; see ``partner``."""


def watched(system: ExtendedSystem, p: CurvePoint) -> WatchedPoint:
    """The point with its test functions, for ``locate`` on both sides of it."""
    return WatchedPoint(p, events(system, p), partner(system, p))


def events(system: ExtendedSystem, p: CurvePoint) -> dict[Event, float]:
    """The test functions at a point; a change of sign from one point to the next is an event."""
    kind = p.condition.kind
    flip = PointKind.PITCHFORK if system.symmetric else PointKind.DOUBLING
    characteristic = np.polynomial.Polynomial(np.poly(p.jacobian)[::-1])
    out: dict[Event, float] = {}
    if isinstance(p.condition, Multiplier):
        at, beside = p.condition.value, PointKind.FOLD if kind is not PointKind.FOLD else flip
        name = "1:1 resonance" if at > 0.0 else "1:2 resonance"
        out[name, None] = float(characteristic.deriv()(at))
        out[meeting(kind, beside), beside] = float(characteristic(-at))
        if kind is PointKind.FOLD:
            out["cusp", None] = _second_derivative(system, p, p.condition)
    elif isinstance(p.condition, MultiplierPair):
        for name, off in _resonances(p.condition.total, symmetric=system.symmetric).items():
            out[name, None] = off
        others = p.condition.others(p.multipliers)
        for value, beside in ((1.0, PointKind.FOLD), (-1.0, flip)):
            out[meeting(kind, beside), beside] = float(np.prod(value - others).real)
    elif isinstance(p.condition, Grazing):
        n = system.states
        phase = float(p.z[n])
        curvature = p.condition.curvature(system.flow(p.z), p.z[:n], phase)
        out["degenerate grazing", None] = curvature
        for value, beside in ((1.0, PointKind.FOLD), (-1.0, flip)):
            out[meeting(kind, beside), beside] = float(characteristic(value))
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
        return "two grazings" if one is PointKind.GRAZING else f"double {one}"
    a, b = sorted((one, other), key=ORDER.index)
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
    if not np.array_equal(a.impacts, b.impacts):
        kind = a.condition.kind
        event = (meeting(kind, PointKind.GRAZING), PointKind.GRAZING)
        found.append((event, _bisected(system, a, b)))
    ended = _falls_together(system, before, after)
    if ended:
        found.append(((ended, None), _nearest_to_partner(system, before, after)))
    out = [
        CodimensionTwo(name, root[1], index + root[0], other)
        for (name, other), root in found
        if root is not None
    ]
    return sorted(out, key=lambda c: c.position)


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


def _bisected(system: ExtendedSystem, a: CurvePoint, b: CurvePoint) -> Root | None:
    """Where the counts of impacts change between two points: closed in on, then solved for."""
    low, high, found = 0.0, 1.0, a
    for halving in range(HALVINGS):
        middle = 0.5 * (low + high)
        point = system.between(a, b, middle)
        if point is None:
            break
        if np.array_equal(point.impacts, a.impacts):
            low, found = middle, point
        else:
            high = middle
        if halving in TRIES and (root := _touching(system, found, high - low, a, b)):
            return low, root
    return (low, found) if high - low < 1e-6 else None


def _touching(
    system: ExtendedSystem, p: CurvePoint, width: float, a: CurvePoint, b: CurvePoint
) -> CurvePoint | None:
    """The point near p at which a turning point touches its stop, no farther than ``width`` of the
    way from a to b."""
    reach = 2.0 * width * system.distance(a.z, b.z)
    for grazing, phase in _turning(system, p)[:2]:
        found = system.meet(p, grazing, np.array([phase]))
        if found is not None and system.distance(p.z, found.z) <= reach:
            return found
    return None


def grazing_near(system: ExtendedSystem, p: CurvePoint, index: int) -> CodimensionTwo | None:
    """Where a curve that cannot be followed past its point number ``index`` meets grazing: there it
    has a corner, for beyond it the multipliers change with the square root of the penetration.

    On that side the curve hugs the grazing curve, by the square of the distance from the meeting.
    Along the grazing curve all is smooth, so it is followed to where the other kind happens too.
    """
    if isinstance(p.condition, Grazing):
        return None
    kind = p.condition.kind
    event = meeting(kind, PointKind.GRAZING), kind
    for grazing, phase in _turning(system, p)[:2]:
        touching, origin = system.instead(p, grazing, np.array([phase]))
        found = None if origin is None else _first_along(touching, origin, event)
        if found is None:
            continue
        own = replace(
            found,
            z=np.delete(found.z, system.states),
            tangent=p.tangent,
            condition=p.condition.renewed(found.jacobian),
        )
        if system.distance(p.z, own.z) <= CORNER:
            return CodimensionTwo(event[0], own, float(index + 1), PointKind.GRAZING)
    return None


def _first_along(system: ExtendedSystem, origin: CurvePoint, event: Event) -> CurvePoint | None:
    """The nearest point to the origin along its curve at which an event happens, either way, in
    steps that double; None within ``CORNER``."""
    ends, step = {1.0: origin, -1.0: origin}, NEAREST
    while step < CORNER:
        for way, before in list(ends.items()):
            guess = before.z + way * step * system.scale * before.tangent
            after = system.correct(guess, before.tangent, before.condition)
            if after is None:
                del ends[way]
                continue
            ends[way] = after
            one, other = (events(system, p).get(event, np.nan) for p in (before, after))
            if one * other < 0.0 and (root := _root(system, before, after, event)):
                return root[1]
        step *= 2.0
    return None


def _turning(system: ExtendedSystem, p: CurvePoint) -> list[tuple[Grazing, float]]:
    """The orbit's turning points but the curve's own, nearest to its stop first."""
    n = system.states
    own = (p.condition, float(p.z[n])) if isinstance(p.condition, Grazing) else None
    return grazings(system.flow(p.z), p.z[:n], system.n, own, symmetric=system.symmetric)


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
    """Where they are one: the curve's equations are singular there, so by the secant alone."""
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
