"""Steps of a sweep, and cells of a map or a basin, on disk (``work_files``)."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from designer.base.arrays import Array
from designer.base.parquet_entry import ParquetCodec, Rows
from designer.base.record_check import checked_record
from designer.bifurcations.parameter_map import MapCell
from designer.bifurcations.sweep import BLOCK, Sweep
from designer.dynamics.orbit import Motion, OrbitStatus
from designer.dynamics.steady_state import SteadyMotion
from designer.folders.work_files import WorkFiles

RULES = 3
"""Raised whenever a rule changes that decides what a step shows: then old blocks are not reused."""
_COLUMNS = [
    ("status", pa.string()),
    ("n", pa.int64()),
    ("p", pa.int64()),
    ("q", pa.int64()),
    ("symmetric", pa.bool_()),
    ("lyapunov", pa.float64()),
    ("lyapunov_error", pa.float64()),
    ("radius", pa.float64()),
    ("start", pa.list_(pa.float64())),
    ("end", pa.list_(pa.float64())),
    ("minima", pa.list_(pa.float64())),
    ("velocities", pa.list_(pa.float64())),
    ("periods", pa.int64()),
]

_MORE = pa.schema([("more", pa.list_(pa.list_(pa.int64())))])
"""The column of systems with more clearances than one."""
_FURTHER = pa.schema([*_MORE, ("further", pa.list_(pa.list_(pa.float64())))])
"""The columns of sweeps that show more stops than one."""


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
    schema = pa.schema([("track", pa.string()), (parameter, pa.float64()), *_COLUMNS])
    return ParquetCodec(schema, _FURTHER, most)


def _rows(
    parameter: str, track: str, values: Sequence[float], steps: Sequence[SteadyMotion]
) -> list[dict[str, Any]]:
    return [
        {"track": track, parameter: v, **_columns(s)} for v, s in zip(values, steps, strict=True)
    ]


def _columns(motion: Motion) -> dict[str, Any]:
    return {**motion.__dict__, "status": str(motion.status)}


def _named(row: Mapping[str, Any]) -> dict[str, Any]:
    """What ``_columns`` says otherwise than the record does."""
    more = tuple((p, q) for p, q in row.get("more") or ())
    return {"status": OrbitStatus(row["status"]), "more": more}


def _numbers(values: Sequence[float]) -> Array:
    """An array of a list; TypeError where a value is missing."""
    if None in values:
        raise TypeError("a list with nothing in a place")
    return np.array(values, dtype=float)


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
            row.update(_named(row))
            for key in ("start", "end", "minima", "velocities"):
                row[key] = _numbers(row[key])
            row["further"] = tuple(map(_numbers, row.get("further") or ()))
            out.append(checked_record(SteadyMotion, row))
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
                each.update(_named(each))
                each["strobe"] = tuple(each["strobe"])
                out.append(checked_record(MapCell, each))
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
        schema = pa.schema(
            [
                ("i", pa.int64()),
                ("j", pa.int64()),
                (self.x, pa.float64()),
                (self.y, pa.float64()),
                *_COLUMNS[:6],
                ("strobe", pa.list_(pa.float64())),
            ]
        )
        return ParquetCodec(schema, _MORE, len(self.xs))
