"""Rows of a study on disk: folders of Parquet files, one for each finished block of samples.

A row is a flat frozen dataclass with a field ``sample``. Block edges follow from the sample index
alone, and every file says which study it belongs to, so that an interrupted study goes on where
it stopped and a longer one takes over what is there. A file appears whole or not at all.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, fields
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar, get_type_hints

import pyarrow as pa
import pyarrow.parquet as pq

from designer.base.atomic_write import appearing
from designer.yields.verdict import BLOCK

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    class Sampled(DataclassInstance, Protocol):
        """A row of one sample."""

        @property
        def sample(self) -> int: ...

    Row = TypeVar("Row", bound=Sampled)
else:
    Row = TypeVar("Row")

FORMAT = 2
_KEY = b"designer"
_TYPES: dict[type, pa.DataType] = {
    bool: pa.bool_(),
    int: pa.int64(),
    float: pa.float64(),
    str: pa.string(),
}


class BlockStore(Generic[Row]):
    """The rows of one layer of a study.

    Parameters
    ----------
    root : the design folder. folder : the layer's, in it, such as ``samples.parquet``.
    row : the dataclass; its fields are str, int, float, bool or StrEnum.
    study : hash of everything that decides a row.
    omegas : of the questions; where rows have a ``question``, readers get a column ``omega``.
    labels : names of measured boards; where there are any, readers get a column ``board``, which
    has the name of each sample's, in turn.
    size : samples of a block.
    note : told how many blocks of another study were met.
    guard : called before each write; raises where the folder is no longer the study's.
    """

    def __init__(
        self,
        root: Path,
        folder: str,
        row: type[Row],
        study: str,
        *,
        omegas: Sequence[float | None] = (),
        labels: Sequence[str] = (),
        size: int = BLOCK,
        guard: Callable[[], None] = lambda: None,
        note: Callable[[str], None] = lambda _: None,
    ) -> None:
        self.names: set[str] = set()
        """Files of this study that were read or written, relative to the design folder."""
        self.size = size
        self._root, self._folder, self._row, self._study = root, folder, row, study
        self._omegas, self._guard, self._note = omegas, guard, note
        self._labels = labels
        self._foreign: set[str] = set()
        self._noted = 0
        self._hints = {f.name: get_type_hints(row)[f.name] for f in fields(row)}
        self._schema = self._schema_of()
        self._found: dict[str, list[Row]] = {}

    def name(self, block: range) -> str:
        """File of a block, relative to the design folder."""
        return f"{self._folder}/block-{block.start // self.size:06d}.parquet"

    def read(self, block: range) -> list[Row]:
        """What is known of the block's samples in this very study; nothing where a file is of
        another study, damaged or not there."""
        name = self.name(block)
        try:
            held = pq.read_schema(self._root / name).metadata or {}
            said = json.loads(held.get(_KEY, b"{}"))
            if {k: said.get(k) for k in ("format", "study")} != self._said():
                self._foreign.add(name)
                return []
            table = pq.read_table(self._root / name, schema=self._schema, partitioning=None)
            rows = [self._row_of(found) for found in table.to_pylist()]
        except (OSError, ValueError, KeyError, TypeError, pa.ArrowException):
            return []
        if len(rows) != said.get("rows"):
            return []
        self._found[name] = rows
        return [row for row in rows if row.sample in block]

    def put(self, block: range, rows: Sequence[Row]) -> None:
        """Keep a block's rows, all at once; a file that holds just these is left alone.

        Raises
        ------
        InputError : the place cannot be written, the disk is full, or ``guard`` says so.
        """
        name = self.name(block)
        self.names.add(name)
        if self._found.get(name) == list(rows):
            return
        self._guard()
        said = {**self._said(), "first": block.start, "rows": len(rows)}
        schema = self._schema.with_metadata({_KEY: json.dumps(said, sort_keys=True)})
        table = pa.Table.from_pylist([self._columns(row) for row in rows], schema=schema)
        path = self._root / name
        kept = "a place that can be written; finished blocks are kept: --resume goes on"
        with appearing(path, "the block of samples", kept) as partial:
            path.parent.mkdir(exist_ok=True)
            pq.write_table(table, partial)
        self._found[name] = list(rows)

    def say_ignored(self) -> None:
        """Tell once how many blocks of another study or of other rules were left aside."""
        count = len(self._foreign)
        if count > self._noted:
            blocks = "1 block" if count == 1 else f"{count} blocks"
            self._note(f"{self._folder}: {blocks} of another study ignored, computed again")
        self._noted = count

    def forget(self) -> None:
        """Let go of the rows that are kept for comparison: memory stays flat."""
        self._found.clear()

    def _said(self) -> dict[str, Any]:
        return {"format": FORMAT, "study": self._study}

    def _schema_of(self) -> pa.Schema:
        columns = []
        for name, kind in self._hints.items():
            plain = str if issubclass(kind, StrEnum) else kind
            columns.append((name, _TYPES[plain]))
            if name == "sample" and self._labels:
                columns.append(("board", pa.string()))
            if name == "question" and self._omegas:
                columns.append(("omega", pa.float64()))
        return pa.schema(columns)

    def _columns(self, row: Row) -> dict[str, Any]:
        values = asdict(row)
        for name, value in values.items():
            if isinstance(value, StrEnum):
                values[name] = str(value)
        if self._omegas:
            values["omega"] = self._omegas[values["question"]]
        if self._labels:
            values["board"] = self._labels[row.sample % len(self._labels)]
        return values

    def _row_of(self, values: dict[str, Any]) -> Row:
        known = {name: values[name] for name in self._hints}
        for name, kind in self._hints.items():
            if issubclass(kind, StrEnum):
                known[name] = kind(known[name])
        return self._row(**known)
