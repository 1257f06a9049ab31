"""The main job as functions with typed results: what ``from designer import …`` offers.

Nothing here writes a file or prints; ``designer.job`` does the same with a design folder.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from designer import gate, pipeline, tolerance
from designer.attractor import coexisting, settle, starts
from designer.blocks import BlockStore
from designer.catalog import Catalog, load_catalog
from designer.deck import Excitation
from designer.errors import EnvironmentMissing, InputError
from designer.flow import Flow, FlowStatus
from designer.modelfile import ModelFile, Response
from designer.ngspice import HOW_TO_INSTALL, SimulationFailed, Waveforms
from designer.orbit import Orbit, OrbitStatus
from designer.pipeline import Checked
from designer.progress import Progress
from designer.responses import STARTS, ModelResponse, circuit_flow, find, scale_of
from designer.synthesis import Design
from designer.system import Array, Drive
from designer.tolerance import Answer, StudyPlan, Yield
from designer.workers import SpiceJob, SpicePool

Engine = Literal["model", "circuit", "ngspice"]
ENGINES: tuple[Engine, ...] = ("model", "circuit", "ngspice")
SAMPLES = 200
SEED = 1


@dataclass(frozen=True)
class Synthesis:
    """A model file, what its model shows, and the parts chosen for it."""

    modelfile: ModelFile
    catalog: Catalog
    found: tuple[ModelResponse, ...]
    design: Design
    seconds: float = 0.0


@dataclass(frozen=True)
class Study:
    """A tolerance study of the responses in ``checked``.

    asked : for each question of the plan, the index of its response. left_out : why a response
    is no question, by index.
    """

    checked: tuple[Checked, ...]
    plan: StudyPlan
    asked: tuple[int, ...]
    left_out: dict[int, str]
    answers: tuple[Answer, ...]

    def answers_to(self, index: int) -> tuple[Answer, ...]:
        """The answers for response number ``index``, by sample."""
        if index not in self.asked:
            return ()
        question = self.asked.index(index)
        return tuple(a for a in self.answers if a.question == question)

    @property
    def yields(self) -> tuple[Yield | None, ...]:
        """For each response; None where it was left out."""
        return tuple(
            tolerance.count(self.answers_to(i)) if i in self.asked else None
            for i in range(len(self.checked))
        )


@dataclass(frozen=True)
class RunResult:
    """Everything that ``run`` found."""

    modelfile: ModelFile
    catalog: Catalog
    found: tuple[ModelResponse, ...]
    design: Design
    checked: tuple[Checked, ...]
    study: Study
    provenance: dict[str, Any] = field(default_factory=dict)
    cost: dict[str, float] = field(default_factory=dict)

    @property
    def plan(self) -> StudyPlan:
        return self.study.plan

    @property
    def answers(self) -> tuple[Answer, ...]:
        return self.study.answers

    @property
    def yields(self) -> tuple[Yield | None, ...]:
        """For each response; None where it was left out of the study."""
        return self.study.yields

    @property
    def satisfied(self) -> bool:
        """Whether every wanted response was found and every engine shows it."""
        return all(c.model.found and c.agrees for c in self.checked)


@dataclass(frozen=True)
class Simulated:
    """A response on one engine, in model units whatever the engine."""

    omega: float
    expected: str | None
    found: bool
    orbit: Orbit
    others: tuple[Orbit, ...]
    seconds: float


def cores() -> int:
    """How many cores this process may use: the default of ``jobs``."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def synthesise(modelfile: ModelFile, catalog: Catalog | None = None) -> Synthesis:
    """Find the wanted responses on the model and choose the parts.

    Raises
    ------
    InputError, Unreachable : the model file asks for what cannot be built.
    """
    began = time.perf_counter()
    catalog = load_catalog() if catalog is None else catalog
    with naming(modelfile):
        found, design = pipeline.design_for(modelfile, catalog)
    return Synthesis(modelfile, catalog, found, design, time.perf_counter() - began)


