"""A model whose parameters or drive frequency a sweep changes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, ClassVar

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.base.schema import one_of
from designer.base.si_unit import Unit
from designer.bifurcations.flow_family import Family
from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive
from designer.dynamics.steady_state import DrivenSystem
from designer.model.find_responses import FASTEST, SLOWEST, check_omega, scale_of
from designer.model.model import TRIED, Dimensionless, Mechanical
from designer.model.si_units import units_of
from designer.model.swept_tables import ModalBatch

SMALLEST = math.nextafter(0.0, 1.0)
BELOW_ONE = math.nextafter(1.0, 0.0)
GREATEST = math.nextafter(math.inf, 0.0)
DOMAINS = {
    "omega": (SLOWEST, FASTEST),
    "b": (SMALLEST, GREATEST),
    "k0": (0.0, BELOW_ONE),
    "zeta": (SMALLEST, TRIED["zeta"][1]),
    "m": TRIED["m"],
    "k": TRIED["k"],
    "c": TRIED["c"],
    "f20": (0.0, 1.0),
}
"""Closed intervals in which a model's parameter can be followed (``model.Dimensionless``)."""


@dataclass
class ModelSubject:
    """A model at one drive frequency, whose parameters can be swept."""

    whose: ClassVar[str] = "model"
    model: Dimensionless
    """The model in dimensionless parameters."""
    omega: float | None = None
    """Dimensionless drive frequency; None: it has to be among the changes."""
    parameters: tuple[str, ...] = tuple(DOMAINS)
    """Names of what can be swept."""
    states: tuple[str, ...] = ("x1", "x1'", "x2", "x2'")
    """Names of the states."""
    units: Mapping[str, str] = field(default_factory=dict)
    """Unit by parameter, and by "x", "v" and "λ" for the axes of a diagram; none where
    dimensionless."""
    _batch: ModalBatch = field(default_factory=ModalBatch, repr=False)
    mechanical: Mechanical | None = None
    """The SI values that the model was made from, if it was."""

    @property
    def si(self) -> dict[str, Unit]:
        """SI units of the quantities that have one, by name."""
        return units_of(self.mechanical)

    def check(self, option: str, name: str, value: float) -> None:
        """InputError that names the option, unless the parameter may have this value."""
        if name not in self.parameters:
            raise InputError(None, option, name, one_of(name, self.parameters))
        if name == "omega":
            check_omega(option, value)
            return
        try:
            _changed(self.model, {name: value})
        except InputError as error:
            expected = error.expected if math.isfinite(value) else "a finite number"
            raise InputError(None, option, value, f"{name}: {expected}") from None

    def settings(self, changes: Sequence[Mapping[str, float]]) -> list[DrivenSystem]:
        """One for each set of changes, the others as they stand."""
        models, omegas = [], []
        for change in changes:
            models.append(_changed(self.model, change))
            omega = change.get("omega", self.omega)
            assert omega is not None
            omegas.append(float(omega))
        tables = self._batch.tables(models, omegas)
        return [
            DrivenSystem(lambda m=m, w=w: _flow(m, w), 2.0 * np.pi / w, t)  # type: ignore[misc]
            for m, w, t in zip(models, omegas, tables, strict=True)
        ]

    def scale(self, changes: Sequence[Mapping[str, float]]) -> Array:
        """(states,) size of the states that starts are drawn from: one for all changes."""
        out = np.zeros(4)
        for change in changes:
            omega = change.get("omega", self.omega)
            assert omega is not None
            out = np.maximum(out, scale_of(_changed(self.model, change), omega))
        return out

    def family(self, parameter: str) -> Family:
        """One flow for each value of a parameter, the others as they stand."""
        return of_model(self.model, 1.0 if self.omega is None else self.omega, parameter)

    def held(self, swept: Mapping[str, float | None]) -> dict[str, float | None]:
        """ω and the model's parameters."""
        numbers = {f.name: getattr(self.model, f.name) for f in fields(self.model)}
        return {"omega": self.omega, **{k: v for k, v in numbers.items() if k != "sides"}}

    def remarks(self) -> tuple[str, ...]:
        """Which stop there is, where there is one only."""
        return () if self.model.sides == "both" else (f"{self.model.sides} stop only",)

    def as_dict(self) -> dict[str, object]:
        """What decides the flow, for hashes and provenance."""
        return {"model": dict(self.model.__dict__), "omega": self.omega}


def _flow(model: Dimensionless, omega: float) -> Flow:
    return Flow(model.second_order().piecewise_linear(), Drive(omega))


def _changed(model: Dimensionless, change: Mapping[str, float]) -> Dimensionless:
    others: dict[str, Any] = {k: v for k, v in change.items() if k != "omega"}
    return replace(model, **others) if others else model


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
