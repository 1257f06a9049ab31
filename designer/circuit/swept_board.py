"""What a sweep changes: parameters of a model, or the generator's settings of a board."""

from __future__ import annotations

import hashlib
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain

import numpy as np

from designer.base.arrays import Array
from designer.base.errors import InputError
from designer.base.schema import GREATEST, SMALLEST, one_of
from designer.base.si_unit import Unit
from designer.bifurcations.flow_family import Family, FlowPlane
from designer.bifurcations.subject import ShownStop
from designer.circuit.board_values import Board
from designer.circuit.coefficients import coefficient_errors
from designer.circuit.design import Design
from designer.circuit.netlist import Excitation
from designer.circuit.nominal import nominal_reduction
from designer.dynamics.drive_shape import SINE
from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import ForceCorner, Mode, ModeKey, PiecewiseLinearSystem
from designer.dynamics.steady_state import UPPER, DrivenSystem
from designer.model.find_responses import scale_of
from designer.model.mechanics import (
    MechanicalModel,
    SecondOrderSystem,
    check_omega,
    frequency_range,
)
from designer.model.relative_motion import shown_stops, subscripted
from designer.model.si_units import NO_UNITS

SETTINGS = {
    "frequency": (SMALLEST, GREATEST),
    "amplitude": (0.0, GREATEST),
    "offset": (-GREATEST, GREATEST),
}
"""The generator's settings with their ranges: Hz, V peak, V."""
UNITS = {"frequency": "Hz", "amplitude": "V", "offset": "V", "x": "V", "v": "V", "λ": "1/s"}
"""The units of a board's parameters, and of the two axes and the exponent of a diagram."""
ROUNDING = 1e-9
"""Relative: what a corner's place may be off that a dead zone of another mass's units has."""


