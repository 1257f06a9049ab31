"""Finished bifurcation curves on disk, as Parquet and as CSV."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import pyarrow as pa

from designer.base.csv_tables import csv_text
from designer.base.parquet_entry import ParquetCodec, columns_of
from designer.base.si_unit import Unit
from designer.bifurcations.border_curve import BorderCurve, CurveMeeting, CurveOrigin, read_curve
from designer.bifurcations.border_curves import BLOCKS
from designer.bifurcations.curve_switch import OtherCurve
from designer.bifurcations.grazing_contact import GrazingContact
from designer.folders.work_files import WorkFiles

_TOUCH = [
    *columns_of(GrazingContact, "clearance side tip".split()),
    *columns_of(OtherCurve, "phase size".split()),
]
_OTHER = [
    *columns_of(OtherCurve, "kind n state stable".split()),
    pa.field("touch", pa.struct(_TOUCH)),
]
_KIND, _VALUES = pa.field("kind", pa.string()), *columns_of(CurveMeeting, ["values"])
_MEETING = pa.struct([_KIND, _VALUES, pa.field("other", pa.struct(_OTHER))])
_ORIGIN = pa.struct([*columns_of(CurveOrigin, ["curve"]), _KIND, _VALUES])
_CODEC = ParquetCodec(
    pa.schema(
        [
            *columns_of(BorderCurve, "kind response symmetric".split()),
            pa.field("points", pa.list_(pa.list_(pa.float64()))),
            *columns_of(BorderCurve, "stable ends".split()),
            pa.field("codimension_two", pa.list_(_MEETING)),
            pa.field("begun_at", _ORIGIN),
        ]
    )
)


@dataclass(frozen=True)
class CurveBlocks:
    """Blocks of the curves of one sweep: ``curves.parquet/block-000000.parquet`` in a folder."""

    files: WorkFiles
    """Where the blocks lie."""

    @staticmethod
    def names(depth: int) -> list[str]:
        """File names of all blocks, inside the folder. depth : see ``border_curves.CurvePlan``."""
        return [CurveBlocks.name(k) for k in range(BLOCKS * (1 + depth))]

    @staticmethod
    def name(block: int) -> str:
        """File name of a block, inside the folder."""
        return f"curves.parquet/block-{block:06d}.parquet"

    def read(self, block: int) -> list[BorderCurve] | None:
        """The curves of a finished block of this very work, or None."""
        return self.files.read(
            self.name(block), _CODEC, lambda rows: list(map(read_curve, rows)), block=block
        )

    def write(self, block: int, curves: Sequence[BorderCurve]) -> None:
        """Keep a finished block, a row a curve."""
        rows = [curve.as_dict() for curve in curves]
        self.files.write(self.name(block), _CODEC, rows, block=block)


def curves_csv(
    curves: Sequence[BorderCurve], first: str, second: str, units: Mapping[str, Unit] | None = None
) -> str:
    """A row a point: the curve's number, kind, response, symmetry, both values, whether the orbit
    is stable on one side, and where the curve was begun if it was switched to; points of
    codimension two follow their curve, with their name as kind. units : of the parameters that have
    an SI unit; such a one's values stand in it too, last."""
    in_si = {name: unit for name, unit in (units or {}).items() if name in (first, second)}
    columns = [
        "curve", "kind", "response", "symmetric", first, second, "stable", "begun_at",
        *(f"{name}_{unit.suffix}" for name, unit in in_si.items()),
    ]  # fmt: skip

    def place(values: Sequence[float]) -> dict[str, str]:
        at = dict(zip((first, second), values, strict=True))
        si = {f"{n}_{unit.suffix}": repr(at[n] * unit.scale) for n, unit in in_si.items()}
        return {first: repr(at[first]), second: repr(at[second]), **si}

    rows = []
    for number, c in enumerate(curves, 1):
        head = {"curve": str(number), "response": c.response, "symmetric": str(c.symmetric).lower()}
        head["begun_at"] = origin_text(c.begun_at)
        for values, stable in zip(c.points.tolist(), c.stable, strict=True):
            rows.append({**head, "kind": c.kind, **place(values), "stable": str(stable).lower()})
        rows += [
            {**head, "kind": met.name, **place(met.values), "stable": ""}
            for met in c.codimension_two
        ]
    return csv_text(columns, rows)


def origin_text(origin: CurveOrigin | None) -> str:
    """Such as "fold-flip of curve 3"; "" of a curve through a point of the sweep."""
    return "" if origin is None else f"{origin.name} of curve {origin.curve}"
