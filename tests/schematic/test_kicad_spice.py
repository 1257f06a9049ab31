"""KiCad's SPICE netlist of the sheet against our own deck, for every kind of circuit and board."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from designer.catalog.entries import Mounting
from designer.check.deck_runs import FirstRun
from designer.circuit.board_values import nominal_board
from designer.circuit.coefficients import coefficient_errors
from designer.circuit.netlist import Circuit, Excitation
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.piecewise_linear import Drive
from designer.model.clearance import Sides
from designer.schematic.kicad_project import files
from designer.spice import deck, numerics_gate
from designer.spice.deck import SolverSettings
from designer.spice.pool import SpicePool
from designer.spice.read_orbit import Read
from designer.spice.worker import open_simulator
from tests.schematic.test_kicad_cli import same, spice
from tests.shared.chains import TWO_GAPS, chain, chain_circuit
from tests.shared.exact_circuits import Scale, exact_values
from tests.shared.kicad_cases import project, written
from tests.shared.stages import bought, model, one_sided, stage
from tests.spice.test_rectifier_ngspice import LOW, SCALED

pytestmark = [pytest.mark.kicad, pytest.mark.slow]

RECTIFIER = stage("rectifier", "both", SCALED)
HALVES = {**{n: v for n, v in SCALED.items() if n != "R50"}, "R50A": 4.64e3, "R50B": 4.64e3}
# One generator feeds both masses: R12/R6 = (1 - f20)/f20 for equal capacitors.
DRIVEN = {**SCALED, "R12": 71.5e3}

CASES: dict[str, tuple[Circuit, Sides, float, Mounting, dict[float, str]]] = {
    "rectifier": (RECTIFIER, "both", 0.0, "mixed",
                  {1.55: "1-1-1", 0.54: "1-3-3", 0.215: "1-8-8"}),
    "one-sided": (stage("saturation", "upper", bought(one_sided())), "upper", 0.0, "mixed",
                  {1.2: "1-1-0"}),
    "one-sided rectifier": (stage("rectifier", "lower", LOW), "lower", 0.0, "mixed",
                            {0.54: "1-0-2"}),
    "f20": (stage("rectifier", "both", DRIVEN, f20=0.2), "both", 0.2, "mixed", {0.85: "1-2-2"}),
    "composites": (stage("rectifier", "both", HALVES, {"R50": "series"}), "both", 0.0, "mixed",
                   {1.55: "1-1-1"}),
    "through-hole": (RECTIFIER, "both", 0.0, "tht", {1.55: "1-1-1"}),
    "surface": (RECTIFIER, "both", 0.0, "smd", {1.55: "1-1-1"}),
}  # fmt: skip
"""Circuit, its stops, f20, mounting, and the response by drive frequency."""


def subject(circuit: Circuit, sides: Sides, f20: float, omega: float) -> numerics_gate.GateSubject:
    """The nominal board at omega, started on the model's own orbit."""
    wanted = model(sides, f20).second_order()
    errors = coefficient_errors(circuit, wanted)
    orbit = settle(Flow(wanted.piecewise_linear(), Drive(omega)), np.zeros(4))
    excitation = Excitation(errors.scales.frequency(omega), 1.0 / errors.drive_gain[0])
    reduction = Reduction(circuit, nominal_board(circuit))
    flow = Flow(reduction.system(), excitation.drive)
    return numerics_gate.GateSubject(
        reduction, excitation, settle(flow, orbit.start * errors.scales.volts)
    )


@pytest.mark.parametrize("name", CASES)
def test_kicads_own_deck_shows_the_same_responses(name: str, tmp_path: Path) -> None:
    """The n-p-q of the exact circuit and of our own deck, at the settings that pass the gate."""
    circuit, sides, f20, mounting, wanted = CASES[name]
    asked = [subject(circuit, sides, f20, omega) for omega in wanted]
    assert [s.orbit.response for s in asked] == list(wanted.values())
    jobs = []
    with SpicePool(1) as pool:
        for i, (each, result) in enumerate(
            zip(asked, numerics_gate.check(pool, asked), strict=True)
        ):
            assert result.passed
            own = numerics_gate.job(each, result.settings)
            run = FirstRun(each.excitation, result.settings, own.stop, each.orbit.start)
            sheet = replace(project(circuit, mounting), run=run)
            folder = written(files(sheet), tmp_path / str(i))
            theirs_text = spice(folder)
            jobs += [own, replace(own, netlist=theirs_text)]
        found = dict(pool.map(jobs))
    for i, each in enumerate(asked):
        ours, theirs = found[2 * i], found[2 * i + 1]
        assert isinstance(ours, Read)
        assert isinstance(theirs, Read), theirs
        assert theirs.orbit.response == ours.orbit.response == each.orbit.response
        same(ours.orbit, theirs.orbit)


def test_kicads_deck_of_a_chain_shows_the_same_waves(tmp_path: Path) -> None:
    """Three masses, a clearance to ground and one between masses: every state and both outputs of
    the dead zones, from rest, in KiCad's netlist and in ours."""
    mechanism = chain(3, *TWO_GAPS)
    values = exact_values(mechanism.second_order(), Scale(1e-3, np.full(6, 1.5), 4.0))
    circuit = chain_circuit(mechanism, "rectifier", values=bought(values))
    omega, stop = 1.0, 40e-3
    run = FirstRun(
        Excitation(omega / (2e-3 * np.pi), 9.0), SolverSettings("trap", 5e-6), stop, np.zeros(6)
    )
    own = deck.write(
        circuit, nominal_board(circuit), run.excitation, run.settings,
        title="ours", stop_time=stop, initial=run.initial,
    )  # fmt: skip
    theirs = spice(written(files(replace(project(circuit), run=run)), tmp_path))
    assert len(circuit.outputs) == 8
    waves = [open_simulator("batch").run(text, circuit.outputs, stop) for text in (own, theirs)]
    steps = np.linspace(0.0, stop, 500)
    for net in circuit.outputs:
        ours, other = (np.interp(steps, w.axis, w.signals[net].real) for w in waves)
        assert np.ptp(ours) > 0.1, f"{net} moves"
        np.testing.assert_allclose(ours, other, atol=2e-3 * float(np.ptp(ours)))
