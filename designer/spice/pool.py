"""Worker processes that run decks: `SpicePool` hands out `SpiceJob`, any number at a time.

A worker is a fresh process (spawn) with one simulator, an empty home and working directory of its
own, one thread for numerical libraries, and no ear for Ctrl-C, which is the parent's affair. A
job carries a function that is applied to the waveforms inside the worker, so that what travels
back is small. A worker that dies or hangs is replaced and its job is tried once more; one that
cannot be trusted after a job (see `Simulator.usable`) is replaced too. What a job gives depends on
the job alone, not on the number of workers nor on the order.

This module is imported by every worker: it imports little. A script that makes a pool needs the
usual ``if __name__ == "__main__":``, as every user of spawn does.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import pickle
import shutil
import signal
import tempfile
import time
import weakref
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, TypeVar

from designer.base.environment import changed_environment, spawn_context
from designer.base.errors import EnvironmentMissing
from designer.spice.batch_backend import program_version
from designer.spice.shared_backend import library_name
from designer.spice.simulator import (
    HOW_TO_INSTALL,
    Backend,
    SimulationFailed,
    SpiceJob,
    Waveforms,
)
from designer.spice.worker import Reply, reason_of, work

T = TypeVar("T")

START_TIMEOUT = 60.0
"""Time that a worker has for getting ready, s."""
ATTEMPTS = 2
"""How often a job that kills its worker is tried, and a worker that will not start is started."""
ONE_THREAD: dict[str, str | None] = {
    f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "BLIS", "NUMBA")
}


class SpicePool:
    """Worker processes, started when first needed.

    Use it in a ``with`` statement: leaving it, by whatever way, ends the workers at once and
    removes their folders.

    Parameters
    ----------
    jobs : the most workers at a time.
    backend : ``shared`` (libngspice in the worker) or ``batch`` (a process for every deck).
    timeout : the longest that one attempt at a job may take, s, but for a job's own patience.
    """

    def __init__(self, jobs: int, backend: Backend = "shared", timeout: float = 120.0) -> None:
        if jobs < 1:
            raise ValueError(f"jobs: found {jobs}, expected at least 1")
        if not timeout > 0.0:
            raise ValueError(f"timeout: found {timeout}, expected more than 0 s")
        self.version: str | None = None
        """ngspice's version as a worker found it; None before the first worker is ready."""
        self._jobs = jobs
        self._backend: Backend = backend
        self._timeout = timeout
        self._workers: list[_Worker] = []
        self._failed_starts = 0
        self._mapping = False
        self._folder = Path(tempfile.mkdtemp(prefix="designer-spice-"))
        self._cleanup = weakref.finalize(self, _end, self._workers, self._folder)

    def __enter__(self) -> SpicePool:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End all workers at once and remove their folders. May be called twice."""
        self._cleanup()

    def map(self, jobs: Iterable[SpiceJob[T] | None]) -> Iterator[tuple[int, T | SimulationFailed]]:
        """Run jobs and yield ``(index, result)`` as they finish, in no certain order.

        Jobs are taken from the iterable only as workers become free. Giving the iterator up early
        ends the jobs under way.

        Parameters
        ----------
        jobs : any number of them; None where the next depends on a result that is still to come.

        Raises
        ------
        EnvironmentMissing : ngspice is missing or too old, or workers do not start.
        RuntimeError : the pool is closed, or another map of it is not finished.
        """
        if not self._cleanup.alive:
            raise RuntimeError("this pool is closed")
        if self._mapping:
            raise RuntimeError("this pool is at work: finish or close the other iterator first")
        self._mapping = True
        try:
            yield from self._results(iter(jobs))
        finally:
            for worker in [w for w in self._workers if w.task is not None]:
                self._discard(worker)
            self._mapping = False

    def _results(
        self, source: Iterator[SpiceJob[T] | None]
    ) -> Iterator[tuple[int, T | SimulationFailed]]:
        waiting: deque[_Task] = deque()
        numbers = itertools.count()
        while True:
            busy = sum(w.task is not None for w in self._workers)
            while len(waiting) < self._jobs - busy:
                job = next(source, None)
                if job is None:
                    break
                waiting.append(_Task(next(numbers), pickle.dumps(job), job.patience))
            if not waiting and not busy:
                return
            self._hand_out(waiting)
            for worker in self._worth_a_look():
                result = self._look_at(worker, waiting)
                if result is not None:
                    yield result

    def _hand_out(self, waiting: deque[_Task]) -> None:
        """Give tasks to ready workers, and start workers for the tasks that are left."""
        for worker in [w for w in self._workers if w.ready and w.task is None]:
            if not waiting:
                return
            task = waiting.popleft()
            try:
                worker.connection.send_bytes(task.job)
            except OSError:  # it died idle: not the task's fault
                self._discard(worker)
                waiting.appendleft(task)
                continue
            worker.task = task
            worker.deadline = time.monotonic() + task.patience * self._timeout
        starting = sum(not w.ready for w in self._workers)
        for _ in range(min(len(waiting) - starting, self._jobs - len(self._workers))):
            _start(self._backend, Path(tempfile.mkdtemp(dir=self._folder)), self._workers)

    def _worth_a_look(self) -> list[_Worker]:
        """The workers that have something to say, or whose time is over; waits for the first."""
        active = [w for w in self._workers if w.task is not None or not w.ready]
        if not active:
            return []
        left = min(w.deadline for w in active) - time.monotonic()
        ready = wait([w.connection for w in self._workers], max(left, 0.0))
        now = time.monotonic()
        return [
            w for w in self._workers if w.connection in ready or (w in active and now >= w.deadline)
        ]

    def _look_at(self, worker: _Worker, waiting: deque[_Task]) -> tuple[int, Any] | None:
        """Take a worker's message, or draw the consequences of its silence."""
        reply: Reply | None = None
        given = START_TIMEOUT
        if worker.ready:
            given = self._timeout * (1.0 if worker.task is None else worker.task.patience)
        complaint = f"gave no answer within {given:g} s"
        if worker.connection.poll():
            try:
                reply = pickle.loads(worker.connection.recv_bytes())
            except (EOFError, OSError):
                complaint = ""  # dead: discarding it tells how
        task, worker.task = worker.task, None
        if reply is None or reply.last:
            status = self._discard(worker, patience=0.0 if complaint else 1.0)
            complaint = complaint or f"died (exit {status})"
        if reply is None:
            return self._lost(task, worker.ready, complaint, waiting)
        if not worker.ready:
            if reply.last:
                raise EnvironmentMissing(reply.text)
            worker.ready, self.version, self._failed_starts = True, reply.text, 0
            return None
        assert task is not None
        return task.index, _unpack(reply.value)

    def _lost(
        self, task: _Task | None, was_ready: bool, complaint: str, waiting: deque[_Task]
    ) -> tuple[int, SimulationFailed] | None:
        if not was_ready:
            self._failed_starts += 1
            if self._failed_starts >= ATTEMPTS:
                where = f": libngspice is {library_name()}" if self._backend == "shared" else ""
                raise EnvironmentMissing(
                    f"simulation workers do not start: the last {complaint}{where}; "
                    f"{HOW_TO_INSTALL}"
                )
        if task is None:
            return None
        task.complaints.append(complaint)
        if len(task.complaints) < ATTEMPTS:
            waiting.appendleft(task)
            return None
        first, last = task.complaints[0], task.complaints[-1]
        how = f"{last} twice" if first == last else f"{first}, then {last}"
        return task.index, SimulationFailed(f"worker {how}")

    def _discard(self, worker: _Worker, patience: float = 0.0) -> int | None:
        """End a worker; see `_Worker.end`."""
        with _interrupts_deferred():
            self._workers.remove(worker)
            return worker.end(patience)


