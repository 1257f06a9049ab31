"""Blocks of a study on a Dask cluster, by the address of its scheduler.

The unit is a block: the same samples, the same rows, whoever makes them. ngspice's runs stay on
the machine that asks, where the gate has passed the settings. A worker that dies costs the blocks
that it was at work on, which others make again. This is the only module that needs ``distributed``.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from typing import Any, Self

from designer.base.errors import EnvironmentMissing
from designer.base.version import __version__
from designer.yields.layers import Step, Task
from designer.yields.study_identity import RULES

PATIENCE = 5.0
"""s that a scheduler has to answer, and to have a worker."""
ATTEMPTS = 5
"""How often a block may lose its worker."""
AHEAD = 4
"""Blocks a worker has waiting, so that memory stays flat."""
_HOW = "start one with dask scheduler and dask worker, and give its address as tcp://HOST:PORT"


class Cluster:
    """A cluster as a runner of blocks (``layers.Runner``). Use it in a ``with`` statement.

    Raises
    ------
    EnvironmentMissing : ``distributed`` is not installed, nobody answers at the address, there is
        no worker, or workers have another version of this tool.
    """

    def __init__(self, address: str) -> None:
        self._client = _connected(address)
        try:
            self._check(address)
        except BaseException:
            self._client.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._client.close()

    def run(self, tasks: Iterable[Task], step: Step) -> Iterator[tuple[int, Sequence[Any]]]:
        """(index, rows) as blocks finish, in no certain order; ``step`` once a row.

        Raises
        ------
        EnvironmentMissing : a block lost its worker too often, or the cluster went away.
        """
        source = enumerate(tasks)
        index: dict[Any, int] = {}
        with self._staying():
            completed = self._as_completed()
            limit = AHEAD * max(len(self._client.scheduler_info()["workers"]), 1)
        try:
            with self._staying():
                self._feed(source, index, completed, limit)
            while index:
                with self._staying():
                    future = next(completed)
                    number = index.pop(future)
                    rows: Sequence[Any] = future.result()
                for _ in rows:
                    step()
                yield number, rows
                with self._staying():
                    self._feed(source, index, completed, limit)
        finally:
            if self._client.status == "running":
                self._client.cancel(list(index))

    def _as_completed(self) -> Any:
        from distributed import as_completed

        make: Any = as_completed
        return make(loop=self._client.loop)

    def _feed(
        self, source: Iterator[tuple[int, Task]], index: dict[Any, int], completed: Any, limit: int
    ) -> None:
        while len(index) < limit:
            following = next(source, None)
            if following is None:
                return
            number, task = following
            # Not pure: equal blocks of two studies are two blocks.
            future = self._client.submit(_rows, task, pure=False, retries=ATTEMPTS)
            index[future] = number
            completed.add(future)

    @contextmanager
    def _staying(self) -> Iterator[None]:
        """Turns the loss of the cluster into an error of its own; a block's own error stays."""
        from distributed.scheduler import KilledWorker

        try:
            yield
        except KilledWorker as error:
            raise EnvironmentMissing(f"the cluster lost a block's workers: {error}") from None
        except CancelledError as error:  # of every future, once the client gives up
            raise EnvironmentMissing(f"the cluster went away: {_line(error)}") from None
        except Exception as error:
            if self._client.status == "running":
                raise
            raise EnvironmentMissing(f"the cluster went away: {_line(error)}") from None

    def _check(self, address: str) -> None:
        """The cluster has workers, and all of them make rows by the rules of this process."""
        try:
            self._client.wait_for_workers(1, timeout=PATIENCE)
            identities = self._client.run(_identity)
        except (OSError, TimeoutError) as error:
            raise EnvironmentMissing(f"no worker at {address}: {error}; {_HOW}") from None
        except ImportError as error:
            raise EnvironmentMissing(f"workers at {address} lack this tool: {error}") from None
        for worker, (version, rules) in sorted(identities.items()):
            if (version, rules) != _identity():
                raise EnvironmentMissing(
                    f"the worker {worker} has designer {version} with rules {rules}, "
                    f"this machine {__version__} with {RULES}"
                )


def _connected(address: str) -> Any:  # a Client, which has no types
    try:
        from distributed import Client
    except ImportError:
        raise EnvironmentMissing(
            "--cluster needs the package distributed: pip install 'designer-circuits[cluster]'"
        ) from None
    logging.getLogger("distributed").setLevel(logging.ERROR)
    make: Any = Client
    try:
        return make(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise EnvironmentMissing(f"no cluster at {address}: {_line(error)}; {_HOW}") from None


def _line(error: BaseException) -> str:
    """Its message on one line."""
    return " ".join(str(error).split())


def _identity() -> tuple[str, dict[str, int]]:
    return __version__, dict(RULES)


def _rows(task: Task) -> Sequence[Any]:
    """A block, on a worker."""
    return task(1, lambda: None)
