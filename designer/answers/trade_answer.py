"""The answer of ``trade``, which ``trade.json`` holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NotRequired

from typing_extensions import TypedDict

from designer.answers.shared_rows import ForceFrequency, IntervalRow, ProvenanceRow, Seconds


class NamedRow(ForceFrequency):
    number: int
    omega: float
    b: float


class LabelRow(NamedRow):
    expected: str | None


class FidelityRow(LabelRow):
    rung: str
    level: str
    settings: Mapping[str, Any]
    response: str
    reason: str
    gate: bool | None
    right: Mapping[str, bool]
    error: float | None
    error_of_equations: float | None
    impact_velocity_error: float | None
    impact_velocity_error_of_equations: float | None
    numerical_error: float | None
    convergence: float | None
    seconds_per_period: float | None


class TruthShown(TypedDict, total=False):
    rung: str


class TruthRow(LabelRow, TruthShown):
    response: str
    sure: bool
    uncertainty: float | None
    impact_velocity_uncertainty: float | None
    periodic: Mapping[str, bool]
    impacts: Mapping[str, bool]


class YieldDifference(IntervalRow):
    boards: int
    ok: int
    gained: int
    lost: int
    difference: float | None


class BoardTradeShown(NamedRow, YieldDifference):
    undecided: int
    resolved: NotRequired[int]
    bandwidth: NotRequired[YieldDifference | None]
    """With bandwidth against without."""


class BoardTradeRow(BoardTradeShown):
    expected: str | None
    periods: float | None
    seconds_per_board: Mapping[str, float | None]


class LeftOutRow(LabelRow):
    reason: str


class CheapestShown(TypedDict):
    """The cheapest fidelity that answers a question, as a report shows it; without a number: of
    all responses."""

    number: int | None
    question: str
    of: str
    rung: str | None
    level: str | None
    measured: NotRequired[float | None]
    convergence: NotRequired[float | None]
    shown: bool | None
    seconds: float | None
    note: str


class CheapestRow(CheapestShown, ForceFrequency):
    omega: float | None
    b: float | None
    expected: str | None
    bound: float | None


class TradeShown(TypedDict):
    """What a report shows of a trade, of earlier versions too."""

    truths: Sequence[TruthShown]
    boards: Sequence[BoardTradeShown]
    cheapest: Sequence[CheapestShown]


class TradeAnswer(TypedDict):
    """What ``trade`` prints and ``trade.json`` holds."""

    truths: Sequence[TruthRow]
    boards: Sequence[BoardTradeRow]
    cheapest: Sequence[CheapestRow]
    format: int
    title: str
    rungs: Sequence[FidelityRow]
    left_out: Sequence[LeftOutRow]
    provenance: ProvenanceRow
    cost: Seconds
