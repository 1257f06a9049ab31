"""The circuits of the paper's Section 5 on its responses 1-p-p, and how well they follow them.

A circuit is started on the model's own orbit; what it settles on is held against that orbit in
model units, drive period by drive period.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from designer import paper_design, pipeline
from designer.attractor import settle
from designer.catalog import Catalog
from designer.circuit import Circuit, nominal_board
from designer.circuitspec import DeadZone
from designer.coefficients import CoefficientErrors, coefficient_errors
from designer.dead_zone_parts import OUTPUT
from designer.deck import Excitation
from designer.ensemble import displacement
from designer.exact import images, waveform_error
from designer.flow import Flow
from designer.modelfile import ModelFile
from designer.orbit import Orbit, OrbitStatus, failed
from designer.paper_design import Candidate
from designer.reduction import FloatingCircuit, Reduction
from designer.responses import ModelResponse
from designer.system import Array, Drive
from designer.tolerance_cases import model_file

PRINTED, CORRECTED, OURS, RECTIFIER = "printed", "corrected", "match", "rectifier"
CIRCUITS = (PRINTED, CORRECTED, OURS, RECTIFIER)
TITLES = {
    PRINTED: "paper, as printed",
    CORRECTED: "paper, corrected",
    OURS: "this tool, same stage",
    RECTIFIER: "this tool, rectifier stage",
}


@dataclass(frozen=True)
class Built:
    """A circuit with its generator and the scales that carry it over to the model.

    errors : None where a coefficient has the wrong sign, ``reason`` says which; volts (states,)
    are then those that were given instead.
    """

    candidate: Candidate
    errors: CoefficientErrors | None
    reason: str
    volts: Array

    @property
    def circuit(self) -> Circuit:
        return self.candidate.circuit

    def reduction(self) -> Reduction:
        """Of the nominal board, with the op-amps' finite gain and bias current."""
        return Reduction(self.circuit, nominal_board(self.circuit))

    def excitation(self, omega: float) -> Excitation:
        """The generator's setting for a response."""
        return Excitation(self.candidate.frequency * omega, self.candidate.amplitude)


@dataclass(frozen=True)
class Followed:
    """What a circuit settles on, from the model's orbit of one response.

    kept : whether that is the wanted n-p-q. error : RMS difference of x1 from the model's, over its
    peak, nan where the periods differ.
    """

    omega: float
    expected: str
    orbit: Orbit
    kept: bool
    error: float


def model_with(zone: DeadZone) -> ModelFile:
    """The paper's model and its eight responses, with this dead zone for the tool's own design."""
    made = model_file()
    text = made.text.replace('dead_zone = "rectifier"', f'dead_zone = "{zone}"')
    return replace(made, circuit=replace(made.circuit, dead_zone=zone), text=text)


def build(name: str, catalog: Catalog) -> Built:
    """One of ``CIRCUITS``."""
    model, opamp = paper_design.MODEL, catalog.opamp(paper_design.OPAMP)
    if name == PRINTED:
        values = paper_design.PRINTED
        setting = paper_design.PRINTED_FREQUENCY, paper_design.PRINTED_AMPLITUDE
        circuit = paper_design.circuit(model, values, opamp)
    elif name == CORRECTED:
        values = paper_design.corrected()
        setting = paper_design.generator(model, values)
        circuit = paper_design.circuit(model, values, opamp)
    else:
        zone: DeadZone = "rectifier" if name == RECTIFIER else "saturation"
        _, design = pipeline.design_for(model_with(zone), catalog)
        circuit = design.circuit
        setting = design.errors.scales.frequency(1.0), design.amplitude()
    return built(Candidate(TITLES[name], "", circuit, *setting))


def built(candidate: Candidate, instead: Array | None = None) -> Built:
    """With its scales. instead : (states,) volts per unit where the circuit has none of its own.

    Raises
    ------
    ArithmeticError : it has none, and none were given.
    """
    try:
        errors = coefficient_errors(candidate.circuit, paper_design.MODEL.second_order())
    except (ArithmeticError, FloatingCircuit) as error:
        if instead is None:
            raise
        return Built(candidate, None, str(error), instead)
    return Built(candidate, errors, "", errors.scales.volts)


def model_flow(omega: float) -> Flow:
    """The paper's model under its drive."""
    return Flow(paper_design.MODEL.second_order().piecewise_linear(), Drive(omega))


def follow(one: Built, found: Sequence[ModelResponse]) -> tuple[Followed, ...]:
    """Every response on the exact circuit."""
    system = one.reduction().system()
    out = []
    for r in found:
        flow = Flow(system, one.excitation(r.omega).drive)
        try:
            orbit = settle(flow, r.orbit.start * one.volts)
        except ArithmeticError as error:
            orbit = failed(str(error))
        shown = np.zeros(0)
        if orbit.status is OrbitStatus.PERIODIC:
            shown = displacement(flow, orbit) / one.volts[0]
        kept = orbit.status is OrbitStatus.PERIODIC and r.spec.accepts(orbit.n, orbit.p, orbit.q)
        assert r.expected is not None
        out.append(Followed(r.omega, r.expected, orbit, kept, error_of(r, shown)))
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
