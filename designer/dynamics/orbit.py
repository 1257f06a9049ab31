"""What a response is, in one normal form whichever engine made it."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from designer.base.arrays import Array, Index
from designer.dynamics.counts import Counts, Pairs

Complex = NDArray[np.complex128]
SURE = 4.0
"""Standard errors that a measured exponent has to be away from a value to be told from it."""
SYMMETRY_TOLERANCE = 1e-3
"""Of the peak: below it an orbit counts as symmetric."""
STILL, COARSE = 1e-9, 1e-3
"""Shares of the largest peak below which a state hardly moves: by rounding, and by tolerances."""
MOST_COUNTED = 1_000_000
"""Drive periods or impacts that a stored motion may have."""


class OrbitStatus(StrEnum):
    """What is known of a response."""

    PERIODIC = "periodic"
    APERIODIC = "aperiodic"
    QUASI_PERIODIC = "quasi-periodic"
    GRAZING = "grazing"
    CLIPPED = "clipped"
    NOT_SETTLED = "not settled"
    DIVERGED = "diverged"
    FAILED = "failed"


ANSWERS = frozenset(
    {
        OrbitStatus.PERIODIC,
        OrbitStatus.APERIODIC,
        OrbitStatus.QUASI_PERIODIC,
        OrbitStatus.GRAZING,
        OrbitStatus.CLIPPED,
    }
)
"""Statuses that answer the question where no response was wanted."""
WITHOUT_PERIOD = frozenset({OrbitStatus.APERIODIC, OrbitStatus.QUASI_PERIODIC})
"""Answers that no n-p-q names."""
SETTLED = frozenset({OrbitStatus.PERIODIC, *WITHOUT_PERIOD})
"""Answers that a board may be asked to show."""


class Motion:
    """What a steady motion is called: a base of the records that say how one was found."""

    status: OrbitStatus
    n: int
    """Least period in drive periods; 0 unless periodic."""
    p: int
    """Impacts on the first clearance's upper stop in n drive periods; 0 unless periodic."""
    q: int
    """Impacts on the first clearance's lower stop in n drive periods; 0 unless periodic."""
    more: Pairs
    """Impacts on the upper and the lower stop of each further clearance; () unless periodic."""

    @property
    def counts(self) -> Counts:
        """n, and the impacts on the stops of every clearance; n = 0 where there is no period."""
        return Counts(self.n, ((self.p, self.q), *self.more))

    @property
    def response(self) -> str:
        """ "n-p-q" of a periodic motion, otherwise its status."""
        return str(self.counts if self.status is OrbitStatus.PERIODIC else self.status)

    @property
    def countable(self) -> bool:
        """Whether its numbers are such as a count gives: what is stored may be anything."""
        counts = (self.n, self.p, self.q, *(side for pair in self.more for side in pair))
        least = 1 if self.status is OrbitStatus.PERIODIC else 0
        return self.n >= least and all(0 <= count <= MOST_COUNTED for count in counts)


