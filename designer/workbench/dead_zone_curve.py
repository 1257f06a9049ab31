"""Where a board's stops are, by its own record: the output of the dead zone over the displacement.

Inside the clearance the output is a straight line, beyond each stop a steeper one. The two corners
are the thresholds that impacts are counted by. All laps of the record go into them, so that they
are known far better than a reading on the screen.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from designer.base.arrays import Array
from designer.workbench.prediction import PredictedStop

ROBUST = 3.0
"""Standard errors beyond which a point counts less: corners are round, and the stage lags."""


@dataclass(frozen=True)
class DeadZoneCurve:
    """The output of a dead zone over the displacement: three straight lines."""

    ends: Mapping[int, float]
    """Where the stops are, by side [V of the displacement]."""
    end_errors: Mapping[int, float]
    """Standard error of that [V]."""
    inside: tuple[float, float]
    """Output inside the clearance: volts at no displacement, and per volt of it."""
    gains: Mapping[int, float]
    """Volts of output for each volt beyond the stop, what ``inside`` adds left out."""
    misfit: float
    """Standard deviation of the output from the lines [V], noise left out."""

    def excess(self, displacement: Array, output: Array) -> Array:
        """(k,) output less the line inside the clearance [V]: the force of the stops."""
        return np.asarray(output - self.inside[0] - self.inside[1] * displacement)


def fitted(
    displacement: Array, output: Array, errors: tuple[float, float], stop: PredictedStop, dof: float
) -> DeadZoneCurve:
    """The three lines through a curve of output (k,) over displacement (k,) [V].

    errors : standard errors of a point of both [V]. dof : points of the curve that are independent.
    A side that the motion does not reach keeps the nominal stop, with the nominal gain.
    """
    sides = [
        side
        for side, end in stop.ends.items()
        if (side * (displacement - end) > 0.02 * abs(end)).any()
    ]
    first = np.array([stop.inside[0], stop.inside[1]])
    begun = [[_first_end(displacement, output, stop, side), stop.gains[side]] for side in sides]
    start = np.concatenate([first, *begun])
    scale = math.hypot(errors[1], errors[0] * max(map(abs, stop.gains.values()), default=1.0))

    def value(parameters: Array) -> Array:
        line = parameters[0] + parameters[1] * displacement
        for k, side in enumerate(sides):
            end, gain = parameters[2 + 2 * k : 4 + 2 * k]
            line = line + gain * side * np.maximum(side * (displacement - end), 0.0)
        return np.asarray(line)

    def left(parameters: Array) -> Array:
        return np.asarray((value(parameters) - output) / scale)

    solved = least_squares(
        left,
        start,
        loss="soft_l1",
        f_scale=ROBUST,
        x_scale=np.maximum(np.abs(start), 1e-3),
    )
    slope: Array = np.asarray(solved.jac, dtype=np.float64)
    covariance = np.linalg.pinv(slope.T @ slope) * len(output) / max(dof, 1.0)
    deviation = float(np.std(value(solved.x) - output))
    misfit = math.sqrt(max(deviation**2 - errors[1] ** 2, 0.0))
    known = {side: k for k, side in enumerate(sides)}
    ends, end_errors, gains = dict(stop.ends), {}, dict(stop.gains)
    for side in stop.ends:
        end_errors[side] = math.inf
        if side in known:
            place = 2 + 2 * known[side]
            ends[side], gains[side] = float(solved.x[place]), float(solved.x[place + 1])
            end_errors[side] = math.sqrt(float(covariance[place, place]))
    inside = (float(solved.x[0]), float(solved.x[1]))
    return DeadZoneCurve(ends, end_errors, inside, gains, misfit)


def _first_end(displacement: Array, output: Array, stop: PredictedStop, side: int) -> float:
    """About where a stop is [V]: as far before the furthest displacement as the output is high
    there, by the nominal gain; the nominal stop where it is not.

    A search that begins at the nominal stop overshoots where a scope's zero has moved a shallow
    contact, and a stop that the motion does not reach leaves it nowhere to go.
    """
    at = int(np.argmax(side * displacement))
    depth = (output[at] - stop.inside[0] - stop.inside[1] * displacement[at]) / stop.gains[side]
    return float(displacement[at] - depth) if side * depth > 0.0 else stop.ends[side]
