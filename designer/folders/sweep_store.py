"""Steps of a sweep, and cells of a map or a basin, on disk (``work_files``)."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa

from designer.base.arrays import Array
from designer.base.parquet_entry import ParquetCodec, Rows, columns_of
from designer.base.record_check import read_record
from designer.bifurcations.parameter_map import MapCell
from designer.bifurcations.sweep import BLOCK, Sweep
from designer.dynamics.orbit import Motion
from designer.dynamics.steady_state import SteadyMotion
from designer.folders.work_files import WorkFiles

RULES = 4
"""Raised whenever a rule changes that decides what a step shows: then old blocks are not reused."""
_STEP = columns_of(
    SteadyMotion,
    "status n p q symmetric lyapunov lyapunov_error radius start end minima velocities "
    "periods".split(),
)
_CELL = columns_of(MapCell, "status n p q symmetric lyapunov strobe".split())
_MORE = pa.schema(columns_of(MapCell, ["more"]))
"""The column of systems with more clearances than one."""
_FURTHER = pa.schema(columns_of(SteadyMotion, ["more", "further"]))
"""The same, and the column of sweeps that show more stops than one."""


def work_hash(settings: Mapping[str, Any]) -> str:
    """Hash of what decides a result."""
    text = json.dumps({"rules": RULES, **settings}, sort_keys=True)
    return hashlib.sha256(text.encode("ascii")).hexdigest()


def write_sweep(path: Path, sweep: Sweep, provenance: Mapping[str, Any]) -> None:
    """A whole sweep as one Parquet file, with the columns of the blocks: track after track, the
    values ascending.

    Raises
    ------
    InputError : it cannot be written.
    """
    parameter = sweep.plan.parameter
    rows = [
        row
        for track, steps in sweep.steps.items()
        for row in _rows(parameter, track, [float(v) for v in sweep.plan.values], steps)
    ]
    files = WorkFiles(path.parent, work_hash(sweep.plan.as_dict()), provenance)
    files.write(path.name, _sweep_codec(parameter, len(rows)), rows)


def _sweep_codec(parameter: str, most: int) -> ParquetCodec:
    schema = pa.schema([pa.field("track", pa.string()), pa.field(parameter, pa.float64()), *_STEP])
    return ParquetCodec(schema, _FURTHER, most)


def _rows(
    parameter: str, track: str, values: Sequence[float], steps: Sequence[SteadyMotion]
) -> list[dict[str, Any]]:
    return [
        {"track": track, parameter: v, **_columns(s)} for v, s in zip(values, steps, strict=True)
    ]


def _columns(motion: Motion) -> dict[str, Any]:
    return {**motion.__dict__, "status": str(motion.status)}


@dataclass(frozen=True)
class SweepStore:
    """Blocks of one sweep: ``sweep.parquet/TRACK-000000.parquet`` in a folder."""

    files: WorkFiles
    """Where the blocks lie."""
    parameter: str
    """Name of the swept parameter's column."""

    @staticmethod
    def name(track: str, block: int) -> str:
        """File name of a block, inside the folder."""
        return f"sweep.parquet/{track.replace(' ', '-')}-{block:06d}.parquet"

    def read(self, track: str, block: int) -> list[SteadyMotion] | None:
        """The steps of a finished block of this very work, or None."""
        codec = _sweep_codec(self.parameter, BLOCK)
        name = self.name(track, block)
        return self.files.read(name, codec, self._steps, track=track, block=block)

    def _steps(self, rows: Rows) -> list[SteadyMotion]:
        out = []
        for row in map(dict, rows):
            del row["track"], row[self.parameter]
            out.append(read_record(SteadyMotion, row))
        return out

    def write(
        self, track: str, block: int, values: Sequence[float], steps: list[SteadyMotion]
    ) -> None:
        """Keep a finished block; rows in the order in which the steps were made."""
        rows = _rows(self.parameter, track, values, steps)
        codec = _sweep_codec(self.parameter, BLOCK)
        self.files.write(self.name(track, block), codec, rows, track=track, block=block)


@dataclass(frozen=True)
class GridStore:
    """Rows of one map or basin: ``KIND.parquet/row-000000.parquet`` in a folder."""

    files: WorkFiles
    """Where the rows lie."""
    kind: str
    """"map" or "basins"."""
    x: str
    """Name of the column of values along a row."""
    xs: Array
    """Values along a row."""
    y: str
    """Name of the column of values from row to row."""
    ys: Array
    """Values from row to row."""

    @staticmethod
    def name(kind: str, row: int) -> str:
        """File name of a row, inside the folder."""
        return f"{kind}.parquet/row-{row:06d}.parquet"

    def read(self, row: int) -> list[MapCell] | None:
        """The cells of a finished row of this very work, or None."""

        def cells(rows: Rows) -> list[MapCell]:
            out = []
            for each in map(dict, rows):
                del each[self.x], each[self.y]
                out.append(read_record(MapCell, each))
            if [(cell.i, cell.j) for cell in out] != [(row, j) for j in range(len(self.xs))]:
                raise ValueError("cells of other places")
            return out

        return self.files.read(self.name(self.kind, row), self._codec, cells, row=row)

    def write(self, row: int, cells: list[MapCell]) -> None:
        """Keep a finished row."""
        rows = []
        for cell in cells:
            coordinates = {self.x: float(self.xs[cell.j]), self.y: float(self.ys[cell.i])}
            rows.append({**coordinates, **_columns(cell)})
        self.files.write(self.name(self.kind, row), self._codec, rows, row=row)

    @property
    def _codec(self) -> ParquetCodec:
        at = [pa.field(name, pa.float64()) for name in (self.x, self.y)]
        schema = pa.schema([*columns_of(MapCell, "ij"), *at, *_CELL])
        return ParquetCodec(schema, _MORE, len(self.xs))
