"""Rows of a study on disk: folders of Parquet files, one for each finished block of samples.

A row is a flat frozen dataclass with a field ``sample``. Block edges follow from the sample index
alone, and every file says which study it belongs to, so that an interrupted study goes on where
it stopped and a longer one takes over what is there. A file appears whole or not at all, and one
that was damaged since is not taken (``base.keyed_store``).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, fields
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Any, Generic, TypeVar

import pyarrow as pa

from designer.base.atomic_write import appearing
from designer.base.keyed_store import KeyedStore, Vouch, nobody
from designer.base.parquet_entry import MOST_ROWS, ParquetCodec, Rows, columns_of
from designer.base.progress import quiet
from designer.base.record_check import read_record
from designer.dynamics.counts import read_counts
from designer.dynamics.orbit import OrbitStatus
from designer.verdicts.cross_check import UNDECIDED, CrossCheck, StartKind
from designer.verdicts.verdict import BLOCK, BoardRow

Row = TypeVar("Row", bound=BoardRow | CrossCheck)
FORMAT = 2
_WORDS = {*OrbitStatus, UNDECIDED, ""}
"""What a response is called that has no n-p-q."""


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
    note : told which blocks are damaged, and how many of another study were met.
    vouch : asked about blocks of earlier versions, which have no checksum.
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
        note: Callable[[str], None] = quiet,
        vouch: Vouch = nobody,
    ) -> None:
        self.names: set[str] = set()
        """Files of this study that were read or written, relative to the design folder."""
        self.size = size
        self._root, self._folder, self._row, self._study = root, folder, row, study
        self._omegas, self._guard, self._note = omegas, guard, note
        self._labels = labels
        self._noted = 0
        self._names = [f.name for f in fields(row)]
        most = size * len(StartKind) * len(omegas) if omegas else MOST_ROWS
        codec = ParquetCodec(self._schema_of(), most=most)
        self._store: KeyedStore[Rows] = KeyedStore(root, codec, note, vouch, self._write)
        self._read: dict[str, list[Row]] = {}

    def name(self, block: range) -> str:
        """File of a block, relative to the design folder."""
        return f"{self._folder}/block-{block.start // self.size:06d}.parquet"

    def read(self, block: range) -> list[Row]:
        """The stored rows of the block's samples in this study; none where a file is of another
        study, damaged or not there."""
        name = self.name(block)
        rows = self._store.read_as(name, self._key(block), partial(self._rows_of, block))
        if rows is None:
            return []
        if name not in self._store.unsealed:
            self._read[name] = rows
        return [row for row in rows if row.sample in block]

    def put(self, block: range, rows: Sequence[Row]) -> None:
        """Store a block's rows, all at once; a file that holds just these is left alone.

        Raises
        ------
        InputError : the place cannot be written, the disk is full, or ``guard`` says so.
        """
        name = self.name(block)
        self.names.add(name)
        if self._read.get(name) == list(rows):
            return
        self._guard()
        columns = [self._columns(row) for row in rows]
        self._store.write(name, self._key(block), columns, {"rows": len(rows)})
        self._read[name] = list(rows)

    def say_ignored(self) -> None:
        """Tell once how many blocks of another study or of other rules were left aside."""
        count = len(self._store.foreign)
        if count > self._noted:
            blocks = "1 block" if count == 1 else f"{count} blocks"
            self._note(f"{self._folder}: {blocks} of another study ignored, computed again")
        self._noted = count

    def forget(self) -> None:
        """Drop the rows that are held for comparison: memory stays flat."""
        self._read.clear()

    def _key(self, block: range) -> dict[str, Any]:
        first = block.start // self.size * self.size
        return {"format": FORMAT, "study": self._study, "first": first}

    def _write(self, name: str, content: bytes) -> None:
        expected = "a place that can be written; finished blocks are kept: --resume goes on"
        path = self._root / name
        with appearing(path, "the block of samples", expected) as partial:
            path.parent.mkdir(exist_ok=True)
            partial.write_bytes(content)

    def _schema_of(self) -> pa.Schema:
        columns = []
        for column in columns_of(self._row, self._names):
            columns.append(column)
            if column.name == "sample" and self._labels:
                columns.append(pa.field("board", pa.string()))
            if column.name == "question" and self._omegas:
                columns.append(pa.field("omega", pa.float64()))
        return pa.schema(columns)

    def _columns(self, row: Row) -> dict[str, Any]:
        values: dict[str, Any] = {
            name: str(value) if isinstance(value, StrEnum) else value
            for name, value in asdict(row).items()
        }
        if self._omegas:
            values["omega"] = self._omegas[values["question"]]
        if self._labels:
            values["board"] = self._labels[row.sample % len(self._labels)]
        return values

    def _rows_of(self, block: range, stored: Rows) -> list[Row]:
        """The rows of a file; ValueError where they are not such as a study writes."""
        rows = [read_record(self._row, {n: row[n] for n in self._names}) for row in stored]
        first = block.start // self.size * self.size
        for row in rows:
            if not first <= row.sample < first + self.size:
                raise ValueError(f"sample {row.sample}")
            if not 0 <= row.question < (len(self._omegas) or MOST_ROWS):
                raise ValueError(f"question {row.question}")
            if row.response not in _WORDS and read_counts(row.response) is None:
                raise ValueError(f"response {row.response}")
        keys = [(row.sample, row.question, getattr(row, "kind", "")) for row in rows]
        if len(set(keys)) < len(keys):
            raise ValueError("two rows of one sample")
        return rows
