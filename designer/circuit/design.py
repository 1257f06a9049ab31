"""A finished choice of parts, and what it was chosen for."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from designer.base.arrays import Array
from designer.base.frames import frame, table_html
from designer.circuit.board_values import nominal_board
from designer.circuit.coefficients import CoefficientErrors
from designer.circuit.netlist import Circuit, Excitation
from designer.circuit.reduction import Reduction
from designer.circuit.resistors import Composite, composites_of
from designer.dynamics.drive_shape import SINE, Shape
from designer.dynamics.orbit import Orbit
from designer.dynamics.piecewise_linear import SecondDrive
from designer.model.find_responses import ModelResponse
from designer.model.mechanics import MechanicalModel

if TYPE_CHECKING:
    import pandas as pd

TOLERANCE = 2e-3
"""Relative, of a side condition: two circuits with like errors differ so much in their scales."""


@dataclass(frozen=True)
class Certificate:
    """What is proved of a choice of parts."""

    status: str
    """"optimal" or "bound"."""
    lower_bound: float
    """No choice from this catalogue has a smaller ``max_error`` under the stated conditions."""
    proof: str
    """How the lower bound is known."""


@dataclass(frozen=True)
class ConditionCheck:
    """A side condition on the finished circuit, as verified outside the search."""

    name: str
    """Name of the condition, as in a model file."""
    quantity: str
    """What is limited, with its unit, such as "swing_v"."""
    limit: float
    """The bound."""
    found: float
    """The quantity's value on the finished circuit."""
    where: str = ""
    """The part or section that has it."""
    least: bool = False
    """Whether the bound is from below."""

    @property
    def excess(self) -> float:
        """Found over limit, or limit over found for a bound from below: up to 1 it holds."""
        over, under = (self.limit, self.found) if self.least else (self.found, self.limit)
        return over / under if under > 0.0 else float("inf")

    @property
    def holds(self) -> bool:
        """Whether it is kept, to what the scales of a circuit with errors are known to."""
        return self.excess <= 1.0 + TOLERANCE

    @property
    def at_limit(self) -> bool:
        """Whether it is within 1 % of its bound."""
        return self.excess >= 0.99


