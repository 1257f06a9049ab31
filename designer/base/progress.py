"""What a run says while it works, on standard error only.

On a terminal a bar for each stage, with rate and time left; elsewhere a line for each, and one
more from time to time while it lasts; with ``-q`` nothing. Time left is said from a tenth of a
stage on: the longest steps often come first, and the first of all may wait for a compiler.

Any function may call `stage`, `note`, `doing`, `part` and the other functions of this module: they
reach whom a verb was given to tell (`reported`). No stage is silent: inside ``with progress:`` that
one says every `SILENCE` seconds how long the stage has lasted, how far it is, and what it works on
just now (`doing`, `part`), if nothing else was said. What is sought (``with seeking:``) is
told a minute after the search began, as good as it is known then, and each minute from there on. A
work of several stages (``with whole(…):``) says beside each of them how far the whole is. The same
lines stand in the log.
"""

from __future__ import annotations

import functools
import logging
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, ParamSpec, Self, TypeVar

from designer.base.errors import InputError
from designer.base.printed import printable, tell

if TYPE_CHECKING:
    from rich.progress import Progress as Bars, TaskID

P = ParamSpec("P")
Result = TypeVar("Result")
Show = Callable[[Any], None]
"""Takes an answer while the work goes on: of a design once its parts stand, of a study once the
yields of the exact circuit stand, where ngspice is asked after that, and once all yields stand,
where attribution or maps take time after that."""


class _Quiet:
    """Takes an answer or a note and tells nobody; by its name in the help of a function."""

    def __call__(self, answer: object) -> None:
        """Does nothing."""

    def __repr__(self) -> str:
        return "quiet"


quiet = _Quiet()
"""What shows an answer, or takes a note, where nothing else was given."""
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
TRUST = 5.0
"""s of usual work whose pace is taken for granted: less of it says little of the machine."""
LONGER = 0.25
"""A phase that has lasted longer than usual is taken to last this share of that time again."""


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
        self._done, self._lock = 0, threading.RLock()

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

    @property
    def left(self) -> float:
        """Time that the steps which are not done will take [s]; 0 where too little is known."""
        with self._lock:
            if self.total is None or 10 * self._done < self.total:
                return 0.0
            return (self._clock() - self._began) * (self.total - self._done) / self._done

    def _report(self, after: float) -> None:
        now = self._clock()
        if now - self._last < after:
            return
        self._last, spent = now, now - self._began
        far = how_far(self._done, self.total, spent) if self._done else f"{duration(spent)} so far"
        self._say(f"  {far}" + (f": {self.detail}" if self.detail else ""))


