"""The paper's circuit with exact parts, on its 1-p-p responses, and as it is synthesised: what
ngspice is tested on."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from designer.check.synthesis_result import Synthesis, synthesise
from designer.circuit.board_values import nominal_board
from designer.circuit.coefficients import coefficient_errors
from designer.circuit.netlist import Excitation
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle, starts
from designer.dynamics.coexisting_attractors import coexisting
from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive
from designer.model.model import Dimensionless
from designer.model.model_file import read_model_file
from designer.spice.numerics_gate import GateSubject
from tests.circuit.test_coefficients import exact_for_paper
from tests.circuit.test_reduction import circuit_of
from tests.shared.answer_store import stored

MODEL = Dimensionless(m=0.5, k=0.5, k0=0.95, c=0.5, zeta=0.1, f20=0.0, b=0.25)
OMEGA = {1: 1.55, 2: 0.85, 3: 0.54, 4: 0.41, 5: 0.337, 6: 0.284, 7: 0.24, 8: 0.215}
"""Drive frequency of the 1-p-p response, by p."""


def flow_of(subject: GateSubject) -> Flow:
    """The exact flow of a subject's board under its excitation."""
    return Flow(subject.system, subject.excitation.drive)


PAPER = Path(__file__).resolve().parents[2] / "examples" / "paper.toml"


@cache
def synthesised() -> Synthesis:
    """``examples/paper.toml``, synthesised once for all tests."""
    made: Synthesis = stored(synthesise)(read_model_file(PAPER))
    return made


@cache
def subject(p: int) -> GateSubject:
    """The nominal board on its 1-p-p orbit of the exact circuit."""
    circuit = circuit_of(exact_for_paper())
    errors = coefficient_errors(circuit, MODEL.second_order())
    reduction = Reduction(circuit, nominal_board(circuit))
    model = Flow(MODEL.second_order().piecewise_linear(), Drive(OMEGA[p]))
    met = coexisting(model, starts(np.full(4, 2.0), 32))
    orbit = next(o for o in met if (o.n, o.p, o.q) == (1, p, p))
    volts = float(1.0 / errors.drive_gain[0])
    excitation = Excitation(errors.scales.frequency(OMEGA[p]), volts)
    rough = GateSubject(reduction, excitation, orbit)
    found = settle(flow_of(rough), orbit.start * errors.scales.volts)
    assert found.response == f"1-{p}-{p}"
    return GateSubject(reduction, excitation, found)
