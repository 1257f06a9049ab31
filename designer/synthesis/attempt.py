"""One pass from limits to a circuit: linear block, inverters, dead zone, drive.

Nothing is verified and nothing repeated here; ``synthesis.parts_choice`` does both.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from designer.base.arrays import Array
from designer.catalog.catalog import Catalog
from designer.catalog.diode_curve import diode_model
from designer.catalog.entries import Kind, OpAmp
from designer.circuit import build as topology, drive_resistors
from designer.circuit.coefficients import CoefficientErrors, CutShort, coefficient_errors
from designer.circuit.dead_zone_kind import Zone, zone_of
from designer.circuit.netlist import Circuit
from designer.circuit.resistors import Composite
from designer.circuit.terms import Term
from designer.model.circuit_table import CircuitSpec
from designer.model.find_responses import Peaks
from designer.model.model import Dimensionless
from designer.synthesis import linear_search, nonlinear_block, size_dead_zone
from designer.synthesis.dead_zone_target import DeadZone
from designer.synthesis.limits import GENERATOR_PEAK, NO_AIMS, Aims, ConditionLimits
from designer.synthesis.linear_block import Targets
from designer.synthesis.linear_search import LinearBlock
from designer.synthesis.nonlinear_block import StageRoom
from designer.synthesis.part_names import levels, parts_of, terms_of
from designer.synthesis.preferences import Wishes
from designer.synthesis.tie_break import Shortfall

BASE = 1e4
"""Resistors that only set a level (inverters, inputs of the gain stages) [ohm]."""
REFERENCE_MARGIN = 1.5
"""Between a reference's current and the ends of the range in which it regulates."""


@dataclass(frozen=True)
class Order:
    """What is to be built, and from what."""

    model: Dimensionless
    """The wanted model."""
    spec: CircuitSpec
    """What the circuit is to be made of."""
    opamp: OpAmp
    """The op-amp that it is built with."""
    saturation: float
    """Output limit of the op-amps, ± [V]."""
    zone: Zone
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
    terms: tuple[Term, ...]
    """Terms of the model's equations."""
    parts: Circuit
    """The model's circuit with every value 1."""
    largest: float
    """Largest of the generator's amplitudes, over that at the model's clearance."""
    aims: Aims = NO_AIMS
    """What is aimed at inside the side conditions."""

    @property
    def base(self) -> float:
        return nearest(self.resistors, BASE)

    def build(
        self, values: Mapping[str, float], composites: Mapping[str, Composite] | None = None
    ) -> Circuit:
        """The circuit of these values."""
        return topology.build(
            self.terms,
            values,
            self.opamp,
            supply=self.spec.supply,
            saturation=self.saturation,
            clearance="A" if self.model.k0 > 0.0 else None,
            zone=self.zone,
            composites=composites or {},
        )

    def errors(self, circuit: Circuit, swing: float) -> CoefficientErrors:
        """Errors of the circuit; without a clearance ``swing`` [V] sets the amplitude."""
        aim = None if circuit.stops else (swing, self.peaks.states)
        return coefficient_errors(circuit, self.model.second_order(), swing=aim)


@dataclass(frozen=True)
class Attempt:
    """Chosen values, the circuit that they make, and what each search said."""

    values: dict[str, float]
    """The chosen values by part [ohm, F]."""
    circuit: Circuit
    """The circuit that they make."""
    errors: CoefficientErrors
    """Errors of its coefficients."""
    linear: LinearBlock
    """What the search of the linear block said."""
    zone: DeadZone | None
    """What the search of the dead-zone stage said; None where there is no such stage."""

    @property
    def solver(self) -> dict[str, str]:
        """What the solver said of each block."""
        said = {"linear block": self.linear.solver}
        return said if self.zone is None else said | {"dead zone": self.zone.solver}

    def kinds(self, free: frozenset[float]) -> int:
        """How many different values it has, apart from those that are free."""
        return len(set(self.circuit.values.values()) - free)


