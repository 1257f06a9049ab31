"""Every fidelity's answer on one response beside the two truths: n-p-q, waveform, impact speeds.

``board``: the nominal circuit at the fidelity ``full`` at its finest step. ``equations``: the exact
flow of the model. What follows from the differences is for ``fidelity.trade_study`` to say.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from designer.base.arrays import Array
from designer.dynamics.orbit import WITHOUT_PERIOD, Orbit, OrbitStatus
from designer.fidelity.fidelity_answers import CIRCUIT, MODEL, RK4, TOP, FidelityAnswer, Truths
from designer.model.find_responses import ModelResponse
from designer.verdicts.exact_circuit import images, waveform_error

if TYPE_CHECKING:
    from designer.answers.trade_answer import LabelRow


@dataclass(frozen=True)
class ResponseLabel:
    """Which wanted response of the model file."""

    number: int
    """Number in the order of the model file, from 1."""
    omega: float
    """Dimensionless frequency."""
    b: float
    """Dimensionless clearance."""
    expected: str | None
    """The wanted n-p-q; None where any was."""

    @classmethod
    def of(cls, number: int, response: ModelResponse) -> ResponseLabel:
        """The label of response number ``number``."""
        return cls(number, response.omega, response.b, response.expected)

    def as_dict(self) -> LabelRow:
        """Plain data by the keys of the contract."""
        return {
            "number": self.number,
            "omega": self.omega,
            "b": self.b,
            "expected": self.expected,
        }


BOARD, EQUATIONS = "board", "equations"


@dataclass(frozen=True)
class FidelityError:
    """What one fidelity at one setting shows of one response, and how far it is off."""

    label: ResponseLabel
    rung: str
    level: str
    """Name of the setting, alike for all responses."""
    settings: Mapping[str, Any]
    response: str
    """n-p-q or status that the fidelity shows."""
    reason: str
    """Why there is no answer, or ""."""
    seconds: float
    """CPU time of a drive period."""
    gate: bool | None
    """Whether ngspice's setting passed the numerics gate; None of what ngspice does not compute."""
    right: Mapping[str, bool]
    """Whether its n-p-q is the truth's (either twin), by truth."""
    error: Mapping[str, float]
    """RMS difference of x1 over its peak, by truth; nan where it does not apply."""
    velocity: Mapping[str, float]
    """Largest relative difference of an impact's velocity, by truth; nan where it does not
    apply."""
    numerical: float
    """Error against the exact flow of the fidelity's own equations; nan where there is none."""
    convergence: float
    """RMS difference of x1 from the fidelity's own finest run, over its peak, where that is all
    there is to compare it with: of the truth's fidelity, and of fidelities whose equations have no
    exact flow. It is no error against anything else."""


@dataclass(frozen=True)
class Truth:
    """What the board does, as computed at the finest steps."""

    label: ResponseLabel
    response: str
    """n-p-q or status that the board shows."""
    sure: bool
    """Whether its two finest steps show the same."""
    error: float
    """RMS difference of x1 between its two finest steps, over its peak."""
    velocity: float
    """Largest relative difference of an impact's velocity between its two finest steps."""
    periodic: Mapping[str, bool]
    """Whether the motion has a period, by truth."""
    impacts: Mapping[str, bool]
    """Whether it has a period and any impacts in it, by truth."""
    rung: str = TOP
    """The fidelity that stands for the board."""

    def is_itself(self, fidelity: str, of: str) -> bool:
        """Whether a fidelity is measured against itself."""
        return fidelity == (self.rung if of == BOARD else MODEL)


def compare(
    label: ResponseLabel, some: Sequence[FidelityAnswer], truth: Truths = TOP
) -> tuple[tuple[FidelityError, ...], Truth]:
    """The answers to one response beside both truths, and the board's. truth : the fidelity that
    stands for the board."""
    exact = next(a for a in some if a.fidelity == MODEL)
    top = [a for a in some if a.fidelity == truth]
    if len(top) < 2:  # without a run nothing is sure
        last, drawn = Orbit(OrbitStatus.FAILED), np.zeros(0)
        sure, error, velocity = False, math.nan, math.nan
    else:
        last, drawn = top[-1].orbit, top[-1].shown
        sure = alike(top[-2].orbit, last)
        error, velocity = _waveform(top[-2].shown, drawn), difference(top[-2].orbit, last)
    against = {BOARD: (last, drawn), EQUATIONS: (exact.orbit, exact.shown)}
    rows = tuple(
        FidelityError(
            label,
            a.fidelity,
            a.level,
            a.settings,
            a.orbit.response,
            a.reason,
            a.seconds,
            a.gate,
            {of: alike(a.orbit, orbit) for of, (orbit, _) in against.items()},
            {of: _waveform(a.shown, shown) for of, (_, shown) in against.items()},
            {of: difference(a.orbit, orbit) for of, (orbit, _) in against.items()},
            *_numerical(a, some),
        )
        for a in some
    )
    periodic = {of: o.status is OrbitStatus.PERIODIC for of, (o, _) in against.items()}
    impacts = {of: periodic[of] and o.counts.total > 0 for of, (o, _) in against.items()}
    return rows, Truth(label, last.response, sure, error, velocity, periodic, impacts, truth)


def difference(first: Orbit, second: Orbit) -> float:
    """Largest difference of the impacts' speeds on a stop, over the second orbit's fastest there,
    side by side in order of size; nan where the counts differ or an orbit has no period. A twin
    counts as the same: sides may be exchanged."""
    if first.status is not OrbitStatus.PERIODIC or second.status is not OrbitStatus.PERIODIC:
        return math.nan
    best = math.nan
    stops = [(k, side) for k in range(len(first.counts.impacts)) for side in (1.0, -1.0)]
    for turn in (1.0, -1.0):
        worst = 0.0
        for k, side in stops:
            a, b = _speeds(first, k, side), _speeds(second, k, turn * side)
            if len(a) != len(b):
                worst = math.nan
                break
            if len(a):
                worst = max(worst, float((np.abs(a - b) / b.max()).max()))
        best = worst if math.isnan(best) else min(best, worst) if worst == worst else best
    return best


def _speeds(orbit: Orbit, clearance: int, side: float) -> Array:
    """The speeds of the impacts on a stop, in ascending order."""
    there = (orbit.impact_clearances == clearance) & (orbit.impact_sides == side)
    return np.sort(np.abs(orbit.impact_velocities[there]))


def alike(first: Orbit, second: Orbit) -> bool:
    """Whether two orbits are the same n-p-q, either twin; both without a period are alike too."""
    if first.status is not OrbitStatus.PERIODIC or second.status is not OrbitStatus.PERIODIC:
        return first.status in WITHOUT_PERIOD and second.status in WITHOUT_PERIOD
    return first.counts.family == second.counts.family


def _numerical(answer: FidelityAnswer, some: Sequence[FidelityAnswer]) -> tuple[float, float]:
    """Error against the exact flow of the same equations, and convergence where there is none."""
    exact = {RK4: MODEL, "ideal": CIRCUIT}.get(answer.fidelity)
    finest = [a for a in some if a.fidelity == (exact or answer.fidelity)][-1]
    apart = math.nan if finest is answer else _waveform(answer.shown, finest.shown)
    return (apart, math.nan) if exact else (math.nan, apart)


def _waveform(shown: Array, wanted: Array) -> float:
    if not len(wanted):
        return math.nan
    return waveform_error(shown, images(wanted, mirror=True))
