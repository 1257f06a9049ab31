"""Tells when numba compiles, and for whom."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba.core.event import Listener


class CompileWatch(Listener):  # type: ignore[misc]
    """Calls ``tell`` with the name of a function's module when its compilation begins, and with
    None when it ends; a callee is within its caller. numba compiles on one thread at a time."""

    def __init__(self, tell: Callable[[str | None], None]) -> None:
        self._tell = tell
        self._depth = 0

    def on_start(self, event: Any) -> None:
        """As numba calls it."""
        self._depth += 1
        if self._depth == 1:
            self._tell(str(event.data["dispatcher"].py_func.__module__))

    def on_end(self, event: object) -> None:
        """As numba calls it."""
        self._depth -= 1
        if self._depth == 0:
            self._tell(None)