def order(
    model: Dimensionless, spec: CircuitSpec, catalog: Catalog, peaks: Peaks, largest: float
) -> Order:
    """What the model file asks for, with what the catalogue has for it.

    Raises
    ------
    InputError : an unknown part of the catalogue.
    Unreachable : no value of the series can be bought.
    """
    opamp = catalog.opamp(spec.opamp)
    zone = zone_of_spec(model, spec, catalog)
    resistors = to_choose_from("resistor", spec, catalog)
    capacitors = to_choose_from("capacitor", spec, catalog)
    prices = [catalog.part("capacitor", v, spec.capacitor_grade).price for v in capacitors.tolist()]
    return Order(
        model=model,
        spec=spec,
        opamp=opamp,
        saturation=spec.saturation or opamp.saturation_at(spec.supply),
        zone=zone,
        peaks=peaks,
        resistors=resistors,
        capacitors=capacitors,
        prices=np.array(prices, dtype=float),
        resistor_prices={
            v: float(catalog.part("resistor", v, spec.resistor_grade).price)
            for v in resistors.tolist()
        },
        terms=terms_of(model),
        parts=parts_of(model, spec, catalog, zone),
        largest=largest,
    )


def to_choose_from(kind: Kind, spec: CircuitSpec, catalog: Catalog) -> Array:
    """Values of the circuit's resistors [ohm] or capacitors [F] that can be bought, ascending.

    Raises
    ------
    Unreachable : there is none.
    """
    if kind == "resistor":
        return catalog.values(kind, spec.resistors, *spec.resistor_range, spec.resistor_grade)
    return catalog.values(kind, spec.capacitors, *spec.capacitor_range, spec.capacitor_grade)


def zone_of_spec(model: Dimensionless, spec: CircuitSpec, catalog: Catalog) -> Zone:
    """The dead-zone stage that a model file asks for."""
    return zone_of(spec.dead_zone, model.sides, catalog, spec.diode, spec.reference)


def linear_block(
    order: Order,
    limits: ConditionLimits,
    wishes: Wishes,
    *,
    between: tuple[float, float] = (0.0, np.inf),
    level: float | None = None,
) -> LinearBlock | Shortfall:
    """The linear block within these limits, or what leaves none.

    between : range of R4 [ohm]. level : the one level of error to search, if not all.
    """
    mu = order.model.mu if order.model.k0 > 0.0 else 0.0
    bounds = limits.bounds(mu, order.peaks, order.resistors)
    return linear_search.best(
        Targets.from_state_matrix(order.model.second_order().state_matrix()),
        order.resistors,
        order.capacitors,
        order.prices,
        replace(bounds, stop=max(bounds.stop, between[0]), stop_most=between[1]),
        wishes,
        level,
    )


def attempt(
    order: Order,
    limits: ConditionLimits,
    wishes: Wishes,
    linear: LinearBlock,
    *,
    thrifty: bool = False,
) -> Attempt | Shortfall:
    """A circuit with this linear block within these limits, or what leaves none.

    thrifty : take values that the linear block has for whatever only sets a level.
    """
    model = order.model
    values = {
        name: nearest(order.resistors if name.startswith("R") else order.capacitors, value)
        for name, value in linear.values.items()
    }
    level = _levels(order, limits, values, thrifty)
    if isinstance(level, Shortfall):
        return level
    values |= level
    zone: DeadZone | None = None
    if model.k0 > 0.0:
        found = _dead_zone(order, limits, wishes, values)
        if isinstance(found, str):
            return Shortfall(found, True)
        zone = found
        values |= zone.values
    try:
        return _driven(order, limits, values, linear, zone, thrifty=thrifty)
    except CutShort:  # an output that is meant to be linear is not, within the clearance
        return Shortfall("swing", False)


def _driven(
    order: Order,
    limits: ConditionLimits,
    values: dict[str, float],
    linear: LinearBlock,
    zone: DeadZone | None,
    *,
    thrifty: bool,
) -> Attempt | Shortfall:
    """The attempt with the drive's resistors, and the errors of its circuit."""
    # R6 and R12 do not enter the coefficients, so any value will do to find what they need.
    placeholder = float(order.resistors[-1])
    trial = values | dict.fromkeys(drive_resistors.NAMES, placeholder)
    errors = order.errors(order.build(trial), limits.swing)
    driven = _drive(
        order, values, drive_resistors.per_ohm(order.model, errors, placeholder), thrifty
    )
    if isinstance(driven, Shortfall):
        return driven
    complete = values | driven
    circuit = order.build(complete)
    return Attempt(complete, circuit, order.errors(circuit, limits.swing), linear, zone)


