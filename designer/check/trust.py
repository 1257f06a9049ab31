"""Whether a result can be trusted: its error, measured on the result itself, against what it says.

A lap of an orbit is computed several ways that share no rounding error: by the kernel that
answered, and by the general one with its steps cut differently, from starts a few roundings apart.
What they differ by is what rounding does to a lap, with all that the flow magnifies inside it: a
stop of stiffness μ turns a rounding error of the displacement into sqrt(μ) times as much of the
velocity, and into μ times as much of the multipliers. The fixed point of the lap is off by that,
times ‖(I - Φ)⁻¹‖, Φ the lap's linearised map. States count in units of their peaks.

A result that claims more than this error allows is *not to be trusted here*; the answer gives the
reason. Where there is no answer there is nothing to trust either.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from designer.base.arrays import Array
from designer.base.reason import Reason
from designer.dynamics.attractors import STROBE_TOLERANCE, peaks_near
from designer.dynamics.flow import Flow
from designer.dynamics.flow_result import FlowResult, FlowStatus
from designer.dynamics.orbit import ANSWERS, Orbit, OrbitStatus
from designer.spice.numerics_gate import GateResult
from designer.spice.simulator import SimulationFailed

if TYPE_CHECKING:
    from designer.answers.shared_rows import TrustVerdict
    from designer.answers.simulate_answer import TrustRow

ROUNDING = 2.0**-53
"""Of a number in double precision."""
SPLITS = (1, 2, 3, 5)
"""Stretches a period of the general kernel's runs: each cuts its steps at other times."""
APART = 8.0
"""Roundings of the peak by which their starts differ from the orbit's."""
MARGIN = 10.0
"""A few runs show the usual rounding error; the bound is so many times the largest they show."""
WORDS = "not to be trusted here"


@dataclass(frozen=True)
class Trust:
    """What is known of a result's error. States are in units of their peaks."""

    rounding: float = math.nan
    """Largest difference of a lap's end between the ways to compute it; nan where nothing was
    measured."""
    magnification: float = math.nan
    """‖Φ‖ of the lap; nan where nothing was measured."""
    error: float = math.nan
    """Bound of the state's error; nan where nothing was measured."""
    multiplier_error: float = math.nan
    """Bound of the error of the largest multiplier's modulus; nan where nothing was measured."""
    doubts: tuple[Reason, ...] = ()
    """Why the result is not to be trusted."""
    answered: bool = False
    """Whether there is a result."""

    @property
    def trusted(self) -> bool | None:
        """None where there is nothing to trust: no answer, and no doubt of what there is."""
        if self.doubts:
            return False
        return True if self.answered else None

    @property
    def reasons(self) -> tuple[str, ...]:
        """The doubts' words, without figures."""
        return tuple(doubt.words for doubt in self.doubts)

    def __str__(self) -> str:
        """With the figures; empty without a doubt."""
        return f"{WORDS}: {'; '.join(map(str, self.doubts))}" if self.doubts else ""

    def verdict(self) -> TrustVerdict:
        """Without the figures, which no two machines share: equal studies are equal files."""
        return {"trusted": self.trusted, "reasons": list(self.reasons)}

    def as_dict(self) -> TrustRow:
        """With the figures, in the reasons too."""
        return {
            "trusted": self.trusted,
            "reasons": [str(doubt) for doubt in self.doubts],
            "rounding": self.rounding,
            "magnification": self.magnification,
            "error": self.error,
            "multiplier_error": self.multiplier_error,
        }


