"""One pass from limits to a circuit: linear block, inverters, dead zone, drive.

Nothing is verified and nothing repeated here; ``synthesis.parts_choice`` does both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from designer.base.arrays import Array
from designer.catalog.entries import Kind, OpAmp
from designer.catalog.output_stage import OutputStage, output_at
from designer.catalog.parts_catalog import Catalog
from designer.circuit import build
from designer.circuit.coefficients import CoefficientErrors, CutShort, coefficient_errors
from designer.circuit.dead_zone_parts import DeadZoneStage, dead_zone_stage
from designer.circuit.netlist import Circuit
from designer.circuit.resistors import Composite
from designer.circuit.terms import entry_resistor
from designer.linear_network import linear_search
from designer.linear_network.linear_terms import LinearBlock, LinearQuestion, Shortfall, Targets
from designer.model.circuit_table import CircuitSpec
from designer.model.find_responses import ModelResponse, Peaks
from designer.model.mechanics import MechanicalModel
from designer.synthesis import all_stages
from designer.synthesis.all_stages import StageQuestion
from designer.synthesis.dead_zone_target import DeadZone
from designer.synthesis.equal_parts import equal_parts
from designer.synthesis.limits import GENERATOR_PEAK, NO_AIMS, Aims, ConditionLimits
from designer.synthesis.part_checks import (
    buyable,
    drive_resistors,
    equal_resistors,
    nearest,
    unit_circuit,
)

BASE = 1e4
"""Resistors that only set a level (inverters, inputs of the gain stages) [ohm]."""
LEAST_SHARE = 0.2
"""Of the largest amplitude: below it a generator's resolution and noise begin to count."""


@dataclass(frozen=True)
class Order:
    """What is to be built, and from what."""

    model: MechanicalModel
    spec: CircuitSpec
    """What the circuit is to be made of."""
    opamp: OpAmp
    """The op-amp that it is built with."""
    output: OutputStage
    """How far the outputs of the op-amps reach."""
    stage: DeadZoneStage
    """The stage that makes the dead zone."""
    peaks: Peaks
    """What the circuit has to hold."""
    resistors: Array
    """Resistances that can be bought [ohm], ascending."""
    capacitors: Array
    """Capacitances that can be bought [F], ascending."""
    prices: Array
    """Price class of each capacitance."""
    resistor_prices: Mapping[float, float]
    """Price class by resistance."""
    levels: tuple[frozenset[str], ...]
    """Groups of equal resistors that only set a level: those of each inverter and sum."""
    drives: tuple[tuple[str, ...], ...]
    """For each of the generator's channels the names of its resistors, one for each mass that it
    drives."""
    largest: tuple[float, ...]
    """For each the largest of its amplitudes, over that at the model's clearance."""
    drive_force: float = 1.0
    """``least_drive`` of the wanted responses."""
    temperatures: tuple[float, float] | None = None
    """``Catalog.temperatures``."""
    aims: Aims = NO_AIMS
    """What is aimed at inside the side conditions."""

    @classmethod
    def of(
        cls,
        model: MechanicalModel,
        spec: CircuitSpec,
        catalog: Catalog,
        peaks: Peaks,
        *,
        largest: tuple[float, ...] = (1.0,),
        drive_force: float = 1.0,
        aims: Aims = NO_AIMS,
        apart: frozenset[int] = frozenset(),
    ) -> Order:
        """What the model file asks for, with what the catalogue has for it.

        apart : ``DeadZoneStage.apart``.

        Raises
        ------
        InputError : an unknown part of the catalogue.
        Unreachable : no value of the series can be bought.
        """
        opamp = catalog.opamp(spec.opamp)
        stage = dead_zone_stage(model, spec, catalog)
        stage = replace(stage, apart=stage.apart | apart)
        unit = unit_circuit(model, spec, catalog, stage)
        resistors = buyable("resistor", spec, catalog)
        capacitors = buyable("capacitor", spec, catalog)

        def price(kind: Kind, value: float, grade: float) -> float:
            return float(catalog.part(kind, value, grade).price)

        return cls(
            model=model,
            spec=spec,
            opamp=opamp,
            output=output_at(opamp, spec.supply, spec.saturation),
            stage=stage,
            peaks=peaks,
            resistors=resistors,
            capacitors=capacitors,
            prices=np.array(
                [price("capacitor", v, spec.capacitor_grade) for v in capacitors.tolist()]
            ),
            resistor_prices={
                v: price("resistor", v, spec.resistor_grade) for v in resistors.tolist()
            },
            levels=equal_resistors(unit),
            drives=tuple(drive_resistors(unit, k) for k in range(len(unit.generators))),
            largest=largest,
            drive_force=drive_force,
            temperatures=catalog.temperatures,
            aims=aims,
        )

    @cached_property
    def bounds(self) -> OpAmp:
        """The op-amp with the bounds that hold at every temperature of the boards."""
        return self.opamp.over(self.temperatures)

    @property
    def stiffness(self) -> str:
        """Name of the resistor of the stiffness of the first stop's mass by itself (R4)."""
        system = self.model.second_order()
        mass = system.dead_zones[0].mass if system.dead_zones else 0
        return entry_resistor(system.size, 2 * mass + 1, 2 * mass)

    @property
    def lead(self) -> int:
        """Index of the state that the first dead zone watches, whose signal counts."""
        zones = self.model.second_order().dead_zones
        return zones[0].watched if zones else 0

    def build(
        self, values: Mapping[str, float], composites: Mapping[str, Composite] | None = None
    ) -> Circuit:
        """The circuit of these values."""
        return build.circuit_of(
            self.model,
            values,
            self.opamp,
            supply=self.spec.supply,
            saturation=self.spec.saturation,
            stage=self.stage,
            composites=composites or {},
        )

    def errors(self, circuit: Circuit, swing: float) -> CoefficientErrors:
        """Errors of the circuit; without a gap ``swing`` [V] sets the amplitude."""
        aim = swing, self.peaks.states
        return coefficient_errors(circuit, self.model.second_order(), swing=aim)


