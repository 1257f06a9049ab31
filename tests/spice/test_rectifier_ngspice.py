"""The rectifier in ngspice against its exact reduction, in sizes that use the op-amps' swing."""

from __future__ import annotations

import numpy as np
import pytest

from designer.catalog.netlist_guard import check_netlist
from designer.circuit.board_values import Board, nominal_board
from designer.circuit.coefficients import coefficient_errors
from designer.circuit.netlist import Circuit, Excitation
from designer.circuit.reduction import Reduction
from designer.dynamics.attractors import settle
from designer.dynamics.flow import Flow
from designer.dynamics.orbit import OrbitStatus
from designer.dynamics.piecewise_linear import Drive
from designer.model.clearance import Sides
from designer.spice import deck, numerics_gate
from designer.spice.deck import SolverSettings
from designer.spice.worker import open_simulator
from designer.spread.spread import Spread, draw
from tests.shared.stages import model, stage

SCALED: dict[str, float] = {
    "R1": 27e3, "R2": 220e3, "R3": 220e3, "R4": 71.5e3, "R5": 71.5e3, "R6": 17.8e3,
    "R7": 27e3, "R8": 220e3, "R9": 110e3, "R10": 71.5e3, "R11": 35.7e3,
    **{f"C{i}": 10e-9 for i in range(1, 5)}, **{f"R{i}": 10e3 for i in range(100, 108)},
    "R50": 9.31e3, "R200": 10e3, "R201": 10e3, "R202": 24.9e3, "R203": 10e3, "R204": 10e3,
    "R205": 24.9e3, "R206": 2.2e3, "R207": 2.2e3, "R208": 10e3, "R209": 10e3,
}  # fmt: skip
# With one stop M1 swings far on the other side: a threshold of 1 V leaves room for that.
LOW = {**SCALED, "R201": 49.9e3, "R204": 49.9e3}
BENCH = Spread(0.01, 0.01, 3e-3, 10e-3)


def subject(
    circuit: Circuit, board: Board, sides: Sides, omega: float
) -> numerics_gate.GateSubject:
    """The response of this board at omega, started on the model's own orbit."""
    wanted = model(sides).second_order()
    errors = coefficient_errors(circuit, wanted)
    orbit = settle(Flow(wanted.piecewise_linear(), Drive(omega)), np.zeros(4))
    excitation = Excitation(errors.scales.frequency(omega), 1.0 / errors.drive_gain[0])
    reduction = Reduction(circuit, board)
    flow = Flow(reduction.system(), excitation.drive)
    return numerics_gate.GateSubject(
        reduction, excitation, settle(flow, orbit.start * errors.scales.volts)
    )


@pytest.mark.parametrize(
    ("sides", "omega", "response", "steps"),
    [("both", 1.55, "1-1-1", 1000), ("both", 0.54, "1-3-3", 2000), ("both", 0.215, "1-8-8", 8000),
     ("upper", 1.2, "1-1-0", 1000), ("lower", 1.2, "1-0-1", 1000), ("upper", 0.41, "1-3-0", 2000),
     ("lower", 0.54, "1-0-2", 2000)],
)  # fmt: skip
def test_ngspice_shows_what_the_exact_reduction_says(
    sides: Sides, omega: float, response: str, steps: int
) -> None:
    """Every state over four periods within 2e-3 of its peak, and the same n-p-q."""
    circuit = stage("rectifier", sides, SCALED if sides == "both" else LOW)
    asked = subject(circuit, nominal_board(circuit), sides, omega)
    assert asked.orbit.response == response
    job = numerics_gate.job(asked, SolverSettings("trap", asked.period / steps), whole=True)
    waves = open_simulator("shared").run(job.netlist, job.signals, job.stop)
    assert job.reduce(waves).orbit.response == response
    points = 100
    exact = Flow(asked.system, asked.excitation.drive).run(
        asked.orbit.start, 4, mode=asked.orbit.mode, points=points
    ).strobes  # fmt: skip
    grid = np.arange(len(exact)) * asked.period / points
    u = -asked.excitation.amplitude * np.sin(2.0 * np.pi * grid / asked.period)
    for net in circuit.state_nets:
        want = asked.reduction.output(circuit.rest, net, exact, u)
        got = np.interp(grid, waves.axis, waves.signals[net])
        assert np.abs(got - want)[1:].max() < 2e-3 * np.abs(want).max(), net


@pytest.mark.parametrize("index", range(4))
@pytest.mark.parametrize("method", ["trap", "gear"])
def test_boards_converge_at_coarse_steps_too(index: int, method: str) -> None:
    """Offsets, references off by their grade: ngspice starts and ends near the exact state."""
    circuit = stage("rectifier", "both", SCALED)
    asked = subject(circuit, draw(circuit, BENCH, 3, index), "both", 0.54)
    assert asked.orbit.status is OrbitStatus.PERIODIC
    text = deck.write(
        circuit, asked.board, asked.excitation, SolverSettings(method, asked.period / 400),
        title="a board", stop_time=asked.period, initial=asked.orbit.start,
    )  # fmt: skip
    waves = open_simulator("shared").run(text, circuit.state_nets, asked.period)
    last = np.array([waves.signals[net][-1] for net in circuit.state_nets]) - asked.shift
    peak = np.abs(asked.orbit.extremes).max(axis=1)
    assert (np.abs(last - asked.orbit.start) < 0.02 * peak).all()


def test_discharged_start() -> None:
    circuit = stage("rectifier", "both", SCALED)
    text = deck.write(
        circuit, nominal_board(circuit), Excitation(400.0, 5.0), SolverSettings("trap", 2e-6),
        title="from rest", stop_time=1 / 400, initial=None,
    )  # fmt: skip
    waves = open_simulator("shared").run(text, ("v1", "fv"), 1 / 400)
    assert abs(waves.signals["v1"][0]) < 1e-3
    assert np.abs(waves.signals["v1"]).max() > 1.0


def test_the_deck_holds_every_part_and_its_sources() -> None:
    circuit = stage("rectifier", "both", SCALED)
    board = draw(circuit, BENCH, 3, 0)
    text = deck.write(
        circuit, board, Excitation(400.0, 5.0), SolverSettings("trap", 2e-6),
        title="parts", stop_time=1e-3,
    )  # fmt: skip
    check_netlist(text)
    lines = {line.split()[0]: line.split() for line in text.splitlines() if line[0].isalpha()}
    for part in circuit.parts:
        assert part.name in lines or f"X{part.name}" in lines
    assert lines["VCC"] == ["VCC", "vcc", "0", "15.0"]
    assert lines["VEE"] == ["VEE", "vee", "0", "-15.0"]
    assert lines["VR1"][1:3] == ["vrp", "0"]
    assert float(lines["VR1"][3]) == board.reference["VR1"]
    assert lines["VR2"][1:3] == ["0", "vrn"]
    assert lines["D200"] == ["D200", "w1", "fv", "diode0"]
    assert lines["D203"] == ["D203", "c2", "d2", "diode0"]
    assert text.count(".model diode0 d(") == 1


def test_the_deck_of_the_saturating_stage_has_no_supplies() -> None:
    from tests.circuit.test_reduction import EXACT, circuit_of

    circuit = circuit_of(EXACT)
    assert circuit.supplies == ()
    text = deck.write(
        circuit, nominal_board(circuit), Excitation(400.0, 1.0), SolverSettings("trap", 2e-6),
        title="parts", stop_time=1e-3,
    )  # fmt: skip
    assert "VCC" not in text
    assert " diode" not in text
