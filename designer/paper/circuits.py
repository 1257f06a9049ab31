"""The circuits of the paper's Section 5 on its responses 1-p-p, and how well they follow them.

A circuit is started on the model's own orbit; what it settles on is held against that orbit in
model units, drive period by drive period.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from designer.base.arrays import Array
from designer.catalog.parts_catalog import Catalog
from designer.check.synthesis_result import synthesise
from designer.circuit import paper_values
from designer.circuit.board_values import nominal_board
from designer.circuit.coefficients import CoefficientErrors, coefficient_errors
from designer.circuit.dead_zone_place import OUTPUT
from designer.circuit.ensemble import displacement
from designer.circuit.netlist import Circuit, Excitation
from designer.circuit.paper_values import ComparedCircuit
from designer.circuit.reduction import FloatingCircuit, Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import Orbit, OrbitStatus, failed
from designer.dynamics.piecewise_linear import Drive
from designer.model.circuit_table import DeadZone
from designer.model.find_responses import ModelResponse
from designer.model.model_file import ModelFile, parse_model_file
from designer.verdicts.exact_circuit import images, waveform_error

OMEGA = {1: 1.55, 2: 0.85, 3: 0.54, 4: 0.41, 5: 0.337, 6: 0.284, 7: 0.24, 8: 0.215}
"""Drive frequency at which 1-p-p is asked for, by p."""
PRINTED, CORRECTED, OURS, RECTIFIER = "printed", "corrected", "match", "rectifier"
CIRCUITS = (PRINTED, CORRECTED, OURS, RECTIFIER)
TITLES = {
    PRINTED: "paper, as printed",
    CORRECTED: "paper, corrected",
    OURS: "this tool, same stage",
    RECTIFIER: "this tool, rectifier stage",
}


_MODEL = """format = 1
title = "The paper's 1-p-p responses, rectifying dead zone"
[model]
m = 0.5
k = 0.5
k0 = 0.95
c = 0.5
zeta = 0.1
f20 = 0.0
b = 0.25
sides = "both"
{responses}
[circuit]
opamp = "TL074C"
saturation = 13.0
resistors = "E96"
capacitors = "E12"
resistor_grade = 0.01
capacitor_grade = 0.01
dead_zone = "rectifier"
diode = "1N4148"
reference = "LM4040C50"
"""


@dataclass(frozen=True)
class Built:
    """A circuit with its generator and the scales that carry it over to the model."""

    candidate: ComparedCircuit
    """The circuit with its generator's settings."""
    errors: CoefficientErrors | None
    """Errors of its coefficients; None where one has the wrong sign."""
    reason: str
    """Which coefficient has the wrong sign, or ""."""
    volts: Array
    """(states,) volts per unit of each model state; where a coefficient has the wrong sign, those
    that were given."""

    @property
    def circuit(self) -> Circuit:
        return self.candidate.circuit

    def reduction(self) -> Reduction:
        """The reduction of the nominal board, with the op-amps' finite gain and bias current."""
        return Reduction(self.circuit, nominal_board(self.circuit))

    def excitation(self, omega: float) -> Excitation:
        """The generator's setting for a response."""
        return Excitation(self.candidate.frequency * omega, self.candidate.amplitude)


@dataclass(frozen=True)
class SettledResponse:
    """What a circuit settles on, from the model's orbit of one response."""

    omega: float
    """Dimensionless frequency."""
    expected: str
    """The wanted n-p-q."""
    orbit: Orbit
    kept: bool
    """Whether it settles on the wanted n-p-q."""
    error: float
    """RMS difference of x1 from the model's, over its peak, nan where the periods differ."""


def model_file() -> ModelFile:
    """The paper's model with the eight 1-p-p responses, and the rectifying dead zone."""
    responses = "\n".join(
        f'[[response]]\nomega = {omega}\nexpect = "1-{p}-{p}"' for p, omega in OMEGA.items()
    )
    return parse_model_file(_MODEL.format(responses=responses))


def model_with(dead_zone: DeadZone) -> ModelFile:
    """The paper's model and its eight responses, with this dead zone for the tool's design."""
    modelfile = model_file()
    text = modelfile.text.replace('dead_zone = "rectifier"', f'dead_zone = "{dead_zone}"')
    return replace(modelfile, circuit=replace(modelfile.circuit, dead_zone=dead_zone), text=text)


def build(name: str, catalog: Catalog) -> Built:
    """One of ``CIRCUITS``."""
    model, opamp = paper_values.MODEL, catalog.opamp(paper_values.OPAMP)
    if name == PRINTED:
        values = paper_values.PRINTED
        setting = paper_values.PRINTED_FREQUENCY, paper_values.PRINTED_AMPLITUDE
        circuit = paper_values.circuit(model, values, opamp)
    elif name == CORRECTED:
        values = paper_values.corrected()
        setting = paper_values.generator(model, values)
        circuit = paper_values.circuit(model, values, opamp)
    else:
        dead_zone: DeadZone = "rectifier" if name == RECTIFIER else "saturation"
        design = synthesise(model_with(dead_zone), catalog).design
        circuit = design.circuit
        setting = design.errors.scales.frequency(1.0), design.amplitude()
    return built(ComparedCircuit(TITLES[name], "", circuit, *setting))


def built(candidate: ComparedCircuit, instead: Array | None = None) -> Built:
    """The circuit with its scales. instead : (states,) volts per unit where the circuit has none of
    its own.

    Raises
    ------
    ArithmeticError : it has none, and none were given.
    """
    try:
        errors = coefficient_errors(candidate.circuit, paper_values.MODEL.second_order())
    except (ArithmeticError, FloatingCircuit) as error:
        if instead is None:
            raise
        return Built(candidate, None, str(error), instead)
    return Built(candidate, errors, "", errors.scales.volts)


def model_flow(omega: float) -> Flow:
    """The paper's model under its drive."""
    return Flow(paper_values.MODEL.second_order().piecewise_linear(), Drive(omega))


def follow(one: Built, wanted: Sequence[ModelResponse]) -> tuple[SettledResponse, ...]:
    """Every response on the exact circuit."""
    system = one.reduction().system()
    out = []
    for r in wanted:
        flow = Flow(system, one.excitation(r.omega).drive)
        try:
            orbit = settle(flow, r.orbit.start * one.volts)
        except ArithmeticError as error:
            orbit = failed(str(error))
        shown = np.zeros(0)
        if orbit.status is OrbitStatus.PERIODIC:
            shown = displacement(flow, orbit) / one.volts[0]
        kept = orbit.status is OrbitStatus.PERIODIC and r.spec.accepts(orbit.counts)
        assert r.expected is not None
        out.append(SettledResponse(r.omega, r.expected, orbit, kept, error_of(r, shown)))
    return tuple(out)


def error_of(response: ModelResponse, shown: Array) -> float:
    """RMS difference of a displacement (n · POINTS,) in model units from the model's, over its
    peak; the nearest of the model's n periods and mirror images counts."""
    flow = model_flow(response.omega)
    wanted = images(displacement(flow, response.orbit), mirror=True)
    return waveform_error(shown, wanted)


def dc_curve(one: Built, v1: Array) -> Array:
    """(k,) output [V] of the nonlinear stage at constant v1 (k,) [V]: the paper's Fig. 7."""
    reduction = one.reduction()
    system = reduction.system()
    out = np.zeros(len(v1))
    x = np.zeros(system.size)
    for i, v in enumerate(v1):
        x[0] = v
        out[i] = reduction.output(system.mode_at(x, 0.0), OUTPUT, x[None, :], np.zeros(1))[0]
    return out
