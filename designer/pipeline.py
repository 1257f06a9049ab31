"""The main job, stage by stage: model file → responses → design → checked circuit → yields.

Each stage takes what the one before it made and can be called alone. Nothing here writes files or
prints; ``designer.folder`` and the command line do.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from designer import gate, trust
from designer.attempt import zone_of_spec
from designer.catalog import Catalog
from designer.circuit import nominal_board
from designer.deck import Excitation
from designer.design import Design
from designer.flow import Flow
from designer.gate import GateResult
from designer.modelfile import ModelFile
from designer.ngspice import SimulationFailed
from designer.orbit import Orbit, OrbitStatus
from designer.partnames import parts_of
from designer.reduction import Reduction
from designer.responses import ModelResponse, circuit_flow, find, peaks, reached
from designer.spread import Spread
from designer.spreadrules import check_names
from designer.synthesis import check_choices, synthesise
from designer.system import Array, Drive
from designer.trust import Trust
from designer.verdict import Answer, Question, StudyPlan, Yield, count
from designer.workers import SpicePool

TRACE_POINTS = 1024
"""Points of a drawn orbit per drive period."""
SHOWN_PERIODS = 30
"""Drive periods of a trace of a response without a period."""


@dataclass(frozen=True)
class Trace:
    """One engine's orbit over its n periods in model units: time (k,), states (k, 4)."""

    time: Array
    states: Array


@dataclass(frozen=True)
class Checked:
    """A wanted response on all three engines, for the nominal circuit.

    circuit : orbit of the exact circuit rung, in volts and seconds. gate : ngspice's settings and
    its run; None where ngspice was not asked. design, flow : what was checked, and its circuit's
    flow at this response; without them nothing is measured of the exact answers' trust.
    """

    model: ModelResponse
    circuit: Orbit
    excitation: Excitation
    gate: GateResult | None
    design: Design | None = None
    flow: Flow | None = None

    @cached_property
    def model_trust(self) -> Trust:
        """Of the model's answer. Measured when somebody asks: it takes as long as the check."""
        if self.design is None:
            return Trust()
        return trust.of_orbit(model_flow(self.design, self.model), self.model.orbit)

    @cached_property
    def circuit_trust(self) -> Trust:
        """Of the exact circuit's answer, likewise."""
        return Trust() if self.flow is None else trust.of_orbit(self.flow, self.circuit)

    @property
    def ngspice(self) -> Orbit | None:
        """ngspice's orbit; status failed with the reason where it failed or the gate did not
        pass."""
        if self.gate is None:
            return None
        if isinstance(self.gate.read, SimulationFailed):
            return Orbit(OrbitStatus.FAILED, reason=self.gate.read.reason)
        if not self.gate.passed:
            return Orbit(
                OrbitStatus.FAILED,
                reason=f"the numerics gate did not pass (steps a period: {self.gate.tried}): "
                + self.gate.why,
            )
        return self.gate.read.orbit

    @property
    def trust(self) -> dict[str, Trust]:
        """Of each engine's answer."""
        said = {"model": self.model_trust, "circuit": self.circuit_trust}
        return said if self.gate is None else {**said, "ngspice": trust.of_gate(self.gate)}

    @property
    def trusted(self) -> bool:
        """Whether every engine that was asked has an answer, and it can be trusted."""
        return all(said.trusted is True for said in self.trust.values())

    @property
    def agrees(self) -> bool:
        """Whether every engine that was asked shows the same n-p-q, up to the mirror twin."""

        def kind(o: Orbit) -> tuple[int, tuple[int, ...]] | str:
            return (o.n, tuple(sorted((o.p, o.q)))) if o.n else str(o.status)

        engines = [self.model.orbit, self.circuit]
        if self.ngspice is not None:
            engines.append(self.ngspice)
        return len({(str(o.status), kind(o)) for o in engines}) == 1


def design_for(modelfile: ModelFile, catalog: Catalog) -> tuple[tuple[ModelResponse, ...], Design]:
    """Find the wanted responses on the model and choose the parts.

    Raises
    ------
    InputError, Unreachable : see ``responses.find`` and ``synthesis.synthesise``.
    """
    check_choices(modelfile.model, modelfile.circuit, catalog)
    choice = modelfile.model, modelfile.circuit, catalog
    check_names(modelfile, parts_of(*choice, zone_of_spec(*choice)))
    found = find(modelfile.model, modelfile.responses)
    design = synthesise(
        modelfile.model, modelfile.circuit, catalog, peaks(modelfile.model, found), found
    )
    Spread.of(modelfile, design.circuit, catalog)  # refuses what this design's boards cannot be
    return found, design


