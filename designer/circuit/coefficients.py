"""How far a finished circuit's equation is from the model's: the coefficient error.

docs/definitions.md: the minimum over the time scale and a positive scale for each state of the
largest |ln(realised/wanted)| over all coefficients of the state equations, gaps among them but for
the one that sets the amplitude. A dead-zone null, a wanted zero, counts in units of the spring on
its mass: mu |ln(1 - leftover/slope)|. So does a constant force, over that spring times a gap.
Realised coefficients come from the nodal reduction with ideal op-amps, never from the formulas that
chose the parts. Of a dead zone of velocities what is said of displacements holds of velocities.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np

from designer.base.arrays import Array
from designer.circuit.board_values import Board, nominal_board
from designer.circuit.netlist import Circuit
from designer.circuit.reduction import Reduction
from designer.circuit.scale_fit import minimax
from designer.model.clearance import Clearance
from designer.model.mechanics import SecondOrderSystem, state_names


class CutShort(ArithmeticError):
    """An op-amp that is meant to be linear inside the clearance is not."""


@dataclass(frozen=True)
class DeadZoneReading:
    """One clearance of a board, in volts and seconds."""

    clearance: Clearance
    """The clearance as wanted."""
    leftover: Array
    """(n, n) what the stage adds to the state matrix while the clearance is open."""
    constant: Array
    """(n,) what it adds to the rates of the states then, as a constant."""
    slopes: dict[int, Array]
    """(n, n) what it adds to the state matrix in contact, by side; one under 0 where both sides are
    ends of one switch, or where there is only one."""
    nulls: dict[int, float]
    """ln of the null's gain ratio, by side."""
    bias: float
    """Constant force inside the clearance, over the mass's springs at the threshold."""
    thresholds: dict[int, float]
    """Displacement of the mass [V] at which contact begins, by side, positive away from rest."""

    @property
    def first_gap(self) -> tuple[int, float]:
        """The first side whose gap is not zero, and that gap.

        Raises
        ------
        StopIteration : every gap is zero.
        """
        return next((side, stop.gap) for side, stop in self.clearance.sides if stop.gap)

    @classmethod
    def of(cls, reduction: Reduction, index: int, clearance: Clearance) -> DeadZoneReading:
        """The stage of the clearance with this index.

        Raises
        ------
        CutShort : the open mode does not hold up to where contact begins.
        """
        c = reduction.circuit
        stop = c.dead_zones[index]
        system = reduction.system()
        state, row = c.states.index(stop.state), 2 * clearance.mass + 1
        rest, inside = system.mode(c.open), reduction.solution(c.open).voltage[stop.output]
        flat = float(inside[state])
        slopes: dict[int, Array] = {}
        thresholds: dict[int, float] = {}
        nulls: dict[int, float] = {}
        leftover, constant = np.zeros_like(rest.A), np.zeros_like(rest.d)
        bias = 0.0
        for side, contact in stop.contacts:
            key = c.carrying(contact)
            steep = float(reduction.solution(key).voltage[stop.output][state])
            change = system.mode(key).A - rest.A
            per_gain = change / (steep - flat)
            end = reduction.threshold(stop, contact)
            _stays_linear(reduction, index, end, contact.switch)
            if not thresholds and not stop.limits:
                leftover = flat * per_gain
                constant = float(inside[-1]) * per_gain[:, state]
                spring = abs(float((rest.A - leftover)[row, state]))
                bias = float(inside[-1] * per_gain[row, state]) / (spring * abs(end) or np.inf)
            thresholds[side] = side * end
            one = stop.shared or len(stop.contacts) == 1
            left, own = (steep, flat) if stop.limits else (flat, steep)
            nulls[side] = float(np.log1p(-left / own))
            slopes.setdefault(0 if one else side, change if stop.limits else steep * per_gain)
        return cls(clearance, leftover, constant, slopes, nulls, bias, thresholds)


