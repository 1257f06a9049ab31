"""Work for the exact engine on all cores: threads, since its kernels release the GIL."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from designer.flow import interrupt

Item = TypeVar("Item")
Result = TypeVar("Result")


def parallel(
    function: Callable[[Item], Result], items: Iterable[Item], jobs: int
) -> Iterator[Result]:
    """function(item) for each item, in order, by ``jobs`` threads.

    Ctrl-C, or leaving the iterator, stops the flows that are under way within a second.
    """
    pool = ThreadPoolExecutor(jobs)
    futures = [pool.submit(function, item) for item in items]
    try:
        for future in futures:
            yield future.result()
    except BaseException:
        interrupt.set()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
        interrupt.clear()
