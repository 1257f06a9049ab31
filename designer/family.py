"""Flows that differ in one parameter: what a branch of orbits is followed over.

A model's family runs over one of its dimensionless parameters or over ω, a board's over one of the
generator's settings. Each value has a flow of its own; the last few are kept.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from designer.deck import Excitation
from designer.errors import InputError
from designer.flow import Flow
from designer.model import Dimensionless
from designer.responses import FASTEST, SLOWEST
from designer.system import Drive, PiecewiseLinearSystem

SMALLEST = math.nextafter(0.0, 1.0)
BELOW_ONE = math.nextafter(1.0, 0.0)
GREATEST = math.nextafter(math.inf, 0.0)
DOMAINS = {
    "omega": (SLOWEST, FASTEST),
    "b": (SMALLEST, GREATEST),
    "k0": (0.0, BELOW_ONE),
    "zeta": (SMALLEST, GREATEST),
    "m": (SMALLEST, BELOW_ONE),
    "k": (SMALLEST, BELOW_ONE),
    "c": (0.0, BELOW_ONE),
    "f20": (0.0, 1.0),
}
"""Closed intervals in which a model's parameter can be followed (``model.Dimensionless``)."""
SETTINGS = {
    "frequency": (SMALLEST, GREATEST),
    "amplitude": (0.0, GREATEST),
    "offset": (-GREATEST, GREATEST),
}
"""The same for the generator of a board: Hz, V peak, V."""
KEPT = 8
"""Flows that a family remembers."""


@dataclass(frozen=True)
class Family:
    """One flow for each value of a parameter.

    parameter : its name. low, high : ends of its domain. build : makes the flow at a value.
    """

    parameter: str
    low: float
    high: float
    build: Callable[[float], Flow]
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


def of_model(model: Dimensionless, omega: float, parameter: str) -> Family:
    """The model at drive frequency omega, with one parameter of ``DOMAINS`` free.

    Raises
    ------
    InputError : the parameter is not one of them.
    """
    if parameter not in DOMAINS:
        raise InputError(None, "over", parameter, f"one of {', '.join(DOMAINS)}")

    def build(value: float) -> Flow:
        if parameter == "omega":
            return Flow(model.second_order().piecewise_linear(), Drive(value), fast=False)
        names: dict[str, Any] = {parameter: value}
        variant = replace(model, **names)
        return Flow(variant.second_order().piecewise_linear(), Drive(omega), fast=False)

    return Family(parameter, *DOMAINS[parameter], build)


def of_board(system: PiecewiseLinearSystem, excitation: Excitation, parameter: str) -> Family:
    """A reduced board with one setting of its generator free: frequency, amplitude or offset.

    Raises
    ------
    InputError : the setting is not one of them.
    """
    if parameter not in SETTINGS:
        raise InputError(None, "over", parameter, f"one of {', '.join(SETTINGS)}")

    def build(value: float) -> Flow:
        return Flow(system, replace(excitation, **{parameter: value}).drive, fast=False)

    return Family(parameter, *SETTINGS[parameter], build)