class WholeWork:
    """How far a work of several phases is, each of which takes some time as a rule.

    usual : that time [s], in the order of the work, by how the name of the phase's first stage
    begins. What has ended, and the phase under way where it lasts longer, say by how much this work
    is slower than usual. The share that is done never falls, whatever becomes known of the rest.
    """

    def __init__(self, usual: Mapping[str, float], clock: Callable[[], float]) -> None:
        self.usual = dict(usual)
        self._clock = clock
        self._began = self._phase_began = clock()
        self._at = -1
        self._seconds = self._expected = self._most = 0.0

    def enter(self, stage: str) -> None:
        """A stage begins: with it the phase that it is the first of, and the one before ends."""
        names = list(self.usual)
        ahead = range(self._at + 1, len(names))
        place = next((i for i in ahead if stage.startswith(names[i])), None)
        if place is None:  # a stage of the phase, or one that is gone through again
            return
        now = self._clock()
        if self._at >= 0:
            self._seconds += now - self._phase_began
            self._expected += self.usual[names[self._at]]
        self._at, self._phase_began = place, now

    def far(self, steps_left: float) -> tuple[float, float] | None:
        """Share of the work that is done, and the time that is left [s]; None before the first
        phase. steps_left : of the stage that is under way [s]."""
        if self._at < 0:
            return None
        times, now = list(self.usual.values()), self._clock()
        pace = (TRUST + self._seconds) / (TRUST + self._expected)
        spent, usual = now - self._phase_began, times[self._at]
        rest = max(usual * pace - spent, LONGER * spent, steps_left)
        # Else a first phase that lasts would be most of the whole until the next one begins.
        known = self._seconds + spent + steps_left
        pace = max(pace, (TRUST + known) / (TRUST + self._expected + usual))
        left = rest + pace * sum(times[self._at + 1 :])
        self._most = max(self._most, 1.0 - left / (self.spent + left))
        return self._most, left

    @property
    def spent(self) -> float:
        """Time since it began [s]."""
        return self._clock() - self._began


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
    _work: WholeWork | None = None
    _ended: threading.Event | None = None
    _told: AbstractContextManager[None] | None = None

    def stage(self, text: str, total: int | None = None) -> Callable[[], None]:
        """A stage begins, with ``total`` steps if that is known; call the result at each step."""
        LOG.info("%s", text)
        if self._work is not None:
            self._work.enter(text)
        self._stage = ProgressStage(total, self._say_far, self._clock)
        return self._stage.step

    @contextmanager
    def whole(self, usual: Mapping[str, float]) -> Iterator[None]:
        """Inside, a whole is worked on: how far it is stands beside each stage. usual : as of
        ``WholeWork``. A whole within another one is a part of it."""
        if self._work is not None:
            yield
            return
        self._work = WholeWork(usual, self._clock)
        try:
            yield
        finally:
            self._work = None

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
        self._told = report_to(self)
        self._told.__enter__()
        self._ended = threading.Event()
        threading.Thread(target=self._watch, args=(self._ended,), daemon=True).start()
        return self

    def __exit__(self, kind: type[BaseException] | None, *rest: object) -> None:
        if self._ended is not None:
            self._ended.set()
        if self._told is not None:
            self._told.__exit__(None, None, None)
            self._told = None

    def _say(self, line: str) -> None:
        """A line about the stage."""
        LOG.info("%s", line)

    def _say_far(self, line: str) -> None:
        """A line about the stage, with how far the whole is."""
        far = self._far()
        self._say(line if far is None else f"{line}; whole: {in_words(*far)}")

    def _far(self) -> tuple[float, float] | None:
        """``WholeWork.far`` as it is now."""
        left = 0.0 if self._stage is None else self._stage.left
        return None if self._work is None else self._work.far(left)

    def _watch(self, ended: threading.Event) -> None:
        while not ended.wait(BEAT):
            self.beat()


_WATCHED: ContextVar[Progress | None] = ContextVar("watched", default=None)
"""Who is told."""
_PARTS: ContextVar[tuple[str, ...]] = ContextVar("parts", default=())
"""The parts of the work that are under way, the outermost first; a thread beside has its own."""
_WITHIN: ContextVar[Progress | None] = ContextVar("within", default=None)
"""Who hears of no stage for now (`within_stage`)."""


@contextmanager
def report_to(progress: Progress | None) -> Iterator[None]:
    """Inside, this one is told of the work, which is no part of another's; None: whoever is told
    already."""
    if progress is None or progress is _WATCHED.get():
        yield
        return
    told, parts = _WATCHED.set(progress), _PARTS.set(())
    try:
        yield
    finally:
        _PARTS.reset(parts)
        _WATCHED.reset(told)


def reported(function: Callable[P, Result]) -> Callable[P, Result]:
    """The function, which tells of its work whom its keyword ``progress`` names (`report_to`).

    Raises
    ------
    InputError : ``progress`` is something else.
    """

    @functools.wraps(function)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> Result:
        progress = kwargs.get("progress")
        if not (progress is None or isinstance(progress, Progress)):
            raise InputError(None, "progress", repr(progress), "a designer.base.progress.Progress")
        with report_to(progress):
            return function(*args, **kwargs)

    return wrapped