@dataclass(eq=False)
class _Task:
    index: int
    job: bytes
    patience: float = 1.0
    complaints: list[str] = field(default_factory=list)


@dataclass(eq=False)
class _Worker:
    process: BaseProcess
    connection: Connection
    folder: Path
    deadline: float  # for getting ready, then for the task; s, monotonic clock
    ready: bool = False
    task: _Task | None = None

    def end(self, patience: float = 0.0) -> int | None:
        """Kill the process and what it started, collect it, remove its folder.

        Returns the exit status (minus the signal, if it was one); ``patience`` is the time that
        a process has to end by itself and so tell its own, s.
        """
        with contextlib.suppress(OSError):
            self.connection.close()
        wait([self.process.sentinel], patience)
        pid = self.process.pid
        assert pid is not None, "a worker is entered in the list only after its start"
        # It leads a group of its own as soon as it runs; before that there is no such group.
        # Until it is joined nobody else can have its number.
        with contextlib.suppress(ProcessLookupError):
            os.killpg(pid, signal.SIGKILL)
        self.process.kill()
        self.process.join()
        status = self.process.exitcode
        self.process.close()
        shutil.rmtree(self.folder, ignore_errors=True)
        return status


def _end(workers: list[_Worker], folder: Path) -> None:
    with _interrupts_deferred():
        for worker in workers:
            worker.end()
        workers.clear()
        shutil.rmtree(folder, ignore_errors=True)


@contextlib.contextmanager
def _interrupts_deferred() -> Iterator[None]:
    """Put Ctrl-C off until the end of the block, so that no worker gets lost on the way."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _start(backend: Backend, folder: Path, workers: list[_Worker]) -> None:
    """Start a worker and enter it in the list, both or neither."""
    # Its tracker runs already: started inside the block below it would lift the hold of Ctrl-C.
    context = spawn_context()
    parent_end, child_end = context.Pipe()
    process = context.Process(
        target=work, args=(child_end, backend, str(folder)), name="designer-spice", daemon=True
    )
    # A held signal stays held in the child, so Ctrl-C cannot hit it before it can say that it
    # ignores it.
    with _interrupts_deferred(), child_end:
        with changed_environment(ONE_THREAD):  # before the child imports numpy
            process.start()
        workers.append(_Worker(process, parent_end, folder, time.monotonic() + START_TIMEOUT))


def _unpack(value: bytes) -> Any:
    try:
        return pickle.loads(value)
    except Exception as error:
        return SimulationFailed(f"analysis failed: its result cannot be read: {reason_of(error)}")


def require_ngspice(pool: SpicePool) -> None:
    """EnvironmentMissing before any long work; the worker that was started stays for it."""
    program_version()
    deck = "a resistor\nV1 a 0 1\nR1 a 0 1\n.tran 1 2\n.end\n"
    for _, answer in pool.map([SpiceJob(deck, ("a",), 2.0, _length)]):
        if isinstance(answer, SimulationFailed):
            raise EnvironmentMissing(f"ngspice does not work: {answer.reason}; {HOW_TO_INSTALL}")


def _length(waveforms: Waveforms) -> int:
    return len(waveforms.axis)
