"""From a model to chosen parts: linear block, dead zone, drive, and what can be said of them.

Lexicographic, as docs/synthesis.md explains: the linear block's error first, proved by the joins
of ``designer.linear_block``; then the dead zone's slope and null; each with the fewest distinct
values among its best. The finished circuit is then reduced and its error computed afresh.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from designer import dead_zone, linear_search, matching, topology
from designer.catalog import Catalog, OpAmp
from designer.circuit import Circuit
from designer.coefficients import CoefficientErrors, coefficient_errors
from designer.completion import Bounds
from designer.errors import InputError, Unreachable
from designer.linear_block import Targets
from designer.linear_search import PROOF_TOLERANCE, LinearBlock
from designer.model import Dimensionless
from designer.modelfile import CircuitSpec
from designer.selection import Shortfall
from designer.system import Array

SWING_SHARE = 0.85
"""Of the op-amp's limit: what the states' peaks may use; the rest is for spread and transients."""
LEVEL_RATIO = 4.0
"""Largest ratio between the peaks of the state voltages that belong together."""
SHARE = 1.6
"""How much larger than x1's peak voltage another state's may be: the clearance gets the swing."""
LOAD, SIGNAL = 2e3, (4.7e3, 5e5)
"""Least load of an output [ohm]; range of the signal resistors [ohm], for load and for noise."""
BASE = 1e4
"""Resistors that only set a level (inverters, inputs of the gain stages) [ohm]."""
LEAST_GAIN = 1.25
"""Of the saturating path, so that it does saturate where the clearance is never closed."""
GENERATOR_PEAK = 5.0
"""Largest amplitude asked of a generator [V]: 10 V peak to peak, what common ones give."""
LEAST_SIGNAL = 10.0
"""Peak of x1 over the op-amp's largest offset: below it a circuit shows offsets, not dynamics."""
FREES = {
    "frequency": "widen circuit.frequency or circuit.capacitor_range",
    "displacement integrators": "add a series to circuit.capacitors or widen circuit.frequency",
    "signal resistors": "widen circuit.resistor_range, or set circuit.side_conditions = false",
    "coefficients": "add a series to circuit.resistors or circuit.capacitors, or widen the ranges",
    "stop slope": "widen circuit.resistor_range (R50 is the stop) or take a finer series",
    "stop stiffness": "a smaller model.k0 or a wider circuit.resistor_range: R4 is too small",
    "dead-zone null": "a finer series, or a larger model.b: the threshold may be too small a part "
    "of the swing for the gain of the saturating path",
}


@dataclass(frozen=True)
class Peaks:
    """What the circuit has to hold: peaks of x1, x1', x2, x2' (4,) over all wanted responses and
    the starts from rest, and the deepest penetration of a stop, all in model units."""

    states: Array
    penetration: float


@dataclass(frozen=True)
class Certificate:
    """status : "optimal" or "bound"; lower_bound : no choice from this catalogue has a smaller
    max_error under the stated conditions; proof : how that is known."""

    status: str
    lower_bound: float
    proof: str


@dataclass(frozen=True)
class Design:
    """A finished choice of parts.

    errors are of the reduced circuit. conditions : side conditions that were kept, by name, with
    their values. solver : what the solver said of each stage. seconds : wall time.
    """

    model: Dimensionless
    circuit: Circuit
    errors: CoefficientErrors
    certificate: Certificate
    conditions: dict[str, float]
    solver: dict[str, str]
    seconds: float

    @property
    def distinct_values(self) -> int:
        """How many different values the resistors and capacitors have."""
        kinds = {(r.value, "R") for r in self.circuit.resistors}
        return len(kinds | {(c.value, "C") for c in self.circuit.capacitors})

    def amplitude(self, b: float | None = None) -> float:
        """Generator amplitude [V peak] that makes the clearance ``b`` (default: the model's)."""
        wanted = np.array([1.0 - self.model.f20, self.model.f20])
        gain = self.errors.drive_gain
        driven = gain > 0.0
        volts = float(np.exp(np.mean(np.log(wanted[driven] / gain[driven]))))
        return volts * (1.0 if b is None else self.model.b / b)

    def volts(self, b: float | None = None) -> Array:
        """(4,) volts per unit of each model state at clearance ``b``."""
        return self.errors.scales.volts * (1.0 if b is None else self.model.b / b)


