"""What a block of few bytes says it holds is counted before it is unpacked."""

from __future__ import annotations

import struct
from typing import Any, NoReturn

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from designer.base.parquet_entry import MOST_VALUES, ParquetCodec, Rows

PAIR = pa.struct([("kind", pa.string()), ("values", pa.list_(pa.float64()))])
SCHEMA = pa.schema(
    [
        ("sample", pa.int64()),
        ("reason", pa.string()),
        ("good", pa.bool_()),
        ("values", pa.list_(pa.float64())),
        ("pairs", pa.list_(PAIR)),
    ]
)
FORM = ParquetCodec(SCHEMA, most=1000)
ROW: dict[str, Any] = {"sample": 1, "reason": "why", "good": True, "values": [], "pairs": []}


def rows(count: int) -> list[dict[str, Any]]:
    pair = {"kind": "fold", "values": [1.0, 0.25]}
    each = ({"reason": "why" * (k % 7), "values": [0.5] * (k % 4)} for k in range(count))
    out = [{**ROW, "sample": k, **one} for k, one in enumerate(each)]
    if out:
        out[-1] |= {"good": None, "reason": None, "pairs": [pair, {"kind": None, "values": None}]}
    return out


@pytest.mark.parametrize("count", [0, 1, 1000])
def test_what_is_written_is_read(count: int) -> None:
    written = rows(count)
    assert FORM.decode(FORM.encode({"a": 1}, written)) == ({"a": 1}, written)


@pytest.mark.parametrize("packed", ["none", "gzip", "zstd"])
@pytest.mark.parametrize("version", ["1.0", "2.0"])
@pytest.mark.parametrize("size", [100, 10**9])
def test_pages_as_the_library_may_write_them(packed: str, version: str, size: int) -> None:
    table = pa.Table.from_pylist(rows(1000), schema=SCHEMA)
    out = pa.BufferOutputStream()
    pq.write_table(
        table, out, compression=packed, data_page_version=version, data_page_size=size,
        row_group_size=300,
    )  # fmt: skip
    assert FORM.decode(out.getvalue().to_pybytes())[1] == table.to_pylist()


def _never(*_arguments: object, **_words: object) -> NoReturn:
    raise AssertionError("values were unpacked")


def lying(content: bytes, says: int, instead: int) -> bytes:
    """The footer with another count, in as many bytes."""
    (length,) = struct.unpack("<I", content[-8:-4])
    footer = content[-8 - length : -8]
    count = _varint(2 * says)
    assert count in footer
    other = bytearray(_varint(2 * instead))
    while len(other) < len(count):  # a number may have zeros before it
        other[-1] |= 0x80
        other.append(0)
    return content[: -8 - length] + footer.replace(count, bytes(other)) + content[-8:]


def _varint(value: int) -> bytes:
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    return bytes((*out, value))


MANY = MOST_VALUES + 1
HOSTILE: dict[str, Rows] = {
    "rows": [ROW] * 1001,
    "values": [{**ROW, "values": [1.0] * MANY}],
    "texts": [{**ROW, "reason": "x" * 1_000_000}] * 100,
    "texts in lists": [{**ROW, "pairs": [{"kind": "x" * 1_000_000, "values": []}] * 100}],
    "bytes": [{**ROW, "reason": "x" * 70_000_000}],
}


@pytest.mark.parametrize("what", HOSTILE)
def test_a_small_file_of_much_is_refused(what: str, monkeypatch: pytest.MonkeyPatch) -> None:
    content = FORM.encode({}, HOSTILE[what])
    assert len(content) < 4_000_000
    if "texts" in what:  # read as a list of different ones
        with pytest.raises(ValueError, match="texts of more than"):
            FORM.decode(content)
        return
    monkeypatch.setattr(pq.ParquetFile, "read", _never)
    with pytest.raises(ValueError, match="more than"):
        FORM.decode(content)


def test_a_footer_that_lies_is_not_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    """It says ten values: PyArrow would make as many as the pages say."""
    content = lying(FORM.encode({}, HOSTILE["values"]), MANY, 10)
    metadata = pq.read_metadata(pa.BufferReader(content))
    counts = [metadata.row_group(0).column(k).num_values for k in range(metadata.num_columns)]
    assert max(counts) == 10
    monkeypatch.setattr(pq.ParquetFile, "read", _never)
    with pytest.raises(ValueError, match="more than"):
        FORM.decode(content)


def test_encodings_that_swell_are_refused() -> None:
    """Each text as its beginning in the one before and the rest: n texts of n bytes from n."""
    table = pa.table({"reason": ["x" * k for k in range(1000)]})
    out = pa.BufferOutputStream()
    encoding = {"reason": "DELTA_BYTE_ARRAY"}
    pq.write_table(table, out, use_dictionary=False, column_encoding=encoding)
    with pytest.raises(ValueError, match="another encoding"):
        ParquetCodec(table.schema).decode(out.getvalue().to_pybytes())
