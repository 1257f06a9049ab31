"""How far a finished circuit's equation is from the model's: the coefficient error.

docs/definitions.md: the minimum over the time scale and a positive scale for each state of the
largest |ln(realised/wanted)| over all coefficients of the state equations. The dead-zone null, a
wanted zero, counts in units of K1: mu |ln(1 - leftover/slope)|. So does the constant force that a
stage with one stop leaves inside the clearance, over K1 times the threshold. Realised coefficients
come from the nodal reduction with ideal op-amps, never from the formulas that chose the parts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.base.arrays import Array
from designer.circuit.dead_zone_parts import OUTPUT
from designer.circuit.netlist import Board, Circuit, nominal_board
from designer.circuit.reduction import Reduction
from designer.circuit.scale_fit import minimax
from designer.model.mechanics import SecondOrderSystem

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
    """Magnitude of v1 at the upper stop, or at the only one [V]."""
    threshold_lower: float = float("nan")
    """Magnitude of v1 at the lower stop [V]. nan where there is none."""

    @property
    def offcentre(self) -> float:
        """How far the middle of the clearance lies from rest, over half the clearance.

        Stated, not an error: a DC offset of the generator moves it. 0 with one stop or none.
        """
        both = self.threshold + self.threshold_lower
        return float((self.threshold - self.threshold_lower) / both) if both == both else 0.0

    def frequency(self, omega: float) -> float:
        """Generator frequency [Hz] of a dimensionless frequency omega."""
        return float(omega / (2.0 * np.pi * self.seconds))


class CutShort(ArithmeticError):
    """An op-amp that is meant to be linear inside the clearance is not."""


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


def coefficient_errors(
    circuit: Circuit,
    model: SecondOrderSystem,
    board: Board | None = None,
    swing: tuple[float, Array] | None = None,
) -> CoefficientErrors:
    """Errors of ``circuit`` (or of one ``board`` of it) against the dimensionless ``model``.

    The amplitude is set by the clearance, volts[0] = threshold/b; without one, by ``swing``: the
    voltage [V] that the largest of the states' peaks (states,) shall have.

    Raises
    ------
    ArithmeticError : a coefficient has the wrong sign, so no scale makes it right; or an op-amp
        clips or a diode switches inside the clearance, so its stiffness is not one number.
    """
    reduction = Reduction(circuit, board or nominal_board(circuit, ideal=True))
    rest = reduction.system().mode(circuit.rest)
    dead_zone = _dead_zone(reduction) if circuit.stops else None
    realised = rest.A if dead_zone is None else dead_zone.A
    wanted = model.state_matrix()
    n = len(wanted)
    pairs = {
        f"{_state(i)}' {_state(j)}": (i, j, realised[i, j], wanted[i, j])
        for i, j in np.argwhere(wanted != 0.0).tolist()
    }
    if dead_zone is not None:
        stop = model.clearances[0]
        stiffness = -stop.first.stiffness / model.mass[stop.mass]
        pairs |= {name: (1, 0, slope, stiffness) for name, slope in dead_zone.slopes.items()}
    # The error is ln realised + ln seconds + ln volts_j - ln volts_i - ln wanted.
    h, D = np.zeros(len(pairs)), np.zeros((len(pairs), 1 + n))
    for row, (i, j, value, want) in enumerate(pairs.values()):
        h[row] = np.log(value / want) if value / want > 0.0 else np.inf
        D[row, 0] = 1.0
        D[row, 1 + j] += 1.0
        D[row, 1 + i] -= 1.0
    if not np.all(np.isfinite(h)):
        wrong = [name for name, value in zip(pairs, h, strict=True) if not np.isfinite(value)]
        raise ArithmeticError(f"coefficients of the wrong sign: {', '.join(wrong)}")
    D = D[:, [0, *range(2, 1 + n)]]  # volts of x1 is the amplitude, set below
    free = minimax(h, D)
    errors = dict(zip(pairs, (h + D @ free).tolist(), strict=True))
    relative = np.exp(np.concatenate([[0.0], free[1:]]))
    amplitude = 1.0
    if swing is not None:
        amplitude = swing[0] / float((swing[1] * relative).max())
    thresholds: dict[int, float] = {}
    if dead_zone is not None:
        thresholds = dead_zone.thresholds
        amplitude = next(iter(thresholds.values())) / model.clearances[0].first.gap
        mu = model.clearances[0].first.stiffness / -wanted[1, 0] / model.mass[0]
        errors["dead-zone null"] = float(mu * dead_zone.null)
        if len(thresholds) == 1:
            errors["dead-zone bias"] = dead_zone.bias
    lower = thresholds.get(-1, float("nan"))
    scales = Scales(
        seconds=float(np.exp(free[0])),
        volts=amplitude * relative,
        threshold=thresholds.get(1, lower),
        threshold_lower=lower,
    )
    drive = -rest.B * scales.seconds / scales.volts
    return CoefficientErrors(
        errors=errors,
        max_error=max(abs(e) for e in errors.values()),
        scales=scales,
        drive_gain=drive[1::2] * model.mass,
    )


@dataclass(frozen=True)
class _DeadZone:
    """A : the state matrix without the stop. slopes : the stop's entry in A, by error name.

    null : ln of the null's gain ratio, at the side where it is worst. bias : constant force inside
    the clearance over K1 times the threshold. thresholds : magnitude of v1 [V] by side.
    """

    A: Array
    slopes: dict[str, float]
    null: float
    bias: float
    thresholds: dict[int, float]


def _dead_zone(reduction: Reduction) -> _DeadZone:
    c = reduction.circuit
    stop = c.stops[0]
    system = reduction.system()
    state, row = c.states.index(stop.state), c.states.index(stop.state) + 1
    rest, inside = system.mode(c.rest), reduction.solution(c.rest).voltage[OUTPUT]
    flat = float(inside[state])
    slopes: dict[str, float] = {}
    thresholds: dict[int, float] = {}
    nulls: list[float] = []
    A, bias = rest.A, 0.0
    for side, contact in stop.contacts:
        key = c.carrying(contact)
        steep = float(reduction.solution(key).voltage[OUTPUT][state])
        per_gain = (system.mode(key).A - rest.A) / (steep - flat)
        switch = c.switches.index(contact.switch)
        guard = next(g for g in rest.guards if g.target[switch] == contact.position)
        end = -guard.e / float(guard.C[state])
        threshold = abs(end)
        _stays_linear(reduction, state, end, contact.switch)
        if not thresholds:
            A = rest.A - flat * per_gain
            force = float(inside[-1] * per_gain[row, state])
            bias = force / abs(float(A[row, state]) * threshold)
        thresholds[side] = threshold
        nulls.append(float(np.log1p(-flat / steep)))
        name = "upper stop slope" if side > 0 else "lower stop slope"
        if stop.shared or len(stop.contacts) == 1:
            name = "stop slope"
        slopes.setdefault(name, float(steep * per_gain[row, state]))
    return _DeadZone(A, slopes, max(nulls, key=abs), bias, thresholds)


def _stays_linear(reduction: Reduction, state: int, end: float, ends: str) -> None:
    """The mode at rest has to hold up to where contact begins, at ``end`` [V]."""
    c = reduction.circuit
    for guard in reduction.system().mode(c.rest).guards:
        pairs = zip(c.switches, c.rest, guard.target, strict=True)
        switch = next(name for name, here, there in pairs if here != there)
        reach = abs(float(guard.C[state]) * end) + abs(guard.e)
        if switch != ends and float(guard.C[state]) * end + guard.e > 1e-9 * reach:
            raise CutShort(f"{switch} changes inside the clearance, before v1 = {end:.4g} V")


def _state(i: int) -> str:
    return f"x{i // 2 + 1}" + ("'" if i % 2 else "")
