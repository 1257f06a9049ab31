"""From a chosen linear block to the dead-zone stage beside it.

The linear block leaves freedom: its scales may move as long as none of its errors grows past the
largest one. The stop's slope is sought inside the interval that this leaves.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.optimize import linprog

from designer.base.arrays import Array
from designer.circuit.scale_fit import minimax
from designer.model.model import Dimensionless
from designer.synthesis.dead_zone_target import DeadZoneTarget
from designer.synthesis.linear_block import PARTS, Targets, residuals_of

LEAST_GAIN = 1.25
"""Of the saturating path, so that it does saturate where the clearance is never closed."""
LEAST_PENETRATION = 0.02
"""Of the peak of x1: what counts as the deepest penetration where there is less."""


@dataclass(frozen=True)
class StageRoom:
    """What the responses, the op-amps and the conditions leave to the stage."""

    saturation: float
    """Output limit of U3C [V]."""
    swing: float
    """Largest voltage of an output that stays linear [V]."""
    supply: float
    """Supply of either rail, ± [V]."""
    peaks: Array
    """(4,) peaks of the states in model units."""
    penetration: float
    """Deepest penetration of a stop in model units."""
    load: float
    """Least resistance that an output may drive [ohm]."""
    strict: bool = True
    """Whether these limits are conditions; otherwise they only say where the search begins."""
    noise_gain: float = float("inf")
    """Largest noise gain of an amplifier of the stage."""
    kind: Literal["saturation", "rectifier"] = "saturation"
    """Kind of the stage."""
    excursion: float = 0.0
    """Largest |x1| on the side without a stop, in model units."""
    drop: float = 0.0
    """Forward voltage of a diode [V]."""
    reference: float = 5.0
    """Voltage of the reference [V]."""
    reference_current: tuple[float, float] = (0.0, float("inf"))
    """Least and largest current of the reference [A], margins included."""


def target_of(model: Dimensionless, values: Mapping[str, float], room: StageRoom) -> DeadZoneTarget:
    """What the stage has to do beside this linear block."""
    targets = Targets.from_state_matrix(model.second_order().state_matrix())
    h, D = _residuals(values, targets)
    relative = relative_volts(minimax(h, D))
    top = room.swing / float((room.peaks * relative).max())  # volts per unit of x1
    peak = float(room.peaks[0])
    depth = max(room.penetration, LEAST_PENETRATION * peak)
    return DeadZoneTarget(
        mu=model.mu,
        slope=slope_interval(values, targets, model.mu),
        saturation=room.saturation,
        threshold=min(model.b * top, room.saturation / LEAST_GAIN),
        linear_gain=room.swing / (top * peak),
        output_gain=(room.swing - room.drop) / (top * depth),
        load=room.load,
        noise_gain=room.noise_gain,
        strict=room.strict,
        kind=room.kind,
        sides=model.sides,
        excursion=max(room.excursion, peak if room.excursion == 0.0 else 0.0) / model.b,
        supply=room.supply,
        reference=room.reference,
        reference_current=room.reference_current,
    )


def relative_volts(scales: Array) -> Array:
    """(4,) volts per unit of each state over those of x1, from the scales (alpha, p, q1, q3)."""
    _, p, q1, q3 = scales
    velocity = -q1
    return np.asarray(np.exp([0.0, velocity, velocity + p + q3, velocity + p]))


def slope_interval(values: Mapping[str, float], targets: Targets, mu: float) -> tuple[float, float]:
    """Least and largest (fv slope)/R50 [1/ohm] that make the stop's slope right while no error of
    the linear block exceeds its least largest one.

    The slope's error is ln(fv slope/R50) + alpha + q1 - ln mu, so the extremes of alpha + q1 over
    all scales with |h + D s| <= error are two linear programs of four variables.
    """
    h, D = _residuals(values, targets)
    best = minimax(h, D)
    error = float(np.abs(h + D @ best).max())
    limit = np.concatenate([error - h, error + h]) + 1e-12
    ends = []
    for sign in (1.0, -1.0):
        found = linprog(
            np.array([sign, 0.0, sign, 0.0]),
            A_ub=np.concatenate([D, -D]),
            b_ub=limit,
            bounds=[(None, None)] * 4,
            method="highs",
        )
        # HiGHS' own tolerance can make a point of the interval empty: then the point itself.
        scales = best if found.x is None else found.x
        ends.append(float(scales[0] + scales[2]))
    middle = float(best[0] + best[2])
    low, high = min(*ends, middle), max(*ends, middle)
    return float(mu * np.exp(-high)), float(mu * np.exp(-low))


def _residuals(values: Mapping[str, float], t: Targets) -> tuple[Array, Array]:
    """(10,) offsets and (10, 4) scales (alpha, p, q1, q3) of the linear block's errors."""
    logs = np.log([values[name] for name in PARTS])
    h, D = residuals_of(logs[None, :10], logs[None, 10:], t.logs)
    return h[0], D