class BoardSubject:
    """The nominal board of a design, in volts and seconds, under its generator.

    amplitude [V peak] and offset [V] stand unless they are changed; the design's amplitude for the
    model's clearance by default. frequency [Hz] may be None where it is among the changes.
    """

    name = "nominal board"
    parameters = ("frequency", "omega", "amplitude", "offset")
    """ω is the frequency by the design's time scale."""
    si: Mapping[str, Unit] = NO_UNITS
    labels: Mapping[str, str] = {}

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
        self.system = _with_corners(nominal_reduction(design).system(), design)
        self.states = design.circuit.state_nets
        self.weights = np.ones(len(self.states))
        self.units: Mapping[str, str] = UNITS

    @property
    def stops(self) -> tuple[ShownStop, ...]:
        """The stops of ``shown_stops``, by the names of several clearances."""
        model = self.design.model.second_order()
        shown, several = shown_stops(model) or UPPER, len(model.clearances) > 1
        return tuple(self._stop(model, k, side, several=several) for k, side in shown)

    @staticmethod
    def _stop(model: SecondOrderSystem, index: int, side: int, *, several: bool) -> ShownStop:
        word, number = ("upper", "A1") if side > 0 else ("lower", "A2")
        if not model.clearances:
            return ShownStop(index, side, f"the {word} stop ({number})", "v₂")
        clearance = model.clearances[index]
        place = clearance.name if several else number
        name = f"the {word} stop of {place}" if several else f"the {word} stop ({place})"
        masses = [mass for mass, _ in clearance.terms]
        velocity = " − ".join(subscripted(f"v{2 * mass + 2}") for mass in masses)
        if clearance.combination:
            velocity = f"the speed in {clearance.name}"
        return ShownStop(index, side, name, velocity)

    def check(self, option: str, name: str, value: float) -> None:
        """InputError that names the option, unless the parameter may have this value."""
        if name not in self.parameters:
            raise InputError(None, option, name, one_of(name, self.parameters))
        if not np.isfinite(value):
            raise InputError(None, option, value, "a finite number")
        if name == "omega":
            check_omega(option, value, self.design.model)
        elif name == "frequency":
            slowest, fastest = frequency_range(self.design.model)
            scales = self.design.errors.scales
            least, most = scales.frequency(slowest), scales.frequency(fastest)
            if not least <= value <= most:
                raise InputError(
                    None, option, value, f"a frequency from {least:.4g} to {most:.4g} Hz"
                )
        elif name == "amplitude" and value <= 0.0:
            raise InputError(None, option, value, "an amplitude > 0 V")

    def settings(self, changes: Sequence[Mapping[str, float]]) -> list[DrivenSystem]:
        """One for each set of changes, the others as they stand."""
        drives = [self.excitation(change).drive for change in changes]
        stops = tuple((stop.clearance, stop.side) for stop in self.stops)
        return [DrivenSystem(partial(Flow, self.system, d), d.period, None, stops) for d in drives]

    def scale(self, changes: Sequence[Mapping[str, float]]) -> Array:
        """(states,) size of the states that starts are drawn from: one for all changes."""
        out = np.zeros(len(self.states))
        for change in changes:
            model, volts = self.drawn(change)
            out = np.maximum(out, scale_of(model, self._omega(change)) * volts)
        return out

    def drawn(self, change: Mapping[str, float]) -> tuple[MechanicalModel, Array]:
        """The model whose motion the board shows at a setting, and (states,) volts per unit of each
        of its states."""
        volts = self.design.amplitude(omega=self._omega(change))
        b = self.design.model.b * volts / self.excitation(change).amplitude
        return self.design.model.at(b), self.design.volts(b)

    def _omega(self, change: Mapping[str, float]) -> float:
        seconds = self.design.errors.scales.seconds
        return 2.0 * np.pi * self.excitation(change).frequency * seconds

    def family(self, parameter: str) -> Family:
        """One flow for each value of a setting, the others as they stand."""
        frequency = self.design.errors.scales.frequency
        if parameter == "omega":
            return Family("omega", 0.0, GREATEST, lambda w: self._flow({"frequency": frequency(w)}))
        own = self.design.model.second_order().own_frequency
        own_frequency = {"frequency": frequency(own)} if self.frequency is None else {}
        return Family(
            parameter,
            *SETTINGS[parameter],
            lambda value: self._flow({**own_frequency, parameter: value}),
        )

    def plane(self, first: str, second: str) -> FlowPlane:
        """One flow for each pair of values of two settings, the others as they stand."""
        return FlowPlane(
            self.family(first),
            self.family(second),
            lambda a, b: self._flow({first: a, second: b}),
        )

    def _flow(self, change: Mapping[str, float]) -> Flow:
        return Flow(self.system, self.excitation(change).drive, fast=False)

    def fixed(self, swept: Mapping[str, float | None]) -> dict[str, float | None]:
        """The generator's settings; no frequency where ω is swept."""
        return {
            "frequency": None if "omega" in swept else self.frequency,
            "amplitude": self.amplitude,
            "offset": self.offset,
        }

    def remarks(self) -> tuple[str, ...]:
        """Nothing: the design's own files say what it is."""
        return ()

    def as_dict(self) -> dict[str, object]:
        """What decides the flow, for hashes and provenance. The hash is of the whole circuit: of
        the op-amps' gain, bias currents and limits and the diodes' curves too."""
        circuit, load = self.design.circuit, self.design.circuit.saturation_load
        text = repr(circuit) + (repr(load) if load is not None else "")
        shapes = self.design.drive_shapes
        return {
            "board": "nominal",
            "parts": dict(sorted(circuit.values.items())),
            "circuit_sha256": hashlib.sha256(text.encode("utf-8")).hexdigest(),
            "frequency": self.frequency,
            "amplitude": self.amplitude,
            "offset": self.offset,
            **({} if shapes == (SINE,) else {"shapes": shapes, "ratio": self._ratio}),
        }

    @property
    def _ratio(self) -> float:
        """The second channel's amplitude over the first one's at the model's own frequency; 0
        without a second channel."""
        design = self.design
        first, *others = (design.amplitude(channel=k) for k in range(len(design.drive_shapes)))
        return others[0] / first if others else 0.0

    def setting_ratios(self, boards: Iterable[Board]) -> dict[str, Array]:
        """(boards,) by setting, its value on the nominal board over that on each board, at which
        both move alike: by time scale, and drive over threshold, of the coefficient error's best
        scales. What else differs no setting makes up for.

        Boards on which a coefficient has the wrong sign, or an op-amp clips inside the clearance,
        are left out.
        """
        design, model = self.design, self.design.model.second_order()
        seconds, volts = list[float](), list[float]()
        for board in boards:
            try:
                errors = coefficient_errors(design.circuit, model, board)
            except ArithmeticError:
                continue
            seconds.append(errors.scales.seconds / design.errors.scales.seconds)
            volts.append(design.amplitude() / replace(design, errors=errors).amplitude())
        slower = np.array(seconds)
        return {"frequency": slower, "omega": slower, "amplitude": np.array(volts)}

    def excitation(self, change: Mapping[str, float]) -> Excitation:
        """The generator's setting with these changes."""
        frequency = change.get("frequency", self.frequency)
        if "omega" in change:
            frequency = self.design.errors.scales.frequency(change["omega"])
        assert frequency is not None
        omega = 2.0 * np.pi * float(frequency) * self.design.errors.scales.seconds
        amplitude = float(change.get("amplitude", self.amplitude))
        # The second channel keeps the ratio that it has to the first at this frequency.
        own = self.design.excitation(self.design.model.b, omega)
        return replace(
            own.louder(amplitude / own.amplitude),
            frequency=float(frequency),
            amplitude=amplitude,
            offset=float(change.get("offset", self.offset)),
        )


