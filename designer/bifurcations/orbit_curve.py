"""The curve of periodic orbits over a parameter, point by point.

A point is y = (x, λ): the state x at the strobe and the parameter λ, with F(x, λ) = P(x, λ) - x = 0
for the n-period map P, or for symmetric orbits of odd n with P the half-period map followed by the
mirror. The latter's Jacobian H has H² for monodromy, and it cannot leave for an asymmetric branch.
Points are solved for on a hyperplane t·(y - y0) = 0, by Newton on the bordered system (Keller's
pseudo-arclength), so that folds, where λ turns back, are points like others. All of y is measured
in ``scale``: the peak of each state and the size of λ.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array, Index
from designer.base.errors import InputError
from designer.bifurcations.flow_family import Family
from designer.dynamics.attractors import peaks_near
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowStatus

NEWTON = 10
"""Most iterations of the corrector."""
CONVERGED, STALLED = 1e-12, 1e-9
"""Of the peak: how far the map moves a converged point; where rounding, magnified by the flow,
stops Newton's method earlier, up to the second."""
SETTLED = 1e-7
"""Of the peak: nearer than this to the curve ∂P/∂λ is not computed anew."""
DIFFERENCE = 3e-8
"""Of the parameter's size: step of the central difference for ∂P/∂λ; wider ones reach across
grazing points that lie near, narrower ones drown in rounding."""
ASTRAY = 1.0
"""Of the distance between two neighbouring points: the most that the curve between them lies off
their chord. It does not turn by more than ``continuation.TURN`` from one to the next."""


@dataclass(frozen=True)
class MapImage:
    """What the map of an orbit's period makes of a state."""

    x: Array
    """(states,) image of the state."""
    jacobian: Array
    """(states, states) Jacobian of the map there."""
    impacts: Index
    """(clearances, 2) impacts on the lower and the upper stop on the way."""


def map_image(flow: Flow, x: Array, n: int, *, symmetric: bool) -> MapImage | None:
    """The image of x under the n-period map, or the mirrored half-period one of symmetric orbits.

    None where the flow does not come to an end.
    """
    eye = np.eye(len(x))
    if symmetric:
        run = flow.run(x, n, points=2, stretches=n, tangent=eye)
    else:
        run = flow.run(x, n, tangent=eye)
    if run.status is not FlowStatus.DONE or run.tangent is None:
        return None
    impacts = run.counts.sum(axis=0)
    if not symmetric:
        return MapImage(run.strobes[-1], run.tangent, impacts)
    mirror = flow.system.mirror
    assert mirror is not None
    return MapImage(mirror @ run.strobes[-1], mirror @ run.tangent, impacts)


@dataclass(frozen=True)
class Solved:
    """A point of the curve."""

    y: Array
    """(states + 1,) state and parameter."""
    jacobian: Array
    """(states, states) Jacobian of the map."""
    tangent: Array
    """(states + 1,) unit tangent in scaled units, oriented as it was asked for."""
    iterations: int
    """Steps of Newton's method that were spent."""
    residual: float
    """How far the map moves x, or y lies off its hyperplane, in scaled units; more than
    ``CONVERGED`` where Newton's method stalled."""

    @property
    def value(self) -> float:
        """Value of the parameter."""
        return float(self.y[-1])

    @property
    def x(self) -> Array:
        """(states,) at the strobe."""
        return self.y[:-1]