def nominal_reduction(design: Design) -> Reduction:
    """The nominal board's exact reduction, with the op-amps' finite gain and bias."""
    return Reduction(design.circuit, nominal_board(design.circuit))


def check(
    design: Design,
    found: Sequence[ModelResponse],
    pool: SpicePool | None,
    progress: Callable[[str], None] = lambda _: None,
    *,
    gates: Sequence[GateResult] | None = None,
) -> tuple[Checked, ...]:
    """Every response on the exact circuit and, with a pool, in ngspice behind the gate.

    gates : what ngspice's gate found of this very design before; it is not asked again then.
    """
    reduction = nominal_reduction(design)
    system = reduction.system()
    settings = [
        Excitation(design.errors.scales.frequency(r.omega), design.amplitude(r.b)) for r in found
    ]
    progress("exact circuit")
    flows = [circuit_flow(system, design, r) for r in found]
    orbits = [reached(flow, design, r) for flow, r in zip(flows, found, strict=True)]
    met: list[GateResult | None] = [None] * len(found)
    if pool is not None and gates is not None:
        met = list(gates)
    elif pool is not None:
        progress("ngspice, numerics gate")
        met = list(
            gate.check(
                pool,
                [gate.Subject(reduction, e, o) for e, o in zip(settings, orbits, strict=True)],
            )
        )
    return tuple(
        Checked(r, o, e, g, design, flow)
        for r, o, e, g, flow in zip(found, orbits, settings, met, flows, strict=True)
    )


def model_flow(design: Design, response: ModelResponse) -> Flow:
    """The flow of the model at a response."""
    model = replace(design.model, b=response.b)
    return Flow(model.second_order().piecewise_linear(), Drive(response.omega))


def plan_study(
    modelfile: ModelFile,
    design: Design,
    checked: Sequence[Checked],
    catalog: Catalog,
    *,
    samples: int,
    seed: int,
) -> StudyPlan:
    """The Monte Carlo study of these responses, boards as the model file says.

    Every one of ``checked`` is a question; who calls leaves out what the nominal circuit does not
    show periodically (``study.tolerance``), since there is no nominal orbit to start from.
    """
    return StudyPlan(
        circuit=design.circuit,
        spread=Spread.of(modelfile, design.circuit, catalog),
        seed=seed,
        samples=samples,
        questions=tuple(
            Question(
                c.model.spec,
                c.excitation,
                c.circuit,
                c.gate.settings if c.gate is not None and c.gate.passed else None,
            )
            for c in checked
        ),
    )


def yields(plan: StudyPlan, answers: Sequence[Answer]) -> tuple[Yield, ...]:
    """The yield of each question of the plan."""
    return tuple(count([a for a in answers if a.question == i]) for i in range(len(plan.questions)))


def traces(design: Design, checked: Checked) -> dict[str, Trace]:
    """Orbits of each engine in model units, for overlays: "model", "circuit", "ngspice"."""
    out: dict[str, Trace] = {}
    b = checked.model.b
    volts, seconds = design.volts(b), design.errors.scales.seconds
    out["model"] = trace_of(model_flow(design, checked.model), checked.model.orbit, np.ones(4), 1.0)
    circuit = circuit_flow(nominal_reduction(design).system(), design, checked.model)
    out["circuit"] = trace_of(circuit, checked.circuit, volts, seconds)
    read = checked.gate.read if checked.gate is not None else None
    if read is not None and not isinstance(read, SimulationFailed) and read.trace is not None:
        time, states = read.trace
        out["ngspice"] = Trace(time / seconds, states / volts)
    return out


def trace_of(flow: Flow, orbit: Orbit, volts: Array, seconds: float) -> Trace:
    """An orbit over its n periods in model units; from rest where it has no start."""
    periods = max(orbit.n, 1) if orbit.status is OrbitStatus.PERIODIC else SHOWN_PERIODS
    start = orbit.start if len(orbit.start) else np.zeros(flow.system.size)
    run = flow.run(start, periods, mode=orbit.mode or None, points=TRACE_POINTS)
    time = np.arange(len(run.strobes)) * flow.drive.period / TRACE_POINTS
    return Trace(time / seconds, run.strobes / volts)
