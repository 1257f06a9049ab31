"""Completing ratios to values: the absolute levels of one mass's resistors and capacitors.

A row of the ``RatioTable`` fixes the damping resistors and the ratios of the stiffness resistors.
Here every level of the stiffness pair, every pair of capacitors C2, C4 with the row's ratio and
every displacement integrator R1 C1, R7 C3 that the time scale allows is joined to it, again
through windows of (sum of |coefficients|) · eps, so that nothing that can reach eps is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.linear_block import RatioTable, Targets, window
from designer.system import Array, Index, Mask

MOST_GROUPS = 10_000
"""Groups that are completed: each is joined with every resistor, so memory follows."""


@dataclass(frozen=True)
class Bounds:
    """Side conditions of the linear block; infinite or zero where switched off.

    seconds : range of the time scale. level : largest ratio between the peaks of the state
    voltages of one mass, and between the two velocities. share : how much larger than x1's the
    peak voltage of another state may be. stop : least R4 [ohm] that leaves room
    for the stop's resistor. peaks : (4,) peaks of x1, x1', x2, x2' in model units. signal :
    range of the linear block's resistors [ohm].
    """

    seconds: tuple[float, float]
    level: float
    share: float
    stop: float
    peaks: Array
    signal: tuple[float, float] = (0.0, np.inf)

    @property
    def p_range(self) -> tuple[float, float]:
        """Limits of ln (volts of x2')/(volts of x1')."""
        centre = float(np.log(self.peaks[1] / self.peaks[3]))
        return centre - float(np.log(self.level)), centre + float(np.log(self.level))


@dataclass(frozen=True)
class Side:
    """Completions of one mass, each (k,): group, then ln of the two stiffness resistors, of the
    displacement integrator's resistor and capacitor. whole : none is missing."""

    group: Index
    upper: Array
    lower: Array
    resistor: Array
    capacitor: Array
    whole: bool

    def __len__(self) -> int:
        return len(self.group)

    def take(self, which: Index | Mask) -> Side:
        columns = {k: v[which] for k, v in self.__dict__.items() if k != "whole"}
        return Side(**columns, whole=self.whole)


def groups_of(table: RatioTable, c: Array, bounds: Bounds) -> tuple[RatioTable, Array, Array, bool]:
    """Rows of the table with every pair of capacitors that has their ratio and is in the band.

    At most ``MOST_GROUPS``, those of least error; the last entry says whether that is all.
    """
    whole = len(table) * len(c) <= 50 * MOST_GROUPS
    table = table.take(np.arange(min(len(table), 50 * MOST_GROUPS // len(c))))
    row, pick = (a.ravel() for a in np.meshgrid(np.arange(len(table)), np.arange(len(c))))
    c4 = c[pick] + table.delta[row]
    sold = np.isin(np.round(c4, 9), np.round(c, 9))
    seconds = np.exp(table.alpha[row] + c[pick])
    good = sold & (seconds >= bounds.seconds[0]) & (seconds <= bounds.seconds[1])
    keep = np.sort(np.flatnonzero(good)[np.argsort(row[good], kind="stable")[:MOST_GROUPS]])
    whole = whole and len(keep) == int(good.sum())
    return table.take(row[keep]), np.asarray(c[pick[keep]]), c4[keep], whole


def sides_of(
    groups: RatioTable,
    c2: Array,
    c4: Array,
    r: Array,
    c: Array,
    t: Targets,
    bounds: Bounds,
    level: float,
) -> tuple[Side, Side]:
    """Completions of both masses that keep the conditions on levels."""
    peaks: Array = np.log(bounds.peaks)
    ratio, half = float(np.log(bounds.level)), 4 * level
    first = _complete(
        groups.r2 + t.w2, t.w4, c2, groups.ratio4, r, c, half, peaks[:2], ratio, upper=True
    )
    first = first.take(first.upper >= np.log(max(bounds.stop, 1e-300)))
    second = _complete(
        groups.r9 + t.w9, t.w11, c4, groups.ratio5, r, c, half, peaks[2:], ratio, upper=False
    )
    # Levels, ln of volts at the peak, against x1's: x1' and x2' by the first side, x2 by both.
    base1, base2 = (groups.r2 + t.w2)[first.group], (groups.r9 + t.w9)[second.group]
    velocity1 = peaks[1] - peaks[0] - (first.upper + t.w4 - base1)
    velocity2 = velocity1 + peaks[3] - peaks[1] + groups.p[first.group]
    share = float(np.log(bounds.share))
    low = (velocity1 <= share) & (velocity2 <= share)
    first, velocity2 = first.take(low), velocity2[low]
    lowest = np.full(len(groups), np.inf)
    np.minimum.at(lowest, first.group, velocity2)
    displacement2 = lowest[second.group] + peaks[2] - peaks[3] + second.lower + t.w11 - base2
    return first, second.take(displacement2 <= share)


def _complete(
    base: Array,
    w: float,
    cap: Array,
    ratio: Array,
    r: Array,
    c: Array,
    half: float,
    peaks: Array,
    level: float,
    *,
    upper: bool,
) -> Side:
    """Every (stiffness pair, integrator) of one mass for each group.

    base : ln of (own damping resistor · |its coefficient|), the time scale over the velocity
    capacitor; w : ln of the stiffness coefficient that the pair's ``upper`` (else lower) resistor
    realises; the pair's ratio is fixed, its level free. Displacement over velocity scale is then
    resistor + w - base, and R C of the displacement integrator follows from the time scale.
    """
    g, i = (a.ravel() for a in np.meshgrid(np.arange(len(base)), np.arange(len(r)), indexing="ij"))
    hit, j, whole = window(r, r[i] + ratio[g], 1e-9)
    g, low, high = g[hit], r[i[hit]], r[j]
    anchor = high if upper else low
    gap = peaks[1] - peaks[0] - (anchor + w - base[g])
    near = np.abs(gap) <= level
    g, low, high, anchor = g[near], low[near], high[near], anchor[near]
    pr, pc = (v.ravel() for v in np.meshgrid(r, c))
    order = np.argsort(pr + pc, kind="stable")
    hit, k, rest = window((pr + pc)[order], cap[g] + 2 * base[g] - w - anchor, half)
    return Side(g[hit], high[hit], low[hit], pr[order[k]], pc[order[k]], whole and rest)
