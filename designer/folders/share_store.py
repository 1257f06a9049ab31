"""Counted basins on disk: finished blocks as Parquet, the whole as CSV."""

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
from designer.bifurcations.basin_shares import AttractorShare, BasinShares, SharePlan, Step
from designer.dynamics.orbit import OrbitStatus

FORMAT = 1
_COLUMNS = [
    ("attractor", pa.int64()),
    ("status", pa.string()),
    ("n", pa.int64()),
    ("p", pa.int64()),
    ("q", pa.int64()),
    ("more", pa.list_(pa.list_(pa.int64()))),
    ("symmetric", pa.bool_()),
    ("twin", pa.int64()),
    ("count", pa.int64()),
    ("strobes", pa.list_(pa.list_(pa.float64()))),
]


@dataclass(frozen=True)
class ShareBlocks:
    """Blocks of the counted basins of one sweep: ``shares.parquet/block-000000.parquet`` in
    ``root``, a row for each attractor at each value."""

    root: Path
    """Folder that the blocks lie in."""
    parameter: str
    """Name of the swept parameter's column."""
    work: str
    """Hash of what decides the counts."""
    provenance: Mapping[str, Any]
    """Versions, seed and settings, which go into every file."""
    note: Note = quiet
    """Told of entries that are not taken."""
    vouch: Vouch = nobody
    """Asked about entries without a seal."""

    @staticmethod
    def name(block: int) -> str:
        """File name of a block, inside root."""
        return f"shares.parquet/block-{block:06d}.parquet"

    @staticmethod
    def names(plan: SharePlan) -> list[str]:
        """File names of all blocks, inside root."""
        return [ShareBlocks.name(k) for k in range(len(plan.blocks()))]

    def read(self, block: int) -> list[Step] | None:
        """The steps of a finished block of this very work, or None."""
        rows = self._store.read(self.name(block), self._key(block))
        if rows is None:
            return None
        steps: dict[float, list[AttractorShare]] = {}
        for row in map(dict, rows):
            steps.setdefault(row.pop(self.parameter), []).append(_read(row))
        return [tuple(step) for step in steps.values()]

    def write(self, block: int, values: Sequence[float], steps: Sequence[Step]) -> None:
        """Keep a finished block."""
        rows = [
            {self.parameter: value, **share.__dict__, "status": str(share.status)}
            for value, step in zip(values, steps, strict=True)
            for share in step
        ]
        more = {"provenance": self.provenance}
        self._store.write(self.name(block), self._key(block), rows, more)

    @cached_property
    def _store(self) -> KeyedStore[Rows]:
        schema = pa.schema([(self.parameter, pa.float64()), *_COLUMNS])
        return KeyedStore(self.root, ParquetForm(schema), self.note, self.vouch)

    def _key(self, block: int) -> dict[str, Any]:
        return {"format": FORMAT, "work": self.work, "block": block}


def _read(row: dict[str, Any]) -> AttractorShare:
    row["status"] = OrbitStatus(row["status"])
    for key in ("more", "strobes"):
        row[key] = tuple(map(tuple, row[key]))
    return AttractorShare(**row)


def shares_csv(shares: BasinShares) -> str:
    """A row for each attractor at each value: its share of the starts with its limits (95 %), its
    response, and its first strobe."""
    plan = shares.plan
    columns = (
        plan.parameter, "attractor", "response", "symmetric", "twin", "count", "starts", "share",
        "low", "high", *plan.subject.states,
    )  # fmt: skip
    rows = []
    for value, step in zip(plan.values.tolist(), shares.steps, strict=True):
        for s in step:
            low, high = shares.interval(s.count)
            cells = (
                repr(value), s.attractor, s.response, "" if s.symmetric is None else s.symmetric,
                "" if s.twin is None else s.twin, s.count, len(plan.numbers),
                s.count / len(plan.numbers), low, high, *s.strobes[0],
            )  # fmt: skip
            rows.append(dict(zip(columns, map(_text, cells), strict=True)))
    return csv_text(columns, rows)


def _text(cell: object) -> str:
    return str(cell).lower() if isinstance(cell, bool) else str(cell)
