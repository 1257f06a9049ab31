"""Pieces of a long report: what stands on the disk is read whole, or refused by name."""

from __future__ import annotations

from pathlib import Path

import pytest

from designer.case_store import read_piece
from designer.errors import InputError


def test_a_piece_is_read_as_it_was_written(tmp_path: Path) -> None:
    path = tmp_path / "one.json"
    assert read_piece(path, "--out") is None
    path.write_text('{"key": "k", "value": 1.5}')
    assert read_piece(path, "--out") == {"key": "k", "value": 1.5}


@pytest.mark.parametrize("content", [b"", b'{"key": "k"', b"[1, 2]", b"null", b"\xff\xfe"])
def test_what_is_no_piece_is_refused_by_name(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "one.json"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_piece(path, "--resume", "a case of this report")
    assert (str(caught.value.file), caught.value.field) == (str(path), "--resume")
    assert caught.value.expected == "a case of this report"
