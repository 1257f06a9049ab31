"""Entries of a keyed store as Parquet files: rows of a schema, with a head and a seal.

Head and seal stand in the file's key-value metadata, so that any reader of Parquet reads the rows.

A few bytes of a Parquet file may stand for any number of equal values, and its footer need not say
so. Rows, values and bytes are therefore counted in the headers of its pages before any is decoded.
"""

from __future__ import annotations

import json
import types
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from designer.base.keyed_store import OtherFormError
from designer.base.seal import BLANK

HEAD, SEAL = b"designer", b"designer-seal"
"""Keys of the file's metadata."""
MOST_ROWS = 10_000
"""The most rows of an entry, where its codec does not say."""
MOST_VALUES = 4_000_000
"""The most values of an entry, over all columns; each takes up to 40 bytes here."""
MOST_BYTES = 64_000_000
"""The most bytes of an entry that is unpacked, and of all its texts written out."""
_WRITER = "parquet-cpp-arrow"
Rows = Sequence[Mapping[str, Any]]
_SCALARS: dict[type, pa.DataType] = {
    bool: pa.bool_(),
    int: pa.int64(),
    float: pa.float64(),
    str: pa.string(),
}


def columns_of(kind: type, names: Iterable[str]) -> list[pa.Field]:
    """Columns for these fields of a dataclass, in this order, with the types that it states: a list
    for an array (k,) or a tuple, text for an enumeration."""
    hints = get_type_hints(kind)
    return [pa.field(name, _type_of(hints[name])) for name in names]


def _type_of(kind: Any) -> pa.DataType:
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (Union, types.UnionType):  # or None
        return _type_of(inner[0])
    if origin is np.ndarray:
        return pa.list_(pa.float64())
    if origin is tuple:
        return pa.list_(_type_of(inner[0]))
    return _SCALARS[str if issubclass(kind, StrEnum) else kind]


@dataclass(frozen=True)
class ParquetCodec:
    """Rows as mappings from column names to values (``keyed_store.EntryCodec``)."""

    schema: pa.Schema
    """Columns and their types."""
    optional: pa.Schema = field(default_factory=lambda: pa.schema([]))
    """Further columns, of which a file has those in which a row has something."""
    most: int = MOST_ROWS
    """Rows that an entry may have."""

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
        OtherFormError : a head with other columns, or with more rows than an entry may have.
        ValueError, TypeError, LookupError, OSError : other bytes, no head, or more values or bytes
            than an entry may have.
        """
        try:
            file = pq.ParquetFile(pa.BufferReader(content))
            schema, metadata = file.schema_arrow, file.metadata
            head = json.loads((schema.metadata or {}).get(HEAD, b"{}"))
            if not isinstance(head, dict):
                raise TypeError("a head that is no object")
            present = [f for f in self.optional if f.name in schema.names]
            if not schema.remove_metadata().equals(pa.schema([*self.schema, *present])):
                raise OtherFormError(head, "other columns")
            if metadata.num_rows > self.most:
                found = f"{metadata.num_rows} rows, more than {self.most}"
                raise OtherFormError(head, found)
            texts = _check_size(content, metadata)
            # A text that many rows share stays one text until it is known how long all are.
            file = pq.ParquetFile(pa.BufferReader(content), read_dictionary=texts)
            table = file.read()
            if sum(map(_text_bytes, table.columns)) > MOST_BYTES:
                raise ValueError(f"texts of more than {MOST_BYTES} bytes")
        except pa.ArrowException as error:
            raise ValueError(str(error)) from None
        rows: Rows = table.to_pylist()
        return head, rows


def _check_size(content: bytes, metadata: pq.FileMetaData) -> list[str]:
    """The paths of the columns of text; ValueError for an entry that is too large."""
    if not metadata.created_by.startswith(_WRITER):  # of others the library reads some bytes more
        raise ValueError("another writer")
    values = size = 0
    texts = set()
    for group in range(metadata.num_row_groups):
        for column in range(metadata.num_columns):
            chunk = metadata.row_group(group).column(column)
            if chunk.physical_type == "BYTE_ARRAY":
                texts.add(chunk.path_in_schema)
            if not chunk.total_compressed_size:  # of a table without rows
                continue
            offsets = (chunk.data_page_offset, chunk.dictionary_page_offset or 0)
            begin = min(offset for offset in offsets if offset)
            for count, unpacked in _pages(content, begin, begin + chunk.total_compressed_size):
                values, size = values + count, size + unpacked
                if values > MOST_VALUES or size > MOST_BYTES:
                    raise ValueError(f"more than {MOST_VALUES} values, or {MOST_BYTES} bytes")
    return sorted(texts)


def _text_bytes(column: pa.ChunkedArray | pa.Array) -> int:
    """Bytes of all texts in a column, each counted as often as it stands there."""
    if isinstance(column, pa.ChunkedArray):
        return sum(map(_text_bytes, column.chunks))
    if pa.types.is_dictionary(column.type):
        lengths = pc.binary_length(column.dictionary)
        return int(pc.sum(lengths.take(column.indices)).as_py() or 0)
    if pa.types.is_list(column.type):
        return _text_bytes(column.flatten())
    if pa.types.is_struct(column.type):
        return sum(map(_text_bytes, column.flatten()))
    return 0


# ---------------------------------------------------------------------------------------------
# Page headers (parquet.thrift of Apache Parquet, in Thrift's compact protocol)

_UNPACKED, _PACKED = 2, 3
_DATA_PAGE, _DICTIONARY_PAGE, _DATA_PAGE_V2 = 5, 7, 8
_VALUES = 1
_ENCODING = {_DATA_PAGE: 2, _DICTIONARY_PAGE: 2, _DATA_PAGE_V2: 4}
"""Fields of a page's header, and of the headers in it."""
_PLAIN_OR_REPEATED = (0, 2, 3, 8)
"""Encodings in which a value is no longer than it stands in the page or in its dictionary."""


