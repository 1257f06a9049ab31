"""The mixed-integer program that turns ratios into parts: levels, capacitors, fewest kinds.

Input is a complete ``RatioTable`` at some level. Each of its rows is completed, again by joins, to
the values of R4, R10, R1, C1 (first mass) and R5, R11, R7, C3 (second mass) for every pair of
capacitors C2, C4; cvxpy and HiGHS then choose one row of each side that agree, with the four
scales as continuous variables: least error first, then fewest distinct values.
"""

from __future__ import annotations

from dataclasses import dataclass

import cvxpy as cp
import numpy as np

from designer.linear_block import RatioTable, Targets, window
from designer.system import Array, Index, Mask

KEEP_GROUPS, KEEP_ROWS = 40, 20
"""Where more choices share the least error than the program can hold: how many go in."""
LARGEST = 3000
"""Rows that the program holds without leaving any out."""
SOLVER = {"mip_rel_gap": 0.0, "mip_abs_gap": 1e-9, "time_limit": 60.0, "random_seed": 0}
"""HiGHS options; they stand in the provenance."""


@dataclass(frozen=True)
class Bounds:
    """Side conditions of the linear block; infinite or zero where switched off.

    seconds : range of the time scale. level : largest ratio between the peaks of the state
    voltages of one mass, and between the two velocities. share : how much larger than x1's the
    peak voltage of another state may be. stop : least R4 [ohm] that leaves room
    for the stop's resistor. peaks : (4,) peaks of x1, x1', x2, x2' in model units.
    """

    seconds: tuple[float, float]
    level: float
    share: float
    stop: float
    peaks: Array

    @property
    def p_range(self) -> tuple[float, float]:
        """Limits of ln (volts of x2')/(volts of x1')."""
        centre = float(np.log(self.peaks[1] / self.peaks[3]))
        return centre - float(np.log(self.level)), centre + float(np.log(self.level))


@dataclass(frozen=True)
class Selection:
    """Values by part name, the error reached, whether nothing was left out, the solver's word."""

    values: dict[str, float]
    error: float
    complete: bool
    solver: str


@dataclass(frozen=True)
class _Side:
    """Completions of one mass, each (k,): group, then ln of the two stiffness resistors, of the
    displacement integrator's resistor and capacitor."""

    group: Index
    upper: Array
    lower: Array
    resistor: Array
    capacitor: Array

    def __len__(self) -> int:
        return len(self.group)

    def take(self, which: Index | Mask) -> _Side:
        return _Side(**{k: v[which] for k, v in self.__dict__.items()})


def select(
    table: RatioTable,
    resistors: Array,
    capacitors: Array,
    t: Targets,
    bounds: Bounds,
    level: float,
) -> Selection | str:
    """The best completion with error at most ``level``, or the name of what leaves none."""
    r: Array = np.log(resistors)
    c: Array = np.log(capacitors)
    groups, c2, c4 = _groups(table, c, bounds)
    if len(groups) == 0:
        return "frequency"
    sides = _sides(groups, c2, c4, r, c, t, bounds, level)
    both = np.intersect1d(sides[0].group, sides[1].group)
    if len(both) == 0:
        return "displacement integrators"
    first, second = (side.take(np.isin(side.group, both)) for side in sides)
    complete = table.complete
    if len(first) + len(second) > LARGEST:
        own = np.stack([groups.r2, groups.r3, groups.r8, groups.r9, c2, c4], axis=1)
        first, second = _fewest_kinds([first, second], own)
        complete = False
    return _program(groups, c2, c4, first, second, t, level, complete, bounds)


def _groups(table: RatioTable, c: Array, bounds: Bounds) -> tuple[RatioTable, Array, Array]:
    """Rows of the table with every pair of capacitors that has their ratio and is in the band."""
    row, pick = (a.ravel() for a in np.meshgrid(np.arange(len(table)), np.arange(len(c))))
    c4 = c[pick] + table.delta[row]
    sold = np.isin(np.round(c4, 9), np.round(c, 9))
    seconds = np.exp(table.alpha[row] + c[pick])
    good = sold & (seconds >= bounds.seconds[0]) & (seconds <= bounds.seconds[1])
    return table.take(row[good]), np.asarray(c[pick[good]]), c4[good]