def check(
    synthesis: Synthesis, pool: SpicePool | None, progress: Progress | None = None
) -> tuple[Checked, ...]:
    """Every response of a design on the exact circuit and, with a pool, in ngspice."""
    said = Progress() if progress is None else progress
    return pipeline.check(
        synthesis.design, synthesis.found, pool, lambda text: ignore(said.stage(text))
    )


def tolerance_study(
    synthesis: Synthesis,
    *,
    samples: int = SAMPLES,
    seed: int = SEED,
    jobs: int | None = None,
    pool: SpicePool | None = None,
    checked: tuple[Checked, ...] | None = None,
    store: Callable[[StudyPlan], BlockStore] | None = None,
    progress: Progress | None = None,
) -> Study:
    """How many boards out of ``samples`` show each response, under ``bench-1``.

    checked : of the same design, to save the time of the gate. pool : where ngspice runs; without
    one ngspice is not asked. store : where blocks are read from and written to.
    """
    need_responses(synthesis.modelfile)
    said = Progress() if progress is None else progress
    jobs = cores() if jobs is None else jobs
    at_least("--samples", samples, 1)
    at_least("--seed", seed, 0)
    at_least("--jobs", jobs, 1)
    checked = check(synthesis, pool, said) if checked is None else checked
    left_out = {i: why for i, c in enumerate(checked) if (why := _why_not(c))}
    asked = tuple(i for i in range(len(checked)) if i not in left_out)
    plan = pipeline.plan_study(
        synthesis.modelfile,
        synthesis.design,
        [checked[i] for i in asked],
        synthesis.catalog,
        samples=samples,
        seed=seed,
    )
    blocks = None if store is None else store(plan)
    answers: list[Answer] = []
    steps = samples * len(asked)
    if pool is not None:
        steps += min(samples, tolerance.NGSPICE_SAMPLES) * sum(
            q.settings is not None for q in plan.questions
        )
    step = said.stage(f"tolerance study, {samples} samples of {len(asked)} responses", steps)
    for block in plan.blocks() if asked else ():
        known = None if blocks is None else blocks.read(block)
        if known is None:
            known = tolerance.run_block(plan, block, pool, jobs, step)
            if blocks is not None:
                blocks.write(block, known)
        else:
            for answer in known:
                step()
                if answer.ngspice:
                    step()
        answers += known
    return Study(checked, plan, asked, left_out, tuple(answers))