@dataclass(frozen=True)
class Attempt:
    """Chosen values, the circuit that they make, and what each search said."""

    values: dict[str, float]
    """The chosen values by part [ohm, F]."""
    circuit: Circuit
    """The circuit that they make."""
    errors: CoefficientErrors
    linear: LinearBlock
    """What the search of the linear block said."""
    dead_zone: DeadZone | None
    """What the search of the dead-zone stage said; None where there is no such stage."""

    @property
    def solver(self) -> dict[str, str]:
        """What the solver said of each block."""
        words = {"linear block": self.linear.solver}
        return words if self.dead_zone is None else words | {"dead zone": self.dead_zone.solver}

    def distinct_values(self, preferred: tuple[float, ...]) -> int:
        """How many different values it has, apart from those that are preferred."""
        return len(set(self.circuit.values.values()) - set(preferred))


def linear_block(
    order: Order,
    limits: ConditionLimits,
    *,
    most_values: int | None = None,
    between: tuple[float, float] = (0.0, np.inf),
    level: float | None = None,
    empty: float = 0.0,
) -> LinearBlock | Shortfall:
    """The linear block within these limits, or what leaves none.

    most_values : its share of the limit on distinct values. between : range of the resistor of
    ``Order.stiffness`` [ohm]. level : the one level of error to search, if not all. empty : a level
    at which wider limits leave nothing.
    """
    asked = linear_question(order, limits, most_values=most_values, between=between)
    return linear_search.best(
        asked.targets,
        asked.resistors,
        asked.capacitors,
        asked.prices,
        asked.bounds,
        asked.spec,
        level,
        empty,
    )


def linear_question(
    order: Order,
    limits: ConditionLimits,
    *,
    most_values: int | None = None,
    between: tuple[float, float] = (0.0, np.inf),
) -> LinearQuestion:
    """What is asked of the linear block within these limits; of all resistors, those outside the
    range of the side condition too. most_values, between : as of ``linear_block``."""
    system = order.model.second_order()
    mu = max((system.relative_stiffness(stop) for stop in system.dead_zones), default=0.0)
    mass = system.dead_zones[0].mass if system.dead_zones else 0
    bounds = limits.bounds(mu, order.peaks, order.resistors, mass)
    bounds = replace(bounds, stop=max(bounds.stop, between[0]), stop_most=between[1])
    return LinearQuestion(
        Targets.of(order.model),
        order.resistors,
        order.capacitors,
        order.prices,
        bounds,
        replace(order.spec, most_values=most_values),
    )


