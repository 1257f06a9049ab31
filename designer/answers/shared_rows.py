"""What stands in the answers of several verbs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from typing_extensions import TypedDict


class IntervalRow(TypedDict):
    """Ends of an interval, at 95 %."""

    low: float
    high: float


class ShareRow(IntervalRow):
    share: float


class TrustVerdict(TypedDict):
    """Whether a result can be trusted; null where there is none."""

    trusted: bool | None
    reasons: Sequence[str]


class Seconds(TypedDict):
    seconds: float


class ProvenanceRow(TypedDict):
    """Where a result comes from: versions, seed, settings, hashes. Never a time or a path."""

    versions: Mapping[str, str | None]
    """Of everything that a result depends on; None for what is not installed."""
    seed: int | None
    """None where no random number enters."""
    settings: Mapping[str, Any]
    """Of the solvers that were used."""
    catalogue_sha256: str
    model_sha256: str
    spread: Mapping[str, Any] | None
    """How boards differ; None but of a study."""


class ForceFrequency(TypedDict, total=False):
    """The frequency of the mechanism's force; nothing of a model without SI values."""

    frequency_hz: float


class MechanismFrequency(TypedDict, total=False):
    """What a generator's frequency stands for; nothing of a model without SI values."""

    mechanism_hz: float


class BasePerVolt(TypedDict, total=False):
    """The acceleration of a moving base per generator volt; nothing of a model without SI values or
    without one."""

    base_m_s2_per_v: float


class SpringMisfit(TypedDict):
    """A cubic spring whose force is off where a motion draws it."""

    between: Sequence[str]
    range: float
    reached: float
    error: float


class StopMisfit(TypedDict):
    """Hertzian stops whose force is off where a motion draws it."""

    clearance: str
    depth: float
    reached: float
    error: float


class MisfitRows(TypedDict, total=False):
    beyond_range: list[SpringMisfit]
    coarse_range: list[SpringMisfit]
    beyond_depth: list[StopMisfit]
    coarse_depth: list[StopMisfit]