def _with_corners(system: PiecewiseLinearSystem, design: Design) -> PiecewiseLinearSystem:
    """The nominal board, its guards at corners of the model's laws marked as those of the model."""
    corners = _corners(design)

    def at(key: ModeKey, target: ModeKey) -> ForceCorner | None:
        turned = set(enumerate(key)) ^ set(enumerate(target))
        return next((corners[each] for each in turned if each in corners), None)

    def build(key: ModeKey) -> Mode:
        mode = system.mode(key)
        return replace(
            mode, guards=tuple(replace(g, corner=at(key, g.target)) for g in mode.guards)
        )

    return replace(system, build=build, _modes={}) if corners else system


def _corners(design: Design) -> dict[tuple[int, int], ForceCorner]:
    """By the switch with which a dead zone begins, its number and its position in contact; places
    as the model has them."""
    model, circuit = design.model.second_order(), design.circuit
    laws = {law.name: (np.array(law.row), law.corners) for law in model.laws if not law.curved}
    risen = {
        clearance.name: (
            model.displacement(clearance),
            tuple(side * (s.gap + s.rise) for side, s in clearance.sides if s.rise),
        )
        for clearance in model.clearances
    }
    found = dict[tuple[int, int], ForceCorner]()
    carrying = defaultdict[tuple[str, int], list[tuple[float, list[tuple[int, int]]]]](list)
    for zone, stop in zip(model.dead_zones, circuit.dead_zones, strict=True):
        row, places = (laws | risen).get(zone.bend_of, (np.zeros(0), ()))
        ends = dict(zone.sides)
        for side, contact in stop.contacts:
            switches = ((contact.switch, contact.position), *contact.others)
            own = [(circuit.switches.index(name), position) for name, position in switches]
            gap, stages = ends[side].gap, carrying[stop.bend_of or stop.clearance, side]
            stages.append((gap, own))
            place = side * gap * float(row[zone.mass]) if places else 0.0
            if np.isclose(place, places, rtol=ROUNDING, atol=0.0).any():
                # Two stages may share a corner: then neither knows which one is met first.
                met = (each for at, each in stages if at < gap * (1.0 - ROUNDING))
                before = tuple(chain.from_iterable(met))
                still = tuple((i, circuit.open[i]) for i, _ in own)
                corner = ForceCorner(place, zone.bend_of, (*before, *still), (*before, *own))
                found[own[0]] = corner
    return found
