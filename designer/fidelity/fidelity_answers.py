"""Every fidelity on one response of a design: its answer at several steps, and what a period costs.

The fidelities, by what they compute: the model (fixed-step Runge-Kutta as the paper's baseline, and
the exact flow), the nominal circuit by the exact flow, the same with a bandwidth, and ngspice with
ideal op-amps, with bandwidth and slew (``dynamic``), with a macromodel (``full``). The largest step
of ngspice is a fraction of the period that follows the shortest contact
(``numerics_gate.first_steps``): "step ×1, reltol 1e-05" is what the numerics gate tries first,
"step ×4" four times that step, so coarser. The tolerance goes with the step, for beside a tight one
ngspice takes the small steps anyway. Of each setting it is said whether it passes the gate
(`passes`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final, Literal

import numpy as np

from designer.base.arrays import Array
from designer.check.synthesis_result import Synthesis
from designer.circuit import nominal
from designer.circuit.design import Design
from designer.circuit.ensemble import displacement
from designer.circuit.nominal import on_circuit
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.counts import MAX_PERIOD
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import WITHOUT_PERIOD, Orbit, OrbitStatus
from designer.fidelity import runge_kutta, system_runge_kutta
from designer.fidelity.cpu_clock import Entrant, SpiceClock, here, rounds
from designer.kernels.kernel_boards import POINTS
from designer.model.driven import model_flow
from designer.model.find_responses import ModelResponse
from designer.model.mechanics import MechanicalModel
from designer.model.model import Dimensionless
from designer.spice import numerics_gate as gate
from designer.spice.deck import SolverSettings
from designer.spice.numerics_gate import GateSubject
from designer.spice.opamp_model import FIDELITIES as SPICE_FIDELITIES
from designer.spice.pool import SpicePool
from designer.spice.read_orbit import Read, Reading, clearance_rows, name_in_ngspice, read
from designer.spice.simulator import SimulationFailed, Waveforms

Run = Read | SimulationFailed

RK4, MODEL, CIRCUIT, BANDWIDTH = "rk4", "model", "circuit", "bandwidth"
FIDELITIES = (RK4, MODEL, CIRCUIT, BANDWIDTH, *SPICE_FIDELITIES, "vendor")
TOP: Final = "full"
"""The most faithful fidelity of our own models."""
VENDOR: Final = "vendor"
"""A vendor's macromodel, which the catalogue names: the truth where the user asks for it."""
Truths = Literal["full", "vendor"]
"""What may stand for the board."""
LEVELS = ((4.0, 1e-3), (2.0, 1e-4), (1.0, gate.RELTOL), (0.5, 0.1 * gate.RELTOL))
"""ngspice's largest step over the one that the gate tries first, and its relative tolerance."""
STEPS = (0.04, 0.02, 0.01, runge_kutta.PAPERS_STEP)
"""Steps of Runge-Kutta, in dimensionless time."""
SETTLED = 40
"""Drive periods of Runge-Kutta before it is judged, from the exact orbit."""
TIMED = 8
"""Drive periods of a timed run of ngspice."""
ROUNDS = 3
BASELINE = 4
"""Periods of a timed run of Runge-Kutta and of the exact flow, at least."""


@dataclass(frozen=True)
class FidelityAnswer:
    """What one fidelity at one setting says of a response."""

    fidelity: str
    level: str
    """Name of the setting, alike for all responses."""
    settings: dict[str, Any]
    orbit: Orbit
    """Orbit in model units as far as it is used: n-p-q, status, impacts."""
    shown: Array
    """(n · POINTS,) first displacement in model units; empty where there is none."""
    seconds: float = float("nan")
    """CPU time of a drive period."""
    reason: str = ""
    """Why there is no answer."""
    gate: bool | None = None
    """Whether ngspice's setting passed the numerics gate; None of other fidelities."""


@dataclass(frozen=True)
class FidelityAnswers:
    """A response at every fidelity."""

    response: ModelResponse
    """The response, and what the model shows."""
    subject: GateSubject
    """The nominal circuit at the response."""
    answers: tuple[FidelityAnswer, ...]
    """What each fidelity says of it."""
    settings: SolverSettings | None
    """Settings of ngspice with ideal op-amps that pass the gate; None where none do."""
    seconds: float
    """CPU time of a drive period at ``settings`` [s]; nan without."""


