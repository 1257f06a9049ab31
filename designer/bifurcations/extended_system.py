"""The equations of a bifurcation curve over two parameters, and Newton's method on them.

A point is z = (x, extra, λ, μ): the state at the strobe, the condition's own unknowns and both
parameters. It obeys P(x, λ, μ) - x = 0, for the period's map P or the mirrored half-period map of
symmetric orbits, and the condition (``bifurcations.conditions``). That is one equation less than
there are unknowns: points are solved for on a hyperplane, as in ``bifurcations.orbit_curve``, so
that turns of the curve, in either parameter, are points like others. ∂P/∂x is exact, and so are
height and rate of a grazing by the state; all other derivatives are differences at the guess.
Broyden's formula then keeps them up.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from designer.base.arrays import Array, Index
from designer.bifurcations.conditions import DIFFERENCE, Both, Condition, MapSlopes
from designer.bifurcations.flow_family import FlowPlane
from designer.bifurcations.orbit_curve import CONVERGED, STALLED, MapImage, map_image
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Complex

NEWTON = 14
"""Most iterations of the corrector."""
FARTHEST = 1.0
"""The longest step of Newton's method, in scaled units."""
SLOW = 0.3
"""An iteration that leaves more of the residual than this has the derivatives computed anew."""
ASTRAY = 0.5
"""The most that a curve lies off its interpolation, over the distance between the two neighbouring
points."""


@dataclass(frozen=True)
class CurvePoint:
    """A point of a bifurcation curve."""

    z: Array
    """(unknowns,) state, the condition's unknowns, and both parameters."""
    jacobian: Array
    """(states, states) Jacobian of the map in scaled units."""
    impacts: Index
    """(clearances, 2) impacts on the lower and the upper stop in one map."""
    tangent: Array
    """(unknowns,) unit tangent in scaled units."""
    condition: Condition
    """The condition, set up at this point."""
    iterations: int
    """Steps of Newton's method that were spent."""
    residual: float
    """What was left of the equations, in scaled units."""

    @property
    def values(self) -> tuple[float, float]:
        """The values of both parameters."""
        return float(self.z[-2]), float(self.z[-1])

    @property
    def multipliers(self) -> Complex:
        """(states,) of the map."""
        return np.linalg.eigvals(self.jacobian).astype(complex)

    @property
    def stable_aside(self) -> bool:
        """Whether the orbit is stable on one side of the curve: all multipliers but those that the
        condition binds lie inside the unit circle."""
        others = self.condition.others(self.multipliers)
        return bool((np.abs(others) < 1.0).all())


@dataclass(frozen=True)
class _Value:
    """The equations at a point."""

    gap: Array
    """(states + conditions,) what is left of them, in scaled units."""
    jacobian: Array
    """(states, states) of the map, in scaled units."""
    impacts: Index
    """(clearances, 2) in one map."""


