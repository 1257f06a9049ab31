"""A bifurcation curve over two parameters as plain data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

from designer.base.arrays import Array
from designer.base.record_check import read_record
from designer.bifurcations.curve_switch import OtherCurve, other_curve, read_other_curve
from designer.bifurcations.plane_curves import PlaneCurve
from designer.bifurcations.points import PointKind
from designer.dynamics.counts import period_of

if TYPE_CHECKING:
    from designer.answers.bifurcation_answer import CurveRow, MeetingRow, OriginRow

FOLLOWED, NO_OTHER, NOT_BUILT = "followed", "no other curve", "not built"
UNSTABLE, DEEPER, LOST = "unstable orbits only", "deeper than asked for", "no convergence"
"""What became of the other curve at a point of codimension two."""


@dataclass(frozen=True)
class CurveMeeting:
    """A point of codimension two on a curve, as plain data."""

    name: str
    """Name of the point; see ``codimension_two``."""
    values: tuple[float, float]
    """Values of both parameters."""
    other: OtherCurve | None = None
    """The other curve of the same orbits there, if there is one."""
    curve: int = 0
    """Number of the other curve among those that were followed, from 1; 0 where it is not."""
    status: str = ""
    """What became of the other curve; "" before all curves are followed."""

    def as_dict(self) -> MeetingRow:
        """Plain, for JSON."""
        return {
            "kind": self.name,
            "values": list(self.values),
            "other": None if self.other is None else self.other.as_dict(),
            "status": self.status,
            "curve": self.curve or None,
        }


@dataclass(frozen=True)
class CurveOrigin:
    """The point of codimension two that a curve was begun at."""

    curve: int
    """Number of the curve that it was found on, from 1."""
    name: str
    values: tuple[float, float]
    """Values of both parameters."""

    def as_dict(self) -> OriginRow:
        """Plain, for JSON."""
        return {"curve": self.curve, "kind": self.name, "values": list(self.values)}


@dataclass(frozen=True)
class BorderCurve:
    """A bifurcation curve as plain data."""

    kind: str
    """What happens on it; see ``points.PointKind``."""
    response: str
    """The response at the point that it was begun at, as "n-p-q"."""
    symmetric: bool
    """Whether its orbits are symmetric."""
    points: Array
    """(points, 2) values of both parameters, in order of arclength."""
    stable: tuple[bool, ...]
    """For each point, whether the orbit is stable on one side of the curve."""
    ends: tuple[str, str]
    """Why it stops at its first and at its last point; see ``plane_curves.PlaneCurve``."""
    codimension_two: tuple[CurveMeeting, ...]
    """The points of codimension two, in its order."""
    begun_at: CurveOrigin | None = None
    """Where it was switched to; None where it was begun at a point of the sweep."""

    @classmethod
    def of(cls, curve: PlaneCurve) -> BorderCurve:
        """The plain data of a followed curve."""
        met = [(c.name, c.values, other_curve(curve.system, c)) for c in curve.codimension_two]
        return cls(
            str(curve.kind),
            curve.response,
            curve.system.symmetric,
            curve.values,
            curve.stable,
            curve.ends,
            tuple(CurveMeeting(*each) for each in met),
        )

    def as_dict(self) -> CurveRow:
        """Plain, for JSON."""
        return {
            "kind": self.kind,
            "response": self.response,
            "symmetric": self.symmetric,
            "points": self.points.tolist(),
            "stable": list(self.stable),
            "ends": list(self.ends),
            "codimension_two": [met.as_dict() for met in self.codimension_two],
            "begun_at": None if self.begun_at is None else self.begun_at.as_dict(),
        }

    @property
    def n(self) -> int:
        """Period of its orbits, in drive periods."""
        return period_of(self.response)

    @property
    def turned(self) -> BorderCurve:
        """The same with its parameters exchanged."""
        met = tuple(replace(m, values=m.values[::-1], other=None) for m in self.codimension_two)
        return replace(self, points=self.points[:, ::-1], codimension_two=met)


def read_curve(row: Mapping[str, Any]) -> BorderCurve:
    """A curve from its plain data (``BorderCurve.as_dict``).

    Raises
    ------
    ValueError, TypeError, LookupError : it is no curve's.
    """
    values = {each.name: row[each.name] for each in fields(BorderCurve)}
    values |= {
        "kind": str(PointKind(row["kind"])),
        "codimension_two": tuple(
            _read_meeting(met, symmetric=row["symmetric"]) for met in row["codimension_two"]
        ),
    }
    if (at := row["begun_at"]) is not None:
        values["begun_at"] = {"curve": at["curve"], "name": at["kind"], "values": at["values"]}
    curve = read_record(BorderCurve, values)
    if curve.points.shape != (len(curve.stable), 2):
        raise ValueError("a curve of no points, or of more points than it has stabilities")
    return curve


def _read_meeting(row: Mapping[str, Any], *, symmetric: bool) -> CurveMeeting:
    values = row["values"]
    other = read_other_curve(row["other"], values, symmetric=symmetric)
    return read_record(CurveMeeting, {"name": row["kind"], "values": values, "other": other})
