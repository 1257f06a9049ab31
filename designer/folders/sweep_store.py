"""Finished blocks of a sweep, a map or a basin on disk, as Parquet.

Every file says which work it belongs to and carries the provenance; it appears whole or not at
all, and one that was damaged since is not taken (``base.keyed_store``).
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from designer.base.arrays import Array
from designer.base.keyed_store import KeyedStore, Note, Vouch, nobody, quiet
from designer.base.parquet_entry import ParquetForm, Rows
from designer.bifurcations.parameter_map import MapCell
from designer.bifurcations.sweep import Sweep
from designer.dynamics.orbit import Motion, OrbitStatus
from designer.dynamics.steady_state import Steady

FORMAT = 1
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
"""Of systems with more clearances than one."""
_FURTHER = pa.schema([*_MORE, ("further", pa.list_(pa.list_(pa.float64())))])
"""Of sweeps that show more stops than one."""


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
    key = {"format": FORMAT, "work": work_hash(sweep.plan.as_dict())}
    form = ParquetForm(_sweep_schema(parameter), _FURTHER)
    store: KeyedStore[Rows] = KeyedStore(path.parent, form)
    store.write(path.name, key, rows, {"provenance": provenance})


def _sweep_schema(parameter: str) -> pa.Schema:
    return pa.schema([("track", pa.string()), (parameter, pa.float64()), *_COLUMNS])


def _rows(
    parameter: str, track: str, values: Sequence[float], steps: Sequence[Steady]
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


@dataclass(frozen=True)
class SweepStore:
    """Blocks of one sweep: ``sweep.parquet/TRACK-000000.parquet`` in ``root``."""

    root: Path
    """Folder that the blocks lie in."""
    parameter: str
    """Name of the swept parameter's column."""
    work: str
    """Hash of the plan."""
    provenance: Mapping[str, Any]
    """Versions, seed and settings, which go into every file."""
    note: Note = quiet
    """Told of entries that are not taken."""
    vouch: Vouch = nobody
    """Asked about entries without a seal."""

    @staticmethod
    def name(track: str, block: int) -> str:
        """File name of a block, inside root."""
        return f"sweep.parquet/{track.replace(' ', '-')}-{block:06d}.parquet"

    def read(self, track: str, block: int) -> list[Steady] | None:
        """The steps of a finished block of this very work, or None."""
        rows = self._store.read(self.name(track, block), self._key(track, block))
        if rows is None:
            return None
        out = []
        for row in map(dict, rows):
            del row["track"], row[self.parameter]
            row.update(_named(row))
            for key in ("start", "end", "minima", "velocities"):
                row[key] = np.array(row[key], dtype=float)
            row["further"] = tuple(np.array(v, dtype=float) for v in row.get("further") or ())
            out.append(Steady(**row))
        return out

    def write(self, track: str, block: int, values: Sequence[float], steps: list[Steady]) -> None:
        """Keep a finished block; rows in the order in which the steps were made."""
        rows = _rows(self.parameter, track, values, steps)
        more = {"provenance": self.provenance}
        self._store.write(self.name(track, block), self._key(track, block), rows, more)

    @cached_property
    def _store(self) -> KeyedStore[Rows]:
        form = ParquetForm(_sweep_schema(self.parameter), _FURTHER)
        return KeyedStore(self.root, form, self.note, self.vouch)

    def _key(self, track: str, block: int) -> dict[str, Any]:
        return {"format": FORMAT, "work": self.work, "track": track, "block": block}


@dataclass(frozen=True)
class GridStore:
    """Rows of one map or basin: ``KIND.parquet/row-000000.parquet`` in ``root``."""

    root: Path
    """Folder that the rows lie in."""
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
    work: str
    """Hash of the plan."""
    provenance: Mapping[str, Any]
    """Versions, seed and settings, which go into every file."""
    note: Note = quiet
    """Told of entries that are not taken."""
    vouch: Vouch = nobody
    """Asked about entries without a seal."""

    @staticmethod
    def name(kind: str, row: int) -> str:
        """File name of a row, inside root."""
        return f"{kind}.parquet/row-{row:06d}.parquet"

    def read(self, row: int) -> list[MapCell] | None:
        """The cells of a finished row of this very work, or None."""
        rows = self._store.read(self.name(self.kind, row), self._key(row))
        if rows is None or len(rows) != len(self.xs):
            return None
        out = []
        for each in map(dict, rows):
            del each[self.x], each[self.y]
            each.update(_named(each))
            each["strobe"] = tuple(each["strobe"])
            out.append(MapCell(**each))
        return out

    def write(self, row: int, cells: list[MapCell]) -> None:
        """Keep a finished row."""
        rows = []
        for cell in cells:
            coordinates = {self.x: float(self.xs[cell.j]), self.y: float(self.ys[cell.i])}
            rows.append({**coordinates, **_columns(cell)})
        name = self.name(self.kind, row)
        self._store.write(name, self._key(row), rows, {"provenance": self.provenance})

    @cached_property
    def _store(self) -> KeyedStore[Rows]:
        return KeyedStore(self.root, ParquetForm(self._schema, _MORE), self.note, self.vouch)

    @property
    def _schema(self) -> pa.Schema:
        return pa.schema(
            [
                ("i", pa.int64()),
                ("j", pa.int64()),
                (self.x, pa.float64()),
                (self.y, pa.float64()),
                *_COLUMNS[:6],
                ("strobe", pa.list_(pa.float64())),
            ]
        )

    def _key(self, row: int) -> dict[str, Any]:
        return {"format": FORMAT, "work": self.work, "row": row}
