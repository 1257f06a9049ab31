"""The program ``ngspice -b``, one process for each run: slower to start, nothing to go stale."""

from __future__ import annotations

import functools
import os
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from designer.base.environment import clean_environment
from designer.base.errors import EnvironmentMissing
from designer.catalog.netlist_guard import check_netlist
from designer.spice.simulator import (
    HOW_TO_INSTALL,
    Analysis,
    SimulationFailed,
    Waveforms,
    accept,
    offending_line,
    quoted,
    require_version,
)

LONGEST_START, LONGEST_RUN = 60.0, 300.0
"""Time [s] in which the program says its version, and ends a run; one that hangs is ended."""


class BatchNgspice:
    """Runs each deck in a process and a folder of its own.

    Raises
    ------
    EnvironmentMissing : the program is missing or too old.
    """

    name = "ngspice-batch"
    usable = True

    def __init__(self) -> None:
        self._program = _program()
        self.version = program_version()

    def run(
        self, netlist: str, signals: Sequence[str], stop: float, analysis: Analysis = "tran"
    ) -> Waveforms:
        """See `designer.spice.simulator.Simulator.run`."""
        started = time.perf_counter()
        plots, log, status = self._plots(netlist)
        last = next((p.vectors for p in reversed(plots) if p.name == PLOTS[analysis]), {})
        waveforms = accept(last, signals, stop, log, time.perf_counter() - started, analysis)
        if status != 0:
            raise SimulationFailed(f"ngspice exit {status}", log)
        return waveforms

    def analyse(self, netlist: str) -> list[RawPlot]:
        """Every plot of a deck of any analysis: operating point, ``.dc``, ``.ac``, ``.noise``.

        Raises
        ------
        RefusedNetlist : `check_netlist` refuses the deck.
        SimulationFailed : the log holds an `offending_line`, or there is no plot.
        """
        plots, log, status = self._plots(netlist)
        line = offending_line(log)
        if line is not None:
            raise SimulationFailed(quoted(line), log)
        if status != 0 or not plots:
            raise SimulationFailed(f"{len(plots)} plots, ngspice exit {status}", log)
        return plots

    def _plots(self, netlist: str) -> tuple[list[RawPlot], str, int]:
        """Plots, log and exit status."""
        check_netlist(netlist)
        with tempfile.TemporaryDirectory(prefix="ngspice-") as folder:
            Path(folder, "deck.cir").write_bytes(netlist.encode("utf-8") + b"\n")
            try:
                words = [self._program, "-n", "-b", "-r", "deck.raw", "deck.cir"]
                run = _call(words, folder, LONGEST_RUN)
            except subprocess.TimeoutExpired:
                raise SimulationFailed(f"ngspice gave no answer within {LONGEST_RUN:g} s") from None
            log = run.stdout.decode("utf-8", "replace") + run.stderr.decode("utf-8", "replace")
            raw = Path(folder, "deck.raw")
            content = raw.read_bytes() if raw.exists() else b""
        try:
            return read_raw(content), log, run.returncode
        except ValueError as error:
            line = offending_line(log)
            reason = f"{error} (ngspice exit {run.returncode})" if line is None else quoted(line)
            raise SimulationFailed(reason, log) from error


def _program() -> str:
    program = shutil.which("ngspice")
    if program is None:
        raise EnvironmentMissing(f"the program ngspice is missing; {HOW_TO_INSTALL}")
    return program


def program_version() -> str:
    """Version of the ngspice program on the search path.

    Raises
    ------
    EnvironmentMissing : it is missing or too old.
    """
    return require_version(_version_of(_program()))


@functools.cache
def _version_of(program: str) -> str:
    with tempfile.TemporaryDirectory(prefix="ngspice-") as folder:
        try:
            said = _call([program, "-n", "--version"], folder, LONGEST_START).stdout
        except subprocess.TimeoutExpired:
            found = f"{program} does not say its version within {LONGEST_START:g} s"
            raise EnvironmentMissing(f"{found}; {HOW_TO_INSTALL}") from None
    match = re.search(r"ngspice-(\d[\w.+-]{0,39})", said.decode("utf-8", "replace"))
    return match[1] if match else ""


def _call(command: list[str], folder: str, patience: float) -> subprocess.CompletedProcess[bytes]:
    environment = dict(os.environ)
    for name, value in clean_environment(folder).items():
        if value is None:
            environment.pop(name, None)
        else:
            environment[name] = value
    try:
        return subprocess.run(
            command,
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=patience,
            check=False,
        )
    except OSError as error:
        raise EnvironmentMissing(f"ngspice does not start: {error}; {HOW_TO_INSTALL}") from error


# ---------------------------------------------------------------------------------------------
# The raw file

PLOTS: dict[Analysis, str] = {
    "tran": "Transient Analysis",
    "ac": "AC Analysis",
    "dc": "DC transfer characteristic",
}


@dataclass(frozen=True, eq=False)
class RawPlot:
    """One analysis of a raw file."""

    name: str
    """Name of the analysis, such as ``Transient Analysis``."""
    vectors: dict[str, NDArray[Any]]
    """The vectors by the names that a session uses: ``v1`` for v(v1), ``vm1#branch`` for i(vm1)."""


def read_raw(content: bytes) -> list[RawPlot]:
    """The plots of a binary raw file.

    A plot is a text header (``Key: value`` lines, then one line ``index name type`` a variable)
    and, after the line ``Binary:``, points × variables doubles in the machine's byte order, twice
    as many if the flag is ``complex``.

    Raises
    ------
    ValueError : the file is cut short or is no such file.
    """
    plots: list[RawPlot] = []
    position = 0
    while position < len(content):
        end = content.find(b"\nBinary:\n", position)
        if end < 0:
            raise ValueError("raw file: no binary data")
        header = content[position:end].decode("utf-8", "replace")
        position = end + len(b"\nBinary:\n")
        fields, _, table = header.partition("\nVariables:")
        lines = (line.partition(":") for line in fields.split("\n"))
        value = {key: text.strip(" \t") for key, colon, text in lines if colon}
        names = [line.split("\t")[2] for line in table.split("\n") if line.count("\t") >= 3]
        try:
            columns, rows = int(value["No. Variables"]), int(value["No. Points"])
            name, flags = value["Plotname"], value["Flags"].split()
        except (KeyError, ValueError) as error:
            raise ValueError(f"raw file: bad header ({error})") from error
        if len(names) != columns or columns < 1 or rows < 0:
            raise ValueError(f"raw file: {columns} variables announced, {len(names)} named")
        number = np.dtype(np.complex128 if "complex" in flags else np.float64)
        size = rows * columns * number.itemsize
        if position + size > len(content):
            raise ValueError("raw file: cut short")
        block = np.frombuffer(content, number, rows * columns, position)
        keys = (_session_name(n) for n in names)
        vectors = block.reshape(rows, columns).T.copy()
        plots.append(RawPlot(name, dict(zip(keys, vectors, strict=True))))
        position += size
    return plots


def _session_name(name: str) -> str:
    name = name.lower()
    if name.startswith("v(") and name.endswith(")"):
        return name[2:-1]
    if name.startswith("i(") and name.endswith(")"):
        return f"{name[2:-1]}#branch"
    return name
