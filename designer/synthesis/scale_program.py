"""All values of a circuit and all its side conditions, in logarithms of scales and free parts.

What may be chosen at will, the vector z, holds logarithms: the time scale, the volts of each state
per unit, the capacitors; of each rectifying stage the force resistor and the input resistor of each
half, and between two masses two resistors of the difference amplifier. Every other resistor that a
coefficient depends on follows as a sum of these (``Row``); what is bought is the value nearest to
it. Ranges, swing, levels and what a stage puts out are linear in z; loads, noise gains and
bandwidth are sums of exponentials of it, read from the circuit's nets (``ExponentialSum``). So the
box of what may be chosen is convex.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np

from designer.base.arrays import Array, Index
from designer.base.eseries import series_values
from designer.base.units import format_quantity
from designer.catalog.diode_curve import diode_model
from designer.circuit.build import constant_resistor
from designer.circuit.dead_zone_parts import HalfNames, half_parts
from designer.circuit.dead_zone_place import DeadZonePlace
from designer.circuit.netlist import Circuit, Section
from designer.linear_network.linear_terms import Targets
from designer.model.circuit_table import SIDE_CONDITIONS, CircuitSpec
from designer.model.clearance import Clearance
from designer.model.find_responses import Reach
from designer.model.mechanics import SecondOrderSystem
from designer.synthesis.attempt import BASE, Order
from designer.synthesis.further_stages import LIFT, MOST_DIFFERENCE, idle_shares
from designer.synthesis.limits import (
    GENERATOR_PEAK,
    LEAST_SIGNAL,
    LOAD,
    ConditionLimits,
    bandwidth_limit,
    depth,
)
from designer.synthesis.part_checks import nearest
from designer.synthesis.stop_halves import INPUTS

HIGHEST = 0.95
"""The highest threshold, over the output limit. A stop that no wanted response meets has to be
within reach of the displacement too."""
EQUAL = 1e-9
"""Relative: values that differ by less are one."""


CATALOGUE, TRIED, STAGE = "catalogue", "tried", "stage"
"""Limits that neither a side condition nor a key sets: by what can be bought, by the values that a
search tries, by a stage's own way to work."""
_SOURCES = {
    CATALOGUE: "no other can be bought",
    TRIED: "no other is tried there",
    STAGE: "of the stage itself",
}


@dataclass(frozen=True)
class StatedLimit:
    """A number that a side condition, the model file or the catalogue sets."""

    condition: str
    """The side condition, the key of the table [circuit], ``CATALOGUE``, ``TRIED`` or ``STAGE``."""
    what: str
    """What is limited, in words."""
    value: float
    """The number."""
    unit: str = ""
    """Its unit; none for a ratio."""
    least: bool = False
    """Whether it is a limit from below."""

    def text(self, value: float) -> str:
        """The limit in words, at this value."""
        number = format_quantity(value, self.unit, 3)
        keys = {each.name for each in fields(CircuitSpec)}
        source = f"rule {self.condition}"
        if self.condition in _SOURCES:
            source = _SOURCES[self.condition]
        elif self.condition in SIDE_CONDITIONS:
            source = f"side condition {self.condition}"
        elif self.condition in keys:
            source = f"circuit.{self.condition}"
        return f"{self.what} {'>=' if self.least else '<='} {number} ({source})"


@dataclass(frozen=True)
class Affine:
    """A logarithm that is linear in z: weights @ z + constant."""

    weights: Array
    """(z,) change with z."""
    constant: float = 0.0
    """Where z is 0."""

    def __add__(self, other: Affine | float) -> Affine:
        if isinstance(other, Affine):
            return Affine(self.weights + other.weights, self.constant + other.constant)
        return Affine(self.weights, self.constant + float(other))

    def __neg__(self) -> Affine:
        return Affine(-self.weights, -self.constant)

    def __sub__(self, other: Affine | float) -> Affine:
        return self + (-other)

    def at(self, z: Array) -> float:
        """Its value."""
        return float(self.weights @ z + self.constant)


@dataclass(frozen=True)
class LinearBound:
    """A logarithm that may not exceed 0, and the limit that it keeps."""

    log: Affine
    """The logarithm."""
    limit: StatedLimit
    """What it keeps."""


