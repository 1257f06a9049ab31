"""What a dead-zone stage has to do, and what sizing it returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

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
    saturation: float
    """Output limit of U3C [V]."""
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
    kind: Literal["saturation", "rectifier"] = "saturation"
    """Kind of the stage."""
    sides: Literal["both", "upper", "lower"] = "both"
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
    looked_at: int
    """Rows of tables that the search went through."""
    seconds: float
    """Wall time [s]."""

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


def outside(found: float, interval: tuple[float, float]) -> float:
    """ln of how far a positive value lies above (below: negative) an interval; 0 inside."""
    over, under = np.log(found / interval[1]), np.log(found / interval[0])
    return float(max(over, 0.0) + min(under, 0.0))


def parts_of(kind: str, sides: str) -> tuple[str, ...]:
    """Names of the resistors that the stage has, R50 included."""
    if kind == "rectifier":
        halves = {
            "both": range(200, 208),
            "upper": (200, 201, 202, 206),
            "lower": (203, 204, 205, 207),
        }
        return ("R50", *(f"R{i}" for i in halves[sides]))
    last = 211 if sides == "both" else 213
    return ("R50", *(f"R{i}" for i in range(200, last)))