@dataclass(frozen=True)
class Design:
    """A finished choice of parts."""

    model: MechanicalModel
    circuit: Circuit
    """The circuit that was chosen."""
    errors: CoefficientErrors
    """Errors of the reduced circuit's coefficients."""
    certificate: Certificate
    """What is proved of the choice."""
    conditions: dict[str, float]
    """Side conditions that were kept, by name, with their values."""
    solver: dict[str, str]
    """What the solver said of each stage."""
    seconds: float
    """Wall time [s]."""
    checks: tuple[ConditionCheck, ...] = ()
    """The conditions as verified on the finished circuit."""
    binding: Mapping[str, float] = field(default_factory=dict)
    """The ``max_error`` that the design would have without a condition, for those that cost
    some."""

    @property
    def composites(self) -> dict[str, Composite]:
        """Resistors NAME that are two parts, NAMEA and NAMEB, and how those are joined."""
        return composites_of(self.circuit)

    @property
    def distinct_values(self) -> int:
        """How many different values the resistors and capacitors have."""
        resistors, capacitors = self.circuit.resistors, self.circuit.capacitors
        return len({r.value for r in resistors}) + len({c.value for c in capacitors})

    def amplitude(
        self, b: float | None = None, omega: float | None = None, channel: int = 0
    ) -> float:
        """Generator amplitude [V peak] that makes the clearance ``b`` (default: the model's) at the
        drive frequency ``omega``, which only the force of a moving ground depends on (default: the
        model's own frequency)."""
        system = self.model.second_order()
        wanted = system.drive_force(system.own_frequency if omega is None else omega, channel)
        gain = self.errors.second_gain if channel else self.errors.drive_gain
        driven = wanted != 0.0
        volts = float(np.exp(np.mean(np.log(wanted[driven] / gain[driven]))))
        return volts * (1.0 if b is None else self.model.b / b)

    def base_per_volt(
        self, b: float | None = None, omega: float | None = None
    ) -> tuple[int, float] | None:
        """The generator's channel that stands for a moving base, and the base's acceleration in
        model units per volt of it, peak for peak; None of a model without one. Arguments : as of
        ``amplitude``; with ideal parts it is the same at every frequency."""
        system = self.model.second_order()
        found = system.ground_channel(system.own_frequency if omega is None else omega)
        if found is None:
            return None
        channel, acceleration = found
        return channel, acceleration / self.amplitude(b, omega, channel)

    def largest_amplitudes(self, responses: Sequence[ModelResponse]) -> list[float]:
        """The largest amplitude [V peak] of each of the generator's channels over these responses;
        without any, that at the model's clearance and own frequency."""
        own = self.model.second_order().own_frequency
        places = [(r.b, r.omega) for r in responses] or [(self.model.b, own)]
        return [
            max(self.amplitude(b, omega, channel) for b, omega in places)
            for channel in range(len(self.drive_shapes))
        ]

    def excitation(self, b: float, omega: float) -> Excitation:
        """The generator's setting at a clearance and a dimensionless frequency."""
        frequency = self.errors.scales.frequency(omega)
        shape, *others = self.model.second_order().drive_shapes(omega)
        amplitude = self.amplitude(b, omega)
        second = SecondDrive(self.amplitude(b, omega, 1), others[0]) if others else None
        return Excitation(frequency, amplitude, shape=shape, second=second)

    @property
    def drive_shapes(self) -> tuple[Shape, ...]:
        """What the voltage of each of the generator's channels is the negative of, over its
        amplitude, at the model's own frequency."""
        system = self.model.second_order()
        return system.drive_shapes(system.own_frequency)

    def parts_table(self) -> pd.DataFrame:
        """The resistors and capacitors as a frame: ``name``, ``value``, ``unit``, ``role``."""
        return frame(self._parts(), ("name", "value", "unit", "role"))

    def _parts(self) -> list[dict[str, Any]]:
        kinds = ((self.circuit.resistors, "Ω"), (self.circuit.capacitors, "F"))
        return [
            {"name": part.name, "value": part.value, "unit": unit, "role": part.role}
            for parts, unit in kinds
            for part in parts
        ]

    def _repr_html_(self) -> str:
        note = f"largest coefficient error {self.errors.max_error:.3g}, {self.certificate.status}"
        return table_html("Parts", self._parts(), note)

    @property
    def moving(self) -> int:
        """Index of the displacement in the first clearance, or of the first one."""
        system = self.model.second_order()
        return 2 * system.dead_zones[0].mass if system.clearances else 0

    def impact_volts(self, orbit: Orbit, volts: Array) -> Array:
        """(k,) volts per unit of the model's velocity at each impact of a board's orbit, by its
        clearance. volts (states,) : ``volts``."""
        return self._clearance_volts(volts[1::2])[orbit.impact_clearances]

    def _clearance_volts(self, volts: Array) -> Array:
        """(clearances,) volts per unit in each clearance, of its first mass and the amplifier
        before its stage. volts (masses,) : per unit of each mass."""
        system = self.model.second_order()
        count = len(system.clearances)
        masses = [zone.mass for zone in system.dead_zones[:count]]
        pairs = zip(system.clearances, masses, strict=True)
        factors = [dict(stop.terms)[mass] for stop, mass in pairs]
        return np.asarray(self.dead_zone_gains[:count] * volts[masses] / np.array(factors))

    @cached_property
    def dead_zone_gains(self) -> Array:
        """(dead zones,) volts of the displacement in each per volt of its first mass's: the gain
        of the amplifier that sums displacements, 1 without one."""
        reduction = Reduction(self.circuit, nominal_board(self.circuit, ideal=True))
        solved = reduction.solution(self.circuit.open)
        gains = []
        for zone in self.circuit.dead_zones:
            place = self.circuit.states.index(zone.state)
            net, sign = zone.difference or (self.circuit.state_nets[place], 1)
            gains.append(sign * float(solved.voltage[net][place]))
        return np.array(gains)

    def thresholds(self, number: int) -> dict[int, float]:
        """The displacement [V] at which contact begins, by side (1 upper, -1 lower), as a distance
        from rest; negative where the stop is in contact at rest. On the scale of the first mass.

        number : index of the clearance.
        """
        scales, clearance = self.errors.scales, self.model.second_order().dead_zones[number]
        volts = float(scales.volts[2 * clearance.mass])
        realised = {}
        for side, stop in clearance.sides:
            key = f"gap {clearance.name} {'upper' if side > 0 else 'lower'}"
            realised[side] = stop.gap * volts * math.exp(self.errors.errors.get(key, 0.0))
        if number == 0:
            stated = {1: scales.threshold, -1: scales.threshold_lower}
            realised |= {side: stated[side] for side in realised}
        return realised

    def in_model_units(self, orbit: Orbit, volts: Array) -> Orbit:
        """An orbit of a board, in volts and seconds, in model units. volts : as of ``volts``."""
        seconds, graze, spans = self.errors.scales.seconds, orbit.graze, orbit.spans
        speeds = orbit.speeds
        if len(graze):
            graze = graze / self._clearance_volts(volts[0::2])[:, None]
        if len(spans):
            spans = spans / self._clearance_volts(volts[0::2])[:, None]
        if len(speeds):
            speeds = speeds / self._clearance_volts(volts[1::2])[:, None]
        return replace(
            orbit,
            start=orbit.start / volts if len(orbit.start) else orbit.start,
            extremes=orbit.extremes / volts[:, None] if len(orbit.extremes) else orbit.extremes,
            spans=spans,
            speeds=speeds,
            impact_times=orbit.impact_times / seconds,
            impact_velocities=orbit.impact_velocities / self.impact_volts(orbit, volts),
            lyapunov=orbit.lyapunov * seconds,
            lyapunov_error=orbit.lyapunov_error * seconds,
            frequencies=tuple(w * seconds for w in orbit.frequencies),
            graze=graze,
        )

    def volts(self, b: float | None = None) -> Array:
        """(states,) volts per unit of each model state at clearance ``b``."""
        return self.errors.scales.volts * (1.0 if b is None else self.model.b / b)