def synthesise(model: Dimensionless, spec: CircuitSpec, catalog: Catalog, peaks: Peaks) -> Design:
    """Choose the parts.

    Raises
    ------
    InputError : a choice of the model file that this stage cannot build.
    Unreachable : no choice of parts meets the conditions; names the one that binds.
    """
    began = time.perf_counter()
    check_choices(model, spec, catalog)
    opamp = catalog.opamp(spec.opamp)
    saturation = spec.saturation or opamp.saturation_at(spec.supply)
    resistors = catalog.values(
        "resistor", spec.resistors, *spec.resistor_range, spec.resistor_grade
    )
    capacitors = catalog.values(
        "capacitor", spec.capacitors, *spec.capacitor_range, spec.capacitor_grade
    )
    base = _nearest(resistors, BASE)
    swing = SWING_SHARE * saturation
    bounds = _bounds(model, spec, peaks, resistors)
    prices = np.array(
        [catalog.part("capacitor", v, spec.capacitor_grade).price for v in capacitors.tolist()],
        dtype=float,
    )
    chosen = _linear(model, resistors, capacitors, prices, bounds)
    values = {
        name: _nearest(resistors if name.startswith("R") else capacitors, value)
        for name, value in chosen.values.items()
    }
    for state in range(4):
        for name in topology.inverter_resistors(state):
            values[name] = base
    solver = {"linear block": chosen.solver}
    # R6 and R12 do not enter the coefficients; ``_drive`` sizes them afterwards.
    values |= dict.fromkeys(("R6", "R12"), float(resistors[-1]))
    if model.k0 > 0.0:
        zone = _dead_zone(model, opamp, saturation, swing, peaks, resistors, base, values, spec)
        values |= zone.values
        solver["dead zone"] = zone.solver
    circuit = _build(model, values, opamp, spec, saturation)
    errors = _errors(circuit, model, swing, peaks)
    values |= _drive(model, errors, values, resistors)
    circuit = _build(model, values, opamp, spec, saturation)
    errors = _errors(circuit, model, swing, peaks)
    if spec.side_conditions:
        _check_signal(errors, peaks, opamp)
    return Design(
        model=model,
        circuit=circuit,
        errors=errors,
        certificate=_certificate(errors.max_error, chosen),
        conditions=_conditions(spec, bounds, swing),
        solver=solver,
        seconds=time.perf_counter() - began,
    )


def check_choices(model: Dimensionless, spec: CircuitSpec, catalog: Catalog) -> None:
    """Refuse what cannot be built before anything is computed.

    Raises
    ------
    InputError : an unknown op-amp, or a choice of the contract that this version does not build.
    """
    opamp = catalog.opamp(spec.opamp)
    low, high = opamp.supply.min or 0.0, opamp.supply.max or np.inf
    if not low <= spec.supply <= high:
        raise InputError(
            None, "circuit.supply", spec.supply, f"{low:g} to {high:g} V, the rails of {opamp.name}"
        )
    limit = spec.saturation or opamp.saturation_at(spec.supply)
    if not 0.0 < limit <= spec.supply:
        raise InputError(None, "circuit.saturation", limit, f"above 0 and up to {spec.supply:g} V")
    refusals = {
        "circuit.dead_zone": (spec.dead_zone != "saturation", spec.dead_zone, '"saturation"'),
        "circuit.objective": (spec.objective != "match", spec.objective, '"match"'),
        "circuit.composites": (spec.composites, "true", "false"),
        "model.sides": (
            model.k0 > 0.0 and model.sides != "both",
            model.sides,
            '"both": the saturating dead zone is two-sided',
        ),
    }
    for name, (wrong, found, expected) in refusals.items():
        if wrong:
            raise InputError(None, name, found, f"{expected} (all that this version builds)")


def _check_signal(errors: CoefficientErrors, peaks: Peaks, opamp: OpAmp) -> None:
    """Refuse a circuit whose displacement is as small as an op-amp's offset."""
    volts = float(errors.scales.volts[0] * peaks.states[0])
    if volts < LEAST_SIGNAL * opamp.offset_limit:
        raise Unreachable(
            None,
            "model.b",
            f"a peak of x1 of {volts:.2g} V beside offsets up to {opamp.offset_limit:g} V",
            "a clearance that is reached, a larger circuit.saturation, or a better op-amp",
        )


def _bounds(model: Dimensionless, spec: CircuitSpec, peaks: Peaks, resistors: Array) -> Bounds:
    low, high = spec.frequency
    seconds = (1.0 / (2.0 * np.pi * high), 1.0 / (2.0 * np.pi * low))
    gain = _output_gain(model, peaks)
    least = max(LOAD, float(resistors.min())) if spec.side_conditions else float(resistors.min())
    return Bounds(
        seconds=seconds,
        level=LEVEL_RATIO if spec.side_conditions else np.inf,
        share=SHARE if spec.side_conditions else np.inf,
        stop=least * model.mu / gain,
        peaks=peaks.states,
        signal=SIGNAL if spec.side_conditions else (0.0, np.inf),
    )


def _output_gain(model: Dimensionless, peaks: Peaks) -> float:
    """Largest fv slope: swing over the deepest penetration in volts, where x1 fills the swing."""
    return float(peaks.states[0] / max(peaks.penetration, 0.02 * peaks.states[0]))


def _linear(
    model: Dimensionless, resistors: Array, capacitors: Array, prices: Array, bounds: Bounds
) -> LinearBlock:
    targets = Targets.from_state_matrix(model.second_order().state_matrix())
    found = linear_search.best(targets, resistors, capacitors, prices, bounds)
    if isinstance(found, Shortfall):
        raise Unreachable(
            None,
            "circuit",
            f"no choice of parts; what binds: {found.what}",
            FREES.get(found.what, "a wider choice of parts"),
        )
    return found


