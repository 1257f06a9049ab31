"""What a run says while it works, on standard error only.

On a terminal a bar for each stage, with rate and time left; elsewhere a line for each, and one
more from time to time while it lasts; with ``-q`` nothing. Time left is said from a tenth of a
stage on: the longest steps often come first, and the first of all may wait for a compiler.
"""

from __future__ import annotations

import logging
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
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

    @contextmanager
    def aside(self) -> Iterator[None]:
        """While something else is printed on standard error."""
        yield

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        return None


EVERY = 20.0
"""s between two lines about one stage."""


class Lines(Progress):
    """One line for each stage, and one every `EVERY` seconds about how far it is.

    clock : seconds, for tests.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock

    def stage(self, text: str, total: int | None = None) -> Callable[[], None]:
        print(f"{text} …", file=sys.stderr, flush=True)
        super().stage(text, total)
        began = said = self._clock()
        done, lock = 0, threading.Lock()

        def step() -> None:
            nonlocal done, said
            with lock:
                done += 1
                now = self._clock()
                if now - said < EVERY or (total is not None and done >= total):
                    return
                said = now
                print(f"  {how_far(done, total, now - began)}", file=sys.stderr, flush=True)

        return step

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
            TextColumn("{task.fields[rate]}"),
            console=Console(stderr=True),
        )
        self._open: list[Callable[[], None]] = []

    def stage(self, text: str, total: int | None = None) -> Callable[[], None]:
        super().stage(text, total)
        self._finish()
        bars, task = self._bars, self._bars.add_task(text, total=total, rate="")

        def finish() -> None:
            steps = next(t.completed for t in bars.tasks if t.id == task)
            # Of how many was not known before: now it is.
            end = total or max(int(steps), 1)
            bars.update(task, total=end, completed=end)

        self._open.append(finish)

        def step() -> None:
            bars.advance(task)
            now = next(t for t in bars.tasks if t.id == task)
            if now.elapsed:
                bars.update(task, rate=pace(int(now.completed), total, now.elapsed))

        return step

    def note(self, text: str) -> None:
        super().note(text)
        self._bars.console.print(text, markup=False, highlight=False)

    @contextmanager
    def aside(self) -> Iterator[None]:
        self._finish()
        self._bars.stop()
        for task in self._bars.task_ids:  # they stand above, and are not to be drawn again
            self._bars.remove_task(task)
        try:
            yield
        finally:
            self._bars.start()

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


def how_far(done: int, total: int | None, seconds: float) -> str:
    """Steps, of how many if that is known, and their pace."""
    steps = f"{done} steps" if total is None else f"{done}/{total}"
    return f"{steps}, {pace(done, total, seconds)}"


def pace(done: int, total: int | None, seconds: float) -> str:
    """Rate so far, and time left at that rate once a tenth of the steps is done."""
    speed = done / seconds
    if total is None or 10 * done < total:
        return rate(speed)
    left = round((total - done) / speed)
    hours, minutes = divmod(left // 60, 60)
    return f"{rate(speed)}, {hours}:{minutes:02d}:{left % 60:02d} left"


def rate(speed: float) -> str:
    """Steps per second, or per minute where that is less than one."""
    return f"{speed:.3g}/s" if speed >= 1.0 else f"{60.0 * speed:.3g}/min"


def progress_for(quiet: bool) -> Progress:
    """The kind that suits standard error."""
    if quiet:
        return Progress()
    return Terminal() if sys.stderr.isatty() else Lines()


def _nothing() -> None:
    return None
