"""The curve of a record with the shape that the board behind it gives.

A curve by the record alone has hundreds of free numbers. A board of the spread has about ten that a
record tells, and they say how its displacements move between the samples. So the most probable
board's orbit is taken off the record, and only what is left of it is smoothed, by few knots: that
takes up what the exact circuit leaves out. One curve draws the displacement's samples and those of
the dead zone's output, which in contact tell the displacement several times better. Where the stops
are follows from the same samples.

How likely contact with a stop is at an extreme of the displacement is told by the samples about it.
The displacement's curve says how far the extreme is from the stop, with an error. Whatever that is,
it says the course of the dead zone's output about the extreme too: its samples there, which the
curve itself does not rest on, are held against every distance.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from designer.base.arrays import Array, Index, Mask
from designer.base.errors import DesignerError
from designer.workbench.board_fit import BoardFit, fit_board
from designer.workbench.contact_count import PROMINENT, extremes
from designer.workbench.dead_zone_curve import DeadZoneCurve, fitted
from designer.workbench.folding import POINTS, RIDGE, Fold, Samples, best_knots, fold, spline_basis
from designer.workbench.observation import observe
from designer.workbench.prediction import BoardPrediction, PredictedStop
from designer.workbench.record import RecordedMotion

FAR = 8.0
"""Standard errors beyond which the curve alone decides."""
DISTANCES = 321
"""Distances that are tried within ``FAR`` of either side of the curve's own."""


@dataclass(frozen=True)
class ContactLikelihood:
    """What a curve and the samples near a stop say of contact with it; positive is beyond it."""

    trace: Array
    """(k,) the displacement less the stop along a lap [V]."""
    errors: Array
    """(k,) standard error of it [V]."""
    noise: float
    """Standard error from one extreme to the next [V]."""
    place: Array
    """(m,) points of the lap at which samples near the stop were taken."""
    depth: Array
    """(m,) the depth of the contact [V] by the output there: 0 but for noise without contact."""
    depth_error: float
    """Standard deviation of the noise of one [V]."""

    @cached_property
    def _turns(self) -> Index:
        return np.sort(extremes(self.trace, PROMINENT * self.noise))

    def ratio(self, at: int) -> float:
        """Logarithm of the likelihood of contact over that of none at an extreme, each at the
        distance from the stop that is best for it."""
        curve, error = float(self.trace[at]), float(self.errors[at])
        if abs(curve) > FAR * error:
            return 0.5 * curve * abs(curve) / error**2
        beyond = np.append(curve + error * np.linspace(-FAR, FAR, DISTANCES), 0.0)
        here = self._about(at)
        closed = np.append(self.trace, self.trace[0])
        shape = np.interp(self.place[here], np.arange(len(closed)), closed) - curve
        left = self.depth[here] - np.maximum(beyond[:, None] + shape, 0.0)
        squares = (left**2).sum(axis=1) / self.depth_error**2 + ((beyond - curve) / error) ** 2
        without, touching = squares[beyond <= 0.0].min(), squares[beyond >= 0.0].min()
        return float(0.5 * (without - touching))

    def _about(self, at: int) -> Mask:
        """(m,) which samples lie between the extremes on either side."""
        size, turns = len(self.trace), self._turns
        others = (turns - at) % size
        others = others[others > 0]
        after = int(others.min(initial=size))
        before = size - int(others.max(initial=0))
        way = (self.place - at + 0.5 * size) % size - 0.5 * size
        return np.asarray((way > -before) & (way < after))


SURE = 4.5
"""Logarithm of the ratio of the likelihoods at which an extreme of this curve is decided: three
standard errors."""
KNOTS = (16, 32, 64)
"""Knots of a drive period that are tried for what the orbit leaves over."""
MODEL = 1e-4
"""Of the peak: the least error of such a curve."""
EXTREME = 0.5
"""Of the error of a point: from one extreme to the next, where the orbit has the shape."""
NEAR = 5.0
"""Standard errors of the displacement: samples nearer to a stop are not taken for free of it, nor
for in contact."""
GOOD = 4.0
"""Misfit up to which an orbit may shape the curve: the knots take up the rest."""
ROOM = 1.25
"""How much more than the noise the curve may leave over."""
ROUGH, CORNER = 2.0, 1e-3
"""How much more than its noise the dead zone may leave of the output's samples; and of their range,
what it may leave of those without noise."""
ROUNDS = 2
"""Linear fits, one after the other: a gain times a displacement is not linear in both."""