@dataclass(frozen=True)
class ExponentialSum:
    """Exponentials of logarithms whose sum may not exceed 1, and the limit that this keeps."""

    logs: tuple[Affine, ...]
    """The logarithms of its terms."""
    limit: StatedLimit
    """What it keeps."""

    def at(self, z: Array) -> float:
        """Logarithm of the sum: above 0 the limit is not kept."""
        return float(np.logaddexp.reduce([log.at(z) for log in self.logs]))

    def tangent(self, z: Array) -> LinearBound:
        """A bound that every z keeps which keeps the sum: it touches the sum at this z."""
        logs = np.array([log.at(z) for log in self.logs])
        total = float(np.logaddexp.reduce(logs))
        weights = np.exp(logs - total) @ np.array([log.weights for log in self.logs])
        return LinearBound(Affine(weights, total - float(weights @ z)), self.limit)


@dataclass(frozen=True)
class Row:
    """A resistor, or a damper's capacitor, that follows from z."""

    names: tuple[str, ...]
    """Parts that have this value."""
    log: Affine
    """Its logarithm [ohm, F]."""
    values: Array
    """Logarithms of the values that it may have, ascending."""
    size: float = 1.0
    """Error of a coefficient for an error of its logarithm."""
    held: bool = False
    """Whether its error counts beside that of the threshold which sets the amplitude: that of a
    threshold or of a constant force does."""
    constant: bool = False
    """Whether it makes a constant force, which no scale is fitted to."""


@dataclass(frozen=True)
class ScaleProgram:
    """What may be chosen, what follows from it, and what both have to keep."""

    lists: tuple[Array, ...]
    """Logarithms of the values of each entry of z, ascending; empty where it is any number."""
    shared: Mapping[str, int]
    """Place in z of each part that is chosen at will."""
    rows: tuple[Row, ...]
    """The resistors that follow."""
    bounds: tuple[LinearBound, ...]
    """What is linear."""
    sums: tuple[ExponentialSum, ...]
    """What is not."""
    thresholds: tuple[Affine, ...]
    """The voltage [V] at which the half of each gap conducts."""
    levels: tuple[Affine, ...]
    """The peak [V] of each state."""
    outputs: tuple[Affine, ...]
    """The stage's output at the deepest contact [V], for each half."""

    @classmethod
    def of(cls, order: Order, within: ConditionLimits) -> ScaleProgram:
        """What is ordered, within these limits."""
        return _Maker(order, within).program()

    @property
    def lead(self) -> int:
        """Place among the rows of the threshold that sets the amplitude; -1 without one."""
        places = [k for k, row in enumerate(self.rows) if row.held and not row.constant]
        return places[0] if places else -1

    def volts(self, z: Array) -> Array:
        """(..., states) volts per model unit."""
        return np.exp(z[..., 1 : 1 + len(self.levels)])

    def follows(self, z: Array) -> Array:
        """(..., rows) logarithms of the resistors that follow, before they are rounded."""
        weights = np.array([row.log.weights for row in self.rows])
        return np.asarray(z @ weights.T + [row.log.constant for row in self.rows])

    def broken(self, z: Array, kept: float) -> list[ExponentialSum]:
        """The sums whose logarithm is above ``kept``, at one z (z,)."""
        if not self.sums:
            return []
        weights, constants, first = self._terms
        logs = weights @ z + constants
        totals = np.logaddexp.reduceat(logs, first)
        return [self.sums[k] for k in np.flatnonzero(totals > kept)]

    @cached_property
    def _terms(self) -> tuple[Array, Array, Index]:
        """Weights (terms, z) and constants (terms,) of all terms of the sums, and where each sum's
        begin."""
        logs = [log for s in self.sums for log in s.logs]
        first = np.cumsum([0, *(len(s.logs) for s in self.sums)])[:-1]
        return np.array([g.weights for g in logs]), np.array([g.constant for g in logs]), first

    def values(self, z: Array, rounded: Array) -> dict[str, Any]:
        """(...,) the values [ohm, F] by part. rounded : (..., rows) logarithms of the rows'
        values."""
        out = {name: np.exp(z[..., k]) for name, k in self.shared.items()}
        for k, row in enumerate(self.rows):
            out |= dict.fromkeys(row.names, np.exp(rounded[..., k]))
        return out


