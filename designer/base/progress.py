"""What a run says while it works, on standard error only.

On a terminal a bar for each stage, with rate and time left; elsewhere a line for each, and one
more from time to time while it lasts; with ``-q`` nothing. Time left is said from a tenth of a
stage on: the longest steps often come first, and the first of all may wait for a compiler.

No stage is silent: whoever is watched (``with progress:``) says every `SILENCE` seconds how long
the stage has lasted, how far it is, and what it works on just now, if nothing else was said. What
is worked on comes from `doing` and `part`, which any function may call: they reach who is watched,
or nobody, and so do `note` and `best_so_far`. What is sought (``with seeking:``) is told a minute
after the search began, as good as it is known then, and each minute from there on. The same lines
stand in the log.
"""

from __future__ import annotations

import logging
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar, Token
from typing import TYPE_CHECKING, Self

from designer.base.printed import printable, tell

if TYPE_CHECKING:
    from rich.progress import Progress as Bars, TaskID

LOG = logging.getLogger("designer")
EVERY = 20.0
"""s between two lines about the steps of a stage."""
SILENCE = 10.0
"""s that nothing is said at most."""
REDRAWN = 0.2
"""s between two changes of what a terminal's bar says is worked on."""
MINUTE = 60.0
"""s between two lines about the best answer so far."""
BEAT = 1.0
"""s between two looks at whether it was silent too long."""


class Laps:
    """Wall times of the parts of a work that follow each other."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        """Wall time of each part that has ended [s], by name."""
        self._began = time.perf_counter()

    def end(self, name: str) -> None:
        """A part ends here, and the next one begins."""
        now = time.perf_counter()
        self.seconds[name], self._began = now - self._began, now


class ProgressStage:
    """One stage of the work: its steps, and when something was last said about it.

    total : steps, if that is known. say : takes a line about the stage.
    """

    def __init__(
        self, total: int | None, say: Callable[[str], None], clock: Callable[[], float]
    ) -> None:
        self.total = total
        self.detail = ""
        self._say, self._clock = say, clock
        self._began = self._last = clock()
        self._done, self._lock = 0, threading.Lock()

    def step(self) -> None:
        """One more step is done."""
        with self._lock:
            self._done += 1
            ended = self.total is not None and self._done >= self.total
            if not ended:
                self._report(EVERY)

    def beat(self) -> None:
        """Say how far it is, if nothing was said for too long."""
        with self._lock:
            self._report(SILENCE)

    def _report(self, after: float) -> None:
        now = self._clock()
        if now - self._last < after:
            return
        self._last, spent = now, now - self._began
        far = how_far(self._done, self.total, spent) if self._done else f"{duration(spent)} so far"
        self._say(f"  {far}" + (f": {self.detail}" if self.detail else ""))


class Sought:
    """What is sought: the best that is known of it, and when that was last told.

    what : in words. found : by how many parts of the work it was found within, and a half for a
    step on the way: the smallest counts, which is what the outermost search knows.
    """

    def __init__(self, what: str, clock: Callable[[], float]) -> None:
        self.what = what
        self.found: dict[float, str] = {}
        self._clock = clock
        self._began = self._last = clock()

    def overdue(self) -> str:
        """A line about the best so far, if none was told for `MINUTE`; else an empty text."""
        now = self._clock()
        if now - self._last < MINUTE:
            return ""
        self._last = now
        best = self.found[min(self.found)] if self.found else "none yet"
        return f"  {self.what}, best so far after {duration(now - self._began)}: {best}"


class Progress:
    """Says nothing; what functions use that nobody watches."""

    _clock: Callable[[], float] = staticmethod(time.monotonic)
    _stage: ProgressStage | None = None
    _sought: Sought | None = None
    _ended: threading.Event | None = None
    _token: Token[Progress | None] | None = None

    def stage(self, text: str, total: int | None = None) -> Callable[[], None]:
        """A stage begins, with ``total`` steps if that is known; call the result at each step."""
        LOG.info("%s", text)
        self._stage = ProgressStage(total, self._say, self._clock)
        return self._stage.step

    def doing(self, text: str) -> None:
        """What the stage works on just now; it is only shown where the stage lasts."""
        if self._stage is not None:
            self._stage.detail = ", ".join(filter(None, (*_PARTS.get(), text)))

    def best_so_far(self, text: str, *, step: bool = False) -> None:
        """The best that is known of what is sought. step : only on the way to it, which is told
        until there is one."""
        if self._sought is not None:
            self._sought.found[len(_PARTS.get()) + 0.5 * step] = text

    def forget_parts(self) -> None:
        """What was found within parts of the work that have ended is known no more."""
        if self._sought is not None:
            found, depth = self._sought.found, len(_PARTS.get())
            self._sought.found = {k: text for k, text in found.items() if k <= depth}

    def idle(self) -> None:
        """The work waits for somebody: nothing is said of it until the next stage begins."""
        self._stage = None

    def note(self, text: str) -> None:
        """Something that a user ought to know."""
        LOG.warning("%s", text)

    @contextmanager
    def aside(self) -> Iterator[None]:
        """While something else is printed on standard error."""
        yield

    def beat(self) -> None:
        """Say how far the stage is, if nothing was said for too long, and the best so far."""
        if self._stage is not None:
            self._stage.beat()
        if self._sought is not None and (line := self._sought.overdue()):
            self.note(line)

    def __enter__(self) -> Self:
        self._stage = ProgressStage(None, self._say, self._clock)
        self._stage.detail = "starting"
        self._token = _WATCHED.set(self)
        self._ended = threading.Event()
        threading.Thread(target=self._watch, args=(self._ended,), daemon=True).start()
        return self

    def __exit__(self, kind: type[BaseException] | None, *rest: object) -> None:
        if self._ended is not None:
            self._ended.set()
        if self._token is not None:
            _WATCHED.reset(self._token)
            self._token = None

    def _say(self, line: str) -> None:
        """A line about the stage."""
        LOG.info("%s", line)

    def _watch(self, ended: threading.Event) -> None:
        while not ended.wait(BEAT):
            self.beat()


_WATCHED: ContextVar[Progress | None] = ContextVar("watched", default=None)
"""Who is told by `doing`, `part`, `note`, `seeking` and `best_so_far`."""
_PARTS: ContextVar[tuple[str, ...]] = ContextVar("parts", default=())
"""The parts of the work that are under way, the outermost first; a thread beside has its own."""


def doing(text: str) -> None:
    """Tell who is watched what is worked on just now, such as "dead zone, tables 3"."""
    watched = _WATCHED.get()
    if watched is not None:
        watched.doing(text)


@contextmanager
def part(text: str) -> Iterator[None]:
    """What is worked on inside belongs to this part, such as "without swing"."""
    watched = _WATCHED.get()
    if watched is None:
        yield
        return
    above = _PARTS.set((*_PARTS.get(), text))
    watched.doing("")
    try:
        yield
    finally:
        _PARTS.reset(above)
        watched.forget_parts()


def note(text: str) -> None:
    """Tell who is watched something that a user ought to know."""
    watched = _WATCHED.get()
    if watched is not None:
        watched.note(text)


@contextmanager
def seeking(what: str) -> Iterator[None]:
    """Inside, `best_so_far` says how good an answer is known, such as to "parts"; a search within
    another one is a part of it."""
    watched = _WATCHED.get()
    if watched is None or watched._sought is not None:
        yield
        return
    watched._sought = Sought(what, watched._clock)
    try:
        yield
    finally:
        watched._sought = None


def best_so_far(text: str, *, step: bool = False) -> None:
    """Tell who is watched the best that is known of what is sought, such as "an error of 1 %".
    step : as of ``Progress.best_so_far``."""
    watched = _WATCHED.get()
    if watched is not None:
        watched.best_so_far(text, step=step)


class ProgressLines(Progress):
    """One line for each stage, and one every `EVERY` seconds about how far it is.

    clock : seconds, for tests.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock

    def stage(self, text: str, total: int | None = None) -> Callable[[], None]:
        tell(f"{text} …")
        return super().stage(text, total)

    def note(self, text: str) -> None:
        tell(text)
        super().note(text)

    def _say(self, line: str) -> None:
        tell(line)
        super()._say(line)


