"""What holds on a bifurcation curve beside that the orbit is periodic, as smooth equations.

- A multiplier σ (1 at a fold, -1 at a doubling or, of the half-period map, at a pitchfork): the
  scalar g of the bordered system [[J - σ, b], [c', 0]] [w; g] = [0; 1], which is zero where J - σ
  is singular (Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria, SIAM 2000,
  chapter 3). b and c are the last point's singular vectors.
- A pair of multipliers on the unit circle: the logarithm of its product. Product and sum of the
  pair are smooth also where it becomes real.
- Grazing: the height of one turning point over its stop and its rate are zero
  (``bifurcations.grazing_contact``); the phase of the turning point is a further unknown.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from designer.base.arrays import Array
from designer.bifurcations.grazing_contact import GrazingContact, height, height_along
from designer.bifurcations.points import PointKind
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Complex, Orbit, OrbitStatus
from designer.dynamics.piecewise_linear import PiecewiseLinearSystem
from designer.dynamics.turning_points import turning_points_of

Jacobian = Callable[[], Array | None]
"""Gives the (states, states) Jacobian of the map in scaled units; None where the flow fails."""
DIFFERENCE = 3e-8
"""The step of the differences, in scaled units."""
CLEAR = 3e-12
"""How far short of its stop a tip is held, and how far in it a dip, over the displacement's
peak. So the multipliers along the curve are those of the side that does not change with its
square root."""

SAME_PHASE = 1e-3
"""Turning points no farther apart than this, in drive periods, are one."""


@dataclass(frozen=True)
class MapSlopes:
    """The derivatives of the map at a state."""

    scale: Array
    """(states,) what the states are measured in."""
    jacobian: Array
    """(states, states) in scaled units."""
    change: Callable[[Array], Array | None]
    """Gives the derivative of the Jacobian along a direction, both in scaled units; None where the
    flow fails."""


class Condition(Protocol):
    """The equations of one kind of curve."""

    @property
    def kind(self) -> PointKind:
        """The kind of the curve."""
        ...

    @property
    def unknowns(self) -> int:
        """How many unknowns it adds beside state and parameters."""
        ...

    def residual(self, flow: Flow, x: Array, extra: Array, jacobian: Jacobian) -> Array | None:
        """(1 + unknowns,) zero on the curve; None where the flow does not come to an end."""
        ...

    def slopes(self, flow: Flow, x: Array, extra: Array, image: MapSlopes) -> Array | None:
        """(1 + unknowns, states + unknowns) derivatives of the residual by the scaled state and the
        condition's own unknowns; None where the flow does not come to an end."""
        ...

    def renewed(self, jacobian: Array) -> Condition:
        """The condition, set up at a point of the curve with this scaled Jacobian."""
        ...

    def others(self, multipliers: Complex) -> Complex:
        """The multipliers that the condition does not bind."""
        ...


@dataclass(frozen=True)
class Multiplier:
    """A real multiplier of the map is ``value``."""

    kind: PointKind
    """Fold, period doubling or pitchfork."""
    value: float
    """1 or -1."""
    left: Array
    """(states,) left null vector of J - value at the last point, unit, in scaled units."""
    right: Array
    """(states,) right null vector there."""
    unknowns: int = 0
    """None beside state and parameters."""

    @classmethod
    def at(cls, kind: PointKind, jacobian: Array) -> Multiplier:
        """The condition, set up at a located point with this scaled Jacobian."""
        value = 1.0 if kind is PointKind.FOLD else -1.0
        left, _, right = np.linalg.svd(jacobian - value * np.eye(len(jacobian)))
        return cls(kind, value, left[:, -1], right[-1])

    def residual(self, flow: Flow, x: Array, extra: Array, jacobian: Jacobian) -> Array | None:
        """(1,) g of the bordered system."""
        J = jacobian()
        if J is None:
            return None
        try:
            return np.linalg.solve(self._bordered(J), np.eye(len(J) + 1)[-1])[-1:]
        except np.linalg.LinAlgError:
            return None

    def slopes(self, flow: Flow, x: Array, extra: Array, image: MapSlopes) -> Array | None:
        """(1, states) -v'·D²P(w, ·) with the solutions w and v of the bordered system and of its
        transpose: second derivatives commute, so one difference along w gives them all."""
        matrix, unit = self._bordered(image.jacobian), np.eye(len(x) + 1)[-1]
        try:
            right, left = np.linalg.solve(matrix, unit), np.linalg.solve(matrix.T, unit)
        except np.linalg.LinAlgError:
            return None
        change = image.change(right[:-1])
        return None if change is None else -(left[:-1] @ change)[None]

    def _bordered(self, J: Array) -> Array:
        """(states + 1, states + 1) matrix of the system that gives g."""
        size = len(J)
        matrix = np.zeros((size + 1, size + 1))
        matrix[:size, :size] = J - self.value * np.eye(size)
        matrix[:size, size] = self.left
        matrix[size, :size] = self.right
        return matrix

    def renewed(self, jacobian: Array) -> Multiplier:
        """The condition with this Jacobian's null vectors, turned as those before."""
        new = Multiplier.at(self.kind, jacobian)
        left = new.left if new.left @ self.left >= 0.0 else -new.left
        right = new.right if new.right @ self.right >= 0.0 else -new.right
        return replace(self, left=left, right=right)

    def others(self, multipliers: Complex) -> Complex:
        """All multipliers but the one nearest to ``value``."""
        return np.delete(multipliers, int(np.argmin(np.abs(multipliers - self.value))))