@dataclass(frozen=True)
class _Asked:
    """A response with what ngspice and the exact flow need of it."""

    response: ModelResponse
    model: MechanicalModel
    design: Design
    volts: Array
    subject: GateSubject


def subject(made: Synthesis, r: ModelResponse) -> GateSubject:
    """The nominal circuit of a design, on the orbit that this response has there."""
    reduction = nominal.nominal_reduction(made.design)
    excitation = made.design.excitation(r.b, r.omega)
    return GateSubject(reduction, excitation, on_circuit(reduction.system(), made.design, r))


def measured(
    made: Synthesis,
    r: ModelResponse,
    pool: SpicePool,
    clock: SpiceClock,
    *,
    levels: Sequence[tuple[float, float]] = LEVELS,
    rounds_: int = ROUNDS,
    truth: Truths = TOP,
) -> FidelityAnswers:
    """What every fidelity says of a response of the design, and what it costs.

    truth : "vendor" asks the vendor's macromodel too, which the op-amp then has to have.
    pool : for what ngspice answers; clock : of another pool, of one worker, for what it costs.
    """
    one = subject(made, r)
    asked = _Asked(r, made.design.model.at(r.b), made.design, made.design.volts(r.b), one)
    entries = [*_exact(asked), *_spice(asked, pool, clock, levels, truth)]
    entrants = [entrant for _, entrant in entries]
    settings = None
    if one.orbit.status is OrbitStatus.PERIODIC:
        (word,) = gate.check(pool, [one])
        settings = word.settings if word.passed else None
    if settings is not None:
        entrants.append(_timed(one, settings, clock))
    seconds = [float(s) for s in np.median(rounds(entrants, rounds_), axis=0)]
    answers = tuple(
        replace(answer, seconds=s)
        for (answer, _), s in zip(entries, seconds[: len(entries)], strict=True)
    )
    return FidelityAnswers(r, one, answers, settings, seconds[-1] if settings else float("nan"))


def _exact(asked: _Asked) -> Iterator[tuple[FidelityAnswer, Entrant]]:
    """Runge-Kutta at its steps, and the exact flows."""
    r, model, omega = asked.response, asked.model, asked.response.omega
    flow = model_flow(model, omega)
    start = r.orbit.start
    stepper = _stepper(model)
    for step in STEPS:
        steps = max(1, round(flow.drive.period / step / POINTS)) * POINTS
        answer = FidelityAnswer(
            RK4,
            f"Δt = {step:g}",
            {"steps_a_period": steps},
            *_runge_kutta(flow, r, stepper, steps),
        )
        yield (
            answer,
            here(RK4, lambda n, s=steps: stepper.run(omega, start, n, s), BASELINE),  # type: ignore[misc]
        )
    yield (
        FidelityAnswer(MODEL, "exact", {}, r.orbit, _drawn(flow, r.orbit, 1.0)),
        here(MODEL, lambda n: flow.run(start, n), BASELINE),
    )
    subject = asked.subject
    on = Flow(subject.system, subject.excitation.drive)
    yield _of_circuit(CIRCUIT, on, subject.orbit, asked)
    if subject.circuit.figures is not None:
        yield _of_circuit(BANDWIDTH, _lagging_flow(subject), _lagging_orbit(subject), asked)


def _of_circuit(
    fidelity: str, flow: Flow, orbit: Orbit, asked: _Asked
) -> tuple[FidelityAnswer, Entrant]:
    """The exact flow of the nominal circuit, and its orbit in volts."""
    begin = orbit.start if len(orbit.start) else np.zeros(flow.system.size)
    volts = float(asked.volts[flow.system.moving])
    answer = FidelityAnswer(
        fidelity, "exact", {}, _in_model_units(orbit, asked), _drawn(flow, orbit, volts)
    )
    return answer, here(fidelity, lambda n: flow.run(begin, n), BASELINE)


@dataclass(frozen=True)
class _Stepper:
    """Runge-Kutta for one model."""

    run: Callable[[float, Array, int, int], Array]
    trace: Callable[[float, Array, int, int, int], Array]