class Terminal(Progress):
    """Bars, for a terminal."""

    def __init__(self) -> None:
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress as Bars,
            SpinnerColumn,
            TextColumn,
            TimeElapsedColumn,
        )

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
        self._shown: tuple[TaskID, str] | None = None
        self._drawn = 0.0

    def stage(self, text: str, total: int | None = None) -> Callable[[], None]:
        counted = super().stage(text, total)
        text = printable(text)
        self._finish()
        bars, task = self._bars, self._bars.add_task(text, total=total, rate="")
        self._shown = task, text

        def finish() -> None:
            steps = next(t.completed for t in bars.tasks if t.id == task)
            # Of how many was not known before: now it is.
            end = total or max(int(steps), 1)
            bars.update(task, total=end, completed=end, description=text)

        self._open.append(finish)

        def step() -> None:
            counted()
            bars.advance(task)
            now = next(t for t in bars.tasks if t.id == task)
            if now.elapsed:
                bars.update(task, rate=pace(int(now.completed), total, now.elapsed))

        return step

    def doing(self, text: str) -> None:
        super().doing(text)
        now = self._clock()
        if self._shown is not None and self._stage is not None and now - self._drawn >= REDRAWN:
            self._drawn, (task, name) = now, self._shown
            self._bars.update(task, description=f"{name}: {printable(self._stage.detail)}")

    def idle(self) -> None:
        super().idle()
        self._finish()
        self._shown = None

    def note(self, text: str) -> None:
        super().note(text)
        self._bars.console.print(printable(text), markup=False, highlight=False)

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
        return super().__enter__()

    def __exit__(self, kind: type[BaseException] | None, *rest: object) -> None:
        if kind is None:
            self._finish()
        super().__exit__(kind, *rest)
        self._bars.stop()

    def _finish(self) -> None:
        while self._open:
            self._open.pop()()


def how_far(count: int, total: int | None, seconds: float) -> str:
    """Steps, of how many if that is known, and their pace."""
    steps = f"{count} steps" if total is None else f"{count}/{total}"
    return f"{steps}, {pace(count, total, seconds)}"


def pace(count: int, total: int | None, seconds: float) -> str:
    """Rate so far, and time left at that rate once a tenth of the steps is done."""
    speed = count / seconds
    if total is None or 10 * count < total:
        return rate(speed)
    return f"{rate(speed)}, {duration((total - count) / speed)} left"


def duration(seconds: float) -> str:
    """Hours, minutes and seconds, such as "0:03:20"."""
    rounded = round(seconds)
    hours, minutes = divmod(rounded // 60, 60)
    return f"{hours}:{minutes:02d}:{rounded % 60:02d}"


def rate(speed: float) -> str:
    """Steps per second, or per minute where that is less than one."""
    return f"{speed:.3g}/s" if speed >= 1.0 else f"{60.0 * speed:.3g}/min"


def progress_for(quiet: bool) -> Progress:
    """The kind that suits standard error."""
    if quiet:
        return Progress()
    return Terminal() if sys.stderr.isatty() else ProgressLines()
