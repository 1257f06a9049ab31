"""Every nonlinear stage of a circuit, its constant forces and its references.

A single clearance with equal stops sets the amplitude, and ``size_dead_zone`` searches its stage
with the freedom that the linear block's scales have. In any other circuit the amplitude is tried at
many values up to the largest, and at each of them every stage is chosen (``further_stages``).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from designer.base.arrays import Array
from designer.base.progress import doing
from designer.catalog.output_stage import OutputStage
from designer.circuit.build import constant_resistor
from designer.circuit.coefficients import EXACT
from designer.circuit.dead_zone_parts import DeadZoneStage, half_parts, reference_sign
from designer.circuit.dead_zone_place import DeadZonePlace
from designer.model.circuit_table import CircuitSpec
from designer.model.clearance import Clearance
from designer.model.find_responses import Peaks
from designer.model.mechanics import MechanicalModel, SecondOrderSystem
from designer.synthesis import further_stages, size_dead_zone
from designer.synthesis.dead_zone_target import DeadZone, DeadZoneTarget, target_of
from designer.synthesis.further_stages import CircuitScales, Difference
from designer.synthesis.limits import ConditionLimits

LEAST_AMPLITUDE = 0.8
"""Of the largest amplitude: the least that is tried."""
AMPLITUDES = 40
"""Amplitudes that are tried."""


@dataclass(frozen=True)
class StageQuestion:
    """What the stages are chosen for, and from what."""

    model: MechanicalModel
    stage: DeadZoneStage
    """The kind of the dead zones."""
    limits: ConditionLimits
    peaks: Peaks
    """What the circuit has to hold."""
    output: OutputStage
    """How far the outputs of the op-amps reach."""
    spec: CircuitSpec
    """Its supply, matched, preferred, most_values and slack count."""
    resistors: Array
    """Values that may be used [ohm], ascending."""
    base: float
    """The first value tried for resistors that only set a level [ohm]."""
    prices: Mapping[float, float]
    """Price class by value."""


def size(question: StageQuestion, values: Mapping[str, float]) -> DeadZone | str | None:
    """The resistors of all stages beside this linear block, or the name of the condition that
    leaves none; None where the model needs no such part. values : of the linear block by part."""
    system = question.model.second_order()
    zones = system.dead_zones
    if not zones and not system.wired.constant.any():
        return None
    sizing = _Sizing(question, system, values)
    if len(zones) == 1 and alike(zones[0]):
        return sizing.searched()
    return sizing.enumerated()


def with_levels(
    question: StageQuestion, linear: Mapping[str, float], chosen: Mapping[str, float]
) -> dict[str, float] | str:
    """Chosen resistors of rectifying stages and of constant forces, with the clamps' and the feeds
    of the references; or the condition that leaves none. linear : of the linear block by part."""
    sizing = _Sizing(question, question.model.second_order(), linear)
    out = dict(chosen)
    for place in sizing.places:
        out |= sizing.lifts(place, chosen)
    return sizing.with_feeds(out)


def alike(clearance: Clearance) -> bool:
    """Whether the stops of a clearance are alike, or only one, away from rest."""
    stops = [stop for _, stop in clearance.sides]
    return all(stop == stops[0] for stop in stops) and stops[0].gap > 0.0 and not clearance.limits


@dataclass(frozen=True)
class _Stages:
    """Stages chosen at one amplitude: values [ohm] and errors by name, the first threshold [V]."""

    values: dict[str, float]
    errors: dict[str, float]
    threshold: float

    @property
    def worst(self) -> float:
        return max((abs(e) for e in self.errors.values()), default=0.0)


@dataclass(frozen=True)
class _Sizing:
    """The choice of all stages beside one linear block."""

    question: StageQuestion
    system: SecondOrderSystem
    linear: Mapping[str, float]

    @property
    def places(self) -> tuple[DeadZonePlace, ...]:
        return self.question.stage.places(self.system.dead_zones)

    @property
    def heavy(self) -> Array:
        """Resistors that an output may drive."""
        values = self.question.resistors
        return values[values >= self.question.limits.load]

    def searched(self) -> DeadZone | str:
        """The stage of a single clearance with equal stops, which sets the amplitude."""
        q, place = self.question, self.places[0]
        clearance = place.clearance
        amplifier = self._differences(place, self._at(1.0))[0]
        own = dict(amplifier.values)
        stage = size_dead_zone.size(
            self._target(place, amplifier.gain),
            q.resistors,
            q.base,
            frozenset({*self.linear.values(), *own.values()}),
            q.spec,
            {**self.linear, **own},
            q.prices,
        )
        if isinstance(stage, str):
            return stage
        errors = {**stage.errors, **amplifier.errors}
        threshold = stage.threshold / amplifier.gain
        scales = CircuitScales.of(
            self.system, self.linear, clearance.watched, threshold / clearance.first.gap
        )
        own |= stage.values
        if clearance.other is not None:
            force = stage.values[place.part("R50")]
            values, error = further_stages.reaction(self.system, place, scales, force, self.heavy)
            own |= values
            errors["reaction"] = error
        whole = self._with_references(own, scales)
        if isinstance(whole, str):
            return whole
        worst = max(abs(e) for e in errors.values())
        proved = stage.proved and worst <= stage.bound + EXACT
        return replace(stage, values=whole, errors=errors, threshold=threshold, proved=proved)

    def enumerated(self) -> DeadZone | str:
        """All stages at the amplitude that leaves them the least error."""
        scales = self._at(1.0)
        if self.places:
            doing("stages of all clearances")
            tried = [self._at(share) for share in np.linspace(1.0, LEAST_AMPLITUDE, AMPLITUDES)]
            errors = np.array([self._least_error(at) for at in tried])
            if not np.isfinite(errors.min()):
                return "stop slope"
            scales = tried[int(np.flatnonzero(errors <= errors.min() + EXACT)[0])]
        stage = self._stages(scales)
        if stage is None:
            return "stop slope"
        whole = self._with_references(stage.values, scales)
        if isinstance(whole, str):
            return whole
        return DeadZone(
            values=whole,
            errors=stage.errors,
            threshold=stage.threshold,
            bound=0.0,
            proved=stage.worst <= EXACT,
            proof=further_stages.PROOF,
            solver="every choice looked at",
        )

    def _least_error(self, scales: CircuitScales) -> float:
        """The least that the largest error of all stages can be at these scales."""
        return max(
            min(q.least_error(self.question.resistors) for q in self._questions(place, scales))
            for place in self.places
        )

    def _questions(
        self, place: DeadZonePlace, scales: CircuitScales
    ) -> list[further_stages.RectifierQuestion]:
        """What the stage of a clearance has to do, with each amplifier that it may have."""
        return [
            further_stages.RectifierQuestion(
                self.system,
                place,
                scales,
                each,
                self._target(place, each.gain),
                self.question.peaks.reach(place.index),
            )
            for each in self._differences(place, scales)
        ]

    def _at(self, share: float) -> CircuitScales:
        """The scales at this share of the largest amplitude."""
        q = self.question
        unit = CircuitScales.of(self.system, self.linear, 0, 1.0)
        top = q.limits.swing / float((q.peaks.states * unit.volts).max())
        return replace(unit, volts=unit.volts * (top * share))

    def _stages(self, scales: CircuitScales) -> _Stages | None:
        """The stage of each clearance at these scales."""
        values: dict[str, float] = {}
        errors: dict[str, float] = {}
        threshold = float("nan")
        preferred = self.question.spec.preferred
        for place in self.places:
            known = frozenset({*self.linear.values(), *values.values(), *preferred})
            questions = self._questions(place, scales)
            least = [q.least_error(self.question.resistors) for q in questions]
            question = questions[int(np.argmin(least))]
            best = further_stages.rectifier(question, self.question.resistors, known)
            if best is None:
                return None
            values |= best.values
            errors |= best.errors
            threshold = best.threshold if place.index == 0 else threshold
        return _Stages(values, errors, threshold)

    def _differences(self, place: DeadZonePlace, scales: CircuitScales) -> tuple[Difference, ...]:
        """Difference amplifiers that the stage may have, the largest gain first."""
        peak = self.question.peaks.reach(place.index).peak
        volts = float(scales.volts[place.clearance.watched])
        most = self.question.limits.swing / (volts * peak) if peak > 0.0 else 1.0
        return further_stages.differences(place, scales.volts, most, self.heavy)

    @cached_property
    def _targets(self) -> tuple[DeadZoneTarget, ...]:
        """The conditions on each stage, per volt of its mass's displacement."""
        q = self.question
        return tuple(
            target_of(
                q.model,
                self.linear,
                q.stage,
                q.limits,
                q.peaks,
                output=q.output,
                supply=q.spec.supply,
                index=place.index,
            )
            for place in self.places
        )

    def _target(self, place: DeadZonePlace, gain: float) -> DeadZoneTarget:
        """The conditions on a stage behind an amplifier of this gain, per volt at its input."""
        target = self._targets[place.index]
        if gain == 1.0:
            return target
        low, high = target.slope
        return replace(
            target,
            slope=(low / gain, high / gain),
            threshold=target.threshold * gain,
            linear_gain=target.linear_gain / gain,
            output_gain=target.output_gain / gain,
        )

    def _with_references(
        self, chosen: Mapping[str, float], scales: CircuitScales
    ) -> dict[str, float] | str:
        """The stages' values with those of constant forces and feeds; what leaves none."""
        reference, out = self.question.stage.reference, dict(chosen)
        if self.system.wired.constant.any():
            assert reference is not None
            out |= further_stages.constants(self.system, scales, reference.voltage, self.heavy)
        return self.with_feeds(out)

    def with_feeds(self, chosen: Mapping[str, float]) -> dict[str, float] | str:
        """The same with the feeds of the references alone."""
        q, reference, out = self.question, self.question.stage.reference, dict(chosen)
        loads = self._loads(out)
        if reference is not None and set(loads) - {s for s, r in q.stage.feeds.items() if r in out}:
            feeds = further_stages.feeds(q.stage, loads, q.spec.supply, q.resistors, out)
            if feeds is None:
                return "reference current"
            out |= feeds
        known = {**self.linear, **out}
        groups = ([known[name] for name in group if name in known] for group in q.spec.matched)
        return "matched parts" if any(len(set(group)) > 1 for group in groups) else out

    def lifts(self, place: DeadZonePlace, chosen: Mapping[str, float]) -> dict[str, float]:
        """The clamps' resistors of a rectifying stage, beside its other resistors."""
        if not place.shared:
            return {}
        reference = self.question.stage.reference
        assert reference is not None
        sources, thresholds = {}, {}
        for side, stop in place.clearance.sides:
            names = half_parts(place.index, side)
            sources[side] = chosen[names.source]
            volts = reference.voltage * sources[side] / chosen.get(names.threshold, np.inf)
            thresholds[side] = float(np.copysign(volts, stop.gap))
        q = self.question
        shares = further_stages.idle_shares(place.clearance, q.peaks.reach(place.index))
        limit = q.output.limit
        return further_stages.lifts(place, sources, thresholds, shares, limit, self.heavy)

    def _loads(self, values: Mapping[str, float]) -> dict[int, float]:
        """Conductance on each reference that is there [1/ohm], by its sign."""
        loads: dict[int, float] = {}
        ends = [
            (reference_sign(place, side, stop), half_parts(place.index, side).threshold)
            for place in self.places
            for side, stop in place.clearance.sides
            if self.question.stage.rectifies
        ]
        ends += [
            (-1 if force > 0.0 else 1, constant_resistor(mass))
            for mass, force in enumerate(self.system.wired.constant.tolist())
            if force
        ]
        for sign, name in ends:
            if name in values:
                loads[sign] = loads.get(sign, 0.0) + 1.0 / values[name]
        return loads
