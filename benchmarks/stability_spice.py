"""ngspice on designs at the ends of the domain, and synthesis at the ends of the catalogue.

Each design is the tool's own; each is asked one response on its nominal board, from the exact
circuit's orbit, behind the numerics gate.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from designer.base.defaults import Fidelity
from designer.base.errors import InputError
from designer.check import checked_design, trust
from designer.check.synthesis_result import Synthesis, synthesise
from designer.circuit import nominal
from designer.circuit.netlist import Excitation
from designer.circuit.nominal import circuit_flow, on_circuit
from designer.dynamics.orbit import OrbitStatus
from designer.model.model_file import parse_model_file
from designer.spice import convergence_aids, equation_check, numerics_gate
from designer.spice.pool import SpicePool
from designer.spice.simulator import SimulationFailed
from designer.verdicts import exact_circuit
from designer.yields.study_plan import plan_study

MODEL: dict[str, Any] = {
    "m": 0.5, "k": 0.5, "k0": 0.95, "c": 0.5, "zeta": 0.1, "f20": 0.0, "b": 0.25, "sides": "both",
}  # fmt: skip
ONE_SIDED: dict[str, Any] = {"zeta": 0.2, "b": 0.5, "sides": "upper"}
"""With ω = 0.9 a 1-1-0 at every stiffness of the stop: the paper's case is chaotic there."""
CIRCUIT: dict[str, Any] = {
    "opamp": "TL074C", "resistors": "E12", "capacitors": "E6", "side_conditions": ["swing", "load"],
}  # fmt: skip
"""With every side condition synthesis takes up to a minute at the ends of the domain."""
FULL: tuple[Fidelity, ...] = ("ideal", "dynamic", "full")
LEVELS = 3
"""Step sizes that the gate may try above the fidelity ``ideal``, of its five: a way to the orbit
may take 400 periods there."""
BOARDS, SEED = 20, 77


@dataclass(frozen=True)
class Case:
    """A design; ``value`` says how far along ``axis`` it stands. spread : of its resistors and
    capacitors, where boards are drawn too."""

    axis: str
    value: float
    omega: float
    model: dict[str, Any]
    circuit: dict[str, Any]
    fidelities: tuple[Fidelity, ...] = ("ideal", "dynamic")
    spread: float | None = None

    @property
    def name(self) -> str:
        return f"{self.axis}-{self.value:g}".replace(" ", "-")

    @property
    def text(self) -> str:
        """As a model file."""
        lines = ["format = 1", "[model]", *_lines(MODEL | self.model)]
        lines += ["[[response]]", f"omega = {self.omega!r}", "[circuit]"]
        lines += _lines(CIRCUIT | self.circuit)
        if self.spread is not None:
            names = '["resistors", "capacitors"]'
            lines += ["[[spread.part]]", f"names = {names}", f"grade = {self.spread!r}"]
        return "\n".join(lines) + "\n"


def _lines(values: dict[str, Any]) -> list[str]:
    return [f"{k} = {_toml(v)}" for k, v in values.items()]


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"' if isinstance(value, str) else repr(value)


def cases() -> Iterator[Case]:
    """Designs that ngspice is asked about."""
    yield Case("paper's case", 0.0, 0.85, {}, {}, FULL)
    for k0 in (0.99, 0.9999):
        yield Case("k0", k0, 0.9, {**ONE_SIDED, "k0": k0}, {}, FULL)
    yield Case("zeta", 0.01, 0.85, {"zeta": 0.01}, {}, FULL)
    yield Case("zeta", 0.001, 2.0, {"zeta": 0.001, "b": 0.1}, {})
    for omega in (0.2, 0.1, 0.05):
        yield Case("omega", omega, omega, {}, {}, ("ideal",))
    for b in (1e-2, 1e-3, 1e-4):
        yield Case("small clearance, b", b, 0.85, {"b": b}, {}, FULL)
    large = {"saturation": 14.0, "side_conditions": ["swing", "level"]}
    yield Case("large clearance, b", 2.0, 0.85, {"b": 2.0, "zeta": 0.01}, large, FULL)
    # Stiffer stops and a frequency nearer to resonance: the threshold is most of the swing.
    far = {"b": 4.0, "zeta": 0.01, "k0": 0.99}
    yield Case("large clearance, b", 4.0, 0.72, far, large, FULL)
    low = {
        "resistor_range": [100.0, 1e4],
        "capacitor_range": [1e-8, 1e-5],
        "side_conditions": ["swing"],
    }
    yield Case("resistors up to", 1e4, 0.85, {}, low, FULL)
    high = {"resistor_range": [1e5, 1e7], "capacitor_range": [1e-11, 1e-8]}
    yield Case("resistors from", 1e5, 0.85, {}, high, FULL)
    yield Case("rectifier", 0.25, 0.85, {}, {"dead_zone": "rectifier"}, FULL)
    yield Case("rectifier, b", 0.05, 0.85, {"b": 0.05}, {"dead_zone": "rectifier"})
    for grade in (0.05, 0.2):
        yield Case("spread", grade, 0.85, {}, {}, ("ideal",), grade)