@dataclass(frozen=True)
class Curve:
    """Periodic orbits of a family along its parameter."""

    family: Family
    n: int
    """Period of the orbits, in drive periods."""
    symmetric: bool
    """Whether they are those that the half-period map finds."""
    scale: Array
    """(states + 1,) what state and parameter are measured in."""

    @classmethod
    def through(cls, family: Family, x: Array, value: float, n: int, symmetric: bool) -> Curve:
        """The curve near state x at a value of the parameter, with its scale.

        Raises
        ------
        InputError : symmetric orbits of even n, or of a system without a mirror.
        """
        flow = family.flow(value)
        if symmetric and (n % 2 == 0 or flow.system.mirror is None):
            raise InputError(None, "n", n, "an odd period of a system with a mirror")
        size = abs(value) if value else 1.0
        return cls(family, n, symmetric, np.append(peaks_near(flow, x), size))

    def image(self, x: Array, value: float) -> tuple[Array, Array] | None:
        """P(x) and its Jacobian at a value, or None where the flow does not come to an end."""
        image = map_image(self.family.flow(value), x, self.n, symmetric=self.symmetric)
        return None if image is None else (image.x, image.jacobian)

    def slope(self, x: Array, value: float) -> Array | None:
        """(states,) ∂P/∂λ, by a central difference of the exact flow inside the domain."""
        h = DIFFERENCE * float(self.scale[-1])
        ends = [v for v in (value - h, value + h) if self.family.contains(v)]
        if len(ends) < 2:
            ends = sorted([value, *ends])
        images = [self.image(x, v) for v in ends]
        if len(ends) < 2 or images[0] is None or images[1] is None:
            return None
        return np.asarray((images[1][0] - images[0][0]) / (ends[1] - ends[0]))

    def correct(
        self, y0: Array, border: Array, along: Array | None = None, centre: Array | None = None
    ) -> Solved | None:
        """The point of the curve with border·(y - centre) = 0 in scaled units, by Newton from y0.

        border : (states + 1,). centre : y0 by default. along : orients the tangent of the answer
        (default: border). None where Newton's method does not converge or leaves the domain.
        """
        y, last = np.array(y0, dtype=float), np.inf
        centre = np.array(y0 if centre is None else centre, dtype=float)
        size, scale = len(y) - 1, self.scale
        slope: Array | None = None
        for iteration in range(1, NEWTON + 1):
            if not np.all(np.isfinite(y)) or np.abs(y / scale)[:size].max() > 1e3:
                return None
            if not self.family.contains(float(y[-1])):
                return None
            image = self.image(y[:-1], float(y[-1]))
            if image is None:
                return None
            gap = (image[0] - y[:-1]) / scale[:-1]
            if slope is None or float(np.abs(gap).max()) > SETTLED:
                slope = self.slope(y[:-1], float(y[-1]))
            if slope is None:
                return None
            matrix = np.zeros((size + 1, size + 1))
            scaled = image[1] * scale[:-1] / scale[:-1, None]
            matrix[:size, :size] = scaled - np.eye(size)
            matrix[:size, size] = slope * scale[-1] / scale[:-1]
            matrix[size] = border
            aside = float(border @ ((y - centre) / scale))
            error = max(float(np.abs(gap).max()), abs(aside))
            if error < CONVERGED or (error < STALLED and error >= 0.5 * last):
                tangent = _null(matrix[:size], border if along is None else along)
                return Solved(y, image[1], tangent, iteration, error)
            try:
                step = np.linalg.solve(matrix, np.append(gap, aside))
            except np.linalg.LinAlgError:
                return None
            y = y - scale * step
            last = error
        return None

    def near(self, x: Array, value: float, sign: float = 1.0) -> Solved | None:
        """The orbit near x at a fixed value, tangent towards greater (sign 1) or less values."""
        border = np.zeros(len(x) + 1)
        border[-1] = sign
        return self.correct(np.append(x, value), border)

    def between(self, a: Solved, b: Solved, s: float) -> Solved | None:
        """The point of the curve at a share s of the way from a to b, s in [0, 1].

        None where none lies near: Newton's method may find another branch on the same hyperplane.
        """
        chord = (b.y - a.y) / self.scale
        length = float(np.linalg.norm(chord))
        # Hermite's cubic: the tangents at both ends are known.
        ta = a.tangent * (1.0 if a.tangent @ chord > 0.0 else -1.0)
        tb = b.tangent * (1.0 if b.tangent @ chord > 0.0 else -1.0)
        guess = a.y + self.scale * (
            (3.0 * s**2 - 2.0 * s**3) * chord
            + length * ((s - 2.0 * s**2 + s**3) * ta + (s**3 - s**2) * tb)
        )
        centre = a.y + s * (b.y - a.y)
        solved = self.correct(guess, chord / length, centre=centre)
        if solved is None or np.linalg.norm((solved.y - centre) / self.scale) > ASTRAY * length:
            return None
        return solved

    def monodromy(self, solved: Solved) -> Array:
        """(states, states) of the n-period map."""
        J = solved.jacobian
        return np.asarray(J @ J if self.symmetric else J)

    def distance(self, a: Solved, b: Solved) -> float:
        """Distance between two points, in scaled units."""
        return float(np.linalg.norm((b.y - a.y) / self.scale))


def _null(rows: Array, along: Array) -> Array:
    """The unit vector that the rows (n, n + 1) map to nought, with along·vector >= 0."""
    vector = np.linalg.svd(rows)[2][-1]
    return np.asarray(vector if vector @ along >= 0.0 else -vector)
