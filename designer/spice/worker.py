"""What happens inside a worker process: one simulator, one job after another.

``spice.pool`` starts workers and ends them. This module is imported by every worker: it
imports little.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import sys
import tempfile
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any

from designer.base.environment import clean_environment, set_environment
from designer.base.errors import EnvironmentMissing
from designer.spice.backends import open_simulator
from designer.spice.simulator import Backend, SimulationFailed, Simulator, SpiceSweep, Waveforms

if TYPE_CHECKING:
    from designer.spice.job import SpiceJob


@dataclass(frozen=True)
class Reply:
    """What a worker says: first how its start went, then one for each job."""

    text: str = ""
    """At the start: ngspice's version, or what is missing."""
    value: bytes = b""
    """Pickled result or ``SimulationFailed``."""
    last: bool = False
    """Whether the worker ends after this."""


def work(connection: Connection, backend: Backend, folder: str) -> None:
    """The whole life of a worker."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.setsid()  # what it starts ends with it
    os.dup2(2, 1)  # standard output is the parent's: no library prints into its JSON
    _move_to(folder)
    try:
        simulator = open_simulator(backend)
    except EnvironmentMissing as error:
        connection.send_bytes(pickle.dumps(Reply(str(error), last=True)))
        return
    connection.send_bytes(pickle.dumps(Reply(simulator.version)))
    while simulator.usable:
        try:
            job = connection.recv_bytes()
        except EOFError:  # the parent is gone
            break
        value = _outcome(simulator, job)
        with contextlib.suppress(BrokenPipeError):
            connection.send_bytes(pickle.dumps(Reply(value=value, last=not simulator.usable)))
    os._exit(0)  # libngspice tidies up a heap that may be corrupt; there is nothing to tidy


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
            raise SimulationFailed(f"analysis failed: it cannot be read: {told(error)}") from error
        try:
            waveforms: Waveforms | SpiceSweep
            if todo.analysis == "tran":
                waveforms = simulator.run(todo.netlist, todo.signals, todo.stop_time)
            else:
                waveforms = simulator.sweep(
                    todo.netlist, todo.signals, todo.stop_time, todo.analysis
                )
        except (ValueError, OSError, EnvironmentMissing) as error:
            raise SimulationFailed(f"simulation failed: {told(error)}") from error
        try:
            return pickle.dumps(todo.reduce(waveforms))
        except Exception as error:
            raise SimulationFailed(f"analysis failed: {told(error)}", waveforms.log) from error
    except SimulationFailed as failure:
        return pickle.dumps(SimulationFailed(failure.reason, failure.log))


def told(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"
