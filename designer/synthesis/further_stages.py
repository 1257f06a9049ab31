"""Stages, constant forces and references at scales that are given.

Where the amplitude is set, the volts of every state are known; each threshold and slope is wanted
as they say, and so is each constant force.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.circuit.build import constant_resistor
from designer.circuit.dead_zone_parts import DeadZoneStage, half_parts
from designer.circuit.dead_zone_place import DeadZonePlace
from designer.circuit.scale_fit import minimax
from designer.linear_network.linear_block import errors_of
from designer.linear_network.linear_terms import Targets
from designer.model.clearance import Clearance
from designer.model.find_responses import Reach
from designer.model.mechanics import SecondOrderSystem
from designer.synthesis.dead_zone_target import REFERENCE_MARGIN, DeadZoneTarget
from designer.synthesis.stop_halves import (
    ChosenHalves,
    HalfRules,
    HalfTarget,
    choose,
    least_error,
    nearest_to,
)

PROOF = (
    "at each of many amplitudes every force and input resistor of each clearance with the nearest "
    "reference and feedback resistor; no lower bound but 0"
)
"""What is known of the stages chosen here."""
LIFT = 0.75
"""Share of the output limit that an idle half may stand at, a diode's drop not counted."""
MOST_DIFFERENCE = 5.0
"""Largest gain of a difference amplifier."""
GAINS = 8
"""Gains of a difference amplifier that are tried."""


@dataclass(frozen=True)
class CircuitScales:
    """How the chosen linear block scales the model."""

    volts: Array
    """(2n,) volts per unit of each state."""
    rates: Array
    """(n,) what a resistor into a mass's velocity, fed by its own displacement, is times the
    coefficient that it makes."""

    @classmethod
    def of(
        cls, system: SecondOrderSystem, values: Mapping[str, float], state: int, volts: float
    ) -> CircuitScales:
        """Of these parts, by name, when a unit of this state is so many volts."""
        errors = errors_of(values, Targets.from_state_matrix(system.wired.state_matrix()))
        scales = minimax(errors.offsets, errors.columns)
        relative = np.exp(errors.volts @ scales)
        rates = np.exp(errors.rates @ scales + errors.rate_offsets)
        return cls(volts * relative / relative[state], rates)

    def siemens(self, system: SecondOrderSystem, stiffness: float, mass: int, by: int) -> float:
        """Conductance from the state ``by`` into the velocity of ``mass`` that makes this
        stiffness, or damping [1/ohm]."""
        rate = stiffness / float(system.mass[mass] * self.rates[mass])
        return rate * float(self.volts[2 * mass] / self.volts[by])

    def current(self, system: SecondOrderSystem, force: float, mass: int) -> float:
        """Current into the velocity of a mass that makes this force [A]."""
        return float(force * self.volts[2 * mass] / (system.mass[mass] * self.rates[mass]))


@dataclass(frozen=True)
class ChosenStage:
    """The resistors of one clearance and how good they are."""

    values: dict[str, float]
    """By part name [ohm]."""
    errors: dict[str, float]
    """Largest size of an error, by what it is."""
    threshold: float
    """Displacement of the mass at the first stop [V]."""

    @property
    def worst(self) -> float:
        return max(self.errors.values())


@dataclass(frozen=True)
class Difference:
    """A difference amplifier; of a clearance to ground none, with a gain of 1."""

    values: dict[str, float]
    """Its resistors by part name [ohm]."""
    gain: float
    """From the displacement of the first mass."""
    errors: dict[str, float]
    """Size of the error of its ratio, by what it is."""