def _stepper(model: MechanicalModel) -> _Stepper:
    """The stepper of a model: the paper's two masses have one in numbers, any other system one in
    arrays."""
    if isinstance(model, Dimensionless):
        return _Stepper(partial(runge_kutta.run, model), partial(runge_kutta.trace, model))
    any_of = system_runge_kutta
    return _Stepper(partial(any_of.run, model), partial(any_of.trace, model))


def _runge_kutta(
    flow: Flow, r: ModelResponse, stepper: _Stepper, steps: int
) -> tuple[Orbit, Array]:
    """The orbit that Runge-Kutta settles on, read off as ngspice's are, and its displacement."""
    n, system = r.orbit.n or MAX_PERIOD, flow.system
    x = stepper.run(r.omega, r.orbit.start, SETTLED * n, steps)
    states = stepper.trace(r.omega, x, 4 * n, steps, steps)
    period = 2.0 * np.pi / r.omega
    time = np.arange(len(states)) * period / steps
    signals = dict(zip(system.states, states.T, strict=True)) | {"u": np.sin(r.omega * time)}
    reading = Reading(
        period,
        0,
        system.states,
        np.zeros(system.size),
        clearance_rows(system),
        "u",
        keep=True,
    )
    run = read(Waveforms(time, signals, "", 0.0), reading)
    return run.orbit, _traced(run, 1.0, system.moving)


def in_ngspice(subject: GateSubject, truth: Truths) -> dict[str, GateSubject]:
    """The subject at every fidelity of ngspice, by name; with the vendor's macromodel as the truth,
    ``full`` is the one from the data sheet's figures. Those above ``ideal`` start on the orbit with
    bandwidth, from which the way is shorter."""
    figures, near = subject.circuit.figures, replace(subject, start=_lagging_start(subject))
    full = near
    if truth == VENDOR and figures is not None:
        plain = replace(subject.circuit, figures=replace(figures, spice=None))
        full = replace(near, reduction=Reduction(plain, subject.board))
    on = {str(fidelity): replace(full, fidelity=fidelity) for fidelity in SPICE_FIDELITIES}
    on["ideal"] = replace(on["ideal"], start=subject.start)
    return on | ({VENDOR: replace(near, fidelity=TOP)} if truth == VENDOR else {})


def _spice(
    asked: _Asked,
    pool: SpicePool,
    clock: SpiceClock,
    levels: Sequence[tuple[float, float]],
    truth: Truths,
) -> Iterator[tuple[FidelityAnswer, Entrant]]:
    subject = asked.subject
    if not len(subject.orbit.start):
        return
    contact = gate.shortest_contact(subject.orbit, subject.system, subject.excitation)
    first = gate.first_steps(subject, contact)
    named = in_ngspice(subject, truth)
    on = dict(zip(named, gate.warmed(pool, list(named.values())), strict=True))
    ladder = [(max(1, round(first / factor)), reltol) for factor, reltol in levels]
    names = [f"step ×{factor:g}, reltol {reltol:g}" for factor, reltol in levels]
    asks: list[tuple[str, int, SolverSettings]] = []
    for name, one in on.items():
        for k, own in enumerate(ladder):
            settings = _own(one, own)
            asks.append((name, k, settings))
            asks += [(name, k, other) for other in companions(settings)]
    jobs = [
        gate.job(on[name], settings, keep=settings == _own(on[name], ladder[k]))
        for name, k, settings in asks
    ]
    answers = dict(pool.map(jobs))
    runs: dict[tuple[str, int], list[Run]] = {}
    for i, (name, k, _) in enumerate(asks):
        runs.setdefault((name, k), []).append(answers[i])
    for name, one in on.items():
        for k, own in enumerate(ladder):
            settings = _own(one, own)
            run, half, gear = runs[name, k]
            passed = passes(one, run, (half, gear))
            entrant = _timed(one, settings, clock)
            described = {**settings.as_dict(), "steps_a_period": ladder[k][0]}
            described["discarded_periods"] = one.discard
            if isinstance(run, SimulationFailed):
                orbit, shown = Orbit(OrbitStatus.FAILED, reason=run.reason), np.zeros(0)
            else:
                orbit = _in_model_units(run.orbit, asked)
                moving = one.system.moving
                shown = _traced(run, float(asked.volts[moving]), moving)
            yield (
                FidelityAnswer(
                    name, names[k], described, orbit, shown, reason=orbit.reason, gate=passed
                ),
                entrant,
            )


