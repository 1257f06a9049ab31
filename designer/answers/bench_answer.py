"""The answer of ``bench``, which ``bench.json`` holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NotRequired

from typing_extensions import TypedDict

from designer.answers.shared_rows import IntervalRow, MechanismFrequency, ProvenanceRow, Seconds


class CutRow(TypedDict):
    """A channel that is cut off [V]."""

    net: str
    channel: str
    low: float | None
    high: float | None
    words: str


class StopEnd(TypedDict):
    """Where a board's stop begins [V], and the standard error.

    error : None of a stop that the motion does not reach: the volts are then the nominal board's.
    """

    volts: float
    error: float | None


class StopRow(TypedDict):
    clearance: str
    upper: NotRequired[StopEnd]
    lower: NotRequired[StopEnd]


class OverlayRow(TypedDict):
    response: str
    difference: Mapping[str, float | None]


class NgspiceOverlay(OverlayRow):
    fitted: bool


class FigureRow(IntervalRow):
    """A figure of a board; fields of ``board_fit.BoardFigure``."""

    name: str
    unit: str
    value: float
    nominal: float
    sigma: float


class PartShare(TypedDict):
    part: str
    share: float


class AdviceRow(MechanismFrequency):
    omega: float
    expected: str
    shown: Mapping[str, float]
    as_set: float
    share: float
    helps: bool
    turn: bool
    words: str
    frequency_hz: float
    amplitude_v_peak: float
    offset_v: float
    change: Mapping[str, float]
    parts: Sequence[PartShare]


class AdviceShown(TypedDict, total=False):
    words: str


class RecordKeys(MechanismFrequency):
    file: str
    omega: float
    response: str
    sure: bool
    others: Sequence[str]
    wanted: str | None
    as_wanted: bool | None


class RecordShown(RecordKeys):
    """What a report shows of a record, of earlier versions too."""

    advice: AdviceShown | None


class BenchShown(TypedDict):
    records: Sequence[RecordShown]


class RecordRow(RecordKeys):
    kind: str
    samples: int
    periods: float
    channels: Mapping[str, str]
    frequency: float
    frequency_hz: float
    frequency_error_hz: float | None
    amplitude_v_peak: float | None
    by_board: bool
    reason: str
    would_tell: str
    clipped: Sequence[CutRow]
    symmetric: bool | None
    asymmetry: float | None
    asymmetry_error: float | None
    stops: Sequence[StopRow]
    exact_circuit: OverlayRow | None
    ngspice: NgspiceOverlay | None
    fitted: Sequence[FigureRow] | None
    advice: AdviceRow | None


class BoardRecord(TypedDict):
    board: str
    files: Sequence[str]
    figures: Sequence[FigureRow]
    misfit: float | None
    doubtful: bool
    residual: float | None
    rounds: int | None
    advice: Sequence[AdviceRow]
    reason: str


class KindSpreadRow(IntervalRow):
    kind: str
    factor: float
    told: float


class BenchKeys(TypedDict):
    format: int
    title: str
    boards: Sequence[BoardRecord]
    spread: Sequence[KindSpreadRow]
    files: Sequence[str]
    design_sha256: str
    provenance: ProvenanceRow


class BenchJson(BenchKeys):
    """What ``bench`` prints and ``bench.json`` holds."""

    records: Sequence[RecordRow]
    cost: Seconds
