"""Side conditions and wishes as the rules that every choice of the linear block keeps.

The conditions are stated on nominal scales, which need no solver: alpha is the mean of v0 to v3,
p half of v2 - v3 (``synthesis.linear_block``), q1 = r4 + w4 - alpha, q3 = r11 + w11 + delta -
alpha. At error eps they are within 2 eps of those that make the error least.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array, Index, Mask
from designer.synthesis.kernel_linear import Rules, Values
from designer.synthesis.linear_block import PARTS, SCALES, Targets, elementary
from designer.synthesis.preferences import Wishes

PLACES, ENTRIES = elementary(SCALES)
ANY_NUMBER = len(PARTS)
"""Distinct values that the linear block has at most."""


@dataclass(frozen=True)
class Bounds:
    """Side conditions of the linear block; infinite or zero where switched off."""

    seconds: tuple[float, float]
    """Range of the time scale."""
    level: float
    """Largest ratio between the peaks of the state voltages of one mass, and between the two
    velocities."""
    share: float
    """How much larger than x1's the peak voltage of another state may be."""
    stop: float
    """Least R4 [ohm] that leaves room for the stop's resistor."""
    peaks: Array
    """(4,) peaks of x1, x1', x2, x2' in model units."""
    signal: tuple[float, float] = (0.0, np.inf)
    """Range of the linear block's resistors [ohm]."""
    stop_most: float = np.inf
    """Largest R4 that is looked at [ohm]."""


def rules_of(values: Values, t: Targets, bounds: Bounds, wishes: Wishes) -> Rules:
    """What the compiled loops need to know of the conditions and wishes."""
    uses_one = np.isin(PLACES, (6, 7)) & (ENTRIES != 0.0)
    uses_two = np.isin(PLACES, (8, 9)) & (ENTRIES != 0.0)
    one, two = uses_one.any(axis=1), uses_two.any(axis=1)
    preferred = np.log(np.array(sorted(v for v in wishes.preferred if v > 0.0), dtype=float))
    return Rules(
        w=t.logs,
        seconds=np.log(np.maximum(bounds.seconds, 1e-300)),
        level=float(np.log(bounds.level)),
        share=float(np.log(bounds.share)),
        stop=np.log(np.array([max(bounds.stop, 1e-300), bounds.stop_most])),
        peaks=np.log(bounds.peaks),
        ties=ties_of(wishes),
        free_r=_among(values.r, preferred),
        free_c=_among(values.c, preferred),
        most=ANY_NUMBER if wishes.most_values is None else min(wishes.most_values, ANY_NUMBER),
        six=_vectors(~one & ~two),
        one=_vectors(one & ~two),
        two=_vectors(two & ~one),
        both=_vectors(one & two),
    )


def ties_of(wishes: Wishes) -> Mask:
    """(14, 14) which parts of the linear block must be equal; other names are not its business."""
    tied = np.eye(len(PARTS), dtype=bool)
    for group in wishes.matched:
        own = [PARTS.index(name) for name in group if name in PARTS]
        tied[np.ix_(own, own)] = True
    for _ in PARTS:  # equal to equal is equal
        tied = (tied.astype(int) @ tied.astype(int)) > 0
    return np.asarray(tied & ~np.eye(len(PARTS), dtype=bool))


def _vectors(which: Mask) -> tuple[Index, Array]:
    return np.ascontiguousarray(PLACES[which]), np.ascontiguousarray(ENTRIES[which])


def _among(logs: Array, preferred: Array) -> Mask:
    return np.asarray((np.abs(logs[:, None] - preferred[None, :]) < 1e-9).any(axis=1))
