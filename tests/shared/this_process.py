"""No second process: what it would do is done here, with what a test has changed here."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

import pytest

from designer.base import second_process
from designer.base.second_process import Awaited

Result = TypeVar("Result")


class _Done(Awaited[Result]):
    """Called here, as if it were there."""

    def wait(self) -> bool:
        self()
        return True


class ThisProcess:
    """In the place of ``OtherProcess``."""

    def __init__(self, modules: Sequence[str]) -> None:
        pass

    def __call__(self, function: Callable[..., Result], *arguments: Any) -> Awaited[Result]:
        return _Done(function, arguments)

    def close(self) -> None:
        pass


@contextmanager
def in_this_process() -> Iterator[None]:
    """Inside, no second process is started: each would import all that pictures need anew."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(second_process, "OtherProcess", ThisProcess)
        yield
