"""From one bifurcation curve to another of the same orbits, at a point of codimension two.

Both curves pass through the point; what else is unknown is the tangent of the other one.

- Two multipliers, or a multiplier and a pair: both curves are smooth there, the other is followed
  both ways (Kuznetsov, Elements of Applied Bifurcation Theory, chapter 9).
- 1:1 and 1:2 resonance: the curve on which a pair has the product 1 passes through the end of the
  torus curve. It is followed on the side on which the pair is complex.
- Grazing meets a curve of multipliers: a multiplier changes with the square root of the
  penetration, so the other curve is smooth only where the turning point is clear of its stop. It
  is begun on that side. The grazing curve itself is smooth, and is followed both ways.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from designer.base.arrays import Array, Index
from designer.base.record_check import read_record
from designer.bifurcations.codimension_two import CodimensionTwo
from designer.bifurcations.conditions import Condition, Grazing, Multiplier, MultiplierPair
from designer.bifurcations.extended_system import CurvePoint, ExtendedSystem
from designer.bifurcations.flow_family import FlowPlane
from designer.bifurcations.grazing_contact import GrazingContact
from designer.bifurcations.plane_curves import PlaneCurve, PlaneWindow, followed, system_at
from designer.bifurcations.points import PointKind
from designer.dynamics.counts import Counts

if TYPE_CHECKING:
    from designer.answers.bifurcation_answer import OtherCurveRow, TouchRow

CRITICAL = 1e-4
"""How far outside the unit circle a multiplier may lie that counts as one on it: two that are one
at a resonance are known to the square root of their product's error."""
DEPTHS = (1e-5, 1e-4, 1e-6)
"""How far clear of its stop a turning point is, over the displacement's peak, where the tangent of
a curve that ends at grazing is taken; the differences of the derivatives do not reach the stop."""
ASIDE = 1e-4
"""How far along the tangent, in scaled units, it is seen on which side a pair is complex."""


@dataclass(frozen=True)
class OtherCurve:
    """The orbit of a point of codimension two, on the other curve that passes there. Plain data."""

    kind: PointKind
    n: int
    """Period of the orbit, in drive periods."""
    symmetric: bool
    """Whether the curve's orbits are symmetric ones, found by the half-period map."""
    values: tuple[float, float]
    """The values of both parameters."""
    state: tuple[float, ...]
    """(states,) at the strobe."""
    stable: bool
    """Whether no multiplier lies outside the unit circle, so that a stable orbit may lie near."""
    touch: GrazingContact | None = None
    """The turning point of one of the two curves that grazes a stop; None where none does."""
    phase: float = 0.0
    """The phase of that turning point, in drive periods after the strobe."""
    size: float = 0.0
    """Peak of the displacement in its clearance."""

    def as_dict(self) -> OtherCurveRow:
        """The curve as plain data for JSON."""
        touch: TouchRow | None = None
        if self.touch is not None:
            touch = {
                "clearance": self.touch.clearance,
                "side": self.touch.side,
                "tip": self.touch.tip,
                "phase": self.phase,
                "size": self.size,
            }
        return {
            "kind": str(self.kind),
            "n": self.n,
            "state": list(self.state),
            "stable": self.stable,
            "touch": touch,
        }


def read_other_curve(
    row: Mapping[str, Any] | None, values: tuple[float, float], *, symmetric: bool
) -> OtherCurve | None:
    """The other curve from its plain data (``OtherCurve.as_dict``), or None of None.

    Raises
    ------
    ValueError, TypeError, LookupError : it is no curve's.
    """
    if row is None:
        return None
    own = {name: row[name] for name in ("kind", "n", "state", "stable")}
    own |= {"symmetric": symmetric, "values": values}
    if (touch := row["touch"]) is not None:
        contact = {each.name: touch[each.name] for each in fields(GrazingContact)}
        own |= {"touch": contact, "phase": touch["phase"], "size": touch["size"]}
    return read_record(OtherCurve, own)


def other_curve(system: ExtendedSystem, c: CodimensionTwo) -> OtherCurve | None:
    """What the other curve at a point of codimension two is begun from; None where there is no
    other curve of the same orbits."""
    if c.other is None:
        return None
    p, n = c.point, system.states
    stable = bool((np.abs(p.multipliers) < 1.0 + CRITICAL).all())
    plain = OtherCurve(
        c.other.kind, system.n, system.symmetric, p.values, tuple(p.z[:n].tolist()), stable
    )
    if isinstance(c.other, Grazing):
        return _with_grazing(plain, c.other, float(c.extra[0]))
    own = p.condition
    return _with_grazing(plain, own, float(p.z[n])) if isinstance(own, Grazing) else plain


