"""Counted basins on disk: finished blocks as Parquet, the whole as CSV."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pyarrow as pa

from designer.base.csv_tables import csv_text
from designer.base.parquet_entry import ParquetCodec, Rows, columns_of
from designer.base.record_check import read_record
from designer.bifurcations.basin_shares import AttractorShare, BasinShares, SharePlan, Step
from designer.folders.work_files import WorkFiles

_COLUMNS = columns_of(
    AttractorShare, "attractor status n p q more symmetric twin count strobes".split()
)


@dataclass(frozen=True)
class ShareBlocks:
    """Blocks of the counted basins of one sweep: ``shares.parquet/block-000000.parquet`` in
    a folder, a row for each attractor at each value."""

    files: WorkFiles
    """Where the blocks lie."""
    parameter: str
    """Name of the swept parameter's column."""

    @staticmethod
    def name(block: int) -> str:
        """File name of a block, inside the folder."""
        return f"shares.parquet/block-{block:06d}.parquet"

    @staticmethod
    def names(plan: SharePlan) -> list[str]:
        """File names of all blocks, inside the folder."""
        return [ShareBlocks.name(k) for k in range(len(plan.blocks()))]

    def read(self, block: int) -> list[Step] | None:
        """The steps of a finished block of this very work, or None."""

        def steps(rows: Rows) -> list[Step]:
            by_value: dict[float, list[AttractorShare]] = {}
            for row in map(dict, rows):
                by_value.setdefault(row.pop(self.parameter), []).append(
                    read_record(AttractorShare, row)
                )
            return [tuple(step) for step in by_value.values()]

        return self.files.read(self.name(block), self._codec, steps, block=block)

    def write(self, block: int, values: Sequence[float], steps: Sequence[Step]) -> None:
        """Keep a finished block."""
        rows = [
            {self.parameter: value, **share.__dict__, "status": str(share.status)}
            for value, step in zip(values, steps, strict=True)
            for share in step
        ]
        self.files.write(self.name(block), self._codec, rows, block=block)

    @property
    def _codec(self) -> ParquetCodec:
        return ParquetCodec(pa.schema([pa.field(self.parameter, pa.float64()), *_COLUMNS]))


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