@dataclass(frozen=True)
class MultiplierPair:
    """A pair of multipliers has the product 1."""

    total: float
    """Sum of the pair at the last point."""
    kind: PointKind = PointKind.TORUS
    unknowns: int = 0
    """None beside state and parameters."""

    @classmethod
    def at(cls, jacobian: Array) -> MultiplierPair:
        """The condition, set up at a located point with this scaled Jacobian."""
        values = np.linalg.eigvals(jacobian).astype(complex)
        complex_ones = values[np.abs(values.imag) > 1e-9 * np.abs(values)]
        nearest = complex_ones[np.argmin(np.abs(np.abs(complex_ones) - 1.0))]
        return cls(2.0 * float(nearest.real))

    def residual(self, flow: Flow, x: Array, extra: Array, jacobian: Jacobian) -> Array | None:
        """(1,) logarithm of the product."""
        J = jacobian()
        if J is None:
            return None
        return np.array([self._logarithm(J)])

    def slopes(self, flow: Flow, x: Array, extra: Array, image: MapSlopes) -> Array | None:
        """(1, states) by differences along each state."""
        begun = self._logarithm(image.jacobian)
        slopes = []
        for direction in np.eye(len(x)):
            change = image.change(direction)
            if change is None:
                return None
            shifted = self._logarithm(image.jacobian + DIFFERENCE * change)
            slopes.append((shifted - begun) / DIFFERENCE)
        return np.array([slopes])

    def _logarithm(self, jacobian: Array) -> float:
        """The logarithm of the modulus of the pair's product."""
        values = np.linalg.eigvals(jacobian).astype(complex)
        i, j = self._places(values)
        return float(np.log(abs(values[i] * values[j])))

    def renewed(self, jacobian: Array) -> MultiplierPair:
        """The condition with this Jacobian's pair."""
        values = np.linalg.eigvals(jacobian).astype(complex)
        i, j = self._places(values)
        return replace(self, total=float((values[i] + values[j]).real))

    def others(self, multipliers: Complex) -> Complex:
        """All multipliers but the pair."""
        return np.delete(multipliers, self._places(multipliers))

    def _places(self, values: Complex) -> tuple[int, int]:
        """The two with product nearest to 1 and sum nearest to the last one's."""

        def off(pair: tuple[int, int]) -> float:
            a, b = values[pair[0]], values[pair[1]]
            return float(abs(a * b - 1.0) + abs(a + b - self.total))

        pairs = [(i, j) for i in range(len(values)) for j in range(i)]
        return min(pairs, key=off)


@dataclass(frozen=True)
class Grazing:
    """The condition that a turning point grazes a stop."""

    contact: GrazingContact
    """Which turning point grazes which stop."""
    n: int
    """Period of the orbit, in drive periods."""
    size: float
    """Peak of the displacement in the clearance."""
    kind: PointKind = PointKind.GRAZING
    """Grazing, or a corner."""
    unknowns: int = 1
    """The phase of the turning point, in drive periods."""
    clear: float = CLEAR
    """How far clear of its stop the turning point is held; see ``CLEAR``."""

    def residual(self, flow: Flow, x: Array, extra: Array, jacobian: Jacobian) -> Array | None:
        """(2,) height, and its rate by the phase, over the peak."""
        found = height(flow, x, self.n, self.contact, float(extra[0]))
        if found is None:
            return None
        clear = self.clear if self.contact.tip else -self.clear
        return np.array([found[0] / self.size + clear, found[1] / self.size])

    def slopes(self, flow: Flow, x: Array, extra: Array, image: MapSlopes) -> Array | None:
        """(2, states + 1) of height and rate, by the linearised flow."""
        found = height_along(flow, x, self.n, self.contact, float(extra[0]), np.diag(image.scale))
        if found is None:
            return None
        return np.column_stack([found[:2, 1:], found[1:, 0]]) / self.size

    def curvature(self, flow: Flow, x: Array, phase: float) -> float:
        """Second derivative of the height by the phase, over the peak; negative at a tip."""
        found = height(flow, x, self.n, self.contact, phase)
        return float("nan") if found is None else float(found[2]) / self.size

    def renewed(self, jacobian: Array) -> Grazing:
        """The condition itself: it has nothing to set up."""
        return self

    def others(self, multipliers: Complex) -> Complex:
        """All multipliers: grazing binds none."""
        return multipliers


