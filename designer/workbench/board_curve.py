"""The curve of a record with the shape that the board behind it gives.

A curve by the record alone has hundreds of free numbers. A board of the spread has about ten that a
record tells, and they say how its displacements move between the samples. So the most probable
board's orbit is taken off the record, and only what is left of it is smoothed, by few knots: that
takes up what the exact circuit leaves out. Where the stops are is still read from the record, the
output of the dead zone over this curve.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import DesignerError
from designer.workbench.board_fit import GOOD, BoardFit, fit_board
from designer.workbench.contact_count import ContactEvidence
from designer.workbench.dead_zone_curve import DeadZoneCurve, fitted
from designer.workbench.folding import POINTS, Fold, Samples, best_knots, fold
from designer.workbench.observation import observe
from designer.workbench.prediction import BoardPrediction, PredictedStop
from designer.workbench.record import RecordedMotion

SURE = 4.5
"""Logarithm of the ratio of the likelihoods at which an extreme of this curve is decided: three
standard errors."""
KNOTS = (4, 8, 16, 32, 64)
"""Knots of a drive period that are tried for what the orbit leaves over."""
MODEL = 1e-4
"""Of the peak: the least error of such a curve."""
EXTREME = 0.5
"""Of the error of a point: from one extreme to the next, where the orbit has the shape."""


def board_evidence(
    curve: Fold,
    samples: Samples,
    motion: RecordedMotion,
    nets: Sequence[str],
    prediction: BoardPrediction,
    zones: Mapping[str, DeadZoneCurve],
) -> dict[tuple[int, int], ContactEvidence]:
    """What the displacements say of contact, by the number of the clearance and the side of the
    stop; nothing where no board of the spread draws the record.

    curve : by the record alone. zones : by clearance, the stages whose output was recorded.
    """
    stops = [stop for stop in prediction.stops if stop.clearance in zones]
    moving = tuple(dict.fromkeys(net for stop in stops for net in stop.displacement))
    fit = _fit(motion, curve.n, moving, prediction) if moving else None
    if fit is None:
        return {}
    values, errors = _sharpened(fit, curve.n, samples, motion, [nets.index(m) for m in moving])
    return {
        (prediction.stops.index(stop), side): evidence
        for stop in stops
        for side, evidence in _beyond(
            stop,
            zones[stop.clearance],
            np.asarray(
                sum(f * values[:, moving.index(net)] for net, f in stop.displacement.items())
            ),
            math.hypot(*(f * errors[moving.index(net)] for net, f in stop.displacement.items())),
            samples,
            motion.frequency,
            nets.index(stop.output),
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


def _sharpened(
    fit: BoardFit, n: int, samples: Samples, motion: RecordedMotion, places: Sequence[int]
) -> tuple[Array, Array]:
    """(n · POINTS, nets) curves of the nets that were fitted [V], which are these columns of the
    samples, and (nets,) the standard error of a point."""
    (seen,) = fit.observations
    first = seen.first
    orbit = fit.shown(0, first + motion.frequency * samples.time)
    rest = replace(
        samples, values=samples.values[:, places] - orbit, noise=samples.noise[list(places)]
    )
    knots = best_knots(rest, motion.frequency, KNOTS)
    more = fold(rest, motion.frequency, n, knots)
    values = fit.shown(0, first + np.arange(n * POINTS) / POINTS) + more.curve
    free = (fit.told + more.knots) / len(samples.time)
    peak = np.abs(values).max(axis=0)
    return values, np.hypot(more.left * np.sqrt(free), MODEL * peak)


def _beyond(
    stop: PredictedStop,
    zone: DeadZoneCurve,
    displacement: Array,
    error: float,
    samples: Samples,
    frequency: float,
    output: int,
) -> Iterator[tuple[int, ContactEvidence]]:
    """By side: the displacement (n · POINTS,) [V] beyond the stop, which is read from the output
    over it, sample by sample."""
    n = len(displacement) // POINTS
    grid = np.arange(len(displacement) + 1) / POINTS
    closed = np.append(displacement, displacement[0])
    moved = np.interp((samples.time * frequency) % n, grid, closed)
    start = replace(stop, ends=zone.ends, inside=zone.inside, gains=zone.gains)
    volts = samples.values[:, output]
    rough = float(np.std(volts - start.output_of(moved)))
    sharp = fitted(moved, volts, (error, rough), start, len(volts))
    for side, end in sharp.ends.items():
        whole = math.hypot(error, sharp.end_errors[side])
        if math.isfinite(whole):
            beyond = side * (displacement - end)
            yield side, ContactEvidence(beyond, whole, None, math.inf, EXTREME * error)
