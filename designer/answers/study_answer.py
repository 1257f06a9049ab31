"""The answers of ``tolerance``, which ``tolerance.json`` holds, and of ``run``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NotRequired

from typing_extensions import TypedDict

from designer.answers.design_answer import DesignCost, DesignKeys
from designer.answers.shared_rows import (
    ForceFrequency,
    IntervalRow,
    ProvenanceRow,
    TrustVerdict,
)


class CountKeys(TypedDict):
    ok: int
    lost: int
    grazing: int
    failed: int
    samples: int


class CensusKey(TypedDict, total=False):
    census: bool


class YieldCounts(CountKeys, IntervalRow, CensusKey):
    """The same with the interval of the yield."""


class RatedCounts(YieldCounts):
    """The same with the yield; null where nothing was decided."""

    rate: float | None


class TallyRow(RatedCounts):
    reasons: Mapping[str, int]


class BenchTally(TallyRow):
    steps: int
    seen_where_it_is_not: int


class TunedRow(TallyRow):
    tries: int
    unanswered: int
    followed: int
    bench: BenchTally


class TrimmedRow(TallyRow):
    at_end: int


class SecondAmplitudes(TypedDict, total=False):
    """Of the second channel, where there is one."""

    amplitude2_v_peak: float
    to_amplitude2_v_peak: float


class RecipeRow(SecondAmplitudes):
    """How a response is reached from power-up; times in drive periods and seconds."""

    way: str
    frequency_hz: float
    amplitude_v_peak: float
    to_frequency_hz: float
    to_amplitude_v_peak: float
    steps: int
    hold_periods: int
    wait_periods: int
    sweep_seconds: float
    wait_seconds: float
    reached: int
    trials: int
    board_reached: int
    board_trials: int
    boards: int
    able: int
    smooth: bool
    slower: bool
    text: str


class ReachedRow(TallyRow):
    clipped_at_start: int
    recipe: RecipeRow


class ExponentRow(TypedDict):
    """A largest Lyapunov exponent, per model time."""

    value: float | None
    error: float | None


class QuantileRows(TypedDict):
    """Quantiles of each margin; null where no board has it."""

    radius: Sequence[float] | None
    penetration: Sequence[float] | None
    miss: Sequence[float] | None
    asymmetry: Sequence[float] | None
    waveform: Sequence[float] | None


class MarginRows(QuantileRows):
    quantiles: Sequence[float]
    boards: int
    counted: Mapping[str, int]


class AgreementCounts(TypedDict):
    asked: int
    agreed: int
    failed: int
    undecided: NotRequired[int]


class LeftOutBoard(TypedDict):
    sample: int
    reason: str


class NominalAgreement(AgreementCounts):
    too_long: NotRequired[int]
    left_out: NotRequired[Sequence[LeftOutBoard]]
    not_asked: NotRequired[int]


class AgreementRow(AgreementCounts):
    nominal_start: NotRequired[NominalAgreement]


class DisagreementRow(IntervalRow):
    count: int
    asked: int


class StratumRow(TypedDict):
    name: str
    samples: int
    asked: int
    only_ngspice_ok: int
    only_exact_ok: int


class DifferenceRow(TypedDict):
    """A board on which the engines differ; fields of ``two_engine_yield.Disagreement``."""

    sample: int
    kind: str
    why: str
    exact: str
    ngspice: str
    distance: float | None
    explanation: str


class CombinedRow(IntervalRow):
    estimate: float
    disagreement: DisagreementRow
    undecided: int
    if_undecided_lost: float
    if_undecided_ok: float
    strata: Sequence[StratumRow]
    differences: Sequence[DifferenceRow]


class LimitRow(TypedDict):
    what: str
    distance: float | None


class PredictionRow(TypedDict):
    ok: int
    lost: int
    missed: int
    alarms: int
    right: int


class ExactSubject(TypedDict):
    name: str
    kind: str
    avoided: int
    replayed: int
    caused: int
    kept: int
    low: float | None
    high: float | None


class SobolRow(TypedDict):
    coordinate: str
    part: str
    first: float | None
    total: float | None
    first_error: NotRequired[float | None]
    total_error: NotRequired[float | None]


class CornerRow(TypedDict):
    coordinates: Sequence[str]
    worst: Sequence[str]
    margin: float | None
    verdict: str
    response: str
    survived: int
    corners: int


class AttributionRow(TypedDict):
    question: int
    lost: int
    subjects: Sequence[ExactSubject]
    indices: Sequence[SobolRow]
    limits: Sequence[LimitRow]
    prediction: PredictionRow
    sought: int
    there: int
    corner: CornerRow | None
    limited_by: str
    skipped: str


class AttributionCost(TypedDict):
    attractors: int
    orbits: int
    seconds: float


class AttributionRows(TypedDict):
    samples: int
    seed: int
    responses: Sequence[AttributionRow]
    cost: AttributionCost


class AttributionStatusRow(TypedDict):
    status: str
    share: float
    budget: int | None
    reason: str


class LossRegionRow(TypedDict):
    found_by: str
    becomes: str
    share: float
    boards: int
    parts: Sequence[str]


class ToleranceMarginRow(TypedDict):
    """How far a part may be off; null: above ten times its tolerance."""

    part: str
    widening: float | None


class RareLossKeys(TypedDict):
    lost: float
    low: float
    high: float
    unanswered: float
    boards: int
    pilots: int
    drawn_lost: int
    effective: float
    largest_weight: float
    gain: float | None
    unseen: float
    narrow: bool
    regions: Sequence[LossRegionRow]
    margins: Sequence[ToleranceMarginRow]
    per_million: Sequence[float]


class RareLossRow(RareLossKeys):
    question: int
    seconds: float


class AnyLostRow(IntervalRow):
    least: float
    most: float


class AxisValues(TypedDict):
    name: str
    values: Sequence[float]


class StudyMapRow(TypedDict):
    over: str
    question: int
    axes: Sequence[AxisValues]
    there: Sequence[Any]
    """This and the next six: on the grid."""
    ok: Sequence[Any]
    lost: Sequence[Any]
    grazing: Sequence[Any]
    failed: Sequence[Any]
    low: Sequence[Any]
    high: Sequence[Any]
    samples: int
    seed: int
    used: float
    frequency_hz: float | None
    window: Sequence[float] | None
    open: Sequence[bool]
    recommended: Sequence[float] | None
    op_amps: NotRequired[Mapping[str, Any]]
    """This and the next one: over temperature."""
    specified: NotRequired[Sequence[float | None]]


class FindingRow(TypedDict):
    name: str
    deviation: float | None
    bound: float
    reason: str
    passed: bool


class EquationCheckRow(TypedDict):
    passed: bool
    low_hz: NotRequired[float | None]
    high_hz: NotRequired[float | None]
    findings: Sequence[FindingRow]


class LimitingRow(TypedDict):
    mechanism: str
    border: str
    distance: float | None
    shares: Mapping[str, float]
    line: str


class ResponseExtras(ForceFrequency, total=False):
    exponents: Mapping[str, ExponentRow]
    """Of a motion without period, by engine."""
    rare: RareLossKeys | None
    """Where that was asked for; null where the response was left out."""
    left_out: str
    """Why there is no yield."""
    limited_by: LimitingRow | None
    """Of ``search``; null where it was not studied."""


YieldKey = TypedDict("YieldKey", {"yield": YieldCounts | None})
"""As built; null where the response was left out."""


class StudyResponse(ResponseExtras, YieldKey):
    omega: float
    expected: str | None
    found: bool
    model: str
    circuit: str
    ngspice: str | None
    ngspice_reason: str
    engines_agree: bool
    symmetric: bool | None
    others: Sequence[str]
    rate: float | None
    reasons: Mapping[str, int]
    margins: NotRequired[MarginRows]
    agreement: AgreementRow
    combined: NotRequired[CombinedRow | None]
    tuned: NotRequired[TunedRow | None]
    trimmed: NotRequired[TrimmedRow | None]
    reached: NotRequired[ReachedRow | None]
    blame: NotRequired[AttributionRow | None]
    trust: NotRequired[Mapping[str, TrustVerdict | None]]
    """By engine, and of the yield."""


class MeasuredBoard(TypedDict):
    """What became of a measured board, by response; null where one was left out."""

    board: str
    sample: int
    verdicts: Sequence[str | None]
    shown: Sequence[str | None]
    reasons: Sequence[str | None]
    cells: Sequence[str | None]
    all: str | None
    """The worst verdict."""


class OneBoardRow(TypedDict):
    built: YieldCounts | None
    tuned: YieldCounts | None
    trimmed: YieldCounts | None
    reached: YieldCounts | None


class AnyLostKey(TypedDict, total=False):
    """Where rare losses were asked for; null of one response."""

    any_lost: AnyLostRow | None


class StudyKeys(AnyLostKey):
    samples: int
    boards: NotRequired[Sequence[MeasuredBoard] | None]
    until: NotRequired[float | None]
    narrow: NotRequired[bool | None]
    all_on_one_board: NotRequired[OneBoardRow]
    blame: NotRequired[AttributionStatusRow]
    equation_check: NotRequired[EquationCheckRow | None]
    responses: Sequence[StudyResponse]
    maps: NotRequired[Sequence[StudyMapRow]]


class StudyCost(TypedDict, total=False):
    """What a study cost; wall times [s]."""

    design_seconds: float
    check_seconds: float
    study_seconds: float
    """This has the next six in it."""
    exact_seconds: float
    early_table_seconds: float
    ngspice_seconds: float
    growing_seconds: float
    further_layers_seconds: float
    first_report_seconds: float
    blame_seconds: float
    rare_seconds: float
    maps_seconds: float
    jobs: float


class RunCost(TypedDict):
    """What a design and its study cost; empty where somebody took it out."""

    design: DesignCost
    study: StudyCost


class RunAnswer(DesignKeys, StudyKeys):
    """What ``run`` prints; in Python ``tolerance`` answers so too."""

    cost: RunCost


class StudyAnswer(StudyKeys):
    """What ``tolerance`` prints and ``tolerance.json`` holds."""

    format: int
    provenance: ProvenanceRow
    cost: StudyCost
