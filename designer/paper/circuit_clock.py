"""The claim "a third of the time": the circuit in SPICE against Runge-Kutta, each as it may be run.

The paper's Runge-Kutta has Δt = 0.005; its language is not given, so there are three, and SciPy's.
The circuit is the corrected one on its response: in ngspice with ideal op-amps at the settings that
pass the gate and at ngspice's own tolerance, with the full model of the op-amps, and by the exact
flow. Each one's error is against the exact flow of its own equations, after as many periods as all
the others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from designer.base.arrays import Array
from designer.circuit.ensemble import displacement
from designer.circuit.paper_values import MODEL
from designer.dynamics.flow import Flow
from designer.fidelity import runge_kutta
from designer.fidelity.cpu_clock import Entrant, SpiceClock, here, rounds
from designer.fidelity.runge_kutta import PAPERS_STEP
from designer.kernels.kernel_boards import POINTS
from designer.model.find_responses import ModelResponse
from designer.paper.circuits import Built, SettledResponse, model_flow
from designer.spice import numerics_gate
from designer.spice.deck import SolverSettings
from designer.spice.numerics_gate import GateSubject
from designer.spice.pool import SpicePool
from designer.spice.simulator import SimulationFailed
from designer.verdicts.exact_circuit import waveform_error

PERIODS = 20
"""Drive periods after which errors are taken, and of every run of ngspice."""
ROUNDS = 7
RTOL = 1e-6
"""SciPy's relative and absolute tolerance."""
DEFAULT_RELTOL = 1e-3
"""ngspice's own."""
BASE = "Runge-Kutta, NumPy"
"""What the times are put over."""
CLAIM = 1.0 / 3.0
"""Section 5.3."""


@dataclass(frozen=True)
class _Entry:
    setting: str
    entrant: Entrant
    error: float


def measure(
    pool: SpicePool,
    one: Built,
    response: ModelResponse,
    settled: SettledResponse,
    *,
    rounds_: int = ROUNDS,
    progress: Callable[[], None] = lambda: None,
) -> list[dict[str, Any]]:
    """Every method on one response, a row each; pool : of one worker.

    name, setting : of the method. seconds : CPU time of a drive period [s], median of the rounds.
    ratio : to that of ``BASE`` in the same round, median. error : RMS of x1 over a drive period,
    over its peak; nan without a run.
    """
    entries = [*_models(response), *_circuits(pool, one, settled)]
    taken = rounds([e.entrant for e in entries], rounds_, progress)
    base = next(i for i, e in enumerate(entries) if e.entrant.name == BASE)
    seconds, ratios = np.median(taken, axis=0), np.median(taken / taken[:, base, None], axis=0)
    return [
        {
            "name": e.entrant.name,
            "setting": e.setting,
            "seconds": float(s),
            "ratio": float(r),
            "error": e.error,
        }
        for e, s, r in zip(entries, seconds, ratios, strict=True)
    ]


def _models(response: ModelResponse) -> list[_Entry]:
    omega, start = response.omega, response.orbit.start
    flow = model_flow(omega)
    steps = round(flow.drive.period / PAPERS_STEP)
    wanted = displacement(flow, response.orbit)[None, :]
    setting = f"Δt = {PAPERS_STEP:g}"
    # To the nearest multiple of the points of a period: its error is that of the step.
    fine = max(1, round(steps / POINTS)) * POINTS
    after = runge_kutta.run(MODEL, omega, start, PERIODS, fine)
    drawn = runge_kutta.trace(MODEL, omega, after, 1, POINTS, fine)[:-1, 0]
    error = waveform_error(drawn, wanted)
    methods: list[tuple[str, Callable[[int], object]]] = [
        (BASE, lambda n: runge_kutta.run_arrays(MODEL, omega, start, n, steps)),
        (
            "Runge-Kutta, plain Python",
            lambda n: runge_kutta.run(MODEL, omega, start, n, steps, carry=runge_kutta.numbers),
        ),
        ("Runge-Kutta, numba", lambda n: runge_kutta.run(MODEL, omega, start, n, steps)),
    ]
    entries = [_Entry(setting, here(name, run, 1), error) for name, run in methods]
    span = flow.drive.period
    last = _scipy(omega, start, PERIODS * span, np.zeros(0))
    times = span * np.arange(POINTS) / POINTS
    shown = _scipy(omega, last[:, -1], float(times[-1]), times)[0]
    entries.append(
        _Entry(
            f"rtol = {RTOL:g}",
            here("SciPy RK45", lambda n: _scipy(omega, start, n * span, np.zeros(0)), 1),
            waveform_error(shown, wanted),
        )
    )
    entries.append(_Entry("", here("exact flow, model", lambda n: flow.run(start, n), 100), 0.0))
    return entries


def _scipy(omega: float, start: Array, end: float, times: Array) -> Array:
    """(4, k) states at ``times``, or at the end where there are none."""
    A = MODEL.second_order().state_matrix()
    B = np.zeros(4)
    B[1::2] = MODEL.second_order().force / MODEL.second_order().mass

    def rhs(t: float, x: Array) -> Array:
        out = A @ x + B * np.sin(omega * t)
        out[1] -= MODEL.mu * (x[0] - min(max(x[0], -MODEL.b), MODEL.b))
        return np.asarray(out)

    wanted = times if len(times) else np.array([end])
    return np.asarray(solve_ivp(rhs, (0.0, end), start, rtol=RTOL, atol=RTOL, t_eval=wanted).y)


def _circuits(pool: SpicePool, one: Built, settled: SettledResponse) -> list[_Entry]:
    reduction, orbit = one.reduction(), settled.orbit
    excitation = one.excitation(settled.omega)
    subject = GateSubject(reduction, excitation, orbit)
    flow = Flow(subject.system, excitation.drive)
    wanted = displacement(flow, orbit)[None, :]
    (passed,) = numerics_gate.check(pool, [subject])
    rough = SolverSettings("trap", subject.period / numerics_gate.STEPS_PER_PERIOD, DEFAULT_RELTOL)
    clock = SpiceClock(pool)
    entries = [
        _Entry("", here("exact flow, circuit", lambda n: flow.run(orbit.start, n), 100), 0.0)
    ]
    runs = (
        ("ngspice, ideal op-amps", subject, passed.settings),
        ("ngspice, ideal op-amps, coarse", subject, rough),
        ("ngspice, full op-amps", replace(subject, fidelity="full"), passed.settings),
    )
    for name, who, settings in runs:
        long = replace(who, discard=PERIODS - 4 * orbit.n)
        (answer,) = (a for _, a in pool.map([numerics_gate.job(long, settings, keep=True)]))
        error = float("nan")
        if not isinstance(answer, SimulationFailed) and answer.trace is not None:
            time, states = answer.trace
            grid = np.arange(POINTS) * subject.period / POINTS
            # Of the full op-amps this is what the ideal ones leave out, not a numerical error.
            error = waveform_error(np.interp(grid, time, states[:, 0]), wanted)
        setting = f"T/{subject.period / settings.max_step:.0f}, reltol {settings.reltol:g}"
        if settings is passed.settings and not passed.passed:
            setting += ", gate not passed"
        entries.append(
            _Entry(
                setting,
                clock.entrant(name, numerics_gate.job(long, settings), numerics_gate.length(long)),
                error,
            )
        )
    return entries
