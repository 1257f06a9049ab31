"""One small interface to ngspice: what a run takes, what it returns, and when it counts.

Two implementations pass the same tests: `spice.shared_backend` drives libngspice inside the
process through PySpice, `spice.batch_backend` starts the program ``ngspice -b`` for every run.

ngspice fails silently. A node that floats between capacitors gives exit status 0, a waveform that
looks normal, and "singular matrix" somewhere in the log; "timestep too small" leaves a waveform
that ends early. So a run counts only if `accept` says so; everything else is `SimulationFailed`.

ngspice also does what a deck tells it. A comment that starts with ``*#`` is a command, text after
``.end`` is another deck, a model card can name a file or a program. So a deck reaches ngspice only
through `check_netlist`.

This module is imported by every worker process: it imports numpy and the standard library only.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Literal, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from designer.base.errors import DesignerError, EnvironmentMissing
from designer.base.printed import one_line

Backend = Literal["shared", "batch"]
Analysis = Literal["tran", "ac", "dc"]
T_co = TypeVar("T_co", covariant=True)

OLDEST_NGSPICE = 36
HOW_TO_INSTALL = (
    "install the system packages ngspice and libngspice0 (Debian, Ubuntu: "
    f"apt-get install ngspice libngspice0), version {OLDEST_NGSPICE} or later"
)


@dataclass(frozen=True, eq=False)
class Waveforms:
    """What an analysis that counts has produced.

    With ``uic`` ngspice does not keep t = 0: the axis starts at its first step.
    """

    axis: NDArray[np.float64]
    """(k,), strictly increasing: time [s]; frequency [Hz] of "ac", swept voltage [V] of "dc"."""
    signals: Mapping[str, NDArray[Any]]
    """Name as asked for → (k,) [V]; [A] of a branch, such as ``vm1#branch``; complex of "ac"."""
    log: str
    """What ngspice printed."""
    seconds: float
    """Wall time of the run."""


LOG_LIMIT = 20_000
"""Characters of ngspice's log that a failure keeps."""


class SimulationFailed(DesignerError):
    """A run that does not count: why, and what ngspice printed (cut to `LOG_LIMIT`)."""

    def __init__(self, reason: str, log: str = "") -> None:
        self.reason = reason
        self.log = log if len(log) <= LOG_LIMIT else log[:LOG_LIMIT] + "\n… (cut)"
        super().__init__(self.reason, self.log)  # both in args: pickling calls this again

    def __str__(self) -> str:
        return self.reason


class Simulator(Protocol):
    """A way to run a deck."""

    name: str
    """``ngspice-shared`` or ``ngspice-batch``."""
    version: str
    """ngspice's own, such as ``39``."""
    usable: bool
    """False once the session is beyond repair; only a new process helps."""

    def run(
        self, netlist: str, signals: Sequence[str], stop: float, analysis: Analysis = "tran"
    ) -> Waveforms:
        """Run a deck and return the wanted signals.

        Parameters
        ----------
        netlist : a whole deck: title, elements, one analysis, ``.end``.
        signals : node names, any case.
        stop : last value of the axis, which the run must reach.

        Raises
        ------
        ValueError : `check_netlist` refuses the deck.
        SimulationFailed : the run does not count.
        """


@dataclass(frozen=True)
class SpiceJob(Generic[T_co]):
    """One run of ngspice, as it is handed to a worker."""

    netlist: str
    """The deck, as of ``Simulator.run``."""
    signals: tuple[str, ...]
    """Names of the wanted signals, as of ``Simulator.run``."""
    stop: float
    """Last value of the axis, as of ``Simulator.run``."""
    reduce: Callable[[Waveforms], T_co]
    """What is made of the waveforms, inside the worker. It and its result must pickle: a function
    of a module or a ``functools.partial`` of one, not a lambda."""
    analysis: Analysis = "tran"
    patience: float = 1.0
    """How many times the pool's time it may take: a run at a finer step takes longer."""