def _stays_linear(reduction: Reduction, index: int, end: float, ends: str) -> None:
    """The open mode has to hold up to where contact begins, at ``end`` [V], whatever the stages of
    other clearances do there, and the amplifiers in front of them. Between two masses ``end`` is
    where one would be with the other one at rest, so only the stage's own amplifiers count."""
    c = reduction.circuit
    zones = c.dead_zones
    state, own = c.states.index(zones[index].state), zones[index].difference
    others = {name for k, stop in enumerate(zones) if k != index for name in stop.switches}
    fronts = {zone.difference[0] for zone in zones if zone.difference not in (None, own)}
    others |= {section.name for section in c.sections if section.output in fronts}
    if own is not None:
        others |= {s.name for s in c.sections if s.output != own[0]} - set(zones[index].switches)
    for guard in reduction.system().mode(c.open).guards:
        pairs = zip(c.switches, c.open, guard.target, strict=True)
        switch = next(name for name, here, there in pairs if here != there)
        reach = abs(float(guard.C[state]) * end) + abs(guard.e)
        if switch not in {ends, *others} and float(guard.C[state]) * end + guard.e > 1e-9 * reach:
            raise CutShort(f"{switch} changes inside the clearance, before v1 = {end:.4g} V")


LARGE_ERROR = 0.01
"""A largest coefficient error above this is said first, and makes a stage worse than another."""
EXACT = 1e-6
"""What a coefficient error means: one up to this is none ("exact"), two that differ by no more are
equal, one this close to its lower bound is proved, a condition that costs less does not bind."""


@dataclass(frozen=True)
class Scales:
    """How circuit and model correspond: v_i = volts[i] · x_i, T = seconds · t."""

    seconds: float
    """Circuit seconds per unit of model time."""
    volts: Array
    """(states,) volts per unit of each model state (x1, dx1/dt, …)."""
    threshold: float
    """The moving mass's displacement at the first clearance's upper stop, or at the only one, as a
    distance from rest [V]; negative where the stop is in contact at rest."""
    threshold_lower: float = float("nan")
    """The threshold of the lower stop; nan where there is none."""
    middle: float = 0.0
    """Where the middle of the clearance is wanted, over half the clearance."""

    @property
    def offcentre(self) -> float:
        """How far the clearance's middle lies from where it is wanted, over half the clearance.

        Stated, not an error: a DC offset of the generator moves it. 0 with one stop or none.
        """
        both = self.threshold + self.threshold_lower
        if both != both:
            return 0.0
        return float((self.threshold - self.threshold_lower) / both) - self.middle

    def frequency(self, omega: float) -> float:
        """Generator frequency [Hz] of a dimensionless frequency omega."""
        return float(omega / (2.0 * np.pi * self.seconds))


@dataclass(frozen=True)
class CoefficientErrors:
    """How far the circuit's coefficients lie from the model's."""

    errors: dict[str, float]
    """ln(realised/wanted) by coefficient, at the best scales."""
    max_error: float
    """The largest size among the errors."""
    scales: Scales
    """How circuit and model correspond, with the least ``max_error``."""
    drive_gain: Array
    """Model force per generator volt, for the driven masses (0 where not driven)."""
    second_gain: Array
    """Model force per volt of the generator's second channel, for the masses that it drives."""
    slopes: Array
    """(errors, 1 + states) change of each error with the logarithms of the time scale and of each
    state's volts."""


@dataclass(frozen=True)
class _Coefficient:
    """One logarithm of realised over wanted, and how the scales move it.

    weights : by scale, 0 the time's and 1 + i that of state i.
    """

    log: float
    weights: dict[int, float]


