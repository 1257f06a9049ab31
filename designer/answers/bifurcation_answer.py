"""The answer of ``bifurcation``: of a sweep, a map or basins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, NotRequired

from typing_extensions import TypedDict

from designer.answers.shared_rows import MisfitRows, ProvenanceRow, ShareRow


class SiUnitKeys(TypedDict, total=False):
    """The SI unit of a parameter, where its values in it differ from those shown."""

    si_unit: str
    si_scale: float


class ValueInSi(TypedDict, total=False):
    """The value in the SI unit of the swept parameter, if it has one."""

    value_hz: float
    value_m: float
    value_m_s: float


class EndsInSi(TypedDict, total=False):
    """The ends in the SI unit of the parameter, if it has one."""

    from_hz: float
    to_hz: float
    from_m: float
    to_m: float
    from_m_s: float
    to_m_s: float


EndKeys = TypedDict("EndKeys", {"from": float, "to": float})


class EndRow(ValueInSi):
    kind: str
    value: float | None
    error: float | None
    reason: NotRequired[str]
    """Of one that was not located or not looked for."""


class WindowRow(EndKeys, EndsInSi, MisfitRows):
    track: str
    response: str
    symmetric: bool | None
    steps: int
    lyapunov: NotRequired[Sequence[float]]
    """Least and greatest exponent of an aperiodic one."""
    lyapunov_error: NotRequired[float | None]
    from_end: NotRequired[EndRow]
    """This and the next one: of a periodic one, where ends were looked for."""
    to_end: NotRequired[EndRow]
    family: NotRequired[int | None]
    """Where ends were looked for; null of one without a period."""


class BirthRow(TypedDict):
    response: str
    symmetric: bool
    side: str
    stable: bool


ChangeKeys = TypedDict("ChangeKeys", {"from": str, "to": str})


class ChangeRow(ChangeKeys):
    track: str | None
    text: str


class PointRow(ValueInSi):
    parameter: str
    kind: str
    value: float
    error: float | None
    before: str
    after: str
    stable_before: bool | None
    stable_after: bool | None
    direction: int
    branch: int | None
    response: str
    symmetric: bool | None
    stable_above: bool | None
    stable_below: bool | None
    side: str | None
    born: BirthRow | None
    stops: NotRequired[Sequence[str]]
    """Those that are grazed, of several clearances."""
    reason: NotRequired[str]
    """Of an end that was not located."""
    caption: NotRequired[str]
    changes: NotRequired[Sequence[ChangeRow]]


class TouchRow(TypedDict):
    clearance: int
    side: int
    tip: bool
    phase: float
    size: float


class OtherCurveRow(TypedDict):
    kind: str
    n: int
    state: Sequence[float]
    stable: bool
    touch: TouchRow | None


class MeetingRow(TypedDict):
    kind: str
    values: Sequence[float]
    other: NotRequired[OtherCurveRow | None]
    status: NotRequired[str]
    """What became of the other curve."""
    curve: NotRequired[int | None]


class OriginRow(TypedDict):
    curve: int
    kind: str
    values: Sequence[float]


class CurveRow(TypedDict):
    kind: str
    response: str
    symmetric: bool
    points: Sequence[Sequence[float]]
    stable: Sequence[bool]
    ends: Sequence[str]
    codimension_two: Sequence[MeetingRow]
    begun_at: NotRequired[OriginRow | None]


class BorderRow(TypedDict):
    """Where a ray leaves a region."""

    values: Sequence[float]
    kind: str


class BoxRow(TypedDict):
    centre: Sequence[float]
    half_widths: Sequence[float]
    share: float


class EllipseRow(TypedDict):
    centre: Sequence[float]
    half_axes: Sequence[float]
    share: float


SpreadEnds = TypedDict("SpreadEnds", {"from": Sequence[float], "to": Sequence[float]})


class SpreadBoxRow(SpreadEnds):
    share: float
    boards: int
    inside: float


class RegionRow(TypedDict):
    at: Sequence[float]
    response: str
    symmetric: bool
    border: Sequence[BorderRow]
    around: BoxRow
    best: BoxRow
    ellipse_around: EllipseRow
    ellipse_best: EllipseRow
    spread: SpreadBoxRow | None


class ShareStep(ShareRow):
    value: float
    response: str
    symmetric: bool | None
    twin: int | None
    count: int


class AttractorShares(TypedDict):
    number: int
    steps: Sequence[ShareStep]


class SharePlanKeys(TypedDict):
    starts: int
    seed: int
    box: Mapping[str, Sequence[float]]
    periods: Mapping[str, Any]


class SharesRow(SharePlanKeys):
    """Which share of the starts ends where, along a sweep."""

    phase: str
    attractors: Sequence[AttractorShares]


class CurvePlanKeys(EndKeys):
    name: str
    depth: int


class SecondAxis(CurvePlanKeys, EndsInSi, SiUnitKeys):
    at: float
    unit: NotRequired[str]


class WorkHead(TypedDict):
    format: int
    provenance: ProvenanceRow
    cost: dict[str, Any]


AndKey = TypedDict("AndKey", {"and": SecondAxis}, total=False)


class SweepExtras(AndKey, total=False):
    shares: SharesRow
    curves: Sequence[CurveRow]
    region: RegionRow


SweptEnds = TypedDict("SweptEnds", {"from": NotRequired[float], "to": NotRequired[float]})


class SweepBody(SweptEnds, SiUnitKeys, SweepExtras):
    parameter: str
    unit: str
    tracks: Sequence[str]
    steps: int
    windows: Sequence[WindowRow]
    points: Sequence[PointRow]


class SweepAnswer(SweepBody, WorkHead):
    """What ``bifurcation`` prints of a sweep."""

    kind: Literal["sweep"]


class AxisRow(EndKeys, EndsInSi):
    """An axis of a grid."""

    name: str
    steps: int


class GridBody(TypedDict):
    """A grid over two parameters or states."""

    x: AxisRow
    y: AxisRow


class MapBody(GridBody):
    counts: Mapping[str, int]


class MapAnswer(MapBody, WorkHead):
    """What ``bifurcation`` prints of a map."""

    kind: Literal["map"]


class AttractorRow(TypedDict):
    """An attractor; fields of ``basins.Attractor``."""

    number: int
    response: str
    symmetric: bool | None
    strobe: Sequence[float]
    twin: int | None
    share: float


class BasinsBody(GridBody):
    at: Mapping[str, float]
    attractors: Sequence[AttractorRow]
    cells: Sequence[int]


class BasinsAnswer(BasinsBody, WorkHead):
    """What ``bifurcation`` prints of basins."""

    kind: Literal["basins"]


BifurcationAnswer = SweepAnswer | MapAnswer | BasinsAnswer
