"""One run of ngspice, as it is handed to a worker."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from designer.spice.simulator import Analysis

T_co = TypeVar("T_co", covariant=True)


@dataclass(frozen=True)
class SpiceJob(Generic[T_co]):
    """A deck, what is wanted of it, and what is to be made of that.

    ``netlist``, ``signals`` and ``stop_time`` (s) are those of `Simulator.run`. ``reduce`` runs
    inside the worker; it and its result must pickle, so it is a function of a module (or a
    `functools.partial` of one), not a lambda. With ``analysis`` "ac" or "dc" the run is a
    `Simulator.sweep`: ``stop_time`` is then its last frequency [Hz] or voltage [V], and ``reduce``
    gets a `Sweep`.
    """

    netlist: str
    signals: tuple[str, ...]
    stop_time: float
    reduce: Callable[[Any], T_co]
    analysis: Analysis = "tran"
