"""A call in steps runs only while somebody waits, and ends where nobody does any more."""

from __future__ import annotations

import threading
from collections.abc import Callable

import pytest

from designer.explorer.response_map import stepped


def test_its_result_comes_after_its_steps() -> None:
    done: list[int] = []

    def call(progress: Callable[[], None]) -> str:
        for k in range(3):
            done.append(k)
            progress()
        return "end"

    steps = stepped(call)
    assert done == []
    assert [len(done) for _ in range(3) if next(steps) is None] == [1, 2, 3]
    with pytest.raises(StopIteration, match=r"^end$"):
        next(steps)


def test_what_it_raises_is_raised() -> None:
    def call(progress: Callable[[], None]) -> None:
        progress()
        raise KeyError("x")

    steps = stepped(call)
    next(steps)
    with pytest.raises(KeyError):
        next(steps)


def test_one_that_is_closed_ends_where_it_is() -> None:
    cleared, went_on = threading.Event(), threading.Event()

    def call(progress: Callable[[], None]) -> None:
        try:
            progress()
            went_on.set()
        finally:
            cleared.set()

    steps = stepped(call)
    next(steps)
    steps.close()
    assert cleared.is_set()
    assert not went_on.is_set()