def board_evidence(
    curve: Fold,
    samples: Samples,
    motion: RecordedMotion,
    nets: Sequence[str],
    prediction: BoardPrediction,
    zones: Mapping[str, DeadZoneCurve],
) -> dict[tuple[int, int], ContactLikelihood]:
    """What the displacements say of contact, by the number of the clearance and the side of the
    stop; nothing where no board of the spread draws the record.

    curve : by the record alone. zones : by clearance, the stages whose output was recorded.
    """
    stops = [stop for stop in prediction.stops if stop.clearance in zones]
    moving = tuple(dict.fromkeys(net for stop in stops for net in stop.displacement))
    fit = _fit(motion, curve.n, moving, prediction) if moving else None
    if fit is None:
        return {}
    orbit = _Orbit.of(fit, curve.n, samples, motion.frequency, moving)
    return {
        (prediction.stops.index(stop), side): evidence
        for stop in stops
        for side, evidence in _beyond(
            stop, zones[stop.clearance], orbit, samples, motion.frequency, nets
        )
    }


def _fit(
    motion: RecordedMotion, n: int, nets: Sequence[str], prediction: BoardPrediction
) -> BoardFit | None:
    """The board behind the record; None where none of the spread draws it."""
    try:
        seen = observe(motion, nets, prediction.setting_of(motion), n=n)
        fit = fit_board(prediction.prior, [seen], [prediction.starts(motion.frequency)])
    except DesignerError:  # a setting that nobody knows, or no such board
        return None
    return fit if max(fit.misfits) < GOOD else None


@dataclass(frozen=True)
class _Orbit:
    """The fitted orbit as the record shows it: at the samples, and along a lap."""

    nets: tuple[str, ...]
    sampled: Array
    lap: Array

    @classmethod
    def of(
        cls, fit: BoardFit, n: int, samples: Samples, frequency: float, nets: tuple[str, ...]
    ) -> _Orbit:
        first = fit.observations[0].first
        sampled = fit.shown(0, first + frequency * samples.time)
        return cls(nets, sampled, fit.shown(0, first + np.arange(n * POINTS) / POINTS))

    def displacement(self, volts: Array, stop: PredictedStop) -> Array:
        """(k,) of voltages (k, nets)."""
        moved = sum(f * volts[:, self.nets.index(net)] for net, f in stop.displacement.items())
        return np.asarray(moved)


def _beyond(
    stop: PredictedStop,
    zone: DeadZoneCurve,
    orbit: _Orbit,
    samples: Samples,
    frequency: float,
    nets: Sequence[str],
) -> Iterator[tuple[int, ContactLikelihood]]:
    """By side what is known of contact: of one curve of the displacement, which draws its own
    samples and, through the dead zone, those of the output that are not near a stop."""
    n, volts = len(orbit.lap) // POINTS, samples.values[:, nets.index(stop.output)]
    moved, lap = orbit.displacement(orbit.sampled, stop), orbit.displacement(orbit.lap, stop)
    made_of = [(nets.index(net), factor) for net, factor in stop.displacement.items()]
    seen = np.asarray(sum(factor * samples.values[:, place] for place, factor in made_of))
    noise = math.hypot(*(factor * samples.noise[place] for place, factor in made_of))
    rest = replace(samples, values=(seen - moved)[:, None], noise=np.array([noise]))
    (knots,) = best_knots(rest, frequency, KNOTS)
    more = fold(rest, frequency, n, knots)
    if more.left[0] > ROOM * noise:
        return
    phase = (samples.time * frequency) % n
    grid = np.arange(n * POINTS + 1) / POINTS
    curve = lap + more.curve[:, 0]
    moved = moved + np.interp(phase, grid, np.append(more.curve, more.curve[0]))
    like = replace(stop, ends=zone.ends, inside=zone.inside, gains=zone.gains)
    rough = float(np.std(volts - like.output_of(moved)))
    # An output that no dead zone draws says nothing of where its stops are: it may be cut off.
    quiet = math.hypot(float(samples.noise[nets.index(stop.output)]), CORNER * float(np.ptp(volts)))
    if rough > ROUGH * quiet:
        return
    error = float(more.error[0])
    first = fitted(moved, volts, (error, rough), like, len(volts))
    near = np.any([np.abs(moved - end) < NEAR * error for end in first.ends.values()], axis=0)
    basis = spline_basis(phase * knots, n * knots)
    along = spline_basis(np.arange(n * POINTS) * knots / POINTS, n * knots)
    known = _Joint(first, np.zeros(n * knots), np.zeros((0, 0)))
    for _ in range(ROUNDS):
        known = _joined(known, basis, (seen, moved, volts), float(more.left[0]), rough, near)
    curve, moved = curve + along @ known.knots, moved + basis @ known.knots
    for side in known.sides:
        gain, end = known.zone.gains[side], known.zone.ends[side]
        errors = np.hypot(known.errors(along, side), MODEL * np.abs(curve).max())
        yield (
            side,
            ContactLikelihood(
                trace=side * (curve - end),
                errors=errors,
                noise=EXTREME * float(np.median(errors)),
                place=phase[near] * POINTS,
                depth=side * known.zone.excess(moved[near], volts[near]) / gain,
                depth_error=rough / abs(gain),
            ),
        )


