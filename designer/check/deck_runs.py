"""The runs of a deck for other simulators: each response of a design, from its own orbit."""

from __future__ import annotations

from designer.check.first_responses import PERIODS
from designer.check.synthesis_result import Synthesis
from designer.circuit.netlist import Excitation
from designer.circuit.nominal import nominal_reduction, on_circuit
from designer.model.find_responses import ModelResponse, find
from designer.model.response_table import Response
from designer.spice import numerics_gate
from designer.spice.deck import SolverSettings
from designer.spice.simulator_decks import ResponseRun

FINER = 8
"""How much smaller the step is than the first that the numerics gate tries."""


def response_runs(made: Synthesis) -> tuple[ResponseRun, ...]:
    """One run for each wanted response in the order of the model file; ω = 1 where there is none.

    The step is an eighth of that which the numerics gate tries first: the gate takes smaller ones
    until two agree, and a deck that somebody runs elsewhere has no gate.
    """
    found = made.found or find(made.design.model, [Response(1.0)])
    return tuple(_run(made, response) for response in found)


def _run(made: Synthesis, response: ModelResponse) -> ResponseRun:
    design = made.design
    excitation = Excitation(
        design.errors.scales.frequency(response.omega), design.amplitude(response.b)
    )
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