def require_version(found: str) -> str:
    """``found`` if it is recent enough.

    Raises
    ------
    EnvironmentMissing : it is not, or it is no version at all.
    """
    major = re.match(r"\d{1,4}(?!\d)", found, re.ASCII)
    if major is None or int(major[0]) < OLDEST_NGSPICE:
        told = one_line(found[:40]) or "of unknown version"
        raise EnvironmentMissing(f"ngspice {told} found; {HOW_TO_INSTALL}")
    return found


_OFFENDING = re.compile(
    r"error|warning|singular|timestep too small|no such|undefined|doanalyses|aborted|fatal"
    # "Note: v1: has no value, DC 0 assumed": a source whose value was lost or misspelt
    r"|has no value",
    re.IGNORECASE,
)

# Steps on the way to an operating point. Where the way ends in vain, a line follows that counts
# ("source stepping failed", "Transient op failed", "doAnalyses"); where it does not, the point
# that was found satisfies the equations as any other does. "singular matrix" is never harmless.
_HARMLESS = re.compile(
    r"Warning: (Further gmin increment|Last gmin step failed"
    r"|Dynamic gmin stepping failed|True gmin stepping failed)",
)

# Lines that quote the deck: its title, and the table of node names and voltages, where a node
# may be called "error".
_QUOTATION = re.compile(r"\s*(Circuit: .*|\S+\s+[-+]?\d[\d.]*(e[-+]?\d+)?)\s*", re.IGNORECASE)


def offending_line(log: str) -> str | None:
    """The first line of a log that says that the run cannot be trusted."""
    for line in log.splitlines():
        if not _QUOTATION.fullmatch(line) and _OFFENDING.search(_HARMLESS.sub("", line)):
            return line.strip()
    return None


def quoted(line: str) -> str:
    """A reason that quotes a line of ngspice's log."""
    return f"ngspice said: {line[:200]}"


_AXES: Mapping[Analysis, tuple[str, str, str]] = {
    "tran": ("time", "time vector", "s"),
    "ac": ("frequency", "frequency vector", "Hz"),
    "dc": ("v-sweep", "vector of the swept source", "V"),
}
"""ngspice's name of the axis, its name in messages, its unit."""


def accept(
    vectors: Mapping[str, NDArray[Any]],
    signals: Sequence[str],
    stop: float,
    log: str,
    seconds: float,
    analysis: Analysis = "tran",
) -> Waveforms:
    """The waveforms of a run, if it counts.

    Parameters
    ----------
    vectors : of the analysis, by lower-case name, with the axis; empty if there is none.
    signals, stop : as in `Simulator.run`.

    Raises
    ------
    SimulationFailed : the log holds an `offending_line`; or the axis is missing, does not increase,
        does not reach its end; or a signal is missing or not finite.
    """
    line = offending_line(log)
    if line is not None:
        raise SimulationFailed(quoted(line), log)
    key, what, unit = _AXES[analysis]
    axis = vectors.get(key)
    if axis is None or axis.size == 0:
        kind = "transient" if analysis == "tran" else analysis
        raise SimulationFailed(f"ngspice made no {kind} analysis", log)
    axis = np.array(axis.real, dtype=np.float64)
    if not np.all(np.isfinite(axis)) or not np.all(np.diff(axis) > 0.0):
        raise SimulationFailed(f"the {what} does not increase", log)
    if axis[-1] < stop - 1e-9 * abs(stop):
        raise SimulationFailed(f"the run ends at {axis[-1]:.9g} {unit}, not {stop:.9g} {unit}", log)
    waves: dict[str, NDArray[Any]] = {}
    for name in signals:
        values = vectors.get(name.lower())
        if values is None:
            raise SimulationFailed(f"the circuit has no node {name!r}", log)
        if values.shape != axis.shape or not np.all(np.isfinite(values)):
            raise SimulationFailed(f"node {name!r} has values that are not finite", log)
        waves[name] = values if analysis == "ac" else values.real
    return Waveforms(axis, waves, log, seconds)