def _sides(
    groups: RatioTable,
    c2: Array,
    c4: Array,
    r: Array,
    c: Array,
    t: Targets,
    bounds: Bounds,
    level: float,
) -> tuple[_Side, _Side]:
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
) -> _Side:
    """Every (stiffness pair, integrator) of one mass for each group.

    base : ln of (own damping resistor · |its coefficient|), the time scale over the velocity
    capacitor; w : ln of the stiffness coefficient that the pair's ``upper`` (else lower) resistor
    realises; the pair's ratio is fixed, its level free. Displacement over velocity scale is then
    resistor + w - base, and R C of the displacement integrator follows from the time scale.
    """
    g, i = (a.ravel() for a in np.meshgrid(np.arange(len(base)), np.arange(len(r)), indexing="ij"))
    hit, j, _ = window(r, r[i] + ratio[g], 1e-9)
    g, low, high = g[hit], r[i[hit]], r[j]
    anchor = high if upper else low
    gap = peaks[1] - peaks[0] - (anchor + w - base[g])
    near = np.abs(gap) <= level
    g, low, high, anchor = g[near], low[near], high[near], anchor[near]
    pr, pc = (v.ravel() for v in np.meshgrid(r, c))
    order = np.argsort(pr + pc, kind="stable")
    hit, k, _ = window((pr + pc)[order], cap[g] + 2 * base[g] - w - anchor, half)
    return _Side(g[hit], high[hit], low[hit], pr[order[k]], pc[order[k]])


def _fewest_kinds(sides: list[_Side], own: Array) -> list[_Side]:
    """The groups and rows with the fewest distinct values, within what the program can hold."""
    kinds = [_distinct_per_row(side, own) for side in sides]
    least = np.full(len(own), 1e9)
    for side, count in zip(sides, kinds, strict=True):
        best = np.full(len(own), 1e9)
        np.minimum.at(best, side.group, count)
        least = np.where(least == 1e9, best, least + best)
    chosen = np.argsort(least, kind="stable")[:KEEP_GROUPS]
    out = []
    for side, count in zip(sides, kinds, strict=True):
        keep: list[int] = []
        for group in chosen:
            rows = np.flatnonzero(side.group == group)
            keep += list(rows[np.argsort(count[rows], kind="stable")[:KEEP_ROWS]])
        out.append(side.take(np.array(keep, dtype=int)))
    return out


def _distinct_per_row(side: _Side, own: Array) -> Array:
    """How many distinct values a row and its group have together."""
    values = np.concatenate(
        [
            own[side.group],
            np.stack([side.upper, side.lower, side.resistor, side.capacitor], axis=1),
        ],
        axis=1,
    )
    ordered = np.sort(np.round(values, 9), axis=1)
    return np.asarray(1 + (np.diff(ordered, axis=1) > 1e-8).sum(axis=1))