def differences(
    place: DeadZonePlace, volts: Array, most: float, resistors: Array
) -> tuple[Difference, ...]:
    """The difference amplifiers that a clearance may have, the largest gain first. most : the
    largest gain. volts : (2n,) per unit of each state.

    The output is (R222/R220) v_i - (R222/R221) v_j, so R221/R220 is that of the masses' volts.
    """
    clearance = place.clearance
    if clearance.other is None:
        return (Difference({}, 1.0, {}),)
    ratio = float(volts[clearance.state_of(clearance.other)] / volts[clearance.watched])
    inputs = resistors[(resistors >= 1e4 / min(ratio, 1.0)) & (resistors <= 1e5 / max(ratio, 1.0))]
    inputs = inputs if len(inputs) else resistors
    others = nearest_to(resistors, ratio * inputs)
    errors = np.abs(np.log(others / (ratio * inputs)))
    k = int(np.argmin(errors))
    source, error = float(inputs[k]), {f"difference in {clearance.name}": float(errors[k])}
    fine = resistors[resistors <= min(most, MOST_DIFFERENCE) * source]
    feedbacks = (fine if len(fine) else resistors[:1])[-GAINS:]
    names = [place.part(name) for name in ("R220", "R221", "R222")]
    return tuple(
        Difference(
            dict(zip(names, (source, float(others[k]), float(feedback)), strict=True)),
            float(feedback) / source,
            error,
        )
        for feedback in feedbacks[::-1]
    )


@dataclass(frozen=True)
class RectifierQuestion:
    """What the halves of one clearance have to do at these scales."""

    system: SecondOrderSystem
    """The wanted equations."""
    place: DeadZonePlace
    """The clearance and its names."""
    scales: CircuitScales
    amplifier: Difference
    """In front of the stage."""
    target: DeadZoneTarget
    """Its conditions."""
    reach: Reach
    """How far the displacement goes in the clearance."""

    @property
    def halves(self) -> list[HalfTarget]:
        """What each half has to do."""
        clearance, gain = self.place.clearance, self.amplifier.gain
        mass, own = clearance.mass, float(self.scales.volts[clearance.watched])
        return [
            HalfTarget(
                side,
                abs(stop.gap) * own * gain,
                self.scales.siemens(self.system, abs(stop.stiffness), mass, clearance.watched)
                / gain,
            )
            for side, stop in clearance.sides
        ]

    @property
    def rules(self) -> HalfRules:
        """What all of them have to keep."""
        t = self.target
        return HalfRules(t.reference, t.output_gain, t.load, t.noise_gain)

    def least_error(self, resistors: Array) -> float:
        """The least largest error of any halves."""
        return least_error(self.halves, resistors, self.rules)


def rectifier(
    question: RectifierQuestion, resistors: Array, known: frozenset[float]
) -> ChosenStage | None:
    """The stage of a clearance; None where the conditions leave none. known : values that the
    circuit has."""
    place, target, amplifier = question.place, question.target, question.amplifier
    clearance, system, scales = place.clearance, question.system, question.scales
    targets = question.halves
    chosen = choose(targets, resistors, question.rules, known)
    if chosen is None:
        return None
    values = {**amplifier.values, place.part("R50"): chosen.force, **_named(place, chosen)}
    ends = dict(clearance.sides)
    volts = {t.side: float(np.copysign(t.threshold, ends[t.side].gap)) for t in targets}
    sources = {side: half.source for side, half in chosen.halves.items()}
    shares = idle_shares(clearance, question.reach)
    heavy = resistors[resistors >= target.load]
    values |= lifts(place, sources, volts, shares, target.output.limit, heavy)
    errors = {**amplifier.errors, f"stops of {clearance.name}": chosen.error}
    if clearance.other is not None:
        heavy = resistors[resistors >= target.load]
        other, error = reaction(system, place, scales, chosen.force, heavy)
        values |= other
        errors[f"reaction of {clearance.name}"] = error
    side, stop = clearance.sides[0]
    half = chosen.halves[side]
    threshold = 0.0 if half.threshold is None else target.reference * half.source / half.threshold
    return ChosenStage(values, errors, float(np.copysign(threshold, stop.gap)) / amplifier.gain)