def _pages(content: bytes, at: int, end: int) -> Iterator[tuple[int, int]]:
    """Values and bytes, unpacked, of each page between two places of a file.

    Raises
    ------
    ValueError, LookupError : there is something else.
    """
    while at < end:
        header, at = _struct(content, at, 0)
        at += header[_PACKED]
        kind = next(kind for kind in _ENCODING if kind in header)
        count, unpacked = header[kind][_VALUES], header[_UNPACKED]
        if header[_PACKED] < 0 or count < 0 or unpacked < 0:
            raise ValueError("a page of less than nothing")
        if header[kind][_ENCODING[kind]] not in _PLAIN_OR_REPEATED:
            raise ValueError("a page in another encoding")
        yield (0 if kind == _DICTIONARY_PAGE else count), unpacked


def _struct(content: bytes, at: int, depth: int) -> tuple[dict[int, Any], int]:
    """The fields of a structure by their numbers, and where it ends."""
    fields: dict[int, Any] = {}
    number = 0
    while byte := content[at]:
        at += 1
        number += byte >> 4
        if not byte >> 4:
            number, at = _integer(content, at)
        kind = byte & 15
        if kind in (1, 2):  # true, false
            fields[number] = kind == 1
        elif kind in (4, 5, 6):
            fields[number], at = _integer(content, at)
        elif kind == 8:  # bytes, of statistics
            length, at = _varint(content, at)
            at += length
        elif kind == 12 and depth < 3:
            fields[number], at = _struct(content, at, depth + 1)
        else:
            raise ValueError(f"a page's header with type {kind}")
    return fields, at + 1


def _integer(content: bytes, at: int) -> tuple[int, int]:
    value, at = _varint(content, at)
    return value >> 1 ^ -(value & 1), at


def _varint(content: bytes, at: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 70, 7):
        byte = content[at]
        at += 1
        value |= (byte & 127) << shift
        if byte < 128:
            return value, at
    raise ValueError("a number of too many bytes")