@dataclass(frozen=True)
class GeneratorSetting:
    """The generator's setting for one response."""

    omega: float
    """Dimensionless frequency."""
    expect: str | None
    """The wanted n-p-q; None where any is of interest."""
    frequency_hz: float
    """Frequency [Hz]."""
    amplitude_v_peak: float
    """Peak amplitude into a high impedance [V]."""
    offset_v: float = 0.0
    """DC offset [V]."""
    shape: Shape = SINE
    """As of ``Excitation``."""
    second: SecondDrive | None = None
    """As of ``Excitation``."""
    base: tuple[int, float] | None = None
    """As of ``Design.base_per_volt``."""

    @property
    def excitation(self) -> Excitation:
        """The generator's setting without the response that it is for."""
        amplitude, offset = self.amplitude_v_peak, self.offset_v
        return Excitation(self.frequency_hz, amplitude, offset, self.shape, self.second)


def settings(design: Design, responses: Sequence[ModelResponse]) -> tuple[GeneratorSetting, ...]:
    """The generator's settings, in the order of the responses."""
    out = []
    for r in responses:
        to = design.excitation(r.b, r.omega)
        stated = r.omega, r.expected, to.frequency, to.amplitude
        base = design.base_per_volt(r.b, r.omega)
        out.append(GeneratorSetting(*stated, shape=to.shape, second=to.second, base=base))
    return tuple(out)
