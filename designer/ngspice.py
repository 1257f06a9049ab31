"""One small interface to ngspice: what a run takes, what it returns, and when it counts.

Two implementations pass the same tests: `designer.spice_shared` drives libngspice inside the
process through PySpice, `designer.spice_batch` starts the program ``ngspice -b`` for every run.

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
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from designer.errors import DesignerError, EnvironmentMissing

Backend = Literal["shared", "batch"]
Analysis = Literal["tran", "ac", "dc"]

OLDEST_NGSPICE = 36
HOW_TO_INSTALL = (
    "install the system packages ngspice and libngspice0 (Debian, Ubuntu: "
    f"apt-get install ngspice libngspice0), version {OLDEST_NGSPICE} or later"
)


@dataclass(frozen=True, eq=False)
class Waveforms:
    """What a run that counts has produced.

    With ``uic`` ngspice does not keep t = 0: ``time`` starts at its first step.
    """

    time: NDArray[np.float64]
    """(k,), s, strictly increasing, up to the stop time at least."""
    signals: Mapping[str, NDArray[np.float64]]
    """Name as it was asked for → (k,), V (A for a branch such as ``vm1#branch``)."""
    log: str
    """What ngspice printed."""
    seconds: float
    """Wall time of the run."""


@dataclass(frozen=True, eq=False)
class Sweep:
    """What an ``.ac`` or ``.dc`` analysis that counts has produced."""

    axis: NDArray[np.float64]
    """(k,), strictly increasing: frequency in Hz, or the swept source in V."""
    signals: Mapping[str, NDArray[np.complex128]]
    """Name as it was asked for → (k,), V; the imaginary part is 0 for ``.dc``."""
    log: str
    """What ngspice printed."""
    seconds: float
    """Wall time of the run."""


class SimulationFailed(DesignerError):
    """A run that does not count: why, and what ngspice printed (cut to `LOG_LIMIT`)."""

    def __init__(self, reason: str, log: str = "") -> None:
        self.reason = reason
        self.log = log if len(log) <= LOG_LIMIT else log[:LOG_LIMIT] + "\n… (cut)"
        super().__init__(self.reason, self.log)  # both in args: pickling calls this again

    def __str__(self) -> str:
        return self.reason


LOG_LIMIT = 20_000


class Simulator(Protocol):
    """A way to run a deck."""

    name: str
    """``ngspice-shared`` or ``ngspice-batch``."""
    version: str
    """ngspice's own, such as ``39``."""
    usable: bool
    """False once the session is beyond repair; only a new process helps."""

    def run(self, netlist: str, signals: Sequence[str], stop_time: float) -> Waveforms:
        """Run a deck and return the wanted signals.

        Parameters
        ----------
        netlist : a whole deck: title, elements, one ``.tran``, ``.end``.
        signals : node names, any case.
        stop_time : s; the run must reach it.

        Raises
        ------
        ValueError : `check_netlist` refuses the deck.
        SimulationFailed : the run does not count.
        """

    def sweep(self, netlist: str, signals: Sequence[str], stop: float, analysis: Analysis) -> Sweep:
        """Run a deck with one ``.ac`` or ``.dc`` and return the wanted signals.

        Parameters
        ----------
        stop : last frequency [Hz], or last value of the swept source [V]; the run must reach it.

        Raises
        ------
        As `run`.
        """

    def close(self) -> None:
        """Release what can be released. May be called twice."""


def open_simulator(backend: Backend = "shared") -> Simulator:
    """The simulator of this process; a shared session is opened once and then handed out again.

    Raises
    ------
    EnvironmentMissing : ngspice is missing or too old.
    """
    if backend == "shared":
        from designer.spice_shared import SharedNgspice

        return SharedNgspice.of_this_process()
    if backend == "batch":
        from designer.spice_batch import BatchNgspice

        return BatchNgspice()
    raise ValueError(f'backend: found {backend!r}, expected "shared" or "batch"')


def ngspice_version() -> str:
    """Version of the ngspice program, such as ``39``, for provenance.

    It does not open a session. A study's own version is `SpicePool.version`.

    Raises
    ------
    EnvironmentMissing : ngspice is missing or too old.
    """
    from designer.spice_batch import program_version

    return program_version()


def require_version(found: str) -> str:
    """``found`` if it is recent enough.

    Raises
    ------
    EnvironmentMissing : it is not, or it is no version at all.
    """
    major = re.match(r"\d+", found)
    if major is None or int(major[0]) < OLDEST_NGSPICE:
        raise EnvironmentMissing(f"ngspice {found or 'of unknown version'} found; {HOW_TO_INSTALL}")
    return found


# ---------------------------------------------------------------------------------------------
# What may reach ngspice

CARDS = frozenset(
    ".subckt .ends .model .param .func .tran .ic .nodeset .options .option .save .end .title "
    ".global .temp .ac .dc .op .noise".split()
)

MODEL_TYPES = frozenset(
    # SPICE devices
    "r c l sw csw d npn pnp njf pjf nmf pmf nmos pmos vdmos ltra urc "
    # XSPICE code models that only compute: others read files (filesource, d_state, table2d),
    # and from ngspice 42 on run programs (d_process, d_cosim)
    "gain summer mult divide limit climit ilimit slew hyst pwl int d_dt s_xfer aswitch".split()
)

_ELEMENT = re.compile(r"[A-Za-z][^\s]*\s")
_MODEL = re.compile(r"\.model\s+[^\s(]+\s+([A-Za-z_]\w*)\s*(?:[\s(]|$)", re.IGNORECASE)
_HARMFUL = '\\`"$;'  # joins lines, runs commands, names files, expands variables, hides text


def check_netlist(netlist: str) -> None:
    """Refuse a deck that holds anything but elements, comments and the harmless dot cards.

    Allowed: a title line, element lines, ``*`` comments, ``+`` continuations, the cards in
    `CARDS`, models of the types in `MODEL_TYPES`, and nothing after ``.end``.

    Raises
    ------
    ValueError : with the number of the first offending line.
    """
    statements: list[tuple[int, str]] = []
    ended = 0
    for number, raw in enumerate(netlist.split("\n"), start=1):
        line = raw.strip(" \t")
        if not line.replace("\t", " ").isprintable():
            raise _refusal(number, line, "a control character")
        if number == 1:
            # The first line is the title, unless it makes ngspice take the deck for a script.
            if not line or line[0] in ".+" or _is_command(line):
                raise _refusal(number, line, "not a title")
        elif ended and line:
            raise _refusal(number, line, f"text after .end (line {ended})")
        elif line.startswith("*"):
            if _is_command(line):
                raise _refusal(number, line, "a comment that ngspice would execute")
        elif line.startswith("+"):
            if not statements:
                raise _refusal(number, line, "a continuation of nothing")
            first, text = statements[-1]
            _check_characters(number, line)
            statements[-1] = (first, f"{text} {line[1:]}")  # ngspice puts a blank there too
        elif line:
            _check_characters(number, line)
            statements.append((number, line))
            if line.lower() == ".end":
                ended = number
    if not ended:
        raise ValueError("netlist: no .end line")
    for number, text in statements:
        _check_statement(number, text)


def _is_command(comment: str) -> bool:
    return bool(re.match(r"\*\s*(#|ng_)", comment, re.IGNORECASE))


def _check_characters(number: int, line: str) -> None:
    if not line.isascii():
        raise _refusal(number, line, "a character outside ASCII")
    for character in _HARMFUL:
        if character in line:
            raise _refusal(number, line, f"the character {character}")


def _check_statement(number: int, text: str) -> None:
    if not text.startswith("."):
        if not _ELEMENT.match(text):
            raise _refusal(number, text, "not an element line")
        return
    card = text.split(maxsplit=1)[0].lower()
    if card not in CARDS:
        raise _refusal(number, text, f"the card {card}")
    if card == ".model":
        kind = _MODEL.match(text)
        if kind is None or kind[1].lower() not in MODEL_TYPES:
            raise _refusal(number, text, "a model of a type that is not allowed")


def _refusal(number: int, line: str, what: str) -> ValueError:
    return ValueError(f"netlist: line {number} is refused ({what}): {line[:80]!r}")


# ---------------------------------------------------------------------------------------------
# When a run counts

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


def said(line: str) -> str:
    """A reason that quotes a line of ngspice's log."""
    return f"ngspice said: {line[:200]}"


def accept(
    vectors: Mapping[str, NDArray[np.float64]],
    signals: Sequence[str],
    stop_time: float,
    log: str,
    seconds: float,
) -> Waveforms:
    """The waveforms of a run, if it counts.

    Parameters
    ----------
    vectors : of the transient analysis, by lower-case name, with ``time``; empty if there is none.
    signals, stop_time : as in `Simulator.run`.

    Raises
    ------
    SimulationFailed : the log holds an `offending_line`; or the time vector is missing, does not
        increase, does not reach the stop time; or a signal is missing or not finite.
    """
    time, found = _accepted(vectors, "time", signals, stop_time, log)
    return Waveforms(time=time, signals=found, log=log, seconds=seconds)


AXES = {"ac": "frequency", "dc": "v-sweep"}
"""What ngspice calls the axis of each analysis."""


def accept_sweep(
    vectors: Mapping[str, NDArray[np.complex128]],
    signals: Sequence[str],
    stop: float,
    analysis: Analysis,
    log: str,
    seconds: float,
) -> Sweep:
    """The sweep of an ``.ac`` or ``.dc`` analysis, if it counts: as `accept`.

    Raises
    ------
    SimulationFailed : as `accept`, of the axis that `AXES` names.
    """
    axis, found = _accepted(vectors, AXES[analysis], signals, stop, log)
    complex_ = {name: values.astype(np.complex128) for name, values in found.items()}
    return Sweep(axis=axis, signals=complex_, log=log, seconds=seconds)


_WORDS = {
    "time": ("transient", "time vector", "s"),
    "frequency": ("ac", "frequency vector", "Hz"),
    "v-sweep": ("dc", "vector of the swept source", "V"),
}


def _accepted(
    vectors: Mapping[str, NDArray[Any]], name: str, signals: Sequence[str], stop: float, log: str
) -> tuple[NDArray[np.float64], dict[str, NDArray[Any]]]:
    line = offending_line(log)
    if line is not None:
        raise SimulationFailed(said(line), log)
    analysis, what, unit = _WORDS[name]
    axis = vectors.get(name)
    if axis is None or axis.size == 0:
        raise SimulationFailed(f"ngspice made no {analysis} analysis", log)
    axis = np.array(axis.real, dtype=np.float64)
    if not np.all(np.isfinite(axis)) or not np.all(np.diff(axis) > 0.0):
        raise SimulationFailed(f"the {what} does not increase", log)
    if axis[-1] < stop - 1e-9 * abs(stop):
        raise SimulationFailed(f"the run ends at {axis[-1]:.9g} {unit}, not {stop:.9g} {unit}", log)
    found: dict[str, NDArray[Any]] = {}
    for name in signals:
        values = vectors.get(name.lower())
        if values is None:
            raise SimulationFailed(f"the circuit has no node {name!r}", log)
        if values.shape != axis.shape or not np.all(np.isfinite(values)):
            raise SimulationFailed(f"node {name!r} has values that are not finite", log)
        found[name] = values
    return axis, found
