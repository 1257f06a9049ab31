"""What a search remembers, and what of a file it trusts."""

from __future__ import annotations

from pathlib import Path

import pytest

from designer.base.keyed_store import read_line, sealed_line
from designer.centering.answer_cache import AnswerCache

MOST = (10, 20)
"""Greatest numbers of an answer."""


def fill(memory: AnswerCache, questions: list[int]) -> list[int]:
    """Ask; returns which had to be made."""
    made: list[int] = []

    def make(new: list[int]) -> list[tuple[int, ...]]:
        made.extend(questions[k] for k in new)
        return [(questions[k], 2 * questions[k]) for k in new]

    answers = memory.get_all(list(questions), make, MOST)
    assert answers == [(q, 2 * q) for q in questions]
    return made


def test_it_goes_on_where_it_was(tmp_path: Path) -> None:
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    fill(AnswerCache(whole, "a"), [1, 2])
    fill(AnswerCache(whole, "a"), [3, 4])
    assert fill(AnswerCache(cut, "a"), [1, 2]) == [1, 2]
    assert fill(AnswerCache(cut, "a"), [1, 2]) == []
    assert fill(AnswerCache(cut, "a"), [3, 4]) == [3, 4]
    assert cut.read_bytes() == whole.read_bytes()


@pytest.mark.parametrize("kept", [0.4, 0.7, 0.95])
def test_a_file_that_was_cut_short_ends_as_the_whole_one(tmp_path: Path, kept: float) -> None:
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    fill(AnswerCache(whole, "a"), [1, 2, 3, 4, 5])
    content = whole.read_bytes()
    cut.write_bytes(content[: int(kept * len(content))])
    made = fill(AnswerCache(cut, "a"), [1, 2, 3, 4, 5])
    assert 0 < len(made) <= 5
    assert cut.read_bytes() == content


def test_another_search_s_answers_are_not_taken(tmp_path: Path) -> None:
    fill(AnswerCache(tmp_path / "file", "a"), [1])
    assert fill(AnswerCache(tmp_path / "file", "b"), [1]) == [1]


def test_a_damaged_line_is_asked_again_and_no_other(tmp_path: Path) -> None:
    """Any bit of the file; a line break joins two lines."""
    path = tmp_path / "file"
    fill(AnswerCache(path, "a"), [1, 2, 3])
    whole = path.read_bytes()
    breaks = [place for place, byte in enumerate(whole) if byte == ord("\n")]
    for place in range(len(whole)):
        path.write_bytes(
            whole[:place] + bytes([whole[place] ^ 1 << place % 8]) + whole[place + 1 :]
        )
        notes: list[str] = []
        made = fill(AnswerCache(path, "a", notes.append), [1, 2, 3])
        first = place <= breaks[0]
        assert len(made) <= (2 if place in breaks else 0 if first else 1)
        assert [str(path) in note for note in notes] == [True] or place == len(whole) - 1
        assert fill(AnswerCache(path, "a"), [1, 2, 3]) == []


def test_a_file_without_seals_is_not_believed(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text('{"format": 1, "search": "a"}\n["0123", [7]]\n')
    notes: list[str] = []
    assert fill(AnswerCache(path, "a", notes.append), [1]) == [1]
    assert len(notes) == 1
    assert fill(AnswerCache(path, "a"), [1]) == []


@pytest.mark.parametrize(
    "answer", [[], [1], [1, 2, 3], [-1, 2], [1, 21], [10**30, 2], [1.0, 2], ["1", 2], [None, 2], 7]
)
def test_an_answer_that_cannot_be_is_made_again(tmp_path: Path, answer: object) -> None:
    """On a line that a stranger has sealed."""
    path = tmp_path / "file"
    fill(AnswerCache(path, "a"), [1])
    head, line = path.read_bytes().splitlines()
    key, _ = read_line(line) or []
    path.write_bytes(head + b"\n" + sealed_line([key, answer]).encode() + b"\n")
    assert fill(AnswerCache(path, "a"), [1]) == [1]
    assert fill(AnswerCache(path, "a"), [1]) == []
