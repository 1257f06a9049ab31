"""The run that a design's own files show: the first response, from its own orbit."""

from __future__ import annotations

from dataclasses import dataclass

from designer.base.arrays import Array
from designer.check.checked_design import CheckedResponse
from designer.check.synthesis_result import Synthesis
from designer.circuit.netlist import Excitation
from designer.circuit.nominal import nominal_reduction, on_circuit
from designer.model.find_responses import find
from designer.model.response_table import Response
from designer.spice.deck import SolverSettings

PERIODS = 20
"""Drive periods that it takes."""


@dataclass(frozen=True)
class FirstRun:
    """The run that a deck shows."""

    excitation: Excitation
    """The generator's setting."""
    settings: SolverSettings
    """Settings of ngspice."""
    stop_time: float
    """End of the run [s]."""
    initial: Array | None
    """(states,) capacitor voltages at t = 0; None for discharged ones."""


def first_run(made: Synthesis, checked: CheckedResponse | None = None) -> FirstRun:
    """The first response, ω = 1 where there is none.

    checked : of that response; its gate's settings are used.
    """
    design = made.design
    first = made.found[0] if made.found else find(design.model, [Response(1.0)])[0]
    excitation = Excitation(design.errors.scales.frequency(first.omega), design.amplitude(first.b))
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
