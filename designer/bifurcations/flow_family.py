"""Flows that differ in one or two parameters: what a branch or a border is followed over.

A model's family runs over one of its dimensionless parameters or over ω, a board's over one of the
generator's settings; a plane over two of them. Each value has a flow of its own; each thread keeps
its last few.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from designer.base.errors import InputError
from designer.dynamics.flow import Flow

Key = TypeVar("Key")
MOST_FLOWS = 8
"""Flows that a family remembers, in each thread."""
ASIDE = 1e-3
"""Of a value, or of its domain where that is narrower: how far aside it is looked whether a mirror
is that of all values."""


class _Kept(threading.local, Generic[Key]):
    """The last few flows of each thread: a flow is used by one thread at a time."""

    def __init__(self) -> None:
        self.flows: dict[Key, Flow] = {}

    def flow(self, key: Key, build: Callable[[], Flow]) -> Flow:
        """The flow of this key; one that is made takes the place of the oldest."""
        if key not in self.flows:
            made = build()
            while len(self.flows) >= MOST_FLOWS:
                self.flows.pop(next(iter(self.flows)))
            self.flows[key] = made
        return self.flows[key]


@dataclass(frozen=True)
class Family:
    """One flow for each value of a parameter."""

    parameter: str
    low: float
    """Lower end of the parameter's domain."""
    high: float
    """Upper end of the parameter's domain."""
    build: Callable[[float], Flow]
    """Makes the flow at a value."""
    _kept: _Kept[float] = field(default_factory=_Kept, repr=False, compare=False)

    def flow(self, value: float) -> Flow:
        """The flow at a value of the parameter.

        Raises
        ------
        InputError : the value lies outside the domain, or nothing can have it.
        """

        def made() -> Flow:
            self.check(value)
            return self.build(value)

        return self._kept.flow(value, made)

    def contains(self, value: float) -> bool:
        """Whether there is a flow at the value: others may keep the parameter from it that its own
        domain does not know of."""
        try:
            self.flow(value)
        except InputError:
            return False
        return True

    def mirrored(self, value: float) -> bool:
        """Whether the flows at a value and beside it have a mirror: one value alone may have one,
        such as that at which two gaps are equal."""
        near = (v for v in self.beside(value) if self.contains(v))
        return all(self.flow(v).system.mirror is not None for v in near)

    def beside(self, value: float) -> tuple[float, float, float]:
        """A value, and one on either side of it."""
        step = ASIDE * min(abs(value) or 1.0, self.high - self.low)
        return value, value - step, value + step

    def check(self, value: float) -> None:
        """InputError unless the value lies inside the domain."""
        if not self.low <= value <= self.high:
            expected = f"a number between {self.low:g} and {self.high:g}"
            raise InputError(None, self.parameter, value, expected)


@dataclass(frozen=True)
class FlowPlane:
    """One flow for each pair of values of two parameters."""

    first: Family
    """Name and domain of the first parameter; its flows are at the second's nominal value."""
    second: Family
    """Name and domain of the second parameter; its flows are at the first's nominal value."""
    build: Callable[[float, float], Flow]
    """Makes the flow at a pair of values, the first parameter's before the second's."""
    _kept: _Kept[tuple[float, float]] = field(default_factory=_Kept, repr=False, compare=False)

    @property
    def parameters(self) -> tuple[str, str]:
        """Names of both parameters."""
        return self.first.parameter, self.second.parameter

    def flow(self, first: float, second: float) -> Flow:
        """The flow at a pair of values.

        Raises
        ------
        InputError : a value lies outside its domain, or nothing can have both.
        """

        def made() -> Flow:
            self.first.check(first)
            self.second.check(second)
            return self.build(first, second)

        return self._kept.flow((first, second), made)

    def contains(self, first: float, second: float) -> bool:
        """Whether there is a flow at both values: one may keep the other from it."""
        try:
            self.flow(first, second)
        except InputError:
            return False
        return True

    def mirrored(self, first: float, second: float) -> bool:
        """Whether the flows at both values and beside them have a mirror."""
        pairs = [(v, second) for v in self.first.beside(first)]
        pairs += [(first, v) for v in self.second.beside(second)]
        near = (self.flow(*pair) for pair in pairs if self.contains(*pair))
        return all(flow.system.mirror is not None for flow in near)

    def along_first(self, second: float) -> Family:
        """The family over the first parameter, at a value of the second."""
        one = self.first
        return Family(one.parameter, one.low, one.high, lambda v: self.build(v, second))