def reaction(
    system: SecondOrderSystem,
    place: DeadZonePlace,
    scales: CircuitScales,
    force: float,
    resistors: Array,
) -> tuple[dict[str, float], float]:
    """The resistor to the other of two masses, beside the first one's ``force`` resistor, and the
    size of its error."""
    clearance = place.clearance
    assert clearance.other is not None
    one, two = (
        scales.siemens(system, 1.0, mass, clearance.watched)
        for mass in (clearance.mass, clearance.other)
    )
    wanted = one / two * force
    value = float(nearest_to(resistors, np.array([wanted]))[0])
    return {place.part("R51"): value}, float(abs(np.log(value / wanted)))


def _named(place: DeadZonePlace, chosen: ChosenHalves) -> dict[str, float]:
    out: dict[str, float] = {}
    for side, half in chosen.halves.items():
        names = half_parts(place.index, side)
        out |= {names.source: half.source, names.feedback: half.feedback}
        if half.threshold is not None:
            out[names.threshold] = half.threshold
    return out


def lifts(
    place: DeadZonePlace,
    sources: Mapping[int, float],
    thresholds: Mapping[int, float],
    shares: Mapping[int, float],
    limit: float,
    resistors: Array,
) -> dict[str, float]:
    """The clamps' resistors: as large as lets a half idle inside its swing while the other one
    drives fv. A clamp carries both thresholds over its half's input resistor where contact begins,
    and ``shares`` of that at the deepest.

    sources : input resistor of each half, by side [ohm]. thresholds : by side [V], negative where
    the stop is in contact at rest. shares : of ``idle_shares``. limit : of an output [V].
    resistors : that an output may drive, ascending [ohm].
    """
    if not place.shared:
        return {}
    total = sum(thresholds.values())
    out = {}
    for side, source in sources.items():
        share = shares.get(-side, 1.0)
        fine = resistors[resistors * total * max(1.0, share) <= LIFT * limit * source]
        out[half_parts(place.index, side).lift] = float(fine[-1] if len(fine) else resistors[0])
    return out


def idle_shares(clearance: Clearance, reach: Reach) -> dict[int, float]:
    """By driving side: the current of the idle half's clamp at the deepest contact over that where
    contact begins. It falls with depth where the driving half is the steeper one; where it comes
    to 0 the idle half does not stay off (``circuit.dead_zone_parts.idle_limits``). Empty with one
    stop, or where preloads leave no room between the stops."""
    ends = dict(clearance.sides)
    room = sum(stop.gap for stop in ends.values())
    if len(ends) < 2 or room <= 0.0:
        return {}
    return {
        side: 1.0 + reach.on(side) * (1.0 - stop.stiffness / ends[-side].stiffness) / room
        for side, stop in ends.items()
    }


def constants(
    system: SecondOrderSystem, scales: CircuitScales, reference: float, resistors: Array
) -> dict[str, float]:
    """The resistors of the constant forces."""
    return {
        constant_resistor(mass): float(
            nearest_to(
                resistors,
                np.array(
                    [reference / abs(scales.current(system, system.wired.constant[mass], mass))]
                ),
            )[0]
        )
        for mass in np.flatnonzero(system.wired.constant).tolist()
    }


def feeds(
    stage: DeadZoneStage,
    loads: Mapping[int, float],
    supply: float,
    resistors: Array,
    values: Mapping[str, float],
) -> dict[str, float] | None:
    """The resistors that feed the references: the largest that keep each one's current between its
    limits. None where there is none. loads : conductance on each reference [1/ohm], by its sign.
    A feed among ``values`` that does stays.
    """
    assert stage.reference is not None
    volts = stage.reference.voltage
    least = REFERENCE_MARGIN * (stage.reference.current.min or 0.0)
    most = (stage.reference.current.max or np.inf) / REFERENCE_MARGIN
    out = {}
    for sign, load in loads.items():
        name = stage.feeds[sign]
        current = (supply - volts) / resistors - volts * load
        fine = resistors[(current >= least) & (current <= most)]
        if not len(fine):
            return None
        known = [v for v in fine.tolist() if v == values.get(name)]
        out[name] = known[0] if known else float(fine[-1])
    return out