def _program(
    groups: RatioTable,
    c2: Array,
    c4: Array,
    first: _Side,
    second: _Side,
    t: Targets,
    level: float,
    complete: bool,
    bounds: Bounds,
) -> Selection | str:
    """Choose one row of each side in the same group: least error, then fewest distinct values."""
    z1 = cp.Variable(len(first), boolean=True)
    z2 = cp.Variable(len(second), boolean=True)
    alpha, p, q1, q3 = (cp.Variable() for _ in range(4))
    error = cp.Variable(nonneg=True)
    names = np.unique(first.group)
    member1 = (first.group[None, :] == names[:, None]).astype(float)
    member2 = (second.group[None, :] == names[:, None]).astype(float)
    g1 = first.group
    cap2, delta = z1 @ c2[g1], z1 @ groups.delta[g1]
    residuals = [
        alpha - z1 @ groups.r2[g1] - t.w2,
        alpha - delta - z1 @ groups.r9[g1] - t.w9,
        alpha + p - z1 @ groups.r3[g1] - t.w3,
        alpha - delta - p - z1 @ groups.r8[g1] - t.w8,
        alpha + q1 - z1 @ first.upper - t.w4,
        alpha - delta + q1 - p - z1 @ first.lower - t.w10,
        alpha + q3 + p - z2 @ second.upper - t.w5,
        alpha - delta + q3 - z2 @ second.lower - t.w11,
        alpha + cap2 - q1 - z1 @ (first.resistor + first.capacitor),
        alpha + cap2 - q3 - z2 @ (second.resistor + second.capacitor),
    ]
    rules = [cp.sum(z1) == 1, cp.sum(z2) == 1, member1 @ z1 == member2 @ z2, error <= level + 1e-9]
    rules += [cp.abs(cp.hstack(residuals)) <= error]
    if np.isfinite(bounds.share):
        peaks, share = np.log(bounds.peaks), float(np.log(bounds.share))
        rules.append(peaks[2] - peaks[0] - q1 + p + q3 <= share)
    problem = cp.Problem(cp.Minimize(error), rules)
    problem.solve(solver=cp.HIGHS, **SOLVER)
    if z1.value is None or not _chosen(z1, z2):
        return "displacement integrators"
    reached, word = float(error.value), str(problem.status)
    kinds, used = _kinds(groups, c2, c4, first, second, z1, z2)
    stage = cp.Problem(cp.Minimize(cp.sum(kinds)), [*rules, error <= reached + 1e-9, *used])
    best = int(np.argmax(z1.value)), int(np.argmax(z2.value))
    stage.solve(solver=cp.HIGHS, **SOLVER)
    if z1.value is not None and _chosen(z1, z2):
        best = int(np.argmax(z1.value)), int(np.argmax(z2.value))
    i, j = best
    g = int(first.group[i])
    logs = {
        "R1": first.resistor[i], "C1": first.capacitor[i], "R2": groups.r2[g],
        "R3": groups.r3[g], "R4": first.upper[i], "R5": second.upper[j], "C2": c2[g],
        "R7": second.resistor[j], "C3": second.capacitor[j], "R8": groups.r8[g],
        "R9": groups.r9[g], "R10": first.lower[i], "R11": second.lower[j], "C4": c4[g],
    }  # fmt: skip
    return Selection(
        values={k: float(np.exp(v)) for k, v in logs.items()},
        error=reached,
        complete=complete and word == cp.OPTIMAL,
        solver=f"HiGHS: {word}",
    )


def _chosen(z1: cp.Variable, z2: cp.Variable) -> bool:
    """Whether the solver's answer really is one row of each side: its status is not believed."""
    return all(
        abs(v.sum() - 1.0) < 1e-6 and abs(v.max() - 1.0) < 1e-6 for v in (z1.value, z2.value)
    )


def _kinds(
    groups: RatioTable,
    c2: Array,
    c4: Array,
    first: _Side,
    second: _Side,
    z1: cp.Variable,
    z2: cp.Variable,
) -> tuple[cp.Variable, list[cp.Constraint]]:
    """One 0-1 variable per value, at least as large as the use that any position makes of it."""
    g = first.group
    uses = [(z1, column[g]) for column in (groups.r2, groups.r3, groups.r8, groups.r9, c2, c4)]
    uses += [(z1, v) for v in (first.upper, first.lower, first.resistor, first.capacitor)]
    uses += [(z2, v) for v in (second.upper, second.lower, second.resistor, second.capacitor)]
    every = np.unique(np.round(np.concatenate([v for _, v in uses]), 9))
    kinds = cp.Variable(len(every), nonneg=True)
    rules = []
    for z, values in uses:
        own, where = np.unique(np.round(values, 9), return_inverse=True)
        member = (where[None, :] == np.arange(len(own))[:, None]).astype(float)
        rules.append(member @ z <= kinds[np.searchsorted(every, own)])
    return kinds, rules
