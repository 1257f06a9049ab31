"""The answer of ``search MODEL``; ``search.json`` and ``confirmation.json``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NotRequired

from typing_extensions import TypedDict

from designer.answers.cure_answer import CureAnswer
from designer.answers.shared_rows import MechanismFrequency, ProvenanceRow, Seconds
from designer.answers.study_answer import LimitingRow, RunAnswer

Lever = TypedDict("Lever", {"lever": str, "from": str, "to": str})


class ObjectiveRow(TypedDict):
    """Null: no design, or a response missing."""

    smallest_distance: float | None
    smallest_yield: float | None
    product: float | None


class StepRow(ObjectiveRow):
    lever: str
    setting: str
    kept: bool
    reason: str


class ContributionRow(Lever):
    by: str
    alone: ObjectiveRow
    without: ObjectiveRow


class ChoiceRow(TypedDict):
    opamp: str
    dead_zone: str
    swing: float
    share: float
    noise_gain: float
    frequency: Sequence[float]


class PredictedRow(MechanismFrequency):
    omega: float
    b: float
    expected: str | None
    distance: float | None
    predicted_yield: float
    ok: Sequence[int]
    """By stretch."""


class CandidateRow(ObjectiveRow):
    max_error: float
    threshold_v: float | None
    responses: Sequence[PredictedRow]


class SurvivorKeys(TypedDict, total=False):
    """Boards that the fidelity keeps, by its name."""

    bandwidth: int
    ngspice: int


class AskedRow(SurvivorKeys):
    """Boards of a response that a fidelity was asked about."""

    exact: int
    unanswered: int
    borne_out: bool | None


class AskedDesign(TypedDict):
    frequency_hz: float
    kept: bool
    responses: Sequence[AskedRow]


class AskedFidelity(TypedDict):
    rung: str
    stretch: float
    designs: Sequence[AskedDesign]


ModelWindow = TypedDict("ModelWindow", {"b": float, "from": float, "to": float, "steps": int})


class SearchResultKeys(TypedDict):
    seed: int
    stream: str
    stretches: Sequence[float]
    boards: int
    designs_tried: int
    places_tried: int
    objective: ObjectiveRow
    choice: ChoiceRow
    start: CandidateRow | None
    final: CandidateRow
    steps: Sequence[StepRow]
    contributions: Sequence[ContributionRow]
    bandwidth: AskedFidelity
    ngspice: AskedFidelity
    windows: Sequence[Sequence[ModelWindow]]


class SearchRow(SearchResultKeys):
    trade: Mapping[str, Any] | None
    """An earlier trade's word on the fidelity."""


class SearchFile(SearchRow):
    """What ``search.json`` holds."""

    format: int
    provenance: ProvenanceRow
    cost: Seconds


class ConfirmedDifference(TypedDict):
    sample: int
    exact: str
    ngspice: str
    reason: str


class ConfirmedRow(TypedDict):
    """How ngspice judges boards of a response."""

    asked: int
    agreed: int
    undecided: NotRequired[int]
    failed: NotRequired[int]
    ok_on_both: int
    differences: Sequence[ConfirmedDifference]
    gate: Mapping[str, Any] | None
    """Settings of ngspice, and whether they ``passed``."""
    limited_by: LimitingRow | None


class ConfirmationRow(TypedDict):
    rung: str
    responses: Sequence[ConfirmedRow]


class ConfirmationFile(ConfirmationRow):
    """What ``confirmation.json`` holds."""

    format: int
    cost: Seconds


class ConfirmedCure(CureAnswer):
    confirmation: NotRequired[ConfirmationRow | None]
    """Null: no design."""


class SearchKeys(RunAnswer):
    """A run, what was searched, and what ngspice says of it."""

    search: SearchRow
    confirmation: ConfirmationRow


class SearchAnswer(SearchKeys):
    """What ``search MODEL`` prints."""

    cure: NotRequired[ConfirmedCure]
    """Where one was asked for."""
