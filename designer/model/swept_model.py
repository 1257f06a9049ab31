"""A model whose parameters or drive frequency a sweep changes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.base.schema import one_of
from designer.base.si_unit import Unit
from designer.bifurcations.flow_family import Family, FlowPlane
from designer.bifurcations.subject import ShownStop
from designer.dynamics.flow import Flow
from designer.dynamics.steady_state import UPPER, DrivenSystem
from designer.model.driven import model_flow
from designer.model.find_responses import scale_of
from designer.model.mechanics import MechanicalModel, check_omega, frequency_range, state_names
from designer.model.model import SiScales
from designer.model.relative_motion import relative_motions, shown_stops, state_labels
from designer.model.si_units import in_si, units_of
from designer.model.swept_tables import ModalBatch


@dataclass
class ModelSubject:
    """A model at one drive frequency, whose parameters can be swept."""

    name: ClassVar[str] = "model"
    model: MechanicalModel
    omega: float | None = None
    """Drive frequency in the model's units; None: it has to be among the changes."""
    _batch: ModalBatch = field(default_factory=ModalBatch, repr=False)
    scales: SiScales | None = None
    """SI values of the model's units; None where they are not known."""

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of what can be swept."""
        return ("omega", *self.model.parameters)

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states."""
        return state_names(self.model.second_order().size)

    @property
    def weights(self) -> Array:
        """(states,) the first mass's own frequency for a displacement, 1 for a velocity."""
        system = self.model.second_order()
        return np.tile([system.own_frequency, 1.0], system.size)

    @property
    def units(self) -> Mapping[str, str]:
        """Unit of plain numbers by parameter, and by "λ" for the axis of a diagram, whose lengths
        and speeds are shown as ``si`` says; none where they are no SI values."""
        if not in_si(self.scales, self.model):
            return {}
        return {"omega": "rad/s", **self.model.units, "λ": "1/s"}

    @property
    def labels(self) -> Mapping[str, str]:
        """Those of a model whose masses have names."""
        system = self.model.second_order()
        if not system.names:
            return {}
        return {
            **dict(zip(self.states, state_labels(system), strict=True)),
            "displacement": relative_motions(system)[0].label,
        }

    @property
    def stops(self) -> tuple[ShownStop, ...]:
        """Those of ``shown_stops``, by their clearance's name where the masses have names."""
        system = self.model.second_order()
        motions, shown = relative_motions(system), shown_stops(system)
        if not system.names:
            names = {1: "the upper stop (A1)", -1: "the lower stop (A2)"}
            return tuple(ShownStop(k, side, names[side], "x₁′") for k, side in shown or UPPER)
        if not shown:
            return (ShownStop(0, 1, "a stop", motions[0].rate),)
        words = {1: "upper", -1: "lower"}
        return tuple(
            ShownStop(
                k,
                side,
                f"the {words[side]} stop of {system.clearances[k].name}",
                motions[k].rate,
            )
            for k, side in shown
        )

    @property
    def si(self) -> dict[str, Unit]:
        """SI units of the quantities that are shown in one beside their plain numbers, by name."""
        return units_of(self.scales, self.model)

    def check(self, option: str, name: str, value: float) -> None:
        """InputError that names the option, unless the parameter may have this value."""
        if name not in self.parameters:
            raise InputError(None, option, name, one_of(name, self.parameters))
        if name == "omega":
            check_omega(option, value, self.model)
            return
        try:
            self.model.changed({name: value})
        except InputError as error:
            expected = f"{name}: {error.expected}"
            if not math.isfinite(value):
                expected = f"{name}: a finite number"
            elif isinstance(error.found, float) and error.found != value:  # that of another key
                beside = f"{error.field} = {error.found:g}, which is to be {error.expected}"
                expected = f"another {name}: it stands beside {beside}"
            raise InputError(None, option, value, expected) from None

    def settings(self, changes: Sequence[Mapping[str, float]]) -> list[DrivenSystem]:
        """One for each set of changes, the others as they stand."""
        models, omegas = [], []
        for change in changes:
            models.append(_changed(self.model, change))
            omega = change.get("omega", self.omega)
            assert omega is not None
            omegas.append(float(omega))
        tables = self._batch.tables(models, omegas)
        stops = tuple((stop.clearance, stop.side) for stop in self.stops)
        return [
            DrivenSystem(lambda m=m, w=w: model_flow(m, w), 2.0 * np.pi / w, t, stops)  # type: ignore[misc]
            for m, w, t in zip(models, omegas, tables, strict=True)
        ]

    def scale(self, changes: Sequence[Mapping[str, float]]) -> Array:
        """(states,) size of the states that starts are drawn from: one for all changes."""
        out = np.zeros(len(self.states))
        for change in changes:
            omega = change.get("omega", self.omega)
            assert omega is not None
            out = np.maximum(out, scale_of(_changed(self.model, change), omega))
        return out

    def drawn(self, change: Mapping[str, float]) -> tuple[MechanicalModel, Array]:
        """The model with these changes, and (states,) units of its flow's states: its own."""
        return _changed(self.model, change), np.ones(len(self.states))

    def family(self, parameter: str) -> Family:
        """One flow for each value of a parameter, the others as they stand."""
        return of_model(self.model, 1.0 if self.omega is None else self.omega, parameter)

    def plane(self, first: str, second: str) -> FlowPlane:
        """One flow for each pair of values of two parameters, the others as they stand."""

        def build(a: float, b: float) -> Flow:
            change = {first: a, second: b}
            omega = change.get("omega", self.omega)
            assert omega is not None
            return model_flow(_changed(self.model, change), omega, fast=False)

        def side(name: str) -> Family:
            # Where one may be depends on the other: what stands in the file bounds neither.
            family = self.family(name)
            return family if name == "omega" else replace(family, low=-np.inf, high=np.inf)

        return FlowPlane(side(first), side(second), build)

    def fixed(self, swept: Mapping[str, float | None]) -> dict[str, float | None]:
        """ω and the model's parameters, in the order in which a model file has them; those
        that a title leaves out are there where they are swept."""
        model, ordered = self.model, dict.fromkeys([*self.model.as_dict(), *self.model.parameters])
        left_out = model.idle - swept.keys()
        names = [name for name in ordered if name in model.parameters and name not in left_out]
        return {"omega": self.omega, **{name: model.parameter(name) for name in names}}

    def remarks(self) -> tuple[str, ...]:
        """Which stop there is, where there is one only."""
        stops = self.model.second_order().clearances
        if len(stops) != 1 or len(stops[0].sides) != 1:
            return ()
        return ("upper stop only" if stops[0].upper is not None else "lower stop only",)

    def as_dict(self) -> dict[str, object]:
        """What decides the flow, for hashes and provenance."""
        return {"model": self.model.as_dict(), "omega": self.omega}


def _changed(model: MechanicalModel, change: Mapping[str, float]) -> MechanicalModel:
    return model.changed({name: value for name, value in change.items() if name != "omega"})


def of_model(model: MechanicalModel, omega: float, parameter: str) -> Family:
    """The model at drive frequency omega, with one of its parameters, or omega, free.

    Raises
    ------
    InputError : the parameter is not one of them.
    """
    ranges = {"omega": frequency_range(model), **model.parameters}
    if parameter not in ranges:
        raise InputError(None, "over", parameter, f"one of {', '.join(ranges)}")

    def build(value: float) -> Flow:
        if parameter == "omega":
            return model_flow(model, value, fast=False)
        return model_flow(model.changed({parameter: value}), omega, fast=False)

    return Family(parameter, *ranges[parameter], build)
