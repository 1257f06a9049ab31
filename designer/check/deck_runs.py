"""What the decks of a design run and say at their top: the first response in ``circuit.cir``, every
response in a deck for another simulator, each from its own orbit."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from designer.base.arrays import Array
from designer.base.defaults import DIALECTS, Dialect
from designer.check.checked_design import CheckedResponse
from designer.check.synthesis_result import Synthesis
from designer.circuit.netlist import Circuit, Excitation
from designer.circuit.nominal import nominal_reduction, on_circuit
from designer.model.find_responses import ModelResponse, find
from designer.model.response_table import Response
from designer.spice import numerics_gate
from designer.spice.deck import SolverSettings
from designer.spice.simulator_decks import SIMULATORS, ResponseRun, file_name

PERIODS = 20
"""Drive periods that a run takes."""
FINER = 8
"""How much smaller the step for another simulator is than the first that the numerics gate
tries."""


@dataclass(frozen=True)
class FirstRun:
    """The run that a deck shows."""

    excitation: Excitation
    """The generator's setting."""
    settings: SolverSettings
    stop_time: float
    """End of the run [s]."""
    initial: Array | None
    """(states,) capacitor voltages at t = 0; None for discharged ones."""


def first_run(synthesis: Synthesis, checked: CheckedResponse | None = None) -> FirstRun:
    """The first response, ω = 1 where there is none.

    checked : of that response; its gate's settings are used.
    """
    design, first = synthesis.design, _responses(synthesis)[0]
    excitation = design.excitation(first.b, first.omega)
    if checked is None:
        orbit = on_circuit(nominal_reduction(design).system(), design, first)
    else:
        orbit = checked.circuit
    period = 1.0 / excitation.frequency
    settings = SolverSettings("trap", period / 1000.0)
    if checked is not None and checked.gate is not None:
        settings = checked.gate.settings
    initial = orbit.start if len(orbit.start) else None
    return FirstRun(excitation, settings, PERIODS * period, initial)


def response_runs(synthesis: Synthesis) -> tuple[ResponseRun, ...]:
    """One run for each wanted response in the order of the model file; ω = 1 where there is none.

    The step is an eighth of that which the numerics gate tries first: the gate takes smaller ones
    until two agree, and a deck that somebody runs elsewhere has no gate.
    """
    return tuple(_run(synthesis, response) for response in _responses(synthesis))


def _responses(synthesis: Synthesis) -> tuple[ModelResponse, ...]:
    return synthesis.model_responses or find(synthesis.design.model, [Response(1.0)])


def _run(synthesis: Synthesis, response: ModelResponse) -> ResponseRun:
    design = synthesis.design
    excitation = design.excitation(response.b, response.omega)
    reduction = nominal_reduction(design)
    orbit = on_circuit(reduction.system(), design, response)
    subject = numerics_gate.GateSubject(reduction, excitation, orbit)
    contact = numerics_gate.shortest_contact(orbit, subject.system, excitation)
    period = subject.period
    step = period / (FINER * numerics_gate.first_steps(subject, contact))
    return ResponseRun(
        omega=response.omega,
        expected=response.expected,
        excitation=excitation,
        settings=SolverSettings("trap", step, reltol=numerics_gate.RELTOL),
        stop_time=PERIODS * period,
        initial=orbit.start if len(orbit.start) else None,
    )


def circuit_notes(synthesis: Synthesis, run: FirstRun) -> tuple[str, ...]:
    """The notes at the top of ``circuit.cir``. run : the run that the deck does."""
    drive = run.excitation
    if synthesis.model_responses:
        first = synthesis.model_responses[0]
        wanted = f", expected {first.expected}" if first.expected else ""
        count = len(synthesis.model_responses)
        text = f"number 1 of {count} in the model file, omega {first.omega:g}{wanted}"
    else:
        text = "the model file wants none, so omega is 1"
    return (
        "For ngspice 36 or later: its XSPICE code model limit is used. Run: ngspice -b circuit.cir",
        *_circuit(synthesis),
        f"Response: {text}. VM1 drives it: {drive.frequency:.6g} Hz, {drive.amplitude:.6g} V peak"
        + ("" if drive.second is None else f", VM2 with {drive.second.amplitude:.6g} V peak"),
        *_other_responses(drive),
        "The start voltages (IC=) belong to this response alone, and .tran to its frequency",
        "Every response with its own start, and other simulators: designer export DIR --deck NAME,",
        f"with {' or '.join(DIALECTS)}, writes {' or '.join(map(file_name, DIALECTS))}",
    )


def _other_responses(drive: Excitation) -> Iterator[str]:
    """How the generator is set for another response."""
    if drive.drive.is_sine:
        yield "Another response: frequency and amplitude of VM1 are in setup.csv, with its start."
        return
    if drive.is_waveform:
        yield "VM1h2, VM1h3 ... stand under VM1: harmonics of its waveform, whose peak is said here"
    yield "Another response: setup.csv says peaks and frequency, a deck as below has every source."


def simulator_notes(
    synthesis: Synthesis, dialect: Dialect, runs: tuple[ResponseRun, ...]
) -> tuple[str, ...]:
    """The notes at the top of a deck for another simulator."""
    return (
        SIMULATORS[dialect].about,
        *_circuit(synthesis),
        "An op-amp is a current into 1 kohm, clamped by diodes at its output limits, and a source.",
        "Finite gain and bias current are the nominal ones, as in circuit.cir",
        f"Responses: {len(runs)} at the end of the deck, the first one switched on. For another,",
        "put a star before each line of the block that is on, and take away those of the other",
    )


def _circuit(synthesis: Synthesis) -> tuple[str, ...]:
    circuit = synthesis.design.circuit
    stage = synthesis.modelfile.circuit.dead_zone if circuit.dead_zones else "none"
    return (
        f"Circuit: {len(circuit.sections)} op-amps {circuit.opamp} at +-{circuit.supply:g} V, "
        f"{len(circuit.resistors)} resistors, {len(circuit.capacitors)} capacitors, "
        f"dead zone: {stage}",
        *_nodes(circuit),
    )


def _nodes(circuit: Circuit) -> tuple[str, ...]:
    """The state nets carry displacement and velocity of each mass in turn."""
    carried = [
        f"{net} {'dx' if i % 2 else 'x'}{i // 2 + 1}{'/dt' if i % 2 else ''}"
        for i, net in enumerate(circuit.state_nets)
    ]
    zones = circuit.dead_zones
    names = {
        zone.output: f"dead zone {zone.clearance}" if len(zones) > 1 else "nonlinear stage"
        for zone in zones
    }
    stages = [f"{net} output of the {name}" for net, name in names.items()]
    generator = " and ".join(circuit.generator_nets)
    return (
        f"Nodes: {', '.join([*carried, *stages])}, {generator} generator",
        "A further n turns the sign (v1n is -v1). Volts per unit of each state are in scales.csv",
    )
