"""The answer of ``search DIR --yield``, which ``cure.json`` holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NotRequired

from typing_extensions import TypedDict

from designer.answers.shared_rows import ForceFrequency, IntervalRow, ProvenanceRow, Seconds
from designer.answers.study_answer import CountKeys


class RareShareRow(IntervalRow):
    lost: float
    unseen: float
    boards: int


class MeasuredShown(IntervalRow):
    """A yield on fresh boards; the rate is null where the response is not shown."""

    rate: float | None
    failed: int


class RareShareKey(TypedDict, total=False):
    rare: RareShareRow


class MeasuredYieldRow(IntervalRow, CountKeys, RareShareKey):
    rate: float | None


class PlaceRow(TypedDict):
    """Where a response is driven."""

    response: int
    omega: float
    b: float


class NetworkRow(TypedDict):
    family: str
    parts: Sequence[str]


class UpgradesRow(TypedDict):
    """What is changed; null, false or empty: as it is."""

    opamp: str | None
    dead_zone: str | None
    reference: str | None
    grades: Mapping[str, Any]
    places: Sequence[PlaceRow]
    trim: float | None
    trimmer: NotRequired[bool]
    networks: NotRequired[Sequence[NetworkRow]]


class CuredKeys(ForceFrequency):
    omega: float
    expected: str | None
    limit: str


class CuredResponse(CuredKeys):
    b: float
    before: MeasuredYieldRow
    after: MeasuredYieldRow
    reached: bool


class TrialKeys(TypedDict):
    price: float
    said: Sequence[str]


class TrialRow(TrialKeys):
    branch: str
    upgrades: UpgradesRow
    predicted: Sequence[float]
    measured: Sequence[MeasuredYieldRow]
    reached: bool


class RefusedRow(TypedDict):
    upgrades: Sequence[str]
    why: str


class CuredShown(CuredKeys):
    before: MeasuredShown
    after: MeasuredShown


class TrialShown(TrialKeys):
    measured: Sequence[MeasuredShown]


class CureKeys(TypedDict):
    reached: bool
    why: str
    target: float
    price: float
    said: Sequence[str]
    refused: Sequence[RefusedRow]


class CureShown(CureKeys):
    """What a report shows of a cure, of earlier versions too."""

    responses: Sequence[CuredShown]
    front: Sequence[TrialShown]


class CureAnswer(CureKeys):
    """What ``search DIR --yield`` prints and ``cure.json`` holds."""

    responses: Sequence[CuredResponse]
    front: Sequence[TrialRow]
    format: int
    budget: float | None
    branch: str
    upgrades: UpgradesRow
    rounds: Sequence[TrialRow]
    provenance: ProvenanceRow
    cost: Seconds