def of_orbit(flow: Flow, orbit: Orbit) -> Trust:
    """Of what the exact engine says of a response; ``flow`` is the one it was found with.

    Without a start nothing is measured: its status and reason say why. One that has not settled
    is measured too, but no answer. Of a motion without a period, one drive period is a lap.
    """
    if not len(orbit.start):
        return Trust()
    n, size, mode = max(orbit.n, 1), flow.system.size, orbit.mode or None
    peak = orbit.peaks if len(orbit.extremes) else peaks_near(flow, orbit.start, mode)
    general = Flow(flow.system, flow.drive, fast=False)
    apart = APART * ROUNDING * peak * np.random.default_rng(0).choice([-1, 1], (len(SPLITS), size))
    runs = [flow.run(orbit.start, n, mode=mode, tangent=np.eye(size))]
    runs += [
        general.run(orbit.start + off, n, mode=mode, tangent=np.eye(size), points=k)
        for k, off in zip(SPLITS, apart, strict=True)
    ]
    laps = [run.tangent * peak / peak[:, None] for run in runs if run.tangent is not None]
    ended = [run.status for run in runs if run.status is not FlowStatus.DONE]
    if ended:
        return Trust(doubts=(Reason(f"a lap computed anew ends with: {ended[0]}"),))
    ends = np.array([run.strobes[-1] for run in runs]) / peak
    magnification = float(np.linalg.norm(laps[0], 2))
    rounding = float(np.ptp(ends, axis=0).max())
    if runs[0].counts.any():  # all runs may have found the stop with the same last digit
        rounding = max(rounding, ROUNDING * _kick(flow, peak) * magnification)
    error = MARGIN * rounding * (_carried(laps[0]) if orbit.n else 1.0)
    doubts = _doubts_of_lap(runs, error, counted=not _at_strobe(orbit, n * flow.drive.period))
    if orbit.n == 0:
        answered = orbit.status in ANSWERS
        return Trust(rounding, magnification, error, doubts=doubts, answered=answered)
    open_by = MARGIN * float(np.ptp([_radius(lap) for lap in laps]))
    if orbit.status is OrbitStatus.PERIODIC:
        doubts += _doubts_of_orbit(orbit, error, open_by, float(peak[flow.system.moving]))
    return Trust(rounding, magnification, error, open_by, doubts, orbit.status in ANSWERS)


def of_gate(gate: GateResult) -> Trust:
    """Of ngspice, which answers only behind its gate; a run that failed is no answer."""
    if isinstance(gate.read, SimulationFailed):
        return Trust()
    return Trust(doubts=gate.doubts, answered=gate.read.orbit.status in ANSWERS)


# ---------------------------------------------------------------------------------------------


def _kick(flow: Flow, peak: Array) -> float:
    """What a contact makes of a rounding error, of the peak: sqrt(μ) in the model."""
    system, largest = flow.system, 1.0
    for guard in system.mode(system.start).guards:
        if guard.clearance >= 0:
            A = system.mode(guard.target).A
            rate = float(np.abs(np.linalg.eigvals(A)).max())
            largest = max(largest, float(np.linalg.norm(A * peak / peak[:, None], 2)) / rate)
    return largest


def _carried(lap: Array) -> float:
    """How much of a lap's error its fixed point has: ‖(I - Φ)⁻¹‖, at least 1."""
    smallest = float(np.linalg.svd(np.eye(len(lap)) - lap, compute_uv=False)[-1])
    return max(1.0, 1.0 / smallest) if smallest > 0.0 else math.inf


def _at_strobe(orbit: Orbit, span: float) -> bool:
    """Whether an impact falls on the strobe, and so into one lap or the next by its last digit."""
    times = orbit.impact_times
    return bool((np.minimum(times, np.abs(span - times)) < STROBE_TOLERANCE * span).any())


def _doubts_of_lap(runs: list[FlowResult], error: float, *, counted: bool) -> tuple[Reason, ...]:
    doubts = []
    if not error <= STROBE_TOLERANCE:
        words = (
            "rounding errors, as the flow magnifies them, leave the state open by more than the "
            f"{STROBE_TOLERANCE:.0e} of its peak that to call a response periodic asks for"
        )
        doubts.append(Reason(words, f"{error:.1g}"))
    counts = {tuple(int(c) for c in run.counts.sum(axis=(0, 1))) for run in runs}
    if counted and len(counts) > 1:
        figures = " or ".join(f"{upper} and {lower}" for lower, upper in sorted(counts))
        doubts.append(Reason("computed with other steps a lap has other impacts", figures))
    return tuple(doubts)


def _doubts_of_orbit(orbit: Orbit, error: float, open_by: float, peak: float) -> tuple[Reason, ...]:
    doubts = []
    nearest = min(orbit.penetration, orbit.miss) / peak
    if nearest <= error:
        words = "a contact or a miss lies within the error: the count of impacts is open"
        doubts.append(Reason(words, f"{nearest:.1g} of the peak, error {error:.1g}"))
    if abs(1.0 - orbit.radius) <= open_by:
        words = (
            "its largest multiplier cannot be told from 1: whether the response is stable is not "
            "known"
        )
        doubts.append(Reason(words, f"it is open by {open_by:.1g}"))
    return tuple(doubts)


def _radius(lap: Array) -> float:
    return float(np.abs(np.linalg.eigvals(lap)).max())
