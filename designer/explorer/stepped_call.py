"""A long call that hands the turn back at each report of its progress.

``stepped`` makes pieces for ``work_queue`` of a call that knows nothing of it: the call runs in a
thread of its own, but only while somebody waits for the next piece.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Generator
from typing import TypeVar

Result = TypeVar("Result")


class _AbandonedError(BaseException):
    """Nobody wants the result any more."""


class _Call:
    """The thread of one call."""

    def __init__(self, call: Callable[[Callable[[], None]], object]) -> None:
        self.result: object = None
        self.error: BaseException | None = None
        self.done = False
        self._abandoned = False
        self._call = call
        self._ours, self._theirs = threading.Semaphore(0), threading.Semaphore(0)
        self._thread = threading.Thread(target=self._run, name="stepped call", daemon=True)
        self._thread.start()

    def step(self) -> None:
        """Let it run until it reports its progress, or ends."""
        self._ours.release()
        self._theirs.acquire()

    def abandon(self) -> None:
        """End it where it is."""
        self._abandoned = True
        self._ours.release()
        self._thread.join()

    def _progress(self) -> None:
        self._theirs.release()
        self._ours.acquire()
        if self._abandoned:
            raise _AbandonedError

    def _run(self) -> None:
        self._ours.acquire()
        try:
            if not self._abandoned:
                self.result = self._call(self._progress)
        except _AbandonedError:
            pass
        except BaseException as error:
            self.error = error
        finally:
            self.done = True
            self._theirs.release()


def stepped(call: Callable[[Callable[[], None]], Result]) -> Generator[None, None, Result]:
    """The result of a call, which is given a function that it calls at each bit of progress; an
    item for each of these. What the call raises is raised; where the generator is closed, it ends.
    """
    running = _Call(call)
    try:
        running.step()
        while not running.done:
            yield
            running.step()
    finally:
        if not running.done:
            running.abandon()
    if running.error is not None:
        raise running.error
    return running.result  # type: ignore[return-value]
