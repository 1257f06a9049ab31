"""One store for what need not be computed again: no damaged entry is ever believed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, strategies as st

from designer.base.errors import InputError
from designer.base.keyed_store import DAMAGED, UNSEALED, KeyedStore, Lines, read_line, sealed_line
from designer.base.parquet_entry import HEAD, ParquetCodec, Rows
from designer.base.seal import BLANK, MARK, intact, sealed

SCHEMA = pa.schema([("sample", pa.int64()), ("size", pa.float64()), ("reason", pa.string())])
ROWS = [
    {"sample": 0, "size": 1.0 / 3.0, "reason": ""},
    {"sample": 1, "size": float("inf"), "reason": BLANK},  # text from a model file
]
NAME, KEY = "rows.parquet/block-000000.parquet", {"format": 2, "study": "a"}


def parquet(root: Path, notes: list[str], **more: Any) -> KeyedStore[Rows]:
    return KeyedStore(root, ParquetCodec(SCHEMA), notes.append, **more)


def flipped(content: bytes, place: int, bit: int) -> bytes:
    return content[:place] + bytes([content[place] ^ 1 << bit]) + content[place + 1 :]


@given(st.binary(max_size=200), st.binary(max_size=20), st.data())
def test_a_seal_shows_every_bit(before: bytes, after: bytes, data: st.DataObject) -> None:
    content = sealed(before + BLANK.encode() + after)
    assert intact(content) is True
    place = data.draw(st.integers(0, len(content) - 1))
    assert not intact(flipped(content, place, data.draw(st.integers(0, 7))))


def test_what_has_no_seal() -> None:
    assert intact(b"") is None
    assert intact(MARK.encode()) is False
    with pytest.raises(ValueError, match="not found"):
        sealed(b"no blank")


def test_an_entry_comes_back_for_its_own_key(tmp_path: Path) -> None:
    notes: list[str] = []
    store = parquet(tmp_path, notes)
    assert store.read(NAME, KEY) is None
    store.write(NAME, KEY, ROWS, {"provenance": {"title": BLANK}})
    assert parquet(tmp_path, notes).read(NAME, KEY) == ROWS
    assert parquet(tmp_path, notes).read(NAME, {**KEY, "study": "b"}) is None
    assert store.names("rows.parquet/*.parquet") == [NAME]
    assert notes == []
    # Anybody's reader of Parquet has the rows, with the text that looks like a seal.
    assert pq.read_table(tmp_path / NAME).to_pylist() == ROWS


@pytest.mark.parametrize("codec", [ParquetCodec(SCHEMA.remove(1)), ParquetCodec(SCHEMA, most=1)])
def test_an_entry_of_another_form_is_foreign_only_for_another_request(
    tmp_path: Path, codec: ParquetCodec
) -> None:
    """The rows of another map have other columns, or are more: nothing is damaged. Under the key
    that was asked for such an entry is no entry."""
    parquet(tmp_path, []).write(NAME, KEY, ROWS)
    notes: list[str] = []
    other = KeyedStore(tmp_path, codec, notes.append)
    assert other.read(NAME, {**KEY, "study": "b"}) is None
    assert (notes, other.foreign) == ([], {NAME})
    own = KeyedStore(tmp_path, codec, notes.append)
    assert own.read(NAME, KEY) is None
    assert (notes, own.foreign) == ([f"{tmp_path / NAME}: {DAMAGED}"], set())


def test_a_flipped_bit_of_a_block_is_noticed(tmp_path: Path) -> None:
    parquet(tmp_path, []).write(NAME, KEY, ROWS)
    path = tmp_path / NAME
    whole = path.read_bytes()
    for place in range(0, len(whole), 3):
        path.write_bytes(flipped(whole, place, place % 8))
        notes: list[str] = []
        store = parquet(tmp_path, notes)
        assert (store.read(NAME, KEY), store.read(NAME, KEY)) == (None, None)
        (note,) = notes  # once
        assert note.startswith(f"{path}: ")
        assert store.foreign == set()


@pytest.mark.parametrize("place", ["folder", "cut", "empty", "nothing", "other bytes"])
def test_what_is_no_entry_is_missing(tmp_path: Path, place: str) -> None:
    notes: list[str] = []
    store = parquet(tmp_path, notes)
    store.write(NAME, KEY, ROWS)
    path = tmp_path / NAME
    whole = path.read_bytes()
    path.unlink()
    if place == "folder":
        path.mkdir()
    elif place != "nothing":
        path.write_bytes({"cut": whole[:-100], "empty": b"", "other bytes": b"PAR1" * 9}[place])
    assert store.read(NAME, KEY) is None
    assert len(notes) == (place != "nothing")
    if place == "folder":
        with pytest.raises(InputError, match="directory"):
            store.write(NAME, KEY, ROWS)
    else:
        store.write(NAME, KEY, ROWS)
        assert store.read(NAME, KEY) == ROWS


def before(head: Any) -> bytes:
    """A block as versions without seals wrote it."""
    table = pa.Table.from_pylist(ROWS[:1], schema=SCHEMA)
    out = pa.BufferOutputStream()
    pq.write_table(table.replace_schema_metadata({HEAD: json.dumps(head)}), out)
    content: bytes = out.getvalue().to_pybytes()
    return content


def test_a_block_of_before_counts_where_a_manifest_vouches_for_it(tmp_path: Path) -> None:
    path = tmp_path / NAME
    path.parent.mkdir()
    path.write_bytes(before(KEY))
    notes: list[str] = []
    assert parquet(tmp_path, notes).read(NAME, KEY) is None
    assert notes == [f"{path}: {UNSEALED}"]

    def vouch(name: str, content: bytes) -> bool:
        return (name, content) == (NAME, before(KEY))

    store = parquet(tmp_path, notes, vouch=vouch)
    assert store.read(NAME, KEY) == ROWS[:1]
    assert store.unsealed == {NAME}
    store.write(NAME, KEY, ROWS)
    assert store.unsealed == set()


@pytest.mark.parametrize("head", [[], 3, None, "text", [[[1]]]])
def test_a_head_that_is_no_object(tmp_path: Path, head: Any) -> None:
    path = tmp_path / NAME
    path.parent.mkdir()
    path.write_bytes(before(head))
    notes: list[str] = []
    assert parquet(tmp_path, notes, vouch=lambda *_: True).read(NAME, KEY) is None
    assert notes == [f"{path}: {DAMAGED}"]


def test_other_columns_are_no_entry(tmp_path: Path) -> None:
    parquet(tmp_path, []).write(NAME, KEY, ROWS)
    notes: list[str] = []
    other = ParquetCodec(pa.schema([*SCHEMA, ("more", pa.float64())]))
    assert KeyedStore(tmp_path, other, notes.append).read(NAME, KEY) is None
    assert len(notes) == 1


LINES = Lines("pieces", "key")
ENTRIES: Mapping[str, Mapping[str, Any]] = {
    "rungs 1": {"rows": [1.5, None], "elapsed": 0.1},
    "boards, 0 to 9": {"title": 'a "quoted", text\n' + BLANK},
    "boards, 10 to 19": {},
}


def test_lines_are_one_json_object(tmp_path: Path) -> None:
    for entries in (ENTRIES, {}):
        path = tmp_path / "pieces.json"
        path.write_text(LINES.text(entries))
        assert LINES.load(path) == entries
        value = json.loads(path.read_text())
        assert value["format"] == 1
        assert list(value["pieces"]) == list(entries)
    assert LINES.load(tmp_path / "nothing.json") == {}
    path.write_text(LINES.text(ENTRIES))
    assert Lines("pieces", "another").load(path) == {}


def test_a_damaged_line_costs_itself_alone(tmp_path: Path) -> None:
    path = tmp_path / "pieces.json"
    whole = LINES.text(ENTRIES).encode()
    for place in range(len(whole)):
        path.write_bytes(flipped(whole, place, place % 8))
        notes: list[str] = []
        found = LINES.load(path, notes.append)
        assert all(ENTRIES[name] == entry for name, entry in found.items())
        assert len(found) >= len(ENTRIES) - 2  # two where their line break is hit
        assert len(found) == len(ENTRIES) or [str(path) in note for note in notes] == [True]


def test_cut_off_lines_leave_those_before(tmp_path: Path) -> None:
    path = tmp_path / "pieces.json"
    whole = LINES.text(ENTRIES).encode()
    for length in range(len(whole)):
        path.write_bytes(whole[:length])
        found = LINES.load(path)
        assert found == dict(list(ENTRIES.items())[: len(found)])
    assert len(found) == len(ENTRIES)


def test_lines_of_before_count_where_a_manifest_vouches_for_them(tmp_path: Path) -> None:
    path = tmp_path / "pieces.json"
    path.write_text(json.dumps({"format": 1, "pieces": {"a": {"0": "ol"}}}))
    notes: list[str] = []
    assert LINES.load(path, notes.append) == {}
    assert notes == [f"{path}: {UNSEALED}"]
    assert LINES.load(path, vouch=lambda *_: True) == {"a": {"0": "ol"}}
    path.write_text("[]")
    with pytest.raises(InputError, match=r"pieces\.json"):
        LINES.load(path, vouch=lambda *_: True)


@pytest.mark.parametrize("values", [["key", [1, 2]], [], [None, 0.1, "text"]])
def test_a_sealed_line(values: list[Any]) -> None:
    line = sealed_line(values).encode()
    assert read_line(line) == values
    for place in range(len(line)):
        assert read_line(flipped(line, place, place % 8)) is None


def test_a_file_without_lines_is_whole(tmp_path: Path) -> None:
    path, notes = tmp_path / "lines.json", list[str]()
    path.write_text(LINES.text({}))
    assert LINES.load(path, notes.append) == {}
    assert notes == []