def attempt(
    order: Order, limits: ConditionLimits, linear: LinearBlock, *, thrifty: bool = False
) -> Attempt | Shortfall:
    """A circuit with this linear block within these limits, or what leaves none.

    thrifty : take values that the linear block has for whatever only sets a level.
    """
    values = _bought(order, linear.values)
    inverters = _inverters(order, limits, values, thrifty)
    if isinstance(inverters, Shortfall):
        return inverters
    values |= inverters
    sized = all_stages.size(_question(order, limits), values)
    if isinstance(sized, str):
        return Shortfall(sized, False)  # of this linear block; another may have room for the stages
    return _driven(order, limits, linear, sized, values, thrifty)


def completed(
    order: Order, limits: ConditionLimits, linear: LinearBlock, stages: DeadZone | None
) -> Attempt | Shortfall:
    """A circuit with this linear block and these stages, whose resistors that only set a level are
    still to be chosen; or what leaves none."""
    values = _bought(order, linear.values)
    inverters = _inverters(order, limits, values, thrifty=False)
    if isinstance(inverters, Shortfall):
        return inverters
    values |= inverters
    if stages is not None:
        own = _bought(order, stages.values)
        whole = all_stages.with_levels(_question(order, limits), values, own)
        if isinstance(whole, str):
            return Shortfall(whole, False)
        stages = replace(stages, values=whole)
    return _driven(order, limits, linear, stages, values, thrifty=False)


def _bought(order: Order, values: Mapping[str, float]) -> dict[str, float]:
    """Chosen values as the catalogue has them."""
    return {
        name: nearest(order.resistors if name.startswith("R") else order.capacitors, value)
        for name, value in values.items()
    }


def _driven(
    order: Order,
    limits: ConditionLimits,
    linear: LinearBlock,
    stages: DeadZone | None,
    values: Mapping[str, float],
    thrifty: bool,
) -> Attempt | Shortfall:
    """The circuit with its drive. values : of all but the stages and the drive."""
    values = {**values, **(stages.values if stages is not None else {})}
    try:
        drive = _drive(order, limits, values, thrifty)
        if isinstance(drive, Shortfall):
            return drive
        values |= drive
        circuit = order.build(values)
        errors = order.errors(circuit, limits.swing)
    except CutShort:  # an output that is meant to be linear is not, within the clearance
        return Shortfall("swing", False)
    return Attempt(dict(values), circuit, errors, linear, stages)


def _question(order: Order, limits: ConditionLimits) -> StageQuestion:
    return StageQuestion(
        model=order.model,
        stage=order.stage,
        limits=limits,
        peaks=order.peaks,
        output=order.output,
        spec=order.spec,
        resistors=order.resistors,
        base=nearest(order.resistors, BASE),
        prices=order.resistor_prices,
    )


def _inverters(
    order: Order, limits: ConditionLimits, values: Mapping[str, float], thrifty: bool
) -> dict[str, float] | Shortfall:
    """The inverters' resistors, and those of sums: one value for all, but where a matched group
    says otherwise."""
    light = order.resistors[order.resistors >= limits.load]
    if len(light) == 0:
        return Shortfall("load", True)
    base = nearest(light, BASE)
    if thrifty:
        least = max(limits.load, float(order.resistors[0]))
        known = [v for n, v in values.items() if n.startswith("R") and v >= least]
        base = nearest(np.array(known or [base]), base)
    out = dict.fromkeys(sorted(frozenset().union(*order.levels)), base)
    for group in order.spec.matched:
        given = {values[name] for name in group if name in values}
        for equal in order.levels:
            if not equal & set(group):
                continue
            if len(given) > 1:
                return Shortfall("matched parts", False)
            for value in given:
                out |= dict.fromkeys(sorted(equal), value)
    return out


def _drive(
    order: Order, limits: ConditionLimits, values: Mapping[str, float], thrifty: bool
) -> dict[str, float] | Shortfall:
    """The resistors that make the forces with the generator's amplitudes: the forces' ratios as
    exact as can be, the amplitudes up to what a generator gives."""
    out: dict[str, float] = {}
    for channel, names in enumerate(order.drives):
        own = _drive_of(order, limits, {**values, **out}, names, channel, thrifty=thrifty)
        if isinstance(own, Shortfall):
            return own
        out |= own
    return out


