"""Entries of a keyed store as Parquet files: rows of a schema, with a head and a seal.

Head and seal stand in the file's key-value metadata, so that any reader of Parquet reads the rows.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from designer.base.seal import BLANK

HEAD, SEAL = b"designer", b"designer-seal"
"""Keys of the file's metadata."""
Rows = Sequence[Mapping[str, Any]]


@dataclass(frozen=True)
class ParquetForm:
    """Rows as mappings from column names to values (``keyed_store.Form``)."""

    schema: pa.Schema
    """Columns and their types."""
    optional: pa.Schema = field(default_factory=lambda: pa.schema([]))
    """Further columns, of which a file has those in which a row has something."""

    def encode(self, head: Mapping[str, Any], value: Rows) -> bytes:
        """The file; equal heads and rows give equal bytes."""
        metadata = {HEAD: json.dumps(head, sort_keys=True), SEAL: BLANK}
        present = [f for f in self.optional if any(row.get(f.name) for row in value)]
        schema = pa.schema([*self.schema, *present])
        table = pa.Table.from_pylist([dict(row) for row in value], schema=schema)
        out = pa.BufferOutputStream()
        pq.write_table(table.replace_schema_metadata(metadata), out)
        content: bytes = out.getvalue().to_pybytes()
        return content

    def decode(self, content: bytes) -> tuple[Mapping[str, Any], Rows]:
        """Head and rows.

        Raises
        ------
        ValueError, TypeError, OSError : other bytes, other columns, or no head.
        """
        try:
            file = pq.ParquetFile(pa.BufferReader(content))
            head = json.loads((file.schema_arrow.metadata or {}).get(HEAD, b"{}"))
            table = file.read()
        except pa.ArrowException as error:
            raise ValueError(str(error)) from None
        if not isinstance(head, dict):
            raise TypeError("a head that is no object")
        present = [f for f in self.optional if f.name in table.column_names]
        if not table.schema.remove_metadata().equals(pa.schema([*self.schema, *present])):
            raise ValueError("other columns")
        rows: Rows = table.to_pylist()
        return head, rows
