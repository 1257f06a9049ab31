"""The paper's Fig. 7 and Fig. 8 in ngspice: the nonlinear stage alone, and the whole circuit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from designer.base.arrays import Array
from designer.circuit.board_values import nominal_board
from designer.circuit.dead_zone_place import OUTPUT
from designer.circuit.netlist import GROUND, Circuit, Excitation, Generator, Section
from designer.kernels.kernel_boards import POINTS
from designer.paper.circuits import Built, SettledResponse
from designer.spice import deck, numerics_gate
from designer.spice.deck import SolverSettings
from designer.spice.numerics_gate import GateResult, GateSubject
from designer.spice.pool import SpicePool
from designer.spice.simulator import SimulationFailed, SpiceJob, Waveforms

FINE = 8 * POINTS
"""Points of a drive period of a portrait: a contact of p = 8 still is a curve."""
DISPLACEMENT = "v1"
"""Net that the stage is fed from."""


@dataclass(frozen=True)
class NgspiceResponse:
    """One response in ngspice, with the settings that passed the gate."""

    response: str
    """n-p-q or status that ngspice shows."""
    passed: bool
    """Whether settings passed the gate."""
    reason: str
    """Why there is no answer, or ""."""
    steps: int
    """Steps a drive period."""
    trace: Array
    """(n · FINE + 1, 4) states in model units from a strobe on; empty where there is none."""

    @property
    def displacement(self) -> Array:
        """(n · POINTS,) of the first mass."""
        return self.trace[: -1 : FINE // POINTS, 0] if len(self.trace) else np.zeros(0)


def stage_curve(pool: SpicePool, circuit: Circuit, reach: float, points: int) -> Array:
    """(k, 2) v1 and the nonlinear stage's output [V], by ``.dc`` over ± reach.

    The stage is cut out of the circuit and fed by a source; op-amps of the fidelity ``ideal``.

    Raises
    ------
    SimulationFailed : ngspice gives no such curve.
    """
    step = 2.0 * reach / points
    board = nominal_board(circuit)
    stage = replace(
        circuit,
        parts=tuple(p for p in circuit.parts if p.name in _stage(circuit)),
        generator=Generator("VM1", DISPLACEMENT),
        states=(),
        state_nets=(),
    )
    settings = SolverSettings("trap", 1.0, reltol=1e-6, abstol=1e-14, vntol=1e-9)
    text = deck.write(
        stage, board, Excitation(1.0, 1.0), settings, title="nonlinear stage", stop_time=1.0
    )
    lines = []
    for line in text.splitlines():
        word = line.split(maxsplit=1)[0]
        if word == "VM1":
            line = f"VM1 {DISPLACEMENT} 0 DC 0"
        elif word == ".tran":
            line = f".dc VM1 {-reach!r} {reach + 0.5 * step!r} {step!r}"
        lines.append(line)
    job = SpiceJob("\n".join(lines) + "\n", (OUTPUT,), reach - 0.01 * step, _whole, "dc")
    for _, answer in pool.map([job]):
        if isinstance(answer, SimulationFailed):
            raise answer
        return np.column_stack([answer.axis, answer.signals[OUTPUT].real])
    raise SimulationFailed("ngspice gave no answer")


def ngspice_responses(
    pool: SpicePool, one: Built, settled: Sequence[SettledResponse]
) -> tuple[NgspiceResponse, ...]:
    """Every response that the exact circuit shows periodically, behind the numerics gate."""
    reduction = one.reduction()
    subjects = [
        GateSubject(reduction, one.excitation(f.omega), f.orbit) for f in settled if f.orbit.n
    ]
    results = iter(numerics_gate.check(pool, subjects))
    return tuple(
        _response(next(results), one, f)
        if f.orbit.n
        else NgspiceResponse("", False, "", 0, np.zeros((0, 4)))
        for f in settled
    )


def _response(result: GateResult, one: Built, settled: SettledResponse) -> NgspiceResponse:
    steps = result.tried[-1]
    if isinstance(result.read, SimulationFailed):
        return NgspiceResponse("failed", False, result.read.reason, steps, np.zeros((0, 4)))
    orbit = result.read.orbit
    trace = np.zeros((0, 4))
    if orbit.n and result.read.trace is not None:
        time, states = result.read.trace
        grid = np.linspace(0.0, time[-1], orbit.n * FINE + 1)
        trace = np.stack([np.interp(grid, time, column) for column in states.T], axis=1) / one.volts
    reason = "" if result.passed else "the numerics gate did not pass"
    return NgspiceResponse(orbit.response, result.passed, reason, steps, trace)


def _stage(circuit: Circuit) -> set[str]:
    """Names of the parts that make the stage's output of v1: what is more going back from the
    output, but for integrators and what feeds them. A section is more at its output alone."""
    summing = {c.minus for c in circuit.capacitors}
    ends = {GROUND, DISPLACEMENT} | {rail.net for rail in circuit.rails}
    left = [p for p in circuit.parts if not summing & set(p.nets)]
    nets, names = {OUTPUT}, set[str]()
    while True:
        more = [
            p
            for p in left
            if p.name not in names and nets & {*([p.output] if isinstance(p, Section) else p.nets)}
        ]
        if not more:
            return names
        names |= {p.name for p in more}
        nets |= {net for p in more for net in p.nets} - ends


def _whole(sweep: Waveforms) -> Waveforms:
    return sweep
