"""What a dead-zone stage has to do beside a chosen linear block, and what sizing it returns.

The linear block leaves freedom: its scales may move as long as none of its errors grows past the
largest one. The stop's slope is sought inside the interval that this leaves.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from designer.catalog.diode_curve import diode_model
from designer.catalog.output_stage import OutputStage
from designer.circuit.dead_zone_parts import DeadZoneStage
from designer.circuit.scale_fit import minimax
from designer.linear_network.linear_block import errors_of
from designer.linear_network.linear_terms import Targets
from designer.model import circuit_table
from designer.model.clearance import Sides
from designer.model.find_responses import Peaks, Reach
from designer.model.mechanics import MechanicalModel
from designer.synthesis.limits import ConditionLimits, depth

LEAST_GAIN = 1.25
"""Of the saturating path, so that it does saturate where the clearance is never closed."""
REFERENCE_MARGIN = 1.5
"""Between a reference's current and the ends of the range in which it regulates."""
EXCURSION_MARGIN = 1.05
"""Of the largest excursion on the free side of a one-sided stop."""
LEAST_SPAN, SPAN_ROOM = 1.25, 1.6
"""Least ratio of the free side's reach to the threshold, and how far above its least it may be."""


@dataclass(frozen=True)
class DeadZoneTarget:
    """What the stage has to do."""

    mu: float
    """Stop stiffness over K1."""
    slope: tuple[float, float]
    """Least and largest wanted (fv slope)/R50 [1/ohm]; inside the interval the slope has no
    error."""
    output: OutputStage
    """How far an output reaches, U3C's above all."""
    threshold: float
    """Largest v1 at the stop that keeps every state inside its swing [V]."""
    linear_gain: float
    """Largest A- that keeps U3A linear."""
    output_gain: float
    """Largest fv slope that keeps the output of the stage inside its swing, a diode's drop
    included."""
    load: float
    """Least resistance that an output may drive [ohm]."""
    noise_gain: float = float("inf")
    """Largest noise gain of an amplifier of the stage."""
    strict: bool = True
    """Whether these limits are conditions; otherwise they only say where the search begins."""
    kind: circuit_table.DeadZone = "saturation"
    sides: Sides = "both"
    """The stops that exist."""
    excursion: float = 1.0
    """Largest excursion on the free side of a one-sided stop, over the clearance."""
    supply: float = 15.0
    """Supply of either rail, ± [V]."""
    reference: float = 5.0
    """Voltage of the reference [V]."""
    reference_current: tuple[float, float] = (0.0, float("inf"))
    """Least and largest current of the reference [A], margins included."""

    @property
    def farthest(self) -> float:
        """What U3C reaches without a load [V]: no load of its own lets it reach further."""
        return float(self.output.limit_into(np.inf))

    @property
    def shift(self) -> tuple[float, float]:
        """Range of c/Esat = (L - b)/(L + b) of a one-sided stage; L reaches past the excursion."""
        if self.sides == "both":
            return 0.0, 0.0
        span = max(self.excursion * EXCURSION_MARGIN, LEAST_SPAN)
        return (span - 1.0) / (span + 1.0), (span * SPAN_ROOM - 1.0) / (span * SPAN_ROOM + 1.0)


@dataclass(frozen=True)
class DeadZone:
    """What was chosen for the stage, and what is known of it."""

    values: dict[str, float]
    """Values of R50 and R200 … by part [ohm]."""
    errors: dict[str, float]
    """Each error of the stage, signed, from the values alone."""
    threshold: float
    """v1 at the stop [V]."""
    bound: float
    """No choice under the stated conditions has a smaller error."""
    proved: bool
    """Whether the error is within 1e-6 of the bound, or of none."""
    proof: str
    """How the bound is known."""
    solver: str
    """What the solver said of the search."""

    @property
    def error(self) -> float:
        """The largest size among the errors."""
        return max(abs(e) for e in self.errors.values())

    @property
    def slope_error(self) -> float:
        """Size of the stop slope's error."""
        return abs(self.errors["stop slope"])

    @property
    def null_error(self) -> float:
        """Size of the leftover slope in the dead zone, in units of K1; 0 for the rectifier."""
        return abs(self.errors.get("dead-zone null", 0.0))


def outside(value: float, interval: tuple[float, float]) -> float:
    """ln of how far a positive value lies above (below: negative) an interval; 0 inside."""
    over, under = np.log(value / interval[1]), np.log(value / interval[0])
    return float(max(over, 0.0) + min(under, 0.0))


