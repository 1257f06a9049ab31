"""Blocks of a store as a stranger may write them: other rows, with a seal that is right."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq

from designer.base.parquet_entry import HEAD, ParquetCodec
from designer.base.seal import intact, sealed

Change = Callable[[list[dict[str, Any]]], list[dict[str, Any]]]


def reseal(path: Path, change: Change) -> None:
    """Put what ``change`` makes of a block's rows in their place."""
    table = pq.read_table(path)
    head = json.loads(table.schema.metadata[HEAD])
    codec = ParquetCodec(table.schema.remove_metadata())
    path.write_bytes(sealed(codec.encode(head, change(table.to_pylist()))))
    assert intact(path.read_bytes())


def with_value(key: str, value: Any, row: int = -1) -> Change:
    """Another value in one column of one row."""

    def change(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
        rows[row][key] = value
        return rows

    return change
