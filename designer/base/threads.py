"""Work for the exact engine on all cores: threads, since its kernels release the GIL."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import copy_context
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")
interrupt = threading.Event()
"""Set to stop every flow of this process: compiled code hears no Ctrl-C by itself."""
_lock = threading.Lock()
_open = 0
"""Calls of ``parallel`` that are under way, one within another."""


def heed() -> None:
    """Stop here if ``interrupt`` is set."""
    if interrupt.is_set():
        raise KeyboardInterrupt


def parallel(
    function: Callable[[Item], Result], items: Iterable[Item], jobs: int
) -> Iterator[Result]:
    """function(item) for each item, in order, by ``jobs`` threads; a function may call it again.
    Who is told of the caller's work (``progress``) is told of theirs.

    Ctrl-C, or leaving the iterator, stops the flows that are under way within a second.
    """
    with _counted():
        pool = ThreadPoolExecutor(jobs)
        # A copy for each: two threads cannot be in one context at once.
        futures = [pool.submit(copy_context().run, function, item) for item in items]
        try:
            for future in futures:
                yield future.result()
        except BaseException:
            interrupt.set()
            raise
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def _counted() -> Iterator[None]:
    """The last to leave takes the interrupt back: until then it is for the others, too."""
    global _open
    with _lock:
        _open += 1
    try:
        yield
    finally:
        with _lock:
            _open -= 1
            if not _open:
                interrupt.clear()
