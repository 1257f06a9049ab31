"""Pieces of a long report: what stands on the disk is read whole, or refused by name."""

from __future__ import annotations

from pathlib import Path

import pytest

from designer.base.errors import InputError
from designer.base.report_pieces import FOLDER, CaseStore, read_key
from reports.makers import robust_design


def test_the_key_of_a_piece_is_read(tmp_path: Path) -> None:
    path = tmp_path / "one.json"
    assert read_key(path, "--out") is None
    path.write_text('{"key": "k", "value": 1.5}')
    assert read_key(path, "--out") == "k"


@pytest.mark.parametrize(
    "content", [b'{"key": "k"', b"{}", b"[1, 2]", b"null", b"\xff\xfe", b"[" * 100_000]
)
def test_what_is_no_piece_is_refused_by_name(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "one.json"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_key(path, "--resume", "a case of this report")
    assert (str(caught.value.file), caught.value.field) == (str(path), "--resume")
    assert caught.value.expected == "a case of this report"


def made(value: float) -> dict[str, float]:
    return {"value": value}


@pytest.mark.parametrize("keys", ["k", {"one": "k", "two": "j"}])
def test_a_piece_is_made_once(keys: str | dict[str, str], tmp_path: Path) -> None:
    store = CaseStore(tmp_path, ["README.md"], resume=False)
    store.expect(keys)
    assert store.piece("one", lambda: made(1.0)) == {"value": 1.0}
    (tmp_path / "README.md").write_text("of the piece")
    with pytest.raises(InputError, match="--resume"):
        CaseStore(tmp_path, ["README.md"], resume=False)
    again = CaseStore(tmp_path, ["README.md"], resume=True)
    again.expect(keys)
    assert again.piece("one", lambda: made(2.0)) == {"value": 1.0}
    assert again.piece("two", lambda: made(3.0)) == {"value": 3.0}


@pytest.mark.parametrize("keys", ["other", {"one": "other"}])
def test_a_piece_of_other_settings_is_refused(keys: str | dict[str, str], tmp_path: Path) -> None:
    store = CaseStore(tmp_path, [], resume=False)
    store.expect("k")
    store.piece("one", lambda: made(1.0))
    with pytest.raises(InputError, match="other settings"):
        CaseStore(tmp_path, [], resume=True).expect(keys)


def pieces(folder: Path, notes: list[str]) -> list[float]:
    """Both pieces of a report; what is not taken from the disk is 9."""
    store = CaseStore(folder, [], resume=True, note=notes.append)
    store.expect("k")
    return [store.piece(name, lambda: made(9.0))["value"] for name in ("one", "two")]


def test_a_damaged_piece_is_made_again_and_no_other(tmp_path: Path) -> None:
    """Every bit, and every length to which it may be cut."""
    store = CaseStore(tmp_path, [], resume=True)
    store.expect("k")
    for number, name in enumerate(("one", "two")):
        store.piece(name, lambda number=number: made(1.0 + number))  # type: ignore[misc]
    path = tmp_path / FOLDER / "one.json"
    whole = path.read_bytes()
    damaged = [whole[:length] for length in range(0, len(whole) - 1, 5)]
    for place in range(len(whole)):
        bit = 1 << place % 8
        damaged.append(whole[:place] + bytes([whole[place] ^ bit]) + whole[place + 1 :])
    refused = 0
    for content in damaged:
        path.write_bytes(content)
        notes: list[str] = []
        try:
            assert pieces(tmp_path, notes) == [9.0, 2.0]
        except InputError:  # a bit of the seal's own name, or of the key: it looks like another's
            refused += 1
        else:
            assert [str(path) in note for note in notes] == [True]
    assert refused < 20
    path.write_bytes(whole)
    assert pieces(tmp_path, []) == [1.0, 2.0]


def test_a_piece_without_a_seal_is_made_again(tmp_path: Path) -> None:
    """As versions without seals wrote it."""
    store = CaseStore(tmp_path, [], resume=True)
    store.expect("k")
    (tmp_path / FOLDER / "one.json").write_text('{\n "key": "k",\n "value": 1.0\n}\n')
    notes: list[str] = []
    assert pieces(tmp_path, notes) == [9.0, 9.0]
    assert len(notes) == 1
    assert pieces(tmp_path, notes) == [9.0, 9.0]
    assert len(notes) == 1


def test_a_report_that_always_goes_on_names_no_option_that_it_does_not_have(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """After a changed model or changed rules: what to do is said, with no word of --resume."""
    store = CaseStore(tmp_path, [], resume=True, place="out")
    store.expect("k")
    store.piece("one", lambda: made(1.0))
    model = Path(__file__).parents[2] / "examples" / "robust.toml"
    assert robust_design.main([str(tmp_path), "--model", str(model)]) == 2
    said = capsys.readouterr().err
    assert "one.json: out: found a piece of other settings" in said
    assert f"delete {tmp_path / FOLDER}" in said
    assert "another folder" in said
    assert "--" not in said
    with pytest.raises(InputError, match=r"--resume: found a piece of other settings.*folder"):
        CaseStore(tmp_path, [], resume=True).expect("other")


def test_a_file_of_somebody_else_s_stays(tmp_path: Path) -> None:
    """Beside nothing, beside a note, and beside a piece that is none of this report's."""
    (tmp_path / "README.md").write_text("mine")
    for resume in (False, True):
        with pytest.raises(InputError, match=r"README\.md"):
            CaseStore(tmp_path, ["README.md"], resume=resume)
    assert not (tmp_path / FOLDER).exists()
    (tmp_path / FOLDER).mkdir()
    (tmp_path / FOLDER / "notes.txt").write_text("mine")
    (tmp_path / FOLDER / "another.json").write_text('{"key": "k"}')
    with pytest.raises(InputError, match=r"README\.md"):
        CaseStore(tmp_path, ["README.md"], resume=True).expect({"one": "k"})
    with pytest.raises(InputError, match="other settings"):
        CaseStore(tmp_path, ["README.md"], resume=True).expect("mine")
    store = CaseStore(tmp_path, ["other.md"], resume=True)
    store.expect({"one": "k"})
    assert store.piece("one", lambda: made(1.0)) == {"value": 1.0}


def test_a_place_that_cannot_be(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="can be written"):
        CaseStore(tmp_path / "file", [], resume=False)