def _lagging_start(subject: GateSubject) -> Array | None:
    """Start of the orbit of the exact circuit with bandwidth; None where it has none of the kind
    that there is without."""
    if subject.circuit.figures is None:
        return None
    orbit = _lagging_orbit(subject)
    capacitors = orbit.start[: len(subject.circuit.states)]
    return capacitors if orbit.status is subject.orbit.status else None


def _lagging_flow(subject: GateSubject) -> Flow:
    return Flow(_lagging(subject).system(), subject.excitation.drive)


def _lagging(subject: GateSubject) -> Reduction:
    return Reduction(subject.circuit, subject.board, bandwidth=True)


def _lagging_orbit(subject: GateSubject) -> Orbit:
    start = subject.orbit.start
    begin = start if len(start) else np.zeros(subject.system.size)
    return settle(_lagging_flow(subject), _lagging(subject).state(begin))


def _own(subject: GateSubject, ladder: tuple[int, float]) -> SolverSettings:
    """The settings that take so many steps a period at this tolerance."""
    steps, reltol = ladder
    return SolverSettings("trap", subject.period / steps, reltol)


def _timed(subject: GateSubject, settings: SolverSettings, clock: SpiceClock) -> Entrant:
    """A short run from the orbit, for its time."""
    least = TIMED - 4 * (subject.orbit.n or MAX_PERIOD)
    short = replace(subject, discard=max(least, 0))
    return clock.entrant(subject.fidelity, gate.job(short, settings), gate.length(short))


def _in_model_units(orbit: Orbit, asked: _Asked) -> Orbit:
    volts = asked.design.impact_volts(orbit, asked.volts)
    return replace(orbit, impact_velocities=orbit.impact_velocities / volts)


def _drawn(flow: Flow, orbit: Orbit, volts: float) -> Array:
    if orbit.status is not OrbitStatus.PERIODIC:
        return np.zeros(0)
    return displacement(flow, orbit) / volts


def _traced(run: Read, volts: float, moving: int) -> Array:
    """(n · POINTS,) first displacement of a run's last n periods."""
    if not run.orbit.n or run.trace is None:
        return np.zeros(0)
    time, states = run.trace
    count = run.orbit.n * POINTS
    grid = time[-1] * np.arange(count) / count
    return np.asarray(np.interp(grid, time, states[:, moving])) / volts


def companions(settings: SolverSettings) -> tuple[SolverSettings, SolverSettings]:
    """What a setting is held against: half its step, and the other method at that."""
    half = replace(settings, max_step=settings.max_step / 2.0)
    return half, replace(half, method="gear")


def passes(subject: GateSubject, own: Run, others: tuple[Run, Run]) -> bool:
    """Whether the run of a setting, which has its trace, and those of its ``companions`` agree, as
    in ``spice.numerics_gate``.

    Above ideal op-amps the n-p-q is the fidelity's own: whether it is the exact circuit's is what a
    trade measures. subject : at its fidelity.
    """
    read = [run for run in (own, *others) if isinstance(run, Read)]
    if len(read) < 3 or isinstance(own, SimulationFailed):
        return False
    exact, orbit = subject.orbit, own.orbit
    if orbit.status is not OrbitStatus.PERIODIC and orbit.status not in WITHOUT_PERIOD:
        return False
    if len({run.orbit.response for run in read}) > 1:
        return False
    ideal = subject.fidelity == "ideal"
    if ideal and orbit.response != name_in_ngspice(exact.response):
        return False
    if orbit.status is not OrbitStatus.PERIODIC:
        return True  # there is no strobe and no wave to compare
    peak = (exact if exact.status is OrbitStatus.PERIODIC else orbit).coarse_peaks
    last = [run.strobes[-orbit.n :] for run in read]
    apart = max(
        float((np.abs(a - b) / peak).max()) for i, a in enumerate(last) for b in last[i + 1 :]
    )
    if apart > gate.BOUND:
        return False
    wave = gate.wave_error(subject, own) if ideal else 0.0
    return not math.isnan(wave) and wave <= gate.wave_bound(exact)
