"""What tests share of each other's answers: nothing that one of them has changed."""

from __future__ import annotations

import fcntl
import pickle
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from designer.model import find_responses
from designer.yields import rare_losses
from tests.shared import answer_store

Counted = tuple[Callable[[int], list[int]], list[int]]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path) -> Iterator[Path]:
    """A store of this test's own."""
    before, own = answer_store._folders[0], tmp_path / "answers"
    answer_store.open_store(own)
    yield own
    answer_store.open_store(before)


@pytest.fixture
def counted() -> Counted:
    """A function that lists its argument, as if of the package check, and its calls."""
    calls: list[int] = []

    def listed(number: int) -> list[int]:
        calls.append(number)
        return [number]

    listed.__module__ = "designer.check.listed"
    return answer_store.stored(listed), calls


def test_each_caller_has_an_object_of_its_own(counted: Counted) -> None:
    ask, calls = counted
    for number in (-1, -1, -1):
        ask(number).append(0)
    assert ask(-1) == [-1]
    assert calls == [-1]


def test_what_a_patch_may_have_made_is_not_stored(
    counted: Counted, monkeypatch: pytest.MonkeyPatch
) -> None:
    """That of a module the function can import, of Python's own, or of the environment."""
    ask, calls = counted
    patches: list[Callable[[], None]] = [
        lambda: monkeypatch.setattr(find_responses, "__doc__", ""),
        lambda: monkeypatch.setattr(pickle, "__doc__", ""),
        lambda: monkeypatch.setenv("DESIGNER", ""),
    ]
    for patch in patches:
        patch()
        assert ask(-2) == [-2]
        monkeypatch.undo()
    assert calls == [-2] * 3
    monkeypatch.setattr(rare_losses, "__doc__", "")  # of a package after check
    assert ask(-2) == ask(-2) == [-2]
    assert calls == [-2] * 4


def test_who_waits_too_long_is_told_for_what(
    counted: Counted, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ask, _ = counted
    ask(-3)
    (lock,) = folder.glob("*.lock")
    monkeypatch.setattr(answer_store, "_answers", {})
    monkeypatch.setattr(answer_store, "PATIENCE", 0.0)
    with lock.open("w") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        with pytest.raises(TimeoutError, match=r"lock: another process"):
            ask(-3)
