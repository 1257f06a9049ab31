"""Finished bifurcation curves on disk, as Parquet and as CSV."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pyarrow as pa

from designer.base.csv_tables import csv_text
from designer.base.parquet_entry import ParquetForm
from designer.bifurcations.border_curves import BLOCKS, BorderCurve, read_curve
from designer.folders.work_files import WorkFiles

_MEETING = pa.struct([("kind", pa.string()), ("values", pa.list_(pa.float64()))])
_FORM = ParquetForm(
    pa.schema(
        [
            ("kind", pa.string()),
            ("response", pa.string()),
            ("symmetric", pa.bool_()),
            ("points", pa.list_(pa.list_(pa.float64()))),
            ("stable", pa.list_(pa.bool_())),
            ("ends", pa.list_(pa.string())),
            ("codimension_two", pa.list_(_MEETING)),
        ]
    )
)


@dataclass(frozen=True)
class CurveBlocks:
    """Blocks of the curves of one sweep: ``curves.parquet/block-000000.parquet`` in a folder."""

    files: WorkFiles
    """Where the blocks lie."""

    @staticmethod
    def names() -> list[str]:
        """File names of all blocks, inside the folder."""
        return [f"curves.parquet/block-{k:06d}.parquet" for k in range(BLOCKS)]

    def read(self, block: int) -> list[BorderCurve] | None:
        """The curves of a finished block of this very work, or None."""
        rows = self.files.read(self.names()[block], _FORM, block=block)
        return None if rows is None else [read_curve(row) for row in rows]

    def write(self, block: int, curves: Sequence[BorderCurve]) -> None:
        """Keep a finished block, a row a curve."""
        rows = [curve.as_dict() for curve in curves]
        self.files.write(self.names()[block], _FORM, rows, block=block)


def curves_csv(curves: Sequence[BorderCurve], first: str, second: str) -> str:
    """A row a point: the curve's number, kind, response, symmetry, both values, whether the orbit
    is stable on one side; points of codimension two follow their curve, with their name as kind."""
    columns = ("curve", "kind", "response", "symmetric", first, second, "stable")
    rows = []
    for number, c in enumerate(curves, 1):
        head = {"curve": str(number), "response": c.response, "symmetric": str(c.symmetric).lower()}
        for (a, b), stable in zip(c.points.tolist(), c.stable, strict=True):
            at = {"kind": c.kind, first: repr(a), second: repr(b), "stable": str(stable).lower()}
            rows.append({**head, **at})
        for name, a, b in c.codimension_two:
            rows.append({**head, "kind": name, first: repr(a), second: repr(b), "stable": ""})
    return csv_text(columns, rows)