def edges() -> Iterator[Case]:
    """Coefficients at the edges of what a catalogue holds: synthesis alone."""
    for k0 in (0.01, 0.999, 0.9999, 0.99999):
        yield Case("edge k0", k0, 0.85, {"k0": k0}, {})
    for zeta in (1e-2, 1e-3, 1e-4, 1e-5):
        yield Case("edge zeta", zeta, 0.85, {"zeta": zeta}, {})
    for b in (1e-3, 1e-5, 10.0):
        yield Case("edge b", b, 0.85, {"b": b}, {})
    for m in (0.001, 0.999):
        yield Case("edge m", m, 0.85, {"m": m}, {})
    for high in (1e4, 2e3):
        yield Case("edge resistors", high, 0.85, {}, {"resistor_range": [1e3, high]})
    for high in (10.0, 1e5):
        yield Case("edge frequency", high, 0.85, {}, {"frequency": [0.9 * high, high]})


def synthesised(case: Case) -> tuple[Synthesis | None, dict[str, Any]]:
    """The design, and what became of the request."""
    began = time.process_time()
    row: dict[str, Any] = {"axis": case.axis, "value": case.value, "omega": case.omega}
    try:
        made = synthesise(parse_model_file(case.text))
    except InputError as error:
        seconds = time.process_time() - began
        return None, {**row, "refused": str(error), "cost": {"seconds": seconds}}
    design = made.design
    row |= {
        "max_error": design.errors.max_error,
        "certificate": design.certificate.status,
        "threshold": design.errors.scales.threshold,
        "binding": dict(design.binding),
        "cost": {"seconds": time.process_time() - began},
    }
    return made, row


def synthesis_only(case: Case) -> dict[str, Any]:
    """What synthesis answers: a match and its error, or what binds."""
    return synthesised(case)[1]


def measure(case: Case, pool: SpicePool) -> dict[str, Any]:
    """The design at each fidelity: settings that pass the gate, remedies, distance from the exact
    circuit, and whether the netlist computes the equation."""
    made, row = synthesised(case)
    if made is None:
        return row
    (response,) = made.model_responses
    reduction = nominal.nominal_reduction(made.design)
    orbit = on_circuit(reduction.system(), made.design, response)
    excitation = made.design.excitation(response.b, response.omega)
    flow = circuit_flow(reduction.system(), made.design, response)
    row |= {
        "model": response.orbit.response,
        "circuit": orbit.response,
        "radius": orbit.radius if orbit.n else None,
        "circuit_trust": str(trust.of_orbit(flow, orbit)),
    }
    found = equation_check.check(made.design, made.model_responses, pool)
    row["equation"] = {"passed": found.passed, "worst": str(found.worst)}
    row["rungs"] = {}
    for fidelity in case.fidelities:
        levels = numerics_gate.LEVELS if fidelity == "ideal" else LEVELS
        subject = numerics_gate.GateSubject(reduction, excitation, orbit, fidelity=fidelity)
        (result,) = numerics_gate.check(pool, [subject], levels)
        row["rungs"][fidelity] = _of_gate(result)
        if fidelity == "ideal" and result.passed and case.spread is not None:
            row["boards"] = _boards(made, response, orbit, excitation, result, pool)
    return row


def _of_gate(result: numerics_gate.GateResult) -> dict[str, Any]:
    read = result.read
    return {
        "passed": result.passed,
        "why": result.why,
        "response": "failed" if isinstance(read, SimulationFailed) else read.orbit.response,
        "steps_a_period": result.tried[-1],
        "levels": len(result.tried),
        "remedies": list(result.remedies),
        "difference": _number(result.difference),
        "rms": _number(result.wave),
        "rms_bound": _number(result.wave_bound),
        "discarded_periods": result.discarded,
    }


def _boards(
    made: Synthesis,
    response: Any,
    orbit: Any,
    excitation: Excitation,
    result: numerics_gate.GateResult,
    pool: SpicePool,
) -> dict[str, Any]:
    """A few boards of the spread, each from its own orbit on the exact circuit."""
    checked = checked_design.CheckedResponse(response, orbit, excitation, result)
    plan = plan_study(
        made.modelfile, made.design, [checked], made.catalog, samples=BOARDS, seed=SEED
    )
    drawn = exact_circuit.subjects(plan, range(BOARDS), 1)
    asked = [(a, s) for a, s in drawn if s is not None and s.orbit.status is OrbitStatus.PERIODIC]
    tasks = [numerics_gate.task(replace(s), result.settings, keep=True) for _, s in asked]
    said, waves, needed = ["not asked"] * len(asked), [], set()
    for k, outcome in convergence_aids.run(pool, tasks):
        needed |= set(outcome.tried)
        if isinstance(outcome.result, SimulationFailed):
            said[k] = f"failed: {outcome.result.reason}"
            continue
        said[k] = outcome.result.orbit.response
        waves.append(numerics_gate.wave_error(asked[k][1], outcome.result))
    return {
        "exact": [a.response for a, _ in drawn],
        "asked": [a.response for a, _ in asked],
        "ngspice": said,
        "remedies": sorted(needed),
        "rms": [w for w in sorted(waves) if w == w],
    }


def _number(value: float) -> float | None:
    return float(value) if value == value and abs(value) != float("inf") else None