def _with_grazing(plain: OtherCurve, grazing: Grazing, phase: float) -> OtherCurve:
    return replace(plain, touch=grazing.contact, phase=phase, size=grazing.size)


def switched(
    plane: FlowPlane,
    start: OtherCurve,
    name: str,
    window: PlaneWindow,
    *,
    progress: Callable[[], None] = lambda: None,
) -> PlaneCurve | None:
    """The other curve through a point of codimension two, on all sides on which it is defined.

    name : of the point; a curve that begins there has it for its first end. None where the curve
    cannot be begun. progress : called once a point.
    """
    grazing = None
    if start.touch is not None:
        grazing = Grazing(start.touch, start.n, start.size)
    if start.kind is PointKind.GRAZING and grazing is None:
        return None
    x = np.array(start.state)
    extra = np.array([start.phase] if start.kind is PointKind.GRAZING else [])
    system = system_at(plane, start.values, x, start.n, extra, window, symmetric=start.symmetric)
    z = np.concatenate([x, extra, start.values])
    image = system.image(z)
    if image is None:
        return None
    condition = _condition(start, image.jacobian, name, grazing)
    p = CurvePoint(z, image.jacobian, image.impacts, np.zeros(len(z)), condition, 0, 0.0)
    ways: tuple[float, ...] = (1.0, -1.0)
    if grazing is not None and start.kind is not PointKind.GRAZING:
        tangent, ways = _clear_of(system, p, grazing, start.phase), (1.0,)
    else:
        tangent = system.tangent(z, condition)
        if tangent is not None and isinstance(condition, MultiplierPair) and _is_end(name):
            ways = _complex_sides(system, p, condition, tangent)
    if tangent is None or not ways:
        return None
    origin = replace(p, tangent=tangent)
    response = str(_counts(system, image.impacts))
    return followed(system, origin, response, window, ways=ways, begun_at=name, progress=progress)


def _is_end(name: str) -> bool:
    """Whether a torus curve ends at a point of this name."""
    return name in ("1:1 resonance", "1:2 resonance")


def _condition(start: OtherCurve, jacobian: Array, name: str, grazing: Grazing | None) -> Condition:
    """The condition of the other curve, set up at the point."""
    if start.kind is PointKind.GRAZING:
        assert grazing is not None
        return grazing
    if start.kind is not PointKind.TORUS:
        return Multiplier.at(start.kind, jacobian)
    if not _is_end(name):
        return MultiplierPair.at(jacobian)
    values = np.linalg.eigvals(jacobian)
    # The multiplier, 1 or -1, that two are nearest to.
    value = min((1.0, -1.0), key=lambda v: float(np.sort(np.abs(values - v))[1]))
    return MultiplierPair(2.0 * value)


def _clear_of(
    system: ExtendedSystem, p: CurvePoint, grazing: Grazing, phase: float
) -> Array | None:
    """The tangent of a curve that ends at a grazing point, to the side on which the turning point
    is clear of its stop; None where no point lies there."""
    for depth in DEPTHS:
        met = system.meet(p, replace(grazing, clear=depth), np.array([phase]))
        if met is None or not np.array_equal(met[0].impacts, p.impacts):
            continue
        chord = (met[0].z - p.z) / system.scale
        tangent = system.tangent(met[0].z, p.condition)
        if tangent is not None:
            return tangent if tangent @ chord > 0.0 else -tangent
    return None


def _complex_sides(
    system: ExtendedSystem, p: CurvePoint, pair: MultiplierPair, tangent: Array
) -> tuple[float, ...]:
    """The directions along a tangent (1, -1) in which a pair that is real and double is complex."""
    out = []
    for way in (1.0, -1.0):
        image = system.image(p.z + way * ASIDE * system.scale * tangent)
        if image is not None and abs(pair.renewed(image.jacobian).total) < 2.0:
            out.append(way)
    return tuple(out)


def _counts(system: ExtendedSystem, impacts: Index) -> Counts:
    """n-p-q of an orbit from the impacts (clearances, 2) on lower and upper stops in one map."""
    pairs = [(int(upper), int(lower)) for lower, upper in impacts]
    if system.symmetric:
        pairs = [(p + q, p + q) for p, q in pairs]
    return Counts(system.n, tuple(pairs) or ((0, 0),))
