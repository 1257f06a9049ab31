"""The answer of ``synthesise``, which ``design.json`` holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, NotRequired

from typing_extensions import TypedDict

from designer.answers.shared_rows import BasePerVolt, MechanismFrequency, ProvenanceRow, Seconds


class CircuitFigures(TypedDict):
    """Of the op-amps and their supply."""

    opamp: str
    gain: float
    bias: float
    supply: float
    saturation: float


class GradeRow(TypedDict):
    """A grade that nobody sells, and the one that is bought."""

    asked: float
    bought: float


class CertificateRow(TypedDict):
    """What is proved of a choice of parts; fields of ``design.Certificate``."""

    status: str
    lower_bound: float
    proof: str


class ScaleRow(TypedDict):
    """What a second, a volt and the threshold stand for."""

    seconds: float
    volts: Mapping[str, float]
    threshold: float | None


class SecondChannel(TypedDict):
    """The generator's second channel."""

    amplitude_v_peak: float
    phase_deg: float
    shape: Sequence[Sequence[float]]


class ShapeKeys(TypedDict, total=False):
    """Only of no sine, or of two channels."""

    shape: Sequence[Sequence[float]]
    second: SecondChannel


class KnobRow(MechanismFrequency, BasePerVolt, ShapeKeys):
    """The generator's settings for a response."""

    omega: float
    frequency_hz: float
    amplitude_v_peak: float
    offset_v: float
    expected: str | None
    found: bool


class DeadZoneRow(TypedDict):
    """The stage that makes the first dead zone."""

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
    """A design rule and what became of it, as a report shows it."""

    id: str
    status: Literal["pass", "fail", "not run"]
    title: str
    found: str
    limit: str
    do: str


class RuleRow(RuleShown):
    """The same with its figures."""

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
    """What the boards of a design cost, estimated."""

    estimate: bool
    assembly_class: str
    area_dm2: float
    surface_parts: int
    through_parts: int
    euro: Sequence[OrderCost]


class DesignFindings(TypedDict):
    """What is not good enough about a design."""

    warnings: Sequence[str]
    failed_rules: Sequence[RuleRow]


class DesignExtras(TypedDict, total=False):
    """What not every design has."""

    better_grades: Mapping[str, GradeRow]
    """Parts that are bought at a better grade than was asked for."""
    warnings: Sequence[str]
    """This and the next two: not of earlier versions, nor as soon as the parts are chosen."""
    board_cost: BoardCostRow | None
    failed_rules: Sequence[RuleRow]
    comparison: Comparison


class DesignKeys(DesignExtras):
    """Of a design, what stands in the answer of ``run`` too."""

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
    """A response on a circuit of the comparison."""

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
    """The largest output current."""

    ampere: float
    section: str
    response: str


class OffsetRow(TypedDict):
    """Rest's shift over the threshold."""

    typical: float
    maximum: float
    largest: str


class PaperNames(TypedDict, total=False):
    """Sections by the paper's names, where these differ."""

    paper_names: Mapping[str, str]


class ComparedColumn(PaperNames):
    """A circuit of the comparison."""

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
    """The design beside the paper's."""

    columns: Sequence[ComparedColumn]
    printed_in: NotRequired[Mapping[str, str]]


class ComparisonFile(Comparison):
    """What ``compare.json`` holds."""

    format: int
    title: str
    provenance: ProvenanceRow
    cost: Seconds


class DesignAnswer(DesignKeys):
    """What ``synthesise`` prints and ``design.json`` holds."""

    cost: DesignCost