def coefficient_errors(
    circuit: Circuit,
    model: SecondOrderSystem,
    board: Board | None = None,
    swing: tuple[float, Array] | None = None,
) -> CoefficientErrors:
    """Errors of ``circuit`` (or of one ``board`` of it) against ``model``.

    The amplitude is set by the first gap that is not zero, volts[0] = threshold/b; without one, by
    ``swing``: the voltage [V] that the largest of the states' peaks (states,) shall have.

    Raises
    ------
    ArithmeticError : a coefficient has the wrong sign, so no scale makes it right; or an op-amp
        clips or a diode switches inside the clearance, so its stiffness is not one number.
    """
    reduction = Reduction(circuit, board or nominal_board(circuit, ideal=True))
    rest = reduction.system().mode(circuit.open)
    zones = [DeadZoneReading.of(reduction, k, c) for k, c in enumerate(model.dead_zones)]
    realised = rest.A
    for zone in zones:
        realised = realised - zone.leftover
    wanted = model.state_matrix()
    coefficients = _entries(realised, wanted)
    for zone in zones:
        coefficients |= _slopes(zone, model, several=len(zones) > 1)
    lead = next((z for z in zones if any(stop.gap for _, stop in z.clearance.sides)), None)
    if lead is not None:
        coefficients |= _gaps(zones, lead)
    errors, logs = _least(coefficients, len(wanted))
    relative = np.exp(np.concatenate([[0.0], logs[1:]]))
    amplitude = 1.0
    if lead is not None:
        side, gap = lead.first_gap
        amplitude = abs(lead.thresholds[side] / gap) / float(relative[lead.clearance.watched])
    elif swing is not None:
        amplitude = swing[0] / float((swing[1] * relative).max())
    for zone in zones:
        errors |= _flatness(zone, model, several=len(zones) > 1)
    scales = _scales(float(np.exp(logs[0])), amplitude * relative, zones)
    if model.wired.constant.any():
        errors |= _constants(rest.d, zones, lead, model, scales)
    none = np.zeros_like(rest.B)
    drive, second_drive = (
        -inputs[1::2] * scales.seconds / scales.volts[1::2] * model.mass
        for inputs in (rest.B, none if rest.second is None else rest.second)
    )
    return CoefficientErrors(
        errors=errors,
        max_error=max(abs(e) for e in errors.values()),
        scales=scales,
        drive_gain=drive,
        second_gain=second_drive,
        slopes=_scale_slopes(coefficients, errors, len(wanted)),
    )