def _dead_zone(
    model: Dimensionless,
    opamp: OpAmp,
    saturation: float,
    swing: float,
    peaks: Peaks,
    resistors: Array,
    base: float,
    values: dict[str, float],
    spec: CircuitSpec,
) -> dead_zone.DeadZone:
    """Size the stage for the scales of the linear block alone."""
    linear = replace(model, k0=0.0)
    errors = coefficient_errors(
        _build(linear, values, opamp, spec, saturation), linear.second_order()
    )
    relative = errors.scales.volts
    top = swing / float((peaks.states * relative).max())
    seconds = errors.scales.seconds
    found = dead_zone.size(
        dead_zone.DeadZoneTarget(
            mu=model.mu,
            slope=model.mu * values["C2"] * float(relative[1]) / seconds,
            saturation=saturation,
            threshold=min(model.b * top, saturation / LEAST_GAIN),
            linear_gain=swing / (top * float(peaks.states[0])),
            output_gain=swing / (top * max(peaks.penetration, 0.02 * float(peaks.states[0]))),
            load=max(LOAD, float(resistors.min())) if spec.side_conditions else 0.0,
        ),
        resistors,
        base,
        frozenset(values.values()),
    )
    if isinstance(found, str):
        raise Unreachable(None, "circuit", f"no dead zone; what binds: {found}", FREES[found])
    return found


def _build(
    model: Dimensionless,
    values: dict[str, float],
    opamp: OpAmp,
    spec: CircuitSpec,
    saturation: float,
) -> Circuit:
    system = model.second_order()
    return topology.build(
        matching.terms(system.damping.tolist(), system.stiffness.tolist(), system.force.tolist()),
        values,
        opamp,
        supply=spec.supply,
        saturation=saturation,
        clearance="A" if model.k0 > 0.0 else None,
    )


def _errors(
    circuit: Circuit, model: Dimensionless, swing: float, peaks: Peaks
) -> CoefficientErrors:
    """Errors of the circuit; without a clearance the peaks set the amplitude."""
    return coefficient_errors(
        circuit, model.second_order(), swing=None if circuit.stops else (swing, peaks.states)
    )


def _drive(
    model: Dimensionless, errors: CoefficientErrors, values: dict[str, float], resistors: Array
) -> dict[str, float]:
    """The drive's resistors: f20 as exact as can be, the amplitude within the generator's reach.

    A driven mass needs V_M = gain · R; among values with V_M in the upper half of what the
    generator gives, one that the circuit has already is taken first.
    """
    wanted = np.array([1.0 - model.f20, model.f20])
    names = np.array(["R6", "R12"])
    driven = wanted > 0.0
    placeholder = np.array([values["R6"], values["R12"]])
    per_ohm = np.where(driven, wanted / np.where(driven, errors.drive_gain * placeholder, 1.0), 0.0)
    if driven.all():
        i, j = (
            a.ravel() for a in np.meshgrid(np.arange(len(resistors)), np.arange(len(resistors)))
        )
        volts = per_ohm[0] * resistors[i]
        off = np.abs(np.log(volts / (per_ohm[1] * resistors[j])))
        good = (volts <= GENERATOR_PEAK) & (volts >= 0.2 * GENERATOR_PEAK)
        good = good if good.any() else np.ones(len(off), dtype=bool)
        best = np.flatnonzero(good)[np.lexsort((-volts[good], np.round(off[good], 9)))[0]]
        return {"R6": float(resistors[i[best]]), "R12": float(resistors[j[best]])}
    index = int(np.flatnonzero(driven)[0])
    volts = per_ohm[index] * resistors
    reach = volts <= GENERATOR_PEAK
    if not reach.any():
        return {str(names[index]): float(resistors[0])}
    top = float(resistors[reach][-1])
    known = [v for v in values.values() if v >= 1.0 and 0.5 * top <= v <= top]
    return {str(names[index]): max(known) if known else top}


def _nearest(values: Array, wanted: float) -> float:
    return float(values[int(np.argmin(np.abs(np.log(values / wanted))))])


def _certificate(reached: float, chosen: LinearBlock) -> Certificate:
    if chosen.proved and reached <= chosen.bound + PROOF_TOLERANCE:
        return Certificate("optimal", chosen.bound, f"{chosen.proof}; completed by {chosen.solver}")
    return Certificate("bound", min(chosen.bound, reached), chosen.proof)


def _conditions(spec: CircuitSpec, bounds: Bounds, swing: float) -> dict[str, float]:
    kept = {
        "frequency_low_hz": spec.frequency[0],
        "frequency_high_hz": spec.frequency[1],
        "swing_v": swing,
        "generator_peak_v": GENERATOR_PEAK,
        "stop_resistor_r4_low_ohm": float(bounds.stop),
    }
    if spec.side_conditions:
        kept |= {
            "signal_level_ratio": LEVEL_RATIO,
            "signal_share_ratio": SHARE,
            "load_ohm": LOAD,
            "signal_resistor_low_ohm": SIGNAL[0],
            "signal_resistor_high_ohm": SIGNAL[1],
        }
    return kept
