"""One run of ngspice, as it is handed to a worker."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from designer.spice.simulator import Analysis

T_co = TypeVar("T_co", covariant=True)


@dataclass(frozen=True)
class SpiceJob(Generic[T_co]):
    """A deck, what is wanted of it, and what is to be made of that."""

    netlist: str
    """The deck, as of ``Simulator.run``."""
    signals: tuple[str, ...]
    """Names of the signals that are wanted, as of ``Simulator.run``."""
    stop_time: float
    """End of the run [s]; with ``analysis`` "ac" or "dc" the last frequency [Hz] or voltage [V]."""
    reduce: Callable[[Any], T_co]
    """What is made of the waveforms (of a ``SpiceSweep`` with "ac" or "dc"). It runs inside the
    worker; it and its result must pickle, so it is a function of a module (or a
    ``functools.partial`` of one), not a lambda."""
    analysis: Analysis = "tran"
    """"tran" for a ``Simulator.run``, "ac" or "dc" for a ``Simulator.sweep``."""
