"""Finished bifurcation curves on disk, as Parquet and as CSV."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import pyarrow as pa

from designer.base.csv_tables import csv_text
from designer.base.keyed_store import KeyedStore, Note, Vouch, nobody, quiet
from designer.base.parquet_entry import ParquetForm, Rows
from designer.bifurcations.border_curves import BLOCKS, BorderCurve, read_curve

FORMAT = 1
_MEETING = pa.struct([("kind", pa.string()), ("values", pa.list_(pa.float64()))])
_SCHEMA = pa.schema(
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


@dataclass(frozen=True)
class CurveBlocks:
    """Blocks of the curves of one sweep: ``curves.parquet/block-000000.parquet`` in ``root``."""

    root: Path
    """Folder that the blocks lie in."""
    work: str
    """Hash of what decides the curves."""
    provenance: Mapping[str, Any]
    """Versions, seed and settings, which go into every file."""
    note: Note = quiet
    """Told of entries that are not taken."""
    vouch: Vouch = nobody
    """Asked about entries without a seal."""

    @staticmethod
    def names() -> list[str]:
        """File names of all blocks, inside root."""
        return [f"curves.parquet/block-{k:06d}.parquet" for k in range(BLOCKS)]

    def read(self, block: int) -> list[BorderCurve] | None:
        """The curves of a finished block of this very work, or None."""
        rows = self._store.read(self.names()[block], self._key(block))
        return None if rows is None else [read_curve(row) for row in rows]

    def write(self, block: int, curves: Sequence[BorderCurve]) -> None:
        """Keep a finished block, a row a curve."""
        rows = [curve.as_dict() for curve in curves]
        more = {"provenance": self.provenance}
        self._store.write(self.names()[block], self._key(block), rows, more)

    @cached_property
    def _store(self) -> KeyedStore[Rows]:
        return KeyedStore(self.root, ParquetForm(_SCHEMA), self.note, self.vouch)

    def _key(self, block: int) -> dict[str, Any]:
        return {"format": FORMAT, "work": self.work, "block": block}


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
