"""What a sweep changes: parameters of a model, or the generator's settings of a board."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from designer.deck import Excitation
from designer.design import Design
from designer.errors import InputError
from designer.flow import Flow
from designer.model import Dimensionless
from designer.pipeline import nominal_reduction
from designer.responses import FASTEST, SLOWEST, check_omega, scale_of
from designer.schema import one_of
from designer.steady import Setting
from designer.sweep_tables import ModalBatch
from designer.system import Array, Drive, PiecewiseLinearSystem

MODEL_PARAMETERS = ("omega", "b", "k0", "zeta", "m", "k", "c", "f20")
BOARD_SETTINGS = ("frequency", "omega", "amplitude", "offset")
"""Of the generator: Hz, dimensionless by the design's time scale, V peak, V."""
UNITS = {"frequency": "Hz", "amplitude": "V", "offset": "V", "x": "V", "v": "V", "λ": "1/s"}
"""Of a board, by parameter, and of the two axes and the exponent of a diagram."""


@dataclass
class ModelSubject:
    """A model at drive frequency omega (None: it has to be among the changes).

    parameters : names of what can be swept. states : names. units : by parameter, and by "x", "v"
    and "λ" for the axes of a diagram; none where dimensionless.
    """

    model: Dimensionless
    omega: float | None = None
    parameters: tuple[str, ...] = MODEL_PARAMETERS
    states: tuple[str, ...] = ("x1", "x1'", "x2", "x2'")
    units: Mapping[str, str] = field(default_factory=dict)
    _batch: ModalBatch = field(default_factory=ModalBatch, repr=False)

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
            raise InputError(None, option, value, f"{name}: {error.expected}") from None

    def settings(self, changes: Sequence[Mapping[str, float]]) -> list[Setting]:
        """One for each set of changes, the others as they stand."""
        models, omegas = [], []
        for change in changes:
            models.append(_changed(self.model, change))
            omega = change.get("omega", self.omega)
            assert omega is not None
            omegas.append(float(omega))
        tables = self._batch.tables(models, omegas)
        return [
            Setting(lambda m=m, w=w: _flow(m, w), 2.0 * np.pi / w, t)  # type: ignore[misc]
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

    def as_dict(self) -> dict[str, object]:
        """What decides the flow, for hashes and provenance."""
        return {"model": dict(self.model.__dict__), "omega": self.omega}


class BoardSubject:
    """The nominal board of a design, in volts and seconds, under its generator.

    amplitude [V peak] and offset [V] stand unless they are changed; the design's amplitude for the
    model's clearance by default. frequency [Hz] may be None where it is among the changes.
    """

    parameters = BOARD_SETTINGS

    def __init__(
        self,
        design: Design,
        frequency: float | None = None,
        amplitude: float | None = None,
        offset: float = 0.0,
    ) -> None:
        self.design = design
        self.frequency = frequency
        self.amplitude = design.amplitude() if amplitude is None else amplitude
        self.offset = offset
        self.system: PiecewiseLinearSystem = nominal_reduction(design).system()
        self.states = ("v1", "v2", "v3", "v4")
        self.units: Mapping[str, str] = UNITS

    def check(self, option: str, name: str, value: float) -> None:
        """InputError that names the option, unless the parameter may have this value."""
        if name not in self.parameters:
            raise InputError(None, option, name, one_of(name, self.parameters))
        if not np.isfinite(value):
            raise InputError(None, option, value, "a finite number")
        if name == "omega":
            check_omega(option, value)
        elif name == "frequency":
            scales = self.design.errors.scales
            least, most = scales.frequency(SLOWEST), scales.frequency(FASTEST)
            if not least <= value <= most:
                raise InputError(
                    None, option, value, f"a frequency from {least:.4g} to {most:.4g} Hz"
                )
        elif name == "amplitude" and value <= 0.0:
            raise InputError(None, option, value, "an amplitude > 0 V")

    def settings(self, changes: Sequence[Mapping[str, float]]) -> list[Setting]:
        """One for each set of changes, the others as they stand."""
        out = []
        for change in changes:
            drive = self.excitation(change).drive
            out.append(
                Setting(lambda d=drive: Flow(self.system, d), drive.period)  # type: ignore[misc]
            )
        return out

    def scale(self, changes: Sequence[Mapping[str, float]]) -> Array:
        """(states,) size of the states that starts are drawn from: one for all changes."""
        out = np.zeros(4)
        for change in changes:
            e = self.excitation(change)
            b = self.design.model.b * self.design.amplitude() / e.amplitude
            omega = 2.0 * np.pi * e.frequency * self.design.errors.scales.seconds
            model = replace(self.design.model, b=b)
            out = np.maximum(out, scale_of(model, omega) * self.design.volts(b))
        return out

    def as_dict(self) -> dict[str, object]:
        """What decides the flow, for hashes and provenance. The hash is of the whole circuit: of
        the op-amps' gain, bias currents and limits and the diodes' curves too."""
        circuit = self.design.circuit
        return {
            "board": "nominal",
            "parts": dict(sorted(circuit.values.items())),
            "circuit_sha256": hashlib.sha256(repr(circuit).encode("utf-8")).hexdigest(),
            "frequency": self.frequency,
            "amplitude": self.amplitude,
            "offset": self.offset,
        }

    def excitation(self, change: Mapping[str, float]) -> Excitation:
        """The generator's setting with these changes."""
        frequency = change.get("frequency", self.frequency)
        if "omega" in change:
            frequency = self.design.errors.scales.frequency(change["omega"])
        assert frequency is not None
        return Excitation(
            float(frequency),
            float(change.get("amplitude", self.amplitude)),
            offset=float(change.get("offset", self.offset)),
        )


Subject = ModelSubject | BoardSubject


def _flow(model: Dimensionless, omega: float) -> Flow:
    return Flow(model.second_order().piecewise_linear(), Drive(omega))


def _changed(model: Dimensionless, change: Mapping[str, float]) -> Dimensionless:
    others: dict[str, Any] = {k: v for k, v in change.items() if k != "omega"}
    return replace(model, **others) if others else model
