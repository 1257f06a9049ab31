"""The answer of ``simulate``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, NotRequired

from typing_extensions import TypedDict

from designer.answers.shared_rows import (
    ForceFrequency,
    MisfitRows,
    ProvenanceRow,
    Seconds,
    ShareRow,
    TrustVerdict,
)


class ImpactRow(TypedDict):
    time: float
    side: Literal["upper", "lower"]
    velocity: float
    clearance: NotRequired[str]
    """Of a file of format 2."""


class TwinRow(TypedDict):
    response: str
    start: Sequence[float]


class StopReach(TypedDict):
    depth: float | None
    speed: float | None
    depth_m: NotRequired[float | None]
    speed_m_s: NotRequired[float | None]


class ClearanceReach(TypedDict):
    clearance: str
    upper: StopReach | None
    lower: StopReach | None
    max: float | None
    min: float | None
    max_m: NotRequired[float | None]
    min_m: NotRequired[float | None]


class StickingRow(TypedDict):
    """What a friction does over an orbit; fields of ``stick_phases.Sticking``."""

    friction: str
    periods: int
    phases: int
    share: float
    longest: float
    creep: float


class OrbitExtras(MisfitRows, total=False):
    more: Sequence[Sequence[int]]
    """Impacts in further clearances, [upper, lower]."""
    x1_max_m: float | None
    """This and the next two: of ``[mechanical]`` with SI values."""
    x1_min_m: float | None
    impact_velocities_m_s: Sequence[float]
    frequencies_hz: Sequence[float]
    """Of a quasi-periodic motion of a model with SI values."""
    x_max: Sequence[float] | None
    """This and the next one: by mass of a file of format 2, absolute."""
    x_min: Sequence[float] | None
    from_base_max: Sequence[float] | None
    """This and the next two: of a base that moves."""
    from_base_min: Sequence[float] | None
    base_amplitude: float
    in_clearances: Sequence[ClearanceReach]
    """Of a model that has some."""
    sticking: Sequence[StickingRow] | None
    """Of a model with friction; null where it is not known."""


class OrbitRow(OrbitExtras):
    """An orbit in model units."""

    response: str
    status: str
    n: int
    p: int
    q: int
    start: Sequence[float]
    symmetric: bool | None
    asymmetry: float | None
    x1_max: float | None
    x1_min: float | None
    extremes: Mapping[str, Sequence[float]] | None
    impact_velocities: Sequence[float]
    impacts: Sequence[ImpactRow]
    multipliers: Sequence[Sequence[float | None]]
    """Real and imaginary part of each."""
    lyapunov: float | None
    lyapunov_error: float | None
    frequencies: Sequence[float] | None
    penetration: float | None
    miss: float | None
    reason: str


class CoexistingOrbit(OrbitRow):
    twin: TwinRow | None


class AttractorCount(ShareRow):
    response: str
    symmetric: bool | None
    count: int
    on_twin: int | None
    x1_min: float | None
    x1_max: float | None


class UnsettledCount(ShareRow):
    count: int


class StartsRow(TypedDict):
    """Where the starts that were drawn from a box end."""

    count: int
    asked: int
    seed: int
    phase: float
    box: Mapping[str, float]
    """Half-width, by state."""
    attractors: Sequence[AttractorCount]
    not_settled: UnsettledCount


class TrustRow(TrustVerdict):
    rounding: float | None
    magnification: float | None
    error: float | None
    multiplier_error: float | None


class ResponseCost(Seconds):
    periods: int


class ResponseRow(CoexistingOrbit, ForceFrequency):
    omega: float
    expected: str | None
    found: bool
    others: Sequence[CoexistingOrbit]
    starts: StartsRow | None
    engine: Mapping[str, Any]
    trust: TrustRow
    cost: ResponseCost


class SimulateExtras(TypedDict, total=False):
    masses: Sequence[str]
    """This and the next one: of a file of format 2."""
    clearances: Sequence[str]
    files: Sequence[str]
    """Pictures."""


class SimulateAnswer(SimulateExtras):
    """What ``simulate`` prints."""

    format: int
    engine: str
    responses: Sequence[ResponseRow]
    provenance: ProvenanceRow
    cost: Seconds