def _dead_zone(
    order: Order, limits: ConditionLimits, wishes: Wishes, values: Mapping[str, float]
) -> DeadZone | str:
    """The stage beside this linear block, or the name of what leaves none."""
    target = nonlinear_block.target_of(order.model, values, _room(order, limits))
    if "swing" not in limits.kept:  # then an output may go as far as it can
        more = order.saturation / limits.swing
        target = replace(
            target,
            linear_gain=more * target.linear_gain,
            output_gain=more * target.output_gain,
        )
    return size_dead_zone.size(
        target,
        order.resistors,
        order.base,
        frozenset(values.values()),
        wishes,
        values,
        order.resistor_prices,
    )


def _room(order: Order, limits: ConditionLimits) -> StageRoom:
    """What the responses, the op-amps and the conditions leave to the dead zone."""
    room = StageRoom(
        saturation=order.saturation,
        swing=limits.swing,
        supply=order.spec.supply,
        peaks=order.peaks.states,
        penetration=order.peaks.penetration,
        load=limits.load,
        strict=bool(limits.kept),
        noise_gain=limits.noise_gain,
        kind=order.zone.kind,
        excursion=order.peaks.excursion,
    )
    diode, reference = order.zone.diode, order.zone.reference
    if diode is None or reference is None:
        return room
    least, most = reference.current.min or 0.0, reference.current.max or float("inf")
    return replace(
        room,
        drop=diode_model(diode).drop,
        reference=reference.voltage,
        reference_current=(REFERENCE_MARGIN * least, most / REFERENCE_MARGIN),
    )


def _levels(
    order: Order, limits: ConditionLimits, values: Mapping[str, float], thrifty: bool
) -> dict[str, float] | Shortfall:
    """The inverters' resistors: one value for all, but where a matched group says otherwise."""
    own = levels(order.parts)
    light = order.resistors[order.resistors >= limits.load]
    if len(light) == 0:
        return Shortfall("load", True)
    base = nearest(light, BASE)
    if thrifty:
        least = max(limits.load, float(order.resistors[0]))
        known = [v for n, v in values.items() if n.startswith("R") and v >= least]
        base = nearest(np.array(sorted({*known, base})) if not known else np.array(known), base)
    out = dict.fromkeys(sorted(own), base)
    for group in order.spec.matched:
        given = {values[name] for name in group if name in values}
        members = own & set(group)
        if len(given) > 1 and members:
            return Shortfall("matched parts", True)
        for name in members:
            # An inverter's two resistors are equal, so one that is tied ties the other.
            number = int(name[1:])
            pair = (f"R{number - number % 2}", f"R{number - number % 2 + 1}")
            for value in given:
                out |= dict.fromkeys(pair, value)
    return out


def _drive(
    order: Order, values: Mapping[str, float], volts: Array, thrifty: bool
) -> dict[str, float] | Shortfall:
    lists = dict.fromkeys(drive_resistors.NAMES, order.resistors)
    equal = False
    for group in order.spec.matched:
        own = [name for name in drive_resistors.NAMES if name in group]
        given = {values[name] for name in group if name in values}
        if own and len(given) > 1:
            return Shortfall("matched parts", True)
        equal |= len(own) == 2
        for name in own:
            lists[name] = np.array(sorted(given)) if given else lists[name]
    known = [v for n, v in values.items() if n.startswith("R")]
    return drive_resistors.choose(
        volts,
        lists,
        known,
        GENERATOR_PEAK / order.largest,
        equal=equal,
        least=drive_resistors.LEAST_SHARE if thrifty else 0.5,
    )


def nearest(values: Array, wanted: float) -> float:
    """The value nearest in ratio."""
    return float(values[int(np.argmin(np.abs(np.log(values / wanted))))])