def run(
    modelfile: ModelFile,
    catalog: Catalog | None = None,
    *,
    samples: int = SAMPLES,
    seed: int = SEED,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> RunResult:
    """The whole job in memory: synthesis, check in ngspice, tolerance study.

    Raises
    ------
    InputError, Unreachable : the model file asks for what cannot be built.
    EnvironmentMissing : ngspice is missing.
    """
    need_responses(modelfile)
    jobs = cores() if jobs is None else jobs
    at_least("--jobs", jobs, 1)
    with SpicePool(jobs) as pool:
        require_ngspice(pool)
        made = synthesise(modelfile, catalog)
        study = tolerance_study(
            made, samples=samples, seed=seed, jobs=jobs, pool=pool, progress=progress
        )
    return RunResult(made.modelfile, made.catalog, made.found, made.design, study.checked, study)


def simulate(
    modelfile: ModelFile,
    omegas: Sequence[float] = (),
    *,
    engine: Engine = "model",
    synthesis: Synthesis | None = None,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> tuple[Simulated, ...]:
    """The responses of a model file, or what is reached from rest at ``omegas``.

    engine : "model" (exact flow), "circuit" (exact flow of the reduced circuit) or "ngspice".
    synthesis : of this model file; made where the engine needs one and None is given.
    """
    said = Progress() if progress is None else progress
    for omega in omegas:
        if not 0.0 < omega < np.inf:
            raise InputError(None, "--omega", omega, "a finite number > 0")
    if not omegas and not modelfile.responses:
        need_responses(modelfile, " (or --omega)")
    specs = [Response(float(w)) for w in omegas] or list(modelfile.responses)
    if engine == "model":
        step = said.stage("responses of the model", len(specs))
        return tuple(_timed(step, lambda s=s: _on_model(modelfile, s)) for s in specs)  # type: ignore[misc]
    if engine == "circuit":
        made = synthesis or synthesise(modelfile)
        step = said.stage("responses of the exact circuit", len(specs))
        return tuple(
            _timed(step, lambda s=s: _on_circuit(made, s, bool(omegas)))  # type: ignore[misc]
            for s in specs
        )
    with SpicePool(cores() if jobs is None else jobs) as pool:
        require_ngspice(pool)
        made = synthesis or synthesise(modelfile)
        return _in_ngspice(made, specs, bool(omegas), pool, said)


# ---------------------------------------------------------------------------------------------


def need_responses(modelfile: ModelFile, more: str = "") -> None:
    """InputError unless the file wants a response."""
    if not modelfile.responses:
        raise InputError(
            str(modelfile.source) if modelfile.source else None,
            "response",
            "nothing",
            f"at least one table [[response]]{more}",
        )


def at_least(name: str, value: int, least: int) -> None:
    """InputError unless an option is large enough."""
    if value < least:
        raise InputError(None, name, value, f"a whole number >= {least}")


class naming:  # noqa: N801 - reads as a word in a with statement
    """Names the model file in an InputError that names none."""

    def __init__(self, modelfile: ModelFile) -> None:
        self._source = modelfile.source

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if not isinstance(error, InputError) or error.file is not None or self._source is None:
            return
        raise type(error)(self._source, error.field, error.found, error.expected) from None


def require_ngspice(pool: SpicePool) -> None:
    """EnvironmentMissing before any long work; the worker that was started stays for it."""
    from designer.spice_batch import program_version

    program_version()
    deck = "a resistor\nV1 a 0 1\nR1 a 0 1\n.tran 1 2\n.end\n"
    for _, answer in pool.map([SpiceJob(deck, ("a",), 2.0, _length)]):
        if isinstance(answer, SimulationFailed):
            raise EnvironmentMissing(f"ngspice does not work: {answer.reason}; {HOW_TO_INSTALL}")


def ignore(_: object) -> None:
    """Nothing."""


def _length(waveforms: Waveforms) -> int:
    return len(waveforms.time)


def _why_not(checked: Checked) -> str:
    """Why a response cannot be a question of a study; "" where it can."""
    if not checked.model.found:
        return "the model does not show it"
    if checked.circuit.status is not OrbitStatus.PERIODIC:
        return f"the nominal circuit is {checked.circuit.response}"
    return ""


def _timed(step: Callable[[], None], work: Callable[[], Simulated]) -> Simulated:
    began = time.perf_counter()
    result = work()
    step()
    return replace(result, seconds=time.perf_counter() - began)


def _on_model(modelfile: ModelFile, spec: Response) -> Simulated:
    with naming(modelfile):
        (r,) = find(modelfile.model, [spec])
    model = replace(modelfile.model, b=r.b)
    flow = Flow(model.second_order().piecewise_linear(), Drive(r.omega))
    orbits = [_measured(flow, o) for o in (r.orbit, *r.others)]
    return Simulated(r.omega, r.expected, r.found, orbits[0], tuple(orbits[1:]), 0.0)


def _circuit_orbits(
    made: Synthesis, spec: Response, scan: bool
) -> tuple[ModelResponse, Flow, list[Orbit]]:
    """The wanted orbit first, in volts and seconds; with ``scan`` what is reached from rest."""
    with naming(made.modelfile):
        known = [r for r in made.found if r.spec is spec]
        (r,) = known or find(made.modelfile.model, [spec])
    flow = circuit_flow(pipeline.nominal_reduction(made.design).system(), made.design, r)
    volts = made.design.volts(r.b)
    if scan:
        model = replace(made.modelfile.model, b=r.b)
        return r, flow, coexisting(flow, starts(scale_of(model, r.omega) * volts, STARTS))
    orbits = [settle(flow, o.start * volts) for o in (r.orbit, *r.others) if len(o.start)]
    return r, flow, orbits or [settle(flow, np.zeros(flow.system.size))]


def _on_circuit(made: Synthesis, spec: Response, scan: bool) -> Simulated:
    r, flow, orbits = _circuit_orbits(made, spec, scan)
    volts, seconds = made.design.volts(r.b), made.design.errors.scales.seconds
    shown = [dimensionless(_measured(flow, o), volts, seconds) for o in orbits]
    found = _is(r, orbits[0])
    return Simulated(r.omega, r.expected, found, shown[0], _distinct(shown), 0.0)


def _in_ngspice(
    made: Synthesis, specs: Sequence[Response], scan: bool, pool: SpicePool, said: Progress
) -> tuple[Simulated, ...]:
    """ngspice from the exact circuit's attractors, at settings that pass the gate."""
    began = time.perf_counter()
    step = said.stage("responses of the exact circuit", len(specs))
    reduction = pipeline.nominal_reduction(made.design)
    rows, subjects = [], []
    for spec in specs:
        r, _, orbits = _circuit_orbits(made, spec, scan)
        frequency = made.design.errors.scales.frequency(r.omega)
        excitation = Excitation(frequency, made.design.amplitude(r.b))
        started = [o for o in orbits if len(o.start)]
        subjects += [gate.Subject(reduction, excitation, o) for o in started]
        rows.append((r, excitation, len(started)))
        step()
    said.stage("ngspice, numerics gate")
    results = iter(gate.check(pool, subjects))
    seconds = (time.perf_counter() - began) / max(len(specs), 1)
    out = []
    for r, excitation, count in rows:
        volts, scale = made.design.volts(r.b), made.design.errors.scales.seconds
        asked = [Checked(r, r.orbit, excitation, next(results)).ngspice for _ in range(count)]
        heard = [o for o in asked if o is not None] or [Orbit(OrbitStatus.FAILED)]
        shown = [dimensionless(o, volts, scale) for o in heard]
        out.append(
            Simulated(r.omega, r.expected, _is(r, heard[0]), shown[0], _distinct(shown), seconds)
        )
    return tuple(out)


def _is(r: ModelResponse, orbit: Orbit) -> bool:
    """Whether an engine shows what is wanted; anything that is an answer, where nothing is."""
    if orbit.status is not OrbitStatus.PERIODIC:
        return r.spec.expect is None and orbit.status is OrbitStatus.APERIODIC
    symmetric = r.spec.symmetric is None or orbit.symmetric is r.spec.symmetric
    return symmetric and r.spec.accepts(orbit.n, orbit.p, orbit.q)


def _distinct(orbits: Sequence[Orbit]) -> tuple[Orbit, ...]:
    """The others, without those that look like one that is there."""
    kept = [orbits[0]]
    for o in orbits[1:]:
        if not any(_alike(o, k) for k in kept):
            kept.append(o)
    return tuple(kept[1:])


def _alike(a: Orbit, b: Orbit) -> bool:
    if a.status is not b.status or a.n != b.n or {a.p, a.q} != {b.p, b.q}:
        return False
    if not (len(a.extremes) and len(b.extremes)):
        return True
    size = np.abs(a.extremes).max(axis=1)
    twin = -b.extremes[:, ::-1]
    return any(
        bool((np.abs(a.extremes - e).max(axis=1) < 1e-3 * size).all()) for e in (b.extremes, twin)
    )


def _measured(flow: Flow, orbit: Orbit) -> Orbit:
    """With the extremes over 200 periods where the orbit is not periodic and has none."""
    if len(orbit.extremes) or not len(orbit.start):
        return orbit
    run_ = flow.run(orbit.start, 200, measure=True)
    return orbit if run_.status is not FlowStatus.DONE else replace(orbit, extremes=run_.extremes)


def dimensionless(orbit: Orbit, volts: Array, seconds: float) -> Orbit:
    """An orbit in volts and seconds, in model units: volts (states,) per unit, seconds per unit
    of model time."""
    return replace(
        orbit,
        start=orbit.start / volts if len(orbit.start) else orbit.start,
        extremes=orbit.extremes / volts[:, None] if len(orbit.extremes) else orbit.extremes,
        impact_times=orbit.impact_times / seconds,
        impact_velocities=orbit.impact_velocities / volts[1],
        lyapunov=orbit.lyapunov * seconds,
        penetration=orbit.penetration / float(volts[0]),
        miss=orbit.miss / float(volts[0]),
    )