@dataclass(frozen=True)
class Both:
    """Two conditions at once: a point of codimension two."""

    first: Condition
    """The curve's own."""
    second: Condition
    """What holds too."""

    @property
    def kind(self) -> PointKind:
        """The kind of the first condition."""
        return self.first.kind

    @property
    def unknowns(self) -> int:
        """The unknowns of the first condition, then those of the second."""
        return self.first.unknowns + self.second.unknowns

    def residual(self, flow: Flow, x: Array, extra: Array, jacobian: Jacobian) -> Array | None:
        """The residuals of both conditions, one after the other."""
        split = self.first.unknowns
        parts = [
            self.first.residual(flow, x, extra[:split], jacobian),
            self.second.residual(flow, x, extra[split:], jacobian),
        ]
        held = [part for part in parts if part is not None]
        return np.concatenate(held) if len(held) == 2 else None

    def slopes(self, flow: Flow, x: Array, extra: Array, image: MapSlopes) -> Array | None:
        """The slopes of both conditions, each in the columns of the state and of its own
        unknowns."""
        n, split = len(x), self.first.unknowns
        one = self.first.slopes(flow, x, extra[:split], image)
        other = self.second.slopes(flow, x, extra[split:], image)
        if one is None or other is None:
            return None
        out = np.zeros((len(one) + len(other), n + self.unknowns))
        out[: len(one), : n + split] = one
        out[len(one) :, :n], out[len(one) :, n + split :] = other[:, :n], other[:, n:]
        return out

    def renewed(self, jacobian: Array) -> Both:
        """Both conditions, set up at a point."""
        return Both(self.first.renewed(jacobian), self.second.renewed(jacobian))

    def others(self, multipliers: Complex) -> Complex:
        """The multipliers that the first condition does not bind."""
        return self.first.others(multipliers)


def grazings(
    flow: Flow,
    x: Array,
    n: int,
    but: tuple[Grazing, float] | None = None,
    *,
    symmetric: bool = False,
    corners: bool = False,
) -> list[tuple[Grazing, float]]:
    """The turning points of an orbit as what may graze, nearest to its stop first, each with its
    phase. but : one that is left out, and its mirror image. symmetric : whether the second half of
    the orbit is the mirror image of the first, in which case that tells all. corners : those at
    corners of laws in the place of those at stops."""
    orbit = Orbit(OrbitStatus.PERIODIC, n=n, start=x)
    spans = np.abs(flow.run(x, n, measure=True).spans).max(axis=1, initial=0.0)
    first, kind = len(flow.system.clearances), PointKind.GRAZING
    numbers = range(first)
    if corners:
        numbers, kind = range(first, first + len(flow.system.corners)), PointKind.CORNER
    near = sorted(turning_points_of(flow, orbit, numbers), key=lambda t: abs(t.height))
    out = []
    for t in near:
        if symmetric and t.phase >= 0.5 * n:
            continue
        contact = GrazingContact(t.clearance, t.side, t.tip)
        if but is None or not _is_same(flow.system, contact, t.phase, *but):
            own = [abs(other.height) for other in near if other.clearance == t.clearance]
            size = max(own) if corners else float(spans[t.clearance])
            out.append((Grazing(contact, n, size, kind), t.phase))
    return out


def _is_same(
    system: PiecewiseLinearSystem, contact: GrazingContact, phase: float, other: Grazing, at: float
) -> bool:
    """Whether two turning points are one, or mirror images of each other on a symmetric orbit."""
    n, shift = other.n, 0.0
    if contact != other.contact:
        if _image(system, contact) != other.contact:
            return False
        shift = 0.5 * n
    off = (phase - at - shift) % n
    return min(off, n - off) < SAME_PHASE


def _image(system: PiecewiseLinearSystem, contact: GrazingContact) -> GrazingContact | None:
    """The same turning point on the mirror image of an orbit; None where there is none."""
    first = len(system.clearances)
    if contact.clearance >= first:
        number = system.corner_images[contact.clearance - first]
        return None if number < 0 else replace(contact, clearance=first + number)
    return None if system.mirror is None else replace(contact, side=-contact.side)