@dataclass(frozen=True)
class Orbit(Motion):
    """A steady response."""

    status: OrbitStatus
    """How the search for the response ended."""
    n: int = 0
    """Least period in drive periods; 0 unless periodic, grazing or clipped."""
    p: int = 0
    """Impacts on the first clearance's upper stop in n drive periods."""
    q: int = 0
    """Impacts on the first clearance's lower stop in n drive periods."""
    start: Array = field(default_factory=lambda: np.zeros(0))
    """(states,) state at a strobe of the orbit."""
    mode: tuple[int, ...] = ()
    """Key of the mode that holds at ``start``."""
    extremes: Array = field(default_factory=lambda: np.zeros((0, 2)))
    """(states, 2) least and greatest value of each state, refined."""
    spans: Array = field(default_factory=lambda: np.zeros((0, 2)))
    """(clearances, 2) least and greatest displacement in each clearance, refined; (0, 2) where they
    are not known."""
    speeds: Array = field(default_factory=lambda: np.zeros((0, 2)))
    """(clearances, 2) largest speed at an entry into contact on the lower and the upper stop of
    each clearance, nan without one; (0, 2) where they are not known."""
    impact_times: Array = field(default_factory=lambda: np.zeros(0))
    """(k,) times of the impacts over n periods, in order."""
    impact_velocities: Array = field(default_factory=lambda: np.zeros(0))
    """(k,) velocity in the clearance at entry into contact."""
    impact_sides: Array = field(default_factory=lambda: np.zeros(0))
    """(k,) side of each impact: 1 upper, -1 lower."""
    impact_clearances: Index = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """(k,) index of the clearance of each impact; the first where it is not given."""
    asymmetry: float = float("nan")
    """Max |x(t + nT/2) - x*(t)| over the peak of each state, worst state (n odd; else nan), with x*
    the mirror image of x: -x but for a system with another mirror."""
    multipliers: Complex = field(default_factory=lambda: np.zeros(0, dtype=complex))
    """(states,) Floquet multipliers, complex; empty where the engine has none."""
    lyapunov: float = float("nan")
    """Largest exponent per unit of the system's time (nan where unknown)."""
    lyapunov_error: float = float("nan")
    """Its standard error where it was measured on a motion without a period; nan of a periodic
    orbit, whose exponent follows from its multipliers."""
    graze: Array = field(default_factory=lambda: np.zeros((0, 2)))
    """(clearances, 2) smallest penetration and nearest approach to a stop without contact in each
    clearance, in units of the displacement in it; inf where there is none."""
    reason: str = ""
    """Why, where the status is failed, not settled or diverged."""
    periods: int = 0
    """Drive periods that the search cost."""
    more: Pairs = ()
    """Impacts on the upper and the lower stop of each further clearance in n drive periods."""
    frequencies: tuple[float, ...] = ()
    """Of a quasi-periodic motion the drive's angular frequency and the second one, per unit of the
    system's time (``quasi_periodic.frequencies``); () of any other."""
    transients: tuple[int, ...] = ()
    """Of each start whose chaos was seen to end on it, the drive periods for which that was
    watched (``coexisting_attractors``)."""

    def __post_init__(self) -> None:
        if not len(self.impact_clearances):
            first = np.zeros(len(self.impact_sides), dtype=np.int64)
            object.__setattr__(self, "impact_clearances", first)

    @property
    def penetration(self) -> float:
        """Smallest penetration of all contacts, of whichever clearance."""
        return float(self.graze[:, 0].min(initial=np.inf))

    @property
    def miss(self) -> float:
        """Nearest approach to a stop without contact, of whichever clearance."""
        return float(self.graze[:, 1].min(initial=np.inf))

    @property
    def symmetric(self) -> bool | None:
        """Whether the orbit is its own mirror image, half a period later; None if unknown."""
        if self.status is not OrbitStatus.PERIODIC:
            return None
        if self.n % 2 == 0:
            return False
        return bool(self.asymmetry < SYMMETRY_TOLERANCE) if np.isfinite(self.asymmetry) else None

    @property
    def peaks(self) -> Array:
        """(states,) ``peaks_of`` the extremes."""
        return peaks_of(self.extremes) if len(self.extremes) else np.zeros(0)

    @property
    def coarse_peaks(self) -> Array:
        """(states,) ``peaks``, of a state that hardly moves `COARSE` of the largest."""
        return np.asarray(np.maximum(self.peaks, COARSE * self.peaks.max(initial=0.0)))

    @property
    def radius(self) -> float:
        """Largest modulus of the multipliers; nan where there are none."""
        return float(np.abs(self.multipliers).max()) if len(self.multipliers) else float("nan")


def peaks_of(values: Array) -> Array:
    """(states,) what distances of states are measured in: the largest size of each state's values
    (states, k), of one that hardly moves `STILL` of the largest displacement or velocity; of the
    largest state where none of these moves beside it."""
    peak = np.abs(values).max(axis=1)
    top = float(peak.max())
    for own in (peak[0::2], peak[1::2]):
        largest = float(own.max(initial=0.0))
        np.maximum(own, STILL * (largest if largest > STILL * top else top), out=own)
    return np.asarray(np.maximum(peak, 1e-300))


def largest_speeds(velocities: Array, sides: Array | Index, clearances: Index, count: int) -> Array:
    """``Orbit.speeds`` of impacts: their velocities, sides and clearances (k,). count : of all
    clearances."""
    speeds = np.full((count, 2), np.nan)
    np.fmax.at(speeds, (clearances, (sides > 0).astype(int)), np.abs(velocities))
    return speeds


def failed(reason: str) -> Orbit:
    """An orbit that could not be computed, with the reason."""
    return Orbit(OrbitStatus.FAILED, reason=reason)
