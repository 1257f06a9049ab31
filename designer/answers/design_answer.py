"""The answer of ``synthesise``, which ``design.json`` holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, NotRequired

from typing_extensions import TypedDict

from designer.answers.shared_rows import BasePerVolt, MechanismFrequency, ProvenanceRow, Seconds


class CircuitFigures(TypedDict):
    opamp: str
    gain: float
    bias: float
    supply: float
    saturation: float


class GradeRow(TypedDict):
    asked: float
    bought: float


class CertificateRow(TypedDict):
    """What is proved of a choice of parts; fields of ``design.Certificate``."""

    status: str
    lower_bound: float
    proof: str


class ScaleRow(TypedDict):
    seconds: float
    volts: Mapping[str, float]
    threshold: float | None


class SecondChannel(TypedDict):
    amplitude_v_peak: float
    phase_deg: float
    shape: Sequence[Sequence[float]]


class ShapeKeys(TypedDict, total=False):
    """Only of no sine, or of two channels."""

    shape: Sequence[Sequence[float]]
    second: SecondChannel


class KnobRow(MechanismFrequency, BasePerVolt, ShapeKeys):
    omega: float
    frequency_hz: float
    amplitude_v_peak: float
    offset_v: float
    expected: str | None
    found: bool


class DeadZoneRow(TypedDict):
    kind: str
    saturation: float
    threshold: float | None
    threshold_lower: NotRequired[float | None]
    offcentre: NotRequired[float | None]
    slope_error: float | None
    null_error: float | None
    bias_error: NotRequired[float | None]
    reason: NotRequired[str]
    """Of a stage that the file does not state."""


class DesignCost(TypedDict, total=False):
    """What a design cost; wall times [s]."""

    seconds: float
    synthesis_seconds: float
    comparison_seconds: float | None


class RuleShown(TypedDict):
    id: str
    status: Literal["pass", "fail", "not run"]
    title: str
    found: str
    limit: str
    do: str


class RuleRow(RuleShown):
    source: str
    scope: str
    where: str
    value: float | None
    bound: float | None
    unit: str
    reason: str | None
    usual_bound: float | None


class OrderCost(TypedDict):
    """What one board costs in an order of so many, in euro."""

    boards: int
    parts: float
    bare_board: float
    assembly: float
    listed: int
    total: float


class BoardCostRow(TypedDict):
    estimate: bool
    assembly_class: str
    area_dm2: float
    surface_parts: int
    through_parts: int
    euro: Sequence[OrderCost]


class DesignFindings(TypedDict):
    warnings: Sequence[str]
    failed_rules: Sequence[RuleRow]


class DesignExtras(TypedDict, total=False):
    better_grades: Mapping[str, GradeRow]
    """Parts that are bought at a better grade than was asked for."""
    warnings: Sequence[str]
    """This and the next two: not of earlier versions, nor as soon as the parts are chosen."""
    board_cost: BoardCostRow | None
    failed_rules: Sequence[RuleRow]
    comparison: Comparison


class DesignKeys(DesignExtras):
    format: int
    title: str
    model: Mapping[str, Any]
    circuit: CircuitFigures
    parts: Mapping[str, float]
    composites: NotRequired[Mapping[str, str]]
    errors: Mapping[str, float]
    max_error: float
    certificate: CertificateRow
    scales: ScaleRow
    knobs: Sequence[KnobRow]
    dead_zone: DeadZoneRow | None
    distinct_values: int
    conditions: Mapping[str, Any]
    """Limits by quantity; ``checked``, ``at_limit`` and ``binding``."""
    solver: Mapping[str, str]
    provenance: ProvenanceRow


class ComparedResponseRow(TypedDict):
    omega: float
    expected: str | None
    circuit: str
    kept: bool
    reason: str


class LoadRow(TypedDict):
    """Peaks of a section's output, and where."""

    low: float
    high: float
    current: float
    low_in: str
    high_in: str
    current_in: str


class LargestCurrent(TypedDict):
    ampere: float
    section: str
    response: str


class OffsetRow(TypedDict):
    typical: float
    maximum: float
    largest: str


class PaperNames(TypedDict, total=False):
    """Sections by the paper's names, where these differ."""

    paper_names: Mapping[str, str]


class ComparedColumn(PaperNames):
    name: str
    what: str
    opamp: str
    supply: float
    saturation: float
    parts: Mapping[str, float]
    errors: Mapping[str, float] | None
    max_error: float | None
    reason: str
    k0: float | None
    f20: float | None
    b: float | None
    threshold: float | None
    frequency_hz: float
    frequency_error: float | None
    amplitude_v_peak: float
    responses: Sequence[ComparedResponseRow]
    peaks: Mapping[str, LoadRow]
    not_run: Mapping[str, str]
    largest_current: LargestCurrent | None
    offset: OffsetRow | None
    part_count: int
    packages: int
    distinct_values: int
    unsold: Sequence[str]
    price_at_most_eur: float | None


class Comparison(TypedDict):
    columns: Sequence[ComparedColumn]
    printed_in: NotRequired[Mapping[str, str]]


class ComparisonFile(Comparison):
    format: int
    title: str
    provenance: ProvenanceRow
    cost: Seconds


class DesignAnswer(DesignKeys):
    """What ``synthesise`` prints and ``design.json`` holds."""

    cost: DesignCost
