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
    """Where a board's stop begins [V], and the standard error."""

    volts: float
    error: float


class StopRow(TypedDict):
    """The board's own stops in a clearance."""

    clearance: str
    upper: NotRequired[StopEnd]
    lower: NotRequired[StopEnd]


class OverlayRow(TypedDict):
    """What an engine shows, and the difference by net."""

    response: str
    difference: Mapping[str, float | None]


class NgspiceOverlay(OverlayRow):
    """The same of ngspice, on the fitted or the nominal board."""

    fitted: bool


class FigureRow(IntervalRow):
    """A figure of a board; fields of ``board_fit.BoardFigure``."""

    name: str
    unit: str
    value: float
    nominal: float
    sigma: float


class PartShare(TypedDict):
    """A part to replace, and the share of boards that are right then."""

    part: str
    share: float


class AdviceRow(MechanismFrequency):
    """What to turn."""

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
    """Advice as a report shows it."""

    words: str


class RecordKeys(MechanismFrequency):
    """What is told of a record."""

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
    """What a report shows of a board on the bench."""

    records: Sequence[RecordShown]


class RecordRow(RecordKeys):
    """What a record shows."""

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
    """A board as its records show it."""

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
    """How far parts of a kind differ, over what is stated."""

    kind: str
    factor: float
    told: float


class BenchKeys(TypedDict):
    """What is known before ngspice is asked."""

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