def _drive_of(
    order: Order,
    limits: ConditionLimits,
    values: Mapping[str, float],
    names: tuple[str, ...],
    channel: int,
    *,
    thrifty: bool,
) -> dict[str, float] | Shortfall:
    """Those of one channel."""
    if not names:
        return {}
    equal = equal_parts(names, order.spec.matched, values)
    if equal is None:
        return Shortfall("matched parts", False)
    volts = _volts_per_ohm(order, limits, values, channel)
    roots = [equal.of(name) for name in names]
    lists = {
        root: np.array([equal.value[root]]) if root in equal.value else order.resistors
        for root in roots
    }
    aim = GENERATOR_PEAK / order.largest[channel]
    if len(names) > 1:
        return dict(zip(names, _in_ratio(volts, roots, lists, aim), strict=True))
    own = lists[roots[0]]
    within = own[volts[0] * own <= aim]
    top = float(within[-1]) if len(within) else float(own[0])
    # A value that the circuit has already is taken where the amplitude stays large enough.
    least = LEAST_SHARE if thrifty else 0.5
    known = [v for n, v in values.items() if n.startswith("R") and v in own]
    return {names[0]: max((v for v in known if least * top <= v <= top), default=top)}


def _volts_per_ohm(
    order: Order, limits: ConditionLimits, values: Mapping[str, float], channel: int
) -> Array:
    """(driven,) generator volts [V peak] that each mass driven by a channel needs for each ohm."""
    # They do not enter the coefficients, so any value will do to find what they need.
    placeholder = float(order.resistors[-1])
    every = dict.fromkeys([name for names in order.drives for name in names], placeholder)
    trial = order.build({**values, **every})
    errors = order.errors(trial, limits.swing)
    system = order.model.second_order()
    wanted = system.drive_force(system.own_frequency, channel)
    gain = errors.second_gain if channel else errors.drive_gain
    driven = wanted != 0.0
    return np.asarray(wanted[driven] / (gain[driven] * placeholder))


def largest_amplitudes(
    model: MechanicalModel, responses: Sequence[ModelResponse]
) -> tuple[float, ...]:
    """For each of the generator's channels its largest amplitude of the responses over that at the
    model's clearance and own frequency; a moving ground's force follows the drive frequency."""
    system = model.second_order()
    largest = []
    for channel in range(len(system.drive_shapes(system.own_frequency))):
        own = system.drive_force(system.own_frequency, channel)
        ratios = [
            model.b / r.b * system.drive_force(r.omega, channel)[own != 0.0] / own[own != 0.0]
            for r in responses
        ]
        largest.append(max((float(each.max(initial=0.0)) for each in ratios), default=1.0))
    return tuple(largest)


def _in_ratio(
    volts: Array, roots: Sequence[str], lists: Mapping[str, Array], aim: float
) -> list[float]:
    """The resistors whose volts differ least in ratio, of those the largest amplitude to ``aim``.

    volts : that each needs for each ohm. roots : resistors with the same are equal. For every
    largest volt that a choice can have, the others come as near below it as they can.
    """
    own = {root: np.log(volts[[r == root for r in roots]]) for root in lists}
    largest = np.unique(np.concatenate([np.log(lists[r]) + own[r].max() for r in lists]))
    place = {
        root: np.searchsorted(np.log(lists[root]) + own[root].max(), largest + 1e-12, "right") - 1
        for root in lists
    }
    possible = np.all([place[root] >= 0 for root in lists], axis=0)
    largest = largest[possible]
    chosen = {root: lists[root][place[root][possible]] for root in lists}
    needed = np.log(volts)[:, None] + np.log([chosen[root] for root in roots])
    off = largest - needed.min(axis=0)
    amplitude = np.exp(needed.mean(axis=0))  # as ``Design.amplitude`` sets it
    good = (amplitude <= aim) & (amplitude >= LEAST_SHARE * aim)
    good = good if good.any() else np.ones(len(off), dtype=bool)
    best = np.flatnonzero(good)[np.lexsort((-amplitude[good], np.round(off[good], 9)))[0]]
    return [float(chosen[root][best]) for root in roots]
