"""What a deck says of itself at its top: simulator, circuit, responses, nodes."""

from __future__ import annotations

from designer.check.first_responses import FirstRun
from designer.check.synthesis_result import Synthesis
from designer.circuit.dead_zone_parts import OUTPUT
from designer.circuit.netlist import Circuit
from designer.spice.simulator_decks import Dialect, ResponseRun

OTHERS: dict[Dialect, str] = {
    "ltspice": "For LTspice. The op-amps are one subcircuit, opamp, at the end of the elements",
    "portable": "For simulators after SPICE 2: R, C, D, V, I, E and G alone",
}
"""First line of a deck for another simulator."""


def circuit_notes(made: Synthesis, run: FirstRun) -> tuple[str, ...]:
    """For ``circuit.cir``. run : what it shows."""
    drive = run.excitation
    if made.found:
        first = made.found[0]
        wanted = f", expected {first.expected}" if first.expected else ""
        shown = f"number 1 of {len(made.found)} in the model file, omega {first.omega:g}{wanted}"
    else:
        shown = "the model file wants none, so omega is 1"
    return (
        "For ngspice 36 or later: its XSPICE code model limit is used. Run: ngspice -b circuit.cir",
        *_circuit(made),
        f"Response: {shown}. VM1 drives it: {drive.frequency:.6g} Hz, {drive.amplitude:.6g} V peak",
        "Another response: frequency and amplitude of VM1 are in setup.csv, with how to start it.",
        "The start voltages (IC=) belong to this response alone, and .tran to its frequency",
        "Every response with its own start, and other simulators: designer export DIR --deck NAME,",
        "with ltspice or portable, writes circuit-ltspice.cir or circuit-portable.cir",
    )


def simulator_notes(
    made: Synthesis, dialect: Dialect, runs: tuple[ResponseRun, ...]
) -> tuple[str, ...]:
    """For a deck of another simulator."""
    return (
        OTHERS[dialect],
        *_circuit(made),
        "An op-amp is a current into 1 kohm, clamped by diodes at its output limits, and a source.",
        "Finite gain and bias current are the nominal ones, as in circuit.cir",
        f"Responses: {len(runs)} at the end of the deck, the first one switched on. For another,",
        "put a star before each line of the block that is on, and take away those of the other",
    )


def _circuit(made: Synthesis) -> tuple[str, ...]:
    circuit = made.design.circuit
    stage = made.modelfile.circuit.dead_zone if circuit.stops else "none"
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
    stops = f", {OUTPUT} output of the nonlinear stage" if circuit.stops else ""
    return (
        f"Nodes: {', '.join(carried)}{stops}, {circuit.generator.net} generator",
        "A further n turns the sign (v1n is -v1). Volts per unit of each state are in scales.csv",
    )
