"""What happens inside a worker process: one simulator, one job after another.

``spice.pool`` starts workers and ends them. This module is imported by every worker: it
imports little.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import signal
import sys
import tempfile
import threading
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from designer.base.environment import clean_environment, set_environment
from designer.base.errors import EnvironmentMissing
from designer.spice.batch_backend import BatchNgspice
from designer.spice.shared_backend import SharedNgspice
from designer.spice.simulator import Backend, SimulationFailed, Simulator, SpiceJob


@dataclass(frozen=True)
class Reply:
    """What a worker says: first how its start went, then one for each job."""

    text: str = ""
    """ngspice's version, or what is missing; said at the start alone."""
    value: bytes = b""
    """Pickled result or ``SimulationFailed``."""
    last: bool = False
    """Whether the worker ends after this."""


def open_simulator(backend: Backend = "shared") -> Simulator:
    """The simulator of this process; a shared session is opened once and then handed out again.

    Raises
    ------
    EnvironmentMissing : ngspice is missing or too old.
    """
    if backend == "shared":
        return SharedNgspice.of_this_process()
    if backend == "batch":
        return BatchNgspice()
    raise ValueError(f'backend: found {backend!r}, expected "shared" or "batch"')


def work(connection: Connection, backend: Backend, folder: str) -> None:
    """The whole life of a worker."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.setsid()  # what it starts ends with it
    threading.Thread(target=_end_with_the_parent, daemon=True).start()
    os.dup2(2, 1)  # standard output is the parent's: no library prints into its JSON
    _move_to(folder)
    with contextlib.suppress(EOFError, ConnectionError):  # the parent is gone
        try:
            simulator = open_simulator(backend)
        except Exception as error:
            missing = isinstance(error, EnvironmentMissing)
            words = str(error) if missing else f"ngspice does not start: {reason_of(error)}"
            connection.send_bytes(pickle.dumps(Reply(words, last=True)))
            return
        connection.send_bytes(pickle.dumps(Reply(simulator.version)))
        while simulator.usable:
            value = _outcome(simulator, connection.recv_bytes())
            connection.send_bytes(pickle.dumps(Reply(value=value, last=not simulator.usable)))
    os._exit(0)  # libngspice tidies up a heap that may be corrupt; there is nothing to tidy


def _end_with_the_parent() -> None:
    """End this process and what it started when its parent is gone, even amid a job: a parent that
    was killed ends nobody."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os.killpg(0, signal.SIGKILL)


def _move_to(folder: str) -> None:
    """Make an empty home and working directory, and a place for temporary files beside it."""
    home, temporary = Path(folder, "home"), Path(folder, "tmp")
    home.mkdir()
    temporary.mkdir()
    sys.path[:] = [os.path.abspath(entry) for entry in sys.path]  # modules are still to be found
    changes = clean_environment(str(home))
    changes.pop("NGSPICE_LIBRARY_PATH", None)  # which library is the user's to say
    set_environment({**changes, "TMPDIR": str(temporary)})
    tempfile.tempdir = None  # it looks again
    os.chdir(home)


def _outcome(simulator: Simulator, job: bytes) -> bytes:
    """The pickled result of a pickled job; whatever goes wrong is a `SimulationFailed`."""
    try:
        try:
            todo: SpiceJob[Any] = pickle.loads(job)
        except Exception as error:
            raise SimulationFailed(
                f"analysis failed: it cannot be read: {reason_of(error)}"
            ) from error
        try:
            waveforms = simulator.run(todo.netlist, todo.signals, todo.stop, todo.analysis)
        except (ValueError, OSError, EnvironmentMissing) as error:
            raise SimulationFailed(f"simulation failed: {reason_of(error)}") from error
        try:
            return pickle.dumps(todo.reduce(waveforms))
        except Exception as error:
            raise SimulationFailed(f"analysis failed: {reason_of(error)}", waveforms.log) from error
    except SimulationFailed as failure:
        return pickle.dumps(SimulationFailed(failure.reason, failure.log))


def reason_of(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"