def _entries(realised: Array, wanted: Array) -> dict[str, _Coefficient]:
    """The entries of the state matrix."""
    names = state_names(len(wanted) // 2)
    return {
        f"{names[i]}' {names[j]}": _entry(i, j, realised[i, j], wanted[i, j])
        for i, j in np.argwhere(wanted != 0.0).tolist()
    }


def _entry(i: int, j: int, value: float, want: float) -> _Coefficient:
    """Its error is ln realised + ln seconds + ln volts_j - ln volts_i - ln wanted."""
    weights = {0: 1.0, 1 + j: 0.0, 1 + i: 0.0}
    weights[1 + j] += 1.0
    weights[1 + i] -= 1.0
    return _Coefficient(_log(value, want), weights)


def _log(value: float, want: float) -> float:
    return float(np.log(value / want)) if value / want > 0.0 else np.inf


def _slopes(
    zone: DeadZoneReading, model: SecondOrderSystem, *, several: bool
) -> dict[str, _Coefficient]:
    """The force of each stop on each mass, by each displacement, velocity, or both."""
    clearance = zone.clearance
    row, push = model.displacement(clearance), model.push(clearance)
    pairs = [(i, j) for i, _ in clearance.pushed for j, _ in clearance.terms]
    stops = dict(clearance.sides)
    out = {}
    end = f" {clearance.name}" if several else ""
    for side, slope in zone.slopes.items():
        word = {0: "", 1: "upper ", -1: "lower "}[side]
        stiffness = (clearance.first if side == 0 else stops[side]).stiffness
        kind = "bend slope" if clearance.bend_of else "stop slope"
        forces = [(kind, stiffness, clearance.quantity == "velocity")]
        if clearance.damping:
            forces.append(("stop damping", clearance.damping, True))
        for (what, factor, velocity), (i, j) in product(forces, pairs):
            name = f"{word}{what}{end}"
            if not i == j == clearance.mass:
                name += f" x{i + 1}' x{j + 1}" + ("'" if velocity else "")
            want = -factor * push[i] * row[j] / model.mass[i]
            column = 2 * j + velocity
            out[name] = _entry(2 * i + 1, column, slope[2 * i + 1, column], want)
    return out


def _gaps(zones: list[DeadZoneReading], lead: DeadZoneReading) -> dict[str, _Coefficient]:
    """Each further gap over the one that sets the amplitude.

    An even clearance alone has none: an offset of the generator moves its middle.
    """
    first, unit = lead.first_gap
    out = {}
    for zone in zones:
        if len(zones) == 1 and zone.clearance.upper == zone.clearance.lower:
            continue
        own, unit_state = zone.clearance.watched, lead.clearance.watched
        for side, stop in zone.clearance.sides:
            if not stop.gap or (zone is lead and side == first):
                continue
            ratio = zone.thresholds[side] / abs(lead.thresholds[first])
            weights = {1 + own: 0.0, 1 + unit_state: 0.0}
            weights[1 + own] -= 1.0
            weights[1 + unit_state] += 1.0
            kind = "bend" if zone.clearance.bend_of else "gap"
            name = f"{kind} {zone.clearance.name} {'upper' if side > 0 else 'lower'}"
            out[name] = _Coefficient(_log(ratio, stop.gap / abs(unit)), weights)
    return out


def _least(coefficients: dict[str, _Coefficient], states: int) -> tuple[dict[str, float], Array]:
    """The errors at the scales that make the largest least, and the logarithms (states,) of those:
    the time's and those of the states over the first one's, which moves none."""
    h = np.array([c.log for c in coefficients.values()])
    if not np.all(np.isfinite(h)):
        wrong = [name for name, c in coefficients.items() if not np.isfinite(c.log)]
        raise ArithmeticError(f"coefficients of the wrong sign: {', '.join(wrong)}")
    D = _scale_slopes(coefficients, coefficients, states)
    free = _best_scales(h.tobytes(), D.tobytes(), states)
    return dict(zip(coefficients, (h + _free(D) @ free).tolist(), strict=True)), free


@lru_cache(maxsize=1)
def _best_scales(h: bytes, D: bytes, states: int) -> Array:
    """Kept: a circuit is asked about again once its drive is chosen, which moves no coefficient."""
    free = minimax(np.frombuffer(h), _free(np.frombuffer(D).reshape(-1, 1 + states)))
    free.flags.writeable = False
    return free


def _free(D: Array) -> Array:
    """Without the volts of x1, the amplitude, which a gap sets."""
    return D[:, [0, *range(2, D.shape[1])]]


def _scale_slopes(
    coefficients: Mapping[str, _Coefficient], names: Collection[str], states: int
) -> Array:
    """(names, 1 + states) weights of the scales; 0 for what is no logarithm of a coefficient."""
    D = np.zeros((len(names), 1 + states))
    for row, name in enumerate(names):
        for place, weight in coefficients[name].weights.items() if name in coefficients else ():
            D[row, place] += weight
    return D


def _flatness(
    zone: DeadZoneReading, model: SecondOrderSystem, *, several: bool
) -> dict[str, float]:
    """What the stage leaves inside its clearance: stiffness and, with one stop, a constant."""
    own = model.own_slope(zone.clearance) or abs(zone.clearance.first.stiffness)
    shares = [stop.stiffness / own * zone.nulls[side] for side, stop in zone.clearance.sides]
    end = f" {zone.clearance.name}" if several else ""
    out = {f"dead-zone null{end}": float(max(shares, key=abs))}
    if len(zone.thresholds) == 1 and zone.clearance.first.gap:
        out[f"dead-zone bias{end}"] = zone.bias
    return out


def _scales(seconds: float, volts: Array, zones: list[DeadZoneReading]) -> Scales:
    """Thresholds of the first clearance are those that the circuit has."""
    if not zones or zones[0].clearance.bend_of:
        return Scales(seconds, volts, float("nan"))
    clearance, thresholds = zones[0].clearance, zones[0].thresholds
    lower, middle = thresholds.get(-1, float("nan")), 0.0
    if clearance.upper is not None and clearance.lower is not None:
        upper_gap, lower_gap = clearance.upper.gap, clearance.lower.gap
        middle = (upper_gap - lower_gap) / (upper_gap + lower_gap)
    return Scales(seconds, volts, thresholds.get(1, lower), lower, middle)


def _constants(
    d: Array,
    zones: list[DeadZoneReading],
    lead: DeadZoneReading | None,
    model: SecondOrderSystem,
    scales: Scales,
) -> dict[str, float]:
    """Error of each constant force over the mass's springs at the gap that sets the amplitude;
    without a gap over the largest force of the drive."""
    for zone in zones:
        d = d - zone.constant
    forces = d[1::2] * scales.seconds / scales.volts[1::2] * model.mass
    if lead is None:
        units = np.full(model.size, model.largest_force)
    else:
        units = np.abs(np.diag(model.spanning_stiffness)) * abs(lead.first_gap[1])
    return {
        f"constant x{i + 1}": float((forces[i] - model.constant[i]) / units[i])
        for i in np.flatnonzero(model.wired.constant).tolist()
    }