@dataclass(frozen=True)
class ExtendedSystem:
    """Periodic orbits over two parameters, to be held to a condition."""

    plane: FlowPlane
    """Flows by the two parameters."""
    n: int
    """Period of the orbits, in drive periods."""
    symmetric: bool
    """Whether they are those that the half-period map finds."""
    states: int
    scale: Array
    """(unknowns,) what each unknown is measured in: peaks, 1 for a phase, widths of the window."""

    def flow(self, z: Array) -> Flow:
        """The flow at a point's parameters."""
        return self.plane.flow(float(z[-2]), float(z[-1]))

    def image(self, z: Array) -> MapImage | None:
        """The image of a point's state, with the Jacobian in scaled units."""
        n = self.states
        found = map_image(self.flow(z), z[:n], self.n, symmetric=self.symmetric)
        if found is None:
            return None
        return replace(found, jacobian=found.jacobian * self.scale[:n] / self.scale[:n, None])

    def correct(
        self,
        guess: Array,
        border: Array,
        condition: Condition,
        along: Array | None = None,
    ) -> CurvePoint | None:
        """The point of the curve with border·(z - guess) = 0 in scaled units, by Newton's method.

        border : (unknowns,). along : orients the tangent (default: border). None where Newton's
        method does not converge or leaves the parameters' domain.
        """
        return self._solve(guess, border[None], condition, border if along is None else along)

    def meet(
        self, p: CurvePoint, other: Condition, extra: Array
    ) -> tuple[CurvePoint, Array] | None:
        """The orbit near a point of a curve that obeys another condition too, by Newton's method.

        extra : the other's own unknowns at p. The answer is a point of the same curve, whose
        tangent is that of p, and the other's unknowns there. None where there is none.
        """
        both = Both(p.condition, other)
        split = len(p.z) - 2
        scale = np.concatenate([self.scale[:split], np.ones(len(extra)), self.scale[split:]])
        system = replace(self, scale=scale)
        z = np.concatenate([p.z[:split], extra, p.z[split:]])
        found = system._solve(z, np.zeros((0, len(z))), both, np.zeros(len(z)))
        if found is None:
            return None
        own = np.concatenate([found.z[:split], found.z[-2:]])
        point = replace(
            found, z=own, tangent=p.tangent, condition=p.condition.renewed(found.jacobian)
        )
        return point, found.z[split:-2]

    def tangent(self, z: Array, condition: Condition) -> Array | None:
        """(unknowns,) of the curve at a point that obeys the equations, unit, in scaled units; None
        where the flow does not come to an end."""
        value = self._value(z, condition)
        rows = None if value is None else self._derivatives(z, value, condition)
        return None if rows is None else np.asarray(np.linalg.svd(rows)[2][-1])

    def instead(
        self, p: CurvePoint, other: Condition, extra: Array
    ) -> tuple[ExtendedSystem, CurvePoint | None]:
        """The equations of a condition in place of that of a point's curve, and the orbit that
        obeys them, sought across the curve from the point.

        extra : the other's own unknowns there. None where Newton's method finds none.
        """
        n = self.states
        scale, z, border = (
            np.concatenate([each[:n], own, each[-2:]])
            for each, own in (
                (self.scale, np.ones(len(extra))),
                (p.z, extra),
                (p.tangent, np.zeros(len(extra))),
            )
        )
        system = replace(self, scale=scale)
        return system, system.correct(z, border, other)

    def _solve(
        self, guess: Array, border: Array, condition: Condition, along: Array
    ) -> CurvePoint | None:
        """The point that solves the equations with a border (k, unknowns) of as many rows as they
        are short of; None where Newton's method finds none."""
        z = centre = np.array(guess, dtype=float)
        value = self._value(z, condition)
        if value is None:
            return None
        rows = self._derivatives(z, value, condition)
        derived = True
        for iteration in range(1, NEWTON + 1):
            if rows is None:
                return None
            gap = np.append(value.gap, border @ ((z - centre) / self.scale))
            error = float(np.abs(gap).max())
            if error < CONVERGED:
                return _point(z, value, rows, condition, iteration, along, error)
            try:
                step = -np.linalg.solve(np.vstack([rows, border]), gap)
            except np.linalg.LinAlgError:
                return None
            if not np.all(np.isfinite(step)) or np.abs(step).max() > FARTHEST:
                return None
            new = z + self.scale * step
            after = self._value(new, condition)
            if after is None:
                return None
            left = float(np.abs(after.gap).max())
            if left > SLOW * error:
                if derived and left > 0.5 * error and error < STALLED:
                    return _point(z, value, rows, condition, iteration, along, error)
                if left < FARTHEST:
                    z, value = new, after
                elif derived:
                    return None
                rows, derived = self._derivatives(z, value, condition), True
                continue
            change = after.gap - value.gap - rows @ step
            rows = rows + np.outer(change, step) / float(step @ step)
            z, value, derived = new, after, False
        return None

    def between(self, a: CurvePoint, b: CurvePoint, share: float) -> CurvePoint | None:
        """The point of the curve at a share of the way from a to b, share in [0, 1]; None where
        none lies near."""
        guess, chord = hermite(a, b, share, self.scale)
        length = float(np.linalg.norm(chord))
        found = self.correct(guess, chord / length, a.condition)
        if found is None or self.distance(found.z, guess) > ASTRAY * length:
            return None
        return found

    def distance(self, a: Array, b: Array) -> float:
        """Distance between two points, in scaled units."""
        return float(np.linalg.norm((b - a) / self.scale))

    def _value(self, z: Array, condition: Condition) -> _Value | None:
        """The equations at z; None outside the domain and where the flow does not end."""
        n = self.states
        if not np.all(np.isfinite(z)) or np.abs(z[:n] / self.scale[:n]).max() > 1e3:
            return None
        if not self.plane.contains(float(z[-2]), float(z[-1])):
            return None
        image = self.image(z)
        if image is None:
            return None
        held = condition.residual(self.flow(z), z[:n], z[n:-2], lambda: image.jacobian)
        if held is None:
            return None
        gap = (image.x - z[:n]) / self.scale[:n]
        return _Value(np.concatenate([gap, held]), image.jacobian, image.impacts)

    def _derivatives(self, z: Array, value: _Value, condition: Condition) -> Array | None:
        """(equations, unknowns) derivatives in scaled units."""
        n, total = self.states, len(z)
        rows = np.zeros((len(value.gap), total))
        rows[:n, :n] = value.jacobian - np.eye(n)
        image = MapSlopes(self.scale[:n], value.jacobian, lambda d: self._change(z, value, d))
        slopes = condition.slopes(self.flow(z), z[:n], z[n:-2], image)
        if slopes is None:
            return None
        rows[n:, : total - 2] = slopes
        for i in (total - 2, total - 1):
            shifted = z.copy()
            shifted[i] += DIFFERENCE * self.scale[i]
            sign = 1.0
            if not self.plane.contains(float(shifted[-2]), float(shifted[-1])):
                sign = -1.0
                shifted[i] = z[i] - DIFFERENCE * self.scale[i]
            after = self._value(shifted, condition)
            if after is None:
                return None
            rows[:, i] = (after.gap - value.gap) / (sign * DIFFERENCE)
        return rows

    def _change(self, z: Array, value: _Value, direction: Array) -> Array | None:
        """Derivative of the scaled Jacobian at z along a direction of the scaled states."""
        shifted, n = z.copy(), self.states
        shifted[:n] += DIFFERENCE * self.scale[:n] * direction
        image = self.image(shifted)
        return None if image is None else (image.jacobian - value.jacobian) / DIFFERENCE


def hermite(a: CurvePoint, b: CurvePoint, share: float, scale: Array) -> tuple[Array, Array]:
    """The cubic through two points with their tangents, at a share of the way (also beyond), and
    the chord between them in scaled units."""
    chord = (b.z - a.z) / scale
    length = float(np.linalg.norm(chord))
    ta = a.tangent * (1.0 if a.tangent @ chord > 0.0 else -1.0)
    tb = b.tangent * (1.0 if b.tangent @ chord > 0.0 else -1.0)
    s = share
    cubic = (
        (3.0 * s**2 - 2.0 * s**3) * chord
        + length * (s - 2.0 * s**2 + s**3) * ta
        + length * (s**3 - s**2) * tb
    )
    return a.z + scale * cubic, chord


def _point(
    z: Array,
    value: _Value,
    rows: Array,
    condition: Condition,
    iteration: int,
    along: Array,
    error: float,
) -> CurvePoint:
    """The point that Newton's method ended at, with the rows of its derivatives."""
    tangent = np.linalg.svd(rows)[2][-1]
    return CurvePoint(
        z,
        value.jacobian,
        value.impacts,
        tangent if tangent @ along >= 0.0 else -tangent,
        condition.renewed(value.jacobian),
        iteration,
        error,
    )
