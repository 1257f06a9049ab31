"""Rectifier halves with a threshold and a slope that are given: every choice looked at.

Beyond the threshold Vref R200/R201 a half's output is fv = (R202/R200) (v - threshold) at a
displacement of v volts, so the stop's slope is R202/(R200 R50). All halves of a clearance share
R50. Each R50 and each R200 is tried with the nearest R201 and R202, so the least largest error is
that of the whole catalogue.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array, Index
from designer.circuit.coefficients import EXACT

INPUTS = (1e4, 1e5)
"""Range of R200 [ohm]: light for what drives it, quiet."""
ROOM = 2.5
"""How far below its largest value the slope of the steepest half's fv may lie."""


@dataclass(frozen=True)
class HalfTarget:
    """What one half has to do."""

    side: int
    """1 upper, -1 lower."""
    threshold: float
    """Displacement at which it begins to conduct, without its sign [V]; 0: at rest."""
    siemens: float
    """Current of the force resistor per volt of displacement beyond [1/ohm]."""


@dataclass(frozen=True)
class HalfRules:
    """What all halves of a clearance have to keep."""

    reference: float
    """Voltage of the reference [V]."""
    gain: float
    """Largest slope of fv."""
    load: float
    """Least resistance on an output [ohm]."""
    noise_gain: float
    """Largest noise gain of an amplifier."""


@dataclass(frozen=True)
class ChosenHalf:
    """The resistors of one half [ohm]."""

    source: float
    """From the displacement's negative."""
    threshold: float | None
    """From the reference; None without a threshold."""
    feedback: float
    """From fv."""


@dataclass(frozen=True)
class ChosenHalves:
    """The halves of one clearance."""

    force: float
    """Resistor from fv to the mass [ohm]."""
    halves: dict[int, ChosenHalf]
    """By side."""
    error: float
    """Largest error of a threshold or a slope; no choice has a smaller one."""


def least_error(targets: Sequence[HalfTarget], resistors: Array, rules: HalfRules) -> float:
    """The least largest error of any halves; infinite where the rules leave none."""
    errors = _Grids.of(targets, resistors, rules).errors
    return float(errors.min(initial=np.inf))


def choose(
    targets: Sequence[HalfTarget], resistors: Array, rules: HalfRules, known: frozenset[float]
) -> ChosenHalves | None:
    """The halves of least error, of those the ones with the fewest values that are not known yet;
    None where the rules leave none. resistors : ascending [ohm]."""
    grids = _Grids.of(targets, resistors, rules)
    errors = grids.errors
    least = float(errors.min(initial=np.inf))
    if not np.isfinite(least):
        return None
    level = max(least, EXACT)
    rows = np.flatnonzero(errors <= level)
    fresh = _new(grids.forces[rows], known)
    fresh = fresh + sum(half.new(rows, known, level).min(axis=1) for half in grids.halves.values())
    row = int(rows[np.lexsort((errors[rows], fresh))[0]])
    halves = {side: half.chosen(row, known, level) for side, half in grids.halves.items()}
    return ChosenHalves(float(grids.forces[row]), halves, least)


@dataclass(frozen=True)
class _Half:
    """Every force resistor (rows) with every input (columns) of one half: the nearest others."""

    inputs: Array
    thresholds: Array | None
    feedbacks: Array
    error: Array

    @classmethod
    def of(
        cls, target: HalfTarget, forces: Array, inputs: Array, heavy: Array, rules: HalfRules
    ) -> _Half:
        wanted = target.siemens * forces[:, None] * inputs
        feedbacks = nearest_to(heavy, wanted)
        error = np.abs(np.log(feedbacks / wanted))
        noise, thresholds = 1.0 / inputs, None
        if target.threshold > 0.0:
            level = rules.reference / target.threshold * inputs
            thresholds = nearest_to(heavy, level)
            error = np.maximum(error, np.abs(np.log(thresholds / level)))
            noise = noise + 1.0 / thresholds
        loud = 1.0 + feedbacks * noise > rules.noise_gain
        return cls(inputs, thresholds, feedbacks, np.where(loud, np.inf, error))

    def new(self, rows: Index, known: frozenset[float], level: float) -> Array:
        """(rows, columns) number of values that are not known, of choices inside the level."""
        count = _new(self.inputs, known) + _new(self.feedbacks[rows], known)
        if self.thresholds is not None:
            count = count + _new(self.thresholds, known)
        return np.where(self.error[rows] <= level, count, 99)

    def chosen(self, row: int, known: frozenset[float], level: float) -> ChosenHalf:
        """Within the level the fewest new values, then the least error."""
        new = self.new(np.array([row]), known, level)[0]
        column = int(np.lexsort((self.error[row], new))[0])
        threshold = None if self.thresholds is None else float(self.thresholds[column])
        return ChosenHalf(float(self.inputs[column]), threshold, float(self.feedbacks[row, column]))


@dataclass(frozen=True)
class _Grids:
    """The force resistors that leave fv its range, and each half with them, by side."""

    forces: Array
    halves: dict[int, _Half]

    @classmethod
    def of(cls, targets: Sequence[HalfTarget], resistors: Array, rules: HalfRules) -> _Grids:
        heavy = resistors[resistors >= rules.load]
        inputs = heavy[(heavy >= INPUTS[0]) & (heavy <= INPUTS[1])]
        steepest = max(target.siemens for target in targets)
        gains = steepest * heavy
        forces = heavy[(gains <= rules.gain) & (gains >= rules.gain / ROOM)]
        inputs = inputs if len(inputs) else heavy
        return cls(forces, {t.side: _Half.of(t, forces, inputs, heavy, rules) for t in targets})

    @property
    def errors(self) -> Array:
        """(forces,) least largest error with each."""
        worst = np.zeros(len(self.forces))
        for half in self.halves.values():
            worst = np.maximum(worst, half.error.min(axis=1, initial=np.inf))
        return worst


def nearest_to(values: Array, wanted: Array) -> Array:
    """The value nearest in ratio to each of ``wanted``. values : ascending."""
    middles = np.sqrt(values[1:] * values[:-1])
    return np.asarray(values[np.searchsorted(middles, wanted)])


def _new(values: Array, known: frozenset[float]) -> Array:
    """1 where a value is not known yet."""
    return np.asarray(~np.isin(values, sorted(known)), dtype=np.int64)
