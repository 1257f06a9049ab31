"""How far a finished circuit's equation is from the model's: the coefficient error.

docs/definitions.md: the minimum over the time scale and a positive scale for each state of the
largest |ln(realised/wanted)| over all coefficients of the state equations. The dead-zone null, a
wanted zero, counts in units of K1: mu |ln(1 - leftover/slope)|. Realised coefficients come from
the nodal reduction with ideal op-amps, never from the formulas that chose the parts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from designer.circuit import Board, Circuit, nominal_board
from designer.mechanics import SecondOrderSystem
from designer.minimax import minimax
from designer.reduction import Reduction
from designer.system import Array


@dataclass(frozen=True)
class Scales:
    """How circuit and model correspond: v_i = volts[i] · x_i, T = seconds · t.

    seconds : circuit seconds per unit of model time. volts : (states,) volts per unit of each
    model state (x1, dx1/dt, …). threshold : v1 at the upper stop [V] (nan without a clearance).
    """

    seconds: float
    volts: Array
    threshold: float

    def frequency(self, omega: float) -> float:
        """Generator frequency [Hz] of a dimensionless frequency omega."""
        return float(omega / (2.0 * np.pi * self.seconds))


@dataclass(frozen=True)
class CoefficientErrors:
    """errors : ln(realised/wanted) by coefficient, at the best scales; max_error : the largest.

    drive_gain : model force per generator volt, for the driven masses (0 where not driven).
    """

    errors: dict[str, float]
    max_error: float
    scales: Scales
    drive_gain: Array


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
    ArithmeticError : a coefficient has the wrong sign, so no scale makes it right.
    """
    board = nominal_board(circuit, ideal=True) if board is None else board
    reduction = Reduction(circuit, board)
    system = reduction.system()
    open_mode = system.mode(system.start)
    A_lin, slope, null, threshold = open_mode.A, None, 0.0, float("nan")
    if circuit.stops:
        A_lin, slope, null, threshold = _dead_zone(reduction)
    wanted = model.state_matrix()
    n = len(wanted)
    rows, targets, names = [], [], []

    def add(name: str, i: int, j: int, realised: float, want: float) -> None:
        # ln realised + ln seconds + ln volts_j - ln volts_i - ln wanted
        row = np.zeros(1 + n)
        row[0] = 1.0
        row[1 + j] += 1.0
        row[1 + i] -= 1.0
        rows.append(row)
        ratio = realised / want
        targets.append(np.log(ratio) if ratio > 0.0 else np.inf)
        names.append(name)

    for i in range(n):
        for j in range(n):
            if wanted[i, j] != 0.0:
                add(f"{_equation(i)} {_state(j)}", i, j, A_lin[i, j], wanted[i, j])
    if slope is not None:
        stop = model.clearances[0]
        add("stop slope", 1, 0, slope, -stop.stiffness / model.mass[stop.mass])
    h, D = np.array(targets), np.array(rows)
    if not np.all(np.isfinite(h)):
        wrong = [name for name, value in zip(names, h, strict=True) if not np.isfinite(value)]
        raise ArithmeticError(f"coefficients of the wrong sign: {', '.join(wrong)}")
    free = minimax(h, D[:, [0, *range(2, 1 + n)]])  # volts of x1 is the amplitude, set below
    residual = h + D[:, [0, *range(2, 1 + n)]] @ free
    errors = dict(zip(names, (float(e) for e in residual), strict=True))
    relative = np.exp(np.concatenate([[0.0], free[1:]]))
    amplitude = 1.0
    if swing is not None:
        amplitude = swing[0] / float((swing[1] * relative).max())
    if circuit.stops:
        amplitude = threshold / model.clearances[0].gap
        mu = model.clearances[0].stiffness / -wanted[1, 0] / model.mass[0]
        errors["dead-zone null"] = float(mu * null)
    scales = Scales(
        seconds=float(np.exp(free[0])),
        volts=amplitude * relative,
        threshold=threshold,
    )
    drive = -open_mode.B * scales.seconds / scales.volts
    return CoefficientErrors(
        errors=errors,
        max_error=max(abs(e) for e in errors.values()),
        scales=scales,
        drive_gain=drive[1::2] * model.mass,
    )


def _dead_zone(reduction: Reduction) -> tuple[Array, float, float, float]:
    """(A without the stop, slope of the stop in A, ln of the null's gain ratio, threshold [V])."""
    c = reduction.circuit
    stop = c.stops[0]
    index = [s.name for s in c.sections].index(stop.section)
    start = (0,) * len(c.sections)
    contact = (*start[:index], stop.upper, *start[index + 1 :])
    system = reduction.system()
    state = c.states.index(stop.state)
    flat = float(reduction.solution(start).voltage["fv"][state])
    steep = float(reduction.solution(contact).voltage["fv"][state])
    A_open, A_contact = system.mode(start).A, system.mode(contact).A
    per_gain = (A_contact - A_open) / (steep - flat)
    guard = next(g for g in system.mode(start).guards if g.target == contact)
    threshold = -guard.e / float(guard.C[state])
    row = 1
    return (
        A_open - flat * per_gain,
        float(steep * per_gain[row, state]),
        float(np.log1p(-flat / steep)),
        threshold,
    )


def _state(j: int) -> str:
    return f"x{j // 2 + 1}" + ("'" if j % 2 else "")


def _equation(i: int) -> str:
    """The left-hand side of state equation i."""
    return f"x{i // 2 + 1}''" if i % 2 else f"x{i // 2 + 1}'"