def parts_of(kind: circuit_table.DeadZone, sides: str) -> tuple[str, ...]:
    """Names of the resistors that the stage has, R50 included."""
    if DeadZoneStage(kind).rectifies:
        halves = {
            "both": range(200, 208),
            "upper": (200, 201, 202, 206),
            "lower": (203, 204, 205, 207),
        }
        return ("R50", *(f"R{i}" for i in halves[sides]))
    last = 211 if sides == "both" else 213
    return ("R50", *(f"R{i}" for i in range(200, last)))


def target_of(
    model: MechanicalModel,
    values: Mapping[str, float],
    stage: DeadZoneStage,
    limits: ConditionLimits,
    peaks: Peaks,
    *,
    output: OutputStage,
    supply: float,
    index: int = 0,
) -> DeadZoneTarget:
    """What the stage of a clearance has to do beside this linear block.

    values : of the linear block by part name. output : of the op-amps. supply : ± [V].
    index : of the clearance.
    """
    system = model.second_order()
    stop = system.dead_zones[index]
    own, wanted = stop.watched, abs(stop.first.stiffness) / float(system.mass[stop.mass])
    targets, mu = Targets.of(model), system.relative_stiffness(stop)
    errors = errors_of(values, targets)
    relative = np.exp(errors.volts @ minimax(errors.offsets, errors.columns))
    relative = relative / relative[own]  # volts of each state over those of the stop's displacement
    top = limits.swing / float((peaks.states * relative).max())  # volts per unit of length
    reach = peaks.reaches[index] if index < len(peaks.reaches) else Reach()
    peak = float(peaks.states[own]) if len(stop.terms) == 1 else reach.peak
    gap = abs(stop.first.gap)
    drop, reference, current = 0.0, 5.0, (0.0, float("inf"))
    if stage.diode is not None and stage.reference is not None:
        drop, reference = diode_model(stage.diode).drop, stage.reference.voltage
        least, most = stage.reference.current.min or 0.0, stage.reference.current.max or np.inf
        current = (REFERENCE_MARGIN * least, most / REFERENCE_MARGIN)
    # Where the swing is no condition an output may go as far as it can.
    more = 1.0 if "swing" in limits.conditions else output.limit / limits.swing
    return DeadZoneTarget(
        mu=mu,
        slope=slope_interval(values, targets, wanted, stop.mass, own),
        output=output,
        threshold=min(gap * top, output.limit / LEAST_GAIN),
        linear_gain=more * (limits.swing / (top * peak)),
        output_gain=more * ((limits.swing - drop) / (top * depth(reach, peak))),
        load=limits.load,
        noise_gain=limits.noise_gain,
        strict=bool(limits.conditions),
        kind=stage.kind,
        sides=stop.which,
        excursion=(reach.excursion or peak) / (gap or peak),
        supply=supply,
        reference=reference,
        reference_current=current,
    )


def slope_interval(
    values: Mapping[str, float],
    targets: Targets,
    wanted: float,
    mass: int = 0,
    by: int | None = None,
) -> tuple[float, float]:
    """Least and largest (fv slope)/R50 [1/ohm] that make a stop's slope right while no error of
    the linear block exceeds its least largest one.

    wanted : the stop's stiffness over the mass, in the state matrix. mass : that carries the stop.
    by : the state that the stage watches; the mass's displacement, if None.
    The slope's error is ln(fv slope/R50) + rate - ln wanted, with the mass's rate of
    ``LinearErrors`` for its displacement; so the extremes of the rate over all scales with
    |errors| <= error are two linear programs.
    """
    errors = errors_of(values, targets)
    state = 2 * mass if by is None else by
    h, D = errors.offsets, errors.columns
    rate = errors.rates[mass] + errors.volts[state] - errors.volts[2 * mass]
    best = minimax(h, D)
    error = float(np.abs(h + D @ best).max())
    limit = np.concatenate([error - h, error + h]) + 1e-12
    ends = []
    for sign in (1.0, -1.0):
        program = linprog(
            sign * rate,
            A_ub=np.concatenate([D, -D]),
            b_ub=limit,
            bounds=[(None, None)] * len(rate),
            method="highs",
        )
        # HiGHS' own tolerance can make a point of the interval empty: then the point itself.
        scales = best if program.x is None else program.x
        ends.append(float(rate @ scales))
    middle = float(rate @ best)
    low, high = min(*ends, middle), max(*ends, middle)
    offset = float(errors.rate_offsets[mass])
    return float(wanted * np.exp(-high - offset)), float(wanted * np.exp(-low - offset))