def is_watched() -> bool:
    """Whether there is somebody to tell."""
    return _WATCHED.get() is not None


def watched() -> Progress:
    """Who is watched; where nobody is, one that tells the log alone. Threads beside, but for those
    of ``threads.parallel``, ask before they begin."""
    return _WATCHED.get() or Progress()


def stage(text: str, total: int | None = None) -> Callable[[], None]:
    """As of ``Progress.stage``; inside `within_stage` it is what the stage works on just now."""
    told = watched()
    if _WITHIN.get() is told:
        told.doing(text)
        return lambda: None
    return told.stage(text, total)


@contextmanager
def within_stage() -> Iterator[None]:
    """Inside, the stages of what is done are none of their own, but belong to the one under way."""
    token = _WITHIN.set(_WATCHED.get())
    try:
        yield
    finally:
        _WITHIN.reset(token)


def whole(usual: Mapping[str, float]) -> AbstractContextManager[None]:
    """As of ``Progress.whole``."""
    return watched().whole(usual)


def note(text: str) -> None:
    """As of ``Progress.note``."""
    watched().note(text)


def doing(text: str) -> None:
    """Tell who is watched what is worked on just now, such as "dead zone, tables 3"."""
    if (told := _WATCHED.get()) is not None:
        told.doing(text)


@contextmanager
def part(text: str) -> Iterator[None]:
    """What is worked on inside belongs to this part, such as "without swing"."""
    if (told := _WATCHED.get()) is None:
        yield
        return
    above = _PARTS.set((*_PARTS.get(), text))
    told.doing("")
    try:
        yield
    finally:
        _PARTS.reset(above)
        told.forget_parts()


@contextmanager
def seeking(what: str) -> Iterator[None]:
    """Inside, `best_so_far` says how good an answer is known, such as to "parts"; a search within
    another one is a part of it."""
    told = _WATCHED.get()
    if told is None or told._sought is not None:
        yield
        return
    told._sought = Sought(what, told._clock)
    try:
        yield
    finally:
        told._sought = None


def best_so_far(text: str, *, step: bool = False) -> None:
    """Tell who is watched the best that is known of what is sought, such as "an error of 1 %".
    step : as of ``Progress.best_so_far``."""
    if (told := _WATCHED.get()) is not None:
        told.best_so_far(text, step=step)


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
        self._above: TaskID | None = None
        self._drawing = threading.Lock()

    def stage(self, text: str, total: int | None = None) -> Callable[[], None]:
        counted = super().stage(text, total)
        text = printable(text)
        self._finish()
        self._draw_whole()  # it stands above the stages
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

    def beat(self) -> None:
        super().beat()
        self._draw_whole()

    @contextmanager
    def whole(self, usual: Mapping[str, float]) -> Iterator[None]:
        with super().whole(usual):
            yield
        with self._drawing:
            if self._work is None and self._above is not None:
                self._bars.update(self._above, completed=100, rate="")
                self._above = None

    def _draw_whole(self) -> None:
        with self._drawing:
            work, far = self._work, self._far()
            if work is None or far is None:
                return
            if self._above is None:
                self._above = self._bars.add_task("whole", total=100, rate="")
                self._bars.tasks[-1].start_time = self._bars.get_time() - work.spent
            left = f"about {duration(far[1])} left"
            self._bars.update(self._above, completed=round(100.0 * far[0]), rate=left)

    def note(self, text: str) -> None:
        super().note(text)
        self._bars.console.print(printable(text), markup=False, highlight=False)

    @contextmanager
    def aside(self) -> Iterator[None]:
        self._finish()
        with self._drawing:
            self._bars.stop()
            for task in self._bars.task_ids:  # they stand above, and are not to be drawn again
                self._bars.remove_task(task)
            self._above = None
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


def in_words(share: float, left: float) -> str:
    """How far a whole is. left : the time that it will still take [s]."""
    return f"{100.0 * share:.0f} %, about {duration(left)} left"


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