@dataclass(frozen=True)
class _Joint:
    """A dead zone with what is to be added to the displacement's curve, by its knots (k,), and the
    covariance of the knots, the line inside and each reached side's end and gain."""

    zone: DeadZoneCurve
    knots: Array
    covariance: Array

    @property
    def sides(self) -> list[int]:
        return [side for side, error in self.zone.end_errors.items() if math.isfinite(error)]

    def errors(self, along: sparse.csr_array, side: int) -> Array:
        """(m,) standard error of the displacement beyond a stop at points of a lap."""
        k, C = len(self.knots), self.covariance
        end = k + 2 + 2 * self.sides.index(side)
        own = np.asarray(along.multiply(along @ C[:k, :k]).sum(axis=1)).ravel()
        variance = own - 2.0 * (along @ C[:k, end]) + C[end, end]
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def _joined(
    known: _Joint,
    basis: sparse.csr_array,
    waves: tuple[Array, Array, Array],
    noise: float,
    rough: float,
    near: Mask,
) -> _Joint:
    """Curve and dead zone by least squares, linear about what is known.

    basis : (m, k) of the knots at the samples. waves : (m,) the displacement as recorded, its curve
    without the knots, the output [V]. noise, rough : standard deviations of the two. near : (m,)
    outputs that are left out.
    """
    seen, moved, volts = waves
    zone, k = known.zone, len(known.knots)
    now = moved + basis @ known.knots
    slope, expected = np.full(len(now), zone.inside[1]), zone.inside[0] + zone.inside[1] * now
    columns = [np.ones(len(now)), now]
    for side in known.sides:
        touching = side * (now - zone.ends[side]) > 0.0
        depth = np.where(touching, now - zone.ends[side], 0.0)
        slope = slope + zone.gains[side] * touching
        expected = expected + zone.gains[side] * depth
        columns += [-zone.gains[side] * touching, depth]
    free = np.where(near, 0.0, 1.0 / rough**2)
    D = np.column_stack(columns)
    weight = sparse.diags_array(1.0 / noise**2 + free * slope**2)
    across = basis.T @ (D * (free * slope)[:, None])
    normal = np.block(
        [[(basis.T @ weight @ basis).toarray(), across], [across.T, D.T @ (D * free[:, None])]]
    )
    left = free * (volts - expected)
    right = np.concatenate([basis.T @ ((seen - now) / noise**2 + slope * left), D.T @ left])
    covariance = np.asarray(np.linalg.inv(normal + RIDGE * np.diag(np.diag(normal))), dtype=float)
    step = covariance @ right
    a, b, *more = step[k:]
    ends, gains = dict(zone.ends), dict(zone.gains)
    for side, end, gain in zip(known.sides, more[::2], more[1::2], strict=True):
        ends[side], gains[side] = ends[side] + float(end), gains[side] + float(gain)
    inside = (zone.inside[0] + float(a), zone.inside[1] + float(b))
    better = replace(zone, ends=ends, gains=gains, inside=inside)
    return _Joint(better, known.knots + step[:k], covariance)