def halves(clearance: Clearance) -> list[tuple[int, ...]]:
    """The sides whose halves are sized together: both, where the stops are alike."""
    stops = [stop for _, stop in clearance.sides]
    sides = [side for side, _ in clearance.sides]
    alike = all(stop == stops[0] for stop in stops)
    return [tuple(sides)] if alike else [(side,) for side in sides]


def penetration(reach: Reach, side: int, peak: float) -> float:
    """Deepest penetration of the stop on this side, in model units."""
    return depth(Reach(reach.on(side)), peak)


class _Maker:
    """Writes the program."""

    def __init__(self, order: Order, within: ConditionLimits) -> None:
        self.order, self.within = order, within
        self.system: SecondOrderSystem = order.model.second_order()
        self.targets = Targets.of(order.model)
        self.states = 2 * self.system.size
        rectifies = order.stage.rectifies
        every = order.stage.places(self.system.dead_zones)
        self.places: tuple[DeadZonePlace, ...] = every if rectifies else ()
        self.constants = np.flatnonzero(self.system.wired.constant).tolist() if rectifies else []
        self.heavy = order.resistors[order.resistors >= within.load]
        self.peaks = np.log(order.peaks.states)
        self.lists: list[Array] = [np.zeros(0)] * (1 + self.states)
        self.shared: dict[str, int] = {}
        self._choose()
        self.rows: list[Row] = []
        self.bounds: list[LinearBound] = []
        self.thresholds: list[Affine] = []
        self.outputs: list[Affine] = []
        self.lifts: dict[str, Affine] = {}

    def program(self) -> ScaleProgram:
        self._ranges()
        self._scales()
        self._integrators()
        gaps = [stop.gap for place in self.places for _, stop in place.clearance.sides if stop.gap]
        self.lead = abs(gaps[0]) if gaps else None
        for place in self.places:
            if place.clearance.limits:
                self._limiter(place)
            else:
                self._rectifier(place)
        for mass in self.constants:
            self._constant(mass)
        self._generator()
        levels = [self.volts(i) + self.peaks[i] for i in range(self.states)]
        return ScaleProgram(
            tuple(self.lists),
            self.shared,
            tuple(self.rows),
            tuple(self.bounds),
            tuple(self._sums()),
            tuple(self.thresholds),
            tuple(levels),
            tuple(self.outputs),
        )

    # What is chosen at will

    def _choose(self) -> None:
        inputs = self.heavy[(self.heavy >= INPUTS[0]) & (self.heavy <= INPUTS[1])]
        inputs = inputs if len(inputs) else self.heavy

        def free(names: Sequence[str], values: Array) -> None:
            self.shared |= dict.fromkeys(names, len(self.lists))
            self.lists.append(np.log(np.sort(values)))

        for state in range(self.states):
            free([f"C{state + 1}"], self.order.capacitors)
        for place in self.places:
            free([place.part("R50")], self.heavy)
            if place.clearance.limits:
                first, second = (half_parts(place.index, side) for side in (1, -1))
                free([first.source], inputs)
                free([second.source], inputs)
                free([first.feedback], self.heavy)
            else:
                for sides in halves(place.clearance):
                    free([half_parts(place.index, side).source for side in sides], inputs)
            if place.sums:
                free([place.part("R220")], inputs)
                free([place.part("R222")], self.heavy)

    def _unit(self, place: int) -> Affine:
        return Affine(np.eye(len(self.lists))[place])

    @property
    def time(self) -> Affine:
        """The logarithm of the time scale [s]."""
        return self._unit(0)

    def volts(self, state: int) -> Affine:
        """The logarithm of a state's volts per unit."""
        return self._unit(1 + state)

    def part(self, name: str) -> Affine:
        """The logarithm of a part's value, if that is chosen at will."""
        return self._unit(self.shared[name])

    def rate(self, mass: int) -> Affine:
        """The logarithm of what a resistor from a mass's displacement into its velocity is, times
        the coefficient that it makes (``CircuitScales.rates``)."""
        x, v = 2 * mass, 2 * mass + 1
        return self.time + self.volts(x) - self.volts(v) - self.part(f"C{v + 1}")

    # What is kept

    def _keep(self, log: Affine, limit: StatedLimit) -> None:
        """This logarithm stays on its side of the limit's value."""
        if 0.0 < limit.value < np.inf:
            over = log - float(np.log(limit.value))
            self.bounds.append(LinearBound(-over if limit.least else over, limit))

    def _scales(self) -> None:
        """The time scale and the volts of the states."""
        low, high = self.order.spec.frequency
        frequency = -self.time + float(np.log(self.system.own_frequency / (2.0 * np.pi)))
        self._keep(frequency, StatedLimit("frequency", "the band's low end", low, "Hz", least=True))
        self._keep(frequency, StatedLimit("frequency", "the band's high end", high, "Hz"))
        least = self.within.seconds[0]
        if least > self.system.own_frequency / (2.0 * np.pi * high) * (1.0 + EQUAL):
            what = "circuit time per unit of model time"
            self._keep(self.time, StatedLimit("bandwidth", what, least, "s", least=True))
        levels = [self.volts(i) + self.peaks[i] for i in range(self.states)]
        swing = StatedLimit("swing", "peak of a state", self.within.swing, "V")
        ratio = StatedLimit("level", "ratio of two peaks", self.within.level)
        share = StatedLimit("level", "ratio of a peak to that at the clearance", self.within.share)
        own = self.order.lead
        for level in levels:
            self._keep(level, swing)
            self._keep(level - levels[own], share)
        pairs = [*zip(levels[0::2], levels[1::2], strict=True), *combinations(levels[1::2], 2)]
        for one, other in pairs:
            self._keep(one - other, ratio)
            self._keep(other - one, ratio)
        if "level" in self.within.conditions:
            least = LEAST_SIGNAL * self.order.bounds.offset_limit
            self._keep(
                levels[own], StatedLimit("level", "peak at the clearance", least, "V", least=True)
            )

    def _ranges(self) -> None:
        """Keep the ranges of the parts that are chosen at will."""
        for name, place in self.shared.items():
            own = np.exp(self.lists[place][[0, -1]])
            for end, most in zip(own.tolist(), (False, True), strict=True):
                self._keep(self._unit(place), self._end(name, end, most=most))

    def _end(self, name: str, value: float, *, most: bool) -> StatedLimit:
        """The limit that the least or the largest value of a part is, by what sets it."""
        spec, order = self.order.spec, self.order
        kind = "capacitor" if name[0] == "C" else "resistor"
        series, span, bought, unit = (
            (spec.capacitors, spec.capacitor_range, order.capacitors, "F")
            if kind == "capacitor"
            else (spec.resistors, spec.resistor_range, order.resistors, "Ω")
        )
        allowed = series_values(series, *span)[-1 if most else 0]
        sold = bought.max() if most else bought.min()
        source = TRIED
        if np.isclose(value, allowed, rtol=EQUAL, atol=0.0):
            source = f"{kind}_range"
        elif np.isclose(value, sold, rtol=EQUAL, atol=0.0):
            source = CATALOGUE
        # One key is one limit for every part that it bounds.
        what = f"the {'largest' if most else 'smallest'} {kind}"
        return StatedLimit(source, what, value, unit, least=not most)

    def _row(
        self,
        names: Sequence[str],
        log: Affine,
        size: float = 1.0,
        signal: tuple[float, float] = (0.0, np.inf),
        *,
        held: bool = False,
        constant: bool = False,
    ) -> None:
        """A resistor that follows. signal : the range [ohm] that the condition resistors sets."""
        every = self.order.resistors
        low, high = float(every[0]), float(every[-1])
        for key, least, most in (
            ("resistor_range", low, high),
            ("load", self.within.load, np.inf),
            ("resistors", *signal),
        ):
            self._keep(log, StatedLimit(key, names[0], least, "Ω", least=True))
            self._keep(log, StatedLimit(key, names[0], most, "Ω"))
        own = every[(every >= max(self.within.load, signal[0])) & (every <= signal[1])]
        values = np.log(own if len(own) else every)
        self.rows.append(Row(tuple(names), log, values, size, held, constant))

    # What follows

    def _integrators(self) -> None:
        """The linear block."""
        terms = zip(self.targets.entries, self.targets.resistors, self.targets.wanted, strict=True)
        for (a, b), name, wanted in terms:
            log = self.time + self.volts(b) - self.volts(a) - self.part(f"C{a + 1}")
            self._row([name], log - float(wanted), signal=self.within.signal)
        if not self.places and self.system.dead_zones:
            self._leave_room()

    def _leave_room(self) -> None:
        """For the stop's resistor beside that of its mass's stiffness, where the stage is sized
        afterwards."""
        clearance = self.system.dead_zones[0]
        mu = max(self.system.relative_stiffness(stop) for stop in self.system.dead_zones)
        bounds = self.within.bounds(mu, self.order.peaks, self.order.resistors, clearance.mass)
        log = next(row.log for row in self.rows if row.names == (self.order.stiffness,))
        self._keep(log, StatedLimit("load", "the stop's resistor", bounds.stop, "Ω", least=True))

    def _gain(self, place: DeadZonePlace) -> Affine:
        """The gain of the amplifier that sums displacements in front of a stage; 1 without one."""
        if not place.sums:
            return Affine(np.zeros(len(self.lists)))
        return self._difference(place, self.order.peaks.reach(place.index))

    @property
    def _reference(self) -> float:
        """Logarithm of its voltage."""
        assert self.order.stage.reference is not None
        return float(np.log(self.order.stage.reference.voltage))

    @property
    def _drop(self) -> float:
        """The drop of a diode [V]."""
        assert self.order.stage.diode is not None
        return diode_model(self.order.stage.diode).drop

    @property
    def _highest_output(self) -> float:
        """What a stage's output may reach [V]: an op-amp stands a diode's drop beyond it."""
        strict = "swing" in self.within.conditions
        return (self.within.swing if strict else self.order.output.limit) - self._drop

    def _highest_end(self, clearance: Clearance) -> float:
        """The highest voltage [V] of a gap, or of a bend, which no wanted response may reach."""
        highest = HIGHEST * self.order.output.limit
        return min(highest, self.within.swing) if clearance.bend_of else highest

    def _slope(self, clearance: Clearance, stiffness: float) -> Affine:
        """Conductance into the velocity that makes this stiffness, or damping, by the state that
        the dead zone watches [1/ohm]."""
        mass = clearance.mass
        slope = float(np.log(abs(stiffness) / self.system.mass[mass]))
        return self.volts(2 * mass) - self.volts(clearance.watched) - self.rate(mass) + slope

    def _limiter(self, place: DeadZonePlace) -> None:
        """Two rectifiers, one behind the other (``circuit.dead_zone_parts``)."""
        clearance, index = place.clearance, place.index
        assert clearance.upper is not None
        assert clearance.lower is not None
        first, second = (half_parts(index, side) for side in (1, -1))
        gain, force = self._gain(place), self.part(place.part("R50"))
        own = self.volts(clearance.watched) + gain
        above, span = clearance.upper.gap, clearance.upper.gap + clearance.lower.gap
        if clearance.lower.gap:
            what, most = f"lower end of {clearance.name}", self._highest_end(clearance)
            end = own + float(np.log(clearance.lower.gap))
            self._keep(end, StatedLimit("swing", what, most, "V"))
        steep = self.part(first.feedback) - self.part(first.source)
        peak = max(self.order.peaks.reach(index).peak, span)
        limit, put_out = self._highest_output, own + steep
        self._keep(
            put_out + float(np.log(above + peak)),
            StatedLimit("swing", f"output of {first.section} of {place.output}", limit, "V"),
        )
        slope = self._slope(clearance, clearance.upper.stiffness) - gain
        feedback = self.part(second.source) + force + slope - steep
        self._row([second.feedback], feedback)
        fv = put_out + float(np.log(span)) + feedback - self.part(second.source)
        self.outputs.append(fv)
        self._keep(fv, StatedLimit("swing", f"output of {place.output}", limit, "V"))
        thresholds = [(first, own + float(np.log(above)))] if above else []
        for half, threshold in (*thresholds, (second, put_out + float(np.log(span)))):
            self.thresholds.append(threshold)
            what, most = f"threshold of {half.threshold}", self._highest_end(clearance)
            self._keep(threshold, StatedLimit("swing", what, most, "V"))
            log = self.part(half.source) - threshold + self._reference
            self._row([half.threshold], log, held=True)
        self._reaction(place)

    def _rectifier(self, place: DeadZonePlace) -> None:
        """The halves of one clearance, with the amplifiers around them."""
        clearance, index = place.clearance, place.index
        stops = dict(clearance.sides)
        reach = self.order.peaks.reach(index)
        gain, force = self._gain(place), self.part(place.part("R50"))
        drop = self._drop
        idle = idle_shares(clearance, reach) if place.shared else {}
        room = sum(stop.gap for stop in stops.values())
        own = self.volts(clearance.watched) + gain
        for sides in halves(clearance):
            side, stop = sides[0], stops[sides[0]]
            names = [half_parts(index, each) for each in sides]
            source = self.part(names[0].source)
            # Slope of fv over the force resistor that makes the stop's stiffness.
            feedback = source + force + self._slope(clearance, stop.stiffness) - gain
            self._row([n.feedback for n in names], feedback)
            deepest = max(penetration(reach, each, reach.peak) for each in sides)
            fv = feedback - source + own + float(np.log(deepest))
            self.outputs.append(fv)
            limit = self._highest_output
            self._keep(fv, StatedLimit("swing", f"output of {place.output}", limit, "V"))
            if side in idle:
                lifted = LIFT * self.order.output.limit * min(idle[side], 1.0) + 2.0 * drop
                what = f"output of {place.output} beside its idle half"
                self._keep(fv, StatedLimit("swing", what, lifted, "V"))
            if stop.gap:
                threshold = own + float(np.log(abs(stop.gap)))
                self.thresholds.append(threshold)
                what, most = f"threshold of {names[0].threshold}", self._highest_end(clearance)
                self._keep(threshold, StatedLimit("swing", what, most, "V"))
                log = source - threshold + self._reference
                self._row([n.threshold for n in names], log, held=True)
            if len(idle) > 1:
                self._lift(names, sides, own + float(np.log(room)), idle)
        self._reaction(place)
        if clearance.damping:
            self._damper(place)

    def _damper(self, place: DeadZonePlace) -> None:
        """The capacitors beside the force resistors: R C is the stop's damping over its
        stiffness."""
        clearance = place.clearance
        seconds = self.time + float(np.log(clearance.damping / clearance.first.stiffness))
        values = np.log(np.sort(self.order.capacitors))
        known = {name: row.log for row in self.rows for name in row.names}
        first, *others = place.forces
        known[first.resistor] = self.part(first.resistor)
        for force in (first, *others):
            capacitor, log = force.capacitor, seconds - known[force.resistor]
            for most in (False, True):
                value = float(np.exp(values[-1 if most else 0]))
                self._keep(log, self._end(capacitor, value, most=most))
            self.rows.append(Row((capacitor,), log, values))

    def _lift(
        self,
        names: Sequence[HalfNames],
        sides: Sequence[int],
        both: Affine,
        idle: Mapping[int, float],
    ) -> None:
        """The clamps' resistors, as ``further_stages.lifts`` has them; both : thresholds [V]."""
        limit = float(np.log(LIFT * self.order.output.limit))
        for half, side in zip(names, sides, strict=True):
            most = float(np.log(max(1.0, idle[-side])))
            self.lifts[half.lift] = self.part(half.source) + limit - both - most

    def _difference(self, place: DeadZonePlace, reach: Reach) -> Affine:
        """The amplifier of a clearance between masses; its gain."""
        clearance, x = place.clearance, place.clearance.watched
        source, feedback = (self.part(place.part(name)) for name in ("R220", "R222"))
        gain = feedback - source
        for each in place.inputs[1:]:
            share = float(np.log(abs(each.factor)))
            self._row([each.resistor], source + self.volts(each.state) - self.volts(x) - share)
        what = f"gain of the difference in clearance {clearance.name}"
        self._keep(gain, StatedLimit(STAGE, what, MOST_DIFFERENCE))
        if reach.peak > 0.0:
            peak = gain + self.volts(x) + float(np.log(reach.peak))
            what = f"difference in clearance {clearance.name}"
            self._keep(peak, StatedLimit("swing", what, self.within.swing, "V"))
        return gain

    def _reaction(self, place: DeadZonePlace) -> None:
        """The stop's force on the other masses that it pushes."""
        first, *others = place.forces
        one = first.mass
        for force in others:
            two = force.mass
            inertia = float(np.log(self.system.mass[two] / self.system.mass[one]))
            log = self.part(first.resistor) - self.rate(one) + self.rate(two) + inertia
            log = log - self.volts(2 * two) + self.volts(2 * one) - float(np.log(abs(force.factor)))
            self._row([force.resistor], log)

    def _current(self, force: float, mass: int) -> Affine:
        """Into the velocity of a mass that makes this force [A]."""
        own = abs(force) / float(self.system.mass[mass])
        return self.volts(2 * mass) - self.rate(mass) + float(np.log(own))

    def _constant(self, mass: int) -> None:
        """A constant force."""
        force = float(self.system.wired.constant[mass])
        unit = self.system.largest_force
        if self.lead is not None:
            unit = abs(self.system.spanning_stiffness[mass, mass]) * self.lead
        log = -self._current(force, mass) + self._reference
        size = abs(force) / float(unit) if unit > 0.0 else 1.0
        self._row([constant_resistor(mass)], log, size, held=True, constant=True)

    def _generator(self) -> None:
        """The amplitudes of its channels, with the least resistor that each can have."""
        if "generator" not in self.within.conditions:
            return
        least = float(np.log(self.order.resistors[0]))
        limit = StatedLimit("generator", "amplitude", GENERATOR_PEAK, "V")
        for channel, largest in enumerate(self.order.largest):
            forces = self.system.drive_force(self.system.own_frequency, channel)
            for mass in np.flatnonzero(forces).tolist():
                volts = self._current(float(forces[mass]), mass) + least
                self._keep(volts + float(np.log(largest)), limit)

    # What the nets say

    def _sums(self) -> Iterator[ExponentialSum]:
        """Load, noise gain and bandwidth of every stage, by its parts; what is sized afterwards is
        left out."""
        o = self.order
        circuit = o.build(defaultdict(lambda: 1.0))
        known = {name: log for row in self.rows for name, log in self._named(row)}
        known |= self.lifts | {name: self._unit(place) for name, place in self.shared.items()}
        light = o.resistors[o.resistors >= self.within.load]
        base = nearest(light if len(light) else o.resistors, BASE)
        nothing = Affine(np.zeros(len(self.lists)), float(np.log(base)))
        known |= dict.fromkeys(frozenset().union(*o.levels), nothing)
        frequency = -self.time + float(np.log(max(o.peaks.fastest, 1e-300) / (2.0 * np.pi)))
        for section in circuit.sections:
            yield from self._stage_sums(circuit, section, known, frequency)

    def _named(self, row: Row) -> Iterator[tuple[str, Affine]]:
        for name in row.names:
            yield name, row.log

    def _stage_sums(
        self, circuit: Circuit, section: Section, known: Mapping[str, Affine], frequency: Affine
    ) -> Iterator[ExponentialSum]:
        where, conditions = section.name, self.within.conditions
        outputs = circuit.output_nets(section)
        there = [r for r in circuit.resistors if r.name in known]
        loads = [known[r.name] for r in there if outputs & set(r.nets)]
        if "load" in conditions and loads:
            limit = StatedLimit("load", f"load of {where}", LOAD, "Ω", least=True)
            yield ExponentialSum(tuple(-log + float(np.log(LOAD)) for log in loads), limit)
        node = section.inverting
        at = [r for r in there if node in r.nets]
        hertz = bandwidth_limit(self.order.bounds)
        product = StatedLimit("bandwidth", f"noise gain times frequency of {where}", hertz, "Hz")
        most = -float(np.log(hertz))
        store = [c for c in circuit.capacitors if node in c.nets]
        if store:
            own = next(self.part(c.name) for c in store if c.name in circuit.states)
            corner = own + float(np.log(2.0 * np.pi))
            logs = [-known[r.name] - corner + most for r in at]
            logs += [known[c.name] - own + frequency + most for c in store]
            if "bandwidth" in conditions:
                yield ExponentialSum(tuple(logs), product)
            return
        back = [r for r in at if (set(r.nets) - {node}) & outputs]
        if len(back) != 1:
            return
        gains = [known[back[0].name] - known[r.name] for r in at]
        if np.isfinite(self.within.noise_gain):
            limit = StatedLimit("noise_gain", f"noise gain of {where}", self.within.noise_gain)
            yield ExponentialSum(tuple(log - float(np.log(limit.value)) for log in gains), limit)
        if "bandwidth" in conditions:
            yield ExponentialSum(tuple(log + frequency + most for log in gains), product)
