"""Flows that differ in one parameter: what a branch of orbits is followed over.

A model's family runs over one of its dimensionless parameters or over ω, a board's over one of the
generator's settings. Each value has a flow of its own; the last few are kept.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from designer.base.errors import InputError
from designer.dynamics.flow import Flow

KEPT = 8
"""Flows that a family remembers."""


@dataclass(frozen=True)
class Family:
    """One flow for each value of a parameter."""

    parameter: str
    """Name of the parameter."""
    low: float
    """Lower end of the parameter's domain."""
    high: float
    """Upper end of the parameter's domain."""
    build: Callable[[float], Flow]
    """Makes the flow at a value."""
    _kept: dict[float, Flow] = field(default_factory=dict, repr=False, compare=False)

    def flow(self, value: float) -> Flow:
        """The flow at a value of the parameter.

        Raises
        ------
        InputError : the value lies outside the domain.
        """
        known = self._kept.get(value)
        if known is not None:
            return known
        if not self.contains(value):
            raise InputError(
                None, self.parameter, value, f"a number between {self.low:g} and {self.high:g}"
            )
        while len(self._kept) >= KEPT:
            self._kept.pop(next(iter(self._kept)))
        return self._kept.setdefault(value, self.build(value))

    def contains(self, value: float) -> bool:
        """Whether the value lies inside the domain."""
        return self.low <= value <= self.high
