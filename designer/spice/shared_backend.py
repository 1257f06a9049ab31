"""libngspice inside the process, through PySpice: no start-up cost per run.

The library can be initialised once in a process (a second time crashes it), so there is one
session and `SharedNgspice.of_this_process` hands it out. It cannot be unloaded either: a session
lasts as long as its process. A deck that ngspice finds fatal (an undefined parameter is enough)
leaves the library with a corrupt heap; then the session is not `usable`, and the process had
better end soon. Decks that are not the tool's own belong in a `spice.pool.SpicePool`.
"""

from __future__ import annotations

import contextlib
import ctypes.util
import logging
import os
import tempfile
import time
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from designer.base.environment import changed_environment, clean_environment
from designer.base.errors import EnvironmentMissing
from designer.catalog.netlist_guard import check_netlist
from designer.spice.simulator import (
    HOW_TO_INSTALL,
    Analysis,
    SimulationFailed,
    Waveforms,
    accept,
    require_version,
)


class SharedNgspice:
    """The one ngspice session of this process.

    Raises
    ------
    RuntimeError : the process has a session already; take `of_this_process`.
    EnvironmentMissing : the library is missing, too old, or without XSPICE.
    """

    name = "ngspice-shared"
    _only: ClassVar[SharedNgspice | None] = None

    def __init__(self) -> None:
        if SharedNgspice._only is not None:
            raise RuntimeError(
                "this process has an ngspice session already and cannot hold two: "
                "use SharedNgspice.of_this_process(), or a process more"
            )
        self._log: list[str] | None = None
        self._session = _start_session()
        SharedNgspice._only = self  # from here on a second start would crash
        self._session.send_char = self._listen
        self.usable = True
        self.version = str(self._session.ngspice_version or "")
        self._check_library()

    @classmethod
    def of_this_process(cls) -> SharedNgspice:
        """The session, opened if need be. Raises as the class does."""
        if cls._only is None:
            return cls()
        cls._only._check_library()
        return cls._only

    def _check_library(self) -> None:
        require_version(self.version)
        if not self._session.has_xspice:
            raise EnvironmentMissing(f"this libngspice has no XSPICE; {HOW_TO_INSTALL}")

    def run(
        self, netlist: str, signals: Sequence[str], stop: float, analysis: Analysis = "tran"
    ) -> Waveforms:
        """See `designer.spice.simulator.Simulator.run`."""
        check_netlist(netlist)
        if not self.usable:
            raise SimulationFailed("an earlier deck ended the ngspice session of this process")
        started = time.perf_counter()
        self._log = []
        vectors: dict[str, NDArray[Any]] = {}
        try:
            # PySpice raises NameError and its kin on any odd line of output, harmless ones too;
            # whether the run counts is for the log and the vectors to say.
            with contextlib.suppress(NameError):
                self._session.load_circuit(netlist)
            self._watch()
            if self.usable:
                with contextlib.suppress(NameError):
                    self._session.run()
                self._watch()
            if self.usable:
                vectors = self._newest(analysis)
        finally:
            log = "\n".join(self._log)
            self._log = None
            if self.usable:
                self._forget()
        return accept(vectors, signals, stop, log, time.perf_counter() - started, analysis)

    def _watch(self) -> None:
        """Touch the library no more once it wanted to exit: the next call may crash the process."""
        if any("cannot recover" in line for line in self._log or ()):
            self.usable = False

    def _newest(self, analysis: Analysis) -> dict[str, NDArray[Any]]:
        plots = [name for name in self._session.plot_names if name.startswith(analysis)]
        if not plots:
            return {}
        vectors = self._session.plot(None, plots[0])  # the newest comes first
        # A copy of the numbers without PySpice's units, which are slow and not complex.
        return {name.lower(): np.array(vector._data) for name, vector in vectors.items()}

    def _forget(self) -> None:
        """Drop the finished plots and the circuit: neither goes by itself."""
        for command in ("destroy all", "remcirc"):
            with contextlib.suppress(NameError):  # no circuit: it was not even parsed
                self._session.exec_command(command)

    def _listen(self, message: str, session: int) -> int:
        if self._log is not None:
            self._log.append(message.removeprefix("stdout ").removeprefix("stderr "))
        return 0


def library_name() -> str:
    """The libngspice that a session loads; "" where there is none."""
    return os.environ.get("NGSPICE_LIBRARY_PATH") or ctypes.util.find_library("ngspice") or ""


def _start_session() -> Any:
    """A PySpice session of a libngspice that has read no one's settings."""
    library = library_name()
    if not library:
        raise EnvironmentMissing(f"libngspice is missing; {HOW_TO_INSTALL}")
    # "Unsupported Ngspice version" and an echo of every line; the log of a run says it all
    logging.getLogger("PySpice").setLevel(logging.CRITICAL + 1)
    with warnings.catch_warnings():
        # unclean escape sequences, by the path of the file or the name of the module
        warnings.filterwarnings("ignore", module=r"(.*[/\\])?(PySpice|ply)([./\\]|$)")
        from PySpice.Spice.NgSpice.Shared import NgSpiceShared
    # PySpice would ask for libngspice.so, a name that only development packages bring.
    NgSpiceShared.LIBRARY_PATH = library
    with _nobodys_home():
        try:
            session = NgSpiceShared()
        except Exception as error:  # another library, another version: it has none of the functions
            why = f"libngspice does not load: {library}: {error}; {HOW_TO_INSTALL}"
            raise EnvironmentMissing(why) from None
    # An operating point that no stepping finds is a failure at once. ngspice would look for it by
    # a run in time, which never ends where op-amps of endless gain have no bandwidth.
    session.exec_command("optran 0 1 1 0 0 0")
    return session


@contextlib.contextmanager
def _nobodys_home() -> Iterator[None]:
    """Be in a folder where the only ``.spiceinit`` is empty.

    libngspice takes the one in the working directory, or else the one in the home of the password
    database, whatever HOME says: an empty one at hand keeps the other out.
    """
    before = os.open(".", os.O_RDONLY | os.O_DIRECTORY)
    try:
        with tempfile.TemporaryDirectory(prefix="ngspice-") as folder:
            Path(folder, ".spiceinit").touch()
            try:
                os.chdir(folder)
                with changed_environment(clean_environment(folder)):
                    yield
            finally:
                os.fchdir(before)
    finally:
        os.close(before)
