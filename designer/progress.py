"""What a run says while it works, on standard error only.

On a terminal a bar for each stage; elsewhere one line for each; with ``-q`` nothing.
"""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from rich.progress import Progress as Bars

LOG = logging.getLogger("designer")


class Progress:
    """Says nothing; what functions use that nobody watches."""

    def stage(self, text: str, total: int | None = None) -> Callable[[], None]:
        """A stage begins, with ``total`` steps if that is known; call the result at each step."""
        LOG.info("%s", text)
        return _nothing

    def note(self, text: str) -> None:
        """Something that a user ought to know."""
        LOG.warning("%s", text)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        return None


class Lines(Progress):
    """One line for each stage."""

    def stage(self, text: str, total: int | None = None) -> Callable[[], None]:
        print(f"{text} …", file=sys.stderr, flush=True)
        return super().stage(text, total)

    def note(self, text: str) -> None:
        print(text, file=sys.stderr, flush=True)
        super().note(text)


class Terminal(Progress):
    """Bars, for a terminal."""

    def __init__(self) -> None:
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            SpinnerColumn,
            TextColumn,
            TimeElapsedColumn,
        )
        from rich.progress import Progress as Bars

        self._bars: Bars = Bars(
            SpinnerColumn(finished_text="✓"),
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            console=Console(stderr=True),
        )
        self._open: list[Callable[[], None]] = []

    def stage(self, text: str, total: int | None = None) -> Callable[[], None]:
        super().stage(text, total)
        self._finish()
        bars, task = self._bars, self._bars.add_task(text, total=total)

        def finish() -> None:
            steps = next(t.completed for t in bars.tasks if t.id == task)
            bars.update(task, total=total or 1, completed=total or max(steps, 1))

        self._open.append(finish)
        return lambda: bars.advance(task)

    def note(self, text: str) -> None:
        super().note(text)
        self._bars.console.print(text, markup=False, highlight=False)

    def __enter__(self) -> Self:
        self._bars.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is None:
            self._finish()
        self._bars.stop()

    def _finish(self) -> None:
        while self._open:
            self._open.pop()()


def progress_for(quiet: bool) -> Progress:
    """The kind that suits standard error."""
    if quiet:
        return Progress()
    return Terminal() if sys.stderr.isatty() else Lines()


def _nothing() -> None:
    return None
