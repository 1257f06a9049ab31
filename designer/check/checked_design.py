"""The wanted responses of a design on all three engines."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from designer.base.arrays import Array
from designer.check import trust
from designer.check.trust import Trust
from designer.circuit.design import Design
from designer.circuit.netlist import Excitation
from designer.circuit.nominal import (
    Trace,
    circuit_flow,
    nominal_reduction,
    on_circuit,
    response_flow,
    trace_of,
)
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import SURE, Orbit, OrbitStatus
from designer.model.find_responses import ModelResponse
from designer.model.response_table import Response
from designer.spice import numerics_gate as gate, twin_runs
from designer.spice.numerics_gate import GateResult
from designer.spice.pool import SpicePool
from designer.spice.read_orbit import name_in_ngspice
from designer.spice.simulator import SimulationFailed


@dataclass(frozen=True)
class CheckedResponse:
    """A wanted response on all three engines, for the nominal circuit."""

    model: ModelResponse
    """The response, and what the model shows."""
    circuit: Orbit
    """Orbit of the exact circuit, in volts and seconds."""
    excitation: Excitation
    """The generator's setting."""
    gate: GateResult | None
    """Settings of ngspice and its run; None where ngspice was not asked."""
    design: Design | None = None
    """The design that was checked; None where nothing is measured of the exact answers' trust."""
    flow: Flow | None = None
    """Flow of the design's circuit at this response; None as ``design`` is."""

    @property
    def periodic(self) -> bool:
        """Whether an n-p-q is wanted, or shown where nothing is: only then it can be followed."""
        return self.model.spec.completed(self.circuit).periodic

    @property
    def exponents(self) -> dict[str, tuple[float, float]]:
        """Largest Lyapunov exponent and its standard error of each engine that has measured one of
        a motion without a period, per unit of the model's time."""
        seconds = self.excitation.seconds(self.model.omega)
        of = {"model": (self.model.orbit, 1.0), "circuit": (self.circuit, seconds)}
        if self.ngspice is not None:
            of["ngspice"] = self.ngspice, seconds
        return {
            engine: (orbit.lyapunov * scale, orbit.lyapunov_error * scale)
            for engine, (orbit, scale) in of.items()
            if math.isfinite(orbit.lyapunov_error)
        }

    @cached_property
    def model_trust(self) -> Trust:
        """The trust in the model's answer. It is measured when somebody asks: that takes as long as
        the check."""
        if self.design is None:
            return Trust()
        return trust.of_orbit(response_flow(self.design, self.model), self.model.orbit)

    @cached_property
    def circuit_trust(self) -> Trust:
        """The trust in the exact circuit's answer, measured likewise."""
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
        """The trust in each engine's answer."""
        exact = {"model": self.model_trust, "circuit": self.circuit_trust}
        return exact if self.gate is None else {**exact, "ngspice": trust.of_gate(self.gate)}

    @property
    def trusted(self) -> bool:
        """Whether every engine that was asked has an answer, and it can be trusted."""
        return all(one.trusted is True for one in self.trust.values())

    @property
    def agrees(self) -> bool:
        """Whether every engine that was asked shows the same n-p-q, up to the mirror twin, or the
        same motion without a period; of that ngspice tells less (``name_in_ngspice``)."""
        model, circuit, ngspice = self.model.orbit, self.circuit, self.ngspice
        if (model.status, model.counts.family) != (circuit.status, circuit.counts.family):
            return False
        if ngspice is None:
            return True
        if name_in_ngspice(circuit.response) == OrbitStatus.APERIODIC:
            return ngspice.status is OrbitStatus.APERIODIC and _alike(circuit, ngspice)
        return (ngspice.status, ngspice.counts.family) == (circuit.status, circuit.counts.family)


def _alike(one: Orbit, other: Orbit) -> bool:
    """Whether two exponents may be one, within their errors; where one is not known they may."""
    error = math.hypot(one.lyapunov_error, other.lyapunov_error)
    apart = abs(one.lyapunov - other.lyapunov)
    return not (other.status is one.status and apart > SURE * error)


def as_named_in_ngspice(wanted: Response) -> Response:
    """A wanted response by the name that ngspice has for it."""
    if wanted.periodic or wanted.expect is None:
        return wanted
    return replace(wanted, expect=OrbitStatus(name_in_ngspice(str(wanted.expect))))


def check(
    design: Design,
    responses: Sequence[ModelResponse],
    pool: SpicePool | None,
    progress: Callable[[str], object] = lambda _: None,
    *,
    gates: Sequence[GateResult] | None = None,
) -> tuple[CheckedResponse, ...]:
    """Every response on the exact circuit and, with a pool, in ngspice behind the gate.

    gates : earlier results of ngspice's gate for this very design; it is then not run again.
    """
    reduction = nominal_reduction(design)
    system = reduction.system()
    settings = [design.excitation(r.b, r.omega) for r in responses]
    progress("exact circuit")
    flows = [circuit_flow(system, design, r) for r in responses]
    orbits = [on_circuit(system, design, r) for r in responses]
    results: Sequence[GateResult | None] = [None] * len(responses)
    if pool is not None and gates is not None:
        results = gates
    elif pool is not None:
        progress("ngspice, numerics gate")
        pairs = zip(settings, orbits, strict=True)
        subjects = [gate.GateSubject(reduction, e, o) for e, o in pairs]
        results = twin_runs.with_exponents(pool, subjects, gate.check(pool, subjects))
    return tuple(
        CheckedResponse(r, o, e, g, design, flow)
        for r, o, e, g, flow in zip(responses, orbits, settings, results, flows, strict=True)
    )


def traces(design: Design, checked: CheckedResponse) -> dict[str, Trace]:
    """Orbits of each engine in model units, for overlays: "model", "circuit", "ngspice"."""
    out: dict[str, Trace] = {}
    b = checked.model.b
    volts, seconds = design.volts(b), design.errors.scales.seconds
    out["model"] = trace_of(
        response_flow(design, checked.model), checked.model.orbit, np.ones(len(volts)), 1.0
    )
    circuit = circuit_flow(nominal_reduction(design).system(), design, checked.model)
    out["circuit"] = trace_of(circuit, checked.circuit, volts, seconds)
    for trace in () if checked.gate is None else spice_trace(checked.gate, volts, seconds):
        out["ngspice"] = trace
    return out


def spice_trace(result: GateResult, volts: Array, seconds: float) -> tuple[Trace, ...]:
    """ngspice's run in model units, as ``trace_of``; empty where it has none."""
    if isinstance(result.read, SimulationFailed) or result.read.trace is None:
        return ()
    time, states = result.read.trace
    return (Trace(time / seconds, states / volts),)
